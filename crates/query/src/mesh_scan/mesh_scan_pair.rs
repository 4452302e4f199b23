//! A placed scan and a placed mesh under a relative pose, and the cost of a search.

use fearless_simd::Level;
use nearmiss_geometry::{PointId, Pose};
use nearmiss_hierarchy::{LEAF_TRIANGLES, MeshView, NodePair, Part, Relative, ScanArrays, TreePair};
use nearmiss_lanes::wide::Bits;
use nearmiss_mesh::Corners;

use crate::ask::budget::Budget;
use crate::ask::options::Semantics;
use crate::mesh::placed::PlacedMesh;
use crate::mesh_scan::triangle_lanes::LeafTriangles;
use crate::pair::meter::Meter;
use crate::pair::placed::Placed;
use crate::pair::placed_balls::PlacedBalls;

/// The cost of a leaf pair, in node pairs.
const LEAF_PAIR: u64 = 20;

/// From this many radii on, the distance of the bounding balls is a good bound, and single
/// precision loses accuracy.
const FAR_APART: f64 = 100.0;

/// A scan, a, and a mesh, b.
#[derive(Debug)]
pub(crate) struct MeshScanPairing<'a> {
    pub(crate) scan: &'a Placed<'a>,
    pub(crate) mesh: &'a PlacedMesh<'a>,
    pub(crate) a: &'a ScanArrays<'a>,
    pub(crate) b: &'a MeshView<'a>,
    /// The pose of the mesh's stored frame in the scan's.
    pub(crate) stored: Pose,
    /// The same in single precision.
    pub(crate) relative: Relative,
    /// The pose of the mesh's input in the scan's stored frame.
    pose: Pose,
    /// A lower bound of the distance of the bounding balls, in the world.
    pub(crate) gap: f64,
    /// `true` if the balls are so far apart that their gap is nearly the whole distance.
    pub(crate) is_far: bool,
    pub(crate) meter: Meter,
    /// The part of the scan that its enclosures contain.
    pub(crate) part: Part,
    /// The SIMD instructions to use. Results do not depend on them.
    pub(crate) level: Level,
}

impl<'a> MeshScanPairing<'a> {
    /// Returns `None` if a pose is invalid.
    pub(crate) fn new(
        (scan, a): (&'a Placed<'a>, &'a ScanArrays<'a>),
        (mesh, b): (&'a PlacedMesh<'a>, &'a MeshView<'a>),
        semantics: Semantics,
        budget: &Budget,
        level: Level,
    ) -> Option<Self> {
        let about = match semantics {
            Semantics::Obstacle => a.outline.obstacle,
            Semantics::Surface => a.outline.surface,
            Semantics::Thickened(_) => a.outline.discs,
        };
        let balls = PlacedBalls::of([scan.stored_to_world(), mesh.stored_to_world()], [about, *b.ball])?;
        let (stored, relative) = balls.relative();
        let (gap, radii) = (balls.gap, balls.radii);
        let leaves = [a.tree.topology().leaves() as u64, b.tree.topology().leaves() as u64];
        Some(Self {
            scan,
            mesh,
            a,
            b,
            stored,
            relative,
            pose: mesh.pose().relative_to(scan.stored_to_world()),
            gap,
            is_far: gap > FAR_APART * (radii[0] + radii[1]),
            meter: Meter::of_leaves(budget, leaves, LEAF_PAIR),
            part: semantics.part(),
            level,
        })
    }

    /// The identities of the scan and the mesh.
    pub(crate) fn things(&self) -> [u64; 2] {
        [self.a.outline.identity, self.mesh.mesh().identity()]
    }

    /// The leaves of a point and a triangle.
    pub(crate) fn leaves_of(&self, [i, j]: [usize; 2]) -> NodePair {
        NodePair { a: self.a.tree.topology().leaf_of(i), b: self.b.tree.topology().leaf_of(j) }
    }

    /// Both trees, for a descent that prunes pairs whose boxes are further apart than `reach`, in
    /// the scan's stored frame.
    pub(crate) fn trees<'t>(&self, relative: &'t Relative, reach: f32) -> TreePair<'t>
    where
        'a: 't,
    {
        TreePair { a: &self.a.tree, b: &self.b.tree, relative, reach }
    }

    /// Converts a length from the world to the scan's stored frame, enlarged by the rounding error
    /// of a gap there.
    pub(crate) fn to_stored(&self, length: f64) -> f32 {
        #[expect(clippy::cast_possible_truncation, reason = "grown by more than the rounding")]
        let length = (length / self.scan.stored_to_world().scale()) as f32 * (1.0 + 1e-6);
        length + self.relative.slack()
    }

    /// The corners of the `j`-th triangle in the scan's stored frame.
    pub(crate) fn corners(&self, j: usize) -> Corners {
        self.b.corners(j).map(|p| self.pose.apply(p))
    }

    /// The corners of the `j`-th triangle in the world.
    pub(crate) fn world_corners(&self, j: usize) -> Corners {
        self.b.corners(j).map(|p| self.mesh.pose().apply(p))
    }

    /// The triangles of a leaf of the mesh, by its number, in the scan's stored frame.
    pub(crate) fn triangles(&self, leaf: usize) -> LeafTriangles<'_> {
        LeafTriangles { level: self.level, block: &self.b.blocks[leaf], relative: &self.relative }
    }

    /// The lanes of the triangles of a leaf.
    pub(crate) fn lanes(&self, leaf: usize) -> Bits {
        Bits((1 << self.b.tree.topology().points_of_leaf(leaf).len()) - 1)
    }

    /// The number of the triangle in a lane of a leaf.
    pub(crate) fn triangle(leaf: usize, lane: usize) -> usize {
        leaf * LEAF_TRIANGLES + lane
    }

    /// The sources of a point and a triangle, as the caller numbered them.
    pub(crate) fn sources(&self, [i, j]: [usize; 2]) -> [PointId; 2] {
        [self.scan.scan().id(i), PointId(self.b.source[j])]
    }

    /// The band at a point, in the world: its local radius.
    pub(crate) fn band(&self, i: usize) -> f64 {
        f64::from(self.a.radii[i]) * self.scan.stored_to_world().scale()
    }

    /// The band at the nearest points of a node, in the world: the greatest local radius of any of
    /// its points.
    pub(crate) fn band_of_node(&self, nodes: NodePair) -> f64 {
        f64::from(self.a.tree.reach(nodes.a)) * self.scan.stored_to_world().scale()
    }

    /// Counts two leaves, given by leaf numbers, whose items are compared next.
    #[inline]
    pub(crate) fn count(&mut self, [a, b]: [usize; 2]) {
        let triangles = self.b.tree.topology().points_of_leaf(b).len();
        self.meter.leaf_pair(self.a.leaves.points(a).len(), triangles);
    }
}
