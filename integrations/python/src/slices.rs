//! `SliceMap`: a building as a stack of images, and avatars that walk in it.

use std::path::PathBuf;

use nearmiss::Aabb;
use nearmiss::slices::{
    Avatar, AvatarOptions, Floor, Obstacle, Pixel, Route, SliceBuilder, SliceError, SliceFolder,
    SliceMap as Map, SliceOptions, SlicePlan, Slide, StoreError,
};
use nearmiss::store::Progress;
use numpy::PyUntypedArrayMethods;
use pyo3::prelude::*;

use crate::arrays::{Points, doubles, vector, wrong_shape};
use crate::cloud::rows;
use crate::failure::{refused, unstored};
use crate::pool::ask_each;
use crate::prepare::watched;
use crate::record::{array, record};

record! {
    /// The content of a box.
    BoxRecord {
        floor: f64 = "f8",
        pixels: u64 = "u8",
        collides: u8 = "?",
        obstacle: u8 = "?",
        _padding: [u8; 6] = "6u1",
    }
}

/// A slice map: a building as a stack of images of its floors and obstacles, for walking avatars.
///
/// Built from points of shape (N, 3).
///
/// `pixel` is the side of a pixel, a length; by default the longer side of the map has 700 pixels.
/// `slice_height` is three pixels by default. `up` is x, y, z, -x, -y or -z. A pixel whose surface is
/// steeper than `max_slope` degrees is an obstacle; `noise` is the height that a level floor spans,
/// estimated by default.
#[pyclass(frozen, module = "nearmiss")]
#[derive(Debug)]
pub(crate) struct SliceMap(Map);

/// Reads an avatar: width, depth and height, and the height of a climb.
fn avatar(size: [f64; 3], climb: f64) -> PyResult<Avatar> {
    let [width, depth, height] = size;
    Avatar::new(&AvatarOptions::default().with_box([width, depth], height).with_climb(climb)).map_err(refused)
}

#[pymethods]
impl SliceMap {
    #[new]
    #[pyo3(signature = (points, *, pixel = None, slice_height = None, up = "z", max_slope = 45.0, noise = None))]
    fn new(
        points: &Bound<'_, PyAny>,
        pixel: Option<f64>,
        slice_height: Option<f64>,
        up: &str,
        max_slope: f64,
        noise: Option<f64>,
    ) -> PyResult<Self> {
        let mut options = SliceOptions::default()
            .with_slice_height(slice_height)
            .with_obstacle(Obstacle::Slope { degrees: max_slope, noise })
            .with_up(up.parse().map_err(refused)?);
        if let Some(side) = pixel {
            options = options.with_pixel(Pixel::Side(side));
        }
        options.check().map_err(refused)?;
        let py = points.py();
        let points: Vec<[f64; 3]> = Points::new(points)?.to_doubles()?;
        let made = move || {
            let finite = points.iter().filter(|p| p.iter().all(|c| c.is_finite())).copied();
            let mut builder = SliceBuilder::new(&SlicePlan::new(&options, &Aabb::of(finite))?)?;
            builder.add(&points);
            Ok(builder.finish())
        };
        let made = watched(py, None, &Progress::default(), made);
        made?.map(Self).map_err(|cause: SliceError| refused(cause))
    }

    /// Load the map of a folder.
    #[staticmethod]
    fn open(py: Python<'_>, folder: PathBuf) -> PyResult<Self> {
        let loaded = py.detach(|| -> Result<Map, StoreError> {
            let (map, mut faults) = SliceFolder::open(&folder)?.load_all();
            if faults.is_empty() { Ok(map) } else { Err(faults.remove(0)) }
        });
        loaded.map(Self).map_err(unstored)
    }

    /// Save the map to a folder and return its length in bytes.
    fn save(&self, py: Python<'_>, folder: PathBuf) -> PyResult<u64> {
        py.detach(|| self.0.save(&folder)).map_err(unstored)
    }

    fn __repr__(&self) -> String {
        let [width, height, slices] = self.0.grid().counts;
        format!("<SliceMap of {slices} slices of {width} × {height} pixels of {}>", self.0.grid().pixel)
    }

    fn __len__(&self) -> usize {
        self.0.slices().len()
    }

    /// The side of a pixel, a length.
    #[getter]
    fn pixel(&self) -> f64 {
        self.0.grid().pixel
    }

    /// The height of a slice, a length.
    #[getter]
    fn slice_height(&self) -> f64 {
        self.0.grid().slice_height
    }

    /// Return what is in boxes of shape (N, 2, 3), the least and the greatest corner of each.
    ///
    /// The structured array of shape (N,) has the fields `collides`, `obstacle`, `pixels` (the number of
    /// occupied ones) and `floor` (its height below the box; NaN if there is none). `floor` is "max" or
    /// "mean".
    #[pyo3(signature = (boxes, *, floor = "max"))]
    fn query<'py>(&self, boxes: &Bound<'py, PyAny>, floor: &str) -> PyResult<Bound<'py, PyAny>> {
        const EXPECTED: &str = "boxes of shape (N, 2, 3): the least and the greatest corner of each";
        let floor = match floor {
            "max" => Floor::Max,
            "mean" => Floor::Mean,
            other => return Err(refused(format!("expected floor `max` or `mean`, got `{other}`"))),
        };
        let array_given = doubles(boxes, EXPECTED)?;
        let [_, 2, 3] = *array_given.shape() else { return Err(wrong_shape(EXPECTED, boxes)) };
        let corners = array_given.as_slice().map_err(refused)?.as_chunks::<3>().0.as_chunks::<2>().0;
        if let Some(i) = corners.iter().position(|[min, max]| !(0..3).all(|k| min[k] <= max[k])) {
            return Err(refused(format!("expected boxes with min ≤ max, got another one (box {i})")));
        }
        let py = boxes.py();
        let answers = ask_each(py, corners.len(), |i, _| {
            let [min, max] = corners[i];
            // Every slice is loaded.
            let found = self.0.query(&Aabb { min, max }, floor).unwrap_or_default();
            BoxRecord {
                floor: found.floor.unwrap_or(f64::NAN),
                pixels: found.pixels,
                collides: found.collides.into(),
                obstacle: found.obstacle.into(),
                _padding: [0; 6],
            }
        })?;
        array(py, answers)
    }

    /// Return the place nearest to `near`, of shape (3,), where an avatar can stand; None if there is none.
    ///
    /// `size` is the width, depth and height of the avatar, `climb` the height that it steps up at once.
    #[pyo3(
        signature = (near, *, size = [0.4, 0.4, 1.6], climb = 0.35),
        text_signature = "($self, near, *, size=(0.4, 0.4, 1.6), climb=0.35)"
    )]
    fn standing(&self, near: &Bound<'_, PyAny>, size: [f64; 3], climb: f64) -> PyResult<Option<[f64; 3]>> {
        let (avatar, place) = (avatar(size, climb)?, vector(near, "the place")?);
        let found = near.py().detach(|| avatar.nearest_standing(&self.0, place)).map_err(refused)?;
        Ok(found.map(|standing| standing.position))
    }

    /// Find a short route that an avatar can walk between two places of shape (3,).
    ///
    /// Returns the points to walk to, of shape (N, 2), the end of shape (3,), and the length. Raises
    /// `ValueError` if there is no route; the message says how near it gets.
    #[pyo3(
        signature = (start, goal, *, size = [0.4, 0.4, 1.6], climb = 0.35, falls = false),
        text_signature = "($self, start, goal, *, size=(0.4, 0.4, 1.6), climb=0.35, falls=False)"
    )]
    fn route<'py>(
        &self,
        start: &Bound<'py, PyAny>,
        goal: &Bound<'py, PyAny>,
        size: [f64; 3],
        climb: f64,
        falls: bool,
    ) -> PyResult<(Bound<'py, PyAny>, [f64; 3], f64)> {
        let (py, avatar) = (start.py(), avatar(size, climb)?);
        let ends = [vector(start, "the start")?, vector(goal, "the goal")?];
        let found = py.detach(|| Route::find(&self.0, &avatar, ends, falls)).map_err(refused)?;
        let points = &found.route.points;
        Ok((rows(py, points.as_flattened().to_vec(), &[points.len(), 2])?, found.end, found.length))
    }

    /// Walk an avatar from `start`, of shape (3,), to points of shape (N, 2) in turn, sliding along walls.
    ///
    /// Returns the places of its feet after each step, of shape (M, 3).
    #[pyo3(
        signature = (start, points, *, size = [0.4, 0.4, 1.6], climb = 0.35),
        text_signature = "($self, start, points, *, size=(0.4, 0.4, 1.6), climb=0.35)"
    )]
    fn walk<'py>(
        &self,
        py: Python<'py>,
        start: &Bound<'py, PyAny>,
        points: &Bound<'py, PyAny>,
        size: [f64; 3],
        climb: f64,
    ) -> PyResult<Bound<'py, PyAny>> {
        const EXPECTED: &str = "points to walk to, of shape (N, 2)";
        let (avatar, start) = (avatar(size, climb)?, vector(start, "the start")?);
        let given = doubles(points, EXPECTED)?;
        let [_, 2] = *given.shape() else { return Err(wrong_shape(EXPECTED, points)) };
        let route = Route { start, points: given.as_slice().map_err(refused)?.as_chunks::<2>().0.to_vec() };
        let mut places = Vec::new();
        let walked = py.detach(|| {
            route.walk(&mut &self.0, &avatar, &Slide, |_, step| {
                places.push(step.position);
                Ok(())
            })
        });
        walked.map_err(refused)?;
        rows(py, places.as_flattened().to_vec(), &[places.len(), 3])
    }
}
