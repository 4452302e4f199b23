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

use crate::penetration::probe::{Deep, Probe, Vector};

/// Balls at most.
const BALLS: usize = 192;

/// Cones at most.
const CONES: usize = 1024;

/// The share of the wanted bound that is enough.
const ENOUGH: f64 = 0.9;

/// The place of a ball's centre along the way from the front of the cone to the furthest useful one.
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
    /// The share of a further shift by which the place moves if it is to stay in both things.
    share: f64,
}

/// Shifts along the directions in a spherical triangle.
#[derive(Debug, Clone, Copy)]
struct Cone {
    /// Unit vectors.
    corners: [Vector; 3],
    /// The unit vector in the middle, and the cosine of its angle with the corners, where it is greatest.
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
        Self { t, radius: found.depth - rounding, place: found.place, share }
    }
}

/// Raises `lower` towards `enough`, from the deepest place without a shift. `last` is a shift that is almost
/// long enough to separate the things, and where they still touch. Breaks if the budget is spent.
pub(crate) fn cover<P: Probe>(
    probe: &mut P,
    (deepest, last): (&Deep, Option<(Vector, Vector)>),
    enough: f64,
    (Cover { balls, cones }, lower): (&mut Cover, &mut f64),
) -> ControlFlow<()> {
    let enough = ENOUGH * enough;
    let rounding = probe.rounding();
    let first = Ball::new(Vector::zeros(), deepest, rounding);
    // Also if one of them is not a number.
    if !(*lower < enough && first.radius > 0.0) {
        return ControlFlow::Continue(());
    }
    balls.clear();
    balls.push(first);
    cones.clear();
    cones.extend(octahedron().map(|corners| Cone::new(corners, *lower, first.radius)));
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
        let found = deep(probe, (balls, last), t)?.filter(|found| found.depth > 2.0 * rounding);
        let Some(found) = found else {
            // There may be a place after a shorter shift.
            cones.push(Cone { radius: 0.5 * cone.radius, ..cone });
            continue;
        };
        let ball = Ball::new(t, &found, rounding);
        balls.push(ball);
        let own = Cone { radius: ball.radius, ..cone };
        if own.reach(&ball) > cone.covered * (1.0 + GAIN) {
            cones.push(own);
        } else {
            cones.extend(own.divided());
        }
    }
    ControlFlow::Continue(())
}

/// The deepest of some places after a shift by `t`, from those of other shifts.
fn deep<P: Probe>(
    probe: &mut P,
    (balls, last): (&[Ball], Option<(Vector, Vector)>),
    t: Vector,
) -> ControlFlow<(), Option<Deep>> {
    let mut best: Option<Deep> = None;
    let within = |ball: &&Ball| ball.radius - (t - ball.t).norm();
    let ball = balls.iter().max_by(|a, b| within(a).total_cmp(&within(b)));
    let near = ball.into_iter().flat_map(|ball| [ball.share, 1.0].map(|s| ball.place + (t - ball.t) * s));
    let last = last.map(|(shift, place)| place + (t - shift) * 0.5);
    for place in near.chain(last).chain([probe.centres()[1] + t]) {
        let found = probe.deep(place, t)?;
        best = [best, found].into_iter().flatten().max_by(|a, b| a.depth.total_cmp(&b.depth));
    }
    let Some(mut best) = best else { return ControlFlow::Continue(None) };
    let mut step = 0.25 * best.depth;
    for _ in 0..STEPS {
        let Some(uphill) = best.uphill.try_normalize(1e-3) else { break };
        match probe.deep(best.place + uphill * step, t)? {
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

    /// How far the centre of such a ball on the axis may be ahead of the front that it covers; `None` if the front
    /// is wider than the ball.
    fn room(&self) -> Option<f64> {
        let room_sq = self.radius * self.radius - self.covered * self.covered * (1.0 - self.cosine * self.cosine);
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
            if along < 0.0 || half_sq <= 0.0 || along - half > self.covered {
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
