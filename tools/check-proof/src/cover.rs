//! Coverings of a rectangle of pairs of points by rectangles. Nothing is assumed about these: they
//! may overlap, nest or leave it.

use std::ops::Range;

/// The pairs of a range of a's points with a range of b's.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Rectangle {
    pub(crate) a: Range<u64>,
    pub(crate) b: Range<u64>,
}

/// Returns a pair of points below `size` that is in none of `rectangles`. A line sweeps over a's
/// points; a tree of counters tells if the rectangles that it cuts cover b's points.
pub(crate) fn uncovered(rectangles: &[Rectangle], size: [u64; 2]) -> Option<[u64; 2]> {
    let rectangles = rectangles.iter().filter(|r| !r.a.is_empty() && !r.b.is_empty());
    // Where a rectangle starts or ends along a, and its extent along b.
    let mut events: Vec<(u64, bool, Range<u64>)> = Vec::new();
    let mut bounds = vec![0, size[1]];
    for r in rectangles {
        let b = r.b.start.min(size[1])..r.b.end.min(size[1]);
        bounds.extend([b.start, b.end]);
        events.push((r.a.start, true, b.clone()));
        events.push((r.a.end, false, b));
    }
    events.sort_unstable_by_key(|(at, ..)| *at);
    bounds.sort_unstable();
    bounds.dedup();
    let mut counters = Counters::new(bounds.len() - 1);
    let place = |x: u64| bounds.partition_point(|bound| *bound < x);

    let (mut at, mut next) = (0, 0);
    while at < size[0] {
        while next < events.len() && events[next].0 <= at {
            let (_, starts, b) = &events[next];
            counters.change(place(b.start)..place(b.end), *starts);
            next += 1;
        }
        if let Some(slot) = counters.first_free() {
            return Some([at, bounds[slot]]);
        }
        at = events.get(next).map_or(size[0], |(at, ..)| *at);
    }
    None
}

/// The number of rectangles that cover each slot of a row. Counts are stored at the fewest nodes
/// that make up a range.
struct Counters {
    slots: usize,
    count: Vec<u32>,
    /// `true` if counts at the node or below cover all slots below the node.
    full: Vec<bool>,
}

impl Counters {
    fn new(slots: usize) -> Self {
        let nodes = 2 * slots.next_power_of_two().max(1);
        Self { slots, count: vec![0; nodes], full: vec![false; nodes] }
    }

    fn change(&mut self, range: Range<usize>, more: bool) {
        self.change_below(1, 0..self.slots, &range, more);
    }

    fn change_below(&mut self, node: usize, own: Range<usize>, range: &Range<usize>, more: bool) {
        if range.end <= own.start || own.end <= range.start {
            return;
        }
        if range.start <= own.start && own.end <= range.end {
            self.count[node] = if more { self.count[node] + 1 } else { self.count[node] - 1 };
        } else {
            let middle = usize::midpoint(own.start, own.end);
            self.change_below(2 * node, own.start..middle, range, more);
            self.change_below(2 * node + 1, middle..own.end, range, more);
        }
        let below = own.len() > 1 && self.full[2 * node] && self.full[2 * node + 1];
        self.full[node] = self.count[node] > 0 || below;
    }

    fn first_free(&self) -> Option<usize> {
        let (mut node, mut own) = (1, 0..self.slots);
        if self.slots == 0 || self.full[node] {
            return None;
        }
        while own.len() > 1 {
            let middle = usize::midpoint(own.start, own.end);
            let right = self.full[2 * node];
            node = 2 * node + usize::from(right);
            own = if right { middle..own.end } else { own.start..middle };
        }
        Some(own.start)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::Source;

    fn rectangle([a0, a1, b0, b1]: [u64; 4]) -> Rectangle {
        Rectangle { a: a0..a1, b: b0..b1 }
    }

    #[test]
    fn a_missing_rectangle_is_found() {
        // A pinwheel: no guillotine cut separates it.
        let pinwheel = [[0, 6, 0, 3], [6, 9, 0, 6], [3, 9, 6, 9], [0, 3, 3, 9], [3, 6, 3, 6]].map(rectangle);
        assert_eq!(uncovered(&pinwheel, [9, 9]), None);
        for missing in 0..5 {
            let mut some = pinwheel.to_vec();
            let gone = some.remove(missing);
            assert_eq!(uncovered(&some, [9, 9]), Some([gone.a.start, gone.b.start]), "without {missing}");
        }
        assert_eq!(uncovered(&[], [1, 1]), Some([0, 0]));
        assert_eq!(uncovered(&[rectangle([0, 9, 0, 8])], [9, 9]), Some([0, 8]), "a last column");
        assert_eq!(uncovered(&[rectangle([0, 8, 0, 9])], [9, 9]), Some([8, 0]), "a last row");
        assert_eq!(uncovered(&[rectangle([0, 99, 0, 99])], [9, 9]), None, "more than all");
        assert_eq!(uncovered(&[rectangle([4, 2, 0, 9])], [9, 9]), Some([0, 0]), "nothing at all");
    }

    #[test]
    fn agrees_with_a_table() {
        let mut source = Source::new(4);
        let mut whole = 0;
        for _ in 0..3000 {
            let size = [source.below(7) + 1, source.below(7) + 1];
            let mut side = |n: u64| {
                let (x, y) = (source.below(n + 2), source.below(n + 2));
                x.min(y)..x.max(y)
            };
            let rectangles: Vec<Rectangle> =
                (0..12).map(|_| Rectangle { a: side(size[0]), b: side(size[1]) }).collect();
            let covered = |a: u64, b: u64| rectangles.iter().any(|r| r.a.contains(&a) && r.b.contains(&b));
            let all = (0..size[0]).all(|a| (0..size[1]).all(|b| covered(a, b)));
            match uncovered(&rectangles, size) {
                Some([a, b]) => assert!(a < size[0] && b < size[1] && !covered(a, b), "{rectangles:?}"),
                None => assert!(all, "{rectangles:?} leave something of {size:?}"),
            }
            whole += usize::from(all);
        }
        assert!((300..2700).contains(&whole), "both cases come up: {whole}");
    }
}
