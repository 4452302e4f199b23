//! The contact of a shape with one disc or ball, in the stored frame.

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::{PointKind, THICKNESS};

use crate::leaf::disc_triangle::FlatDisc;
use crate::solid::core::{Gap, Solid};
use crate::solid::elements::{Element, Elements};

type Vector = Vector3<f64>;

/// Steps to the deepest place over a disc; two are enough over a plane.
const ROUNDS: u32 = 8;

/// The precision of a depth, in disc radii.
const PRECISION: f64 = 1e-3;

/// A place where a shape touches the surface.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place {
    /// A point of the surface.
    pub(crate) point: Vector,
    /// The direction in which the shape moves out.
    pub(crate) normal: Vector,
    pub(crate) depth: f64,
}

/// The deepest place of a shape on the ball or over the disc of point `i`, whose normal in the direction in
/// which the shape moves out has this sign. `None` if they are apart, or no part of the shape within the
/// margin is over the disc.
pub(crate) fn place_at(elements: &Elements<'_>, solid: &Solid<'_>, i: usize, sign: f64) -> Option<Place> {
    let disc = match elements.element(i) {
        Element::Ball(centre, radius) => {
            let gap = near_gap(elements, solid, i)?;
            return of_ball(solid, &gap, (centre, radius));
        }
        Element::Disc(disc) => disc,
    };
    let out = disc.normal * sign;
    let most = solid.radius + elements.margin.max(f64::from(THICKNESS) * disc.radius);
    let is_edge = elements.placed.scan().kind(i) == PointKind::Edge;
    if let Some(lowest) = solid.lowest_over(&disc, &out) {
        let height = out.dot(&(lowest - disc.centre));
        let is_exact = height <= 0.0 || (solid.radius == 0.0 && !is_edge);
        if is_exact {
            let point = lowest - out * height;
            let is_met =
                height <= most && (solid.distance(&point) <= most || solid.reaches(&disc, most).is_some());
            return is_met.then_some(Place { point, normal: out, depth: solid.radius - height });
        }
    } else if solid.radius == 0.0 && solid.is_box() && !solid.is_point() && !is_edge {
        return None;
    }
    let gap = disc_gap(solid, &disc, most)?;
    // The part of the shape over the disc may be far above it, while another part is at the rim.
    of_disc(solid, &gap, &disc, (out, is_edge, elements.margin)).filter(|it| it.depth >= solid.radius - most)
}

/// The place of a shape that is only beside the disc of point `i`, within its thickness: no part of the
/// shape is over the disc, or that part is far above it. `None` if they are apart.
pub(crate) fn place_beside(elements: &Elements<'_>, solid: &Solid<'_>, i: usize, sign: f64) -> Option<Place> {
    let normal = elements.normal(i) * sign;
    let gap = near_gap(elements, solid, i)?;
    Some(Place { point: gap.on_disc, normal, depth: solid.radius - gap.distance })
}

/// The nearest points of a core and the part of a point, if these are within the margin.
fn near_gap(elements: &Elements<'_>, solid: &Solid<'_>, i: usize) -> Option<Gap> {
    let (gap, thick) = elements.gap(solid, i, elements.margin);
    (gap.distance <= solid.radius + elements.margin.max(thick)).then_some(gap)
}

/// The nearest points of a core and a disc, if these are within `most`.
fn disc_gap(solid: &Solid<'_>, disc: &FlatDisc, most: f64) -> Option<Gap> {
    Some(solid.gap(disc, most)).filter(|gap| gap.distance <= most)
}

/// The contact with a ball: along the way from its centre to the core or, if the core contains it, to
/// the inside of the shape.
fn of_ball(solid: &Solid<'_>, gap: &Gap, (centre, radius): (Vector, f64)) -> Option<Place> {
    let way = gap.on_core - centre;
    let normal = way.try_normalize(0.0).or_else(|| (solid.inside - centre).try_normalize(0.0));
    let normal = normal.unwrap_or_else(Vector::z);
    let inside = if way == Vector::zeros() { -normal.dot(&(solid.support(&-normal) - centre)) } else { 0.0 };
    let depth = solid.radius + radius - way.norm() + inside;
    Some(Place { point: centre + normal * radius, normal, depth }).filter(|it| it.depth.is_finite())
}

/// The contact with a disc: the deepest place of the shape over the disc. `None` if no part of the shape
/// that is within the margin is over the disc.
pub(crate) fn of_disc(
    solid: &Solid<'_>,
    gap: &Gap,
    disc: &FlatDisc,
    (out, is_edge, margin): (Vector, bool, f64),
) -> Option<Place> {
    let way = gap.on_core - gap.on_disc;
    let (length, height) = (way.norm(), out.dot(&way));
    // The core is before the disc.
    if height > 0.0 && length > PRECISION * disc.radius {
        let at = |normal: Vector, depth: f64| Place { point: gap.on_disc, normal, depth };
        let beside_sq = (way - out * height).norm_squared();
        if beside_sq <= (PRECISION * length).powi(2) {
            return Some(at(out, solid.radius - height));
        }
        if is_edge {
            return Some(at(way / length, solid.radius - length));
        }
        // The sphere about the nearest point of the core reaches this far below the rim.
        let below = solid.radius * solid.radius - beside_sq;
        let depth = if below >= 0.0 { below.sqrt() - height } else { f64::NEG_INFINITY };
        return (depth >= -margin).then(|| at(out, depth));
    }
    deepest(solid, disc, out)
}

/// The deepest place of the shape over a disc that crosses its core, or that it is behind of. `None` if no
/// part of the shape is over the disc.
fn deepest(solid: &Solid<'_>, disc: &FlatDisc, out: Vector) -> Option<Place> {
    let lowest = solid.support(&-out);
    let depth = -out.dot(&(lowest - disc.centre));
    let at = |point: Vector, depth: f64| Some(Place { point, normal: out, depth });
    let across = lowest - disc.centre + out * depth;
    if across.norm_squared() <= disc.radius * disc.radius {
        return at(disc.centre + across, depth + solid.radius);
    }
    if solid.is_point() {
        let beside = across.norm();
        let below_sq = solid.radius * solid.radius - (beside - disc.radius).powi(2);
        return if below_sq < 0.0 {
            None
        } else {
            at(disc.centre + across * (disc.radius / beside), depth + below_sq.sqrt())
        };
    }
    if let Some(lowest) = solid.lowest_over(disc, &out) {
        let height = out.dot(&(lowest - disc.centre));
        return at(lowest - out * height, solid.radius - height);
    }
    // The disc moves up from below the shape until the core is within the radius.
    let mut depth = depth + solid.radius;
    for _ in 0..ROUNDS {
        let below = FlatDisc { centre: disc.centre - out * depth, ..*disc };
        let gap = solid.gap(&below, f64::INFINITY);
        let left = gap.distance - solid.radius;
        if left <= PRECISION * disc.radius {
            return at(gap.on_disc + out * depth, depth);
        }
        let rise = out.dot(&(gap.on_core - gap.on_disc));
        if rise <= PRECISION * gap.distance {
            return None;
        }
        // No place of the core is below the plane through the nearest point, across the way to it.
        depth -= left * gap.distance / rise;
    }
    let below = FlatDisc { centre: disc.centre - out * depth, ..*disc };
    at(solid.gap(&below, f64::INFINITY).on_disc + out * depth, depth)
}
