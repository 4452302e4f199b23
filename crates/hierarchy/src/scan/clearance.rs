//! A grid of lower bounds of the distance from the obstacle, and of near leaves. Most questions whether a
//! small shape touches a scan are answered by one of its cells, or by the leaf of that cell.

use std::ops::Range;

use nearmiss_geometry::NodeId;
use nearmiss_index::Cubes;
use nearmiss_lanes::parallel::ranges_with;
use nearmiss_lanes::vector::dot;

use crate::bounds::boxes::OrientedBox;
use crate::bounds::part::Part;
use crate::scan::arrays::ScanArrays;
use crate::tree::wide::Tree;

/// The least edge of a cell, in sampling radii.
const EDGE: f64 = 2.0;

/// The greatest clearance of a cell, in edges. The grid continues as far about the obstacle.
const MOST: f64 = 1.5;

/// The maximum number of cells for each point.
const CELLS_A_POINT: f64 = 2.0;

/// The maximum number of comparisons of a leaf and a cell, for each point.
const COMPARED: f64 = 64.0;

/// Steps of a stored clearance.
const STEPS: f64 = 255.0;

/// Rounding of distances in single precision, relative to all coordinates.
const ROUNDING: f64 = 8e-6;

/// Parts of the grid that threads work on.
const SHARE: usize = 16;

/// The entry of a cell without a near leaf. The root of a tree with inner nodes is not a leaf, and in a
/// tree of one leaf nothing is saved by naming it.
const NONE: NodeId = NodeId::ROOT;

/// A grid with the *clearance* of each cell, a lower bound of the distance of its centre from the obstacle,
/// and a leaf that is near.
#[derive(Debug, Clone)]
pub struct ClearanceGrid {
    cubes: Cubes,
    /// The clearances in steps.
    clearances: Vec<u8>,
    leaves: Vec<NodeId>,
    step: f64,
}

impl ClearanceGrid {
    /// Builds the grid of a scan from the enclosures of its leaves. `None` if one of these is unbounded, or
    /// if many are near many cells. O(n).
    #[must_use]
    pub fn new(scan: &ScanArrays<'_>) -> Option<Self> {
        #[expect(clippy::cast_precision_loss, reason = "a count")]
        let points = scan.radii.len() as f64;
        let tree = &scan.tree;
        let bounds = tree.enclosure(Part::Obstacle, NodeId::ROOT).upright();
        if !bounds.iter().flatten().all(|c| c.is_finite()) {
            return None;
        }
        let least = EDGE * f64::from(scan.sampling_radius);
        let cubes = Cubes::new(bounds, MOST, (least, CELLS_A_POINT * points));
        let edge = cubes.edge();
        let most = MOST * edge;
        let far = bounds.iter().flatten().fold(edge, |far, c| far.max(c.abs()));
        let build = Build { tree, cubes: &cubes, most, lost: ROUNDING * (far + 2.0 * edge) };
        let compared: f64 = (0..tree.topology.leaves())
            .map(|number| {
                let [min, max] = tree.enclosure(Part::Obstacle, tree.topology.leaf(number)).upright();
                (0..3).map(|k| (max[k] - min[k] + 2.0 * most) / edge + 1.0).product::<f64>()
            })
            .sum();
        if compared.is_nan() || compared > COMPARED * points.max(1e3) {
            return None;
        }
        let slabs = cubes.size()[0];
        let parts = ranges_with(slabs, slabs.div_ceil(SHARE), || (), |(), range| build.slabs(&range));
        let count = cubes.count();
        let (mut clearances, mut leaves) = (Vec::with_capacity(count), Vec::with_capacity(count));
        for part in parts {
            clearances.extend(part.0);
            leaves.extend(part.1);
        }
        Some(Self { cubes, clearances, leaves, step: most / STEPS })
    }

    /// Returns a lower bound of the distance of a place from the obstacle. Zero, or less, if the obstacle
    /// may be there. O(1).
    #[inline]
    #[must_use]
    pub fn clearance(&self, place: [f64; 3]) -> f64 {
        match self.cubes.about(place) {
            Some((cell, off_sq)) => {
                f64::from(self.clearances[cell]) * self.step - off_sq.sqrt() * (1.0 + 1e-9)
            }
            // The grid continues this far beyond the obstacle.
            None if place.iter().all(|c| c.is_finite()) => STEPS * self.step * (1.0 - 1e-9),
            None => f64::NEG_INFINITY,
        }
    }

    /// Returns a leaf that is near a place, if there is one: of those whose enclosures are nearest to the
    /// centre of the cell, that with the nearest centre. O(1).
    #[inline]
    #[must_use]
    pub fn leaf(&self, place: [f64; 3]) -> Option<NodeId> {
        let cell = self.cubes.at(place)?;
        Some(self.leaves[cell]).filter(|&leaf| leaf != NONE)
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

/// The nearest leaf of a cell, of those that were compared with it.
#[derive(Debug, Clone, Copy)]
struct Nearest {
    /// The squared distance from the enclosure.
    square: f32,
    /// The squared distance from its centre.
    centre_sq: f32,
    leaf: NodeId,
}

impl Build<'_> {
    /// The clearances and leaves of the cells in some slabs along the first axis.
    #[expect(clippy::cast_possible_truncation, reason = "rounding is counted in `lost`")]
    fn slabs(&self, slabs: &Range<usize>) -> (Vec<u8>, Vec<NodeId>) {
        let Self { tree, cubes, most, lost } = self;
        let [_, ys, zs] = cubes.size();
        let first = slabs.start * ys * zs;
        let far = (most + 2.0 * lost) as f32;
        let nothing = Nearest { square: far * far, centre_sq: f32::INFINITY, leaf: NONE };
        let mut cells = vec![nothing; slabs.len() * ys * zs];
        for number in 0..tree.topology.leaves() {
            let leaf = tree.topology.leaf(number);
            let bounds = tree.enclosure(Part::Obstacle, leaf);
            let Some([xs, ys, zs]) = self.near(&bounds, slabs) else { continue };
            let centre = bounds.centre.map(f64::from);
            for (x, y) in xs.flat_map(|x| ys.clone().map(move |y| (x, y))) {
                let row = cubes.number([x, y, zs.start]) - first;
                let start = cubes.centre(row + first);
                let mut away = [0, 1, 2].map(|k| (start[k] - centre[k]) as f32);
                let mut height = start[2] - centre[2];
                for cell in &mut cells[row..row + zs.len()] {
                    away[2] = height as f32;
                    let own = Nearest::new(&bounds, away, leaf);
                    if own.is_nearer_than(cell) {
                        *cell = own;
                    }
                    height += cubes.edge();
                }
            }
        }
        let steps = STEPS / most;
        #[expect(clippy::cast_sign_loss, reason = "rounded down, saturates")]
        let stored = |cell: &Nearest| ((f64::from(cell.square.sqrt()) - lost) * steps * (1.0 - 1e-9)) as u8;
        (cells.iter().map(stored).collect(), cells.iter().map(|cell| cell.leaf).collect())
    }

    /// The cells, within some slabs, whose centres may be near a box, along each axis; `None` if there are
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

impl Nearest {
    /// A leaf with this enclosure, and a place that is `away` from the centre of it.
    fn new(bounds: &OrientedBox, away: [f32; 3], leaf: NodeId) -> Self {
        let mut square = 0.0;
        for k in 0..3 {
            let beyond = (dot(away, bounds.axes[k]).abs() - bounds.half[k]).max(0.0);
            square += beyond * beyond;
        }
        Self { square, centre_sq: dot(away, away), leaf }
    }

    fn is_nearer_than(&self, other: &Self) -> bool {
        self.square < other.square || self.square == other.square && self.centre_sq < other.centre_sq
    }
}

#[cfg(test)]
mod tests {
    use nearmiss_geometry::PointCloud;
    use nearmiss_testdata::arbitrary::{CloudKind, cloud, point_in, rng};

    use super::*;
    use crate::{BuildOptions, PointHierarchy};

    /// The clearance of a random place is at most the distance from the enclosures of all leaves, and the
    /// leaf of its cell is the nearest one.
    #[test]
    fn clearances_are_bounds_and_leaves_are_near() {
        let rng = &mut rng(9401);
        let (mut free, mut built, mut lost) = (0, 0, 0.0);
        for kind in CloudKind::ALL {
            let points = cloud(kind, 900, 7);
            let Ok(cloud) = PointCloud::from_positions(&points) else { continue };
            let Ok(scan) = PointHierarchy::build(&cloud, &BuildOptions::default()) else { continue };
            let arrays = scan.arrays();
            let Some(grid) = ClearanceGrid::new(&arrays) else { continue };
            built += 1;
            let topology = arrays.tree.topology;
            let leaves: Vec<NodeId> = (0..topology.leaves()).map(|n| topology.leaf(n)).collect();
            let distance = |place: [f64; 3], leaf: NodeId| {
                let bounds = arrays.tree.enclosure(Part::Obstacle, leaf);
                let away = [0, 1, 2].map(|k| place[k] - f64::from(bounds.centre[k]));
                let beyond =
                    bounds.axes.map(|axis| (0..3).map(|k| away[k] * f64::from(axis[k])).sum::<f64>().abs());
                let square: f64 =
                    (0..3).map(|k| (beyond[k] - f64::from(bounds.half[k])).max(0.0).powi(2)).sum();
                square.sqrt()
            };
            let root = scan.root_box();
            let half = 1.5 * f64::from(root.radius());
            for _ in 0..2000 {
                let place = [0, 1, 2].map(|k| f64::from(root.centre[k]) + point_in(rng, half)[k]);
                let nearest =
                    |place| leaves.iter().map(|&leaf| distance(place, leaf)).fold(f64::INFINITY, f64::min);
                let (told, exact) = (grid.clearance(place), nearest(place));
                assert!(told <= exact + 1e-9 * half, "{kind:?}: {place:?} has {told}, not {exact}");
                if told > 0.0 && exact < grid.cubes.edge() {
                    free += 1;
                    lost += (exact - told) / grid.cubes.edge();
                }
                if let Some(leaf) = grid.leaf(place) {
                    let centre = grid.cubes.centre(grid.cubes.at(place).expect("in the grid"));
                    let off = distance(centre, leaf) - nearest(centre);
                    assert!(off <= 1e-5 * half, "{kind:?}: {leaf:?} at {place:?}");
                }
            }
        }
        println!("{built} grids, {free} places, {:.3} edges lost on average", lost / f64::from(free));
        assert!(
            built >= 8 && free > 1000 && lost < 0.6 * f64::from(free),
            "{built} grids, {free} places, {lost}"
        );
    }
}
