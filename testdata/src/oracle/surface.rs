//! The implicit surface of a cloud at one point, by summing over all of it.
//!
//! f(x) = n(x)·(a(x) − x), with a(x) the weighted mean of the points and n(x) the eigenvector of
//! least eigenvalue of their weighted covariance about a(x): Klein & Zachmann, *Point cloud
//! collision detection*, Computer Graphics Forum 23(3), 2004, eqs. 1–6 and 9. Deviations: every
//! point has a bandwidth of its own, and x must satisfy conditions besides f(x) = 0 to be on the
//! surface (see [`Status`]).

use nalgebra::{Matrix3, Vector3};

use super::eigen::symmetric_eigen;
use super::radii::{quantile, radii};

/// The border condition: x may be at most this many h(x) from a(x). At a straight border ‖x − a‖ is
/// 0.53 to 0.564 h.
pub const BORDER: f64 = 0.56;

/// The upper limit of λ1/(h²/2) on a sheet; midway between two sheets it is about 1.
pub const THIN: f64 = 0.3;

/// The lower limit of (λ2 − λ1)/(λ1 + λ2 + λ3) on a sheet.
pub const GAP: f64 = 0.1;

/// The weight of a point as a function of its distance d, up to its support radius `m·r_i`; zero
/// beyond.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kernel {
    /// θ(d) = exp(−d²/h²) with `h = m·r_i/√(−ln θ_ε)`.
    Gaussian {
        /// θ_ε, the weight at the support radius, in (0, 1).
        theta: f64,
    },
    /// θ(d) = (1 − q)⁴(4q + 1), `q = d/(m·r_i)` (Wendland 1995, C²).
    Wendland,
}

impl Kernel {
    /// Returns h_i of a point with support radius `support_radius`, m times its spacing.
    ///
    /// h²/2 is the variance along an axis of the kernel's weights on an evenly sampled plane. That
    /// is the definition of h for Wendland's kernel. With R = `support_radius` and w = (1 − q)⁴(4q + 1),
    /// h²/2 = R²/2 · ∫q³w dq / ∫q w dq = R²/2 · (5/504)/(1/14) = R²·5/72.
    #[must_use]
    pub fn bandwidth(&self, support_radius: f64) -> f64 {
        match self {
            Self::Gaussian { theta } => support_radius / (-theta.ln()).sqrt(),
            Self::Wendland => support_radius * (5.0_f64 / 36.0).sqrt(),
        }
    }

    /// Returns the weight at distance `d` of a point with support radius `support_radius`.
    #[must_use]
    pub fn weight(&self, d: f64, support_radius: f64) -> f64 {
        if d >= support_radius {
            return 0.0;
        }
        match self {
            Self::Gaussian { .. } => (-(d / self.bandwidth(support_radius)).powi(2)).exp(),
            Self::Wendland => {
                let q = d / support_radius;
                (1.0 - q).powi(4) * (4.0 * q + 1.0)
            }
        }
    }
}

/// The width of the kernel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bandwidth {
    /// h_i from the point's own smoothed spacing r_i.
    Local,
    /// The same h for all points, from the 0.9-quantile of the smoothed r_i, as in the papers.
    Global,
}

/// Parameters of the surface besides its points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameters {
    /// m: the support radius of a point is `m·r_i`.
    pub reach: f64,
    /// The weights.
    pub kernel: Kernel,
    /// Local or global bandwidth.
    pub bandwidth: Bandwidth,
    /// Minimum number of points that support x; with fewer, x is outside.
    pub least_support: usize,
}

/// The first condition that a point x of the surface would violate, besides f(x) = 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// Support below the minimum, or x not within half the support radius of any point.
    Outside,
    /// ‖x − a‖ > 0.56 h(x): beyond a border.
    Border,
    /// λ1/(h²/2) ≥ 0.3 or (λ2 − λ1)/(λ1 + λ2 + λ3) ≤ 0.1: no clear sheet, for example between two.
    Ambiguous,
    /// No condition is violated.
    Ok,
}

/// The results at a point x.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Evaluation {
    /// f(x) = n·(a − x), a length; its sign depends on that of `normal`.
    pub value: f64,
    /// n: unit, its component of greatest size positive (of equal ones the first).
    pub normal: [f64; 3],
    /// a(x), the weighted mean.
    pub centroid: [f64; 3],
    /// The number of points that support x.
    pub support: usize,
    /// h(x) = Σ w_i h_i / Σ w_i.
    pub bandwidth: f64,
    /// λ1 ≤ λ2 ≤ λ3 of the covariance about a, normalised by Σ w_i.
    pub eigenvalues: [f64; 3],
    /// The status of x.
    pub status: Status,
}

/// A cloud with its support radii, ready for evaluation.
#[derive(Debug, Clone)]
pub struct SurfaceTwin {
    points: Vec<[f64; 3]>,
    radii: Vec<f64>,
    parameters: Parameters,
}

impl SurfaceTwin {
    /// Computes smoothed spacings, O(n² log n), and for a global bandwidth their 0.9-quantile.
    #[must_use]
    pub fn new(points: &[[f64; 3]], parameters: Parameters) -> Self {
        Self::with_radii(points, &radii(points), parameters)
    }

    /// Creates the surface with smoothed spacings computed elsewhere.
    ///
    /// # Panics
    /// If there is not one spacing for each point, or no point.
    #[must_use]
    pub fn with_radii(points: &[[f64; 3]], smoothed: &[f64], parameters: Parameters) -> Self {
        assert_eq!(points.len(), smoothed.len(), "one spacing for each point");
        let radii = match parameters.bandwidth {
            Bandwidth::Local => smoothed.to_vec(),
            Bandwidth::Global => vec![quantile(smoothed, 0.9); points.len()],
        };
        Self { points: points.to_vec(), radii, parameters }
    }

    /// Returns the r_i in use: local, or the quantile for each point.
    #[must_use]
    pub fn radii(&self) -> &[f64] {
        &self.radii
    }

    /// Returns the points.
    #[must_use]
    pub fn points(&self) -> &[[f64; 3]] {
        &self.points
    }

    /// Returns f and the other results at `x`; `None` if no point supports it.
    #[must_use]
    pub fn evaluate(&self, x: [f64; 3]) -> Option<Evaluation> {
        let Parameters { reach, kernel, .. } = self.parameters;
        let x = Vector3::from(x);
        let reaching: Vec<(Vector3<f64>, f64, f64)> = (self.points.iter().zip(&self.radii))
            .map(|(&p, &r)| (Vector3::from(p), reach * r))
            .filter(|(p, support_radius)| (p - x).norm() < *support_radius)
            .map(|(p, support_radius)| {
                (p, kernel.weight((p - x).norm(), support_radius), kernel.bandwidth(support_radius))
            })
            .collect();
        let total: f64 = reaching.iter().map(|(_, w, _)| w).sum();
        if total <= 0.0 {
            return None;
        }
        let mean = reaching.iter().map(|(p, w, _)| p * *w).sum::<Vector3<f64>>() / total;
        let bandwidth = reaching.iter().map(|(_, w, h)| w * h).sum::<f64>() / total;
        let spread = |(p, w, _): &(Vector3<f64>, f64, f64)| (p - mean) * (p - mean).transpose() * *w;
        let covariance = reaching.iter().map(spread).sum::<Matrix3<f64>>() / total;

        let eigen = symmetric_eigen(&covariance);
        let normal = with_greatest_component_positive(eigen.vectors[0].into());
        let support = reaching.len();
        let is_near = (self.points.iter().zip(&self.radii))
            .any(|(&p, &r)| (Vector3::from(p) - x).norm() <= 0.5 * reach * r);
        Some(Evaluation {
            value: normal.dot(&(mean - x)),
            normal: normal.into(),
            centroid: mean.into(),
            support,
            bandwidth,
            eigenvalues: eigen.values,
            status: if support < self.parameters.least_support || !is_near {
                Status::Outside
            } else {
                status((x - mean).norm(), bandwidth, eigen.values)
            },
        })
    }
}

/// Returns the status by the conditions other than support. Points without extent are no sheet.
fn status(offset: f64, h: f64, [l1, l2, l3]: [f64; 3]) -> Status {
    let trace = l1 + l2 + l3;
    if offset > BORDER * h {
        Status::Border
    } else if trace <= 0.0 || l1 / (0.5 * h * h) >= THIN || (l2 - l1) / trace <= GAP {
        Status::Ambiguous
    } else {
        Status::Ok
    }
}

fn with_greatest_component_positive(n: Vector3<f64>) -> Vector3<f64> {
    let mut greatest = 0;
    for k in 1..3 {
        if n[k].abs() > n[greatest].abs() {
            greatest = k;
        }
    }
    if n[greatest] < 0.0 { -n } else { n }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::{Sampling, patch, plates, sphere};

    const KERNELS: [Kernel; 2] = [Kernel::Gaussian { theta: 1e-5 }, Kernel::Wendland];

    /// Returns a twin whose points all have bandwidth `h`.
    fn with_bandwidth(points: &[[f64; 3]], kernel: Kernel, h: f64) -> SurfaceTwin {
        let parameters = Parameters {
            reach: 1.0 / kernel.bandwidth(1.0),
            kernel,
            bandwidth: Bandwidth::Local,
            least_support: 6,
        };
        SurfaceTwin::with_radii(points, &vec![h; points.len()], parameters)
    }

    fn at(twin: &SurfaceTwin, x: [f64; 3]) -> Evaluation {
        twin.evaluate(x).unwrap()
    }

    #[test]
    fn on_a_plane_f_is_the_height_and_h_the_spread() {
        let points = patch(2.0, 2.0).sample(Sampling::clean(0.02)).points;
        for kernel in KERNELS {
            let twin = with_bandwidth(&points, kernel, 0.2);
            for z in [-0.11, -0.01, 0.0, 0.1] {
                let e = at(&twin, [0.013, 0.1, z]);
                assert!((e.value + z).abs() < 1e-12, "{kernel:?} at {z}: {e:?}");
                assert!((e.normal[2] - 1.0).abs() < 1e-12, "{kernel:?}: {e:?}");
                assert!((e.bandwidth - 0.2).abs() < 1e-12, "{kernel:?}: {e:?}");
                assert_eq!(e.status, Status::Ok, "{kernel:?} at {z}: {e:?}");
            }
            let [_, l2, l3] = at(&twin, [0.013, 0.1, 0.0]).eigenvalues;
            for l in [l2, l3] {
                assert!((l / 0.02 - 1.0).abs() < 2e-3, "{kernel:?}: h²/2 = 0.02, not {l}");
            }
        }
    }

    #[test]
    fn a_sphere_shrinks_by_half_h_squared_times_its_mean_curvature() {
        for (h, spacing, bias) in [(0.05, 0.015, 0.00125), (0.1, 0.025, 0.00503), (0.2, 0.04, 0.0204)] {
            let points = sphere(1.0).sample(Sampling::clean(spacing)).points;
            let twin = with_bandwidth(&points, Kernel::Gaussian { theta: 1e-7 }, h);
            let direction = Vector3::new(0.48, 0.6, 0.64);
            let value = |t: f64| at(&twin, (t * direction).into()).value;
            let (mut low, mut high) = (0.95, 1.02);
            let outside = value(high).signum();
            assert!(value(low).signum() != outside, "a zero between");
            for _ in 0..40 {
                let middle = 0.5 * (low + high);
                if value(middle).signum() == outside {
                    high = middle;
                } else {
                    low = middle;
                }
            }
            let found = 1.0 - low;
            assert!((found / bias - 1.0).abs() < 0.03, "h = {h}: {found}, not {bias}");
        }
    }

    #[test]
    fn a_straight_border_lies_at_0_53_to_0_564_h() {
        let points = patch(2.0, 2.0).sample(Sampling::clean(0.02)).points;
        let h = 0.2;
        let twin = with_bandwidth(&points, Kernel::Gaussian { theta: 1e-7 }, h);
        for (t, expected) in [(0.0, 0.55), (1.0, 1.28), (2.0, 2.17), (3.0, 3.11)] {
            let x = Vector3::new(1.0 + t * h, 0.0, 0.0);
            let e = at(&twin, x.into());
            let offset = (Vector3::from(e.centroid) - x).norm() / h;
            assert!((offset - expected).abs() < 0.03, "{t} h beyond: {offset} h");
            assert!(e.value.abs() < 1e-12, "f does not see the border");
        }
        assert_eq!(at(&twin, [0.99, 0.0, 0.0]).status, Status::Ok);
        assert_eq!(at(&twin, [1.02, 0.0, 0.0]).status, Status::Border);
    }

    #[test]
    fn between_two_sheets_the_surface_is_ambiguous() {
        let h = 0.1;
        let points = plates(1.0, 1.0, 2.0 * h).sample(Sampling::clean(0.02)).points;
        let twin = with_bandwidth(&points, Kernel::Gaussian { theta: 1e-7 }, h);
        let middle = at(&twin, [0.0; 3]);
        assert!(middle.value.abs() < 1e-9, "f vanishes in the middle: {middle:?}");
        assert_eq!(middle.status, Status::Ambiguous, "{middle:?}");
        let [l1, ..] = middle.eigenvalues;
        assert!((l1 / (0.5 * h * h) - 1.0).abs() < 0.1, "{middle:?}");
        let sheet = at(&twin, [0.0, 0.0, 0.098]);
        assert_eq!(sheet.status, Status::Ok, "{sheet:?}");
        assert!((sheet.eigenvalues[0] / (0.5 * h * h) - 0.14).abs() < 0.02, "{sheet:?}");
    }

    #[test]
    fn away_from_the_points_there_is_no_surface() {
        let points = patch(1.0, 1.0).sample(Sampling::clean(0.1)).points;
        let twin = SurfaceTwin::new(
            &points,
            Parameters {
                reach: 3.0,
                kernel: Kernel::Wendland,
                bandwidth: Bandwidth::Global,
                least_support: 6,
            },
        );
        assert!(twin.radii().iter().all(|r| *r == twin.radii()[0]), "one for all");
        let support_radius = 3.0 * twin.radii()[0];
        assert_eq!(twin.evaluate([0.0, 0.0, support_radius]), None, "the support ball is open");
        let rim = twin.evaluate([0.0, 0.0, 0.999 * support_radius]).unwrap();
        assert!(rim.support < 6 && rim.status == Status::Outside, "{rim:?}");
        assert_eq!(twin.points().len(), points.len());
    }

    #[test]
    fn local_bandwidth_follows_the_density() {
        let mut points = patch(2.0, 2.0).sample(Sampling::clean(0.05)).points;
        points.retain(|p| p[0] < 0.0);
        let coarse = patch(2.0, 2.0).sample(Sampling::clean(0.2)).points;
        points.extend(coarse.into_iter().filter(|p| p[0] >= 0.0));
        let parameters =
            Parameters { reach: 3.0, kernel: KERNELS[0], bandwidth: Bandwidth::Local, least_support: 6 };
        let twin = SurfaceTwin::new(&points, parameters);
        let h = |x: f64| at(&twin, [x, 0.0, 0.0]).bandwidth;
        assert!(h(0.8) > 2.5 * h(-0.7), "{} {}", h(0.8), h(-0.7));
        assert!(h(0.1) < h(0.8) && h(0.1) > h(-0.7), "in between at the seam");
    }
}
