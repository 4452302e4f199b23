//! The axes of the boxes: those of the surface's second moments.
//!
//! Gottschalk, Lin & Manocha ("`OBBTree`", SIGGRAPH 1996) take the covariance of the convex hull.
//! Here it is that of the triangles themselves, weighted by area: children's moments add up to their
//! parent's, and a flat patch gets a box along its plane.

use nearmiss_geometry::NodeId;
use nearmiss_lanes::id32;
use nearmiss_lanes::parallel::map_all;
use nearmiss_surface::symmetric_eigen;

use crate::bounds::boxes::to_axes;
use crate::tree::topology::Topology;

/// The area of some surface, its first and its second moments xx xy xz yy yz zz.
#[derive(Debug, Clone, Copy, Default)]
struct Moments {
    area: f64,
    first: [f64; 3],
    second: [f64; 6],
}

impl Moments {
    fn add(&mut self, other: &Self) {
        self.area += other.area;
        for k in 0..3 {
            self.first[k] += other.first[k];
        }
        for k in 0..6 {
            self.second[k] += other.second[k];
        }
    }

    /// The moments of a triangle: ∫ x xᵀ = A/12 (Σ pᵢ pᵢᵀ + s sᵀ) for corners pᵢ with the sum s.
    fn of(corners: &[[f32; 3]; 3]) -> Self {
        let [a, b, c] = corners.map(|p| p.map(f64::from));
        let (u, v) = ([0, 1, 2].map(|k| b[k] - a[k]), [0, 1, 2].map(|k| c[k] - a[k]));
        let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        let area = 0.5 * normal.iter().map(|x| x * x).sum::<f64>().sqrt();
        let sum = [0, 1, 2].map(|k| a[k] + b[k] + c[k]);
        let second =
            |i: usize, j: usize| area / 12.0 * (a[i] * a[j] + b[i] * b[j] + c[i] * c[j] + sum[i] * sum[j]);
        Self {
            area,
            first: sum.map(|x| x * area / 3.0),
            second: [second(0, 0), second(0, 1), second(0, 2), second(1, 1), second(1, 2), second(2, 2)],
        }
    }

    /// The principal axes, the longest first; `None` without area.
    fn axes(&self) -> Option<[[f32; 3]; 3]> {
        if self.area.is_nan() || self.area <= 0.0 {
            return None;
        }
        let mean = self.first.map(|x| x / self.area);
        let about = |k: usize, i: usize, j: usize| self.second[k] / self.area - mean[i] * mean[j];
        let covariance =
            [about(0, 0, 0), about(1, 0, 1), about(2, 0, 2), about(3, 1, 1), about(4, 1, 2), about(5, 2, 2)];
        let [_, middle, long] = symmetric_eigen(covariance).vectors;
        Some(to_axes([long, middle]))
    }
}

/// Returns the axes of the box of each node, in the order of their ids; `None` for nodes whose
/// triangles have no area in single precision. `leaf` returns the triangles of a leaf, relative to
/// a place near them. O(n).
pub(crate) fn axes_of_nodes(
    topology: &Topology,
    corners: impl Fn(usize) -> [[f32; 3]; 3],
) -> Vec<Option<[[f32; 3]; 3]>> {
    let mut moments = vec![Moments::default(); topology.len()];
    for number in 0..topology.leaves() {
        let own = &mut moments[topology.leaf(number).index()];
        for i in topology.points_of_leaf(number) {
            own.add(&Moments::of(&corners(i)));
        }
    }
    // Children have greater ids than their parents.
    for id in (0..topology.inner()).rev() {
        let mut sum = Moments::default();
        for child in topology.children(NodeId(id32(id))).iter() {
            sum.add(&moments[child.index()]);
        }
        moments[id] = sum;
    }
    map_all(&moments, Moments::axes)
}
