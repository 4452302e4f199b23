//! Moments of scanned solids against their closed forms.

use std::f64::consts::PI;

use nearmiss_geometry::{PointCloud, Pose};
use nearmiss_hierarchy::{BuildOptions, PointHierarchy};
use nearmiss_query::{CollideOptions, Detail, Prepared, Scratch, ShapePlan, SolidMoments, Target};
use nearmiss_testdata::shapes::{Form, Order, Sampling, sphere, torus};

fn moments(points: &[[f64; 3]], pose: &Pose, lines: u16) -> Option<SolidMoments> {
    let cloud = PointCloud::from_positions(points).expect("points");
    let scan = PointHierarchy::build(&cloud, &BuildOptions::default()).expect("a scan");
    let options = CollideOptions::estimated().with_detail(Detail::Verdict);
    let plan = ShapePlan::new(&options, &scan).expect("a plan");
    Target::new(scan.at(pose), &plan).moments(lines, &mut Scratch::default())
}

fn sampled(form: Form) -> Vec<[f64; 3]> {
    form.sample(Sampling { spacing: 0.02, order: Order::Regular, noise: 0.0, seed: 1 }).points
}

fn near(found: f64, expected: f64, within: f64, name: &str) {
    assert!((found / expected - 1.0).abs() < within, "{name}: expected {expected}, got {found}");
}

#[test]
fn spheres_and_tori_have_their_moments_in_any_pose() {
    let pose =
        Pose::from_axis_angle([1.0, 2.0, -1.0], 0.9).with_translation([3.0, -4.0, 9.0]).with_scale(2.0);
    let ball = moments(&sampled(sphere(0.5)), &pose, 48).expect("a solid");
    let volume = 4.0 / 3.0 * PI;
    near(ball.volume, volume, 0.01, "the volume of a ball");
    for k in 0..3 {
        assert!((ball.centre[k] - [3.0, -4.0, 9.0][k]).abs() < 0.01, "the centre is {:?}", ball.centre);
        near(ball.inertia[k][k], 0.4 * volume, 0.02, "the inertia of a ball");
        assert!(ball.inertia[k][(k + 1) % 3].abs() < 0.01 * volume, "{:?}", ball.inertia);
    }
    assert!(ball.spread < 0.01, "{} between the axes", ball.spread);

    let (major, minor) = (1.0_f64, 0.4_f64);
    let ring = moments(&sampled(torus(major, minor)), &Pose::IDENTITY, 64).expect("a solid");
    let volume = 2.0 * PI * PI * major * minor * minor;
    near(ring.volume, volume, 0.01, "the volume of a torus");
    near(ring.inertia[2][2], volume * (major * major + 0.75 * minor * minor), 0.02, "about the axis");
    near(ring.inertia[0][0], volume * (0.5 * major * major + 0.625 * minor * minor), 0.02, "across the axis");
}

#[test]
fn open_scans_say_so() {
    let points = sampled(sphere(0.5));
    // Without a cap, lines along its axis leave through the hole.
    let bowl: Vec<[f64; 3]> = points.iter().filter(|p| p[2] < 0.3).copied().collect();
    let spread = moments(&bowl, &Pose::IDENTITY, 32).expect("lines cross it").spread;
    assert!(spread > 0.1, "{spread} between the axes");
    let plate: Vec<[f64; 3]> = points.iter().map(|p| [p[0], p[1], 0.0]).collect();
    assert!(
        moments(&plate, &Pose::IDENTITY, 32).is_none_or(|it| it.spread > 0.5),
        "a plate encloses nothing"
    );
    let nowhere = Pose::from_translation([f64::NAN; 3]);
    assert_eq!(moments(&points, &nowhere, 32), None, "an invalid pose");
}
