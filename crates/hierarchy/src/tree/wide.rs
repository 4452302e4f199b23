//! The tree as it is stored and read: the boxes of siblings side by side, with their growths in a
//! separate array.

use bytemuck::{Pod, Zeroable};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x4, f32x16, u32x4};
use nearmiss_geometry::NodeId;
use nearmiss_lanes::id32;
use nearmiss_lanes::parallel::fill;
use nearmiss_lanes::wide::{cross, product};
use nearmiss_store::{Room, WorkError, Workspace};
use serde::{Deserialize, Serialize};

use crate::bounds::boxes::{OrientedBox, frame};
use crate::bounds::growth::Growth;
use crate::bounds::lanes::Boxes;
use crate::bounds::part::Part;
use crate::tree::topology::{Children, FAN, Grandchildren, NodePair, Topology};

/// The number of pairs of children of two nodes, and of grandchildren of one.
pub(crate) const LANES: usize = FAN * FAN;

/// One number for each of four siblings.
pub(crate) type Lanes = [f32; FAN];

/// The boxes of up to four children. Unused lanes are zero. Three cache lines.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C, align(64))]
pub struct Siblings {
    pub(crate) centre: [Lanes; 3],
    pub(crate) half: [Lanes; 3],
    /// The first two axes. The third one is their product.
    pub(crate) axes: [[Lanes; 3]; 2],
}

impl Siblings {
    pub(crate) const NONE: Self =
        Self { centre: [[0.0; FAN]; 3], half: [[0.0; FAN]; 3], axes: [[[0.0; FAN]; 3]; 2] };

    /// Sets the box in a lane. Its greatest radius is not stored here.
    pub(crate) fn set(&mut self, lane: usize, bounds: &OrientedBox) {
        for k in 0..3 {
            self.centre[k][lane] = bounds.centre[k];
            self.half[k][lane] = bounds.half[k];
            for (axis, rows) in bounds.axes.iter().zip(&mut self.axes) {
                rows[k][lane] = axis[k];
            }
        }
    }

    /// Returns the box in a lane, given the greatest radius in it.
    #[inline]
    pub(crate) fn get(&self, lane: usize, reach: f32) -> OrientedBox {
        let of = |rows: &[Lanes; 3]| [rows[0][lane], rows[1][lane], rows[2][lane]];
        let axes = frame([of(&self.axes[0]), of(&self.axes[1])]);
        OrientedBox { centre: of(&self.centre), half: of(&self.half), axes, reach }
    }

    /// Returns the four boxes in lanes.
    #[inline(always)]
    pub(crate) fn boxes<S: Simd>(&self, simd: S) -> Boxes<f32x4<S>> {
        let [u, v] = &self.axes;
        let (u, v) = (rows(simd, u), rows(simd, v));
        Boxes { centre: rows(simd, &self.centre), half: rows(simd, &self.half), axes: [u, v, cross(u, v)] }
    }

    /// Returns the squared distance of a position from each of the four boxes.
    #[inline(always)]
    pub(crate) fn distances_sq<S: Simd>(&self, simd: S, [x, y, z]: [f32; 3]) -> f32x4<S> {
        let Boxes { centre: [cx, cy, cz], half, axes } = self.boxes(simd);
        let d = [-(cx - x), -(cy - y), -(cz - z)];
        let mut sum = f32x4::splat(simd, 0.0);
        for k in 0..3 {
            let beyond = (product(axes[k], d).abs() - half[k]).max(0.0);
            sum += beyond * beyond;
        }
        sum
    }
}

/// The growths of up to four children, sixteen bits for each length.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Pod, Zeroable)]
#[repr(C, align(16))]
pub struct Growths(pub(crate) [[u32; FAN]; 3]);

impl Growths {
    fn set(&mut self, lane: usize, growth: &Growth) {
        for (row, pair) in self.0.iter_mut().zip(growth.pairs()) {
            row[lane] = pair;
        }
    }

    #[inline]
    pub(crate) fn get(&self, lane: usize) -> Growth {
        Growth::from_pairs([self.0[0][lane], self.0[1][lane], self.0[2][lane]])
    }
}

/// The box of the root, which has no siblings, and its growths by [`Part`].
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Root {
    pub(crate) bounds: OrientedBox,
    pub(crate) growths: [Growth; 2],
}

/// The nodes over the points of a scan, and their bounding boxes.
#[derive(Debug, Clone, Copy)]
pub struct Tree<'a> {
    pub(crate) topology: &'a Topology,
    pub(crate) root: &'a Root,
    /// The boxes of the children of each inner node.
    pub(crate) siblings: &'a [Siblings],
    /// The greatest local radius of the points in the same boxes. Without entries, zero.
    pub(crate) reaches: &'a [Lanes],
    /// The growths of the same children, by [`Part`]. Without entries, enclosures are the boxes.
    pub(crate) growths: [&'a [Growths]; 2],
}

impl<'a> Tree<'a> {
    /// Returns a tree whose boxes are not known: for searches that use none.
    pub(crate) fn without_boxes(topology: &'a Topology) -> Self {
        const NONE: &Root = &Root { bounds: OrientedBox::NONE, growths: [Growth::NONE; 2] };
        Self { topology, root: NONE, siblings: &[], reaches: &[], growths: [&[]; 2] }
    }

    /// Returns the topology of the tree: its nodes and the points under each.
    #[inline]
    #[must_use]
    pub fn topology(&self) -> &'a Topology {
        self.topology
    }

    /// Returns the box of the root.
    #[inline]
    #[must_use]
    pub fn root_box(&self) -> &'a OrientedBox {
        &self.root.bounds
    }

    /// Returns the box around the discs and balls of a node's points, or around its triangles.
    ///
    /// # Panics
    /// If there is no such node. The same holds for the other methods.
    #[inline]
    #[must_use]
    pub fn bounds(&self, id: NodeId) -> OrientedBox {
        match self.topology.parent(id) {
            Some((parent, lane)) => self.siblings[parent.index()].get(lane, self.reaches_below(parent)[lane]),
            None => self.root.bounds,
        }
    }

    /// Returns the growth that makes the box of a node contain this part of it.
    #[inline]
    pub(crate) fn growth(&self, part: Part, id: NodeId) -> Growth {
        match self.topology.parent(id) {
            Some((parent, lane)) => self.growths_below(part, parent.index()).get(lane),
            None => self.root.growths[part as usize],
        }
    }

    /// Returns the growths of the children of an inner node.
    #[inline(always)]
    fn growths_below(&self, part: Part, of: usize) -> &Growths {
        const NONE: Growths = Growths([[0; FAN]; 3]);
        self.growths[part as usize].get(of).unwrap_or(&NONE)
    }

    /// Returns a box that provably contains a node's part of the surface or of the obstacle
    /// (`docs/theory/certificates.md`, `docs/theory/obstacle.md`). It has the axes of the node's
    /// [box](Self::bounds), and contains it.
    #[inline]
    #[must_use]
    pub fn enclosure(&self, part: Part, id: NodeId) -> OrientedBox {
        self.growth(part, id).of(&self.bounds(id))
    }

    /// Returns an eighth of the sum of the surface areas of all boxes, to which the cost of a
    /// traversal is proportional by the surface area heuristic (Goldsmith & Salmon 1987). O(n).
    pub(crate) fn area(&self) -> f64 {
        let area = |[x, y, z]: [f32; 3]| {
            let [x, y, z] = [x, y, z].map(f64::from);
            x * y + y * z + z * x
        };
        let of_children = |siblings: &Siblings| {
            let [x, y, z] = &siblings.half;
            (0..FAN).map(|lane| area([x[lane], y[lane], z[lane]])).sum::<f64>()
        };
        area(self.root.bounds.half) + self.siblings.iter().map(of_children).sum::<f64>()
    }

    /// Returns the greatest local radius of the points under a node.
    #[inline]
    #[must_use]
    pub fn reach(&self, id: NodeId) -> f32 {
        match self.topology.parent(id) {
            Some((parent, lane)) => self.reaches_below(parent)[lane],
            None => self.root.bounds.reach,
        }
    }

    /// Returns the greatest local radius of the points under each child of an inner node.
    #[inline(always)]
    pub(crate) fn reaches_below(&self, id: NodeId) -> &Lanes {
        self.reaches.get(id.index()).unwrap_or(&[0.0; FAN])
    }

    /// Returns half the length of the longest child of an inner node.
    #[inline(always)]
    fn longest_below(&self, id: NodeId) -> f32 {
        let [a, b, c, d] = self.siblings[id.index()].half[0];
        let greater = |a: f32, b: f32| if a > b { a } else { b };
        // Unused lanes are zero.
        greater(greater(a, b), greater(c, d))
    }

    /// Returns the box and the enclosure of this part of a node.
    #[inline(always)]
    #[must_use]
    pub fn bounds_of(&self, part: Part, id: NodeId) -> NodeBounds<f32> {
        let OrientedBox { centre, half, axes, .. } = self.bounds(id);
        let (low, high) = self.growth(part, id).lengths();
        NodeBounds { centre, half, axes, low, high }
    }

    /// Returns the boxes of the children of an inner node. Unused lanes are zero.
    ///
    /// # Panics
    /// If the node is not an inner node. The same holds for the next two methods.
    #[inline(always)]
    #[must_use]
    pub fn boxes_of_children<S: Simd>(&self, simd: S, id: NodeId) -> Boxes<f32x4<S>> {
        self.siblings[id.index()].boxes(simd)
    }

    /// Returns the boxes and enclosures of the children of an inner node. Unused lanes are
    /// unspecified.
    #[inline(always)]
    #[must_use]
    pub fn bounds_of_children<S: Simd>(&self, simd: S, part: Part, id: NodeId) -> NodeBounds<f32x4<S>> {
        self.siblings(simd, part, id.index())
    }

    /// Returns the boxes and enclosures of the grandchildren of a node, in the same order. Unused
    /// lanes are unspecified.
    #[inline(always)]
    #[must_use]
    pub fn bounds_of_grandchildren<S: Simd>(
        &self,
        simd: S,
        part: Part,
        of: &Grandchildren,
    ) -> NodeBounds<f32x16<S>> {
        let [a, b, c, d] = of.parents;
        let a = self.siblings(simd, part, a.index());
        let b = self.siblings(simd, part, b.index());
        let c = self.siblings(simd, part, c.index());
        let d = self.siblings(simd, part, d.index());
        NodeBounds {
            centre: combined([a.centre, b.centre, c.centre, d.centre]),
            half: combined([a.half, b.half, c.half, d.half]),
            axes: [
                combined([a.axes[0], b.axes[0], c.axes[0], d.axes[0]]),
                combined([a.axes[1], b.axes[1], c.axes[1], d.axes[1]]),
                combined([a.axes[2], b.axes[2], c.axes[2], d.axes[2]]),
            ],
            low: combined([a.low, b.low, c.low, d.low]),
            high: combined([a.high, b.high, c.high, d.high]),
        }
    }

    #[inline(always)]
    fn siblings<S: Simd>(&self, simd: S, part: Part, of: usize) -> NodeBounds<f32x4<S>> {
        let Boxes { centre, half, axes } = self.siblings[of].boxes(simd);
        let Growths([first, second, third]) = self.growths_below(part, of);
        let ((lx, ly), (lz, gx), (gy, gz)) = (halves(simd, first), halves(simd, second), halves(simd, third));
        NodeBounds { centre, half, axes, low: [lx, ly, lz], high: [gx, gy, gz] }
    }
}

/// Returns the lanes of some children, as bits.
#[inline(always)]
pub(crate) fn lanes_of(children: Children) -> u32 {
    (1 << children.len()) - 1
}

/// Returns which nodes of a pair, not both of them leaves, are not split: leaves, and a node less
/// than half as long as the other. `leaves` tells which nodes are leaves; `scale` converts lengths
/// of b to a's frame.
///
/// # Panics
/// If there are no such nodes.
#[inline]
#[must_use]
pub fn whole([a, b]: [&Tree<'_>; 2], pair: NodePair, leaves: [bool; 2], scale: f32) -> [bool; 2] {
    if leaves != [false; 2] {
        return leaves;
    }
    let (a, b) = (a.longest_below(pair.a), b.longest_below(pair.b) * scale);
    // With infinite or NaN lengths both nodes are split.
    let (long_a, long_b) = (a > 2.0 * b, b > 2.0 * a);
    [long_b && !long_a, long_a && !long_b]
}

// Functions instead of closures: those may be compiled separately, without the instruction set of
// their caller.

/// Loads four vectors from their coordinates.
#[inline(always)]
pub(crate) fn rows<S: Simd>(simd: S, [x, y, z]: &[Lanes; 3]) -> [f32x4<S>; 3] {
    [f32x4::load_array_ref(simd, x), f32x4::load_array_ref(simd, y), f32x4::load_array_ref(simd, z)]
}

/// Splits four packed pairs of halves into the lengths of the lower and of the upper halves.
#[inline(always)]
fn halves<S: Simd>(simd: S, both: &[u32; FAN]) -> (f32x4<S>, f32x4<S>) {
    let both = u32x4::load_array_ref(simd, both);
    ((both << 16).bitcast(), (both & 0xffff_0000).bitcast())
}

/// The box and the enclosure of a node if `V` is `f32`; of several nodes, one in each lane, if it
/// is a vector.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NodeBounds<V> {
    /// The centres of the boxes.
    pub centre: [V; 3],
    /// Half their edge lengths.
    pub half: [V; 3],
    /// Unit directions of the edges.
    pub axes: [[V; 3]; 3],
    /// The lengths by which the enclosures exceed the boxes against the axes; infinite if
    /// unbounded.
    pub low: [V; 3],
    /// The lengths by which the enclosures exceed the boxes along the axes; infinite if unbounded.
    pub high: [V; 3],
}

impl<V: Copy> NodeBounds<V> {
    /// Returns the same bounds with each number replaced.
    #[inline(always)]
    #[must_use]
    pub fn map<W>(&self, replaced: impl Fn(V) -> W) -> NodeBounds<W> {
        let [u, v, w] = self.axes;
        NodeBounds {
            centre: each(self.centre, &replaced),
            half: each(self.half, &replaced),
            axes: [each(u, &replaced), each(v, &replaced), each(w, &replaced)],
            low: each(self.low, &replaced),
            high: each(self.high, &replaced),
        }
    }
}

#[inline(always)]
fn each<V, W>([x, y, z]: [V; 3], replaced: &impl Fn(V) -> W) -> [W; 3] {
    [replaced(x), replaced(y), replaced(z)]
}

impl<S: Simd> NodeBounds<f32x4<S>> {
    /// Returns the squared distances of a position from the enclosures.
    #[inline(always)]
    #[must_use]
    pub fn distances_sq(&self, simd: S, [x, y, z]: [f32; 3]) -> f32x4<S> {
        let d = [self.centre[0] - x, self.centre[1] - y, self.centre[2] - z];
        let mut sum = f32x4::splat(simd, 0.0);
        for k in 0..3 {
            let (at, half) = (product(self.axes[k], d), self.half[k]);
            let beyond = (at - half - self.low[k]).max(-at - half - self.high[k]).max(0.0);
            sum += beyond * beyond;
        }
        sum
    }
}

/// Concatenates the lanes of four vectors.
#[inline(always)]
fn combined<S: Simd>([a, b, c, d]: [[f32x4<S>; 3]; FAN]) -> [f32x16<S>; 3] {
    [
        a[0].combine(b[0]).combine(c[0].combine(d[0])),
        a[1].combine(b[1]).combine(c[1].combine(d[1])),
        a[2].combine(b[2]).combine(c[2].combine(d[2])),
    ]
}

/// The tree during a build: boxes without growths.
pub(crate) struct Bare {
    topology: Topology,
    root: Root,
    siblings: Room<Siblings>,
    reaches: Room<Lanes>,
}

impl Bare {
    /// Creates a tree with the boxes of all nodes, in the order of their ids.
    pub(crate) fn new(
        work: &Workspace,
        topology: Topology,
        boxes: &[OrientedBox],
    ) -> Result<Self, WorkError> {
        let root = Root { bounds: boxes[NodeId::ROOT.index()], growths: [Growth::default(); 2] };
        let mut room = work.room(topology.inner())?;
        siblings(&topology, boxes, &mut room);
        let mut greatest = work.room(topology.inner())?;
        reaches(&topology, boxes, &mut greatest);
        Ok(Self { topology, root, siblings: room, reaches: greatest })
    }

    pub(crate) fn tree(&self) -> Tree<'_> {
        Tree {
            topology: &self.topology,
            root: &self.root,
            siblings: &self.siblings,
            reaches: &self.reaches,
            growths: [&[]; 2],
        }
    }
}

/// Rearranges the boxes of all nodes, in the order of their ids, into those of siblings.
pub(crate) fn siblings(topology: &Topology, boxes: &[OrientedBox], out: &mut [Siblings]) {
    fill(out, |i| {
        let mut siblings = Siblings::NONE;
        for (lane, id) in topology.children(NodeId(id32(i))).iter().enumerate() {
            siblings.set(lane, &boxes[id.index()]);
        }
        siblings
    });
}

/// Rearranges the greatest radii in the boxes of all nodes, in the order of their ids, into those of
/// siblings.
pub(crate) fn reaches(topology: &Topology, boxes: &[OrientedBox], out: &mut [Lanes]) {
    fill(out, |i| {
        let mut reaches = [0.0; FAN];
        for (reach, id) in reaches.iter_mut().zip(topology.children(NodeId(id32(i))).iter()) {
            *reach = boxes[id.index()].reach;
        }
        reaches
    });
}

/// Rearranges the growths of all nodes, given by the index of their ids, into those of siblings.
pub(crate) fn growths_of_siblings(
    topology: &Topology,
    growth: impl Fn(usize) -> Growth + Sync + Send,
    out: &mut [Growths],
) {
    fill(out, |i| {
        let mut siblings = Growths::default();
        for (lane, id) in topology.children(NodeId(id32(i))).iter().enumerate() {
            siblings.set(lane, &growth(id.index()));
        }
        siblings
    });
}
