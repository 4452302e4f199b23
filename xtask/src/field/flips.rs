//! Counts how often n changes sides within h of a surface.
//!
//! A pair of places, 0.1 h apart, is near a cloud point p: within the local radius along the
//! tangent plane, and within h along the normal N, of the scan before noise. Both normals are
//! turned to the side of N. They flip if they still differ by more than a right angle. Then no sign
//! is right for both, and signs of f there do not distinguish sides. On a sheet smoother than h
//! there is no flip.

use nearmiss::geometry::nalgebra::Vector3;
use nearmiss::hierarchy::GatherScratch;
use nearmiss::{PointHierarchy, Status};
use nearmiss_testdata::arbitrary::{rng, unit_vector};
use rand::RngExt;
use rayon::prelude::*;

use super::place::{Centre, Place};

/// The distance of the places of a pair, in bandwidths.
const STEP: f64 = 0.1;

/// Pairs drawn from one source of random numbers.
const CHUNK: u64 = 1 << 12;

/// The counts.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Tally {
    /// Evaluations of f, two a pair, where it is defined by Klein & Zachmann 2004, eq. 6.
    pub(crate) evaluations: u64,
    /// Pairs that flip, with the covariance about x and about a(x).
    pub(crate) flips: [u64; 2],
    /// Evaluations in pairs whose places are both of status ok. Verdicts depend on f there.
    pub(crate) trusted: u64,
    /// Pairs that flip among these.
    pub(crate) trusted_flips: [u64; 2],
}

impl Tally {
    fn join(self, other: Self) -> Self {
        let both = |s: [u64; 2], t: [u64; 2]| [s[0] + t[0], s[1] + t[1]];
        Self {
            evaluations: self.evaluations + other.evaluations,
            flips: both(self.flips, other.flips),
            trusted: self.trusted + other.trusted,
            trusted_flips: both(self.trusted_flips, other.trusted_flips),
        }
    }

    /// Returns the flips per million evaluations: about x, about a(x).
    pub(crate) fn rates(&self) -> [f64; 2] {
        self.flips.map(|flips| per_million(flips, self.evaluations))
    }

    /// Returns the same where the status is ok.
    pub(crate) fn trusted_rates(&self) -> [f64; 2] {
        self.trusted_flips.map(|flips| per_million(flips, self.trusted))
    }

    /// Returns the share of evaluations in pairs of status ok.
    #[expect(clippy::cast_precision_loss, reason = "for people")]
    pub(crate) fn trusted_share(&self) -> f64 {
        self.trusted as f64 / self.evaluations.max(1) as f64
    }
}

#[expect(clippy::cast_precision_loss, reason = "for people")]
fn per_million(flips: u64, evaluations: u64) -> f64 {
    1e6 * flips as f64 / evaluations.max(1) as f64
}

/// Counts over `pairs` pairs about the points of `clean`, with the f of `rough`. The input of
/// `rough` is in the stored frame of `clean`.
pub(crate) fn count(clean: &PointHierarchy, rough: &PointHierarchy, pairs: u64, seed: u64) -> Tally {
    let chunks = pairs.div_ceil(CHUNK);
    let origin = Vector3::from(rough.frame().origin);
    let counted = (0..chunks).into_par_iter().map(|chunk| {
        let rng = &mut rng(seed ^ chunk.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let mut tally = Tally::default();
        let mut scratch = GatherScratch::default();
        for _ in chunk * CHUNK..pairs.min((chunk + 1) * CHUNK) {
            let p = rng.random_range(0..clean.len());
            let (places, up) = places(clean, p, rng);
            let places = places.map(|x| x - origin);
            tally = tally.join(look(rough, places, up, &mut scratch).unwrap_or_default());
        }
        tally
    });
    counted.reduce(Tally::default, Tally::join)
}

/// Returns two places near the `i`-th point, and its normal.
fn places(scan: &PointHierarchy, i: usize, rng: &mut impl rand::Rng) -> ([Vector3<f64>; 2], Vector3<f64>) {
    let (arrays, plan) = (scan.arrays(), scan.plan());
    let up = Vector3::from(arrays.normals[i].map(f64::from));
    let (r, h) = (f64::from(arrays.radii[i]), f64::from(plan.bandwidth(arrays.radii[i])));
    let direction = Vector3::from(unit_vector(rng));
    let along = (direction - up * up.dot(&direction)).try_normalize(1e-9).unwrap_or_default();
    // The root spreads the places evenly over the disc.
    let (out, height) = (rng.random_range(0.0_f64..1.0).sqrt() * r, rng.random_range(-h..h));
    let x = Vector3::from(arrays.position(i).map(f64::from)) + along * out + up * height;
    ([x, x + Vector3::from(unit_vector(rng)) * (STEP * h)], up)
}

/// Returns the counts of one pair; `None` if f is undefined at either place.
fn look(
    scan: &PointHierarchy,
    places: [Vector3<f64>; 2],
    up: Vector3<f64>,
    scratch: &mut GatherScratch,
) -> Option<Tally> {
    let (first, second) = (Place::new(scan, places[0])?, Place::new(scan, places[1])?);
    let flips = Centre::BOTH.map(|centre| {
        let [n, m] = [first, second].map(|place| {
            let n = place.normal(centre);
            if n.dot(&up) < 0.0 { -n } else { n }
        });
        u64::from(n.dot(&m) < 0.0)
    });
    let trusted = places.into_iter().all(|x| scan.evaluate_with(x.into(), scratch).status == Status::Ok);
    let (trusted, trusted_flips) = if trusted { (2, flips) } else { (0, [0; 2]) };
    Some(Tally { evaluations: 2, flips, trusted, trusted_flips })
}

#[cfg(test)]
mod tests {
    use nearmiss::{BuildOptions, PointCloud, Scan};
    use nearmiss_testdata::shapes::{Form, Sampling, patch, plates, sphere};

    use super::*;

    fn scan(form: Form, noise: f64) -> Scan {
        let points = form.sample(Sampling { noise, ..Sampling::clean(0.04) }).points;
        Scan::build(&PointCloud::from_positions(&points).unwrap(), &BuildOptions::default()).unwrap()
    }

    #[test]
    fn on_a_plane_and_a_sphere_about_the_mean_nothing_flips() {
        for form in [patch(2.0, 1.5), sphere(1.0)] {
            let name = form.name;
            let scan = scan(form, 0.0);
            let tally = count(&scan, &scan, 40_000, 1);
            assert!(tally.evaluations > 75_000, "{name}: {tally:?}");
            assert_eq!(tally.flips[1], 0, "{name}, about a(x)");
            // About x, the normal is tangential beyond h/√2, on 29 % of the way to h.
            let [about_point, _] = tally.rates();
            assert!((4_000.0..200_000.0).contains(&about_point), "{name}: {about_point} about x");
            // Where |x − a| ≤ 0.56 h it is not.
            assert_eq!(tally.trusted_flips, [0, 0], "{name}, where the status is ok");
            assert!(tally.trusted > 30_000, "{name}: {tally:?}");
        }
    }

    #[test]
    fn between_two_sheets_it_flips_and_only_there() {
        // The radius is √2 spacings, h nearly as much. So the sheets are 2 h apart, and n is
        // tangential midway.
        let gap = 0.113;
        let plates = scan(plates(1.5, 1.5, gap), 0.0);
        let h = f64::from(plates.plan().bandwidth(plates.radii()[0]));
        assert!((gap / h - 2.0).abs() < 0.3, "{} h apart", gap / h);
        let tally = count(&plates, &plates, 40_000, 1);
        assert!(tally.rates()[1] > 1000.0, "about a(x), midway: {tally:?}");
        assert_eq!(tally.trusted_flips[1], 0, "the midst is ambiguous: {tally:?}");
        let far = scan(nearmiss_testdata::shapes::plates(1.5, 1.5, 4.0 * gap), 0.0);
        assert_eq!(count(&far, &far, 40_000, 1).flips[1], 0, "8 h apart, neither supports f at the other");
    }

    #[test]
    fn the_count_depends_on_the_seed_and_not_on_threads() {
        let scan = scan(sphere(0.5), 0.3);
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| count(&scan, &scan, 20_000, 7))
        };
        assert_eq!(on(1), on(3));
        assert_ne!(on(1), count(&scan, &scan, 20_000, 8));
    }
}
