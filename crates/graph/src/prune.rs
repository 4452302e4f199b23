//! Pruning of long edges: outliers among the edge lengths at their ends.
//!
//! Klein & Zachmann 2005, §3.2, prune "long" edges by an outlier test of the reader's choice. This
//! is Tukey's fence with a tighter k and two guards (docs/theory/graph.md): lengths on a grid have
//! no spread, and fewer than five lengths have no outliers.

use nearmiss_lanes::parallel::ranges;

use crate::adjacency::{Adjacency, Lists};
use crate::influence::distance;
use crate::options::GraphError;

/// Fewer edges have no outliers.
const LEAST_EDGES: usize = 5;

/// An edge up to this multiple of the median is not long. The diagonals of a square grid are 1.41
/// times as long as its edges.
const ORDINARY: f64 = 1.5;

/// Splits `graph` into the edges to keep and the virtual edges, which are long at one of their
/// ends.
pub(crate) fn split(
    positions: &[[f32; 3]],
    graph: &Adjacency,
    k: f64,
) -> Result<(Adjacency, Adjacency), GraphError> {
    let limits: Vec<f64> = ranges(graph.len(), |range| {
        let (mut lengths, mut limits) = (Vec::new(), Vec::with_capacity(range.len()));
        for i in range {
            lengths.clear();
            lengths.extend(graph.of(i).iter().map(|&j| distance(positions[i], positions[j as usize])));
            limits.push(limit(&mut lengths, k));
        }
        limits
    })
    .into_iter()
    .flatten()
    .collect();
    let parts = ranges(graph.len(), |range| {
        let (mut kept, mut long) = (Lists::default(), Lists::default());
        for i in range {
            let is_long = |j: u32| {
                let j = j as usize;
                distance(positions[i], positions[j]) > limits[i].min(limits[j])
            };
            kept.push(graph.of(i).iter().copied().filter(|&j| !is_long(j)));
            long.push(graph.of(i).iter().copied().filter(|&j| is_long(j)));
        }
        (kept, long)
    });
    let (kept, long): (Vec<Lists>, Vec<Lists>) = parts.into_iter().unzip();
    Ok((Adjacency::from_lists(kept)?, Adjacency::from_lists(long)?))
}

/// Returns the length beyond which an edge is long. Sorts `lengths`.
fn limit(lengths: &mut [f64], k: f64) -> f64 {
    if lengths.len() < LEAST_EDGES {
        return f64::INFINITY;
    }
    lengths.sort_unstable_by(f64::total_cmp);
    // Linear interpolation between order statistics.
    let quantile = |quarters: usize| {
        let (low, rest) = (quarters * (lengths.len() - 1) / 4, quarters * (lengths.len() - 1) % 4);
        let share = [0.0, 0.25, 0.5, 0.75][rest];
        let high = (low + 1).min(lengths.len() - 1);
        lengths[low] + share * (lengths[high] - lengths[low])
    };
    let [q1, median, q3] = [1, 2, 3].map(quantile);
    (q3 + k * (q3 - q1)).max(ORDINARY * median)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_quartiles_with_guards() {
        assert_eq!(limit(&mut [9.0, 1.0, 1.0, 1.0], 1.0).to_bits(), f64::INFINITY.to_bits());
        assert_eq!(limit(&mut [5.0, 1.0, 2.0, 4.0, 3.0], 1.0).to_bits(), 6.0_f64.to_bits());
        assert_eq!(limit(&mut [3.0, 4.0, 5.0, 6.0, 7.0, 8.0], 0.5).to_bits(), 8.25_f64.to_bits());
        assert_eq!(limit(&mut [2.0; 9], 1.0).to_bits(), 3.0_f64.to_bits(), "no spread");
    }
}
