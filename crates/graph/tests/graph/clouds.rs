//! Clouds with graphs for these tests. The graph joins points whose spheres to the fourth neighbour
//! intersect, and is found by other means than in the library.

use std::num::NonZero;

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use nearmiss_graph::{Adjacency, edge_lengths};
use nearmiss_surface::symmetric_eigen;
use nearmiss_testdata::shapes::{Form, Order, Sampling};

/// Points, their graph, the lengths of its edges, and the distance of each point's sixth neighbour.
#[derive(Debug, Clone)]
pub(crate) struct Cloud {
    pub(crate) points: Vec<[f32; 3]>,
    pub(crate) graph: Adjacency,
    pub(crate) lengths: Vec<f32>,
    pub(crate) radii: Vec<f32>,
}

impl Cloud {
    pub(crate) fn new(points: Vec<[f32; 3]>) -> Self {
        let [fourth, sixth] = neighbour_distances(&points, [4, 6]);
        let edges =
            if points.len() <= BRUTE { all_pairs(&points, &fourth) } else { by_tree(&points, &fourth) };
        let graph = Adjacency::from_edges(points.len(), &edges);
        let lengths = edge_lengths(&graph, &points);
        #[expect(clippy::cast_possible_truncation, reason = "radii are single precision")]
        let radii = sixth.into_iter().map(|r| r as f32).collect();
        Self { points, graph, lengths, radii }
    }

    pub(crate) fn of_form(form: Form, spacing: f64, noise: f64, seed: u64) -> Self {
        let order = if seed == 0 { Order::Regular } else { Order::Random };
        Self::new(single(&form.sample(Sampling { spacing, noise, order, seed }).points))
    }

    /// The least eigenvector about each point and its neighbours in the graph, with a random sign.
    pub(crate) fn normals(&self, seed: u64) -> Vec<[f32; 3]> {
        (0..self.points.len())
            .map(|i| {
                let group: Vec<[f64; 3]> = self
                    .graph
                    .of(i)
                    .iter()
                    .map(|&j| j as usize)
                    .chain([i])
                    .map(|j| self.points[j].map(f64::from))
                    .collect();
                let mut covariance = [0.0; 6];
                #[expect(clippy::cast_precision_loss, reason = "a few")]
                let mean = [0, 1, 2].map(|k| group.iter().map(|p| p[k]).sum::<f64>() / group.len() as f64);
                for p in &group {
                    let [x, y, z] = [0, 1, 2].map(|k| p[k] - mean[k]);
                    for (sum, v) in covariance.iter_mut().zip([x * x, x * y, x * z, y * y, y * z, z * z]) {
                        *sum += v;
                    }
                }
                #[expect(clippy::cast_possible_truncation, reason = "normals are single precision")]
                let normal = symmetric_eigen(covariance).vectors[0].map(|c| c as f32);
                if coin(seed, i) { normal } else { normal.map(|c| -c) }
            })
            .collect()
    }
}

/// A random boolean for each index.
pub(crate) fn coin(seed: u64, i: usize) -> bool {
    let mixed = (i as u64 ^ seed << 32).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    (mixed ^ mixed >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 63 == 0
}

#[expect(clippy::cast_possible_truncation, reason = "positions are single precision")]
pub(crate) fn single(points: &[[f64; 3]]) -> Vec<[f32; 3]> {
    points.iter().map(|p| p.map(|c| c as f32)).collect()
}

pub(crate) fn distance(a: &[f32; 3], b: &[f32; 3]) -> f64 {
    (0..3).map(|k| (f64::from(a[k]) - f64::from(b[k])).powi(2)).sum::<f64>().sqrt()
}

/// Greatest number of points for comparisons of all pairs.
const BRUTE: usize = 1000;

fn all_pairs(points: &[[f32; 3]], radii: &[f64]) -> Vec<[u32; 2]> {
    let ids = 0..u32::try_from(points.len()).unwrap();
    let is_edge = |&[i, j]: &[u32; 2]| {
        let (i, j) = (i as usize, j as usize);
        distance(&points[i], &points[j]) <= radii[i] + radii[j]
    };
    ids.flat_map(|j| (0..j).map(move |i| [i, j])).filter(is_edge).collect()
}

/// As [`all_pairs`], with a tree. Of two points, the one with the greater sphere finds the other.
fn by_tree(points: &[[f32; 3]], radii: &[f64]) -> Vec<[u32; 2]> {
    let tree = tree(points);
    let mut edges = Vec::new();
    for (i, p) in points.iter().enumerate() {
        let reach = 4.0 * radii[i] * radii[i] * 1.000_001;
        let found = tree.query(&p.map(f64::from)).within::<SquaredEuclidean<f64>>(reach).execute();
        for j in found.iter().map(|near| near.item as usize).filter(|&j| j != i) {
            if (radii[i], i) > (radii[j], j) && distance(p, &points[j]) <= radii[i] + radii[j] {
                edges.push([u32::try_from(i).unwrap(), u32::try_from(j).unwrap()]);
            }
        }
    }
    edges
}

fn tree(points: &[[f32; 3]]) -> ImmutableKdTree<f64, 3> {
    let points: Vec<[f64; 3]> = points.iter().map(|p| p.map(f64::from)).collect();
    ImmutableKdTree::new_from_slice(&points).unwrap()
}

/// Distances of every point to its neighbours of these ranks.
fn neighbour_distances<const N: usize>(points: &[[f32; 3]], ranks: [usize; N]) -> [Vec<f64>; N] {
    let tree = (points.len() > BRUTE).then(|| tree(points));
    let wanted = NonZero::new(ranks.into_iter().max().unwrap() + 1).unwrap();
    let mut distances = ranks.map(|_| Vec::with_capacity(points.len()));
    for p in points {
        let mut found: Vec<f64> = match &tree {
            None => points.iter().map(|q| distance(p, q)).collect(),
            Some(tree) => {
                let found =
                    tree.query(&p.map(f64::from)).nearest_n::<SquaredEuclidean<f64>>(wanted).execute();
                found.iter().map(|near| near.distance.sqrt()).collect()
            }
        };
        found.sort_unstable_by(f64::total_cmp);
        for (to, rank) in distances.iter_mut().zip(ranks) {
            to.push(found[rank.min(found.len() - 1)]);
        }
    }
    distances
}
