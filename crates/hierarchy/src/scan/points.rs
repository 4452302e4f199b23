//! The points that a scan is built from.

use nearmiss_geometry::{Aabb, Dropped, Frame, PointCloud};

/// The distinct points of a scan: those of a [`PointCloud`], or of a file larger than memory
/// ([`GatheredPoints`](crate::GatheredPoints)).
#[derive(Debug, Clone, Copy)]
pub struct ScanPoints<'a> {
    pub(crate) positions: &'a [[f32; 3]],
    pub(crate) source: &'a [u32],
    pub(crate) frame: Frame,
    pub(crate) bounds: Aabb,
    pub(crate) dropped: Dropped,
    pub(crate) step: f64,
}

/// Where the points of a scan are, and how many were left out.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Placement {
    pub(crate) frame: Frame,
    pub(crate) bounds: Aabb,
    pub(crate) dropped: Dropped,
    pub(crate) step: f64,
}

impl ScanPoints<'_> {
    pub(crate) const fn placement(&self) -> Placement {
        Placement { frame: self.frame, bounds: self.bounds, dropped: self.dropped, step: self.step }
    }

    /// Returns the number of points.
    #[must_use]
    #[expect(clippy::len_without_is_empty, reason = "a scan has at least eight points")]
    pub const fn len(&self) -> usize {
        self.positions.len()
    }

    /// Returns the bounds in the caller's frame.
    #[must_use]
    pub const fn bounds(&self) -> &Aabb {
        &self.bounds
    }
}

impl<'a> From<&'a PointCloud> for ScanPoints<'a> {
    fn from(cloud: &'a PointCloud) -> Self {
        Self {
            positions: cloud.positions(),
            source: cloud.source(),
            frame: cloud.frame(),
            bounds: cloud.bounds(),
            dropped: cloud.dropped(),
            step: cloud.step(),
        }
    }
}

/// Returns a bound of the change of a coordinate by rounding to single precision.
pub(crate) fn step(frame: &Frame, bounds: &Aabb) -> f64 {
    let far = |k: usize| (bounds.min[k] - frame.origin[k]).abs().max((bounds.max[k] - frame.origin[k]).abs());
    0.5 * f64::from(f32::EPSILON) * (0..3).map(far).fold(0.0, f64::max)
}
