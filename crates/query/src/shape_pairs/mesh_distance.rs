//! The distance of a mesh and a convex shape: a descent of the tree of the mesh, nearest child first.

use std::ops::ControlFlow;

use fearless_simd::{Level, Simd, f32x4};
use nearmiss_geometry::NodeId;
use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::{MeshHierarchy, MeshView, Part, PlaceVisitor, Siblings};
use serde::{Deserialize, Serialize};

use crate::mesh::placed::PlacedMesh;
use crate::solid::closest::Closest;
use crate::solid::core::{LaneCore, Solid};
use crate::solid::lanes::LaneBox;

type Vector = Vector3<f64>;

/// Bounds on the distance of a mesh and a convex shape, in world units.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ShapeMeshDistance {
    /// A proven lower bound, up to the rounding of double precision; 0 if they may touch.
    pub lower: f64,
    /// An upper bound: the distance of [`Self::points`]. 0 if they touch.
    pub upper: f64,
    /// The nearest points, of the mesh and of the shape. If they touch, a point of the mesh in the shape.
    pub points: [[f64; 3]; 2],
    /// The triangle of the first point, as the caller numbered it.
    pub triangle: u32,
}

/// A descent to the triangles near a shape, in the stored frame of the mesh.
struct Search<'s, 'a, V> {
    view: &'s MeshView<'a>,
    /// The origin and the scale of the stored frame, in the frame of the mesh's input.
    origin: Vector,
    scale: f64,
    solid: &'s Solid<'s>,
    lane_box: LaneBox<'s>,
    /// The distance of the shape up to which triangles are of interest.
    within: f64,
    /// The squared distance of the core beyond which boxes are skipped.
    most_sq: f32,
    visit: V,
}

/// Calls `visit` with each triangle that may be within a distance of `solid`, which is in the mesh's stored
/// frame: with its place in the tree, its corners, and the points of both nearest to each other. `visit`
/// returns the distance up to which further triangles are of interest, or ends the descent.
pub(crate) fn visit_near(
    mesh: &MeshHierarchy,
    view: &MeshView<'_>,
    (solid, within): (&Solid<'_>, f64),
    level: Level,
    visit: impl FnMut(usize, &[Vector; 3], &Closest) -> ControlFlow<(), f64>,
) -> ControlFlow<()> {
    let (frame, root) = (mesh.frame(), view.tree.root_box());
    let far = Vector3::from(root.centre).amax() + root.radius();
    let mut search = Search {
        view,
        origin: frame.origin.into(),
        scale: frame.scale,
        solid,
        lane_box: LaneBox::new(solid, f64::from(far), LaneCore::Box),
        within: f64::INFINITY,
        most_sq: f32::INFINITY,
        visit,
    };
    search.limit(within);
    let centre = search.lane_box.centre;
    view.tree.descend_to(level, centre, &mut search)
}

/// Bounds the distance of a mesh and `solid`, which is in the mesh's stored frame, up to `within` in the
/// world.
pub(crate) fn distance(
    mesh: &PlacedMesh<'_>,
    solid: &Solid<'_>,
    within: f64,
    level: Level,
) -> Option<ShapeMeshDistance> {
    let (view, to_world) = (mesh.mesh().arrays(), mesh.stored_to_world());
    let (mut upper, mut lower, mut best) = (f64::INFINITY, f64::INFINITY, None);
    let limit = within / to_world.scale();
    // Ends early if they touch.
    let _touching = visit_near(mesh.mesh(), &view, (solid, limit), level, |i, _, found| {
        let distance = (found.distance - solid.radius).max(0.0);
        lower = lower.min(found.lower - solid.radius);
        if distance < upper {
            (upper, best) = (distance, Some((i, *found)));
        }
        if upper == 0.0 { ControlFlow::Break(()) } else { ControlFlow::Continue(upper.min(limit)) }
    });
    let upper = upper * to_world.scale();
    let (triangle, Closest { points: [on_core, on_mesh], distance, .. }) =
        best.filter(|_| upper <= within)?;
    // From the core to the shape.
    let share = if distance > 0.0 { (solid.radius / distance).min(1.0) } else { 0.0 };
    let on_shape = on_core + (on_mesh - on_core) * share;
    Some(ShapeMeshDistance {
        lower: (lower * to_world.scale()).clamp(0.0, upper),
        upper,
        points: [to_world.apply(on_mesh.into()), to_world.apply(on_shape.into())],
        triangle: view.source[triangle],
    })
}

impl<V: FnMut(usize, &[Vector; 3], &Closest) -> ControlFlow<(), f64>> Search<'_, '_, V> {
    /// Limits the search to this distance of the shape.
    #[expect(clippy::cast_possible_truncation, reason = "rounded up")]
    fn limit(&mut self, distance: f64) {
        self.within = distance;
        if self.lane_box.is_near {
            let most = ((distance + self.solid.radius) as f32).next_up() + self.lane_box.slack;
            self.most_sq = (most * most).next_up();
        }
    }

    /// Compares the shape with a triangle.
    fn compare(&mut self, i: usize) -> ControlFlow<()> {
        let corners = self.view.corners(i).map(|corner| (Vector::from(corner) - self.origin) / self.scale);
        let found = self.solid.triangle_gap(&corners, self.within + self.solid.radius);
        let within = (self.visit)(i, &corners, &found)?;
        if within < self.within {
            self.limit(within);
        }
        ControlFlow::Continue(())
    }
}

impl<V: FnMut(usize, &[Vector; 3], &Closest) -> ControlFlow<(), f64>> PlaceVisitor for Search<'_, '_, V> {
    #[inline(always)]
    fn most_sq(&self) -> f32 {
        self.most_sq
    }

    #[inline(always)]
    fn distances_sq<S: Simd>(&self, simd: S, node: NodeId, _: &Siblings, _: [f32; 3]) -> f32x4<S> {
        let nodes = self.view.tree.bounds_of_children(simd, Part::Surface, node);
        self.lane_box.of_nodes(simd, &nodes, false)
    }

    fn leaf<S: Simd>(&mut self, _: S, number: usize) -> ControlFlow<()> {
        self.view.tree.topology().points_of_leaf(number).try_for_each(|i| self.compare(i))
    }
}
