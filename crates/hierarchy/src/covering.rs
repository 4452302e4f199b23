//! Sphere coverings: the radius at which balls about a node's samples contain its part of the surface.
//!
//! Klein & Zachmann 2004, §4.2.2, let the radius grow with random test points and stop when enough of them are
//! inside; what no test point found stays outside. Here test points only say how far the radius has to grow at
//! least. What it is then follows from boxes: every enclosure of a leaf under the node is divided until each part lies
//! in one of the balls, far corner and all, or the radius grows to it (docs/theory/coverings.md).

use bytemuck::{Pod, Zeroable};

use crate::boxes::{OrientedBox, dot, sub};
use crate::gather::TREE_STACK;
use crate::growth::Growth;
use crate::samples::{Random, Samples};
use crate::spacing::{fold_nodes, map};
use crate::split::id32;
use crate::surfels::tangents;
use crate::topology::{MOST_LEAF_POINTS, Node};

/// What is known of a node's sample as a whole; lengths in stored units.
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
#[repr(C)]
pub struct Covering {
    /// The covering radius: balls of this radius about the samples contain the enclosures of all leaves under the node, and with them
    /// its part of the surface, its points and discs. Infinite where an enclosure is.
    pub radius: f32,
    /// r(P') of Klein & Zachmann 2004, Definition 4: balls of this radius cover the surface, as far as tangent discs
    /// show it. At most [`radius`](Self::radius).
    pub sampling: f32,
    /// r(P): the root of the mean square of the local radii of all points under the node, for then the areas that
    /// eq. 10 equates are the sums of the points' own.
    pub spacing: f32,
}

/// Test points that the radius is grown with are the corners of so many random leaves' enclosures.
const LEAVES_TRIED: usize = 8;

/// A radius larger than a test point asks for by this factor needs no closer look.
const LAX: f32 = 1.05;

/// How often a leaf's enclosure is halved at most.
const HALVINGS: usize = 7;

/// What single precision may cost here, relatively: some dozens of roundings in sums and products of lengths, none of
/// which cancel.
const GROWN: f32 = 1.0 + 1e-5;

/// What squares may lose below the least normal number, as a length.
const LOST: f32 = 1e-20;

/// Samples that are worked on together.
pub(crate) const WIDTH: usize = 8;

/// Places side by side; where there are fewer than lanes, one of them again.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Centres {
    blocks: [[[f32; WIDTH]; 3]; MOST_LEAF_POINTS / WIDTH],
    len: usize,
}

impl Default for Centres {
    fn default() -> Self {
        Self { blocks: [[[0.0; WIDTH]; 3]; MOST_LEAF_POINTS / WIDTH], len: 0 }
    }
}

impl Centres {
    pub(crate) fn of(samples: Samples<'_>, positions: &[[f32; 3]]) -> Self {
        let mut centres = Self::default();
        for i in samples.iter() {
            centres.push(positions[i]);
        }
        centres
    }

    /// Adds a place; there must be room.
    #[inline]
    pub(crate) fn push(&mut self, p: [f32; 3]) {
        let (block, lane) = (self.len / WIDTH, self.len % WIDTH);
        for (lanes, x) in self.blocks[block].iter_mut().zip(p) {
            lanes[lane..].fill(x);
        }
        self.len += 1;
    }

    #[inline]
    pub(crate) fn len(&self) -> usize {
        self.len
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = [f32; 3]> {
        (0..self.len).map(|i| {
            let [x, y, z] = &self.blocks[i / WIDTH];
            [x[i % WIDTH], y[i % WIDTH], z[i % WIDTH]]
        })
    }

    #[inline]
    fn blocks(&self) -> &[[[f32; WIDTH]; 3]] {
        &self.blocks[..self.len.div_ceil(WIDTH)]
    }

    /// The squared distance of the nearest; infinite if there is none.
    #[inline]
    pub(crate) fn nearest_sq(&self, p: [f32; 3]) -> f32 {
        let mut least = [f32::INFINITY; WIDTH];
        for [x, y, z] in self.blocks() {
            for i in 0..WIDTH {
                let d = [x[i] - p[0], y[i] - p[1], z[i] - p[2]];
                let d_sq = dot(d, d);
                least[i] = if d_sq < least[i] { d_sq } else { least[i] };
            }
        }
        fold_min(&least)
    }

    /// As seen from the box: relative to its centre, along its axes.
    #[inline]
    fn along(&self, bounds: &OrientedBox) -> Self {
        let mut turned = Self { len: self.len, ..Self::default() };
        let c = bounds.centre;
        for ([x, y, z], to) in self.blocks().iter().zip(&mut turned.blocks) {
            for (axis, to) in bounds.axes.iter().zip(to) {
                for i in 0..WIDTH {
                    to[i] = dot([x[i] - c[0], y[i] - c[1], z[i] - c[2]], *axis);
                }
            }
        }
        turned
    }

    /// The square of the least radius at which one ball alone contains the box between `middle` ± `half`; infinite
    /// if anything is no number.
    #[inline]
    fn far_sq(&self, middle: [f32; 3], half: [f32; 3]) -> f32 {
        let mut least = [f32::INFINITY; WIDTH];
        for [x, y, z] in self.blocks() {
            for i in 0..WIDTH {
                let d = [
                    (x[i] - middle[0]).abs() + half[0],
                    (y[i] - middle[1]).abs() + half[1],
                    (z[i] - middle[2]).abs() + half[2],
                ];
                let d_sq = dot(d, d);
                least[i] = if d_sq < least[i] { d_sq } else { least[i] };
            }
        }
        fold_min(&least)
    }
}

#[inline]
fn fold_min(lanes: &[f32; WIDTH]) -> f32 {
    lanes.iter().fold(f32::INFINITY, |m, &x| if x < m { x } else { m })
}

/// What coverings are measured against.
#[derive(Clone, Copy)]
pub(crate) struct Ground<'a> {
    pub(crate) nodes: &'a [Node],
    pub(crate) boxes: &'a [OrientedBox],
    pub(crate) growths: &'a [Growth],
    pub(crate) positions: &'a [[f32; 3]],
    pub(crate) normals: &'a [[f32; 3]],
    pub(crate) discs: &'a [f32],
    pub(crate) radii: &'a [f32],
    /// The foot points of the points on the surface, to first order.
    pub(crate) feet: &'a [[f32; 3]],
}

/// The coverings of all nodes with these samples.
pub(crate) fn coverings<'a>(
    ground: &Ground<'_>,
    samples: impl Fn(usize) -> Samples<'a> + Sync + Send,
) -> Vec<Covering> {
    let Ground { nodes, positions, feet, radii, .. } = *ground;
    let lift = |i: usize| {
        let d = sub(feet[i], positions[i]);
        dot(d, d)
    };
    let lifts = fold_nodes(nodes, |range| range.map(lift).fold(0.0, f32::max), f32::max);
    let squares = fold_nodes(
        nodes,
        |range| radii[range].iter().map(|&r| f64::from(r) * f64::from(r)).sum(),
        |a: f64, b| a + b,
    );
    let ids: Vec<u32> = (0..id32(nodes.len())).collect();
    map(&ids, |&id| {
        let node = id as usize;
        let centres = Centres::of(samples(node), positions);
        let radius = ground.covering_radius(node, &centres);
        #[expect(clippy::cast_possible_truncation, reason = "stored in single precision")]
        let spacing = (squares[node] / f64::from(nodes[node].count)).sqrt() as f32;
        Covering { radius, sampling: ground.sampling_radius(node, &centres, &lifts).min(radius), spacing }
    })
}

impl Ground<'_> {
    fn enclosure(&self, node: usize) -> OrientedBox {
        self.growths[node].of(&self.boxes[node])
    }

    /// The leaf of the point that is `share` of 2³² of the way through the points of `node`, by its id.
    fn leaf(&self, mut node: usize, share: u64) -> usize {
        let Node { first, count, .. } = self.nodes[node];
        let wanted = first + id32(((share * u64::from(count)) >> 32) as usize);
        while !self.nodes[node].is_leaf() {
            let right = self.nodes[node].right as usize;
            node = if wanted < self.nodes[right].first { node + 1 } else { right };
        }
        node
    }

    /// A radius at which balls about `centres` contain the enclosures of all leaves under `node`.
    fn covering_radius(&self, node: usize, centres: &Centres) -> f32 {
        let mut radius = Radius { tested: 0.0, certified: 0.0 };
        if !self.nodes[node].is_leaf() {
            let mut random = Random::new(id32(node));
            for _ in 0..LEAVES_TRIED {
                radius.test(centres, &self.enclosure(self.leaf(node, random.next() >> 32)));
            }
        }
        let mut stack = [0_u32; TREE_STACK];
        stack[0] = id32(node);
        let mut top = 1;
        while top > 0 {
            top -= 1;
            let id = stack[top] as usize;
            let bounds = self.enclosure(id);
            let seen = centres.along(&bounds);
            if radius.admits(seen.far_sq([0.0; 3], bounds.half)) {
                continue;
            }
            if self.nodes[id].is_leaf() {
                radius.test(centres, &bounds);
                radius.cover(&seen, bounds.half);
            } else {
                stack[top] = self.nodes[id].right;
                stack[top + 1] = id32(id) + 1;
                top += 2;
            }
        }
        radius.certified.sqrt() * GROWN + LOST
    }

    /// A radius at which balls about `centres` cover the discs, moved to the foot points, of all points under `node`,
    /// as far as four points on the rim of each show. `lifts` are the squares of the furthest ways to a foot point.
    fn sampling_radius(&self, node: usize, centres: &Centres, lifts: &[f32]) -> f32 {
        let mut radius = 0.0_f32;
        let mut stack = [0_u32; TREE_STACK];
        stack[0] = id32(node);
        let mut top = 1;
        while top > 0 {
            top -= 1;
            let id = stack[top] as usize;
            let bounds = &self.boxes[id];
            let far = centres.along(bounds).far_sq([0.0; 3], bounds.half).sqrt() + lifts[id].sqrt();
            if far <= radius {
                continue;
            }
            let children = &self.nodes[id];
            if !children.is_leaf() {
                stack[top] = children.right;
                stack[top + 1] = id32(id) + 1;
                top += 2;
                continue;
            }
            for i in children.points() {
                let (foot, disc) = (self.feet[i], self.discs[i]);
                if centres.nearest_sq(foot).sqrt() + disc <= radius {
                    continue;
                }
                let (u, v) = tangents(self.normals[i]);
                for (axis, length) in [(u, disc), (u, -disc), (v, disc), (v, -disc)] {
                    let rim = [0, 1, 2].map(|k| foot[k] + length * axis[k]);
                    radius = radius.max(centres.nearest_sq(rim).sqrt());
                }
            }
        }
        radius
    }
}

/// Squares of radii.
struct Radius {
    /// Some point of an enclosure is so far from all centres.
    tested: f32,
    /// All that was looked at is in balls of this radius.
    certified: f32,
}

impl Radius {
    /// Tests the corners of a box.
    fn test(&mut self, centres: &Centres, bounds: &OrientedBox) {
        let [hx, hy, hz] = bounds.half;
        let [ux, uy, uz] = bounds.axes;
        for (x, y, z) in CORNERS {
            let p = [0, 1, 2].map(|k| bounds.centre[k] + x * hx * ux[k] + y * hy * uy[k] + z * hz * uz[k]);
            let d_sq = centres.nearest_sq(p);
            self.tested = if d_sq > self.tested { d_sq } else { self.tested };
        }
    }

    /// Whether a ball of this squared radius is within what may be certified without a closer look; then it is.
    fn admits(&mut self, far_sq: f32) -> bool {
        let is_small = far_sq <= self.certified.max(LAX * LAX * self.tested);
        if is_small {
            self.certified = self.certified.max(far_sq);
        }
        is_small
    }

    /// Certifies a box about the origin with these half edge lengths, along whose axes the `centres` are seen.
    fn cover(&mut self, centres: &Centres, half: [f32; 3]) {
        let mut stack = [([0.0_f32; 3], half, 0); HALVINGS + 1];
        let mut top = 1;
        while top > 0 {
            top -= 1;
            let (middle, mut half, depth) = stack[top];
            let far_sq = centres.far_sq(middle, half);
            if self.admits(far_sq) {
                continue;
            }
            if depth == HALVINGS {
                self.certified = far_sq;
                continue;
            }
            let longest = (0..3).fold(0, |m, k| if half[k] > half[m] { k } else { m });
            half[longest] *= 0.5;
            for side in [-half[longest], half[longest]] {
                let mut middle = middle;
                middle[longest] += side;
                stack[top] = (middle, half, depth + 1);
                top += 1;
            }
        }
    }
}

/// The signs of a box' corners.
const CORNERS: [(f32, f32, f32); 8] = [
    (-1.0, -1.0, -1.0),
    (-1.0, -1.0, 1.0),
    (-1.0, 1.0, -1.0),
    (-1.0, 1.0, 1.0),
    (1.0, -1.0, -1.0),
    (1.0, -1.0, 1.0),
    (1.0, 1.0, -1.0),
    (1.0, 1.0, 1.0),
];
