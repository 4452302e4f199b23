//! Agreement of two normals, and the edges sorted by it.

use nearmiss_lanes::id32;
use nearmiss_lanes::parallel::ranges;
use nearmiss_lanes::vector::{dot, sub};

use crate::Adjacency;

/// Number of levels of agreement. Edges of equal level stay in the order of their points.
const STEPS: u16 = 1024;

/// Agreement of two normals: whether the signs match, and from 0 to 1 the strength in general and
/// the strength along the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Agreement {
    pub(super) same: bool,
    pub(super) strength: f32,
    along: f32,
}

/// Returns the agreement of the normals `m` at `p` and `n` at `q`.
#[inline]
pub(super) fn agreement(p: [f32; 3], m: [f32; 3], q: [f32; 3], n: [f32; 3]) -> Agreement {
    let e = sub(q, p);
    let square = dot(e, e);
    let (me, ne) = (dot(m, e), dot(n, e));
    let mirrored = dot(m, n) - 2.0 * me * ne / square;
    let off = (me * me).max(ne * ne) / square;
    // Coincident points and invalid normals have no agreement.
    let strength = if mirrored.abs() > 0.0 { mirrored.abs().min(1.0) } else { 0.0 };
    let along = if off < 1.0 { strength * (1.0 - off) } else { 0.0 };
    Agreement { same: mirrored >= 0.0, strength, along }
}

/// Two points and the agreement of their normals.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Edge {
    pub(super) ends: [u32; 2],
    /// Level of the strength, shifted left by one; bit 0 is set for opposite normals.
    strength: u16,
    /// [`STEPS`] − 1 − the level of the strength along the surface.
    weakness: u16,
}

impl Edge {
    pub(super) fn new(ends: [u32; 2], found: Agreement) -> Self {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to STEPS − 1")]
        let step = |share: f32| (share * f32::from(STEPS - 1)) as u16;
        let strength = step(found.strength) << 1 | u16::from(!found.same);
        Self { ends, strength, weakness: STEPS - 1 - step(found.along) }
    }

    pub(super) fn opposite(self) -> bool {
        self.strength & 1 != 0
    }

    pub(super) fn along(self) -> f32 {
        f32::from(STEPS - 1 - self.weakness) / f32::from(STEPS - 1)
    }

    fn step(self) -> usize {
        usize::from(self.strength >> 1)
    }
}

/// Weights of edges in votes.
///
/// An edge of strength s is taken to be right with probability (1 + s) / 2. Of the dragon's edges
/// with s above 0.95 none is wrong; of those below 0.2, a third. Votes of independent edges add up
/// as log-odds, ln((1 + s) / (1 − s)). Weights are integers, so that sums do not depend on their
/// order.
#[derive(Debug)]
pub(super) struct Weights(Vec<i64>);

impl Weights {
    /// Weight of log-odds 1.
    const ONE: f64 = 65536.0;

    /// Sums the slope 2 / (1 − s²) at the midpoints of the levels, because logarithms differ
    /// between machines.
    pub(super) fn new() -> Self {
        let slope = |k: u16| {
            let s = (f64::from(k) + 0.5) / f64::from(STEPS);
            2.0 / (1.0 - s * s) / f64::from(STEPS)
        };
        let sums = (0..STEPS).scan(0.0, |sum, k| {
            let before = *sum;
            *sum += slope(k);
            Some(before)
        });
        #[expect(clippy::cast_possible_truncation, reason = "below 2^20")]
        let weights = sums.map(|odds| (Self::ONE * odds) as i64).collect();
        Self(weights)
    }

    /// Returns the weight of an edge, negative for opposite normals.
    pub(super) fn of(&self, edge: Edge) -> i64 {
        let weight = self.0[edge.step()];
        if edge.opposite() { -weight } else { weight }
    }
}

/// Returns all edges, sorted by strength along the surface, strongest first; edges of equal level
/// by their points.
pub(super) fn strongest_first(graph: &Adjacency, positions: &[[f32; 3]], normals: &[[f32; 3]]) -> Vec<Edge> {
    let stretches = ranges(graph.len(), |points| {
        let mut edges = Vec::new();
        let mut counts = vec![0_u32; usize::from(STEPS)];
        for i in points {
            let (p, m) = (positions[i], normals[i]);
            for &j in graph.of(i).iter().filter(|&&j| i < j as usize) {
                let edge =
                    Edge::new([id32(i), j], agreement(p, m, positions[j as usize], normals[j as usize]));
                counts[usize::from(edge.weakness)] += 1;
                edges.push(edge);
            }
        }
        (edges, counts)
    });
    let mut next = vec![0_usize; usize::from(STEPS)];
    let mut total = 0;
    for (step, next) in next.iter_mut().enumerate() {
        *next = total;
        total += stretches.iter().map(|(_, counts)| counts[step] as usize).sum::<usize>();
    }
    let mut sorted = vec![Edge::default(); total];
    for edge in stretches.into_iter().flat_map(|(edges, _)| edges) {
        let to = &mut next[usize::from(edge.weakness)];
        sorted[*to] = edge;
        *to += 1;
    }
    sorted
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_log_odds() {
        let weights = Weights::new();
        for k in 0..STEPS {
            let s = f64::from(k) / f64::from(STEPS);
            #[expect(clippy::cast_precision_loss, reason = "below 2^20")]
            let found = weights.0[usize::from(k)] as f64 / Weights::ONE;
            let expected = ((1.0 + s) / (1.0 - s)).ln();
            // The last levels are steep, and their weights are finite.
            assert!((found - expected).abs() < if k < STEPS - 32 { 1e-3 } else { 0.1 }, "{found} at {s}");
        }
    }
}
