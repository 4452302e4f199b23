//! Events, changed plans and queries of a kinetic tree allocate no memory.
//!
//! This is a program without a test harness because the counter covers the whole process.
#![expect(clippy::unwrap_used, reason = "a test may panic")]

use nearmiss::kinetic::{FlightPlan, KineticTree};
use nearmiss_benches::counting::Counting;
use nearmiss_testdata::arbitrary::{point_in, rng};

#[global_allocator]
static ALLOCATOR: Counting = Counting::new();

fn main() {
    let rng = &mut rng(1);
    let mut plan = |time| FlightPlan::linear(time, point_in(rng, 1.0), point_in(rng, 1.0)).unwrap();
    let mut tree = KineticTree::of_points(0.0, (0..1000).map(|_| plan(0.0)).collect::<Vec<_>>()).unwrap();
    // Warm: the list of changed plans grows once.
    tree.set_plan(999, plan(0.0)).unwrap();
    let before = ALLOCATOR.calls();
    let mut found = 0;
    for step in 1..100_u32 {
        let time = 0.02 * f64::from(step);
        tree.advance(time).unwrap();
        tree.set_plan(7 * step, plan(time)).unwrap();
        tree.in_box(&tree.bounds(), |_| found += 1);
        tree.on_ray([-2.0, 0.0, 0.0], [1.0, 0.0, 0.0], 4.0, |_, _| 4.0);
    }
    assert_eq!(ALLOCATOR.calls(), before, "calls of the allocator");
    let events = tree.counts().events();
    assert!(events > 500 && found == 99 * 1000, "{events} events, {found} points found");
}
