//! Random pairs of triangles, most of them in special position.

use nearmiss_mesh::Corners;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

pub(crate) type Random = Xoshiro256PlusPlus;

pub(crate) fn random(seed: u64) -> Random {
    Random::seed_from_u64(seed)
}

/// Corners on a lattice of integers from 0 to `most`.
pub(crate) fn on_lattice(rng: &mut Random, most: i32) -> Corners {
    [(); 3].map(|()| [(); 3].map(|()| f64::from(rng.random_range(0..=most))))
}

/// Lattice triangles, the second often in the plane of the first, or sharing corners with it.
pub(crate) fn lattice_pair(rng: &mut Random) -> [Corners; 2] {
    let most = rng.random_range(1..=5);
    let (a, mut b) = (on_lattice(rng, most), on_lattice(rng, most));
    match rng.random_range(0..8) {
        // In the plane of the first: integer combinations of its edges.
        0 | 1 => {
            for p in &mut b {
                let [s, t] = [(); 2].map(|()| f64::from(rng.random_range(-2..=3)));
                *p = [0, 1, 2].map(|k| a[0][k] + s * (a[1][k] - a[0][k]) + t * (a[2][k] - a[0][k]));
            }
        }
        2 => b[0] = a[2],
        3 => [b[0], b[1]] = [a[2], a[0]],
        // Segments and points.
        4 => b[2] = b[1],
        5 => b = if rng.random() { [b[0]; 3] } else { [b[0], b[1], b[0]] },
        _ => {}
    }
    [a, b]
}

/// Places that are not representable, on corners, edges and faces of a random triangle up to
/// rounding.
pub(crate) fn nearly_touching(rng: &mut Random) -> [Corners; 2] {
    let size = [1.0, 1e6, 1e-6][rng.random_range(0..3)];
    let shift = [0.0, 1.0, 1e6, 1e-6][rng.random_range(0..4)];
    let place = |rng: &mut Random| [(); 3].map(|()| shift + size * rng.random::<f64>());
    let mut a = [(); 3].map(|()| place(rng));
    match rng.random_range(0..4) {
        // A needle.
        0 => a[2] = mixed(&a, [0.3, 0.7, 0.0]),
        // Aligned with an axis.
        1 => (a[1][0], a[2][0]) = (a[0][0], a[0][0]),
        _ => {}
    }
    let mut b = [(); 3].map(|()| place(rng));
    let touching = rng.random_range(0..=3);
    for p in &mut b[..touching] {
        let mut weights = [(); 3].map(|()| f64::from(rng.random_range(-2..=4)) * rng.random::<f64>());
        weights[rng.random_range(0..3)] = 0.0;
        let sum: f64 = weights.iter().sum();
        if sum.abs() > 0.1 {
            *p = mixed(&a, weights.map(|w| w / sum));
        }
        if rng.random() {
            let k = rng.random_range(0..3);
            p[k] = if rng.random() { p[k].next_up() } else { p[k].next_down() };
        }
    }
    if rng.random_range(0..8) == 0 {
        b[2] = mixed(&b, [0.5, 0.5, 0.0]);
    }
    [a, b]
}

pub(crate) fn mixed(t: &Corners, weights: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|k| (0..3).map(|i| weights[i] * t[i][k]).sum())
}

/// The greatest magnitude of a coordinate.
pub(crate) fn magnitude(pair: &[Corners; 2]) -> f64 {
    pair.iter().flatten().flatten().fold(0.0, |most, x| x.abs().max(most))
}

/// The greatest difference of coordinates.
pub(crate) fn extent(pair: &[Corners; 2]) -> f64 {
    let side = |k: usize| {
        let along = pair.iter().flatten().map(|p| p[k]);
        along.clone().fold(f64::MIN, f64::max) - along.fold(f64::MAX, f64::min)
    };
    side(0).max(side(1)).max(side(2))
}

/// x · 2^`exponent`; exact if the result is representable.
pub(crate) fn power_scaled(x: f64, exponent: i32) -> f64 {
    x * 2.0_f64.powi(exponent / 2) * 2.0_f64.powi(exponent - exponent / 2)
}

/// Sorts points by their coordinates.
pub(crate) fn sorted<const N: usize>(mut points: [[f64; 3]; N]) -> [[f64; 3]; N] {
    let order = |a: &f64, b: &f64| (a + 0.0).total_cmp(&(b + 0.0));
    points.sort_by(|a, b| order(&a[0], &b[0]).then(order(&a[1], &b[1])).then(order(&a[2], &b[2])));
    points
}
