//! Lower bounds on the distance of a shape from nodes and points, several at a time, in single
//! precision.
//!
//! The shape is represented by the box about its core. Along the axes of either box the gap of two
//! boxes is that of two intervals; the three gaps along orthogonal axes combine to a distance.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x4, f32x16, mask32x16};
use nearmiss_hierarchy::NodeBounds;
use nearmiss_lanes::wide::{Vectors, along, product, squared};

use crate::solid::core::Solid;

/// Rounding of distances, relative to all coordinates: as that of boxes in a relative pose.
const ROUNDING: f64 = 8e-6;

/// Coordinates beyond this have squares near the end of single precision.
const FARTHEST: f64 = 1e15;

/// An upper bound on the error of the square of a sine, as normals in steps are not of unit length.
const SINE_SQ: f32 = 5e-4;

/// The box about the core of a shape, in single precision.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LaneBox {
    pub(crate) centre: [f32; 3],
    pub(crate) axes: [[f32; 3]; 3],
    pub(crate) half: [f32; 3],
    is_point: bool,
    /// `true` if the core is a point or a segment along the first axis.
    pub(crate) is_segment: bool,
    /// `false` if coordinates are out of the range of single precision: then nothing is pruned.
    pub(crate) is_near: bool,
    /// The error of a distance.
    pub(crate) slack: f32,
}

impl LaneBox {
    /// The box of a shape near a scan whose coordinates are at most `far`.
    #[expect(clippy::cast_possible_truncation, reason = "counted in `slack`")]
    pub(crate) fn new(solid: &Solid<'_>, far: f64) -> Self {
        let far = far + solid.centre.amax() + solid.half.sum() + solid.radius;
        let single = |v: [f64; 3]| [v[0] as f32, v[1] as f32, v[2] as f32];
        Self {
            centre: single(solid.centre.into()),
            axes: solid.axes.map(|axis| single(axis.into())),
            half: single(solid.half.into()),
            is_point: solid.is_point(),
            is_segment: solid.is_segment(),
            is_near: far < FARTHEST,
            slack: (ROUNDING * far) as f32,
        }
    }

    /// The distance from the centre to a corner.
    #[inline(always)]
    pub(crate) fn reach(&self) -> f32 {
        let [x, y, z] = self.half;
        x + y + z
    }

    /// Lower bounds, up to the slack, on the squared distances of the core from four nodes: from
    /// their boxes or, if `grown`, from their enclosures.
    #[inline(always)]
    pub(crate) fn of_nodes<S: Simd>(&self, simd: S, nodes: &NodeBounds<f32x4<S>>, grown: bool) -> f32x4<S> {
        let zero = f32x4::splat(simd, 0.0);
        if !self.is_near {
            return zero;
        }
        let [cx, cy, cz] = self.centre;
        let d = [nodes.centre[0] - cx, nodes.centre[1] - cy, nodes.centre[2] - cz];
        // A segment has a length along its first axis only.
        let lengths = if self.is_segment { 1 } else { 3 };
        let mut sum = zero;
        let mut outer = [zero; 3];
        for k in 0..3 {
            let [ax, ay, az] = nodes.axes[k];
            let at = product([ax, ay, az], d);
            let half = nodes.half[k];
            let (low, high) = if grown { (half + nodes.low[k], half + nodes.high[k]) } else { (half, half) };
            let mut reach = zero;
            if !self.is_point {
                let widest = low.max(high);
                for j in 0..lengths {
                    let [x, y, z] = self.axes[j];
                    let cosine = (ax * x + ay * y + az * z).abs();
                    reach += cosine * self.half[j];
                    outer[j] += cosine * widest;
                }
            }
            let beyond = (at - low).max(-at - high) - reach;
            let beyond = beyond.max(0.0);
            sum += beyond * beyond;
        }
        if self.is_point {
            return sum;
        }
        let mut other = zero;
        for j in 0..lengths {
            let [x, y, z] = self.axes[j];
            let at = (d[0] * x + d[1] * y + d[2] * z).abs();
            let beyond = (at - outer[j] - self.half[j]).max(0.0);
            other += beyond * beyond;
        }
        sum.max(other)
    }

    /// Lower bounds, up to the slack, on the distances of the core from points and their planes.
    #[inline(always)]
    pub(crate) fn of_points<S: Simd>(
        &self,
        simd: S,
        points: &Vectors<S>,
        normals: &Vectors<S>,
    ) -> Distances<S> {
        let zero = f32x16::splat(simd, 0.0);
        if !self.is_near {
            return Distances { from_point: zero, from_plane: zero, beside: zero, sine: zero };
        }
        let [cx, cy, cz] = self.centre;
        let d = [points[0] - cx, points[1] - cy, points[2] - cz];
        let height = product(d, *normals).abs();
        if self.is_point {
            let square = squared(d);
            let beside = (square - height * height).max(0.0).sqrt();
            let sine = f32x16::splat(simd, 1.0);
            return Distances { from_point: square.sqrt(), from_plane: height, beside, sine };
        }
        let (mut sum, mut reach, mut rise) = (zero, zero, zero);
        for j in 0..3 {
            let axis = self.axes[j];
            let (at, slope) = (along(d, axis), along(*normals, axis));
            let beyond = (at.abs() - self.half[j]).max(0.0);
            sum += beyond * beyond;
            reach += slope.abs() * self.half[j];
            rise += beyond.copysign(at) * slope;
        }
        let sine_sq = (sum - rise * rise).max(0.0) / sum.max(f32::MIN_POSITIVE) + SINE_SQ;
        let from_plane = (height - reach).max(0.0);
        Distances { from_point: sum.sqrt(), from_plane, beside: zero, sine: sine_sq.sqrt().min(1.0) }
    }
}

/// Distances of a core from points and the planes through them.
#[derive(Clone, Copy)]
pub(crate) struct Distances<S: Simd> {
    pub(crate) from_point: f32x16<S>,
    pub(crate) from_plane: f32x16<S>,
    /// The distance from the axis of each plane's normal; zero unless the core is a point.
    beside: f32x16<S>,
    /// The sine of the angle between each normal and the way from the core to the point; 1 if the core is a
    /// point.
    sine: f32x16<S>,
}

impl<S: Simd> Distances<S> {
    /// The distances from balls and, where `are_discs`, from all within `thick` of discs.
    #[inline(always)]
    pub(crate) fn parts(
        &self,
        simd: S,
        radii: f32x16<S>,
        thick: f32x16<S>,
        are_discs: mask32x16<S>,
    ) -> f32x16<S> {
        let of_balls = self.from_point - radii;
        let out = (self.beside - radii).max(f32x16::splat(simd, 0.0));
        let of_discs = of_balls.max((self.from_plane * self.from_plane + out * out).sqrt());
        are_discs.select(of_discs.max(self.across(radii)) - thick, of_balls)
    }

    /// The distances from balls and, where `are_discs`, from their parts within `thick` of a plane.
    #[inline(always)]
    pub(crate) fn cells(
        &self,
        simd: S,
        radii: f32x16<S>,
        thick: f32x16<S>,
        are_discs: mask32x16<S>,
    ) -> f32x16<S> {
        let zero = f32x16::splat(simd, 0.0);
        let of_balls = self.from_point - radii;
        let (up, out) = ((self.from_plane - thick).max(zero), (self.beside - radii).max(zero));
        let of_discs = of_balls.max((up * up + out * out).sqrt());
        are_discs.select(of_discs.max(self.across(radii) - thick), of_balls)
    }

    /// The distances of discs: the core is beyond the plane across the way to the point, and a disc reaches
    /// this far towards it.
    #[inline(always)]
    fn across(&self, radii: f32x16<S>) -> f32x16<S> {
        self.from_point - radii * self.sine
    }
}
