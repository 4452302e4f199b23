//! The tangent discs of one point of each scan: whether their crossing is reliable, and the contact
//! there.

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::{Part, PointKind};

use crate::ask::answer::{Contact, Reason};
use crate::leaf::crossing::Disc;
use crate::leaf::surfel_pair::{Discs, LeafPair};
use crate::pair::scan_pair::ScanPair;

/// Points nearer than this, in the lesser local radius, show a contact by themselves, whatever the
/// orientation of their discs: discs are as wide as this.
const NEAR: f32 = 0.65;

/// The greatest distance, in the greater local radius, at which a crossing of discs counts. Where
/// surfaces cross, samples of both are within about 0.6 local radii of the crossing and nearer to
/// each other than this. Discs reach up to 1.3; discs that stand upright, as noise on thin plates
/// produces, would bridge a gap of that width.
pub(crate) const FAR: f32 = 0.9;

impl ScanPair<'_> {
    pub(crate) fn disc_a(&self, i: usize) -> Disc {
        Disc { centre: self.a.position(i), normal: self.a.normals[i], radius: self.a.discs.get(i) }
    }

    pub(crate) fn disc_b(&self, j: usize) -> Disc {
        Disc {
            centre: self.relative.point(self.b.position(j)),
            normal: self.relative.direction(self.b.normals[j]),
            radius: self.b.discs.get(j) * self.relative.scale(),
        }
    }

    /// Returns why a crossing of the discs of points `i` and `j` is unreliable, or `None` if it is
    /// reliable. In obstacles, only points on sheets have discs, which are always reliable.
    pub(crate) fn doubt_about(&self, i: usize, j: usize) -> Option<Reason> {
        if self.part == Part::Obstacle {
            return None;
        }
        match self.views[0].scan().kind(i).max(self.views[1].scan().kind(j)) {
            PointKind::Sheet | PointKind::Edge => None,
            kind if kind.is_sparse() => Some(Reason::Undersampled),
            _ => {
                let (distance, [ra, rb]) = self.points(i, j);
                (distance > NEAR * ra.min(rb)).then_some(Reason::Ambiguous)
            }
        }
    }

    /// The distance of two points, and their local radii, in a's stored frame.
    pub(crate) fn points(&self, i: usize, j: usize) -> (f32, [f32; 2]) {
        let q = self.relative.point(self.b.position(j));
        let distance = (Vector3::from(self.a.position(i)) - Vector3::from(q)).norm();
        (distance, [self.a.radii[i], self.b.radii[j] * self.relative.scale()])
    }

    /// Returns `true` if two points are near enough for a crossing of their discs to count.
    #[inline]
    pub(crate) fn are_near(&self, i: usize, j: usize) -> bool {
        let (distance, [ra, rb]) = self.points(i, j);
        distance <= FAR * ra.max(rb)
    }

    /// The contact at the middle of the common part of the chords of two crossing discs, in the
    /// world.
    pub(crate) fn shared_chord(&self, i: usize, j: usize) -> Contact {
        let [va, vb] = self.views;
        let (pa, pb) = (Vector3::from(va.point(i)), Vector3::from(vb.point(j)));
        let double = |[x, y, z]: [f32; 3]| [f64::from(x), f64::from(y), f64::from(z)];
        let na = Vector3::from(va.stored_to_world().rotate(double(self.a.normals[i])));
        let nb = Vector3::from(vb.stored_to_world().rotate(double(self.b.normals[j])));
        let middle = 0.5 * (pa + pb);
        let (fa, fb) = (na.dot(&(pa - middle)), nb.dot(&(pb - middle)));
        let c = na.dot(&nb);
        let gram = 1.0 - c * c;
        let step = if gram < 1e-3 {
            0.5 * (fa * na + fb * nb)
        } else {
            ((fa - c * fb) * na + (fb - c * fa) * nb) / gram
        };
        let radii = [
            f64::from(self.a.discs.get(i)) * va.stored_to_world().scale(),
            f64::from(self.b.discs.get(j)) * vb.stored_to_world().scale(),
        ];
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
            sources: [va.scan().id(i), vb.scan().id(j)],
        }
    }

    /// Returns `true` if the discs of points `i` and `j` cross reliably, by the same test as in the
    /// comparison of leaves. Always `false` for sparse leaves of surfaces, which need more tests.
    pub(crate) fn crosses(&self, [i, j]: [usize; 2]) -> bool {
        let (a, b) = (&self.a.leaves, &self.b.leaves);
        let is_sparse = || a.is_sparse(a.leaf_of(i)) || b.is_sparse(b.leaf_of(j));
        if self.part == Part::Surface && is_sparse() {
            return false;
        }
        let ((discs_a, lane_a), (discs_b, lane_b)) = (Discs::about(a, i), Discs::about(b, j));
        let (relative, reach) = (&self.relative, self.relative.slack());
        let test = LeafPair { a: discs_a, b: discs_b, balls: None, reach, relative };
        test.cross_alone(lane_a, lane_b) && self.are_near(i, j) && self.doubt_about(i, j).is_none()
    }
}
