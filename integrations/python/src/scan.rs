//! `Scan`: a prepared scan, how it is made and where it is saved.

use std::path::PathBuf;

use nearmiss::{Check, Scan as Prepared};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyTuple};

use crate::arrays::Points;
use crate::failure::{refused, unloadable, unreadable, unwritable};
use crate::frame::Source;
use crate::recipe::{OF_SCAN, Recipe};
use crate::things::AnyScan;

/// A prepared scan.
///
/// Prepared from points of shape (N, 3), float32 or float64; those that are contiguous are not copied.
///
/// `normals` has shape (N, 3); with a graph, the computed normals are turned to their side.
/// `drop_invalid` drops points that are not finite, which raise `ValueError` otherwise. `progress` is
/// called with the share that is done, from 0 to 1, anew for a graph. Options: `radius_neighbours` (3
/// to 32, default 6), `reach` (the widest gap that is bridged, a length), `graph` (orient the normals),
/// `scanner` (a position of shape (3,) that normals face; implies `graph`), `close_pairs` (distances
/// along the surface; implies `graph`). Takes about 1.5 s for a million points on two cores; Ctrl-C
/// interrupts it.
#[pyclass(frozen, extends = AnyScan, module = "nearmiss")]
#[derive(Debug)]
pub(crate) struct Scan(pub(crate) Prepared);

/// Reads how files are checked.
pub(crate) fn check_of(name: &str) -> PyResult<Check> {
    match name {
        "full" => Ok(Check::Full),
        "structure" => Ok(Check::Structure),
        other => Err(refused(format!("expected check `full` or `structure`, got `{other}`"))),
    }
}

impl Scan {
    /// Makes the object of a prepared scan.
    pub(crate) fn of(py: Python<'_>, scan: Prepared) -> PyResult<Py<Self>> {
        Py::new(py, Self::initial(scan))
    }

    fn initial(scan: Prepared) -> PyClassInitializer<Self> {
        PyClassInitializer::from(AnyScan(Source::Still(scan.clone()))).add_subclass(Self(scan))
    }
}

#[pymethods]
impl Scan {
    #[new]
    #[pyo3(signature = (points, *, normals = None, drop_invalid = false, progress = None, **options))]
    fn new(
        points: &Bound<'_, PyAny>,
        normals: Option<&Bound<'_, PyAny>>,
        drop_invalid: bool,
        progress: Option<&Bound<'_, PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<PyClassInitializer<Self>> {
        let py = points.py();
        let recipe = Recipe::new(options, OF_SCAN)?;
        let mut cloud = Points::new(points)?.cloud(py, drop_invalid)?;
        if let Some(normals) = normals {
            #[expect(clippy::cast_possible_truncation, reason = "clouds keep normals in single precision")]
            let normals: Vec<[f32; 3]> =
                Points::new(normals)?.to_doubles()?.iter().map(|n| n.map(|c| c as f32)).collect();
            cloud = cloud.with_normals(&normals).map_err(refused)?;
        }
        recipe.prepare(py, cloud, progress).map(Self::initial)
    }

    /// Prepare the points of a file: PLY, PCD, LAS, LAZ, E57, NPY, OBJ, STL, OFF, glTF or text.
    ///
    /// `format` is recognised by default. Other options are those of `Scan`.
    #[staticmethod]
    #[pyo3(signature = (path, *, format = None, progress = None, **options))]
    fn read(
        py: Python<'_>,
        path: PathBuf,
        format: Option<&str>,
        progress: Option<&Bound<'_, PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Py<Self>> {
        let recipe = Recipe::new(options, OF_SCAN)?;
        let format = format.map(str::parse).transpose().map_err(refused)?;
        let cloud = py.detach(|| nearmiss::io::read(&path, format)).map_err(unreadable)?.cloud;
        Self::of(py, recipe.prepare(py, cloud, progress)?)
    }

    /// Open a prepared file (`.nm`) by mapping it.
    ///
    /// `check` is "full", which compares checksums and checks every number, or "structure", for
    /// files from a trusted source, which takes the same time for any scan.
    #[staticmethod]
    #[pyo3(signature = (path, *, check = "full"))]
    fn open(py: Python<'_>, path: PathBuf, check: &str) -> PyResult<Py<Self>> {
        let check = check_of(check)?;
        Self::of(py, py.detach(|| Prepared::open(&path, check)).map_err(unloadable)?)
    }

    /// Load a scan from the bytes of `to_bytes` or of a prepared file. `check` is that of `open`.
    #[staticmethod]
    #[pyo3(signature = (data, *, check = "full"))]
    fn from_bytes(py: Python<'_>, data: &[u8], check: &str) -> PyResult<Py<Self>> {
        let check = check_of(check)?;
        let bytes = data.to_vec();
        Self::of(py, py.detach(|| Prepared::from_bytes(bytes, check)).map_err(unloadable)?)
    }

    /// Return the contents of a prepared file. Pickling uses them.
    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let mut bytes = Vec::new();
        py.detach(|| self.0.write_to(&mut bytes)).map_err(unwritable)?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// Save the scan to a prepared file and return its length in bytes.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<u64> {
        py.detach(|| self.0.save(&path)).map_err(unwritable)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let py = slf.py();
        let bytes = slf.get().to_bytes(py)?;
        PyTuple::new(py, [slf.get_type().getattr("from_bytes")?, PyTuple::new(py, [bytes])?.into_any()])
    }

    fn __repr__(&self) -> String {
        let graph = if self.0.graph().is_some() { ", with graph" } else { "" };
        format!("<Scan of {} points, sampling radius {:.3e}{graph}>", self.0.len(), self.0.sampling_radius())
    }
}
