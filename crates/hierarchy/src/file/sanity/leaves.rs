//! Validation of the leaf blocks: one that does not match its points gives false contacts.

use bytemuck::bytes_of;
use fearless_simd::{Level, Simd, dispatch};
use nearmiss_lanes::parallel::ranges;

use crate::scan::build::PointHierarchy;
use nearmiss_store::Flaw;

/// Checks that the blocks and marks of all leaves match their points.
pub(super) fn check(scan: &PointHierarchy) -> Result<(), Flaw> {
    let (topology, parts, level) = (scan.topology(), scan.leaf_parts(), Level::new());
    let blocks_a_leaf = scan.arrays.leaf_blocks.len() / topology.leaves();
    let (stored, marks) = (&*scan.arrays.leaf_blocks, &*scan.arrays.marks);
    let wrong = ranges(topology.leaves(), |mut leaves| {
        leaves.find(|&leaf| {
            let bounds = scan.tree().bounds(topology.leaf(leaf));
            let is_other = |number: usize| {
                let block = dispatch!(level, simd => simd.vectorize(
                    #[inline(always)]
                    || parts.block(simd, topology, number, &bounds),
                ));
                bytes_of(&stored[number]) != bytes_of(&block)
            };
            let mut blocks = leaf * blocks_a_leaf..(leaf + 1) * blocks_a_leaf;
            blocks.any(is_other) || marks[leaf] != parts.marks(topology, leaf, &bounds)
        })
    });
    match wrong.into_iter().flatten().next() {
        Some(index) => Err(Flaw::Value { what: "the block of leaf", index }),
        None => Ok(()),
    }
}
