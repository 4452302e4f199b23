//! Convex shapes in the stored frame of a scan: a core, and a radius about it.

use nearmiss_geometry::Pose;
use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_mesh::nearest_on_triangle;

use crate::leaf::disc_triangle::FlatDisc;
use crate::solid::closest::{Closest, closest};
use crate::solid::extents::{extreme, frame, frame_of_triangle, spanned, upright_box};
use crate::solid::inner::inner_depth;
use crate::solid::plane::Plane;
use crate::solid::shape::{Shape, SupportMap};

type Vector = Vector3<f64>;

/// A convex shape without its radius, in the stored frame of a scan.
#[derive(Debug, Clone, Copy)]
enum Core<'a> {
    Point,
    /// A segment from the centre to both sides.
    Segment,
    /// The bounding box itself.
    Box,
    /// A truncated cone about the second axis of the bounding box, with these radii below and above.
    Round([f64; 2]),
    Triangle([Vector; 3]),
    /// Places in the world, the stored frame in the world, and a shift in the stored frame.
    Hull(&'a [[f64; 3]], &'a Pose, Vector),
    /// Likewise.
    Own(&'a dyn SupportMap, &'a Pose, Vector),
}

/// A convex shape in the stored frame of a scan.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Solid<'a> {
    core: Core<'a>,
    /// The radius about the core.
    pub(crate) radius: f64,
    /// The centre of a box about the core.
    pub(crate) centre: Vector,
    /// Unit directions of its edges.
    pub(crate) axes: [Vector; 3],
    /// Half its edge lengths.
    pub(crate) half: Vector,
    /// A point inside the shape, which tells the side on which it is.
    pub(crate) inside: Vector,
}

/// A core, relative to the centre of its box, whose distances and extents are bounded more closely than those
/// of the box.
#[derive(Debug, Clone, Copy)]
pub(crate) enum LaneCore<'c> {
    /// Nothing but its box is known.
    Box,
    /// A truncated cone about this axis: half its height and the radii below and above.
    Round { axis: [f32; 3], half: f32, radii: [f32; 2] },
    /// A hull of corners.
    Corners(&'c [[f32; 3]]),
}

/// The nearest points of a core and a disc.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Gap {
    /// The distance of the points: an upper bound.
    pub(crate) distance: f64,
    /// A lower bound.
    pub(crate) lower: f64,
    pub(crate) on_core: Vector,
    pub(crate) on_disc: Vector,
}

impl Gap {
    fn of(on_core: Vector, on_disc: Vector) -> Self {
        let distance = (on_core - on_disc).norm();
        Self { distance, lower: distance * (1.0 - 1e-9), on_core, on_disc }
    }
}

impl From<Closest> for Gap {
    fn from(Closest { points: [on_core, on_disc], distance, lower }: Closest) -> Self {
        Self { distance, lower, on_core, on_disc }
    }
}

impl<'a> Solid<'a> {
    /// Moves a shape into a stored frame, whose pose in the world is `placed`. `None` if the shape is
    /// invalid.
    pub(crate) fn new(shape: &Shape<'a>, placed: &'a Pose) -> Option<Self> {
        if !shape.is_valid() {
            return None;
        }
        let into = |p: [f64; 3]| Vector::from(placed.apply_inverse(p));
        let axes_of = |pose: &Pose| {
            [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
                .map(|axis| Vector::from(placed.rotate_inverse(pose.rotate(axis))))
        };
        let radius = shape.rounding() / placed.scale();
        let upright = [Vector::x(), Vector::y(), Vector::z()];
        let (core, centre, axes, half) = match *shape {
            Shape::Sphere { centre, .. } => (Core::Point, into(centre), upright, Vector::zeros()),
            Shape::Capsule { ends, .. } => {
                let [p, q] = ends.map(into);
                let (along, centre) = (0.5 * (q - p), 0.5 * (p + q));
                let length = along.norm();
                if length == 0.0 {
                    (Core::Point, centre, upright, Vector::zeros())
                } else {
                    (Core::Segment, centre, frame(along / length), Vector::new(length, 0.0, 0.0))
                }
            }
            Shape::Box { pose, half, .. } => {
                let half = Vector::from(half) * (pose.scale() / placed.scale());
                (Core::Box, into(pose.translation()), axes_of(&pose), half)
            }
            Shape::Cylinder { pose, half_height, radius, .. }
            | Shape::Cone { pose, half_height, radius, .. } => {
                let scale = pose.scale() / placed.scale();
                let (h, r) = (half_height * scale, radius * scale);
                let above = if matches!(shape, Shape::Cylinder { .. }) { r } else { 0.0 };
                (Core::Round([r, above]), into(pose.translation()), axes_of(&pose), Vector::new(r, h, r))
            }
            Shape::Triangle { points, .. } => {
                let corners = points.map(into);
                let axes = frame_of_triangle(&corners);
                let own = corners.map(Into::into);
                let (centre, half) = spanned(&axes, |d| extreme(&own, d));
                (Core::Triangle(corners), centre, axes, half)
            }
            Shape::Hull { points, .. } => {
                let (centre, half) = upright_box(points.iter().map(|&p| into(p)));
                (Core::Hull(points, placed, Vector::zeros()), centre, upright, half)
            }
            Shape::Own { map, .. } => {
                let core = Core::Own(map, placed, Vector::zeros());
                let probe = Self {
                    core,
                    radius,
                    centre: Vector::zeros(),
                    axes: upright,
                    half: Vector::zeros(),
                    inside: Vector::zeros(),
                };
                let (centre, half) = spanned(&upright, |d| probe.support(d));
                (core, centre, upright, half)
            }
        };
        let inside = match *shape {
            Shape::Own { map, .. } => into(map.centre()),
            Shape::Cone { .. } => centre - axes[1] * (0.5 * half.y),
            Shape::Triangle { points: [p, q, r], .. } => (into(p) + into(q) + into(r)) / 3.0,
            Shape::Hull { points, .. } => {
                #[expect(clippy::cast_precision_loss, reason = "a mean")]
                let count = points.len() as f64;
                points.iter().map(|&p| into(p) / count).sum()
            }
            _ => centre,
        };
        let is_finite = [centre, half, inside].iter().all(|v| v.iter().all(|c| c.is_finite()));
        (is_finite && radius.is_finite()).then_some(Self { core, radius, centre, axes, half, inside })
    }

    /// A single place of the stored frame.
    #[inline]
    pub(crate) fn point(place: Vector) -> Self {
        let axes = [Vector::x(), Vector::y(), Vector::z()];
        Self { core: Core::Point, radius: 0.0, centre: place, axes, half: Vector::zeros(), inside: place }
    }

    /// A ball of the stored frame; `None` if a coordinate is not finite or the radius is not a length.
    #[inline]
    pub(crate) fn ball((centre, radius): (Vector, f64)) -> Option<Self> {
        let is_valid = centre.iter().all(|c| c.is_finite()) && radius.is_finite() && radius >= 0.0;
        is_valid.then_some(Self { radius, ..Self::point(centre) })
    }

    /// Returns `true` if distances of the core from points are those of its bounding box.
    pub(crate) fn is_box(&self) -> bool {
        matches!(self.core, Core::Point | Core::Segment | Core::Box)
    }

    /// Returns `true` if [`LaneBox`](crate::solid::lanes::LaneBox) knows the distances of the core from
    /// points, not only bounds.
    pub(crate) fn is_closed_in_lanes(&self) -> bool {
        self.is_box() || self.round_ends().is_some()
    }

    /// Returns `true` if nothing is known of the core but its support map.
    pub(crate) fn is_own(&self) -> bool {
        matches!(self.core, Core::Own(..))
    }

    pub(crate) fn is_point(&self) -> bool {
        matches!(self.core, Core::Point)
    }

    /// The radii below and above of a core that is a truncated cone about the second axis.
    pub(crate) fn round_ends(&self) -> Option<[f64; 2]> {
        if let Core::Round(radii) = self.core { Some(radii) } else { None }
    }

    /// Returns `true` if the nearest point of the core is known without an iteration.
    pub(crate) fn has_projection(&self) -> bool {
        !matches!(self.core, Core::Hull(..) | Core::Own(..))
    }

    /// Returns `true` if the core is a point or a segment along the first axis.
    pub(crate) fn is_segment(&self) -> bool {
        matches!(self.core, Core::Point | Core::Segment)
    }

    /// The radius of a ball about [`Self::inside`] that is within the shape: a lower bound of the greatest.
    pub(crate) fn inner_radius(&self) -> f64 {
        let of_core = match self.core {
            Core::Box => self.half.min(),
            Core::Round([below, above]) if below == above => self.half.min(),
            _ => 0.0,
        };
        self.radius + of_core
    }

    fn ends(&self) -> [Vector; 2] {
        let along = self.axes[0] * self.half.x;
        [self.centre - along, self.centre + along]
    }

    /// The point of the core furthest along `d`.
    pub(crate) fn support(&self, d: &Vector) -> Vector {
        match self.core {
            Core::Point => self.centre,
            Core::Segment | Core::Box => (0..3)
                .fold(self.centre, |p, k| p + self.axes[k] * self.half[k].copysign(d.dot(&self.axes[k]))),
            Core::Round(radii) => {
                let [first, axis, second] = self.axes;
                // By both components: what `d` has across the axis may be no more than rounding.
                let (x, z) = (d.dot(&first), d.dot(&second));
                let length = (x * x + z * z).sqrt();
                let out = if length > 0.0 { (first * x + second * z) / length } else { Vector::zeros() };
                let [low, high] = [-1.0, 1.0].map(|side: f64| {
                    let radius = radii[usize::from(side > 0.0)];
                    self.centre + axis * (side * self.half.y) + out * radius
                });
                if d.dot(&(high - low)) > 0.0 { high } else { low }
            }
            Core::Triangle(corners) => extreme(&corners.map(Into::into), d),
            Core::Hull(points, placed, shift) => {
                let towards = Vector::from(placed.rotate((*d).into()));
                let furthest = extreme(points, &towards);
                Vector::from(placed.apply_inverse(furthest.into())) + shift
            }
            Core::Own(map, placed, shift) => {
                Vector::from(placed.apply_inverse(map.support(placed.rotate((*d).into())))) + shift
            }
        }
    }

    /// The point of the core nearest to `x`.
    pub(crate) fn nearest(&self, x: &Vector) -> Vector {
        let away = x - self.centre;
        match self.core {
            Core::Point => self.centre,
            Core::Segment | Core::Box => (0..3).fold(self.centre, |p, k| {
                p + self.axes[k] * away.dot(&self.axes[k]).clamp(-self.half[k], self.half[k])
            }),
            Core::Round([below, above]) => {
                let axis = self.axes[1];
                let height = axis.dot(&away);
                let across = away - axis * height;
                let beside = across.norm();
                let out = if beside > 0.0 { across / beside } else { Vector::zeros() };
                let [radius, height] = in_trapezium([beside, height], self.half.y, [below, above]);
                self.centre + axis * height + out * radius
            }
            Core::Triangle(corners) => nearest_on_triangle(&corners.map(Into::into), (*x).into()).into(),
            Core::Hull(..) | Core::Own(..) => {
                // Relative to x, so that rounding is relative to the distance.
                let support = |d: &Vector| [self.support(d) - x, Vector::zeros()];
                x + closest(support, self.inside - x, [0.0, f64::INFINITY]).points[0]
            }
        }
    }

    /// The core in single precision, relative to the centre of its box. `corners` is memory for that.
    #[expect(clippy::cast_possible_truncation, reason = "as precise as the box in single precision")]
    pub(crate) fn lane_core<'c>(&self, corners: &'c mut Vec<[f32; 3]>) -> LaneCore<'c> {
        let single = |v: Vector| [v.x as f32, v.y as f32, v.z as f32];
        corners.clear();
        match self.core {
            Core::Point | Core::Segment | Core::Box | Core::Own(..) => LaneCore::Box,
            Core::Round(radii) => LaneCore::Round {
                axis: single(self.axes[1]),
                half: self.half.y as f32,
                radii: radii.map(|radius| radius as f32),
            },
            Core::Triangle(own) => {
                corners.extend(own.map(|corner| single(corner - self.centre)));
                LaneCore::Corners(corners)
            }
            Core::Hull(points, placed, shift) => {
                let own = |&p: &[f64; 3]| single(Vector::from(placed.apply_inverse(p)) + shift - self.centre);
                corners.extend(points.iter().map(own));
                LaneCore::Corners(corners)
            }
        }
    }

    /// The same shape shifted by `t`.
    pub(crate) fn shifted(&self, t: &Vector) -> Self {
        let core = match self.core {
            Core::Triangle(corners) => Core::Triangle(corners.map(|corner| corner + t)),
            Core::Hull(points, placed, before) => Core::Hull(points, placed, before + t),
            Core::Own(map, placed, before) => Core::Own(map, placed, before + t),
            other => other,
        };
        Self { core, centre: self.centre + t, inside: self.inside + t, ..*self }
    }

    /// More than the rounding error of a point of the core that is nearest to `x`, if `x` is in the core.
    pub(crate) fn rounding(&self, x: &Vector) -> f64 {
        1e-12 * (self.half.norm() + self.radius) + 2e-15 * x.amax()
    }

    /// The depth of `x` in the shape: a lower bound of its distance from the boundary, and the direction away
    /// from there. `None` if it is outside.
    pub(crate) fn depth(&self, x: &Vector) -> Option<(f64, Vector)> {
        let on_core = self.nearest(x);
        let away = x - on_core;
        let distance = away.norm();
        if distance > self.rounding(x) {
            return (distance < self.radius).then(|| (self.radius - distance, -away / distance));
        }
        let (depth, out) = match self.core {
            Core::Point | Core::Segment | Core::Triangle(_) => (0.0, Vector::zeros()),
            Core::Box | Core::Round(_) | Core::Hull(..) | Core::Own(..) => {
                let scale = self.half.amax();
                inner_depth(|d| self.support(d) - x, scale)
            }
        };
        let uphill = if depth > 0.0 { -out } else { Vector::zeros() };
        (self.radius + depth > 0.0).then_some((self.radius + depth, uphill))
    }

    /// A place inside the shape with its [`Self::depth`]: `x`, or if that is outside, the nearest one of the
    /// core.
    pub(crate) fn deep_near(&self, x: &Vector) -> (Vector, (f64, Vector)) {
        match self.depth(x) {
            Some(depth) => (*x, depth),
            None => (self.nearest(x), (self.radius, Vector::zeros())),
        }
    }

    /// A lower bound on the distance of `x` from the core.
    pub(crate) fn distance_bound(&self, x: &Vector) -> f64 {
        if self.has_projection() {
            return self.distance(x) * (1.0 - 1e-9);
        }
        let support = |d: &Vector| [self.support(d) - x, Vector::zeros()];
        closest(support, self.inside - x, [0.0, f64::INFINITY]).lower
    }

    /// The distance of `x` from the core.
    pub(crate) fn distance(&self, x: &Vector) -> f64 {
        (x - self.nearest(x)).norm()
    }

    /// The nearest points of the core and a disc; any two points if their distance exceeds `beyond`.
    pub(crate) fn gap(&self, disc: &FlatDisc, beyond: f64) -> Gap {
        match self.core {
            Core::Point => Gap::of(self.centre, disc.nearest(&self.centre)),
            Core::Segment => {
                let [p, q] = self.ends();
                let x = p + (q - p) * disc.nearest_share(p, q - p);
                Gap::of(x, disc.nearest(&x))
            }
            Core::Triangle(corners) => {
                let found = disc.nearest_to(&corners.map(Into::into));
                Gap::of(found.on_triangle, found.on_disc)
            }
            Core::Box | Core::Round(_) => {
                self.projected(disc, beyond).unwrap_or_else(|start| self.iterated(disc, start, [0.0, beyond]))
            }
            Core::Hull(..) | Core::Own(..) => self.iterated(disc, self.inside - disc.centre, [0.0, beyond]),
        }
    }

    /// The plane through the point of the core that is furthest against `way`. `None` if that has no length.
    pub(crate) fn plane_across(&self, way: &Vector) -> Option<Plane> {
        let normal = way.try_normalize(0.0)?;
        Some(Plane::through(&self.support(&-normal), normal))
    }

    /// Two points of the core and a disc that are at most `within` apart, if there are any; otherwise any
    /// two.
    pub(crate) fn gap_within(&self, disc: &FlatDisc, within: f64) -> Gap {
        match self.core {
            Core::Point | Core::Segment | Core::Triangle(_) => self.gap(disc, within),
            _ => self.iterated(disc, self.inside - disc.centre, [within, within]),
        }
    }

    /// The nearest points of the core and a triangle; any two points if their distance exceeds `beyond`.
    pub(crate) fn triangle_gap(&self, corners: &[Vector; 3], beyond: f64) -> Closest {
        // Relative to a corner, so that rounding is relative to the distance.
        let origin = corners[0];
        let own = corners.map(|corner| corner - origin);
        if let Core::Point = self.core {
            let place = self.centre - origin;
            let foot = Vector::from(nearest_on_triangle(&own.map(Into::into), place.into()));
            let distance = (place - foot).norm();
            let error = 1e-14 * own.iter().fold(place.amax(), |most, corner| most.max(corner.amax()));
            let lower = (distance * (1.0 - 1e-9) - error).max(0.0);
            return Closest { points: [self.centre, foot + origin], distance, lower };
        }
        let start = self.inside - origin - (own[1] + own[2]) / 3.0;
        let of_triangle = own.map(Into::into);
        let support = |d: &Vector| [self.support(d) - origin, extreme(&of_triangle, &-d)];
        let Closest { points, distance, lower } = closest(support, start, [0.0, beyond]);
        Closest { points: points.map(|p| p + origin), distance, lower }
    }

    /// The nearest points of the core and a disc, if each is soon the point nearest to the other; any two if
    /// their distance exceeds `beyond`. Otherwise the difference of the last two.
    fn projected(&self, disc: &FlatDisc, beyond: f64) -> Result<Gap, Vector> {
        const ROUNDS: u32 = 3;
        /// In disc radii.
        const SAME: f64 = 1e-10;
        let mut on_core = self.nearest(&disc.centre);
        for _ in 0..ROUNDS {
            let on_disc = disc.nearest(&on_core);
            let next = self.nearest(&on_disc);
            let is_same = (next - on_core).norm_squared() <= (SAME * disc.radius).powi(2);
            on_core = next;
            let way = on_core - on_disc;
            let distance = way.norm();
            // From the plane across the way between them.
            let apart = self.support(&-way) - disc.centre - disc.rim(&way);
            let lower = if distance > 0.0 { way.dot(&apart) / distance } else { 0.0 };
            if is_same || lower > beyond {
                return Ok(Gap { distance, lower: lower.clamp(0.0, distance), on_core, on_disc });
            }
        }
        Err(on_core - disc.nearest(&on_core))
    }

    /// The nearest points of the core and a disc by their support maps.
    fn iterated(&self, disc: &FlatDisc, start: Vector, ends: [f64; 2]) -> Gap {
        // Relative to the centre of the disc, so that rounding is relative to the distance.
        let centre = disc.centre;
        let support = |d: &Vector| [self.support(d) - centre, disc.rim(&-d)];
        let Closest { points, distance, lower } = closest(support, start, ends);
        Closest { points: points.map(|p| p + centre), distance, lower }.into()
    }
}

/// The point nearest to `p` of the section of a truncated cone: (distance from the axis, height).
fn in_trapezium(p: [f64; 2], half: f64, [below, above]: [f64; 2]) -> [f64; 2] {
    let [beside, height] = p;
    let side = [above - below, 2.0 * half];
    // Inside, if it is neither above, nor below, nor to the outer side of the slanted side, which is a point
    // or level if the cone is flat.
    let within = side[1] * (beside - below) - side[0] * (height + half) <= 0.0;
    if within && height.abs() <= half && beside <= below.max(above) {
        return p;
    }
    let lids = [[beside.min(below), -half], [beside.min(above), half]];
    let square = side[0] * side[0] + side[1] * side[1];
    let share = if square > 0.0 {
        (((beside - below) * side[0] + (height + half) * side[1]) / square).clamp(0.0, 1.0)
    } else {
        0.0
    };
    let slanted = [below + side[0] * share, -half + side[1] * share];
    let apart_sq = |q: [f64; 2]| (q[0] - beside).powi(2) + (q[1] - height).powi(2);
    let nearer = |a: [f64; 2], b: [f64; 2]| if apart_sq(b) < apart_sq(a) { b } else { a };
    nearer(nearer(lids[0], lids[1]), slanted)
}
