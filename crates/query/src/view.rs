//! A prepared scan somewhere in the world.

use nearmiss_geometry::Pose;
use nearmiss_hierarchy::{GatherScratch, PointHierarchy, Slices};
use nearmiss_surface::Evaluation;

/// A scan in a pose: what queries look at. Cheap to make, cheap to copy.
#[derive(Debug, Clone, Copy)]
pub struct ScanView<'a> {
    scan: &'a PointHierarchy,
    slices: Slices<'a>,
    /// Stored frame → world.
    placed: Pose,
}

impl<'a> ScanView<'a> {
    /// `scan` in `pose`, which leads from the frame of its input to the world. Lengths of the scan, its radii
    /// and bandwidths among them, scale with the pose.
    #[must_use]
    pub fn new(scan: &'a PointHierarchy, pose: &Pose) -> Self {
        let frame = scan.frame();
        let stored = Pose::IDENTITY.with_scale(frame.scale).with_translation(frame.origin);
        Self { slices: scan.slices(), scan, placed: pose.after(&stored) }
    }

    /// The scan.
    #[must_use]
    pub fn scan(&self) -> &'a PointHierarchy {
        self.scan
    }

    /// Its points and nodes.
    #[must_use]
    pub fn slices(&self) -> &Slices<'a> {
        &self.slices
    }

    /// The pose of the scan's stored frame.
    #[must_use]
    pub fn placed(&self) -> &Pose {
        &self.placed
    }

    /// The `i`-th stored point in the world.
    ///
    /// # Panics
    /// When there is no such point.
    #[must_use]
    pub fn point(&self, i: usize) -> [f64; 3] {
        self.placed.apply(self.slices.positions[i].map(f64::from))
    }

    /// The implicit function at `x`, all in the world; the sign of f and of the normal as in the stored frame.
    pub fn evaluate_with(&self, x: [f64; 3], scratch: &mut GatherScratch) -> Evaluation {
        self.in_world(self.scan.evaluate_with(self.placed.apply_inverse(x), scratch))
    }

    /// As [`Self::evaluate_with`], faster where `x` is near the stored point `i`.
    pub(crate) fn evaluate_near(&self, i: usize, x: [f64; 3], scratch: &mut GatherScratch) -> Evaluation {
        self.in_world(self.scan.evaluate_near(i, self.placed.apply_inverse(x), scratch))
    }

    /// What holds in the stored frame, in the world.
    pub(crate) fn in_world(&self, at: Evaluation) -> Evaluation {
        let scale = self.placed.scale();
        Evaluation {
            f: at.f * scale,
            normal: self.placed.rotate(at.normal),
            centroid: self.placed.apply(at.centroid),
            bandwidth: at.bandwidth * scale,
            eigenvalues: at.eigenvalues.map(|l| l * scale * scale),
            ..at
        }
    }
}
