//! `Points`: the plans of all points, and the times at which their next legs start.

use crate::error::KineticError;
use crate::motion::{Course, State};
use crate::plan::{FlightPlan, Leg};
use crate::queue::Queue;

/// The most points or primitives of a tree.
pub(crate) const MOST: usize = 1 << 31;

/// A side of a box: 0 to 2 for the minimum along an axis, 3 to 5 for the maximum.
pub(crate) type Side = usize;

/// The points of a tree: the leg that each is in, and the legs to come.
///
/// Present legs are in the order of the leaves in which the tree was built, so that those of a leaf
/// are side by side. The place of a point in that order is its slot. Nodes know slots, callers
/// points.
#[derive(Debug, Clone, Default)]
pub(crate) struct Points {
    /// The present leg in each slot, an array for each axis: an event concerns one axis.
    pub(crate) courses: [Vec<Course>; 3],
    /// The slot of each point.
    pub(crate) slots: Vec<u32>,
    /// The legs to come of each point, the last one first. Points at the end that have none may be
    /// missing.
    pub(crate) later: Vec<Vec<Leg>>,
    /// When the next leg of each such point starts.
    pub(crate) knots: Queue,
    /// Indices of removed points, which are used again.
    pub(crate) free: Vec<u32>,
    /// Slots of points whose plans changed since the boxes were refreshed, as a list and as bits.
    changed: Vec<u32>,
    bits: Vec<u64>,
}

impl Points {
    /// Adds a point; returns its index.
    pub(crate) fn add(&mut self, plan: FlightPlan, clock: f64) -> Result<u32, KineticError> {
        let point = if let Some(point) = self.free.pop() {
            point
        } else {
            if self.slots.len() >= MOST {
                return Err(KineticError::TooMany);
            }
            let point = nearmiss_lanes::id32(self.slots.len());
            self.push(&plan.first);
            self.slots.push(point);
            point
        };
        self.replace(point, plan, clock);
        Ok(point)
    }

    /// Returns `true` if there is a point of this index.
    pub(crate) fn has(&self, point: u32) -> bool {
        (point as usize) < self.slots.len() && !self.leg(point)[0].start.is_nan()
    }

    /// Returns the slot of a point.
    #[inline]
    pub(crate) fn slot(&self, point: u32) -> u32 {
        self.slots[point as usize]
    }

    /// Returns the present leg of a point.
    pub(crate) fn leg(&self, point: u32) -> Leg {
        let slot = self.slot(point) as usize;
        self.courses.each_ref().map(|courses| courses[slot])
    }

    fn set_leg(&mut self, point: u32, leg: &Leg) {
        let slot = self.slot(point) as usize;
        for (courses, course) in self.courses.iter_mut().zip(leg) {
            courses[slot] = *course;
        }
    }

    /// Adds a slot.
    fn push(&mut self, leg: &Leg) {
        for (courses, course) in self.courses.iter_mut().zip(leg) {
            courses.push(*course);
        }
    }

    /// Gives slots to points in this order, then to all others.
    pub(crate) fn arrange(&mut self, order: impl Iterator<Item = u32>) {
        const NONE: u32 = u32::MAX;
        let count = self.slots.len();
        let mut slots = vec![NONE; count];
        let mut arranged =
            Self { courses: [0; 3].map(|_: i32| Vec::with_capacity(count)), ..Self::default() };
        for point in order.chain(0..nearmiss_lanes::id32(count)) {
            let slot = &mut slots[point as usize];
            if *slot == NONE {
                *slot = nearmiss_lanes::id32(arranged.courses[0].len());
                arranged.push(&self.leg(point));
            }
        }
        (self.courses, self.slots) = (arranged.courses, slots);
    }

    /// Removes a point. A removed one has no start.
    pub(crate) fn remove(&mut self, point: u32) {
        let slot = self.slot(point) as usize;
        self.courses[0][slot].start = f64::NAN;
        if let Some(later) = self.later.get_mut(point as usize) {
            later.clear();
        }
        self.knots.set(point, f64::INFINITY);
        self.free.push(point);
    }

    /// Replaces the plan of a point. Legs before the one that holds at `clock` are dropped.
    pub(crate) fn replace(&mut self, point: u32, plan: FlightPlan, clock: f64) {
        let FlightPlan { mut first, mut later } = plan;
        while let Some(next) = later.pop_if(|leg| leg[0].start <= clock) {
            first = next;
        }
        self.set_leg(point, &first);
        let start = later.last().map_or(f64::INFINITY, |leg| leg[0].start);
        self.knots.set(point, start);
        if self.later.len() <= point as usize {
            if later.is_empty() {
                return;
            }
            self.later.resize(point as usize + 1, Vec::new());
        }
        self.later[point as usize] = later;
    }

    /// Puts `point` into its next leg.
    pub(crate) fn take_leg(&mut self, point: u32) {
        let later = &mut self.later[point as usize];
        let next = later.pop();
        let start = later.last().map_or(f64::INFINITY, |leg| leg[0].start);
        if let Some(leg) = next {
            self.set_leg(point, &leg);
        }
        self.knots.set(point, start);
    }

    /// Returns the plan of a point from its present leg on.
    pub(crate) fn plan(&self, point: u32) -> FlightPlan {
        let later = self.later.get(point as usize).cloned().unwrap_or_default();
        FlightPlan { first: self.leg(point), later }
    }

    /// Returns the position of a point in its present leg.
    pub(crate) fn position(&self, point: u32, time: f64) -> [f64; 3] {
        self.leg(point).map(|course| course.position(time))
    }

    /// Returns the state of the point in a slot, towards a side, at `time`.
    #[inline]
    pub(crate) fn state(&self, slot: u32, side: Side, time: f64) -> State {
        let (axis, sign) = if side < 3 { (side, -1.0) } else { (side - 3, 1.0) };
        self.courses[axis][slot as usize].state(time, sign)
    }

    /// Notes that the plan of `point` changed.
    pub(crate) fn note(&mut self, point: u32) {
        let slot = self.slot(point);
        let (word, bit) = (slot as usize / 64, 1 << (slot % 64));
        if self.bits.len() <= word {
            self.bits.resize(self.slots.len().div_ceil(64), 0);
        }
        if self.bits[word] & bit == 0 {
            self.bits[word] |= bit;
            self.changed.push(slot);
        }
    }

    /// Returns `true` if the plan of the point in a slot was noted as changed.
    #[inline]
    pub(crate) fn has_changed(&self, slot: u32) -> bool {
        self.bits.get(slot as usize / 64).is_some_and(|word| word & 1 << (slot % 64) != 0)
    }

    /// Forgets which plans changed.
    pub(crate) fn forget_changes(&mut self) {
        for slot in self.changed.drain(..) {
            self.bits[slot as usize / 64] = 0;
        }
    }

    /// Returns the bytes in use.
    pub(crate) fn bytes(&self) -> usize {
        let each = |legs: &Vec<Leg>| size_of::<Vec<Leg>>() + legs.len() * size_of::<Leg>();
        let later: usize = self.later.iter().map(each).sum();
        let words = self.slots.len() + self.free.len() + self.changed.len() + 2 * self.bits.len();
        self.slots.len() * size_of::<Leg>() + later + words * size_of::<u32>() + self.knots.bytes()
    }
}
