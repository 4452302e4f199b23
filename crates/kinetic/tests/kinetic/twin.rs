//! Boxes of all nodes against the naive twin, with changes in between.

use nearmiss_testdata::arbitrary::rng;
use proptest::prelude::*;
use rand::RngExt;

use crate::model::{MOTIONS, Model, Motion, plan};

/// Advances by random steps and makes random changes; compares all boxes after each.
fn run(motion: Motion, count: u32, arity: usize, seed: u64, steps: u32) {
    let rng = &mut rng(seed);
    let mut model = Model::random(motion, count, arity, rng);
    let context = format!("{motion:?}, {count} points, arity {arity}, seed {seed}");
    model.check(&context);
    for step in 0..steps {
        let context = format!("{context}, step {step}");
        let wait = if rng.random_bool(0.2) { 1.0 } else { rng.random_range(0.0..0.3) };
        model.tree.advance(model.tree.clock() + wait).unwrap();
        model.check(&format!("{context} (advance)"));
        let now = model.tree.clock();
        match rng.random_range(0..4) {
            0 => {
                for _ in 0..rng.random_range(1..5) {
                    let point = rng.random_range(0..count);
                    let kind = if rng.random_bool(0.3) { MOTIONS[rng.random_range(0..9)] } else { motion };
                    model.set_plan(point, plan(kind, now, rng));
                }
                model.check(&format!("{context} (plans)"));
            }
            1 => {
                for _ in 0..rng.random_range(1..20) {
                    let points: Vec<u32> =
                        (0..rng.random_range(1..=arity)).map(|_| rng.random_range(0..count)).collect();
                    model.insert(&points);
                }
                model.check(&format!("{context} (insert)"));
            }
            2 => {
                for _ in 0..rng.random_range(1..20) {
                    let alive = model.alive();
                    if !alive.is_empty() {
                        model.remove(alive[rng.random_range(0..alive.len())]);
                    }
                }
                model.check(&format!("{context} (remove)"));
            }
            _ => {
                let plans: Vec<_> = (0..count).map(|point| (point, plan(motion, now, rng))).collect();
                model.plans = plans.iter().map(|(_, plan)| plan.clone()).collect();
                model.tree.set_plans(plans).unwrap();
                model.check(&format!("{context} (all plans)"));
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(120))]

    #[test]
    fn boxes_are_those_of_the_twin(
        motion in prop::sample::select(MOTIONS.to_vec()),
        count in 1..80_u32,
        arity in prop::sample::select(vec![1_usize, 3, 4, 16]),
        seed in any::<u64>(),
    ) {
        run(motion, count, arity, seed, 12);
    }
}

#[test]
fn boxes_of_more_points_are_those_of_the_twin() {
    for (i, motion) in MOTIONS.into_iter().enumerate() {
        run(motion, 700, 1, 7 + i as u64, 5);
        run(motion, 400, 3, 70 + i as u64, 4);
    }
}

#[test]
fn growing_and_shrinking_keep_the_tree_low() {
    let rng = &mut rng(3);
    let mut model = Model::new(vec![plan(Motion::Linear, 0.0, rng)], vec![], 0.0);
    model.check("empty");
    // Each new point is beyond all others: the worst case for a tree that never rebuilds.
    for i in 0..600_u32 {
        let x = f64::from(i);
        let drift = [0.001 * (0.3 * x).sin(), 0.0, 0.1];
        let far = nearmiss_kinetic::FlightPlan::linear(0.0, [x, 0.0, 0.0], drift).unwrap();
        let point = model.tree.add_point(far.clone()).unwrap();
        assert_eq!(point as usize, model.plans.len(), "points are numbered in order");
        model.plans.push(far);
        model.insert(&[point]);
        if i % 50 == 0 {
            model.tree.advance(0.01 * x).unwrap();
            model.check("growing");
        }
    }
    model.check("grown");
    for i in 0..600 {
        model.remove(i);
        if i % 50 == 0 {
            model.tree.advance(6.0 + 0.01 * f64::from(i)).unwrap();
            model.check("shrinking");
        }
    }
    model.check("empty again");
    assert_eq!(model.tree.node_count(), 1, "one empty leaf");
    let counts = model.tree.counts();
    assert!(counts.rebuilt < 600 * 40, "{} nodes were built again", counts.rebuilt);
}

#[test]
fn events_do_not_depend_on_queries() {
    for motion in MOTIONS {
        let coarse = &mut Model::random(motion, 300, 1, &mut rng(5)).tree;
        let fine = &mut Model::random(motion, 300, 1, &mut rng(5)).tree;
        let start = coarse.clock();
        for i in 1..=1000_u32 {
            fine.advance(start + f64::from(i) * 0.002).unwrap();
        }
        coarse.advance(start + 2.0).unwrap();
        assert_eq!(coarse.counts(), fine.counts(), "{motion:?}");
        assert_eq!(coarse.bounds(), fine.bounds(), "{motion:?}");
    }
}

#[test]
fn many_events_leave_no_drift() {
    let rng = &mut rng(11);
    let mut model = Model::random(Motion::Linear, 1000, 1, rng);
    let mut rounds = 0;
    while model.tree.counts().events() < 1_000_000 {
        // The points turn back to the middle, so that their order changes again and again.
        let now = model.tree.clock();
        let back = |p: [f64; 3], v: [f64; 3]| [0, 1, 2].map(|k| v[k] - p[k]);
        model.plans = (0..1000)
            .map(|point| {
                let place = model.tree.position(point).unwrap();
                let velocity = back(place, nearmiss_testdata::arbitrary::unit_vector(rng));
                nearmiss_kinetic::FlightPlan::linear(now, place, velocity).unwrap()
            })
            .collect();
        model.tree.set_plans((0..).zip(model.plans.iter().cloned())).unwrap();
        model.tree.advance(now + 2.0).unwrap();
        rounds += 1;
        assert!(rounds < 2000, "only {} events", model.tree.counts().events());
    }
    model.check("after a million events");
}
