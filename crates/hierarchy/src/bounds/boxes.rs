//! Oriented boxes, and whether two of them in relative motion overlap.
//!
//! The separating-axis test of Gottschalk, Lin & Manocha ("`OBBTree`", SIGGRAPH 1996) with the six face
//! normals only: the nine edge axes exclude few further pairs of thin patches and cost more than they save
//! (benches/record).

use bytemuck::{Pod, Zeroable};
use fearless_simd::{Simd, f32x4, f32x16};
use nearmiss_geometry::Pose;
use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_lanes::vector::{dot, sub};
use serde::{Deserialize, Serialize};

type Axes = [[f32; 3]; 3];

/// A box about `centre` with half edge lengths `half` along the orthonormal `axes`. One cache line.
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable, Serialize, Deserialize)]
#[repr(C, align(64))]
pub struct OrientedBox {
    /// The middle.
    pub centre: [f32; 3],
    /// Half the edge lengths.
    pub half: [f32; 3],
    /// Unit directions of the edges, a right-handed frame.
    pub axes: Axes,
    /// Greatest local sampling radius of the points inside.
    pub reach: f32,
}

/// What rounding can do to an interval of a box, relative to the greatest coordinate along its axes. In units
/// of 2⁻²⁴: 3 for each coordinate, 3 and 2 for the centre and its sums, 7 for axes that are orthonormal to
/// rounding only, √3 between coordinates and lengths; together below 30.
pub(crate) const ROUNDING: f32 = 2e-6;

/// The same for a gap between boxes in motion, relative to the sum of all lengths involved: 12 for the centre
/// of the box that is moved, 4 for the distance of the centres along an axis, 18 for the half lengths, each
/// less than 8 off in its cosine; together below 40.
pub const SLACK: f32 = 4e-6;

impl OrientedBox {
    /// The least box along `axes` that contains all `intervals`, given per axis; grown by what rounding may
    /// have cost.
    pub(crate) fn spanned(axes: Axes, low: [f32; 3], high: [f32; 3], reach: f32) -> Self {
        let middle = [0, 1, 2].map(|k| 0.5 * low[k] + 0.5 * high[k]);
        let far = (0..3).fold(0.0_f32, |m, k| m.max(low[k].abs()).max(high[k].abs()));
        let centre =
            [0, 1, 2].map(|k| middle[0] * axes[0][k] + middle[1] * axes[1][k] + middle[2] * axes[2][k]);
        let half = [0, 1, 2].map(|k| 0.5 * high[k] - 0.5 * low[k] + ROUNDING * far);
        Self { centre, half, axes, reach }
    }

    /// Least and greatest coordinate along each of `axes`.
    pub(crate) fn along(&self, axes: &Axes) -> [[f32; 2]; 3] {
        axes.map(|axis| {
            let middle = dot(axis, self.centre);
            let spread: f32 = (0..3).map(|k| self.half[k] * dot(axis, self.axes[k]).abs()).sum();
            [middle - spread, middle + spread]
        })
    }

    /// Squared distance of `p` from the box, 0 inside.
    #[inline]
    #[must_use]
    pub fn distance_sq(&self, p: [f32; 3]) -> f32 {
        let d = sub(p, self.centre);
        let beyond = |k: usize| (dot(self.axes[k], d).abs() - self.half[k]).max(0.0);
        let (x, y, z) = (beyond(0), beyond(1), beyond(2));
        x * x + y * y + z * z
    }

    /// Distance from the centre to a corner.
    #[must_use]
    pub fn radius(&self) -> f32 {
        dot(self.half, self.half).sqrt()
    }
}

/// The motion of one scan's stored frame into another's, in single precision for the hot path, with a bound
/// on what rounding costs there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Relative {
    /// Rows of scale · rotation.
    linear: Axes,
    /// Rows of the rotation.
    rotation: Axes,
    translation: [f32; 3],
    scale: f32,
    scale_back: f32,
    slack: f32,
}

impl Relative {
    /// The motion `pose` from b's stored frame to a's; `reach` bounds the coordinates of both in a's frame.
    #[must_use]
    #[expect(clippy::cast_possible_truncation, reason = "slack covers the rounding")]
    pub fn new(pose: &Pose, reach: f64) -> Self {
        let (r, [x, y, z]) = (pose.rotation(), pose.translation());
        let row = |i: usize| [r[(i, 0)] as f32, r[(i, 1)] as f32, r[(i, 2)] as f32];
        let rotation = [row(0), row(1), row(2)];
        let scale = pose.scale() as f32;
        let scaled = |i: usize| [rotation[i][0] * scale, rotation[i][1] * scale, rotation[i][2] * scale];
        Self {
            linear: [scaled(0), scaled(1), scaled(2)],
            rotation,
            translation: [x as f32, y as f32, z as f32],
            scale,
            scale_back: pose.scale().recip() as f32,
            slack: SLACK * reach as f32,
        }
    }

    /// A point of b's frame in a's.
    #[inline]
    #[must_use]
    pub fn point(&self, p: [f32; 3]) -> [f32; 3] {
        let [rx, ry, rz] = self.linear;
        let [tx, ty, tz] = self.translation;
        [dot(rx, p) + tx, dot(ry, p) + ty, dot(rz, p) + tz]
    }

    /// Four points of b's frame in a's.
    #[inline(always)]
    pub(crate) fn points_of_four<S: Simd>(&self, p: [f32x4<S>; 3]) -> [f32x4<S>; 3] {
        let [x, y, z] = turned(&self.linear, p);
        let [tx, ty, tz] = self.translation;
        [x + tx, y + ty, z + tz]
    }

    /// Four directions of b's frame in a's.
    #[inline(always)]
    pub(crate) fn directions_of_four<S: Simd>(&self, v: [f32x4<S>; 3]) -> [f32x4<S>; 3] {
        turned(&self.rotation, v)
    }

    /// A direction of b's frame in a's.
    #[inline]
    #[must_use]
    pub fn direction(&self, v: [f32; 3]) -> [f32; 3] {
        let [rx, ry, rz] = self.rotation;
        [dot(rx, v), dot(ry, v), dot(rz, v)]
    }

    /// Points of a's frame in b's.
    #[inline(always)]
    #[must_use]
    pub fn points_back<S: Simd>(&self, points: &[f32x16<S>; 3]) -> [f32x16<S>; 3] {
        let [tx, ty, tz] = self.translation;
        let (x, y, z) = (points[0] - tx, points[1] - ty, points[2] - tz);
        let [rx, ry, rz] = self.rotation;
        let back = self.scale_back();
        [
            (x * rx[0] + y * ry[0] + z * rz[0]) * back,
            (x * rx[1] + y * ry[1] + z * rz[1]) * back,
            (x * rx[2] + y * ry[2] + z * rz[2]) * back,
        ]
    }

    /// Sixteen points of b's frame in a's.
    #[inline(always)]
    #[must_use]
    pub fn points<S: Simd>(&self, points: &[f32x16<S>; 3]) -> [f32x16<S>; 3] {
        let [x, y, z] = *points;
        let ([rx, ry, rz], [tx, ty, tz]) = (self.linear, self.translation);
        [
            x * rx[0] + y * rx[1] + z * rx[2] + tx,
            x * ry[0] + y * ry[1] + z * ry[2] + ty,
            x * rz[0] + y * rz[1] + z * rz[2] + tz,
        ]
    }

    /// A point of a's frame in b's.
    #[inline]
    #[must_use]
    pub fn point_back(&self, p: [f32; 3]) -> [f32; 3] {
        let p = sub(p, self.translation);
        let [x, y, z] = self.direction_back(p);
        [x * self.scale_back, y * self.scale_back, z * self.scale_back]
    }

    /// A direction of a's frame in b's.
    #[inline]
    #[must_use]
    pub fn direction_back(&self, v: [f32; 3]) -> [f32; 3] {
        let [rx, ry, rz] = self.rotation;
        [
            rx[0] * v[0] + ry[0] * v[1] + rz[0] * v[2],
            rx[1] * v[0] + ry[1] * v[1] + rz[1] * v[2],
            rx[2] * v[0] + ry[2] * v[1] + rz[2] * v[2],
        ]
    }

    /// Length in b's frame of a unit of a's.
    #[inline]
    #[must_use]
    pub fn scale_back(&self) -> f32 {
        self.scale_back
    }

    /// Length in a's frame of a unit of b's.
    #[inline]
    #[must_use]
    pub fn scale(&self) -> f32 {
        self.scale
    }

    /// A bound on the error of a transformed coordinate.
    #[inline]
    #[must_use]
    pub fn slack(&self) -> f32 {
        self.slack
    }

    /// How far a box of a and one of b are apart along the face normal that parts them most. Negative when
    /// they overlap along all six. A positive value, less [`Relative::slack`], is a lower bound of their
    /// distance.
    #[inline]
    #[must_use]
    pub fn gap(&self, a: &OrientedBox, b: &OrientedBox) -> f32 {
        let mut gap = f32::MIN;
        self.along_normals(a, b, |distance, reach| gap = greater(gap, distance - reach));
        gap
    }

    /// How much of each other two boxes overlap, with `margin` about them: 1 less the distance of their
    /// centres along a face normal as a share of how far the two and `margin` reach along that, the least of
    /// the six. 1 where they share a centre, 0 where they are just so far apart.
    #[inline]
    #[must_use]
    pub fn overlap(&self, a: &OrientedBox, b: &OrientedBox, margin: f32) -> f32 {
        let mut share = 0.0;
        self.along_normals(a, b, |distance, reach| share = greater(share, distance / (reach + margin)));
        1.0 - share
    }

    /// Tells along each of the six face normals of two boxes the distance of their centres and how far both
    /// reach.
    #[inline]
    fn along_normals(&self, a: &OrientedBox, b: &OrientedBox, mut tell: impl FnMut(f32, f32)) {
        let b = self.moved(b);
        let d = sub(b.centre, a.centre);
        let mut reach_b = b.half;
        for i in 0..3 {
            let mut reach_a = a.half[i];
            for j in 0..3 {
                let cosine = dot(a.axes[i], b.axes[j]).abs();
                reach_a += b.half[j] * cosine;
                reach_b[j] += a.half[i] * cosine;
            }
            tell(dot(a.axes[i], d).abs(), reach_a);
        }
        for j in 0..3 {
            tell(dot(b.axes[j], d).abs(), reach_b[j]);
        }
    }

    /// A box of b's frame in a's.
    #[inline]
    #[must_use]
    pub fn moved(&self, b: &OrientedBox) -> OrientedBox {
        let [hx, hy, hz] = b.half;
        let [ex, ey, ez] = b.axes;
        OrientedBox {
            centre: self.point(b.centre),
            half: [hx * self.scale, hy * self.scale, hz * self.scale],
            axes: [self.direction(ex), self.direction(ey), self.direction(ez)],
            reach: b.reach,
        }
    }
}

#[inline(always)]
fn turned<S: Simd>(rows: &Axes, [x, y, z]: [f32x4<S>; 3]) -> [f32x4<S>; 3] {
    let [rx, ry, rz] = rows;
    [x * rx[0] + y * rx[1] + z * rx[2], x * ry[0] + y * ry[1] + z * ry[2], x * rz[0] + y * rz[1] + z * rz[2]]
}

/// The greater of `x` and `y`; `y` if either is NaN.
#[inline]
fn greater(x: f32, y: f32) -> f32 {
    if x > y { x } else { y }
}

/// Three unit vectors in single precision.
#[expect(clippy::cast_possible_truncation, reason = "box axes are single precision")]
pub(crate) fn to_axes(vectors: [[f64; 3]; 3]) -> Axes {
    vectors.map(|v| Vector3::from(v).normalize().map(|x| x as f32).into())
}
