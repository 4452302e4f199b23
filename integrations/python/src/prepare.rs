//! Long work in a thread of its own, while Python sees Ctrl-C and the progress.

use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use nearmiss::store::Progress;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

use crate::failure::refused;
use crate::pool::in_pool;

/// The time between two looks at signals, and two reports of the progress.
const LOOK: Duration = Duration::from_millis(50);

/// Runs `work` on all cores, tells `told` the share that is done, and returns early if a signal or
/// `told` raises an exception. The work then ends in the background, and its result is dropped.
pub(crate) fn watched<T: Send + 'static>(
    py: Python<'_>,
    told: Option<&Bound<'_, PyAny>>,
    progress: &Progress,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    in_thread(py, told, progress, move || in_pool(work))
}

/// Runs `work` in a new thread outside the pool, where it may wait for locks. Otherwise as [`watched`].
pub(crate) fn in_thread<T: Send + 'static>(
    py: Python<'_>,
    told: Option<&Bound<'_, PyAny>>,
    progress: &Progress,
    work: impl FnOnce() -> PyResult<T> + Send + 'static,
) -> PyResult<T> {
    let (sender, mut receiver) = channel();
    let run = move || {
        // Nobody listens after an exception.
        let _ignored = sender.send(work());
    };
    std::thread::Builder::new().name("nearmiss".into()).spawn(run).map_err(refused)?;
    loop {
        let receiver = &mut receiver;
        let waited = py.detach(move || receiver.recv_timeout(LOOK));
        match waited {
            Ok(done) => {
                if let Some(told) = told {
                    told.call1((1.0,))?;
                }
                return done;
            }
            Err(RecvTimeoutError::Timeout) => {
                py.check_signals()?;
                if let Some(told) = told {
                    told.call1((progress.share(),))?;
                }
            }
            Err(RecvTimeoutError::Disconnected) => {
                return Err(PyRuntimeError::new_err("the preparation ended by a fault; please report it"));
            }
        }
    }
}
