//! Moves the points of a prepared scan: carries discs along, and fits some anew.

use fearless_simd::{Level, Simd, dispatch};
use nearmiss_geometry::{Aabb, Frame};
use nearmiss_index::{BlockBoxes, PointBlock};
use nearmiss_lanes::id32;
use nearmiss_lanes::parallel::{change_each, change_runs, fill};
use nearmiss_lanes::vector::dot;
use nearmiss_lanes::wide::blocks_of;

use crate::patch::classes::votes;
use crate::patch::surfels::{Fit, align, fits_of, gaps_of};
use crate::point::affine::{Motion, Rest};
use crate::point::disc::PointCode;
use crate::point::spacing::{Look, spacings_of};
use crate::scan::build::PointHierarchy;
use crate::scan::closing::Closing;
use crate::tree::topology::Topology;

/// The greatest change of lengths in the tangent planes of a leaf, as a factor or its reciprocal, for
/// which its discs are carried along.
const STRETCH: f32 = 1.25;

/// The greatest distance of a point from where the affine map of its leaf takes it, in its local
/// radius, for which the discs of the leaf are carried along. Two standard deviations of a noise that
/// a sheet may have are 0.3.
const OFF: f32 = 0.2;

/// The least local radius: its square is a normal number in single precision.
pub(crate) const LEAST_RADIUS: f32 = 1e-18;

const WIDTH: usize = PointBlock::WIDTH;

/// The number of leaves that a thread takes at once.
const LEAVES_AT_ONCE: usize = 64;

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

/// The points as they were when last fitted, and reused memory.
#[derive(Debug, Clone, Default)]
pub(crate) struct Memory {
    /// `true` if the scan is as it was when last fitted, and the state at rest below is not up to
    /// date.
    is_fresh: bool,
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    radii: Vec<f32>,
    leaves: Vec<Rest>,
    motions: Vec<Motion>,
    /// The leaves to fit anew.
    changed: Vec<u32>,
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
    fn settle(&mut self, scan: &PointHierarchy) {
        if !std::mem::take(&mut self.is_fresh) {
            return;
        }
        let topology = scan.topology();
        self.positions.clear();
        self.positions.extend_from_slice(scan.positions());
        self.normals.clear();
        self.normals.extend_from_slice(scan.normals());
        self.radii.clear();
        self.radii.extend_from_slice(scan.radii());
        self.leaves.resize(topology.leaves(), Rest::default());
        self.motions.resize(topology.leaves(), Motion::default());
        self.closing.reserve(scan);
        let Self { positions, normals, leaves, .. } = self;
        fill(leaves, |leaf| {
            let points = topology.points_of_leaf(leaf);
            Rest::new(&positions[points.clone()], &normals[points])
        });
    }

    /// Returns `true` if a leaf is to be fitted anew.
    fn is_changed(&self, leaf: usize) -> bool {
        !self.motions[leaf].is_carried
    }

    /// Takes a leaf as it is in `scan` for its state at rest.
    fn rest(&mut self, scan: &PointHierarchy, leaf: usize) {
        let points = scan.topology().points_of_leaf(leaf);
        let Self { positions, normals, radii, leaves, .. } = self;
        positions[points.clone()].copy_from_slice(&scan.positions()[points.clone()]);
        normals[points.clone()].copy_from_slice(&scan.normals()[points.clone()]);
        radii[points.clone()].copy_from_slice(&scan.radii()[points.clone()]);
        leaves[leaf] = Rest::new(&positions[points.clone()], &normals[points]);
    }
}

/// Moves the points of `scan`.
pub(crate) fn refit(scan: &mut PointHierarchy, memory: &mut Memory, placed: &NextFrame<'_>) -> Refitted {
    memory.settle(scan);
    place(scan, placed);
    carry(scan, memory);
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
        memory.closing.turn(scan);
        memory.closing.bound(scan);
    } else {
        let blocks = blocks_of_leaves(&scan.topology, changed);
        let boxes = BlockBoxes::new(&scan.arrays.blocks, scan.len());
        let looks = space(scan, memory, &boxes, &blocks);
        memory.closing.support(scan);
        memory.closing.turn(scan);
        memory.closing.bound(scan);
        // The boxes so far contain the points, which suffices to find neighbours.
        fit(scan, memory, (&boxes, &blocks), changed, &looks);
        let Memory { closing, motions, .. } = memory;
        closing.bound_above(scan, |leaf| !motions[leaf].is_carried);
    }
    memory.closing.finish(scan);
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

/// Sets the positions and the frame.
pub(crate) fn place(scan: &mut PointHierarchy, placed: &NextFrame<'_>) {
    // Unpacks the positions of a scan from a file.
    let _unpacked = scan.positions();
    let (source, NextFrame { points, frame, .. }): (&[u32], _) = (&scan.arrays.source, placed);
    let Some(positions) = scan.positions.get_mut() else { return };
    fill(positions.to_mut(), |i| frame.to_local(points[source[i] as usize]));
    let positions: &[[f32; 3]] = positions;
    change_each(scan.arrays.blocks.to_mut(), WIDTH, |number, block| {
        for (lane, p) in positions[number * WIDTH..].iter().take(WIDTH).enumerate() {
            for k in 0..3 {
                block.position[k][lane] = p[k];
            }
        }
    });
    let meta = &mut scan.meta;
    (meta.frame, meta.bounds, meta.step) = (placed.frame, placed.bounds, placed.step);
}

/// Carries normals and radii along with their leaves.
fn carry(scan: &mut PointHierarchy, memory: &mut Memory) {
    let (topology, reach) = (scan.topology, scan.meta.reach);
    let Memory { positions, normals, radii, leaves, motions, .. } = memory;
    let (positions, normals, radii): (&[_], &[_], &[_]) = (positions, normals, radii);
    let (now, level) = (scan.positions(), Level::new());
    change_each(motions, WIDTH, |leaf, motion| {
        let points = topology.points_of_leaf(leaf);
        let (before, now, radii) = (&positions[points.clone()], &now[points.clone()], &radii[points]);
        *motion = dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || leaves[leaf].motion(before, now, radii, (STRETCH, OFF)),
        ));
    });
    let (motions, leaf_size): (&[Motion], _) = (motions, topology.leaf_size());
    let at_once = LEAVES_AT_ONCE * leaf_size;
    change_runs(scan.arrays.normals.to_mut(), at_once, |number, some| {
        let leaves = some.chunks_mut(leaf_size).zip(normals[number * at_once..].chunks(leaf_size));
        for ((now, before), motion) in leaves.zip(&motions[number * LEAVES_AT_ONCE..]) {
            dispatch!(level, simd => simd.vectorize(
                #[inline(always)]
                || motion.turn(simd, before, now),
            ));
        }
    });
    change_runs(scan.arrays.radii.to_mut(), at_once, |number, some| {
        let leaves = some.chunks_mut(leaf_size).zip(radii[number * at_once..].chunks(leaf_size));
        for ((now, before), motion) in leaves.zip(&motions[number * LEAVES_AT_ONCE..]) {
            let stretch = if motion.is_carried { motion.stretch } else { 1.0 };
            for (now, before) in now.iter_mut().zip(before) {
                *now = (before * stretch).min(reach);
            }
        }
    });
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

/// Fits the surface at the points of the `changed` leaves, which have these `blocks`, anew, and takes
/// them as they are then for their state at rest.
fn fit(
    scan: &mut PointHierarchy,
    memory: &mut Memory,
    (boxes, blocks): (&BlockBoxes, &[u32]),
    changed: &[u32],
    looks: &(impl Fn(usize) -> Look + Sync + Send),
) {
    let topology = scan.topology;
    let new = fits_of(&scan.index(), scan.positions(), scan.radii(), looks, changed);
    let is_oriented = scan.meta.is_oriented;
    // The normals of an oriented scan keep their side.
    let sided = |fit: Fit, before: [f32; 3]| {
        if is_oriented && dot(fit.normal, before) < 0.0 { fit.flipped() } else { fit }
    };
    let points = || changed.iter().flat_map(|leaf| topology.points_of_leaf(*leaf as usize));
    let carried: Vec<[f32; 3]> = points().map(|i| scan.normals()[i]).collect();
    for ((i, fit), before) in points().zip(new).zip(&carried) {
        set(scan, i, sided(fit, *before));
    }
    let tree = boxes.over(&scan.arrays.blocks);
    let known =
        |scan: &PointHierarchy, i: usize| Fit::new(scan.arrays.normals[i], scan.arrays.codes[i].kind());
    let corrected = votes(
        &tree,
        scan.positions(),
        scan.radii(),
        |i| known(scan, i),
        (blocks.len(), |k| blocks[k] as usize),
    );
    let is_open = |(i, _): &(u32, Fit)| memory.is_changed(*i as usize / topology.leaf_size());
    let corrected: Vec<(u32, Fit)> = corrected.into_iter().filter(is_open).collect();
    for (i, fit) in &corrected {
        // All leaves before the last one are full.
        let (leaf, place) = (*i as usize / topology.leaf_size(), *i as usize % topology.leaf_size());
        let before =
            changed.partition_point(|changed| (*changed as usize) < leaf) * topology.leaf_size() + place;
        set(scan, *i as usize, sided(*fit, carried[before]));
    }
    let again: Vec<u32> = corrected.iter().map(|(i, _)| *i).collect();
    let gaps = gaps_of(&scan.index(), scan.positions(), |i| scan.normals()[i], &again);
    let codes = scan.arrays.codes.to_mut();
    for ((i, fit), gap) in corrected.iter().zip(gaps) {
        codes[*i as usize] = PointCode::new(fit.kind(), gap);
    }
    for leaf in changed {
        if !is_oriented {
            align(&mut scan.arrays.normals.to_mut()[topology.points_of_leaf(*leaf as usize)]);
        }
        memory.rest(scan, *leaf as usize);
    }
}

/// Sets normal, class and gap of a point. An unknown gap is set to 0.
fn set(scan: &mut PointHierarchy, i: usize, fit: Fit) {
    scan.arrays.normals.to_mut()[i] = fit.normal;
    scan.arrays.codes.to_mut()[i] = fit.point_code().0;
}

#[cfg(test)]
mod tests {
    use nearmiss_geometry::PointCloud;

    use super::*;
    use crate::scan::options::BuildOptions;

    /// Moves a sheet of points. One corner of it folds, so its leaves are fitted anew.
    fn folded(leaf_size: u32) -> (PointHierarchy, Memory, Refitted) {
        let sheet = |fold: f64| -> Vec<[f64; 3]> {
            let lattice = (0..3_600_u32).map(|i| [f64::from(i % 60), f64::from(i / 60)]);
            lattice.map(|[x, y]| [x, y, 0.002 * x * x + fold * (x + y - 90.0).max(0.0)]).collect()
        };
        let cloud = PointCloud::from_positions(&sheet(0.0)).unwrap();
        let mut scan =
            PointHierarchy::build(&cloud, &BuildOptions::default().with_leaf_size(leaf_size)).unwrap();
        let (mut memory, points) = (Memory::at_rest(), sheet(1.0));
        let bounds = Aabb::of(points.iter().copied());
        let placed = NextFrame { points: &points, frame: *scan.frame(), bounds, step: scan.meta.step };
        let refitted = refit(&mut scan, &mut memory, &placed);
        (scan, memory, refitted)
    }

    #[test]
    fn bounds_above_changed_leaves_are_those_of_all_nodes_computed_anew() {
        let bounds = |scan: &PointHierarchy| {
            let arrays = &scan.arrays;
            let bytes: [&[u8]; 4] = [
                bytemuck::cast_slice(&arrays.siblings),
                bytemuck::cast_slice(&arrays.reaches),
                bytemuck::cast_slice(&arrays.surface_growths),
                bytemuck::cast_slice(&arrays.obstacle_growths),
            ];
            bytes.map(<[u8]>::to_vec)
        };
        // Blocks straddle leaves of other sizes than 16.
        for leaf_size in [10, 16, 24] {
            let (mut scan, mut memory, refitted) = folded(leaf_size);
            assert!(refitted.fitted > 100 && refitted.carried > 2_000, "{refitted:?}");
            let partial = bounds(&scan);
            memory.closing.bound(&mut scan);
            assert!(partial == bounds(&scan), "leaves of {leaf_size}");
        }
    }
}
