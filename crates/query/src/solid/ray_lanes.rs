//! Crossings of a ray with the discs of a leaf, sixteen at a time, in single precision.
//!
//! Most lanes are decided: the ray crosses the disc or cell, or it does not, by more than the error. The
//! others are compared in double precision, as is the crossing that becomes the hit.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16, mask32x16};
use nearmiss_hierarchy::LeafBlock;
use nearmiss_lanes::wide::{along, bits, product, squared};

use crate::solid::elements::Parts;

const WIDTH: usize = LeafBlock::WIDTH;

/// The least cosine of a ray and a normal at which single precision decides.
const GRAZING: f32 = 0.05;

/// The least speed along an axis by which lengths are divided.
pub(crate) const LEAST_SPEED: f32 = 1e-12;

/// The error of a place, in steps of a leaf block: those of positions, and of normals over the size of the
/// leaf.
const STEPS: f32 = 16.0;

/// A ray, or a part of it, in single precision.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LaneRay {
    /// The start, and a unit vector.
    pub(crate) from: [f32; 3],
    pub(crate) along: [f32; 3],
    /// The rounding error of a place.
    pub(crate) lost: f32,
    /// The distances from `from` between which crossings count.
    pub(crate) ends: [f32; 2],
}

/// Crossings of a ray with the planes of sixteen discs.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LaneCrossings {
    /// The points that the ray passes within their reach, as bits.
    pub(crate) near: u32,
    /// The points of `near` that the ray certainly does not meet before the end of the search.
    pub(crate) missed: u32,
    /// The points of `near` whose disc or cell the ray certainly crosses.
    pub(crate) met: u32,
    /// The distances of the crossings from the start.
    pub(crate) t: [f32; WIDTH],
    /// Their distances from the centres of the discs, in disc radii.
    pub(crate) beside: [f32; WIDTH],
    /// The cosines of the ray and the normals.
    pub(crate) cosine: [f32; WIDTH],
}

impl LaneRay {
    /// Compares the ray with the points of a block. Nothing beyond `most` is of interest; a thick ray
    /// exceeds its centre by `radius`.
    #[inline(always)]
    pub(crate) fn crossings<S: Simd>(
        &self,
        simd: S,
        (block, count): (&LeafBlock, usize),
        parts: &Parts<S>,
        (most, radius): (f32, f32),
    ) -> LaneCrossings {
        // Seen from the place of the ray nearest to the leaf, so that errors of normals are those of
        // short lengths.
        let (from, way) = (self.from, self.along);
        let middle = (0..3).map(|k| (block.centre[k] - from[k]) * way[k]).sum::<f32>();
        let base = [0, 1, 2].map(|k| from[k] + middle * way[k]);
        let (positions, normals) = (block.positions(simd), block.normals(simd));
        let d = [positions[0] - base[0], positions[1] - base[1], positions[2] - base[2]];
        let lost = self.lost + STEPS * block.step();
        let s = along(d, way);
        let off_sq = squared([d[0] - s * way[0], d[1] - s * way[1], d[2] - s * way[2]]);
        let reach = parts.reaches.max(parts.radii) + (radius + lost);
        let beyond: mask32x16<S> = off_sq.simd_gt(reach * reach)
            | (s + middle - reach).simd_gt(most)
            | (s + middle + reach).simd_lt(0.0);
        let near = !bits(beyond) & ((1 << count) - 1);
        let cosine = along(normals, way);
        let on_ray = product(normals, d) / cosine;
        let t = on_ray + middle;
        let beside = squared([on_ray * way[0] - d[0], on_ray * way[1] - d[1], on_ray * way[2] - d[2]]).sqrt();
        let cosine = cosine.abs();
        let error = f32x16::splat(simd, 2.0 * lost) / cosine;
        let cells = parts.cells.max(parts.radii);
        let [start, end] = self.ends;
        let missed: mask32x16<S> =
            beside.simd_gt(cells + error) | (t - error).simd_gt(most) | (t + error).simd_lt(start);
        let met: mask32x16<S> = (beside + error).simd_lt(cells)
            & (beside - parts.radii).abs().simd_gt(error)
            & (t - error).simd_gt(start)
            & (t + error).simd_lt(end)
            & cosine.simd_gt(GRAZING);
        let discs = near & bits(parts.discs);
        LaneCrossings {
            near,
            missed: bits(missed) & discs,
            met: bits(met) & !bits(missed) & discs,
            t: t.to_array(),
            beside: (beside / parts.radii).to_array(),
            cosine: cosine.to_array(),
        }
    }
}
