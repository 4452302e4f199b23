//! The leaf test of the hierarchical search: edges of a's graph whose ends are on different sides
//! of b.

use std::ops::ControlFlow;

use nearmiss_hierarchy::NodePair;
use nearmiss_lanes::id32;

use crate::ask::interpolation::Interpolation;
use crate::papers::Papers;

/// An edge crosses b only if the distances of its ends from b add up to at most its length. This
/// factor allows for noise and curvature.
const CROSSES: f64 = 1.5;

impl Papers<'_, '_> {
    /// Returns `true` if the leaf of b determines sides: its normals are oriented with sufficient
    /// confidence.
    fn tells_sides(&self, pair: NodePair) -> bool {
        let [_, vb] = self.search.pair.views;
        let points = self.search.pair.b.tree.topology().points(pair.b);
        vb.scan().is_oriented()
            && vb.graph().is_some_and(|graph| {
                graph.confidence()[points].iter().all(|&sure| sure >= super::sides::CERTAIN)
            })
    }

    /// Tests each edge of a's graph from a point of a's leaf near b's leaf for a crossing with b.
    /// No edge crosses if sides are unknown, and none need cross where b is thinner than the edges
    /// are long; there the discs decide.
    pub(crate) fn test_edges(&mut self, pair: NodePair, search: &Interpolation) -> ControlFlow<()> {
        let [va, _] = self.search.pair.views;
        let Some(graph) = va.graph().filter(|_| self.tells_sides(pair)) else {
            return ControlFlow::Continue(());
        };
        let (edges, longest) = (graph.points().edges(), graph.points().reaches());
        let scale = va.stored_to_world().scale();
        let leaf = self.search.pair.a.tree.topology().points(pair.a);
        let volume = self.search.pair.relative.moved(&self.search.pair.b.tree.bounds(pair.b));
        let hint = id32(self.search.pair.b.tree.topology().points(pair.b).start);
        let own = self.search.pair.a.tree.reach(pair.a);
        for i in leaf.clone() {
            let reach = volume.reach + own.max(longest[i]) + self.search.reach;
            if volume.distance_sq(self.search.pair.a.position(i)) > reach * reach {
                continue;
            }
            self.search.pair.meter.go_on()?;
            let from = u32::try_from(i).unwrap_or(u32::MAX);
            let side = self.side_again(from, hint);
            if !side.is_known || side.distance.abs() > CROSSES * f64::from(longest[i]) * scale {
                continue;
            }
            for &to in edges.of(i) {
                // Test each edge within the leaf once.
                if leaf.contains(&(to as usize)) && to < from {
                    continue;
                }
                self.search.pair.meter.go_on()?;
                let there = self.side_again(to, side.near);
                if !side.is_opposite(&there) {
                    continue;
                }
                let tries = self.search.tries;
                self.search_edge([from, to], [side.distance, there.distance], side.near, search)?;
                if self.search.tries > tries {
                    return ControlFlow::Continue(());
                }
            }
        }
        ControlFlow::Continue(())
    }
}
