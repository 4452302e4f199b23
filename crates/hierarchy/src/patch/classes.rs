//! Which points sample a sheet, and which stand for themselves as balls (`docs/theory/obstacle.md`).
//!
//! The fit at a point gives its class. A vote of its neighbours then corrects single flips: a noisy point in
//! the plane of the sheet about it belongs to that sheet, and a plane fitted to a few points of a blob is
//! none. Sparse points come last in the order of the points and have a subtree of their own, so that a stray
//! never widens the bounds of a wall. Noisy points have others all around them: they stay among these.

use std::ops::Range;

use fearless_simd::Level;
use nearmiss_index::{BlockTree, Nearest, PointBlock};
use nearmiss_lanes::id32;
use nearmiss_lanes::parallel::in_order;
use nearmiss_lanes::vector::{dot, sub};
use nearmiss_store::{Room, WorkError, Workspace};

use crate::patch::surfels::Fit;
use crate::point::kind::{PointKind, SLAB};
use crate::tree::split::Item;

const WIDTH: usize = PointBlock::WIDTH;

/// Neighbours that vote.
const VOTERS: usize = 8;

/// So many of them, of about one normal, make a noisy point one of their sheet: half.
const MAJORITY: usize = VOTERS / 2;

/// A sheet point with fewer sheet points of about its normal among its neighbours is noisy: one may be a
/// chance.
const ALONE: usize = 2;

/// The cosine of the angle between the normals of neighbours on a sheet is no less. On a sphere of the
/// greatest curvature that a slab holds they differ by 40° at most.
const AGREEING: f32 = 0.5;

/// Corrects the classes of single points by those of their neighbours. O(n) where all points are on sheets.
pub(crate) fn vote(tree: &BlockTree<'_>, positions: &[[f32; 3]], radii: &[f32], fits: &mut [Fit]) {
    let (level, before) = (Level::new(), &*fits);
    let of_block = |block: usize| block * WIDTH..(block * WIDTH + WIDTH).min(positions.len());
    let in_doubt = |block: usize| before[of_block(block)].iter().any(|fit| fit.kind() == PointKind::Noisy);
    let mut changed = Vec::new();
    let correct = |blocks: Range<usize>| {
        let (mut found, mut changed) = (Nearest::default(), Vec::new());
        for block in blocks.filter(|&block| in_doubt(block)) {
            tree.nearest(level, block, VOTERS, &mut found);
            for i in of_block(block) {
                let near = found.of(i % WIDTH).take(VOTERS).map(|n| n.id as usize);
                if let Some(fit) = corrected(i, near, positions, radii, before) {
                    changed.push((id32(i), fit));
                }
            }
        }
        changed
    };
    in_order(tree.blocks().len(), correct, |some| changed.extend(some));
    for (i, fit) in changed {
        fits[i as usize] = fit;
    }
}

/// Returns `true` if neighbours with these normals may be on one sheet.
fn agree(n: [f32; 3], m: [f32; 3]) -> bool {
    dot(n, m).abs() >= AGREEING
}

/// The fit of point `i` by the vote of its neighbours, if that is another.
fn corrected(
    i: usize,
    near: impl Iterator<Item = usize>,
    positions: &[[f32; 3]],
    radii: &[f32],
    fits: &[Fit],
) -> Option<Fit> {
    let sheets = near.filter(|&j| fits[j].kind().is_sheet());
    match fits[i].kind() {
        PointKind::Noisy => {
            let height = |j: usize| dot(fits[j].normal, sub(positions[i], positions[j])).abs();
            let mut for_sheet = sheets.filter(|&j| height(j) <= SLAB * radii[i].min(radii[j]));
            // The nearest comes first.
            let normal = fits[for_sheet.next()?].normal;
            let agreeing = 1 + for_sheet.filter(|&j| agree(normal, fits[j].normal)).count();
            (agreeing >= MAJORITY).then_some(Fit::new(normal, PointKind::Sheet))
        }
        PointKind::Sheet | PointKind::Edge => {
            let agreeing = sheets.filter(|&j| agree(fits[i].normal, fits[j].normal)).count();
            (agreeing < ALONE).then_some(Fit::new(fits[i].normal, PointKind::Noisy))
        }
        _ => None,
    }
}

/// The points in their order again, the sparse ones last, and how many come before these: as many as fill
/// leaves. Points that are left over stand for themselves among the sparse ones, noisy ones before those at
/// edges and others, the last before the first. `None` if no point is sparse.
pub(crate) fn dense_first(
    positions: &[[f32; 3]],
    fits: &[Fit],
    leaf_size: usize,
    work: &Workspace,
) -> Result<Option<(Room<Item>, usize)>, WorkError> {
    const DENSE: [PointKind; 3] = [PointKind::Noisy, PointKind::Edge, PointKind::Sheet];
    let mut counts = [0; DENSE.len()];
    for fit in fits {
        if let Some(k) = DENSE.iter().position(|&kind| kind == fit.kind()) {
            counts[k] += 1;
        }
    }
    let all: usize = counts.iter().sum();
    if all == fits.len() {
        return Ok(None);
    }
    let mut over = all % leaf_size;
    let dense = all - over;
    // So many of each kind stay, the first.
    for count in &mut counts {
        let left = over.min(*count);
        (over, *count) = (over - left, *count - left);
    }
    let mut room = work.room(fits.len())?;
    let items: &mut [Item] = &mut room;
    let mut next = [0, dense];
    for (i, fit) in fits.iter().enumerate() {
        let stays = DENSE.iter().position(|&kind| kind == fit.kind()).is_some_and(|k| {
            let is_first = counts[k] > 0;
            counts[k] -= usize::from(is_first);
            is_first
        });
        let place = &mut next[usize::from(!stays)];
        items[*place] = Item { position: positions[i], index: id32(i) };
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
        let corrected = |fits: &[Fit]| corrected(0, 1..9, &positions, &radii, fits);
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
