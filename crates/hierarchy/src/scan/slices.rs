//! `Slices`: the arrays of a scan for hot loops, and what of them stands for each point and node in the
//! obstacle.

use std::ops::Range;

use nearmiss_geometry::NodeId;
use nearmiss_index::PointBlock;
use nearmiss_lanes::id32;
use nearmiss_surface::SurfacePlan;

use crate::bounds::boxes::OrientedBox;
use crate::bounds::part::Part;
use crate::patch::covering::Covering;
use crate::point::disc::{DENSE_SHARES, DiscRadii, PointCode};
use crate::point::kind::{ball, cell_radius, is_on_sheet, obstacle_ball, sheet_reach};
use crate::point::leaf_block::Leaves;
use crate::scan::outline::Outline;
use crate::tree::wide::Tree;

/// The codes and the radii of as many points as a block has lanes.
type FullBlock<'a> = (&'a [PointCode; PointBlock::WIDTH], &'a [f32; PointBlock::WIDTH]);

/// The arrays that a query reads, as plain slices: an array in a mapped file is checked once, not at every
/// access.
#[derive(Debug, Clone, Copy)]
pub struct Slices<'a> {
    /// Unit normals; see [`crate::PointHierarchy::normals`].
    pub normals: &'a [[f32; 3]],
    /// Local sampling radii.
    pub radii: &'a [f32],
    /// Radii of the tangent discs.
    pub discs: DiscRadii<'a>,
    /// The nodes, and the boxes about them.
    pub tree: Tree<'a>,
    /// What leaves are compared by.
    pub leaves: Leaves<'a>,
    /// What tells the scan from others, and where it is.
    pub outline: &'a Outline,
    /// The points in blocks: see [`crate::PointHierarchy::blocks`].
    pub blocks: &'a [PointBlock],
    /// The samples of the inner nodes in their order, [`samples_a_node`](Self::samples_a_node) of each; see
    /// [`Slices::samples`].
    pub sample_lists: &'a [u32],
    /// How far the samples of each node reach.
    pub coverings: &'a [Covering],
    /// Points of a full leaf.
    pub leaf_size: u32,
    /// Samples of an inner node.
    pub samples_a_node: u32,
    /// What defines the surface.
    pub plan: &'a SurfacePlan,
    /// The scan's sampling radius.
    pub sampling_radius: f32,
    /// The scan's reach L.
    pub reach: f32,
    /// Points before this are on sheets or, noisy, among others; sparse points come from here on, and stand
    /// in the obstacle as balls. A leaf has points of one sort alone.
    pub dense: usize,
}

impl Slices<'_> {
    /// The `i`-th position in leaf order.
    ///
    /// # Panics
    /// When there is no such point.
    #[inline(always)]
    #[must_use]
    pub fn position(&self, i: usize) -> [f32; 3] {
        PointBlock::position_in(self.blocks, i)
    }

    /// A box about the part of the surface of a node, proven to contain it; it has the axes of the node's
    /// box, and contains it.
    ///
    /// # Panics
    /// When there is no such node.
    #[inline]
    #[must_use]
    pub fn enclosure(&self, node: usize) -> OrientedBox {
        self.tree.enclosure(Part::Surface, NodeId(id32(node)))
    }

    /// A box about the part of the obstacle of a node (`docs/theory/obstacle.md`); it has the axes of the
    /// node's box, and contains it.
    ///
    /// # Panics
    /// When there is no such node.
    #[inline]
    #[must_use]
    pub fn obstacle_enclosure(&self, node: usize) -> OrientedBox {
        self.tree.enclosure(Part::Obstacle, NodeId(id32(node)))
    }

    /// The radius of the ball that stands for a point in the obstacle: half its local radius, a third where
    /// it has others all around it, zero for points on sheets.
    ///
    /// # Panics
    /// When there is no such point.
    #[inline]
    #[must_use]
    pub fn obstacle_ball(&self, i: usize) -> f32 {
        obstacle_ball(i, self.dense, self.discs.codes[i].kind(), self.radii[i])
    }

    /// Returns `true` if a point stands in the obstacle by the sheet that it samples, and `false` if by a
    /// ball.
    ///
    /// # Panics
    /// When there is no such point.
    #[inline]
    #[must_use]
    pub fn is_on_sheet(&self, i: usize) -> bool {
        is_on_sheet(i, self.dense, self.discs.codes[i].kind())
    }

    /// How far the obstacle may lie from a point that is the nearest to it: the radius of its ball, or of its
    /// part of a sheet, the lesser of its local radius and half the reach.
    ///
    /// # Panics
    /// When there is no such point.
    #[inline]
    #[must_use]
    pub fn obstacle_reach(&self, i: usize) -> f32 {
        if self.is_on_sheet(i) {
            sheet_reach(self.radii[i], self.discs.get(i), self.reach)
        } else {
            self.obstacle_ball(i)
        }
    }

    /// [`Self::obstacle_ball`] of the points in a block, in lanes; 0 where there is no point.
    ///
    /// # Panics
    /// When there is no such block.
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

    /// No less than [`Self::obstacle_reach`] of the points in a block, in lanes; 0 where there is no point.
    ///
    /// # Panics
    /// When there is no such block.
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

    /// The codes and the radii of a full block without sparse points.
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

    /// How far from a point on a sheet the surface belongs to the obstacle: the lesser of its local radius
    /// and half the reach.
    ///
    /// # Panics
    /// When there is no such point.
    #[inline]
    #[must_use]
    pub fn cell_radius(&self, i: usize) -> f32 {
        cell_radius(self.radii[i], self.reach)
    }

    /// About a [sparse](crate::PointKind::is_sparse) point, the radius of the ball in which surface may be
    /// that no disc stands for: the local radius, but no more than the scan's, within which nothing is
    /// promised of any point. Zero for others.
    ///
    /// # Panics
    /// When there is no such point.
    #[inline]
    #[must_use]
    pub fn ball(&self, i: usize) -> f32 {
        ball(self.discs.codes[i].kind(), self.radii[i], self.sampling_radius)
    }
}
