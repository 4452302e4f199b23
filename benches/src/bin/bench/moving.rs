//! Meshes and scans that deform: the times of refitting, renewing and preparing anew, and the answers
//! of each. Frames of a depth camera that replace each other.
//!
//! Methods are compared frame by frame, so each finds what the others left in the caches. Rows that say
//! "alone" are of a program that follows the same frames by one method, with the same questions about each.
//!
//! The frames of a mesh are files. A scan of it has points that are spread over the surface of the
//! first frame and move with their triangles. Two copies are asked in every frame, at the same poses
//! for all methods.

use std::cell::RefCell;
use std::hint::black_box;
use std::path::PathBuf;

use nearmiss::io::{Pieces, read_in_pieces};
use nearmiss::{
    Answer, BuildOptions, CollideOptions, CollidePlan, DistanceOptions, DistancePlan, Evidence,
    MeshBuildOptions, MeshItself, MeshPair, MeshScratch, MovingMesh, MovingScan, Pair, Placed, Pose, Scratch,
    TriangleMesh, Verdict,
};
use nearmiss_benches::clock::{nanoseconds, timed};
use nearmiss_benches::sample::count;
use nearmiss_benches::{Failure, machine};
use nearmiss_testdata::arbitrary::{rng, rotation, unit_vector};
use rand::RngExt;

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

/// Positions of all frames.
type Frames = Vec<Vec<[f64; 3]>>;

pub(crate) fn run(options: &Options) -> Result<(), Failure> {
    println!("{}\n", machine::description());
    if options.frames.is_empty() {
        return depth_frames(options);
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

/// Times in microseconds.
#[derive(Debug, Default)]
struct Times(Vec<f64>);

impl Times {
    fn of<R>(&mut self, work: impl FnOnce() -> R) -> R {
        let (result, time) = timed(work);
        self.0.push(nanoseconds(time) / 1e3);
        result
    }

    fn row(mut self, name: &str) {
        self.0.sort_by(f64::total_cmp);
        let (n, total) = (self.0.len(), self.0.iter().sum::<f64>());
        if n > 0 {
            println!("| {name} | {:.1} | {:.1} | {:.1} |", total / count(n), self.0[n / 2], self.0[n - 1]);
        }
    }
}

/// Follows frames by one method alone, with questions about each frame.
fn alone<'f, F: 'f + ?Sized>(
    name: &str,
    frames: impl Iterator<Item = &'f F>,
    mut follow: impl FnMut(&'f F) -> Result<(), Failure>,
    mut ask: impl FnMut(&'f F) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let mut times = Times::default();
    for frame in frames {
        times.of(|| follow(frame))?;
        ask(frame)?;
    }
    times.row(name);
    Ok(())
}

fn heading(what: &str) {
    println!("\n## {what}\n\n| µs | mean | median | most |\n| --- | --: | --: | --: |");
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
    for (name, by_refits) in [("refit, alone", true), ("renew, alone", false)] {
        let scan = RefCell::new(MovingScan::new(&frames[0], &built)?);
        let follow = |frame: &Vec<[f64; 3]>| {
            let mut scan = scan.borrow_mut();
            if by_refits {
                scan.refit(frame).map(drop)?
            } else {
                scan.renew(frame)?
            }
            Ok(())
        };
        let ask = |_: &_| {
            let scan = scan.borrow();
            let about = about(&poses, scan.bounds().centre());
            about.iter().try_for_each(|pose| ask(&scan, pose, &mut Times::default()).map(drop))
        };
        alone(name, frames.iter(), follow, ask)?;
    }
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

/// A room as a depth camera sees it, with noise and holes: two walls, a floor, and balls that move.
fn depth_frame([width, height]: [u32; 2], time: f64, rng: &mut impl rand::Rng) -> Vec<[f64; 3]> {
    let focus = 0.82 * f64::from(width);
    let balls = [
        ([-0.5 + 0.3 * time.sin(), 0.3, 2.0], 0.5),
        ([0.7, 0.6 - 0.2 * time.cos(), 2.6], 0.4),
        ([0.2, -0.5, 1.5 + 0.1 * time], 0.2),
    ];
    let mut pixel = |i: u32| {
        let (u, v) = (i % width, i / width);
        let d = [f64::from(u) - 0.5 * f64::from(width), f64::from(v) - 0.5 * f64::from(height)]
            .map(|x| x / focus);
        let d = [d[0], d[1], 1.0];
        let mut depth = 4.0_f64;
        for (slope, away) in [(d[1], 1.2), (d[0], 2.0)] {
            depth = if slope > 0.0 { depth.min(away / slope) } else { depth };
        }
        for (centre, radius) in balls {
            let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
            let (dd, dc, cc) = (dot(d, d), dot(d, centre), dot(centre, centre) - radius * radius);
            let root = dc * dc - dd * cc;
            depth = if root > 0.0 { depth.min((dc - root.sqrt()) / dd) } else { depth };
        }
        let [noise, hole] = [rng.random::<f64>(), rng.random::<f64>()];
        // Quadratic in the depth, as of cameras that triangulate.
        let depth = depth + 5e-4 * depth * depth * (noise - 0.5);
        if hole < 0.02 || (u / 40 + v / 40) % 11 == 0 { [f64::NAN; 3] } else { d.map(|x| x * depth) }
    };
    (0..width * height).map(&mut pixel).collect()
}

/// Frames of a depth camera that replace each other, by pixels and as points without order, and a
/// ball that is asked about in each.
fn depth_frames(options: &Options) -> Result<(), Failure> {
    const FRAMES: u32 = 20;
    let [width, height] = [640, 480];
    let rng = &mut rng(options.seed);
    let first: Vec<[f64; 3]> =
        depth_frame([width, height], 0.0, rng).into_iter().filter(|p| p[2].is_finite()).collect();
    let built = BuildOptions::default();
    let mut organised = MovingScan::new(&first, &built)?;
    let (mut unorganised, mut anew) = (organised.clone(), organised.clone());
    let tool: Vec<[f64; 3]> =
        nearmiss_benches::object::bumpy_sphere(5000).into_iter().map(|p| p.map(|x| 0.15 * x)).collect();
    let tool = MovingScan::new(&tool, &built)?;
    let mut times: [Times; 6] = std::array::from_fn(|_| Times::default());
    let [by_pixels, by_points, rebuild, ask_pixels, ask_points, ask_anew] = &mut times;
    let (mut scratch, mut totals) = (Scratch::default(), Totals::default());
    let asked = CollideOptions::default().with_evidence(Evidence::Certified);
    let mut frames = Frames::new();
    for step in 0..FRAMES {
        let frame = depth_frame([width, height], 0.1 * f64::from(step), rng);
        frames.push(frame.clone());
        by_pixels.of(|| organised.replace_organised(&frame, width as usize))?;
        by_points.of(|| unorganised.replace(&frame))?;
        let measured: Vec<[f64; 3]> = frame.iter().copied().filter(|p| p[2].is_finite()).collect();
        rebuild.of(|| anew = MovingScan::new(&measured, &built).unwrap_or_else(|_| anew.clone()));
        for _ in 0..options.poses {
            let seen = frame[rng.random_range(0..frame.len())];
            if !seen[2].is_finite() {
                continue;
            }
            let away = unit_vector(rng).map(|c| c * (0.12 + 0.1 * rng.random::<f64>()));
            let pose = rotation(rng).with_translation([0, 1, 2].map(|k| seen[k] + away[k]));
            let mut ask = |scan: &MovingScan, times: &mut Times| -> Result<Answer, Failure> {
                let plan = CollidePlan::new(&asked, scan, &tool)?;
                let pair = Pair::new(scan.at(&Pose::IDENTITY), tool.at(&pose));
                Ok(times.of(|| black_box(pair.collide(&plan, &mut scratch))))
            };
            let expected = ask(&anew, ask_anew)?;
            let found = [ask(&organised, ask_pixels)?, ask(&unorganised, ask_points)?];
            let scans: [&MovingScan; 2] = [&organised, &unorganised];
            for (k, (found, scan)) in found.iter().zip(scans).enumerate() {
                totals.proven[k] += usize::from(is_proof(&found.verdict));
                if found.verdict.is_intersecting() != expected.verdict.is_intersecting() {
                    totals.differ[k] += 1;
                    let (apart, answer) =
                        if expected.verdict.is_intersecting() { (scan, found) } else { (&anew, &expected) };
                    let plan = DistancePlan::new(&DistanceOptions::default(), apart, &tool)?;
                    let pair = Pair::new(apart.at(&Pose::IDENTITY), tool.at(&pose));
                    let distance = pair.distance(&plan, &mut Scratch::default()).upper;
                    totals.beyond[k] += usize::from(distance > answer.band);
                }
            }
            totals.proven[2] += usize::from(is_proof(&expected.verdict));
            totals.apart += usize::from(expected.verdict.is_separated());
        }
    }
    heading(&format!("frames of a depth camera: {width} × {height}, {} points", organised.len()));
    let names = [
        "replaced by pixels",
        "replaced by points",
        "prepare anew",
        "ask, by pixels",
        "ask, by points",
        "ask, prepared anew",
    ];
    let count = times[3].0.len();
    times.into_iter().zip(names).for_each(|(times, name)| times.row(name));
    for (name, by_pixels) in [("replaced by pixels, alone", true), ("replaced by points, alone", false)] {
        let scan = RefCell::new(MovingScan::new(&first, &built)?);
        let follow = |frame: &Vec<[f64; 3]>| {
            let mut scan = scan.borrow_mut();
            if by_pixels {
                scan.replace_organised(frame, width as usize)?
            } else {
                scan.replace(frame)?
            }
            Ok(())
        };
        let ask = |frame: &Vec<[f64; 3]>| {
            let scan = scan.borrow();
            let plan = CollidePlan::new(&asked, &scan, &tool)?;
            let step = frame.len() / options.poses.max(1) as usize;
            for seen in frame.iter().step_by(step.max(1)).filter(|seen| seen[2].is_finite()) {
                let tool = tool.at(&Pose::from_translation([seen[0], seen[1], seen[2] - 0.2]));
                black_box(Pair::new(scan.at(&Pose::IDENTITY), tool).collide(&plan, &mut scratch));
            }
            Ok(())
        };
        alone(name, frames.iter(), follow, ask)?;
    }
    let Totals { differ, beyond, proven, apart, .. } = totals;
    println!(
        "\n{differ:?} of {count} verdicts by pixels and by points differ from those prepared anew, {beyond:?} beyond the \
         band; of {apart} separations {proven:?} are certified by each"
    );
    Ok(())
}

/// Counts over all frames and poses, of refitted, renewed and rebuilt scans.
#[derive(Debug, Default)]
struct Totals {
    /// Verdicts that differ from those of a scan prepared anew, and those beyond the band.
    differ: [usize; 2],
    beyond: [usize; 2],
    /// Certified separations.
    proven: [usize; 3],
    apart: usize,
    /// Points fitted anew by refits, in all frames and at most.
    fitted: usize,
    most: usize,
    loosest: f64,
}

fn is_proof(verdict: &Verdict) -> bool {
    matches!(verdict, Verdict::Separated { evidence: Evidence::Certified, .. })
}

/// Returns the upper bound of the distance of two copies.
fn nearest(scan: &MovingScan, pose: &Pose) -> Result<f64, Failure> {
    let plan = DistancePlan::new(&DistanceOptions::default(), scan, scan)?;
    let pair = Pair::new(scan.at(&Pose::IDENTITY), Placed::new(scan, pose));
    Ok(pair.distance(&plan, &mut Scratch::default()).upper)
}
