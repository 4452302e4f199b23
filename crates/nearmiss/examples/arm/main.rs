//! A six-link arm of capsules in a scanned room: finds a path of its joints that is proven free of the
//! room and of the arm itself, and draws it with the clearance as colour. All bodies are in one `World`.
//!
//! `cargo run --release -p nearmiss --example arm [SCAN [OUT.svg [X,Y,Z [TOOL]]]]`, z up; the arm stands at
//! X,Y,Z, and has the scan TOOL, shrunk, in its hand
#![expect(clippy::print_stdout, reason = "a program for people")]

mod arm;
mod drawing;

use std::error::Error;
use std::f64::consts::PI;
use std::path::{Path, PathBuf};

use arm::{Angles, Arm, CLEARANCE, between, prove};
use drawing::Moment;
use nearmiss::{
    BuildOptions, Check, CollideOptions, DistanceOptions, DistancePlan, NearestPair, PointCloud, Pose, Scan,
    Scratch, Shape, ShapePlan, Target,
};
use nearmiss_testdata::arbitrary::rng;
use rand::RngExt;

/// Legs of the path, and tries to find each.
const LEGS: usize = 5;
const TRIES: u32 = 400;

/// Times of each leg that are drawn.
const SHOWN: u32 = 12;

fn main() -> Result<(), Box<dyn Error>> {
    let mut words = std::env::args_os().skip(1);
    let scan = match words.next() {
        Some(path) => open(&PathBuf::from(path))?,
        None => Scan::build(&PointCloud::from_positions(&room())?, &BuildOptions::default())?,
    };
    let picture = words.next().map_or_else(|| PathBuf::from("arm.svg"), PathBuf::from);
    let place = words.next().and_then(|word| word.to_str().map(numbers)).unwrap_or_default();
    let tool = words.next().map(|path| open(&PathBuf::from(path))).transpose()?;
    let mut scratch = Scratch::default();

    let base = <[f64; 3]>::try_from(place).unwrap_or_else(|_| scan.bounds().centre());
    let plan = ShapePlan::new(&CollideOptions::default(), &scan)?;
    let dot = Shape::Sphere { centre: base, radius: 0.0 };
    let room_for = Target::new(scan.at(&Pose::IDENTITY), &plan).distance(&dot, f64::INFINITY, &mut scratch);
    // Longer than the room around its base, so that the path must go about things.
    let length = 1.6 * room_for.map_or(1.0, |found| found.upper);
    let plan = DistancePlan::new(&DistanceOptions::default(), &scan, tool.as_ref().unwrap_or(&scan))?;
    let mut arm = Arm::new(&scan, (base, length), tool.as_ref(), plan);
    println!("an arm {length:.3} long at {base:.3?}, among {} points", scan.len());

    let mut rng = rng(5);
    let mut path: Vec<Angles> = vec![[0.0, -1.2, 2.0, 0.0, 1.0, 0.0]];
    let (mut refused, mut intervals, mut clearance) = (0, 0, f64::INFINITY);
    for _ in 0..TRIES {
        if path.len() > LEGS {
            break;
        }
        let goal: Angles =
            std::array::from_fn(|k| rng.random_range(-1.0..1.0) * if k == 1 { 0.9 } else { PI });
        let Some(start) = path.last() else { break };
        match prove(&mut arm, [start, &goal], &mut scratch) {
            Ok(proof) => {
                intervals += proof.intervals;
                clearance = clearance.min(proof.clearance);
                path.push(goal);
            }
            Err(_) => refused += 1,
        }
    }
    println!("{} legs proven free, {refused} refused; {intervals} intervals in the proof", path.len() - 1);
    if clearance.is_finite() {
        let most = CLEARANCE * length;
        println!("all pairs keep at least {clearance:.2e}, proven (up to {most:.3} is looked for)");
    }

    let mut moments = Vec::new();
    let mut nearest: [Option<NearestPair>; 2] = [None; 2];
    for leg in path.windows(2) {
        for step in 0..=SHOWN {
            let angles = between([&leg[0], &leg[1]], f64::from(step) / f64::from(SHOWN));
            arm.turn_to(&angles);
            let own = arm.nearest_pairs(&mut scratch);
            let apart = own[0].map_or(0.0, |pair| pair.upper);
            moments.push(Moment { links: arm.links(&angles), tool: arm.tool(), apart });
            for (best, own) in nearest.iter_mut().zip(own) {
                let is_nearer = |own: &NearestPair| best.is_none_or(|best| own.upper < best.upper);
                *best = own.filter(is_nearer).or(*best);
            }
        }
    }
    for near in nearest.into_iter().flatten() {
        let [a, b] = near.ids.map(|id| arm.name(id));
        println!("nearest among the times shown: {b} and {a}, {:.4} apart", near.upper);
    }
    std::fs::write(&picture, drawing::svg(&scan, &arm, &moments)?)?;
    println!("drawn in {}", picture.display());
    Ok(())
}

/// Opens a prepared scan, or prepares the points of a file.
fn open(path: &Path) -> Result<Scan, Box<dyn Error>> {
    if path.extension().is_some_and(|end| end == "nm") {
        return Ok(Scan::open(path, Check::Structure)?);
    }
    Ok(Scan::build(&nearmiss::io::read(path, None)?.cloud, &BuildOptions::default())?)
}

fn numbers(text: &str) -> Vec<f64> {
    text.split(',').filter_map(|word| word.trim().parse().ok()).collect()
}

/// Points of a room, 4 by 3 by 2.5, with a table and a post.
fn room() -> Vec<[f64; 3]> {
    const STEP: f64 = 0.04;
    let mut points = Vec::new();
    let mut plate = |corner: [f64; 3], along: [usize; 2], size: [u32; 2]| {
        for i in 0..=size[0] {
            for j in 0..=size[1] {
                let mut p = corner;
                p[along[0]] += f64::from(i) * STEP;
                p[along[1]] += f64::from(j) * STEP;
                points.push(p);
            }
        }
    };
    for z in [0.0, 2.52] {
        plate([-2.0, -1.5, z], [0, 1], [100, 75]);
    }
    for (corner, along, size) in [
        ([-2.0, -1.5, 0.02], [0, 2], [100, 62]),
        ([-2.0, 1.5, 0.02], [0, 2], [100, 62]),
        ([-2.0, -1.48, 0.02], [1, 2], [74, 62]),
        ([2.0, -1.48, 0.02], [1, 2], [74, 62]),
        // The table and the post.
        ([0.7, -0.5, 0.8], [0, 1], [15, 25]),
        ([-0.9, 0.7, 0.02], [0, 2], [4, 62]),
        ([-0.9, 0.86, 0.02], [0, 2], [4, 62]),
        ([-0.9, 0.72, 0.02], [1, 2], [3, 62]),
        ([-0.74, 0.72, 0.02], [1, 2], [3, 62]),
    ] {
        plate(corner, along, size);
    }
    points
}
