//! A prepared mesh at a pose in the world.

use nearmiss_geometry::Pose;
use nearmiss_hierarchy::MeshHierarchy;

/// A prepared mesh at a pose. Takes a few nanoseconds to make or copy.
#[derive(Debug, Clone, Copy)]
pub struct PlacedMesh<'a> {
    mesh: &'a MeshHierarchy,
    /// Maps the frame of the mesh's input to the world.
    pose: Pose,
    /// Maps the stored frame to the world.
    stored_to_world: Pose,
}

impl<'a> PlacedMesh<'a> {
    /// Places `mesh` at `pose`, which maps the frame of the mesh's input to the world.
    #[inline]
    #[must_use]
    pub fn new(mesh: &'a MeshHierarchy, pose: &Pose) -> Self {
        let frame = mesh.frame();
        // Equals `pose.after(frame)`, as the pose of the frame has no rotation.
        let stored_to_world =
            pose.with_scale(pose.scale() * frame.scale).with_translation(pose.apply(frame.origin));
        Self { mesh, pose: *pose, stored_to_world }
    }

    /// The same placed mesh, shifted by `t` in the world.
    pub(crate) fn shifted(&self, t: [f64; 3]) -> Self {
        let [x, y, z] = self.pose.translation();
        Self::new(self.mesh, &self.pose.with_translation([x + t[0], y + t[1], z + t[2]]))
    }

    /// The mesh.
    #[must_use]
    pub fn mesh(&self) -> &'a MeshHierarchy {
        self.mesh
    }

    /// The pose of the mesh.
    #[must_use]
    pub fn pose(&self) -> &Pose {
        &self.pose
    }

    /// The pose of the mesh's stored frame.
    pub(crate) fn stored_to_world(&self) -> &Pose {
        &self.stored_to_world
    }
}
