//! `Points`: the plans of all points, and the times at which their next legs start.

use std::collections::BTreeMap;

use crate::error::KineticError;
use crate::motion::State;
use crate::plan::{FlightPlan, Leg};
use crate::queue::Queue;

/// The most points or primitives of a tree.
pub(crate) const MOST: usize = 1 << 31;

/// A side of a box: 0 to 2 for the minimum along an axis, 3 to 5 for the maximum.
pub(crate) type Side = usize;

/// The points of a tree: the leg that each is in, and the legs to come.
#[derive(Debug, Clone, Default)]
pub(crate) struct Points {
    pub(crate) legs: Vec<Leg>,
    /// The legs to come of those points that have any, the last one first.
    pub(crate) later: BTreeMap<u32, Vec<Leg>>,
    /// When the next leg of each such point starts.
    pub(crate) knots: Queue,
    /// Indices of removed points, which are used again.
    pub(crate) free: Vec<u32>,
    /// Points whose plans changed since the boxes were refreshed, as a list and as bits.
    changed: Vec<u32>,
    bits: Vec<u64>,
}

impl Points {
    /// Adds a point; returns its index.
    pub(crate) fn add(&mut self, plan: FlightPlan, clock: f64) -> Result<u32, KineticError> {
        let point = if let Some(point) = self.free.pop() {
            point
        } else {
            if self.legs.len() >= MOST {
                return Err(KineticError::TooMany);
            }
            self.legs.push(plan.first);
            nearmiss_lanes::id32(self.legs.len() - 1)
        };
        self.replace(point, plan, clock);
        Ok(point)
    }

    /// Returns `true` if there is a point of this index.
    pub(crate) fn has(&self, point: u32) -> bool {
        self.legs.get(point as usize).is_some_and(|leg| !leg[0].start.is_nan())
    }

    /// Removes a point. A removed one has no start.
    pub(crate) fn remove(&mut self, point: u32) {
        self.legs[point as usize][0].start = f64::NAN;
        self.later.remove(&point);
        self.knots.set(point, f64::INFINITY);
        self.free.push(point);
    }

    /// Replaces the plan of a point. Legs before the one that holds at `clock` are dropped.
    pub(crate) fn replace(&mut self, point: u32, plan: FlightPlan, clock: f64) {
        let FlightPlan { mut first, mut later } = plan;
        while let Some(next) = later.pop_if(|leg| leg[0].start <= clock) {
            first = next;
        }
        self.legs[point as usize] = first;
        let start = later.last().map_or(f64::INFINITY, |leg| leg[0].start);
        self.knots.set(point, start);
        if later.is_empty() {
            self.later.remove(&point);
        } else {
            self.later.insert(point, later);
        }
    }

    /// Puts `point` into its next leg.
    pub(crate) fn take_leg(&mut self, point: u32) {
        let Some(later) = self.later.get_mut(&point) else { return self.knots.set(point, f64::INFINITY) };
        if let Some(leg) = later.pop() {
            self.legs[point as usize] = leg;
        }
        let start = later.last().map_or(f64::INFINITY, |leg| leg[0].start);
        if later.is_empty() {
            self.later.remove(&point);
        }
        self.knots.set(point, start);
    }

    /// Returns the plan of a point from its present leg on.
    pub(crate) fn plan(&self, point: u32) -> FlightPlan {
        let later = self.later.get(&point).cloned().unwrap_or_default();
        FlightPlan { first: self.legs[point as usize], later }
    }

    /// Returns the position of a point in its present leg.
    pub(crate) fn position(&self, point: u32, time: f64) -> [f64; 3] {
        let leg = &self.legs[point as usize];
        [0, 1, 2].map(|k| leg[k].position(time))
    }

    /// Returns the state of a point towards a side at `time`.
    #[inline]
    pub(crate) fn state(&self, point: u32, side: Side, time: f64) -> State {
        let (axis, sign) = if side < 3 { (side, -1.0) } else { (side - 3, 1.0) };
        self.legs[point as usize][axis].state(time, sign)
    }

    /// Returns the better of two points for a side, from now on: ties of position, velocity and
    /// acceleration go to the lower index.
    pub(crate) fn extremal(&self, a: u32, b: u32, side: Side, time: f64) -> u32 {
        let [of_a, of_b] = [a, b].map(|point| self.state(point, side, time));
        if of_a.is_ahead_of(&of_b) || (a < b && !of_b.is_ahead_of(&of_a)) { a } else { b }
    }

    /// Notes that the plan of `point` changed.
    pub(crate) fn note(&mut self, point: u32) {
        let (word, bit) = (point as usize / 64, 1 << (point % 64));
        if self.bits.len() <= word {
            self.bits.resize(word + 1, 0);
        }
        if self.bits[word] & bit == 0 {
            self.bits[word] |= bit;
            self.changed.push(point);
        }
    }

    /// Returns `true` if the plan of `point` was noted as changed.
    #[inline]
    pub(crate) fn has_changed(&self, point: u32) -> bool {
        self.bits.get(point as usize / 64).is_some_and(|word| word & 1 << (point % 64) != 0)
    }

    /// Forgets which plans changed.
    pub(crate) fn forget_changes(&mut self) {
        for point in self.changed.drain(..) {
            self.bits[point as usize / 64] = 0;
        }
    }

    /// Returns the bytes in use.
    pub(crate) fn bytes(&self) -> usize {
        let later: usize = self.later.values().map(|legs| legs.len() * size_of::<Leg>() + 32).sum();
        let words = self.free.len() + self.changed.len() + 2 * self.bits.len();
        self.legs.len() * size_of::<Leg>() + later + words * size_of::<u32>() + self.knots.bytes()
    }
}
