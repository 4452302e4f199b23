//! A scan that moves past another one: is the whole motion free, and where is the first impact?
//!
//! `cargo run --release -p nearmiss --example sweep [A.ply [B.ply]]`
#![expect(clippy::print_stdout, reason = "a program for people")]

use std::error::Error;
use std::path::PathBuf;

use nearmiss::{
    BuildOptions, Motion, Pose, Prepared, Scan, Scratch, Sweep, SweepOptions, SweepPlan, SweepVerdict,
};

const DRAGON: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/data/dragon-23k.ply");

fn main() -> Result<(), Box<dyn Error>> {
    let mut files = std::env::args_os().skip(1).map(PathBuf::from);
    let first = files.next().unwrap_or_else(|| DRAGON.into());
    let second = files.next().unwrap_or_else(|| first.clone());
    let build = |path: &PathBuf| -> Result<Scan, Box<dyn Error>> {
        Ok(Scan::build(&nearmiss::io::read(path, None)?.cloud, &BuildOptions::default())?)
    };
    let (a, b) = (build(&first)?, build(&second)?);
    let plan = SweepPlan::new(&SweepOptions::default(), &a, &b)?;
    let mut scratch = Scratch::default();

    let size = a.bounds().half_extents()[0];
    let stays = Motion::still(Pose::IDENTITY);
    for height in [3.0, 2.0, 1.0, 0.0] {
        // Past a at this height, turned by a third of a turn on the way.
        let at = |x: f64, angle: f64| {
            Pose::from_axis_angle([0.0, 1.0, 0.0], angle).with_translation([x * size, height * size, 0.0])
        };
        let path = Motion::through(&[at(-4.0, 0.0), at(0.0, 1.0), at(4.0, 2.0)])?;
        let answer = Sweep::new(a.along(&stays), b.along(&path)).first_impact(&plan, &mut scratch);
        print!("{:.4} higher: ", height * size);
        match answer.verdict {
            SweepVerdict::Free { clearance, upper, at } => {
                println!("free, at least {clearance:.4} apart; {upper:.4} at t = {at:.3}");
            }
            SweepVerdict::Impact { t_free, t_hit, contact, .. } => {
                println!("free up to t = {t_free:.3}, impact at {t_hit:.3}, {:.4?}", contact.point);
            }
            SweepVerdict::Undecided { t_free, reason } => {
                println!("free up to t = {t_free:.3}, then undecided: {reason:?}");
            }
        }
        println!("  {} distance queries, {} intervals", answer.distances, answer.intervals);
    }
    Ok(())
}
