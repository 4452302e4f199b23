//! Seeded generators of clouds and poses for property tests: ordinary ones, and ones that break
//! trees, grids and fits.

use nearmiss_geometry::Pose;
use rand::{Rng, RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// The peculiarity of a cloud of [`cloud`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum CloudKind {
    /// No peculiarity: uniform in a cube of side 2.
    Random,
    /// Nine tenths of the points in a tenth of each axis: the density differs about a thousandfold.
    Clustered,
    /// A lattice without noise: many equal distances.
    Lattice,
    /// Rings of a spinning scanner on a floor: dense along, far apart across.
    Rings,
    /// All on one line, not parallel to an axis.
    Collinear,
    /// All on one plane, not parallel to two axes, up to rounding.
    Coplanar,
    /// All within a millionth of the distance from the origin.
    OneVoxel,
    /// Only three different values of x.
    EqualX,
    /// Two clusters, a million times their size apart.
    FarClusters,
    /// Every point several times, interleaved.
    Duplicates,
    /// [`CloudKind::Random`] times 1e12.
    Huge,
    /// [`CloudKind::Random`] times 1e-12.
    Tiny,
    /// A dense flat patch, and one point at a tenth of its size above it.
    Outlier,
    /// A noisy sphere of radius 1, the typical input of the implicit surface.
    Sphere,
}

impl CloudKind {
    /// Every kind once.
    pub const ALL: [Self; 14] = [
        Self::Random,
        Self::Clustered,
        Self::Lattice,
        Self::Rings,
        Self::Collinear,
        Self::Coplanar,
        Self::OneVoxel,
        Self::EqualX,
        Self::FarClusters,
        Self::Duplicates,
        Self::Huge,
        Self::Tiny,
        Self::Outlier,
        Self::Sphere,
    ];
}

/// Returns the random generator of this crate; its stream is the same on every platform.
#[must_use]
pub fn rng(seed: u64) -> Xoshiro256PlusPlus {
    Xoshiro256PlusPlus::seed_from_u64(seed)
}

/// Returns `n` finite points of a kind; the same for the same seed.
#[must_use]
pub fn cloud(kind: CloudKind, n: u32, seed: u64) -> Vec<[f64; 3]> {
    let rng = &mut rng(seed);
    match kind {
        CloudKind::Random => cube(rng, n, 1.0),
        CloudKind::Huge => cube(rng, n, 1e12),
        CloudKind::Tiny => cube(rng, n, 1e-12),
        CloudKind::Clustered => (0..n).map(|i| point_in(rng, if i % 10 == 0 { 1.0 } else { 0.1 })).collect(),
        CloudKind::Lattice => lattice(n),
        CloudKind::Rings => (0..n).map(|i| ring_point(rng, i)).collect(),
        CloudKind::Collinear => (0..n)
            .map(|_| {
                let t = rng.random_range(-1.0..1.0);
                [t, 2.0 * t + 1.0, 0.5 - 3.0 * t]
            })
            .collect(),
        CloudKind::Coplanar => (0..n)
            .map(|_| {
                let [x, y, _] = point_in(rng, 1.0);
                [x, y, 0.3 * x - 0.7 * y + 0.1]
            })
            .collect(),
        CloudKind::OneVoxel => (0..n).map(|_| point_in(rng, 1e-4).map(|x| 100.0 + x)).collect(),
        CloudKind::EqualX => (0..n)
            .map(|i| {
                let [_, y, z] = point_in(rng, 1.0);
                [f64::from(i % 3), y, z]
            })
            .collect(),
        CloudKind::FarClusters => (0..n)
            .map(|i| {
                let [x, y, z] = point_in(rng, 1.0);
                [x + if i % 2 == 0 { 0.0 } else { 1e6 }, y, z]
            })
            .collect(),
        CloudKind::Duplicates => {
            let distinct = cube(rng, n.div_ceil(3).max(1), 1.0);
            distinct.iter().cycle().zip(0..n).map(|(&p, _)| p).collect()
        }
        CloudKind::Outlier => (0..n)
            .map(|i| {
                let [x, y, _] = point_in(rng, 1.0);
                if i == 0 { [0.0, 0.0, 0.2] } else { [x, y, 0.0] }
            })
            .collect(),
        CloudKind::Sphere => (0..n)
            .map(|_| {
                let radius = 1.0 + 0.01 * gaussian(rng);
                unit_vector(rng).map(|x| radius * x)
            })
            .collect(),
    }
}

fn cube<R: Rng>(rng: &mut R, n: u32, half: f64) -> Vec<[f64; 3]> {
    (0..n).map(|_| point_in(rng, half)).collect()
}

/// Returns a point of the cube of half side `half` about the origin.
pub fn point_in<R: Rng>(rng: &mut R, half: f64) -> [f64; 3] {
    [0; 3].map(|_| half * rng.random_range(-1.0..1.0))
}

/// Returns the first `n` nodes of the smallest cubic lattice that has as many, a quarter apart.
fn lattice(n: u32) -> Vec<[f64; 3]> {
    let side = (1..).find(|s: &u32| s.saturating_pow(3) >= n).unwrap_or(1);
    let nodes = (0..side).flat_map(|x| (0..side).flat_map(move |y| (0..side).map(move |z| [x, y, z])));
    nodes.map(|node| node.map(|k| 0.25 * f64::from(k))).zip(0..n).map(|(p, _)| p).collect()
}

/// Returns a return of a scanner 1.8 above a flat floor with sixteen beams, 2° to 17° below the
/// horizon.
fn ring_point<R: Rng>(rng: &mut R, i: u32) -> [f64; 3] {
    let down = f64::from(2 + i % 16).to_radians();
    let reach = 1.8 / down.tan() + 0.01 * gaussian(rng);
    let (s, c) = rng.random_range(0.0..std::f64::consts::TAU).sin_cos();
    [reach * c, reach * s, 0.01 * gaussian(rng)]
}

/// Returns a uniformly distributed direction.
pub fn unit_vector<R: Rng>(rng: &mut R) -> [f64; 3] {
    // Cylinders of equal height cut off equal areas of the sphere (Archimedes).
    let z: f64 = rng.random_range(-1.0..1.0);
    let (s, c) = rng.random_range(0.0..std::f64::consts::TAU).sin_cos();
    let flat = (1.0 - z * z).sqrt();
    [flat * c, flat * s, z]
}

/// Returns a normally distributed number, mean 0, variance 1 (Marsaglia's polar method; its second
/// number is dropped).
pub fn gaussian<R: Rng>(rng: &mut R) -> f64 {
    loop {
        let (u, v): (f64, f64) = (rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0));
        let s = u * u + v * v;
        if s > 0.0 && s < 1.0 {
            return u * (-2.0 * s.ln() / s).sqrt();
        }
    }
}

/// Returns a uniformly distributed rotation about the origin (Shoemake, *Uniform random rotations*,
/// 1992).
pub fn rotation<R: Rng>(rng: &mut R) -> Pose {
    let share: f64 = rng.random_range(0.0..1.0);
    let (sin_a, cos_a) = rng.random_range(0.0..std::f64::consts::TAU).sin_cos();
    let (sin_b, cos_b) = rng.random_range(0.0..std::f64::consts::TAU).sin_cos();
    let (p, q) = ((1.0 - share).sqrt(), share.sqrt());
    Pose::from_quaternion([p * sin_a, p * cos_a, q * sin_b, q * cos_b])
}

/// Returns a uniform rotation, then a shift to a point of the cube of half side `spread`.
pub fn pose<R: Rng>(rng: &mut R, spread: f64) -> Pose {
    rotation(rng).with_translation(point_in(rng, spread))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::oracle;

    #[test]
    fn every_kind_gives_as_many_finite_points_as_asked_and_the_same_again() {
        for kind in CloudKind::ALL {
            for n in [1, 10, 501] {
                let points = cloud(kind, n, 3);
                assert_eq!(points.len(), n as usize, "{kind:?}");
                assert!(points.iter().flatten().all(|x| x.is_finite()), "{kind:?} is finite");
                assert_eq!(points, cloud(kind, n, 3), "{kind:?} depends on the seed only");
            }
            if kind != CloudKind::Lattice {
                assert_ne!(cloud(kind, 50, 1), cloud(kind, 50, 2), "{kind:?} depends on the seed");
            }
        }
    }

    #[test]
    fn kinds_are_what_they_say() {
        let of = |kind| cloud(kind, 800, 5);
        assert!(oracle::looks_like_a_line(&of(CloudKind::Collinear)), "a line");
        let raw = oracle::spacing(&of(CloudKind::Clustered));
        let range = oracle::quantile(&raw, 0.97) / oracle::quantile(&raw, 0.3);
        assert!(range > 5.0, "spacing differs by the cube root of a density ratio of some hundred: {range}");
        let mut distinct: Vec<_> = of(CloudKind::Duplicates).iter().map(|p| p.map(f64::to_bits)).collect();
        distinct.sort_unstable();
        distinct.dedup();
        assert_eq!(distinct.len(), 267);
        let mut xs: Vec<_> = of(CloudKind::EqualX).iter().map(|p| p[0].to_bits()).collect();
        xs.sort_unstable();
        xs.dedup();
        assert_eq!(xs.len(), 3);
    }

    #[test]
    fn rotations_leave_no_direction_out() {
        let rng = &mut rng(11);
        let mut sum = [0.0; 3];
        let mut squares = [0.0; 3];
        for _ in 0..4000 {
            let d = rotation(rng).rotate([0.0, 0.6, 0.8]);
            for k in 0..3 {
                sum[k] += d[k] / 4000.0;
                squares[k] += d[k] * d[k] / 4000.0;
            }
        }
        for k in 0..3 {
            assert!(sum[k].abs() < 0.04, "mean {sum:?}");
            assert!((squares[k] - 1.0 / 3.0).abs() < 0.03, "variance {squares:?}");
        }
    }

    #[test]
    fn gaussians_have_the_moments_of_one() {
        let rng = &mut rng(12);
        let xs: Vec<f64> = (0..20_000).map(|_| gaussian(rng)).collect();
        let moment = |k: i32| xs.iter().map(|x| x.powi(k)).sum::<f64>() / 20_000.0;
        assert!(moment(1).abs() < 0.03, "{}", moment(1));
        assert!((moment(2) - 1.0).abs() < 0.05, "{}", moment(2));
        assert!((moment(4) - 3.0).abs() < 0.3, "{}", moment(4));
    }
}
