//! [`ScanArrays`]: the arrays of a scan for hot loops, and the parts of points and nodes in the obstacle.

use std::ops::Range;

use nearmiss_geometry::NodeId;
use nearmiss_index::PointBlock;
use nearmiss_lanes::wide::spread_out;
use nearmiss_lanes::{id32, prefetch};
use nearmiss_surface::SurfacePlan;

use crate::bounds::boxes::OrientedBox;
use crate::bounds::part::Part;
use crate::patch::covering::Covering;
use crate::point::disc::{DENSE_SHARES, DiscRadii, PointCode};
use crate::point::kind::{SLAB, ball, cell_radius, is_on_sheet, obstacle_ball, sheet_reach};
use crate::point::leaf_block::Leaves;
use crate::scan::outline::Outline;
use crate::tree::wide::Tree;

/// The codes and the radii of the points of a full block.
type FullBlock<'a> = (&'a [PointCode; PointBlock::WIDTH], &'a [f32; PointBlock::WIDTH]);

/// The arrays that a query reads, as plain slices.
#[derive(Debug, Clone, Copy)]
pub struct ScanArrays<'a> {
    /// Unit normals; see [`crate::PointHierarchy::normals`].
    pub normals: &'a [[f32; 3]],
    /// Local sampling radii.
    pub radii: &'a [f32],
    /// The radii of the tangent discs.
    pub discs: DiscRadii<'a>,
    /// The nodes and their bounding boxes.
    pub tree: Tree<'a>,
    /// The leaf blocks and marks.
    pub leaves: Leaves<'a>,
    /// The hash that identifies the scan, and its bounding balls.
    pub outline: &'a Outline,
    /// The points in blocks: see [`crate::PointHierarchy::blocks`].
    pub blocks: &'a [PointBlock],
    /// The samples of the inner nodes in order, [`samples_a_node`](Self::samples_a_node) for each;
    /// see [`ScanArrays::samples`].
    pub sample_lists: &'a [u32],
    /// The sphere covering of each node.
    pub coverings: &'a [Covering],
    /// The number of points in a full leaf.
    pub leaf_size: u32,
    /// The number of samples of an inner node.
    pub samples_a_node: u32,
    /// The definition of the surface.
    pub plan: &'a SurfacePlan,
    /// The scan's sampling radius.
    pub sampling_radius: f32,
    /// The scan's reach L.
    pub reach: f32,
    /// The number of dense points, which come first: points on sheets, and noisy ones among them.
    /// The points after them, sparse or left over, are balls in the obstacle. A leaf has points of
    /// one sort only.
    pub dense: usize,
}

/// Volumes that contain the obstacle near each point of a block: a ball about the point and, on a sheet, a
/// slab about its tangent plane.
#[derive(Debug, Clone, Copy)]
pub struct ObstacleParts {
    /// The normals of the points; zero in unused lanes.
    pub normals: [[f32; PointBlock::WIDTH]; 3],
    /// The radii of the balls, at least [`ScanArrays::obstacle_reach`]; zero in unused lanes.
    pub reaches: [f32; PointBlock::WIDTH],
    /// Half the thicknesses of the slabs. Infinite where there is only a ball, and in unused lanes.
    pub slabs: [f32; PointBlock::WIDTH],
}

impl ScanArrays<'_> {
    /// Returns the `i`-th position in leaf order.
    ///
    /// # Panics
    /// If there is no such point.
    #[inline(always)]
    #[must_use]
    pub fn position(&self, i: usize) -> [f32; 3] {
        PointBlock::position_in(self.blocks, i)
    }

    /// Returns a box that provably contains a node's part of the surface. It has the axes of the
    /// node's box, and contains it.
    ///
    /// # Panics
    /// If there is no such node.
    #[inline]
    #[must_use]
    pub fn enclosure(&self, node: usize) -> OrientedBox {
        self.tree.enclosure(Part::Surface, NodeId(id32(node)))
    }

    /// Returns a box that provably contains a node's part of the obstacle
    /// (`docs/theory/obstacle.md`). It has the axes of the node's box, and contains it.
    ///
    /// # Panics
    /// If there is no such node.
    #[inline]
    #[must_use]
    pub fn obstacle_enclosure(&self, node: usize) -> OrientedBox {
        self.tree.enclosure(Part::Obstacle, NodeId(id32(node)))
    }

    /// Asks the processor to load a leaf.
    ///
    /// # Panics
    /// If there is no such leaf.
    #[inline(always)]
    pub fn prefetch_leaf(&self, number: usize) {
        for (block, first, _) in self.leaves.blocks(number) {
            prefetch(block);
            prefetch(&self.radii[first]);
        }
    }

    /// Asks the processor to load the positions and normals of the points of a leaf from `first` on, of up
    /// to sixteen.
    ///
    /// # Panics
    /// If there is no such point.
    #[inline(always)]
    pub fn prefetch_points(&self, first: usize) {
        prefetch(&self.blocks[first / PointBlock::WIDTH].position);
        if let Some(normals) = self.normals[first..].first_chunk::<{ PointBlock::WIDTH }>() {
            prefetch(normals);
        }
    }

    /// Returns the radius of the ball that represents a point in the obstacle: half the local
    /// radius of a sparse point, about a third of that of other points off sheets, zero for points
    /// on sheets.
    ///
    /// # Panics
    /// If there is no such point.
    #[inline]
    #[must_use]
    pub fn obstacle_ball(&self, i: usize) -> f32 {
        obstacle_ball(i, self.dense, self.discs.codes[i].kind(), self.radii[i])
    }

    /// Returns `true` if a point is represented in the obstacle by the sheet that it samples,
    /// `false` if by a ball.
    ///
    /// # Panics
    /// If there is no such point.
    #[inline]
    #[must_use]
    pub fn is_on_sheet(&self, i: usize) -> bool {
        is_on_sheet(i, self.dense, self.discs.codes[i].kind())
    }

    /// Returns the radius around a point that contains its part of the obstacle: the radius of its
    /// ball or, on a sheet, the greater of those of its [cell](Self::cell_radius) and its disc with
    /// its thickness.
    ///
    /// # Panics
    /// If there is no such point.
    #[inline]
    #[must_use]
    pub fn obstacle_reach(&self, i: usize) -> f32 {
        if self.is_on_sheet(i) {
            sheet_reach(self.radii[i], self.discs.get(i), self.reach)
        } else {
            self.obstacle_ball(i)
        }
    }

    /// Returns [`Self::obstacle_ball`] for the points in a block; 0 in unused lanes.
    ///
    /// # Panics
    /// If there is no such block.
    #[inline(always)]
    #[must_use]
    pub fn obstacle_balls(&self, block: usize) -> [f32; PointBlock::WIDTH] {
        let mut balls = [0.0; PointBlock::WIDTH];
        if let Some((codes, radii)) = self.dense_block(block) {
            for lane in 0..PointBlock::WIDTH {
                balls[lane] = DENSE_SHARES[usize::from(codes[lane].0)] * radii[lane];
            }
        } else {
            for (ball, i) in balls.iter_mut().zip(self.points_of(block)) {
                *ball = self.obstacle_ball(i);
            }
        }
        balls
    }

    /// Returns an upper bound of [`Self::obstacle_reach`] for the points in a block; 0 in unused
    /// lanes.
    ///
    /// # Panics
    /// If there is no such block.
    #[inline(always)]
    #[must_use]
    pub fn obstacle_reaches(&self, block: usize) -> [f32; PointBlock::WIDTH] {
        let mut reaches = self.obstacle_balls(block);
        if let Some((codes, radii)) = self.dense_block(block) {
            for lane in 0..PointBlock::WIDTH {
                let disc = codes[lane].disc_of_sheet(radii[lane], self.reach);
                let of_sheet = sheet_reach(radii[lane], disc, self.reach);
                reaches[lane] = if reaches[lane] > 0.0 { reaches[lane] } else { of_sheet };
            }
        } else {
            for (reach, i) in reaches.iter_mut().zip(self.points_of(block)) {
                *reach = self.obstacle_reach(i);
            }
        }
        reaches
    }

    /// Returns the volumes that contain the obstacle near each of the points in a block.
    ///
    /// # Panics
    /// If there is no such block.
    #[inline(always)]
    #[must_use]
    pub fn obstacle_parts(&self, block: usize) -> ObstacleParts {
        let mut normals = [[0.0; PointBlock::WIDTH]; 3];
        spread_out(&self.normals[self.points_of(block)], &mut normals);
        ObstacleParts { normals, reaches: self.obstacle_reaches(block), slabs: self.obstacle_slabs(block) }
    }

    /// Returns half the thicknesses of the slabs of the points in a block.
    #[inline(always)]
    fn obstacle_slabs(&self, block: usize) -> [f32; PointBlock::WIDTH] {
        let mut slabs = [f32::INFINITY; PointBlock::WIDTH];
        if let Some((codes, radii)) = self.dense_block(block) {
            for lane in 0..PointBlock::WIDTH {
                let is_ball = DENSE_SHARES[usize::from(codes[lane].0)] > 0.0;
                slabs[lane] = if is_ball { f32::INFINITY } else { SLAB * radii[lane] };
            }
        } else {
            for (slab, i) in slabs.iter_mut().zip(self.points_of(block)) {
                if self.is_on_sheet(i) {
                    *slab = SLAB * self.radii[i];
                }
            }
        }
        slabs
    }

    /// Returns the codes and the radii of a full block without sparse points.
    #[inline(always)]
    fn dense_block(&self, block: usize) -> Option<FullBlock<'_>> {
        let points = self.points_of(block);
        if points.end > self.dense {
            return None;
        }
        let codes = self.discs.codes[points.clone()].try_into().ok()?;
        Some((codes, self.radii[points].try_into().ok()?))
    }

    #[inline(always)]
    fn points_of(&self, block: usize) -> Range<usize> {
        let first = block * PointBlock::WIDTH;
        first..(first + PointBlock::WIDTH).min(self.radii.len())
    }

    /// Returns the distance from a point on a sheet up to which the surface belongs to the
    /// obstacle: the lesser of its local radius and half the reach.
    ///
    /// # Panics
    /// If there is no such point.
    #[inline]
    #[must_use]
    pub fn cell_radius(&self, i: usize) -> f32 {
        cell_radius(self.radii[i], self.reach)
    }

    /// Returns the radius of the ball around a [sparse](crate::PointKind::is_sparse) point in which
    /// there may be surface that no disc represents. It is the local radius, limited to the scan's
    /// sampling radius, within which nothing is guaranteed for any point. Zero for other points.
    ///
    /// # Panics
    /// If there is no such point.
    #[inline]
    #[must_use]
    pub fn ball(&self, i: usize) -> f32 {
        ball(self.discs.codes[i].kind(), self.radii[i], self.sampling_radius)
    }
}
