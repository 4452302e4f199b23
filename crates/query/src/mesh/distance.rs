//! The distance of two meshes: branch and bound, nearest pair of nodes first.

use std::ops::ControlFlow;

use nearmiss_hierarchy::{NodePair, Open, PairVisitor, Part, resume};
use nearmiss_mesh::triangle_distance;
use serde::{Deserialize, Serialize};

use crate::ask::answer::Statistics;
use crate::distance::{Frontier, Nearness};
use crate::mesh::hint::MeshHint;
use crate::mesh::mesh_pair::{EXACT, MeshPairing};
use crate::pair::bounds::{BoundVisitor, Bounds};
use crate::pair::relative_pose::{Limits, RelativePose};

/// The distance of two meshes, in world units: lower ≤ distance ≤ upper.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MeshDistance {
    /// A proven lower bound. Equals the upper bound once the search is complete.
    pub lower: f64,
    /// The distance of the two [points](Self::points). Infinite if a pose is invalid.
    pub upper: f64,
    /// A point of each mesh at distance [`Self::upper`]. Both are the same if the meshes meet.
    pub points: [[f64; 3]; 2],
    /// The triangles of these points, as the caller numbered them.
    pub triangles: [u32; 2],
    /// `true` if the search ended before the budget did.
    pub complete: bool,
    /// The cost of the query.
    pub statistics: Statistics,
}

/// The nearest triangles so far.
#[derive(Debug, Clone, Copy)]
struct Nearest {
    /// The distance in the world.
    distance: f64,
    /// Points in the frame of a's input.
    points: [[f64; 3]; 2],
    triangles: [usize; 2],
}

struct Search<'s, 'a> {
    pair: &'s mut MeshPairing<'a>,
    relative_pose: &'s RelativePose,
    best: Nearest,
    /// Pairs whose boxes exceed the distance of the centres by this much cannot improve the best.
    limit: f32,
}

impl Search<'_, '_> {
    /// Computes the distance of two triangles and keeps it if it is the least so far.
    fn compare(&mut self, triangles: [usize; 2]) {
        self.pair.meter.leaf_work(EXACT);
        let [a, b] = self.pair.corners(triangles);
        let found = triangle_distance(&a, &b);
        let distance = found.distance * self.pair.meshes[0].pose().scale();
        if distance < self.best.distance {
            self.best = Nearest { distance, points: found.points, triangles };
            self.limit = self.relative_pose.beyond(self.relative_pose.bound_of(distance));
        }
    }
}

impl PairVisitor<Nearness> for Search<'_, '_> {
    #[inline]
    fn compared(&mut self, pairs: u32) -> ControlFlow<()> {
        self.pair.meter.spent.node_pairs += u64::from(pairs);
        self.pair.meter.go_on()
    }

    #[inline]
    fn is_wanted(&mut self, open: &Open<Nearness>) -> bool {
        open.key.enclosures() < self.limit
    }

    fn leaf_pair(&mut self, leaves: [usize; 2], _: &Open<Nearness>) -> ControlFlow<()> {
        let bounds = self.pair.least_distances(leaves);
        let to_world = self.pair.meshes[0].stored_to_world().scale();
        let lanes = self.pair.lanes(leaves);
        let _all = MeshPairing::by_bound(leaves, (&bounds, lanes), |bound, triangles| {
            if f64::from(bound) * to_world * (1.0 - 1e-9) >= self.best.distance {
                return ControlFlow::Break(());
            }
            self.compare(triangles);
            ControlFlow::Continue(())
        });
        if self.best.distance == 0.0 {
            return ControlFlow::Break(());
        }
        self.pair.meter.go_on()
    }
}

impl BoundVisitor<Nearness> for Search<'_, '_> {
    #[inline]
    fn limits(&self) -> Limits {
        Limits { boxes: self.limit, enclosures: f32::NEG_INFINITY }
    }

    #[inline(always)]
    fn key(&mut self, above: &Open<Nearness>, _: NodePair, boxes: f32, _: f32) -> Option<Nearness> {
        // A pair is no nearer than its parents.
        let boxes = boxes.max(above.key.enclosures());
        Some(Nearness::new(boxes, boxes))
    }
}

/// Bounds the distance of two meshes, from the nearest triangles of the last query if `hint` is given.
pub(crate) fn distance(
    pair: &mut MeshPairing<'_>,
    open: &mut Frontier,
    hint: Option<&mut MeshHint>,
) -> MeshDistance {
    let relative_pose = pair.relative_pose();
    let (trees, level) = ([&pair.a.tree, &pair.b.tree], pair.level);
    let best = Nearest { distance: f64::INFINITY, points: [[0.0; 3]; 2], triangles: [0; 2] };
    let mut search = Search { pair, relative_pose: &relative_pose, best, limit: f32::INFINITY };
    let known = hint.as_ref().and_then(|hint| hint.nearest).map(|hint| hint.map(|i| i as usize));
    let counts = [search.pair.a.triangles.len(), search.pair.b.triangles.len()];
    search.compare(known.filter(|known| known[0] < counts[0] && known[1] < counts[1]).unwrap_or_default());

    let least = relative_pose.least();
    open.start(Nearness::new(least, least));
    let bounds = Bounds { trees, relative_pose: &relative_pose, part: Part::Surface };
    let mut flow = search.pair.meter.go_on();
    if flow.is_continue() && search.best.distance > 0.0 {
        flow = resume(&bounds, level, open, &mut search);
    }
    let complete = flow.is_continue() || search.best.distance == 0.0;
    let Nearest { distance: upper, points, triangles } = search.best;
    let lower = if complete {
        upper
    } else {
        let least = open.iter().fold(search.limit, |least, key| least.min(key.enclosures()));
        relative_pose.proven(relative_pose.bound(least)).min(upper)
    };
    if let Some(hint) = hint {
        hint.nearest = Some(triangles.map(nearmiss_lanes::id32));
        let scale = search.pair.meshes[0].stored_to_world().scale();
        hint.clear = search.pair.clearance(lower * (1.0 - 1e-9) / scale);
    }
    let pose = search.pair.meshes[0].pose();
    MeshDistance {
        lower,
        upper,
        points: points.map(|p| pose.apply(p)),
        triangles: [search.pair.a.source[triangles[0]], search.pair.b.source[triangles[1]]],
        complete,
        statistics: search.pair.meter.spent,
    }
}
