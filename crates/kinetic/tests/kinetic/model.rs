//! The naive twin of a tree: plans and primitives in lists, boxes by looking at every point.

use nearmiss_geometry::Aabb;
use nearmiss_kinetic::{FlightPlan, KineticTree};
use nearmiss_testdata::arbitrary::{gaussian, point_in, unit_vector};
use rand::{Rng, RngExt};

/// Families of motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Motion {
    /// Random positions and velocities.
    Linear,
    /// Random accelerations as well.
    Quadratic,
    /// Several legs that join.
    Legs,
    /// Several legs that do not join.
    Jumps,
    /// All points do the same.
    Equal,
    /// All points are at one place one second later, with different velocities.
    Crossing,
    /// Whole numbers, so that many events are at equal times.
    Lattice,
    /// Parabolas of one apex that touch each other.
    Touching,
    /// No motion.
    Stopped,
}

pub(crate) const MOTIONS: [Motion; 9] = [
    Motion::Linear,
    Motion::Quadratic,
    Motion::Legs,
    Motion::Jumps,
    Motion::Equal,
    Motion::Crossing,
    Motion::Lattice,
    Motion::Touching,
    Motion::Stopped,
];

/// Returns a random plan from `now` on.
pub(crate) fn plan<R: Rng>(motion: Motion, now: f64, rng: &mut R) -> FlightPlan {
    let whole = |rng: &mut R| [0; 3].map(|_: i32| f64::from(rng.random_range(-3..4_i32)));
    match motion {
        Motion::Linear => FlightPlan::linear(now, point_in(rng, 1.0), unit_vector(rng)),
        Motion::Quadratic => FlightPlan::quadratic(
            now,
            point_in(rng, 1.0),
            unit_vector(rng),
            unit_vector(rng).map(|x| 2.0 * x),
        ),
        Motion::Legs | Motion::Jumps => {
            let mut plan = FlightPlan::linear(now, point_in(rng, 1.0), unit_vector(rng)).unwrap();
            let mut time = now;
            for _ in 0..rng.random_range(0..4) {
                time += rng.random_range(0.05..1.0);
                let place = if motion == Motion::Legs { plan.position(time) } else { point_in(rng, 1.0) };
                let next = FlightPlan::quadratic(time, place, unit_vector(rng), unit_vector(rng));
                plan = plan.then(next.unwrap()).unwrap();
            }
            Ok(plan)
        }
        Motion::Equal => FlightPlan::linear(now, [0.25; 3], [1.0, -1.0, 0.1]),
        Motion::Crossing => {
            let velocity = [0; 3].map(|_: i32| gaussian(rng));
            FlightPlan::linear(now, velocity.map(|v| 0.1 - v), velocity)
        }
        Motion::Lattice => FlightPlan::quadratic(now, whole(rng), whole(rng), whole(rng)),
        Motion::Touching => {
            let bend = whole(rng);
            FlightPlan::quadratic(now, bend.map(|a| 0.5 * a), bend.map(|a| -a), bend)
        }
        Motion::Stopped => FlightPlan::at_rest(now, point_in(rng, 1.0)),
    }
    .unwrap()
}

/// A tree and its twin.
#[derive(Debug)]
pub(crate) struct Model {
    pub(crate) tree: KineticTree,
    pub(crate) plans: Vec<FlightPlan>,
    pub(crate) primitives: Vec<Option<Vec<u32>>>,
}

impl Model {
    pub(crate) fn new(plans: Vec<FlightPlan>, primitives: Vec<Vec<u32>>, start: f64) -> Self {
        let tree = KineticTree::new(start, plans.clone(), &primitives).unwrap();
        Self { tree, plans, primitives: primitives.into_iter().map(Some).collect() }
    }

    /// `count` points, and about as many primitives of up to `arity` of them.
    pub(crate) fn random<R: Rng>(motion: Motion, count: u32, arity: usize, rng: &mut R) -> Self {
        let start = rng.random_range(-2.0..2.0);
        let plans = (0..count).map(|_| plan(motion, start, rng)).collect();
        let primitives = (0..count).map(|i| {
            if arity == 1 {
                return vec![i];
            }
            (0..rng.random_range(1..=arity)).map(|_| rng.random_range(0..count)).collect()
        });
        let mut primitives: Vec<Vec<u32>> = primitives.collect();
        if let Some(first) = primitives.first_mut() {
            first.resize(arity, first[0]);
        }
        Self::new(plans, primitives, start)
    }

    pub(crate) fn set_plan(&mut self, point: u32, plan: FlightPlan) {
        self.tree.set_plan(point, plan.clone()).unwrap();
        self.plans[point as usize] = plan;
    }

    pub(crate) fn insert(&mut self, points: &[u32]) {
        let primitive = self.tree.insert(points).unwrap() as usize;
        if primitive == self.primitives.len() {
            self.primitives.push(None);
        }
        assert!(self.primitives[primitive].is_none(), "index {primitive} is in use");
        self.primitives[primitive] = Some(points.to_vec());
    }

    pub(crate) fn remove(&mut self, primitive: u32) {
        self.tree.remove(primitive).unwrap();
        self.primitives[primitive as usize] = None;
    }

    /// The box of a primitive now.
    pub(crate) fn bounds(&self, primitive: u32) -> Aabb {
        let points = self.primitives[primitive as usize].as_ref().unwrap();
        Aabb::of(points.iter().map(|&point| self.plans[point as usize].position(self.tree.clock())))
    }

    /// The primitives that exist.
    pub(crate) fn alive(&self) -> Vec<u32> {
        (0_u32..).zip(&self.primitives).filter(|(_, points)| points.is_some()).map(|(i, _)| i).collect()
    }

    /// Compares every node with all primitives below it.
    pub(crate) fn check(&self, context: &str) {
        let mut seen = Vec::new();
        self.tree.for_each_node(|bounds, primitives| {
            let mut expected = Aabb::EMPTY;
            for &primitive in primitives {
                let own = self.bounds(primitive);
                expected.grow(own.min);
                expected.grow(own.max);
            }
            for k in 0..3 {
                for (found, expected) in [(bounds.min[k], expected.min[k]), (bounds.max[k], expected.max[k])]
                {
                    let is_close =
                        found == expected || (found - expected).abs() <= 1e-12 * (20.0 + expected.abs());
                    assert!(
                        is_close,
                        "{context}: expected {expected}, got {found} for axis {k} of {primitives:?} at {}",
                        self.tree.clock()
                    );
                }
            }
            seen = primitives.to_vec();
        });
        seen.sort_unstable();
        assert_eq!(seen, self.alive(), "{context}: the root has all primitives");
        let limit = 4.0 + (f64::from(u32::try_from(seen.len().max(1)).unwrap())).ln() / (4.0_f64 / 3.0).ln();
        let height = f64::from(u32::try_from(self.tree.height()).unwrap());
        assert!(height <= limit, "{context}: height {height} of {} primitives", seen.len());
    }
}
