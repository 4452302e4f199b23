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
    pub(crate) pairs: Pairs,
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
        self.advance_trees(&mut Trees::Two([a, b]), time)
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
        self.next_contact_of(&mut Trees::Two([a, b]), until, &mut narrow)
    }

    /// Calls `visit` with each pair of primitives whose boxes now have a point in common, after a
    /// call of [`advance`](Self::advance) or [`next_contact`](Self::next_contact) with these trees.
    pub fn for_each_overlap(&self, a: &KineticTree, b: &KineticTree, mut visit: impl FnMut(u32, u32)) {
        self.any_overlap(a, b, |i, j| {
            visit(i, j);
            false
        });
    }

    /// Returns `true` if `found` does for one of the pairs that [`for_each_overlap`](Self::for_each_overlap)
    /// visits. Calls it for none after that.
    pub fn any_overlap(&self, a: &KineticTree, b: &KineticTree, found: impl FnMut(u32, u32) -> bool) -> bool {
        self.has_overlap([a, b], false, found)
    }

    pub(crate) fn has_overlap(
        &self,
        [a, b]: [&KineticTree; 2],
        is_own: bool,
        mut found: impl FnMut(u32, u32) -> bool,
    ) -> bool {
        let (mut others, mut has_found) = (Vec::new(), false);
        self.pairs.for_each(|nodes, meets| {
            if !meets || has_found {
                return;
            }
            let of_b = b.nodes.primitives_of(nodes[1]);
            others.clear();
            others.extend(of_b.iter().map(|&j| (j, b.primitive_bounds(j))));
            for (n, &i) in a.nodes.primitives_of(nodes[0]).iter().enumerate() {
                let Some(own) = a.primitive_bounds(i) else { continue };
                let others = if is_own && nodes[0] == nodes[1] { &others[n + 1..] } else { &others[..] };
                for (j, other) in others {
                    let overlaps = other.is_some_and(|other| {
                        (0..3).all(|k| own.min[k] <= other.max[k] && other.min[k] <= own.max[k])
                    });
                    if overlaps && found(i, *j) {
                        has_found = true;
                        return;
                    }
                }
            }
        });
        has_found
    }

    /// Returns the number of pairs that are apart, and of leaf pairs that meet. Looks at all pairs.
    #[must_use]
    pub fn pair_counts(&self) -> [usize; 2] {
        let mut counts = [0; 2];
        self.pairs.for_each(|_, meets| counts[usize::from(meets)] += 1);
        counts
    }

    pub(crate) fn advance_trees(&mut self, trees: &mut Trees<'_>, time: f64) -> Result<(), KineticError> {
        let time = self.start(trees, time)?;
        while self.next_time(trees) <= time {
            self.step(trees);
        }
        self.pairs.forget_fresh();
        self.end(trees, time);
        Ok(())
    }

    pub(crate) fn next_contact_of(
        &mut self,
        trees: &mut Trees<'_>,
        until: f64,
        narrow: &mut impl FnMut([&KineticTree; 2], [u32; 2], [f64; 2]) -> Option<f64>,
    ) -> Result<Option<FirstContact>, KineticError> {
        let until = self.start(trees, until)?;
        let mut best: Option<FirstContact> = None;
        let mut now = trees.both()[0].clock;
        let mut found = std::mem::take(&mut self.found);
        self.pairs.refresh_all();
        loop {
            let knot = |tree: &KineticTree| tree.points.knots.first().map_or(f64::INFINITY, |(time, _)| time);
            let end = trees.both().map(knot).into_iter().fold(f64::INFINITY, f64::min);
            let limit = best.map_or(until, |best| best.time);
            self.pairs.take_fresh(&mut found);
            for &leaves in &found {
                best = narrowed(trees, leaves, [now, limit.min(end)], best, narrow);
            }
            let limit = best.map_or(until, |best| best.time);
            let next = self.next_time(trees);
            if next > limit {
                break;
            }
            self.step(trees);
            now = next.max(now);
            if next >= end {
                self.pairs.refresh_all();
            }
        }
        self.found = found;
        self.end(trees, best.map_or(until, |best| best.time));
        Ok(best)
    }

    /// Checks the trees; starts the list again if they changed.
    fn start(&mut self, trees: &mut Trees<'_>, time: f64) -> Result<f64, KineticError> {
        let [a, b] = trees.both();
        if a.clock != b.clock {
            return Err(KineticError::Clocks { a: a.clock, b: b.clock });
        }
        let time = a.coming(time)?;
        if self.known != Some(state_of([a, b])) {
            self.pairs.restart(View { trees: [a, b], now: a.clock }, trees.is_one());
        }
        for k in 0..trees.count() {
            trees.get(k).changes.get_or_insert_default().clear();
        }
        Ok(time)
    }

    fn end(&mut self, trees: &mut Trees<'_>, time: f64) {
        for k in 0..trees.count() {
            let tree = trees.get(k);
            tree.clock = time;
            tree.changes = None;
        }
        self.known = Some(state_of(trees.both()));
    }

    fn next_time(&self, trees: &Trees<'_>) -> f64 {
        let [a, b] = trees.both().map(KineticTree::next_time);
        a.min(b).min(self.pairs.next_time())
    }

    /// Processes the next event: of the first tree, of the second one, or of the list.
    fn step(&mut self, trees: &mut Trees<'_>) {
        let next = self.next_time(trees);
        let [a, b] = trees.both();
        let now = next.max(a.clock).max(b.clock);
        for k in 0..trees.count() {
            let moved = trees.get(k);
            if moved.next_time() > next {
                continue;
            }
            moved.step();
            let mut changes = moved.changes.take().unwrap_or_default();
            // A single tree is both the first and the second one.
            let roles = if trees.is_one() { 0..2 } else { k..k + 1 };
            for (node, sides) in changes.drain(..) {
                for role in roles.clone() {
                    self.pairs.node_changed(role, node, sides, View { trees: trees.both(), now });
                }
            }
            trees.get(k).changes = Some(changes);
            return;
        }
        self.events += 1;
        self.pairs.step(View { trees: trees.both(), now });
    }
}

/// Two trees, or one that is compared with itself.
pub(crate) enum Trees<'a> {
    One(&'a mut KineticTree),
    Two([&'a mut KineticTree; 2]),
}

impl Trees<'_> {
    /// Returns both trees; the same one twice if there is one.
    fn both(&self) -> [&KineticTree; 2] {
        match self {
            Self::One(tree) => [tree; 2],
            Self::Two([a, b]) => [a, b],
        }
    }

    const fn is_one(&self) -> bool {
        matches!(self, Self::One(_))
    }

    const fn count(&self) -> usize {
        if self.is_one() { 1 } else { 2 }
    }

    const fn get(&mut self, k: usize) -> &mut KineticTree {
        match self {
            Self::One(tree) => tree,
            Self::Two(trees) => trees[k],
        }
    }
}

fn state_of(trees: [&KineticTree; 2]) -> [(u64, u64); 2] {
    trees.map(|tree| (tree.edits, tree.clock.to_bits()))
}

/// Returns the pairs of primitives of two leaves. Those of a leaf with itself come once each.
fn primitives<'a>(
    trees: [&'a KineticTree; 2],
    leaves: [u32; 2],
    is_own: bool,
) -> impl Iterator<Item = (u32, u32)> + use<'a> {
    let [of_a, of_b] = [0, 1].map(|k| trees[k].nodes.primitives_of(leaves[k]));
    let is_same = is_own && leaves[0] == leaves[1];
    of_a.iter().enumerate().flat_map(move |(n, &i)| {
        let others = if is_same { &of_b[n + 1..] } else { of_b };
        others.iter().map(move |&j| (i, j))
    })
}

/// Returns the earlier one of `best` and the first meeting of primitives of two leaves.
fn narrowed(
    trees: &Trees<'_>,
    leaves: [u32; 2],
    [from, to]: [f64; 2],
    mut best: Option<FirstContact>,
    narrow: &mut impl FnMut([&KineticTree; 2], [u32; 2], [f64; 2]) -> Option<f64>,
) -> Option<FirstContact> {
    let (is_own, trees) = (trees.is_one(), trees.both());
    for (i, j) in primitives(trees, leaves, is_own) {
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
