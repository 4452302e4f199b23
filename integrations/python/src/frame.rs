//! The points that a question is about: a still scan, or the current frame of a moving one.

use std::ops::Deref;
use std::sync::{Arc, Mutex, PoisonError};

use nearmiss::store::Progress;
use nearmiss::{DeformError, MovingScan, Placed, PointHierarchy, Pose, Prepared, Scan};
use pyo3::prelude::*;
use pyo3::sync::MutexExt;

use crate::failure::refused;
use crate::pool::in_pool;
use crate::prepare::in_thread;

/// A moving scan that threads share.
///
/// A question takes a reference of the current frame and works without the lock, so it sees one whole
/// frame, and questions about several moving scans cannot wait for each other. A change holds the
/// lock until it is complete. It copies the frame first if a question still uses it.
///
/// No thread of the pool takes the lock: while it waits for a part of one change, it may take up another
/// one, which would wait for the lock that this thread holds.
#[derive(Debug)]
pub(crate) struct Moving(Mutex<Latest>);

/// The latest frame.
#[derive(Debug)]
struct Latest {
    scan: Arc<MovingScan>,
    /// How the scan followed this frame; `None` for the first one.
    renewal: Option<&'static str>,
}

impl Moving {
    pub(crate) fn new(scan: MovingScan) -> Self {
        Self(Mutex::new(Latest { scan: Arc::new(scan), renewal: None }))
    }

    /// Returns the current frame, and how the scan followed it. Waits for a change in progress.
    pub(crate) fn latest(&self, py: Python<'_>) -> (Arc<MovingScan>, Option<&'static str>) {
        let latest = self.0.lock_py_attached(py).unwrap_or_else(PoisonError::into_inner);
        (Arc::clone(&latest.scan), latest.renewal)
    }

    /// Changes the scan on all cores, without the interpreter. `work` returns how.
    pub(crate) fn change(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut MovingScan) -> Result<&'static str, DeformError> + Send,
    ) -> PyResult<&'static str> {
        py.detach(|| self.change_here(work))?.map_err(refused)
    }

    /// Does the same in a thread of its own. Ctrl-C ends the wait; the change is then completed in the
    /// background.
    pub(crate) fn change_watched(
        self: &Arc<Self>,
        py: Python<'_>,
        work: impl FnOnce(&mut MovingScan) -> Result<&'static str, DeformError> + Send + 'static,
    ) -> PyResult<&'static str> {
        let moving = Arc::clone(self);
        in_thread(py, None, &Progress::default(), move || moving.change_here(work))?.map_err(refused)
    }

    /// Takes the lock in this thread, which must be outside the pool, then works in the pool.
    fn change_here(
        &self,
        work: impl FnOnce(&mut MovingScan) -> Result<&'static str, DeformError> + Send,
    ) -> PyResult<Result<&'static str, DeformError>> {
        let mut latest = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let scan = &mut latest.scan;
        let renewal = in_pool(|| work(Arc::make_mut(scan)))?;
        if let Ok(how) = renewal {
            latest.renewal = Some(how);
        }
        Ok(renewal)
    }
}

/// A scan to ask, still or moving. A clone refers to the same scan.
#[derive(Debug, Clone)]
pub(crate) enum Source {
    Still(Scan),
    Moving(Arc<Moving>),
}

impl Source {
    /// Returns the points to ask now. Waits for a change in progress.
    pub(crate) fn frame(&self, py: Python<'_>) -> Frame<'_> {
        match self {
            Self::Still(scan) => Frame::Still(scan),
            Self::Moving(moving) => Frame::Moving(moving.latest(py).0),
        }
    }
}

/// A still scan, or a frame of a moving one, which later frames do not change.
#[derive(Debug)]
pub(crate) enum Frame<'a> {
    Still(&'a Scan),
    Moving(Arc<MovingScan>),
}

impl Deref for Frame<'_> {
    type Target = PointHierarchy;

    fn deref(&self) -> &PointHierarchy {
        match self {
            Self::Still(scan) => scan,
            Self::Moving(scan) => scan,
        }
    }
}

impl Prepared for Frame<'_> {
    fn at(&self, pose: &Pose) -> Placed<'_> {
        match self {
            Self::Still(scan) => scan.at(pose),
            Self::Moving(scan) => scan.at(pose),
        }
    }
}
