//! `Semantics::Thickened`: balls about the points, decided exactly.

use std::ops::ControlFlow;

use nearmiss_geometry::NodeId;
use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::{MOST_LEAF_POINTS, NodePair, Split, Visitor};

use crate::posed::Posed;
use crate::verdict::Contact;

/// The search for two points within twice the radius of each other.
#[derive(Debug)]
pub(crate) struct Balls<'a> {
    pub(crate) pair: Posed<'a>,
    /// 2R + margin in the world, and a little more in a's stored frame.
    reach: f64,
    pub(crate) reach_stored: f32,
    /// One such pair of every pair of leaves, if all are wanted.
    all: Option<&'a mut Vec<Contact>>,
    /// The first such pair.
    pub(crate) found: Option<Contact>,
    /// Their numbers.
    pub(crate) met: Option<[usize; 2]>,
    /// A lower bound of the distance of all points looked at or excluded, in the world.
    pub(crate) apart: f64,
}

impl<'a> Balls<'a> {
    pub(crate) fn new(pair: Posed<'a>, reach: f64, all: Option<&'a mut Vec<Contact>>) -> Self {
        let reach_stored = pair.stored(reach);
        Self { pair, reach, reach_stored, all, found: None, met: None, apart: f64::INFINITY }
    }
}

impl Visitor for Balls<'_> {
    #[inline]
    fn admit(&mut self, a: [NodeId; 2], b: [NodeId; 2], count: u8) -> [Option<f32>; 4] {
        self.pair.gaps(a, b, count).map(|gap| {
            // Written so that a gap that is no number excludes nothing.
            if gap > self.reach_stored {
                let bound = f64::from(gap - self.pair.relative.slack()) * self.pair.views[0].placed().scale();
                self.apart = self.apart.min(bound);
                return None;
            }
            Some(self.reach_stored - gap)
        })
    }

    #[inline]
    fn split(&self, pair: NodePair) -> Split {
        self.pair.split(pair)
    }

    #[inline]
    fn go_on(&mut self) -> ControlFlow<()> {
        self.pair.meter.go_on()
    }

    fn leaves(&mut self, pair: NodePair) -> ControlFlow<()> {
        let (node_a, node_b) = (self.pair.a.nodes[pair.a.index()], self.pair.b.nodes[pair.b.index()]);
        self.pair.meter.leaf_pair(node_a.count as usize, node_b.count as usize);
        let [va, vb] = self.pair.views;
        let mut points_b = [Vector3::zeros(); MOST_LEAF_POINTS];
        for (q, j) in points_b.iter_mut().zip(node_b.points()) {
            *q = Vector3::from(vb.point(j));
        }
        for i in node_a.points() {
            let p = Vector3::from(va.point(i));
            for (&q, j) in points_b.iter().zip(node_b.points()) {
                let distance = (p - q).norm();
                self.apart = self.apart.min(distance);
                if distance <= self.reach {
                    let contact = contact(&self.pair, [p, q], [i, j]);
                    self.found.get_or_insert(contact);
                    self.met.get_or_insert([i, j]);
                    let Some(all) = &mut self.all else { return ControlFlow::Break(()) };
                    all.push(contact);
                    return ControlFlow::Continue(());
                }
            }
        }
        ControlFlow::Continue(())
    }
}

/// Between two points.
fn contact(pair: &Posed<'_>, [p, q]: [Vector3<f64>; 2], [i, j]: [usize; 2]) -> Contact {
    Contact {
        point: (0.5 * (p + q)).into(),
        normals: None,
        residual: 0.5 * (p - q).norm(),
        sources: [pair.views[0].scan().id(i), pair.views[1].scan().id(j)],
    }
}

/// Where two points are, if they are within `reach` of each other in the world.
pub(crate) fn balls_meet(pair: &Posed<'_>, reach: f64, [i, j]: [usize; 2]) -> Option<Contact> {
    let [p, q] = [pair.views[0].point(i), pair.views[1].point(j)].map(Vector3::from);
    ((p - q).norm() <= reach).then(|| contact(pair, [p, q], [i, j]))
}
