//! What two leaves are compared by, in one place: a query comes to a leaf that no other has lately come to,
//! and waits for each part of memory that it needs.

use bytemuck::{Pod, Zeroable};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16, i16x16};
use nearmiss_lanes::vector::sub;

use crate::bounds::boxes::OrientedBox;
use crate::point::disc::DiscRadii;
use crate::point::kind::is_on_sheet;
use crate::tree::topology::Topology;

/// Lanes of a block.
const WIDTH: usize = 16;

/// Unit vectors are told in so many steps.
const STEPS: f32 = 32767.0;

/// Up to sixteen points of a leaf as tangent discs, and the leaf's box.
///
/// Of places and radii sixteen bits are kept, in steps of a 2⁻¹⁵th of the leaf, and of directions as many:
/// off by less than a thousandth of a local radius and of a degree, where discs say no more than that
/// surfaces cross to first order; in half the memory.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C, align(32))]
pub struct LeafBlock {
    positions: [[i16; WIDTH]; 3],
    normals: [[i16; WIDTH]; 3],
    discs: [i16; WIDTH],
    /// The box of the leaf: its centre, half its edges, their directions.
    pub centre: [f32; 3],
    /// Half its edge lengths.
    pub half: [f32; 3],
    /// Unit directions of the edges.
    pub axes: [[f32; 3]; 3],
    step: f32,
}

impl LeafBlock {
    /// How many points fit.
    pub const WIDTH: usize = WIDTH;

    /// Without points. `bounds` is to hold the discs of all that are [set](Self::set).
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

    /// Puts a disc into a lane.
    ///
    /// # Panics
    /// When there is no such lane.
    #[expect(clippy::cast_possible_truncation, reason = "a cast of floats keeps within the range")]
    pub fn set(&mut self, lane: usize, position: [f32; 3], normal: [f32; 3], disc: f32) {
        let nearest = |x: f32| (x + 0.5_f32.copysign(x)) as i16;
        let per_step = if self.step > 0.0 { 1.0 / self.step } else { 0.0 };
        let steps = |x: f32| nearest(x * per_step);
        let offset = sub(position, self.centre).map(steps);
        self.discs[lane] = steps(disc);
        for k in 0..3 {
            self.positions[k][lane] = offset[k];
            self.normals[k][lane] = nearest(normal[k] * STEPS);
        }
    }

    /// The position in a lane.
    ///
    /// # Panics
    /// When there is no such lane, as all here.
    #[inline]
    #[must_use]
    pub fn position(&self, lane: usize) -> [f32; 3] {
        let ([x, y, z], [i, j, k]) = (self.centre, &self.positions);
        let steps = [f32::from(i[lane]), f32::from(j[lane]), f32::from(k[lane])];
        [x + steps[0] * self.step, y + steps[1] * self.step, z + steps[2] * self.step]
    }

    /// The normal in a lane.
    #[inline]
    #[must_use]
    pub fn normal(&self, lane: usize) -> [f32; 3] {
        let [x, y, z] = &self.normals;
        let per_step = 1.0 / STEPS;
        [f32::from(x[lane]) * per_step, f32::from(y[lane]) * per_step, f32::from(z[lane]) * per_step]
    }

    /// The radius of the disc in a lane.
    #[inline]
    #[must_use]
    pub fn disc(&self, lane: usize) -> f32 {
        f32::from(self.discs[lane]) * self.step
    }

    /// All positions; the centre of the box where there is no point.
    #[inline(always)]
    pub fn positions<S: Simd>(&self, simd: S) -> [f32x16<S>; 3] {
        let [x, y, z] = &self.positions;
        let [cx, cy, cz] = self.centre;
        [steps(simd, x) * self.step + cx, steps(simd, y) * self.step + cy, steps(simd, z) * self.step + cz]
    }

    /// All normals.
    #[inline(always)]
    pub fn normals<S: Simd>(&self, simd: S) -> [f32x16<S>; 3] {
        let [x, y, z] = &self.normals;
        let unit = 1.0 / STEPS;
        [steps(simd, x) * unit, steps(simd, y) * unit, steps(simd, z) * unit]
    }

    /// The radii of all discs.
    #[inline(always)]
    pub fn discs<S: Simd>(&self, simd: S) -> f32x16<S> {
        steps(simd, &self.discs) * self.step
    }
}

#[inline(always)]
fn steps<S: Simd>(simd: S, steps: &[i16; WIDTH]) -> f32x16<S> {
    let (low, high) = i16x16::load_array_ref(simd, steps).widen();
    f32x16::float_from(low.combine(high))
}

/// Whether some point of a leaf is sparse, as a bit.
const SPARSE: u8 = 1;

/// Whether some point of a leaf stands in the obstacle as a ball.
const BALLS: u8 = 2;

/// Whether a leaf is loose, as a bit.
const LOOSE: u8 = 4;

/// A leaf longer than so many of its greatest local radii is not a patch of a sheet. Half the length of a
/// patch of 16 points is some two.
const LOOSE_FROM: f32 = 3.0;

/// The arrays that leaf blocks are built from.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LeafParts<'a> {
    pub(crate) positions: &'a [[f32; 3]],
    pub(crate) normals: &'a [[f32; 3]],
    pub(crate) discs: DiscRadii<'a>,
    /// Points before this are dense.
    pub(crate) dense: usize,
}

impl LeafParts<'_> {
    /// How many blocks a leaf has.
    pub(crate) fn blocks_a_leaf(topology: &Topology) -> usize {
        topology.leaf_size().div_ceil(WIDTH)
    }

    /// The block with this number of all leaves'; `bounds` is the box of its leaf.
    pub(crate) fn block(&self, topology: &Topology, number: usize, bounds: &OrientedBox) -> LeafBlock {
        let blocks_a_leaf = Self::blocks_a_leaf(topology);
        let (leaf, part) = (number / blocks_a_leaf, number % blocks_a_leaf);
        let mut block = LeafBlock::new(bounds);
        let points = topology.points_of_leaf(leaf);
        for (lane, i) in points.skip(part * WIDTH).take(WIDTH).enumerate() {
            block.set(lane, self.positions[i], self.normals[i], self.discs.get(i));
        }
        block
    }

    /// What kinds of points a leaf has, and whether it is loose; `bounds` is its box.
    pub(crate) fn marks(&self, topology: &Topology, leaf: usize, bounds: &OrientedBox) -> u8 {
        let kind = |i: usize| self.discs.codes[i].kind();
        let points = topology.points_of_leaf(leaf);
        let is_sparse = points.clone().any(|i| kind(i).is_sparse());
        let has_balls = points.into_iter().any(|i| !is_on_sheet(i, self.dense, kind(i)));
        let is_loose = bounds.half[0] > LOOSE_FROM * bounds.reach;
        let marks = [(SPARSE, is_sparse), (BALLS, has_balls), (LOOSE, is_loose)];
        marks.into_iter().filter(|mark| mark.1).fold(0, |marks, mark| marks | mark.0)
    }
}

/// The leaves in the order of their points.
#[derive(Debug, Clone, Copy)]
pub struct Leaves<'a> {
    pub(crate) topology: &'a Topology,
    /// As many for each leaf as a full one needs.
    pub(crate) blocks: &'a [LeafBlock],
    /// What kinds of points each has, and whether it is loose.
    pub(crate) marks: &'a [u8],
}

impl<'a> Leaves<'a> {
    /// The points of a leaf, by its number.
    #[inline]
    #[must_use]
    pub fn points(&self, leaf: usize) -> std::ops::Range<usize> {
        self.topology.points_of_leaf(leaf)
    }

    /// The leaf of a point.
    #[inline]
    #[must_use]
    pub fn leaf_of(&self, i: usize) -> usize {
        i / self.topology.leaf_size()
    }

    /// The block with a point, its first point and how many it has.
    ///
    /// # Panics
    /// When there is no such point.
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
    /// When there is no such leaf, as below.
    #[inline]
    #[must_use]
    pub fn is_sparse(&self, leaf: usize) -> bool {
        self.marks[leaf] & SPARSE != 0
    }

    /// Returns `true` if some of them stand in the obstacle as balls.
    #[inline]
    #[must_use]
    pub fn has_balls(&self, leaf: usize) -> bool {
        self.marks[leaf] & BALLS != 0
    }

    /// Returns `true` if its points may tell more of its obstacle than its box: it is longer than a patch of
    /// a sheet would be.
    #[inline]
    #[must_use]
    pub fn is_loose(&self, leaf: usize) -> bool {
        self.marks[leaf] & LOOSE != 0
    }

    /// Its points in blocks, with the first point of each block and how many it has.
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
