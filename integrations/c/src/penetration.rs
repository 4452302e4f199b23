//! Questions how far to move something out of a scan.

use std::mem::MaybeUninit;

use nearmiss::Interior;

use crate::answer::evidence;
use crate::collide::pair;
use crate::handle::{get, get_mut};
use crate::options::{Budget, Evidence, budget};
use crate::plan::Plan;
use crate::pointer::{required, write};
use crate::pose::Placed;
use crate::scratch::Scratch;
use crate::shape::Shape;
use crate::status::{Failure, Status, guard};
use crate::target::target;

/// The scans whose surface encloses a solid. What is inside a solid overlaps it; other scans are surfaces
/// without inside, such as rooms.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(i32)]
pub enum Solids {
    /// None.
    None = 0,
    /// The first scan, or the only one.
    A = 1,
    /// The second scan.
    B = 2,
    /// Both scans.
    Both = 3,
}

/// Bounds on the least shift that separates two things, in world units: lower ≤ length ≤ upper.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct Penetration {
    /// A lower bound: every shorter shift leaves a contact or an overlap. 0 if no bound was found.
    pub lower: f64,
    /// The length of a shift that separates the two: 0 if they already are separate, infinite if a pose or a
    /// shape is out of range or if no such shift was found.
    pub upper: f64,
    /// The unit direction of that shift; 0 if none is needed or known.
    pub direction: [f64; 3],
    /// The length within which nothing is claimed about the scanned things themselves.
    pub band: f64,
    /// The certainty of the separation after that shift; none if there is no such shift.
    pub evidence: Evidence,
    /// True if the budget did not end the search.
    pub complete: bool,
}

impl Penetration {
    pub(crate) fn new(found: &nearmiss::Penetration) -> Self {
        let &nearmiss::Penetration { lower, upper, direction, evidence: certainty, band, complete, .. } =
            found;
        let evidence = if upper.is_finite() { evidence(certainty) } else { Evidence::None };
        Self { lower, upper, direction, band, evidence, complete }
    }
}

/// Returns what counts of the insides of two scans, from a `NearmissSolids` of at most `last`.
pub(crate) fn interiors(solids: i32, last: Solids) -> Result<[Interior; 2], Failure> {
    if !(0..=last as i32).contains(&solids) {
        let last = last as i32;
        return Err(Failure::argument(format_args!("expected solids of 0 to {last}, got {solids}")));
    }
    Ok([1, 2].map(|bit| if solids & bit == 0 { Interior::Hollow } else { Interior::Solid }))
}

/// Bounds how far the second scan must be moved, in any direction, to be separate from the first. `solids`
/// is a `NearmissSolids`. Without solids and thickened points, the lower bound is 0. `limits` may be null.
/// Takes as long as some hundred calls of `nearmiss_collide`. Thread safety: one call at a time for each
/// scratch.
#[unsafe(no_mangle)]
pub extern "C" fn nearmiss_penetration(
    plan: Option<&Plan>,
    a: Option<&Placed<'_>>,
    b: Option<&Placed<'_>>,
    solids: i32,
    limits: Option<&Budget>,
    scratch: Option<&mut Scratch>,
    out: Option<&mut MaybeUninit<Penetration>>,
) -> Status {
    guard(|| {
        let (plan, interiors) = (&get(plan, "plan")?.collide, interiors(solids, Solids::Both)?);
        let (pair, memory) = (pair(a, b, limits)?, get_mut(scratch, "scratch")?);
        write(out, Penetration::new(&pair.penetration(plan, interiors, &mut memory.scratch)))
    })
}

/// Bounds how far a shape must be moved, in any direction, to touch nothing of a scan. `solids` is
/// `NEARMISS_SOLIDS_A` if the surface of the scan encloses a solid. `limits` may be null. Takes as long as
/// some hundred calls of `nearmiss_touch`. Thread safety: one call at a time for each scratch.
///
/// # Safety
/// Pointers are null or valid, that to the points of a hull too.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn nearmiss_shape_penetration(
    plan: Option<&Plan>,
    scan: Option<&Placed<'_>>,
    shape: Option<&Shape>,
    solids: i32,
    limits: Option<&Budget>,
    scratch: Option<&mut Scratch>,
    out: Option<&mut MaybeUninit<Penetration>>,
) -> Status {
    guard(|| {
        let (target, memory) = (target(plan, scan)?, get_mut(scratch, "scratch")?);
        let ([interior, _], limits) = (interiors(solids, Solids::A)?, budget(limits)?);
        // SAFETY: the caller promises the points of the shape.
        let shape = unsafe { required(shape, "shape")?.checked() }?;
        let found = target.penetration(&shape, interior, &limits, &mut memory.scratch);
        write(out, Penetration::new(&found))
    })
}
