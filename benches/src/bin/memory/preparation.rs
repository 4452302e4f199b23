//! The cost of preprocessing a large scan, with rivals beside.
//!
//! Memory is the peak of the allocated bytes above those live before the work; the input is not
//! counted. Pages of mapped files are not counted, because they do not come from the allocator.

use std::path::PathBuf;

use nearmiss::{BuildOptions, Check, GraphOptions, Paths, PointCloud, Scan};
use nearmiss_benches::clock::timed;
use nearmiss_benches::object::Object;
use nearmiss_benches::rivals::kiddo::PointScan;
use nearmiss_benches::rivals::parry::MeshTree;
use nearmiss_benches::sample::{count, quantile};
use nearmiss_benches::{Failure, machine};

use crate::ALLOCATOR;

/// A temporary file, removed on drop.
struct Scratch(PathBuf);

impl Drop for Scratch {
    fn drop(&mut self) {
        // Nothing can report a failure here.
        let _ = std::fs::remove_file(&self.0);
    }
}

/// Prints the median time of `runs` of `work`, with peak and remaining memory in bytes per point;
/// returns the last result.
fn measure<T>(
    what: &str,
    points: usize,
    runs: usize,
    mut work: impl FnMut() -> Result<T, Failure>,
) -> Result<T, Failure> {
    let mut times = Vec::new();
    loop {
        let before = ALLOCATOR.live();
        ALLOCATOR.restart();
        let (result, time) = timed(&mut work);
        let result = result?;
        times.push(time.as_secs_f64() * 1e3);
        if times.len() < runs {
            continue;
        }
        times.sort_unstable_by(f64::total_cmp);
        let each = |bytes: usize| count(bytes.saturating_sub(before)) / count(points);
        println!(
            "| {what} | {:.3} | {:.3} | {:.1} | {:.1} |",
            quantile(&times, 0.5),
            times[0],
            each(ALLOCATOR.peak()),
            each(ALLOCATOR.live()),
        );
        return Ok(result);
    }
}

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Object to measure: a file, `dragon-5k`, `dragon-23k` or `bumpy:POINTS`
    #[arg(default_value = "bumpy:1000000")]
    object: String,
    /// Runs; the median counts
    #[arg(long, value_name = "N", default_value_t = 3)]
    runs: usize,
    /// Thread counts; 0 means all
    #[arg(long, value_name = "N", default_values_t = [1, 0])]
    threads: Vec<usize>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let runs = arguments.runs.max(1);
    let object = Object::read(&arguments.object)?;
    let (cloud, n) = (&object.cloud, object.cloud.len());
    println!("{}\n## {}, {n} points\n", machine::description(), object.name);
    println!("| | median ms | best ms | peak B/point | kept B/point |");
    println!("| --- | --: | --: | --: | --: |");

    let positions: Vec<[f64; 3]> = (0..n).map(|i| cloud.point(i)).collect();
    measure("cloud from positions", n, runs, || Ok(PointCloud::from_positions(&positions)?))?;
    let mut scan = None;
    for &threads in &arguments.threads {
        let name = if threads == 0 { "all threads".into() } else { format!("{threads} thread(s)") };
        let options = BuildOptions::default().with_threads(threads);
        drop(scan.take());
        scan = Some(measure(&format!("prepare, {name}"), n, runs, || Ok(Scan::build(cloud, &options)?))?);
    }
    let bare = scan.ok_or("no number of threads")?;
    let mut scan = bare.clone();
    for (name, pairs) in [("graph, no map", None), ("graph, with the map", Some(Paths::Rebuilt))] {
        let options = GraphOptions::default().with_close_pairs(pairs);
        scan = measure(name, n, runs, || Ok(bare.clone().with_graph(cloud, &options, None)?))?;
    }
    let file = Scratch(std::env::temp_dir().join(format!("nearmiss-{}.scan", std::process::id())));
    let bytes = measure("save", n, runs, || Ok(scan.save(&file.0)?))?;
    let open = |check| Ok(Scan::open(&file.0, check)?);
    measure("open, Check::Structure", n, runs.max(9), || open(Check::Structure))?;
    measure("open, Check::Full", n, runs, || open(Check::Full))?;
    measure("read, Check::Full", n, runs, || Ok(Scan::read(&file.0, Check::Full)?))?;
    measure("rival: kiddo's kd-tree", n, runs, || PointScan::new(cloud, object.r))?;
    if let Some(mesh) = &object.mesh {
        measure("rival: parry's BVH of the mesh", n, runs, || Ok(MeshTree::new(mesh)))?;
    }
    let size = count(usize::try_from(bytes)?);
    println!(
        "\nfile: {bytes} bytes, {:.1} a point; {} nodes, {:.1} bytes a node",
        size / count(n),
        scan.topology().len(),
        count(scan.bytes_of_nodes()) / count(scan.topology().len())
    );
    println!(
        "{:.2} % of the points usable, sampling radius {:.6}",
        100.0 * scan.usable(),
        scan.sampling_radius()
    );
    Ok(())
}
