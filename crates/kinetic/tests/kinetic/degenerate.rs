//! Motions in which many events coincide, and input that must be rejected.

use nearmiss_kinetic::{FlightPlan, KineticError, KineticTree};
use nearmiss_testdata::arbitrary::rng;

use crate::model::{Model, Motion, plan};

#[test]
fn events_at_one_instant_end() {
    for motion in [Motion::Crossing, Motion::Lattice, Motion::Touching, Motion::Equal] {
        let mut model = Model::random(motion, 2000, 1, &mut rng(2));
        let start = model.tree.clock();
        for t in [0.5, 0.999_999_999, 1.0, 1.000_000_001, 3.0] {
            model.tree.advance(start + t).unwrap();
            model.check(&format!("{motion:?} at {t}"));
        }
        let events = model.tree.counts().events();
        // Two per point, level and side are plenty.
        assert!(events < 2000 * 2 * 11 * 6, "{motion:?}: {events} events");
        if motion == Motion::Equal {
            assert_eq!(events, 0, "equal points never overtake each other");
        }
    }
}

#[test]
fn reversed_motion_has_the_same_number_of_events_back() {
    let rng = &mut rng(4);
    let plans: Vec<FlightPlan> = (0..500).map(|_| plan(Motion::Linear, 0.0, rng)).collect();
    let mut tree = KineticTree::of_points(0.0, plans.clone()).unwrap();
    tree.advance(4.0).unwrap();
    let there = tree.counts().events();
    for (point, plan) in (0..).zip(&plans) {
        // Back in the time that it took.
        let [from, to] = [plan.position(4.0), plan.position(0.0)];
        let velocity = [0, 1, 2].map(|k| (to[k] - from[k]) / 4.0);
        tree.set_plan(point, FlightPlan::linear(4.0, from, velocity).unwrap()).unwrap();
    }
    tree.advance(8.0).unwrap();
    let back = tree.counts().events() - there;
    assert!(there > 500, "{there} events");
    assert!(back.abs_diff(there) <= there / 100, "{there} there, {back} back");
}

#[test]
fn huge_and_tiny_numbers_end() {
    let mut plans = Vec::new();
    for scale in [1e-300, 1e-160, 1e-100, 1.0, 1e99, 1e100] {
        for sign in [-1.0, 1.0] {
            for i in 0..3 {
                let mut numbers = [0.0; 3];
                numbers[i] = sign * scale;
                let [p, v, a] = numbers.map(|x| [x, -x, 0.5 * x]);
                plans.push(FlightPlan::quadratic(0.0, p, v, a).unwrap());
            }
        }
    }
    let mut tree = KineticTree::of_points(0.0, plans).unwrap();
    for time in [1e-300, 1e-9, 1.0, 2.0, 1e6, 1e15] {
        tree.advance(time).unwrap();
    }
    assert!(tree.bounds().max.iter().all(|x| x.is_finite()), "finite bounds");
}

#[test]
fn wrong_input_is_rejected() {
    let mut tree = KineticTree::of_points(0.0, [FlightPlan::at_rest(0.0, [1.0; 3]).unwrap()]).unwrap();
    tree.advance(2.5).unwrap();
    let message = tree.advance(2.0).unwrap_err().to_string();
    assert!(message.starts_with("expected a time not before 2.5 s, got 2 s; "), "{message}");
    assert!(matches!(tree.advance(f64::NAN), Err(KineticError::Number { .. })), "a time that is NaN");
    assert!(matches!(tree.advance(f64::INFINITY), Err(KineticError::Number { .. })), "no end");
    let plan = FlightPlan::at_rest(0.0, [1.0; 3]).unwrap();
    assert!(matches!(tree.set_plan(1, plan), Err(KineticError::NoSuchPoint { point: 1 })), "one point");
    assert!(matches!(tree.insert(&[]), Err(KineticError::Arity { .. })), "no points");
    assert!(matches!(tree.insert(&[0, 0]), Err(KineticError::Arity { .. })), "two points");
    assert!(matches!(tree.insert(&[9]), Err(KineticError::NoSuchPoint { point: 9 })), "no such point");
    assert!(matches!(tree.remove(1), Err(KineticError::NoSuchPrimitive { .. })), "one primitive");
    assert!(matches!(tree.remove_point(0), Err(KineticError::InUse { .. })), "in use");
    tree.remove(0).unwrap();
    tree.remove_point(0).unwrap();
    assert!(matches!(tree.remove(0), Err(KineticError::NoSuchPrimitive { .. })), "removed");
    assert!(tree.position(0).is_none() && tree.is_empty(), "nothing is left");
    assert!(KineticTree::new(0.0, [], &[[0_u32; 3]]).is_err(), "triangles without points");
    assert!(KineticTree::new(0.0, [], &[[0_u32; 0]]).is_err(), "primitives without points");
    assert!(KineticTree::of_points(f64::NAN, []).is_err(), "no start");
    assert_eq!(KineticTree::of_points(1.0, []).unwrap().next_event(), None, "nothing moves");
}
