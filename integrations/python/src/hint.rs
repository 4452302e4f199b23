//! Hints: what the last question found out, for the next similar one.

use std::sync::Mutex;

use pyo3::prelude::*;

use crate::failure::refused;

/// Returns the error of a hint that another thread uses.
pub(crate) fn busy() -> PyErr {
    refused("expected a hint for each pair and thread, got one in use by another thread; make one for each")
}

/// A hint of a pair of scans.
#[pyclass(frozen, module = "nearmiss")]
#[derive(Debug, Default)]
pub(crate) struct Hint(pub(crate) Mutex<nearmiss::PairHint>);

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
pub(crate) struct ShapeHint(pub(crate) Mutex<nearmiss::ShapeHint>);

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
        self.0.try_lock().map_err(|_busy| busy())?.clear();
        Ok(())
    }
}
