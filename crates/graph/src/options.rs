//! Options of a graph.

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// The data stored for paths between close pairs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Paths {
    /// Nothing. Each step of a path is searched among the neighbours.
    #[default]
    Rebuilt,
    /// One byte for each pair: the rank, among the neighbours, of the next point of the path.
    Stored,
}

/// Values of r of the r-SIG. A larger r would connect points of unrelated surfaces.
const NEIGHBOURS: std::ops::RangeInclusive<u32> = 1..=32;

/// Values of k in [`Prune::Quartiles`].
const FENCE: std::ops::RangeInclusive<f64> = 0.0..=1e6;

/// Greatest coordinate whose squared differences are in the range of single precision.
const FARTHEST: f32 = 1e18;

/// The pruning of long edges.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Prune {
    /// All edges are kept.
    Never,
    /// Edges that are long at one of their ends become virtual. An edge is long if it is longer
    /// than Q3 + k · (Q3 − Q1) and than 1.5 times the median of the edge lengths at that end. Ends
    /// with fewer than five edges are skipped. k is the given number, at least 0; a larger k keeps
    /// more edges.
    Quartiles(f64),
}

/// Options of a graph. Building a graph validates them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct GraphOptions {
    /// r: a point's sphere of influence extends to its r-th nearest neighbour (Klein & Zachmann
    /// 2005, §3.2). 1 to 32, default 4. A larger r bridges wider gaps between samples, but also
    /// joins more points that are not connected on the surface. The cost grows in proportion.
    pub neighbours: u32,
    /// Pruning of long edges. Default: [`Prune::Quartiles`] with k = 1.
    pub prune: Prune,
    /// The data stored for paths between close pairs; `None`, the default, for no map of close
    /// pairs. The geodesic kernel needs the map. It takes most of the time and memory.
    pub close_pairs: Option<Paths>,
}

impl Default for GraphOptions {
    fn default() -> Self {
        Self { neighbours: 4, prune: Prune::Quartiles(1.0), close_pairs: None }
    }
}

impl GraphOptions {
    /// Sets r.
    #[must_use]
    pub const fn with_neighbours(self, neighbours: u32) -> Self {
        Self { neighbours, ..self }
    }

    /// Sets the pruning.
    #[must_use]
    pub const fn with_prune(self, prune: Prune) -> Self {
        Self { prune, ..self }
    }

    /// Sets the data stored for paths between close pairs; `None` for no map of close pairs.
    #[must_use]
    pub const fn with_close_pairs(self, close_pairs: Option<Paths>) -> Self {
        Self { close_pairs, ..self }
    }

    /// Validates the options.
    pub(crate) fn check(&self) -> Result<(), GraphError> {
        if !NEIGHBOURS.contains(&self.neighbours) {
            return Err(GraphError::Neighbours(self.neighbours));
        }
        match self.prune {
            Prune::Quartiles(k) if !FENCE.contains(&k) => Err(GraphError::Prune(k)),
            _ => Ok(()),
        }
    }
}

/// Error of building or updating a graph.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum GraphError {
    /// An r that is not between 1 and 32.
    #[error("expected 1 to 32 neighbours for spheres of influence, got {0}")]
    Neighbours(u32),
    /// A k that is not between 0 and a million.
    #[error("expected a pruning fence of 0 to 1000000 interquartile ranges, got {0}")]
    Prune(f64),
    /// A coordinate that is not finite, or too large to be squared in single precision.
    #[error(
        "expected finite coordinates within ±1e18, got another (point {index}); drop the point or scale the input down"
    )]
    Coordinate {
        /// Index of the first such point.
        index: usize,
    },
    /// A scanner position that is not finite.
    #[error("expected finite coordinates of the scanner, got {0:?}")]
    Scanner([f64; 3]),
    /// More points, or more ends of edges, than 32 bits can number.
    #[error(
        "expected at most 4294967295 points or ends of edges, got {ends}; use fewer points or neighbours"
    )]
    TooLarge {
        /// Number of points or of ends of edges.
        ends: usize,
    },
    /// A geodesic kernel requested of a graph without a map of close pairs.
    #[error(
        "expected a graph with close pairs for the geodesic kernel, got one without; build it with close pairs"
    )]
    NoClosePairs,
}

/// Checks that differences of `positions` can be squared in single precision.
pub(crate) fn check_positions(positions: &[[f32; 3]]) -> Result<(), GraphError> {
    let fits = |p: &[f32; 3]| p.iter().all(|c| c.abs() <= FARTHEST);
    if positions.len() >= u32::MAX as usize {
        return Err(GraphError::TooLarge { ends: positions.len() });
    }
    positions.iter().position(|p| !fits(p)).map_or(Ok(()), |index| Err(GraphError::Coordinate { index }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_checked_by_name() {
        let options = GraphOptions::default();
        assert_eq!(options.check(), Ok(()));
        assert_eq!(options.with_neighbours(0).check(), Err(GraphError::Neighbours(0)));
        assert_eq!(options.with_neighbours(33).check(), Err(GraphError::Neighbours(33)));
        assert_eq!(options.with_prune(Prune::Quartiles(-0.1)).check(), Err(GraphError::Prune(-0.1)));
        assert!(options.with_prune(Prune::Quartiles(f64::NAN)).check().is_err(), "NaN quartiles");
        assert_eq!(options.with_prune(Prune::Never).check(), Ok(()));
        for bad in [f32::NAN, f32::INFINITY, -1.1e18] {
            let positions = [[0.0; 3], [1e18, 0.0, bad]];
            assert_eq!(check_positions(&positions), Err(GraphError::Coordinate { index: 1 }), "{bad}");
        }
    }
}
