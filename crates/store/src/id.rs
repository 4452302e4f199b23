//! `SectionId`: the name of a section.

use std::fmt;

/// The name of a section: a tag of four bytes, and a number for each of several sections with one
/// tag.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SectionId {
    /// The tag, by convention four upper-case ASCII letters. `META` is reserved.
    pub tag: [u8; 4],
    /// The number among the sections with this tag; 0 for a single section.
    pub part: u32,
}

impl SectionId {
    /// The metadata section.
    pub(crate) const META: Self = Self { tag: *b"META", part: 0 };
}

impl fmt::Display for SectionId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.tag.escape_ascii(), self.part)
    }
}
