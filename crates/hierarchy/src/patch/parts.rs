//! Boxes and enclosures of all nodes from the points alone, without a look at their neighbours.
//!
//! A place of the obstacle that belongs to a point on a sheet is within its local radius, and within
//! the thickness of the sheet of its tangent plane: both are parts of the definition
//! (`docs/theory/obstacle.md`). So a cylinder contains it. A place of the surface is within half a
//! support radius of its nearest point (`docs/theory/certificates.md`, fact 2). Enclosures from
//! neighbours ([`crate::patch::enclosure`]) are tighter, at ten times the cost.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x16, mask32x16};
use nearmiss_geometry::NodeId;
use nearmiss_index::PointBlock;
use nearmiss_lanes::id32;
use nearmiss_lanes::parallel::change_both;
use nearmiss_lanes::vector::dot;
use nearmiss_lanes::wide::{along, greatest, lanes_of, least, load};

use crate::bounds::boxes::{OrientedBox, ROUNDING};
use crate::bounds::growth::Growth;
use crate::point::disc::DiscRadii;
use crate::point::kind::{SLAB, THICKNESS, ball, cell_radius, is_on_sheet, obstacle_ball};
use crate::tree::topology::Topology;

const WIDTH: usize = PointBlock::WIDTH;

/// The number of nodes that a thread takes at once.
const AT_ONCE: usize = 16;

/// Allowance for the relative rounding error of the extents of a cylinder.
const GROWN: f32 = 1.0 + 1e-4;

/// The parts of a block of points, side by side.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C, align(64))]
pub(crate) struct PartBlock {
    normal: [[f32; WIDTH]; 3],
    radius: [f32; WIDTH],
    disc: [f32; WIDTH],
    /// The greater radius of the balls of a point; 0 for points without.
    ball: [f32; WIDTH],
    /// The radius of the cylinder about the cell of a point on a sheet, and half its height; 0 for
    /// other points.
    cell: [f32; WIDTH],
    slab: [f32; WIDTH],
}

/// The arrays that parts follow from.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Parts<'a> {
    pub(crate) normals: &'a [[f32; 3]],
    pub(crate) discs: DiscRadii<'a>,
    /// The number of dense points, which come first.
    pub(crate) dense: usize,
}

impl Parts<'_> {
    /// Returns the parts of the points in block `number`.
    pub(crate) fn block(&self, number: usize) -> PartBlock {
        let Self { normals, discs, dense } = *self;
        let mut block = PartBlock::zeroed();
        let first = number * WIDTH;
        for i in first..(first + WIDTH).min(normals.len()) {
            let (lane, kind, radius) = (i - first, discs.codes[i].kind(), discs.radii[i]);
            for k in 0..3 {
                block.normal[k][lane] = normals[i][k];
            }
            block.radius[lane] = radius;
            block.disc[lane] = discs.get(i);
            let small = ball(kind, radius, discs.sampling_radius);
            block.ball[lane] = small.max(obstacle_ball(i, dense, kind, radius));
            if is_on_sheet(i, dense, kind) {
                block.cell[lane] = cell_radius(radius, discs.reach) * GROWN;
                block.slab[lane] = SLAB * radius * GROWN;
            }
        }
        block
    }
}

/// Replaces the box of each node above a `changed` leaf by one along its axes about the discs and balls
/// of the node's points, with their greatest radius, and sets its growths to the enclosures of the
/// surface and of the obstacle. The surface is within `beyond` of the points. O(n), and O(n log n) tests of
/// `changed`.
///
/// The box of a node with at most four leaves is the smallest one. That of any other node is the
/// smallest one about the boxes of the nodes with four leaves under it, which are small beside it.
pub(crate) fn bound_parts(
    topology: &Topology,
    (boxes, growths): (&mut [OrientedBox], &mut [[Growth; 2]]),
    (points, parts): (&[PointBlock], &[PartBlock]),
    beyond: f32,
    changed: impl Fn(usize) -> bool + Sync + Send,
) {
    let is_changed = |id: usize| topology.leaves_under(NodeId(id32(id))).any(&changed);
    let (level, beyond, small) = (Level::new(), beyond * GROWN, topology.first_bottom());
    let (large_boxes, boxes) = boxes.split_at_mut(small);
    let (large_growths, growths) = growths.split_at_mut(small);
    change_both(boxes, growths, AT_ONCE, |number, bounds, growths| {
        if !is_changed(small + number) {
            return;
        }
        let range = topology.points(NodeId(id32(small + number)));
        let Extents { discs, cells, points, reach } = dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || extents(simd, (points, parts), range, &bounds.axes),
        ));
        *bounds = OrientedBox::spanned(bounds.axes, discs[0], discs[1], reach);
        let own = bounds.along(&bounds.axes);
        let surface = Growth::beyond(&own, points[0].map(|x| x - beyond), points[1].map(|x| x + beyond));
        *growths = [surface, Growth::beyond(&own, cells[0], cells[1])];
    });
    let (boxes, growths): (&[_], &[_]) = (boxes, growths);
    change_both(large_boxes, large_growths, 1, |id, bounds, of_node| {
        if !is_changed(id) {
            return;
        }
        let below = topology.bottoms_under(NodeId(id32(id)));
        let below = below.start - small..below.end - small;
        (*bounds, *of_node) = dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || about(&bounds.axes, (&boxes[below.clone()], &growths[below])),
        ));
    });
}

/// Returns the smallest box along some axes about some boxes, and its growths to the smallest
/// enclosures about theirs.
#[inline(always)]
fn about(
    axes: &[[f32; 3]; 3],
    (boxes, growths): (&[OrientedBox], &[[Growth; 2]]),
) -> (OrientedBox, [Growth; 2]) {
    let mut spans = [[[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]]; 3];
    let mut reach = 0.0_f32;
    for (bounds, growths) in boxes.iter().zip(growths) {
        reach = reach.max(bounds.reach);
        // All three have the same axes.
        let solids = [*bounds, growths[0].of(bounds), growths[1].of(bounds)];
        let [u, v, w] = bounds.axes;
        for k in 0..3 {
            let (x, y, z) = (dot(axes[k], u).abs(), dot(axes[k], v).abs(), dot(axes[k], w).abs());
            for (span, solid) in spans.iter_mut().zip(&solids) {
                let middle = dot(axes[k], solid.centre);
                let spread = x * solid.half[0] + y * solid.half[1] + z * solid.half[2];
                span[0][k] = span[0][k].min(middle - spread);
                span[1][k] = span[1][k].max(middle + spread);
            }
        }
    }
    // The boxes are rounded once more than points.
    for [low, high] in &mut spans {
        let far = (0..3).fold(0.0_f32, |far, k| far.max(low[k].abs()).max(high[k].abs()));
        (*low, *high) = (low.map(|x| x - ROUNDING * far), high.map(|x| x + ROUNDING * far));
    }
    let [discs, surface, obstacle] = spans;
    let bounds = OrientedBox::spanned(*axes, discs[0], discs[1], reach);
    let own = bounds.along(axes);
    let growths =
        [Growth::beyond(&own, surface[0], surface[1]), Growth::beyond(&own, obstacle[0], obstacle[1])];
    (bounds, growths)
}

/// The least and greatest coordinates of some points along three axes.
struct Extents {
    /// The extents of discs and balls.
    discs: [[f32; 3]; 2],
    /// The extents of cylinders about cells, then of points.
    cells: [[f32; 3]; 2],
    points: [[f32; 3]; 2],
    /// The greatest local radius.
    reach: f32,
}

#[inline(always)]
fn extents<S: Simd>(
    simd: S,
    (points, parts): (&[PointBlock], &[PartBlock]),
    range: Range<usize>,
    axes: &[[f32; 3]; 3],
) -> Extents {
    let (most, none) = (f32x16::splat(simd, f32::INFINITY), f32x16::splat(simd, f32::NEG_INFINITY));
    let mut low = [[most; 3]; 3];
    let mut high = [[none; 3]; 3];
    let mut reach = f32x16::splat(simd, 0.0);
    let zero = f32x16::splat(simd, 0.0);
    for number in range.start / WIDTH..range.end.div_ceil(WIDTH) {
        let block = &parts[number];
        let lanes = |row: &[f32; WIDTH]| f32x16::load_array_ref(simd, row);
        let (position, normal) = (load(simd, &points[number].position), load(simd, &block.normal));
        let (disc, ball) = (lanes(&block.disc), lanes(&block.ball));
        let (cell, slab) = (lanes(&block.cell), lanes(&block.slab));
        let [u, v, w] = axes;
        let cosines = [along(normal, *u), along(normal, *v), along(normal, *w)];
        let squares = [cosines[0] * cosines[0], cosines[1] * cosines[1], cosines[2] * cosines[2]];
        let own = lanes_of(number, &range);
        let is_whole = own == (1 << WIDTH) - 1;
        let inside = mask32x16::from_bitmask(simd, u64::from(own));
        let radius = lanes(&block.radius);
        reach = reach.max(simd.select_f32x16(inside, radius, zero));
        for k in 0..3 {
            // The axes are orthonormal. This does not cancel as √(1 − (n·axis)²) does.
            let sine = (squares[(k + 1) % 3] + squares[(k + 2) % 3]).sqrt();
            let spreads =
                [(disc * (sine + THICKNESS)).max(ball), cell * sine + slab * cosines[k].abs(), zero];
            let middle = along(position, axes[k]);
            for j in 0..3 {
                let (mut least, mut greatest) = (middle - spreads[j], middle + spreads[j]);
                if !is_whole {
                    least = simd.select_f32x16(inside, least, most);
                    greatest = simd.select_f32x16(inside, greatest, none);
                }
                low[j][k] = low[j][k].min(least);
                high[j][k] = high[j][k].max(greatest);
            }
        }
    }
    let mut found = [[[0.0; 3]; 2]; 3];
    for j in 0..3 {
        for k in 0..3 {
            found[j][0][k] = least(low[j][k], f32::INFINITY);
            found[j][1][k] = greatest(high[j][k], f32::NEG_INFINITY);
        }
    }
    let [discs, cells, points] = found;
    Extents { discs, cells, points, reach: greatest(reach, 0.0) }
}
