//! Bodies that fall onto the scan of a house come to rest where they do on its exact mesh.

#[path = "../examples/drop/world.rs"]
#[expect(dead_code, reason = "the example uses more of it")]
mod world;

use nearmiss::geometry::PointCloud;
use nearmiss::{BuildOptions, Scan};
use nearmiss_parry::ScanShape;
use nearmiss_testdata::house::{house, scanned, triangles};
use rapier3d::math::Vector;
use rapier3d::parry::query::{Ray, RayCast as _};
use rapier3d::parry::shape::{SharedShape, TriMesh};
use world::Drop;

/// The distance of neighbouring points.
const SPACING: f64 = 0.05;

/// The scanned house, its sampling radius, and its exact mesh.
fn grounds(noise: f64) -> (SharedShape, f64, TriMesh) {
    let quads = house();
    let points = scanned(&quads, SPACING, noise, 7);
    let cloud = PointCloud::from_positions(&points).expect("points");
    let scan = Scan::build(&cloud, &BuildOptions::default()).expect("a scan");
    let radius = scan.sampling_radius();
    let mesh = triangles(&quads);
    #[expect(clippy::cast_possible_truncation, reason = "single precision is meant")]
    let vertices = mesh.vertices().iter().map(|v| Vector::from_array(v.map(|c| c as f32))).collect();
    let exact = TriMesh::new(vertices, mesh.triangles().to_vec()).expect("a mesh");
    (ScanShape::new(scan).expect("for shapes").shared(), radius, exact)
}

/// Places above both floors and the stairs, and a metre from one another.
fn places() -> Vec<[f32; 3]> {
    let lattice = |x0: f32, y0: f32, z: f32, columns: u8, rows: u8| {
        let place = move |k: u8| [x0 + f32::from(k % columns), y0 + f32::from(k / columns), z];
        (0..columns * rows).map(place)
    };
    lattice(1.3, 1.2, 1.2, 4, 5).chain(lattice(8.0, 7.3, 4.0, 6, 4)).collect()
}

/// The height of the surface of `exact` below a place.
fn floor_below(exact: &TriMesh, place: Vector) -> Option<f32> {
    let ray = Ray::new(place, Vector::new(0.0, 0.0, -1.0));
    exact.cast_local_ray(&ray, 100.0, true).map(|t| place.z - t)
}

#[test]
fn bodies_rest_on_a_scan_as_on_the_exact_mesh() {
    for noise in [0.0, 0.005] {
        let (scan, radius, exact) = grounds(noise);
        let places = places();
        let on = |ground: SharedShape| {
            let mut drop = Drop::new(ground, &places, 11);
            let start: f64 = drop.energy().iter().sum();
            let (mut deepest, mut most) = (0.0_f32, start);
            for step in 0..300 {
                drop.world.step();
                most = most.max(drop.energy().iter().sum());
                // The first contacts are those of a fall.
                if step > 200 {
                    deepest = deepest.max(drop.deepest());
                }
            }
            assert!(most <= start * 1.001, "energy rose from {start} to {most} J");
            (drop, f64::from(deepest))
        };
        let (ours, deepest) = on(scan.clone());
        let (theirs, _) = on(SharedShape::new(exact.clone()));
        assert!(deepest <= radius, "noise {noise}: {deepest} deep, {radius} allowed");
        let mut same = 0;
        for (a, b) in ours.positions().into_iter().zip(theirs.positions()) {
            let below = floor_below(&exact, a).expect("a body fell through the floor");
            assert!(a.z - below < 0.4, "noise {noise}: a body hangs at {a}, {below} is below");
            // Bodies that roll may end elsewhere.
            same += u32::from(f64::from((a.z - b.z).abs()) <= radius);
        }
        let count = u32::try_from(places.len()).expect("few");
        assert!(
            same * 10 >= count * 8,
            "noise {noise}: {same} of {count} at the height of those on the mesh"
        );
        let again = on(scan).0;
        assert_eq!(ours.positions(), again.positions(), "noise {noise}: the same world twice");
    }
}
