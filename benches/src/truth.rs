//! Truth sets: poses with exact answers, one JSON object per line.

use std::path::Path;

use nearmiss::{Aabb, Pose};

use crate::Failure;

/// Greatest error of the poses of a truth set, relative to the bounds.
const TOLERANCE: f64 = 1e-3;

/// A question with its exact answer.
#[derive(Debug, Clone, Copy)]
pub struct Question {
    /// Pose of the first copy.
    pub a: Pose,
    /// Pose of the second.
    pub b: Pose,
    /// `true` if the exact surfaces intersect.
    pub truth: bool,
    /// Exact distance, or minus the depth if they intersect.
    pub gap: f64,
}

/// Reads the questions of `path` about an object with these `bounds`.
///
/// # Errors
/// When a line is not a scored question; the error names the first one.
pub fn read(path: &Path, bounds: &Aabb) -> Result<Vec<Question>, Failure> {
    let text = std::fs::read_to_string(path)?;
    let question = |(number, line): (usize, &str)| {
        parse(line, bounds).map_err(|cause| format!("{}:{}: {cause}", path.display(), number + 1).into())
    };
    text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty()).map(question).collect()
}

fn parse(line: &str, bounds: &Aabb) -> Result<Question, Failure> {
    let value: serde_json::Value = serde_json::from_str(line)?;
    let pose = |key: &str| -> Result<Pose, Failure> {
        let entries = value[key].as_array().ok_or_else(|| format!("expected a pose {key:?}, got none"))?;
        let entries: Option<Vec<f64>> = entries.iter().map(serde_json::Value::as_f64).collect();
        let entries: Option<[f64; 16]> = entries.and_then(|e| e.try_into().ok());
        let entries = entries.ok_or_else(|| format!("expected 16 numbers as pose {key:?}"))?;
        let size = bounds.half_extents().into_iter().fold(0.0, f64::max);
        Ok(Pose::from_row_major(&entries, bounds, TOLERANCE * size)?)
    };
    let truth = value["truth"].as_bool().ok_or("expected an answer \"truth\", got none")?;
    let gap = value["gap"]
        .as_f64()
        .ok_or("expected a number \"gap\", got none; sets without gaps cannot be scored")?;
    Ok(Question { a: pose("a")?, b: pose("b")?, truth, gap })
}
