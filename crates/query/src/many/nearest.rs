//! The two bodies of a world that are nearest to each other.

use nearmiss_geometry::Aabb;

use crate::distance::DistancePlan;
use crate::many::body::{BodyDistance, PlacedBody};
use crate::many::world::{Bodies, BodyId, World};
use crate::mesh::prepared::PreparedMesh;
use crate::pair::prepared::Prepared;
use crate::question::Scratch;
use crate::solid::as_shape::AsShape;

/// The two bodies that are nearest to each other, and bounds of the least distance of all pairs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NearestPair {
    /// The two bodies, the smaller id first.
    pub ids: [BodyId; 2],
    /// A point of each of them, [`Self::upper`] apart.
    pub points: [[f64; 3]; 2],
    /// A proven lower bound of the distance of any two bodies that count, at most `reach`: pairs that are
    /// further apart may not have been compared.
    pub lower: f64,
    /// The distance of these two bodies, from above: no other pair was found nearer.
    pub upper: f64,
}

impl<S: Prepared, M: PreparedMesh, H: AsShape> World<S, M, H> {
    /// Finds the two bodies that are nearest to each other, of those whose bounding boxes come within
    /// `reach`, which may be infinite. The boxes of scans include the balls of
    /// [`Semantics::Thickened`](crate::Semantics::Thickened). `counts` leaves pairs out, such as
    /// neighbouring links of a robot. `None` if no pair counts.
    ///
    /// Pairs are compared in the order of the gaps between their boxes, until a gap exceeds the least
    /// distance. Pairs with an invalid pose or shape are left out, as their distance is unknown. `plan` is
    /// that of [`BodyPair::distance`](crate::BodyPair::distance).
    ///
    /// ```
    /// use nearmiss_geometry::{PointCloud, Pose};
    /// use nearmiss_hierarchy::{BuildOptions, PointHierarchy};
    /// use nearmiss_query::{Bodies, DistanceOptions, DistancePlan, Scratch, World};
    ///
    /// let points: Vec<[f32; 3]> =
    ///     (0..2500_u16).map(|i| [f32::from(i % 50) * 0.02, f32::from(i / 50) * 0.02, 0.0]).collect();
    /// let plate = PointHierarchy::build(&PointCloud::from_positions(&points)?, &BuildOptions::default())?;
    /// let mut world = World::new();
    /// let ids = [0.0, 0.5, 0.7].map(|z| world.insert(&plate, &Pose::from_translation([0.0, 0.0, z])));
    ///
    /// let plan = DistancePlan::new(&DistanceOptions::default(), &plate, &plate)?;
    /// let (all, scratch) = (Bodies::All, &mut Scratch::default());
    /// let ask = |counts: fn(_, _) -> bool, scratch: &mut Scratch| {
    ///     world.nearest_pair(all, f64::INFINITY, counts, &plan, scratch)
    /// };
    /// let nearest = ask(|_, _| true, scratch).expect("three pairs");
    /// assert_eq!(nearest.ids, [ids[1], ids[2]]);
    /// assert!(nearest.lower > 0.15 && (nearest.upper - 0.2).abs() < 1e-3);
    /// assert_eq!(ask(|_, _| false, scratch), None);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn nearest_pair(
        &self,
        bodies: Bodies<'_>,
        reach: f64,
        mut counts: impl FnMut(BodyId, BodyId) -> bool,
        plan: &DistancePlan,
        scratch: &mut Scratch,
    ) -> Option<NearestPair> {
        let radius = plan.options().semantics.growth();
        // The boxes of the broad phase do not contain the balls about points.
        let thickness = |pair: [BodyId; 2]| -> f64 {
            pair.map(|id| if let Some(PlacedBody::Scan(_)) = self.body(id) { radius } else { 0.0 })
                .iter()
                .sum()
        };
        let mut pairs = Vec::new();
        let reach_of = |a, b| counts(a, b).then(|| reach + thickness([a, b]));
        self.near_pairs_by(bodies, reach + 2.0 * radius, reach_of, &mut pairs);
        let gap_of = |pair: [BodyId; 2]| ((self.gap(pair) - thickness(pair)).max(0.0), pair);
        let mut pairs: Vec<(f64, [BodyId; 2])> = pairs.into_iter().map(gap_of).collect();
        pairs.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut best: Option<NearestPair> = None;
        for (gap, ids) in pairs {
            if best.is_some_and(|best| gap > best.upper) {
                break;
            }
            let found = self.body_pair(ids).and_then(|pair| pair.distance(plan, scratch));
            let Some(BodyDistance { lower, upper, points }) = found else { continue };
            let lower = best.map_or(lower, |best| best.lower.min(lower));
            best = Some(match best {
                Some(best) if best.upper <= upper => NearestPair { lower, ..best },
                _ => NearestPair { ids, points, lower, upper },
            });
        }
        best.map(|best| NearestPair { lower: best.lower.min(reach.max(0.0)), ..best })
    }

    /// Returns the distance of the bounding boxes of two bodies: a lower bound of theirs. 0 for bodies
    /// without.
    fn gap(&self, [a, b]: [BodyId; 2]) -> f64 {
        let (Some(a), Some(b)) = (self.bounds(a), self.bounds(b)) else { return 0.0 };
        let beyond = |k: usize, a: &Aabb, b: &Aabb| (a.min[k] - b.max[k]).max(b.min[k] - a.max[k]).max(0.0);
        let squared: f64 = (0..3).map(|k| beyond(k, &a, &b).powi(2)).sum();
        // Less than rounding could take away.
        squared.sqrt() * (1.0 - 1e-4)
    }
}
