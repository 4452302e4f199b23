//! What two leaves are compared by, in one place: a query comes to a leaf that no other has lately come to, and waits for each part
//! of memory that it needs.

use crate::boxes::OrientedBox;
use crate::build::PointHierarchy;
use crate::surfels::PointKind;

/// Lanes of a block.
const WIDTH: usize = 16;

/// Up to sixteen points of a leaf as tangent discs, and the leaf's box.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C, align(64))]
pub struct LeafBlock {
    /// Positions; zero in lanes without a point.
    pub positions: [[f32; WIDTH]; 3],
    /// Unit normals.
    pub normals: [[f32; WIDTH]; 3],
    /// Radii of the discs.
    pub discs: [f32; WIDTH],
    /// The box of the leaf.
    pub bounds: OrientedBox,
}

impl LeafBlock {
    /// How many points fit.
    pub const WIDTH: usize = WIDTH;

    const EMPTY: Self = Self {
        positions: [[0.0; WIDTH]; 3],
        normals: [[0.0; WIDTH]; 3],
        discs: [0.0; WIDTH],
        bounds: OrientedBox { centre: [0.0; 3], half: [0.0; 3], axes: [[0.0; 3]; 3], reach: 0.0 },
    };
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
    points: usize,
    leaf_size: usize,
    blocks_a_leaf: usize,
}

impl Leaves {
    /// Those of this scan. O(n).
    pub(crate) fn of(scan: &PointHierarchy) -> Self {
        let (slices, leaf_size) = (scan.slices(), scan.leaf_size as usize);
        let blocks_a_leaf = leaf_size.div_ceil(WIDTH);
        let mut leaves = Self { points: scan.len(), leaf_size, blocks_a_leaf, ..Self::default() };
        let ids = (0_u32..).zip(slices.nodes).filter(|(_, node)| node.is_leaf());
        for ((id, node), bounds) in ids.map(|(id, node)| ((id, node), slices.boxes[id as usize])) {
            leaves.ids.push(id);
            leaves
                .sparse
                .push(slices.kinds[node.points()].iter().any(|&k| PointKind::from_code(k).is_sparse()));
            let full = leaves.blocks.len() + blocks_a_leaf;
            for first in node.points().step_by(WIDTH) {
                let mut block = LeafBlock { bounds, ..LeafBlock::EMPTY };
                for (lane, i) in (first..node.points().end.min(first + WIDTH)).enumerate() {
                    for k in 0..3 {
                        block.positions[k][lane] = slices.positions[i][k];
                        block.normals[k][lane] = slices.normals[i][k];
                    }
                    block.discs[lane] = slices.discs[i];
                }
                leaves.blocks.push(block);
            }
            leaves.blocks.resize(full, LeafBlock { bounds, ..LeafBlock::EMPTY });
        }
        leaves
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

    /// Whether some of them are [sparse](PointKind::is_sparse).
    #[inline]
    #[must_use]
    pub fn is_sparse(&self, leaf: usize) -> bool {
        self.sparse[leaf]
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
