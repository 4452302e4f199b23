//! What a pair of nodes whose boxes overlap says on a closer look: S0 §5.1 and §5.2.
//!
//! Their sphere coverings may part them. Otherwise the sample points of a's node that lie on either side of
//! f′_B, the function that the sample points of b's node define, tell how likely the surfaces cross; only
//! those count that are further from it than the covering radius of b's node, for nearer ones say little of
//! f_B.

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::{Extent, NodePair, apart as coverings_apart};
use nearmiss_surface::Status;

use crate::ask::options::Order;
use crate::papers::Papers;

impl Papers<'_, '_> {
    /// `None` where coverings part the pair; otherwise `share`, the less the more urgent, less what the
    /// sample points say. At most about one itself, a share decides between pairs of as many sample points.
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
            _ => 0.0,
        };
        Some(share - sides)
    }

    /// The lesser number, weighted, of a's sample points on one of the sides of f′_B.
    fn sides(&mut self, pair: NodePair, weight: impl Fn([f64; 3]) -> f64) -> f32 {
        let [va, vb] = self.search.pair.views;
        let near = f64::from(self.search.pair.b.covering_radius(pair.b.index()));
        // f′_B's normals are turned to one side: that of the least extent of b's node.
        let up = Vector3::from(self.search.pair.b.tree.bounds(pair.b).axes[2].map(f64::from));
        let mut sides = [0.0_f64; 2];
        for i in self.search.pair.a.samples(pair.a.index()).iter() {
            if self.search.pair.meter.go_on().is_break() {
                break;
            }
            let x = vb.placed().apply_inverse(va.point(i));
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

/// (λ2 − λ1)/(λ1 + λ2 + λ3): how sure a normal is.
fn eigenvalue_gap([l1, l2, l3]: [f64; 3]) -> f64 {
    let sum = l1 + l2 + l3;
    if sum > 0.0 { (l2 - l1) / sum } else { 0.0 }
}
