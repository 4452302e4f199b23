//! Certificates, the events at which they fail, and the refreshing of boxes after other changes.

use crate::error::KineticError;
use crate::motion::later;
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
        let event = self.nodes.get(ROOT).first;
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
        let mut at = self.nodes.get(ROOT).first_at;
        let node = self.nodes.get(at);
        let side = node.first_side();
        let (old, new) = (node.winners[side], node.rivals[side]);
        if node.is_leaf() {
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
            }
            self.counts.steps += 1;
            let is_moving = self.nodes.compare(at);
            at = self.nodes.get(at).parent;
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
        self.counts.certificates += 1;
        let now = self.clock;
        let node = self.nodes.get(at);
        let winner = node.winners[side];
        let (rival, wait) = if node.is_leaf() {
            self.first_rival(at, winner, side)
        } else {
            let [a, b] = [node.children, node.children + 1].map(|child| self.nodes.get(child).winners[side]);
            let rival = if a == winner { b } else { a };
            let state = |point| self.points.state(point, side, now);
            (rival, if rival == winner { f64::INFINITY } else { state(winner).overtaken_in(&state(rival)) })
        };
        let node = self.nodes.get_mut(at);
        node.times[side] = later(now, wait);
        node.rivals[side] = rival;
    }

    /// Returns the point of a leaf that overtakes `winner` first, and the seconds until then. At
    /// equal times it is the point that gains most, of equal ones that of the lowest index.
    fn first_rival(&self, leaf: u32, winner: u32, side: Side) -> (u32, f64) {
        let mut best = (NONE, f64::INFINITY);
        if winner == NONE {
            return best;
        }
        let state = |point| self.points.state(point, side, self.clock);
        let ahead = state(winner);
        for &point in self.nodes.points_of(leaf) {
            if point == winner {
                continue;
            }
            let rival = state(point);
            let wait = ahead.overtaken_in(&rival);
            let is_better = wait < best.1
                || (wait == best.1 && wait < f64::INFINITY && {
                    let other = state(best.0);
                    rival.gains_on(&other) || (point < best.0 && !other.gains_on(&rival))
                });
            if is_better {
                best = (point, wait);
            }
        }
        best
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
        let children = self.nodes.get(at).children;
        let mut sides = ALL_SIDES;
        if children == 0 {
            if is_fresh {
                self.list_points(at);
            }
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
        }
        let mut changed = 0;
        for side in (0..SIDES).filter(|side| sides & 1 << side != 0) {
            let best = if children == 0 {
                let points = self.nodes.points_of(at).iter().copied();
                points.reduce(|a, b| self.points.extremal(a, b, side, self.clock)).unwrap_or(NONE)
            } else {
                let [a, b] = [children, children + 1].map(|child| self.nodes.get(child).winners[side]);
                self.points.extremal(a, b, side, self.clock)
            };
            let winner = std::mem::replace(&mut self.nodes.get_mut(at).winners[side], best);
            if winner != best {
                self.counts.updates += u64::from(!is_fresh);
            }
            if winner != best || (best != NONE && self.points.has_changed(best)) {
                changed |= 1 << side;
            }
            self.certify(at, side);
        }
        self.nodes.compare(at);
        if let Some(changes) = &mut self.changes
            && changed != 0
        {
            changes.push((at, changed));
        }
        if is_fresh { ALL_SIDES } else { changed }
    }

    /// Lists the points of the primitives of a leaf, each of them once.
    pub(crate) fn list_points(&mut self, leaf: u32) {
        let node = *self.nodes.get(leaf);
        if node.size == 0 {
            self.nodes.get_mut(leaf).flags &= DIRTY | FRESH;
            return;
        }
        let start = node.block as usize * self.nodes.leaf_points;
        let first = node.block as usize * self.nodes.leaf_size;
        let mut count = 0;
        for i in first..first + node.size as usize {
            for &point in self.primitives.points(self.nodes.primitives[i]) {
                if !self.nodes.points[start..start + count].contains(&point) {
                    self.nodes.points[start + count] = point;
                    count += 1;
                }
            }
        }
        let node = self.nodes.get_mut(leaf);
        node.flags = node.flags & (DIRTY | FRESH) | 4 * nearmiss_lanes::id32(count);
    }
}
