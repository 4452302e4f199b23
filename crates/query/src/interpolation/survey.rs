//! Which points of a lie in the box of b.

use std::ops::ControlFlow;

use nearmiss_geometry::NodeId;
use nearmiss_hierarchy::OrientedBox;

use super::volume::{Row, Volume};
use crate::surface::Surfaces;

/// The part of a that lies in the box of b is told by no fewer nodes than these, if it has so many.
const NODES: usize = 128;

/// Where b is, in a's stored frame, and how far outside of it a point of a may reach in.
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

impl Surfaces<'_> {
    pub(crate) fn bounds_of_b(&self) -> Bounds {
        let volume = self.pair.relative.moved(&self.pair.b.enclosure(0));
        let own = self.pair.a.boxes[0].reach;
        Bounds { volume, reach_sq: own * own }
    }

    /// Looks for the part of a in the box of b, as coarsely as will do. `areas` has the areas of all points
    /// before each.
    pub(crate) fn survey(&mut self, areas: &[f64], volume: &mut Volume) -> ControlFlow<()> {
        volume.nodes.clear();
        volume.nodes.push(NodeId::ROOT);
        let root = [NodeId::ROOT; 2];
        loop {
            volume.finer.clear();
            let mut is_finest = true;
            for &id in &volume.nodes {
                self.pair.meter.go_on()?;
                if self.pair.gaps([id; 2], root, 1)[0] > self.reach {
                    continue;
                }
                let node = self.pair.a.nodes[id.index()];
                if node.is_leaf() {
                    volume.finer.push(id);
                } else {
                    is_finest = false;
                    volume.finer.extend([NodeId(id.0 + 1), NodeId(node.right)]);
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
            let node = self.pair.a.nodes[id.index()];
            let points = node.first..node.first + node.count;
            volume.count += node.count;
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
