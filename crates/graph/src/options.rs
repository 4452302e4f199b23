//! How a graph is built.

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// What is kept of paths.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Paths {
    /// Nothing: each step is looked for among the neighbours.
    #[default]
    Rebuilt,
    /// A byte a pair: the rank among the neighbours of where the path goes on.
    Stored,
}

/// r of the r-SIG: more would join what lies beside each other on no surface.
const NEIGHBOURS: std::ops::RangeInclusive<u32> = 1..=32;

/// How many interquartile ranges an edge may be longer than the third quartile.
const FENCE: std::ops::RangeInclusive<f64> = 0.0..=1e6;

/// Coordinates whose squared differences single precision holds.
const FARTHEST: f32 = 1e18;

/// Whether long edges are taken off the surface.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Prune {
    /// All edges stay.
    Never,
    /// Edges are virtual that at one of their ends are longer than Q3 + k · (Q3 − Q1) and than 1.5 times the
    /// median, by the lengths of the edges there, if these are five or more. k is given, at least 0; larger
    /// keeps more.
    Quartiles(f64),
}

/// How a graph is built. Plain numbers, checked by the build.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct GraphOptions {
    /// r: a point's sphere of influence reaches to its r-th nearest neighbour (S1 §3.2). 1 to 32, default 4.
    /// Larger bridges wider gaps between samples, joins more that is not joined on the surface, and costs in
    /// proportion.
    pub neighbours: u32,
    /// What becomes of long edges. Default: [`Prune::Quartiles`] with k = 1.
    pub prune: Prune,
    /// Whether the map of close pairs is made, and what of its paths is kept. Default: made, paths rebuilt.
    pub close_pairs: Option<Paths>,
}

impl Default for GraphOptions {
    fn default() -> Self {
        Self { neighbours: 4, prune: Prune::Quartiles(1.0), close_pairs: Some(Paths::Rebuilt) }
    }
}

impl GraphOptions {
    /// The same options with this r.
    #[must_use]
    pub const fn with_neighbours(self, neighbours: u32) -> Self {
        Self { neighbours, ..self }
    }

    /// The same options with this pruning.
    #[must_use]
    pub const fn with_prune(self, prune: Prune) -> Self {
        Self { prune, ..self }
    }

    /// The same options with this map of close pairs, or none.
    #[must_use]
    pub const fn with_close_pairs(self, close_pairs: Option<Paths>) -> Self {
        Self { close_pairs, ..self }
    }

    /// Checks every range.
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

/// Why no graph is built.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum GraphError {
    /// r is not between 1 and 32.
    #[error("spheres of influence up to the neighbour of rank {0}; it must lie between 1 and 32")]
    Neighbours(u32),
    /// k is not between 0 and a million.
    #[error("a fence of {0} interquartile ranges; it must lie between 0 and 1000000")]
    Prune(f64),
    /// A coordinate is not finite, or beyond what single precision squares.
    #[error(
        "point {index} has a coordinate that is not finite or beyond ±1e18; drop it or scale the input down"
    )]
    Coordinate {
        /// Index of the first such point.
        index: usize,
    },
    /// The place of the scanner is none.
    #[error("the scanner at {0:?}; its coordinates must be finite")]
    Scanner([f64; 3]),
    /// More points, or ends of edges, than 32 bits count.
    #[error("{ends} ends of edges; at most 4294967295 can be stored; choose fewer neighbours")]
    TooLarge {
        /// How many there are.
        ends: usize,
    },
    /// The geodesic kernel has nothing to measure by.
    #[error("the geodesic kernel measures by a graph's map of close pairs; build the graph with that map")]
    NoClosePairs,
}

/// Checks that differences of `positions` can be squared.
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
        assert!(options.with_prune(Prune::Quartiles(f64::NAN)).check().is_err(), "no number");
        assert_eq!(options.with_prune(Prune::Never).check(), Ok(()));
        for bad in [f32::NAN, f32::INFINITY, -1.1e18] {
            let positions = [[0.0; 3], [1e18, 0.0, bad]];
            assert_eq!(check_positions(&positions), Err(GraphError::Coordinate { index: 1 }), "{bad}");
        }
    }
}
