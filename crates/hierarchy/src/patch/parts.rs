//! Boxes and enclosures of all nodes from the points alone, without a look at their neighbours.
//!
//! A place of the obstacle that belongs to a point on a sheet is within its local radius, and within
//! the thickness of the sheet of its tangent plane: both are parts of the definition
//! (`docs/theory/obstacle.md`). So a cylinder contains it. A place of the surface is within half a
//! support radius of its nearest point (`docs/theory/certificates.md`, fact 2). Enclosures from
//! neighbours ([`crate::patch::enclosure`]) are tighter, at ten times the cost.

use std::ops::Range;

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x16, mask32x16};
use nearmiss_geometry::NodeId;
use nearmiss_lanes::id32;
use nearmiss_lanes::parallel::{Divide, Runs, change_both, change_together};
use nearmiss_lanes::vector::dot;
use nearmiss_lanes::wide::{along, greatest, greatest_of_each, least_of_each, load, sum};

use crate::bounds::boxes::{OrientedBox, ROUNDING};
use crate::bounds::growth::Growth;
use crate::patch::covering::Covering;
use crate::point::kind::{SLAB, THICKNESS, ball, cell_radius, is_on_sheet, obstacle_ball};
use crate::point::leaf_block::{DiscLanes, LeafBlock, LeafParts, WIDTH, sixteens};
use crate::tree::topology::{FAN, MOST_LEAF_POINTS, Topology};

/// The number of bottoms that a thread takes at once.
const AT_ONCE: usize = 16;

/// The maximum number of blocks of points under a bottom.
const MOST_BLOCKS: usize = FAN * MOST_LEAF_POINTS / WIDTH;

/// Allowance for the relative rounding error of the extents of a cylinder.
const GROWN: f32 = 1.0 + 1e-4;

/// The parts of up to sixteen points of a leaf, side by side.
#[derive(Debug, Clone, Copy)]
struct PartLanes {
    discs: DiscLanes,
    /// The greater radius of the balls of a point; 0 for points without.
    ball: [f32; WIDTH],
    /// The radius of the cylinder about the cell of a point on a sheet, and half its height; 0 for
    /// other points.
    cell: [f32; WIDTH],
    slab: [f32; WIDTH],
}

impl PartLanes {
    const NONE: Self =
        Self { discs: DiscLanes::NONE, ball: [0.0; WIDTH], cell: [0.0; WIDTH], slab: [0.0; WIDTH] };

    #[inline(always)]
    fn of(points: Range<usize>, parts: &LeafParts<'_>) -> Self {
        let (dense, reach, ordinary) = (parts.dense, parts.discs.reach, parts.discs.sampling_radius);
        let mut lanes = Self {
            discs: parts.lanes(points.clone()),
            ball: [0.0; WIDTH],
            cell: [0.0; WIDTH],
            slab: [0.0; WIDTH],
        };
        if points.end <= dense && lanes.discs.are_sheets {
            for lane in 0..WIDTH {
                let radius = lanes.discs.radius[lane];
                lanes.cell[lane] = cell_radius(radius, reach) * GROWN;
                lanes.slab[lane] = SLAB * radius * GROWN;
            }
            return lanes;
        }
        for lane in 0..WIDTH {
            let i = points.start + lane.min(points.len() - 1);
            let (kind, radius) = (parts.discs.codes[i].kind(), lanes.discs.radius[lane]);
            lanes.ball[lane] = ball(kind, radius, ordinary).max(obstacle_ball(i, dense, kind, radius));
            if is_on_sheet(i, dense, kind) {
                lanes.cell[lane] = cell_radius(radius, reach) * GROWN;
                lanes.slab[lane] = SLAB * radius * GROWN;
            }
        }
        lanes
    }
}

/// The *bottoms*, nodes whose children are leaves, and these leaves: their boxes, whose axes are known, and
/// the other arrays to set. A tree of one leaf has one bottom, without a box.
#[derive(Debug)]
pub(crate) struct Low<'a> {
    pub(crate) topology: &'a Topology,
    /// The number of the first bottom.
    pub(crate) first: usize,
    pub(crate) bottoms: (Runs<'a, OrientedBox>, Runs<'a, [Growth; 2]>),
    pub(crate) leaves: LeafRuns<'a>,
}

/// The boxes, growths, blocks, marks and coverings of leaves.
type LeafRuns<'a> = (
    (Runs<'a, OrientedBox>, Runs<'a, [Growth; 2]>),
    (Runs<'a, LeafBlock>, (Runs<'a, u8>, Runs<'a, Covering>)),
);

impl Divide for Low<'_> {
    fn divide(self, item: usize) -> (Self, Self) {
        let Self { topology, first, bottoms, leaves } = self;
        let leaf = leaves_under(topology, first + item).start - leaves_under(topology, first).start;
        let (bottoms, leaves) = (bottoms.divide(item), leaves.divide(leaf));
        (
            Self { topology, first, bottoms: bottoms.0, leaves: leaves.0 },
            Self { topology, first: first + item, bottoms: bottoms.1, leaves: leaves.1 },
        )
    }
}

/// Returns the leaves under a bottom, by its number.
fn leaves_under(topology: &Topology, bottom: usize) -> Range<usize> {
    let id = topology.first_bottom() + bottom;
    if id < topology.inner() { topology.leaves_under(NodeId(id32(id))) } else { 0..topology.leaves() }
}

/// Replaces the box of each leaf by the smallest one along its axes about the discs and balls of its
/// points, with their greatest radius, and sets its growths to the enclosures of the surface and of the
/// obstacle. The surface is within `beyond` of the points. Does the same for the nodes whose children
/// are leaves, and sets blocks, marks and spacings of the leaves. O(n).
pub(crate) fn bound_leaves(parts: &LeafParts<'_>, beyond: f32, low: Low<'_>) {
    let (topology, level, beyond) = (low.topology, Level::new(), beyond * GROWN);
    let bottoms = (topology.inner() - topology.first_bottom()).max(1);
    change_together(0..bottoms, AT_ONCE, low, &|items, low| {
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || low.bound(simd, parts, beyond, items),
        ));
    });
}

impl Low<'_> {
    #[inline(always)]
    fn bound<S: Simd>(self, simd: S, parts: &LeafParts<'_>, beyond: f32, items: Range<usize>) {
        let Self { topology, bottoms: (bottom_boxes, bottom_growths), leaves, .. } = self;
        let ((boxes, growths), (blocks, (marks, coverings))) = leaves;
        let mut lanes = [PartLanes::NONE; MOST_BLOCKS];
        let first_leaf = leaves_under(topology, items.start).start;
        for (place, item) in items.enumerate() {
            let mut count = 0;
            for leaf in leaves_under(topology, item) {
                let (start, points) = (count, topology.points_of_leaf(leaf));
                for points in sixteens(points) {
                    lanes[count] = PartLanes::of(points, parts);
                    count += 1;
                }
                let at = leaf - first_leaf;
                let bounds = &mut boxes.elements[at];
                growths.elements[at] =
                    extents(simd, &lanes[start..count], &bounds.axes).bound(simd, bounds, beyond);
                let blocks = &mut blocks.elements[at * blocks.each..(at + 1) * blocks.each];
                for (k, block) in blocks.iter_mut().enumerate() {
                    *block = match lanes[start..count].get(k) {
                        Some(lanes) => LeafBlock::of(simd, &lanes.discs, bounds),
                        None => LeafBlock::new(bounds),
                    };
                }
                marks.elements[at] = parts.marks(topology, leaf, bounds);
                coverings.elements[at] = Covering::withheld(spacing(simd, &lanes[start..count]));
            }
            if let Some(bounds) = bottom_boxes.elements.get_mut(place) {
                let extents = extents(simd, &lanes[..count], &bounds.axes);
                bottom_growths.elements[place] = extents.bound(simd, bounds, beyond);
            }
        }
    }
}

/// Replaces the boxes of the other inner nodes, and sets their growths, by the smallest ones along their axes
/// about smaller boxes and enclosures under them: up to three levels above the bottoms those of the bottoms,
/// further up those of the nodes two levels above the bottoms. O(n log n).
pub(crate) fn bound_above(topology: &Topology, (boxes, growths): (&mut [OrientedBox], &mut [[Growth; 2]])) {
    /// Fewer nodes are bounded by one thread.
    const FEW: usize = 16;
    /// The height above the bottoms up to which these bound a node.
    const LOW: u32 = 3;
    /// The height of the nodes that bound those above.
    const MIDDLE: u32 = 2;
    let (level, mut end, mut height) = (Level::new(), topology.first_bottom(), 0);
    // From the lowest level up. The nodes of a level are consecutive, and come before those below.
    while end > 0 {
        height += 1;
        let levels = if height > LOW { height - MIDDLE } else { height };
        let start = topology.parent(NodeId(id32(end))).map_or(0, |(parent, _)| parent.index());
        let (boxes, boxes_below) = boxes.split_at_mut(end);
        let (growths, growths_below) = growths.split_at_mut(end);
        let (boxes_below, growths_below): (&[_], &[_]) = (boxes_below, growths_below);
        change_both(&mut boxes[start..], &mut growths[start..], FEW, |k, bounds, of_node| {
            let below = topology.inner_below(NodeId(id32(start + k)), levels);
            let below = below.start - end..below.end - end;
            (*bounds, *of_node) = dispatch!(level, simd => simd.vectorize(
                #[inline(always)]
                || about(simd, &bounds.axes, (&boxes_below[below.clone()], &growths_below[below])),
            ));
        });
        end = start;
    }
}

/// Returns the smallest box along some axes about some boxes, and its growths to the smallest
/// enclosures about theirs.
#[inline(always)]
fn about<S: Simd>(
    simd: S,
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
    (bounds, Growth::beyond_each(simd, &own, [surface, obstacle]))
}

/// Returns the root mean square of the radii of some points.
#[inline(always)]
fn spacing<S: Simd>(simd: S, all: &[PartLanes]) -> f32 {
    let (mut squares, mut count) = (f32x16::splat(simd, 0.0), 0.0);
    for PartLanes { discs, .. } in all {
        let (radius, lanes) = (f32x16::load_array_ref(simd, &discs.radius), discs.count);
        #[expect(clippy::cast_precision_loss, reason = "at most 16")]
        let lanes = lanes as f32;
        let is_used: mask32x16<S> =
            f32x16::load_array_ref(simd, &NUMBERS).simd_lt(f32x16::splat(simd, lanes));
        squares += is_used.select(radius * radius, f32x16::splat(simd, 0.0));
        count += lanes;
    }
    (sum(squares) / count).sqrt()
}

/// The numbers of the lanes.
const NUMBERS: [f32; WIDTH] =
    [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0];

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

impl Extents {
    /// Sets a box along the same axes, and returns its growths. The surface is within `beyond` of the
    /// points.
    #[inline(always)]
    fn bound<S: Simd>(&self, simd: S, bounds: &mut OrientedBox, beyond: f32) -> [Growth; 2] {
        let Self { discs, cells, points, reach } = self;
        *bounds = OrientedBox::spanned(bounds.axes, discs[0], discs[1], *reach);
        let own = bounds.along(&bounds.axes);
        let (mut low, mut high) = (points[0], points[1]);
        for k in 0..3 {
            (low[k], high[k]) = (low[k] - beyond, high[k] + beyond);
        }
        Growth::beyond_each(simd, &own, [[low, high], *cells])
    }
}

#[inline(always)]
fn extents<S: Simd>(simd: S, all: &[PartLanes], axes: &[[f32; 3]; 3]) -> Extents {
    let (most, none) = (f32x16::splat(simd, f32::INFINITY), f32x16::splat(simd, f32::NEG_INFINITY));
    let mut low = [[most; 3]; 3];
    let mut high = [[none; 3]; 3];
    let mut reach = f32x16::splat(simd, 0.0);
    let zero = f32x16::splat(simd, 0.0);
    for PartLanes { discs: DiscLanes { position, normal, radius, disc, .. }, ball, cell, slab } in all {
        let (position, normal) = (load(simd, position), load(simd, normal));
        let (disc, ball) = (f32x16::load_array_ref(simd, disc), f32x16::load_array_ref(simd, ball));
        let (cell, slab) = (f32x16::load_array_ref(simd, cell), f32x16::load_array_ref(simd, slab));
        let [u, v, w] = axes;
        let cosines = [along(normal, *u), along(normal, *v), along(normal, *w)];
        let squares = [cosines[0] * cosines[0], cosines[1] * cosines[1], cosines[2] * cosines[2]];
        reach = reach.max(f32x16::load_array_ref(simd, radius));
        for k in 0..3 {
            // The axes are orthonormal. This does not cancel as √(1 − (n·axis)²) does.
            let sine = (squares[(k + 1) % 3] + squares[(k + 2) % 3]).sqrt();
            let spreads =
                [(disc * (sine + THICKNESS)).max(ball), cell * sine + slab * cosines[k].abs(), zero];
            let middle = along(position, axes[k]);
            for j in 0..3 {
                low[j][k] = low[j][k].min(middle - spreads[j]);
                high[j][k] = high[j][k].max(middle + spreads[j]);
            }
        }
    }
    let (low, high) = (least_of_each(rows(&low)), greatest_of_each(rows(&high)));
    let mut extents = [[[0.0; 3]; 2]; 3];
    for j in 0..3 {
        for k in 0..3 {
            (extents[j][0][k], extents[j][1][k]) = (low[3 * j + k], high[3 * j + k]);
        }
    }
    let [discs, cells, points] = extents;
    Extents { discs, cells, points, reach: greatest(reach, 0.0) }
}

/// Returns nine rows, and the last one again.
#[inline(always)]
fn rows<S: Simd>([[a, b, c], [d, e, f], [g, h, i]]: &[[f32x16<S>; 3]; 3]) -> [f32x16<S>; WIDTH] {
    [*a, *b, *c, *d, *e, *f, *g, *h, *i, *i, *i, *i, *i, *i, *i, *i]
}
