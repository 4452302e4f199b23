//! Two scans in relative motion, and what every search through them does with a pair of nodes.

use nearmiss_geometry::NodeId;
use nearmiss_hierarchy::{NodePair, Relative, Slices, Split};

use crate::budget::Meter;
use crate::view::ScanView;

/// Two views, their arrays, the motion between them, and what the search has cost.
#[derive(Debug)]
pub(crate) struct Posed<'a> {
    pub(crate) views: [&'a ScanView<'a>; 2],
    pub(crate) a: &'a Slices<'a>,
    pub(crate) b: &'a Slices<'a>,
    pub(crate) relative: Relative,
    pub(crate) meter: Meter,
}

impl<'a> Posed<'a> {
    pub(crate) fn new(views: [&'a ScanView<'a>; 2], relative: Relative, meter: Meter) -> Self {
        let [a, b] = views.map(ScanView::slices);
        Self { views, a, b, relative, meter }
    }

    /// The leaves with a point of either scan.
    pub(crate) fn leaves_of(&self, [i, j]: [usize; 2]) -> NodePair {
        let (a, b) = (&self.a.wide.leaves, &self.b.wide.leaves);
        NodePair { a: NodeId(a.id(a.leaf_of(i))), b: NodeId(b.id(b.leaf_of(j))) }
    }

    /// A length of the world in a's stored frame, and a little more: what rounding may take from a gap there.
    pub(crate) fn stored(&self, length: f64) -> f32 {
        #[expect(clippy::cast_possible_truncation, reason = "grown by more than the rounding")]
        let length = (length / self.views[0].placed().scale()) as f32 * (1.0 + 1e-6);
        length + self.relative.slack()
    }

    /// The gaps between the boxes of either of `a` and either of `b`, of which `count` pairs are counted.
    #[inline]
    pub(crate) fn gaps(&mut self, a: [NodeId; 2], b: [NodeId; 2], count: u8) -> [f32; 4] {
        self.meter.spent.node_pairs += u64::from(count);
        let boxes_a = [&self.a.boxes[a[0].index()], &self.a.boxes[a[1].index()]];
        let boxes_b = [&self.b.boxes[b[0].index()], &self.b.boxes[b[1].index()]];
        self.relative.gaps(boxes_a, boxes_b)
    }

    /// The gaps between the enclosures of either of `a` and either of `b`.
    #[inline]
    pub(crate) fn gaps_of_enclosures(&self, a: [NodeId; 2], b: [NodeId; 2]) -> [f32; 4] {
        let [a0, a1] = a.map(|id| self.a.enclosure(id.index()));
        let [b0, b1] = b.map(|id| self.b.enclosure(id.index()));
        self.relative.gaps([&a0, &a1], [&b0, &b1])
    }

    /// The gaps of boxes, with how much of each other the boxes overlap when `margin` is about them.
    #[inline]
    pub(crate) fn gaps_and_overlaps(
        &mut self,
        a: [NodeId; 2],
        b: [NodeId; 2],
        count: u8,
        margin: f32,
    ) -> ([f32; 4], [f32; 4]) {
        self.meter.spent.node_pairs += u64::from(count);
        let boxes_a = [&self.a.boxes[a[0].index()], &self.a.boxes[a[1].index()]];
        let boxes_b = [&self.b.boxes[b[0].index()], &self.b.boxes[b[1].index()]];
        self.relative.gaps_and_overlaps(boxes_a, boxes_b, margin)
    }

    /// Both nodes, unless one is more than twice as long as the other: then that one.
    #[inline]
    pub(crate) fn split(&self, pair: NodePair) -> Split {
        let a = self.a.boxes[pair.a.index()].half[0];
        let b = self.b.boxes[pair.b.index()].half[0] * self.relative.scale();
        if a > 2.0 * b {
            Split::First
        } else if b > 2.0 * a {
            Split::Second
        } else {
            Split::Both
        }
    }
}
