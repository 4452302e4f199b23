//! Two scans in a simulation: one query a frame, with a time limit and a hint.
//!
//! `cargo run --release -p nearmiss --example frames [A.ply [B.ply]]`
#![expect(clippy::print_stdout, reason = "a program for people")]

use std::error::Error;
use std::path::PathBuf;
use std::time::Duration;

use nearmiss::{
    Budget, BuildOptions, CollideOptions, CollidePlan, Deadline, Detail, Pair, PairHint, Pose, Scan, Scratch,
    Verdict,
};

const DRAGON: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/data/dragon-23k.ply");

fn main() -> Result<(), Box<dyn Error>> {
    let mut files = std::env::args_os().skip(1).map(PathBuf::from);
    let first = files.next().unwrap_or_else(|| DRAGON.into());
    let second = files.next().unwrap_or_else(|| first.clone());

    // Preprocess once. Programs that start often should open a saved scan instead, with
    // `Scan::open`.
    let build = |path: &PathBuf| -> Result<Scan, Box<dyn Error>> {
        Ok(Scan::build(&nearmiss::io::read(path, None)?.cloud, &BuildOptions::default())?)
    };
    let (a, b) = (build(&first)?, build(&second)?);
    let options = CollideOptions::estimated().with_detail(Detail::Verdict);
    let plan = CollidePlan::new(&options, &a, &b)?;

    // Keep these from frame to frame, so that queries do not allocate.
    let (mut scratch, mut hint, mut manifold) = (Scratch::default(), PairHint::default(), Vec::new());

    // b approaches along x by a hundredth of the total size per frame, until it touches.
    let size = a.bounds().half_extents()[0] + b.bounds().half_extents()[0];
    let [from, to] = [b.bounds().centre(), a.bounds().centre()];
    for frame in 0..200 {
        let away = 1.2 * size - 0.01 * size * f64::from(frame);
        let pose = Pose::from_translation([to[0] - from[0] + away, to[1] - from[1], to[2] - from[2]]);
        let budget = Budget::default().with_deadline(Deadline::within(Duration::from_micros(500)));
        let pair = Pair::new(a.at(&Pose::IDENTITY), b.at(&pose)).within(&budget);
        let answer = pair.hinted(&mut hint).manifold(&mut manifold).collide(&plan, &mut scratch);
        match answer.verdict {
            Verdict::Intersecting { .. } => {
                println!("frame {frame}: contact at {} places", manifold.len());
                for place in &manifold {
                    println!("  at {:.4?}, push a along {:.2?}", place.point, place.normal);
                }
                return Ok(());
            }
            Verdict::Separated { .. } => {}
            Verdict::Undecided(reason) => println!("frame {frame}: undecided: {reason:?}"),
        }
    }
    println!("no contact in 200 frames");
    Ok(())
}
