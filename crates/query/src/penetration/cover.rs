//! A lower bound of the penetration: shifts that are proven to leave the two things in contact, around
//! none at all.
//!
//! A place of depth m after a shift t proves that all shifts within m of t leave a contact. Such balls cover
//! the shifts along a cone of directions, from the origin outwards. The cone that is covered least is
//! continued by another ball or, where balls are smaller than the cone is wide, divided into four. If all
//! cones are covered up to a length, it is a lower bound. One place alone proves no more than its depth,
//! which is small for a corner or a thin thing.

use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::ops::ControlFlow;

use crate::penetration::probe::{Deep, Probe, Vector, Where};

/// Balls at most.
const BALLS: usize = 192;

/// Cones at most.
const CONES: usize = 1024;

/// The share of the greatest useful bound that is enough.
pub(crate) const ENOUGH: f64 = 0.9;

/// The place of a ball's centre on the axis of a cone, between the plane through the corners up to which the
/// cone is covered and the furthest centre whose ball reaches these corners.
const AHEAD: f64 = 0.6;

/// Steps uphill from the deepest place.
const STEPS: usize = 4;

/// The shortest gain in length that counts, relative to it.
const GAIN: f64 = 1e-3;

/// Reusable memory.
#[derive(Debug, Clone, Default)]
pub(crate) struct Cover {
    balls: Vec<Ball>,
    /// The cones that are not covered yet.
    cones: BinaryHeap<Cone>,
}

/// Shifts that are proven to leave a contact.
#[derive(Debug, Clone, Copy)]
struct Ball {
    t: Vector,
    radius: f64,
    /// The place that proves it, after the shift by `t`.
    place: Vector,
    at: Where,
    /// The share of a further shift by which the place moves if it is to stay in both things.
    share: f64,
}

/// Shifts along the directions in a spherical triangle.
#[derive(Debug, Clone, Copy)]
struct Cone {
    /// Unit vectors.
    corners: [Vector; 3],
    /// The unit vector in the middle, and the cosine of its greatest angle with a corner.
    axis: Vector,
    cosine: f64,
    /// Shorter shifts leave a contact.
    covered: f64,
    /// The radius of the ball that was computed last for this cone.
    radius: f64,
}

impl Ball {
    fn new(t: Vector, found: &Deep, rounding: f64) -> Self {
        let share = (found.in_a / found.depth).clamp(0.0, 1.0);
        Self { t, radius: found.depth - rounding, place: found.place, at: found.at, share }
    }
}

/// A shift that separates the things, and one that is almost as long with the place where they still touch.
#[derive(Debug, Clone, Copy)]
pub(crate) struct WayOut {
    pub(crate) apart: Vector,
    pub(crate) last: Option<(Vector, Vector)>,
}

/// Raises `lower` up to `enough`, from the deepest place without a shift. Breaks if the budget is spent.
pub(crate) fn cover<P: Probe>(
    probe: &mut P,
    (deepest, out): (&Deep, &WayOut),
    enough: f64,
    (Cover { balls, cones }, lower): (&mut Cover, &mut f64),
) -> ControlFlow<()> {
    let rounding = probe.rounding();
    let first = Ball::new(Vector::zeros(), deepest, rounding);
    // Also if one of them is not a number.
    if !(*lower < enough && first.radius > 0.0) {
        return ControlFlow::Continue(());
    }
    balls.clear();
    balls.reserve(BALLS + 1);
    balls.push(first);
    cones.clear();
    cones.reserve(CONES);
    cones.extend(octahedron().map(|corners| Cone::new(corners, *lower, first.radius.max(*lower))));
    let mut tried = 0;
    while let Some(cone) = cones.pop() {
        *lower = lower.max(cone.covered.min(enough));
        if *lower >= enough || cones.len() + 4 > CONES {
            break;
        }
        let covered = balls.iter().map(|ball| cone.reach(ball)).fold(cone.covered, f64::max);
        if covered > cone.covered * (1.0 + GAIN) {
            cones.push(Cone { covered, ..cone });
            continue;
        }
        if cone.room().is_none() {
            cones.extend(cone.divided());
            continue;
        }
        if tried == BALLS {
            break;
        }
        tried += 1;
        let t = cone.centre();
        let found = deep(probe, (balls, out.last), t, cone.radius)?;
        // A place that contradicts the shift that separates the things is outside one of them.
        let most = (out.apart - t).norm();
        let is_sound = |found: &Deep| found.depth > 2.0 * rounding && found.depth <= most + probe.slack();
        let found = found.filter(is_sound).map(|found| Deep { depth: found.depth.min(most), ..found });
        let Some(found) = found else {
            // There may be a place after a shorter shift.
            cones.push(Cone { radius: 0.5 * cone.radius, ..cone });
            continue;
        };
        let ball = Ball::new(t, &found, rounding);
        balls.push(ball);
        // A single small ball does not divide it at once.
        let own = Cone { radius: ball.radius.max(0.5 * cone.radius), ..cone };
        if own.reach(&ball) > cone.covered * (1.0 + GAIN) {
            cones.push(own);
        } else {
            cones.extend(own.divided());
        }
    }
    ControlFlow::Continue(())
}

/// Looks for a place as deep as `wanted` after a shift by `t`, near those of other shifts, and returns it or
/// the deepest one.
fn deep<P: Probe>(
    probe: &mut P,
    (balls, last): (&[Ball], Option<(Vector, Vector)>),
    t: Vector,
    wanted: f64,
) -> ControlFlow<(), Option<Deep>> {
    let mut best: Option<Deep> = None;
    let within = |ball: &&Ball| ball.radius - (t - ball.t).norm();
    let ball = balls.iter().max_by(|a, b| within(a).total_cmp(&within(b)));
    let near = ball
        .into_iter()
        .flat_map(|ball| [ball.share, 1.0].map(|share| (ball.place + (t - ball.t) * share, ball.at)));
    let last = last.map(|(shift, place)| place + (t - shift) * 0.5);
    let others = last.into_iter().chain([probe.centres()[1] + t]);
    let near = near.map(|(place, at)| (place, Some(at))).chain(others.map(|place| (place, None)));
    for (place, at) in near {
        let found = match at {
            Some(at) => probe.deep_at(place, t, at)?,
            None => probe.deep(place, t)?,
        };
        let found = found.filter(|found| found.depth > 0.0);
        best = [best, found].into_iter().flatten().max_by(|a, b| a.depth.total_cmp(&b.depth));
        if best.is_some_and(|best| best.depth >= wanted) {
            break;
        }
    }
    let Some(mut best) = best else { return ControlFlow::Continue(None) };
    let mut step = 0.25 * best.depth;
    for _ in 0..STEPS {
        if best.depth >= wanted {
            break;
        }
        let Some(uphill) = best.uphill.try_normalize(1e-3) else { break };
        match probe.deep_at(best.place + uphill * step, t, best.at)? {
            Some(found) if found.depth > best.depth => best = found,
            _ => step *= 0.5,
        }
    }
    ControlFlow::Continue(Some(best))
}

impl Cone {
    fn new(corners: [Vector; 3], covered: f64, radius: f64) -> Self {
        let axis = corners.iter().sum::<Vector>().normalize();
        let cosine = corners.iter().map(|corner| axis.dot(corner)).fold(1.0, f64::min);
        Self { corners, axis, cosine, covered, radius }
    }

    /// The greatest distance of a ball's centre on the axis from the plane through the corners up to which
    /// the cone is covered, if the ball is to reach them. `None` if they are too far from the axis.
    fn room(&self) -> Option<f64> {
        let room_sq =
            self.radius * self.radius - self.covered * self.covered * (1.0 - self.cosine * self.cosine);
        (room_sq > 0.0).then(|| room_sq.sqrt())
    }

    /// The centre of the next ball, if it is about as large as the last one.
    fn centre(&self) -> Vector {
        let ahead = AHEAD * self.room().unwrap_or(0.0);
        self.axis * (self.covered * self.cosine + ahead)
    }

    /// The length up to which a ball before the cone covers the shifts, if it covers all at the front; 0
    /// otherwise. The distance from its centre is greatest along a corner, and convex there.
    fn reach(&self, ball: &Ball) -> f64 {
        let mut reach = f64::INFINITY;
        for corner in &self.corners {
            let along = corner.dot(&ball.t);
            let half_sq = ball.radius * ball.radius - (ball.t.norm_squared() - along * along);
            let half = half_sq.max(0.0).sqrt();
            let is_met = along >= 0.0 && half_sq > 0.0 && half_sq.is_finite();
            if !is_met || along - half > self.covered {
                return 0.0;
            }
            reach = reach.min(along + half);
        }
        reach
    }

    /// Four cones of half the width.
    fn divided(&self) -> [Self; 4] {
        let [p, q, r] = self.corners;
        let [a, b, c] = [q + r, r + p, p + q].map(|middle| middle.normalize());
        let all = [[p, c, b], [c, q, a], [b, a, r], [a, b, c]];
        all.map(|corners| Self::new(corners, self.covered, self.radius))
    }
}

/// The faces of an octahedron, as directions.
fn octahedron() -> [[Vector; 3]; 8] {
    std::array::from_fn(|n| {
        let side = |k: usize| if n >> k & 1 == 0 { 1.0 } else { -1.0 };
        [Vector::x() * side(0), Vector::y() * side(1), Vector::z() * side(2)]
    })
}

// The cone that is covered least is the greatest.
impl Ord for Cone {
    fn cmp(&self, other: &Self) -> Ordering {
        other.covered.total_cmp(&self.covered)
    }
}

impl PartialOrd for Cone {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Cone {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Cone {}

#[cfg(test)]
mod tests {
    use nearmiss_testdata::arbitrary::{rng, rotation, unit_vector};
    use rand::RngExt;

    use super::*;
    use crate::penetration::survey::ContactSurvey;

    /// A floor without thickness, and a box.
    struct Floor {
        centre: Vector,
        axes: [Vector; 3],
        half: [f64; 3],
        asked: usize,
    }

    impl Floor {
        /// The height of the box above and below its centre.
        fn reach(&self) -> f64 {
            (0..3).map(|k| self.half[k] * self.axes[k].z.abs()).sum()
        }

        fn meets(&self, t: Vector) -> bool {
            (self.centre.z + t.z).abs() <= self.reach()
        }
    }

    impl Probe for Floor {
        fn is_apart(&mut self, t: Vector) -> ControlFlow<(), bool> {
            ControlFlow::Continue(!self.meets(t))
        }

        fn touch(&mut self, _: Vector) -> ControlFlow<(), Option<(Vector, Vector)>> {
            ControlFlow::Continue(None)
        }

        fn survey(&mut self, _: &mut ContactSurvey) -> ControlFlow<()> {
            ControlFlow::Continue(())
        }

        fn places(&self) -> &'static [Where] {
            Where::of([false, true])
        }

        fn deep_at(&mut self, place: Vector, t: Vector, at: Where) -> ControlFlow<(), Option<Deep>> {
            self.asked += 1;
            let place = Vector::new(place.x, place.y, 0.0);
            let from = place - self.centre - t;
            let along = self.axes.map(|axis| axis.dot(&from));
            let left = |k: &usize| self.half[*k] - along[*k].abs();
            let nearest = (0..3).min_by(|i, k| left(i).total_cmp(&left(k))).unwrap();
            let (depth, uphill) = (left(&nearest), -self.axes[nearest] * along[nearest].signum());
            ControlFlow::Continue((depth > 0.0).then_some(Deep { place, at, depth, in_a: 0.0, uphill }))
        }

        fn centres(&self) -> [Vector; 2] {
            [Vector::zeros(), self.centre]
        }

        fn axes(&self) -> [[Vector; 3]; 2] {
            [[Vector::x(), Vector::y(), Vector::z()], self.axes]
        }

        fn slack(&self) -> f64 {
            0.0
        }

        fn rounding(&self) -> f64 {
            1e-12
        }
    }

    #[test]
    fn boxes_in_a_floor_have_lower_bounds_near_their_depths() {
        let rng = &mut rng(4471);
        // Sums of the bound of one place and of the cover, in depths, and the number: of boxes and of plates.
        let mut sums = [[0.0; 3]; 2];
        for round in 0..100 {
            let pose = rotation(rng);
            let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
            let axes = axes.map(|axis| Vector::from(pose.rotate(axis)));
            let half = if round % 2 == 0 { [0.3, 0.2, 0.4] } else { [0.5, 0.1, 0.5] };
            let mut floor = Floor { centre: Vector::zeros(), axes, half, asked: 0 };
            floor.centre.z = floor.reach() * rng.random_range(-0.9..0.9);
            let depth = floor.reach() - floor.centre.z.abs();
            let ControlFlow::Continue(Some(deepest)) = floor.deep(floor.centre, Vector::zeros()) else {
                continue;
            };
            let mut lower = deepest.depth;
            let apart = Vector::z() * (depth.copysign(floor.centre.z) * (1.0 + 1e-9));
            let out = WayOut { apart, last: None };
            let flow =
                cover(&mut floor, (&deepest, &out), ENOUGH * depth, (&mut Cover::default(), &mut lower));
            assert!(flow.is_continue() && lower <= depth * (1.0 + 1e-9), "{lower} of {depth}");
            assert!(floor.asked <= BALLS * (4 + STEPS) + 1, "{} questions", floor.asked);
            for _ in 0..200 {
                let t = Vector::from(unit_vector(rng)) * (lower * rng.random_range(0.0..1.0));
                assert!(floor.meets(t), "round {round}: {t} of {lower}");
            }
            let own = [deepest.depth / depth, lower / depth, 1.0];
            let of_kind = &mut sums[round % 2];
            *of_kind = [0, 1, 2].map(|k| of_kind[k] + own[k]);
        }
        for ([alone, covered, count], wanted) in sums.into_iter().zip([0.65, 0.38]) {
            assert!(count > 25.0 && covered > wanted * count && covered > 1.5 * alone, "{sums:?}");
        }
    }

    /// The directions of the cones are all directions, and a ball covers what it is said to cover.
    #[test]
    fn cones_are_covered_up_to_their_reach() {
        let rng = &mut rng(4472);
        let mut reached = 0;
        for round in 0..2000 {
            let mut cone = Cone::new(octahedron()[round % 8], 0.5, 0.5);
            for _ in 0..rng.random_range(0..4) {
                cone = cone.divided()[rng.random_range(0..4)];
            }
            let t = Vector::from(unit_vector(rng)) * rng.random_range(0.0..1.0);
            let ball =
                Ball { t, radius: rng.random_range(0.0..1.0), place: t, at: Where::Inside, share: 0.0 };
            let reach = cone.reach(&ball);
            if reach <= 0.5 {
                continue;
            }
            reached += 1;
            for _ in 0..50 {
                let weights = [0; 3].map(|_| rng.random_range(0.0..1.0));
                let way: Vector = (0..3).map(|k| cone.corners[k] * weights[k]).sum();
                let shift = way.normalize() * rng.random_range(0.5..reach);
                assert!((shift - t).norm() <= ball.radius * (1.0 + 1e-9), "{shift} of {cone:?}, {ball:?}");
            }
        }
        assert!(reached > 100, "{reached} cones are covered further");
        for _ in 0..1000 {
            let way = Vector::from(unit_vector(rng));
            let holds = |corners: &[Vector; 3]| {
                let [p, q, r] = corners;
                let turns = [p.cross(q), q.cross(r), r.cross(p)].map(|side| side.dot(&way));
                turns.iter().all(|x| *x >= 0.0) || turns.iter().all(|x| *x <= 0.0)
            };
            let parts = octahedron().map(|corners| Cone::new(corners, 0.5, 0.5).divided());
            let near = parts.iter().flatten().filter(|cone| cone.axis.dot(&way) > 0.0);
            assert!(near.filter(|cone| holds(&cone.corners)).count() >= 1, "{way} is in no cone");
        }
    }
}
