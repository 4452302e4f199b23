//! `Target`: a placed scan against shapes and rays.

use nearmiss::{
    CollideOptions, Detail, Evidence, Interior, Pose, Prepared as _, Ray, Scratch, Semantics, ShapePlan,
    ShapeVerdict,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{Points, vector, wrong_shape};
use crate::failure::refused;
use crate::frame::{Frame, Source};
use crate::hint::ShapeHint;
use crate::options::{OF_BUDGET, Options};
use crate::penetration::{Penetration, PenetrationRecord};
use crate::pool::{ask, ask_each};
use crate::record::{Record, array};
use crate::shape::Shape;
use crate::shape_answers::{
    RayAnswer, RayRecord, ShapeAnswer, ShapeContactRecord, ShapeDistance, ShapeDistanceRecord, ShapeRecord,
};
use crate::sweep::{SweepAnswer, SweepRecord, motion};

/// A placed scan, with the meaning of options. If the scan moves, each question is about its frame then.
#[pyclass(frozen, module = "nearmiss")]
#[derive(Debug)]
pub(crate) struct Target {
    source: Source,
    pose: Pose,
    options: CollideOptions,
}

/// The scan of a target as it is now.
struct Now<'a> {
    frame: Frame<'a>,
    pose: Pose,
    plan: ShapePlan,
}

impl Now<'_> {
    fn target(&self) -> nearmiss::Target<'_> {
        self.by(&self.plan)
    }

    fn by(&self, plan: &ShapePlan) -> nearmiss::Target<'_> {
        nearmiss::Target::new(self.frame.at(&self.pose), plan)
    }

    /// Prepares questions about distances up to `reach`.
    fn within(&self, reach: f64) -> PyResult<Within<'_>> {
        if reach.is_nan() || reach < 0.0 {
            return Err(refused(format!("expected a reach of at least 0, got {reach}")));
        }
        let options = self.plan.options();
        let is_exact = matches!(options.semantics, Semantics::Thickened(_));
        let is_proven = is_exact || options.evidence == Evidence::Certified;
        let beyond = if is_proven && reach.is_finite() {
            let asked = options.with_margin(reach).with_detail(Detail::Verdict);
            Some(self.by(&ShapePlan::new(&asked, &self.frame).map_err(refused)?))
        } else {
            None
        };
        Ok(Within { target: self.target(), reach, beyond })
    }
}

/// Questions about distances up to a reach.
struct Within<'a> {
    target: nearmiss::Target<'a>,
    reach: f64,
    /// The target with the reach as its margin; `None` if nothing is proven about what is beyond the reach.
    beyond: Option<nearmiss::Target<'a>>,
}

impl Within<'_> {
    fn distance(&self, shape: &nearmiss::Shape<'_>, scratch: &mut Scratch) -> ShapeDistanceRecord {
        match self.target.distance(shape, self.reach, scratch) {
            Some(found) => ShapeDistanceRecord::new(&found),
            None => ShapeDistanceRecord::beyond(self.lower(shape, scratch)),
        }
    }

    /// Returns a lower bound of the distance of a shape that is further than the reach from all discs and
    /// balls: the reach, unless the obstacle may be nearer than its discs. 0 for an invalid shape.
    fn lower(&self, shape: &nearmiss::Shape<'_>, scratch: &mut Scratch) -> f64 {
        let Some(beyond) = &self.beyond else { return 0.0 };
        match beyond.touch(shape, scratch).verdict {
            ShapeVerdict::Separated { evidence: Evidence::Certified } => self.reach,
            _ => {
                let found = self.target.distance(shape, f64::INFINITY, scratch);
                found.map_or(0.0, |found| found.lower.min(self.reach))
            }
        }
    }
}

impl Target {
    /// Places a scan. Fails if an option is out of range.
    pub(crate) fn new(
        py: Python<'_>,
        source: &Source,
        pose: Pose,
        options: CollideOptions,
    ) -> PyResult<Self> {
        let target = Self { source: source.clone(), pose, options };
        target.now(py)?;
        Ok(target)
    }

    fn now(&self, py: Python<'_>) -> PyResult<Now<'_>> {
        let frame = self.source.frame(py);
        let plan = ShapePlan::new(&self.options, &frame).map_err(refused)?;
        Ok(Now { frame, pose: self.pose, plan })
    }

    /// Reads one ray.
    fn ray(origin: &Bound<'_, PyAny>, direction: &Bound<'_, PyAny>, max: f64, radius: f64) -> PyResult<Ray> {
        check_lengths(max, radius)?;
        made([vector(origin, "the origin")?, vector(direction, "the direction")?], [max, radius], 0)
    }

    /// Reads rays from arrays of shape (N, 3), one of which may have shape (3,).
    fn rays(
        origins: &Bound<'_, PyAny>,
        directions: &Bound<'_, PyAny>,
        max: f64,
        radius: f64,
    ) -> PyResult<Vec<Ray>> {
        check_lengths(max, radius)?;
        let read = |given: &Bound<'_, PyAny>| match given.extract::<[f64; 3]>() {
            Ok(one) => Ok(vec![one]),
            Err(_) => Points::new(given)?.to_doubles(),
        };
        let (starts, ways) = (read(origins)?, read(directions)?);
        let count = if starts.len() == 1 { ways.len() } else { starts.len() };
        if ways.len() != count && ways.len() != 1 {
            let expected = format!("directions of shape ({count}, 3), one for each origin");
            return Err(wrong_shape(&expected, directions));
        }
        let one_of = |all: &[[f64; 3]], i: usize| all[if all.len() == 1 { 0 } else { i }];
        (0..count).map(|i| made([one_of(&starts, i), one_of(&ways, i)], [max, radius], i)).collect()
    }
}

/// Asks about each of a sequence of shapes.
fn each<'py, R: Record + Send>(
    given: &Bound<'py, PyAny>,
    question: impl Fn(&nearmiss::Shape<'_>, &mut Scratch) -> R + Sync,
) -> PyResult<Bound<'py, PyAny>> {
    let kept: Vec<Bound<'py, Shape>> = given.extract().map_err(|_cause| {
        refused("expected a sequence of Shape, got something else; make them, as by Shape.sphere")
    })?;
    let shapes: Vec<nearmiss::Shape<'_>> = kept.iter().map(|shape| shape.get().convex()).collect();
    let answers = ask_each(given.py(), shapes.len(), |i, scratch| question(&shapes[i], scratch));
    array(given.py(), answers?)
}

/// Checks the greatest length and the radius of rays.
fn check_lengths(max: f64, radius: f64) -> PyResult<()> {
    if max.is_nan() || max < 0.0 {
        return Err(refused(format!("expected a greatest length of rays of at least 0, got {max}")));
    }
    if !(radius >= 0.0 && radius.is_finite()) {
        return Err(refused(format!("expected a finite radius of rays of at least 0, got {radius}")));
    }
    Ok(())
}

/// Makes the `i`-th ray.
fn made([origin, way]: [[f64; 3]; 2], [max, radius]: [f64; 2], i: usize) -> PyResult<Ray> {
    if !origin.iter().chain(&way).all(|c| c.is_finite()) || way == [0.0; 3] {
        return Err(refused(format!(
            "expected a finite origin and a finite direction other than 0, got {origin:?} and {way:?} (ray {i})"
        )));
    }
    Ok(Ray::new(origin, way).with_max(max).with_radius(radius))
}

#[pymethods]
impl Target {
    fn __repr__(&self, py: Python<'_>) -> String {
        format!("<Target: {} points at {:?}>", self.source.frame(py).len(), self.pose.translation())
    }

    /// Decide whether a shape touches the scan. Returns a `ShapeAnswer`.
    fn touch(&self, shape: &Bound<'_, Shape>) -> PyResult<ShapeAnswer> {
        let (py, convex) = (shape.py(), shape.get().convex());
        let now = self.now(py)?;
        Ok(ShapeAnswer(ask(py, |scratch| ShapeRecord::new(&now.target().touch(&convex, scratch)))))
    }

    /// Answer `touch` for a sequence of shapes on all cores. Returns a structured array of shape (N,)
    /// with the fields of a `ShapeAnswer`.
    fn touch_each<'py>(&self, shapes: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let now = self.now(shapes.py())?;
        let target = now.target();
        each(shapes, |shape, scratch| ShapeRecord::new(&target.touch(shape, scratch)))
    }

    /// Bound the distance of a shape and the scan: lower ≤ distance ≤ upper. If nothing is within the length
    /// `within`, the upper bound is infinite, and the lower one at most `within`. Returns a `ShapeDistance`.
    #[pyo3(signature = (shape, within = f64::INFINITY))]
    fn distance(&self, shape: &Bound<'_, Shape>, within: f64) -> PyResult<ShapeDistance> {
        let (py, convex) = (shape.py(), shape.get().convex());
        let now = self.now(py)?;
        let question = now.within(within)?;
        Ok(ShapeDistance(ask(py, |scratch| question.distance(&convex, scratch))))
    }

    /// Answer `distance` for a sequence of shapes on all cores. Returns a structured array of shape
    /// (N,) with the fields of a `ShapeDistance`.
    #[pyo3(signature = (shapes, within = f64::INFINITY))]
    fn distance_each<'py>(&self, shapes: &Bound<'py, PyAny>, within: f64) -> PyResult<Bound<'py, PyAny>> {
        let now = self.now(shapes.py())?;
        let question = now.within(within)?;
        each(shapes, |shape, scratch| question.distance(shape, scratch))
    }

    /// Return up to eight contacts of a shape, as a structured array of shape (N,). The first is the
    /// deepest; the others are spread out, at least half a local radius apart. No limit ends the search
    /// early; `touch` tells the evidence of a contact.
    ///
    /// Its fields are `point`, `normal` (the direction in which the shape moves out), `depth` (negative
    /// for a gap within the margin) and `id`, which stays the same from frame to frame with a `hint`.
    #[pyo3(signature = (shape, *, hint = None))]
    fn contacts<'py>(
        &self,
        py: Python<'py>,
        shape: &Bound<'py, Shape>,
        hint: Option<&Bound<'py, ShapeHint>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (now, shape) = (self.now(py)?, shape.get().convex());
        let mut hint = hint.map(|hint| hint.get().lock()).transpose()?;
        let hint = hint.as_deref_mut();
        let mut found = Vec::new();
        ask(py, |scratch| match hint {
            Some(hint) => now.target().contacts_hinted(&shape, hint, &mut found, scratch),
            None => now.target().contacts(&shape, &mut found, scratch),
        });
        array(py, found.iter().map(ShapeContactRecord::new).collect())
    }

    /// Bound the length of the shortest move that takes a shape out of the scan. With `solid`, the surface
    /// of the scan encloses a solid; otherwise the way out may lead to either side.
    ///
    /// Returns a `Penetration`: the shape is free if it moves by `upper` along `direction`, and no move
    /// shorter than `lower` frees it. Both are 0 for a shape that touches nothing. Options are `work` (a test
    /// of the shape is one unit) and `seconds`.
    #[pyo3(signature = (shape, *, solid = false, **options))]
    fn penetration(
        &self,
        shape: &Bound<'_, Shape>,
        solid: bool,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Penetration> {
        let (py, convex) = (shape.py(), shape.get().convex());
        let now = self.now(py)?;
        let options = Options::new(options, OF_BUDGET, now.frame.metric())?;
        let interior = if solid { Interior::Solid } else { Interior::Hollow };
        let found =
            ask(py, |scratch| now.target().penetration(&convex, interior, &options.budget(), scratch));
        Ok(Penetration(PenetrationRecord::new(&found)))
    }

    /// Prove that a shape stays clear of the scan during a whole motion, by more than the margin, or find the
    /// first impact.
    ///
    /// The shape moves through the poses `path`, of shape (N, 4, 4), by screws; pose k is reached at time k.
    /// Returns a `SweepAnswer`, whose times count poses. Options are `work` (a distance query is one unit)
    /// and `seconds`.
    #[pyo3(signature = (shape, path, **options))]
    fn sweep(
        &self,
        shape: &Bound<'_, Shape>,
        path: &Bound<'_, PyAny>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<SweepAnswer> {
        let (py, convex, way) = (shape.py(), shape.get().convex(), motion(Some(path), Pose::from_matrix)?);
        let now = self.now(py)?;
        let options = Options::new(options, OF_BUDGET, now.frame.metric())?;
        let answer = ask(py, |scratch| now.target().sweep_within(&convex, &way, &options.budget(), scratch));
        Ok(SweepAnswer(SweepRecord::of_shape(&answer, way.duration())))
    }

    /// Find the first place where a ray, or a ball of `radius` along it, hits the scan.
    ///
    /// `origin` and `direction` have shape (3,); the direction need not be a unit vector. `max` is the
    /// greatest length. Returns a `RayAnswer`, whose `t` is a length, not a multiple of the direction.
    #[pyo3(signature = (origin, direction, *, max = f64::INFINITY, radius = 0.0))]
    fn cast(
        &self,
        origin: &Bound<'_, PyAny>,
        direction: &Bound<'_, PyAny>,
        max: f64,
        radius: f64,
    ) -> PyResult<RayAnswer> {
        let (py, ray) = (origin.py(), Self::ray(origin, direction, max, radius)?);
        let now = self.now(py)?;
        Ok(RayAnswer(ask(py, |scratch| RayRecord::new(&now.target().cast(&ray, scratch)))))
    }

    /// Answer `cast` for many rays on all cores. `origins` and `directions` have shape (N, 3); one of
    /// them may have shape (3,). Returns a structured array of shape (N,) with the fields of a
    /// `RayAnswer`; `t` is NaN where nothing is hit.
    #[pyo3(signature = (origins, directions, *, max = f64::INFINITY, radius = 0.0))]
    fn cast_each<'py>(
        &self,
        origins: &Bound<'py, PyAny>,
        directions: &Bound<'py, PyAny>,
        max: f64,
        radius: f64,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (py, rays) = (origins.py(), Self::rays(origins, directions, max, radius)?);
        let now = self.now(py)?;
        let target = now.target();
        array(py, ask_each(py, rays.len(), |i, scratch| RayRecord::new(&target.cast(&rays[i], scratch)))?)
    }

    /// Return all places where one ray hits the scan, the nearest first, as a structured array of
    /// shape (N,) with the fields of a `RayAnswer`.
    #[pyo3(signature = (origin, direction, *, max = f64::INFINITY, radius = 0.0))]
    fn cast_all<'py>(
        &self,
        origin: &Bound<'py, PyAny>,
        direction: &Bound<'py, PyAny>,
        max: f64,
        radius: f64,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (py, ray) = (origin.py(), Self::ray(origin, direction, max, radius)?);
        let now = self.now(py)?;
        let mut found = Vec::new();
        ask(py, |scratch| now.target().cast_all(&ray, &mut found, scratch));
        let record = |hit: &nearmiss::RayHit| {
            RayRecord::new(&nearmiss::RayAnswer { hit: Some(*hit), evidence: hit.evidence })
        };
        array(py, found.iter().map(record).collect())
    }
}
