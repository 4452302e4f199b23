//! The distances of boxes from a body.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16, mask32x16};
use nearmiss_lanes::wide::{along, load};

use super::cut::{BoxQuery, BoxTree, Slabs};
use super::{Bounds, Boxes};

/// A point, a segment or a box that boxes are compared with.
#[derive(Debug, Clone, Copy)]
pub struct BoxBody {
    pub(super) centre: [f32; 3],
    /// The unit vectors along which it has a length, and half of that.
    pub(super) axes: [[f32; 3]; 3],
    pub(super) half: [f32; 3],
    lengths: usize,
    /// The upright box about it.
    bounds: Bounds,
    /// `true` if boxes are compared by their inner parts.
    pub(super) is_inner: bool,
}

impl BoxBody {
    /// A box about `centre`, with orthonormal `axes` and half the edge lengths `half`, the first of which are
    /// those above zero. With `is_inner`, distances are those of the inner parts of boxes.
    #[inline]
    #[must_use]
    pub fn new(centre: [f32; 3], axes: [[f32; 3]; 3], half: [f32; 3], is_inner: bool) -> Self {
        let lengths = half.iter().rposition(|&length| length > 0.0).map_or(0, |last| last + 1);
        let reach = [0, 1, 2].map(|k| (0..lengths).map(|j| axes[j][k].abs() * half[j]).sum::<f32>());
        let bounds = Bounds {
            min: [0, 1, 2].map(|k| centre[k] - reach[k]),
            max: [0, 1, 2].map(|k| centre[k] + reach[k]),
            support_radius: 0.0,
        };
        Self { centre, axes, half, lengths, bounds, is_inner }
    }
}

/// The distances of sixteen boxes from a body along some axes.
struct Apart<S: Simd> {
    /// The sums of the squared distances along the normals of the slabs.
    sum: f32x16<S>,
    /// The centres of the boxes, seen from that of the body, along its axes.
    along: [f32x16<S>; 3],
    /// The lengths by which the boxes extend from their centres along these axes.
    reach: [f32x16<S>; 3],
}

impl<S: Simd> Apart<S> {
    /// Adds the slabs along one normal of each box.
    #[inline(always)]
    fn add(&mut self, simd: S, slabs: &Slabs, body: &BoxBody) {
        let normal = load(simd, &slabs.normal);
        let at = along(normal, body.centre);
        let [low, high] = if body.is_inner { &slabs.inner } else { &slabs.between };
        let low = f32x16::load_array_ref(simd, low) - at;
        let high = f32x16::load_array_ref(simd, high) - at;
        let (middle, half) = ((low + high) * 0.5, (high - low) * 0.5);
        let mut apart = low.max(-high);
        for j in 0..body.lengths {
            let cosine = along(normal, body.axes[j]);
            self.along[j] += cosine * middle;
            self.reach[j] += cosine.abs() * half;
            apart -= cosine.abs() * body.half[j];
        }
        let apart = apart.max(0.0);
        self.sum += apart * apart;
    }

    /// The squared distances along the axes of the body, once all slabs have been added.
    #[inline(always)]
    fn along_axes(&self, simd: S, body: &BoxBody) -> f32x16<S> {
        let mut sum = f32x16::splat(simd, 0.0);
        for j in 0..body.lengths {
            let apart = (self.along[j].abs() - self.reach[j] - body.half[j]).max(0.0);
            sum += apart * apart;
        }
        sum
    }
}

impl BoxQuery for BoxBody {
    /// Lower bounds on the squared distances of the boxes. Beyond `most_sq` they may be less close.
    #[inline(always)]
    fn distances_sq<S: Simd>(
        &self,
        simd: S,
        tree: &BoxTree,
        ((level, group), boxes): ((usize, usize), &Boxes),
        most_sq: f32,
    ) -> f32x16<S> {
        let upright = boxes.distances_sq(simd, &self.bounds);
        if level > 0 {
            return upright;
        }
        let zero = f32x16::splat(simd, 0.0);
        let mut apart = Apart { sum: zero, along: [zero; 3], reach: [zero; 3] };
        for slabs in &tree.slabs[group] {
            let near: mask32x16<S> = upright.max(apart.sum).simd_le(most_sq);
            if near.all_false() {
                return upright.max(apart.sum);
            }
            apart.add(simd, slabs, self);
        }
        upright.max(apart.sum).max(apart.along_axes(simd, self))
    }
}
