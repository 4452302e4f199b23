//! Pages: the cubes of a part of space near the obstacle.

use std::ops::ControlFlow;

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x4, f32x16};
use nearmiss_geometry::NodeId;
use nearmiss_lanes::id32;

use crate::bounds::boxes::OrientedBox;
use crate::bounds::part::Part;
use crate::descent::PlaceVisitor;
use crate::point::leaf_block::WIDTH;
use crate::scan::arrays::ScanArrays;
use crate::scan::clearance::brick::{Brick, Item, MOST_LEAVES, Places, distances_sq, in_steps};
use crate::tree::wide::{Siblings, Tree};

/// The number of cubes along each edge of a page.
pub(crate) const SIDE: usize = 4;

/// The number of cubes of a page.
pub(crate) const CUBES: usize = SIDE * SIDE * SIDE;

const VECTORS: usize = CUBES / WIDTH;

/// The maximum number of leaves near a page. With more, which takes points that are a hundred times denser
/// there than elsewhere, nothing is computed, and the cubes tell nothing.
const MOST_LEAVES_NEAR: usize = 2048;

/// Codes of cubes below this are numbers of bricks. The others are clearances.
const BRICKS: u8 = 64;

/// The steps of a clearance.
pub(crate) const STEPS: f64 = 191.0;

/// The cubes of a block of space near the obstacle.
#[derive(Debug, Clone)]
pub(crate) struct Page {
    codes: [u8; CUBES],
    bricks: Vec<Brick>,
}

/// The entry of a cube in a page.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Entry<'a> {
    Brick(&'a Brick),
    /// The clearance in steps.
    Steps(u8),
}

impl Page {
    #[inline(always)]
    pub(crate) fn at(&self, cube: usize) -> Entry<'_> {
        let code = self.codes[cube];
        if code < BRICKS {
            Entry::Brick(&self.bricks[usize::from(code)])
        } else {
            Entry::Steps(code - BRICKS)
        }
    }
}

/// Distances of interest, in single precision.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reach {
    /// The edge of a cube.
    pub(crate) edge: f64,
    /// The greatest clearance of a cube, and that below which it has a brick.
    pub(crate) most: f32,
    pub(crate) near: f32,
    /// The greatest distance in a brick.
    pub(crate) in_brick: f32,
    /// The distance from the centre of a cube up to which leaves are listed.
    pub(crate) listed: f32,
    /// The rounding error of a distance.
    pub(crate) lost: f32,
}

/// The leaves near a page, and the distances of all cubes from their enclosures.
#[derive(Debug, Default)]
pub(crate) struct Near {
    leaves: Vec<u32>,
    bounds: Vec<OrientedBox>,
    /// The parts of the points of these leaves, with their number before each leaf, and after the last.
    items: Vec<Item>,
    ends: Vec<usize>,
    distances: Vec<[[f32; WIDTH]; VECTORS]>,
    /// The distances of the leaves near a cube, and their numbers in `leaves`.
    own: Vec<(f32, u32)>,
}

/// Builds the page with this first corner. `near` is working memory.
pub(crate) fn page(
    (scan, reach, level): (&ScanArrays<'_>, &Reach, Level),
    corner: [f64; 3],
    near: &mut Near,
) -> Page {
    dispatch!(level, simd => simd.vectorize(
        #[inline(always)]
        || near.page(simd, (scan, reach), corner),
    ))
}

impl Near {
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, clippy::cast_precision_loss, reason = "counted in `lost`")]
    fn page<S: Simd>(&mut self, simd: S, (scan, reach): (&ScanArrays<'_>, &Reach), corner: [f64; 3]) -> Page {
        let middle = corner.map(|c| (c + 0.5 * reach.edge * SIDE as f64) as f32);
        let half = (0.867 * reach.edge * (SIDE - 1) as f64) as f32;
        let within = half + reach.most.max(reach.in_brick + reach.edge as f32) + 2.0 * reach.lost;
        self.leaves.clear();
        let mut search = Collect { tree: &scan.tree, most_sq: within * within, found: &mut self.leaves };
        if scan.tree.descend_to_by(simd, middle, &mut search).is_break() {
            return Page { codes: [BRICKS; CUBES], bricks: Vec::new() };
        }
        let mut centres = [[[0.0; WIDTH]; 3]; VECTORS];
        for cube in 0..CUBES {
            let centre = centre(corner, reach.edge, cube);
            for k in 0..3 {
                centres[cube / WIDTH][k][cube % WIDTH] = centre[k] as f32;
            }
        }
        self.distances.clear();
        self.bounds.clear();
        self.items.clear();
        self.ends.clear();
        self.ends.push(0);
        let mut least = [[reach.most; WIDTH]; VECTORS];
        for &leaf in &self.leaves {
            let bounds = scan.tree.enclosure(Part::Obstacle, scan.tree.topology.leaf(leaf as usize));
            let mut all = [[0.0; WIDTH]; VECTORS];
            for vector in 0..VECTORS {
                let own = distances_sq(simd, &bounds, &centres[vector]).sqrt();
                own.store_array(&mut all[vector]);
                own.min(f32x16::load_array_ref(simd, &least[vector])).store_array(&mut least[vector]);
            }
            self.distances.push(all);
            self.bounds.push(bounds);
            self.items.extend(scan.leaves.points(leaf as usize).map(|i| Item::new(scan, i)));
            self.ends.push(self.items.len());
        }
        let near = |clearance: f32| clearance < reach.near;
        let count = least.as_flattened().iter().filter(|&&clearance| near(clearance)).count();
        let mut page = Page { codes: [0; CUBES], bricks: Vec::with_capacity(count) };
        for (cube, code) in page.codes.iter_mut().enumerate() {
            let clearance = least[cube / WIDTH][cube % WIDTH];
            if near(clearance) {
                #[expect(clippy::cast_possible_truncation, reason = "below 64")]
                let number = page.bricks.len() as u8;
                *code = number;
                page.bricks.push(self.brick(simd, reach, (cube, centre(corner, reach.edge, cube))));
            } else {
                *code = BRICKS + in_steps(clearance, (reach.most, STEPS as f32), reach.lost);
            }
        }
        page
    }

    /// The brick of a cube with this centre.
    #[inline(always)]
    fn brick<S: Simd>(&mut self, simd: S, reach: &Reach, (cube, centre): (usize, [f64; 3])) -> Brick {
        let mut places = Places::new(centre, reach.edge, (reach.in_brick, reach.lost));
        let most = places.within().max(reach.listed);
        self.own.clear();
        for (near, all) in self.distances.iter().enumerate() {
            let distance = all[cube / WIDTH][cube % WIDTH];
            if distance <= most {
                self.own.push((distance, id32(near)));
            }
        }
        self.own.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        for (slot, &(distance, near)) in self.own.iter().enumerate() {
            if distance > places.within() {
                break;
            }
            let near = near as usize;
            if places.may_be_near(simd, &self.bounds[near]) {
                places.compare(simd, self.items_of(near), slot);
            }
        }
        let listed = self.own.get(MOST_LEAVES).map_or(reach.listed, |own| own.0.min(reach.listed));
        let leaves = self.own.iter().map(|own| own.1 as usize);
        let leaves = leaves.map(|near| (self.leaves[near], self.items_of(near)));
        places.brick(leaves, (listed, reach.listed))
    }

    /// The parts of the points of a leaf.
    #[inline(always)]
    fn items_of(&self, near: usize) -> &[Item] {
        &self.items[self.ends[near]..self.ends[near + 1]]
    }
}

/// The centre of a cube of the page with this first corner.
#[expect(clippy::cast_precision_loss, reason = "small numbers")]
fn centre(corner: [f64; 3], edge: f64, cube: usize) -> [f64; 3] {
    let steps = [cube / (SIDE * SIDE), cube / SIDE % SIDE, cube % SIDE];
    [0, 1, 2].map(|k| corner[k] + edge * (steps[k] as f64 + 0.5))
}

/// The search for all leaves within a distance of a place. Ends early if there are too many.
struct Collect<'s, 'a> {
    tree: &'s Tree<'a>,
    most_sq: f32,
    found: &'s mut Vec<u32>,
}

impl PlaceVisitor for Collect<'_, '_> {
    const IN_ORDER: bool = true;

    #[inline(always)]
    fn most_sq(&self) -> f32 {
        self.most_sq
    }

    #[inline(always)]
    fn distances_sq<S: Simd>(&self, simd: S, node: NodeId, _: &Siblings, place: [f32; 3]) -> f32x4<S> {
        self.tree.bounds_of_children(simd, Part::Obstacle, node).distances_sq(simd, place)
    }

    #[inline(always)]
    fn leaf<S: Simd>(&mut self, _: S, number: usize) -> ControlFlow<()> {
        self.found.push(id32(number));
        if self.found.len() > MOST_LEAVES_NEAR { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}
