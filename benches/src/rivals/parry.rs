//! Parry's bounding volume hierarchy of a mesh's triangles, traversed in pairs, with a
//! double-precision triangle test, as a user with a mesh would write for speed.
//!
//! Boxes are compared along their six face axes in single precision, slightly inflated so that no
//! pair is lost. Triangles are compared in double precision.

use std::cell::Cell;

use nearmiss::{Pose, TriangleMesh};
use parry3d::bounding_volume::Aabb;
use parry3d::glamx::{Mat3A, Vec3A};
use parry3d::math::Vector;
use parry3d::partitioning::{Bvh, BvhBuildStrategy, BvhNode};

use crate::rivals::method::{Method, Reply};
use crate::rivals::triangles::{Triangle, intersect, normal};

/// Added to the absolute values of a rotation; exceeds the rounding of single precision.
const ROUNDING: f32 = 1e-6;

/// The triangles of a mesh in a hierarchy.
#[derive(Clone)]
#[expect(missing_debug_implementations, reason = "the hierarchy has none")]
pub struct MeshTree {
    tree: Bvh,
    root: BvhNode,
    triangles: Vec<Triangle>,
    /// Bound of the rounding of coordinates, in units of the mesh.
    slack: f32,
}

impl MeshTree {
    /// Builds the hierarchy, without triangles of zero area.
    #[must_use]
    pub fn new(mesh: &TriangleMesh) -> Self {
        let corners = |t: &[u32; 3]| t.map(|v| mesh.vertices()[v as usize]);
        let has_area = |t: &Triangle| normal(t).iter().any(|&x| x != 0.0);
        let triangles: Vec<Triangle> = mesh.triangles().iter().map(corners).filter(has_area).collect();
        let boxes: Vec<Aabb> = triangles.iter().map(bounds).collect();
        let farthest = triangles.iter().flatten().flatten().fold(0.0, |far: f64, x| far.max(x.abs()));
        let tree = Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes);
        let root = BvhNode::leaf(tree.root_aabb(), 0);
        Self { tree, root, triangles, slack: ROUNDING * single(farthest) }
    }
}

/// Rounds to single precision.
#[expect(clippy::cast_possible_truncation, reason = "that is what it is for; callers add slack")]
fn single(x: f64) -> f32 {
    x as f32
}

fn bounds(t: &Triangle) -> Aabb {
    let extreme = |k: usize, pick: fn(f64, f64) -> f64| single(pick(pick(t[0][k], t[1][k]), t[2][k]));
    let corner = |pick| Vector::new(extreme(0, pick), extreme(1, pick), extreme(2, pick));
    Aabb::new(corner(f64::min), corner(f64::max))
}

/// A relative pose in single precision, with precomputed values for comparing boxes.
struct RelativePose {
    turn: Mat3A,
    back: Mat3A,
    spread: Mat3A,
    spread_back: Mat3A,
    shift: Vec3A,
    slack: Vec3A,
}

impl RelativePose {
    fn new(pose: &Pose, slack: f32) -> Self {
        let columns = [0, 1, 2].map(|k| {
            let axis: [f64; 3] = std::array::from_fn(|i| pose.rotation()[(i, k)]);
            Vec3A::from_array(axis.map(single))
        });
        let turn = Mat3A::from_cols(columns[0], columns[1], columns[2]);
        let [x, y, z] = columns.map(|c| c.abs() + Vec3A::splat(ROUNDING));
        let spread = Mat3A::from_cols(x, y, z);
        let shift = Vec3A::from_array(pose.translation().map(single));
        let slack = Vec3A::splat(4.0 * slack + 2.0 * ROUNDING * shift.length());
        Self { turn, back: turn.transpose(), spread, spread_back: spread.transpose(), shift, slack }
    }

    /// Returns `true` if the boxes of two nodes may overlap; the second one is moved.
    fn overlap(&self, a: &BvhNode, b: &BvhNode) -> bool {
        let centre_and_half = |node: &BvhNode| {
            let (min, max) = (Vec3A::from(node.mins()), Vec3A::from(node.maxs()));
            (0.5 * (min + max), 0.5 * (max - min))
        };
        let ((centre_a, half_a), (centre_b, half_b)) = (centre_and_half(a), centre_and_half(b));
        let between = self.turn * centre_b + self.shift - centre_a;
        let reach = half_a + self.spread * half_b + self.slack;
        if !between.abs().cmple(reach).all() {
            return false;
        }
        let reach = half_b + self.spread_back * half_a + self.slack;
        (self.back * between).abs().cmple(reach).all()
    }
}

impl Method for MeshTree {
    fn name(&self) -> String {
        "parry BVH + f64 triangles (mesh)".into()
    }

    fn ask(&mut self, a: &Pose, b: &Pose) -> Reply {
        let pose = a.inverse().after(b);
        let relative = RelativePose::new(&pose, self.slack);
        if !relative.overlap(&self.root, &self.root) {
            return Reply { node_pairs: 1, ..Reply::default() };
        }
        let node_pairs = Cell::new(1);
        let check = |a: &BvhNode, b: &BvhNode| {
            node_pairs.set(node_pairs.get() + 1);
            relative.overlap(a, b)
        };
        let mut evaluations = 0;
        let hit = self.tree.leaf_pairs(&self.tree, check).any(|(i, j)| {
            evaluations += 1;
            let moved = self.triangles[j as usize].map(|p| pose.apply(p));
            intersect(&self.triangles[i as usize], &moved)
        });
        Reply { hit, evaluations, node_pairs: node_pairs.get() }
    }
}
