//! How a hierarchy is built.

use nearmiss_store::WorkError;
use nearmiss_surface::{SurfaceError, SurfaceOptions};
use thiserror::Error;

use crate::patch::samples::SAMPLES;

/// K of the local radii: fewer span no plane, more say nothing of the spacing.
pub(crate) const RADIUS_NEIGHBOURS: std::ops::RangeInclusive<u32> = 3..=32;

/// How a hierarchy is built. Plain numbers, checked by the build.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct BuildOptions {
    /// What defines the surface.
    pub surface: SurfaceOptions,
    /// K: a point's spacing is the distance to its K-th neighbour, more where the first K look like a line.
    /// 3 to 32, default 6. Larger bridges wider gaps between samples and blurs more detail.
    pub radius_neighbours: u32,
    /// Points in a leaf, 4 to 64, default 16. Larger leaves make fewer nodes and dearer leaf tests.
    pub leaf_size: u32,
    /// Sample points of an inner node, 8 to 32, default 16. More make finer levels and tighter coverings, at
    /// four bytes each.
    pub samples: u32,
    /// L: how far the scan may be interpolated, in the caller's units. No gap wider than this is bridged, and
    /// no local radius exceeds it. `None`, the default: twice the sampling radius, so that nothing is
    /// interpolated further from a measured point than nine tenths of the points have six neighbours. A tenth
    /// of outliers does not change it.
    pub reach: Option<f64>,
    /// Threads to build on; 0, the default, takes what the process's pool has. Never changes the result.
    pub threads: usize,
}

impl Default for BuildOptions {
    fn default() -> Self {
        Self {
            surface: SurfaceOptions::default(),
            radius_neighbours: 6,
            leaf_size: 16,
            samples: 16,
            reach: None,
            threads: 0,
        }
    }
}

impl BuildOptions {
    /// The same options with this surface.
    #[must_use]
    pub const fn with_surface(self, surface: SurfaceOptions) -> Self {
        Self { surface, ..self }
    }

    /// The same options with this K for local sampling radii.
    #[must_use]
    pub const fn with_radius_neighbours(self, radius_neighbours: u32) -> Self {
        Self { radius_neighbours, ..self }
    }

    /// The same options with this many points in a leaf.
    #[must_use]
    pub const fn with_leaf_size(self, leaf_size: u32) -> Self {
        Self { leaf_size, ..self }
    }

    /// The same options with this many samples of an inner node.
    #[must_use]
    pub const fn with_samples(self, samples: u32) -> Self {
        Self { samples, ..self }
    }

    /// The same options with this reach.
    #[must_use]
    pub const fn with_reach(self, reach: f64) -> Self {
        Self { reach: Some(reach), ..self }
    }

    /// The same options on this many threads.
    #[must_use]
    pub const fn with_threads(self, threads: usize) -> Self {
        Self { threads, ..self }
    }

    pub(crate) fn check(&self) -> Result<(), BuildError> {
        if !(4..=64).contains(&self.leaf_size) {
            return Err(BuildError::LeafSize(self.leaf_size));
        }
        if !RADIUS_NEIGHBOURS.contains(&self.radius_neighbours) {
            return Err(BuildError::RadiusNeighbours(self.radius_neighbours));
        }
        if !SAMPLES.contains(&self.samples) {
            return Err(BuildError::Samples(self.samples));
        }
        match self.reach {
            Some(reach) if !(reach > 0.0 && reach.is_finite()) => Err(BuildError::Reach(reach)),
            _ => Ok(()),
        }
    }
}

/// Why a hierarchy cannot be built.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum BuildError {
    /// An option of the surface is out of range.
    #[error(transparent)]
    Surface(#[from] SurfaceError),
    /// Leaves too small or too large.
    #[error("leaves of {0} points; 4 to 64 are possible")]
    LeafSize(u32),
    /// Too few or too many neighbours for a radius.
    #[error("a local radius from {0} neighbours; 3 to 32 are possible")]
    RadiusNeighbours(u32),
    /// Too few or too many samples of a node.
    #[error("{0} samples of a node; 8 to 32 are possible")]
    Samples(u32),
    /// A reach that is not a length, or vanishes beside the scan's extent.
    #[error("reach must be positive, finite and no less than the rounding of positions, got {0}")]
    Reach(f64),
    /// The folder that the work is done in fails.
    #[error(transparent)]
    Work(#[from] WorkError),
    /// The threads could not be started.
    #[error("cannot start {0} threads")]
    Threads(usize),
}
