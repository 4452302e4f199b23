//! Hints: what the last question found out, for the next similar one.

use std::sync::{Mutex, MutexGuard};

use pyo3::prelude::*;

use crate::failure::refused;

/// Locks a hint; fails if another thread uses it.
fn lock<T>(hint: &Mutex<T>) -> PyResult<MutexGuard<'_, T>> {
    hint.try_lock().map_err(|_busy| {
        refused(
            "expected a hint for each pair and thread, got one in use by another thread; make one for each",
        )
    })
}

/// A hint of a pair of scans.
#[pyclass(frozen, module = "nearmiss")]
#[derive(Debug, Default)]
pub(crate) struct Hint(Mutex<nearmiss::PairHint>);

impl Hint {
    /// Locks the hint; fails if another thread uses it.
    pub(crate) fn lock(&self) -> PyResult<MutexGuard<'_, nearmiss::PairHint>> {
        lock(&self.0)
    }
}

#[pymethods]
impl Hint {
    #[new]
    fn new() -> Self {
        Self::default()
    }

    fn __repr__(&self) -> String {
        let fresh = self.0.try_lock().is_ok_and(|hint| *hint == nearmiss::PairHint::default());
        format!("<Hint{}>", if fresh { ", fresh" } else { "" })
    }
}

/// A hint of a scan and a shape.
#[pyclass(frozen, module = "nearmiss")]
#[derive(Debug, Default)]
pub(crate) struct ShapeHint(Mutex<nearmiss::ShapeHint>);

impl ShapeHint {
    /// Locks the hint; fails if another thread uses it.
    pub(crate) fn lock(&self) -> PyResult<MutexGuard<'_, nearmiss::ShapeHint>> {
        lock(&self.0)
    }
}

#[pymethods]
impl ShapeHint {
    #[new]
    fn new() -> Self {
        Self::default()
    }

    fn __repr__(&self) -> String {
        let fresh = self.0.try_lock().is_ok_and(|hint| *hint == nearmiss::ShapeHint::default());
        format!("<ShapeHint{}>", if fresh { ", fresh" } else { "" })
    }

    /// Forgets all contacts.
    fn clear(&self) -> PyResult<()> {
        self.lock()?.clear();
        Ok(())
    }
}
