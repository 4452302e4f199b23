//! How well two normals agree, and the edges in the order of that.

use nearmiss_lanes::id32;
use nearmiss_lanes::parallel::ranges;
use nearmiss_lanes::vector::{dot, sub};

use crate::Adjacency;

/// Steps of agreement that are told apart; edges of one step are taken in the order of their points.
const STEPS: u16 = 1024;

/// Whether two normals agree as they are, how well, and how well along the surface, 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Agreement {
    pub(super) same: bool,
    pub(super) strength: f32,
    along: f32,
}

/// How the normals `m` at `p` and `n` at `q` agree.
#[inline]
pub(super) fn agreement(p: [f32; 3], m: [f32; 3], q: [f32; 3], n: [f32; 3]) -> Agreement {
    let e = sub(q, p);
    let square = dot(e, e);
    let (me, ne) = (dot(m, e), dot(n, e));
    let mirrored = dot(m, n) - 2.0 * me * ne / square;
    let off = (me * me).max(ne * ne) / square;
    // Points in one place, or normals that are none, say nothing.
    let strength = if mirrored.abs() > 0.0 { mirrored.abs().min(1.0) } else { 0.0 };
    let along = if off < 1.0 { strength * (1.0 - off) } else { 0.0 };
    Agreement { same: mirrored >= 0.0, strength, along }
}

/// Two points, and how their normals agree.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Edge {
    pub(super) ends: [u32; 2],
    /// The step of how well normals agree, and one bit for opposite ones.
    strength: u16,
    /// [`STEPS`] − 1 − the step of how well they agree along the surface.
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

/// What edges weigh when many decide together.
///
/// Of two signs that an edge of strength s holds to agree let (1 + s) / 2 be right; of the dragon's edges
/// with s above 0.95 none is wrong, of those below 0.2 a third. What independent witnesses say is the sum of
/// their log-odds, ln((1 + s) / (1 − s)). They are whole numbers here, so that no sum depends on its order.
#[derive(Debug)]
pub(super) struct Weights(Vec<i64>);

impl Weights {
    /// The weight of log-odds of one.
    const ONE: f64 = 65536.0;

    /// Adds up the slope 2 / (1 − s²), by the middles of the steps: logarithms of machines differ.
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

    /// Of this edge, negative if it holds normals to be opposite.
    pub(super) fn of(&self, edge: Edge) -> i64 {
        let weight = self.0[edge.step()];
        if edge.opposite() { -weight } else { weight }
    }
}

/// All edges, the best agreement first; of equal steps by their points.
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
            // The last steps are steep; there is no infinite one.
            assert!((found - expected).abs() < if k < STEPS - 32 { 1e-3 } else { 0.1 }, "{found} at {s}");
        }
    }
}
