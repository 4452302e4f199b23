//! Adding noise to a scan.

use nearmiss::geometry::nalgebra::Vector3;
use nearmiss::{BuildOptions, PointCloud, PointHierarchy, Scan};
use nearmiss_testdata::arbitrary::{gaussian, rng};

use crate::repository::Outcome;

/// Distance from a point of a square lattice to its sixth neighbour, its local radius, in spacings.
const SIXTH: f64 = std::f64::consts::SQRT_2;

/// Moves the points of `clean`, in its stored frame, along their normals by a normally distributed
/// distance, and preprocesses them with default options. The standard deviation is `noise` times
/// the local spacing. The new stored frame may have another origin, but has the same unit, because
/// stored positions need no other.
pub(crate) fn roughened(clean: &PointHierarchy, noise: f64, seed: u64) -> Outcome<Scan> {
    let rng = &mut rng(seed);
    let arrays = clean.arrays();
    let moved = clean.positions().iter().zip(arrays.normals).zip(arrays.radii).map(|((p, n), r)| {
        let along = Vector3::from(n.map(f64::from));
        let shift = noise * f64::from(*r) / SIXTH * gaussian(rng);
        <[f64; 3]>::from(Vector3::from(p.map(f64::from)) + shift * along)
    });
    let cloud = PointCloud::cleaned(&moved.collect::<Vec<_>>())?;
    Ok(Scan::build(&cloud, &BuildOptions::default())?)
}
