//! Which format a file has: by its magic, then by its name, then by the look of its first line.

use std::fmt;
use std::path::Path;
use std::str::FromStr;

use thiserror::Error;

use crate::error::{Foreign, ReadError};
use crate::text::{Lines, number, words};

/// A format that can be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Format {
    /// Polygon File Format: ascii or binary, either byte order, with or without faces.
    Ply,
    /// Point Cloud Data of the Point Cloud Library: ascii, binary or compressed.
    Pcd,
    /// Points as lines of text, separated by white space, commas or semicolons; CSV among them.
    Xyz,
    /// Wavefront OBJ.
    Obj,
}

/// Not the name of a format that can be read.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("unknown format `{given}`; known are ply, pcd, xyz (also csv) and obj")]
pub struct UnknownFormatName {
    /// What was given.
    pub given: String,
}

impl FromStr for Format {
    type Err = UnknownFormatName;

    fn from_str(name: &str) -> Result<Self, UnknownFormatName> {
        match name.to_ascii_lowercase().as_str() {
            "ply" => Ok(Self::Ply),
            "pcd" => Ok(Self::Pcd),
            "xyz" | "csv" => Ok(Self::Xyz),
            "obj" => Ok(Self::Obj),
            _ => Err(UnknownFormatName { given: name.into() }),
        }
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Ply => "ply",
            Self::Pcd => "pcd",
            Self::Xyz => "xyz",
            Self::Obj => "obj",
        })
    }
}

/// Endings of names of text files that hold points and nothing else.
const TEXT_ENDINGS: [&str; 9] = ["xyz", "csv", "txt", "asc", "pts", "xyzn", "xyzrgb", "3d", "neu"];

/// The format of a file of this length from its start, 64 KiB unless it is shorter; refuses those that are
/// known but cannot be read.
pub(crate) fn recognise(bytes: &[u8], length: u64, name: &Path) -> Result<Format, ReadError> {
    let unsupported = |format| ReadError::Unsupported { path: name.into(), format };
    let ending = name.extension().and_then(|e| e.to_str()).unwrap_or_default();
    let ending = ending.to_ascii_lowercase();
    if let Some(foreign) = foreign_magic(bytes, length) {
        return Err(unsupported(foreign));
    }
    if let Some(format) = magic(bytes) {
        return Ok(format);
    }
    if let Some(foreign) = foreign_ending(&ending) {
        return Err(unsupported(foreign));
    }
    if TEXT_ENDINGS.contains(&ending.as_str()) {
        return Ok(Format::Xyz);
    }
    ending.parse().ok().or_else(|| look(bytes)).ok_or_else(|| ReadError::UnknownFormat { path: name.into() })
}

fn magic(bytes: &[u8]) -> Option<Format> {
    let is_ply = bytes.strip_prefix(b"ply").and_then(<[u8]>::first);
    if is_ply.is_some_and(u8::is_ascii_whitespace) {
        return Some(Format::Ply);
    }
    let is_pcd = bytes.starts_with(b"# .PCD") || matches!(first_word(bytes)?, b"VERSION" | b"FIELDS");
    is_pcd.then_some(Format::Pcd)
}

fn foreign_magic(bytes: &[u8], length: u64) -> Option<Foreign> {
    // Of the byte that holds the point format, laszip sets the highest bit.
    let is_laz = bytes.get(104).is_some_and(|format| format & 0x80 != 0);
    let is_ascii_stl = || {
        let start = bytes[..bytes.len().min(1024)].trim_ascii_start();
        start.starts_with(b"solid") && start.windows(5).any(|w| w == b"facet")
    };
    match bytes {
        [b'L', b'A', b'S', b'F', ..] if is_laz => Some(Foreign::Laz),
        [b'L', b'A', b'S', b'F', ..] => Some(Foreign::Las),
        [b'g', b'l', b'T', b'F', ..] => Some(Foreign::Gltf),
        [0x1f, 0x8b, ..] => Some(Foreign::Gzip),
        [b'P', b'K', 3, 4, ..] => Some(Foreign::Zip),
        [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => Some(Foreign::Utf16),
        _ if bytes.starts_with(b"ASTM-E57") => Some(Foreign::E57),
        _ if is_ascii_stl() || is_binary_stl(bytes, length) => Some(Foreign::Stl),
        _ if matches!(first_word(bytes)?, b"OFF" | b"COFF" | b"NOFF" | b"STOFF") => Some(Foreign::Off),
        _ => None,
    }
}

/// Binary STL has no magic, but its length follows from a count: a header of 80 bytes, then 50 a triangle.
fn is_binary_stl(bytes: &[u8], length: u64) -> bool {
    let count = bytes.get(80..84).and_then(<[u8]>::first_chunk);
    let promised = count.map(|count| 84 + 50 * u64::from(u32::from_le_bytes(*count)));
    promised == Some(length)
}

fn foreign_ending(ending: &str) -> Option<Foreign> {
    Some(match ending {
        "las" => Foreign::Las,
        "laz" => Foreign::Laz,
        "e57" => Foreign::E57,
        "stl" => Foreign::Stl,
        "gltf" | "glb" => Foreign::Gltf,
        "off" => Foreign::Off,
        _ => return None,
    })
}

fn look(bytes: &[u8]) -> Option<Format> {
    match first_word(bytes)? {
        b"v" | b"vn" | b"o" | b"g" | b"mtllib" => Some(Format::Obj),
        word => {
            let start = word.split(|b| matches!(b, b',' | b';')).next()?;
            number(start).map(|_| Format::Xyz)
        }
    }
}

/// The first word that is not in a comment; none if the file starts with very much else.
fn first_word(bytes: &[u8]) -> Option<&[u8]> {
    /// Bytes looked at: more than any licence text at the head of a file.
    const START: usize = 1 << 16;
    let mut lines = Lines::new(&bytes[..bytes.len().min(START)]);
    let line = lines.find(|line| {
        let text = line.text.trim_ascii_start();
        !text.is_empty() && !text.starts_with(b"#") && !text.starts_with(b"//")
    })?;
    words(line.text).next()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(bytes: &[u8], name: &str) -> Result<Format, String> {
        recognise(bytes, bytes.len() as u64, Path::new(name)).map_err(|e| e.to_string())
    }

    #[test]
    fn content_goes_before_name() {
        assert_eq!(of(b"ply\nformat", "a.xyz"), Ok(Format::Ply));
        assert_eq!(of(b"ply\r\n", "a"), Ok(Format::Ply));
        assert_eq!(of(b"# .PCD v0.7", "a.ply"), Ok(Format::Pcd));
        assert_eq!(of(b"# made by me\nVERSION .7\n", "a"), Ok(Format::Pcd));
        assert_eq!(of(b"plywood", "a.OBJ"), Ok(Format::Obj));
        assert_eq!(of(b"1 2 3", "a.ply"), Ok(Format::Ply), "then the name");
        assert_eq!(of(b"# points\n1,2,3", "scan.dat"), Ok(Format::Xyz), "then the look");
        assert_eq!(of(b"\n-1e3;2;3", "scan"), Ok(Format::Xyz), "then the look");
        assert_eq!(of(b"# mesh\nv 1 2 3", "mesh"), Ok(Format::Obj), "then the look");
    }

    #[test]
    fn what_cannot_be_read_is_named() {
        let mut las = *b"LASF";
        let mut stl = vec![b' '; 80];
        stl.extend(1_u32.to_le_bytes());
        stl.resize(134, 0);
        for (bytes, name, word) in [
            (&las[..], "a.ply", "LAS"),
            (b"ASTM-E57\x01", "a", "E57"),
            (b"glTF\x02", "a", "glTF"),
            (b"{\"asset\":1}", "a.gltf", "glTF"),
            (b"solid x\nfacet normal 0 0 1", "a.txt", "STL"),
            (&stl, "a", "STL"),
            (b"OFF\n8 6 0\n", "a.obj", "OFF"),
            (&[0x1f, 0x8b, 8], "a.ply.gz", "gzip"),
            (b"\xff\xfe1\0", "a.csv", "UTF-16"),
            (b"whatever", "a.laz", "LAZ"),
        ] {
            let message = of(bytes, name).unwrap_err();
            assert!(message.starts_with(name) && message.contains(word), "{word}: {message}");
        }
        las[0] = b'?';
        let message = of(&las, "a.bin").unwrap_err();
        assert!(message.contains("unknown format") && message.contains("--format"), "{message}");
    }

    #[test]
    fn names_of_formats_go_both_ways() {
        for format in [Format::Ply, Format::Pcd, Format::Xyz, Format::Obj] {
            assert_eq!(format.to_string().parse(), Ok(format));
        }
        assert_eq!("CSV".parse(), Ok(Format::Xyz));
        let unknown = "e57".parse::<Format>().unwrap_err();
        assert!(unknown.to_string().contains("`e57`"), "{unknown}");
    }
}
