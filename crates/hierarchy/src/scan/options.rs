//! Options of a build, and its errors.

use nearmiss_store::WorkError;
use nearmiss_surface::{SurfaceError, SurfaceOptions};
use thiserror::Error;

use crate::patch::samples::SAMPLES;

/// The valid range of K for local radii. Fewer neighbours span no plane; more do not measure the
/// spacing.
pub(crate) const RADIUS_NEIGHBOURS: std::ops::RangeInclusive<u32> = 3..=32;

/// The options of a build. Plain numbers, validated by the build.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct BuildOptions {
    /// The definition of the surface.
    pub surface: SurfaceOptions,
    /// K: a point's spacing is the distance to its K-th neighbour, or more if the first K look like
    /// a line. 3 to 32, default 6. A larger K bridges wider gaps between samples and blurs more
    /// detail.
    pub radius_neighbours: u32,
    /// The number of points in a leaf, 4 to 64, default 16. Larger leaves make fewer nodes and
    /// slower leaf tests.
    pub leaf_size: u32,
    /// The number of sample points of an inner node, 8 to 32, default 16. More samples give finer
    /// levels and tighter coverings, at four bytes each.
    pub samples: u32,
    /// L: how far the scan may be interpolated, in the caller's units. No gap wider than this is
    /// bridged, and no local radius exceeds it. `None`, the default, takes twice the 0.9-quantile
    /// of the local radii before this limit, usually twice the sampling radius. Up to a tenth of
    /// outliers does not change it.
    pub reach: Option<f64>,
    /// The number of threads; 0, the default, uses those of the current pool. Never changes the
    /// result.
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
    /// Sets the definition of the surface.
    #[must_use]
    pub const fn with_surface(self, surface: SurfaceOptions) -> Self {
        Self { surface, ..self }
    }

    /// Sets K for local radii.
    #[must_use]
    pub const fn with_radius_neighbours(self, radius_neighbours: u32) -> Self {
        Self { radius_neighbours, ..self }
    }

    /// Sets the number of points in a leaf.
    #[must_use]
    pub const fn with_leaf_size(self, leaf_size: u32) -> Self {
        Self { leaf_size, ..self }
    }

    /// Sets the number of samples of an inner node.
    #[must_use]
    pub const fn with_samples(self, samples: u32) -> Self {
        Self { samples, ..self }
    }

    /// Sets the reach L.
    #[must_use]
    pub const fn with_reach(self, reach: f64) -> Self {
        Self { reach: Some(reach), ..self }
    }

    /// Sets the number of threads.
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

/// The error of a build.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum BuildError {
    /// An option of the surface is out of range.
    #[error(transparent)]
    Surface(#[from] SurfaceError),
    /// The leaf size is out of range.
    #[error("expected leaves of 4 to 64 points, got {0}")]
    LeafSize(u32),
    /// The number of neighbours for local radii is out of range.
    #[error("expected 3 to 32 neighbours for local radii, got {0}")]
    RadiusNeighbours(u32),
    /// The number of samples of a node is out of range.
    #[error("expected 8 to 32 samples of a node, got {0}")]
    Samples(u32),
    /// The reach is not positive and finite, or vanishes beside the scan's extent.
    #[error("expected a finite reach above 0 and above the rounding error of positions, got {0}")]
    Reach(f64),
    /// The points spread so far that the rounding error of positions exceeds their spacing.
    #[error(
        "expected positions that are precise enough for a spacing of {spacing:.2e}, got coordinates up to {extent:.2e}; \
         remove points that are far from all others, or give a reach"
    )]
    Spread {
        /// The greatest spacing of most points.
        spacing: f64,
        /// The greatest coordinate.
        extent: f64,
    },
    /// The workspace failed.
    #[error(transparent)]
    Work(#[from] WorkError),
    /// The threads could not be started.
    #[error("cannot start {0} threads; use fewer")]
    Threads(usize),
}
