//! A hundred copies of a scan in one world: counts the copies that touch each other and those that
//! touch a gripper.
//!
//! `cargo run --release -p nearmiss --example world [SCAN.ply]`
#![expect(clippy::print_stdout, reason = "a program for people")]

use std::error::Error;
use std::path::PathBuf;

use nearmiss::{Bodies, BuildOptions, CollideOptions, CollidePlan, Pose, Scan, Scratch, Shape, World};

const DRAGON: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/data/dragon-23k.ply");

fn main() -> Result<(), Box<dyn Error>> {
    let file = std::env::args_os().nth(1).map_or_else(|| DRAGON.into(), PathBuf::from);
    let scan = Scan::build(&nearmiss::io::read(&file, None)?.cloud, &BuildOptions::default())?.with_shapes();
    let plan = CollidePlan::new(&CollideOptions::default(), &scan, &scan)?;
    let size = scan.bounds().half_extents();

    // Cloning a scan only costs a reference count.
    let mut world = World::new();
    for i in 0..100_u32 {
        let turned = Pose::from_axis_angle([0.0, 1.0, 0.0], 0.7 * f64::from(i));
        let place = [1.5 * size[0] * f64::from(i % 10), 0.0, 1.5 * size[0] * f64::from(i / 10)];
        world.insert(scan.clone(), &turned.with_translation(place));
    }

    let (mut pairs, mut scratch) = (Vec::new(), Scratch::default());
    world.near_pairs(Bodies::All, plan.reach(), &mut pairs);
    let touching = pairs.iter().filter_map(|&ids| world.pair(ids));
    let touching = touching.filter(|pair| pair.collide(&plan, &mut scratch).verdict.is_intersecting());
    println!("{} bodies, {} near pairs, {} of them touch", world.len(), pairs.len(), touching.count());

    let [x, y, z] = scan.bounds().centre();
    let gripper = Shape::Capsule { ends: [[x, y, z], [x + 9.0 * size[0], y, z]], radius: 0.1 * size[1] };
    let mut ids = Vec::new();
    world.near_shape(&gripper, 0.0, &mut ids);
    let touched = ids.iter().filter_map(|&id| world.placed(id)).filter(|body| body.touches(&gripper));
    println!("the gripper touches {} bodies of {} near it", touched.count(), ids.len());
    Ok(())
}
