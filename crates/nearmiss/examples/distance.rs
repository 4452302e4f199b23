//! The clearance of two scans: bounds on their distance, the nearest points, and the curves of
//! intersection.
//!
//! `cargo run --release -p nearmiss --example distance [A.ply [B.ply]]`
#![expect(clippy::print_stdout, reason = "a program for people")]

use std::error::Error;
use std::path::PathBuf;

use nearmiss::{
    BuildOptions, CurveOptions, CurvePlan, Curves, DistanceOptions, DistancePlan, Pair, Pose, Scan, Scratch,
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
    let mut scratch = Scratch::default();
    let distance = DistancePlan::new(&DistanceOptions::default(), &a, &b)?;
    let curve = CurvePlan::new(&CurveOptions::default(), &a, &b)?;

    let size = a.bounds().half_extents()[0];
    for away in [3.0, 2.0, 1.0] {
        let pair = Pair::new(a.at(&Pose::IDENTITY), b.at(&Pose::from_translation([away * size, 0.0, 0.0])));
        let found = pair.distance(&distance, &mut scratch);
        println!("moved by {:.4}: between {:.5} and {:.5} apart", away * size, found.lower, found.upper);
        println!("  nearest points {:.4?} and {:.4?}", found.points[0], found.points[1]);
        let mut curves = Curves::default();
        pair.curves(&curve, &mut curves, &mut scratch);
        println!("  {} curves of intersection, {:.4} long", curves.curves.len(), curves.length());
    }
    Ok(())
}
