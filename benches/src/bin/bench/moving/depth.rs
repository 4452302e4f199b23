//! Frames of a depth camera that replace each other.

use std::hint::black_box;

use nearmiss::{
    Answer, BuildOptions, CollideOptions, CollidePlan, DistanceOptions, DistancePlan, Evidence, MovingScan,
    Pair, Pose, Scratch,
};
use nearmiss_benches::Failure;
use nearmiss_testdata::arbitrary::{rng, rotation, unit_vector};
use rand::RngExt;

use super::measured::{Frames, Times, Totals, alone, heading, is_proof};

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
pub(crate) fn depth_frames(poses: u32, seed: u64) -> Result<(), Failure> {
    const FRAMES: u32 = 20;
    let [width, height] = [640, 480];
    let rng = &mut rng(seed);
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
        for _ in 0..poses {
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
    depth_frames_alone(poses, (&first, &frames, width as usize), &tool)?;
    let Totals { differ, beyond, proven, apart, .. } = totals;
    println!(
        "\n{differ:?} of {count} verdicts by pixels and by points differ from those prepared anew, {beyond:?} beyond the \
         band; of {apart} separations {proven:?} are certified by each"
    );
    Ok(())
}

/// Follows frames of a depth camera by each method alone. `first` are the points to begin with.
fn depth_frames_alone(
    poses: u32,
    (first, frames, width): (&[[f64; 3]], &Frames, usize),
    tool: &MovingScan,
) -> Result<(), Failure> {
    let asked = CollideOptions::default().with_evidence(Evidence::Certified);
    let mut scratch = Scratch::default();
    let scan = MovingScan::new(first, &BuildOptions::default())?;
    let mut ask = |scan: &MovingScan, frame: &[[f64; 3]]| {
        let plan = CollidePlan::new(&asked, scan, tool)?;
        let step = frame.len() / poses.max(1) as usize;
        for seen in frame.iter().step_by(step.max(1)).filter(|seen| seen[2].is_finite()) {
            let tool = tool.at(&Pose::from_translation([seen[0], seen[1], seen[2] - 0.2]));
            black_box(Pair::new(scan.at(&Pose::IDENTITY), tool).collide(&plan, &mut scratch));
        }
        Ok(())
    };
    let by_pixels = |scan: &mut MovingScan, frame: &[_]| Ok(scan.replace_organised(frame, width)?);
    alone("replaced by pixels, alone", frames, &scan, by_pixels, &mut ask)?;
    alone("replaced by points, alone", frames, &scan, |scan, frame| Ok(scan.replace(frame)?), &mut ask)
}
