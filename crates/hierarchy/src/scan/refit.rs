//! Moves the points of a prepared scan: carries discs along, fits some anew, and bounds all nodes.

use nearmiss_geometry::{Aabb, Frame, NodeId};
use nearmiss_index::{BlockBoxes, PointBlock};
use nearmiss_lanes::id32;
use nearmiss_lanes::parallel::{change_each, fill};
use nearmiss_lanes::vector::dot;
use nearmiss_store::Array;
use nearmiss_surface::SurfacePlan;

use crate::bounds::boxes::OrientedBox;
use crate::bounds::growth::Growth;
use crate::patch::classes::vote_among;
use crate::patch::covering::Covering;
use crate::patch::parts::{PartBlock, Parts, bound_parts};
use crate::patch::surfels::{Fit, align, codes_of, fits_of};
use crate::point::affine::{Motion, Rest};
use crate::point::disc::DiscRadii;
use crate::point::gather::NeighbourList;
use crate::point::leaf_block::LeafParts;
use crate::point::neighbours::fill_groups;
use crate::point::spacing::{Look, spacings_of};
use crate::scan::build::PointHierarchy;
use crate::scan::sampling::{quantile, set_reaches};
use crate::tree::split::{Item, bound_in_order};
use crate::tree::topology::Topology;
use crate::tree::wide::{Root, growths_of_siblings, siblings};

/// The greatest change of lengths in the tangent planes of a leaf, as a factor or its reciprocal, for
/// which its discs are carried along.
const STRETCH: f32 = 1.25;

/// The greatest distance of a point from where the affine map of its leaf takes it, in its local
/// radius, for which the discs of the leaf are carried along. Two standard deviations of a noise that
/// a sheet may have are 0.3.
const OFF: f32 = 0.2;

/// The least local radius: its square is a normal number in single precision.
const LEAST_RADIUS: f32 = 1e-18;

const WIDTH: usize = PointBlock::WIDTH;

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
#[derive(Debug, Clone)]
pub(crate) struct Memory {
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    radii: Vec<f32>,
    leaves: Vec<Rest>,
    motions: Vec<Motion>,
    items: Vec<Item>,
    parts: Vec<PartBlock>,
    boxes: Vec<OrientedBox>,
    growths: Vec<[Growth; 2]>,
    /// The leaves to fit anew.
    changed: Vec<u32>,
    counts: Vec<usize>,
}

impl Memory {
    /// The memory of a scan whose points have just been fitted.
    pub(crate) fn at_rest(scan: &PointHierarchy) -> Self {
        let topology = scan.topology();
        let mut memory = Self {
            positions: scan.positions().to_vec(),
            normals: scan.normals().to_vec(),
            radii: scan.radii().to_vec(),
            leaves: vec![Rest::default(); topology.leaves()],
            motions: vec![Motion::default(); topology.leaves()],
            items: vec![Item { position: [0.0; 3], index: 0 }; scan.len()],
            parts: vec![bytemuck::Zeroable::zeroed(); scan.blocks().len()],
            boxes: vec![OrientedBox::default(); topology.len()],
            growths: vec![[Growth::default(); 2]; topology.len()],
            changed: Vec::with_capacity(topology.leaves()),
            counts: Vec::new(),
        };
        let Self { positions, normals, leaves, .. } = &mut memory;
        fill(leaves, |leaf| {
            let points = topology.points_of_leaf(leaf);
            Rest::new(&positions[points.clone()], &normals[points])
        });
        memory
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
    place(scan, memory, placed);
    carry(scan, memory);
    let topology = scan.topology;
    memory.changed.clear();
    let is_changed = |leaf: &usize| !memory.motions[*leaf].is_carried;
    memory.changed.extend((0..topology.leaves()).filter(is_changed).map(id32));
    let changed = std::mem::take(&mut memory.changed);
    let spaced = if changed.is_empty() { None } else { Some(space(scan, memory, &changed)) };
    support(scan, memory);
    bound_in_order(&memory.items, &topology, &mut memory.boxes);
    if let Some(looks) = spaced {
        // Boxes about points suffice to find neighbours.
        set_reaches(&topology, &mut memory.boxes, &scan.arrays.radii);
        scan.meta.root.bounds = memory.boxes[NodeId::ROOT.index()];
        siblings(&topology, &memory.boxes, scan.arrays.siblings.to_mut());
        fit(scan, memory, &changed, &looks);
    }
    bound(scan, memory);
    let fitted = changed.iter().map(|leaf| topology.points_of_leaf(*leaf as usize).len()).sum();
    memory.changed = changed;
    finish(scan, memory);
    Refitted { carried: scan.len() - fitted, fitted }
}

/// Sets the positions and the frame.
fn place(scan: &mut PointHierarchy, memory: &mut Memory, placed: &NextFrame<'_>) {
    // Unpacks the positions of a scan from a file.
    let _unpacked = scan.positions();
    let (source, NextFrame { points, frame, .. }): (&[u32], _) = (&scan.arrays.source, placed);
    fill(&mut memory.items, |i| Item {
        position: frame.to_local(points[source[i] as usize]),
        index: source[i],
    });
    let items: &[Item] = &memory.items;
    if let Some(positions) = scan.positions.get_mut() {
        fill(positions.to_mut(), |i| items[i].position);
    }
    change_each(scan.arrays.blocks.to_mut(), WIDTH, |number, block| {
        for (lane, item) in items[number * WIDTH..].iter().take(WIDTH).enumerate() {
            for k in 0..3 {
                block.position[k][lane] = item.position[k];
            }
        }
    });
    let meta = &mut scan.meta;
    (meta.frame, meta.bounds, meta.step) = (placed.frame, placed.bounds, placed.step);
}

/// Carries normals and radii along with their leaves.
fn carry(scan: &mut PointHierarchy, memory: &mut Memory) {
    let (topology, reach) = (scan.topology, scan.meta.reach);
    let Memory { positions, normals, radii, leaves, motions, items, .. } = memory;
    let (positions, normals, radii): (&[_], &[_], &[_]) = (positions, normals, radii);
    fill(motions, |leaf| {
        let points = topology.points_of_leaf(leaf);
        let mut now = [[0.0; 3]; crate::tree::topology::MOST_LEAF_POINTS];
        let now = &mut now[..points.len()];
        for (place, item) in now.iter_mut().zip(&items[points.clone()]) {
            *place = item.position;
        }
        leaves[leaf].motion(&positions[points.clone()], now, &radii[points], (STRETCH, OFF))
    });
    let (motions, leaf_size): (&[Motion], _) = (motions, topology.leaf_size());
    fill(scan.arrays.normals.to_mut(), |i| motions[i / leaf_size].normal(normals[i]));
    fill(scan.arrays.radii.to_mut(), |i| {
        let motion = &motions[i / leaf_size];
        let stretch = if motion.is_carried { motion.stretch } else { 1.0 };
        (radii[i] * stretch).min(reach)
    });
}

/// Measures the spacing of the points of the `changed` leaves anew. Returns a function that tells the
/// appearance of their neighbours.
fn space(
    scan: &mut PointHierarchy,
    memory: &Memory,
    changed: &[u32],
) -> impl Fn(usize) -> Look + Sync + Send + use<> {
    let topology = scan.topology;
    let mut blocks: Vec<u32> = Vec::new();
    for leaf in changed {
        let points = topology.points_of_leaf(*leaf as usize);
        blocks.extend((points.start / WIDTH..points.end.div_ceil(WIDTH)).map(id32));
    }
    blocks.dedup();
    let boxes = BlockBoxes::new(&scan.arrays.blocks, scan.len());
    let options = (scan.meta.radius_neighbours as usize, scan.meta.reach);
    let found =
        spacings_of(scan.positions(), &boxes.over(&scan.arrays.blocks), options, &scan.arrays.radii, &blocks);
    let leaf_size = topology.leaf_size();
    let radii = scan.arrays.radii.to_mut();
    for (block, found) in blocks.iter().zip(found.chunks(WIDTH)) {
        let first = *block as usize * WIDTH;
        for (i, (_, radius)) in (first..radii.len()).zip(found) {
            if !memory.motions[i / leaf_size].is_carried {
                radii[i] = radius.max(LEAST_RADIUS);
            }
        }
    }
    move |i| {
        blocks.binary_search(&id32(i / WIDTH)).map_or(Look::Area, |k| found[k * WIDTH + i % WIDTH].0.look())
    }
}

/// Sets the sampling radius, the support radii of the points, and the balls around blocks. There are
/// no neighbour lists afterwards.
fn support(scan: &mut PointHierarchy, memory: &mut Memory) {
    scan.meta.sampling_radius = quantile(&scan.arrays.radii, &mut memory.counts);
    let (radius, unit) = (f64::from(scan.meta.sampling_radius), 1.0 / scan.meta.frame.scale);
    // The options were valid for the first frame.
    scan.plan = SurfacePlan::new(&scan.meta.surface, radius, unit).unwrap_or(scan.plan);
    let (plan, radii): (_, &[f32]) = (&scan.plan, &scan.arrays.radii);
    let blocks = scan.arrays.blocks.to_mut();
    change_each(blocks, WIDTH, |number, block| {
        plan.tune(block, &radii[number * WIDTH..radii.len().min((number + 1) * WIDTH)]);
    });
    fill_groups(blocks, scan.arrays.groups.to_mut());
    if !scan.arrays.listed.is_empty() {
        scan.arrays.lists.to_mut().fill(NeighbourList { within: -1.0, first: 0, count: 0 });
        scan.arrays.listed = Array::default();
    }
}

/// Fits the surface at the points of the `changed` leaves anew, and takes them as they are then for
/// their state at rest.
fn fit(
    scan: &mut PointHierarchy,
    memory: &mut Memory,
    changed: &[u32],
    looks: &(impl Fn(usize) -> Look + Sync + Send),
) {
    let (topology, leaf_size) = (scan.topology, scan.topology.leaf_size());
    let points = || changed.iter().flat_map(|leaf| topology.points_of_leaf(*leaf as usize));
    let (positions, radii) = (scan.positions(), scan.radii());
    let new = fits_of(&scan.index(), positions, radii, looks, changed);
    let mut fits: Vec<Fit> =
        scan.normals().iter().zip(&*scan.arrays.codes).map(|(n, code)| Fit::new(*n, code.kind())).collect();
    for (i, fit) in points().zip(new) {
        fits[i] = fit;
    }
    let blocks = &scan.arrays.blocks;
    let boxes = BlockBoxes::new(blocks, scan.len());
    let is_changed = |i: usize| !memory.motions[i / leaf_size].is_carried;
    vote_among(&boxes.over(blocks), positions, radii, &mut fits, is_changed);
    let codes = codes_of(&scan.index(), positions, &fits, changed);
    let is_oriented = scan.meta.is_oriented;
    let normals = scan.arrays.normals.to_mut();
    for leaf in changed {
        let points = topology.points_of_leaf(*leaf as usize);
        for i in points.clone() {
            let (n, before) = (fits[i].normal, normals[i]);
            normals[i] = if is_oriented && dot(n, before) < 0.0 { n.map(|c| -c) } else { n };
        }
        if !is_oriented {
            align(&mut normals[points]);
        }
    }
    let all = scan.arrays.codes.to_mut();
    for (i, code) in points().zip(codes) {
        all[i] = code;
    }
    for leaf in changed {
        memory.rest(scan, *leaf as usize);
    }
}

/// Fits boxes and enclosures along the axes in memory.
fn bound(scan: &mut PointHierarchy, memory: &mut Memory) {
    let PointHierarchy { meta, plan, topology, arrays, .. } = scan;
    let Memory { parts, boxes, growths, .. } = memory;
    let discs = DiscRadii {
        codes: &arrays.codes,
        radii: &arrays.radii,
        reach: meta.reach,
        sampling_radius: meta.sampling_radius,
    };
    let of_points = Parts { normals: &arrays.normals, discs, dense: meta.dense as usize };
    fill(parts, |number| of_points.block(number));
    let greatest = arrays.radii.iter().copied().fold(0.0, f32::max);
    let beyond = 0.5 * plan.support_radius(greatest);
    bound_parts(topology, (boxes, growths), (&arrays.blocks, parts), beyond);
    siblings(topology, boxes, arrays.siblings.to_mut());
    let growths: &[[Growth; 2]] = growths;
    growths_of_siblings(topology, |id| growths[id][0], arrays.surface_growths.to_mut());
    growths_of_siblings(topology, |id| growths[id][1], arrays.obstacle_growths.to_mut());
    meta.root = Root { bounds: boxes[NodeId::ROOT.index()], growths: growths[NodeId::ROOT.index()] };
}

/// Computes everything that depends on boxes.
fn finish(scan: &mut PointHierarchy, memory: &Memory) {
    let PointHierarchy { meta, topology, arrays, positions, .. } = scan;
    let parts = LeafParts {
        positions: positions.get().map_or(&[], |positions| positions),
        normals: &arrays.normals,
        discs: DiscRadii {
            codes: &arrays.codes,
            radii: &arrays.radii,
            reach: meta.reach,
            sampling_radius: meta.sampling_radius,
        },
        dense: meta.dense as usize,
    };
    let of_leaf = |leaf: usize| memory.boxes[topology.leaf(leaf).index()];
    parts.fill(topology, of_leaf, (arrays.leaf_blocks.to_mut(), arrays.marks.to_mut()));
    spacings(topology, &arrays.radii, arrays.coverings.to_mut());
    scan.meta.outline = scan.outlined();
}

/// Sets the spacings of all nodes, and withholds their radii.
fn spacings(topology: &Topology, radii: &[f32], coverings: &mut [Covering]) {
    // Children come after their parent.
    for id in topology.ids().rev() {
        let points = topology.points(id);
        #[expect(clippy::cast_precision_loss, reason = "a mean")]
        let count = points.len() as f32;
        let sum: f32 = if topology.is_leaf(id) {
            radii[points].iter().map(|r| r * r).sum()
        } else {
            let of = |child: NodeId| {
                #[expect(clippy::cast_precision_loss, reason = "a mean")]
                let count = topology.points(child).len() as f32;
                coverings[child.index()].spacing.powi(2) * count
            };
            topology.children(id).iter().map(of).sum()
        };
        let spacing = (sum / count).sqrt();
        coverings[id.index()] = Covering { radius: f32::INFINITY, sampling: f32::INFINITY, spacing };
    }
}
