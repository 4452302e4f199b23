//! A guess at the format of a file that is not a container, so that the error can name a remedy.

use std::fmt;

/// The likely format of a file that is not a container, guessed from its first bytes. For messages
/// only.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Looks {
    /// Stanford PLY file.
    Ply,
    /// Point Cloud Library file.
    Pcd,
    /// LAS or LAZ.
    Las,
    /// ASTM E57.
    E57,
    /// Binary glTF.
    Gltf,
    /// STL in text form.
    Stl,
    /// PNG image.
    Png,
    /// gzip stream.
    Gzip,
    /// zip archive.
    Zip,
    /// Printable text of some kind, such as XYZ, CSV or OBJ.
    Text,
    /// A container whose line ends were translated in transfer.
    LineEnds,
    /// Zero bytes only, as left by a crash or an unfinished copy.
    Zeros,
    /// None of the above.
    Unknown,
}

/// First bytes and their formats. The first match counts.
const STARTS: [(&[u8], Looks); 12] = [
    (b"\x8Enmiss", Looks::LineEnds),
    (b"ply\n", Looks::Ply),
    (b"ply\r", Looks::Ply),
    (b"# .PCD", Looks::Pcd),
    (b"VERSION .7", Looks::Pcd),
    (b"LASF", Looks::Las),
    (b"ASTM-E57", Looks::E57),
    (b"glTF", Looks::Gltf),
    (b"solid ", Looks::Stl),
    (b"\x89PNG", Looks::Png),
    (b"\x1F\x8B", Looks::Gzip),
    (b"PK\x03\x04", Looks::Zip),
];

impl Looks {
    /// Guesses the format from the first 64 bytes of a file.
    pub(crate) fn of(head: &[u8]) -> Self {
        let head = &head[..head.len().min(64)];
        if let Some((_, looks)) = STARTS.iter().find(|(start, _)| head.starts_with(start)) {
            return *looks;
        }
        let printable = |byte: &u8| (b' '..=b'~').contains(byte) || b"\t\r\n".contains(byte);
        if head.iter().all(|&byte| byte == 0) {
            Self::Zeros
        } else if head.iter().all(printable) {
            Self::Text
        } else {
            Self::Unknown
        }
    }
}

/// A noun phrase with a remedy that completes "got …".
impl fmt::Display for Looks {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let prepare = "prepare it with `preprocess`";
        match self {
            Self::Ply => write!(f, "a PLY file; {prepare}"),
            Self::Pcd => write!(f, "a PCD file; {prepare}"),
            Self::Las => write!(f, "a LAS or LAZ file; {prepare}"),
            Self::E57 => write!(f, "an E57 file; {prepare}"),
            Self::Gltf => write!(f, "a binary glTF file; {prepare}"),
            Self::Stl => write!(f, "an STL file; {prepare}"),
            Self::Png => f.write_str("a PNG image; name another file"),
            Self::Gzip => f.write_str("a gzip stream; unpack it first"),
            Self::Zip => f.write_str("a zip archive; unpack it first"),
            Self::Text => write!(f, "text; if it holds points, {prepare}"),
            Self::LineEnds => {
                f.write_str("one whose line ends were translated; copy it again in binary mode")
            }
            Self::Zeros => {
                f.write_str("zero bytes, as after an unfinished copy; copy it again or prepare it again")
            }
            Self::Unknown => f.write_str("a file of an unknown format; prepare a scan with `preprocess`"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_starts_are_named() {
        assert_eq!(Looks::of(b"ply\nformat ascii 1.0\n"), Looks::Ply);
        assert_eq!(Looks::of(b"LASF\0\0"), Looks::Las);
        assert_eq!(Looks::of(b"1.0 2.0 3.0\n"), Looks::Text);
        assert_eq!(Looks::of(&[0; 4096]), Looks::Zeros);
        assert_eq!(Looks::of(b"\xFF\xFE\0\0"), Looks::Unknown);
        assert_eq!(Looks::of(b"\x8Enmiss\n"), Looks::LineEnds);
    }
}
