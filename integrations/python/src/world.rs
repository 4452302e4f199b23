//! `World`: many placed scans, meshes and convex shapes.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use nearmiss::{
    AsShape, Bodies, Body, BodyId, BodyInterior, BodyPair, CollideOptions, CollidePlan, DistanceOptions,
    DistancePlan, Interior, Mesh as PreparedMesh, MeshScanPlan, Metric, PlacedBody, Pose,
    Scan as PreparedScan, Scratch, Shape as Convex, ShapePlan, World as Crowd,
};
use pyo3::exceptions::{PyKeyError, PyTypeError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::answers::{AnswerRecord, Distance, DistanceRecord, PairRecord as _};
use crate::cloud::rows;
use crate::failure::refused;
use crate::options::{OF_DISTANCE, OF_NEAREST, OF_SCANS, Options};
use crate::pair::interiors;
use crate::penetration::{Penetration, PenetrationRecord};
use crate::pool::{ask, ask_each};
use crate::poses::Poses;
use crate::record::array;
use crate::scan::Scan;
use crate::shape::Shape;
use crate::things::Mesh;

/// The bodies of a world.
type Placed = Crowd<PreparedScan, PreparedMesh, Arc<Shape>>;

/// Placed scans, meshes and shapes, each with an id.
#[pyclass(frozen, module = "nearmiss")]
#[derive(Debug)]
pub(crate) struct World(Mutex<Latest>);

/// The bodies as they are now.
#[derive(Debug)]
struct Latest {
    /// Shared with questions in progress. A change copies the bodies first if there is one.
    bodies: Arc<Placed>,
    /// Ids from this one on have not been given to a body.
    next: u64,
}

impl AsShape for Shape {
    fn as_shape(&self) -> Convex<'_> {
        self.convex()
    }
}

/// The plans of questions about touches.
struct Plans {
    collide: CollidePlan,
    /// The plans about a scan and something else, if there is a scan.
    of_scan: Option<(MeshScanPlan, ShapePlan)>,
}

impl Plans {
    fn new(world: &Placed, options: &Options, metric: Metric) -> PyResult<Self> {
        let collide = CollidePlan::of_metric(&options.collide, metric).map_err(refused)?;
        let scan = world.ids().find_map(|id| world.placed(id));
        let of_scan = scan.map(|scan| {
            let of_mesh = MeshScanPlan::new(&options.collide, scan.scan())?;
            Ok((of_mesh, ShapePlan::new(&options.collide, scan.scan())?))
        });
        Ok(Self { collide, of_scan: of_scan.transpose().map_err(|e: nearmiss::PlanError| refused(e))? })
    }

    /// Answers whether two bodies touch.
    fn ask(&self, pair: &BodyPair<'_>, scratch: &mut Scratch) -> AnswerRecord {
        let swapped = |record: AnswerRecord, is_swapped| if is_swapped { record.swapped() } else { record };
        match (pair, &self.of_scan) {
            (BodyPair::Scans(pair), _) => AnswerRecord::new(&pair.collide(&self.collide, scratch)),
            (BodyPair::MeshAndScan { pair, mesh_is_first }, Some((plan, _))) => {
                swapped(AnswerRecord::new(&pair.collide(plan, scratch)), *mesh_is_first)
            }
            (BodyPair::Meshes(pair), _) if self.collide.reach() == 0.0 => {
                AnswerRecord::of_meshes(&pair.collide(scratch.meshes()))
            }
            (BodyPair::ShapeAndScan { pair, shape_is_first }, Some((_, plan))) => {
                swapped(AnswerRecord::of_shape(&pair.touch(plan, scratch)), *shape_is_first)
            }
            _ => AnswerRecord::of_bodies(&pair.touch(&self.collide, scratch)),
        }
    }
}

fn no_body(id: u64) -> PyErr {
    PyKeyError::new_err(format!("expected the id of a body of this world, got {id}; `ids` lists them"))
}

impl World {
    fn lock(&self) -> MutexGuard<'_, Latest> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns the bodies as they are now. Other threads can change the world meanwhile.
    fn now(&self) -> Arc<Placed> {
        Arc::clone(&self.lock().bodies)
    }

    /// Changes the bodies.
    fn change<T>(&self, work: impl FnOnce(&mut Placed) -> T) -> T {
        work(Arc::make_mut(&mut self.lock().bodies))
    }

    /// Inserts a body and returns its id.
    fn add(&self, body: Body<PreparedScan, PreparedMesh, Arc<Shape>>, pose: &Pose) -> u64 {
        let mut latest = self.lock();
        let BodyId(id) = Arc::make_mut(&mut latest.bodies).insert_body(body, pose);
        latest.next = id + 1;
        id
    }

    /// Checks that the world has, or had, bodies with the ids of all pairs.
    fn check_pairs(&self, pairs: &[[u64; 2]]) -> PyResult<()> {
        let next = self.lock().next;
        pairs.as_flattened().iter().find(|&&id| id >= next).map_or(Ok(()), |&id| Err(no_body(id)))
    }
}

/// Returns ids of bodies that the world has; `None` for all bodies.
fn ids_of(world: &Placed, of: Option<Vec<u64>>) -> PyResult<Option<Vec<BodyId>>> {
    let id_of = |id| world.get(BodyId(id)).map(|_| BodyId(id)).ok_or_else(|| no_body(id));
    of.map(|ids| ids.into_iter().map(id_of).collect()).transpose()
}

/// Returns the bodies of a list; all of them for `None`.
fn bodies_of(ids: Option<&[BodyId]>) -> Bodies<'_> {
    ids.map_or(Bodies::All, Bodies::These)
}

/// Returns the metric of the scans of a world, which must be the same.
fn metric_of(world: &Placed) -> PyResult<Metric> {
    let mut metrics = world.ids().filter_map(|id| Some((id, world.placed(id)?.scan().metric())));
    let Some((_, first)) = metrics.next() else { return Ok(Metric::Euclidean) };
    match metrics.find(|(_, metric)| *metric != first) {
        Some((BodyId(id), _)) => {
            Err(refused(format!("expected scans prepared for one kernel, got another one of body {id}")))
        }
        None => Ok(first),
    }
}

/// The plans of questions about distances.
struct DistancePlans {
    all: DistancePlan,
    /// The plan about a scan and a shape, with the same meaning.
    of_shape: ShapePlan,
}

impl DistancePlans {
    fn new(world: &Placed, given: Option<&Bound<'_, PyDict>>, names: &[&str]) -> PyResult<(Self, Options)> {
        let metric = metric_of(world)?;
        let options = Options::new(given, names, metric)?;
        let semantics = options.collide.semantics;
        let asked = DistanceOptions::default().with_semantics(semantics).with_relative(options.relative);
        let all = DistancePlan::of_metric(&asked, metric).map_err(refused)?;
        let of_shape = CollideOptions::default().with_semantics(semantics);
        let of_shape = ShapePlan::of_metric(&of_shape, metric).map_err(refused)?;
        Ok((Self { all, of_shape }, options))
    }

    /// Bounds the distance of two bodies.
    fn ask(&self, pair: &BodyPair<'_>, scratch: &mut Scratch) -> DistanceRecord {
        let swapped = |record: DistanceRecord, is_swapped| if is_swapped { record.swapped() } else { record };
        match pair {
            BodyPair::Scans(pair) => DistanceRecord::new(&pair.distance(&self.all, scratch)),
            BodyPair::MeshAndScan { pair, mesh_is_first } => {
                swapped(DistanceRecord::new(&pair.distance(&self.all, scratch)), *mesh_is_first)
            }
            BodyPair::Meshes(pair) => DistanceRecord::of_meshes(&pair.distance(scratch.meshes())),
            BodyPair::ShapeAndScan { pair, shape_is_first } => {
                let found = pair.distance(&self.of_shape, f64::INFINITY, scratch);
                let record = found.map_or(DistanceRecord::UNKNOWN, |found| DistanceRecord::of_shape(&found));
                swapped(record, *shape_is_first)
            }
            _ => pair.distance(&self.all, scratch).map_or(DistanceRecord::UNKNOWN, |found| {
                DistanceRecord::of_bodies((found.lower, found.upper), found.points, false)
            }),
        }
    }
}

#[pymethods]
impl World {
    #[new]
    fn new() -> Self {
        Self(Mutex::new(Latest { bodies: Arc::new(Crowd::with_meshes_and_shapes()), next: 0 }))
    }

    fn __len__(&self) -> usize {
        self.lock().bodies.len()
    }

    fn __repr__(&self) -> String {
        format!("<World of {} bodies>", self.__len__())
    }

    /// The ids of all bodies, in the order of insertion.
    #[getter]
    fn ids(&self) -> Vec<u64> {
        self.lock().bodies.ids().map(|id| id.0).collect()
    }

    /// Place a Scan, a Mesh or a Shape at `pose`, of shape (4, 4), and return the id of the new body.
    #[pyo3(signature = (body, pose = None))]
    fn insert(&self, body: &Bound<'_, PyAny>, pose: Option<&Bound<'_, PyAny>>) -> PyResult<u64> {
        let poses = Poses::new(pose)?;
        let (body, pose) = if let Ok(scan) = body.cast::<Scan>() {
            let scan = &scan.get().0;
            (Body::Scan(scan.clone()), poses.one(&**scan)?)
        } else if let Ok(mesh) = body.cast::<Mesh>() {
            let mesh = &mesh.get().mesh;
            (Body::Mesh(mesh.clone()), poses.one(mesh)?)
        } else if let Ok(shape) = body.cast::<Shape>() {
            (Body::Shape(Arc::new(shape.get().clone())), poses.one_of_shape()?)
        } else {
            let class = body.get_type().name()?;
            let told = format!("expected a Scan, a Mesh or a Shape, got {class}");
            return Err(PyTypeError::new_err(told));
        };
        Ok(self.add(body, &pose))
    }

    /// Remove a body. Raises `KeyError` for an unknown id.
    fn remove(&self, id: u64) -> PyResult<()> {
        self.change(|world| world.remove_body(BodyId(id))).map(drop).ok_or_else(|| no_body(id))
    }

    /// Move a body to `pose`, of shape (4, 4). Raises `KeyError` for an unknown id.
    fn move_to(&self, id: u64, pose: &Bound<'_, PyAny>) -> PyResult<()> {
        let poses = Poses::new(Some(pose))?;
        let pose = match self.lock().bodies.body(BodyId(id)).ok_or_else(|| no_body(id))? {
            PlacedBody::Scan(scan) => poses.one(scan.scan())?,
            PlacedBody::Mesh(mesh) => poses.one(mesh.mesh())?,
            PlacedBody::Shape(_) => poses.one_of_shape()?,
        };
        if self.change(|world| world.move_to(BodyId(id), &pose)) { Ok(()) } else { Err(no_body(id)) }
    }

    /// Return the pairs of ids, of shape (N, 2), whose bounding boxes come within the length `reach`; of all
    /// bodies, or those with a body in the list `of`. All other pairs are further apart. Raises `KeyError`
    /// for an unknown id.
    #[pyo3(signature = (reach = 0.0, of = None))]
    fn near_pairs<'py>(
        &self,
        py: Python<'py>,
        reach: f64,
        of: Option<Vec<u64>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        check_reach(reach)?;
        let world = self.now();
        let pairs = near(py, &world, reach, ids_of(&world, of)?.as_deref());
        let flat: Vec<u64> = pairs.iter().flatten().map(|id| id.0).collect();
        rows(py, flat, &[pairs.len(), 2])
    }

    /// Answer `collide` for all pairs that may touch, or those with a body in the list `of`, on all cores.
    ///
    /// Returns the pairs of ids, of shape (N, 2), and a structured array of answers, of shape (N,), as
    /// `Scan.collide_each` does. Options are those of `Scan.collide`. Shapes are solid, and have no normals
    /// and no sources. Raises `KeyError` for an unknown id in `of`.
    #[pyo3(signature = (of = None, **options))]
    fn collide<'py>(
        &self,
        py: Python<'py>,
        of: Option<Vec<u64>>,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let world = self.now();
        let ids = ids_of(&world, of)?;
        let metric = metric_of(&world)?;
        let options = Options::new(options, OF_SCANS, metric)?;
        let plans = Plans::new(&world, &options, metric)?;
        let pairs = near(py, &world, plans.collide.reach(), ids.as_deref());
        let answers = ask_each(py, pairs.len(), |i, scratch| {
            let pair = world.body_pair(pairs[i]).map(|pair| pair.within(&options.budget()));
            let unasked = || AnswerRecord::new(&nearmiss::Answer::UNASKED);
            pair.map_or_else(unasked, |pair| plans.ask(&pair, scratch))
        })?;
        let flat: Vec<u64> = pairs.iter().flatten().map(|id| id.0).collect();
        Ok((rows(py, flat, &[pairs.len(), 2])?, array(py, answers)?))
    }

    /// Bound the distance of two bodies: lower ≤ distance ≤ upper. Returns a `Distance`. Options are those of
    /// `Scan.distance`; `work` and `seconds` do not limit pairs with a shape. Raises `KeyError` for an
    /// unknown id.
    #[pyo3(signature = (a, b, **options))]
    fn distance(
        &self,
        py: Python<'_>,
        a: u64,
        b: u64,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Distance> {
        let world = self.now();
        let (plans, options) = DistancePlans::new(&world, options, OF_DISTANCE)?;
        if let Some(id) = [a, b].into_iter().find(|&id| world.body(BodyId(id)).is_none()) {
            return Err(no_body(id));
        }
        let pair = world.body_pair([BodyId(a), BodyId(b)]).ok_or_else(|| no_body(a))?;
        let pair = pair.within(&options.budget());
        Ok(Distance(ask(py, |scratch| plans.ask(&pair, scratch))))
    }

    /// Bound the length of the shortest move that takes the body `b` out of the body `a`. `solid` names
    /// scans whose surface encloses a solid: "a", "b" or "both". Shapes and the closed parts of meshes are
    /// solid anyway.
    ///
    /// Returns a `Penetration`, as `Scan.penetration` does. Options are those of `Scan.collide`; `margin`
    /// needs a scan, and `work` and `seconds` do not limit two shapes. Raises `KeyError` for an unknown id.
    #[pyo3(signature = (a, b, *, solid = None, **options))]
    fn penetration(
        &self,
        py: Python<'_>,
        a: u64,
        b: u64,
        solid: Option<&str>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Penetration> {
        let world = self.now();
        let metric = metric_of(&world)?;
        let options = Options::new(options, OF_SCANS, metric)?;
        let plan = CollidePlan::of_metric(&options.collide, metric).map_err(refused)?;
        let [first, second] = [a, b].map(|id| world.get(BodyId(id)).ok_or_else(|| no_body(id)));
        let bodies = [first?, second?];
        let has_scan = bodies.iter().any(|body| matches!(body, Body::Scan(_)));
        if options.collide.margin != 0.0 && !has_scan {
            return Err(refused("expected no `margin` for bodies of which none is a scan"));
        }
        let [own, other] = interiors(solid, bodies.map(|body| matches!(body, Body::Scan(_))))?;
        let pair = world.body_pair([BodyId(a), BodyId(b)]).ok_or_else(|| no_body(a))?;
        let found = ask(py, |scratch| {
            // The closed parts of meshes are found when first asked for, without the interpreter.
            let interiors = [interior(bodies[0], own), interior(bodies[1], other)];
            pair.penetration(&plan, interiors, &options.budget(), scratch)
        });
        Ok(Penetration(PenetrationRecord::new(&found)))
    }

    /// Find the two bodies that are nearest to each other, of those whose bounding boxes come within the
    /// length `reach`; of all pairs, or those with a body in the list `of`. Pairs of ids in `ignore` do not
    /// count, such as neighbouring links of a robot. They may name bodies that were removed.
    ///
    /// Returns the ids and a `Distance` without sources, and for a scan without evidence and band, which
    /// `distance` tells; or None if no pair counts. The lower bound is at most `reach`, and holds for all
    /// pairs that count. Options are `thickened`, `surface_only` and `relative`. Raises `KeyError` for an
    /// unknown id.
    #[pyo3(signature = (reach = f64::INFINITY, *, ignore = Vec::new(), of = None, **options))]
    fn nearest(
        &self,
        py: Python<'_>,
        reach: f64,
        ignore: Vec<[u64; 2]>,
        of: Option<Vec<u64>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Option<([u64; 2], Distance)>> {
        check_reach(reach)?;
        self.check_pairs(&ignore)?;
        let world = self.now();
        let ids = ids_of(&world, of)?;
        let (plans, _) = DistancePlans::new(&world, options, OF_NEAREST)?;
        let found = ask(py, |scratch| {
            let counts =
                |a: BodyId, b: BodyId| !ignore.contains(&[a.0, b.0]) && !ignore.contains(&[b.0, a.0]);
            world.nearest_pair(bodies_of(ids.as_deref()), reach, counts, &plans.all, scratch)
        });
        Ok(found.map(|found| {
            let has_scan = found.ids.iter().any(|&id| world.placed(id).is_some());
            let record = DistanceRecord::of_bodies((found.lower, found.upper), found.points, has_scan);
            (found.ids.map(|id| id.0), Distance(record))
        }))
    }
}

/// Returns the inside of a body; that of a scan is given.
fn interior(body: &Body<PreparedScan, PreparedMesh, Arc<Shape>>, of_scan: Interior) -> BodyInterior<'_> {
    match body {
        Body::Scan(_) => BodyInterior::Scan(of_scan),
        Body::Mesh(mesh) => BodyInterior::Mesh(mesh.solid()),
        Body::Shape(_) => BodyInterior::Shape,
    }
}

/// Checks a reach.
fn check_reach(reach: f64) -> PyResult<()> {
    if reach.is_nan() || reach < 0.0 {
        return Err(refused(format!("expected a reach of at least 0, got {reach}")));
    }
    Ok(())
}

/// Returns the pairs near each other, without the interpreter.
fn near(py: Python<'_>, world: &Placed, reach: f64, of: Option<&[BodyId]>) -> Vec<[BodyId; 2]> {
    py.detach(|| {
        let mut pairs = Vec::new();
        world.near_pairs(bodies_of(of), reach, &mut pairs);
        pairs
    })
}
