//! f' of a node compared with a naive implementation of f over its samples with one bandwidth.

use nearmiss_geometry::{NodeId, PointCloud};
use nearmiss_hierarchy::{BuildOptions, GatherScratch, PointHierarchy};
use nearmiss_surface::{Bandwidth, Kernel, Status, SurfaceOptions};
use nearmiss_testdata::arbitrary::{self, CloudKind};
use nearmiss_testdata::oracle::{self, Parameters, SurfaceTwin};

#[test]
fn f_of_a_node_equals_the_twin_over_its_samples() {
    let (mut compared, mut ok) = (0, 0);
    for kernel in [Kernel::Gaussian, Kernel::Wendland] {
        for bandwidth in [Bandwidth::Local, Bandwidth::Global, Bandwidth::Fixed(0.1)] {
            let surface = SurfaceOptions::default().with_kernel(kernel).with_bandwidth(bandwidth);
            let cloud = PointCloud::from_positions(&arbitrary::cloud(CloudKind::Sphere, 1500, 3)).unwrap();
            let options = BuildOptions::default().with_surface(surface);
            let scan = PointHierarchy::build(&cloud, &options).unwrap();
            let (mut scratch, mut random) = (GatherScratch::default(), arbitrary::rng(8));
            for id in (0..scan.topology().len()).step_by(3) {
                let arrays = scan.arrays();
                let points = scan.topology().points(NodeId(u32::try_from(id).unwrap()));
                let count = points.len() as f64;
                let samples: Vec<usize> = arrays.samples(id).iter().collect();
                // Eq. 10 and 9 of Klein & Zachmann 2004.
                let thinning = (count / samples.len() as f64).sqrt();
                let squares = arrays.radii[points].iter().map(|&r| f64::from(r).powi(2)).sum::<f64>();
                let reach = match kernel {
                    Kernel::Wendland => 7.2_f64.sqrt(),
                    _ => (-(1e-4_f64).ln()).sqrt(),
                };
                let h = thinning
                    * match bandwidth {
                        Bandwidth::Global => 3.0 * f64::from(arrays.sampling_radius) / reach,
                        Bandwidth::Fixed(h) => h,
                        _ => 3.0 * (squares / count).sqrt() / reach,
                    };
                assert!((f64::from(arrays.node_bandwidth(id)) / h - 1.0).abs() < 1e-5, "node {id}: {h}");
                assert!(
                    (f64::from(arrays.node_support_radius(id)) / (h * reach) - 1.0).abs() < 1e-5,
                    "node {id}"
                );
                let points: Vec<[f64; 3]> =
                    samples.iter().map(|&i| scan.positions()[i].map(f64::from)).collect();
                let kernel = match kernel {
                    Kernel::Wendland => oracle::Kernel::Wendland,
                    _ => oracle::Kernel::Gaussian { theta: 1e-4 },
                };
                let parameters =
                    Parameters { reach: 3.0, kernel, bandwidth: oracle::Bandwidth::Local, least_support: 6 };
                let twin = SurfaceTwin::with_radii(&points, &vec![h * reach / 3.0; points.len()], parameters);
                for p in &points[..4] {
                    let away = arbitrary::point_in(&mut random, 0.7 * h);
                    let x = [0, 1, 2].map(|k| p[k] + away[k]);
                    let found = scan.evaluate_node_with(id, x, &mut scratch);
                    let Some(expected) = twin.evaluate(x) else { continue };
                    if found.status == Status::Ok && expected.status == oracle::Status::Ok {
                        let error = (found.f.abs() - expected.value.abs()).abs();
                        assert!(error < 1e-4 * h, "node {id} at {x:?}: {} and {}", found.f, expected.value);
                        ok += 1;
                    }
                    compared += 1;
                }
            }
        }
    }
    assert!(compared > 1000 && 4 * ok > compared, "{ok} of {compared}");
}
