//! `MovingScan`: a scan whose points move, or are replaced by those of another frame.

use std::sync::Arc;

use nearmiss::store::Progress;
use nearmiss::{DeformError, MovingScan as Prepared, Renewal};
use numpy::PyUntypedArrayMethods;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{Points, doubles, no_cloud, wrong_shape};
use crate::failure::refused;
use crate::frame::{Moving, Source};
use crate::prepare::watched;
use crate::recipe::{OF_MOVING, Recipe};
use crate::scan::Scan;
use crate::things::AnyScan;

/// A scan whose points move from frame to frame, or are replaced by those of another frame.
///
/// Answers every question that a `Scan` answers, about the current frame. A certificate is a proof for that
/// frame. Threads may share it: a question that begins during a change waits until it is complete, and a
/// question in progress keeps its frame, of which the change makes a copy. So an answer is about one whole
/// frame, and no question fails because of a change.
///
/// Prepared from the first frame: points of shape (N, 3), float32 or float64.
///
/// `drop_invalid` drops points that are not finite, which raise `ValueError` otherwise; the frames of
/// `move_to` then have the other points. Options: `radius_neighbours` (3 to 32, default 6) and `reach`
/// (the widest gap that is bridged, a length), which later frames keep. Takes as long as `Scan`; Ctrl-C
/// interrupts it.
#[pyclass(frozen, extends = AnyScan, module = "nearmiss")]
#[derive(Debug)]
pub(crate) struct MovingScan(Arc<Moving>);

impl MovingScan {
    fn initial(scan: Prepared) -> PyClassInitializer<Self> {
        let moving = Arc::new(Moving::new(scan));
        PyClassInitializer::from(AnyScan(Source::Moving(Arc::clone(&moving)))).add_subclass(Self(moving))
    }
}

/// Returns how a scan followed a frame, in a word.
const fn name_of(renewal: Renewal) -> &'static str {
    match renewal {
        Renewal::Refitted => "refitted",
        Renewal::Renewed => "renewed",
        _ => "rebuilt",
    }
}

/// The name of a frame of other points.
const REPLACED: &str = "replaced";

#[pymethods]
impl MovingScan {
    #[new]
    #[pyo3(signature = (points, *, drop_invalid = false, **options))]
    fn new(
        points: &Bound<'_, PyAny>,
        drop_invalid: bool,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<PyClassInitializer<Self>> {
        let build = Recipe::new(options, OF_MOVING)?.build;
        let mut frame = Points::new(points)?.to_doubles()?;
        if drop_invalid {
            frame.retain(|p| p.iter().all(|c| c.is_finite()));
        }
        let made = watched(points.py(), None, &Progress::default(), move || Prepared::new(&frame, &build))?;
        made.map(Self::initial).map_err(|cause| match &cause {
            DeformError::Cloud(cause) => no_cloud(cause),
            _ => refused(cause),
        })
    }

    /// Make a moving scan of a `Scan`, whose points are the first frame. Its reach stays in later frames.
    ///
    /// Raises `ValueError` for a scan with a graph, or one prepared from repeated points.
    #[staticmethod]
    fn of(scan: &Bound<'_, Scan>) -> PyResult<Py<Self>> {
        let (py, scan) = (scan.py(), scan.get().0.clone());
        let moving = py.detach(|| Prepared::try_from(scan)).map_err(refused)?;
        Py::new(py, Self::initial(moving))
    }

    /// Move the points: an array of shape (N, 3), in the order of the first frame, all of them finite.
    ///
    /// Carries normals and radii along where points move nearly together, which takes a small part of the
    /// time of preparing a `Scan`, and fits them anew elsewhere. Prepares the scan anew if its boxes have
    /// become loose. Returns how, as `renewal` does. If it raises `ValueError`, the scan is unchanged.
    fn move_to(&self, points: &Bound<'_, PyAny>) -> PyResult<&'static str> {
        let (py, points) = (points.py(), Points::new(points)?);
        let points = points.doubles()?;
        self.0.change(py, |scan| scan.move_to(&points).map(name_of))
    }

    /// Replace the scan by one of other points, of shape (M, 3), such as the next frame of a depth camera.
    ///
    /// Points that are not finite are dropped. `move_to` then takes points in the order of this frame. If it
    /// raises `ValueError`, the scan is unchanged. Ctrl-C ends the wait; the scan is then replaced in the
    /// background, and questions wait for it.
    fn replace(&self, points: &Bound<'_, PyAny>) -> PyResult<()> {
        let (py, points) = (points.py(), Points::new(points)?.to_doubles()?);
        self.0.change_watched(py, move |scan| scan.replace(&points).map(|()| REPLACED)).map(drop)
    }

    /// Replace the scan by a depth frame: an array of shape (H, W, 3), with a point for each pixel.
    ///
    /// Pixels that are not finite or zero, where nothing was measured, are dropped. Neighbours are sought
    /// among the pixels around each point, which takes a small part of the time of `replace`. If it raises
    /// `ValueError`, the scan is unchanged.
    fn replace_organised(&self, points: &Bound<'_, PyAny>) -> PyResult<()> {
        const EXPECTED: &str = "a depth frame of shape (H, W, 3)";
        let array = doubles(points, EXPECTED)?;
        let [_, width @ (1..), 3] = *array.shape() else { return Err(wrong_shape(EXPECTED, points)) };
        let pixels = array.as_slice().map_err(refused)?.as_chunks::<3>().0;
        let work = |scan: &mut Prepared| scan.replace_organised(pixels, width).map(|()| REPLACED);
        self.0.change(points.py(), work).map(drop)
    }

    /// The way in which the scan followed the last frame: "refitted", "renewed" (all points fitted anew),
    /// "rebuilt" (prepared anew, with another order of the points) or "replaced"; None for the first
    /// frame.
    #[getter]
    fn renewal(&self, py: Python<'_>) -> Option<&'static str> {
        self.0.latest(py).1
    }

    /// The cost of the boxes relative to that when all points were last fitted anew: the sum of their areas,
    /// in squared local radii. `move_to` prepares the scan anew above 2.
    #[getter]
    fn looseness(&self, py: Python<'_>) -> f64 {
        let scan = self.0.latest(py).0;
        py.detach(|| scan.looseness())
    }

    /// The share of points whose kind no longer suits their place in the order, such as sparse points among
    /// those of a sheet. `move_to` prepares the scan anew above 0.05.
    #[getter]
    fn misplaced(&self, py: Python<'_>) -> f64 {
        let scan = self.0.latest(py).0;
        py.detach(|| scan.misplaced())
    }

    /// Return the current frame as a `Scan`, for example to save it. Later frames do not change it.
    fn still(&self, py: Python<'_>) -> PyResult<Py<Scan>> {
        Scan::of(py, self.0.latest(py).0.still())
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        let (scan, renewal) = self.0.latest(py);
        let (count, radius) = (scan.len(), scan.sampling_radius());
        format!(
            "<MovingScan of {count} points, sampling radius {radius:.3e}, {}>",
            renewal.unwrap_or("first frame")
        )
    }
}
