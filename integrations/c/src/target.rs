//! Questions about a scan, and shapes or rays.

use std::mem::MaybeUninit;

use nearmiss::{Shape as Convex, ShapeVerdict, Target};

use crate::answer::{NOBODY, NONE, NOWHERE, Reason, Verdict, evidence};
use crate::handle::{get, get_mut};
use crate::hint::ShapeHint;
use crate::options::Evidence;
use crate::plan::Plan;
use crate::pointer::{check, fill, required, slice};
use crate::pose::Placed;
use crate::scratch::Scratch;
use crate::shape::Shape;
use crate::status::{Failure, Status, guard};

/// The answer about a shape. Missing numbers are NaN, a missing point `UINT32_MAX`.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ShapeAnswer {
    /// The verdict.
    pub verdict: Verdict,
    /// The certainty of the verdict.
    pub evidence: Evidence,
    /// The reason if it is undecided.
    pub reason: Reason,
    /// The point whose disc or ball the shape touches, as the input numbers it.
    pub source: u32,
    /// A place of the scan in the shape.
    pub point: [f64; 3],
    /// The length within which nothing is claimed about the scanned thing itself.
    pub band: f64,
}

/// Bounds on the distance of a shape and a scan: lower ≤ distance ≤ upper. If no disc or ball of the scan is
/// within the greatest distance asked for, or if a pose or the shape is out of range, `upper` is infinite,
/// places and `band` are NaN, and `source` is `UINT32_MAX`.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ShapeDistance {
    /// A proven lower bound. At most the distance asked for if `upper` is infinite; 0 if nothing is known.
    pub lower: f64,
    /// An upper bound: the distance of the two places.
    pub upper: f64,
    /// The nearest place on the scan.
    pub point: [f64; 3],
    /// The nearest place on the shape.
    pub point_of_shape: [f64; 3],
    /// The local radius of the nearest point.
    pub band: f64,
    /// The nearest point, as the input numbers it.
    pub source: u32,
    /// The certainty of the upper bound; none if it is infinite.
    pub evidence: Evidence,
}

/// A contact of a shape with a scan, for a physics solver.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ShapeContact {
    /// A point of the surface.
    pub point: [f64; 3],
    /// The unit direction in which the shape moves out.
    pub normal: [f64; 3],
    /// The depth along the normal; negative for a gap within the margin.
    pub depth: f64,
    /// A number that the contact keeps from frame to frame with a hint.
    pub id: u64,
}

/// A ray, or a ball that moves along it.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct Ray {
    /// The start.
    pub origin: [f64; 3],
    /// The direction, of any length but 0.
    pub direction: [f64; 3],
    /// The greatest length; infinite for a ray without end.
    pub max: f64,
    /// The radius of the ball; 0 for a ray.
    pub radius: f64,
}

/// The answer about a ray. Missing numbers are NaN, a missing point `UINT32_MAX`.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct RayHit {
    /// True if it hits anything.
    pub hit: bool,
    /// The certainty of the hit, or of none.
    pub evidence: Evidence,
    /// The point whose disc or ball is hit, as the input numbers it.
    pub source: u32,
    /// The length from the origin.
    pub t: f64,
    /// The place.
    pub point: [f64; 3],
    /// The unit normal there.
    pub normal: [f64; 3],
}

impl ShapeAnswer {
    fn new(answer: &nearmiss::ShapeAnswer) -> Self {
        let none = Self {
            verdict: Verdict::Undecided,
            evidence: Evidence::None,
            reason: Reason::None,
            source: NOBODY,
            point: NOWHERE,
            band: answer.band,
        };
        match answer.verdict {
            ShapeVerdict::Touching { point, source, evidence: certainty } => {
                let (verdict, evidence) = (Verdict::Touching, evidence(certainty));
                Self { verdict, evidence, source: source.0, point, ..none }
            }
            ShapeVerdict::Separated { evidence: certainty } => {
                Self { verdict: Verdict::Separated, evidence: evidence(certainty), ..none }
            }
            ShapeVerdict::Undecided(why) => Self { reason: Reason::new(why), ..none },
        }
    }
}

impl ShapeDistance {
    /// No disc or ball was found, and this lower bound is known.
    fn beyond(lower: f64) -> Self {
        Self {
            lower,
            upper: f64::INFINITY,
            point: NOWHERE,
            point_of_shape: NOWHERE,
            band: NONE,
            source: NOBODY,
            evidence: Evidence::None,
        }
    }

    fn new(distance: &nearmiss::ShapeDistance) -> Self {
        let [point, point_of_shape] = distance.points;
        Self {
            lower: distance.lower,
            upper: distance.upper,
            point,
            point_of_shape,
            band: distance.band,
            source: distance.source.0,
            evidence: evidence(distance.evidence),
        }
    }
}

impl RayHit {
    fn new(answer: &nearmiss::RayAnswer) -> Self {
        let certainty = evidence(answer.evidence);
        answer.hit.map_or(
            Self {
                hit: false,
                evidence: certainty,
                source: NOBODY,
                t: NONE,
                point: NOWHERE,
                normal: NOWHERE,
            },
            |hit| Self {
                hit: true,
                evidence: certainty,
                source: hit.source.0,
                t: hit.t,
                point: hit.point,
                normal: hit.normal,
            },
        )
    }
}

impl Ray {
    fn checked(&self) -> Result<nearmiss::Ray, Failure> {
        let Self { origin, direction, max, radius } = *self;
        let is_finite = origin.iter().chain(&direction).all(|c| c.is_finite());
        let are_lengths = max >= 0.0 && radius >= 0.0 && radius.is_finite();
        if !is_finite || direction == [0.0; 3] || !are_lengths {
            return Err(Failure::argument(format_args!(
                "expected a finite origin, a finite direction other than 0, and lengths of at least 0, got {self:?}"
            )));
        }
        Ok(nearmiss::Ray::new(origin, direction).with_max(max).with_radius(radius))
    }
}

/// Returns a target.
pub(crate) fn target<'a>(plan: Option<&Plan>, scan: Option<&Placed<'a>>) -> Result<Target<'a>, Failure> {
    Ok(Target::new(required(scan, "scan")?.at()?, &get(plan, "plan")?.shape))
}

/// Decides for each of `count` shapes whether it touches a scan, or comes within the margin of the
/// plan, and writes `count` answers to `out`. Thread safety: one call at a time for each scratch.
///
/// # Safety
/// `shapes` and `out` are `count` values; other pointers are null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn nearmiss_touch(
    plan: Option<&Plan>,
    scan: Option<&Placed<'_>>,
    shapes: *const Shape,
    count: usize,
    scratch: Option<&mut Scratch>,
    out: *mut ShapeAnswer,
) -> Status {
    guard(|| {
        let (target, memory) = (target(plan, scan)?, get_mut(scratch, "scratch")?);
        // SAFETY: the caller promises shapes, their points and places.
        unsafe {
            each(slice(shapes, count, "shapes")?, out, |shape| {
                Ok(ShapeAnswer::new(&target.touch(&shape.checked()?, &mut memory.scratch)))
            })
        }
    })
}

/// Writes an answer about each of the questions to `out`.
///
/// # Safety
/// `out` is null or has a place for each question.
unsafe fn each<Q, A>(
    questions: &[Q],
    out: *mut A,
    mut ask: impl FnMut(&Q) -> Result<A, Failure>,
) -> Result<(), Failure> {
    if !questions.is_empty() {
        if out.is_null() {
            return Err(Failure::null("out"));
        }
        check(out, questions.len(), "out")?;
    }
    for (i, question) in questions.iter().enumerate() {
        let answer = ask(question)?;
        // SAFETY: `i` is below the number of questions, so the caller promises the place.
        unsafe { out.add(i).write(answer) };
    }
    Ok(())
}

/// Bounds the distance of each of `count` shapes and a scan, and writes `count` answers to `out`. No disc or
/// ball further away than `within` is looked for, which saves time; infinite for no limit. Thread safety: one
/// call at a time for each scratch.
///
/// # Safety
/// `shapes` and `out` are `count` values; other pointers are null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn nearmiss_shape_distance(
    plan: Option<&Plan>,
    scan: Option<&Placed<'_>>,
    shapes: *const Shape,
    count: usize,
    within: f64,
    scratch: Option<&mut Scratch>,
    out: *mut ShapeDistance,
) -> Status {
    guard(|| {
        let (target, memory) = (target(plan, scan)?, get_mut(scratch, "scratch")?);
        if within.is_nan() || within < 0.0 {
            return Err(Failure::argument(format_args!("expected `within` of at least 0, got {within}")));
        }
        // SAFETY: the caller promises shapes, their points and places.
        unsafe {
            each(slice(shapes, count, "shapes")?, out, |shape| {
                let (shape, scratch) = (shape.checked()?, &mut memory.scratch);
                Ok(match target.distance(&shape, within, scratch) {
                    Some(distance) => ShapeDistance::new(&distance),
                    None => ShapeDistance::beyond(least_beyond(&target, &shape, within, scratch)),
                })
            })
        }
    })
}

/// Returns a proven lower bound, at most `within`, of the distance of a shape and a scan without any disc or
/// ball within `within`. The obstacle may come a little nearer than its discs. 0 if nothing is known.
fn least_beyond(
    target: &Target<'_>,
    shape: &Convex<'_>,
    within: f64,
    scratch: &mut nearmiss::Scratch,
) -> f64 {
    if within == f64::INFINITY {
        return 0.0;
    }
    let grown = grown(*shape, within).map(|grown| target.touch(&grown, scratch).verdict);
    if let Some(ShapeVerdict::Separated { evidence: nearmiss::Evidence::Certified }) = grown {
        return within;
    }
    target.distance(shape, f64::INFINITY, scratch).map_or(0.0, |found| found.lower.min(within))
}

/// Returns all within `by` of a shape. `None` if that is out of range.
fn grown(mut shape: Convex<'_>, by: f64) -> Option<Convex<'_>> {
    match &mut shape {
        Convex::Sphere { radius, .. }
        | Convex::Capsule { radius, .. }
        | Convex::Box { radius, .. }
        | Convex::Cylinder { rounding: radius, .. }
        | Convex::Cone { rounding: radius, .. }
        | Convex::Triangle { radius, .. }
        | Convex::Hull { radius, .. } => *radius = (*radius + by).next_up(),
        _ => return None,
    }
    Some(shape).filter(|grown| grown.rounding().is_finite())
}

/// Writes the contacts of a shape with a scan to `out`, as many as its capacity holds, and their number,
/// at most eight, to `count`. The first is the deepest; the others are spread out, at least half a local
/// radius apart. The list is empty if the pose or the shape is out of range; `nearmiss_touch` is then
/// undecided. `hint` may be null. Thread safety: one call at a time for each scratch and each hint.
///
/// # Safety
/// `out` are `capacity` places; other pointers are null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn nearmiss_shape_contacts(
    plan: Option<&Plan>,
    scan: Option<&Placed<'_>>,
    shape: Option<&Shape>,
    hint: Option<&mut ShapeHint>,
    scratch: Option<&mut Scratch>,
    out: *mut ShapeContact,
    capacity: usize,
    count: Option<&mut MaybeUninit<usize>>,
) -> Status {
    guard(|| {
        let (target, memory) = (target(plan, scan)?, get_mut(scratch, "scratch")?);
        // SAFETY: the caller promises the points of the shape.
        let shape = unsafe { required(shape, "shape")?.checked() }?;
        let found = &mut memory.shape_contacts;
        match hint {
            None => target.contacts(&shape, found, &mut memory.scratch),
            hint => target.contacts_hinted(&shape, get_mut(hint, "hint")?, found, &mut memory.scratch),
        }
        let contacts = found.iter().map(|contact| {
            let &nearmiss::ShapeContact { point, normal, depth, id } = contact;
            ShapeContact { point, normal, depth, id }
        });
        // SAFETY: the caller promises the places.
        unsafe { fill(contacts, (out, capacity), count) }
    })
}

/// Finds the first place where each of `count` rays hits a scan, and writes `count` answers to `out`. If the
/// pose is out of range, it hits nothing, with estimated evidence. Thread safety: one call at a time for each
/// scratch.
///
/// # Safety
/// `rays` and `out` are `count` values; other pointers are null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn nearmiss_cast(
    plan: Option<&Plan>,
    scan: Option<&Placed<'_>>,
    rays: *const Ray,
    count: usize,
    scratch: Option<&mut Scratch>,
    out: *mut RayHit,
) -> Status {
    guard(|| {
        let (target, memory) = (target(plan, scan)?, get_mut(scratch, "scratch")?);
        // SAFETY: the caller promises rays and places.
        unsafe {
            each(slice(rays, count, "rays")?, out, |ray| {
                Ok(RayHit::new(&target.cast(&ray.checked()?, &mut memory.scratch)))
            })
        }
    })
}

/// Writes all places where a ray hits a scan to `out`, as many as its capacity holds, the nearest
/// first, and their whole number to `count`. Thread safety: one call at a time for each scratch.
///
/// # Safety
/// `out` are `capacity` places; other pointers are null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn nearmiss_cast_all(
    plan: Option<&Plan>,
    scan: Option<&Placed<'_>>,
    ray: Option<&Ray>,
    scratch: Option<&mut Scratch>,
    out: *mut RayHit,
    capacity: usize,
    count: Option<&mut MaybeUninit<usize>>,
) -> Status {
    guard(|| {
        let (target, memory) = (target(plan, scan)?, get_mut(scratch, "scratch")?);
        let ray = required(ray, "ray")?.checked()?;
        target.cast_all(&ray, &mut memory.hits, &mut memory.scratch);
        let hits = memory
            .hits
            .iter()
            .map(|hit| RayHit::new(&nearmiss::RayAnswer { hit: Some(*hit), evidence: hit.evidence }));
        // SAFETY: the caller promises the places.
        unsafe { fill(hits, (out, capacity), count) }
    })
}
