//! Oriented boxes, and the overlap test of two of them in a relative pose.
//!
//! The test is the separating-axis test of Gottschalk, Lin & Manocha ("`OBBTree`", SIGGRAPH 1996)
//! with the six face normals only. The nine edge axes separate few further pairs of thin patches
//! and cost more than they save (benches/record).

use std::ops::{Add, Mul};

use bytemuck::{Pod, Zeroable};
use fearless_simd::{Simd, f32x4, f32x16};
use nearmiss_geometry::Pose;
use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_index::{CutBox, Slab};
use nearmiss_lanes::vector::{cross, dot, sub};
use serde::{Deserialize, Serialize};

type Axes = [[f32; 3]; 3];

/// A box around `centre` with half edge lengths `half` along the orthonormal `axes`. One cache
/// line.
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable, Serialize, Deserialize)]
#[repr(C, align(64))]
pub struct OrientedBox {
    /// The centre.
    pub centre: [f32; 3],
    /// Half the edge lengths.
    pub half: [f32; 3],
    /// Unit directions of the edges. The third one is the product of the first two.
    pub axes: Axes,
    /// Greatest local sampling radius of the points inside.
    pub reach: f32,
}

/// Bound on the rounding error of an interval of a box, relative to the greatest coordinate along
/// its axes. In units of 2⁻²⁴: 3 for each coordinate, 3 and 2 for the centre and its sums, 20 for
/// axes that are orthonormal only up to rounding (the third one is a product of rounded vectors), √3
/// between coordinates and lengths; below 40 in all.
pub(crate) const ROUNDING: f32 = 3e-6;

/// Bound on the rounding error of a gap between boxes in a relative pose, relative to the sum of
/// all lengths involved. In units of 2⁻²⁴: 12 for the centre of the transformed box, 4 for the
/// distance of the centres along an axis, 30 for the half lengths, each less than 18 off in its
/// cosine; below 50 in all.
pub const SLACK: f32 = 4e-6;

impl OrientedBox {
    /// An empty box without axes, as by default.
    pub(crate) const NONE: Self = Self { centre: [0.0; 3], half: [0.0; 3], axes: [[0.0; 3]; 3], reach: 0.0 };

    /// The least and the greatest corner of a box along the coordinate axes about this one, a little larger.
    pub(crate) fn upright(&self) -> [[f64; 3]; 2] {
        let half = [0, 1, 2]
            .map(|k| (0..3).map(|j| f64::from(self.axes[j][k].abs()) * f64::from(self.half[j])).sum::<f64>());
        [-1.0, 1.0].map(|sign| [0, 1, 2].map(|k| f64::from(self.centre[k]) + sign * 1.000_001 * half[k]))
    }

    /// The upright box about this one, and the three slabs that it is the common part of, the thinnest first.
    /// The inner part is another box with the same axes.
    #[expect(clippy::cast_possible_truncation, reason = "rounded outwards")]
    pub(crate) fn cut(&self, inner: &Self) -> CutBox {
        let [min, max] = self.upright();
        let mut order = [0, 1, 2];
        order.sort_by(|&a, &b| self.half[a].total_cmp(&self.half[b]));
        let between = |of: &Self, k: usize| {
            let middle: f64 = (0..3).map(|j| f64::from(self.axes[k][j]) * f64::from(of.centre[j])).sum();
            let half = 1.000_001 * f64::from(of.half[k]);
            [((middle - half) as f32).next_down(), ((middle + half) as f32).next_up()]
        };
        CutBox {
            min: min.map(|c| (c as f32).next_down()),
            max: max.map(|c| (c as f32).next_up()),
            slabs: order.map(|k| Slab {
                normal: self.axes[k],
                between: between(self, k),
                inner: between(inner, k),
            }),
        }
    }

    /// Returns the smallest box along `axes` that contains an interval on each axis, grown by the
    /// rounding error.
    #[inline(always)]
    pub(crate) fn spanned(axes: Axes, low: [f32; 3], high: [f32; 3], reach: f32) -> Self {
        let (mut middle, mut far) = ([0.0; 3], 0.0_f32);
        for k in 0..3 {
            middle[k] = 0.5 * low[k] + 0.5 * high[k];
            far = far.max(low[k].abs()).max(high[k].abs());
        }
        let (mut centre, mut half) = ([0.0; 3], [0.0; 3]);
        for k in 0..3 {
            centre[k] = middle[0] * axes[0][k] + middle[1] * axes[1][k] + middle[2] * axes[2][k];
            half[k] = 0.5 * high[k] - 0.5 * low[k] + ROUNDING * far;
        }
        Self { centre, half, axes, reach }
    }

    /// Returns the interval of the box along each of `axes`.
    #[inline(always)]
    pub(crate) fn along(&self, axes: &Axes) -> [[f32; 2]; 3] {
        let mut intervals = [[0.0; 2]; 3];
        for (interval, axis) in intervals.iter_mut().zip(axes) {
            let (middle, mut spread) = (dot(*axis, self.centre), 0.0);
            for k in 0..3 {
                spread += self.half[k] * dot(*axis, self.axes[k]).abs();
            }
            *interval = [middle - spread, middle + spread];
        }
        intervals
    }

    /// Returns the squared distance of `p` from the box, 0 inside.
    #[inline]
    #[must_use]
    pub fn distance_sq(&self, p: [f32; 3]) -> f32 {
        let d = sub(p, self.centre);
        let beyond = |k: usize| (dot(self.axes[k], d).abs() - self.half[k]).max(0.0);
        let (x, y, z) = (beyond(0), beyond(1), beyond(2));
        x * x + y * y + z * z
    }

    /// Returns `true` if the box contains all `points`, up to rounding.
    pub(crate) fn holds(&self, points: impl IntoIterator<Item = [f32; 3]>) -> bool {
        let size = |v: [f32; 3]| v[0].abs() + v[1].abs() + v[2].abs();
        let slack = ROUNDING * (size(self.centre) + size(self.half));
        points.into_iter().all(|p| {
            let d = sub(p, self.centre);
            (0..3).all(|k| dot(self.axes[k], d).abs() <= self.half[k] + slack)
        })
    }

    /// Returns the distance from the centre to a corner.
    #[must_use]
    pub fn radius(&self) -> f32 {
        dot(self.half, self.half).sqrt()
    }
}

/// The relative pose of two scans, from one stored frame to the other, in single precision for the
/// hot path. Includes a bound on the rounding error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Relative {
    /// Rows of the scaled rotation.
    linear: Axes,
    /// Rows of the rotation.
    rotation: Axes,
    translation: [f32; 3],
    scale: f32,
    scale_back: f32,
    slack: f32,
}

impl Relative {
    /// Creates the relative pose `pose` of b's stored frame in a's. `reach` bounds the coordinates
    /// of both scans in a's frame.
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

    /// Transforms a point of b's frame to a's.
    #[inline]
    #[must_use]
    pub fn point(&self, p: [f32; 3]) -> [f32; 3] {
        let [rx, ry, rz] = self.linear;
        let [tx, ty, tz] = self.translation;
        [dot(rx, p) + tx, dot(ry, p) + ty, dot(rz, p) + tz]
    }

    /// Transforms four points of b's frame to a's.
    #[inline(always)]
    #[must_use]
    pub fn points_of_four<S: Simd>(&self, p: [f32x4<S>; 3]) -> [f32x4<S>; 3] {
        let [x, y, z] = turned(&self.linear, p);
        let [tx, ty, tz] = self.translation;
        [x + tx, y + ty, z + tz]
    }

    /// Transforms four directions of b's frame to a's.
    #[inline(always)]
    #[must_use]
    pub fn directions_of_four<S: Simd>(&self, v: [f32x4<S>; 3]) -> [f32x4<S>; 3] {
        turned(&self.rotation, v)
    }

    /// Transforms a direction of b's frame to a's.
    #[inline]
    #[must_use]
    pub fn direction(&self, v: [f32; 3]) -> [f32; 3] {
        let [rx, ry, rz] = self.rotation;
        [dot(rx, v), dot(ry, v), dot(rz, v)]
    }

    /// Transforms sixteen points of a's frame to b's.
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

    /// Transforms sixteen points of b's frame to a's.
    #[inline(always)]
    #[must_use]
    pub fn points<S: Simd>(&self, points: &[f32x16<S>; 3]) -> [f32x16<S>; 3] {
        let [x, y, z] = turned(&self.linear, *points);
        let [tx, ty, tz] = self.translation;
        [x + tx, y + ty, z + tz]
    }

    /// Transforms sixteen directions of b's frame to a's.
    #[inline(always)]
    #[must_use]
    pub fn directions<S: Simd>(&self, v: &[f32x16<S>; 3]) -> [f32x16<S>; 3] {
        turned(&self.rotation, *v)
    }

    /// Transforms a point of a's frame to b's.
    #[inline]
    #[must_use]
    pub fn point_back(&self, p: [f32; 3]) -> [f32; 3] {
        let p = sub(p, self.translation);
        let [x, y, z] = self.direction_back(p);
        [x * self.scale_back, y * self.scale_back, z * self.scale_back]
    }

    /// Transforms a direction of a's frame to b's.
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

    /// Returns the length in b's frame of a unit of a's.
    #[inline]
    #[must_use]
    pub fn scale_back(&self) -> f32 {
        self.scale_back
    }

    /// Returns the length in a's frame of a unit of b's.
    #[inline]
    #[must_use]
    pub fn scale(&self) -> f32 {
        self.scale
    }

    /// Returns a bound on the error of a transformed coordinate.
    #[inline]
    #[must_use]
    pub fn slack(&self) -> f32 {
        self.slack
    }

    /// Returns the gap of a box of a and a box of b: their separation along a face normal, the
    /// maximum over all six. Negative if the boxes overlap along all six. A positive gap less
    /// [`Relative::slack`] is a lower bound of their distance.
    #[inline]
    #[must_use]
    pub fn gap(&self, a: &OrientedBox, b: &OrientedBox) -> f32 {
        let mut gap = f32::MIN;
        self.along_normals(a, b, |distance, reach| gap = greater(gap, distance - reach));
        gap
    }

    /// Returns the overlap of two boxes with `margin` around them. Along a face normal it is 1 − d
    /// / (e + `margin`), with the distance d of the centres and the sum e of the half extents; the
    /// result is the minimum over all six normals. 1 for concentric boxes, 0 for boxes exactly
    /// `margin` apart.
    #[inline]
    #[must_use]
    pub fn overlap(&self, a: &OrientedBox, b: &OrientedBox, margin: f32) -> f32 {
        let mut share = 0.0;
        self.along_normals(a, b, |distance, reach| share = greater(share, distance / (reach + margin)));
        1.0 - share
    }

    /// Passes the distance of the centres and the sum of the half extents to `tell`, along each of
    /// the six face normals of two boxes.
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

    /// Transforms a box of b's frame to a's.
    #[inline]
    #[must_use]
    pub fn moved(&self, b: &OrientedBox) -> OrientedBox {
        let [hx, hy, hz] = b.half;
        let [u, v, _] = b.axes;
        OrientedBox {
            centre: self.point(b.centre),
            half: [hx * self.scale, hy * self.scale, hz * self.scale],
            axes: frame([self.direction(u), self.direction(v)]),
            reach: b.reach,
        }
    }
}

#[inline(always)]
fn turned<V: Copy + Add<Output = V> + Mul<f32, Output = V>>(rows: &Axes, [x, y, z]: [V; 3]) -> [V; 3] {
    let [rx, ry, rz] = rows;
    [x * rx[0] + y * rx[1] + z * rx[2], x * ry[0] + y * ry[1] + z * ry[2], x * rz[0] + y * rz[1] + z * rz[2]]
}

/// Returns the greater of `x` and `y`; `y` if either is NaN.
#[inline]
fn greater(x: f32, y: f32) -> f32 {
    if x > y { x } else { y }
}

/// Returns the right-handed frame of two orthogonal unit vectors.
#[inline]
pub(crate) const fn frame([u, v]: [[f32; 3]; 2]) -> Axes {
    [u, v, cross(u, v)]
}

/// Returns the right-handed frame along two orthogonal vectors, in single precision.
#[expect(clippy::cast_possible_truncation, reason = "box axes are single precision")]
pub(crate) fn to_axes(vectors: [[f64; 3]; 2]) -> Axes {
    frame(vectors.map(|v| Vector3::from(v).normalize().map(|x| x as f32).into()))
}
