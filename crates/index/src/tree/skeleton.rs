//! Shapes that queries measure distances from: points, segments and boxes.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16};
use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_lanes::wide::squared;

use super::Boxes;

/// A shape without thickness. Points within a radius of a point form a sphere, of a segment a
/// capsule.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Skeleton {
    /// A point.
    Point([f64; 3]),
    /// A segment between two points, which may coincide.
    Segment([[f64; 3]; 2]),
    /// A solid box about `centre`, with half edge lengths `half` along the orthonormal `axes`.
    Box {
        /// The centre.
        centre: [f64; 3],
        /// Half the edge lengths.
        half: [f64; 3],
        /// Unit directions of the edges.
        axes: [[f64; 3]; 3],
    },
}

impl Skeleton {
    /// Returns the squared distance of `p` in double precision. Searches are exact with respect to
    /// it.
    #[must_use]
    pub fn distance_sq(&self, p: [f64; 3]) -> f64 {
        let p = Vector3::from(p);
        match *self {
            Self::Point(centre) => (p - Vector3::from(centre)).norm_squared(),
            Self::Segment([from, to]) => {
                let (away, along) = (p - Vector3::from(from), Vector3::from(to) - Vector3::from(from));
                let length_sq = along.norm_squared();
                let share =
                    if length_sq > 0.0 { (away.dot(&along) / length_sq).clamp(0.0, 1.0) } else { 0.0 };
                (away - along * share).norm_squared()
            }
            Self::Box { centre, half, axes } => {
                let away = p - Vector3::from(centre);
                let beyond = |k: usize| (away.dot(&Vector3::from(axes[k])).abs() - half[k]).max(0.0);
                beyond(0).powi(2) + beyond(1).powi(2) + beyond(2).powi(2)
            }
        }
    }

    /// Returns the centre and the radius of a ball that contains the shape.
    #[must_use]
    pub fn ball(&self) -> ([f64; 3], f64) {
        match *self {
            Self::Point(centre) => (centre, 0.0),
            Self::Segment([from, to]) => {
                let (from, to) = (Vector3::from(from), Vector3::from(to));
                (from.lerp(&to, 0.5).into(), 0.5 * (to - from).norm())
            }
            Self::Box { centre, half, .. } => (centre, Vector3::from(half).norm()),
        }
    }

    /// Returns a bound on the error of distances in single precision, for points near the shape.
    pub(super) fn slack(&self) -> f64 {
        /// In units of 2⁻²⁴: one each for a coordinate of the point, of the shape and of their
        /// difference, three for products and sums, the same again for rounded directions; below 40
        /// in all.
        const ROUNDING: f64 = 2.5e-6;
        let far = |v: [f64; 3]| v[0].abs() + v[1].abs() + v[2].abs();
        let reach = match *self {
            Self::Point(centre) => far(centre),
            Self::Segment([from, to]) => far(from) + 2.0 * far(to),
            Self::Box { centre, half, .. } => far(centre) + far(half),
        };
        ROUNDING * reach
    }
}

/// A skeleton in single precision that computes distances in lanes.
pub(super) trait Lanes: Copy {
    /// Returns lower bounds of the squared distances of boxes; infinite in unused lanes.
    fn of_boxes<S: Simd>(self, simd: S, boxes: &Boxes) -> f32x16<S>;

    /// Returns the squared distances of points.
    fn of_points<S: Simd>(self, simd: S, points: [f32x16<S>; 3]) -> f32x16<S>;
}

#[expect(clippy::cast_possible_truncation, reason = "slack covers the rounding")]
pub(super) fn single(v: [f64; 3]) -> [f32; 3] {
    [v[0] as f32, v[1] as f32, v[2] as f32]
}

/// A point.
#[derive(Clone, Copy)]
pub(super) struct Place(pub(super) [f32; 3]);

impl Lanes for Place {
    #[inline(always)]
    fn of_boxes<S: Simd>(self, simd: S, boxes: &Boxes) -> f32x16<S> {
        Span { min: self.0, max: self.0 }.of_boxes(simd, boxes)
    }

    #[inline(always)]
    fn of_points<S: Simd>(self, _simd: S, [x, y, z]: [f32x16<S>; 3]) -> f32x16<S> {
        squared([x - self.0[0], y - self.0[1], z - self.0[2]])
    }
}

/// An axis-aligned box.
#[derive(Clone, Copy)]
struct Span {
    min: [f32; 3],
    max: [f32; 3],
}

impl Span {
    #[inline(always)]
    fn of_boxes<S: Simd>(self, simd: S, boxes: &Boxes) -> f32x16<S> {
        let mut apart = [f32x16::simd_from(simd, 0.0); 3];
        for k in 0..3 {
            let above = f32x16::load_array_ref(simd, &boxes.min[k]) - self.max[k];
            let below = -(f32x16::load_array_ref(simd, &boxes.max[k]) - self.min[k]);
            apart[k] = above.max(below).max(apart[k]);
        }
        squared(apart)
    }
}

/// Returns the centres and radii of the boxes' bounding spheres.
#[inline(always)]
fn balls<S: Simd>(simd: S, boxes: &Boxes) -> ([f32x16<S>; 3], f32x16<S>) {
    let mut middle = [f32x16::simd_from(simd, 0.0); 3];
    let mut half = middle;
    for k in 0..3 {
        let (min, max) =
            (f32x16::load_array_ref(simd, &boxes.min[k]), f32x16::load_array_ref(simd, &boxes.max[k]));
        middle[k] = (min + max) * 0.5;
        half[k] = (max - min) * 0.5;
    }
    (middle, squared(half).sqrt())
}

/// Returns lower bounds of the squared distances of boxes from a skeleton: the greater of
/// `apart_sq`, from the skeleton's AABB, and the bound by the boxes' bounding spheres, whose
/// centres have squared distance `middle_sq`.
#[inline(always)]
fn outside<S: Simd>(middle_sq: f32x16<S>, radius: f32x16<S>, apart_sq: f32x16<S>) -> f32x16<S> {
    // Centre and radius are NaN in unused lanes, where `apart_sq` is selected.
    let beyond = (middle_sq.sqrt() - radius * (1.0 + 1e-6)) * (1.0 - 1e-6);
    let beyond_sq = beyond.max(0.0) * beyond;
    let is_more = beyond_sq.simd_gt(apart_sq);
    middle_sq.token().select_f32x16(is_more, beyond_sq, apart_sq)
}

/// A segment.
#[derive(Clone, Copy)]
pub(super) struct Stretch {
    from: [f32; 3],
    along: [f32; 3],
    /// The reciprocal of the squared length, or 0.
    per_length_sq: f32,
    span: Span,
}

impl Stretch {
    pub(super) fn new([from, to]: [[f64; 3]; 2]) -> Self {
        let along = [to[0] - from[0], to[1] - from[1], to[2] - from[2]];
        let length_sq = Vector3::from(single(along)).norm_squared();
        let (a, b) = (single(from), single(to));
        let per_length_sq = if length_sq > 0.0 { 1.0 / length_sq } else { 0.0 };
        let span = Span { min: [0, 1, 2].map(|k| a[k].min(b[k])), max: [0, 1, 2].map(|k| a[k].max(b[k])) };
        Self { from: a, along: single(along), per_length_sq, span }
    }
}

impl Lanes for Stretch {
    #[inline(always)]
    fn of_boxes<S: Simd>(self, simd: S, boxes: &Boxes) -> f32x16<S> {
        let (middle, radius) = balls(simd, boxes);
        outside(self.of_points(simd, middle), radius, self.span.of_boxes(simd, boxes))
    }

    #[inline(always)]
    fn of_points<S: Simd>(self, _simd: S, [x, y, z]: [f32x16<S>; 3]) -> f32x16<S> {
        let [ax, ay, az] = self.along;
        let away = [x - self.from[0], y - self.from[1], z - self.from[2]];
        let share = (away[0] * ax + away[1] * ay + away[2] * az) * self.per_length_sq;
        let share = share.max(0.0).min(1.0);
        squared([away[0] - share * ax, away[1] - share * ay, away[2] - share * az])
    }
}

/// A box.
#[derive(Clone, Copy)]
pub(super) struct Block {
    centre: [f32; 3],
    half: [f32; 3],
    axes: [[f32; 3]; 3],
    span: Span,
}

impl Block {
    pub(super) fn new(centre: [f64; 3], half: [f64; 3], axes: [[f64; 3]; 3]) -> Self {
        let reach = [0, 1, 2].map(|k| (0..3).map(|j| half[j] * axes[j][k].abs()).sum::<f64>());
        let side = |sign: f64| single([0, 1, 2].map(|k| centre[k] + sign * reach[k]));
        let axes = [single(axes[0]), single(axes[1]), single(axes[2])];
        let span = Span { min: side(-1.0), max: side(1.0) };
        Self { centre: single(centre), half: single(half), axes, span }
    }
}

impl Lanes for Block {
    #[inline(always)]
    fn of_boxes<S: Simd>(self, simd: S, boxes: &Boxes) -> f32x16<S> {
        let (middle, radius) = balls(simd, boxes);
        outside(self.of_points(simd, middle), radius, self.span.of_boxes(simd, boxes))
    }

    #[inline(always)]
    fn of_points<S: Simd>(self, simd: S, [x, y, z]: [f32x16<S>; 3]) -> f32x16<S> {
        let away = [x - self.centre[0], y - self.centre[1], z - self.centre[2]];
        let mut beyond = [f32x16::simd_from(simd, 0.0); 3];
        for k in 0..3 {
            let [ax, ay, az] = self.axes[k];
            let along = (away[0] * ax + away[1] * ay + away[2] * az).abs();
            beyond[k] = (along - self.half[k]).max(beyond[k]);
        }
        squared(beyond)
    }
}
