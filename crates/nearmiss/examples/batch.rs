//! A robot's planned path: finds the free poses on all cores, and the first collision.
//!
//! `cargo run --release -p nearmiss --example batch [ROOM.ply [PART.ply]]`
#![expect(clippy::print_stdout, reason = "a program for people")]

use std::error::Error;
use std::path::PathBuf;

use nearmiss::{
    Answer, BatchScratch, BuildOptions, CollideOptions, CollidePlan, Pair, Pose, Scan, Until, each,
};

const DRAGON: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/data/dragon-23k.ply");

fn main() -> Result<(), Box<dyn Error>> {
    let mut files = std::env::args_os().skip(1).map(PathBuf::from);
    let first = files.next().unwrap_or_else(|| DRAGON.into());
    let second = files.next().unwrap_or_else(|| first.clone());
    let build = |path: &PathBuf| -> Result<Scan, Box<dyn Error>> {
        Ok(Scan::build(&nearmiss::io::read(path, None)?.cloud, &BuildOptions::default())?)
    };
    let (room, part) = (build(&first)?, build(&second)?);

    // 10,000 poses on a shrinking circle around the room. A gap of 1 % of the part's spacing counts
    // as contact.
    let size = room.bounds().half_extents().into_iter().fold(0.0, f64::max);
    let path: Vec<Pose> = (0..10_000_u32)
        .map(|i| {
            let share = f64::from(i) / 10_000.0;
            let (sin, cos) = (std::f64::consts::TAU * 5.0 * share).sin_cos();
            let radius = 3.0 * size * (1.0 - share);
            Pose::from_translation([radius * cos, radius * sin, 0.0])
        })
        .collect();
    let options = CollideOptions::default().with_margin(0.01 * part.sampling_radius());
    let plan = CollidePlan::new(&options, &room, &part)?;

    let mut scratch = BatchScratch::default();
    let mut answers = vec![Answer::UNASKED; path.len()];
    let mut ask = |until: Until| {
        each(&mut answers, None, &mut scratch, |i, scratch| {
            let pair = Pair::new(room.at(&Pose::IDENTITY), part.at(&path[i]));
            until.after(pair.collide(&plan, scratch))
        })
    };
    println!("the first contact is at pose {} of {}", ask(Until::First), path.len());
    ask(Until::All);
    let free = answers.iter().filter(|answer| answer.verdict.is_separated()).count();
    println!("{free} poses are free");
    Ok(())
}
