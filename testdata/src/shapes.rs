//! Shapes with exactly known surfaces, and samplings of them.
//!
//! A [`Form`] is a union of primitive surfaces: two-sided, without inside. A [`Shape`] is a form
//! with points sampled from it. Points of a noise-free shape are on the form up to rounding. Where
//! the form ends (the rim of a bowl, the edge of a patch), there are points on the end itself, so
//! that the samples end where the truth does.
//!
//! Random numbers are the same on every platform; sines and logarithms may differ in their last
//! bit.

mod form;
mod forms;
mod mesh;
mod primitive;
mod sampling;

pub use form::Form;
pub use forms::{avatar, bars, bowl, building, cuboid, field, patch, plates, shells, sphere, step, torus};
pub use primitive::Primitive;
pub use sampling::{Order, Sampling, scorer_radius};

/// A form with points sampled from it.
#[derive(Debug, Clone, PartialEq)]
pub struct Shape {
    /// The exact surface.
    pub form: Form,
    /// The parameters of the sampling.
    pub sampling: Sampling,
    /// The samples.
    pub points: Vec<[f64; 3]>,
}

impl Form {
    /// Samples the form.
    #[must_use]
    pub fn sample(self, sampling: Sampling) -> Shape {
        let points = sampling::points(&self, &sampling);
        Shape { form: self, sampling, points }
    }
}

impl Shape {
    /// Returns the exact distance of `x` to the form, regardless of the noise of the points.
    #[must_use]
    pub fn distance(&self, x: [f64; 3]) -> f64 {
        self.form.distance(x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arbitrary::{point_in, rng};
    use crate::oracle;
    use rand::RngExt;

    fn forms() -> Vec<Form> {
        vec![
            sphere(1.0),
            torus(1.0, 0.4),
            bowl(1.0),
            avatar(1.6, 0.3),
            patch(2.0, 1.5),
            plates(1.0, 1.0, 0.2),
            step(1.0, 0.5, 1.2),
            cuboid([1.0, 0.8, 0.6]),
            shells(0.5, 1.0),
            field([2, 2, 2], 1.0, 0.35),
            bars(2, 1.2, 0.4),
            building(),
        ]
    }

    fn noisy(order: Order, noise: f64) -> Sampling {
        Sampling { spacing: 0.1, noise, order, seed: 4 }
    }

    #[test]
    fn clean_points_lie_on_the_form_and_noise_is_as_large_as_asked() {
        for form in forms() {
            for order in [Order::Regular, Order::Random] {
                let name = form.name;
                let clean = form.clone().sample(noisy(order, 0.0));
                let off = |shape: &Shape| shape.points.iter().map(|&p| shape.distance(p)).collect::<Vec<_>>();
                let greatest = off(&clean).into_iter().fold(0.0, f64::max);
                assert!(greatest < 1e-12, "{name}, {order:?}: {greatest} off");
                let rough = form.clone().sample(noisy(order, 0.2));
                let square: f64 = off(&rough).iter().map(|d| d * d).sum();
                let deviation = (square / oracle::count(rough.points.len())).sqrt();
                // Near edges another face may be nearer, which only shortens distances.
                assert!((0.016..0.022).contains(&deviation), "{name}, {order:?}: {deviation}");
                assert_eq!(rough, form.clone().sample(noisy(order, 0.2)), "{name} depends on the seed only");
            }
        }
    }

    #[test]
    fn every_place_of_the_form_is_sampled_and_no_two_points_coincide() {
        let rng = &mut rng(9);
        for form in forms() {
            for order in [Order::Regular, Order::Random] {
                let shape = form.clone().sample(noisy(order, 0.0));
                let area: f64 = form.parts.iter().map(Primitive::area).sum();
                let density = oracle::count(shape.points.len()) * 0.01 / area;
                assert!(
                    (0.7..1.6).contains(&density),
                    "{}, {order:?}: {density} points per spacing²",
                    form.name
                );
                for _ in 0..300 {
                    let part = form.parts[rng.random_range(0..form.parts.len())];
                    let x = part.random_point(rng);
                    let (_, d) = oracle::nearest(&shape.points, x).unwrap();
                    assert!(d < 0.16, "{}, {order:?}: a hole at {x:?}, {d}", form.name);
                }
                let raw = oracle::spacing(&shape.points);
                let r = scorer_radius(&shape.points);
                assert!((0.11..0.21).contains(&r), "{}, {order:?}: r = {r}", form.name);
                assert!(raw.iter().all(|x| *x > 0.0), "no spacing is zero");
            }
        }
    }

    #[test]
    fn distances_agree_with_a_dense_sampling() {
        let rng = &mut rng(10);
        for form in forms() {
            let dense = form.clone().sample(Sampling::clean(0.03));
            for _ in 0..60 {
                let x = point_in(rng, 2.0);
                let exact = form.distance(x);
                let (_, sampled) = oracle::nearest(&dense.points, x).unwrap();
                assert!(exact <= sampled + 1e-12, "{}: {exact} above {sampled}", form.name);
                // A sample is within 0.03 of the foot, without cancellation for distant x.
                assert!(sampled <= exact.hypot(0.03) + 0.03 * 0.5, "{}: {exact}, {sampled}", form.name);
            }
        }
    }

    #[test]
    fn the_scorers_radius_is_the_brute_force_one() {
        for form in forms() {
            for order in [Order::Regular, Order::Random] {
                let points = form.clone().sample(noisy(order, 0.1)).points;
                let sixth = |p: &[f64; 3]| {
                    let away = |q: &[f64; 3]| (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt();
                    let mut all: Vec<f64> = points.iter().map(away).collect();
                    all.sort_unstable_by(f64::total_cmp);
                    // The first is the point itself.
                    all[6]
                };
                let all: Vec<f64> = points.iter().map(sixth).collect();
                let naive = oracle::quantile(&all, 0.9);
                let mut points = points.clone();
                points.extend_from_within(..points.len() / 2);
                let r = scorer_radius(&points);
                assert!((r - naive).abs() < 1e-12, "{}: {r}, naive {naive}", form.name);
            }
        }
    }

    #[test]
    fn the_grid_takes_as_many_points_as_wanted() {
        let form = bars(6, 1.0, 0.3);
        let spacing = form.spacing_for(20_000);
        let n = form.sample(Sampling::clean(spacing)).points.len();
        assert!((18_000..23_000).contains(&n), "{n} points");
    }
}
