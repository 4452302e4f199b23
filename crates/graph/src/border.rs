//! Points at the border of a surface, whose neighbours are on one side.
//!
//! Consider the points at most two edges away, weighted by the number of walks that lead to them.
//! Their mean deviates from the centre point along the surface by some fraction of their standard
//! deviation. Inside a surface that fraction is sampling noise; at a straight border it is about
//! 0.5 (docs/theory/graph.md). The deviation along the normal, the least principal direction of
//! these points, is due to curvature and is ignored. "Approximating Bounded, Non-orientable
//! Surfaces from Points" (Adamson & Alexa 2004) also uses the weighted mean to find borders, for
//! positions off the points.

use nearmiss_lanes::parallel::{map, ranges};
use nearmiss_surface::symmetric_eigen;

use crate::adjacency::Adjacency;

/// Fraction from which a point is at the border. If points are at least half a spacing apart, the
/// outermost ones at a straight border have 0.41 to 0.77, and points of closed shapes at most 0.33.
const SHARE: f64 = 0.4;

/// Fewer neighbours cannot surround a point.
const LEAST_NEIGHBOURS: usize = 3;

/// Returns 1 for each point at a border, 0 for others.
pub(crate) fn borders(positions: &[[f32; 3]], graph: &Adjacency) -> Vec<u8> {
    let sums = map(graph.len(), |i| {
        let near = graph.of(i).iter().map(|&j| Sums::at(minus(positions[j as usize], positions[i])));
        near.fold(Sums::at([0.0; 3]), |sum, next| sum.plus(&next))
    });
    let parts = ranges(graph.len(), |range| {
        let is_border = |i: usize| {
            let near = graph.of(i).iter().map(|&j| {
                let j = j as usize;
                sums[j].moved(minus(positions[j], positions[i]))
            });
            let about = near.fold(sums[i], |sum, next| sum.plus(&next));
            u8::from(graph.of(i).len() < LEAST_NEIGHBOURS || about.eccentricity() > SHARE)
        };
        range.map(is_border).collect::<Vec<u8>>()
    });
    parts.into_iter().flatten().collect()
}

fn minus(a: [f32; 3], b: [f32; 3]) -> [f64; 3] {
    [0, 1, 2].map(|k| f64::from(a[k]) - f64::from(b[k]))
}

/// Number, sum and sum of squares (xx xy xz yy yz zz) of some vectors.
#[derive(Debug, Clone, Copy)]
struct Sums {
    count: f64,
    first: [f64; 3],
    second: [f64; 6],
}

impl Sums {
    /// Returns the sums of one vector.
    fn at(d: [f64; 3]) -> Self {
        let [x, y, z] = d;
        Self { count: 1.0, first: d, second: [x * x, x * y, x * z, y * y, y * z, z * z] }
    }

    fn plus(mut self, other: &Self) -> Self {
        self.count += other.count;
        for k in 0..3 {
            self.first[k] += other.first[k];
        }
        for k in 0..6 {
            self.second[k] += other.second[k];
        }
        self
    }

    /// Returns the sums of the same vectors, each shifted by `d`.
    fn moved(&self, d: [f64; 3]) -> Self {
        let mut sums = *self;
        for (k, (a, b)) in [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)].into_iter().enumerate() {
            sums.second[k] += self.first[a] * d[b] + self.first[b] * d[a] + self.count * d[a] * d[b];
        }
        for k in 0..3 {
            sums.first[k] += self.count * d[k];
        }
        sums
    }

    /// Returns the length of the mean along the surface, in standard deviations of the vectors
    /// along the surface.
    fn eccentricity(&self) -> f64 {
        let [x, y, z] = self.first.map(|c| c / self.count);
        let [xx, xy, xz, yy, yz, zz] = self.second.map(|c| c / self.count);
        let about = [xx - x * x, xy - x * y, xz - x * z, yy - y * y, yz - y * z, zz - z * z];
        let [nx, ny, nz] = symmetric_eigen(about).vectors[0];
        let along = nx * x + ny * y + nz * z;
        let off_sq = x * x + y * y + z * z - along * along;
        let spread_sq = xx + yy + zz
            - (nx * (nx * xx + 2.0 * (ny * xy + nz * xz)) + ny * (ny * yy + 2.0 * nz * yz) + nz * nz * zz);
        (off_sq.max(0.0) / spread_sq).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{GraphOptions, PointGraph};
    use nalgebra::Matrix3;
    use nearmiss_testdata::arbitrary::{CloudKind, cloud};
    use nearmiss_testdata::oracle;

    /// Computes the fraction from every walk of two steps.
    fn naive(positions: &[[f32; 3]], graph: &Adjacency, i: usize) -> f64 {
        let stay_or_step = |i: usize| {
            let mut all = vec![i];
            all.extend(graph.of(i).iter().map(|&j| j as usize));
            all
        };
        let ends: Vec<[f64; 3]> = stay_or_step(i)
            .into_iter()
            .flat_map(stay_or_step)
            .map(|k| minus(positions[k], positions[i]))
            .collect();
        let count = ends.iter().map(|_| 1.0).sum::<f64>();
        let mean = [0, 1, 2].map(|k| ends.iter().map(|d| d[k]).sum::<f64>() / count);
        let product = |k: usize, l: usize| {
            ends.iter().map(|d| (d[k] - mean[k]) * (d[l] - mean[l])).sum::<f64>() / count
        };
        let n = oracle::symmetric_eigen(&Matrix3::from_fn(product)).vectors[0];
        let across = |d: [f64; 3]| {
            let along: f64 = (0..3).map(|k| d[k] * n[k]).sum();
            (0..3).map(|k| (d[k] - along * n[k]).powi(2)).sum::<f64>()
        };
        (across(mean) / (ends.iter().map(|&d| across(d)).sum::<f64>() / count)).sqrt()
    }

    #[test]
    #[expect(clippy::cast_possible_truncation, reason = "points are stored in single precision")]
    fn sums_moved_are_sums_over_walks() {
        for kind in [CloudKind::Sphere, CloudKind::Coplanar, CloudKind::Outlier, CloudKind::Rings] {
            let positions: Vec<[f32; 3]> = cloud(kind, 400, 1).iter().map(|p| p.map(|x| x as f32)).collect();
            let graph = PointGraph::build(&positions, &GraphOptions::default()).unwrap();
            let edges = graph.edges();
            for i in 0..positions.len() {
                let share = naive(&positions, edges, i);
                let few = edges.of(i).len() < LEAST_NEIGHBOURS;
                if few || (share - SHARE).abs() > 1e-9 {
                    assert_eq!(graph.is_border(i), few || share > SHARE, "{kind:?}: point {i}, {share}");
                }
            }
        }
    }
}
