//! What two leaves are compared by, in one place: a query comes to a leaf that no other has lately come to,
//! and waits for each part of memory that it needs.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16, i16x16};
use nearmiss_lanes::parallel::map_all;
use nearmiss_lanes::vector::sub;

use crate::boxes::OrientedBox;
use crate::growth::Growth;
use crate::kind::{PointKind, is_on_sheet};
use crate::topology::Node;

/// Lanes of a block.
const WIDTH: usize = 16;

/// Unit vectors are told in so many steps.
const STEPS: f32 = 32767.0;

/// Up to sixteen points of a leaf as tangent discs, and the leaf's box.
///
/// Of places and radii sixteen bits are kept, in steps of a 2⁻¹⁵th of the leaf, and of directions as many:
/// off by less than a thousandth of a local radius and of a degree, where discs say no more than that
/// surfaces cross to first order; in half the memory.
#[derive(Debug, Clone, Copy, PartialEq)]
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
        [0, 1, 2].map(|k| self.centre[k] + f32::from(self.positions[k][lane]) * self.step)
    }

    /// The normal in a lane.
    #[inline]
    #[must_use]
    pub fn normal(&self, lane: usize) -> [f32; 3] {
        [0, 1, 2].map(|k| f32::from(self.normals[k][lane]) * (1.0 / STEPS))
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

/// What the tree in lanes is made of: arrays of a scan.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TreeParts<'a> {
    pub(crate) nodes: &'a [Node],
    pub(crate) boxes: &'a [OrientedBox],
    /// Of surface and obstacle.
    pub(crate) growths: [&'a [Growth]; 2],
    pub(crate) positions: &'a [[f32; 3]],
    pub(crate) normals: &'a [[f32; 3]],
    pub(crate) discs: &'a [f32],
    pub(crate) kinds: &'a [u8],
    /// Points before this are dense.
    pub(crate) dense: usize,
    pub(crate) leaf_size: u32,
}

/// The leaves in the order of their points.
#[derive(Debug, Clone, Default)]
pub struct Leaves {
    /// As many for each leaf as a full one needs.
    blocks: Vec<LeafBlock>,
    /// Their ids in the binary tree.
    ids: Vec<u32>,
    /// Whether some point of a leaf is sparse.
    sparse: Vec<bool>,
    /// Whether some point of a leaf stands in the obstacle as a ball.
    balls: Vec<bool>,
    points: usize,
    leaf_size: usize,
    blocks_a_leaf: usize,
}

impl Leaves {
    /// Those of a scan. O(n), on all cores.
    pub(crate) fn of(scan: &TreeParts<'_>) -> Self {
        let leaf_size = scan.leaf_size as usize;
        let is_on_sheet = |i: usize| is_on_sheet(i, scan.dense, PointKind::from_code(scan.kinds[i]));
        let blocks_a_leaf = leaf_size.div_ceil(WIDTH);
        let numbered = (0_u32..).zip(scan.nodes).filter(|(_, node)| node.is_leaf());
        let (mut ids, mut sparse, mut balls) = (Vec::new(), Vec::new(), Vec::new());
        for (id, node) in numbered {
            let is_sparse = |&code: &u8| PointKind::from_code(code).is_sparse();
            ids.push(id);
            sparse.push(scan.kinds[node.points()].iter().any(is_sparse));
            balls.push(node.points().any(|i| !is_on_sheet(i)));
        }
        let numbers: Vec<usize> = (0..ids.len() * blocks_a_leaf).collect();
        let blocks = map_all(&numbers, |&number| {
            let (leaf, part) = (number / blocks_a_leaf, number % blocks_a_leaf);
            let mut block = LeafBlock::new(&scan.boxes[ids[leaf] as usize]);
            let points = scan.nodes[ids[leaf] as usize].points();
            for (lane, i) in points.skip(part * WIDTH).take(WIDTH).enumerate() {
                block.set(lane, scan.positions[i], scan.normals[i], scan.discs[i]);
            }
            block
        });
        Self { blocks, ids, sparse, balls, points: scan.positions.len(), leaf_size, blocks_a_leaf }
    }

    /// The leaf's id in the binary tree.
    ///
    /// # Panics
    /// When there is no such leaf, as all here.
    #[inline]
    #[must_use]
    pub fn id(&self, leaf: usize) -> u32 {
        self.ids[leaf]
    }

    /// Its points.
    #[inline]
    #[must_use]
    pub fn points(&self, leaf: usize) -> std::ops::Range<usize> {
        let first = leaf * self.leaf_size;
        first..self.points.min(first + self.leaf_size)
    }

    /// The leaf of a point.
    #[inline]
    #[must_use]
    pub fn leaf_of(&self, i: usize) -> usize {
        i / self.leaf_size
    }

    /// The block with a point, its first point and how many it has.
    ///
    /// # Panics
    /// When there is no such point.
    #[inline]
    #[must_use]
    pub fn block_with(&self, i: usize) -> (&LeafBlock, usize, usize) {
        let (leaf, within) = (i / self.leaf_size, i % self.leaf_size);
        let part = within / WIDTH;
        let first = i - within % WIDTH;
        let count = (self.points(leaf).end - first).min(WIDTH);
        (&self.blocks[leaf * self.blocks_a_leaf + part], first, count)
    }

    /// Whether some of them are [sparse](PointKind::is_sparse).
    #[inline]
    #[must_use]
    pub fn is_sparse(&self, leaf: usize) -> bool {
        self.sparse[leaf]
    }

    /// Returns `true` if some of them stand in the obstacle as balls.
    #[inline]
    #[must_use]
    pub fn has_balls(&self, leaf: usize) -> bool {
        self.balls[leaf]
    }

    /// Its points in blocks, with the first point of each block and how many it has.
    #[inline]
    pub fn blocks(&self, leaf: usize) -> impl Iterator<Item = (&LeafBlock, usize, usize)> {
        let points = self.points(leaf);
        let blocks = &self.blocks[leaf * self.blocks_a_leaf..][..points.len().div_ceil(WIDTH)];
        blocks.iter().enumerate().map(move |(i, block)| {
            let first = points.start + i * WIDTH;
            (block, first, (points.end - first).min(WIDTH))
        })
    }
}
