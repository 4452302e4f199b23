//! The inside of a scan that encloses a solid.

use fearless_simd::Level;
use nearmiss_geometry::NodeId;

use crate::ask::options::Semantics;
use crate::pair::placed::{Placed, ViewScratch};
use crate::penetration::answer::Interior;
use crate::penetration::probe::Vector;
use crate::solid::cast::all_hits;
use crate::solid::core::Solid;
use crate::solid::crossing::Crossing;
use crate::solid::distance::{Nearest, nearest};
use crate::solid::elements::{Element, Elements};
use crate::solid::ray::StoredRay;

/// Directions of the rays, of about unit length. They are irrational and far from those of edges and walls.
const RAYS: [[f64; 3]; 7] = [
    [0.5257311, 0.7390851, 0.4214187],
    [-0.6180340, 0.2935127, 0.7291836],
    [0.1987654, -0.8346268, 0.5137423],
    [-0.4812118, -0.3789012, -0.7905694],
    [0.8413442, -0.2614972, -0.4730127],
    [-0.7320508, 0.6435011, -0.2236068],
    [0.3090170, 0.4472136, -0.8393972],
];

/// Rays that decide if they agree, and the least number of all rays that makes sure.
const FEW: usize = 3;
const SURE: usize = 6;

/// Working memory.
pub(crate) type Working<'w> = (Level, &'w mut Vec<Crossing>, &'w mut ViewScratch);

/// Returns `true` if a place of the stored frame is inside the surface of a scan.
///
/// A ray from a place inside a closed surface crosses it an odd number of times. Three rays decide if they
/// agree, otherwise the majority of seven: a ray may leave by a hole, or graze the surface.
pub(crate) fn is_inside(elements: &Elements<'_>, place: &Vector, working: Working<'_>) -> bool {
    let (odd, cast) = odd_rays(elements, place, FEW, working);
    2 * odd > cast
}

/// Returns `true` if at least six of seven rays tell that a place is inside.
fn is_surely_inside(elements: &Elements<'_>, place: &Vector, working: Working<'_>) -> bool {
    odd_rays(elements, place, RAYS.len(), working).0 >= SURE
}

/// Counts the rays from a place that cross the surface an odd number of times, and all that were cast:
/// no more than `few` if these agree.
fn odd_rays(
    elements: &Elements<'_>,
    place: &Vector,
    few: usize,
    (level, found, scratch): Working<'_>,
) -> (usize, usize) {
    let bounds = elements.placed.scan().root_box();
    let away = place - Vector::from(bounds.centre.map(f64::from));
    let is_beyond = |k: usize| {
        let axis = Vector::from(bounds.axes[k].map(f64::from));
        axis.dot(&away).abs() > f64::from(bounds.half[k] + bounds.reach)
    };
    // Also true of NaN.
    if (0..3).any(is_beyond) || !place.iter().all(|x| x.is_finite()) {
        return (0, few);
    }
    let mut odd = 0;
    for (n, direction) in RAYS.iter().enumerate() {
        let direction = Vector::from(*direction).normalize();
        let ray = StoredRay { origin: *place, direction, max: f64::INFINITY, radius: 0.0 };
        odd += usize::from(is_odd(elements, &ray, (level, &mut *found, &mut *scratch)));
        if n + 1 == few && (odd == 0 || odd == few) {
            return (odd, few);
        }
    }
    (odd, RAYS.len())
}

/// Returns `true` if a ray crosses the surface an odd number of times.
fn is_odd(elements: &Elements<'_>, ray: &StoredRay, working: Working<'_>) -> bool {
    // Balls of noisy points, and discs near them, are part of one surface.
    let layer = f64::from(elements.arrays.sampling_radius) * elements.scale();
    let (mut crossings, mut last) = (0_u32, f64::NEG_INFINITY);
    all_hits(elements, ray, working, |hit| {
        crossings += u32::from(hit.t - last > layer);
        last = hit.t;
    });
    crossings % 2 == 1
}

/// Returns `true` if the way between two places of the stored frame crosses the surface an odd number of
/// times, in both directions. Two sheets closer than a sampling radius are taken for one.
pub(crate) fn crosses(
    elements: &Elements<'_>,
    places: [&Vector; 2],
    (level, found, scratch): Working<'_>,
) -> bool {
    [[0, 1], [1, 0]].into_iter().all(|[from, to]| {
        let way = places[to] - places[from];
        let max = way.norm();
        let Some(direction) = way.try_normalize(0.0) else { return false };
        let ray = StoredRay { origin: *places[from], direction, max, radius: 0.0 };
        is_odd(elements, &ray, (level, &mut *found, &mut *scratch))
    })
}

/// Returns `true` if the inside counts.
pub(crate) fn counts(elements: &Elements<'_>, interior: Interior) -> bool {
    counted(elements.semantics, interior) == Interior::Solid
}

/// The inside as it counts with these semantics: thickened points have none.
pub(crate) fn counted(semantics: Semantics, interior: Interior) -> Interior {
    if let Semantics::Thickened(_) = semantics { Interior::Hollow } else { interior }
}

/// The depth of a place in a solid scan.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Depth {
    /// A lower bound on the distance of the place from the discs, the balls and the flat cells.
    pub(crate) length: f64,
    /// The greatest distance of a place of the cell of the nearest disc from that disc: an estimate of the
    /// holes between discs nearby.
    pub(crate) hole: f64,
    /// The direction away from the nearest disc or ball.
    pub(crate) uphill: Vector,
}

impl Depth {
    /// A length such that every shorter shift leaves a contact or an overlap with a ball of this radius about
    /// the place. A ball whose centre has left through a hole meets the discs around the hole only while it
    /// reaches their rims.
    pub(crate) fn with_ball(&self, radius: f64) -> f64 {
        self.length + (radius * radius - self.hole * self.hole).max(0.0).sqrt()
    }
}

/// The depth of a place in a solid scan, in the stored frame. `None` unless the place is surely inside.
pub(crate) fn depth_in(
    elements: &Elements<'_>,
    place: &Vector,
    (level, found, scratch): Working<'_>,
) -> Option<Depth> {
    if !is_surely_inside(elements, place, (level, found, scratch)) {
        return None;
    }
    let Nearest { i, gap, lower, .. } = foot(elements, place, level)?;
    let uphill = (place - gap.on_disc).try_normalize(0.0).unwrap_or_else(Vector::zeros);
    Some(Depth { length: lower, hole: elements.hole(i), uphill })
}

/// The same with all places and lengths in the world.
pub(crate) fn world_depth_in(elements: &Elements<'_>, place: &Vector, working: Working<'_>) -> Option<Depth> {
    let frame = *elements.placed.stored_to_world();
    let Depth { length, hole, uphill } =
        depth_in(elements, &frame.apply_inverse((*place).into()).into(), working)?;
    let [length, hole] = [length, hole].map(|length| length * frame.scale());
    Some(Depth { length, hole, uphill: frame.rotate(uphill.into()).into() })
}

/// Returns `true` if a place of the world is inside the surface of a scan.
pub(crate) fn contains(elements: &Elements<'_>, place: &Vector, working: Working<'_>) -> bool {
    is_inside(elements, &elements.placed.stored_to_world().apply_inverse((*place).into()).into(), working)
}

/// A ball about all that counts of a scan, in the world.
pub(crate) fn world_ball(elements: &Elements<'_>) -> (Vector, f64) {
    let frame = elements.placed.stored_to_world();
    let root = elements.arrays.tree.enclosure(elements.part(), NodeId::ROOT);
    let radius = f64::from(root.radius()) + elements.beyond_boxes();
    (frame.apply(root.centre.map(f64::from)).into(), radius * frame.scale())
}

/// The axes of the bounding box of a scan, in the world.
pub(crate) fn world_axes(elements: &Elements<'_>) -> [Vector; 3] {
    let frame = elements.placed.stored_to_world();
    elements.arrays.tree.root_box().axes.map(|axis| frame.rotate(axis.map(f64::from)).into())
}

/// The number of points of a scan that are tested.
pub(crate) const TESTED: usize = 16;

/// Some points of a scan, spread over it, in the world.
pub(crate) fn some_points(placed: &Placed<'_>) -> [Vector; TESTED] {
    std::array::from_fn(|n| placed.point(placed.scan().len() * n / TESTED).into())
}

/// The same as [`nearest_part`] with all places and lengths in the world.
pub(crate) fn world_nearest_part(
    elements: &Elements<'_>,
    place: &Vector,
    level: Level,
) -> Option<(Vector, f64)> {
    let frame = elements.placed.stored_to_world();
    let (point, radius) = nearest_part(elements, &frame.apply_inverse((*place).into()).into(), level)?;
    Some((frame.apply(point.into()).into(), radius * frame.scale()))
}

/// The place of the discs nearest to another one, in the stored frame, or the centre and the radius of the
/// ball of the nearest measured point. `None` if these are no part of the obstacle.
pub(crate) fn nearest_part(elements: &Elements<'_>, place: &Vector, level: Level) -> Option<(Vector, f64)> {
    if elements.semantics == Semantics::Surface {
        return None;
    }
    match elements.element(elements.placed.scan().nearest_point((*place).into()) as usize) {
        Element::Ball(centre, radius) => Some((centre, radius)),
        // Another disc may be nearer than that of the nearest point.
        Element::Disc(_) => Some((foot(elements, place, level)?.gap.on_disc, 0.0)),
    }
}

/// The part of a scan with flat cells that is nearest to a place of the stored frame.
fn foot(elements: &Elements<'_>, place: &Vector, level: Level) -> Option<Nearest> {
    // A point has no corners.
    nearest(&elements.flat(), &Solid::point(*place), f64::INFINITY, (level, &mut Vec::new()))
}
