//! Local sampling radii.
//!
//! A point's spacing is the distance to its K-th nearest neighbour, with K growing up to 32 while those
//! neighbours look like a line, as the returns of one LiDAR ring do. It is then made smooth,
//! `r_i := min_j (r_j + 0.3 ‖p_i − p_j‖)`, so that a lone point cannot bleed over a dense region.

use std::num::NonZero;

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use nearmiss_surface::symmetric_eigen;

use crate::boxes::{OrientedBox, dot, sub};
use crate::gather::TREE_STACK;
use crate::options::BuildError;
use crate::split::id32;
use crate::topology::Node;

/// More neighbours than this say more about the shape than about the spacing.
const MOST_NEIGHBOURS: usize = 32;

/// λ2 < 0.05 λ3 is what a line of points with noise looks like.
const LINE: f64 = 0.05;

/// How fast radii may grow with distance. 0.3 lets them double over some three spacings.
const GROWTH: f32 = 0.3;

/// A spacing, and whether the neighbours still looked like a line when their number ran out.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Spacing {
    pub(crate) radius: f32,
    pub(crate) is_line: bool,
}

/// The spacing of every one of the distinct `points`.
pub(crate) fn spacings(points: &[[f32; 3]], neighbours: usize) -> Result<Vec<Spacing>, BuildError> {
    let turned = map(points, |p| turn(*p));
    let tree = ImmutableKdTree::<f64, 3>::new_from_slice(&turned).or(Err(BuildError::Neighbours))?;
    let ids: Vec<u32> = (0..id32(points.len())).collect();
    Ok(map(&ids, |&i| {
        let near = nearest(&tree, points, &turned, i as usize, neighbours);
        if near.len() <= neighbours || !is_line(points, &near) {
            return Spacing { radius: near.last().map_or(0.0, length), is_line: false };
        }
        let near = nearest(&tree, points, &turned, i as usize, MOST_NEIGHBOURS);
        let last = near.len() - 1;
        let grown = (neighbours..=last).find(|&k| !is_line(points, &near[..=k]));
        Spacing { radius: length(&near[grown.unwrap_or(last)]), is_line: grown.is_none() }
    }))
}

/// The distance of a neighbour: at least 1e-18, whose square single precision still holds.
#[expect(clippy::cast_possible_truncation, reason = "radii are stored in single precision")]
fn length(near: &(f64, usize)) -> f32 {
    near.0.sqrt().max(1e-18) as f32
}

/// A fixed rotation, by 1, 0.7 and 0.3 radians about the axes: a kd-tree whose points share a coordinate, or
/// two, has leaves without end, and scans like walls and lines along an axis. Nothing scanned lies along these.
/// In double precision, so that no neighbour changes its rank.
#[inline]
fn turn(p: [f32; 3]) -> [f64; 3] {
    let [x, y, z] = p.map(f64::from);
    [
        0.730_681_649_935_512 * x + 0.358_208_578_049_394 * y + 0.581_197_850_184_727 * z,
        0.226_026_321_249_623 * x + 0.676_369_202_093_991 * y - 0.701_025_537_738_177 * z,
        -0.644_217_687_237_691 * x + 0.643_592_508_556_904 * y + 0.413_245_997_415_041 * z,
    ]
}

/// `f` of every item, in order, on all cores where there are several.
pub(crate) fn map<T: Sync, R: Send>(items: &[T], f: impl Fn(&T) -> R + Sync + Send) -> Vec<R> {
    #[cfg(feature = "rayon")]
    {
        use rayon::prelude::*;
        items.par_iter().with_min_len(1024).map(f).collect()
    }
    #[cfg(not(feature = "rayon"))]
    items.iter().map(f).collect()
}

/// Squared distance and index of point `i` itself and of the nearest `count` others, by distance, then index.
fn nearest(
    tree: &ImmutableKdTree<f64, 3>,
    points: &[[f32; 3]],
    turned: &[[f64; 3]],
    i: usize,
    count: usize,
) -> Vec<(f64, usize)> {
    let wanted = NonZero::new(count + 1).unwrap_or(NonZero::<usize>::MIN);
    let found = tree.query(&turned[i]).nearest_n::<SquaredEuclidean<f64>>(wanted).execute();
    let exact = |j: usize| {
        let d = [0, 1, 2].map(|k| f64::from(points[j][k]) - f64::from(points[i][k]));
        (d[0] * d[0] + d[1] * d[1] + d[2] * d[2], j)
    };
    let mut near: Vec<(f64, usize)> = found.iter().map(|n| exact(n.item as usize)).collect();
    near.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    near
}

/// Whether the points look like a line: the covariance about their mean has λ2 < 0.05 λ3.
fn is_line(points: &[[f32; 3]], near: &[(f64, usize)]) -> bool {
    let origin = points[near[0].1];
    let mut s = [0.0_f64; 9];
    for &(_, i) in near {
        let [x, y, z] = [0, 1, 2].map(|k| f64::from(points[i][k] - origin[k]));
        for (sum, v) in s.iter_mut().zip([x, y, z, x * x, x * y, x * z, y * y, y * z, z * z]) {
            *sum += v;
        }
    }
    #[expect(clippy::cast_precision_loss, reason = "at most 33")]
    let n = near.len() as f64;
    let [x, y, z, xx, xy, xz, yy, yz, zz] = s.map(|sum| sum / n);
    let c = [xx - x * x, xy - x * y, xz - x * z, yy - y * y, yz - y * z, zz - z * z];
    // For a line λ1λ2 + λ3(λ1 + λ2) < (0.05² + 2·0.05) λ3²; most neighbourhoods are far from that, and the sum
    // of the principal minors says so without a solve.
    let minors = c[0] * c[3] - c[1] * c[1] + c[0] * c[5] - c[2] * c[2] + c[3] * c[5] - c[4] * c[4];
    if minors > (LINE * LINE + 2.0 * LINE) * (c[0] + c[3] + c[5]).powi(2) * (1.0 + 1e-9) {
        return false;
    }
    let [_, l2, l3] = symmetric_eigen(c).values;
    l2 < LINE * l3
}

/// `r_i := min_j (r_j + 0.3 ‖p_i − p_j‖)` over all j, by branch and bound on the tree.
pub(crate) fn smooth(points: &[[f32; 3]], radii: &[f32], nodes: &[Node], boxes: &[OrientedBox]) -> Vec<f32> {
    let least =
        fold_nodes(nodes, |range| radii[range].iter().copied().fold(f32::INFINITY, f32::min), f32::min);
    let ids: Vec<u32> = (0..id32(points.len())).collect();
    map(&ids, |&i| {
        let p = points[i as usize];
        let mut best = radii[i as usize];
        let mut stack = [0_u32; TREE_STACK];
        let mut top = 1;
        while top > 0 {
            top -= 1;
            let id = stack[top] as usize;
            let margin = best - least[id];
            if margin <= 0.0 || GROWTH * GROWTH * boxes[id].distance_sq(p) >= margin * margin {
                continue;
            }
            let node = nodes[id];
            if node.is_leaf() {
                for j in node.points() {
                    let d = sub(points[j], p);
                    best = best.min(radii[j] + GROWTH * dot(d, d).sqrt());
                }
            } else {
                stack[top] = node.right;
                stack[top + 1] = id32(id) + 1;
                top += 2;
            }
        }
        best
    })
}

/// A value for each node from its points, leaves first: `leaf` of a leaf's range, `join` of two children's.
pub(crate) fn fold_nodes<T: Copy + Default>(
    nodes: &[Node],
    leaf: impl Fn(std::ops::Range<usize>) -> T,
    join: impl Fn(T, T) -> T,
) -> Vec<T> {
    let mut values = vec![T::default(); nodes.len()];
    // Children come after their parent.
    for id in (0..nodes.len()).rev() {
        let node = nodes[id];
        values[id] = if node.is_leaf() {
            leaf(node.points())
        } else {
            join(values[id + 1], values[node.right as usize])
        };
    }
    values
}
