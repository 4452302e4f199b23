//! Two hundred bodies fall onto a scan: `cargo run --release -p nearmiss-parry --example drop -- SCAN
//! [PICTURE.png]`. The scan is in metres, z up: a prepared scan (`.nm`), or a point cloud in any format that
//! nearmiss reads. `-` in place of a scan is the scan of a small house.
//!
//! Prints energy, depths, the number of bodies below the whole scan, and the time of a step. Draws the
//! scene after 0, 0.5, 2 and 10 seconds, from above and from the side, and the energy over time as
//! `PICTURE.svg`.

#![expect(
    clippy::print_stdout,
    clippy::disallowed_methods,
    reason = "a program may print and read the clock"
)]

#[path = "../common/mod.rs"]
mod common;
mod energy;
mod picture;
mod world;

use std::fs::File;
use std::io::BufWriter;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use common::Failure;
use nearmiss::geometry::PointCloud;
use nearmiss::{BuildOptions, Pose, Ray, Scan, Scratch, Shape, ShapePlan, Target};
use nearmiss_parry::ScanShape;
use nearmiss_testdata::house::{Quad, house, scanned};
use rand::RngExt as _;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng as _;
use rapier3d::math::Vector;
use rapier3d::parry::shape::{SharedShape, TriMesh};
use world::Drop;

/// The distance of neighbouring points of the house.
const SPACING: f64 = 0.05;

/// The steps after which the scene is drawn, sixty a second.
const SHOWN: [u32; 4] = [0, 30, 120, 600];

fn main() -> ExitCode {
    common::finish(run())
}

fn run() -> Result<(), Failure> {
    let mut words = std::env::args().skip(1);
    let quads = house();
    let path = words.next().filter(|path| path != "-");
    // Created first, so that a wrong path is reported before the bodies fall.
    let create = |path: String| match File::create(&path) {
        Ok(file) => Ok((path, file)),
        Err(error) => Err(format!("{path}: {error}")),
    };
    let drawn = words.next().map(create).transpose()?;
    let scan = match &path {
        Some(path) => common::open(path)?.0,
        None => {
            let cloud = PointCloud::from_positions(&scanned(&quads, SPACING, 0.0, 7))?;
            Scan::build(&cloud, &BuildOptions::default())?
        }
    };
    let places = places(&scan, 200)?;
    println!("{} points, {} bodies, sampling radius {:.3}", scan.len(), places.len(), scan.sampling_radius());
    let (strip, energy) = fall(&scan, ScanShape::new(scan.clone())?.shared(), &places);
    let mut records = vec![energy::Record { name: "on the scan", steps: energy }];
    if path.is_none() {
        let exact = mesh(&quads)?;
        println!("the same on a mesh of {} triangles", exact.indices().len());
        let (_, energy) = fall(&scan, SharedShape::new(exact), &places);
        records.push(energy::Record { name: "on the mesh", steps: energy });
    }
    if let Some((path, file)) = drawn {
        let picture = picture::strip(&scan, &strip);
        picture.encode(BufWriter::new(file))?;
        energy::plot(&records, &Path::new(&path).with_extension("svg"))?;
    }
    Ok(())
}

/// A triangle mesh of surfaces, two triangles for each square of the spacing of points.
fn mesh(quads: &[Quad]) -> Result<TriMesh, Failure> {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for quad in quads {
        let [columns, rows] = quad.sides.map(|side| {
            let length = side.iter().map(|c| c * c).sum::<f64>().sqrt();
            (1_u32..).find(|&n| f64::from(n) * SPACING >= length).unwrap_or(1)
        });
        let first = u32::try_from(vertices.len())?;
        for (row, column) in (0..=rows).flat_map(|row| (0..=columns).map(move |column| (row, column))) {
            let at = quad.at([f64::from(column) / f64::from(columns), f64::from(row) / f64::from(rows)]);
            vertices.push(Vector::from_array(single(at)));
        }
        for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
            let [low, high] = [0, 1].map(|up| first + (row + up) * (columns + 1) + column);
            triangles.extend([[low, low + 1, high + 1], [low, high + 1, high]]);
        }
    }
    Ok(TriMesh::new(vertices, triangles)?)
}

/// Where the bodies are when they are drawn, and the energy of each step.
type Fallen = (Vec<(f64, Vec<Vector>)>, Vec<[f64; 2]>);

/// Lets bodies fall for ten seconds, and prints what becomes of them.
fn fall(scan: &Scan, ground: SharedShape, places: &[[f32; 3]]) -> Fallen {
    let mut drop = Drop::new(ground, places, 11);
    println!("seconds, kinetic J, kinetic and potential J, deepest contact, fastest, fell out, ms a step");
    let (mut strip, mut energy) = (Vec::new(), Vec::new());
    let mut took = 0.0;
    for step in 0..=600 {
        if SHOWN.contains(&step) {
            strip.push((f64::from(step) / 60.0, drop.positions()));
        }
        let [kinetic, potential] = drop.energy();
        energy.push([kinetic, potential]);
        if step % 60 == 0 {
            let fastest = drop.speeds().into_iter().fold(0.0, f32::max);
            let out = fell_out(scan, &drop);
            let (second, total, mean) = (step / 60, kinetic + potential, took / 60.0);
            let deepest = drop.deepest();
            println!("{second}, {kinetic:.4}, {total:.1}, {deepest:.4}, {fastest:.4}, {out}, {mean:.2}");
            took = 0.0;
        }
        let clock = Instant::now();
        drop.world.step();
        took += clock.elapsed().as_secs_f64() * 1000.0;
    }
    (strip, energy)
}

/// Free places above points of the scan that look up, from a fixed seed.
fn places(scan: &Scan, count: usize) -> Result<Vec<[f32; 3]>, Failure> {
    let plan = ShapePlan::new(&nearmiss::CollideOptions::estimated(), scan)?;
    let target = Target::new(scan.at(&Pose::IDENTITY), &plan);
    let (mut scratch, mut random) = (Scratch::default(), Xoshiro256PlusPlus::seed_from_u64(3));
    let bounds = *scan.bounds();
    let mut places: Vec<[f64; 3]> = Vec::new();
    for _ in 0..1_000_000 {
        if places.len() == count {
            break;
        }
        let from = [0, 1, 2].map(|k| random.random_range(bounds.min[k]..bounds.max[k]));
        let down = Ray::new(from, [0.0, 0.0, -1.0]).with_max(4.0);
        let Some(hit) = target.cast(&down, &mut scratch).hit.filter(|hit| hit.normal[2] > 0.9) else {
            continue;
        };
        let centre = [hit.point[0], hit.point[1], hit.point[2] + 0.5];
        let is_apart = |p: &[f64; 3]| (0..3).any(|k| (p[k] - centre[k]).abs() > 0.5);
        let room = Shape::Sphere { centre, radius: 0.35 };
        // Not beside an edge or a hole of the floor.
        let mut is_floor = |[x, y]: [f64; 2]| {
            let from = [centre[0] + x, centre[1] + y, centre[2]];
            target.is_hit(&Ray::new(from, [0.0, 0.0, -1.0]).with_max(0.8), &mut scratch)
        };
        if ![[-1.0, 0.0], [1.0, 0.0], [0.0, -1.0], [0.0, 1.0]]
            .map(|d| d.map(|c| 0.6 * c))
            .into_iter()
            .all(&mut is_floor)
        {
            continue;
        }
        if places.iter().all(is_apart) && target.touch(&room, &mut scratch).verdict.is_separated() {
            places.push(centre);
        }
    }
    Ok(places.into_iter().map(single).collect())
}

#[expect(clippy::cast_possible_truncation, reason = "rapier computes in single precision")]
fn single(place: [f64; 3]) -> [f32; 3] {
    place.map(|c| c as f32)
}

/// The number of bodies below the whole scan: they fell through a hole, or off an edge.
fn fell_out(scan: &Scan, drop: &Drop) -> usize {
    let lowest = scan.bounds().min[2];
    drop.positions().iter().filter(|place| f64::from(place.z) < lowest).count()
}
