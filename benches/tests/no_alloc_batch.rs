//! Batches and broad phases allocate no memory once their scratch is warm. The allocations of rayon
//! for spreading work over threads do not grow with the number of queries.
//!
//! This is a program without a test harness because the counter covers the whole process.
#![expect(clippy::unwrap_used, reason = "a test may panic")]

use std::ops::ControlFlow;

use nearmiss::{
    Answer, BatchScratch, Bodies, Budget, BuildOptions, CollideOptions, CollidePlan, Evidence, Pair, Pose,
    Scan, World, each,
};
use nearmiss_benches::counting::Counting;
use nearmiss_benches::object::Object;
use nearmiss_benches::poses;

#[global_allocator]
static ALLOCATOR: Counting = Counting::new();

/// The number of allocations of `work`.
fn calls(work: impl FnOnce()) -> usize {
    let before = ALLOCATOR.calls();
    work();
    ALLOCATOR.calls() - before
}

fn main() {
    let object = Object::read("dragon-5k").unwrap().scaled().unwrap();
    let scan = Scan::build(&object.cloud, &BuildOptions::default()).unwrap();
    let options = CollideOptions::estimated().with_evidence(Evidence::Certified);
    let plan = CollidePlan::new(&options, &scan, &scan).unwrap();
    let sweep: Vec<Pose> = poses::sweep(30, 1, 0).into_iter().flatten().collect();
    let poses: Vec<[Pose; 2]> = sweep.iter().map(|&b| [Pose::IDENTITY, b]).collect();
    let mut world = World::new();
    for pose in &sweep[..100] {
        world.insert(scan.clone(), pose);
    }

    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let (mut batch, mut of_world, mut pairs) =
            (BatchScratch::default(), BatchScratch::default(), Vec::new());
        let mut answers = vec![Answer::UNASKED; poses.len()];
        pool.install(|| {
            let mut ask = |count: usize| {
                each(&mut answers[..count], None, &mut batch, |i, scratch| {
                    let [a, b] = [0, 1].map(|k: usize| scan.at(&poses[i][k]));
                    ControlFlow::Continue(Pair::new(a, b).collide(&plan, scratch))
                })
            };
            // The assignment of queries to threads varies, so scratches need several rounds to be
            // warm.
            (0..10).for_each(|_| assert_eq!(ask(poses.len()), poses.len(), "all are answered"));
            let [few, many] = [50, poses.len()].map(|n| calls(|| _ = ask(n)));
            if threads == 1 {
                assert_eq!([few, many], [0, 0], "a batch on one thread");
            } else {
                assert!(few < 10 && many < 10, "{few} and {many} times, whatever the number of questions");
            }
            let mut ask = || {
                world.near_pairs(Bodies::All, plan.reach(), &mut pairs);
                let budget = Budget::UNLIMITED.with_work(50);
                answers.resize(pairs.len().max(answers.len()), Answer::UNASKED);
                each(&mut answers[..pairs.len()], None, &mut of_world, |i, scratch| {
                    let pair = world.pair(pairs[i]).expect("both bodies are there");
                    ControlFlow::Continue(pair.within(&budget).collide(&plan, scratch))
                })
            };
            assert!(ask() > 1000, "enough pairs");
            (0..3).for_each(|_| _ = ask());
            let again = calls(|| _ = ask());
            assert!(again < if threads == 1 { 1 } else { 10 }, "{again} on {threads} threads");
        });
    }
}
