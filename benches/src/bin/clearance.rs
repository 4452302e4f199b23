//! The clearance of an object that moves through a scan: bounds, the nearest points, and what each answer takes.
//!
//! `clearance SCAN OBJECT --from X,Y,Z --to X,Y,Z [--size S] [--steps N] [--turn DEGREES] [--image OUT.svg]`
//!
//! The object's centre goes straight from one place to the other while it turns about a fixed axis. At each step the distance is
//! asked with and the verdict with certified evidence, and hinted by the step before; the exact distance of the nearest points is
//! the truth that no upper bound may exceed.
#![expect(clippy::print_stdout, reason = "a program for people")]

use std::fs;

use nearmiss::{
    Budget, BuildOptions, CollideOptions, CollidePlan, CollideScratch, DistanceOptions, DistancePlan,
    DistanceScratch, Evidence, PairHint, Pose, Scan, Verdict, collide_hinted, distance_with,
};
use nearmiss_benches::arguments::Arguments;
use nearmiss_benches::clock::{nanoseconds, timed};
use nearmiss_benches::object::Object;
use nearmiss_benches::plot::{self, Axis, Line, Panel};
use nearmiss_benches::rivals::kiddo::PointScan;
use nearmiss_benches::sample::{Sample, count};
use nearmiss_benches::{Failure, machine};
use nearmiss_testdata::arbitrary::{rng, unit_vector};

fn main() -> Result<(), Failure> {
    let mut arguments = Arguments::of_process();
    let place = |text: Option<String>, name: &str| -> Result<[f64; 3], Failure> {
        let text = text.ok_or_else(|| format!("{name} X,Y,Z is missing"))?;
        let numbers: Result<Vec<f64>, _> = text.split(',').map(str::parse).collect();
        let numbers = numbers.map_err(|_| format!("expected {name} X,Y,Z, got {text:?}"))?;
        Ok(numbers.try_into().map_err(|_| format!("expected three numbers for {name}, got {text:?}"))?)
    };
    let from = place(arguments.value("--from")?, "--from")?;
    let to = place(arguments.value("--to")?, "--to")?;
    let size: Option<f64> = arguments.value("--size")?;
    let steps: usize = arguments.value("--steps")?.unwrap_or(200);
    let turn: f64 = arguments.value("--turn")?.unwrap_or(180.0);
    let image: Option<String> = arguments.value("--image")?;
    let [scan, object]: [String; 2] =
        arguments.words()?.try_into().map_err(|_| "usage: clearance SCAN OBJECT --from … --to …")?;

    let (room, body) = (Object::read(&scan)?, Object::read(&object)?);
    let (a, b) = (
        Scan::build(&room.cloud, &BuildOptions::default())?,
        Scan::build(&body.cloud, &BuildOptions::default())?,
    );
    let longest = 2.0 * body.cloud.bounds().half_extents().into_iter().fold(0.0, f64::max);
    let scale = size.map_or(1.0, |size| size / longest);
    let tree = PointScan::new(&room.cloud, f64::INFINITY)?;
    let plan = DistancePlan::new(&DistanceOptions::default(), &a, &b)?;
    let asked = CollideOptions::default().with_evidence(Evidence::Certified);
    let verdicts = CollidePlan::new(&asked, &a, &b)?;
    let (mut distances, mut scratch) = (DistanceScratch::default(), CollideScratch::default());
    let mut hint = PairHint::default();
    let axis = unit_vector(&mut rng(3));
    let centre = body.cloud.bounds().centre();

    let [mut lower, mut upper, mut truth, mut times, mut hinted] = [const { Vec::new() }; 5];
    let (mut of_distance, mut of_verdict) = (Sample::default(), Sample::default());
    let (mut touching, mut certified, mut wrong) = (0, 0, 0);
    for step in 0..steps {
        let share = count(step) / count((steps - 1).max(1));
        let turned = Pose::from_axis_angle(axis, share * turn.to_radians()).with_scale(scale);
        let middle = turned.apply(centre);
        let pose =
            turned.with_translation([0, 1, 2].map(|k| from[k] + (to[k] - from[k]) * share - middle[k]));
        let (va, vb) = (a.at(&Pose::IDENTITY), b.at(&pose));
        let (found, time) = timed(|| distance_with(&va, &vb, &plan, &Budget::UNLIMITED, &mut distances));
        let (answer, brief) =
            timed(|| collide_hinted(&va, &vb, &verdicts, &Budget::UNLIMITED, &mut hint, &mut scratch));
        let (nearest, ..) = tree.nearest_pair(&body.cloud, &pose);
        wrong += usize::from(found.lower > nearest * (1.0 + 1e-6) || found.upper > nearest * (1.0 + 1e-6));
        touching += usize::from(answer.verdict.is_intersecting());
        certified +=
            usize::from(matches!(answer.verdict, Verdict::Separated { evidence: Evidence::Certified, .. }));
        of_distance.push(nanoseconds(time));
        of_verdict.push(nanoseconds(brief));
        let way = share * (0..3).map(|k| (to[k] - from[k]).powi(2)).sum::<f64>().sqrt();
        lower.push([way, found.lower]);
        upper.push([way, found.upper]);
        truth.push([way, nearest]);
        times.push([way, nanoseconds(time) / 1e3]);
        hinted.push([way, nanoseconds(brief) / 1e3]);
    }
    let (of_distance, of_verdict) = (of_distance.summary(), of_verdict.summary());
    println!("{}\n", machine::description());
    println!(
        "{steps} steps of {} in {}: {touching} touch, {certified} certified apart, {wrong} bounds above the nearest points; \
         distance {:.0} µs (p99 {:.0}), hinted verdict {:.2} µs (p99 {:.1})",
        body.name,
        room.name,
        of_distance.mean / 1e3,
        of_distance.p99 / 1e3,
        of_verdict.mean / 1e3,
        of_verdict.p99 / 1e3
    );
    if let Some(path) = image {
        let line = |name: &str, points: Vec<[f64; 2]>, colour: usize| Line {
            name: name.into(),
            points,
            colour,
            dashed: false,
        };
        let figure = plot::figure(&[
            Panel {
                title: "clearance along the path".into(),
                axes: [Axis::even("way"), Axis::even("clearance")],
                lines: vec![
                    line("nearest points", truth, 0),
                    line("upper bound", upper, 1),
                    line("lower bound", lower, 2),
                ],
            },
            Panel {
                title: "time of an answer".into(),
                axes: [Axis::even("way"), Axis::logarithmic("µs")],
                lines: vec![line("distance", times, 0), line("verdict, hinted", hinted, 1)],
            },
        ])?;
        fs::write(path, figure)?;
    }
    Ok(())
}
