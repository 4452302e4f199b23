//! Recognition of file formats: by the magic number, then by the name, then by the first line.

use std::path::Path;

use crate::error::{Foreign, ReadError};
use crate::format::Format;
use crate::text::{Lines, number, words};
use crate::{npy, off, stl};

/// Recognises the format of a file of this length from its first 64 KiB and its name. Fails for
/// known formats that cannot be read.
pub(crate) fn recognise(bytes: &[u8], length: u64, name: &Path) -> Result<Format, ReadError> {
    let unsupported = |format| ReadError::Unsupported { path: name.into(), format };
    let ending = name.extension().and_then(|e| e.to_str()).unwrap_or_default();
    if let Some(foreign) = foreign_magic(bytes) {
        return Err(unsupported(foreign));
    }
    if let Some(format) = magic(bytes, length) {
        return Ok(format);
    }
    ending.parse().ok().or_else(|| look(bytes)).ok_or_else(|| ReadError::UnknownFormat { path: name.into() })
}

fn magic(bytes: &[u8], length: u64) -> Option<Format> {
    let is_ply = bytes.strip_prefix(b"ply").and_then(<[u8]>::first);
    if is_ply.is_some_and(u8::is_ascii_whitespace) {
        return Some(Format::Ply);
    }
    let binary: [(&[u8], Format); 4] = [
        (b"LASF", Format::Las),
        (b"ASTM-E57", Format::E57),
        (npy::MAGIC, Format::Npy),
        (b"glTF", Format::Gltf),
    ];
    if let Some((_, format)) = binary.into_iter().find(|(magic, _)| bytes.starts_with(magic)) {
        return Some(format);
    }
    if stl::is_text(bytes) || stl::is_binary(bytes, length) {
        return Some(Format::Stl);
    }
    if bytes.starts_with(b"{") {
        return bytes.windows(7).take(4096).any(|word| word == b"\"asset\"").then_some(Format::Gltf);
    }
    let first = first_word(bytes).unwrap_or_default();
    if off::is_header(first) {
        return Some(Format::Off);
    }
    let is_pcd = bytes.starts_with(b"# .PCD") || matches!(first, b"VERSION" | b"FIELDS");
    is_pcd.then_some(Format::Pcd)
}

fn foreign_magic(bytes: &[u8]) -> Option<Foreign> {
    match bytes {
        [0x1f, 0x8b, ..] => Some(Foreign::Gzip),
        [b'P', b'K', 3, 4, ..] => Some(Foreign::Zip),
        [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => Some(Foreign::Utf16),
        _ => None,
    }
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

/// Returns the first word outside comments, if it is within the first 64 KiB.
fn first_word(bytes: &[u8]) -> Option<&[u8]> {
    /// Number of bytes searched: more than any licence text at the start of a file.
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
        assert_eq!(of(b"LASF\0\0", "a.ply"), Ok(Format::Las));
        assert_eq!(of(b"# made by me\nVERSION .7\n", "a"), Ok(Format::Pcd));
        assert_eq!(of(b"plywood", "a.OBJ"), Ok(Format::Obj));
        assert_eq!(of(b"1 2 3", "a.ply"), Ok(Format::Ply), "then the name");
        assert_eq!(of(b"# points\n1,2,3", "scan.dat"), Ok(Format::Xyz), "then the look");
        assert_eq!(of(b"\n-1e3;2;3", "scan"), Ok(Format::Xyz), "then the look");
        assert_eq!(of(b"# mesh\nv 1 2 3", "mesh"), Ok(Format::Obj), "then the look");
    }

    #[test]
    fn formats_show_in_their_first_bytes() {
        let mut stl = vec![b' '; 80];
        stl.extend(1_u32.to_le_bytes());
        stl.resize(134, 0);
        for (bytes, format) in [
            (&b"ASTM-E57\x01"[..], Format::E57),
            (b"glTF\x02", Format::Gltf),
            (b"{\"asset\":1}", Format::Gltf),
            (b"solid x\nfacet normal 0 0 1", Format::Stl),
            (&stl, Format::Stl),
            (b"OFF\n8 6 0\n", Format::Off),
            (b"# cube\nCOFF 8 6 0\n", Format::Off),
            (b"\x93NUMPY\x01\x00", Format::Npy),
        ] {
            assert_eq!(of(bytes, "a.xyz"), Ok(format));
        }
        for (name, format) in [("a.laz", Format::Las), ("a.GLB", Format::Gltf), ("a.npy", Format::Npy)] {
            assert_eq!(of(b"whatever", name), Ok(format), "then the name");
        }
    }

    #[test]
    fn what_cannot_be_read_is_named() {
        for (bytes, name, word) in [
            (&[0x1f, 0x8b, 8][..], "a.ply.gz", "gzip"),
            (b"\xff\xfe1\0", "a.csv", "UTF-16"),
            (b"PK\x03\x04", "a", "zip"),
        ] {
            let message = of(bytes, name).unwrap_err();
            assert!(message.starts_with(name) && message.contains(word), "{word}: {message}");
        }
        let message = of(b"?ASF", "a.bin").unwrap_err();
        assert!(message.contains("unknown format") && message.contains("--format"), "{message}");
    }

    #[test]
    fn names_of_formats_go_both_ways() {
        for format in Format::ALL {
            assert_eq!(format.to_string().parse(), Ok(format));
        }
        assert_eq!("CSV".parse(), Ok(Format::Xyz));
        let unknown = "rcp".parse::<Format>().unwrap_err();
        assert!(unknown.to_string().contains("`rcp`"), "{unknown}");
    }
}
