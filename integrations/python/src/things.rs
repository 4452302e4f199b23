//! The things that questions are about, as classes of Python.

use nearmiss::Mesh as PreparedMesh;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;

use crate::frame::{Frame, Source};
use crate::poses::Placeable;

/// A scan, still or moving: the base of `Scan` and `MovingScan`, with all questions about them.
#[pyclass(frozen, subclass, module = "nearmiss")]
#[derive(Debug)]
pub(crate) struct AnyScan(pub(crate) Source);

/// A prepared triangle mesh.
///
/// Prepared from vertices of shape (N, 3) and their indices of shape (M, 3), a row for each triangle.
///
/// Vertices at one place are welded, those up to `weld` apart too. Triangles without area and
/// repeated ones are dropped. Takes about 0.1 s for 100,000 triangles.
#[pyclass(frozen, module = "nearmiss")]
#[derive(Debug)]
pub(crate) struct Mesh {
    pub(crate) mesh: PreparedMesh,
}

/// A thing to compare with.
pub(crate) enum Thing<'py> {
    Scan(Bound<'py, AnyScan>),
    Mesh(Bound<'py, Mesh>),
}

impl<'py> FromPyObject<'_, 'py> for Thing<'py> {
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        if let Ok(scan) = given.cast::<AnyScan>() {
            return Ok(Self::Scan((*scan).clone()));
        }
        match given.cast::<Mesh>() {
            Ok(mesh) => Ok(Self::Mesh((*mesh).clone())),
            Err(_) => {
                let class = given.get_type().name()?;
                Err(PyTypeError::new_err(format!("expected a Scan, a MovingScan or a Mesh, got {class}")))
            }
        }
    }
}

impl Thing<'_> {
    /// Returns the thing as it is now.
    pub(crate) fn side(&self) -> Side<'_> {
        match self {
            Self::Scan(scan) => Side::Scan(scan.get().0.frame(scan.py())),
            Self::Mesh(mesh) => Side::Mesh(mesh.get()),
        }
    }
}

/// One of the two sides of a question.
pub(crate) enum Side<'a> {
    Scan(Frame<'a>),
    Mesh(&'a Mesh),
}

impl Side<'_> {
    /// Returns what poses place.
    pub(crate) fn placeable(&self) -> &dyn Placeable {
        match self {
            Self::Scan(scan) => &**scan,
            Self::Mesh(mesh) => &mesh.mesh,
        }
    }
}
