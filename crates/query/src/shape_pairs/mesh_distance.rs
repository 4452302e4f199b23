//! The distance of a mesh and a convex shape: a descent of the tree of the mesh, nearest child first.

use std::ops::ControlFlow;

use fearless_simd::{Level, Simd, f32x4};
use nearmiss_geometry::NodeId;
use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::{MeshView, Part, PlaceVisitor, Siblings};
use serde::{Deserialize, Serialize};

use crate::mesh::placed::PlacedMesh;
use crate::solid::closest::Closest;
use crate::solid::core::Solid;
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

/// The search for the nearest triangle, in the stored frame of the mesh.
struct Search<'s, 'a> {
    view: &'s MeshView<'a>,
    /// The origin and the scale of the stored frame, in the frame of the mesh's input.
    origin: Vector,
    scale: f64,
    solid: &'s Solid<'s>,
    lane_box: LaneBox,
    /// The least distance of the shape so far, or the distance up to which triangles are of interest.
    upper: f64,
    /// The least lower bound of any triangle that was compared.
    lower: f64,
    best: Option<(usize, Closest)>,
    /// The squared distance of the core beyond which boxes are skipped.
    most_sq: f32,
}

/// Bounds the distance of a mesh and `solid`, which is in the mesh's stored frame, up to `within` in the
/// world.
pub(crate) fn distance(
    mesh: &PlacedMesh<'_>,
    solid: &Solid<'_>,
    within: f64,
    level: Level,
) -> Option<ShapeMeshDistance> {
    let (view, frame, to_world) = (mesh.mesh().arrays(), mesh.mesh().frame(), mesh.stored_to_world());
    let root = view.tree.root_box();
    let far = Vector3::from(root.centre).amax() + root.radius();
    let mut search = Search {
        view: &view,
        origin: frame.origin.into(),
        scale: frame.scale,
        solid,
        lane_box: LaneBox::new(solid, f64::from(far)),
        upper: f64::INFINITY,
        lower: f64::INFINITY,
        best: None,
        most_sq: f32::INFINITY,
    };
    search.limit(within / to_world.scale());
    // Ends early if they touch.
    let centre = search.lane_box.centre;
    let _touching = view.tree.descend_to(level, centre, &mut search);
    let Search { upper, lower, best, .. } = search;
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

impl Search<'_, '_> {
    /// Limits the search to this distance of the shape.
    #[expect(clippy::cast_possible_truncation, reason = "rounded up")]
    fn limit(&mut self, distance: f64) {
        if self.lane_box.is_near {
            let most = ((distance + self.solid.radius) as f32).next_up() + self.lane_box.slack;
            self.most_sq = (most * most).next_up();
        }
    }

    /// Compares the shape with a triangle.
    fn compare(&mut self, i: usize) {
        let radius = self.solid.radius;
        let corners = self.view.corners(i).map(|corner| (Vector::from(corner) - self.origin) / self.scale);
        let found = self.solid.triangle_gap(&corners, self.upper + radius);
        let distance = (found.distance - radius).max(0.0);
        self.lower = self.lower.min(found.lower - radius);
        if distance < self.upper {
            (self.upper, self.best) = (distance, Some((i, found)));
            self.limit(distance);
        }
    }
}

impl PlaceVisitor for Search<'_, '_> {
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
        for i in self.view.tree.topology().points_of_leaf(number) {
            self.compare(i);
            if self.upper == 0.0 {
                return ControlFlow::Break(());
            }
        }
        ControlFlow::Continue(())
    }
}
