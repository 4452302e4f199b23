//! Sphere coverings: the radius at which balls around a node's samples contain its part of the
//! surface.
//!
//! Klein & Zachmann 2004, §4.2.2, increase the radius by random test points and stop when enough of
//! them are inside; parts that no test point hits stay outside. Here it is the least radius at
//! which each solid of the node's points is in a single ball. The solids contain the cells in which
//! the surface nearest to the points provably is, and their discs and balls
//! (docs/theory/coverings.md). As in the paper, the radius grows with the parts found outside. The
//! furthest parts come first, so most of a node is skipped because a box around it is already
//! inside.

use bytemuck::{Pod, Zeroable};
use fearless_simd::{Level, Simd, dispatch};
use nearmiss_geometry::NodeId;
use nearmiss_lanes::id32;
use nearmiss_lanes::parallel::fill;
use nearmiss_lanes::vector::dot;

use crate::bounds::boxes::OrientedBox;
use crate::bounds::growth::Growth;
use crate::patch::centres::{Centres, WIDTH, fold_min};
use crate::patch::enclosure::Cell;
use crate::patch::samples::NodeSamples;
use crate::point::kind::THICKNESS;
use crate::point::spacing::fold_nodes;
use crate::tree::topology::{TREE_STACK, Topology};

/// Properties of a node's sample as a whole, in stored units.
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
#[repr(C)]
pub struct Covering {
    /// The covering radius: balls of this radius around the samples contain the node's part of the
    /// surface, its points, their discs and balls. Infinite if nothing is proven.
    pub radius: f32,
    /// r(P') of Klein & Zachmann 2004, Definition 4, measured to first order: each tangent disc
    /// under the node, with its thickness, and the ball of each sparse point is in a ball of this
    /// radius. At most [`radius`](Self::radius).
    pub sampling: f32,
    /// r(P): the root mean square of the local radii of all points under the node. With it the
    /// areas that eq. 10 equates are the sums of the points' own areas.
    pub spacing: f32,
}

impl Covering {
    /// A covering whose radii are not known.
    pub(crate) const fn withheld(spacing: f32) -> Self {
        Self { radius: f32::INFINITY, sampling: f32::INFINITY, spacing }
    }
}

/// Allowance for the relative rounding error: the same as for enclosures, which use the same cells.
const GROWN: f32 = 1.0 + 1e-4;

/// Allowance for the rounding error of the difference of two squares, relative to the greater.
const CANCELLED: f32 = 1.0 + 2e-6;

/// The length that squares may lose to underflow.
const LOST: f32 = 1e-20;

/// Returns the positions of the samples of a node.
pub(crate) fn centres_of(samples: NodeSamples<'_>, positions: &[[f32; 3]]) -> Centres {
    let mut centres = Centres::default();
    for i in samples.iter() {
        centres.push(positions[i]);
    }
    centres
}

impl Centres {
    /// Returns the square of the least radius at which a single ball contains the box; infinite if
    /// anything is NaN.
    #[inline(always)]
    fn far_sq(&self, bounds: &OrientedBox) -> f32 {
        let OrientedBox { centre: c, half, axes, .. } = bounds;
        let mut least = [f32::INFINITY; WIDTH];
        for [x, y, z] in self.blocks() {
            let mut d_sq = [0.0; WIDTH];
            for (axis, half) in axes.iter().zip(half) {
                for i in 0..WIDTH {
                    let far = dot([x[i] - c[0], y[i] - c[1], z[i] - c[2]], *axis).abs() + half;
                    d_sq[i] += far * far;
                }
            }
            for i in 0..WIDTH {
                least[i] = if d_sq[i] < least[i] { d_sq[i] } else { least[i] };
            }
        }
        fold_min(&least)
    }

    /// Returns for each solid the square of the least radius at which a single ball contains it.
    #[inline(always)]
    fn each_far_sq(&self, solids: &Solids) -> [f32; WIDTH] {
        let Solids { middle: [px, py, pz], normal: [nx, ny, nz], across, height } = solids;
        let mut least = [f32::INFINITY; WIDTH];
        for centre in 0..self.len() {
            let [x, y, z] = self.get(centre);
            for i in 0..WIDTH {
                let d = [x - px[i], y - py[i], z - pz[i]];
                let up = dot(d, [nx[i], ny[i], nz[i]]);
                let aside_sq = dot(d, d) * CANCELLED - up * up;
                let aside = if aside_sq > 0.0 { aside_sq } else { 0.0 }.sqrt() + across[i];
                let up = up.abs() + height[i];
                let d_sq = up * up + aside * aside;
                least[i] = if d_sq < least[i] { d_sq } else { least[i] };
            }
        }
        least
    }
}

/// Returns the greatest of the lanes and 0, ignoring NaN as [`f32::max`] does.
#[inline(always)]
fn fold_max(lanes: &[f32; WIDTH]) -> f32 {
    let mut greatest = 0.0_f32;
    for &x in lanes {
        greatest = greatest.max(x);
    }
    greatest
}

/// A flat cylinder around a point and its normal.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Solid {
    /// The radius.
    across: f32,
    /// Half the height.
    height: f32,
}

impl Solid {
    /// Returns a solid that contains the disc of a point with its thickness, and its ball.
    pub(crate) fn of_disc(disc: f32, ball: f32) -> Self {
        let thickness = disc * THICKNESS;
        Self { across: (disc + thickness).max(ball), height: thickness.max(ball) }
    }

    /// Returns a solid that contains the cell of a point as well.
    pub(crate) fn of_cell(cell: &Cell, disc: Self) -> Self {
        Self { across: cell.across.max(disc.across), height: cell.height().max(disc.height) }
    }
}

/// Solids side by side.
struct Solids {
    middle: [[f32; WIDTH]; 3],
    normal: [[f32; WIDTH]; 3],
    across: [f32; WIDTH],
    height: [f32; WIDTH],
}

/// The data that coverings must contain.
#[derive(Clone, Copy)]
pub(crate) struct Ground<'a> {
    pub(crate) topology: &'a Topology,
    pub(crate) boxes: &'a [OrientedBox],
    pub(crate) growths: &'a [Growth],
    pub(crate) positions: &'a [[f32; 3]],
    pub(crate) normals: &'a [[f32; 3]],
    pub(crate) radii: &'a [f32],
    /// Solids around the disc and the ball of each point.
    pub(crate) discs: &'a [Solid],
    /// Solids around the cell of each point as well.
    pub(crate) cells: &'a [Solid],
}

/// Sets `out` to the coverings of all nodes with these samples.
pub(crate) fn coverings<'a>(
    ground: &Ground<'_>,
    samples: impl Fn(NodeId) -> NodeSamples<'a> + Sync + Send,
    out: &mut [Covering],
) {
    let Ground { topology, positions, radii, .. } = *ground;
    let squares = fold_nodes(
        topology,
        |range| radii[range].iter().map(|&r| f64::from(r) * f64::from(r)).sum(),
        |a: f64, b| a + b,
    );
    let level = Level::new();
    fill(out, |i| {
        let node = NodeId(id32(i));
        let centres = centres_of(samples(node), positions);
        let count = f64::from(id32(topology.points(node).len()));
        #[expect(clippy::cast_possible_truncation, reason = "stored in single precision")]
        let spacing = (squares[i] / count).sqrt() as f32;
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || {
                let radius = ground.covering_radius(node, &centres);
                Covering { radius, sampling: ground.sampling_radius(node, &centres).min(radius), spacing }
            },
        ))
    });
}

// Inlined into a caller that is compiled for an instruction set.
impl Ground<'_> {
    /// Returns a radius at which balls around `centres` contain the surface whose nearest points
    /// are under `node`, and the discs and balls of these points.
    #[inline(always)]
    fn covering_radius(&self, node: NodeId, centres: &Centres) -> f32 {
        let about = |id: NodeId| self.growths[id.index()].of(&self.boxes[id.index()]);
        self.greatest(node, centres, about, self.cells)
    }

    /// Returns a radius at which each disc and ball of a point under `node` is in one of the balls
    /// around `centres`.
    #[inline(always)]
    fn sampling_radius(&self, node: NodeId, centres: &Centres) -> f32 {
        self.greatest(node, centres, |id| self.boxes[id.index()], self.discs)
    }

    /// Returns the least radius at which the parts under `node` are each in one of the balls around
    /// `centres`. A part is the box `about` a node, or else each of the `solids` of its points. The
    /// furthest of siblings comes first, so that little is left to visit.
    #[inline(always)]
    fn greatest(
        &self,
        node: NodeId,
        centres: &Centres,
        about: impl Fn(NodeId) -> OrientedBox,
        solids: &[Solid],
    ) -> f32 {
        let far_sq = |id: NodeId| centres.far_sq(&about(id));
        let mut radius_sq = 0.0_f32;
        let mut stack = [(NodeId::ROOT, 0.0_f32); TREE_STACK];
        stack[0] = (node, far_sq(node));
        let mut top = 1;
        while top > 0 {
            top -= 1;
            let (id, far) = stack[top];
            if far <= radius_sq {
                continue;
            }
            if self.topology.is_leaf(id) {
                let points = self.topology.points(id);
                let (mut inside_sq, mut start) = (0.0_f32, points.start);
                while start < points.end {
                    let far_sq = centres.each_far_sq(&self.side_by_side(solids, start, points.end));
                    inside_sq = inside_sq.max(fold_max(&far_sq));
                    start += WIDTH;
                }
                radius_sq = radius_sq.max(inside_sq.min(far));
                continue;
            }
            let bottom = top;
            for child in self.topology.children(id).iter() {
                let far = far_sq(child);
                // Furthest on top.
                let mut at = top;
                while at > bottom && stack[at - 1].1 > far {
                    stack[at] = stack[at - 1];
                    at -= 1;
                }
                stack[at] = (child, far);
                top += 1;
            }
        }
        radius_sq.sqrt() * GROWN + LOST
    }

    /// Returns the solids from point `start` on, padded with the last one.
    #[inline(always)]
    fn side_by_side(&self, of: &[Solid], start: usize, end: usize) -> Solids {
        let none = [0.0; WIDTH];
        let mut solids = Solids { middle: [none; 3], normal: [none; 3], across: none, height: none };
        for lane in 0..WIDTH {
            let i = (start + lane).min(end - 1);
            for k in 0..3 {
                solids.middle[k][lane] = self.positions[i][k];
                solids.normal[k][lane] = self.normals[i][k];
            }
            Solid { across: solids.across[lane], height: solids.height[lane] } = of[i];
        }
        solids
    }
}
