//! The part of a that is in the box of b.

use std::ops::{ControlFlow, Range};

use nearmiss_geometry::NodeId;
use nearmiss_hierarchy::{NodePair, OrientedBox};
use nearmiss_lanes::id32;

use super::volume::{Row, Volume};
use crate::papers::Papers;

/// The least number of nodes that describe the part of a in the box of b, if a has that many.
const NODES: usize = 128;

/// The box of b in a's stored frame, and the distance outside of it up to which a point of a may
/// reach into it.
#[derive(Debug, Clone)]
pub(crate) struct Bounds {
    volume: OrientedBox,
    reach_sq: f32,
}

impl Bounds {
    pub(crate) fn holds(&self, place: [f32; 3]) -> bool {
        self.volume.distance_sq(place) <= self.reach_sq
    }
}

impl Papers<'_, '_> {
    pub(crate) fn bounds_of_b(&self) -> Bounds {
        let volume = self.search.pair.relative.moved(&self.search.pair.b.enclosure(0));
        let own = self.search.pair.a.tree.reach(NodeId::ROOT);
        Bounds { volume, reach_sq: own * own }
    }

    /// Finds the part of a in the box of b, as coarsely as suffices. `areas` holds the prefix sums
    /// of the areas of all points.
    pub(crate) fn survey(&mut self, areas: &[f64], volume: &mut Volume) -> ControlFlow<()> {
        volume.nodes.clear();
        volume.nodes.push(NodeId::ROOT);
        let topology = self.search.pair.a.tree.topology();
        loop {
            volume.finer.clear();
            let mut is_finest = true;
            for &id in &volume.nodes {
                self.search.pair.meter.go_on()?;
                if self.search.pair.gap(NodePair { a: id, b: NodeId::ROOT }) > self.search.reach {
                    continue;
                }
                if topology.is_leaf(id) {
                    volume.finer.push(id);
                } else {
                    is_finest = false;
                    volume.finer.extend(topology.children(id).iter());
                }
            }
            std::mem::swap(&mut volume.nodes, &mut volume.finer);
            if is_finest || volume.nodes.len() >= 2 * NODES {
                break;
            }
        }
        volume.rows.clear();
        (volume.area, volume.count) = (0.0, 0);
        for id in &volume.nodes {
            let Range { start, end } = topology.points(*id);
            let points = id32(start)..id32(end);
            volume.count += points.end - points.start;
            let own = areas[points.end as usize] - areas[points.start as usize];
            match volume.rows.last_mut() {
                Some(last) if last.points.end == points.start => last.points.end = points.end,
                _ => volume.rows.push(Row { points, before: volume.area }),
            }
            volume.area += own;
        }
        ControlFlow::Continue(())
    }
}
