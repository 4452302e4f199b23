//! `SeparationList`: continuous collision detection of two kinetic trees.

use crate::error::KineticError;
use crate::pairs::{Pairs, View};
use crate::tree::KineticTree;

/// A time at which two primitives meet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FirstContact {
    /// The time, in seconds.
    pub time: f64,
    /// A primitive of each tree.
    pub primitives: [u32; 2],
}

/// The node pairs of two kinetic trees that are apart, each with a proof of that and the time until
/// which it holds (a kinetic separation list, after Weller & Zachmann 2006).
///
/// A collision test of two trees goes down from the roots and stops at pairs of boxes that are apart
/// and at leaf pairs. The list holds exactly these pairs at every time. A pair that is apart has a
/// side of an axis on which it stays apart longest. It is replaced by the pairs below it when they
/// meet. Pairs that meet are put together again when they part. So the work depends on how often
/// boxes meet and part, not on how often one asks, and no contact is missed between two queries.
///
/// The trees are those given to every call, always the same two in the same order. If plans or
/// primitives were changed by other calls, or a tree was advanced without the list, it starts again
/// from the roots.
#[derive(Debug, Clone, Default)]
pub struct SeparationList {
    pairs: Pairs,
    /// The edits and clocks of the trees after the last call.
    known: Option<[(u64, u64); 2]>,
    found: Vec<[u32; 2]>,
    events: u64,
}

impl SeparationList {
    /// Creates a list. The first call compares the trees from their roots.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Returns the number of events of the list so far: pairs that met or parted.
    #[must_use]
    pub const fn events(&self) -> u64 {
        self.events
    }

    /// Advances both trees and the list to `time`, in seconds.
    ///
    /// # Errors
    /// [`KineticError::Clocks`] if the trees are at different times, [`KineticError::Past`] if
    /// `time` is before their clocks, [`KineticError::Number`] if it is not finite.
    pub fn advance(
        &mut self,
        a: &mut KineticTree,
        b: &mut KineticTree,
        time: f64,
    ) -> Result<(), KineticError> {
        let time = self.start(a, b, time)?;
        while self.next_time(a, b) <= time {
            self.step(a, b);
        }
        self.pairs.forget_fresh();
        self.end(a, b, time);
        Ok(())
    }

    /// Advances both trees and the list to the earliest time, up to `until`, at which two
    /// primitives meet, and returns it; to `until` if none do.
    ///
    /// `narrow` decides about primitives of leaves whose boxes meet. It gets the trees, a primitive
    /// of each, and an interval `[from, to]`, and returns the first time within it at which the
    /// primitives meet. No leg of a plan starts within the interval, so
    /// [`KineticTree::position_at`] gives positions. It may be called with primitives whose own
    /// boxes are apart. With `|_, _, [from, _]| Some(from)` leaf boxes take the place of
    /// primitives.
    ///
    /// # Errors
    /// As [`advance`](Self::advance).
    pub fn next_contact(
        &mut self,
        a: &mut KineticTree,
        b: &mut KineticTree,
        until: f64,
        mut narrow: impl FnMut([&KineticTree; 2], [u32; 2], [f64; 2]) -> Option<f64>,
    ) -> Result<Option<FirstContact>, KineticError> {
        let until = self.start(a, b, until)?;
        let mut best: Option<FirstContact> = None;
        let mut now = a.clock;
        let mut found = std::mem::take(&mut self.found);
        self.pairs.refresh_all();
        loop {
            let knot = |tree: &KineticTree| tree.points.knots.first().map_or(f64::INFINITY, |(time, _)| time);
            let end = knot(a).min(knot(b));
            let limit = best.map_or(until, |best| best.time);
            self.pairs.take_fresh(&mut found);
            for &leaves in &found {
                best = narrowed([a, b], leaves, [now, limit.min(end)], best, &mut narrow);
            }
            let limit = best.map_or(until, |best| best.time);
            let next = self.next_time(a, b);
            if next > limit {
                break;
            }
            self.step(a, b);
            now = next.max(now);
            if next >= end {
                self.pairs.refresh_all();
            }
        }
        self.found = found;
        self.end(a, b, best.map_or(until, |best| best.time));
        Ok(best)
    }

    /// Calls `visit` with each pair of primitives whose boxes now have a point in common, after a
    /// call of [`advance`](Self::advance) or [`next_contact`](Self::next_contact) with these trees.
    pub fn for_each_overlap(&self, a: &KineticTree, b: &KineticTree, mut visit: impl FnMut(u32, u32)) {
        let bounds = |tree: &KineticTree, primitive| tree.primitive_bounds(primitive);
        self.pairs.for_each(|nodes, meets| {
            if !meets {
                return;
            }
            for &i in a.nodes.primitives_of(nodes[0]) {
                let Some(own) = bounds(a, i) else { continue };
                for &j in b.nodes.primitives_of(nodes[1]) {
                    let other = bounds(b, j);
                    let overlaps = other.is_some_and(|other| {
                        (0..3).all(|k| own.min[k] <= other.max[k] && other.min[k] <= own.max[k])
                    });
                    if overlaps {
                        visit(i, j);
                    }
                }
            }
        });
    }

    /// Returns the number of pairs that are apart, and of leaf pairs that meet. Looks at all pairs.
    #[must_use]
    pub fn pair_counts(&self) -> [usize; 2] {
        let mut counts = [0; 2];
        self.pairs.for_each(|_, meets| counts[usize::from(meets)] += 1);
        counts
    }

    /// Checks the trees; starts the list again if they changed.
    fn start(&mut self, a: &mut KineticTree, b: &mut KineticTree, time: f64) -> Result<f64, KineticError> {
        if a.clock != b.clock {
            return Err(KineticError::Clocks { a: a.clock, b: b.clock });
        }
        let time = a.coming(time)?;
        if self.known != Some(state_of([a, b])) {
            self.pairs.restart(View { trees: [a, b], now: a.clock });
        }
        for tree in [a, b] {
            tree.changes.get_or_insert_default().clear();
        }
        Ok(time)
    }

    fn end(&mut self, a: &mut KineticTree, b: &mut KineticTree, time: f64) {
        for tree in [&mut *a, &mut *b] {
            tree.clock = time;
            tree.changes = None;
        }
        self.known = Some(state_of([a, b]));
    }

    fn next_time(&self, a: &KineticTree, b: &KineticTree) -> f64 {
        a.next_time().min(b.next_time()).min(self.pairs.next_time())
    }

    /// Processes the next event: of the first tree, of the second one, or of the list.
    fn step(&mut self, a: &mut KineticTree, b: &mut KineticTree) {
        let next = self.next_time(a, b);
        let now = next.max(a.clock).max(b.clock);
        for tree in 0..2 {
            let moved = if tree == 0 { &mut *a } else { &mut *b };
            if moved.next_time() > next {
                continue;
            }
            moved.step();
            let mut changes = moved.changes.take().unwrap_or_default();
            for (node, sides) in changes.drain(..) {
                self.pairs.node_changed(tree, node, sides, View { trees: [a, b], now });
            }
            let moved = if tree == 0 { &mut *a } else { &mut *b };
            moved.changes = Some(changes);
            return;
        }
        self.events += 1;
        self.pairs.step(View { trees: [a, b], now });
    }
}

fn state_of(trees: [&KineticTree; 2]) -> [(u64, u64); 2] {
    trees.map(|tree| (tree.edits, tree.clock.to_bits()))
}

/// Returns the earlier one of `best` and the first meeting of primitives of two leaves.
fn narrowed(
    trees: [&KineticTree; 2],
    leaves: [u32; 2],
    [from, to]: [f64; 2],
    mut best: Option<FirstContact>,
    narrow: &mut impl FnMut([&KineticTree; 2], [u32; 2], [f64; 2]) -> Option<f64>,
) -> Option<FirstContact> {
    let [of_a, of_b] = [0, 1].map(|k| trees[k].nodes.primitives_of(leaves[k]));
    for (&i, &j) in of_a.iter().flat_map(|i| of_b.iter().map(move |j| (i, j))) {
        let limit = best.map_or(to, |best| best.time.min(to));
        if let Some(time) = narrow(trees, [i, j], [from, limit])
            && time <= limit
            && best.is_none_or(|best| time < best.time)
        {
            best = Some(FirstContact { time: time.max(from), primitives: [i, j] });
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use nearmiss_testdata::arbitrary::{point_in, rng, unit_vector};
    use rand::RngExt;

    use super::*;
    use crate::nodes::ROOT;
    use crate::plan::FlightPlan;

    /// The pairs at which a test of the trees stops, by boxes alone.
    fn front(trees: [&KineticTree; 2], nodes: [u32; 2], found: &mut Vec<([u32; 2], bool)>) {
        let [a, b] = [0, 1].map(|k| trees[k].node_box(nodes[k]));
        let meets = (0..3).all(|k| a.min[k] <= b.max[k] && b.min[k] <= a.max[k]);
        let of = [0, 1].map(|k| trees[k].nodes.link(nodes[k]));
        let tree = usize::from(of[0].is_leaf() || (!of[1].is_leaf() && of[1].size > of[0].size));
        if !meets || of[tree].is_leaf() {
            return found.push((nodes, meets));
        }
        for child in [of[tree].children, of[tree].children + 1] {
            let mut below = nodes;
            below[tree] = child;
            front(trees, below, found);
        }
    }

    fn check(list: &SeparationList, trees: [&KineticTree; 2]) {
        let mut found = Vec::new();
        list.pairs.for_each(|nodes, meets| found.push((nodes, meets)));
        let mut expected = Vec::new();
        front(trees, [ROOT; 2], &mut expected);
        found.sort_unstable();
        expected.sort_unstable();
        assert_eq!(found, expected, "at {}", trees[0].clock());
    }

    #[test]
    fn the_list_is_the_front_at_every_time() {
        let rng = &mut rng(6);
        for _ in 0..6 {
            let plan = |rng: &mut _, shift: f64| {
                let [x, y, z] = point_in(rng, 1.0);
                let [to, turn] = [unit_vector(rng), unit_vector(rng)];
                let first =
                    FlightPlan::quadratic(0.0, [x + shift, y, z], [to[0] - shift, to[1], to[2]], turn);
                let first = first.unwrap();
                let place = first.position(1.5);
                first.then(FlightPlan::linear(1.5, place, unit_vector(rng)).unwrap()).unwrap()
            };
            let [mut a, mut b] = [-1.5, 1.5].map(|shift| {
                let plans: Vec<_> = (0..150).map(|_| plan(rng, shift)).collect();
                KineticTree::of_points(0.0, plans).unwrap()
            });
            let mut list = SeparationList::new();
            let mut time = 0.0;
            for step in 0..40_u32 {
                list.advance(&mut a, &mut b, time).unwrap();
                check(&list, [&a, &b]);
                if step % 8 == 7 {
                    // Jumps, which the list notices.
                    for point in 0..5 {
                        let place = point_in(rng, 1.0);
                        a.set_plan(point, FlightPlan::linear(time, place, unit_vector(rng)).unwrap())
                            .unwrap();
                    }
                    list.advance(&mut a, &mut b, time).unwrap();
                    check(&list, [&a, &b]);
                }
                time += rng.random_range(0.0..0.15);
            }
            assert!(list.events() > 100, "{} events", list.events());
        }
    }
}
