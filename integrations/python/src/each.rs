//! Batches of questions about two things at many poses.

use nearmiss::{Answer, Pose, Scratch};
use pyo3::prelude::*;

use crate::answers::{AnswerRecord, DistanceRecord};
use crate::pool::ask_each;
use crate::poses::PosePairs;
use crate::record::array;

/// The verdict of a question with a matrix that is no pose.
const INVALID: i8 = i8::MIN;

/// Answers a question about contact at all poses, on all cores, as a structured array.
pub(crate) fn each_answer<'py>(
    py: Python<'py>,
    pairs: &PosePairs<'_>,
    ask: impl Fn([Pose; 2], &mut Scratch) -> AnswerRecord + Sync,
) -> PyResult<Bound<'py, PyAny>> {
    let answers = ask_each(py, pairs.len(), |i, scratch| match pairs.at(i) {
        Some(poses) => ask(poses, scratch),
        None => AnswerRecord { verdict: INVALID, ..AnswerRecord::new(&Answer::UNASKED) },
    })?;
    if answers.iter().any(|answer| answer.verdict == INVALID) {
        return Err(pairs.fault());
    }
    array(py, answers)
}

/// Answers a question about distance at all poses, on all cores, as a structured array.
pub(crate) fn each_distance<'py>(
    py: Python<'py>,
    pairs: &PosePairs<'_>,
    ask: impl Fn([Pose; 2], &mut Scratch) -> DistanceRecord + Sync,
) -> PyResult<Bound<'py, PyAny>> {
    let distances = ask_each(py, pairs.len(), |i, scratch| match pairs.at(i) {
        Some(poses) => ask(poses, scratch),
        None => DistanceRecord { lower: f64::NAN, ..bytemuck::Zeroable::zeroed() },
    })?;
    if distances.iter().any(|distance| distance.lower.is_nan()) {
        return Err(pairs.fault());
    }
    array(py, distances)
}
