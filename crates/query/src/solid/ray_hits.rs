//! The hits of a ray, given its crossings with the parts of points.
//!
//! Of the discs of a sheet the one whose centre is nearest to the crossing, in disc radii, tells where the
//! ray hits. The place may move along the ray to where the implicit function vanishes. Between discs that
//! leave a hole, the surface continues in the cells of points (docs/theory/obstacle.md): a crossing of a
//! cell's plane counts if its point is the nearest one, or if the implicit function vanishes there.

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::PointKind;
use nearmiss_surface::Status;

use crate::ask::answer::Evidence;
use crate::ask::options::{Detail, Semantics};
use crate::leaf::disc_triangle::FlatDisc;
use crate::pair::placed::ViewScratch;
use crate::solid::core::Solid;
use crate::solid::crossing::{Crossing, meets};
use crate::solid::elements::{Element, Elements};
use crate::solid::meeting::verified_in;
use crate::solid::ray::{RayHit, StoredRay};

type Vector = Vector3<f64>;

/// The greatest |f| on the surface, in bandwidths.
const ON_SURFACE: f64 = 1e-6;

/// Evaluations along a ray.
const ROUNDS: u32 = 8;

/// The least cosine of a ray and a normal at which the crossing is refined.
const GRAZING: f64 = 0.02;

/// Returns the first of the crossings from number `next` on that counts, as a hit, and the thickness of
/// the sheet there in the world; sets `next` to the crossing after those of the same sheet. `are_all` if the
/// crossings are not only those of the first hit.
pub(crate) fn next_hit(
    elements: &Elements<'_>,
    ray: &StoredRay,
    (all, are_all): (&[Crossing], bool),
    next: &mut usize,
    scratch: &mut ViewScratch,
) -> Option<(RayHit, f64)> {
    while let Some(first) = all.get(*next) {
        let start = *next;
        if !elements.is_disc(first.i) {
            *next += 1;
            return hit(elements, ray, first, scratch).map(|hit| (hit, 0.0));
        }
        let layer = first.layer(elements);
        let mut end = first.t + layer;
        let is_same = |it: &&Crossing| {
            let is_same = it.t <= end;
            // As far as a search for the first hit looks.
            if are_all && is_same && it.is_sure() {
                end = end.min(it.t + it.layer(elements));
            }
            is_same
        };
        let count = all[start..].iter().take_while(is_same).count();
        *next += count;
        let sheet = || all[start..start + count].iter().filter(|it| elements.is_disc(it.i));
        let best = if first.is_at_start(ray) {
            // The nearest point may be in the ball, which certifies the hit.
            let away = |it: &Crossing| (elements.position(it.i) - ray.origin).norm_squared();
            let touching = sheet().filter(|it| it.is_at_start(ray));
            touching.min_by(|a, b| away(a).total_cmp(&away(b)))
        } else {
            sheet().min_by(|a, b| a.beside.total_cmp(&b.beside))
        };
        let Some(best) = best else { continue };
        let found = hit(elements, ray, best, scratch);
        // In a hole, the point nearest to the ray may be another one.
        let found = found.or_else(|| sheet().find_map(|it| hit(elements, ray, it, scratch)));
        if let Some(found) = found {
            return Some((found, layer * elements.scale()));
        }
        // A ball among the crossings of a hole still counts.
        let is_ball = |it: &Crossing| !elements.is_disc(it.i);
        *next = start + all[start..start + count].iter().position(is_ball).unwrap_or(count);
    }
    None
}

/// The hit at a crossing. `None` if it is in a hole between discs where there is no surface.
fn hit(
    elements: &Elements<'_>,
    ray: &StoredRay,
    crossing: &Crossing,
    scratch: &mut ViewScratch,
) -> Option<RayHit> {
    let i = crossing.i;
    let (placed, scale) = (&elements.placed, elements.scale());
    let source = placed.scan().id(i);
    let told = |t: f64, point: Vector, normal: Vector, evidence| RayHit {
        t: t * scale,
        point: elements.in_world(&point),
        normal: elements.turned(&normal),
        source,
        evidence,
    };
    let disc = match elements.element(i) {
        Element::Ball(centre, radius) => {
            let t = crossing.t;
            let normal = (ray.at(t) - centre).try_normalize(0.0).unwrap_or(-ray.direction);
            return Some(told(t, centre + normal * radius, normal, Evidence::Certified));
        }
        Element::Disc(disc) => disc,
    };
    // The crossing may be known in single precision only.
    let cell = f64::from(elements.arrays.cell_radius(i)).max(disc.radius);
    let crossing = meets(ray, &disc, i, cell).unwrap_or(*crossing);
    let Crossing { t, beside, .. } = crossing;
    if crossing.is_at_start(ray) {
        let (point, normal, evidence) = at_start(elements, ray, (i, &disc), scratch);
        return Some(told(t, point, normal, evidence));
    }
    let x = ray.at(t);
    let towards = disc.normal * 1.0_f64.copysign(-disc.normal.dot(&ray.direction));
    let side = |normal: Vector| {
        // A ball may touch the flank of a bend that it moves along.
        let right = match placed.scan().is_oriented() {
            true => disc.normal,
            false if ray.radius > 0.0 => towards,
            false => -ray.direction,
        };
        if normal.dot(&right) < 0.0 { -normal } else { normal }
    };
    let is_wanted = elements.detail == Detail::Witness && placed.verifies();
    if is_wanted
        && let Some((t, point, normal, evidence)) = refined(elements, ray, (i, t, towards), scratch)
        && (beside <= 1.0 || evidence == Evidence::Certified)
    {
        return Some(told(t, point, side(normal), evidence));
    }
    let on_disc = disc.nearest(&x);
    if beside <= 1.0 {
        let is_edge = placed.scan().kind(i) == PointKind::Edge;
        let way = x - on_disc;
        let rim = is_edge && beside >= 1.0 - 1e-9 && ray.radius > 0.0;
        let normal = if rim { way.try_normalize(0.0).unwrap_or(towards) } else { side(towards) };
        return Some(told(t, on_disc, normal, Evidence::Estimated));
    }
    // The surface between the discs, to first order.
    let place = x - disc.normal * disc.normal.dot(&(x - disc.centre));
    let is_inner = placed.scan().kind(i) == PointKind::Sheet;
    let is_part = is_inner && placed.scan().nearest_point_near(i, place.into()) as usize == i;
    is_part.then(|| told(t, place, side(towards), Evidence::Estimated))
}

/// The contact of a ball that touches a disc before it moves: the point, the normal and the evidence. The
/// normal is outwards if the scan is oriented, otherwise on the side of the ball's centre.
fn at_start(
    elements: &Elements<'_>,
    ray: &StoredRay,
    (i, disc): (usize, &FlatDisc),
    scratch: &mut ViewScratch,
) -> (Vector, Vector, Evidence) {
    let on_disc = disc.nearest(&ray.origin);
    let height = disc.normal.dot(&(ray.origin - disc.centre));
    let side = if height == 0.0 { -disc.normal.dot(&ray.direction) } else { height };
    let is_turned = !elements.placed.scan().is_oriented() && side < 0.0;
    let normal = if is_turned { -disc.normal } else { disc.normal };
    let verified = Solid::ball((ray.origin, ray.radius)).and_then(|ball| {
        elements.held(&ball, i).or_else(|| {
            let is_wanted = elements.detail == Detail::Witness;
            let found = is_wanted.then(|| verified_in(elements, &ball, (i, on_disc), scratch))??;
            Some(elements.placed.stored_to_world().apply_inverse(found).into())
        })
    });
    let evidence = if verified.is_some() { Evidence::Certified } else { Evidence::Estimated };
    (verified.unwrap_or(on_disc), normal, evidence)
}

/// Looks for the place along a ray, near distance `t`, where it is its radius away from the surface
/// near point `i`, on the side of `towards`. Returns the distance, the point of the surface, the
/// normal, turned to that side, and the evidence: estimated if the place is not part of the obstacle.
fn refined(
    elements: &Elements<'_>,
    ray: &StoredRay,
    (i, start, towards): (usize, f64, Vector),
    scratch: &mut ViewScratch,
) -> Option<(f64, Vector, Vector, Evidence)> {
    let (placed, scale) = (&elements.placed, elements.scale());
    let frame = placed.stored_to_world();
    let most = f64::from(elements.arrays.radii[i]);
    let mut field = placed.near(i, scratch);
    let mut t = start;
    for _ in 0..ROUNDS {
        let x = ray.at(t);
        // A thick ray looks at the surface beside its ball.
        let foot = x - towards * ray.radius;
        let at = field.evaluate(elements.in_world(&foot));
        if at.status == Status::Outside {
            return None;
        }
        let normal = Vector::from(frame.rotate_inverse(at.normal));
        let cosine = normal.dot(&ray.direction);
        let f = at.f / scale;
        if f.abs() <= ON_SURFACE * at.bandwidth / scale {
            let is_part =
                elements.semantics == Semantics::Surface || placed.is_obstacle(i, elements.in_world(&foot));
            let normal = normal * 1.0_f64.copysign(normal.dot(&towards));
            let evidence =
                if at.status == Status::Ok && is_part { Evidence::Certified } else { Evidence::Estimated };
            return (t >= 0.0 && t <= ray.max).then_some((t, foot, normal, evidence));
        }
        if cosine.abs() < GRAZING {
            return None;
        }
        // f is positive below the surface.
        t += f / cosine;
        let moved = (t - start).abs();
        if moved.is_nan() || moved > most / cosine.abs() {
            return None;
        }
    }
    None
}
