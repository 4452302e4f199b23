//! An object's mesh against a scan, beside its points against the same scan.
//!
//! With poses that have exact answers, the mesh of the second object is compared with the points of
//! the first, and answers are scored. Otherwise the object is placed at random in real scans. The
//! truth is then the distance of the nearest point of the scan from the mesh, in multiples of its
//! local spacing: the distance of that point from its sixth distinct neighbour. Each pose is queried
//! once by each method, in separate passes.

use std::hint::black_box;
use std::path::PathBuf;

use nearmiss::{
    Budget, BuildOptions, CollideOptions, CollidePlan, Detail, DistanceOptions, DistancePlan, Evidence, Mesh,
    MeshBuildOptions, MeshScanPair, MeshScanPlan, Pair, Pose, Scan, Scratch, Semantics, Verdict,
};
use nearmiss_benches::asked::best_effort;
use nearmiss_benches::clock::{nanoseconds, timed};
use nearmiss_benches::object::Object;
use nearmiss_benches::sample::{Sample, count};
use nearmiss_benches::scorer::{Score, spacings};
use nearmiss_benches::{Failure, machine, truth};
use nearmiss_testdata::arbitrary::{rng, rotation};
use rand::RngExt;

/// Separations of at least this many local spacings should be certified.
const FAR: f64 = 6.0;

/// The object's longest side over the scan's diagonal.
const SHARE: f64 = 0.04;

#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// Scans that the object is placed in
    #[arg(required = true, value_name = "SCAN")]
    scans: Vec<String>,
    /// The object with the mesh; by default the scan itself, which must have one
    #[arg(long, value_name = "OBJECT")]
    object: Option<String>,
    /// Poses with exact answers, one JSON object per line, instead of random ones
    #[arg(long, value_name = "POSES.jsonl")]
    truth: Option<PathBuf>,
    /// Work units per query of poses with exact answers; best efforts are scored
    #[arg(long, value_name = "N", requires = "truth")]
    work: Option<u64>,
    /// The longest side that the object is scaled to; by default a 25th of the scan's diagonal
    #[arg(long, value_name = "S")]
    size: Option<f64>,
    /// Random poses of the object
    #[arg(long, value_name = "N", default_value_t = 300)]
    poses: usize,
    /// Seed of the random numbers
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
}

/// A scan, the object's points as a scan, and its mesh.
struct Subject {
    name: String,
    scan: Scan,
    points: Scan,
    mesh: Mesh,
}

pub(crate) fn run(options: &Options) -> Result<(), Failure> {
    println!("{}\n", machine::description());
    for source in &options.scans {
        let object = Object::read(source)?;
        let body = options.object.as_ref().map_or_else(|| Ok(object.clone()), |body| Object::read(body))?;
        let mesh =
            body.mesh.as_ref().ok_or_else(|| format!("expected an object with a mesh, got {}", body.name))?;
        let subject = Subject {
            name: format!("{} against {}", body.name, object.name),
            scan: Scan::build(&object.cloud, &BuildOptions::default())?,
            points: Scan::build(&body.cloud, &BuildOptions::default())?,
            mesh: Mesh::build(mesh, &MeshBuildOptions::default())?,
        };
        match &options.truth {
            Some(poses) => score(&subject, &object, &truth::read(poses, &object.cloud.bounds())?, options)?,
            None => place(&subject, &object, &body, options)?,
        }
    }
    Ok(())
}

/// The options of a verdict, a witness and a certificate.
fn plans() -> [CollideOptions; 3] {
    let options = CollideOptions::estimated();
    [options.with_detail(Detail::Verdict), options, options.with_evidence(Evidence::Certified)]
}

/// Scores both methods on poses with exact answers.
fn score(
    subject: &Subject,
    object: &Object,
    questions: &[truth::Question],
    options: &Options,
) -> Result<(), Failure> {
    let budget = options.work.map_or(Budget::UNLIMITED, |work| Budget::UNLIMITED.with_work(work));
    let mut scratch = Scratch::default();
    for (what, asked) in ["verdict", "witness", "certified"].into_iter().zip(plans()) {
        let plan = MeshScanPlan::new(&asked, &subject.scan)?;
        let of_points = CollidePlan::new(&asked, &subject.scan, &subject.points)?;
        for by_mesh in [true, false] {
            let (mut score, mut times) = (Score::default(), Sample::default());
            for (index, question) in questions.iter().enumerate() {
                let scan = subject.scan.at(&question.a);
                let (answer, time) = timed(|| {
                    if by_mesh {
                        let pair = MeshScanPair::new(scan, subject.mesh.at(&question.b)).within(&budget);
                        pair.collide(&plan, &mut scratch)
                    } else {
                        let pair = Pair::new(scan, subject.points.at(&question.b)).within(&budget);
                        pair.collide(&of_points, &mut scratch)
                    }
                });
                times.push(nanoseconds(time));
                score.count(index, question, object.r, &best_effort(answer.verdict));
            }
            let (times, method) = (times.summary(), if by_mesh { "mesh" } else { "points" });
            println!(
                "\n{}, {what}, {method}: mean {:.2} µs, p99 {:.2} µs",
                subject.name,
                times.mean / 1e3,
                times.p99 / 1e3
            );
            println!("{score}");
        }
    }
    Ok(())
}

/// A random pose, the least distance of a point of the scan from the mesh, and the spacing there.
struct Placing {
    pose: Pose,
    distance: f64,
    spacing: f64,
}

/// Measures both methods at random poses of the object in the scan.
#[expect(clippy::too_many_lines, reason = "one table, row by row")]
fn place(subject: &Subject, object: &Object, body: &Object, options: &Options) -> Result<(), Failure> {
    let half = object.cloud.bounds().half_extents();
    let diagonal = 2.0 * half.iter().map(|x| x * x).sum::<f64>().sqrt();
    let longest = 2.0 * body.cloud.bounds().half_extents().into_iter().fold(0.0, f64::max);
    let scale = options.size.unwrap_or(SHARE * diagonal) / longest;
    let (bounds, centre, rng) = (object.cloud.bounds(), body.cloud.bounds().centre(), &mut rng(options.seed));
    let spacings = spacings(&object.cloud)?;
    let mut scratch = Scratch::default();
    let exact = DistanceOptions::default().with_semantics(Semantics::Thickened(0.0));
    let exact = DistancePlan::against_mesh(&exact, &subject.scan)?;
    let placings: Vec<Placing> = (0..options.poses)
        .map(|_| {
            let to = [0, 1, 2]
                .map(|k| bounds.min[k] + (bounds.max[k] - bounds.min[k]) * rng.random_range(0.0..1.0));
            let turned = rotation(rng).with_scale(scale);
            let from = turned.apply(centre);
            let pose = turned.with_translation([0, 1, 2].map(|k| to[k] - from[k]));
            let pair = MeshScanPair::new(subject.scan.at(&Pose::IDENTITY), subject.mesh.at(&pose));
            let found = pair.distance(&exact, &mut scratch);
            let stored = (0..object.cloud.len()).find(|&i| object.cloud.source()[i] == found.sources[0].0);
            Placing { pose, distance: found.upper, spacing: spacings[stored.unwrap_or(0)] }
        })
        .collect();
    println!(
        "\n{}, scaled by {scale:.4}\n\n| question | method | µs: mean, p99 | intersecting: certified, estimated | \
         separated: certified, estimated | undecided | furthest contact, spacings | certified from 6 spacings on |",
        subject.name
    );
    println!("|{}", " --- |".repeat(8));
    for (what, asked) in ["verdict", "witness", "certified"].into_iter().zip(plans()) {
        let plan = MeshScanPlan::new(&asked, &subject.scan)?;
        let of_points = CollidePlan::new(&asked, &subject.scan, &subject.points)?;
        for by_mesh in [true, false] {
            let mut times = Sample::default();
            let (mut kinds, mut furthest, mut far) = ([0; 5], 0.0_f64, [0; 2]);
            for placing in &placings {
                let scan = subject.scan.at(&Pose::IDENTITY);
                let (answer, time) = timed(|| {
                    if by_mesh {
                        black_box(
                            MeshScanPair::new(scan, subject.mesh.at(&placing.pose))
                                .collide(&plan, &mut scratch),
                        )
                    } else {
                        black_box(
                            Pair::new(scan, subject.points.at(&placing.pose))
                                .collide(&of_points, &mut scratch),
                        )
                    }
                });
                times.push(nanoseconds(time));
                let kind = match answer.verdict {
                    Verdict::Intersecting { evidence: Evidence::Certified, .. } => 0,
                    Verdict::Intersecting { .. } => 1,
                    Verdict::Separated { evidence: Evidence::Certified, .. } => 2,
                    Verdict::Separated { .. } => 3,
                    Verdict::Undecided(_) => 4,
                };
                kinds[kind] += 1;
                if let Verdict::Separated { gap, .. } = answer.verdict
                    && gap > placing.distance
                {
                    println!("a gap of {gap}, but a point is {} away", placing.distance);
                }
                if kind < 2 {
                    furthest = furthest.max(placing.distance / placing.spacing);
                } else if placing.distance >= FAR * placing.spacing {
                    far[0] += 1;
                    far[1] += usize::from(kind == 2);
                }
            }
            let (times, method) = (times.summary(), if by_mesh { "mesh" } else { "points" });
            println!(
                "| {what} | {method} | {:.1}, {:.0} | {}, {} | {}, {} | {} | {furthest:.2} | {} of {} |",
                times.mean / 1e3,
                times.p99 / 1e3,
                kinds[0],
                kinds[1],
                kinds[2],
                kinds[3],
                kinds[4],
                far[1],
                far[0],
            );
        }
    }
    distances(subject, &placings, &mut scratch)
}

/// Measures the bounds of distances by both methods.
fn distances(subject: &Subject, placings: &[Placing], scratch: &mut Scratch) -> Result<(), Failure> {
    println!(
        "\n| distance | µs: mean, p99 | `lower` above the nearest point | `upper` above it | `lower` ≥ half of it, far |"
    );
    println!("|{}", " --- |".repeat(5));
    let plan = DistancePlan::new(&DistanceOptions::default(), &subject.scan, &subject.points)?;
    for by_mesh in [true, false] {
        let (mut times, mut above, mut far, mut half) = (Sample::default(), [0; 2], 0, 0);
        for Placing { pose, distance, spacing } in placings {
            let scan = subject.scan.at(&Pose::IDENTITY);
            let (found, time) = timed(|| {
                if by_mesh {
                    black_box(MeshScanPair::new(scan, subject.mesh.at(pose)).distance(&plan, scratch))
                } else {
                    black_box(Pair::new(scan, subject.points.at(pose)).distance(&plan, scratch))
                }
            });
            times.push(nanoseconds(time));
            let rounding = 1e-6 * (distance + spacing);
            above[0] += usize::from(found.lower > distance + rounding);
            above[1] += usize::from(found.upper > distance + rounding);
            if *distance >= FAR * spacing {
                far += 1;
                half += usize::from(found.lower >= 0.5 * distance);
            }
        }
        let (times, method) = (times.summary(), if by_mesh { "mesh" } else { "points" });
        let share = 100.0 * count(half) / count(far.max(1));
        println!(
            "| {method} | {:.1}, {:.0} | {} | {} | {share:.1} % of {far} |",
            times.mean / 1e3,
            times.p99 / 1e3,
            above[0],
            above[1],
        );
    }
    Ok(())
}
