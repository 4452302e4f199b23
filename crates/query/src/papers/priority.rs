//! A closer test of node pairs whose boxes overlap (Klein & Zachmann 2004, §5.1 and §5.2).
//!
//! If the sphere coverings of the nodes are disjoint, the pair is pruned. Otherwise the sample
//! points of a's node are counted on either side of f′_B, the function that the sample points of
//! b's node define. The counts estimate how likely the surfaces cross. Only points further from
//! f′_B than the covering radius of b's node count, as nearer ones say little about f_B.

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::{Extent, NodePair, apart as coverings_apart};
use nearmiss_surface::Status;

use crate::ask::options::Order;
use crate::pair::cell_table::expected;
use crate::pair::cell_volume::filled_cells;
use crate::papers::Papers;

impl Papers<'_, '_> {
    /// Returns the priority of a pair, lowest first: by cells, their negated number; otherwise
    /// `share` minus the count of sample points on the sides. As `share` is about one at most, it
    /// decides between pairs with equal counts.
    /// `None` if the coverings are disjoint.
    pub(crate) fn look_closer(&mut self, pair: NodePair, share: f32) -> Option<f32> {
        let (slices_a, slices_b) = (self.search.pair.a, self.search.pair.b);
        if self.coverings
            && coverings_apart(
                slices_a,
                slices_b,
                pair,
                &self.search.pair.relative,
                self.search.reach,
                Extent::Discs,
            )
        {
            return None;
        }
        let sides = match self.order {
            Order::Sides => self.sides(pair, |_| 1.0),
            Order::SidesByGap => self.sides(pair, eigenvalue_gap),
            Order::Cells => return Some(-self.common_cells(pair)),
            Order::DepthFirst | Order::Overlap => 0.0,
        };
        Some(share - sides)
    }

    /// Returns the number of cells that the surfaces of both nodes are expected to fill.
    fn common_cells(&mut self, pair: NodePair) -> f32 {
        let (a, b) = (self.search.pair.a, self.search.pair.b);
        let [of_a, of_b] = &mut self.scratch.cells;
        let counts = [of_a.get(a, pair.a), of_b.get(b, pair.b)];
        let volume = a.tree.bounds(pair.a);
        let other = self.search.pair.relative.moved(&b.tree.bounds(pair.b));
        expected(filled_cells([&volume, &other], counts))
    }

    /// The weighted number of a's sample points on the side of f′_B that has fewer of them.
    fn sides(&mut self, pair: NodePair, weight: impl Fn([f64; 3]) -> f64) -> f32 {
        let [va, vb] = self.search.pair.views;
        let near = f64::from(self.search.pair.b.covering_radius(pair.b.index()));
        // The normals of f′_B are turned to one side: that of the shortest axis of b's node.
        let up = Vector3::from(self.search.pair.b.tree.bounds(pair.b).axes[2].map(f64::from));
        let mut sides = [0.0_f64; 2];
        for i in self.search.pair.a.samples(pair.a.index()).iter() {
            if self.search.pair.meter.go_on().is_break() {
                break;
            }
            let x = vb.stored_to_world().apply_inverse(va.point(i));
            self.search.pair.meter.evaluated(1);
            let at = vb.scan().evaluate_node_with(pair.b.index(), x, &mut self.search.gathers[1].gather);
            if at.status == Status::Outside || at.f.abs() <= near {
                continue;
            }
            let above = at.f * Vector3::from(at.normal).dot(&up);
            sides[usize::from(above > 0.0)] += weight(at.eigenvalues);
        }
        #[expect(clippy::cast_possible_truncation, reason = "an urgency")]
        let least = sides[0].min(sides[1]) as f32;
        least
    }
}

/// (λ2 − λ1)/(λ1 + λ2 + λ3): the confidence of a normal.
fn eigenvalue_gap([l1, l2, l3]: [f64; 3]) -> f64 {
    let sum = l1 + l2 + l3;
    if sum > 0.0 { (l2 - l1) / sum } else { 0.0 }
}
