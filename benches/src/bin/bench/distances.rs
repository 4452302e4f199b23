//! Distance of two copies of an object over the poses of the sweep: time, bounds and work. The
//! rival is kiddo's search for the nearest point of one copy for each point of the other.
//!
//! Each time is the least of three queries of a pose, which do not follow each other directly.

use std::hint::black_box;

use nearmiss::{
    BuildOptions, Distance, DistanceOptions, DistancePlan, Evidence, Pair, Pose, Scan, Scratch, Semantics,
};
use nearmiss_benches::clock::{nanoseconds, timed};
use nearmiss_benches::object::Object;
use nearmiss_benches::rivals::kiddo::PointScan;
use nearmiss_benches::sample::{Sample, count};
use nearmiss_benches::{Failure, machine, poses};

/// Queries per pose.
const ASKINGS: usize = 3;

#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// Objects to measure: files, `dragon-5k`, `dragon-23k` or `bumpy:POINTS`
    #[arg(required = true, value_name = "OBJECT")]
    objects: Vec<String>,
    /// Poses at each distance
    #[arg(long, value_name = "N", default_value_t = 200)]
    per_distance: usize,
    /// Passes, each with new poses
    #[arg(long, value_name = "N", default_value_t = 1)]
    passes: u64,
    /// Poses at each distance for the rival
    #[arg(long, value_name = "N", default_value_t = 2)]
    rival_poses: usize,
    /// Index of the first distance
    #[arg(long, value_name = "I", default_value_t = 0)]
    from: usize,
    /// Seed of the random numbers
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Threads that preprocess the scan; 0 means all
    #[arg(long, value_name = "N", default_value_t = 0)]
    threads: usize,
}

pub(crate) fn run(options: &Options) -> Result<(), Failure> {
    println!("{}", machine::description());
    options.objects.iter().try_for_each(|source| measure(source, options))
}

fn measure(source: &str, options: &Options) -> Result<(), Failure> {
    let object = Object::read(source)?.scaled()?;
    let scan = Scan::build(&object.cloud, &BuildOptions::default().with_threads(options.threads))?;
    println!("## {}: {} points, r {:.5}\n", object.name, object.cloud.len(), object.r);
    for (name, semantics) in [("surfaces", Semantics::Surface), ("points", Semantics::Thickened(0.0))] {
        let plan = DistancePlan::new(&DistanceOptions::default().with_semantics(semantics), &scan, &scan)?;
        let mut scratch = Scratch::default();
        let ask = |pose: &Pose| {
            let (a, b) = (scan.at(&Pose::IDENTITY), scan.at(pose));
            Pair::new(a, b).distance(&plan, &mut scratch)
        };
        println!("### {name}\n");
        tell(&columns(options, options.per_distance, ask), options.from, object.r);
    }
    let rival = PointScan::new(&object.cloud, f64::INFINITY)?;
    println!("### kiddo, the nearest of each point\n");
    println!("| d | mean µs |\n| --: | --: |");
    let mut sum = 0.0;
    for (i, poses) in poses::sweep(options.rival_poses, options.seed, 0).iter().enumerate().skip(options.from)
    {
        let mut times = Sample::default();
        for pose in poses {
            times.push(nanoseconds(timed(|| black_box(rival.least_distance(black_box(pose)))).1));
        }
        sum += times.summary().mean / count(poses::DISTANCES - options.from);
        println!("| {} | {:.1} |", poses::distance(i), times.summary().mean / 1e3);
    }
    println!("\nmean of all distances {:.1} µs\n", sum / 1e3);
    Ok(())
}

/// Queries the poses of each distance in turn.
fn columns(options: &Options, per_distance: usize, mut ask: impl FnMut(&Pose) -> Distance) -> Vec<Column> {
    let mut columns: Vec<Column> = Vec::new();
    columns.resize_with(poses::DISTANCES, Column::default);
    for pass in 0..options.passes {
        let poses = poses::sweep(per_distance, options.seed, pass);
        for (column, poses) in columns.iter_mut().zip(&poses).skip(options.from) {
            let mut least = vec![f64::INFINITY; poses.len()];
            for asking in 0..ASKINGS {
                for (pose, least) in poses.iter().zip(&mut least) {
                    let (found, time) = timed(|| black_box(ask(black_box(pose))));
                    *least = least.min(nanoseconds(time));
                    if asking == 0 {
                        column.add(&found);
                    }
                }
            }
            least.into_iter().for_each(|time| column.times.push(time));
        }
    }
    columns
}

fn tell(columns: &[Column], from: usize, r: f64) {
    println!(
        "| d | mean µs | median | p99 | upper, r | upper − lower, r | touching | certified | node pairs | leaf pairs | evaluations |"
    );
    println!("|{}", " --: |".repeat(11));
    let mut sum = 0.0;
    for (i, column) in columns.iter().enumerate().skip(from) {
        let all = column.times.summary();
        sum += all.mean / count(columns.len() - from);
        let n = count(column.times.len());
        println!(
            "| {} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} | {:.3} | {:.3} | {:.1} | {:.1} | {:.1} |",
            poses::distance(i),
            all.mean / 1e3,
            all.median / 1e3,
            all.p99 / 1e3,
            column.upper / n / r,
            column.width / n / r,
            column.touching / n,
            column.certified / n,
            column.node_pairs / n,
            column.leaf_pairs / n,
            column.evaluations / n,
        );
    }
    println!("\nmean of all distances {:.2} µs\n", sum / 1e3);
}

/// Sums over the poses of a distance.
#[derive(Default)]
struct Column {
    times: Sample,
    upper: f64,
    width: f64,
    touching: f64,
    certified: f64,
    node_pairs: f64,
    leaf_pairs: f64,
    evaluations: f64,
}

impl Column {
    #[expect(clippy::cast_precision_loss, reason = "means of counts")]
    fn add(&mut self, found: &Distance) {
        self.upper += found.upper;
        self.width += found.upper - found.lower;
        self.touching += f64::from(u8::from(found.upper <= 0.0));
        self.certified += f64::from(u8::from(found.evidence == Evidence::Certified));
        self.node_pairs += found.statistics.node_pairs as f64;
        self.leaf_pairs += found.statistics.leaf_pairs as f64;
        self.evaluations += found.statistics.evaluations as f64;
    }
}
