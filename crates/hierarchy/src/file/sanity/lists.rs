//! Validation of blocks, the balls around them, and neighbour lists: a corrupt list silently
//! changes f.

use nearmiss_index::{Level, PointBlock};

use crate::point::gather::NeighbourList;
use crate::point::neighbours::MOST_LISTED;
use crate::scan::build::PointHierarchy;
use nearmiss_store::Flaw;

/// Checks that every list is within the entries, and not so long that an evaluation would take too
/// much time.
fn check_ranges(lists: &[NeighbourList], listed: usize) -> Result<(), Flaw> {
    let is_there = |list: &NeighbourList| {
        let (first, count) = (list.first as usize, list.count as usize);
        count <= MOST_LISTED && first <= listed && count <= listed - first && list.within.is_finite()
    };
    Flaw::first("the neighbour list of block", lists.iter().position(|list| !is_there(list)))
}

/// Checks that blocks repeat the points, which are already validated, that balls contain the
/// support of their blocks, and that lists ascend and contain valid groups.
pub(super) fn check(scan: &PointHierarchy) -> Result<(), Flaw> {
    check_ranges(&scan.arrays.lists, scan.arrays.listed.len())?;
    let blocks = scan.plan.blocks(scan.positions(), &scan.arrays.radii);
    let differs = blocks.zip(&scan.arrays.blocks).position(|(expected, found)| expected != *found);
    Flaw::first("the copy of the points of block", differs)?;
    let left_out = scan.arrays.blocks.iter().enumerate().position(|(number, block)| {
        let group = &scan.arrays.groups[number / PointBlock::WIDTH];
        let lane = number % PointBlock::WIDTH;
        let ([cx, cy, cz], radius) = (group.position.map(|c| c[lane]), group.support_radius[lane]);
        let PointBlock { position: [x, y, z], support_radius, .. } = block;
        let mut held = [0_u32; PointBlock::WIDTH];
        for i in 0..PointBlock::WIDTH {
            let (dx, dy, dz) = (x[i] - cx, y[i] - cy, z[i] - cz);
            let room = radius - support_radius[i];
            // Unused lanes have no support.
            let empty = support_radius[i] <= 0.0;
            let within = (room >= 0.0) & (dx * dx + dy * dy + dz * dz <= room * room);
            held[i] = u32::from(empty | within);
        }
        !(radius.is_finite() && held.iter().all(|&held| held != 0))
    });
    Flaw::first("the bounding ball of block", left_out)?;
    let count = scan.arrays.groups.len();
    let wrong = scan.arrays.lists.iter().position(|list| {
        let entries =
            scan.arrays.listed.get(list.first as usize..).and_then(|rest| rest.get(..list.count as usize));
        let ascend = |entries: &[u32]| {
            entries.windows(2).all(|two| two[0] < two[1])
                && entries.last().is_none_or(|&b| (b as usize) < count)
        };
        !entries.is_some_and(ascend)
    });
    Flaw::first("the neighbour list of block", wrong)
}

/// Checks that no list misses a group with support where the list claims to be complete.
pub(super) fn check_complete(scan: &PointHierarchy) -> Result<(), Flaw> {
    let mut found = Vec::new();
    let incomplete = (0..scan.arrays.blocks.len()).position(|block| {
        let index = scan.index();
        let (Some((within, list)), Some([cx, cy, cz])) = (scan.neighbours(block), index.middle(block)) else {
            return false;
        };
        index.collect(Level::new(), [cx, cy, cz], within, &mut found);
        let has_support = |PointBlock { position: [x, y, z], support_radius, .. }: &PointBlock| {
            (0..PointBlock::WIDTH).any(|i| {
                let d = [x[i] - cx, y[i] - cy, z[i] - cz];
                d.map(|d| f64::from(d).powi(2)).iter().sum::<f64>().sqrt()
                    < f64::from(support_radius[i] + within)
            })
        };
        let blocks = |group: u32| {
            let first = group as usize * PointBlock::WIDTH;
            &scan.arrays.blocks[first..(first + PointBlock::WIDTH).min(scan.arrays.blocks.len())]
        };
        found
            .iter()
            .any(|&group| list.binary_search(&group).is_err() && blocks(group).iter().any(has_support))
    });
    Flaw::first("the neighbour list of block", incomplete)
}
