//! `Scan`: a prepared scan and the questions about it.

use std::path::PathBuf;

use nearmiss::{
    Check, ClashOptions, ClashPlan, CollidePlan, Contacts, CurveOptions, CurvePlan, Curves, DistanceOptions,
    DistancePlan, Pair, Pose, Scan as Prepared,
};
use pyo3::exceptions::PyRuntimeWarning;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyTuple};

use crate::answers::{
    Answer, AnswerRecord, ClashRecord, ContactRecord, Distance, DistanceRecord, ManifoldRecord,
};
use crate::arrays::Points;
use crate::cloud::rows;
use crate::each::{each_answer, each_distance};
use crate::failure::{refused, unloadable, unreadable, unwritable};
use crate::hint::{Hint, busy};
use crate::options::{OF_DISTANCE, OF_MEANING, OF_SCANS, OF_SHAPES, Options};
use crate::pool::ask;
use crate::poses::{PosePairs, Poses};
use crate::recipe::Recipe;
use crate::record::array;
use crate::target::Target;

/// A prepared scan.
#[pyclass(frozen, module = "nearmiss")]
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
    /// Plans a collision of this scan with another one.
    fn plan(&self, other: &Self, options: Option<&Bound<'_, PyDict>>) -> PyResult<(CollidePlan, Options)> {
        let options = Options::new(options, OF_SCANS, &self.0)?;
        Ok((CollidePlan::new(&options.collide, &self.0, &other.0).map_err(refused)?, options))
    }

    /// Plans a distance of this scan from another one.
    fn distance_plan(
        &self,
        other: &Self,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<(DistancePlan, Options)> {
        let options = Options::new(options, OF_DISTANCE, &self.0)?;
        let asked = DistanceOptions::default()
            .with_semantics(options.collide.semantics)
            .with_relative(options.relative);
        Ok((DistancePlan::new(&asked, &self.0, &other.0).map_err(refused)?, options))
    }

    /// Returns the one pose of each of both scans.
    fn both(
        &self,
        other: &Self,
        pose: Option<&Bound<'_, PyAny>>,
        own: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<[Pose; 2]> {
        Ok([Poses::new(own)?.one(&self.0)?, Poses::new(pose)?.one(&other.0)?])
    }
}

#[pymethods]
impl Scan {
    /// Prepare points of shape (N, 3), float32 or float64; those that are contiguous are not copied.
    ///
    /// `normals` has shape (N, 3). `drop_invalid` drops points that are not finite, which raise
    /// `ValueError` otherwise. `progress` is called with the share that is done, from 0 to 1, anew for a
    /// graph. Options: `radius_neighbours` (3 to 32, default 6), `reach` (the widest gap that is bridged,
    /// a length), `graph` (orient the normals), `scanner` (a position of shape (3,) that normals face;
    /// implies `graph`), `close_pairs` (distances along the surface; implies `graph`). Takes about 1.5 s
    /// for a million points on two cores; Ctrl-C interrupts it.
    #[new]
    #[pyo3(signature = (points, *, normals = None, drop_invalid = false, progress = None, **options))]
    fn new(
        points: &Bound<'_, PyAny>,
        normals: Option<&Bound<'_, PyAny>>,
        drop_invalid: bool,
        progress: Option<&Bound<'_, PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let py = points.py();
        let recipe = Recipe::new(options)?;
        let mut cloud = Points::new(points)?.cloud(py, drop_invalid)?;
        if let Some(normals) = normals {
            #[expect(clippy::cast_possible_truncation, reason = "clouds keep normals in single precision")]
            let normals: Vec<[f32; 3]> =
                Points::new(normals)?.to_doubles()?.iter().map(|n| n.map(|c| c as f32)).collect();
            cloud = cloud.with_normals(&normals).map_err(refused)?;
        }
        recipe.prepare(py, cloud, progress).map(Self)
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
    ) -> PyResult<Self> {
        let recipe = Recipe::new(options)?;
        let format = format.map(str::parse).transpose().map_err(refused)?;
        let cloud = py.detach(|| nearmiss::io::read(&path, format)).map_err(unreadable)?.cloud;
        recipe.prepare(py, cloud, progress).map(Self)
    }

    /// Open a prepared file (`.nm`) by mapping it.
    ///
    /// `check` is "full", which compares checksums and checks every number, or "structure", for
    /// files from a trusted source, which takes the same time for any scan.
    #[staticmethod]
    #[pyo3(signature = (path, *, check = "full"))]
    fn open(py: Python<'_>, path: PathBuf, check: &str) -> PyResult<Self> {
        let check = check_of(check)?;
        py.detach(|| Prepared::open(&path, check)).map(Self).map_err(unloadable)
    }

    /// Load a scan from the bytes of `to_bytes` or of a prepared file. `check` is that of `open`.
    #[staticmethod]
    #[pyo3(signature = (data, *, check = "full"))]
    fn from_bytes(py: Python<'_>, data: &[u8], check: &str) -> PyResult<Self> {
        let check = check_of(check)?;
        let bytes = data.to_vec();
        py.detach(|| Prepared::from_bytes(bytes, check)).map(Self).map_err(unloadable)
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

    fn __len__(&self) -> usize {
        self.0.len()
    }

    fn __repr__(&self) -> String {
        let graph = if self.0.graph().is_some() { ", with graph" } else { "" };
        format!("<Scan of {} points, sampling radius {:.3e}{graph}>", self.0.len(), self.0.sampling_radius())
    }

    /// The least and the greatest corner, of shape (2, 3).
    #[getter]
    fn bounds<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let bounds = self.0.bounds();
        rows(py, [bounds.min, bounds.max].concat(), &[2, 3])
    }

    /// The 0.9-quantile of the local radii, a length.
    #[getter]
    fn sampling_radius(&self) -> f64 {
        self.0.sampling_radius()
    }

    /// The widest gap that is bridged, a length.
    #[getter]
    fn reach(&self) -> f64 {
        self.0.reach()
    }

    /// True if the normals point outwards, as with `graph`.
    #[getter]
    fn is_oriented(&self) -> bool {
        self.0.is_oriented()
    }

    /// The share of points that sample a sheet.
    #[getter]
    fn usable(&self) -> f64 {
        self.0.usable()
    }

    /// The numbers of input points that were dropped: those not finite, and duplicates.
    #[getter]
    fn dropped(&self) -> (usize, usize) {
        let dropped = self.0.dropped();
        (dropped.not_finite, dropped.duplicate)
    }

    /// The points in the order of the scan, of shape (N, 3).
    #[getter]
    fn points<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let frame = self.0.frame();
        let flat: Vec<f64> = self.0.positions().iter().flat_map(|&p| frame.to_world(p)).collect();
        rows(py, flat, &[self.0.len(), 3])
    }

    /// The normals in the order of the scan, of shape (N, 3).
    #[getter]
    fn normals<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        rows(py, self.0.normals().as_flattened().to_vec(), &[self.0.len(), 3])
    }

    /// The index in the input of each point, of shape (N,).
    #[getter]
    fn sources<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        rows(py, self.0.source().to_vec(), &[self.0.len()])
    }

    /// Decide whether this scan, at `own_pose`, touches `other`, at `pose`.
    ///
    /// Poses have shape (4, 4); the default is the identity. Options: `margin` (a length: nearer counts
    /// as touching), `thickened` (compare balls of this radius about the points), `surface_only`
    /// (ignore points that sample no surface), `evidence` ("certified" or "estimated"), `detail`
    /// ("witness" or "verdict"), and budgets: `work` (units of work), `seconds`. A `hint` speeds up
    /// the next similar question. Returns an Answer. Takes microseconds.
    #[pyo3(signature = (other, pose = None, own_pose = None, *, hint = None, **options))]
    fn collide(
        &self,
        other: &Bound<'_, Self>,
        pose: Option<&Bound<'_, PyAny>>,
        own_pose: Option<&Bound<'_, PyAny>>,
        hint: Option<&Bound<'_, Hint>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Answer> {
        let (py, other) = (other.py(), other.get());
        let (plan, options) = self.plan(other, options)?;
        let [a, b] = self.both(other, pose, own_pose)?;
        let mut hint = hint.map(|hint| hint.get().0.try_lock().map_err(|_busy| busy())).transpose()?;
        let hint = hint.as_deref_mut();
        let answer = ask(py, |scratch| {
            let pair = Pair::new(self.0.at(&a), other.0.at(&b)).within(&options.budget());
            match hint {
                Some(hint) => pair.hinted(hint).collide(&plan, scratch),
                None => pair.collide(&plan, scratch),
            }
        });
        Ok(Answer(AnswerRecord::new(&answer)))
    }

    /// Answer `collide` for many poses on all cores.
    ///
    /// `poses` and `own_poses` have shape (N, 4, 4); one of them may be a single pose. Returns a
    /// structured array of shape (N,) with the fields of an Answer. In it `verdict` is 1 for touching,
    /// 0 for apart and -1 for undecided; `evidence` is 1 for certified, 0 for estimated and -1 for
    /// none; missing lengths are NaN, missing indices -1.
    #[pyo3(signature = (other, poses, own_poses = None, **options))]
    fn collide_each<'py>(
        &self,
        other: &Bound<'py, Self>,
        poses: &Bound<'py, PyAny>,
        own_poses: Option<&Bound<'py, PyAny>>,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (py, other) = (other.py(), other.get());
        let (plan, options) = self.plan(other, options)?;
        let poses = [Poses::new(own_poses)?, Poses::new(Some(poses))?];
        let pairs = PosePairs::new(&poses, [&self.0, &other.0])?;
        each_answer(py, &pairs, |[a, b], scratch| {
            let pair = Pair::new(self.0.at(&a), other.0.at(&b)).within(&options.budget());
            AnswerRecord::new(&pair.collide(&plan, scratch))
        })
    }

    /// Bound the distance of this scan, at `own_pose`, and `other`, at `pose`: lower ≤ distance ≤
    /// upper.
    ///
    /// Poses have shape (4, 4). Options: `thickened`, `surface_only`, `work` and `seconds` as for
    /// `collide`, and `relative` (how far the lower bound may stay below the upper one, as a share of
    /// it; 0.1 by default). Returns a Distance; lengths are in the units of the world.
    #[pyo3(signature = (other, pose = None, own_pose = None, **options))]
    fn distance(
        &self,
        other: &Bound<'_, Self>,
        pose: Option<&Bound<'_, PyAny>>,
        own_pose: Option<&Bound<'_, PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Distance> {
        let (py, other) = (other.py(), other.get());
        let (plan, options) = self.distance_plan(other, options)?;
        let [a, b] = self.both(other, pose, own_pose)?;
        let distance = ask(py, |scratch| {
            Pair::new(self.0.at(&a), other.0.at(&b)).within(&options.budget()).distance(&plan, scratch)
        });
        Ok(Distance(DistanceRecord::new(&distance)))
    }

    /// Answer `distance` for many poses on all cores; see `collide_each`. Returns a structured array
    /// of shape (N,) with the fields of a Distance.
    #[pyo3(signature = (other, poses, own_poses = None, **options))]
    fn distance_each<'py>(
        &self,
        other: &Bound<'py, Self>,
        poses: &Bound<'py, PyAny>,
        own_poses: Option<&Bound<'py, PyAny>>,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (py, other) = (other.py(), other.get());
        let (plan, options) = self.distance_plan(other, options)?;
        let poses = [Poses::new(own_poses)?, Poses::new(Some(poses))?];
        let pairs = PosePairs::new(&poses, [&self.0, &other.0])?;
        each_distance(py, &pairs, |[a, b], scratch| {
            let pair = Pair::new(self.0.at(&a), other.0.at(&b)).within(&options.budget());
            DistanceRecord::new(&pair.distance(&plan, scratch))
        })
    }

    /// Return a contact of each pair of leaves that touch, as a structured array of shape (N,).
    ///
    /// Its fields are `point`, `normal_a`, `normal_b`, `residual`, `source_a` and `source_b`; sources
    /// are indices of the input points. Options are those of `collide`.
    #[pyo3(signature = (other, pose = None, own_pose = None, **options))]
    fn contacts<'py>(
        &self,
        other: &Bound<'py, Self>,
        pose: Option<&Bound<'py, PyAny>>,
        own_pose: Option<&Bound<'py, PyAny>>,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (py, other) = (other.py(), other.get());
        let (plan, options) = self.plan(other, options)?;
        let [a, b] = self.both(other, pose, own_pose)?;
        let mut found = Contacts::default();
        ask(py, |scratch| {
            let pair = Pair::new(self.0.at(&a), other.0.at(&b)).within(&options.budget());
            pair.contacts(&mut found).collide(&plan, scratch)
        });
        array(py, found.contacts.iter().map(ContactRecord::new).collect())
    }

    /// Return up to eight contact points for a physics solver, the deepest first, as a structured
    /// array of shape (N,).
    ///
    /// Its fields are `point`, `normal` (the direction in which this scan moves out of `other`), `gap`
    /// (negative for penetration), `source_a` and `source_b`. Options are those of `collide`.
    #[pyo3(signature = (other, pose = None, own_pose = None, *, hint = None, **options))]
    fn manifold<'py>(
        &self,
        other: &Bound<'py, Self>,
        pose: Option<&Bound<'py, PyAny>>,
        own_pose: Option<&Bound<'py, PyAny>>,
        hint: Option<&Bound<'py, Hint>>,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (py, other) = (other.py(), other.get());
        let (plan, options) = self.plan(other, options)?;
        let [a, b] = self.both(other, pose, own_pose)?;
        let mut hint = hint.map(|hint| hint.get().0.try_lock().map_err(|_busy| busy())).transpose()?;
        let hint = hint.as_deref_mut();
        let mut found = Vec::new();
        ask(py, |scratch| {
            let pair = Pair::new(self.0.at(&a), other.0.at(&b)).within(&options.budget());
            let question = pair.manifold(&mut found);
            match hint {
                Some(hint) => question.hinted(hint).collide(&plan, scratch),
                None => question.collide(&plan, scratch),
            }
        });
        array(py, found.iter().map(ManifoldRecord::new).collect())
    }

    /// List the places where this scan, at `own_pose`, touches `other`, at `pose`, or comes nearer than
    /// `clearance`: groups of contacts that are at most `link` apart.
    ///
    /// Returns a structured array of shape (N,), the hard clashes first, then the greatest ones. Its
    /// fields are `hard` (false if they only come nearer than the clearance), `centre` and `size` of the
    /// box about the contacts, `lower` and `upper` (bounds of the least distance), `evidence`,
    /// `contacts` and `surroundings` (their numbers), and of the best contact `point`, `residual`,
    /// `source_a` and `source_b`. Options: `thickened` and `surface_only`. Warns if the clearance is so
    /// great that the search ended early.
    #[pyo3(signature = (other, pose = None, own_pose = None, *, clearance = 0.0, link = None, **options))]
    #[expect(clippy::too_many_arguments, reason = "names in Python")]
    fn clashes<'py>(
        &self,
        other: &Bound<'py, Self>,
        pose: Option<&Bound<'py, PyAny>>,
        own_pose: Option<&Bound<'py, PyAny>>,
        clearance: f64,
        link: Option<f64>,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (py, other) = (other.py(), other.get());
        let options = Options::new(options, OF_MEANING, &self.0)?;
        let asked =
            ClashOptions::default().with_clearance(clearance).with_semantics(options.collide.semantics);
        let asked = link.map_or(asked, |link| asked.with_link(link));
        let plan = ClashPlan::new(&asked, &self.0, &other.0).map_err(refused)?;
        let [a, b] = self.both(other, pose, own_pose)?;
        let found = ask(py, |scratch| Pair::new(self.0.at(&a), other.0.at(&b)).clashes(&plan, scratch));
        if !found.complete {
            let what = c"the search ended early, so clashes may be missing; ask for a smaller clearance";
            PyErr::warn(py, &py.get_type::<PyRuntimeWarning>(), what, 1)?;
        }
        array(py, found.clashes.iter().map(|clash| ClashRecord::new(clash, &found.contacts)).collect())
    }

    /// Find all curves in which the surfaces of this scan, at `own_pose`, and of `other`, at `pose`,
    /// intersect.
    ///
    /// Returns a list of arrays of shape (N, 3), one for each curve; the last point of a closed one is
    /// its first. `spacing` is the distance of successive points (by default two sampling radii),
    /// `tolerance` the greatest distance from either surface.
    #[pyo3(signature = (other, pose = None, own_pose = None, *, spacing = None, tolerance = None))]
    fn curves<'py>(
        &self,
        other: &Bound<'py, Self>,
        pose: Option<&Bound<'py, PyAny>>,
        own_pose: Option<&Bound<'py, PyAny>>,
        spacing: Option<f64>,
        tolerance: Option<f64>,
    ) -> PyResult<Vec<Bound<'py, PyAny>>> {
        let (py, other) = (other.py(), other.get());
        let mut options = CurveOptions::default();
        (options.spacing, options.tolerance) = (spacing, tolerance);
        let plan = CurvePlan::new(&options, &self.0, &other.0).map_err(refused)?;
        let [a, b] = self.both(other, pose, own_pose)?;
        let mut found = Curves::default();
        ask(py, |scratch| Pair::new(self.0.at(&a), other.0.at(&b)).curves(&plan, &mut found, scratch));
        let points = |curve: &nearmiss::Curve| {
            let points = &found.points[curve.first..][..curve.count];
            let again = points.first().filter(|_| curve.is_closed());
            let flat: Vec<f64> = points.iter().chain(again).flatten().copied().collect();
            let count = flat.len() / 3;
            rows(py, flat, &[count, 3])
        };
        found.curves.iter().map(points).collect()
    }

    /// Place the scan at `pose` of shape (4, 4), for questions about shapes and rays.
    ///
    /// Options: `margin`, `thickened`, `surface_only`, `evidence` and `detail`, as for `collide`.
    #[pyo3(signature = (pose = None, **options))]
    fn target(
        &self,
        pose: Option<&Bound<'_, PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Target> {
        let options = Options::new(options, OF_SHAPES, &self.0)?;
        Target::new(&self.0, Poses::new(pose)?.one(&self.0)?, &options)
    }
}
