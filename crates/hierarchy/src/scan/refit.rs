//! Moves the points of a prepared scan: carries discs along, and fits some anew.

use fearless_simd::{Level, Simd, dispatch};
use nearmiss_geometry::{Aabb, Frame};
use nearmiss_index::{BlockBoxes, PointBlock};
use nearmiss_lanes::id32;
use nearmiss_lanes::parallel::{Runs, change_together, runs};
use nearmiss_lanes::vector::dot;
use nearmiss_lanes::wide::blocks_of;

use crate::patch::alignment::align;
use crate::patch::classes::votes;
use crate::patch::surfels::{Fit, fits_of, gaps_of};
use crate::point::affine::{Rest, RestLanes};
use crate::point::disc::PointCode;
use crate::point::gather::Index;
use crate::point::neighbours::supports;
use crate::point::spacing::{Look, spacings_of};
use crate::scan::build::PointHierarchy;
use crate::scan::closing::Closing;
use crate::tree::axes::Spread;
use crate::tree::topology::Topology;

/// The greatest change of the spacing of a leaf, and of lengths in its tangent plane relative to the
/// spacing, as a factor or its reciprocal, for which its discs are carried along.
const STRETCH: f32 = 1.25;

/// The greatest distance of a point from where the affine map of its leaf takes it, in its local
/// radius, for which the discs of the leaf are carried along. Two standard deviations of a noise that
/// a sheet may have are 0.3.
const OFF: f32 = 0.2;

/// The least local radius: its square is a normal number in single precision.
pub(crate) const LEAST_RADIUS: f32 = 1e-18;

const WIDTH: usize = PointBlock::WIDTH;

/// The number of runs of sixteen leaves that a thread takes at once.
const AT_ONCE: usize = 4;

/// How the points of a scan followed a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Refitted {
    /// The number of points that were carried along by the motion of their leaf.
    pub carried: usize,
    /// The number of points at which radius, normal and class were fitted anew.
    pub fitted: usize,
}

/// The points of a frame in the caller's order, and their frame.
pub(crate) struct NextFrame<'a> {
    pub(crate) points: &'a [[f64; 3]],
    pub(crate) frame: Frame,
    pub(crate) bounds: Aabb,
    pub(crate) step: f64,
}

/// A leaf when it was last fitted.
#[derive(Debug, Clone, Copy, Default)]
struct Leaf {
    rest: Rest,
    /// `false` if it is to be fitted anew.
    is_carried: bool,
}

/// The points as they were when last fitted, and reused memory.
#[derive(Debug, Clone, Default)]
pub(crate) struct Memory {
    /// `true` if the scan is as it was when last fitted, so that all leaves rest where they are.
    is_fresh: bool,
    leaves: Vec<Leaf>,
    /// The points of the leaves, as many lanes for each.
    lanes: Vec<RestLanes>,
    /// The leaves to fit anew.
    changed: Vec<u32>,
    /// The boxes of blocks, if some leaves are fitted anew.
    boxes: BlockBoxes,
    pub(crate) closing: Closing,
}

impl Memory {
    /// The memory of a scan whose points have just been fitted.
    pub(crate) fn at_rest() -> Self {
        Self { is_fresh: true, ..Self::default() }
    }

    /// Notes that all points have just been fitted.
    pub(crate) const fn refresh(&mut self) {
        self.is_fresh = true;
    }

    /// Takes the scan for its state at rest if it has just been fitted.
    fn settle(&mut self, topology: &Topology) {
        if std::mem::take(&mut self.is_fresh) {
            self.leaves.clear();
            self.leaves.resize(topology.leaves(), Leaf::default());
            self.lanes.resize(topology.leaves() * lanes_a_leaf(topology), RestLanes::default());
        }
    }

    /// Returns `true` if a leaf is to be fitted anew.
    fn is_changed(&self, leaf: usize) -> bool {
        !self.leaves[leaf].is_carried
    }
}

/// Returns the number of lanes that hold the points of a leaf.
const fn lanes_a_leaf(topology: &Topology) -> usize {
    topology.leaf_size().div_ceil(WIDTH)
}

/// Moves the points of `scan`.
pub(crate) fn refit(scan: &mut PointHierarchy, memory: &mut Memory, placed: &NextFrame<'_>) -> Refitted {
    memory.settle(&scan.topology);
    carry(scan, memory, placed);
    let mut changed = std::mem::take(&mut memory.changed);
    changed.clear();
    changed.extend((0..scan.topology.leaves()).filter(|leaf| memory.is_changed(*leaf)).map(id32));
    let fitted = close(scan, memory, &changed);
    memory.changed = changed;
    Refitted { carried: scan.len() - fitted, fitted }
}

/// Fits the points of the `changed` leaves anew and bounds all nodes. Returns the number of these points.
fn close(scan: &mut PointHierarchy, memory: &mut Memory, changed: &[u32]) -> usize {
    if changed.is_empty() {
        memory.closing.support(scan);
    } else {
        let blocks = blocks_of_leaves(&scan.topology, changed);
        let mut boxes = std::mem::take(&mut memory.boxes);
        boxes.renew(&scan.arrays.blocks, scan.len());
        let looks = space(scan, memory, &boxes, &blocks);
        memory.closing.support(scan);
        fit(scan, memory, (&boxes, &blocks), changed, &looks);
        memory.boxes = boxes;
    }
    memory.closing.bound(scan);
    changed.iter().map(|leaf| scan.topology.points_of_leaf(*leaf as usize).len()).sum()
}

/// Returns the blocks with points of some leaves, ascending.
fn blocks_of_leaves(topology: &Topology, leaves: &[u32]) -> Vec<u32> {
    let mut blocks: Vec<u32> = Vec::new();
    for leaf in leaves {
        blocks.extend(blocks_of(&topology.points_of_leaf(*leaf as usize)).map(id32));
    }
    blocks.dedup();
    blocks
}

/// Sets the positions and the frame, and carries normals and radii along with their leaves.
fn carry(scan: &mut PointHierarchy, memory: &mut Memory, placed: &NextFrame<'_>) {
    // Unpacks the positions of a scan from a file.
    let _unpacked = scan.positions();
    let meta = &mut scan.meta;
    (meta.frame, meta.bounds, meta.step) = (placed.frame, placed.bounds, placed.step);
    let (topology, leaf_size, arrays) = (scan.topology, scan.topology.leaf_size(), &mut scan.arrays);
    let Some(positions) = scan.positions.get_mut() else { return };
    let moves = Moves { placed, source: &arrays.source, reach: meta.reach, leaf_size };
    // The points of sixteen leaves fill whole blocks.
    let points = WIDTH * leaf_size;
    let moved = (
        runs(positions.to_mut(), points),
        runs(arrays.blocks.to_mut(), leaf_size),
        runs(arrays.normals.to_mut(), points),
        runs(arrays.radii.to_mut(), points),
        (runs(&mut memory.leaves, WIDTH), runs(memory.closing.spreads_of_leaves(&topology), WIDTH)),
        runs(&mut memory.lanes, WIDTH * lanes_a_leaf(&topology)),
    );
    let level = Level::new();
    change_together(0..topology.leaves().div_ceil(WIDTH), AT_ONCE, moved, &|items, moved| {
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || moves.carry(simd, items.start * points, moved),
        ));
    });
}

/// Parts of the positions, blocks, normals, radii and leaves that move with the moments of these, and of the
/// leaves at rest.
type Moved<'a> = (
    Runs<'a, [f32; 3]>,
    Runs<'a, PointBlock>,
    Runs<'a, [f32; 3]>,
    Runs<'a, f32>,
    (Runs<'a, Leaf>, Runs<'a, Spread>),
    Runs<'a, RestLanes>,
);

/// How points move into a frame.
struct Moves<'a> {
    placed: &'a NextFrame<'a>,
    source: &'a [u32],
    reach: f32,
    leaf_size: usize,
}

impl Moves<'_> {
    /// Moves some leaves, from the point `start` on. Those that were fitted in the frame before rest there.
    #[inline(always)]
    fn carry<S: Simd>(
        &self,
        simd: S,
        start: usize,
        (positions, blocks, normals, radii, (leaves, spreads), lanes): Moved<'_>,
    ) {
        // A copy, as the loop below may not change it.
        let (leaf_size, points, frame) = (self.leaf_size, self.placed.points, self.placed.frame);
        let (all, each) = (positions.elements.len(), leaf_size.div_ceil(WIDTH));
        let of_leaf = |leaf: usize| leaf * leaf_size..all.min((leaf + 1) * leaf_size);
        // The last leaf may fill fewer.
        let lanes_of = |leaf: usize| leaf * each..leaf * each + of_leaf(leaf).len().div_ceil(WIDTH);
        for (k, leaf) in leaves.elements.iter_mut().enumerate().filter(|(_, leaf)| !leaf.is_carried) {
            let own = (&positions.elements[of_leaf(k)], &normals.elements[of_leaf(k)]);
            leaf.rest = Rest::new(own.0, own.1);
            let own = (own.0, own.1, &radii.elements[of_leaf(k)]);
            leaf.rest.spread(own, &mut lanes.elements[lanes_of(k)]);
        }
        for (now, source) in positions.elements.iter_mut().zip(&self.source[start..]) {
            *now = frame.to_local(points[*source as usize]);
        }
        for (block, points) in blocks.elements.iter_mut().zip(positions.elements.chunks(WIDTH)) {
            block.place(points);
        }
        for (k, (leaf, spread)) in leaves.elements.iter_mut().zip(spreads.elements).enumerate() {
            let rest = &lanes.elements[lanes_of(k)];
            let (motion, spread_now) =
                leaf.rest.motion(simd, rest, &positions.elements[of_leaf(k)], (STRETCH, OFF));
            (leaf.is_carried, *spread) = (motion.is_carried, spread_now);
            let moved = (&mut normals.elements[of_leaf(k)], &mut radii.elements[of_leaf(k)]);
            motion.carry(simd, rest, moved, self.reach);
        }
    }
}

/// Measures the spacing of the points of the changed leaves, which have these `blocks`, anew. Returns a
/// function that tells the appearance of their neighbours.
fn space(
    scan: &mut PointHierarchy,
    memory: &Memory,
    boxes: &BlockBoxes,
    blocks: &[u32],
) -> impl Fn(usize) -> Look + Sync + Send + use<> {
    let options = (scan.meta.radius_neighbours as usize, scan.meta.reach);
    let found =
        spacings_of(scan.positions(), &boxes.over(&scan.arrays.blocks), options, &scan.arrays.radii, blocks);
    let leaf_size = scan.topology.leaf_size();
    let radii = scan.arrays.radii.to_mut();
    for (block, found) in blocks.iter().zip(found.chunks(WIDTH)) {
        let first = *block as usize * WIDTH;
        for (i, (_, radius)) in (first..radii.len()).zip(found) {
            if memory.is_changed(i / leaf_size) {
                radii[i] = radius.max(LEAST_RADIUS);
            }
        }
    }
    let blocks = blocks.to_vec();
    move |i| {
        blocks.binary_search(&id32(i / WIDTH)).map_or(Look::Area, |k| found[k * WIDTH + i % WIDTH].0.look())
    }
}

/// Fits the surface at the points of the `changed` leaves, which have these `blocks`, anew.
fn fit(
    scan: &mut PointHierarchy,
    memory: &Memory,
    (boxes, blocks): (&BlockBoxes, &[u32]),
    changed: &[u32],
    looks: &(impl Fn(usize) -> Look + Sync + Send),
) {
    let topology = scan.topology;
    // The boxes of the nodes are those of the frame before.
    let supports = supports(&scan.arrays.groups);
    let index = Index { supports: Some(&supports), ..scan.index() };
    let new = fits_of(&index, scan.positions(), looks, changed);
    let is_oriented = scan.meta.is_oriented;
    // The normals of an oriented scan keep their side.
    let sided = |fit: Fit, before: [f32; 3]| {
        if is_oriented && dot(fit.normal, before) < 0.0 { fit.flipped() } else { fit }
    };
    let points = || changed.iter().flat_map(|leaf| topology.points_of_leaf(*leaf as usize));
    let carried: Vec<[f32; 3]> = points().map(|i| scan.normals()[i]).collect();
    let fits = points().zip(new).zip(&carried).map(|((i, fit), before)| (i, sided(fit, *before)));
    set(scan, fits);
    let tree = boxes.over(&scan.arrays.blocks);
    let (normals, codes) = (scan.normals(), &scan.arrays.codes);
    let corrected = votes(
        &tree,
        scan.positions(),
        scan.radii(),
        |i| Fit::new(normals[i], codes[i].kind()),
        (blocks.len(), |k| blocks[k] as usize),
    );
    let leaf_of = |i: u32| i as usize / topology.leaf_size();
    let is_open = |(i, _): &(u32, Fit)| memory.is_changed(leaf_of(*i));
    let corrected: Vec<(u32, Fit)> = corrected.into_iter().filter(is_open).collect();
    let fits = corrected.iter().map(|&(i, fit)| {
        // All leaves before the last one are full.
        let place =
            changed.partition_point(|changed| (*changed as usize) < leaf_of(i)) * topology.leaf_size();
        (i as usize, sided(fit, carried[place + i as usize % topology.leaf_size()]))
    });
    set(scan, fits);
    let again: Vec<u32> = corrected.iter().map(|(i, _)| *i).collect();
    let index = Index { supports: Some(&supports), ..scan.index() };
    let gaps = gaps_of(&index, scan.positions(), |i| scan.normals()[i], &again);
    let codes = scan.arrays.codes.to_mut();
    for ((i, fit), gap) in corrected.iter().zip(gaps) {
        codes[*i as usize] = PointCode::new(fit.kind(), gap);
    }
    if !is_oriented {
        let normals = scan.arrays.normals.to_mut();
        changed.iter().for_each(|leaf| align(&mut normals[topology.points_of_leaf(*leaf as usize)]));
    }
}

/// Sets normals, classes and gaps of points. Unknown gaps are set to 0.
fn set(scan: &mut PointHierarchy, fits: impl Iterator<Item = (usize, Fit)>) {
    let (normals, codes) = (scan.arrays.normals.to_mut(), scan.arrays.codes.to_mut());
    for (i, fit) in fits {
        (normals[i], codes[i]) = (fit.normal, fit.point_code().0);
    }
}
