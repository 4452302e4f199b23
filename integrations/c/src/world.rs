//! Worlds: many placed scans, meshes and shapes.

use std::mem::MaybeUninit;

use nearmiss::{Bodies, Body, BodyId, BodyInterior, DistancePlan, MeshScanPlan};

use crate::answer::{Answer, Distance, NOWHERE};
use crate::handle::{Handle, free, get, get_mut, make, opaque};
use crate::hint::Hint;
use crate::mesh::Mesh;
use crate::options::{Budget, Evidence, budget};
use crate::penetration::{Penetration, Solids, interiors};
use crate::plan::Plan;
use crate::pointer::{fill, required, slice, write};
use crate::pose::{Placed, Pose};
use crate::scratch::Scratch;
use crate::shape::{OwnShape, Shape};
use crate::status::{Failure, Status, guard};

/// The bodies of a world.
///
/// cbindgen:ignore
type Crowd = nearmiss::World<nearmiss::Scan, nearmiss::Mesh, OwnShape>;

/// Placed scans, meshes and convex shapes, each a body with an id. Any number of threads may ask at the same
/// time, while none changes it.
#[derive(Debug)]
pub struct World(Handle<Crowd>);

opaque!(World of Crowd as b"nm-world");

/// The ids of two bodies, the smaller one first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(C)]
pub struct BodyPair {
    /// The smaller id.
    pub a: u64,
    /// The greater id.
    pub b: u64,
}

/// Bounds on the distance of two bodies: lower ≤ distance ≤ upper. If it is not known, `lower` is 0, `upper`
/// infinite, and the places are NaN.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct BodyDistance {
    /// The ids of the bodies: in the order of the caller, or for a nearest pair the smaller one first. Both
    /// are `UINT64_MAX` if no pair counts.
    pub pair: BodyPair,
    /// A proven lower bound; 0 if nothing is known.
    pub lower: f64,
    /// An upper bound: the distance of the two places. 0 if the bodies touch; infinite if nothing is known.
    pub upper: f64,
    /// The nearest place on the first body.
    pub point_a: [f64; 3],
    /// The nearest place on the second body.
    pub point_b: [f64; 3],
    /// The certainty of the upper bound; none if it is infinite. Estimated for a scan and a shape, and for a
    /// nearest pair with a scan.
    pub evidence: Evidence,
    /// True if the budget did not end the search; false if nothing is known.
    pub complete: bool,
}

impl BodyDistance {
    /// The distance of a pair of which one body at least is a scan.
    fn of_scans(pair: BodyPair, found: &nearmiss::Distance) -> Self {
        let Distance { lower, upper, point_a, point_b, evidence, complete, .. } = Distance::new(found);
        Self { pair, lower, upper, point_a, point_b, evidence, complete }
    }

    /// These bounds and places, found without a budget.
    fn found(pair: BodyPair, [lower, upper]: [f64; 2], [point_a, point_b]: [[f64; 3]; 2]) -> Self {
        Self { pair, lower, upper, point_a, point_b, evidence: Evidence::Certified, complete: true }
    }

    /// Nothing but a lower bound is known.
    fn beyond(pair: BodyPair, lower: f64, complete: bool) -> Self {
        let upper = f64::INFINITY;
        Self { evidence: Evidence::None, complete, ..Self::found(pair, [lower, upper], [NOWHERE; 2]) }
    }

    /// The same distance, of which the upper bound proves nothing if `is_estimated`.
    fn estimated(self, is_estimated: bool) -> Self {
        Self { evidence: if is_estimated { Evidence::Estimated } else { self.evidence }, ..self }
    }

    /// The same distance with the places exchanged.
    fn swapped(self) -> Self {
        Self { point_a: self.point_b, point_b: self.point_a, ..self }
    }

    /// Bounds the distance of `bodies`, whose ids are `ids`.
    fn between(
        ids: BodyPair,
        bodies: &nearmiss::BodyPair<'_>,
        plan: &DistancePlan,
        scratch: &mut nearmiss::Scratch,
    ) -> Self {
        use nearmiss::BodyPair::{MeshAndScan, Meshes, Scans, ShapeAndScan};
        match bodies {
            Scans(pair) => Self::of_scans(ids, &pair.distance(plan, scratch)),
            MeshAndScan { pair, mesh_is_first } => {
                let found = Self::of_scans(ids, &pair.distance(plan, scratch));
                if *mesh_is_first { found.swapped() } else { found }
            }
            Meshes(pair) => {
                let nearmiss::MeshDistance { lower, upper, points, complete, .. } =
                    pair.distance(scratch.meshes());
                let found = Self::found(ids, [lower, upper], points);
                if upper.is_finite() {
                    Self { complete, ..found }
                } else {
                    Self::beyond(ids, lower, complete)
                }
            }
            other => match other.distance(plan, scratch) {
                Some(nearmiss::BodyDistance { lower, upper, points }) => {
                    let is_of_scan = matches!(other, ShapeAndScan { .. });
                    Self::found(ids, [lower, upper], points).estimated(is_of_scan)
                }
                None => Self::beyond(ids, 0.0, false),
            },
        }
    }
}

/// The pair of two bodies of a world.
fn pair_of(world: &Crowd, pair: BodyPair) -> Result<nearmiss::BodyPair<'_>, Failure> {
    let ids = [BodyId(pair.a), BodyId(pair.b)];
    let missing = || no_body(if world.body(ids[0]).is_none() { pair.a } else { pair.b });
    world.body_pair(ids).ok_or_else(missing)
}

fn no_body(id: u64) -> Failure {
    Failure::argument(format_args!("expected the id of a body of this world, got {id}"))
}

/// Makes an empty world. Thread safety: any thread.
#[unsafe(no_mangle)]
pub extern "C" fn nearmiss_world_new(out: Option<&mut MaybeUninit<*mut World>>) -> Status {
    guard(|| make(out, || Ok(Crowd::with_meshes_and_shapes())))
}

/// Frees a world; null is fine. Thread safety: no other call may use the handle at the same time or
/// later.
///
/// # Safety
/// `world` is null or a handle that no other call uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn nearmiss_world_free(world: *mut World) -> Status {
    guard(|| free(world))
}

/// Adds a placed scan and writes its id to `out`. The world keeps the scan; its handle may be freed.
/// Thread safety: no other call may use the world at the same time.
#[unsafe(no_mangle)]
pub extern "C" fn nearmiss_world_insert(
    world: Option<&mut World>,
    scan: Option<&Placed<'_>>,
    out: Option<&mut MaybeUninit<u64>>,
) -> Status {
    guard(|| {
        let world = get_mut(world, "world")?;
        let placed = required(scan, "scan")?;
        let (scan, pose) = (get(placed.scan, "scan")?, placed.pose.checked()?);
        let out = out.ok_or_else(|| Failure::null("out"))?;
        write(Some(out), world.insert(scan.clone(), &pose).0)
    })
}

/// Adds a mesh and writes its id to `out`. `pose` maps the frame of its vertices to the world; null leaves it
/// where it is. The world keeps the mesh; its handle may be freed. Thread safety: no other call may use the
/// world at the same time.
#[unsafe(no_mangle)]
pub extern "C" fn nearmiss_world_insert_mesh(
    world: Option<&mut World>,
    mesh: Option<&Mesh>,
    pose: Option<&Pose>,
    out: Option<&mut MaybeUninit<u64>>,
) -> Status {
    guard(|| {
        let (world, mesh) = (get_mut(world, "world")?, get(mesh, "mesh")?);
        let pose = pose.map_or(Ok(nearmiss::Pose::IDENTITY), Pose::checked)?;
        let out = out.ok_or_else(|| Failure::null("out"))?;
        write(Some(out), world.insert_mesh(mesh.clone(), &pose).0)
    })
}

/// Adds a convex shape and writes its id to `out`. `pose` maps the frame in which the shape is given to the
/// world; null leaves the shape where it is. The world copies the shape, and the points of a hull. Thread
/// safety: no other call may use the world at the same time.
///
/// # Safety
/// The points of a hull are valid; other pointers are null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn nearmiss_world_insert_shape(
    world: Option<&mut World>,
    shape: Option<&Shape>,
    pose: Option<&Pose>,
    out: Option<&mut MaybeUninit<u64>>,
) -> Status {
    guard(|| {
        let world = get_mut(world, "world")?;
        // SAFETY: the caller promises the points of a hull.
        let shape = OwnShape::new(unsafe { required(shape, "shape")?.checked() }?)?;
        let pose = pose.map_or(Ok(nearmiss::Pose::IDENTITY), Pose::checked)?;
        let out = out.ok_or_else(|| Failure::null("out"))?;
        write(Some(out), world.insert_shape(shape, &pose).0)
    })
}

/// Removes a body. Thread safety: no other call may use the world at the same time.
#[unsafe(no_mangle)]
pub extern "C" fn nearmiss_world_remove(world: Option<&mut World>, id: u64) -> Status {
    guard(|| get_mut(world, "world")?.remove_body(BodyId(id)).map(drop).ok_or_else(|| no_body(id)))
}

/// Moves a body. Thread safety: no other call may use the world at the same time.
#[unsafe(no_mangle)]
pub extern "C" fn nearmiss_world_move(world: Option<&mut World>, id: u64, pose: Option<&Pose>) -> Status {
    guard(|| {
        let (world, pose) = (get_mut(world, "world")?, required(pose, "pose")?.checked()?);
        if world.move_to(BodyId(id), &pose) { Ok(()) } else { Err(no_body(id)) }
    })
}

/// Writes the pairs of bodies that may meet under `plan` to `out`, as many as its capacity holds, in
/// ascending order, and their whole number to `count`. With `id_count` above 0, only pairs with one of
/// the bodies `ids`, such as those that have moved; ids of no body are ignored. With an `id_count` of 0 all
/// pairs, also if no body has moved. Thread safety: one call at a time for each scratch.
///
/// # Safety
/// `ids` are `id_count` numbers, `out` are `capacity` places; other pointers are null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn nearmiss_world_near_pairs(
    world: Option<&World>,
    plan: Option<&Plan>,
    ids: *const u64,
    id_count: usize,
    scratch: Option<&mut Scratch>,
    out: *mut BodyPair,
    capacity: usize,
    count: Option<&mut MaybeUninit<usize>>,
) -> Status {
    guard(|| {
        let (world, reach) = (get(world, "world")?, get(plan, "plan")?.collide.reach());
        let memory = get_mut(scratch, "scratch")?;
        // SAFETY: the caller promises the ids.
        let ids = unsafe { slice(ids, id_count, "ids") }?;
        memory.ids.clear();
        memory.ids.extend(ids.iter().map(|&id| BodyId(id)));
        let bodies = if ids.is_empty() { Bodies::All } else { Bodies::These(&memory.ids) };
        world.near_pairs(bodies, reach, &mut memory.pairs);
        let pairs = memory.pairs.iter().map(|&[a, b]| BodyPair { a: a.0, b: b.0 });
        // SAFETY: the caller promises the places.
        unsafe { fill(pairs, (out, capacity), count) }
    })
}

/// Decides whether two bodies touch: two scans as `nearmiss_collide` does, a scan and a shape as
/// `nearmiss_touch` does, a scan and a mesh as two scans, and other pairs exactly. A mesh is its triangles
/// without an inside. `hint` counts for two scans only, and `limits` for pairs without a shape.
///
/// Answers about two scans, or a scan and a mesh, have all fields; the source of a mesh is its triangle.
/// Other answers have verdict, evidence, reason, witness, band and likelihood, and those about a scan and a
/// shape the source of the scan. Their remaining numbers are missing, and their work is 0. Thread safety: one
/// call at a time for each scratch and each hint.
#[unsafe(no_mangle)]
pub extern "C" fn nearmiss_world_collide(
    world: Option<&World>,
    plan: Option<&Plan>,
    pair: BodyPair,
    limits: Option<&Budget>,
    hint: Option<&mut Hint>,
    scratch: Option<&mut Scratch>,
    out: Option<&mut MaybeUninit<Answer>>,
) -> Status {
    guard(|| {
        let (world, plan) = (get(world, "world")?, get(plan, "plan")?);
        let pair = pair_of(world, pair)?.within(&budget(limits)?);
        let memory = get_mut(scratch, "scratch")?;
        let answer = match (&pair, hint) {
            (nearmiss::BodyPair::Scans(pair), None) => {
                Answer::new(&pair.collide(&plan.collide, &mut memory.scratch))
            }
            (nearmiss::BodyPair::Scans(pair), hint) => {
                let hint = get_mut(hint, "hint")?;
                Answer::new(&pair.hinted(hint).collide(&plan.collide, &mut memory.scratch))
            }
            (nearmiss::BodyPair::MeshAndScan { pair, mesh_is_first }, _) => {
                let options = plan.collide.options();
                let plan = MeshScanPlan::new(options, pair.scan().scan()).map_err(Failure::argument)?;
                let answer = Answer::new(&pair.collide(&plan, &mut memory.scratch));
                if *mesh_is_first { answer.swapped() } else { answer }
            }
            (nearmiss::BodyPair::ShapeAndScan { pair, shape_is_first }, _) => {
                Answer::of_shape(&pair.touch(&plan.shape, &mut memory.scratch), *shape_is_first)
            }
            (pair, _) => Answer::of_bodies(&pair.touch(&plan.collide, &mut memory.scratch)),
        };
        write(out, answer)
    })
}

/// Bounds the distance of two bodies: of two scans as `nearmiss_distance` does. It is unknown if a pose or a
/// shape is out of range. `limits` may be null, and count for pairs without a shape. Thread safety: one call
/// at a time for each scratch.
#[unsafe(no_mangle)]
pub extern "C" fn nearmiss_world_distance(
    world: Option<&World>,
    plan: Option<&Plan>,
    pair: BodyPair,
    limits: Option<&Budget>,
    scratch: Option<&mut Scratch>,
    out: Option<&mut MaybeUninit<BodyDistance>>,
) -> Status {
    guard(|| {
        let (world, plan) = (get(world, "world")?, get(plan, "plan")?);
        let bodies = pair_of(world, pair)?.within(&budget(limits)?);
        let memory = &mut get_mut(scratch, "scratch")?.scratch;
        write(out, BodyDistance::between(pair, &bodies, &plan.distance, memory))
    })
}

/// Bounds how far body b of a pair must be moved, in any direction, to be separate from body a. `solids` is
/// a `NearmissSolids`, which counts for scans; shapes, and meshes where they are closed, are solid anyway.
/// The margin of the plan counts for pairs with a scan. `limits` may be null. Takes as long as some hundred
/// calls of `nearmiss_world_collide`. The first question about a mesh takes 20 ms more for 100,000 triangles.
/// Thread safety: one call at a time for each scratch.
#[unsafe(no_mangle)]
pub extern "C" fn nearmiss_world_penetration(
    world: Option<&World>,
    plan: Option<&Plan>,
    pair: BodyPair,
    solids: i32,
    limits: Option<&Budget>,
    scratch: Option<&mut Scratch>,
    out: Option<&mut MaybeUninit<Penetration>>,
) -> Status {
    guard(|| {
        let (world, plan) = (get(world, "world")?, &get(plan, "plan")?.collide);
        let (bodies, [a, b]) = (pair_of(world, pair)?, interiors(solids, Solids::Both)?);
        let interior = |id: u64, scan| match world.get(BodyId(id)) {
            Some(Body::Scan(_)) => Ok(BodyInterior::Scan(scan)),
            Some(Body::Mesh(mesh)) => Ok(BodyInterior::Mesh(mesh.solid())),
            Some(Body::Shape(_)) => Ok(BodyInterior::Shape),
            None => Err(no_body(id)),
        };
        let (interiors, budget) = ([interior(pair.a, a)?, interior(pair.b, b)?], budget(limits)?);
        let memory = &mut get_mut(scratch, "scratch")?.scratch;
        write(out, Penetration::new(&bodies.penetration(plan, interiors, &budget, memory)))
    })
}

/// Finds the two bodies that are nearest to each other, of those whose bounding boxes come within `reach`,
/// which may be infinite. `ignored` are pairs that do not count, such as neighbouring links of a robot. Pairs
/// with a pose or a shape out of range are left out, as their distance is unknown.
///
/// `lower` is at most `reach`, and a bound for all pairs that count. If nothing is found, both ids are
/// `UINT64_MAX`, `upper` is infinite, and `lower` is `reach`, or 0 if a pair was left out. Thread safety: one
/// call at a time for each scratch.
///
/// # Safety
/// `ignored` are `ignored_count` pairs; other pointers are null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn nearmiss_world_nearest_pair(
    world: Option<&World>,
    plan: Option<&Plan>,
    reach: f64,
    ignored: *const BodyPair,
    ignored_count: usize,
    scratch: Option<&mut Scratch>,
    out: Option<&mut MaybeUninit<BodyDistance>>,
) -> Status {
    guard(|| {
        let (world, plan) = (get(world, "world")?, get(plan, "plan")?);
        if reach.is_nan() || reach < 0.0 {
            return Err(Failure::argument(format_args!("expected a reach of at least 0, got {reach}")));
        }
        // SAFETY: the caller promises the pairs.
        let ignored = unsafe { slice(ignored, ignored_count, "ignored") }?;
        let mut any_counts = false;
        let counts = |a: BodyId, b: BodyId| {
            let counts =
                !ignored.iter().any(|pair| [(pair.a, pair.b), (pair.b, pair.a)].contains(&(a.0, b.0)));
            any_counts |= counts;
            counts
        };
        let memory = &mut get_mut(scratch, "scratch")?.scratch;
        let found = world.nearest_pair(Bodies::All, reach, counts, &plan.distance, memory);
        let Some(nearmiss::NearestPair { ids, points, lower, upper }) = found else {
            // If pairs were near but none was found, their distances are unknown.
            let lower = if any_counts { 0.0 } else { reach };
            let no_pair = BodyPair { a: u64::MAX, b: u64::MAX };
            return write(out, BodyDistance::beyond(no_pair, lower, !any_counts));
        };
        let has_scan = ids.iter().any(|&id| matches!(world.get(id), Some(Body::Scan(_))));
        let pair = BodyPair { a: ids[0].0, b: ids[1].0 };
        write(out, BodyDistance::found(pair, [lower, upper], points).estimated(has_scan))
    })
}
