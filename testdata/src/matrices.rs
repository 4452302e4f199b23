//! Symmetric 3×3 matrices, ordinary and adversarial, and errors of eigenpairs. Entries are in the
//! order xx xy xz yy yz zz.

use rand::{Rng, RngExt};

use crate::arbitrary::{gaussian, point_in, rng, rotation};

/// The peculiarity of a matrix.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Family {
    /// No peculiarity: entries uniform in −1…1.
    Random,
    /// Weighted covariance of points about a place on a noisy curved sheet.
    Neighbourhood,
    /// A multiple of the identity.
    Isotropic,
    /// A multiple of the identity, except for the last bits of its entries.
    NearlyIsotropic,
    /// Eigenvalues 0, 1, 1, rotated.
    Planar,
    /// Eigenvalues 0, 0, 1, rotated.
    Linear,
    /// v vᵀ.
    RankOne,
    /// Two eigenvalues one bit apart, on the diagonal or rotated.
    OneBit,
    /// Eigenvalues 1, 1 + d, 1 + e with d and e from 1e-16 to 1, rotated.
    Clustered,
    /// Zero outside the diagonal.
    Diagonal,
    /// Zeros, of either sign.
    Zero,
    /// Entries around 1e-30.
    Small,
    /// Entries around 1e30.
    Large,
    /// Entries that are subnormal numbers.
    Subnormal,
    /// Entries from 1e300 to the greatest finite number.
    Huge,
    /// Every entry with a magnitude of its own, 1e-300 to 1e300.
    Wide,
}

impl Family {
    /// All families.
    pub const ALL: [Self; 16] = [
        Self::Random,
        Self::Neighbourhood,
        Self::Isotropic,
        Self::NearlyIsotropic,
        Self::Planar,
        Self::Linear,
        Self::RankOne,
        Self::OneBit,
        Self::Clustered,
        Self::Diagonal,
        Self::Zero,
        Self::Small,
        Self::Large,
        Self::Subnormal,
        Self::Huge,
        Self::Wide,
    ];

    /// Returns `count` matrices of this family; the same for the same seed.
    #[must_use]
    pub fn matrices(self, count: u32, seed: u64) -> Vec<[f64; 6]> {
        let mut rng = rng(seed);
        (0..count).map(|i| self.matrix(&mut rng, i)).collect()
    }

    fn matrix<R: Rng>(self, rng: &mut R, i: u32) -> [f64; 6] {
        let some = |rng: &mut R| [0; 6].map(|_| rng.random_range(-1.0..1.0_f64));
        let power = |rng: &mut R, least: f64, most: f64| 10.0_f64.powf(rng.random_range(least..most));
        match self {
            Self::Random => some(rng),
            Self::Neighbourhood => neighbourhood(rng),
            Self::Isotropic => {
                let x = rng.random_range(-1.0..1.0);
                [x, 0.0, 0.0, x, 0.0, x]
            }
            Self::NearlyIsotropic => {
                let mut bits = || f64::from(rng.random_range(-3..4_i32)) * f64::EPSILON;
                [1.0 + bits(), bits(), bits(), 1.0 + bits(), bits(), 1.0 + bits()]
            }
            Self::Planar => turned(rng, [0.0, 1.0, 1.0]),
            Self::Linear => turned(rng, [0.0, 0.0, 1.0]),
            Self::RankOne => {
                let [x, y, z] = point_in(rng, 1.0);
                [x * x, x * y, x * z, y * y, y * z, z * z]
            }
            Self::OneBit => {
                let x: f64 = rng.random_range(0.5..1.0);
                let other = if i % 4 < 2 { 0.1 } else { 2.0 };
                let values = [x, x.next_up(), other];
                if i.is_multiple_of(2) {
                    [
                        values[i as usize % 3],
                        0.0,
                        0.0,
                        values[(i as usize + 1) % 3],
                        0.0,
                        values[(i as usize + 2) % 3],
                    ]
                } else {
                    turned(rng, values)
                }
            }
            Self::Clustered => {
                let (d, e) = (power(rng, -16.0, 0.0), power(rng, -16.0, 0.0));
                turned(rng, [1.0, 1.0 + d, 1.0 + e])
            }
            Self::Diagonal => {
                let [a, _, _, b, _, c] = some(rng);
                [a, 0.0, 0.0, b, 0.0, c]
            }
            Self::Zero => [0; 6].map(|_| if rng.random_range(0..2) == 0 { 0.0 } else { -0.0 }),
            Self::Small => some(rng).map(|x| x * 1e-30),
            Self::Large => some(rng).map(|x| x * 1e30),
            Self::Subnormal => {
                let scale = power(rng, -323.0, -308.0);
                some(rng).map(|x| x * scale)
            }
            Self::Huge => {
                let scale = if i.is_multiple_of(4) { f64::MAX } else { power(rng, 300.0, 308.0) };
                some(rng).map(|x| x * scale)
            }
            Self::Wide => some(rng).map(|x| x * power(rng, -300.0, 300.0)),
        }
    }
}

/// Returns a matrix with these eigenvalues in a random frame, to rounding.
fn turned<R: Rng>(rng: &mut R, values: [f64; 3]) -> [f64; 6] {
    let pose = rotation(rng);
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|axis| pose.rotate(axis));
    let entry = |i: usize, j: usize| (0..3).map(|k| values[k] * axes[k][i] * axes[k][j]).sum();
    [entry(0, 0), entry(0, 1), entry(0, 2), entry(1, 1), entry(1, 2), entry(2, 2)]
}

/// Returns the covariance of 30 points of a noisy paraboloid with Gaussian weights, randomly
/// rotated.
fn neighbourhood<R: Rng>(rng: &mut R) -> [f64; 6] {
    let pose = rotation(rng);
    let (bend, noise) = (rng.random_range(-0.5..0.5), rng.random_range(0.0..0.05));
    let (mut weight, mut first, mut second) = (0.0, [0.0; 3], [0.0; 6]);
    for _ in 0..30 {
        let [x, y, _] = point_in(rng, 2.0);
        let z = bend * (x * x + 0.5 * y * y) + noise * gaussian(rng);
        let w = (-(x * x + y * y + z * z)).exp();
        let [x, y, z] = pose.rotate([x, y, z]);
        weight += w;
        first = [first[0] + w * x, first[1] + w * y, first[2] + w * z];
        for (sum, product) in second.iter_mut().zip([x * x, x * y, x * z, y * y, y * z, z * z]) {
            *sum += w * product;
        }
    }
    let [x, y, z] = first.map(|s| s / weight);
    let [xx, xy, xz, yy, yz, zz] = second.map(|s| s / weight);
    [xx - x * x, xy - x * y, xz - x * z, yy - y * y, yz - y * z, zz - z * z]
}

/// Returns the largest component of B n − λ n over the largest entry of B. NaN if anything is NaN;
/// 0 if B and λ are 0.
///
/// Errors up to the last bit of a subnormal λ do not count. If the eigenvalue is beyond the range
/// of `f64`, the end of the range is the best possible value. It is right if B n points along n and
/// is at least as long.
#[must_use]
pub fn residual(matrix: [f64; 6], value: f64, vector: [f64; 3]) -> f64 {
    /// The least positive number.
    const LEAST: f64 = 5e-324;
    let largest = matrix.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    // In two steps, because the inverse of a subnormal number is out of range.
    let first = if largest < 1e-290 { 1e200 } else { 1.0 };
    let relative = |x: f64| if largest > 0.0 { x * first / (largest * first) } else { x };
    let [xx, xy, xz, yy, yz, zz] = matrix.map(relative);
    let [x, y, z] = vector;
    let image = [xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z];
    let along = image[0] * x + image[1] * y + image[2] * z;
    let at_end = value.abs() >= f64::MAX && value.is_finite() && along / relative(value) > 1.0;
    let value = if at_end { along } else { relative(value) };
    let errors = [0, 1, 2].map(|k| (image[k] - value * vector[k]).abs());
    // Not f64::max, which skips NaN.
    let worst = errors.into_iter().fold(0.0, |worst, error| if error <= worst { worst } else { error });
    if worst.is_nan() { worst } else { (worst - relative(LEAST)).max(0.0) }
}

/// Returns the largest difference of the dot products of three vectors from those of a frame, NaN
/// if any is NaN.
#[must_use]
pub fn orthogonality_error(vectors: [[f64; 3]; 3]) -> f64 {
    let mut worst = 0.0_f64;
    for i in 0..3 {
        for j in 0..3 {
            let dot: f64 = (0..3).map(|k| vectors[i][k] * vectors[j][k]).sum();
            let error = (dot - f64::from(u8::from(i == j))).abs();
            worst = if error > worst { error } else { worst + 0.0 * error };
        }
    }
    worst
}
