//! Sampling of forms, and the radius by which answers are scored.

use nalgebra::Vector3;

use super::form::Form;
use super::primitive::{Oriented, Primitive};
use crate::arbitrary::{gaussian, rng};
use crate::oracle;

/// The order of samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Order {
    /// Lattices, rings and Fibonacci spirals.
    Regular,
    /// Dart throwing: points that keep three quarters of the spacing from each other.
    Random,
}

/// Parameters of a sampling.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sampling {
    /// Approximate square root of the area of a point, in the form's unit.
    pub spacing: f64,
    /// Standard deviation of the noise along the normal, as a share of `spacing`.
    pub noise: f64,
    /// Regular or random.
    pub order: Order,
    /// Seed of all random choices.
    pub seed: u64,
}

impl Sampling {
    /// Returns a regular sampling without noise.
    #[must_use]
    pub fn clean(spacing: f64) -> Self {
        Self { spacing, noise: 0.0, order: Order::Regular, seed: 0 }
    }
}

/// Points of another part nearer than this share of the spacing are the same point of a shared
/// edge.
const SAME: f64 = 0.25;

pub(super) fn points(form: &Form, sampling: &Sampling) -> Vec<[f64; 3]> {
    let rng = &mut rng(sampling.seed);
    let mut kept: Vec<Oriented> = Vec::new();
    let mut grid = Cells::new(form, sampling.spacing);
    for part in &form.parts {
        let samples = match sampling.order {
            Order::Regular => part.regular(sampling.spacing),
            Order::Random => darts(form, part, sampling, rng),
        };
        let earlier = kept.len();
        for sample in samples {
            if !grid.any_within(&kept[..earlier], &sample.0, SAME * sampling.spacing) {
                kept.push(sample);
            }
        }
        for (i, sample) in kept.iter().enumerate().skip(earlier) {
            grid.insert(i, &sample.0);
        }
    }
    let sigma = sampling.noise * sampling.spacing;
    let noisy = kept.into_iter().map(|(p, n)| match sampling.noise {
        0.0 => p.into(),
        _ => (p + sigma * gaussian(rng) * n).into(),
    });
    noisy.collect()
}

/// Returns points on the end of a part, evenly, then darts that keep their distance, until there
/// are enough or no more fit.
fn darts(form: &Form, part: &Primitive, sampling: &Sampling, rng: &mut impl rand::Rng) -> Vec<Oriented> {
    /// With three quarters of the spacing, one point per spacing² fits after some ten darts each.
    const KEEP: f64 = 0.75;
    const DARTS_EACH: f64 = 15.0;
    let mut kept = part.end(sampling.spacing);
    let mut grid = Cells::new(form, sampling.spacing);
    for (i, sample) in kept.iter().enumerate() {
        grid.insert(i, &sample.0);
    }
    let wanted = part.area() / (sampling.spacing * sampling.spacing);
    let mut thrown = 0.0;
    while oracle::count(kept.len()) < wanted && thrown < DARTS_EACH * wanted {
        thrown += 1.0;
        let dart = part.random_oriented(rng);
        if !grid.any_within(&kept, &dart.0, KEEP * sampling.spacing) {
            grid.insert(kept.len(), &dart.0);
            kept.push(dart);
        }
    }
    kept
}

/// Cells one spacing wide, so that all points nearer than that are in the 27 cells around.
struct Cells {
    origin: Vector3<f64>,
    width: f64,
    counts: [usize; 3],
    cells: Vec<Vec<usize>>,
}

impl Cells {
    fn new(form: &Form, width: f64) -> Self {
        let (low, high) = form.bounds();
        let origin = low.add_scalar(-width);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "extents are positive and some hundred spacings"
        )]
        let counts = [0, 1, 2].map(|k| ((high[k] - low[k]) / width) as usize + 3);
        Self { origin, width, counts, cells: vec![Vec::new(); counts.iter().product()] }
    }

    fn cell(&self, p: &Vector3<f64>) -> [usize; 3] {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "within the bounds of the form, one cell from every side"
        )]
        let cell = [0, 1, 2].map(|k| ((p[k] - self.origin[k]) / self.width) as usize);
        [0, 1, 2].map(|k| cell[k].clamp(1, self.counts[k] - 2))
    }

    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.counts[1] + y) * self.counts[0] + x
    }

    fn insert(&mut self, i: usize, p: &Vector3<f64>) {
        let at = self.index(self.cell(p));
        self.cells[at].push(i);
    }

    fn any_within(&self, points: &[Oriented], p: &Vector3<f64>, distance: f64) -> bool {
        let [x, y, z] = self.cell(p);
        let around = (0..27).map(|i| self.index([x + i % 3 - 1, y + i / 3 % 3 - 1, z + i / 9 - 1]));
        let mut near = around.flat_map(|cell| &self.cells[cell]);
        near.any(|&i| i < points.len() && (points[i].0 - p).norm() < distance)
    }
}

/// Returns the radius r of scoring: the 0.9-quantile, over all points, of the distance to the 6th
/// nearest other distinct point, in the unit of the points. Nothing is smoothed and no rank grows,
/// unlike in [`oracle::radii`].
///
/// # Panics
/// If there are fewer than seven distinct points.
#[must_use]
pub fn scorer_radius(points: &[[f64; 3]]) -> f64 {
    let mut sorted: Vec<Vector3<f64>> = points.iter().map(|&p| p.into()).collect();
    sorted.sort_unstable_by(|a, b| {
        let axes = [0, 1, 2].map(|k| a[k].total_cmp(&b[k]));
        axes[0].then(axes[1]).then(axes[2])
    });
    sorted.dedup();
    assert!(sorted.len() > oracle::RANK, "{} distinct points have no 6th neighbour", sorted.len());
    // Only the neighbours within the 6th distance along x can be among the six.
    let sixth = |i: usize| {
        let mut nearest = [f64::INFINITY; oracle::RANK];
        let (mut left, mut right) = (i, i + 1);
        loop {
            let reach = nearest[oracle::RANK - 1];
            let gap_left = if left > 0 { sorted[i].x - sorted[left - 1].x } else { f64::INFINITY };
            let gap_right = sorted.get(right).map_or(f64::INFINITY, |p| p.x - sorted[i].x);
            if gap_left.min(gap_right) > reach || gap_left.min(gap_right) == f64::INFINITY {
                return reach;
            }
            let j = if gap_left < gap_right {
                left -= 1;
                left
            } else {
                right += 1;
                right - 1
            };
            let d = (sorted[j] - sorted[i]).norm();
            let at = nearest.partition_point(|&x| x <= d);
            if at < oracle::RANK {
                nearest.copy_within(at..oracle::RANK - 1, at + 1);
                nearest[at] = d;
            }
        }
    };
    let sixths: Vec<f64> = (0..sorted.len()).map(sixth).collect();
    oracle::quantile(&sixths, 0.9)
}
