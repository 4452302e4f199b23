//! The data that leaves are compared by, in one place. A query rarely finds its leaves in the
//! cache, and would wait for each separate piece of memory.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x16, i16x16};
use nearmiss_lanes::parallel::{change_each, fill};
use nearmiss_lanes::wide::spread_out;

use crate::bounds::boxes::OrientedBox;
use crate::point::disc::{DiscRadii, PointCode};
use crate::point::kind::is_on_sheet;
use crate::tree::topology::Topology;

/// The number of lanes of a block.
pub(crate) const WIDTH: usize = 16;

/// The number of steps between 0 and 1 in a component of a unit vector.
const STEPS: f32 = 32767.0;

/// Up to sixteen points of a leaf as tangent discs, and the leaf's box.
///
/// Positions and radii are stored in 16 bits, in steps of a 2⁻¹⁵th of the leaf's radius, and
/// normals in 16 bits per component. The errors are below a thousandth of a local radius and of a
/// degree, while discs show crossings to first order only. This halves the memory.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C, align(32))]
pub struct LeafBlock {
    positions: [[i16; WIDTH]; 3],
    normals: [[i16; WIDTH]; 3],
    discs: [i16; WIDTH],
    /// The centre of the leaf's box.
    pub centre: [f32; 3],
    /// Half the edge lengths of the leaf's box.
    pub half: [f32; 3],
    /// Unit directions of the edges of the leaf's box.
    pub axes: [[f32; 3]; 3],
    step: f32,
}

impl LeafBlock {
    /// The number of points in a full block.
    pub const WIDTH: usize = WIDTH;

    /// Creates a block without points. `bounds` must contain the discs of all points that are
    /// [set](Self::set).
    #[must_use]
    pub fn new(bounds: &OrientedBox) -> Self {
        let OrientedBox { centre, half, axes, .. } = *bounds;
        let step = bounds.radius() / STEPS;
        Self {
            positions: [[0; WIDTH]; 3],
            normals: [[0; WIDTH]; 3],
            discs: [0; WIDTH],
            centre,
            half,
            axes,
            step,
        }
    }

    /// Writes a disc to a lane.
    ///
    /// # Panics
    /// If there is no such lane.
    pub fn set(&mut self, lane: usize, position: [f32; 3], normal: [f32; 3], disc: f32) {
        let scale = self.steps_per_length();
        let offset = [0, 1, 2].map(|k| position[k] - self.centre[k]);
        self.discs[lane] = nearest(disc * scale);
        for k in 0..3 {
            self.positions[k][lane] = nearest(offset[k] * scale);
            self.normals[k][lane] = nearest(normal[k] * STEPS);
        }
    }

    /// Creates a block of the points in `lanes`. `bounds` must contain their discs.
    #[inline(always)]
    pub(crate) fn of<S: Simd>(simd: S, lanes: &DiscLanes, bounds: &OrientedBox) -> Self {
        let mut block = Self::new(bounds);
        let scale = block.steps_per_length();
        for k in 0..3 {
            block.positions[k] = in_steps(simd, &lanes.position[k], bounds.centre[k], scale);
            block.normals[k] = in_steps(simd, &lanes.normal[k], 0.0, STEPS);
        }
        block.discs = in_steps(simd, &lanes.disc, 0.0, scale);
        for lane in lanes.count..WIDTH {
            block.discs[lane] = 0;
            for k in 0..3 {
                (block.positions[k][lane], block.normals[k][lane]) = (0, 0);
            }
        }
        block
    }

    #[inline(always)]
    fn steps_per_length(&self) -> f32 {
        if self.step > 0.0 { 1.0 / self.step } else { 0.0 }
    }

    /// Returns the unit in which positions and radii are stored.
    #[inline(always)]
    #[must_use]
    pub fn step(&self) -> f32 {
        self.step
    }

    /// Returns the position in a lane.
    ///
    /// # Panics
    /// If there is no such lane. The same holds for the other methods.
    #[inline]
    #[must_use]
    pub fn position(&self, lane: usize) -> [f32; 3] {
        let ([x, y, z], [i, j, k]) = (self.centre, &self.positions);
        let steps = [f32::from(i[lane]), f32::from(j[lane]), f32::from(k[lane])];
        [x + steps[0] * self.step, y + steps[1] * self.step, z + steps[2] * self.step]
    }

    /// Returns the normal in a lane.
    #[inline]
    #[must_use]
    pub fn normal(&self, lane: usize) -> [f32; 3] {
        let [x, y, z] = &self.normals;
        let per_step = 1.0 / STEPS;
        [f32::from(x[lane]) * per_step, f32::from(y[lane]) * per_step, f32::from(z[lane]) * per_step]
    }

    /// Returns the radius of the disc in a lane.
    #[inline]
    #[must_use]
    pub fn disc(&self, lane: usize) -> f32 {
        f32::from(self.discs[lane]) * self.step
    }

    /// Returns all positions; the centre of the box in unused lanes.
    #[inline(always)]
    pub fn positions<S: Simd>(&self, simd: S) -> [f32x16<S>; 3] {
        let [x, y, z] = &self.positions;
        let [cx, cy, cz] = self.centre;
        [steps(simd, x) * self.step + cx, steps(simd, y) * self.step + cy, steps(simd, z) * self.step + cz]
    }

    /// Returns all normals.
    #[inline(always)]
    pub fn normals<S: Simd>(&self, simd: S) -> [f32x16<S>; 3] {
        let [x, y, z] = &self.normals;
        let unit = 1.0 / STEPS;
        [steps(simd, x) * unit, steps(simd, y) * unit, steps(simd, z) * unit]
    }

    /// Returns the radii of all discs.
    #[inline(always)]
    pub fn discs<S: Simd>(&self, simd: S) -> f32x16<S> {
        steps(simd, &self.discs) * self.step
    }
}

/// Returns the nearest integer.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "a cast of floats keeps within the range")]
fn nearest(x: f32) -> i16 {
    (x + 0.5_f32.copysign(x)) as i16
}

/// Returns the distances of numbers from `origin` times `scale`, each rounded to the nearest integer.
#[inline(always)]
fn in_steps<S: Simd>(simd: S, numbers: &[f32; WIDTH], origin: f32, scale: f32) -> [i16; WIDTH] {
    let scaled = (f32x16::load_array_ref(simd, numbers) - origin) * scale;
    let rounded = scaled + f32x16::splat(simd, 0.5).copysign(scaled);
    let (low, high) = simd.cvt_i32_precise_f32x16(rounded).split();
    low.saturating_narrow(high).to_array()
}

/// Returns the first sixteen items, the last one repeated if there are fewer.
#[inline(always)]
fn repeated<T: Copy>(items: &[T]) -> [T; WIDTH] {
    if let Some(items) = items.first_chunk() {
        return *items;
    }
    let mut lanes = [items[items.len() - 1]; WIDTH];
    lanes[..items.len()].copy_from_slice(items);
    lanes
}

/// Returns the points of a leaf in runs of sixteen; the last may be shorter.
#[inline(always)]
pub(crate) fn sixteens(points: Range<usize>) -> impl Iterator<Item = Range<usize>> {
    points.clone().step_by(WIDTH).map(move |first| first..points.end.min(first + WIDTH))
}

/// Up to sixteen points of a leaf with their discs, one in each lane. Unused lanes repeat the last point.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DiscLanes {
    pub(crate) position: [[f32; WIDTH]; 3],
    pub(crate) normal: [[f32; WIDTH]; 3],
    /// The local radii.
    pub(crate) radius: [f32; WIDTH],
    /// The radii of the discs.
    pub(crate) disc: [f32; WIDTH],
    /// The number of points.
    pub(crate) count: usize,
    /// `true` if all points sample sheets.
    pub(crate) are_sheets: bool,
}

impl DiscLanes {
    pub(crate) const NONE: Self = Self {
        position: [[0.0; WIDTH]; 3],
        normal: [[0.0; WIDTH]; 3],
        radius: [0.0; WIDTH],
        disc: [0.0; WIDTH],
        count: 0,
        are_sheets: true,
    };
}

#[inline(always)]
fn steps<S: Simd>(simd: S, steps: &[i16; WIDTH]) -> f32x16<S> {
    let (low, high) = i16x16::load_array_ref(simd, steps).widen();
    f32x16::float_from(low.combine(high))
}

/// Mark of a leaf with a sparse point.
const SPARSE: u8 = 1;

/// Mark of a leaf with a point that is a ball in the obstacle.
const BALLS: u8 = 2;

/// Mark of a loose leaf.
const LOOSE: u8 = 4;

/// The half length, in its greatest local radius, from which a leaf is loose, that is, not a patch
/// of a sheet. Half the length of a patch of 16 points is about two.
const LOOSE_FROM: f32 = 3.0;

/// The arrays that leaf blocks are built from.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LeafParts<'a> {
    pub(crate) positions: &'a [[f32; 3]],
    pub(crate) normals: &'a [[f32; 3]],
    pub(crate) discs: DiscRadii<'a>,
    /// The number of dense points, which come first.
    pub(crate) dense: usize,
}

impl LeafParts<'_> {
    /// Returns the number of blocks in a leaf.
    pub(crate) fn blocks_a_leaf(topology: &Topology) -> usize {
        topology.leaf_size().div_ceil(WIDTH)
    }

    /// Sets the blocks and marks of all leaves. `bounds` returns the box of a leaf.
    pub(crate) fn fill(
        &self,
        topology: &Topology,
        bounds: impl Fn(usize) -> OrientedBox + Sync + Send,
        (blocks, marks): (&mut [LeafBlock], &mut [u8]),
    ) {
        let (blocks_a_leaf, level) = (Self::blocks_a_leaf(topology), Level::new());
        change_each(blocks, WIDTH, |number, block| {
            let bounds = bounds(number / blocks_a_leaf);
            *block = dispatch!(level, simd => simd.vectorize(
                #[inline(always)]
                || self.block(simd, topology, number, &bounds),
            ));
        });
        fill(marks, |leaf| self.marks(topology, leaf, &bounds(leaf)));
    }

    /// Returns block `number`, counted over all leaves. `bounds` is the box of its leaf.
    #[inline(always)]
    pub(crate) fn block<S: Simd>(
        &self,
        simd: S,
        topology: &Topology,
        number: usize,
        bounds: &OrientedBox,
    ) -> LeafBlock {
        let blocks_a_leaf = Self::blocks_a_leaf(topology);
        let (leaf, part) = (number / blocks_a_leaf, number % blocks_a_leaf);
        let mut parts = sixteens(topology.points_of_leaf(leaf)).skip(part);
        // No closure: it may be compiled without the instruction set of the caller.
        let Some(points) = parts.next() else { return LeafBlock::new(bounds) };
        LeafBlock::of(simd, &self.lanes(points), bounds)
    }

    /// Returns up to sixteen points of a leaf, at least one.
    #[inline(always)]
    pub(crate) fn lanes(&self, points: Range<usize>) -> DiscLanes {
        let DiscRadii { codes, radii, reach, sampling_radius } = self.discs;
        let last = points.end - 1;
        let (mut position, mut normal) =
            (self.positions[last].map(|x| [x; WIDTH]), self.normals[last].map(|x| [x; WIDTH]));
        spread_out(&self.positions[points.clone()], &mut position);
        spread_out(&self.normals[points.clone()], &mut normal);
        let (codes, radius) = (repeated(&codes[points.clone()]), repeated(&radii[points.clone()]));
        let (are_sheets, mut disc) = (PointCode::are_sheets(&codes), [0.0; WIDTH]);
        if are_sheets {
            for lane in 0..WIDTH {
                disc[lane] = codes[lane].disc_of_sheet(radius[lane], reach);
            }
        } else {
            for lane in 0..WIDTH {
                disc[lane] = codes[lane].disc(radius[lane], reach, sampling_radius);
            }
        }
        DiscLanes { position, normal, radius, disc, count: points.len(), are_sheets }
    }

    /// Returns the marks of a leaf; `bounds` is its box.
    pub(crate) fn marks(&self, topology: &Topology, leaf: usize, bounds: &OrientedBox) -> u8 {
        let kind = |i: usize| self.discs.codes[i].kind();
        let points = topology.points_of_leaf(leaf);
        // Most leaves have neither.
        let is_plain = points.end <= self.dense && PointCode::are_sheets(&self.discs.codes[points.clone()]);
        let is_sparse = !is_plain && points.clone().any(|i| kind(i).is_sparse());
        let has_balls = !is_plain && points.into_iter().any(|i| !is_on_sheet(i, self.dense, kind(i)));
        let is_loose = bounds.half[0] > LOOSE_FROM * bounds.reach;
        let marks = [(SPARSE, is_sparse), (BALLS, has_balls), (LOOSE, is_loose)];
        marks.into_iter().filter(|mark| mark.1).fold(0, |marks, mark| marks | mark.0)
    }
}

/// The leaves in the order of their points.
#[derive(Debug, Clone, Copy)]
pub struct Leaves<'a> {
    pub(crate) topology: &'a Topology,
    /// The blocks of all leaves; each leaf has as many as a full one needs.
    pub(crate) blocks: &'a [LeafBlock],
    /// The marks of each leaf.
    pub(crate) marks: &'a [u8],
}

impl<'a> Leaves<'a> {
    /// Returns the points of a leaf, by its number.
    #[inline]
    #[must_use]
    pub fn points(&self, leaf: usize) -> Range<usize> {
        self.topology.points_of_leaf(leaf)
    }

    /// Returns the leaf of a point.
    #[inline]
    #[must_use]
    pub fn leaf_of(&self, i: usize) -> usize {
        i / self.topology.leaf_size()
    }

    /// Returns the block of a point, the first point of the block and the number of its points.
    ///
    /// # Panics
    /// If there is no such point.
    #[inline]
    #[must_use]
    pub fn block_with(&self, i: usize) -> (&'a LeafBlock, usize, usize) {
        let leaf_size = self.topology.leaf_size();
        let (leaf, within) = (i / leaf_size, i % leaf_size);
        let part = within / WIDTH;
        let first = i - within % WIDTH;
        let count = (self.points(leaf).end - first).min(WIDTH);
        (&self.blocks[leaf * leaf_size.div_ceil(WIDTH) + part], first, count)
    }

    /// Returns `true` if some points of a leaf are [sparse](crate::PointKind::is_sparse).
    ///
    /// # Panics
    /// If there is no such leaf. The same holds for the methods below.
    #[inline]
    #[must_use]
    pub fn is_sparse(&self, leaf: usize) -> bool {
        self.marks[leaf] & SPARSE != 0
    }

    /// Returns `true` if some points of a leaf are balls in the obstacle.
    #[inline]
    #[must_use]
    pub fn has_balls(&self, leaf: usize) -> bool {
        self.marks[leaf] & BALLS != 0
    }

    /// Returns `true` if a leaf is longer than a patch of a sheet would be. Its points may then
    /// bound its obstacle better than its box.
    #[inline]
    #[must_use]
    pub fn is_loose(&self, leaf: usize) -> bool {
        self.marks[leaf] & LOOSE != 0
    }

    /// Returns the blocks of a leaf, each with its first point and its number of points.
    #[inline]
    pub fn blocks(&self, leaf: usize) -> impl Iterator<Item = (&'a LeafBlock, usize, usize)> + use<'a> {
        let points = self.points(leaf);
        let blocks_a_leaf = self.topology.leaf_size().div_ceil(WIDTH);
        let blocks = &self.blocks[leaf * blocks_a_leaf..][..points.len().div_ceil(WIDTH)];
        blocks.iter().enumerate().map(move |(i, block)| {
            let first = points.start + i * WIDTH;
            (block, first, (points.end - first).min(WIDTH))
        })
    }
}
