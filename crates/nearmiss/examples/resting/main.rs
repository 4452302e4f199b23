//! A ball, a box, a cylinder and a capsule fall on a scanned surface and come to rest: how much energy is
//! left?
//!
//! `cargo run --release -p nearmiss --example resting [SCAN.ply]`, z up
#![expect(clippy::print_stdout, reason = "a program for people")]

mod solver;

use std::error::Error;
use std::path::PathBuf;

use nearmiss::geometry::nalgebra::{UnitQuaternion, Vector3};
use nearmiss::{BuildOptions, CollideOptions, PointCloud, Pose, Ray, Scan, Scratch, ShapePlan, Target};
use solver::{Body, GRAVITY, Kind};

const STEP: f64 = 1.0 / 240.0;

/// The resistance to rolling, in sizes of a body: about that of a football on grass.
const ROLLING: f64 = 0.05;

fn main() -> Result<(), Box<dyn Error>> {
    let cloud = match std::env::args_os().nth(1).map(PathBuf::from) {
        Some(path) => nearmiss::io::read(&path, None)?.cloud,
        None => PointCloud::from_positions(&floor())?,
    };
    let scan = Scan::build(&cloud, &BuildOptions::default())?;
    let r = scan.sampling_radius();
    let plan = ShapePlan::new(&CollideOptions::default().with_margin(0.5 * r), &scan)?;
    let target = Target::new(scan.at(&Pose::IDENTITY), &plan);
    let mut scratch = Scratch::default();

    let (centre, top) = (scan.bounds().centre(), scan.bounds().max[2]);
    let size = 6.0 * r;
    let kinds = [
        ("ball", Kind::Ball { radius: size }),
        ("box", Kind::Box { half: [size, 0.8 * size, 0.6 * size] }),
        ("cylinder", Kind::Cylinder { half: size, radius: 0.5 * size }),
        ("capsule", Kind::Capsule { half: size, radius: 0.5 * size }),
    ];
    for (name, kind) in kinds {
        let down = Ray::new([centre[0], centre[1], top + 1.0], [0.0, 0.0, -1.0]);
        let hit = target.cast(&down, &mut scratch).hit.ok_or("expected a surface below the centre")?;
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 0.0, 0.3));
        let place = [hit.point[0], hit.point[1], hit.point[2] + 1.3 * size];
        let mut body = Body::new(kind, place, turn, [0.6, ROLLING * size]);
        for step in 1..=960_u32 {
            body.step(&target, STEP, &mut scratch);
            if step % 240 == 0 {
                println!(
                    "{name}, {} s: energy {:.1e} m g r, {} contacts, {:.4?}",
                    step / 240,
                    body.energy() / (GRAVITY * size),
                    body.contacts(),
                    <[f64; 3]>::from(body.place)
                );
            }
        }
    }
    Ok(())
}

/// Points of a floor, 4 by 4, every 0.05, each off by up to 0.001.
fn floor() -> Vec<[f64; 3]> {
    let noise = |i: u32| f64::from(i.wrapping_mul(2_654_435_761) >> 16) / 32768.0 - 1.0;
    (0..6400_u32).map(|i| [f64::from(i % 80) * 0.05, f64::from(i / 80) * 0.05, 0.001 * noise(i)]).collect()
}
