//! Searches in a graph and evaluations along it allocate no memory once their scratch is warm.
//!
//! This is a program without a test harness because the counter covers the whole process.
#![expect(clippy::unwrap_used, reason = "a test may panic")]

use nearmiss::graph::{
    ClosePairs, GeodesicKernel, GeodesicScratch, GraphOptions, KernelScratch, LevelScratch, Levels, Network,
    Paths, PointGraph, edge_lengths,
};
use nearmiss::{BuildOptions, Scan};
use nearmiss_benches::counting::Counting;
use nearmiss_benches::object::Object;

#[global_allocator]
static ALLOCATOR: Counting = Counting::new();

fn main() {
    let object = Object::read("dragon-5k").unwrap();
    let scan = Scan::build(&object.cloud, &BuildOptions::default()).unwrap();
    let graph = PointGraph::build(scan.positions(), &GraphOptions::default()).unwrap();
    let lengths = edge_lengths(graph.edges(), scan.positions());
    let network = Network::new(graph.edges(), &lengths);
    let support_radii: Vec<f32> = scan.radii().iter().map(|&r| scan.plan().support_radius(r)).collect();
    let pairs = ClosePairs::build(network, &support_radii, Paths::Rebuilt);
    let levels = Levels::build(network, scan.radii());
    let kernel = GeodesicKernel::new(scan.plan(), scan.positions(), scan.radii(), graph.edges(), &pairs);
    let (mut search, mut coarse) = (GeodesicScratch::default(), LevelScratch::default());
    let (mut supporting, mut path) = (KernelScratch::default(), Vec::new());
    let n = u32::try_from(scan.len()).unwrap();
    let mut ask = || {
        for i in (0..n).step_by(97) {
            let other = (i + n / 2) % n;
            search.within(network, i, support_radii[i as usize]);
            search.path(network, i, other, &mut path);
            levels.path(network, [i, other], &mut coarse, &mut path);
            let close = pairs.of(i as usize).last().map_or(i, |close| close.point);
            pairs.path(network, [i, close], &mut search, &mut path);
            let x = scan.positions()[i as usize]
                .map(|c| f64::from(c) + 0.1 * f64::from(scan.radii()[i as usize]));
            assert!(kernel.evaluate(x, i, &mut supporting).f.is_finite(), "f at {x:?}");
        }
    };
    ask();
    let before = ALLOCATOR.calls();
    ask();
    assert_eq!(ALLOCATOR.calls() - before, 0, "nothing is allocated the second time");
}
