//! The point of a mesh nearest to a place.

use std::ops::ControlFlow;

use fearless_simd::{Level, Simd};
use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::{MeshHierarchy, MeshView, PlaceVisitor, SLACK};
use nearmiss_mesh::nearest_on_triangle;

use crate::mesh::placed::PlacedMesh;
use crate::mesh::solid::SolidView;

/// The distance of a place inside a solid, whose pose is that of `placed`, from its surface, and the
/// direction away from there, all in the world. `None` for a place outside.
pub(crate) fn depth_in_solid(
    solid: &SolidView<'_>,
    placed: &PlacedMesh<'_>,
    place: Vector3<f64>,
) -> Option<(f64, Vector3<f64>)> {
    let pose = placed.pose();
    let own = pose.apply_inverse(place.into());
    if !solid.contains(own) {
        return None;
    }
    let away = place - Vector3::from(pose.apply(foot(solid.mesh, solid.view, solid.level, own)));
    Some((away.norm(), away.try_normalize(0.0).unwrap_or_else(Vector3::zeros)))
}

/// Finds the point of a mesh nearest to `place`, both in the frame of the mesh's input. O(log n).
pub(crate) fn foot(mesh: &MeshHierarchy, view: &MeshView<'_>, level: Level, place: [f64; 3]) -> [f64; 3] {
    let frame = mesh.frame();
    let stored = [0, 1, 2].map(|k| (place[k] - frame.origin[k]) / frame.scale);
    let bounds = view.tree.root_box();
    let far = Vector3::from(stored).amax() + f64::from(Vector3::from(bounds.centre).amax() + bounds.radius());
    let mut search = Search {
        view,
        place,
        scale: frame.scale,
        slack: f64::from(SLACK) * far,
        best: (f64::INFINITY, place),
        most_sq: f32::INFINITY,
    };
    #[expect(clippy::cast_possible_truncation, reason = "counted in the slack")]
    let stored = stored.map(|x| x as f32);
    let _whole = view.tree.descend_to(level, stored, &mut search);
    search.best.1
}

struct Search<'a> {
    view: &'a MeshView<'a>,
    place: [f64; 3],
    /// The length of a unit of the stored frame.
    scale: f64,
    /// The rounding error of distances in the stored frame.
    slack: f64,
    /// The least squared distance so far, and its point.
    best: (f64, [f64; 3]),
    most_sq: f32,
}

impl PlaceVisitor for Search<'_> {
    fn most_sq(&self) -> f32 {
        self.most_sq
    }

    fn leaf<S: Simd>(&mut self, _: S, number: usize) -> ControlFlow<()> {
        for i in self.view.tree.topology().points_of_leaf(number) {
            let foot = nearest_on_triangle(&self.view.corners(i), self.place);
            let square = (Vector3::from(foot) - Vector3::from(self.place)).norm_squared();
            if square < self.best.0 {
                self.best = (square, foot);
                let most = square.sqrt() / self.scale + self.slack;
                #[expect(clippy::cast_possible_truncation, reason = "rounded up")]
                let most_sq = (most * most * (1.0 + 1e-5)) as f32;
                self.most_sq = most_sq;
            }
        }
        ControlFlow::Continue(())
    }
}
