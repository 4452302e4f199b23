//! The frames of a motion, and positions between them.

use std::path::{Path, PathBuf};

use nearmiss::TriangleMesh;
use nearmiss::io::{Pieces, read_in_pieces};

use crate::console::Console;
use crate::error::CliError;
use crate::input;

/// The number of bytes that are read at once.
const BLOCK: usize = 1 << 20;

/// The frames of a mesh or scan, a second apart.
#[derive(Debug)]
pub(super) struct Frames {
    paths: Vec<PathBuf>,
    positions: Vec<Vec<[f64; 3]>>,
    /// The triangles of a mesh.
    pub(super) triangles: Option<Vec<[u32; 3]>>,
}

impl Frames {
    /// Reads all frames. Fails if their counts differ.
    pub(super) fn read(paths: &[PathBuf], console: Console) -> Result<Self, CliError> {
        let bar = console.steps("reading frames", paths.len() as u64);
        let mut frames = Self { paths: paths.to_vec(), positions: Vec::new(), triangles: None };
        for path in paths {
            let (positions, mesh) = read(path)?;
            let what = if frames.triangles.is_some() { "vertices" } else { "points" };
            if let Some(first) = frames.positions.first() {
                let (expected, got) = (first.len(), positions.len());
                if expected != got {
                    let what = format!(
                        "expected {expected} {what}, as in {}, got {got}; give frames of one motion",
                        paths[0].display()
                    );
                    return Err(CliError::UnsuitableFile { path: path.clone(), what });
                }
                if mesh.as_ref().is_some_and(|mesh| Some(mesh.triangles()) != frames.triangles.as_deref()) {
                    let what = format!(
                        "expected the faces of {}, got others; give frames of one mesh, whose faces stay",
                        paths[0].display()
                    );
                    return Err(CliError::UnsuitableFile { path: path.clone(), what });
                }
            } else {
                frames.triangles = mesh.map(|mesh| mesh.triangles().to_vec());
            }
            frames.positions.push(positions);
            bar.advance(1);
        }
        Ok(frames)
    }

    /// Returns the number of frames.
    pub(super) fn len(&self) -> usize {
        self.positions.len()
    }

    /// Returns the time of frame `i`.
    #[expect(clippy::cast_precision_loss, clippy::unused_self, reason = "a number of files")]
    pub(super) fn time(&self, i: usize) -> f64 {
        i as f64
    }

    /// Returns the time of the last frame.
    pub(super) fn last(&self) -> f64 {
        self.time(self.len() - 1)
    }

    /// Returns the places of a vertex in all frames.
    pub(super) fn places(&self, vertex: usize) -> Vec<[f64; 3]> {
        self.positions.iter().map(|frame| frame[vertex]).collect()
    }

    /// Returns the path and the positions of the first frame.
    pub(super) fn first(&self) -> (&Path, &[[f64; 3]]) {
        (&self.paths[0], &self.positions[0])
    }

    /// Sets `positions` to those at time `t`, between those of the frames before and after it.
    pub(super) fn at(&self, t: f64, positions: &mut Vec<[f64; 3]>) {
        let (before, share) = self.before(t);
        let after = &self.positions[(before + 1).min(self.len() - 1)];
        let between = |(p, q): (&[f64; 3], &[f64; 3])| {
            // Exact at either end.
            [0, 1, 2].map(|k| if share > 0.0 { p[k] * (1.0 - share) + q[k] * share } else { p[k] })
        };
        positions.clear();
        positions.extend(self.positions[before].iter().zip(after).map(between));
    }

    /// Returns the error about positions at time `t`, which names the frame before.
    pub(super) fn fault(&self, t: f64, cause: &nearmiss::DeformError) -> CliError {
        CliError::UnsuitableFile { path: self.paths[self.before(t).0].clone(), what: cause.to_string() }
    }

    /// Returns the frame before time `t`, and the share of the way to the next.
    fn before(&self, t: f64) -> (usize, f64) {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within the frames")]
        let before = (t.max(0.0) as usize).min(self.len() - 1);
        (before, t - t.floor())
    }
}

/// Reads the positions of a file in its order, and its faces if it has any.
fn read(path: &Path) -> Result<(Vec<[f64; 3]>, Option<TriangleMesh>), CliError> {
    input::check_raw(path)?;
    let _limit = input::limit_reading(path, None);
    match read_in_pieces(path, None, BLOCK)? {
        Pieces::Mesh { vertices, mesh } => Ok((vertices.positions, Some(mesh))),
        Pieces::Points(pieces) => {
            let mut positions = Vec::new();
            pieces.each(|points| positions.extend_from_slice(&points.positions))?;
            Ok((positions, None))
        }
    }
}
