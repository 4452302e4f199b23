//! Meshes and scans that deform: the times of refitting, renewing and preparing anew, and the answers
//! of each. Frames of a depth camera that replace each other.
//!
//! Methods are compared frame by frame, so each finds what the others left in the caches. Rows that say
//! "alone" are of a program that follows the same frames by one method, with the same questions about each.
//! It writes each frame just before, as a simulation or a camera does; the other rows read it from where all
//! are kept. It calls from a thread of the pool, unless the row says otherwise.
//!
//! The frames of a mesh are files. A scan of it has points that are spread over the surface of the
//! first frame and move with their triangles. Two copies are asked in every frame, at the same poses
//! for all methods.

mod depth;
mod measured;

use std::hint::black_box;
use std::path::PathBuf;

use nearmiss::io::{Pieces, read_in_pieces};
use nearmiss::{
    Answer, BuildOptions, CollideOptions, CollidePlan, DistanceOptions, DistancePlan, Evidence,
    MeshBuildOptions, MeshItself, MeshPair, MeshScratch, MovingMesh, MovingScan, Pair, Placed, Pose, Scratch,
    TriangleMesh,
};
use nearmiss_benches::sample::count;
use nearmiss_benches::{Failure, machine};
use nearmiss_testdata::arbitrary::{rng, rotation, unit_vector};
use rand::RngExt;

use depth::depth_frames;
use measured::{Frames, Times, Totals, alone, heading, is_proof};

#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// Frames of a mesh, one file each; the first one has faces. Without any, frames of a depth camera
    #[arg(value_name = "FRAME")]
    frames: Vec<PathBuf>,
    /// Frames between two files
    #[arg(long, value_name = "N", default_value_t = 4)]
    between: u32,
    /// Points of the scan
    #[arg(long, value_name = "N", default_value_t = 100_000)]
    points: u32,
    /// Poses of the second copy in each frame
    #[arg(long, value_name = "N", default_value_t = 40)]
    poses: u32,
    /// Seed of the random numbers
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
}

pub(crate) fn run(options: &Options) -> Result<(), Failure> {
    println!("{}\n", machine::description());
    if options.frames.is_empty() {
        return depth_frames(options.poses, options.seed);
    }
    let (files, triangles) = read(&options.frames)?;
    let mut frames = Frames::new();
    for pair in files.windows(2) {
        for k in 0..=options.between {
            let share = f64::from(k) / f64::from(options.between + 1);
            let between = |(p, q): (&[f64; 3], &[f64; 3])| [0, 1, 2].map(|k| p[k] + share * (q[k] - p[k]));
            frames.push(pair[0].iter().zip(&pair[1]).map(between).collect());
        }
    }
    frames.extend(files.last().cloned());
    println!("{} frames, {} vertices, {} triangles\n", frames.len(), frames[0].len(), triangles.len());
    meshes(options, &frames, &triangles)?;
    scans(options, &frames, &triangles)
}

/// Reads the positions of all files, and the triangles of the first.
fn read(paths: &[PathBuf]) -> Result<(Frames, Vec<[u32; 3]>), Failure> {
    let (mut frames, mut triangles) = (Frames::new(), Vec::new());
    for path in paths {
        match read_in_pieces(path, None, 1 << 20)? {
            Pieces::Mesh { vertices, mesh } => {
                if frames.is_empty() {
                    triangles = mesh.triangles().to_vec();
                }
                frames.push(vertices.positions);
            }
            Pieces::Points(pieces) => {
                let mut positions = Vec::new();
                pieces.each(|points| positions.extend_from_slice(&points.positions))?;
                frames.push(positions);
            }
        }
    }
    if triangles.is_empty() {
        return Err("the first frame has no faces".into());
    }
    Ok((frames, triangles))
}

/// Poses of a second copy, from deep within the first to apart.
fn poses(options: &Options, size: f64) -> Vec<Pose> {
    let rng = &mut rng(options.seed);
    let pose = |k: u32| {
        let away = 0.3 + f64::from(k) / f64::from(options.poses);
        rotation(rng).with_translation(unit_vector(rng).map(|c| c * away * size))
    };
    (0..options.poses).map(pose).collect()
}

/// Turns poses about the centre of a frame.
fn about(poses: &[Pose], centre: [f64; 3]) -> Vec<Pose> {
    let pose = |pose: &Pose| {
        let (from, by) = (pose.rotate(centre), pose.translation());
        pose.with_translation([0, 1, 2].map(|k| centre[k] - from[k] + by[k]))
    };
    poses.iter().map(pose).collect()
}

fn meshes(options: &Options, frames: &Frames, triangles: &[[u32; 3]]) -> Result<(), Failure> {
    let built = MeshBuildOptions::default().with_cells(false);
    let first = TriangleMesh::new(frames[0].clone(), triangles.to_vec())?;
    let mut refitted = MovingMesh::new(&first, &built)?;
    let mut anew = refitted.clone();
    let size = 2.0 * refitted.bounds().half_extents().iter().copied().fold(0.0, f64::max);
    let poses = poses(options, size);
    let mut times: [Times; 5] = std::array::from_fn(|_| Times::default());
    let [refit, rebuild, ask_refitted, ask_anew, itself] = &mut times;
    let (mut scratch, mut wrong, mut hits, mut folded) = (MeshScratch::default(), 0, 0, 0);
    let (mut loosest, mut by_looseness) = (1.0_f64, ByLooseness::default());
    let ask = |mesh: &MovingMesh, pose: &Pose, times: &mut Times, scratch: &mut MeshScratch| {
        let pair = MeshPair::new(mesh.at(&Pose::IDENTITY), mesh.at(pose));
        times.of(|| black_box(pair.collide(scratch)).verdict.is_intersecting())
    };
    for frame in frames {
        refit.of(|| refitted.refit(frame))?;
        rebuild.of(|| anew.rebuild(frame))?;
        loosest = loosest.max(refitted.looseness());
        let asked = ask_refitted.0.len();
        for pose in about(&poses, refitted.bounds().centre()) {
            let found = ask(&refitted, &pose, ask_refitted, &mut scratch);
            let expected = ask(&anew, &pose, ask_anew, &mut scratch);
            wrong += usize::from(found != expected);
            hits += usize::from(expected);
        }
        by_looseness.add(refitted.looseness(), [&ask_refitted.0[asked..], &ask_anew.0[asked..]]);
        let question = MeshItself::new(refitted.at(&Pose::IDENTITY));
        folded += usize::from(itself.of(|| question.collide(&mut scratch)).verdict.is_intersecting());
    }
    heading(&format!("the mesh: {} triangles, {} nodes", refitted.len(), refitted.topology().len()));
    let names = ["refit", "prepare anew", "ask, refitted", "ask, prepared anew", "against itself"];
    times.into_iter().zip(names).for_each(|(times, name)| times.row(name));
    println!(
        "\n{wrong} of {} verdicts differ, {hits} meet; boxes at most {loosest:.2} times as costly; {folded} of {} frames \
         meet themselves",
        frames.len() * poses.len(),
        frames.len()
    );
    by_looseness.print();
    Ok(())
}

/// The times of queries by the looseness of the boxes, of refitted things and of those prepared anew.
#[derive(Debug, Default)]
struct ByLooseness([(usize, [f64; 2]); LOOSENESS.len()]);

/// The least looseness of each class.
const LOOSENESS: [f64; 7] = [0.0, 1.1, 1.25, 1.5, 2.0, 3.0, 5.0];

impl ByLooseness {
    fn add(&mut self, looseness: f64, times: [&[f64]; 2]) {
        let class = LOOSENESS.partition_point(|least| *least <= looseness).saturating_sub(1);
        let (frames, sums) = &mut self.0[class];
        *frames += 1;
        for (sum, times) in sums.iter_mut().zip(times) {
            *sum += times.iter().sum::<f64>() / count(times.len());
        }
    }

    fn print(&self) {
        println!(
            "\n| looseness from | frames | ask refitted, µs | anew, µs | ratio |\n| --: | --: | --: | --: | --: |"
        );
        for (least, (frames, sums)) in LOOSENESS.iter().zip(&self.0).filter(|(_, (frames, _))| *frames > 0) {
            let [refitted, anew] = sums.map(|sum| sum / count(*frames));
            println!("| {least} | {frames} | {refitted:.1} | {anew:.1} | {:.2} |", refitted / anew);
        }
    }
}

/// Spreads points over a mesh. They move with their triangles.
fn spread(options: &Options, frames: &Frames, triangles: &[[u32; 3]]) -> Frames {
    let area = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| frames[0][v as usize]);
        let (u, v) = ([0, 1, 2].map(|k| b[k] - a[k]), [0, 1, 2].map(|k| c[k] - a[k]));
        let n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        n.iter().map(|x| x * x).sum::<f64>().sqrt()
    };
    let mut sums: Vec<f64> = triangles
        .iter()
        .scan(0.0, |sum, t| {
            *sum += area(t);
            Some(*sum)
        })
        .collect();
    let whole = sums.last().copied().unwrap_or(1.0);
    sums.iter_mut().for_each(|sum| *sum /= whole);
    let rng = &mut rng(options.seed);
    let places: Vec<(usize, [f64; 3])> = (0..options.points)
        .map(|i| {
            // Strata along the order of the triangles spread the points more evenly.
            let share = (f64::from(i) + rng.random::<f64>()) / f64::from(options.points);
            let triangle = sums.partition_point(|sum| *sum < share).min(triangles.len() - 1);
            let (a, b) = (rng.random::<f64>().sqrt(), rng.random::<f64>());
            (triangle, [1.0 - a, a * (1.0 - b), a * b])
        })
        .collect();
    let at = |frame: &Vec<[f64; 3]>| {
        let place = |(triangle, w): &(usize, [f64; 3])| {
            let [a, b, c] = triangles[*triangle].map(|v| frame[v as usize]);
            [0, 1, 2].map(|k| w[0] * a[k] + w[1] * b[k] + w[2] * c[k])
        };
        places.iter().map(place).collect()
    };
    frames.iter().map(at).collect()
}

fn scans(options: &Options, frames: &Frames, triangles: &[[u32; 3]]) -> Result<(), Failure> {
    let frames = spread(options, frames, triangles);
    let built = BuildOptions::default();
    let mut times: [Times; 6] = std::array::from_fn(|_| Times::default());
    let [refit, renew, rebuild, ask_refitted, ask_renewed, ask_anew] = &mut times;
    let mut refitted = MovingScan::new(&frames[0], &built)?;
    let (mut renewed, mut anew) = (refitted.clone(), refitted.clone());
    let size = 2.0 * refitted.bounds().half_extents().iter().copied().fold(0.0, f64::max);
    let poses = poses(options, size);
    let mut scratch = Scratch::default();
    let asked = CollideOptions::default().with_evidence(Evidence::Certified);
    let mut ask = |scan: &MovingScan, pose: &Pose, times: &mut Times| -> Result<Answer, Failure> {
        let plan = CollidePlan::new(&asked, scan, scan)?;
        let pair = Pair::new(scan.at(&Pose::IDENTITY), Placed::new(scan, pose));
        Ok(times.of(|| black_box(pair.collide(&plan, &mut scratch))))
    };
    let (mut totals, mut by_looseness) = (Totals::default(), ByLooseness::default());
    for frame in &frames {
        let done = refit.of(|| refitted.refit(frame))?.fitted;
        totals.fitted += done;
        totals.most = done.max(totals.most);
        totals.loosest = refitted.looseness().max(totals.loosest);
        renew.of(|| renewed.renew(frame))?;
        rebuild.of(|| anew.rebuild(frame))?;
        let before = ask_refitted.0.len();
        for pose in about(&poses, refitted.bounds().centre()) {
            let expected = ask(&anew, &pose, ask_anew)?;
            let asked = [(&refitted, &mut *ask_refitted), (&renewed, &mut *ask_renewed)];
            for (k, (scan, times)) in asked.into_iter().enumerate() {
                let found = ask(scan, &pose, times)?;
                totals.proven[k] += usize::from(is_proof(&found.verdict));
                if found.verdict.is_intersecting() != expected.verdict.is_intersecting() {
                    totals.differ[k] += 1;
                    // The one that is separated tells how far.
                    let (apart, answer) =
                        if expected.verdict.is_intersecting() { (scan, &found) } else { (&anew, &expected) };
                    totals.beyond[k] += usize::from(nearest(apart, &pose)? > answer.band);
                }
            }
            totals.proven[2] += usize::from(is_proof(&expected.verdict));
            totals.apart += usize::from(expected.verdict.is_separated());
        }
        by_looseness.add(refitted.looseness(), [&ask_refitted.0[before..], &ask_anew.0[before..]]);
    }
    heading(&format!("a scan of {} points", refitted.len()));
    let names = ["refit", "renew", "prepare anew", "ask, refitted", "ask, renewed", "ask, prepared anew"];
    times.into_iter().zip(names).for_each(|(times, name)| times.row(name));
    let first = MovingScan::new(&frames[0], &built)?;
    let mut ask = |scan: &MovingScan, _: &_| {
        let about = about(&poses, scan.bounds().centre());
        about.iter().try_for_each(|pose| ask(scan, pose, &mut Times::default()).map(drop))
    };
    alone("refit, alone", &frames, &first, |scan, frame| Ok(scan.refit(frame).map(drop)?), &mut ask)?;
    alone("renew, alone", &frames, &first, |scan, frame| Ok(scan.renew(frame)?), &mut ask)?;
    let Totals { differ, beyond, proven, apart, fitted, most, loosest } = totals;
    println!(
        "\n{differ:?} of {} verdicts of refitted and renewed scans differ from those prepared anew, {beyond:?} beyond the \
         band; of {apart} separations {proven:?} are certified by each; {:.2} % of points fitted anew in a frame, at most \
         {:.2} %; boxes at most {loosest:.2} times as costly",
        frames.len() * poses.len(),
        100.0 * count(fitted) / count(frames.len() * refitted.len()),
        100.0 * count(most) / count(refitted.len()),
    );
    by_looseness.print();
    Ok(())
}

/// Returns the upper bound of the distance of two copies.
fn nearest(scan: &MovingScan, pose: &Pose) -> Result<f64, Failure> {
    let plan = DistancePlan::new(&DistanceOptions::default(), scan, scan)?;
    let pair = Pair::new(scan.at(&Pose::IDENTITY), Placed::new(scan, pose));
    Ok(pair.distance(&plan, &mut Scratch::default()).upper)
}
