//! Bodies of the example `resting` come to rest on a scan, without damping and without sleeping. Round
//! ones have some resistance to rolling, without which they roll on for ever, as on any smooth ground.

#[path = "../../examples/resting/solver.rs"]
mod solver;

use nearmiss::geometry::nalgebra::{UnitQuaternion, Vector3};
use nearmiss::{BuildOptions, CollideOptions, PointCloud, Pose, Scan, Scratch, ShapePlan, Target};
use nearmiss_testdata::shapes::{Order, Sampling, patch};
use solver::{Body, GRAVITY, Kind};

/// Two seconds, in steps of a 240th.
const STEPS: u32 = 480;

/// Drops a body flat on a plane with this noise, and returns its energy in m g times its size.
fn energy_left(target: &Target<'_>, kind: Kind, (size, resistance): (f64, f64)) -> f64 {
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 0.0, 0.3));
    let mut body = Body::new(kind, [0.03, -0.02, 1.3 * size], turn, [0.6, resistance * size]);
    let mut scratch = Scratch::default();
    let mut highest: f64 = 0.0;
    for step in 0..STEPS {
        body.step(target, 1.0 / 240.0, &mut scratch);
        // Not by chance at the turn of a vibration.
        if step >= STEPS - 10 {
            highest = highest.max(body.energy());
        }
    }
    assert!(body.contacts() > 0 && body.place.z > 0.3 * size, "{kind:?} fell through: {:?}", body.place);
    highest / (GRAVITY * size)
}

#[test]
fn bodies_come_to_rest_on_a_scan() {
    for noise in [0.0, 0.03] {
        let sampling = Sampling { spacing: 0.05, noise, order: Order::Random, seed: 3 };
        let points = patch(2.0, 2.0).sample(sampling).points;
        let scan =
            Scan::build(&PointCloud::from_positions(&points).unwrap(), &BuildOptions::default()).unwrap();
        let margin = 0.5 * scan.sampling_radius();
        let plan = ShapePlan::new(&CollideOptions::default().with_margin(margin), &scan).unwrap();
        let target = Target::new(scan.at(&Pose::IDENTITY), &plan);
        let size = 0.3;
        for (kind, resistance) in [
            (Kind::Ball { radius: size }, 0.01),
            (Kind::Box { half: [size, 0.8 * size, 0.6 * size] }, 0.0),
            (Kind::Cylinder { half: size, radius: 0.5 * size }, 0.01),
            (Kind::Capsule { half: size, radius: 0.5 * size }, 0.01),
        ] {
            let left = energy_left(&target, kind, (size, resistance));
            assert!(left <= 1e-6, "noise {noise}: {kind:?} has {left:.1e} m g r after 2 s");
        }
    }
}
