//! A grid that lists the lowest inner nodes near each cell. Descents towards small shapes start at
//! those nodes instead of at the root.

use std::ops::ControlFlow;

use fearless_simd::{Level, Simd, f32x4};
use nearmiss_geometry::NodeId;
use nearmiss_index::Cubes;
use nearmiss_lanes::id32;
use nearmiss_lanes::parallel::ranges_with;

use crate::bounds::boxes::OrientedBox;
use crate::bounds::part::Part;
use crate::descent::single::PlaceVisitor;
use crate::descent::starts::{MOST_STARTS, Plate, Start, Starts};
use crate::tree::wide::{Siblings, Tree};

/// The least edge of a cell, in sampling radii.
const EDGE: f64 = 4.0;

/// The distance, in edges, up to which a cell lists nodes.
const MARGIN: f64 = 1.0;

/// The maximum number of cells for each point.
const CELLS_A_POINT: f64 = 1.0;

/// Rounding of distances in single precision, relative to all coordinates.
const ROUNDING: f64 = 8e-6;

/// Cells that a thread takes at once.
const AT_ONCE: usize = 1024;

/// A grid that lists, for each cell, the lowest inner nodes of a [`Tree`] whose enclosures of the
/// obstacle are near; on surfaces about six. See [`Self::near`].
#[derive(Debug, Clone)]
pub struct NodeGrid {
    cubes: Cubes,
    /// Every node within this distance of a place in a cell is below a node that the cell lists.
    margin: f64,
    /// The end of the list before each cell, and of the last.
    ends: Vec<usize>,
    nodes: Vec<Start>,
    /// The plates of the lowest inner nodes, and the first of these.
    plates: Vec<Plate>,
    first: u32,
    /// The rounding error of a distance.
    lost: f64,
}

impl NodeGrid {
    /// Builds the grid of a tree over `points` points with this sampling radius. `None` if some
    /// enclosure is unbounded. O(n) for surfaces.
    #[must_use]
    pub fn new(tree: &Tree<'_>, sampling_radius: f64, points: usize, level: Level) -> Option<Self> {
        let root = tree.enclosure(Part::Obstacle, NodeId::ROOT);
        let [min, max] = root.upright();
        if !min.iter().chain(&max).all(|c| c.is_finite()) {
            return None;
        }
        #[expect(clippy::cast_precision_loss, reason = "a count")]
        let most = CELLS_A_POINT * points as f64;
        let cubes = Cubes::new([min, max], MARGIN, (EDGE * sampling_radius, most));
        let edge = cubes.edge();
        let far = (0..3).fold(edge, |far, k| far.max(min[k].abs()).max(max[k].abs()));
        let lost = ROUNDING * (far + 2.0 * edge);
        let margin = MARGIN * edge - 2.0 * lost;
        // Half the diagonal of a cell, a little more.
        let beyond = MARGIN * edge + 0.867 * edge;
        #[expect(clippy::cast_possible_truncation, reason = "counted in `lost`")]
        let (most, single) = (((beyond + lost) as f32).next_up(), (lost as f32).next_up());
        let most_sq = (most * most).next_up();
        let lists = ranges_with(
            cubes.count(),
            AT_ONCE,
            || (),
            |(), range| {
                let (mut ends, mut nodes) = (Vec::new(), Vec::new());
                for cell in range {
                    let first = nodes.len();
                    let mut search = Search { tree, most_sq, lost: single, found: &mut nodes };
                    #[expect(clippy::cast_possible_truncation, reason = "counted in `lost`")]
                    let place = cubes.centre(cell).map(|c| c as f32);
                    // The visitor never breaks.
                    let _whole = tree.descend_to(level, place, &mut search);
                    let own = &mut nodes[first..];
                    own.sort_unstable_by(|a, b| {
                        b.distance.total_cmp(&a.distance).then(b.node.0.cmp(&a.node.0))
                    });
                    if own.len() > MOST_STARTS {
                        nodes.truncate(first);
                        nodes.extend_from_slice(Starts::ROOT.nodes);
                    }
                    ends.push(nodes.len());
                }
                (ends, nodes)
            },
        );
        let lowest = tree.topology.first_bottom()..tree.topology.inner();
        let first = id32(lowest.start);
        let plates = lowest.map(|i| plate(&tree.enclosure(Part::Obstacle, NodeId(id32(i))))).collect();
        let mut grid = Self { cubes, margin, ends: vec![0], nodes: Vec::new(), plates, first, lost };
        for (ends, nodes) in lists {
            let before = grid.nodes.len();
            grid.ends.extend(ends.into_iter().map(|end| before + end));
            grid.nodes.extend(nodes);
        }
        Some(grid)
    }

    /// Returns nodes that contain every leaf whose enclosure of the obstacle is within `core` + `reach`
    /// of `place`; their distances are at least those from a core within `core` of it. `None` if the
    /// grid cannot tell, because that exceeds about four sampling radii. O(1).
    #[inline]
    #[must_use]
    pub fn near(&self, place: [f64; 3], core: f64, reach: f64) -> Option<Starts<'_>> {
        let all = core + reach;
        if all.is_nan() || all > self.margin {
            return None;
        }
        let Some((cell, off_sq)) = self.cubes.about(place) else { return Some(Starts::NONE) };
        let nodes = &self.nodes[self.ends[cell]..self.ends[cell + 1]];
        if nodes.is_empty() {
            return Some(Starts::NONE);
        }
        let off = off_sq.sqrt();
        #[expect(clippy::cast_possible_truncation, reason = "rounded up")]
        let [within, beyond] = [off + all, off + core].map(|x| ((x * (1.0 + 1e-6)) as f32).next_up());
        #[expect(clippy::cast_possible_truncation, reason = "counted in `lost`")]
        let (single, most) = (place.map(|c| c as f32), ((all + self.lost) as f32).next_up());
        let further = nodes.iter().take_while(|start| start.distance > within).count();
        Some(Starts {
            nodes: &nodes[further..],
            beyond,
            plates: (&self.plates, self.first),
            place: single,
            most,
        })
    }
}

/// Returns the plate of an enclosure.
fn plate(bounds: &OrientedBox) -> Plate {
    let OrientedBox { centre, half, axes, .. } = *bounds;
    let thinnest = if half[1] <= half[2] { 1 } else { 2 };
    let thinnest = if half[0] <= half[thinnest] { 0 } else { thinnest };
    Plate { centre, radius: bounds.radius(), normal: axes[thinnest], half: half[thinnest] }
}

/// The search for the nodes of a cell.
struct Search<'s, 'a> {
    tree: &'s Tree<'a>,
    most_sq: f32,
    /// The rounding error of a distance.
    lost: f32,
    found: &'s mut Vec<Start>,
}

impl PlaceVisitor for Search<'_, '_> {
    #[inline(always)]
    fn most_sq(&self) -> f32 {
        self.most_sq
    }

    #[inline(always)]
    fn distances_sq<S: Simd>(&self, simd: S, node: NodeId, _: &Siblings, place: [f32; 3]) -> f32x4<S> {
        self.tree.bounds_of_children(simd, Part::Obstacle, node).distances_sq(simd, place)
    }

    fn is_wanted(&mut self, node: NodeId, least_sq: f32) -> bool {
        let topology = self.tree.topology;
        let is_lowest =
            |node| topology.is_leaf(node) || topology.is_leaf(NodeId(topology.children(node).first));
        if least_sq <= self.most_sq && is_lowest(node) {
            self.found.push(Start { node, distance: (least_sq.sqrt() - self.lost).max(0.0) });
            return false;
        }
        least_sq <= self.most_sq
    }

    fn leaf<S: Simd>(&mut self, _: S, _: usize) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}
