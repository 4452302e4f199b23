//! The map of close pairs: speed and size.
//!
//! `geodesics [OBJECT]… [--runs N]`; the objects are the shipped dragon's unless told otherwise.
#![expect(clippy::print_stdout, reason = "a program for people")]

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use nearmiss::graph::{Adjacency, ClosePairs, Network, Paths, edge_lengths};
use nearmiss::{BuildOptions, Scan};
use nearmiss_benches::clock::timed;
use nearmiss_benches::object::Object;
use nearmiss_benches::sample::count;
use nearmiss_benches::{Failure, arguments::Arguments, machine};

/// The spheres of influence of the fourth neighbour, by kiddo's tree.
fn spheres_of_influence(points: &[[f32; 3]]) -> Result<Adjacency, Failure> {
    let wide: Vec<[f64; 3]> = points.iter().map(|p| p.map(f64::from)).collect();
    let tree = ImmutableKdTree::<f64, 3>::new_from_slice(&wide).map_err(|e| format!("{e:?}"))?;
    let five = std::num::NonZero::new(5).ok_or("five is nothing")?;
    let fourth: Vec<f64> = wide
        .iter()
        .map(|p| {
            let found = tree.query(p).nearest_n::<SquaredEuclidean<f64>>(five).execute();
            found.iter().map(|near| near.distance.sqrt()).fold(0.0, f64::max)
        })
        .collect();
    let mut edges = Vec::new();
    for (i, p) in wide.iter().enumerate() {
        let reach = 4.0 * fourth[i] * fourth[i] * 1.000_001;
        for near in tree.query(p).within::<SquaredEuclidean<f64>>(reach).execute() {
            let j = near.item as usize;
            if j != i && (fourth[i], i) > (fourth[j], j) && near.distance.sqrt() <= fourth[i] + fourth[j] {
                edges.push([u32::try_from(i)?, u32::try_from(j)?]);
            }
        }
    }
    Ok(Adjacency::from_edges(points.len(), &edges))
}

fn measure(object: &Object, runs: usize) -> Result<(), Failure> {
    let scan = Scan::build(&object.cloud, &BuildOptions::default())?;
    let graph = spheres_of_influence(scan.positions())?;
    let n = count(scan.len());
    println!(
        "\n## {}, {} points, {:.1} edges a point\n",
        object.name,
        scan.len(),
        count(graph.edge_count()) / n
    );
    let horizons: Vec<f32> = scan.radii().iter().map(|&r| scan.plan().horizon(r)).collect();
    for paths in [Paths::Rebuilt, Paths::Stored] {
        let mut least = f64::INFINITY;
        let mut size = (0, 0);
        for _ in 0..runs {
            let (pairs, time) = timed(|| {
                let lengths = edge_lengths(&graph, scan.positions());
                ClosePairs::build(Network::new(&graph, &lengths), &horizons, paths)
            });
            least = least.min(time.as_secs_f64());
            size = (pairs.pair_count(), pairs.byte_len());
        }
        println!(
            "close pairs, {paths:?}: {:.0} points/s, {:.1} a point, {:.0} bytes a point",
            n / least,
            count(size.0) / n,
            count(size.1) / n
        );
    }
    Ok(())
}

fn main() -> Result<(), Failure> {
    let mut arguments = Arguments::of_process();
    let runs = arguments.value("--runs")?.unwrap_or(3_usize).max(1);
    let mut objects = arguments.words()?;
    if objects.is_empty() {
        objects = vec!["dragon-5k".into(), "dragon-23k".into()];
    }
    println!("{}", machine::description());
    for object in &objects {
        measure(&Object::read(object)?, runs)?;
    }
    Ok(())
}
