//! The number of threads does not change the results.
#![cfg(feature = "rayon")]

use nearmiss_filter::{min_neighbours, remove_outliers, voxel};
use nearmiss_geometry::PointCloud;

#[test]
fn threads_change_nothing() {
    let points: Vec<[f64; 3]> = (0..20_000_u32)
        .map(|i| [i.wrapping_mul(2_654_435_761), i.wrapping_mul(40_503_001), i.wrapping_mul(97_654_321)])
        .map(|p| p.map(|x| f64::from(x >> 8) * 1e-6))
        .collect();
    let cloud = PointCloud::cleaned(&points).unwrap();
    let found = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            (
                voxel(&cloud, 1.0).unwrap(),
                remove_outliers(&cloud, 8, 1.0).unwrap(),
                min_neighbours(&cloud, 2, 0.5).unwrap(),
            )
        })
    };
    let one = found(1);
    assert!(
        one.0.len() < points.len() && one.1.len() < points.len() && one.2.len() < points.len(),
        "some go"
    );
    assert_eq!(one, found(2));
    assert_eq!(one, found(7));
}
