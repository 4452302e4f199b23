//! Two prepared meshes under a relative pose, and the cost of a search.

use std::cell::OnceCell;
use std::ops::ControlFlow;

use fearless_simd::Level;
use nearmiss_geometry::Pose;
use nearmiss_hierarchy::{LEAF_TRIANGLES, MeshView, Relative, TreePair};
use nearmiss_lanes::wide::Bits;
use nearmiss_mesh::Corners;

use crate::ask::budget::Budget;
use crate::mesh::answer::MeshContact;
use crate::mesh::placed::PlacedMesh;
use crate::mesh::triangle_pairs::{least_distances, may_meet};
use crate::pair::clearance::Clearance;
use crate::pair::meter::Meter;
use crate::pair::placed_balls::PlacedBalls;
use crate::pair::relative_pose::RelativePose;

/// The cost of a leaf pair, in node pairs.
const LEAF_PAIR: u64 = 16;

/// The share of the radius of the smaller mesh up to which motions are resolved.
const RESOLVED: f64 = 1e-3;

/// The cost of an exact distance of two triangles, in node pairs.
pub(crate) const EXACT: u64 = 64;

/// Two placed meshes, their arrays, the relative pose, and the cost of the search.
#[derive(Debug)]
pub(crate) struct MeshPairing<'a> {
    pub(crate) meshes: &'a [PlacedMesh<'a>; 2],
    pub(crate) a: &'a MeshView<'a>,
    pub(crate) b: &'a MeshView<'a>,
    /// The pose of b's stored frame in a's.
    pub(crate) stored: Pose,
    /// The same in single precision.
    pub(crate) relative: Relative,
    /// The pose of b's input in the frame of a's input, once it is needed.
    pose: OnceCell<Pose>,
    /// A lower bound of the distance of the bounding balls, in the world.
    pub(crate) gap: f64,
    pub(crate) meter: Meter,
    /// The SIMD instructions to use. Results do not depend on them.
    pub(crate) level: Level,
    /// `true` if both meshes are the same one, compared with itself.
    is_of_itself: bool,
}

impl<'a> MeshPairing<'a> {
    /// Returns `None` if a pose is invalid.
    #[inline]
    pub(crate) fn new(
        meshes: &'a [PlacedMesh<'a>; 2],
        [a, b]: [&'a MeshView<'a>; 2],
        budget: &Budget,
        level: Level,
    ) -> Option<Self> {
        let balls =
            PlacedBalls::of([meshes[0].stored_to_world(), meshes[1].stored_to_world()], [*a.ball, *b.ball])?;
        let (stored, relative) = balls.relative();
        let leaves = [a, b].map(|mesh| mesh.tree.topology().leaves() as u64);
        let pairs = (LEAF_TRIANGLES * LEAF_TRIANGLES) as u64;
        let meter = Meter::of_leaves(budget, leaves, LEAF_PAIR + pairs * EXACT);
        let gap = balls.gap;
        Some(Self {
            meshes,
            a,
            b,
            stored,
            relative,
            pose: OnceCell::new(),
            gap,
            meter,
            level,
            is_of_itself: false,
        })
    }

    /// The same pair, of a mesh with itself: only triangles without a common corner are compared,
    /// and each two of them once.
    pub(crate) fn of_itself(self) -> Self {
        // Rounding would move triangles that touch apart.
        Self { is_of_itself: true, pose: OnceCell::from(Pose::IDENTITY), ..self }
    }

    /// Returns `true` if these triangles are to be compared.
    #[inline]
    pub(crate) fn compares(&self, [i, j]: [usize; 2]) -> bool {
        if !self.is_of_itself {
            return true;
        }
        let (a, b) = (self.a.corners(i), self.b.corners(j));
        i < j && !a.iter().any(|p| b.contains(p))
    }

    /// The identities of both meshes.
    fn things(&self) -> [u64; 2] {
        self.meshes.each_ref().map(|placed| placed.mesh().identity())
    }

    /// Returns `true` if a separation at an earlier pose still holds.
    pub(crate) fn is_clear(&self, known: Option<&Clearance>) -> bool {
        let left =
            known.and_then(|known| known.at(self.things(), &self.stored, self.b.ball, self.relative.slack()));
        left.is_some_and(|left| left > 0.0)
    }

    /// Remembers a separation by `distance`, in a's stored frame. `None` if that is too small to be of
    /// use.
    pub(crate) fn clearance(&self, distance: f64) -> Option<Clearance> {
        Clearance::new(self.things(), &self.stored, distance - f64::from(self.relative.slack()))
    }

    /// Converts a length from the frame of a's input to a's stored frame.
    pub(crate) fn to_stored(&self, length: f64) -> f64 {
        length / self.meshes[0].mesh().frame().scale
    }

    /// The trees of both meshes, for a descent that prunes pairs whose boxes are disjoint.
    pub(crate) fn trees<'t>(&self, relative: &'t Relative) -> TreePair<'t>
    where
        'a: 't,
    {
        TreePair { a: &self.a.tree, b: &self.b.tree, relative, reach: relative.slack() }
    }

    /// The way up to which motions are resolved, in the world: a share of the radius of the smaller mesh.
    pub(crate) fn band(&self) -> f64 {
        let radius = |placed: &PlacedMesh<'_>, mesh: &MeshView<'_>| {
            mesh.ball.radius * placed.stored_to_world().scale()
        };
        RESOLVED * radius(&self.meshes[0], self.a).min(radius(&self.meshes[1], self.b))
    }

    /// Prepares the relative pose for bounds of distances.
    pub(crate) fn relative_pose(&self) -> RelativePose {
        let roots = [self.a, self.b].map(|mesh| mesh.tree.root_box());
        let placed = [self.meshes[0].stored_to_world(), self.meshes[1].stored_to_world()];
        RelativePose::new(roots, placed, &self.stored)
    }

    /// Lower bounds on the distances of the triangle pairs of two leaves, in a's stored frame; see
    /// [`least_distances`].
    pub(crate) fn least_distances(&mut self, [a, b]: [usize; 2]) -> [f32; LEAF_TRIANGLES * LEAF_TRIANGLES] {
        self.meter.spent.leaf_pairs += 1;
        self.meter.leaf_work(LEAF_PAIR);
        least_distances(self.level, [&self.a.blocks[a], &self.b.blocks[b]], &self.relative)
    }

    /// Returns the corners of the `i`-th triangle of a and the `j`-th of b in the frame of a's input.
    #[inline]
    pub(crate) fn corners(&self, [i, j]: [usize; 2]) -> [Corners; 2] {
        let pose = self.pose.get_or_init(|| self.meshes[1].pose().relative_to(self.meshes[0].pose()));
        [self.a.corners(i), self.b.corners(j).map(|p| pose.apply(p))]
    }

    /// Counts two leaves, and returns the lanes of their triangle pairs that may meet; see
    /// [`may_meet`].
    #[inline]
    pub(crate) fn lanes_that_may_meet(&mut self, [a, b]: [usize; 2]) -> u32 {
        self.meter.spent.leaf_pairs += 1;
        self.meter.leaf_work(LEAF_PAIR);
        may_meet(self.level, [&self.a.blocks[a], &self.b.blocks[b]], &self.relative) & self.lanes([a, b])
    }

    /// The lanes in use by the triangle pairs of two leaves, as bits.
    pub(crate) fn lanes(&self, [a, b]: [usize; 2]) -> u32 {
        let count = |mesh: &MeshView<'_>, leaf: usize| mesh.tree.topology().points_of_leaf(leaf).len();
        let (a, b) = (count(self.a, a), count(self.b, b));
        ((1 << a) - 1) * (0x1111 & ((1 << (4 * b)) - 1))
    }

    /// The triangles in a lane of two leaves.
    #[inline]
    pub(crate) fn triangles([a, b]: [usize; 2], lane: usize) -> [usize; 2] {
        [a * LEAF_TRIANGLES + lane % LEAF_TRIANGLES, b * LEAF_TRIANGLES + lane / LEAF_TRIANGLES]
    }

    /// Calls `visit` with the triangles in some lanes of two leaves until it breaks, the least of the
    /// `bounds` of their distances first: the others may then be out of reach.
    #[inline]
    pub(crate) fn by_bound(
        leaves: [usize; 2],
        (bounds, lanes): (&[f32; LEAF_TRIANGLES * LEAF_TRIANGLES], u32),
        mut visit: impl FnMut(f32, [usize; 2]) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let mut open = lanes;
        while let Some(lane) = Bits(open).min_by(|&i, &j| bounds[i].total_cmp(&bounds[j])) {
            open &= !(1 << lane);
            visit(bounds[lane], Self::triangles(leaves, lane))?;
        }
        ControlFlow::Continue(())
    }

    /// The contact of two triangles in the world; `None` if they do not meet.
    pub(crate) fn contact(&self, triangles: [usize; 2]) -> Option<MeshContact> {
        let [a, b] = self.corners(triangles);
        let contact = nearmiss_mesh::triangle_contact(&a, &b)?;
        let pose = self.meshes[0].pose();
        Some(MeshContact {
            point: pose.apply(contact.point),
            ends: contact.ends.map(|end| pose.apply(end)),
            normals: contact.normals.map(|normal| pose.rotate(normal.unwrap_or([0.0; 3]))),
            triangles: [self.a.source[triangles[0]], self.b.source[triangles[1]]],
        })
    }
}
