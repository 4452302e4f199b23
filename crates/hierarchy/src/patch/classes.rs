//! Classification of points: some sample a sheet, the others are balls in the obstacle
//! (`docs/theory/obstacle.md`).
//!
//! The fit at a point gives its class. A vote of its neighbours then corrects single errors: a
//! noisy point in the plane of the surrounding sheet belongs to that sheet, and a plane fitted to a
//! few points of a blob is not a sheet. Sparse points come last in the order of the points and have
//! their own subtree, so that a stray point never enlarges the bounds of a wall. Noisy points stay
//! among the points around them.

use std::ops::Range;

use fearless_simd::Level;
use nearmiss_index::{BlockTree, Nearest, PointBlock};
use nearmiss_lanes::id32;
use nearmiss_lanes::parallel::in_order;
use nearmiss_lanes::vector::{dot, sub};
use nearmiss_store::{Room, WorkError, Workspace};

use crate::patch::surfels::Fit;
use crate::point::kind::{PointKind, SLAB};
use crate::tree::items::Item;

const WIDTH: usize = PointBlock::WIDTH;

/// The number of neighbours that vote.
const VOTERS: usize = 8;

/// A noisy point joins a sheet if at least this many voters, half of all, are on it with similar
/// normals.
const MAJORITY: usize = VOTERS / 2;

/// A sheet point is noisy if fewer than this many of its neighbours are sheet points with a similar
/// normal: one can be a coincidence.
const ALONE: usize = 2;

/// The least cosine of the angle between the normals of neighbours on one sheet. On a sphere of the
/// greatest curvature that fits a slab they differ by 40° at most.
const AGREEING: f32 = 0.5;

/// Corrects the classes of single points by those of their neighbours. O(n) if all points are on
/// sheets.
pub(crate) fn vote(tree: &BlockTree<'_>, positions: &[[f32; 3]], radii: &[f32], fits: &mut [Fit]) {
    let before = &*fits;
    let blocks = tree.blocks().len();
    for (i, fit) in votes(tree, positions, radii, |i| before[i], (blocks, |k| k)) {
        fits[i as usize] = fit;
    }
}

/// Returns the points of some blocks whose class their neighbours correct, with their fits after that.
/// There are `count` blocks; `block` returns the number of each. `fit` returns the fit of any point
/// before the votes.
pub(crate) fn votes(
    tree: &BlockTree<'_>,
    positions: &[[f32; 3]],
    radii: &[f32],
    fit: impl Fn(usize) -> Fit + Sync + Send,
    (count, block): (usize, impl Fn(usize) -> usize + Sync + Send),
) -> Vec<(u32, Fit)> {
    let level = Level::new();
    let of_block = |block: usize| block * WIDTH..(block * WIDTH + WIDTH).min(positions.len());
    let in_doubt = |block: &usize| of_block(*block).any(|i| fit(i).kind() == PointKind::Noisy);
    let mut changed = Vec::new();
    let correct = |found: &mut Nearest, some: Range<usize>| {
        let mut changed = Vec::new();
        for block in some.map(&block).filter(in_doubt) {
            tree.nearest(level, block, VOTERS, found);
            for i in of_block(block) {
                let near = found.of(i % WIDTH).take(VOTERS).map(|n| n.id as usize);
                let known = (|i: usize| positions[i], |i: usize| radii[i], &fit);
                if let Some(fit) = corrected(i, near, &known) {
                    changed.push((id32(i), fit));
                }
            }
        }
        changed
    };
    in_order(count, Nearest::default, correct, |some| changed.extend(some));
    changed
}

/// Returns `true` if neighbours with these normals may be on one sheet.
fn agree(n: [f32; 3], m: [f32; 3]) -> bool {
    dot(n, m).abs() >= AGREEING
}

/// Returns the fit of point `i` after the vote of its neighbours, the nearest first, if it changes.
/// The functions return the position, the radius and the fit of a point.
pub(crate) fn corrected<I: Copy>(
    i: I,
    near: impl Iterator<Item = I>,
    (position, radius, fit): &(impl Fn(I) -> [f32; 3], impl Fn(I) -> f32, impl Fn(I) -> Fit),
) -> Option<Fit> {
    let sheets = near.filter(|&j| fit(j).kind().is_sheet());
    match fit(i).kind() {
        PointKind::Noisy => {
            let height = |j: I| dot(fit(j).normal, sub(position(i), position(j))).abs();
            let mut for_sheet = sheets.filter(|&j| height(j) <= SLAB * radius(i).min(radius(j)));
            // The nearest comes first.
            let normal = fit(for_sheet.next()?).normal;
            let agreeing = 1 + for_sheet.filter(|&j| agree(normal, fit(j).normal)).count();
            (agreeing >= MAJORITY).then_some(Fit::new(normal, PointKind::Sheet))
        }
        PointKind::Sheet | PointKind::Edge => {
            let agreeing = sheets.filter(|&j| agree(fit(i).normal, fit(j).normal)).count();
            (agreeing < ALONE).then_some(Fit::new(fit(i).normal, PointKind::Noisy))
        }
        _ => None,
    }
}

/// Returns the points in their order, but with the sparse ones last, and the number of the points
/// before them. These fill whole leaves; a remainder is moved to the sparse points. It consists of
/// noisy points if there are enough, then of points at edges, then of others, and of each kind the
/// last ones are moved. Returns `None` if no point is sparse.
pub(crate) fn dense_first(
    count: usize,
    (position, kind): (impl Fn(usize) -> [f32; 3], impl Fn(usize) -> PointKind),
    leaf_size: usize,
    work: &Workspace,
) -> Result<Option<(Room<Item>, usize)>, WorkError> {
    const DENSE: [PointKind; 3] = [PointKind::Noisy, PointKind::Edge, PointKind::Sheet];
    let mut counts = [0; DENSE.len()];
    for i in 0..count {
        let kind = kind(i);
        if let Some(k) = DENSE.iter().position(|&dense| dense == kind) {
            counts[k] += 1;
        }
    }
    let all: usize = counts.iter().sum();
    if all == count {
        return Ok(None);
    }
    let mut over = all % leaf_size;
    let dense = all - over;
    // Of each kind, the first `count` stay.
    for kept in &mut counts {
        let left = over.min(*kept);
        (over, *kept) = (over - left, *kept - left);
    }
    let mut room = work.room(count)?;
    let items: &mut [Item] = &mut room;
    let mut next = [0, dense];
    for i in 0..count {
        let kind = kind(i);
        let stays = DENSE.iter().position(|&dense| dense == kind).is_some_and(|k| {
            let is_first = counts[k] > 0;
            counts[k] -= usize::from(is_first);
            is_first
        });
        let place = &mut next[usize::from(!stays)];
        items[*place] = Item { position: position(i), index: id32(i) };
        *place += 1;
    }
    Ok(Some((room, dense)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_noisy_point_at_a_corner_is_of_neither_sheet_and_one_on_a_floor_is_of_the_floor() {
        let (up, aside) = ([0.0, 0.0, 1.0], [1.0, 0.0, 0.0]);
        let fit = Fit::new;
        let floor = (1..=6).map(|i: u8| [0.1 * f32::from(i), 0.05, 0.0]);
        let wall = (1..=2).map(|i: u8| [0.0, 0.05, -0.1 * f32::from(i)]);
        let positions: Vec<_> = [[0.0; 3]].into_iter().chain(floor).chain(wall).collect();
        let radii = vec![1.0; positions.len()];
        let kinds = |sheets: usize| {
            let mut fits = vec![fit([0.7, 0.0, 0.7], PointKind::Noisy)];
            for i in 1..=6 {
                fits.push(fit(up, if i <= sheets { PointKind::Sheet } else { PointKind::Noisy }));
            }
            fits.extend([fit(aside, PointKind::Sheet); 2]);
            fits
        };
        let corrected = |fits: &[Fit]| {
            corrected(0, 1..9, &(|i: usize| positions[i], |i: usize| radii[i], |i: usize| fits[i]))
        };
        assert!(
            corrected(&kinds(2)).is_none(),
            "two of the floor and two of the wall are not four of one sheet"
        );
        let found = corrected(&kinds(4)).unwrap();
        assert_eq!((found.kind(), found.normal), (PointKind::Sheet, up));
        let mut alone = kinds(0);
        alone[0] = fit(up, PointKind::Sheet);
        assert_eq!(corrected(&alone).unwrap().kind(), PointKind::Noisy, "no neighbour has its normal");
        alone[1..=2].fill(fit(up, PointKind::Sheet));
        assert!(corrected(&alone).is_none());
    }
}
