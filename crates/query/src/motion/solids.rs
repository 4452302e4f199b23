//! A convex shape that moves past a scan: conservative advancement (Mirtich 1996, chapter 2) on proven
//! distances. Where nothing is proven, it goes on with the distance of the discs and balls, by at least
//! a quarter of a spacing, or less for small shapes.

use fearless_simd::Level;
use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_geometry::{Aabb, Motion, Pose, Screw};

use crate::ask::budget::Budget;
use crate::motion::answer::{ShapeSweep, ShapeSweepVerdict, SweepReason};
use crate::motion::step::least_step;
use crate::pair::placed::ViewScratch;
use crate::pair::placed_balls::is_proper;
use crate::solid::answer::{ShapeContact, ShapeDistance};
use crate::solid::contacts::{Candidates, contacts};
use crate::solid::core::Solid;
use crate::solid::distance::distance;
use crate::solid::elements::Elements;
use crate::solid::shape::Shape;

type Vector = Vector3<f64>;

/// The share of the way that is proven free which a step takes. Less would take more steps; with all of
/// it, no distance would be left at the end.
const STEP: f64 = 0.8;

/// If less than this is left of the distance, in local radii, steps are no longer proven.
const LEFT: f64 = 0.1;

/// Halvings of the last interval before a contact.
const HALVINGS: u32 = 10;

/// Distance queries after which the search for a contact ends.
const MOST: u32 = 100_000;

/// More than the relative rounding of a speed and of a distance.
const ROUNDING: f64 = 1e-9;

/// More than the rounding of a place that is moved by a pose along a motion, relative to its coordinates.
const ROUNDING_OF_PLACES: f64 = 1e-14;

/// The memory of a sweep.
pub(crate) type Working<'a> = (Level, &'a mut ViewScratch, &'a mut Candidates, &'a mut Vec<ShapeContact>);

/// A shape along its motion.
struct Course<'s, 'a> {
    elements: &'s Elements<'a>,
    shape: &'s Shape<'s>,
    motion: &'s Motion,
    /// The centre of a ball about the shape in its own frame, and its radius.
    ball: (Vector, f64),
    /// The clearance in the world.
    clearance: f64,
    budget: &'s Budget,
    level: Level,
    scratch: &'s mut ViewScratch,
    /// The band where the distance was least.
    band: f64,
    distances: u32,
}

/// Decides whether a shape keeps the margin of the plan along a motion.
pub(crate) fn sweep(
    elements: &Elements<'_>,
    shape: &Shape<'_>,
    (motion, budget): (&Motion, &Budget),
    (level, scratch, candidates, found): Working<'_>,
) -> ShapeSweep {
    let clearance = elements.margin * elements.scale();
    let Some(Aabb { min, max }) = shape.bounds() else {
        let verdict = ShapeSweepVerdict::Undecided { t_free: 0.0, reason: SweepReason::Shape };
        return ShapeSweep { verdict, band: f64::INFINITY, distances: 0 };
    };
    let (min, max) = (Vector::from(min), Vector::from(max));
    let ball = (0.5 * (min + max), 0.5 * (max - min).norm());
    let (band, distances) = (f64::INFINITY, 0);
    let mut course =
        Course { elements, shape, motion, ball, clearance, budget, level, scratch, band, distances };
    let verdict = match course.run() {
        Outcome::Told(verdict) => verdict,
        Outcome::Hit { t_free, apart, t_hit } => {
            let t_hit = course.first_touch(apart, t_hit);
            let (moved, frame) = course.placed(&motion.at(t_hit));
            let solid = Solid::new(&moved, &frame);
            contacts(elements, solid.as_ref(), None, found, (level, &mut *course.scratch, candidates));
            match (found.first(), course.at(t_hit)) {
                (Some(&contact), _) => ShapeSweepVerdict::Impact { t_free, t_hit, contact },
                (None, Ok(nearest)) => {
                    let contact = between(&nearest, solid.map(|it| elements.in_world(&it.inside)));
                    ShapeSweepVerdict::Impact { t_free, t_hit, contact }
                }
                (None, Err(reason)) => ShapeSweepVerdict::Undecided { t_free, reason },
            }
        }
    };
    ShapeSweep { verdict, band: course.band, distances: course.distances }
}

/// The contact at the nearest points of a shape that touches nothing but the rim of a disc from beside, as
/// a shape without a radius does just before it crosses the disc. `inside` is in the shape.
fn between(nearest: &ShapeDistance, inside: Option<[f64; 3]>) -> ShapeContact {
    let [point, on_shape] = nearest.points.map(Vector::from);
    let away = |to: Vector| (to - point).try_normalize(0.0);
    let normal = away(on_shape).or_else(|| away(inside?.into())).unwrap_or_else(Vector::z);
    ShapeContact {
        point: point.into(),
        normal: normal.into(),
        depth: -(on_shape - point).norm(),
        id: u64::from(nearest.source.0),
    }
}

/// The outcome of an advancement.
enum Outcome {
    Told(ShapeSweepVerdict),
    /// They touch at `t_hit`, but not at `apart`.
    Hit {
        t_free: f64,
        apart: f64,
        t_hit: f64,
    },
}

impl<'s> Course<'s, '_> {
    /// The shape at a pose, and the stored frame of the scan relative to it. Hulls and shapes of the
    /// caller's own borrow their places, so the frame moves past them instead.
    fn placed(&self, at: &Pose) -> (Shape<'s>, Pose) {
        let frame = *self.elements.placed.stored_to_world();
        match self.shape.moved(at) {
            Some(moved) => (moved, frame),
            None => (*self.shape, frame.relative_to(at)),
        }
    }

    /// Bounds the distance at a time, rounding included.
    fn at(&mut self, time: f64) -> Result<ShapeDistance, SweepReason> {
        let at = self.motion.at(time);
        if !is_proper(&at) {
            return Err(SweepReason::Pose);
        }
        let (moved, frame) = self.placed(&at);
        let solid = Solid::new(&moved, &frame).ok_or(SweepReason::Shape)?;
        self.distances += 1;
        // Without any disc or ball, nothing is known.
        let working = (self.level, &mut self.scratch.corners);
        let found = distance(self.elements, Some(&solid), f64::INFINITY, working).ok_or(SweepReason::Near)?;
        let own = at.scale() * (self.ball.0.norm() + self.ball.1);
        let far = Vector::from(at.translation()).norm()
            + Vector::from(self.elements.placed.stored_to_world().translation()).norm()
            + own;
        let lower = found.lower * (1.0 - ROUNDING) - ROUNDING_OF_PLACES * far;
        Ok(ShapeDistance { lower: lower.max(0.0), ..found })
    }

    /// A bound on the speed of any point of the shape: along a screw each has a constant speed.
    fn speed(&self, screw: &Screw) -> f64 {
        let start = screw.start();
        let centre = start.apply(self.ball.0.into());
        let turn = Vector::from(screw.turn()).norm();
        (Vector::from(screw.velocity(centre)).norm() + turn * self.ball.1 * start.scale()) * (1.0 + ROUNDING)
    }

    fn run(&mut self) -> Outcome {
        let duration = self.motion.duration();
        // The radius of the shape with all that counts as contact, in the world.
        let size = self.ball.1 * self.motion.at(0.0).scale()
            + self.elements.beyond_boxes() * self.elements.scale()
            + self.clearance;
        let (mut time, mut apart) = (0.0, 0.0);
        // The time up to which the motion is proven free, and `true` while the proof goes on.
        let (mut proven, mut goes_on) = (0.0_f64, true);
        let (mut least, mut at, mut kept) = (f64::INFINITY, 0.0, f64::INFINITY);
        // The lower bound before, and the way since.
        let mut last: Option<(f64, f64)> = None;
        let mut reason = SweepReason::Near;
        loop {
            let found = match self.at(time) {
                Ok(found) => found,
                Err(reason) => {
                    let verdict = ShapeSweepVerdict::Undecided { t_free: proven.min(time), reason };
                    return Outcome::Told(verdict);
                }
            };
            let left = found.lower - self.clearance;
            if found.upper < least {
                (least, at, self.band) = (found.upper, time, found.band);
            }
            if found.upper <= self.clearance {
                return Outcome::Hit { t_free: proven.min(time), apart, t_hit: time };
            }
            kept = kept.min(last.map_or(found.lower, |(lower, way)| 0.5 * (lower + found.lower - way)));
            // Each leg takes one unit of time.
            let end = (time.floor() + 1.0).min(duration);
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a leg")]
            let speed = self.speed(&self.motion.screw(time as usize));
            if goes_on && left > 0.0 {
                proven = proven.max((time + left / speed).min(end));
            }
            if time >= duration {
                goes_on &= left > 0.0 || last.is_some() && proven >= duration;
                break;
            }
            let is_near = left <= LEFT * found.band;
            // No disc or ball is nearer than the upper bound.
            let free = STEP * (found.upper - self.clearance);
            let way = if is_near { free.max(least_step(found.band, size)) } else { STEP * left };
            let next = time + way / speed;
            // What is left of the proof may reach the end of the motion.
            goes_on &= proven >= duration || !is_near && (next > time || speed == 0.0);
            let distances = self.distances;
            if distances >= MOST || self.budget.go_on(distances.into()).is_break() {
                (reason, goes_on) = (SweepReason::Budget, false);
                break;
            }
            apart = time;
            time = if next > time && next < end { next } else { end };
            last = Some((found.lower, speed * (time - apart)));
        }
        Outcome::Told(if goes_on {
            ShapeSweepVerdict::Free { clearance: kept.max(self.clearance), upper: least, at }
        } else {
            ShapeSweepVerdict::Undecided { t_free: proven, reason }
        })
    }

    /// The first time between two at which a contact is found, by halving.
    fn first_touch(&mut self, mut apart: f64, mut hit: f64) -> f64 {
        for _ in 0..HALVINGS {
            let middle = 0.5 * (apart + hit);
            if self.at(middle).is_ok_and(|found| found.upper <= self.clearance) {
                hit = middle;
            } else {
                apart = middle;
            }
        }
        hit
    }
}
