//! Many threads of a pool that simultaneously need data computed at first use.
#![expect(clippy::expect_used, reason = "a test may panic")]

use std::sync::mpsc;
use std::time::Duration;

use nearmiss::graph::LazyPath;
use nearmiss::{BuildOptions, GraphOptions, PointCloud, Scan};
use nearmiss_testdata::dragon::{Dragon, dragon_mesh};
use rayon::prelude::*;

/// Number of graphs that are searched.
const ROUNDS: usize = 256;

#[test]
fn threads_of_a_pool_that_want_levels_at_once_do_not_wait_for_each_other_for_ever() {
    let cloud = PointCloud::from_positions(dragon_mesh(Dragon::Points23k).unwrap().vertices()).unwrap();
    let scan = Scan::build(&cloud, &BuildOptions::default()).unwrap();
    let scan = scan.with_graph(&cloud, &GraphOptions::default(), None).unwrap();
    let (done, all_done) = mpsc::channel();
    std::thread::spawn(move || {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(16).build().unwrap();
        let n = u32::try_from(scan.len()).unwrap();
        for round in 0..ROUNDS {
            // The clone has computed nothing yet, because the original is never searched.
            let graph = scan.graph().unwrap().clone();
            let length = |i: u32| {
                let (u, v) = (i * 91 % n, (i * 91 + n / 3) % n);
                // Edge lengths alone are computed so fast that threads often collide.
                if round % 32 != 0 {
                    return graph
                        .network(scan.positions())
                        .edges(u as usize)
                        .map(|(_, d)| f64::from(d))
                        .sum();
                }
                let mut path = LazyPath::default();
                assert!(graph.lead(scan.positions(), scan.radii(), [u, v], &mut path), "{u} to {v}");
                path.length()
            };
            let lengths: Vec<f64> = pool.install(|| (0..256).into_par_iter().map(length).collect());
            done.send(lengths).unwrap();
        }
    });
    let next = || all_done.recv_timeout(Duration::from_secs(60)).expect("threads wait for each other");
    let mut first = [Vec::new(), Vec::new()];
    for round in 0..ROUNDS {
        let (lengths, first) = (next(), &mut first[usize::from(round % 32 != 0)]);
        if first.is_empty() {
            *first = lengths;
        } else {
            assert_eq!(lengths, *first, "round {round}");
        }
    }
}
