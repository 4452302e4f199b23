//! The contact of a shape with one disc or ball, in the stored frame.

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::PointKind;
use nearmiss_lanes::lane::Lane;

use crate::leaf::disc_triangle::FlatDisc;
use crate::solid::core::{Gap, Solid};
use crate::solid::deepest::Capsule;
use crate::solid::discs::{Discs, Over};
use crate::solid::elements::{Element, Elements};
use crate::solid::inner::inner_depth;
use crate::solid::lowest::SharpBox;
use crate::solid::portal::Lowest;

type Vector = Vector3<f64>;

/// The precision of a distance, in disc radii.
pub(crate) const PRECISION: f64 = 1e-3;

/// Shorter vectors have no exact length.
const LEAST: f64 = 1e-150;

/// A place where a shape touches the surface.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place {
    /// A point of the surface.
    pub(crate) point: Vector,
    /// The direction in which the shape moves out.
    pub(crate) normal: Vector,
    pub(crate) depth: f64,
}

/// The deepest place of a shape over a disc.
pub(crate) struct Deepest {
    pub(crate) place: Place,
    /// `true` if the core is beside the disc there.
    pub(crate) is_beside: bool,
    /// The core is at most this far from the disc if the place is not further before it than that.
    pub(crate) apart: f64,
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
    let most = solid.radius + elements.margin.max(disc.thickness());
    let place = if elements.placed.scan().kind(i) == PointKind::Edge {
        at_border(solid, &disc, out, most)
    } else {
        over_disc(solid, &disc, out, (most, elements.margin))
    };
    // The part of the shape over the disc may be far above it, while another part is at the rim.
    place.filter(|it| it.depth >= solid.radius - most)
}

/// A shape moves out of a disc to the other side if it reaches so many times as far behind the disc as before
/// it.
const BEYOND: f64 = 4.0;

/// A place that is less deep is not wrong by much, in local radii.
const SHALLOW: f64 = 0.05;

/// Checks on which side of point `i` a shape moves out that has this place there.
///
/// A shape may be almost or all behind a disc although its centre is before the plane of the disc, as the
/// foot of a long body is behind the steps of stairs that it has passed. Returns `None` if the place counts,
/// `Some(Some(place))` if another place on the other side counts instead, and `Some(None)` if neither does.
/// While the shape touches the disc, a place counts up to a depth of the local radius.
pub(crate) fn from_behind(
    elements: &Elements<'_>,
    solid: &Solid<'_>,
    (i, sign): (usize, f64),
    place: &Place,
) -> Option<Option<Place>> {
    let band = f64::from(elements.arrays.radii[i]);
    let (depth, is_deep) = (place.depth, place.depth > band);
    let is_told = if elements.margin > 0.0 { depth > SHALLOW * band } else { is_deep };
    let least = if is_deep { depth / BEYOND } else { 0.0 };
    // Mostly the shape reaches far enough above some place of the disc, so nothing more has to be computed.
    if !is_told || solid.reach(&place.point, &place.normal) >= least || !elements.is_disc(i) {
        return None;
    }
    let (centre, radius) = (elements.position(i), f64::from(elements.arrays.discs.get(i)));
    let (out, towards) = (elements.normal(i) * sign, solid.inside - centre);
    let across = towards - out * out.dot(&towards);
    let inwards = across * (radius / across.norm()).min(1.0);
    if solid.reach(&(centre + inwards), &out) >= least {
        return None;
    }
    let other = place_at(elements, solid, i, -sign);
    other.is_none_or(|other| other.depth < least).then_some(other)
}

/// An upper bound on the depth over the disc of point `i`, whose normal in the direction in which the shape
/// moves out has this sign: the depth of the lowest point of the shape. Infinite for shapes of which bounds
/// from their boxes are as good, and for balls.
pub(crate) fn most_depth(elements: &Elements<'_>, solid: &Solid<'_>, i: usize, sign: f64) -> f64 {
    if solid.is_box() || !elements.is_disc(i) || elements.placed.scan().kind(i) == PointKind::Edge {
        return f64::INFINITY;
    }
    let out = elements.normal(i) * sign;
    solid.radius - out.dot(&(solid.support(&-out) - elements.position(i)))
}

/// The deepest place of a shape over a disc. `None` if the core is further than `most` from the disc, or no
/// part of the shape is over the disc. A round part that is beside the disc must be within the margin.
pub(crate) fn over_disc(
    solid: &Solid<'_>,
    disc: &FlatDisc,
    out: Vector,
    (most, margin): (f64, f64),
) -> Option<Place> {
    within(solid, disc, deepest(solid, disc, out)?, (most, margin))
}

/// The deepest place over a disc, with the conditions of [`over_disc`].
#[inline]
pub(crate) fn within(
    solid: &Solid<'_>,
    disc: &FlatDisc,
    found: Deepest,
    (most, margin): (f64, f64),
) -> Option<Place> {
    let Deepest { place, is_beside, apart } = found;
    let is_within = place.depth >= solid.radius - most && (!is_beside || place.depth >= -margin);
    (is_within && (apart <= most || solid.reaches(disc, most).is_some())).then_some(place)
}

/// The place of a shape at a disc at the border of a sheet: along the way between the nearest points of core
/// and disc or, if the core is not before the disc, the deepest place over the disc.
fn at_border(solid: &Solid<'_>, disc: &FlatDisc, out: Vector, most: f64) -> Option<Place> {
    let gap = disc_gap(solid, disc, most)?;
    let way = gap.on_core - gap.on_disc;
    let (length, height) = (gap.distance, out.dot(&way));
    if height <= 0.0 || length <= PRECISION * disc.radius {
        return deepest(solid, disc, out).map(|over| over.place);
    }
    let is_over = (way - out * height).norm_squared() <= (PRECISION * length).powi(2);
    let (normal, apart) = if is_over { (out, height) } else { (way / length, length) };
    Some(Place { point: gap.on_disc, normal, depth: solid.radius - apart })
}

/// The deepest place of a shape over a disc, which the shape need not touch. `None` if no part of the shape
/// is over the disc.
fn deepest(solid: &Solid<'_>, disc: &FlatDisc, normal: Vector) -> Option<Deepest> {
    if is_closed(solid) {
        let Over { is_over, on_disc, depth, is_beside, apart } = over_discs(solid, &Discs::of(disc, &normal));
        let place = Place { point: on_disc.into(), normal, depth };
        return is_over.then_some(Deepest { place, is_beside, apart });
    }
    let Lowest { height, on_disc, is_beside, other } = solid.lowest_place(disc, &normal)?;
    let place = Place { point: on_disc, normal, depth: -height };
    // The part of the shape over the disc is convex, so it has a place at each height between two others.
    Some(Deepest { place, is_beside, apart: solid.radius - other })
}

/// Returns `true` if there is a closed form for the deepest places of a shape over discs.
pub(crate) fn is_closed(solid: &Solid<'_>) -> bool {
    solid.is_segment() || (solid.is_box() && solid.radius == 0.0)
}

/// The deepest places over discs of a shape for which there is a closed form.
#[inline(always)]
pub(crate) fn over_discs<L: Lane>(solid: &Solid<'_>, discs: &Discs<L>) -> Over<L> {
    if solid.is_segment() { Capsule::of(solid).over(discs) } else { SharpBox::of(solid).over(discs) }
}

/// The place of a shape that is only beside the disc of point `i`, within its thickness: no part of the
/// shape is over the disc, or that part is far above it. `None` if they are apart. If the side `is_open`, the
/// shape moves out to where it is.
pub(crate) fn place_beside(
    elements: &Elements<'_>,
    solid: &Solid<'_>,
    (i, sign, is_open): (usize, f64, bool),
) -> Option<Place> {
    let normal = elements.normal(i) * sign;
    let gap = near_gap(elements, solid, i)?;
    let is_behind = is_open && normal.dot(&(gap.on_core - gap.on_disc)) < 0.0;
    let normal = if is_behind { -normal } else { normal };
    Some(Place { point: gap.on_disc, normal, depth: solid.radius - gap.distance })
}

/// The nearest points of a core and the part of a point, if these are within the margin.
fn near_gap(elements: &Elements<'_>, solid: &Solid<'_>, i: usize) -> Option<Gap> {
    let (gap, thick) = elements.element(i).gap(solid, elements.margin);
    (gap.distance <= solid.radius + elements.margin.max(thick)).then_some(gap)
}

/// The nearest points of a core and a disc, if these are within `most`.
pub(crate) fn disc_gap(solid: &Solid<'_>, disc: &FlatDisc, most: f64) -> Option<Gap> {
    Some(solid.gap(disc, most)).filter(|gap| gap.distance <= most)
}

/// The contact with a ball: along the way from its centre to the core or, if the core contains it, on a short
/// way out of the core.
fn of_ball(solid: &Solid<'_>, gap: &Gap, (centre, radius): (Vector, f64)) -> Option<Place> {
    let way = gap.on_core - centre;
    let (normal, inside) = if way.norm() <= solid.rounding(&centre) {
        way_out(solid, &centre)
    } else {
        (way.try_normalize(0.0).unwrap_or_else(Vector::z), 0.0)
    };
    let depth = solid.radius + radius - way.norm() + inside;
    Some(Place { point: centre + normal * radius, normal, depth }).filter(|it| it.depth.is_finite())
}

/// A direction in which the core moves away from a place in it, and the distance after which the place is
/// outside. It is the shortest of those along the axes of the box about the core, across each of these axes,
/// to the inside of the shape, across the side of a cone, and across the nearest face of other shapes. It is
/// the shortest of all, for hulls and shapes of the caller's own up to the precision of [`inner_depth`].
fn way_out(solid: &Solid<'_>, place: &Vector) -> (Vector, f64) {
    let to = solid.inside - place;
    let exit = |normal: Vector| (normal, -normal.dot(&(solid.support(&-normal) - place)));
    let mut shortest = exit(to.try_normalize(LEAST).unwrap_or_else(Vector::z));
    if solid.is_point() {
        return shortest;
    }
    let mut offer = |normal: Vector| {
        let own = exit(normal);
        if own.1 < shortest.1 {
            shortest = own;
        }
    };
    let least = (1e-12 * to.norm()).max(LEAST);
    for (k, axis) in solid.axes.into_iter().enumerate() {
        let along = axis.dot(&to);
        offer(axis * 1.0_f64.copysign(along));
        let ends = solid.round_ends().filter(|_| k == 1);
        // On the axis of a cone, all ways across are as good.
        let across = (to - axis * along).try_normalize(least).or(ends.map(|_| solid.axes[0]));
        let Some(across) = across else { continue };
        offer(across);
        if let Some([below, above]) = ends {
            let side = across * (2.0 * solid.half.y) + axis * (above - below);
            offer(side.try_normalize(LEAST).unwrap_or(across));
        }
    }
    if !solid.has_projection() {
        let (_, out) = inner_depth(|d| solid.support(d) - place, solid.half.amax());
        if let Some(out) = out.try_normalize(LEAST) {
            // If the core is flat, to both sides.
            offer(-out);
            offer(out);
        }
    }
    shortest
}

#[cfg(test)]
mod tests {
    use nearmiss_geometry::Pose;
    use nearmiss_testdata::arbitrary::{point_in, rng, rotation, unit_vector};
    use rand::RngExt;

    use super::*;
    use crate::solid::shape::Shape;

    /// A place on the axis of a cone is as far from its side as one beside the axis, and a flat hull leaves
    /// its plane.
    #[test]
    fn ways_out_of_cones_on_their_axes_and_of_flat_hulls() {
        let turn = rotation(&mut rng(7365)).with_translation([1.0, 2.0, 3.0]);
        let shape = Shape::Cone { pose: turn, half_height: 0.3, radius: 0.2, rounding: 0.0 };
        let cone = Solid::new(&shape, &Pose::IDENTITY).unwrap();
        for (up, beside) in [(0.25, 0.0), (0.25, 1e-6), (0.1, 0.0), (-0.2, 0.0)] {
            let (_, inside) = way_out(&cone, &turn.apply([beside, up, 0.0]).into());
            let expected = ((3.0 * (0.2 - beside) - 0.3 - up) / 10.0_f64.sqrt()).min(0.3 + up);
            assert!((inside - expected).abs() < 1e-11, "{up}, {beside}: {inside}, expected {expected}");
        }
        let corners = [[0.3, -0.3, 0.3], [-0.3, 0.3, 0.3], [-0.3, 0.3, -0.3], [0.3, -0.3, -0.3]];
        let corners = corners.map(|corner| turn.apply(corner));
        let hull = Solid::new(&Shape::Hull { points: &corners, radius: 0.0 }, &Pose::IDENTITY).unwrap();
        let (normal, inside) = way_out(&hull, &turn.translation().into());
        let along = Vector::from(turn.rotate_inverse(normal.into())).dot(&Vector::new(1.0, 1.0, 0.0));
        assert!(inside.abs() < 1e-12 && (along.abs() - 2.0_f64.sqrt()).abs() < 1e-9, "{inside} {normal}");
    }

    /// A shape far from the origin leaves a ball whose centre is in its core.
    #[test]
    fn small_cores_lead_out_far_from_the_origin() {
        let rng = &mut rng(7363);
        for round in 0..20_000 {
            let far = [1030.0, -1e5, 3e7][round % 3];
            let pose = rotation(rng).with_translation([far; 3]);
            let half = [0.05, 0.04, 0.03].map(|half| half * far.abs() * [1e-3, 1e-6, 1e-9][round / 6 % 3]);
            let shape = match round % 2 {
                0 => Shape::Box { pose, half, radius: 0.0 },
                _ => Shape::Cylinder { pose, half_height: half[0], radius: half[1], rounding: 0.0 },
            };
            let solid = Solid::new(&shape, &Pose::IDENTITY).unwrap();
            let centre = Vector::from(pose.apply(point_in(rng, 0.9 * half[2])));
            let way = solid.nearest(&centre) - centre;
            assert!(way.norm() <= solid.rounding(&centre), "round {round}: {way:?} {shape:?}");
            let (normal, inside) = way_out(&solid, &centre);
            assert!(
                (normal.norm() - 1.0).abs() < 1e-12 && inside > 0.0,
                "round {round}: {normal:?} {inside}"
            );
        }
    }

    /// A capsule has a place over a disc if it is near the disc, and not if it is wholly behind it.
    #[test]
    fn capsules_have_places_over_the_discs_that_they_touch() {
        let rng = &mut rng(7361);
        let (mut through, mut behind, mut before) = (0, 0, 0);
        for round in 0..20_000 {
            let normal = Vector::from(unit_vector(rng));
            let disc =
                FlatDisc { centre: point_in(rng, 0.5).into(), normal, radius: rng.random_range(0.1..0.5) };
            let (radius, margin) = (rng.random_range(0.01..0.3), [0.0_f64, 0.1][round % 2]);
            let ends = [point_in(rng, 1.5), point_in(rng, 1.5)];
            let solid = Solid::new(&Shape::Capsule { ends, radius }, &Pose::IDENTITY).unwrap();
            let most = radius + margin.max(0.05 * disc.radius);
            let gap = solid.gap(&disc, f64::INFINITY);
            let deepest = Capsule::of(&solid).over(&Discs::of(&disc, &normal));
            let depth = deepest.depth;
            if !deepest.is_over
                || (gap.distance - most).abs() < 1e-9
                || (deepest.is_beside && depth < -margin)
            {
                continue;
            }
            let found = over_disc(&solid, &disc, normal, (most, margin));
            assert_eq!(found.is_some(), gap.distance <= most, "round {round}: {gap:?} {solid:?} {disc:?}");
            through += usize::from(found.is_some() && depth > 2.0 * radius + margin);
            before += usize::from(found.is_some() && depth < radius);
            behind += usize::from(found.is_none() && depth > 0.0);
        }
        assert!(
            through > 400 && behind > 1000 && before > 500,
            "{through} through, {behind} behind, {before} before"
        );
    }
}
