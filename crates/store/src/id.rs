//! The names of sections.

use std::fmt;

/// Names a section: four bytes that say what it is, and a number that tells several of a kind apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SectionId {
    /// What the section holds, by custom four upper-case ASCII letters. `META` is taken.
    pub tag: [u8; 4],
    /// Which of several sections with one tag; 0 where there is one.
    pub part: u32,
}

impl SectionId {
    /// The one metadata section.
    pub(crate) const META: Self = Self { tag: *b"META", part: 0 };
}

impl fmt::Display for SectionId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.tag.escape_ascii(), self.part)
    }
}
