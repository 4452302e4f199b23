//! Well-filled cells of scans.

use nearmiss_geometry::{NodeId, PointCloud};
use nearmiss_hierarchy::{BuildOptions, CELLS, PointHierarchy};

/// A rectangle of 4 by 2 with points on a lattice, without those in a middle part of this share of its
/// sides.
fn rectangle(hole: f64) -> PointHierarchy {
    let places =
        (0..160_u32 * 80).map(|i| [f64::from(i % 160) / 40.0 - 2.0, f64::from(i / 160) / 40.0 - 1.0]);
    let is_outside = |[x, y]: &[f64; 2]| x.abs() > 2.0 * hole || y.abs() > hole;
    let points: Vec<[f64; 3]> = places.filter(is_outside).map(|[x, y]| [x, y, 0.0]).collect();
    let cloud = PointCloud::from_positions(&points).unwrap();
    PointHierarchy::build(&cloud, &BuildOptions::default()).unwrap()
}

#[test]
fn points_fill_the_cells_that_their_surface_fills() {
    for (hole, share) in [(0.0, 1.0), (0.5, 0.75), (0.75, 0.4375)] {
        let scan = rectangle(hole);
        let filled = f64::from(scan.arrays().filled_cells(NodeId::ROOT));
        let expected = share * f64::from(CELLS);
        // A row of cells along each edge of the hole may go either way.
        assert!((filled - expected).abs() <= 6.0, "{filled} cells, expected {expected}");
    }
    // Gaps between the squares of a leaf's few points stay empty.
    let scan = rectangle(0.0);
    for number in (0..scan.topology().leaves()).step_by(17) {
        let filled = scan.arrays().filled_cells(scan.topology().leaf(number));
        assert!(filled >= 16, "{filled} cells of leaf {number}");
    }
}
