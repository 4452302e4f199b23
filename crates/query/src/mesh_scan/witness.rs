//! Points that verify a contact of a triangle and the surface of a scan.

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::Part;
use nearmiss_mesh::{Corners, nearest_on_triangle, unit_normal};
use nearmiss_surface::{Evaluation, Status, meet, project};

use crate::ask::answer::Contact;
use crate::mesh_scan::mesh_scan_pair::MeshScanPairing;
use crate::pair::placed::ViewScratch;

/// Greatest |f| of a surface point, and greatest distance of a point of a triangle from it, in
/// bandwidths.
const ON_SURFACE: f64 = 1e-6;

/// A verified point further than this from the contact of the disc belongs to another contact. In
/// local radii.
const NEARBY: f64 = 4.0;

/// Evaluations of a search between two points of a triangle.
const ROUNDS: u32 = 24;

/// Steps along the surface to a point within the margin; each costs up to twelve evaluations.
const SURFACE_ROUNDS: u32 = 4;

/// The search for a point on a triangle and on the surface near point `i`.
pub(crate) struct Witness<'w, 'a> {
    pub(crate) pair: &'w mut MeshScanPairing<'a>,
    pub(crate) scratch: &'w mut ViewScratch,
    pub(crate) i: usize,
    /// The corners of the triangle in the world.
    pub(crate) triangle: Corners,
}

impl Witness<'_, '_> {
    /// Returns `contact` at a verified point on the triangle and on the surface. A point is verified
    /// if |f| ≤ 1e-6 h there with the status ok, and the triangle is no further away than that.
    ///
    /// Newton's method on the surface and the plane of the triangle comes first. If it ends beside
    /// the triangle, f is evaluated at points of the triangle. Between two with opposite signs, the
    /// segment has a zero of f, and is part of the triangle.
    pub(crate) fn touching(&mut self, contact: &Contact) -> Option<Contact> {
        if !self.pair.scan.verifies() {
            return None;
        }
        let found = match self.by_newton(contact.point) {
            Ok(found) => Some(found),
            Err(last) => self.by_signs(last),
        };
        let (point, at) = found?;
        let moved = (Vector3::from(point) - Vector3::from(contact.point)).norm();
        (moved <= NEARBY * self.pair.band(self.i) && self.is_part(point)).then(|| Contact {
            point,
            normals: contact.normals.map(|[_, of_triangle]| [at.normal, of_triangle]),
            residual: at.f.abs(),
            ..*contact
        })
    }

    /// Returns `true` if a point of the surface is in the part of the scan that is compared.
    fn is_part(&self, x: [f64; 3]) -> bool {
        self.pair.part == Part::Surface || self.pair.scan.is_obstacle(self.i, x)
    }

    /// Evaluates f; `None` once the budget is spent.
    fn evaluate(&mut self, x: [f64; 3]) -> Option<Evaluation> {
        if self.pair.meter.go_on().is_break() {
            return None;
        }
        self.pair.meter.evaluated(1);
        Some(self.pair.scan.evaluate_near(self.i, x, self.scratch))
    }

    /// Searches for a point on the surface and on the plane of the triangle. Fails with the last
    /// point if that is not a witness.
    fn by_newton(&mut self, start: [f64; 3]) -> Result<([f64; 3], Evaluation), [f64; 3]> {
        let Some(normal) = unit_normal(&self.triangle) else { return Err(start) };
        let corner = Vector3::from(self.triangle[0]);
        let found = meet(start, |x| {
            let of_scan = self.evaluate(x)?;
            let height = Vector3::from(normal).dot(&(corner - Vector3::from(x)));
            let centroid = Vector3::from(x) + Vector3::from(normal) * height;
            let of_plane = Evaluation {
                f: height,
                normal,
                centroid: centroid.into(),
                eigenvalues: [0.0; 3],
                status: Status::Ok,
                ..of_scan
            };
            Some([of_scan, of_plane])
        });
        let Some(found) = found else { return Err(start) };
        let foot = Vector3::from(nearest_on_triangle(&self.triangle, found.point));
        let beside = (foot - Vector3::from(found.point)).norm();
        let [at, _] = found.at;
        if found.verified && beside <= ON_SURFACE * at.bandwidth {
            Ok((found.point, at))
        } else {
            Err(found.point)
        }
    }

    /// Searches for a zero of f between points of the triangle: the one nearest to `about`, and
    /// those in the directions of the corners, at most a local radius away.
    fn by_signs(&mut self, about: [f64; 3]) -> Option<([f64; 3], Evaluation)> {
        let from = Vector3::from(nearest_on_triangle(&self.triangle, about));
        let own = self.evaluate(from.into()).filter(|at| at.status != Status::Outside)?;
        let most = self.pair.band(self.i);
        for corner in self.triangle {
            let way = Vector3::from(corner) - from;
            let length = way.norm();
            if length == 0.0 {
                continue;
            }
            let to = from + way * (most / length).min(1.0);
            let other = self.evaluate(to.into())?;
            if other.status != Status::Outside && (own.f < 0.0) != (other.f < 0.0) {
                return self.between([(from, own.f), (to, other.f)]);
            }
        }
        None
    }

    /// Finds a zero of f between two points with opposite signs.
    fn between(&mut self, ends: [(Vector3<f64>, f64); 2]) -> Option<([f64; 3], Evaluation)> {
        let [(from, first), (to, last)] = ends;
        let ((mut low, mut below), (mut high, mut above)) = ((0.0, first), (1.0, last));
        for round in 0..ROUNDS {
            let secant = low + (high - low) * (below / (below - above)).clamp(0.01, 0.99);
            let share = if round % 3 == 2 { 0.5 * (low + high) } else { secant };
            let x = (from + (to - from) * share).into();
            let at = self.evaluate(x)?;
            if at.f.abs() <= ON_SURFACE * at.bandwidth {
                return (at.status == Status::Ok).then_some((x, at));
            }
            if (at.f < 0.0) == (first < 0.0) {
                (low, below) = (share, at.f);
            } else {
                (high, above) = (share, at.f);
            }
        }
        None
    }

    /// Returns `contact` at the middle of a verified point on the surface and a point of the
    /// triangle at most `margin` apart. `start` is a point of the triangle near the surface.
    pub(crate) fn within(&mut self, contact: &Contact, start: [f64; 3], margin: f64) -> Option<Contact> {
        if !self.pair.scan.verifies() {
            return None;
        }
        let mut on_triangle = start;
        for _ in 0..SURFACE_ROUNDS {
            if self.pair.meter.go_on().is_break() {
                return None;
            }
            let (scan, i) = (self.pair.scan, self.i);
            let foot = project(on_triangle, |x| scan.evaluate_near(i, x, self.scratch));
            self.pair.meter.evaluated(u64::from(foot.evaluations));
            if !foot.converged {
                return None;
            }
            let x = Vector3::from(foot.point);
            on_triangle = nearest_on_triangle(&self.triangle, foot.point);
            let apart = (x - Vector3::from(on_triangle)).norm();
            if apart <= margin {
                return self.is_part(foot.point).then(|| Contact {
                    point: (0.5 * (x + Vector3::from(on_triangle))).into(),
                    normals: contact.normals.map(|[_, of_triangle]| [foot.at.normal, of_triangle]),
                    residual: 0.5 * apart,
                    ..*contact
                });
            }
        }
        None
    }
}
