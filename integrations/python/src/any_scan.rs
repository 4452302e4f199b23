//! Methods of `AnyScan`: the questions about scans, still or moving.

use nearmiss::{
    ClashOptions, ClashPlan, CollidePlan, Contacts, CurveOptions, CurvePlan, Curves, MeshScanPair,
    MeshScanPlan, Pose, Prepared as _,
};
use pyo3::exceptions::PyRuntimeWarning;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::answers::{Answer, AnswerRecord, ClashRecord, ContactRecord, Distance, ManifoldRecord};
use crate::cloud::rows;
use crate::failure::refused;
use crate::frame::Frame;
use crate::hint::Hint;
use crate::options::{OF_MEANING, OF_SCANS, OF_SHAPES, Options, may_have_ended};
use crate::pair::{Apart, Contact, Overlap, Question, interiors, pair_of};
use crate::penetration::Penetration;
use crate::pool::ask;
use crate::poses::{Poses, both};
use crate::record::array;
use crate::target::Target;
use crate::things::{AnyScan, Mesh, Side, Thing};

impl AnyScan {
    /// Prepares a question about this scan and another thing.
    fn ask<'a, Q: Question<'a>>(
        &'a self,
        py: Python<'_>,
        other: &'a Thing<'_>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Q> {
        Q::new([Side::Scan(self.0.frame(py)), other.side()], options)
    }

    /// Returns this scan and another one as they are now.
    fn scans<'a>(&'a self, other: &'a Bound<'_, Self>) -> [Frame<'a>; 2] {
        [self, other.get()].map(|scan| scan.0.frame(other.py()))
    }
}

/// Returns the one pose of each of two scans.
fn poses_of(scans: &[Frame<'_>; 2], poses: [Option<&Bound<'_, PyAny>>; 2]) -> PyResult<[Pose; 2]> {
    both(scans.each_ref().map(|scan| &**scan as _), poses)
}

#[pymethods]
impl AnyScan {
    fn __len__(&self, py: Python<'_>) -> usize {
        self.0.frame(py).len()
    }

    /// The least and the greatest corner of the points, of shape (2, 3). The obstacle, and so a hit of a ray,
    /// may exceed them by up to `reach`.
    #[getter]
    fn bounds<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let scan = self.0.frame(py);
        let bounds = scan.bounds();
        rows(py, [bounds.min, bounds.max].concat(), &[2, 3])
    }

    /// The 0.9-quantile of the local radii, a length.
    #[getter]
    fn sampling_radius(&self, py: Python<'_>) -> f64 {
        self.0.frame(py).sampling_radius()
    }

    /// The widest gap that is bridged, a length.
    #[getter]
    fn reach(&self, py: Python<'_>) -> f64 {
        self.0.frame(py).reach()
    }

    /// True if the normals point outwards, as with `graph`.
    #[getter]
    fn is_oriented(&self, py: Python<'_>) -> bool {
        self.0.frame(py).is_oriented()
    }

    /// The share of points that sample a sheet.
    #[getter]
    fn usable(&self, py: Python<'_>) -> f64 {
        self.0.frame(py).usable()
    }

    /// The numbers of input points that were dropped: those not finite, and duplicates.
    #[getter]
    fn dropped(&self, py: Python<'_>) -> (usize, usize) {
        let dropped = self.0.frame(py).dropped();
        (dropped.not_finite, dropped.duplicate)
    }

    /// The points in the order of the scan, of shape (N, 3).
    #[getter]
    fn points<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let scan = self.0.frame(py);
        let frame = scan.frame();
        let flat: Vec<f64> = scan.positions().iter().flat_map(|&p| frame.to_world(p)).collect();
        rows(py, flat, &[scan.len(), 3])
    }

    /// The normals in the order of the scan, of shape (N, 3).
    #[getter]
    fn normals<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let scan = self.0.frame(py);
        rows(py, scan.normals().as_flattened().to_vec(), &[scan.len(), 3])
    }

    /// The index in the input of each point, of shape (N,).
    #[getter]
    fn sources<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let scan = self.0.frame(py);
        rows(py, scan.source().to_vec(), &[scan.len()])
    }

    /// Decide whether this scan, at `own_pose`, touches `other`, at `pose`: any scan, or a Mesh.
    ///
    /// Poses have shape (4, 4); the default is the identity. Options: `margin` (a length: nearer counts
    /// as touching), `thickened` (compare balls of this radius about the points), `surface_only`
    /// (ignore points that sample no surface), `evidence` ("certified" or "estimated"), `detail`
    /// ("witness" or "verdict"), and budgets: `work` (units of work), `seconds`. A `hint` speeds up
    /// the next similar question about two scans. Returns an Answer, in which the source of a mesh is the
    /// index of a triangle. Takes microseconds.
    #[pyo3(signature = (other, pose = None, own_pose = None, *, hint = None, **options))]
    #[expect(clippy::too_many_arguments, reason = "names in Python")]
    fn collide(
        &self,
        py: Python<'_>,
        other: Thing<'_>,
        pose: Option<&Bound<'_, PyAny>>,
        own_pose: Option<&Bound<'_, PyAny>>,
        hint: Option<&Bound<'_, Hint>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Answer> {
        let question: Contact<'_> = self.ask(py, &other, options)?;
        let record = match hint {
            None => question.one(py, [own_pose, pose]),
            Some(hint) => question.hinted(py, [own_pose, pose], &mut *hint.get().lock()?),
        };
        record.map(Answer)
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
        other: Thing<'py>,
        poses: &Bound<'py, PyAny>,
        own_poses: Option<&Bound<'py, PyAny>>,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let py = poses.py();
        self.ask::<Contact<'_>>(py, &other, options)?.each(py, [own_poses, Some(poses)])
    }

    /// Bound the distance of this scan, at `own_pose`, and `other`, at `pose`, any scan or a Mesh:
    /// lower ≤ distance ≤ upper.
    ///
    /// Poses have shape (4, 4). Options: `thickened`, `surface_only`, `work` and `seconds` as for
    /// `collide`, and `relative` (how far the lower bound may stay below the upper one, as a share of
    /// it; 0.1 by default). Returns a Distance; lengths are in the units of the world.
    #[pyo3(signature = (other, pose = None, own_pose = None, **options))]
    fn distance(
        &self,
        py: Python<'_>,
        other: Thing<'_>,
        pose: Option<&Bound<'_, PyAny>>,
        own_pose: Option<&Bound<'_, PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Distance> {
        self.ask::<Apart<'_>>(py, &other, options)?.one(py, [own_pose, pose]).map(Distance)
    }

    /// Answer `distance` for many poses on all cores; see `collide_each`. Returns a structured array
    /// of shape (N,) with the fields of a Distance.
    #[pyo3(signature = (other, poses, own_poses = None, **options))]
    fn distance_each<'py>(
        &self,
        other: Thing<'py>,
        poses: &Bound<'py, PyAny>,
        own_poses: Option<&Bound<'py, PyAny>>,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let py = poses.py();
        self.ask::<Apart<'_>>(py, &other, options)?.each(py, [own_poses, Some(poses)])
    }

    /// Find a contact of each pair of leaves that touch. Returns the Answer and the contacts, as a structured
    /// array of shape (N,). Contacts may be missing if `Answer.complete` is False.
    ///
    /// The fields of the array are `point`, `normal_a`, `normal_b`, `residual`, `source_a` and `source_b`;
    /// sources are indices of the input points, or of the triangles of a Mesh. Options are those of
    /// `collide`.
    #[pyo3(signature = (other, pose = None, own_pose = None, **options))]
    fn contacts<'py>(
        &self,
        py: Python<'py>,
        other: Thing<'py>,
        pose: Option<&Bound<'py, PyAny>>,
        own_pose: Option<&Bound<'py, PyAny>>,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<(Answer, Bound<'py, PyAny>)> {
        let scan = self.0.frame(py);
        let options = Options::new(options, OF_SCANS, scan.metric())?;
        let mut found = Contacts::default();
        let answer = match other.side() {
            Side::Scan(other) => {
                let scans = [scan, other];
                let plan = CollidePlan::new(&options.collide, &scans[0], &scans[1]).map_err(refused)?;
                let poses = poses_of(&scans, [own_pose, pose])?;
                ask(py, |scratch| {
                    let pair = pair_of(&scans, &poses).within(&options.budget());
                    pair.contacts(&mut found).collide(&plan, scratch)
                })
            }
            Side::Mesh(Mesh { mesh, .. }) => {
                let plan = MeshScanPlan::new(&options.collide, &scan).map_err(refused)?;
                let [at, of_mesh] = both([&*scan, mesh], [own_pose, pose])?;
                ask(py, |scratch| {
                    let pair = MeshScanPair::new(scan.at(&at), mesh.at(&of_mesh)).within(&options.budget());
                    pair.contacts(&plan, &mut found, scratch)
                })
            }
        };
        let answer = Answer(AnswerRecord::new(&answer).with_list(found.complete));
        Ok((answer, array(py, found.contacts.iter().map(ContactRecord::new).collect())?))
    }

    /// Find up to eight contact points for a physics solver. Returns the Answer and the points, as a
    /// structured array of shape (N,). The first is the deepest; each of the others is the candidate furthest
    /// from all earlier ones. If `Answer.complete` is False, a limit may have ended the search before it knew
    /// all candidates.
    ///
    /// The fields of the array are `point`, `normal` (the direction in which this scan moves out of `other`),
    /// `gap` (negative for penetration), `source_a` and `source_b`. Options are those of `collide`.
    #[pyo3(signature = (other, pose = None, own_pose = None, *, hint = None, **options))]
    fn manifold<'py>(
        &self,
        other: &Bound<'py, Self>,
        pose: Option<&Bound<'py, PyAny>>,
        own_pose: Option<&Bound<'py, PyAny>>,
        hint: Option<&Bound<'py, Hint>>,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<(Answer, Bound<'py, PyAny>)> {
        let (py, scans) = (other.py(), self.scans(other));
        let options = Options::new(options, OF_SCANS, scans[0].metric())?;
        let plan = CollidePlan::new(&options.collide, &scans[0], &scans[1]).map_err(refused)?;
        let poses = poses_of(&scans, [own_pose, pose])?;
        let mut hint = hint.map(|hint| hint.get().lock()).transpose()?;
        let hint = hint.as_deref_mut();
        let mut found = Vec::new();
        let answer = ask(py, |scratch| {
            let budget = options.budget();
            let pair = pair_of(&scans, &poses).within(&budget);
            let question = pair.manifold(&mut found);
            let answer = match hint {
                Some(hint) => question.hinted(hint).collide(&plan, scratch),
                None => question.collide(&plan, scratch),
            };
            let record = AnswerRecord::new(&answer);
            // The points are looked for after the verdict, with the rest of the budget.
            let has_points = answer.verdict.is_intersecting();
            if has_points { record.with_list(!may_have_ended(&budget, &answer.statistics)) } else { record }
        });
        Ok((Answer(answer), array(py, found.iter().map(ManifoldRecord::new).collect())?))
    }

    /// Bound the length of the shortest move that takes `other`, at `pose`, out of this scan, at
    /// `own_pose`. `other` is any scan or a Mesh. `solid` names the scans whose surface encloses a solid:
    /// "a" for this scan, "b" for `other`, or "both". Closed parts of a mesh are solid anyway.
    ///
    /// Returns a Penetration: `other` is free if it moves by `upper` along `direction`, and no move shorter
    /// than `lower` frees it. Both are 0 for separate things; `lower` is 0 if neither is solid and no points
    /// are thickened. Options are those of `collide`.
    #[pyo3(signature = (other, pose = None, own_pose = None, *, solid = None, **options))]
    #[expect(clippy::too_many_arguments, reason = "names in Python")]
    fn penetration(
        &self,
        py: Python<'_>,
        other: Thing<'_>,
        pose: Option<&Bound<'_, PyAny>>,
        own_pose: Option<&Bound<'_, PyAny>>,
        solid: Option<&str>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Penetration> {
        let sides = [Side::Scan(self.0.frame(py)), other.side()];
        Overlap::new(sides, solid, options)?.one(py, [own_pose, pose])
    }

    /// List the places where this scan, at `own_pose`, touches `other`, at `pose`, or comes nearer than
    /// `clearance`: groups of contacts that are at most `link` apart. With `depth`, hard clashes tell how
    /// far `other` must move out of each. `solid` names the scans whose surface encloses a solid, "a" for
    /// this scan, "b" for `other`, or "both", and asks for depths as well.
    ///
    /// Returns a structured array of shape (N,), the hard clashes first, then the greatest ones. Its
    /// fields are `hard` (false if they only come nearer than the clearance), `centre` and `size` of the
    /// box about the contacts, `lower` and `upper` (bounds of the least distance), `depth` (the length of a
    /// move of `other` out of the clash, along `depth_direction`), `depth_lower` (no shorter move does;
    /// all three are NaN where no depth is known), `evidence`, `contacts` and `surroundings` (their
    /// numbers), and of the best contact `point`, `residual`, `source_a` and `source_b`. Options:
    /// `thickened` and `surface_only`. Warns if the clearance is so great that the search ended early.
    #[pyo3(signature = (
        other, pose = None, own_pose = None, *, clearance = 0.0, link = None, depth = false, solid = None, **options
    ))]
    #[expect(clippy::too_many_arguments, reason = "names in Python")]
    fn clashes<'py>(
        &self,
        other: &Bound<'py, Self>,
        pose: Option<&Bound<'py, PyAny>>,
        own_pose: Option<&Bound<'py, PyAny>>,
        clearance: f64,
        link: Option<f64>,
        depth: bool,
        solid: Option<&str>,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (py, scans) = (other.py(), self.scans(other));
        let options = Options::new(options, OF_MEANING, scans[0].metric())?;
        let asked =
            ClashOptions::default().with_clearance(clearance).with_semantics(options.collide.semantics);
        let asked = link.map_or(asked, |link| asked.with_link(link));
        let insides = interiors(solid, [true; 2])?;
        let asked = if depth || solid.is_some() { asked.with_depths(insides) } else { asked };
        let plan = ClashPlan::new(&asked, &scans[0], &scans[1]).map_err(refused)?;
        let poses = poses_of(&scans, [own_pose, pose])?;
        let found = ask(py, |scratch| pair_of(&scans, &poses).clashes(&plan, scratch));
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
        let (py, scans) = (other.py(), self.scans(other));
        let mut options = CurveOptions::default();
        (options.spacing, options.tolerance) = (spacing, tolerance);
        let plan = CurvePlan::new(&options, &scans[0], &scans[1]).map_err(refused)?;
        let poses = poses_of(&scans, [own_pose, pose])?;
        let mut found = Curves::default();
        ask(py, |scratch| pair_of(&scans, &poses).curves(&plan, &mut found, scratch));
        let points = |curve: &nearmiss::Curve| {
            let points = &found.points[curve.first..][..curve.count];
            let again = points.first().filter(|_| curve.is_closed());
            let flat: Vec<f64> = points.iter().chain(again).flatten().copied().collect();
            let count = flat.len() / 3;
            rows(py, flat, &[count, 3])
        };
        found.curves.iter().map(points).collect()
    }

    /// Place the scan at `pose` of shape (4, 4), for questions about shapes and rays. The target of a
    /// moving scan follows its frames.
    ///
    /// Options: `margin`, `thickened`, `surface_only`, `evidence` and `detail`, as for `collide`.
    #[pyo3(signature = (pose = None, **options))]
    fn target(
        &self,
        py: Python<'_>,
        pose: Option<&Bound<'_, PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Target> {
        let scan = self.0.frame(py);
        let options = Options::new(options, OF_SHAPES, scan.metric())?;
        Target::new(py, &self.0, Poses::new(pose)?.one(&*scan)?, options.collide)
    }
}
