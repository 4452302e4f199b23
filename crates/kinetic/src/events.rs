//! Certificates, the events at which they fail, and the refreshing of boxes after other changes.

use crate::error::KineticError;
use crate::motion::{State, later};
use crate::nodes::{DIRTY, FRESH, ROOT, SIDES};
use crate::plan::seconds;
use crate::points::Side;
use crate::primitives::NONE;
use crate::tree::KineticTree;

/// A bit for each side.
const ALL_SIDES: u8 = (1 << SIDES) - 1;

impl KineticTree {
    /// Moves the clock to `time`, in seconds, and processes all events up to then.
    ///
    /// Events are in the order of time. At equal times, legs of plans come before certificates,
    /// nodes before those below them, left before right, and sides in a fixed order. A point that
    /// overtakes another is faster than it, so events at one instant end. Each event costs O(log n).
    ///
    /// # Errors
    /// [`KineticError::Past`] if `time` is before the clock, [`KineticError::Number`] if it is not
    /// finite.
    pub fn advance(&mut self, time: f64) -> Result<(), KineticError> {
        let time = self.coming(time)?;
        while self.next_time() <= time {
            self.step();
        }
        self.clock = time;
        Ok(())
    }

    /// Returns `time` if the clock can move there.
    pub(crate) fn coming(&self, time: f64) -> Result<f64, KineticError> {
        let time = seconds(time)?;
        if time < self.clock { Err(KineticError::Past { time, clock: self.clock }) } else { Ok(time) }
    }

    /// Moves the clock to the next event or leg, and processes it. There must be one.
    #[inline]
    pub(crate) fn step(&mut self) {
        let event = self.nodes.link(ROOT).first;
        match self.points.knots.first() {
            Some((knot, _)) if knot <= event => {
                self.clock = self.clock.max(knot);
                self.take_legs(knot);
            }
            _ => {
                self.clock = self.clock.max(event);
                self.process();
            }
        }
    }

    /// Puts the points into the legs that start at `time`.
    fn take_legs(&mut self, time: f64) {
        while let Some((knot, point)) = self.points.knots.first()
            && knot <= time
        {
            self.points.take_leg(point);
            self.counts.legs += 1;
            self.touch(point);
        }
        self.refresh();
    }

    /// Processes the failure of the earliest certificate: the rival becomes extremal, in that node
    /// and in those above where its predecessor was.
    fn process(&mut self) {
        let mut at = self.nodes.link(ROOT).first_at;
        let node = self.nodes.get(at);
        let side = node.first_side();
        let (old, new) = (node.winners[side], node.rivals[side]);
        if self.nodes.link(at).is_leaf() {
            self.counts.leaf_events += 1;
        } else {
            self.counts.tree_events += 1;
        }
        let mut is_changing = true;
        loop {
            if is_changing {
                let winner = &mut self.nodes.get_mut(at).winners[side];
                is_changing = *winner == old;
                if is_changing {
                    *winner = new;
                    self.note_change(at, 1 << side);
                }
                self.certify(at, side);
                self.nodes.retime(at);
            }
            self.counts.steps += 1;
            let is_moving = self.nodes.compare(at);
            at = self.nodes.link(at).parent;
            if at == NONE || !(is_changing || is_moving) {
                break;
            }
        }
    }

    fn note_change(&mut self, at: u32, sides: u8) {
        self.counts.updates += u64::from(sides.count_ones());
        if let Some(changes) = &mut self.changes {
            changes.push((at, sides));
        }
    }

    /// Computes the certificate of a side: the rival that overtakes the extremal point first.
    fn certify(&mut self, at: u32, side: Side) {
        let now = self.clock;
        let winner = self.nodes.get(at).winners[side];
        let children = self.nodes.link(at).children;
        let state = |slot| self.points.state(slot, side, now);
        let (rival, wait) = if children == 0 {
            let slots = self.nodes.points_of(at);
            first_rival(winner, state(winner), slots.iter().map(|&slot| (slot, state(slot))))
        } else {
            let [a, b] = [children, children + 1].map(|child| self.nodes.get(child).winners[side]);
            let rival = if a == winner { b } else { a };
            (rival, if rival == winner { f64::INFINITY } else { state(winner).overtaken_in(&state(rival)) })
        };
        self.set_certificate(at, side, rival, wait);
    }

    fn set_certificate(&mut self, at: u32, side: Side, rival: u32, wait: f64) {
        self.counts.certificates += 1;
        let now = self.clock;
        let node = self.nodes.get_mut(at);
        node.times[side] = later(now, wait);
        node.rivals[side] = rival;
    }

    /// Notes that the plan of a point changed. [`Self::refresh`] has to follow.
    pub(crate) fn touch(&mut self, point: u32) {
        self.points.note(point);
        for primitive in self.primitives.of(point) {
            self.nodes.mark(self.primitives.leaves[primitive as usize], 0);
        }
    }

    /// Computes the boxes and certificates of all nodes that were marked.
    pub(crate) fn refresh(&mut self) {
        if self.nodes.get(ROOT).flags & DIRTY != 0 {
            self.refresh_below(ROOT);
        }
        self.points.forget_changes();
    }

    /// Refreshes a marked node; returns the sides whose extremal points, or their plans, changed.
    fn refresh_below(&mut self, at: u32) -> u8 {
        let flags = self.nodes.get(at).flags;
        self.nodes.get_mut(at).flags &= !(DIRTY | FRESH);
        let is_fresh = flags & FRESH != 0;
        let children = self.nodes.link(at).children;
        let old = self.nodes.get(at).winners;
        let mut sides = ALL_SIDES;
        if children == 0 {
            if is_fresh {
                self.list_points(at);
            }
            self.refresh_leaf(at);
        } else {
            let mut below = 0;
            for child in [children, children + 1] {
                if self.nodes.get(child).flags & DIRTY != 0 {
                    below |= self.refresh_below(child);
                }
            }
            if !is_fresh {
                sides = below;
            }
            self.refresh_inner(at, sides);
        }
        let new = &self.nodes.get(at).winners;
        let [mut other, mut changed] = [0, 0];
        for side in (0..SIDES).filter(|side| sides & 1 << side != 0) {
            let is_other = new[side] != old[side];
            other |= u8::from(is_other) << side;
            changed |=
                u8::from(is_other || (new[side] != NONE && self.points.has_changed(new[side]))) << side;
        }
        self.counts.updates += if is_fresh { 0 } else { u64::from(other.count_ones()) };
        self.nodes.retime(at);
        self.nodes.compare(at);
        if let Some(changes) = &mut self.changes
            && changed != 0
        {
            changes.push((at, changed));
        }
        if is_fresh { ALL_SIDES } else { changed }
    }

    /// Computes some sides of an inner node.
    fn refresh_inner(&mut self, at: u32, sides: u8) {
        let children = self.nodes.link(at).children;
        for side in (0..SIDES).filter(|side| sides & 1 << side != 0) {
            let [a, b] = [children, children + 1].map(|child| self.nodes.get(child).winners[side]);
            let states = [a, b].map(|slot| self.points.state(slot, side, self.clock));
            let is_first = is_extremal((a, &states[0]), (b, &states[1]));
            let (winner, rival) = if is_first { (a, b) } else { (b, a) };
            let [ahead, behind] = if is_first { states } else { [states[1], states[0]] };
            self.nodes.get_mut(at).winners[side] = winner;
            let wait = if a == b { f64::INFINITY } else { ahead.overtaken_in(&behind) };
            self.set_certificate(at, side, rival, wait);
        }
    }

    /// Computes all sides of a leaf.
    fn refresh_leaf(&mut self, leaf: u32) {
        let mut states = std::mem::take(&mut self.states);
        for axis in 0..3 {
            states.clear();
            let state = |&slot| (slot, self.points.state(slot, axis, self.clock));
            states.extend(self.nodes.points_of(leaf).iter().map(state));
            for side in [axis, axis + 3] {
                let first = states
                    .iter()
                    .copied()
                    .reduce(|a, b| if is_extremal((a.0, &a.1), (b.0, &b.1)) { a } else { b });
                let rival = |(slot, ahead)| first_rival(slot, ahead, states.iter().copied());
                let (rival, wait) = first.map_or((NONE, f64::INFINITY), rival);
                self.nodes.get_mut(leaf).winners[side] = first.map_or(NONE, |(slot, _)| slot);
                self.set_certificate(leaf, side, rival, wait);
                for (_, state) in &mut states {
                    *state = state.reversed();
                }
            }
        }
        self.states = states;
    }

    /// Lists the points of the primitives of a leaf, each of them once.
    pub(crate) fn list_points(&mut self, leaf: u32) {
        let (block, size) = (self.nodes.get(leaf).block as usize, self.nodes.link(leaf).size as usize);
        if size == 0 {
            self.nodes.get_mut(leaf).flags &= DIRTY | FRESH;
            return;
        }
        let start = block * self.nodes.leaf_points;
        let first = block * self.nodes.leaf_size;
        let mut count = 0;
        for i in first..first + size {
            for &point in self.primitives.points(self.nodes.primitives[i]) {
                let slot = self.points.slot(point);
                if !self.nodes.points[start..start + count].contains(&slot) {
                    self.nodes.points[start + count] = slot;
                    count += 1;
                }
            }
        }
        let node = self.nodes.get_mut(leaf);
        node.flags = (node.flags & (DIRTY | FRESH)) | (4 * nearmiss_lanes::id32(count));
    }
}

/// Returns `true` if `a` is extremal beside `b`, from now on. Ties of position, velocity and
/// acceleration go to the lower slot.
fn is_extremal(a: (u32, &State), b: (u32, &State)) -> bool {
    a.1.is_ahead_of(b.1) || (a.0 < b.0 && !b.1.is_ahead_of(a.1))
}

/// Returns the point that overtakes `winner` first, and the seconds until then. At equal times it is
/// the point that gains most, of equal ones that of the lowest slot.
fn first_rival(winner: u32, ahead: State, all: impl Iterator<Item = (u32, State)>) -> (u32, f64) {
    let mut best = (NONE, f64::INFINITY);
    let mut best_state = ahead;
    for (slot, rival) in all {
        if slot == winner {
            continue;
        }
        let wait = ahead.overtaken_in(&rival);
        let is_better = wait < best.1
            || (wait == best.1
                && wait < f64::INFINITY
                && (rival.gains_on(&best_state) || (slot < best.0 && !best_state.gains_on(&rival))));
        if is_better {
            (best, best_state) = ((slot, wait), rival);
        }
    }
    best
}
