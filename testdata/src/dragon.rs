//! The Stanford Dragon in two resolutions, as files and as meshes.
//!
//! Source and terms of use: `testdata/data/STANFORD-TERMS.md`.

use std::io::{Error, ErrorKind, Result};
use std::path::{Path, PathBuf};

use nearmiss_geometry::TriangleMesh;

/// The resolution.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dragon {
    /// 5,205 points, 11,102 triangles.
    Points5k,
    /// 22,998 points, 47,794 triangles.
    Points23k,
}

impl Dragon {
    const fn counts(self) -> (usize, usize) {
        match self {
            Self::Points5k => (5_205, 11_102),
            Self::Points23k => (22_998, 47_794),
        }
    }
}

/// Returns the path of the file: binary little-endian PLY, `f32` vertices, faces as lists of three
/// `i32`. The dragon is about 0.2 units high.
///
/// The path is in the source tree from which this crate was compiled.
#[must_use]
pub fn dragon_path(which: Dragon) -> PathBuf {
    let name = match which {
        Dragon::Points5k => "dragon-5k.ply",
        Dragon::Points23k => "dragon-23k.ply",
    };
    Path::new(env!("CARGO_MANIFEST_DIR")).join("data").join(name)
}

/// Returns the file's vertices and triangles, read without any other crate. Supports this layout
/// only.
///
/// # Errors
/// If the file cannot be read or is not the one of this crate.
pub fn dragon_mesh(which: Dragon) -> Result<TriangleMesh> {
    const END: &[u8] = b"end_header\n";
    let bytes = std::fs::read(dragon_path(which))?;
    let damaged = || Error::new(ErrorKind::InvalidData, "not the dragon this crate ships");
    let header = bytes.windows(END.len()).position(|w| w == END).ok_or_else(damaged)?;
    let body = &bytes[header + END.len()..];
    let (vertices, faces) = which.counts();
    if body.len() != 12 * vertices + 13 * faces {
        return Err(damaged());
    }
    let (body, faces) = body.split_at(12 * vertices);
    let word = |b: &[u8], k: usize| [b[4 * k], b[4 * k + 1], b[4 * k + 2], b[4 * k + 3]];
    let vertices =
        body.chunks_exact(12).map(|b| [0, 1, 2].map(|k| f64::from(f32::from_le_bytes(word(b, k)))));
    let triangles = faces.chunks_exact(13).map(|b| [0, 1, 2].map(|k| u32::from_le_bytes(word(&b[1..], k))));
    TriangleMesh::new(vertices.collect(), triangles.collect()).map_err(Error::other)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_files_are_whole() {
        for (which, least_y, greatest_y) in
            [(Dragon::Points5k, 0.0528, 0.1963), (Dragon::Points23k, 0.0528, 0.1975)]
        {
            let mesh = dragon_mesh(which).unwrap();
            let (vertices, triangles) = which.counts();
            assert_eq!(mesh.vertices().len(), vertices, "{which:?}");
            assert_eq!(mesh.triangles().len(), triangles, "{which:?}");
            let ys = mesh.vertices().iter().map(|p| p[1]);
            let (min, max) = ys.fold((f64::MAX, f64::MIN), |(lo, hi), y| (lo.min(y), hi.max(y)));
            assert!((min - least_y).abs() < 1e-3 && (max - greatest_y).abs() < 1e-3, "{min} {max}");
            assert!(std::fs::metadata(dragon_path(which)).unwrap().len() < 1_200_000, "small enough to ship");
        }
    }
}
