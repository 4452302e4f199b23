//! Enclosures: boxes that provably contain the surface.
//!
//! A surface point x belongs to the leaf of its nearest cloud point p. Let J be the points that
//! have x within their support radius. Three facts bound x (docs/theory/certificates.md has the
//! proof):
//!
//! 1. a(x) is in the hull of J and ‖x − a(x)‖ ≤ 0.56 h(x), so x is in the hull of J grown by 0.56
//!    of J's greatest h;
//! 2. x is within half the support radius of a point of J, and p is no further from x than that
//!    point. The distance of x from p is therefore at most half the greatest support radius of the
//!    points that have p within their support radius;
//! 3. x is on p's side of the bisecting plane of p and any other point.
//!
//! None of them uses f(x) = 0: every x of status ok is enclosed.
//!
//! Facts 1 and 2 bound a leaf along the axes of its box. All three give each point a cell, a
//! cylinder around its normal. The leaf's part is also in the box around these cells; the smaller
//! bound counts. The enclosure of an inner node is the smallest box along its own axes around those
//! of its leaves. The claim of Klein & Zachmann 2004, §4.2, that x is in the hull of J itself is
//! wrong (docs/theory).

use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x16, mask32x16};
use nearmiss_geometry::NodeId;
use nearmiss_index::PointBlock;
use nearmiss_lanes::id32;
use nearmiss_lanes::parallel::fill;
use nearmiss_lanes::vector::{cross, dot, sub};
use nearmiss_lanes::wide::{along, greatest, lanes_of, least, load, product, seen_from};
use nearmiss_store::{Room, WorkError, Workspace};
use nearmiss_surface::BORDER;

use crate::bounds::boxes::OrientedBox;
use crate::bounds::growth::Growth;
use crate::point::gather::Index;
use crate::point::neighbours::Locality;
use crate::tree::topology::Topology;

/// The number of sectors of a tangent plane in which a cell is bounded separately.
const SECTORS: usize = 16;

/// Unit vectors between the sectors, 22.5° apart.
const RAYS: [[f32; SECTORS]; 2] = {
    const A: f32 = 0.923_879_5;
    const B: f32 = 0.707_106_77;
    const C: f32 = 0.382_683_43;
    [
        [1.0, A, B, C, 0.0, -C, -B, -A, -1.0, -A, -B, -C, 0.0, C, B, A],
        [0.0, C, B, A, 1.0, A, B, C, 0.0, -C, -B, -A, -1.0, -A, -B, -C],
    ]
};

/// For each ray the next one.
const NEXT_RAYS: [[f32; SECTORS]; 2] = {
    let mut next = RAYS;
    let mut k = 0;
    while k < SECTORS {
        (next[0][k], next[1][k]) = (RAYS[0][(k + 1) % SECTORS], RAYS[1][(k + 1) % SECTORS]);
        k += 1;
    }
    next
};

/// The distance, in local radii, up to which neighbours bound a cell. Further ones do so only
/// beside holes; ignoring them makes the cell wider, never wrong.
const NEIGHBOURS: f32 = 1.75;

/// Allowance for the relative rounding error: about a hundred roundings in differences of nearby
/// numbers.
const GROWN: f32 = 1.0 + 1e-4;

/// The number of points processed together.
const WIDTH: usize = PointBlock::WIDTH;

/// The points that may support a leaf's part of the surface, relative to a point of the leaf, in
/// lanes.
#[derive(Debug, Clone, Default)]
pub(crate) struct Surroundings {
    origin: [f32; 3],
    blocks: Vec<PointBlock>,
    /// The maximum distance of a surface point from its nearest point, by fact 2.
    reach: f32,
    /// 0.56 h over the support radius.
    border: f32,
}

impl Surroundings {
    /// Sets the surroundings of a leaf; `origin` is a point of the leaf.
    #[inline(always)]
    pub(crate) fn fill(&mut self, index: &Index<'_>, origin: [f32; 3], locality: &Locality) {
        self.origin = origin;
        self.reach = locality.reach * GROWN;
        #[expect(clippy::cast_possible_truncation, reason = "a constant")]
        let border = BORDER as f32 * GROWN;
        self.border = border * index.plan.bandwidth(1.0) / index.plan.support_radius(1.0);
        self.blocks.clear();
        for &id in &locality.blocks {
            let mut block = index.blocks[id as usize];
            for k in 0..3 {
                block.position[k].iter_mut().for_each(|x| *x -= origin[k]);
            }
            block.support_radius.iter_mut().for_each(|h| *h *= GROWN);
            self.blocks.push(block);
        }
    }

    /// Returns the greatest distance of a surface point from its nearest point.
    pub(crate) fn reach(&self) -> f32 {
        self.reach
    }

    /// Returns the cell of the point `p`, a cylinder that contains the surface points nearest to it,
    /// by facts 1 and 2. The support of all blocks but those at `places` is out of its reach.
    #[inline(always)]
    pub(crate) fn cell<S: Simd>(&self, simd: S, p: [f32; 3], normal: [f32; 3], places: &[u32]) -> Cell {
        let reach = self.reach;
        let (low, high) = self.heights(simd, sub(p, self.origin), normal, places);
        Cell { across: reach, low: low.max(-reach), high: high.min(reach) }
    }

    /// Applies fact 1 along the normal of `p`: returns the least and greatest height of a surface
    /// point within reach of it.
    #[inline(always)]
    fn heights<S: Simd>(&self, simd: S, p: [f32; 3], normal: [f32; 3], places: &[u32]) -> (f32, f32) {
        let reach = self.reach;
        let zero = f32x16::splat(simd, 0.0);
        let (mut low, mut high, mut most) = (zero, zero, zero);
        for &place in places {
            let block = &self.blocks[place as usize];
            let d = seen_from(simd, &block.position, p);
            let support_radius = f32x16::load_array_ref(simd, &block.support_radius);
            let within = support_radius + reach;
            let reaches: mask32x16<S> = product(d, d).simd_lt(within * within);
            let height = simd.select_f32x16(reaches, along(d, normal), zero);
            let radius = simd.select_f32x16(reaches, support_radius, zero);
            (low, high, most) = (height.min(low), height.max(high), radius.max(most));
        }
        let margin = self.border * greatest(most, 0.0);
        (least(low, 0.0) - margin, greatest(high, 0.0) + margin)
    }
}

/// Fact 3 in the tangent plane of a point: the sectors in which its neighbours bound its cell.
pub(crate) struct Sides<S: Simd> {
    /// The greatest squared distance of a neighbour that bounds.
    most_sq: f32,
    /// For each sector, the greatest reciprocal of a bound.
    closed: f32x16<S>,
}

impl<S: Simd> Sides<S> {
    /// Starts without a neighbour. `radius` is the local radius of the point.
    #[inline(always)]
    pub(crate) fn new(simd: S, radius: f32) -> Self {
        let within = NEIGHBOURS * radius;
        Self { most_sq: within * within, closed: f32x16::splat(simd, 0.0) }
    }

    /// Adds the points of a block. `d_sq` are their squared distances, `x` and `y` their coordinates
    /// in the tangent plane, and `heights` returns their heights above it. No part of `cell` is
    /// outside its least and greatest height.
    #[inline(always)]
    pub(crate) fn add(
        &mut self,
        simd: S,
        cell: &Cell,
        d_sq: f32x16<S>,
        [x, y]: [f32x16<S>; 2],
        height: f32x16<S>,
    ) {
        /// The greatest reciprocal of a bound. A sum of two products of such numbers is finite, so
        /// that minima and maxima are the same on every machine.
        const MOST: f32 = 1e30;
        let counts: mask32x16<S> = d_sq.simd_gt(0.0) & d_sq.simd_le(self.most_sq);
        if !counts.any_true() {
            return;
        }
        // t·q ≤ ‖q‖²/2 − z·height for the part t of x − p across the normal, a neighbour q and any
        // height z.
        let bound = d_sq * 0.5 + (-(height * cell.low)).max(-(height * cell.high)).max(0.0);
        let (x, y) = (x / bound, y / bound);
        let counts: mask32x16<S> = counts & (x.abs() + y.abs()).simd_lt(MOST);
        let (x, y) = (x.to_array(), y.to_array());
        let mut bits = counts.to_bitmask();
        while bits != 0 {
            let i = bits.trailing_zeros() as usize % WIDTH;
            bits &= bits - 1;
            // A bound that holds at both rays of a sector holds between them.
            let (side, next) = (rays(simd, &RAYS, x[i], y[i]), rays(simd, &NEXT_RAYS, x[i], y[i]));
            self.closed = self.closed.max(side.min(next));
        }
    }

    /// Narrows the cell to the bounds of its sides.
    #[inline(always)]
    pub(crate) fn close(self, cell: &mut Cell) {
        let least = least(self.closed, f32::INFINITY);
        let across = if least > 0.0 { GROWN / least } else { f32::INFINITY };
        cell.across = across.min(cell.across);
    }
}

/// Returns the component of a vector along each ray.
#[inline(always)]
fn rays<S: Simd>(simd: S, rays: &[[f32; SECTORS]; 2], x: f32, y: f32) -> f32x16<S> {
    f32x16::load_array_ref(simd, &rays[0]) * x + f32x16::load_array_ref(simd, &rays[1]) * y
}

/// A cylinder around the normal of a point that contains the surface points nearest to it.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Cell {
    /// The radius.
    pub(crate) across: f32,
    /// Least (not positive) and greatest (not negative) height along the normal.
    low: f32,
    high: f32,
}

impl Cell {
    /// Returns the part no further than `across` from the axis and `height` from the plane.
    pub(crate) fn within(&self, across: f32, height: f32) -> Self {
        Self { across: self.across.min(across), low: self.low.max(-height), high: self.high.min(height) }
    }

    /// Returns the greatest height on either side.
    pub(crate) fn height(&self) -> f32 {
        self.high.max(-self.low)
    }
}

/// Bounds of a leaf's part of the surface along the axes of its box, relative to a point of the
/// leaf.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct LeafBounds {
    axes: [[f32; 3]; 3],
    origin: [f32; 3],
    low: [f32; 3],
    high: [f32; 3],
}

impl LeafBounds {
    /// Applies facts 1 and 2 to a leaf with these points and box.
    #[inline(always)]
    pub(crate) fn new<S: Simd>(
        simd: S,
        points: &[[f32; 3]],
        about: &OrientedBox,
        surroundings: &Surroundings,
    ) -> Self {
        let (axes, origin, reach) = (about.axes, points[0], surroundings.reach);
        let (mut own_low, mut own_high) = ([0.0_f32; 3], [0.0_f32; 3]);
        for p in points {
            for k in 0..3 {
                let c = dot(axes[k], sub(*p, origin));
                (own_low[k], own_high[k]) = (own_low[k].min(c), own_high[k].max(c));
            }
        }
        let zero = f32x16::splat(simd, 0.0);
        let (mut low, mut high, mut most) = ([zero; 3], [zero; 3], zero);
        for block in &surroundings.blocks {
            let d = load(simd, &block.position);
            let (mut at, mut far) = ([zero; 3], [zero; 3]);
            for k in 0..3 {
                at[k] = along(d, axes[k]);
                far[k] = (-(at[k] - own_low[k])).max(at[k] - own_high[k]).max(zero);
            }
            let support_radius = f32x16::load_array_ref(simd, &block.support_radius);
            let within = support_radius + reach;
            let is_near: mask32x16<S> = product(far, far).simd_lt(within * within);
            for k in 0..3 {
                low[k] = simd.select_f32x16(is_near, at[k].min(low[k]), low[k]);
                high[k] = simd.select_f32x16(is_near, at[k].max(high[k]), high[k]);
            }
            most = simd.select_f32x16(is_near, support_radius.max(most), most);
        }
        let margin = surroundings.border * greatest(most, 0.0);
        let mut bounds = Self { axes, origin, low: own_low, high: own_high };
        for k in 0..3 {
            bounds.low[k] = (least(low[k], own_low[k]) - margin).max(own_low[k] - reach);
            bounds.high[k] = (greatest(high[k], own_high[k]) + margin).min(own_high[k] + reach);
        }
        bounds
    }

    /// Starts to bound the leaf by its points' cells.
    pub(crate) fn cells(&self) -> Cells {
        Cells { leaf: *self, low: [f32::INFINITY; 3], high: [f32::NEG_INFINITY; 3] }
    }

    /// Returns the same axes with zero extent: the leaf's box already contains everything.
    pub(crate) fn empty(&self) -> Self {
        Self { low: [0.0; 3], high: [0.0; 3], ..*self }
    }

    /// Returns the growth of `bounds`, a box of the same axes, that contains these bounds.
    fn growth(&self, bounds: &OrientedBox) -> Growth {
        let at = self.axes.map(|axis| dot(axis, self.origin));
        Growth::new(
            bounds,
            [0, 1, 2].map(|k| at[k] + self.low[k] * GROWN),
            [0, 1, 2].map(|k| at[k] + self.high[k] * GROWN),
        )
    }
}

/// The extents of the cells of a leaf's points.
#[derive(Debug)]
pub(crate) struct Cells {
    leaf: LeafBounds,
    low: [f32; 3],
    high: [f32; 3],
}

impl Cells {
    /// Includes the cell of the point `p` with this normal.
    pub(crate) fn include(&mut self, p: [f32; 3], normal: [f32; 3], cell: &Cell) {
        let d = sub(p, self.leaf.origin);
        for k in 0..3 {
            let axis = self.leaf.axes[k];
            let spread = cross(axis, normal);
            let spread = cell.across * dot(spread, spread).sqrt();
            let cosine = dot(axis, normal);
            let (a, b) = (cosine * cell.low, cosine * cell.high);
            let c = dot(axis, d);
            self.low[k] = self.low[k].min(c - spread + a.min(b));
            self.high[k] = self.high[k].max(c + spread + a.max(b));
        }
    }

    /// Returns the bounds of the leaf, after the cells of all its points have been included.
    pub(crate) fn close(self) -> LeafBounds {
        let Self { mut leaf, low, high } = self;
        for k in 0..3 {
            // Only ordered numbers may reduce the bounds.
            if low[k] <= high[k] {
                leaf.low[k] = leaf.low[k].max(low[k]);
                leaf.high[k] = leaf.high[k].min(high[k]);
            }
        }
        leaf
    }
}

/// Returns the growths from the boxes of all nodes to their enclosures, given the bounds of the
/// leaves in order.
pub(crate) fn growths(
    topology: &Topology,
    boxes: &[OrientedBox],
    leaves: &[LeafBounds],
    work: &Workspace,
) -> Result<Room<Growth>, WorkError> {
    let leaf_boxes = &boxes[topology.inner()..];
    let mut room = work.room(topology.len())?;
    let growths: &mut [Growth] = &mut room;
    let (of_inner, of_leaves) = growths.split_at_mut(topology.inner());
    fill(of_leaves, |number| leaves[number].growth(&leaf_boxes[number]));
    let of_leaves = &*of_leaves;
    let mut blocks = work.room(leaves.len().div_ceil(WIDTH))?;
    fill(&mut blocks, |number| {
        let leaves = number * WIDTH..leaves.len().min((number + 1) * WIDTH);
        BoxBlock::of(leaves.map(|leaf| of_leaves[leaf].of(&leaf_boxes[leaf])))
    });
    let (level, blocks): (_, &[BoxBlock]) = (Level::new(), &blocks);
    fill(of_inner, |id| {
        let id = NodeId(id32(id));
        let range = topology.leaves_under(id);
        let bounds = &boxes[id.index()];
        let [low, high] = dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || extents(simd, blocks, &range, &bounds.axes),
        ));
        Growth::new(bounds, low, high)
    });
    Ok(room)
}

/// Boxes side by side.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C, align(64))]
struct BoxBlock {
    centre: [[f32; WIDTH]; 3],
    half: [[f32; WIDTH]; 3],
    axes: [[[f32; WIDTH]; 3]; 3],
}

impl BoxBlock {
    fn of(boxes: impl Iterator<Item = OrientedBox>) -> Self {
        let zero = [[0.0; WIDTH]; 3];
        let mut block = Self { centre: zero, half: zero, axes: [zero; 3] };
        for (lane, bounds) in boxes.enumerate() {
            for k in 0..3 {
                block.centre[k][lane] = bounds.centre[k];
                block.half[k][lane] = bounds.half[k];
                for j in 0..3 {
                    block.axes[k][j][lane] = bounds.axes[k][j];
                }
            }
        }
        block
    }
}

/// Returns the least and greatest coordinates of the boxes in `range` along `axes`, as
/// [`OrientedBox::along`] does for one box.
#[inline(always)]
fn extents<S: Simd>(
    simd: S,
    blocks: &[BoxBlock],
    range: &Range<usize>,
    axes: &[[f32; 3]; 3],
) -> [[f32; 3]; 2] {
    let (most, none) = (f32x16::splat(simd, f32::INFINITY), f32x16::splat(simd, f32::NEG_INFINITY));
    let (mut low, mut high) = ([most; 3], [none; 3]);
    for number in range.start / WIDTH..range.end.div_ceil(WIDTH) {
        let block = &blocks[number];
        let inside = mask32x16::from_bitmask(simd, u64::from(lanes_of(number, range)));
        for k in 0..3 {
            let middle = along(load(simd, &block.centre), axes[k]);
            let mut spread = f32x16::splat(simd, 0.0);
            for j in 0..3 {
                let cosine = along(load(simd, &block.axes[j]), axes[k]).abs();
                spread += f32x16::load_array_ref(simd, &block.half[j]) * cosine;
            }
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
