//! Two meshes as a [`Course`].

use std::ops::ControlFlow;

use fearless_simd::Level;
use nearmiss_geometry::{PointId, Pose};
use nearmiss_hierarchy::{
    Ball, BoxVisitor, MeshHierarchy, Open, PairVisitor, Plunging, Stack, TreePair, descend,
};
use nearmiss_mesh::{TriangleDistance, triangle_distance, unit_normal};

use crate::ask::answer::{Answer, Contact, Evidence, Reason, Verdict};
use crate::ask::budget::Budget;
use crate::contact::collide::ContactScratch;
use crate::distance::{Distance, Frontier, unknown};
use crate::mesh::distance::distance;
use crate::mesh::hint::MeshHint;
use crate::mesh::mesh_pair::{EXACT, MeshPairing};
use crate::mesh::placed::PlacedMesh;
use crate::motion::course::{Course, Look};
use crate::motion::plan::SweepPlan;
use crate::pair::pairing::Pairing;

/// Two meshes that move.
pub(crate) struct MovingMeshes<'a> {
    pub(crate) meshes: [&'a MeshHierarchy; 2],
    pub(crate) level: Level,
}

impl MovingMeshes<'_> {
    fn placed(&self, poses: &[Pose; 2]) -> [PlacedMesh<'_>; 2] {
        [0, 1].map(|k| PlacedMesh::new(self.meshes[k], &poses[k]))
    }

    /// Calls `ask` with the pair at `poses`; `None` if a pose is invalid.
    fn ask<R>(
        &self,
        poses: &[Pose; 2],
        budget: &Budget,
        ask: impl FnOnce(MeshPairing<'_>) -> R,
    ) -> Option<R> {
        let (placed, views) = (self.placed(poses), self.meshes.map(MeshHierarchy::arrays));
        Some(ask(MeshPairing::new(&placed, views.each_ref(), budget, self.level)?))
    }
}

impl Course for MovingMeshes<'_> {
    const THICK: f64 = 0.0;

    fn balls(&self) -> [Ball; 2] {
        self.meshes.map(|mesh| *mesh.arrays().ball)
    }

    fn stored(&self, poses: &[Pose; 2]) -> [Pose; 2] {
        self.placed(poses).map(|placed| *placed.stored_to_world())
    }

    fn at<L: Look>(&self, poses: &[Pose; 2], budget: &Budget, look: L) -> Option<L::Found> {
        self.ask(poses, budget, |pair| {
            let pose = pair.stored;
            look.look(pair, &pose)
        })
    }

    fn distance(
        &self,
        poses: &[Pose; 2],
        _: &SweepPlan,
        budget: &Budget,
        nearest: &mut [usize; 2],
        (open, _): (&mut Frontier, &mut ContactScratch),
    ) -> Distance {
        let mut hint = MeshHint { nearest: Some(nearest.map(nearmiss_lanes::id32)), ..MeshHint::default() };
        let found =
            self.ask(poses, budget, |mut pair| (pair.band(), distance(&mut pair, open, Some(&mut hint))));
        *nearest = hint.nearest.map_or(*nearest, |found| found.map(|i| i as usize));
        let Some((band, found)) = found else { return unknown([[0.0; 3]; 2], [PointId(0); 2]) };
        Distance {
            lower: found.lower,
            band,
            upper: found.upper,
            points: found.points,
            sources: found.triangles.map(PointId),
            evidence: Evidence::Certified,
            complete: found.complete,
            statistics: found.statistics,
        }
    }

    fn touches(
        &self,
        poses: &[Pose; 2],
        plan: &SweepPlan,
        budget: &Budget,
        scratch: &mut ContactScratch,
    ) -> Answer {
        let stack = &mut scratch.frontiers.stack;
        let answer = self.ask(poses, budget, |pair| Within::search(pair, plan.options().clearance, stack));
        answer.unwrap_or(Answer { verdict: Verdict::Undecided(Reason::Pose), ..Answer::UNASKED })
    }
}

/// A search for two triangles that are at most `most` apart.
struct Within<'a> {
    pair: MeshPairing<'a>,
    /// In the world, as the next.
    most: f64,
    /// A lower bound of the distance of all triangles that were compared.
    apart: f64,
    found: Option<(TriangleDistance, [usize; 2])>,
}

impl<'a> Within<'a> {
    fn search(pair: MeshPairing<'a>, most: f64, stack: &mut Stack) -> Answer {
        let (relative, level, band) = (pair.relative, pair.level, pair.band());
        let mut search = Self { apart: f64::INFINITY, pair, most, found: None };
        stack.clear();
        let flow = if search.pair.gap > most {
            search.apart = search.pair.gap;
            ControlFlow::Continue(())
        } else {
            #[expect(clippy::cast_possible_truncation, reason = "rounded up")]
            let reach = (most / search.pair.to_world() * (1.0 + 1e-6)) as f32 + relative.slack();
            let trees = TreePair { reach, ..search.pair.trees(&relative) };
            descend(trees, level, &mut Plunging::new(stack), &mut search)
        };
        let verdict = match search.found {
            Some((distance, triangles)) => {
                let contact = search.contact(distance, triangles);
                Verdict::Intersecting { contact, evidence: Evidence::Certified }
            }
            None if flow.is_break() => Verdict::Undecided(Reason::Budget { likelihood: 0.5 }),
            None => Verdict::Separated { gap: search.apart.max(most), evidence: Evidence::Certified },
        };
        Answer { verdict, band, distance_estimate: None, statistics: search.pair.meter.spent }
    }

    /// The contact midway between two triangles.
    fn contact(
        &self,
        TriangleDistance { points, distance }: TriangleDistance,
        triangles: [usize; 2],
    ) -> Contact {
        if let Some(contact) = self.pair.contact(triangles) {
            return Contact::from(&contact);
        }
        let pose = self.pair.meshes[0].pose();
        let [p, q] = points.map(|p| pose.apply(p));
        let corners = self.pair.corners(triangles);
        Contact {
            point: [0, 1, 2].map(|k| 0.5 * p[k] + 0.5 * q[k]),
            normals: Some(corners.map(|corners| pose.rotate(unit_normal(&corners).unwrap_or_default()))),
            residual: 0.5 * pose.scale() * distance,
            sources: [PointId(self.pair.a.source[triangles[0]]), PointId(self.pair.b.source[triangles[1]])],
        }
    }
}

impl PairVisitor for Within<'_> {
    #[inline]
    fn compared(&mut self, pairs: u32) -> ControlFlow<()> {
        self.pair.meter.spent.node_pairs += u64::from(pairs);
        self.pair.meter.go_on()
    }

    fn leaf_pair(&mut self, leaves: [usize; 2], _: &Open) -> ControlFlow<()> {
        let (bounds, lanes, to_world) =
            (self.pair.least_distances(leaves), self.pair.lanes(leaves), self.pair.to_world());
        let _all = MeshPairing::by_bound(leaves, (&bounds, lanes), |bound, triangles| {
            let bound = f64::from(bound) * to_world * (1.0 - 1e-9);
            if bound > self.most {
                self.apart = self.apart.min(bound);
                return ControlFlow::Break(());
            }
            self.pair.meter.leaf_work(EXACT);
            let [a, b] = self.pair.corners(triangles);
            let found = triangle_distance(&a, &b);
            let distance = found.distance * self.pair.meshes[0].pose().scale();
            if distance <= self.most {
                self.found = Some((found, triangles));
                return ControlFlow::Break(());
            }
            self.apart = self.apart.min(distance);
            ControlFlow::Continue(())
        });
        if self.found.is_some() { ControlFlow::Break(()) } else { self.pair.meter.go_on() }
    }
}

impl BoxVisitor for Within<'_> {
    const NOTES_GAPS: bool = true;

    #[inline]
    fn least_apart(&mut self, least: f32) {
        let least = f64::from(least - self.pair.relative.slack()) * self.pair.to_world() * (1.0 - 1e-6);
        self.apart = self.apart.min(least);
    }
}
