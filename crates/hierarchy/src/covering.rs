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
use crate::topology::{MOST_LEAF_POINTS, Node};

/// What is known of a node's sample as a whole; lengths in stored units.
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
#[repr(C)]
pub struct Covering {
    /// The covering radius: balls of this radius about the samples contain the enclosures of all leaves under the node, and with them
    /// its part of the surface, its points and discs. Infinite where an enclosure is.
    pub radius: f32,
    /// r(P') of Klein & Zachmann 2004, Definition 4, measured on what shows of the surface to first order: each tangent
    /// disc of a point under the node, moved to the point's foot point, lies in a ball of this radius. At most [`radius`](Self::radius).
    pub sampling: f32,
    /// r(P): the root of the mean square of the local radii of all points under the node, for then the areas that
    /// eq. 10 equates are the sums of the points' own.
    pub spacing: f32,
}

/// Test points that the radius is grown with are the corners of so many random leaves' enclosures.
const LEAVES_TRIED: usize = 4;

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

/// Places side by side; where there are fewer than lanes, places infinitely far away.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Centres {
    blocks: [[[f32; WIDTH]; 3]; MOST_LEAF_POINTS / WIDTH],
    len: usize,
}

impl Default for Centres {
    fn default() -> Self {
        Self { blocks: [[[f32::INFINITY; WIDTH]; 3]; MOST_LEAF_POINTS / WIDTH], len: 0 }
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
            lanes[lane] = x;
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

    /// The same for several places side by side.
    #[inline]
    fn each_nearest_sq<const N: usize>(&self, [px, py, pz]: &[[f32; N]; 3]) -> [f32; N] {
        let mut least = [f32::INFINITY; N];
        for [x, y, z] in self.iter() {
            for i in 0..N {
                let d = [x - px[i], y - py[i], z - pz[i]];
                let d_sq = dot(d, d);
                least[i] = if d_sq < least[i] { d_sq } else { least[i] };
            }
        }
        least
    }

    /// The square of the least radius at which one ball alone contains the box; infinite if anything is no number.
    #[inline]
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

    /// For each disc the square of the least radius at which one ball alone contains it.
    #[inline]
    fn each_far_sq(&self, discs: &Discs) -> [f32; WIDTH] {
        let Discs { foot: [px, py, pz], normal: [nx, ny, nz], radius } = discs;
        let mut least = [f32::INFINITY; WIDTH];
        for [x, y, z] in self.iter() {
            for i in 0..WIDTH {
                let d = [x - px[i], y - py[i], z - pz[i]];
                let height = dot(d, [nx[i], ny[i], nz[i]]);
                let across_sq = dot(d, d) - height * height;
                let across = if across_sq > 0.0 { across_sq } else { 0.0 }.sqrt() + radius[i];
                let d_sq = height * height + across * across;
                least[i] = if d_sq < least[i] { d_sq } else { least[i] };
            }
        }
        least
    }

    /// As seen from the box: relative to its centre, along its axes.
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

    /// As [`Self::far_sq`], of the box between `middle` ± `half`.
    #[inline]
    fn far_part_sq(&self, middle: [f32; 3], half: [f32; 3]) -> f32 {
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
    let less = |a: f32, b: f32| if a < b { a } else { b };
    let mut four = [0.0; WIDTH / 2];
    for i in 0..WIDTH / 2 {
        four[i] = less(lanes[i], lanes[i + WIDTH / 2]);
    }
    less(less(four[0], four[2]), less(four[1], four[3]))
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
        self.descend(
            node,
            &mut radius,
            |id| centres.far_sq(&self.enclosure(id)),
            Radius::admits,
            |radius, leaf| {
                let bounds = self.enclosure(leaf);
                radius.test(centres, &bounds);
                radius.cover(&centres.along(&bounds), bounds.half);
            },
        );
        radius.certified.sqrt() * GROWN + LOST
    }

    /// A radius at which each disc of a point under `node`, moved to its foot point, lies in one of the balls about
    /// `centres`: the least. `lifts` are the squares of the furthest ways to a foot point.
    fn sampling_radius(&self, node: usize, centres: &Centres, lifts: &[f32]) -> f32 {
        let mut radius_sq = 0.0_f32;
        self.descend(
            node,
            &mut radius_sq,
            |id| (centres.far_sq(&self.boxes[id]).sqrt() + lifts[id].sqrt()).powi(2),
            |radius_sq, far_sq| far_sq <= *radius_sq,
            |radius_sq, leaf| {
                let points = self.nodes[leaf].points();
                for start in points.clone().step_by(WIDTH) {
                    let far_sq = centres.each_far_sq(&self.discs(start, points.end));
                    *radius_sq = far_sq.iter().fold(*radius_sq, |m, &d_sq| m.max(d_sq));
                }
            },
        );
        radius_sq.sqrt()
    }

    /// Visits those leaves under `node` with whose greatest distance, by `far_sq`, `admits` is not content, nor with that of any
    /// node above; of two children the further first, so that little is left to visit.
    fn descend<T>(
        &self,
        node: usize,
        state: &mut T,
        far_sq: impl Fn(usize) -> f32,
        admits: impl Fn(&mut T, f32) -> bool,
        mut visit: impl FnMut(&mut T, usize),
    ) {
        let mut stack = [(0_u32, 0.0_f32); TREE_STACK];
        stack[0] = (id32(node), far_sq(node));
        let mut top = 1;
        while top > 0 {
            top -= 1;
            let (id, far) = stack[top];
            let id = id as usize;
            if admits(state, far) {
                continue;
            }
            if self.nodes[id].is_leaf() {
                visit(state, id);
                continue;
            }
            let [left, right] =
                [id + 1, self.nodes[id].right as usize].map(|child| (id32(child), far_sq(child)));
            let (near, far) = if left.1 > right.1 { (right, left) } else { (left, right) };
            stack[top] = near;
            stack[top + 1] = far;
            top += 2;
        }
    }

    /// The discs from that of point `start` on, moved to their foot points; if there are too few, the last again.
    #[inline]
    fn discs(&self, start: usize, end: usize) -> Discs {
        let mut discs = Discs { foot: [[0.0; WIDTH]; 3], normal: [[0.0; WIDTH]; 3], radius: [0.0; WIDTH] };
        for lane in 0..WIDTH {
            let i = (start + lane).min(end - 1);
            for k in 0..3 {
                discs.foot[k][lane] = self.feet[i][k];
                discs.normal[k][lane] = self.normals[i][k];
            }
            discs.radius[lane] = self.discs[i];
        }
        discs
    }
}

/// Discs side by side.
struct Discs {
    foot: [[f32; WIDTH]; 3],
    normal: [[f32; WIDTH]; 3],
    radius: [f32; WIDTH],
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
        let edge = |k: usize| bounds.axes[k].map(|x| x * bounds.half[k]);
        let [u, v, w] = [edge(0), edge(1), edge(2)];
        let corners = [0, 1, 2].map(|k| {
            let (a, b) = (bounds.centre[k] - w[k], bounds.centre[k] + w[k]);
            let (c, d) = (u[k] + v[k], u[k] - v[k]);
            [a + c, a - c, a + d, a - d, b + c, b - c, b + d, b - d]
        });
        let away = centres.each_nearest_sq(&corners);
        self.tested = away.iter().fold(self.tested, |m, &d_sq| if d_sq > m { d_sq } else { m });
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
            let far_sq = centres.far_part_sq(middle, half);
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
