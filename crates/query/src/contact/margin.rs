//! Contact within a margin.
//!
//! Two points nearer than the margin always meet, whatever their discs. Otherwise the distance of
//! their tangent discs decides. It is found by alternating projection, as both discs are convex
//! (Cheney & Goldstein, "Proximity maps for convex sets", Proc. AMS 10, 1959). For a witness,
//! points on both implicit surfaces move towards each other.

use std::ops::{ControlFlow, Range};

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_surface::{Projection, project};

use crate::ask::answer::Contact;
use crate::contact::search::Surfaces;
use crate::leaf::crossing::Disc;

/// Projections from one disc to the other and back. The error shrinks at least by the squared
/// cosine between the planes per round; after this many it is a fraction of the smallest useful
/// margin.
const DISC_ROUNDS: u32 = 16;

/// Steps along the surfaces; each costs about ten evaluations.
const SURFACE_ROUNDS: u32 = 4;

/// The cost of the distance of two discs, in node pairs.
const PAIRS_A_DISTANCE: u64 = 4;

/// Finds a point on each disc, at most `enough` apart, by alternating projection.
pub(crate) fn near(a: &Disc, b: &Disc, enough: f32) -> Option<[Vector3<f32>; 2]> {
    let mut x = Vector3::from(a.centre);
    let mut least = f32::INFINITY;
    for _ in 0..DISC_ROUNDS {
        let y = nearest(b, x);
        let distance = (x - y).norm();
        if distance <= enough {
            return Some([x, y]);
        }
        if distance > least * (1.0 - 1e-4) {
            return None;
        }
        least = distance;
        x = nearest(a, y);
    }
    None
}

/// The point of `disc` nearest to `p`.
fn nearest(disc: &Disc, p: Vector3<f32>) -> Vector3<f32> {
    let (centre, normal) = (Vector3::from(disc.centre), Vector3::from(disc.normal));
    let away = p - centre;
    let across = away - normal * normal.dot(&away);
    let length = across.norm();
    if length > disc.radius { centre + across * (disc.radius / length) } else { centre + across }
}

impl Surfaces<'_> {
    /// Compares the disc of point `i` with those points of b that come within the margin.
    pub(crate) fn near_discs(&mut self, i: usize, of_b: Range<usize>) -> ControlFlow<()> {
        let disc = self.pair.disc_a(i);
        for j in of_b {
            self.pair.meter.go_on()?;
            let other = self.pair.disc_b(j);
            let distance = (Vector3::from(disc.centre) - Vector3::from(other.centre)).norm();
            if distance > self.reach + disc.radius + other.radius || self.pair.is_of_balls([i, j]) {
                continue;
            }
            if distance <= self.reach + self.pair.relative.slack() {
                let [p, q] = [self.pair.views[0].point(i), self.pair.views[1].point(j)].map(Vector3::from);
                if (p - q).norm() <= self.margin {
                    return self.met([p, q], i, j);
                }
            }
            self.pair.meter.leaf_work(PAIRS_A_DISTANCE);
            if let Some([x, y]) = near(&disc, &other, self.reach) {
                match self.pair.doubt_about(i, j) {
                    Some(reason) => _ = self.doubt.get_or_insert(reason),
                    None => {
                        let placed = self.pair.views[0].stored_to_world();
                        let world = [x, y].map(|v| Vector3::from(placed.apply(v.map(f64::from).into())));
                        return self.met(world, i, j);
                    }
                }
            }
        }
        ControlFlow::Continue(())
    }

    /// Records a contact of two points within the margin, on or at the points or discs `i` and `j`.
    fn met(&mut self, places: [Vector3<f64>; 2], i: usize, j: usize) -> ControlFlow<()> {
        let contact = self.between(places, i, j);
        self.tries += 1;
        self.met.get_or_insert([i, j]);
        let certified = if self.is_settled() { None } else { self.approach(places, &contact, i, j) };
        self.record(contact, certified)
    }

    /// The contact midway between two points.
    fn between(&self, [p, q]: [Vector3<f64>; 2], i: usize, j: usize) -> Contact {
        let [va, vb] = self.pair.views;
        let na = va.stored_to_world().rotate(self.pair.a.normals[i].map(f64::from));
        let nb = vb.stored_to_world().rotate(self.pair.b.normals[j].map(f64::from));
        Contact {
            point: (0.5 * (p + q)).into(),
            normals: Some([na, nb]),
            residual: 0.5 * (p - q).norm(),
            sources: [va.scan().id(i), vb.scan().id(j)],
        }
    }

    /// Finds a verified point on each surface, nearer to each other than the margin. Both points
    /// move towards each other along their surfaces, at most a local radius per step.
    fn approach(
        &mut self,
        [p, q]: [Vector3<f64>; 2],
        contact: &Contact,
        i: usize,
        j: usize,
    ) -> Option<Contact> {
        if !self.verifies() {
            return None;
        }
        let views = self.pair.views;
        let radii = [self.pair.a.radii[i], self.pair.b.radii[j]];
        let mut evaluations = 0;
        let mut land = |side: usize, x: Vector3<f64>| {
            let scratch = &mut self.gathers[side];
            let mut near = views[side].near([i, j][side], scratch);
            let foot = project(x.into(), |y| near.evaluate(y));
            evaluations += u64::from(foot.evaluations);
            foot
        };
        let step = |side: usize, from: &Projection, to: &Projection| {
            let [from, to, n] = [from.point, to.point, from.at.normal].map(Vector3::from);
            let along = (to - from) - n * n.dot(&(to - from));
            let most = f64::from(radii[side]) * views[side].stored_to_world().scale();
            from + along * (most / along.norm()).min(1.0)
        };
        let (mut x, mut y) = (land(0, p), land(1, q));
        let mut found = None;
        for _ in 0..SURFACE_ROUNDS {
            if !(x.converged && y.converged) {
                break;
            }
            let [u, v] = [x.point, y.point].map(Vector3::from);
            if (u - v).norm() <= self.margin {
                found = Some(Contact {
                    point: (0.5 * (u + v)).into(),
                    normals: Some([x.at.normal, y.at.normal]),
                    residual: 0.5 * (u - v).norm(),
                    ..*contact
                });
                break;
            }
            x = land(0, step(0, &x, &y));
            y = land(1, step(1, &y, &x));
        }
        self.pair.meter.evaluated(evaluations);
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn disc(centre: [f32; 3], normal: [f32; 3], radius: f32) -> Disc {
        Disc { centre, normal, radius }
    }

    #[test]
    fn distances_between_discs_are_found() {
        let flat = disc([0.0; 3], [0.0, 0.0, 1.0], 1.0);
        let cases = [
            (disc([0.5, 0.0, 0.3], [0.0, 0.0, 1.0], 1.0), 0.3, "above each other"),
            (disc([3.0, 0.0, 0.0], [0.0, 0.0, 1.0], 1.0), 1.0, "side by side"),
            (disc([2.5, 0.0, 0.0], [1.0, 0.0, 0.0], 1.0), 1.5, "edge towards face"),
            (disc([0.0, 0.0, 1.4], [1.0, 0.0, 0.0], 1.0), 0.4, "standing above"),
            (disc([0.0, 0.0, 0.4], [1.0, 0.0, 0.0], 1.0), 0.0, "standing across"),
        ];
        for (other, distance, what) in cases {
            for (a, b) in [(&flat, &other), (&other, &flat)] {
                assert!(near(a, b, distance + 1e-3).is_some(), "{what}: {distance} is enough");
                assert!(near(a, b, distance * 0.999 - 1e-6).is_none(), "{what}: less is not");
            }
        }
    }
}
