//! [`PointHierarchy`]: a scan's points in leaf order, with everything that does not depend on a query.

use std::sync::OnceLock;

use nearmiss_geometry::{Aabb, Dropped, Frame, NodeId, PointCloud, PointId};
use nearmiss_index::PointBlock;
use nearmiss_lanes::parallel::on_threads;
use nearmiss_lanes::prefetch;
use nearmiss_lanes::vector::dot;
use nearmiss_store::{Array, Workspace};
use nearmiss_surface::SurfacePlan;

use crate::bounds::boxes::OrientedBox;
use crate::bounds::part::Part;
use crate::point::disc::DiscRadii;
use crate::point::kind::{PointKind, cell_radius, is_on_sheet, obstacle_ball};
use crate::point::leaf_block::{LeafBlock, LeafParts, Leaves};
use crate::point::stored_point::StoredPoint;
use crate::scan::arrays::ScanArrays;
use crate::scan::data::{Arrays, HierarchyMeta};
use crate::scan::identity::identity;
use crate::scan::options::{BuildError, BuildOptions};
use crate::scan::outline::{Ball, Outline};
use crate::scan::points::ScanPoints;
use crate::scan::prepare::{Prepared, prepare};
use crate::tree::topology::Topology;
use crate::tree::wide::{Tree, reaches, siblings};

/// A scan prepared for queries: points in leaf order, their radii, normals and discs, and the tree
/// over them.
///
/// All lengths and directions are in the frame of the stored positions ([`PointHierarchy::frame`]).
/// Arrays are stored separately, so that a moving scan can replace its bounds and keep its
/// topology.
#[derive(Debug, Clone)]
pub struct PointHierarchy {
    pub(crate) meta: HierarchyMeta,
    /// The surface definition of `meta`, at the scale of the stored positions.
    pub(crate) plan: SurfacePlan,
    pub(crate) topology: Topology,
    pub(crate) arrays: Arrays,
    /// Positions in leaf order, unpacked from the blocks on first use.
    pub(crate) positions: OnceLock<Array<[f32; 3]>>,
}

impl PointHierarchy {
    /// Prepares `cloud`. O(n log n), on all cores by default. The result does not depend on the
    /// number of threads.
    ///
    /// # Errors
    /// If an option is out of range, or the threads cannot be started.
    pub fn build(cloud: &PointCloud, options: &BuildOptions) -> Result<Self, BuildError> {
        Self::build_in(&cloud.into(), options, &Workspace::in_memory())
    }

    /// Like [`Self::build`], for points that may be in files, with the intermediate arrays in a
    /// workspace. The result is the same.
    ///
    /// # Errors
    /// If an option is out of range, the threads cannot be started, or the workspace fails.
    pub fn build_in(
        points: &ScanPoints<'_>,
        options: &BuildOptions,
        work: &Workspace,
    ) -> Result<Self, BuildError> {
        options.check()?;
        on_threads(options.threads, || build(points, options, work))
            .or(Err(BuildError::Threads(options.threads)))?
    }

    /// Returns the arrays that a query reads.
    #[inline(always)]
    #[must_use]
    pub fn arrays(&self) -> ScanArrays<'_> {
        ScanArrays {
            normals: &self.arrays.normals,
            radii: &self.arrays.radii,
            discs: self.discs(),
            tree: self.tree(),
            leaves: self.leaves(),
            outline: &self.meta.outline,
            blocks: &self.arrays.blocks,
            sample_lists: &self.arrays.sample_lists,
            coverings: &self.arrays.coverings,
            leaf_size: self.meta.leaf_size,
            samples_a_node: self.meta.samples,
            plan: &self.plan,
            sampling_radius: self.meta.sampling_radius,
            reach: self.meta.reach,
            dense: self.meta.dense as usize,
        }
    }

    /// Returns the number of points.
    #[must_use]
    #[expect(clippy::len_without_is_empty, reason = "a cloud has at least eight points")]
    pub fn len(&self) -> usize {
        self.arrays.source.len()
    }

    /// Returns the frame of the stored positions.
    #[must_use]
    pub fn frame(&self) -> &Frame {
        &self.meta.frame
    }

    /// Returns the bounds of the points in the caller's frame.
    #[must_use]
    pub fn bounds(&self) -> &Aabb {
        &self.meta.bounds
    }

    /// Returns the numbers of input points that were dropped.
    #[must_use]
    pub fn dropped(&self) -> Dropped {
        self.meta.dropped
    }

    /// Returns the greatest change of a coordinate by rounding to `f32`, in the caller's units.
    #[must_use]
    pub fn step(&self) -> f64 {
        self.meta.step
    }

    /// Returns the 0.9-quantile of the local radii, in the caller's units.
    #[must_use]
    pub fn sampling_radius(&self) -> f64 {
        f64::from(self.meta.sampling_radius) * self.meta.frame.scale
    }

    /// Returns L, how far the scan may be interpolated, in the caller's units. No gap wider than
    /// this is bridged, and no local radius exceeds it.
    #[must_use]
    pub fn reach(&self) -> f64 {
        f64::from(self.meta.reach) * self.meta.frame.scale
    }

    /// Returns the share of points that are represented by a sheet in the obstacle; the others are
    /// balls.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "counts below 2^32 are exact")]
    pub fn sheet_share(&self) -> f64 {
        let arrays = self.arrays();
        (0..self.len()).filter(|&i| arrays.is_on_sheet(i)).count() as f64 / self.len() as f64
    }

    /// Returns the definition of the surface, at the scale of the stored positions.
    #[must_use]
    pub fn plan(&self) -> &SurfacePlan {
        &self.plan
    }

    /// Returns the number of points in a full leaf.
    #[must_use]
    pub fn leaf_size(&self) -> u32 {
        self.meta.leaf_size
    }

    /// Returns K of the local radii.
    #[must_use]
    pub fn radius_neighbours(&self) -> u32 {
        self.meta.radius_neighbours
    }

    /// Returns the number of samples of an inner node.
    #[must_use]
    pub fn samples_a_node(&self) -> u32 {
        self.meta.samples
    }

    /// Returns the positions in leaf order. A scan from a file unpacks them on first use, in O(n);
    /// [`ScanArrays::position`] reads a single position without that.
    #[must_use]
    pub fn positions(&self) -> &[[f32; 3]] {
        self.positions.get_or_init(|| {
            let (blocks, points): (&[PointBlock], _) = (&self.arrays.blocks, 0..self.len());
            points.map(|i| PointBlock::position_in(blocks, i)).collect::<Vec<_>>().into()
        })
    }

    /// Returns the unit normals. Until they [are oriented](Self::turn_normals) their signs are
    /// arbitrary, but consistent within a leaf.
    #[must_use]
    pub fn normals(&self) -> &[[f32; 3]] {
        &self.arrays.normals
    }

    /// Returns `true` if neighbouring normals are on the same side.
    #[must_use]
    pub fn is_oriented(&self) -> bool {
        self.meta.is_oriented
    }

    /// Flips the normals whose sign differs in `oriented`, which must have the same directions
    /// otherwise. In `oriented`, neighbours must be on the same side, as a graph over the points
    /// determines it. The sign of f follows from the normals ([`Self::evaluate_oriented_with`]);
    /// boxes and verdicts do not depend on it.
    ///
    /// # Panics
    /// If `oriented` does not have one normal for each point.
    pub fn turn_normals(&mut self, oriented: &[[f32; 3]]) {
        assert_eq!(oriented.len(), self.len(), "expected a normal for each point");
        for (normal, to) in self.arrays.normals.to_mut().iter_mut().zip(oriented) {
            if dot(*normal, *to) < 0.0 {
                *normal = normal.map(|c| -c);
            }
        }
        self.meta.is_oriented = true;
        self.renew_leaves();
    }

    /// Replaces the boxes of all nodes, given in the order of their ids; then recomputes leaf
    /// blocks, marks and outline. The growths are kept, so the enclosures must be the same.
    pub(crate) fn bound(&mut self, boxes: &[OrientedBox]) {
        self.meta.root.bounds = boxes[NodeId::ROOT.index()];
        siblings(&self.topology, boxes, self.arrays.siblings.to_mut());
        reaches(&self.topology, boxes, self.arrays.reaches.to_mut());
        self.renew_leaves();
        self.meta.outline = self.outlined();
    }

    /// Recomputes leaf blocks and marks from the points and boxes.
    pub(crate) fn renew_leaves(&mut self) {
        let (mut blocks, mut marks) =
            (std::mem::take(&mut self.arrays.leaf_blocks), std::mem::take(&mut self.arrays.marks));
        self.fill_leaves(blocks.to_mut(), marks.to_mut());
        (self.arrays.leaf_blocks, self.arrays.marks) = (blocks, marks);
    }

    fn fill_leaves(&self, blocks: &mut [LeafBlock], marks: &mut [u8]) {
        let (tree, topology) = (self.tree(), &self.topology);
        self.leaf_parts().fill(topology, |leaf| tree.bounds(topology.leaf(leaf)), (blocks, marks));
    }

    /// Returns the arrays that leaf blocks are built from.
    pub(crate) fn leaf_parts(&self) -> LeafParts<'_> {
        LeafParts {
            positions: self.positions(),
            normals: &self.arrays.normals,
            discs: self.discs(),
            dense: self.meta.dense as usize,
        }
    }

    /// Computes the hash that identifies this scan, and its bounding balls.
    pub(crate) fn outlined(&self) -> Outline {
        let (meta, arrays) = (&self.meta, &self.arrays);
        // Coverings are withheld where discs were carried along. Then normals, and with them
        // enclosures, do not follow from the rest.
        let is_carried = arrays.coverings.first().is_some_and(|root| root.sampling == f32::INFINITY);
        let normals = is_carried.then_some(&arrays.normals[..]);
        self.outlined_as(identity(meta, self.positions(), &arrays.codes, &arrays.radii, normals))
    }

    /// Computes the bounding balls of this scan.
    pub(crate) fn outlined_as(&self, identity: u64) -> Outline {
        let arrays = self.arrays();
        Outline {
            identity,
            surface: Ball::about(&arrays.enclosure(0)),
            obstacle: Ball::about(&arrays.obstacle_enclosure(0)),
            discs: Ball::about(&self.meta.root.bounds),
        }
    }

    /// Returns the local sampling radii r_i.
    #[must_use]
    pub fn radii(&self) -> &[f32] {
        &self.arrays.radii
    }

    /// Returns the radii of the points' tangent discs.
    #[inline]
    #[must_use]
    pub fn discs(&self) -> DiscRadii<'_> {
        DiscRadii {
            codes: &self.arrays.codes,
            radii: &self.arrays.radii,
            reach: self.meta.reach,
            sampling_radius: self.meta.sampling_radius,
        }
    }

    /// Returns the kind of the `i`-th stored point.
    ///
    /// # Panics
    /// If there is no such point.
    #[inline]
    #[must_use]
    pub fn kind(&self, i: usize) -> PointKind {
        self.arrays.codes[i].kind()
    }

    /// Returns `true` if the `i`-th stored point is at a border of its sheet: a sector of its tangent
    /// plane of about 135° or more is empty.
    ///
    /// # Panics
    /// If there is no such point.
    #[inline]
    #[must_use]
    pub fn is_at_border(&self, i: usize) -> bool {
        self.arrays.codes[i].is_at_border()
    }

    /// Returns the share of points that sample a sheet.
    #[must_use]
    pub fn usable(&self) -> f64 {
        self.share(PointKind::Sheet) + self.share(PointKind::Edge)
    }

    /// Returns the share of points of this kind.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "counts below 2^32 are exact")]
    pub fn share(&self, kind: PointKind) -> f64 {
        let count = self.arrays.codes.iter().filter(|code| code.kind() == kind).count();
        count as f64 / self.len() as f64
    }

    /// Returns the index of each stored point in the caller's input.
    #[must_use]
    pub fn source(&self) -> &[u32] {
        &self.arrays.source
    }

    /// Returns the caller's id of the `i`-th stored point.
    ///
    /// # Panics
    /// If there is no such point.
    #[inline]
    #[must_use]
    pub fn id(&self, i: usize) -> PointId {
        PointId(self.arrays.source[i])
    }

    /// Asks the processor to load what is known of the `i`-th stored point.
    ///
    /// # Panics
    /// If there is no such point.
    #[inline]
    pub fn prefetch_point(&self, i: usize) {
        let (arrays, lane) = (&self.arrays, i % PointBlock::WIDTH);
        let block = &arrays.blocks[i / PointBlock::WIDTH];
        block.position.iter().for_each(|row| prefetch(&row[lane]));
        prefetch(&arrays.normals[i]);
        prefetch(&arrays.radii[i]);
        prefetch(&arrays.codes[i]);
        prefetch(&arrays.source[i]);
    }

    /// Returns the leaves.
    #[inline]
    #[must_use]
    pub fn leaves(&self) -> Leaves<'_> {
        let (blocks, marks) = (&self.arrays.leaf_blocks, &self.arrays.marks);
        Leaves { topology: &self.topology, blocks, marks }
    }

    /// Returns the `i`-th stored point.
    ///
    /// # Panics
    /// If there is no such point.
    #[inline]
    #[must_use]
    pub fn stored_point(&self, i: usize) -> StoredPoint {
        let (code, radius) = (self.arrays.codes[i], self.arrays.radii[i]);
        let (kind, dense) = (code.kind(), self.meta.dense as usize);
        StoredPoint {
            position: PointBlock::position_in(&self.arrays.blocks, i),
            normal: self.arrays.normals[i],
            kind,
            radius,
            disc: code.disc(radius, self.meta.reach, self.meta.sampling_radius),
            ball: obstacle_ball(i, dense, kind, radius),
            is_on_sheet: is_on_sheet(i, dense, kind),
            cell: cell_radius(radius, self.meta.reach),
        }
    }

    /// Returns the nodes and their bounding boxes.
    #[inline]
    #[must_use]
    pub fn tree(&self) -> Tree<'_> {
        let (surface, obstacle) = (&self.arrays.surface_growths, &self.arrays.obstacle_growths);
        Tree {
            topology: &self.topology,
            root: &self.meta.root,
            siblings: &self.arrays.siblings,
            reaches: &self.arrays.reaches,
            growths: [surface, obstacle],
        }
    }

    /// Returns the box around all points.
    #[inline]
    #[must_use]
    pub fn root_box(&self) -> &OrientedBox {
        &self.meta.root.bounds
    }

    /// Returns the hash that identifies this scan, and its bounding balls.
    #[inline]
    #[must_use]
    pub fn outline(&self) -> &Outline {
        &self.meta.outline
    }

    /// Returns the topology of the tree: its nodes and the points under each.
    #[inline]
    #[must_use]
    pub fn topology(&self) -> &Topology {
        &self.topology
    }

    /// Returns the box of each node around the discs and [balls](ScanArrays::ball) of its points, in
    /// the order of the nodes' ids.
    #[must_use]
    pub fn boxes(&self) -> impl ExactSizeIterator<Item = OrientedBox> {
        let tree = self.tree();
        self.topology.ids().map(move |id| tree.bounds(id))
    }

    /// Returns a box for each node that provably contains its part of the surface
    /// (docs/theory/certificates.md): every surface point whose nearest stored point is the node's.
    #[must_use]
    pub fn enclosures(&self) -> impl ExactSizeIterator<Item = OrientedBox> {
        let tree = self.tree();
        self.topology.ids().map(move |id| tree.enclosure(Part::Surface, id))
    }

    /// Returns the bytes stored for nodes: boxes, enclosures, samples and coverings. Klein &
    /// Zachmann 2004, §6.1, report the same. Arrays with one entry per point and neighbour lists
    /// are not counted.
    #[must_use]
    pub fn bytes_of_nodes(&self) -> usize {
        size_of_val::<[_]>(&self.arrays.siblings)
            + size_of_val::<[_]>(&self.arrays.reaches)
            + 2 * size_of_val::<[_]>(&self.arrays.surface_growths)
            + size_of_val::<[_]>(&self.arrays.sample_lists)
            + size_of_val::<[_]>(&self.arrays.coverings)
    }

    /// Returns the points in blocks: point `i` is in lane `i` % 16 of block `i` / 16.
    #[must_use]
    pub fn blocks(&self) -> &[PointBlock] {
        &self.arrays.blocks
    }

    /// Returns a ball for each block of points that contains the supports of all its points, with
    /// the ball's radius in place of a support radius. The ball of block `i` is in lane `i` % 16 of
    /// group `i` / 16.
    #[must_use]
    pub fn groups(&self) -> &[PointBlock] {
        &self.arrays.groups
    }

    /// Returns the neighbour list of `block`: a distance, and the groups, ascending, that may have
    /// support within that distance of the centre of the block's ball. Returns `None` if the list
    /// would be too long or there is no such block.
    #[must_use]
    pub fn neighbours(&self, block: usize) -> Option<(f32, &[u32])> {
        let list = self.arrays.lists.get(block).filter(|list| list.within > 0.0)?;
        let entries = self.arrays.listed.get(list.first as usize..)?.get(..list.count as usize)?;
        Some((list.within, entries))
    }
}

fn build(
    points: &ScanPoints<'_>,
    options: &BuildOptions,
    work: &Workspace,
) -> Result<PointHierarchy, BuildError> {
    assembled(prepare(points, options, work)?, work)
}

/// Adds leaf blocks, marks and outline to a prepared scan.
pub(crate) fn assembled(prepared: Prepared, work: &Workspace) -> Result<PointHierarchy, BuildError> {
    let Prepared { meta, plan, topology, arrays, positions } = prepared;
    let positions = Array::from(positions).into();
    let mut hierarchy = PointHierarchy { meta, plan, topology, arrays, positions };
    let mut leaf_blocks = work.room(topology.leaves() * LeafParts::blocks_a_leaf(&topology))?;
    let mut marks = work.room(topology.leaves())?;
    hierarchy.fill_leaves(&mut leaf_blocks, &mut marks);
    (hierarchy.arrays.leaf_blocks, hierarchy.arrays.marks) = (leaf_blocks.into(), marks.into());
    hierarchy.meta.outline = hierarchy.outlined();
    Ok(hierarchy)
}
