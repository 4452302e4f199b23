//! A grid that lists the groups of boxes near each cell. Searches near small bodies start at those groups
//! instead of at the root.

use std::ops::ControlFlow;

use fearless_simd::{Level, Simd, dispatch, f32x16};
use nearmiss_lanes::id32;
use nearmiss_lanes::parallel::ranges_with;
use nearmiss_lanes::wide::WIDTH;

use super::Boxes;
use super::bodies::BoxBody;
use super::cut::{BoxQuery, BoxTree};
use super::walk::{NearWalker, Stack};
use crate::cubes::Cubes;

/// The distance, in edges, up to which a cell lists groups.
const MARGIN: f64 = 1.0;

/// The maximum number of groups that a cell lists; with more, a search starts at the root.
const MOST: usize = 32;

/// Rounding of distances in single precision, relative to all coordinates.
const ROUNDING: f64 = 8e-6;

/// Cells that a thread takes at once.
const AT_ONCE: usize = 1024;

/// A grid that lists, for each cell, the groups of a [`BoxTree`] that are near; on surfaces about three. See
/// [`Self::near`].
#[derive(Debug, Clone)]
pub struct BoxGrid {
    cubes: Cubes,
    /// Every box within this distance of a place in a cell is in a group that the cell lists.
    margin: f64,
    /// The end of the list before each cell, and of the last.
    ends: Vec<usize>,
    groups: Vec<Start>,
    /// The cells with too many groups to list.
    crowded: Vec<bool>,
}

/// A group at which searches start.
#[derive(Debug, Clone, Copy)]
struct Start {
    group: u32,
    /// A lower bound on the distance of its boxes from the centre of the cell.
    distance: f32,
}

/// The groups at which a search starts, from [`BoxGrid::near`].
#[derive(Debug, Clone, Copy)]
pub struct BoxStarts<'a> {
    /// The furthest first.
    groups: &'a [Start],
    /// By how much the distances may exceed those from the body.
    beyond: f32,
}

impl BoxStarts<'_> {
    /// Returns `true` if nothing is near.
    #[inline]
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.groups.is_empty()
    }

    /// The groups, each with a lower bound on its squared distance from the body.
    #[inline(always)]
    pub(super) fn all(&self) -> impl Iterator<Item = (f32, u32)> {
        self.groups.iter().map(|start| {
            let least = (start.distance - self.beyond).max(0.0);
            (least * least, start.group)
        })
    }
}

impl BoxTree {
    /// Builds the grid of a tree with at most `cells` cells, whose edges are at least `edge` long. `None` if
    /// the tree is empty or a box is unbounded. O(n) for the leaves of surfaces.
    #[must_use]
    pub fn cells(&self, level: Level, edge: f64, cells: f64) -> Option<BoxGrid> {
        let [min, max] = self.bounds()?;
        let cubes = Cubes::new([min, max], MARGIN, (edge, cells));
        let edge = cubes.edge();
        let far = (0..3).fold(edge, |far, k| far.max(min[k].abs()).max(max[k].abs()));
        let lost = ROUNDING * (far + 2.0 * edge);
        // Half the diagonal of a cell, a little more.
        let most = MARGIN * edge + 0.867 * edge + lost;
        #[expect(clippy::cast_possible_truncation, reason = "counted in `lost`")]
        let (most, single) = ((most as f32).next_up(), (lost as f32).next_up());
        let lists = ranges_with(
            cubes.count(),
            AT_ONCE,
            || (),
            |(), range| {
                let (mut ends, mut all, mut crowded) = (Vec::new(), Vec::new(), Vec::new());
                for cell in range {
                    let first = all.len();
                    #[expect(clippy::cast_possible_truncation, reason = "counted in `lost`")]
                    let centre = cubes.centre(cell).map(|c| c as f32);
                    let body = BoxBody::new(centre, [[0.0; 3]; 3], [0.0; 3], false);
                    let most_sq = (most * most).next_up();
                    let mut search =
                        Listing { tree: self, body, most_sq, lost: single, found: &mut all, first };
                    dispatch!(level, simd => simd.vectorize(
                        #[inline(always)]
                        || {
                            let (groups, mut stack) = (self.groups(), Stack::new());
                            // The walker never breaks.
                            let _whole = groups.walk_near(simd, groups.root(), &mut stack, &mut search);
                        },
                    ));
                    let own = &mut all[first..];
                    own.sort_unstable_by(|a, b| {
                        b.distance.total_cmp(&a.distance).then(b.group.cmp(&a.group))
                    });
                    crowded.push(own.len() > MOST);
                    if own.len() > MOST {
                        all.truncate(first);
                    }
                    ends.push(all.len());
                }
                (ends, all, crowded)
            },
        );
        let margin = MARGIN * edge - 2.0 * lost;
        let mut grid = BoxGrid { cubes, margin, ends: vec![0], groups: Vec::new(), crowded: Vec::new() };
        for (ends, groups, crowded) in lists {
            let before = grid.groups.len();
            grid.ends.extend(ends.into_iter().map(|end| before + end));
            grid.groups.extend(groups);
            grid.crowded.extend(crowded);
        }
        Some(grid)
    }
}

impl BoxGrid {
    /// Returns the groups that hold every box within `core` + `reach` of `place`, for a body within `core` of
    /// that. `None` if the grid cannot tell, because that exceeds about the edge of a cell or too many boxes
    /// are there. O(1).
    #[inline]
    #[must_use]
    pub fn near(&self, place: [f64; 3], core: f64, reach: f64) -> Option<BoxStarts<'_>> {
        let all = core + reach;
        if all.is_nan() || all > self.margin {
            return None;
        }
        let none = BoxStarts { groups: &[], beyond: 0.0 };
        let Some((cell, off_sq)) = self.cubes.about(place) else { return Some(none) };
        if self.crowded[cell] {
            return None;
        }
        let groups = &self.groups[self.ends[cell]..self.ends[cell + 1]];
        let off = off_sq.sqrt();
        #[expect(clippy::cast_possible_truncation, reason = "rounded up")]
        let [within, beyond] = [off + all, off + core].map(|x| ((x * (1.0 + 1e-6)) as f32).next_up());
        let further = groups.iter().take_while(|start| start.distance > within).count();
        Some(BoxStarts { groups: &groups[further..], beyond })
    }
}

/// The search for the groups near the centre of a cell.
struct Listing<'s> {
    tree: &'s BoxTree,
    body: BoxBody,
    most_sq: f32,
    /// The rounding error of a distance.
    lost: f32,
    /// The groups of all cells, those of this one from number `first` on.
    found: &'s mut Vec<Start>,
    first: usize,
}

impl<S: Simd> NearWalker<S> for Listing<'_> {
    #[inline(always)]
    fn distances_sq(&self, simd: S, group: (usize, usize), boxes: &Boxes) -> f32x16<S> {
        self.body.distances_sq(simd, self.tree, (group, boxes), self.most_sq)
    }

    #[inline(always)]
    fn most_sq(&self) -> f32 {
        self.most_sq
    }

    /// The boxes of a group are visited one after the other, the nearest one first.
    #[inline(always)]
    fn block(&mut self, _: S, id: usize, least_sq: f32) -> ControlFlow<()> {
        let group = id32(id / WIDTH);
        if self.found[self.first..].last().is_none_or(|last| last.group != group) {
            self.found.push(Start { group, distance: (least_sq.sqrt() - self.lost).max(0.0) });
        }
        ControlFlow::Continue(())
    }
}
