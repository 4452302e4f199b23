//! One point of each scan: their contact by discs or balls.
//!
//! The points are read one by one, so that a remembered contact can be tested without the arrays of
//! whole scans.

use nearmiss_geometry::PointId;
use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::{Part, Relative, StoredPoint};

use crate::ask::answer::{Contact, Evidence};
use crate::leaf::disc_pair::{are_near, doubt_about};
use crate::leaf::surfel_pair::{Discs, LeafPair};
use crate::pair::placed::Placed;
use crate::pair::scan_pair::ScanPair;

/// One point of each scan.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PointPair<'p> {
    views: [&'p Placed<'p>; 2],
    items: [usize; 2],
    points: [StoredPoint; 2],
}

impl<'a> ScanPair<'a> {
    /// The points `i` of a and `j` of b.
    pub(crate) fn single(&self, points: [usize; 2]) -> PointPair<'a> {
        PointPair::new(self.views, points)
    }
}

impl<'p> PointPair<'p> {
    pub(crate) fn new(views: [&'p Placed<'p>; 2], items: [usize; 2]) -> Self {
        let points = [views[0].scan().stored_point(items[0]), views[1].scan().stored_point(items[1])];
        Self { views, items, points }
    }

    /// Returns `true` if both points are part of a sheet in their obstacles.
    pub(crate) fn are_sheets(&self) -> bool {
        self.points[0].is_on_sheet && self.points[1].is_on_sheet
    }

    /// The greater of the local radii, in the world.
    pub(crate) fn band(&self) -> f64 {
        self.in_world(0, self.points[0].radius).max(self.in_world(1, self.points[1].radius))
    }

    /// A length in the stored frame of a scan, in the world.
    fn in_world(&self, side: usize, length: f32) -> f64 {
        f64::from(length) * self.views[side].stored_to_world().scale()
    }

    fn position(&self, side: usize) -> Vector3<f64> {
        self.views[side].stored_to_world().apply(double(self.points[side].position)).into()
    }

    fn normal(&self, side: usize) -> Vector3<f64> {
        self.views[side].stored_to_world().rotate(double(self.points[side].normal)).into()
    }

    /// The distance of the points in the world.
    pub(crate) fn distance(&self) -> f64 {
        (self.position(0) - self.position(1)).norm()
    }

    /// Returns `true` if the discs of the points cross reliably, by the same test as in the
    /// comparison of leaves. Always `false` for sparse leaves of surfaces, which need more tests.
    pub(crate) fn cross(&self, relative: &Relative, part: Part) -> bool {
        let [a, b] = [self.views[0].scan().leaves(), self.views[1].scan().leaves()];
        let [i, j] = self.items;
        if part == Part::Surface && (a.is_sparse(a.leaf_of(i)) || b.is_sparse(b.leaf_of(j))) {
            return false;
        }
        let ((discs_a, lane_a), (discs_b, lane_b)) = (Discs::about(&a, i), Discs::about(&b, j));
        let test = LeafPair { a: discs_a, b: discs_b, balls: None, reach: 0.0, relative };
        let [a, b] = &self.points;
        let points = || {
            let q = relative.point(b.position);
            let distance = (Vector3::from(a.position) - Vector3::from(q)).norm();
            (distance, [a.radius, b.radius * relative.scale()])
        };
        test.cross_alone(lane_a, lane_b)
            && are_near(points())
            && doubt_about(part, [a.kind, b.kind], points).is_none()
    }

    /// The contact at the middle of the common part of the chords of two crossing discs, in the
    /// world.
    pub(crate) fn shared_chord(&self) -> Contact {
        let (pa, pb) = (self.position(0), self.position(1));
        let (na, nb) = (self.normal(0), self.normal(1));
        let middle = 0.5 * (pa + pb);
        let (fa, fb) = (na.dot(&(pa - middle)), nb.dot(&(pb - middle)));
        let c = na.dot(&nb);
        let gram = 1.0 - c * c;
        let step = if gram < 1e-3 {
            0.5 * (fa * na + fb * nb)
        } else {
            ((fa - c * fb) * na + (fb - c * fa) * nb) / gram
        };
        let radii = [self.in_world(0, self.points[0].disc), self.in_world(1, self.points[1].disc)];
        let place = middle + step;
        // Along the common line each chord is an interval. For parallel planes any point will do.
        let along = na.cross(&nb).try_normalize(0.03).map_or_else(Vector3::zeros, |line| {
            let chord = |p: Vector3<f64>, radius: f64| {
                let t = line.dot(&(p - place));
                let half = (radius * radius - (p - place - t * line).norm_squared()).max(0.0).sqrt();
                (t - half, t + half)
            };
            let ((a0, a1), (b0, b1)) = (chord(pa, radii[0]), chord(pb, radii[1]));
            line * (0.5 * (a0.max(b0) + a1.min(b1)))
        });
        Contact {
            point: (place + along).into(),
            normals: Some([na.into(), nb.into()]),
            residual: nb.dot(&(pa - pb)).abs().max(na.dot(&(pa - pb)).abs()),
            sources: self.sources(),
        }
    }

    /// The contact of two points, at least one of which is a ball, if they are at most `margin`
    /// apart in the world.
    ///
    /// Certified if a ball meets a ball or contains a measured point, estimated if it meets a
    /// tangent disc.
    pub(crate) fn ball_contact(&self, margin: f64) -> Option<(Contact, Evidence)> {
        let [p, q] = [self.position(0), self.position(1)];
        let [ra, rb] = [self.in_world(0, self.points[0].ball), self.in_world(1, self.points[1].ball)];
        let (distance, most) = ((p - q).norm(), ra + rb + margin);
        let contact = |point: Vector3<f64>, apart: f64| Contact {
            point: point.into(),
            normals: None,
            residual: 0.5 * apart,
            sources: self.sources(),
        };
        if distance <= most {
            let share = if most > 0.0 { (ra + 0.5 * margin) / most } else { 0.5 };
            return Some((contact(p + (q - p) * share, distance), Evidence::Certified));
        }
        let (centre, side) = if ra > 0.0 && rb == 0.0 {
            (p, 1)
        } else if rb > 0.0 && ra == 0.0 {
            (q, 0)
        } else {
            return None;
        };
        let foot = self.nearest_of_disc(side, centre);
        let distance = (foot - centre).norm();
        (distance <= most).then(|| {
            let way = if distance > 0.0 { (ra + rb + 0.5 * margin).min(distance) / distance } else { 0.0 };
            (contact(centre + (foot - centre) * way, distance), Evidence::Estimated)
        })
    }

    /// The contact in the middle between the points.
    pub(crate) fn midpoint(&self) -> Contact {
        let [p, q] = [self.position(0), self.position(1)];
        Contact {
            point: (0.5 * (p + q)).into(),
            normals: None,
            residual: 0.5 * (p - q).norm(),
            sources: self.sources(),
        }
    }

    fn sources(&self) -> [PointId; 2] {
        [self.views[0].scan().id(self.items[0]), self.views[1].scan().id(self.items[1])]
    }

    /// The world point of the tangent disc of the point on this side that is nearest to `x`.
    fn nearest_of_disc(&self, side: usize, x: Vector3<f64>) -> Vector3<f64> {
        let (centre, normal) = (self.position(side), self.normal(side));
        let radius = self.in_world(side, self.points[side].disc);
        let away = x - centre;
        let across = away - normal * normal.dot(&away);
        let length = across.norm();
        centre + if length > radius { across * (radius / length) } else { across }
    }
}

#[inline]
fn double([x, y, z]: [f32; 3]) -> [f64; 3] {
    [f64::from(x), f64::from(y), f64::from(z)]
}
