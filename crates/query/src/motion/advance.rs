//! The proof that a whole motion is free, from its start on.
//!
//! The distance to prove is chosen by distance queries: half the lower bound at the start, and less
//! where the proof stalls, down to the clearance that was asked for. So the proof of a free motion
//! also tells by how much it is free, and a step of the proof is as long as the distance allows. A
//! second proof, of a greater share of the least distance that the first one met, then finds where
//! the motion is tightest.

use nearmiss_geometry::{Motion, Pose, Screw};
use nearmiss_hierarchy::{Ball, NodePair, Stack};

use super::answer::SweepReason;
use super::course::Course;
use super::interval::{Interval, IntervalProof, Outcome};
use super::plan::SweepPlan;
use super::travel::Travel;
use crate::ask::answer::{Answer, Statistics};
use crate::ask::budget::Budget;
use crate::contact::collide::ContactScratch;
use crate::distance::{Distance, Frontier};

/// The shares of the lower bound of a measured distance that are proven for the times around it, by
/// the first and by the second proof.
const SHARES: [f64; 2] = [0.5, 0.75];

/// Excesses over the clearance below this many bands are not worth a proof of their own.
const WORTH: f64 = 0.5;

/// Working memory of sweeps.
#[derive(Debug, Clone, Default)]
pub(crate) struct MotionScratch {
    parts: Vec<TimeSpan>,
    pairs: Vec<NodePair>,
    stack: Stack,
}

/// A part of the time of a screw that is still to be proven.
#[derive(Debug, Clone, Copy)]
struct TimeSpan {
    from: f64,
    to: f64,
    /// The numbers of the node pairs to prove: the first, and the one after the last.
    pairs: [usize; 2],
}

/// The least distance that was measured along a motion.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Nearest {
    pub(crate) upper: f64,
    pub(crate) at: f64,
    pub(crate) band: f64,
    /// The least of all lower bounds.
    lower: f64,
}

/// The reason for which a proof ends early.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Stop {
    /// The proof stalls.
    Stalled,
    /// The search cannot go on.
    Ended(SweepReason),
}

/// The memory of the queries that a sweep asks.
pub(crate) struct SweepScratch<'s> {
    pub(crate) open: &'s mut Frontier,
    pub(crate) contact: &'s mut ContactScratch,
    pub(crate) motion: &'s mut MotionScratch,
}

/// A sweep in progress.
pub(crate) struct Sweeping<'s, C> {
    pub(crate) course: &'s C,
    pub(crate) motions: [&'s Motion; 2],
    pub(crate) plan: &'s SweepPlan,
    budget: &'s Budget,
    scratch: SweepScratch<'s>,
    balls: [Ball; 2],
    /// The distance that is being proven.
    pub(crate) proving: f64,
    /// The least distance that is worth a proof: the clearance, or what is proven already.
    least: f64,
    /// The share of a lower bound that is proven.
    share: f64,
    pub(crate) nearest: Nearest,
    /// The time of the last distance query, and its lower bound.
    measured: (f64, f64),
    /// The nearest items of the last distance query.
    items: [usize; 2],
    pub(crate) distances: u32,
    pub(crate) contacts: u32,
    pub(crate) intervals: u32,
    pub(crate) spent: Statistics,
}

impl<'s, C: Course> Sweeping<'s, C> {
    pub(crate) fn new(
        (course, motions): (&'s C, [&'s Motion; 2]),
        plan: &'s SweepPlan,
        budget: &'s Budget,
        scratch: SweepScratch<'s>,
    ) -> Self {
        Self {
            course,
            motions,
            plan,
            budget,
            scratch,
            balls: course.balls(),
            proving: f64::INFINITY,
            least: plan.options().clearance,
            share: SHARES[0],
            nearest: Nearest { upper: f64::INFINITY, at: 0.0, band: f64::INFINITY, lower: f64::INFINITY },
            measured: (0.0, 0.0),
            items: [0; 2],
            distances: 0,
            contacts: 0,
            intervals: 0,
            spent: Statistics::default(),
        }
    }

    /// The time at which the later of the two motions ends.
    pub(crate) fn duration(&self) -> f64 {
        self.motions[0].duration().max(self.motions[1].duration())
    }

    /// The screws of both from time `k` on.
    pub(crate) fn screws(&self, k: usize) -> [Screw; 2] {
        self.motions.map(|motion| motion.screw(k))
    }

    /// The budget that is left.
    fn left(&self) -> Budget {
        let spent = self.spent.evaluations + self.spent.node_pairs;
        Budget {
            work: self.budget.work.map(|work| work.saturating_sub(spent)),
            resolution: None,
            ..*self.budget
        }
    }

    fn spend(&mut self, spent: &Statistics) {
        self.spent.evaluations += spent.evaluations;
        self.spent.node_pairs += spent.node_pairs;
        self.spent.leaf_pairs += spent.leaf_pairs;
    }

    /// Measures the distance at `time`, with both at `poses`, and chooses the distance to prove
    /// from there on.
    fn measure(&mut self, time: f64, poses: &[Pose; 2]) -> Distance {
        let budget = self.left();
        let SweepScratch { open, contact, .. } = &mut self.scratch;
        let found = self.course.distance(poses, self.plan, &budget, &mut self.items, (open, contact));
        self.distances += 1;
        self.spend(&found.statistics);
        self.measured = (time, found.lower);
        let lower = self.nearest.lower.min(found.lower);
        if found.upper < self.nearest.upper {
            self.nearest = Nearest { upper: found.upper, at: time, band: found.band, lower };
        }
        self.nearest.lower = lower;
        let next = (self.share * found.lower).min(self.share * self.proving);
        let is_worth = next > self.least + WORTH * found.band;
        self.proving = if is_worth { next } else { self.least };
        found
    }

    /// Tests for contact at a time within the screws.
    pub(crate) fn touches(&mut self, screws: &[Screw; 2], within: f64) -> Answer {
        let budget = self.left();
        let poses = screws.each_ref().map(|screw| screw.at(within));
        let answer = self.course.touches(&poses, self.plan, &budget, self.scratch.contact);
        self.contacts += 1;
        self.spend(&answer.statistics);
        answer
    }

    /// The time up to which the last distance query proves the rest of these screws, which start at
    /// `time`, from `from` on; `from` if it proves nothing.
    fn clear_until(&self, (time, screws): (f64, &[Screw; 2]), from: f64) -> f64 {
        let (at, lower) = (self.measured.0 - time, self.measured.1);
        if !(0.0..=1.0).contains(&at) {
            return from;
        }
        let poses = screws.each_ref().map(|screw| screw.at(at));
        let stored = self.course.stored(&poses);
        let travel = Travel::new(screws, 1.0, stored.each_ref(), &self.balls);
        let [_, ball] = &self.balls;
        // No point of b moves further than `way` in a unit of time.
        let way = travel.of_ball(ball.centre, ball.radius);
        let off = travel.rounding + way * 4.0 * f64::EPSILON * (1.0 + time);
        let spare = (lower - self.proving - off).max(0.0);
        let reach = if way > 0.0 { (spare / way).min(1.0) * (1.0 - 1e-9) } else { 0.0 };
        if from >= at - reach { from.max(at + reach) } else { from }
    }

    /// A bound on the speed of any point of b as seen from a, in the world, from the time `within`
    /// of the screws on.
    pub(crate) fn speed(&self, screws: &[Screw; 2], within: f64) -> f64 {
        let poses = screws.each_ref().map(|screw| screw.at(within));
        let stored = self.course.stored(&poses);
        let [_, ball] = &self.balls;
        Travel::new(screws, 1.0, stored.each_ref(), &self.balls).of_ball(ball.centre, ball.radius)
    }

    /// The radius of the smaller thing, in the world.
    pub(crate) fn size(&self) -> f64 {
        let stored = self.course.stored(&self.screws(0).map(|screw| *screw.start()));
        let [a, b] = [0, 1].map(|k| self.balls[k].radius * stored[k].scale());
        a.min(b)
    }

    /// Proves the whole motion. Otherwise returns the time up to which it is proven, and the reason
    /// why the proof ends.
    pub(crate) fn prove(&mut self) -> Result<(), (f64, Stop)> {
        let poses = self.screws(0).map(|screw| *screw.start());
        let first = self.measure(0.0, &poses);
        if first.band == f64::INFINITY {
            return Err((0.0, Stop::Ended(SweepReason::Pose)));
        }
        self.prove_all()
    }

    /// Proves a greater distance of a motion that is proven to be free, if there is one.
    pub(crate) fn tighten(&mut self) {
        self.share = SHARES[1];
        (self.least, self.proving) = (self.proving, self.share * self.nearest.lower);
        let is_worth = self.proving > self.least + WORTH * self.nearest.band;
        if !is_worth || self.prove_all().is_err() {
            self.proving = self.least;
        }
    }

    /// Proves the distance that is to be proven for the whole motion, or less where it stalls.
    fn prove_all(&mut self) -> Result<(), (f64, Stop)> {
        let duration = self.duration();
        let (mut k, mut time) = (0, 0.0);
        loop {
            let length = (duration - time).min(1.0);
            self.prove_screws(time, &self.screws(k), length)?;
            (k, time) = (k + 1, time + 1.0);
            if time >= duration {
                return Ok(());
            }
        }
    }

    /// Proves the first `length` of the screws that start at `time`.
    fn prove_screws(&mut self, time: f64, screws: &[Screw; 2], length: f64) -> Result<(), (f64, Stop)> {
        self.scratch.motion.pairs.clear();
        self.scratch.motion.pairs.push(NodePair::ROOTS);
        self.scratch.motion.parts.clear();
        self.scratch.motion.parts.push(TimeSpan { from: 0.0, to: length, pairs: [0, 1] });
        while let Some(mut part) = self.scratch.motion.parts.pop() {
            part.from = self.clear_until((time, screws), part.from);
            if part.from >= part.to && part.to > 0.0 {
                continue;
            }
            let middle = 0.5 * (part.from + part.to);
            let poses = screws.each_ref().map(|screw| screw.at(middle));
            // Pairs past the end belong to parts that are proven.
            self.scratch.motion.pairs.truncate(part.pairs[1]);
            let outcome = self.prove_part(&part, screws, &poses);
            let left = self.scratch.motion.pairs.len();
            let is_divisible = part.from < middle && middle < part.to;
            match outcome {
                Err(reason) => return Err((time + part.from, Stop::Ended(reason))),
                Ok(Outcome::Spent) => return Err((time + part.from, Stop::Ended(SweepReason::Budget))),
                Ok(Outcome::Proven) if left == part.pairs[1] => {}
                Ok(Outcome::Proven) if is_divisible => {
                    let pairs = [part.pairs[1], left];
                    self.scratch.motion.parts.push(TimeSpan { from: middle, pairs, ..part });
                    self.scratch.motion.parts.push(TimeSpan { to: middle, pairs, ..part });
                }
                Ok(_) if self.proving > self.least => {
                    self.measure(time + middle, &poses);
                    self.scratch.motion.parts.push(part);
                }
                Ok(_) => return Err((time + part.from, Stop::Stalled)),
            }
        }
        Ok(())
    }

    fn prove_part(
        &mut self,
        part: &TimeSpan,
        screws: &[Screw; 2],
        poses: &[Pose; 2],
    ) -> Result<Outcome, SweepReason> {
        let budget = self.left();
        let interval = Interval {
            screws,
            half: 0.5 * (part.to - part.from),
            balls: &self.balls,
            clearance: self.proving,
            thickness: self.plan.thickness().map(|radius| C::THICK * radius),
        };
        let MotionScratch { pairs, stack, .. } = &mut *self.scratch.motion;
        let look = IntervalProof { interval, pairs, from: part.pairs[0], to: part.pairs[1], stack };
        let (outcome, spent) = self.course.at(poses, &budget, look).ok_or(SweepReason::Pose)?;
        self.intervals += 1;
        self.spend(&spent);
        Ok(outcome)
    }
}
