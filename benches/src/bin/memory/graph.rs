//! The cost and the shape of proximity graphs.

use std::hint::black_box;

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use nearmiss::graph::{DynamicGraph, GraphOptions, PointGraph, Prune, Touched};
use nearmiss::index::{BlockBoxes, Nearest, PointBlock};
use nearmiss::surface::Level;
use nearmiss::{BuildOptions, PointHierarchy};
use nearmiss_benches::clock::timed;
use nearmiss_benches::object::Object;
use nearmiss_benches::sample::count;
use nearmiss_benches::{Failure, machine};

use crate::ALLOCATOR;

/// Prints the least time of `runs` of `work`, in nanoseconds per point.
fn measure<T>(what: &str, points: usize, runs: usize, mut work: impl FnMut() -> T) -> T {
    let (mut result, mut best) = timed(&mut work);
    for _ in 1..runs {
        let (again, time) = timed(&mut work);
        (result, best) = (again, best.min(time));
    }
    println!("| {what} | {:.1} |", best.as_secs_f64() * 1e9 / count(points));
    result
}

/// Measures the six nearest neighbours of every point, on one thread.
fn neighbours(positions: &[[f32; 3]], runs: usize) -> Result<(), Failure> {
    const COUNT: usize = 6;
    let n = positions.len();
    let mut blocks = vec![PointBlock::EMPTY; n.div_ceil(PointBlock::WIDTH)];
    for (i, p) in positions.iter().enumerate() {
        for k in 0..3 {
            blocks[i / 16].position[k][i % 16] = p[k];
        }
    }
    println!("| nearest {COUNT}, one thread | ns a point |\n| --- | --: |");
    let boxes = measure("build of the tree", n, runs, || BlockBoxes::new(&blocks, n));
    let tree = boxes.over(&blocks);
    let mut found = Nearest::default();
    for (name, level) in [("best", Level::new()), ("baseline", Level::baseline())] {
        measure(&format!("block tree, {name} instructions"), n, runs, || {
            for block in 0..blocks.len() {
                tree.nearest(level, block, COUNT, &mut found);
                black_box(&found);
            }
        });
    }
    let rival = measure("rival: build of kiddo's kd-tree", n, runs, || {
        ImmutableKdTree::<f32, 3>::new_from_slice(positions)
    })
    .map_err(|e| format!("{e:?}"))?;
    let wanted = std::num::NonZero::new(COUNT + 1).ok_or("no neighbours")?;
    measure("rival: kiddo", n, runs, || {
        for p in positions {
            black_box(rival.query(p).nearest_n::<SquaredEuclidean<f32>>(wanted).execute());
        }
    });
    Ok(())
}

/// Measures the construction of the graph on one thread, two, and so on.
fn speed(positions: &[[f32; 3]], runs: usize) -> Result<(), Failure> {
    println!("\n| threads | points/s | peak bytes a point |\n| --: | --: | --: |");
    let mut threads = 1;
    while threads <= std::thread::available_parallelism()?.get() {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
        let mut best = f64::INFINITY;
        let before = ALLOCATOR.live();
        ALLOCATOR.restart();
        for _ in 0..runs {
            let build = || PointGraph::build(positions, &GraphOptions::default());
            let (graph, time) = timed(|| pool.install(build));
            black_box(graph?);
            best = best.min(time.as_secs_f64());
        }
        let (n, peak) = (count(positions.len()), ALLOCATOR.peak().saturating_sub(before));
        println!("| {threads} | {:.0} | {:.0} |", n / best, count(peak) / n);
        threads *= 2;
    }
    Ok(())
}

/// Prints statistics of the graph, by pruning.
fn looks(positions: &[[f32; 3]]) -> Result<(), Failure> {
    println!("\n| pruning | degree | virtual % | components | in the largest % | border % | bytes a point |");
    println!("| --- | --: | --: | --: | --: | --: | --: |");
    let n = count(positions.len());
    for prune in [Prune::Never, Prune::Quartiles(0.5), Prune::Quartiles(1.0), Prune::Quartiles(1.5)] {
        let graph = PointGraph::build(positions, &GraphOptions::default().with_prune(prune))?;
        let counts = graph.counts();
        let mut sizes = vec![0_usize; positions.len()];
        for &least in graph.components() {
            sizes[least as usize] += 1;
        }
        let largest = sizes.into_iter().max().unwrap_or_default();
        let all = count(counts.edges + counts.virtual_edges);
        println!(
            "| {prune:?} | {:.2} | {:.2} | {} | {:.2} | {:.2} | {:.1} |",
            2.0 * count(counts.edges) / n,
            100.0 * count(counts.virtual_edges) / all,
            counts.components,
            100.0 * count(largest) / n,
            100.0 * count(counts.border) / n,
            count(graph.bytes()) / n,
        );
    }
    Ok(())
}

/// Updates that a row of the table averages.
const UPDATES: usize = 1000;

/// Prints a row of the table of updates.
fn row(
    size: u32,
    what: &str,
    mut update: impl FnMut(usize) -> Result<Touched, Failure>,
) -> Result<(), Failure> {
    let (mut spheres, mut touched, mut most) = (0, 0, 0);
    let (result, time) = timed(|| -> Result<(), Failure> {
        for i in 0..UPDATES {
            let one = update(i)?;
            spheres += one.spheres;
            touched += one.points;
            most = most.max(one.points);
        }
        Ok(())
    });
    result?;
    let [spheres, touched] = [spheres, touched].map(|n| count(n) / count(UPDATES));
    let micros = time.as_secs_f64() * 1e6 / count(UPDATES);
    println!("| {size} | {what} | {spheres:.1} | {touched:.1} | {most} | {micros:.1} |");
    Ok(())
}

/// Measures the time and extent of one update, on surfaces of increasing size.
fn updates() -> Result<(), Failure> {
    println!("{}\n", machine::description());
    println!(
        "| points | update | spheres | points touched | most | µs |\n| --: | --- | --: | --: | --: | --: |"
    );
    for exponent in 3..=6 {
        let size = 10_u32.pow(exponent);
        let object = Object::read(&format!("bumpy:{}", size as usize + UPDATES))?;
        let hierarchy = PointHierarchy::build(&object.cloud, &BuildOptions::default())?;
        // The points left out come from all over the surface.
        let (mut there, mut spare) = (Vec::new(), Vec::new());
        let every = object.cloud.len() / UPDATES;
        for (i, &p) in hierarchy.positions().iter().enumerate() {
            let list = if i % every == 0 && spare.len() < UPDATES { &mut spare } else { &mut there };
            list.push(p);
        }
        let mut graph = DynamicGraph::new(&there, &GraphOptions::default())?;
        let mut ids = Vec::new();
        row(size, "insert", |i| {
            let (id, touched) = graph.insert(spare[i])?;
            ids.push(id);
            Ok(touched)
        })?;
        row(size, "move", |i| {
            // A third of the way to a neighbour.
            let to = graph.of(ids[i]).first().and_then(|&j| graph.position(j)).ok_or("no neighbour")?;
            let to = [0, 1, 2].map(|k| spare[i][k] + (to[k] - spare[i][k]) / 3.0);
            Ok(graph.relocate(ids[i], to)?.ok_or("no such point")?)
        })?;
        row(size, "remove", |i| Ok(graph.remove(ids[i]).ok_or("no such point")?))?;
    }
    Ok(())
}

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Object to measure: a file, `dragon-5k`, `dragon-23k` or `bumpy:POINTS`
    #[arg(default_value = "bumpy:1000000")]
    object: String,
    /// Runs; the fastest one counts
    #[arg(long, value_name = "N", default_value_t = 3)]
    runs: usize,
    /// Measure instead the insertion, move and removal of one point among 10³ to 10⁶
    #[arg(long)]
    updates: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let runs = arguments.runs.max(1);
    if arguments.updates {
        return updates();
    }
    let object = Object::read(&arguments.object)?;
    let hierarchy = PointHierarchy::build(&object.cloud, &BuildOptions::default())?;
    let positions = hierarchy.positions();
    println!("{}\n## {}, {} points\n", machine::description(), object.name, positions.len());
    neighbours(positions, runs)?;
    speed(positions, runs)?;
    looks(positions)
}
