//! Enclosures: boxes that provably contain the surface.
//!
//! A surface point x belongs to the leaf of its nearest cloud point p. With J the points whose horizon reaches x,
//! three facts bound where it can be (docs/theory/certificates.md has the argument step by step):
//!
//! 1. a(x) is in the hull of J and ‖x − a(x)‖ ≤ 0.56 h(x), so x is in the hull of J grown by 0.56 of J's greatest h;
//! 2. x is in the inner half of the horizon of one of J, and p is not further from x than that: x is within half
//!    the greatest horizon of those that reach p;
//! 3. x is on p's side of the plane half-way between p and any other point.
//!
//! For a leaf all three are applied along the axes of its box; the enclosure of an inner node is the least box
//! along its own axes about those of its leaves. The paper's claim that x is in the hull of J itself (Klein &
//! Zachmann 2004, §4.2) does not hold (docs/theory).

use nearmiss_surface::{BORDER, Neighbourhood, SurfacePlan};

use crate::boxes::{OrientedBox, dot, sub};
use crate::gather::GatherScratch;
use crate::split::id32;
use crate::spacing::map;
use crate::topology::Node;

/// Sectors of the plane of a leaf in which cells are bounded one by one.
const SECTORS: usize = 16;

/// Unit vectors between the sectors, 22.5 degrees apart.
const RAYS: [[f32; SECTORS]; 2] = {
    const A: f32 = 0.923_879_5;
    const B: f32 = 0.707_106_77;
    const C: f32 = 0.382_683_43;
    [
        [1.0, A, B, C, 0.0, -C, -B, -A, -1.0, -A, -B, -C, 0.0, C, B, A],
        [0.0, C, B, A, 1.0, A, B, C, 0.0, -C, -B, -A, -1.0, -A, -B, -C],
    ]
};

/// Neighbours further than this many local radii bound a cell only beside holes; what is missed there makes it
/// wider, never wrong.
const NEIGHBOURS: f32 = 1.75;

/// What single precision may cost here, relatively: some hundred roundings in differences of nearby numbers.
const GROWN: f32 = 1.0 + 1e-4;

/// Bounds of a leaf's part of the surface along the axes of its box, relative to a point of its own.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LeafBounds {
    axes: [[f32; 3]; 3],
    origin: [f32; 3],
    low: [f32; 3],
    high: [f32; 3],
    /// Fact 2.
    reach: f32,
}

impl LeafBounds {
    /// Facts 1 and 2 for a leaf with these points and box, about which `scratch` has collected.
    pub(crate) fn new(
        plan: &SurfacePlan,
        points: &[[f32; 3]],
        about: &OrientedBox,
        scratch: &GatherScratch,
    ) -> Self {
        let (axes, origin) = (about.axes, points[0]);
        let local = |p: [f32; 3]| axes.map(|axis| dot(axis, sub(p, origin)));
        let mut own = [[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]];
        for p in points {
            include(&mut own, local(*p));
        }
        let reach = scratch.reach * GROWN;
        let mut hull = own;
        let mut horizon = 0.0_f32;
        for (p, radius) in &scratch.surroundings {
            let x = local(*p);
            let far = (0..3).map(|k| (own[0][k] - x[k]).max(x[k] - own[1][k]).max(0.0));
            let own_horizon = plan.horizon(*radius);
            let within = (own_horizon + reach) * GROWN;
            if far.map(|d| d * d).sum::<f32>() < within * within {
                include(&mut hull, x);
                horizon = horizon.max(own_horizon);
            }
        }
        #[expect(clippy::cast_possible_truncation, reason = "a constant")]
        let margin = BORDER as f32 * (plan.bandwidth(1.0) / plan.horizon(1.0)) * horizon * GROWN;
        let low = [0, 1, 2].map(|k| (hull[0][k] - margin).max(own[0][k] - reach));
        let high = [0, 1, 2].map(|k| (hull[1][k] + margin).min(own[1][k] + reach));
        Self { axes, origin, low, high, reach }
    }

    /// Begins to bound the leaf by its points' cells, fact 3, across the third axis, along which it is thin.
    pub(crate) fn cells(&self) -> Cells<'_> {
        Cells { leaf: self, low: [f32::INFINITY; 2], high: [f32::NEG_INFINITY; 2] }
    }

    /// The numbers of the leaf's points, those first that are furthest along some side: once their cells are known,
    /// most others cannot widen the bounds.
    pub(crate) fn outermost_first(&self, points: &[[f32; 3]]) -> impl Iterator<Item = usize> {
        let mut ends = [(f32::NEG_INFINITY, 0); 4];
        for (i, p) in points.iter().enumerate() {
            let d = sub(*p, self.origin);
            let (x, y) = (dot(d, self.axes[0]), dot(d, self.axes[1]));
            for (end, along) in ends.iter_mut().zip([x, -x, y, -y]) {
                if along > end.0 {
                    *end = (along, i);
                }
            }
        }
        let first = ends.map(|(_, i)| i);
        let is_new = move |k: usize| !first[..k].contains(&first[k]);
        let rest = (0..points.len()).filter(move |i| !first.contains(i));
        (0..4).filter(move |&k| is_new(k)).map(move |k| first[k]).chain(rest)
    }

    /// The box, not less than `bounds`, which has the same axes.
    fn enclosure(&self, bounds: &OrientedBox) -> OrientedBox {
        let at = self.axes.map(|axis| dot(axis, self.origin));
        let (low, high) = (self.low.map(|x| x * GROWN), self.high.map(|x| x * GROWN));
        let other = bounds.along(&self.axes);
        let low = [0, 1, 2].map(|k| (at[k] + low[k]).min(other[k][0]));
        let high = [0, 1, 2].map(|k| (at[k] + high[k]).max(other[k][1]));
        OrientedBox::spanned(self.axes, low, high, bounds.reach)
    }
}

/// The extents of the cells of a leaf's points in the plane of the leaf.
#[derive(Debug)]
pub(crate) struct Cells<'a> {
    leaf: &'a LeafBounds,
    low: [f32; 2],
    high: [f32; 2],
}

impl Cells<'_> {
    /// Includes the cell of the point `p` with this local radius and these neighbours.
    pub(crate) fn include(&mut self, p: [f32; 3], radius: f32, near: &Neighbourhood) {
        let LeafBounds { axes, origin, low, high, reach } = self.leaf;
        let [x, y, z] = axes.map(|axis| dot(axis, sub(p, *origin)));
        let full = [x, y].map(|c| [c - reach, c + reach]);
        if (0..2).all(|k| full[k][0] >= self.low[k] && full[k][1] <= self.high[k]) {
            return;
        }
        let bounds = sectors(axes, [low[2] - z, high[2] - z], NEIGHBOURS * radius, near);
        for (k, c) in [x, y].into_iter().enumerate() {
            let (mut least, mut most) = (0.0_f32, 0.0_f32);
            for (i, bound) in bounds.iter().enumerate() {
                let bound = bound.min(*reach);
                let ends = [RAYS[k][i], RAYS[k][(i + 1) % SECTORS]];
                least = least.min(bound * ends[0].min(ends[1]));
                most = most.max(bound * ends[0].max(ends[1]));
            }
            self.low[k] = self.low[k].min(c + least);
            self.high[k] = self.high[k].max(c + most);
        }
    }

    /// The bounds of the leaf with the cells of all its points included.
    pub(crate) fn close(self) -> LeafBounds {
        let mut leaf = *self.leaf;
        for k in 0..2 {
            leaf.low[k] = leaf.low[k].max(self.low[k]);
            leaf.high[k] = leaf.high[k].min(self.high[k]);
        }
        leaf
    }
}

/// How far a surface point nearest to a point can be from it in each sector of the plane of the first two axes, at
/// heights between these two along the third.
fn sectors(axes: &[[f32; 3]; 3], heights: [f32; 2], within: f32, near: &Neighbourhood) -> [f32; SECTORS] {
    // Per sector the greatest reciprocal of a bound.
    let mut closed = [0.0_f32; SECTORS];
    for q in near.offsets() {
        let d_sq = dot(q, q);
        if d_sq > within * within || d_sq <= 0.0 {
            continue;
        }
        // Fact 3: t·q ≤ ‖q‖²/2 − z·height for the part t of x − p in the plane and any height z.
        let height = dot(q, axes[2]);
        let c = 0.5 * d_sq + (-heights[0] * height).max(-heights[1] * height).max(0.0);
        let (x, y) = (dot(q, axes[0]) / c, dot(q, axes[1]) / c);
        let mut side = [0.0_f32; SECTORS];
        for k in 0..SECTORS {
            side[k] = x * RAYS[0][k] + y * RAYS[1][k];
        }
        // What holds at both rays of a sector holds between them.
        let mut next = [side[0]; SECTORS];
        next[..SECTORS - 1].copy_from_slice(&side[1..]);
        for k in 0..SECTORS {
            let least = if side[k] < next[k] { side[k] } else { next[k] };
            closed[k] = if closed[k] > least { closed[k] } else { least };
        }
    }
    closed.map(|c| GROWN / c)
}

fn include(bounds: &mut [[f32; 3]; 2], x: [f32; 3]) {
    for k in 0..3 {
        bounds[0][k] = bounds[0][k].min(x[k]);
        bounds[1][k] = bounds[1][k].max(x[k]);
    }
}

/// The enclosures of all nodes, given the bounds of the leaves in order and the boxes about the discs.
pub(crate) fn enclosures(nodes: &[Node], boxes: &[OrientedBox], leaves: &[LeafBounds]) -> Vec<OrientedBox> {
    let ids: Vec<u32> = (0..id32(nodes.len())).collect();
    let mut of_leaves = Vec::with_capacity(leaves.len());
    let leaf_boxes = nodes.iter().zip(boxes).filter(|(node, _)| node.is_leaf());
    of_leaves.extend(leaf_boxes.zip(leaves).map(|((_, bounds), leaf)| leaf.enclosure(bounds)));
    let leaf_size = nodes.iter().find(|node| node.is_leaf()).map_or(1, |leaf| leaf.count as usize);
    map(&ids, |&id| {
        let (node, bounds) = (&nodes[id as usize], &boxes[id as usize]);
        let range = node.first as usize / leaf_size..(node.first + node.count).div_ceil(id32(leaf_size)) as usize;
        if node.is_leaf() {
            return of_leaves[range.start];
        }
        let own = bounds.along(&bounds.axes);
        let (mut low, mut high) = (own.map(|side| side[0]), own.map(|side| side[1]));
        for leaf in &of_leaves[range] {
            let other = leaf.along(&bounds.axes);
            for k in 0..3 {
                low[k] = low[k].min(other[k][0]);
                high[k] = high[k].max(other[k][1]);
            }
        }
        OrientedBox::spanned(bounds.axes, low, high, bounds.reach)
    })
}
