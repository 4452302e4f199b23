//! The tangent discs of one point of each scan: whether their crossing is reliable.

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::{Part, PointKind};

use crate::ask::answer::Reason;
use crate::leaf::crossing::Disc;
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
    /// reliable.
    pub(crate) fn doubt_about(&self, i: usize, j: usize) -> Option<Reason> {
        let kinds = [self.views[0].scan().kind(i), self.views[1].scan().kind(j)];
        doubt_about(self.part, kinds, || self.points(i, j))
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
        are_near(self.points(i, j))
    }
}

/// Returns `true` if two points at this distance, with these local radii, are near enough for a
/// crossing of their discs to count.
#[inline]
pub(crate) fn are_near((distance, [ra, rb]): (f32, [f32; 2])) -> bool {
    distance <= FAR * ra.max(rb)
}

/// Returns why a crossing of the discs of two points of these kinds is unreliable, or `None` if it
/// is reliable. In obstacles, only points on sheets have discs, which are always reliable. `points`
/// returns the distance of the points and their local radii.
#[inline]
pub(crate) fn doubt_about(
    part: Part,
    kinds: [PointKind; 2],
    points: impl FnOnce() -> (f32, [f32; 2]),
) -> Option<Reason> {
    if part == Part::Obstacle {
        return None;
    }
    match kinds[0].max(kinds[1]) {
        PointKind::Sheet | PointKind::Edge => None,
        kind if kind.is_sparse() => Some(Reason::Undersampled),
        _ => {
            let (distance, [ra, rb]) = points();
            (distance > NEAR * ra.min(rb)).then_some(Reason::Ambiguous)
        }
    }
}
