//! The formats that can be read, and their names.

use std::fmt;
use std::str::FromStr;

use thiserror::Error;

/// A format that can be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Format {
    /// Polygon File Format: ascii or binary in either byte order, with or without faces.
    Ply,
    /// Point Cloud Data, the format of the Point Cloud Library: ascii, binary or compressed.
    Pcd,
    /// Text with one point per line and values separated by white space, commas or semicolons;
    /// includes CSV.
    Xyz,
    /// Wavefront OBJ.
    Obj,
    /// ASPRS LAS 1.0 to 1.4, including LAZ and COPC, which are compressed by laszip.
    Las,
    /// ASTM E57.
    E57,
    /// NumPy arrays of N × 3 numbers.
    Npy,
    /// Stereolithography, binary or text.
    Stl,
    /// Object File Format of Geomview, text only.
    Off,
    /// glTF 2.0, text or binary.
    Gltf,
}

impl Format {
    /// All formats.
    pub const ALL: [Self; 10] = [
        Self::Ply,
        Self::Pcd,
        Self::Xyz,
        Self::Obj,
        Self::Las,
        Self::E57,
        Self::Npy,
        Self::Stl,
        Self::Off,
        Self::Gltf,
    ];

    /// Returns the name of the format, followed by the other file extensions that it has.
    #[must_use]
    pub const fn names(self) -> &'static [&'static str] {
        match self {
            Self::Ply => &["ply"],
            Self::Pcd => &["pcd"],
            Self::Xyz => &["xyz", "csv", "txt", "asc", "pts", "xyzn", "xyzrgb", "3d", "neu"],
            Self::Obj => &["obj"],
            Self::Las => &["las", "laz"],
            Self::E57 => &["e57"],
            Self::Npy => &["npy"],
            Self::Stl => &["stl"],
            Self::Off => &["off"],
            Self::Gltf => &["gltf", "glb"],
        }
    }

    /// Returns a list of all names in words: `a, b (also c) or d`.
    #[must_use]
    pub fn list() -> String {
        let named = Self::ALL.map(|format| match format.names() {
            [name] => (*name).to_owned(),
            [name, last] => format!("{name} (also {last})"),
            [name, others @ .., last] => format!("{name} (also {} or {last})", others.join(", ")),
            [] => String::new(),
        });
        let [first @ .., last] = &named;
        format!("{} or {last}", first.join(", "))
    }

    /// Returns `true` if every file of this format can be read from disk in pieces. Such a format
    /// has no reader for bytes in memory.
    pub(crate) const fn is_streamed(self) -> bool {
        matches!(self, Self::Las | Self::E57)
    }
}

/// Error of parsing a [`Format`] from an unknown name.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("expected {}, got `{given}`", Format::list())]
pub struct UnknownFormatName {
    /// The given name.
    pub given: String,
}

impl FromStr for Format {
    type Err = UnknownFormatName;

    fn from_str(name: &str) -> Result<Self, UnknownFormatName> {
        let is_named = |format: &Self| format.names().iter().any(|known| name.eq_ignore_ascii_case(known));
        Self::ALL.into_iter().find(is_named).ok_or_else(|| UnknownFormatName { given: name.into() })
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.names()[0])
    }
}
