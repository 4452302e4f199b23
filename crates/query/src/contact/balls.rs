//! `Semantics::Thickened`: balls about the points, decided exactly.

use std::ops::ControlFlow;

use nearmiss_hierarchy::{BoxVisitor, NodePair, Open, PairVisitor};

use crate::ask::answer::Contact;
use crate::leaf::nearest_points::nearest;
use crate::pair::pairing::ItemPair;
use crate::pair::scan_pair::ScanPair;

/// The search for two points within `reach` of each other.
#[derive(Debug)]
pub(crate) struct Balls<'a> {
    pub(crate) pair: ScanPair<'a>,
    /// 2R + margin in the world, and the same in a's stored frame, rounded up.
    reach: f64,
    pub(crate) reach_stored: f32,
    /// The nearest such point pair of each leaf pair, if all contacts are requested.
    pub(crate) all: Option<&'a mut Vec<Contact>>,
    /// The first such contact and its points.
    pub(crate) found: Option<(Contact, [usize; 2])>,
    /// A lower bound of the distance of all points compared or pruned, in the world.
    pub(crate) apart: f64,
}

impl<'a> Balls<'a> {
    pub(crate) fn new(pair: ScanPair<'a>, reach: f64, all: Option<&'a mut Vec<Contact>>) -> Self {
        let reach_stored = pair.stored(reach);
        Self { pair, reach, reach_stored, all, found: None, apart: f64::INFINITY }
    }

    /// Finds the nearest points of two leaves and records them if they are within reach.
    pub(crate) fn compare(&mut self, leaves: NodePair) -> ControlFlow<()> {
        let best = ItemPair { distance: self.apart, items: [0; 2] };
        let ItemPair { distance, items: points } = nearest(self.pair.level, &self.pair, leaves, best);
        if distance > self.reach {
            self.apart = distance;
            return ControlFlow::Continue(());
        }
        let contact = self.pair.single(points).midpoint();
        self.found.get_or_insert((contact, points));
        let Some(all) = &mut self.all else { return ControlFlow::Break(()) };
        all.push(contact);
        ControlFlow::Continue(())
    }
}

impl PairVisitor for Balls<'_> {
    #[inline]
    fn compared(&mut self, pairs: u32) -> ControlFlow<()> {
        self.pair.meter.spent.node_pairs += u64::from(pairs);
        self.pair.meter.go_on()
    }

    fn leaf_pair(&mut self, [a, b]: [usize; 2], open: &Open) -> ControlFlow<()> {
        let (of_a, of_b) = (self.pair.a.leaves, self.pair.b.leaves);
        self.pair.meter.leaf_pair(of_a.points(a).len(), of_b.points(b).len());
        self.compare(open.pair)
    }
}

impl BoxVisitor for Balls<'_> {
    const NOTES_GAPS: bool = true;

    #[inline]
    fn least_apart(&mut self, least: f32) {
        let bound =
            f64::from(least - self.pair.relative.slack()) * self.pair.views[0].stored_to_world().scale();
        self.apart = self.apart.min(bound);
    }
}
