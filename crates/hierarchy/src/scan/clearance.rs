//! A grid of lower bounds of the distance from the obstacle, and of what is near. Most questions whether a
//! small shape touches a scan are answered by one of its places, or by the point that is named there.

mod brick;
mod direction;
mod page;
#[cfg(test)]
mod tests;

use std::ops::{ControlFlow, Range};
use std::sync::OnceLock;

use fearless_simd::prelude::*;
use fearless_simd::{Level, dispatch};
use nearmiss_geometry::NodeId;
use nearmiss_index::Cubes;
use nearmiss_lanes::id32;
use nearmiss_lanes::parallel::{map_with, ranges_with};
use nearmiss_lanes::vector::{dot, sub};

use crate::bounds::boxes::OrientedBox;
use crate::bounds::part::Part;
use crate::descent::PlaceVisitor;
use crate::scan::arrays::ScanArrays;
use crate::scan::clearance::brick::Brick;
use crate::scan::clearance::page::{Entry, Near, Page, Reach};
use crate::tree::wide::Tree;

/// The edge of a cube, in sampling radii, if the block of cubes has its least edge.
const EDGE: f64 = 2.0;

/// The greatest clearance of a block, in edges of the block. The grid continues as far about the obstacle.
const MOST_OF_BLOCK: f64 = 1.5;

/// The greatest clearance of a cube, in edges.
const MOST_OF_CUBE: f64 = 1.5;

/// The clearance of the centre of a cube below which the cube has a brick, in edges: half the diagonal, and
/// a little more than half an edge.
const NEAR: f64 = 1.466;

/// The greatest distance in a brick, in edges.
const MOST_IN_BRICK: f64 = 1.25;

/// The step to another place whose distances tell most about a place, in edges: somewhat more than half the
/// distance of the places of a brick, beyond which the greatest distance in a brick is soon reached.
const BEYOND: f64 = 0.4;

/// The distance from the centre of a cube up to which its brick lists leaves, in edges.
const LISTED: f64 = 1.35;

/// The maximum number of blocks for each point.
const BLOCKS_A_POINT: f64 = 1.0;

/// The maximum number of comparisons of a leaf and a block, for each point.
const COMPARED: f64 = 64.0;

/// The number of places along each edge of a cube, and of a block.
#[expect(clippy::cast_possible_truncation, reason = "3 and 12")]
const IN_CUBE: u32 = brick::SIDE as u32;
#[expect(clippy::cast_possible_truncation, reason = "3 and 12")]
const IN_BLOCK: u32 = IN_CUBE * page::SIDE as u32;

/// Steps of a stored distance.
const STEPS: f64 = 255.0;

/// Rounding of distances in single precision, relative to all coordinates.
const ROUNDING: f64 = 8e-6;

/// The leaf of a block without one.
const NO_LEAF: u32 = u32::MAX;

/// The mark of a block without a page. The lower bits are its clearance in steps.
const COARSE: u32 = 1 << 31;

/// Parts of the grid that threads work on.
const SHARE: usize = 16;

/// Lower bounds of the distance of each place from the obstacle, and what is near.
///
/// Space is cut into blocks. A block near the obstacle is cut into 64 cubes, whose edges are about two
/// sampling radii, and each of these that is nearer into 27 places. The content of a block is computed when
/// it is first asked about, in about 0.1 ms where points are spread evenly, and kept.
#[derive(Debug, Clone)]
pub struct ClearanceGrid {
    blocks: Cubes,
    /// For each block the number of its page, or its clearance.
    entries: Vec<u32>,
    /// A leaf that is near each block.
    nearest: Vec<u32>,
    /// The pages, and the blocks that they are of.
    pages: Vec<(OnceLock<Page>, u32)>,
    /// The enclosures of the leaves.
    leaves: Vec<OrientedBox>,
    /// The lengths of steps in blocks, cubes and bricks, and of lists.
    steps: [f64; 4],
    reach: Reach,
    /// The rounding error of a distance.
    lost: f64,
    level: Level,
}

/// A place in a [`ClearanceGrid`]: what is near it.
///
/// Distances are lower bounds, at most zero where the parts may be.
#[derive(Debug, Clone, Copy)]
pub struct Clearance<'a> {
    /// The distance from all discs with their thickness, and from all balls.
    pub discs: f64,
    /// The distance from the volumes that contain the obstacle.
    pub obstacle: f64,
    /// The cube, the number of the place in it that is looked up, and the vector from there.
    place: Option<(&'a Brick, usize, [f64; 3])>,
}

impl Clearance<'_> {
    /// The same distance from everything.
    #[inline(always)]
    const fn coarse(bound: f64) -> Self {
        Self { discs: bound, obstacle: bound, place: None }
    }

    /// Returns the leaf, and the number in it, of the point whose disc, without its thickness, or ball is
    /// nearest to a place close by. `None` if it is not near, or not in one of the leaves that are listed.
    #[inline]
    #[must_use]
    pub fn nearest(&self) -> Option<(usize, usize)> {
        let (brick, place, _) = self.place?;
        brick.nearest(place)
    }

    /// Returns about the greatest distance that the nearest disc or ball may have, in whatever direction.
    #[inline(always)]
    #[must_use]
    pub fn farthest(&self) -> f64 {
        self.place.map_or(f64::INFINITY, |(_, _, away)| self.discs + 2.0 * length(away))
    }

    /// Returns the direction, to within a few degrees, to the place from the disc or ball that is nearest,
    /// and an estimate of the distance from that. `None` as for [`Self::nearest`].
    #[inline(always)]
    #[must_use]
    pub fn direction(&self) -> Option<([f64; 3], f64)> {
        let (brick, place, away) = self.place?;
        let direction = brick.direction(place)?.map(f64::from);
        let along: f64 = (0..3).map(|k| direction[k] * away[k]).sum();
        Some((direction, self.discs + length(away) + along))
    }
}

impl ClearanceGrid {
    /// Builds the grid of a scan. `None` if the enclosure of a leaf is unbounded, or if many are near many
    /// blocks. O(n).
    #[must_use]
    pub fn new(scan: &ScanArrays<'_>, level: Level) -> Option<Self> {
        #[expect(clippy::cast_precision_loss, reason = "a count")]
        let points = scan.radii.len() as f64;
        let tree = &scan.tree;
        let bounds = tree.enclosure(Part::Obstacle, NodeId::ROOT).upright();
        if !bounds.iter().flatten().all(|c| c.is_finite()) {
            return None;
        }
        #[expect(clippy::cast_precision_loss, reason = "small")]
        let side = page::SIDE as f64;
        let least = side * EDGE * f64::from(scan.sampling_radius);
        let blocks = Cubes::new(bounds, MOST_OF_BLOCK, (least, BLOCKS_A_POINT * points));
        let edge = blocks.edge();
        let most = MOST_OF_BLOCK * edge;
        let far = bounds.iter().flatten().fold(edge, |far, c| far.max(c.abs()));
        let lost = ROUNDING * (far + 2.0 * edge);
        let build = Build { tree, cubes: &blocks, most, lost };
        let compared: f64 = (0..tree.topology.leaves())
            .map(|number| {
                let [min, max] = tree.enclosure(Part::Obstacle, tree.topology.leaf(number)).upright();
                (0..3).map(|k| (max[k] - min[k] + 2.0 * most) / edge + 1.0).product::<f64>()
            })
            .sum();
        if compared.is_nan() || compared > COMPARED * points.max(1e3) {
            return None;
        }
        let slabs = blocks.size()[0];
        let parts = ranges_with(slabs, slabs.div_ceil(SHARE), || (), |(), range| build.slabs(&range));
        let mut entries: Vec<u32> = Vec::with_capacity(blocks.count());
        entries.extend(parts.iter().flatten().map(|near| COARSE | u32::from(near.0)));
        let mut nearest: Vec<u32> = parts.into_iter().flatten().map(|near| near.1).collect();
        spread(blocks.size(), &mut nearest);
        let cube = edge / side;
        let steps = [
            most / STEPS,
            MOST_OF_CUBE * cube / page::STEPS,
            MOST_IN_BRICK * cube / STEPS,
            LISTED * cube / STEPS,
        ];
        let beside = 0.867 * edge + MOST_OF_CUBE * cube;
        let is_near = |entry: u32| f64::from(entry & !COARSE) * steps[0] < beside;
        let near: Vec<usize> = (0..entries.len()).filter(|&block| is_near(entries[block])).collect();
        #[expect(clippy::cast_possible_truncation, reason = "counted in `lost`")]
        let single = |edges: f64| (edges * cube) as f32;
        #[expect(clippy::cast_possible_truncation, reason = "an error")]
        let reach = Reach {
            edge: cube,
            most: single(MOST_OF_CUBE),
            near: single(NEAR),
            in_brick: single(MOST_IN_BRICK),
            listed: single(LISTED),
            lost: lost as f32,
        };
        let mut pages = Vec::with_capacity(near.len());
        for block in near {
            entries[block] = id32(pages.len());
            pages.push((OnceLock::new(), id32(block)));
        }
        let enclosure = |number| tree.enclosure(Part::Obstacle, tree.topology.leaf(number));
        let leaves = (0..tree.topology.leaves()).map(enclosure).collect();
        Some(Self { blocks, entries, nearest, pages, leaves, steps, reach, lost, level })
    }

    /// Computes the content of all blocks, with all threads. `scan` must be that of the grid, as in
    /// [`Self::at`].
    pub fn complete(&self, scan: &ScanArrays<'_>) {
        map_with(self.pages.len(), Near::default, |near, i| {
            self.page(scan, i, near);
        });
    }

    fn page(&self, scan: &ScanArrays<'_>, number: usize, near: &mut Near) -> &Page {
        let (page, block) = &self.pages[number];
        page.get_or_init(|| {
            let (middle, half) = (self.blocks.centre(*block as usize), 0.5 * self.blocks.edge());
            page::page((scan, &self.reach, self.level), middle.map(|c| c - half), near)
        })
    }

    #[cold]
    fn first_page(&self, scan: &ScanArrays<'_>, number: usize) -> &Page {
        self.page(scan, number, &mut Near::default())
    }

    /// Returns what the grid of `scan` tells about a place. The content of a block, which tells of distances
    /// up to about three sampling radii, is left out for a greater `reach`. O(1).
    #[inline]
    #[must_use]
    pub fn at(&self, scan: &ScanArrays<'_>, place: [f64; 3], reach: f64) -> Clearance<'_> {
        self.beside(scan, place, [0.0; 3], reach)
    }

    /// Returns the same about a place that is `away` from the `other` one, by what the grid knows at the
    /// other one.
    ///
    /// The grid knows distances at some places. Between two of these a distance is least certain if the
    /// nearest part is behind one of them. From beyond the place, seen from that part, more is certain.
    #[inline(always)]
    #[must_use]
    pub fn beside(
        &self,
        scan: &ScanArrays<'_>,
        other: [f64; 3],
        away: [f64; 3],
        reach: f64,
    ) -> Clearance<'_> {
        let [of_block, of_cube, of_place, _] = self.steps;
        let Some((part, within)) = self.blocks.locate_part(other, IN_BLOCK) else {
            // The grid continues this far beyond the obstacle.
            let is_place = other.iter().all(|c| c.is_finite());
            return Clearance::coarse(if is_place {
                STEPS * of_block * (1.0 - 1e-9) - length(away)
            } else {
                f64::NEG_INFINITY
            });
        };
        let place_edge = self.blocks.edge() * (1.0 / f64::from(IN_BLOCK));
        // The distance from the centre of the block or the cube, which has as many places along each axis.
        let off = |places: u32| {
            length([0, 1, 2].map(|k| {
                (f64::from(part[k] % places) + within[k] - 0.5 * f64::from(places)) * place_edge + away[k]
            }))
        };
        let entry = self.entries[self.blocks.number(part.map(|own| (own / IN_BLOCK) as usize))];
        if entry & COARSE != 0 {
            return Clearance::coarse(f64::from(entry & !COARSE) * of_block - off(IN_BLOCK));
        }
        if reach > of_cube * page::STEPS {
            return Clearance::coarse(0.0);
        }
        let number = entry as usize;
        let page = self.pages[number].0.get().unwrap_or_else(|| self.first_page(scan, number));
        let [x, y, z] = part.map(|own| (own / IN_CUBE) as usize % page::SIDE);
        let brick = match page.at((x * page::SIDE + y) * page::SIDE + z) {
            Entry::Steps(steps) => return Clearance::coarse(f64::from(steps) * of_cube - off(IN_CUBE)),
            Entry::Brick(brick) => brick,
        };
        let [x, y, z] = part.map(|own| (own % IN_CUBE) as usize);
        let number = (x * brick::SIDE + y) * brick::SIDE + z;
        let away = [0, 1, 2].map(|k| (within[k] - 0.5) * place_edge + away[k]);
        let off = length(away);
        let [discs, obstacle] = brick.distances(number).map(|steps| f64::from(steps) * of_place - off);
        Clearance { discs, obstacle, place: Some((brick, number, away)) }
    }

    /// Returns the number of a leaf that is about as near to a place as any other; `None` outside the grid.
    #[inline]
    #[must_use]
    pub fn leaf(&self, place: [f64; 3]) -> Option<usize> {
        let leaf = self.nearest[self.blocks.at(place)?];
        (leaf != NO_LEAF).then_some(leaf as usize)
    }

    /// Visits all leaves whose enclosures are within `most` of `place`, of which the grid told `clearance`,
    /// until `visitor` ends the search. `None` if the grid does not list all of these leaves, because `most`
    /// exceeds about one sampling radius.
    #[inline]
    pub fn visit_near<V: PlaceVisitor>(
        &self,
        level: Level,
        (clearance, place): (&Clearance<'_>, [f64; 3]),
        most: f64,
        visitor: &mut V,
    ) -> Option<ControlFlow<()>> {
        let (brick, number, away) = clearance.place?;
        let (side, place_edge) = (brick::SIDE, self.edge() / brick::SIDE as f64);
        let numbers = [number / (side * side), number / side % side, number % side];
        #[expect(clippy::cast_precision_loss, reason = "small")]
        let from_middle = numbers.map(|own| own as f64 + 0.5 - 0.5 * side as f64);
        let from_centre = [0, 1, 2].map(|k| from_middle[k] * place_edge + away[k]);
        let listed = f64::from(brick.listed) * self.steps[3] - length(from_centre);
        if most.is_nan() || most > listed {
            return None;
        }
        #[expect(clippy::cast_possible_truncation, reason = "counted in `lost`")]
        let (place, most) = (place.map(|c| c as f32), ((most + self.lost) as f32).next_up());
        let most_sq = (most * most).next_up();
        Some(dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || {
                for &leaf in brick.leaves() {
                    let bounds = &self.leaves[leaf as usize];
                    if distance_sq(bounds, sub(place, bounds.centre)) <= most_sq {
                        visitor.leaf(simd, leaf as usize)?;
                    }
                }
                ControlFlow::Continue(())
            },
        )))
    }

    /// Returns how far from a place, seen from what is nearest, [`Self::beside`] tells most about whether
    /// something is `within` a distance of the place. Not positive if it tells nothing.
    #[inline(always)]
    #[must_use]
    pub fn step_beyond(&self, within: f64) -> f64 {
        (BEYOND * self.edge()).min(STEPS * self.steps[2] - within)
    }

    /// Returns the edge of a cube.
    #[must_use]
    pub fn edge(&self) -> f64 {
        self.blocks.edge() / page::SIDE as f64
    }
}

/// The length of a vector, rounded up.
#[inline(always)]
fn length([x, y, z]: [f64; 3]) -> f64 {
    (x * x + y * y + z * z).sqrt() * (1.0 + 1e-9)
}

/// Gives each block without a leaf that of a block beside it, breadth first.
fn spread([xs, ys, zs]: [usize; 3], nearest: &mut [u32]) {
    let mut front: Vec<usize> = (0..nearest.len()).filter(|&block| nearest[block] != NO_LEAF).collect();
    while !front.is_empty() {
        let mut next = Vec::new();
        for block in front {
            let [x, y, z] = [block / (ys * zs), block / zs % ys, block % zs];
            for (at, size, step) in [(x, xs, ys * zs), (y, ys, zs), (z, zs, 1)] {
                for beside in [(at > 0).then(|| block - step), (at + 1 < size).then(|| block + step)] {
                    let Some(beside) = beside.filter(|&beside| nearest[beside] == NO_LEAF) else { continue };
                    nearest[beside] = nearest[block];
                    next.push(beside);
                }
            }
        }
        front = next;
    }
}

/// The data that building takes.
struct Build<'s> {
    tree: &'s Tree<'s>,
    cubes: &'s Cubes,
    /// The greatest clearance.
    most: f64,
    /// The rounding error of a distance.
    lost: f64,
}

impl Build<'_> {
    /// The clearances of the blocks in some slabs along the first axis, in steps, and the leaves whose
    /// enclosures are nearest to their centres.
    #[expect(clippy::cast_possible_truncation, reason = "rounding is counted in `lost`")]
    fn slabs(&self, slabs: &Range<usize>) -> Vec<(u8, u32)> {
        let Self { tree, cubes, most, lost } = self;
        let [_, ys, zs] = cubes.size();
        let first = slabs.start * ys * zs;
        let far = (most + 2.0 * lost) as f32;
        let mut nearest = vec![(far * far, NO_LEAF); slabs.len() * ys * zs];
        for number in 0..tree.topology.leaves() {
            let bounds = tree.enclosure(Part::Obstacle, tree.topology.leaf(number));
            let Some([xs, ys, zs]) = self.near(&bounds, slabs) else { continue };
            let centre = bounds.centre.map(f64::from);
            for (x, y) in xs.flat_map(|x| ys.clone().map(move |y| (x, y))) {
                let row = cubes.number([x, y, zs.start]) - first;
                let start = cubes.centre(row + first);
                let mut away = [0, 1, 2].map(|k| (start[k] - centre[k]) as f32);
                let mut height = start[2] - centre[2];
                for own in &mut nearest[row..row + zs.len()] {
                    away[2] = height as f32;
                    let square = distance_sq(&bounds, away);
                    if square < own.0 {
                        *own = (square, id32(number));
                    }
                    height += cubes.edge();
                }
            }
        }
        let steps = STEPS / most;
        #[expect(clippy::cast_sign_loss, reason = "rounded down, saturates")]
        let stored = |square: f32| ((f64::from(square.sqrt()) - lost) * steps * (1.0 - 1e-9)) as u8;
        nearest.into_iter().map(|(square, leaf)| (stored(square), leaf)).collect()
    }

    /// The cubes, within some slabs, whose centres may be near a box, along each axis; `None` if there are
    /// none.
    fn near(&self, bounds: &OrientedBox, slabs: &Range<usize>) -> Option<[Range<usize>; 3]> {
        let (size, within) = (self.cubes.size(), self.most + 2.0 * self.lost);
        let [min, max] = bounds.upright();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
        let range = |k: usize| {
            let low = self.cubes.along(k, min[k] - within) - 0.5;
            let high = self.cubes.along(k, max[k] + within) - 0.5;
            let (from, to) = (low.ceil() as usize, ((high.floor() + 1.0) as usize).min(size[k]));
            if k == 0 { from.max(slabs.start)..to.min(slabs.end) } else { from..to }
        };
        let ranges = [range(0), range(1), range(2)];
        ranges.iter().all(|range| range.start < range.end).then_some(ranges)
    }
}

#[inline(always)]
/// The squared distance of a place from a box from whose centre it is `away`.
fn distance_sq(bounds: &OrientedBox, away: [f32; 3]) -> f32 {
    let mut square = 0.0;
    for k in 0..3 {
        let beyond = (dot(away, bounds.axes[k]).abs() - bounds.half[k]).max(0.0);
        square += beyond * beyond;
    }
    square
}
