//! The proximity graph of Klein & Zachmann 2005, §3.2, from all pairs of points.
//!
//! `d_i` is the distance of the r-th nearest other point, or of the furthest if there are fewer.
//! Points are joined iff `‖p_i − p_j‖ ≤ d_i + d_j`. Distances are square roots in double precision
//! of squared distances in single precision, with every operation rounded. At a point with five
//! edges or more, an edge is long if its length exceeds Q3 + k (Q3 − Q1) and 1.5 times the median.
//! Quantiles are interpolated linearly between order statistics. An edge that is long at either end
//! is virtual.

/// A graph. Each edge occurs once, the lesser end first, in ascending order.
#[derive(Debug, Clone, PartialEq)]
pub struct Proximity {
    /// `d_i` of each point.
    pub radii: Vec<f64>,
    /// Edges that are long at neither end.
    pub edges: Vec<[u32; 2]>,
    /// The other edges.
    pub virtual_edges: Vec<[u32; 2]>,
    /// For each point, the least point of its component, without virtual edges.
    pub components: Vec<u32>,
}

/// Returns the graph of `points` with these r and k; without k nothing is pruned.
#[must_use]
pub fn proximity(points: &[[f32; 3]], r: usize, k: Option<f64>) -> Proximity {
    let n = points.len();
    let ids: Vec<u32> = (0_u32..).zip(points).map(|(id, _)| id).collect();
    let radii: Vec<f64> = (0..n)
        .map(|i| {
            let mut all: Vec<f64> =
                (0..n).filter(|&j| j != i).map(|j| distance(points[i], points[j])).collect();
            all.sort_by(f64::total_cmp);
            all.truncate(r);
            all.last().copied().unwrap_or(0.0)
        })
        .collect();
    let joined = |i: usize, j: usize| i != j && distance(points[i], points[j]) <= radii[i] + radii[j];
    let limits: Vec<f64> = (0..n)
        .map(|i| {
            let mut lengths: Vec<f64> =
                (0..n).filter(|&j| joined(i, j)).map(|j| distance(points[i], points[j])).collect();
            lengths.sort_by(f64::total_cmp);
            let q = |share| quantile(&lengths, share);
            match k {
                Some(k) if lengths.len() >= 5 => (q(0.75) + k * (q(0.75) - q(0.25))).max(1.5 * q(0.5)),
                _ => f64::INFINITY,
            }
        })
        .collect();
    let (mut edges, mut virtual_edges) = (Vec::new(), Vec::new());
    for i in 0..n {
        for j in i + 1..n {
            let length = distance(points[i], points[j]);
            if joined(i, j) && (length > limits[i] || length > limits[j]) {
                virtual_edges.push([ids[i], ids[j]]);
            } else if joined(i, j) {
                edges.push([ids[i], ids[j]]);
            }
        }
    }
    let mut components = ids;
    let mut changes = true;
    while changes {
        changes = false;
        for &[a, b] in &edges {
            let least = components[a as usize].min(components[b as usize]);
            for end in [a, b] {
                changes |= components[end as usize] != least;
                components[end as usize] = least;
            }
        }
    }
    Proximity { radii, edges, virtual_edges, components }
}

fn distance(a: [f32; 3], b: [f32; 3]) -> f64 {
    let squares = [0, 1, 2].map(|k| (a[k] - b[k]) * (a[k] - b[k]));
    f64::from(squares[0] + squares[1] + squares[2]).sqrt()
}

/// Returns a quantile, linear between order statistics.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    reason = "a few thousand at most"
)]
fn quantile(sorted: &[f64], share: f64) -> f64 {
    let place = share * (sorted.len() - 1) as f64;
    let low = place.floor() as usize;
    let high = (low + 1).min(sorted.len() - 1);
    sorted[low] + (place - low as f64) * (sorted[high] - sorted[low])
}
