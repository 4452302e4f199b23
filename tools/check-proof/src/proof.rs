//! The output of `nearmiss collide --prove`, read by structs of this checker's own.
//!
//! A number with many digits may be read one unit in the last place off. The checks apply to the
//! numbers as read: poses, gaps and witnesses to 1e-16 of what was written, boxes (single
//! precision) exactly.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

use serde::Deserialize;

use crate::Outcome;

/// An affine map as a row-major 4×4 matrix.
pub(crate) type Matrix = [f64; 16];

/// A line: an answer and its proof. Unknown fields are ignored.
#[derive(Debug, Clone, Deserialize)]
pub(crate) struct Line {
    pub(crate) query: u64,
    pub(crate) placed_a: Matrix,
    pub(crate) placed_b: Matrix,
    pub(crate) margin: f64,
    #[serde(default)]
    pub(crate) semantics: Semantics,
    pub(crate) verdict: Verdict,
    pub(crate) evidence: Option<Evidence>,
    pub(crate) gap: Option<f64>,
    pub(crate) witness: Option<[f64; 3]>,
    pub(crate) residual: Option<f64>,
    pub(crate) nodes_a: Vec<Enclosure>,
    pub(crate) nodes_b: Vec<Enclosure>,
    pub(crate) pairs: Vec<[usize; 2]>,
}

/// The part of the scans that is enclosed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Semantics {
    Obstacle,
    /// The surface; also for older proofs, which have no such field.
    #[default]
    Surface,
    Points,
}

/// The verdict about two scans.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Verdict {
    Intersecting,
    Separated,
    Undecided,
}

/// The evidence of a verdict.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Evidence {
    Certified,
    Estimated,
}

/// A node: its points, and the box that is claimed to contain their part of the surface or
/// obstacle, in the stored frame.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub(crate) struct Enclosure {
    pub(crate) first: u32,
    pub(crate) count: u32,
    pub(crate) centre: [f32; 3],
    pub(crate) half: [f32; 3],
    pub(crate) axes: [[f32; 3]; 3],
}

impl Line {
    /// Parses a line.
    ///
    /// # Errors
    /// If the text is not such a line, or a number in it is not finite.
    pub(crate) fn parse(text: &str) -> Result<Self, String> {
        let line: Self = serde_json::from_str(text).map_err(|e| e.to_string())?;
        let scalars = [Some(line.margin), line.gap, line.residual].into_iter().flatten();
        let vectors = line.placed_a.iter().chain(&line.placed_b).chain(line.witness.iter().flatten());
        let finite = scalars.chain(vectors.copied()).all(f64::is_finite);
        let boxes = || line.nodes_a.iter().chain(&line.nodes_b);
        if !finite || !boxes().all(Enclosure::is_finite) {
            return Err("expected finite numbers, got another".into());
        }
        Ok(line)
    }

    /// Returns `true` if the answer claims more than an estimate.
    pub(crate) fn is_certified(&self) -> bool {
        self.evidence == Some(Evidence::Certified)
    }
}

impl Enclosure {
    fn is_finite(&self) -> bool {
        let mut numbers = self.centre.iter().chain(&self.half).chain(self.axes.iter().flatten());
        numbers.all(|x| x.is_finite())
    }
}

/// The lines of a file that are not blank, a batch at a time, with their numbers.
pub(crate) struct Lines {
    reader: BufReader<File>,
    number: u64,
}

impl Lines {
    pub(crate) fn open(path: &Path) -> Outcome<Self> {
        let file = File::open(path).map_err(|e| format!("{}: {e}", path.display()))?;
        Ok(Self { reader: BufReader::with_capacity(1 << 16, file), number: 0 })
    }

    /// Returns at most `most` further lines; none at the end.
    pub(crate) fn batch(&mut self, most: usize) -> Outcome<Vec<(u64, String)>> {
        let mut lines = Vec::new();
        while lines.len() < most {
            let mut text = String::new();
            if self.reader.read_line(&mut text)? == 0 {
                break;
            }
            self.number += 1;
            if !text.trim().is_empty() {
                lines.push((self.number, text));
            }
        }
        Ok(lines)
    }
}

/// The poses of the queries, by the number of their line.
pub(crate) type Poses = BTreeMap<u64, [Matrix; 2]>;

/// A line of the file of poses.
#[derive(Debug, Deserialize)]
struct PoseLine {
    a: Matrix,
    b: Matrix,
}

/// Reads a file of poses, like `nearmiss collide --poses`.
pub(crate) fn read_poses(path: &Path) -> Outcome<Poses> {
    let mut lines = Lines::open(path)?;
    let mut poses = Poses::new();
    loop {
        let batch = lines.batch(1024)?;
        if batch.is_empty() {
            return Ok(poses);
        }
        for (number, text) in batch {
            let pose: PoseLine =
                serde_json::from_str(&text).map_err(|e| format!("{}, line {number}: {e}", path.display()))?;
            poses.insert(number, [pose.a, pose.b]);
        }
    }
}
