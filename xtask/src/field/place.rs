//! f at a place, with the covariance about either centre.
//!
//! Klein & Zachmann 2004 centre the covariance at a(x) (eq. 4), where others had centred it at x.
//! So does nearmiss; the covariance about x is computed here only, to show the difference. Sums are
//! in double precision, over the points that have x within their support radius. A descent of this
//! module finds them.

use nearmiss::PointHierarchy;
use nearmiss::geometry::NodeId;
use nearmiss::geometry::nalgebra::Vector3;
use nearmiss::surface::symmetric_eigen;

/// The centre of the covariance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Centre {
    /// x itself.
    Point,
    /// The weighted mean a(x).
    Mean,
}

impl Centre {
    pub(crate) const BOTH: [Self; 2] = [Self::Point, Self::Mean];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Point => "x",
            Self::Mean => "a(x)",
        }
    }
}

/// Weighted moments of the points about x, in the stored frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Place {
    /// a(x) − x.
    pub(crate) offset: Vector3<f64>,
    /// Mean of (p−x)(p−x)ᵀ as xx xy xz yy yz zz.
    second: [f64; 6],
    /// h(x), the weighted mean of the points' bandwidths.
    pub(crate) bandwidth: f64,
}

impl Place {
    /// Returns the place `x` of a scan. `None` if too few points support x, so that f is undefined
    /// (eq. 6).
    pub(crate) fn new(scan: &PointHierarchy, x: Vector3<f64>) -> Option<Self> {
        let (plan, arrays) = (scan.plan(), scan.arrays());
        let [mut weight, mut bandwidth, mut support] = [0.0, 0.0, 0.0];
        let (mut first, mut second) = (Vector3::zeros(), [0.0; 6]);
        #[expect(clippy::cast_possible_truncation, reason = "boxes are single precision; see the slack")]
        let near = [x.x as f32, x.y as f32, x.z as f32];
        let (tree, mut stack) = (arrays.tree, vec![NodeId::ROOT]);
        let topology = tree.topology();
        while let Some(id) = stack.pop() {
            let bounds = tree.bounds(id);
            let reach = plan.support_radius(bounds.reach) * (1.0 + 1e-4);
            if bounds.distance_sq(near) > reach * reach {
                continue;
            }
            if !topology.is_leaf(id) {
                stack.extend(topology.children(id).iter());
                continue;
            }
            for i in topology.points(id) {
                let d = Vector3::from(arrays.position(i).map(f64::from)) - x;
                let support_radius = f64::from(plan.support_radius(arrays.radii[i]));
                let share = d.norm_squared() / (support_radius * support_radius);
                if share < 1.0 {
                    #[expect(clippy::cast_possible_truncation, reason = "the kernel is single precision")]
                    let w = f64::from(plan.kernel().weight(plan.reach_sq() * share as f32));
                    support += 1.0;
                    weight += w;
                    bandwidth += w * f64::from(plan.bandwidth(arrays.radii[i]));
                    first += w * d;
                    let products = [d.x * d.x, d.x * d.y, d.x * d.z, d.y * d.y, d.y * d.z, d.z * d.z];
                    for (sum, product) in second.iter_mut().zip(products) {
                        *sum += w * product;
                    }
                }
            }
        }
        let enough = support >= f64::from(plan.options().support_min) && weight > 0.0;
        enough.then(|| Self {
            offset: first / weight,
            second: second.map(|s| s / weight),
            bandwidth: bandwidth / weight,
        })
    }

    /// Returns n(x), of unit length; its sign is arbitrary.
    pub(crate) fn normal(&self, centre: Centre) -> Vector3<f64> {
        let a = match centre {
            Centre::Point => Vector3::zeros(),
            Centre::Mean => self.offset,
        };
        let [xx, xy, xz, yy, yz, zz] = self.second;
        let covariance =
            [xx - a.x * a.x, xy - a.x * a.y, xz - a.x * a.z, yy - a.y * a.y, yz - a.y * a.z, zz - a.z * a.z];
        symmetric_eigen(covariance).vectors[0].into()
    }
}

#[cfg(test)]
mod tests {
    use nearmiss::{BuildOptions, PointCloud, Scan};
    use nearmiss_testdata::arbitrary::{point_in, rng};
    use nearmiss_testdata::shapes::{Sampling, plates};

    use super::*;

    #[test]
    fn about_the_mean_it_is_the_librarys_f() {
        let points = plates(1.0, 1.0, 0.1).sample(Sampling { noise: 0.1, ..Sampling::clean(0.05) }).points;
        let cloud = PointCloud::from_positions(&points).unwrap();
        let scan = Scan::build(&cloud, &BuildOptions::default()).unwrap();
        let rng = &mut rng(5);
        let (mut defined, mut sure) = (0, 0);
        for _ in 0..4000 {
            let x = point_in(rng, 0.6);
            let (place, library) = (Place::new(&scan, x.into()), scan.evaluate(x));
            let needed = scan.plan().options().support_min;
            assert_eq!(place.is_some(), library.support >= needed, "support at {x:?}");
            let Some(place) = place else { continue };
            defined += 1;
            let h = library.bandwidth;
            assert!((place.bandwidth - h).abs() < 1e-5 * h, "h at {x:?}");
            let [l1, l2, _] = library.eigenvalues;
            // Where two eigenvalues are nearly equal, rounding turns the vector.
            if l2 - l1 > 0.05 * h * h {
                sure += 1;
                let n = place.normal(Centre::Mean);
                let aligned = n * n.dot(&Vector3::from(library.normal)).signum();
                assert!((aligned.dot(&place.offset) - library.f).abs() < 1e-4 * h, "f at {x:?}");
            }
        }
        assert!(defined > 1000 && sure > 500, "{defined} defined, {sure} with a clear normal");
    }

    #[test]
    fn about_the_point_the_normal_turns_over_where_theory_says() {
        let points: Vec<[f64; 3]> =
            (0..3600).map(|i| [f64::from(i % 60) / 60.0, f64::from(i / 60) / 60.0, 0.0]).collect();
        let cloud = PointCloud::from_positions(&points).unwrap();
        let scan = Scan::build(&cloud, &BuildOptions::default()).unwrap();
        // At height z the covariance about x is diag(h²/2, h²/2, z²): the least is z² up to h/√2.
        let middle = Vector3::from(scan.frame().to_local([0.5, 0.5, 0.0]).map(f64::from));
        let h = Place::new(&scan, middle).unwrap().bandwidth;
        let tilt = |z: f64, centre| {
            let place = Place::new(&scan, middle + Vector3::new(0.0, 0.0, z * h)).unwrap();
            place.normal(centre).z.abs()
        };
        for z in [0.3, 0.5, 0.68] {
            assert!(tilt(z, Centre::Point) > 0.999, "upright at {z} h");
        }
        for z in [0.74, 0.9, 1.2] {
            assert!(tilt(z, Centre::Point) < 1e-3, "tangential at {z} h");
            assert!(tilt(z, Centre::Mean) > 0.999, "upright about the mean at {z} h");
        }
    }
}
