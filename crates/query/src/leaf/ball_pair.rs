//! The balls that represent points of an obstacle which sample no sheet, compared with balls and
//! with discs.
//!
//! If a leaf with balls is near another leaf, each of its points that reaches the other's box is
//! compared with sixteen points there at a time. Whether two balls meet is decided exactly. Whether
//! a ball meets a sheet is exact if it contains a point of the sheet, and accurate to first order
//! if it meets a disc.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x16, mask32x16};
use nearmiss_hierarchy::{LeafBlock, Part, ScanArrays};
use nearmiss_lanes::wide::{bits, load};

use crate::leaf::surfel_pair::near_box;
use crate::pair::scan_pair::ScanPair;

const WIDTH: usize = LeafBlock::WIDTH;

/// Up to sixteen points of a leaf that a ball is compared with, in their scan's stored frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Targets<'a> {
    block: &'a LeafBlock,
    positions: [[f32; WIDTH]; 3],
    /// The radii of balls; zero for discs.
    balls: [f32; WIDTH],
    /// The lanes of discs, as a bit mask.
    discs: u32,
    /// All lanes that count, as a bit mask.
    lanes: u32,
}

impl<'a> Targets<'a> {
    pub(crate) fn new(scan: &ScanArrays<'_>, (block, first, count): (&'a LeafBlock, usize, usize)) -> Self {
        let (mut positions, mut balls, mut discs) = ([[0.0; WIDTH]; 3], [0.0; WIDTH], 0);
        for lane in 0..count {
            let p = scan.position(first + lane);
            for k in 0..3 {
                positions[k][lane] = p[k];
            }
            balls[lane] = scan.obstacle_ball(first + lane);
            discs |= u32::from(scan.is_on_sheet(first + lane)) << lane;
        }
        Self { block, positions, balls, discs, lanes: (1 << count) - 1 }
    }

    /// The discs alone.
    pub(crate) fn discs(self) -> Self {
        Self { lanes: self.discs, ..self }
    }

    /// The lanes of targets within `radius` of `x`, as a bit mask. Distances are measured to the
    /// target's disc or ball.
    pub(crate) fn within(&self, level: Level, x: [f32; 3], radius: f32) -> u32 {
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || self.within_by(simd, x, radius),
        ))
    }

    #[inline(always)]
    fn within_by<S: Simd>(&self, simd: S, x: [f32; 3], radius: f32) -> u32 {
        let [px, py, pz] = &self.positions;
        let d = [
            f32x16::load_array_ref(simd, px) - x[0],
            f32x16::load_array_ref(simd, py) - x[1],
            f32x16::load_array_ref(simd, pz) - x[2],
        ];
        let d_sq = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
        let reach = f32x16::load_array_ref(simd, &self.balls) + radius;
        let of_balls: mask32x16<S> = d_sq.simd_le(reach * reach);
        let mut near = of_balls.to_bitmask() & !u64::from(self.discs);
        if self.discs != 0 {
            let zero = f32x16::splat(simd, 0.0);
            let [nx, ny, nz] = self.block.normals(simd);
            let height = d[0] * nx + d[1] * ny + d[2] * nz;
            let beside = (d_sq - height * height).max(zero).sqrt() - self.block.discs(simd);
            let beside = beside.max(zero);
            let of_discs: mask32x16<S> = (height * height + beside * beside).simd_le(radius * radius);
            near |= of_discs.to_bitmask() & u64::from(self.discs);
        }
        #[expect(clippy::cast_possible_truncation, reason = "sixteen bits")]
        let bits = near as u32;
        bits & self.lanes
    }
}

/// The points of a block and the radii of their balls, 0 for points on sheets.
#[inline(always)]
fn balls<S: Simd>(simd: S, scan: &ScanArrays<'_>, block: usize) -> ([f32x16<S>; 3], f32x16<S>) {
    let balls = f32x16::load_array_ref(simd, &scan.obstacle_balls(block));
    (load(simd, &scan.blocks[block].position), balls)
}

impl ScanPair<'_> {
    /// Returns `true` if both points are part of a sheet in their obstacles.
    #[inline]
    pub(crate) fn are_sheets(&self, [i, j]: [usize; 2]) -> bool {
        self.a.is_on_sheet(i) && self.b.is_on_sheet(j)
    }

    /// Returns `true` if obstacles are compared and at least one of the points is a ball there.
    #[inline]
    pub(crate) fn is_of_balls(&self, points: [usize; 2]) -> bool {
        self.part == Part::Obstacle && !self.are_sheets(points)
    }

    /// The radii, in the world, of the balls of points `i` and `j`; zero for points on sheets.
    pub(crate) fn balls(&self, [i, j]: [usize; 2]) -> [f64; 2] {
        let [sa, sb] = self.views.map(|view| view.stored_to_world().scale());
        [f64::from(self.a.obstacle_ball(i)) * sa, f64::from(self.b.obstacle_ball(j)) * sb]
    }

    /// The lanes of a block of a whose balls come within `reach`, in a's frame, of the box of a
    /// leaf of b, as a bit mask.
    #[inline]
    pub(crate) fn balls_of_a(&self, level: Level, block: usize, leaf: &LeafBlock, reach: f32) -> u32 {
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || {
                let (centres, balls) = balls(simd, self.a, block);
                let centres = self.relative.points_back(&centres);
                let zero = f32x16::splat(simd, 0.0);
                let radii = (balls + reach) * self.relative.scale_back();
                near_box(simd, leaf, &centres, radii) & bits(balls.simd_gt(zero))
            },
        ))
    }

    /// The same for a block of b and a leaf of a; `reach` in a's frame.
    #[inline]
    pub(crate) fn balls_of_b(&self, level: Level, block: usize, leaf: &LeafBlock, reach: f32) -> u32 {
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || {
                let (centres, balls) = balls(simd, self.b, block);
                let centres = self.relative.points(&centres);
                let zero = f32x16::splat(simd, 0.0);
                let radii = balls * self.relative.scale() + reach;
                near_box(simd, leaf, &centres, radii) & bits(balls.simd_gt(zero))
            },
        ))
    }
}
