//! Boxes around the discs of all nodes, computed for sixteen discs at a time.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x16, mask32x16};
use nearmiss_geometry::NodeId;
use nearmiss_index::PointBlock;
use nearmiss_lanes::id32;
use nearmiss_lanes::parallel::change_each;
use nearmiss_lanes::wide::{along, greatest, lanes_of, least, load};

use crate::bounds::boxes::OrientedBox;
use crate::point::disc::DiscRadii;
use crate::point::kind::THICKNESS;
use crate::tree::topology::Topology;

const WIDTH: usize = PointBlock::WIDTH;

/// The number of nodes that a thread takes at once.
const AT_ONCE: usize = 16;

/// The discs of a block of points, side by side.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C, align(64))]
pub(crate) struct DiscBlock {
    normal: [[f32; WIDTH]; 3],
    disc: [f32; WIDTH],
    ball: [f32; WIDTH],
}

/// The discs of all points, and the radii of their balls; 0 for points without a ball.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Discs<'a> {
    pub(crate) normals: &'a [[f32; 3]],
    pub(crate) discs: DiscRadii<'a>,
    pub(crate) balls: &'a [f32],
}

/// Replaces the box of each node by the smallest one along its axes that contains the discs of the
/// node's points with their thickness, and their balls. `points` has the positions. O(n log n).
pub(crate) fn boxes_of_discs(
    topology: &Topology,
    boxes: &mut [OrientedBox],
    points: &[PointBlock],
    discs: &[DiscBlock],
) {
    let level = Level::new();
    change_each(boxes, AT_ONCE, |id, about| {
        let [low, high] = dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || extents(simd, (points, discs), topology.points(NodeId(id32(id))), &about.axes),
        ));
        *about = OrientedBox::spanned(about.axes, low, high, about.reach);
    });
}

impl Discs<'_> {
    /// Returns the discs of block `number`.
    pub(crate) fn block(&self, number: usize) -> DiscBlock {
        let zero = [0.0; WIDTH];
        let mut block = DiscBlock { normal: [zero; 3], disc: zero, ball: zero };
        let first = number * WIDTH;
        for i in first..(first + WIDTH).min(self.normals.len()) {
            for k in 0..3 {
                block.normal[k][i - first] = self.normals[i][k];
            }
            block.disc[i - first] = self.discs.get(i);
            block.ball[i - first] = self.balls[i];
        }
        block
    }
}

/// Returns the least and greatest coordinates of the discs in `range` along `axes`.
#[inline(always)]
fn extents<S: Simd>(
    simd: S,
    (points, discs): (&[PointBlock], &[DiscBlock]),
    range: Range<usize>,
    axes: &[[f32; 3]; 3],
) -> [[f32; 3]; 2] {
    let (most, none) = (f32x16::splat(simd, f32::INFINITY), f32x16::splat(simd, f32::NEG_INFINITY));
    let (mut low, mut high) = ([most; 3], [none; 3]);
    for number in range.start / WIDTH..range.end.div_ceil(WIDTH) {
        let block = &discs[number];
        let inside = mask32x16::from_bitmask(simd, u64::from(lanes_of(number, &range)));
        let (position, normal) = (load(simd, &points[number].position), load(simd, &block.normal));
        let (disc, ball) =
            (f32x16::load_array_ref(simd, &block.disc), f32x16::load_array_ref(simd, &block.ball));
        for k in 0..3 {
            // ‖n × axis‖, without the cancellation of √(1 − (n·axis)²).
            let [ax, ay, az] = axes[k];
            let [x, y, z] = normal;
            let (x, y, z) = (z * ay - y * az, x * az - z * ax, y * ax - x * ay);
            let spread = (disc * ((x * x + y * y + z * z).sqrt() + THICKNESS)).max(ball);
            let middle = along(position, axes[k]);
            low[k] = low[k].min(simd.select_f32x16(inside, middle - spread, most));
            high[k] = high[k].max(simd.select_f32x16(inside, middle + spread, none));
        }
    }
    let mut bounds = [[0.0; 3]; 2];
    for k in 0..3 {
        bounds[0][k] = least(low[k], f32::INFINITY);
        bounds[1][k] = greatest(high[k], f32::NEG_INFINITY);
    }
    bounds
}
