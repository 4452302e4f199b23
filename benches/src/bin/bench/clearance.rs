//! The clearance of an object that moves through a scan: bounds, the nearest points, and the time
//! of each answer.
//!
//! The centre of the object moves in a straight line while the object turns about a fixed axis.
//! Each step queries the distance, and a certified verdict with the hint of the previous step. No
//! upper bound may exceed the exact distance of the nearest points.

use std::fs;
use std::path::PathBuf;

use nearmiss::{
    BuildOptions, CollideOptions, CollidePlan, DistanceOptions, DistancePlan, Evidence, Pair, PairHint, Pose,
    Scan, Scratch, Verdict,
};
use nearmiss_benches::clock::{nanoseconds, timed};
use nearmiss_benches::object::Object;
use nearmiss_benches::plot::{self, Axis, Line, Panel};
use nearmiss_benches::rivals::kiddo::PointScan;
use nearmiss_benches::sample::{Sample, count};
use nearmiss_benches::{Failure, machine};
use nearmiss_testdata::arbitrary::{rng, unit_vector};

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// The scan that the object moves through
    scan: String,
    /// The object that moves
    object: String,
    /// Start of the object's centre
    #[arg(long, value_name = "X,Y,Z", value_parser = place, allow_hyphen_values = true)]
    from: [f64; 3],
    /// End of the object's centre
    #[arg(long, value_name = "X,Y,Z", value_parser = place, allow_hyphen_values = true)]
    to: [f64; 3],
    /// The longest side that the object is scaled to; by default it keeps its size
    #[arg(long, value_name = "S")]
    size: Option<f64>,
    /// Steps on the path
    #[arg(long, value_name = "N", default_value_t = 200)]
    steps: usize,
    /// The angle by which the object turns on the path
    #[arg(long, value_name = "DEGREES", default_value_t = 180.0, allow_negative_numbers = true)]
    turn: f64,
    /// File to write a figure to
    #[arg(long, value_name = "OUT.svg")]
    image: Option<PathBuf>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let &Arguments { from, to, steps, turn, .. } = arguments;
    let (room, body) = (Object::read(&arguments.scan)?, Object::read(&arguments.object)?);
    let longest = 2.0 * body.cloud.bounds().half_extents().into_iter().fold(0.0, f64::max);
    let scale = arguments.size.map_or(1.0, |size| size / longest);
    let (axis, centre) = (unit_vector(&mut rng(3)), body.cloud.bounds().centre());
    let length = (0..3).map(|k| (to[k] - from[k]).powi(2)).sum::<f64>().sqrt();
    let path: Vec<(f64, Pose)> = (0..steps)
        .map(|step| {
            let share = count(step) / count((steps - 1).max(1));
            let turned = Pose::from_axis_angle(axis, share * turn.to_radians()).with_scale(scale);
            let middle = turned.apply(centre);
            let to = [0, 1, 2].map(|k| from[k] + (to[k] - from[k]) * share - middle[k]);
            (share * length, turned.with_translation(to))
        })
        .collect();
    let found = Found::along(&path, &room, &body)?;
    println!("{}\n", machine::description());
    found.print(&body.name, &room.name);
    if let Some(path) = &arguments.image {
        fs::write(path, found.figure()?)?;
    }
    Ok(())
}

/// Parses the coordinates of a point.
fn place(text: &str) -> Result<[f64; 3], String> {
    let numbers = text.split(',').map(str::parse).collect::<Result<Vec<f64>, _>>();
    match numbers.as_deref() {
        Ok(&[x, y, z]) => Ok([x, y, z]),
        _ => Err(format!("expected X,Y,Z, got {text:?}")),
    }
}

/// Values over the position on the path.
type Curve = Vec<[f64; 2]>;

/// The bounds, times and verdicts along a path.
#[derive(Default)]
struct Found {
    lower: Curve,
    upper: Curve,
    /// Distance of the nearest points.
    nearest: Curve,
    /// Microseconds of a distance query.
    distances: Curve,
    /// Microseconds of a hinted verdict.
    verdicts: Curve,
    touching: usize,
    certified: usize,
    /// Upper bounds that exceed the distance of the nearest points.
    wrong: usize,
}

impl Found {
    fn along(path: &[(f64, Pose)], room: &Object, body: &Object) -> Result<Self, Failure> {
        let build = |object: &Object| Scan::build(&object.cloud, &BuildOptions::default());
        let (a, b) = (build(room)?, build(body)?);
        let tree = PointScan::new(&room.cloud, f64::INFINITY)?;
        let plan = DistancePlan::new(&DistanceOptions::default(), &a, &b)?;
        let certified = CollideOptions::estimated().with_evidence(Evidence::Certified);
        let asked = CollidePlan::new(&certified, &a, &b)?;
        let (mut apart, mut scratch) = (Scratch::default(), Scratch::default());
        let (mut hint, mut found) = (PairHint::default(), Self::default());
        for (way, pose) in path {
            let (va, vb) = (a.at(&Pose::IDENTITY), b.at(pose));
            let (distance, time) = timed(|| Pair::new(va, vb).distance(&plan, &mut apart));
            let (answer, brief) = timed(|| Pair::new(va, vb).hinted(&mut hint).collide(&asked, &mut scratch));
            let (nearest, ..) = tree.nearest_pair(&body.cloud, pose);
            found.wrong += usize::from(distance.lower.max(distance.upper) > nearest * (1.0 + 1e-6));
            match answer.verdict {
                Verdict::Intersecting { .. } => found.touching += 1,
                Verdict::Separated { evidence: Evidence::Certified, .. } => found.certified += 1,
                _ => {}
            }
            found.lower.push([*way, distance.lower]);
            found.upper.push([*way, distance.upper]);
            found.nearest.push([*way, nearest]);
            found.distances.push([*way, nanoseconds(time) / 1e3]);
            found.verdicts.push([*way, nanoseconds(brief) / 1e3]);
        }
        Ok(found)
    }

    fn print(&self, body: &str, room: &str) {
        let summary = |curve: &Curve| {
            let mut sample = Sample::default();
            curve.iter().for_each(|[_, time]| sample.push(*time));
            sample.summary()
        };
        let (distances, verdicts) = (summary(&self.distances), summary(&self.verdicts));
        println!(
            "{} steps of {body} in {room}: {} touch, {} certified apart, {} bounds above the nearest points; \
             distance {:.0} µs (median {:.0}, p99 {:.0}), hinted verdict {:.1} µs (median {:.1}, p99 {:.0})",
            self.lower.len(),
            self.touching,
            self.certified,
            self.wrong,
            distances.mean,
            distances.median,
            distances.p99,
            verdicts.mean,
            verdicts.median,
            verdicts.p99
        );
    }

    fn figure(&self) -> Result<String, Failure> {
        let line = |name: &str, points: &Curve, colour: usize| Line {
            name: name.into(),
            points: points.clone(),
            colour,
            dashed: false,
        };
        plot::figure(&[
            Panel {
                title: "clearance along the path".into(),
                axes: [Axis::even("way"), Axis::even("clearance")],
                lines: vec![
                    line("nearest points", &self.nearest, 0),
                    line("upper bound", &self.upper, 1),
                    line("lower bound", &self.lower, 2),
                ],
            },
            Panel {
                title: "time of an answer".into(),
                axes: [Axis::even("way"), Axis::logarithmic("µs")],
                lines: vec![line("distance", &self.distances, 0), line("verdict, hinted", &self.verdicts, 1)],
            },
        ])
    }
}
