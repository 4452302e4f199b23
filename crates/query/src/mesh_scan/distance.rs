//! Bounds on the distance of a mesh and a scan, by the search that serves two scans.

use nearmiss_geometry::PointId;
use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_mesh::{Corners, nearest_on_triangle};
use nearmiss_surface::Projection;

use crate::ask::answer::Answer;
use crate::ask::budget::Budget;
use crate::contact::collide::ContactScratch;
use crate::distance::{
    Distance, DistancePlan, Feet, Frontier, Measured, Place, ROUNDS, bound, land, step, unknown,
};
use crate::mesh::placed::PlacedMesh;
use crate::mesh_scan::collide::{AskedOfMesh, collide};
use crate::mesh_scan::hint::MeshScanHint;
use crate::mesh_scan::mesh_scan_pair::MeshScanPairing;
use crate::mesh_scan::plan::MeshScanPlan;
use crate::pair::placed::{Placed, ViewScratch};

/// Bounds the distance of a scan and a mesh, with the meaning of `plan`, within `budget`. See
/// [`MeshScanPair::distance`](crate::MeshScanPair::distance).
pub(crate) fn distance(
    (scan, mesh): (&Placed<'_>, &PlacedMesh<'_>),
    plan: &DistancePlan,
    budget: &Budget,
    (open, contact): (&mut Frontier, &mut ContactScratch),
    hint: Option<&mut MeshScanHint>,
) -> Distance {
    let (a, b) = (scan.scan().arrays(), mesh.mesh().arrays());
    let semantics = plan.options().semantics;
    let pair = MeshScanPairing::new((scan, &a), (mesh, &b), semantics, budget, contact.level);
    let Some(pair) = pair else {
        let points = [scan.point(0), mesh.pose().apply(b.corners(0)[0])];
        return unknown(points, [scan.scan().id(0), PointId(b.source[0])]);
    };
    let stored = pair.stored;
    let (points, triangles) = (scan.scan().len(), mesh.mesh().len());
    let known = hint.as_ref().and_then(|hint| hint.nearest).map(|near| near.map(|i| i as usize));
    let start = known.filter(|&[i, j]| i < points && j < triangles).unwrap_or_default();
    let (found, nearest) = bound((pair, &stored), start, plan, budget, (open, contact));
    if let Some(hint) = hint {
        hint.nearest = Some(nearest.map(nearmiss_lanes::id32));
    }
    found
}

impl Measured for MeshScanPairing<'_> {
    const THICK: f64 = 1.0;

    fn place(&self, [i, j]: [usize; 2]) -> Place {
        let foot = self.scan.stored_to_world().apply(self.apart(i, &self.corners(j)).1);
        let p = Vector3::from(self.scan.point(i));
        let (way, ball) = (Vector3::from(foot) - p, self.ball(i));
        let length = way.norm();
        let place = if length > 0.0 { p + way * (ball / length).min(1.0) } else { p };
        let band = self.band(i);
        Place { points: [place.into(), foot], sources: self.sources([i, j]), band, off: 0.5 * band }
    }

    fn touches(&self, plan: &DistancePlan, budget: &Budget, scratch: &mut ContactScratch) -> Answer {
        let plan = MeshScanPlan::touching(plan);
        collide(AskedOfMesh { scan: self.scan, mesh: self.mesh, plan: &plan, budget }, scratch, (None, None))
    }

    /// Only the point on the surface moves, towards the triangle nearest to the sample.
    fn approach(&mut self, [i, j]: [usize; 2], gathers: &mut [ViewScratch; 2]) -> Option<Feet> {
        let (scan, triangle) = (self.scan, self.world_corners(j));
        if !scan.verifies() {
            return None;
        }
        let mut foot = land(scan, i, scan.point(i), &mut gathers[0], &mut self.meter)?;
        let (mut to, mut share) = (towards(&foot, &triangle), 1.0);
        for _ in 0..ROUNDS {
            let Some(place) = step(scan, i, &foot, to, share) else { break };
            let next = land(scan, i, place, &mut gathers[0], &mut self.meter);
            let next = next.map(|next| (next, towards(&next, &triangle)));
            match next {
                Some((next, on)) if on.norm() < to.norm() => (foot, to) = (next, on),
                _ => share *= 0.5,
            }
        }
        let on_triangle = (Vector3::from(foot.point) + to).into();
        Some(Feet { points: [foot.point, on_triangle], distance: to.norm() })
    }

    fn are_obstacle(&self, [i, _]: [usize; 2], feet: &Feet) -> bool {
        self.scan.is_obstacle(i, feet.points[0])
    }
}

/// The way from a point of the surface to the nearest point of a triangle.
fn towards(foot: &Projection, triangle: &Corners) -> Vector3<f64> {
    Vector3::from(nearest_on_triangle(triangle, foot.point)) - Vector3::from(foot.point)
}
