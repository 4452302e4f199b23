//! What a pair of nodes whose boxes overlap says on a closer look: S0 §5.1 and §5.2.
//!
//! Their sphere coverings may part them. Otherwise the sample points of a's node that lie on either side of
//! f′_B, the function that the sample points of b's node define, tell how likely the surfaces cross; only
//! those count that are further from it than the covering radius of b's node, for nearer ones say little of
//! f_B.

use nearmiss_geometry::NodeId;
use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::{Extent, NodePair, apart as coverings_apart};
use nearmiss_surface::Status;

use crate::options::Order;
use crate::surface::Surfaces;

impl Surfaces<'_> {
    /// Takes those pairs back that coverings part, and adds to the urgencies of the others what their sample
    /// points say. At most one before, an urgency then decides between pairs of as many sample points.
    #[cold]
    pub(crate) fn look_closer(&mut self, a: [NodeId; 2], b: [NodeId; 2], admitted: &mut [Option<f32>; 4]) {
        for (i, admitted) in admitted.iter_mut().enumerate() {
            let pair = NodePair { a: a[i >> 1], b: b[i & 1] };
            let double = (i >> 1 == 1 && a[0] == a[1]) || (i & 1 == 1 && b[0] == b[1]);
            let Some(urgency) = admitted.filter(|_| !double) else { continue };
            let (slices_a, slices_b) = (self.pair.a, self.pair.b);
            if self.coverings
                && coverings_apart(slices_a, slices_b, pair, &self.pair.relative, self.reach, Extent::Discs)
            {
                *admitted = None;
                continue;
            }
            let sides = match self.order {
                Order::Sides => self.sides(pair, |_| 1.0),
                Order::SidesByGap => self.sides(pair, eigenvalue_gap),
                _ => 0.0,
            };
            *admitted = Some(urgency + sides);
        }
    }

    /// The lesser number, weighted, of a's sample points on one of the sides of f′_B.
    fn sides(&mut self, pair: NodePair, weight: impl Fn([f64; 3]) -> f64) -> f32 {
        let [va, vb] = self.pair.views;
        let near = f64::from(self.pair.b.covering_radius(pair.b.index()));
        // f′_B's normals are turned to one side: that of the least extent of b's node.
        let up = Vector3::from(self.pair.b.boxes[pair.b.index()].axes[2].map(f64::from));
        let mut sides = [0.0_f64; 2];
        for i in self.pair.a.samples(pair.a.index()).iter() {
            if self.pair.meter.go_on().is_break() {
                break;
            }
            let x = vb.placed().apply_inverse(va.point(i));
            self.pair.meter.spent.evaluations += 1;
            let at = vb.scan().evaluate_node_with(pair.b.index(), x, &mut self.gathers[1].gather);
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
