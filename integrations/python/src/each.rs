//! Batches of questions about two things at many poses.

use std::sync::atomic::{AtomicBool, Ordering};

use nearmiss::{Pose, Scratch};
use pyo3::prelude::*;

use crate::answers::PairRecord;
use crate::pool::ask_each;
use crate::poses::{Placeable, PosePairs, Poses};
use crate::record::array;

/// Answers a question about `things` at all poses, on all cores, as a structured array of shape (N,).
pub(crate) fn each<'py, R: PairRecord>(
    py: Python<'py>,
    things: [&dyn Placeable; 2],
    poses: [Option<&Bound<'py, PyAny>>; 2],
    ask: impl Fn([Pose; 2], &mut Scratch) -> R + Sync,
) -> PyResult<Bound<'py, PyAny>> {
    let [a, b] = poses;
    let given = [Poses::new(a)?, Poses::new(b)?];
    let pairs = PosePairs::new(&given, things)?;
    let is_faulty = AtomicBool::new(false);
    let answers = ask_each(py, pairs.len(), |i, scratch| {
        let Some(poses) = pairs.at(i) else {
            is_faulty.store(true, Ordering::Relaxed);
            return R::zeroed();
        };
        ask(poses, scratch)
    })?;
    if is_faulty.into_inner() {
        return Err(pairs.fault());
    }
    array(py, answers)
}
