//! Estimates of spacing, borders and holes from a sample of the points.
use nearmiss_geometry::PointCloud;
use nearmiss_hierarchy::{BuildOptions, PointHierarchy};
use nearmiss_testdata::shapes::{Sampling, sphere};

fn built(points: &[[f64; 3]]) -> PointHierarchy {
    PointHierarchy::build(&PointCloud::from_positions(points).unwrap(), &BuildOptions::default()).unwrap()
}

/// Returns a plate of 100 × 100 points of spacing 1, without those strictly within a central square
/// of side `hole`.
fn plate(hole: f64) -> Vec<[f64; 3]> {
    let mut points: Vec<[f64; 3]> =
        (0..100_u8).flat_map(|i| (0..100_u8).map(move |j| [f64::from(i), f64::from(j), 0.0])).collect();
    points.retain(|p| (0..2).any(|k| (p[k] - 49.5).abs() >= 0.5 * hole));
    points
}

#[test]
fn a_closed_surface_has_neither_borders_nor_holes() {
    let scan = built(&sphere(1.0).sample(Sampling::clean(0.03)).points);
    let survey = scan.survey(0);
    assert!(survey.border < 0.002 && survey.holes.is_empty(), "{} and {:?}", survey.border, survey.holes);
    let weight: f64 = survey.spacings.iter().map(|(_, weight)| weight).sum();
    assert!((weight - 1.0).abs() < 1e-9, "{weight}");
    let median = survey.spacings[survey.spacings.len() / 2].0;
    assert!((0.03..0.06).contains(&median), "{median}");
}

#[test]
fn a_plate_has_a_border_and_a_hole() {
    let whole = built(&plate(0.0)).survey(0);
    // 396 of 10,000 points are at the border.
    assert!((0.025..0.055).contains(&whole.border) && whole.holes.is_empty(), "{whole:?}");
    let scan = built(&plate(24.0));
    let with_hole = scan.survey(0);
    assert!(with_hole.border > whole.border, "{} after {}", with_hole.border, whole.border);
    // Widths are measured across from the points: smaller near corners, never more than the hole's.
    let widest = with_hole.holes[with_hole.holes.len() - 1];
    assert!((20.0..28.0).contains(&widest), "{:?}", with_hole.holes);
    assert_eq!(with_hole, scan.survey(0), "the same seed, the same points");
    assert_ne!(with_hole, scan.survey(1));
}

#[test]
fn few_points_are_surveyed() {
    let line: Vec<[f64; 3]> = (0..8).map(|i| [f64::from(i), 0.0, 0.0]).collect();
    let survey = built(&line).survey(0);
    assert!(survey.border == 0.0 && survey.holes.is_empty(), "{survey:?}");
}
