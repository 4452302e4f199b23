//! What proximity graphs cost, and what they look like.
//!
//! `graph [OBJECT] [--runs N]`; the object is `bumpy:1000000` unless told otherwise.
#![expect(clippy::print_stdout, reason = "a program for people")]

use std::hint::black_box;

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use nearmiss::graph::{GraphOptions, PointGraph, Prune};
use nearmiss::surface::{BlockTree, Level, Nearest, PointBlock};
use nearmiss::{BuildOptions, PointHierarchy};
use nearmiss_benches::clock::timed;
use nearmiss_benches::object::Object;
use nearmiss_benches::sample::count;
use nearmiss_benches::{Failure, arguments::Arguments, machine};

/// Prints the least time of `runs` of `work`, in nanoseconds a point.
fn measure<T>(what: &str, points: usize, runs: usize, mut work: impl FnMut() -> T) -> T {
    let (mut result, mut best) = timed(&mut work);
    for _ in 1..runs {
        let (again, time) = timed(&mut work);
        (result, best) = (again, best.min(time));
    }
    println!("| {what} | {:.1} |", best.as_secs_f64() * 1e9 / count(points));
    result
}

/// The nearest six of every point, on one thread.
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
    let tree = measure("build of the tree", n, runs, || BlockTree::new(&blocks, n));
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

/// Building the graph on one thread, two, and so on.
fn speed(positions: &[[f32; 3]], runs: usize) -> Result<(), Failure> {
    println!("\n| threads | points/s |\n| --: | --: |");
    let mut threads = 1;
    while threads <= std::thread::available_parallelism()?.get() {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
        let mut best = f64::INFINITY;
        for _ in 0..runs {
            let build = || PointGraph::build(positions, &GraphOptions::default());
            let (graph, time) = timed(|| pool.install(build));
            black_box(graph?);
            best = best.min(time.as_secs_f64());
        }
        println!("| {threads} | {:.0} |", count(positions.len()) / best);
        threads *= 2;
    }
    Ok(())
}

/// What the graph looks like, by how it is pruned.
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

fn main() -> Result<(), Failure> {
    let mut arguments = Arguments::of_process();
    let runs = arguments.value("--runs")?.unwrap_or(3_usize).max(1);
    let words = arguments.words()?;
    let object = Object::read(words.first().map_or("bumpy:1000000", String::as_str))?;
    let hierarchy = PointHierarchy::build(&object.cloud, &BuildOptions::default())?;
    let positions = hierarchy.positions();
    println!("{}\n## {}, {} points\n", machine::description(), object.name, positions.len());
    neighbours(positions, runs)?;
    speed(positions, runs)?;
    looks(positions)
}
