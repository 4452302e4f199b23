//! Curves with the kernel of the placed scan, and curves of saved scans.
use nearmiss::geometry::nalgebra::Vector3;
use nearmiss::{
    BuildOptions, Check, Curve, CurveOptions, CurvePlan, Curves, GraphOptions, Pair, Paths, PlanError,
    PointCloud, Pose, Scan, Scratch,
};
use nearmiss_testdata::shapes::{Sampling, plates, sphere};

fn draw(a: &Scan, b: &Scan, pose: &Pose) -> Curves {
    let plan = CurvePlan::new(&CurveOptions::default(), a, b).unwrap();
    let mut found = Curves::default();
    let pair = Pair::new(a.at(&Pose::IDENTITY), b.at(pose));
    pair.curves(&plan, &mut found, &mut Scratch::default());
    found
}

/// The scan with straight-line distances, and with distances along its graph.
fn both(points: &[[f64; 3]]) -> [Scan; 2] {
    let cloud = PointCloud::from_positions(points).unwrap();
    let scan = Scan::build(&cloud, &BuildOptions::default()).unwrap();
    let along = scan
        .clone()
        .with_graph(&cloud, &GraphOptions::default().with_close_pairs(Some(Paths::Rebuilt)), None)
        .unwrap();
    [scan, along.with_geodesic_kernel().unwrap()]
}

#[test]
fn either_kernel_follows_the_same_circle() {
    let scans = both(&sphere(1.0).sample(Sampling::clean(0.04)).points);
    let pose = Pose::from_translation([1.0, 0.0, 0.0]);
    for scan in &scans {
        let found = draw(scan, scan, &pose);
        assert_eq!((found.curves.len(), found.closed(), found.complete), (1, 1, true), "{:?}", scan.metric());
        for p in &found.points {
            let off = (p[0] - 0.5).hypot(p[1].hypot(p[2]) - 0.75_f64.sqrt());
            assert!(off < 0.05 * scan.sampling_radius(), "{:?}: {off}", scan.metric());
        }
        let mut bytes = Vec::new();
        scan.write_to(&mut bytes).unwrap();
        let again = Scan::from_bytes(bytes, Check::Full).unwrap();
        assert_eq!(draw(&again, &again, &pose), found, "a saved scan has the same curves");
    }
    let refused = CurvePlan::new(&CurveOptions::default(), &scans[0], &scans[1]);
    assert!(matches!(refused, Err(PlanError::Metrics(_))));
}

#[test]
fn along_the_graph_near_plates_are_cut_one_by_one() {
    // The plates are 1.8 bandwidths apart, too close for straight-line distances to separate them
    // well.
    let spacing = 0.05;
    let plates = both(&plates(2.0, 2.0, 2.5 * spacing).sample(Sampling::clean(spacing)).points);
    let walls = both(&nearmiss_testdata::shapes::patch(2.6, 2.6).sample(Sampling::clean(spacing)).points);
    let upright = Pose::from_axis_angle([1.0, 0.0, 0.0], std::f64::consts::FRAC_PI_2);
    let found = draw(&plates[1], &walls[1], &upright);
    let points_of = |curve: &Curve| &found.points[curve.first..curve.first + curve.count];
    // Edges of the graph join the plates at their rims, where the surface may lead from one plate
    // to the other.
    let is_at_rim = |curve: &&Curve| points_of(curve).iter().all(|p| p[0].abs() > 0.95);
    let (at_rims, across): (Vec<&Curve>, Vec<&Curve>) = found.curves.iter().partition(is_at_rim);
    assert!(across.len() == 2 && at_rims.len() <= 2, "{:?}", found.curves);
    for curve in across {
        let points = points_of(curve);
        let side = points[0][2].signum();
        // Paths along the graph bend around the rims.
        for p in points.iter().filter(|p| p[0].abs() < 0.8) {
            assert!(
                (p[2] - side * 1.25 * spacing).abs() < 0.02 * spacing && p[1].abs() < 0.02 * spacing,
                "{p:?}"
            );
        }
        let ends = [points[0], points[points.len() - 1]].map(Vector3::from);
        assert!((ends[0] - ends[1]).norm() > 1.9, "from border to border");
    }
}
