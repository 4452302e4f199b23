//! The penetration of two bodies of a world.

use crate::ask::budget::Budget;
use crate::ask::options::CollidePlan;
use crate::many::body::BodyPair;
use crate::mesh::solid::MeshSolid;
use crate::mesh_scan::plan::MeshScanPlan;
use crate::penetration::answer::{Interior, Penetration};
use crate::question::Scratch;
use crate::solid::plan::ShapePlan;

/// The inside of a body of a world.
#[derive(Debug, Clone, Copy)]
pub enum BodyInterior<'a> {
    /// The inside of a scan.
    Scan(Interior),
    /// The closed parts of a mesh.
    Mesh(&'a MeshSolid),
    /// A shape is solid.
    Shape,
}

impl BodyPair<'_> {
    /// Bounds the penetration of the bodies: how far the second must at least be shifted, in any direction,
    /// to be separate from the first.
    ///
    /// `plan` is that of [`Self::touch`]. `interiors` are those of the first and of the second body; if one
    /// is that of another kind, or of another mesh, the upper bound is infinite. `budget` counts for all
    /// kinds but two shapes, instead of that of the pair. The margin of the plan counts for pairs with a scan
    /// only: meshes and shapes are separate where they do not touch.
    ///
    /// See [`Pair::penetration`](crate::Pair::penetration),
    /// [`MeshScanPair::penetration`](crate::MeshScanPair::penetration),
    /// [`MeshPair::penetration`](crate::MeshPair::penetration),
    /// [`ShapeScanPair::penetration`](crate::ShapeScanPair::penetration),
    /// [`ShapeMeshPair::penetration`](crate::ShapeMeshPair::penetration) and
    /// [`ShapePair::penetration`](crate::ShapePair::penetration) for the bounds and their cost. Does not
    /// allocate once `scratch` is warm.
    ///
    /// ```
    /// use nearmiss_geometry::{PointCloud, Pose};
    /// use nearmiss_hierarchy::{BuildOptions, PointHierarchy};
    /// use nearmiss_query::BodyInterior::{Scan, Shape as Solid};
    /// use nearmiss_query::{Budget, CollideOptions, CollidePlan, Interior, Scratch, Shape, World};
    ///
    /// let points: Vec<[f32; 3]> =
    ///     (0..2500_u16).map(|i| [f32::from(i % 50) * 0.02, f32::from(i / 50) * 0.02, 0.0]).collect();
    /// let floor = PointHierarchy::build(&PointCloud::from_positions(&points)?, &BuildOptions::default())?;
    /// let plan = CollidePlan::of_metric(&CollideOptions::default(), floor.metric())?;
    ///
    /// // A ball that is 0.03 deep in a floor.
    /// let mut world = World::with_shapes();
    /// let floor = world.insert(&floor, &Pose::IDENTITY);
    /// let ball = Shape::Sphere { centre: [0.5, 0.5, 0.0], radius: 0.1 };
    /// let ball = world.insert_shape(ball, &Pose::from_translation([0.0, 0.0, 0.07]));
    ///
    /// let pair = world.body_pair([floor, ball]).expect("both exist");
    /// let interiors = [Scan(Interior::Hollow), Solid];
    /// let found = pair.penetration(&plan, interiors, &Budget::UNLIMITED, &mut Scratch::default());
    /// assert!((found.upper - 0.03).abs() < 1e-3 && found.direction[2] > 0.99, "{found:?}");
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn penetration(
        &self,
        plan: &CollidePlan,
        interiors: [BodyInterior<'_>; 2],
        budget: &Budget,
        scratch: &mut Scratch,
    ) -> Penetration {
        use BodyInterior::{Mesh, Scan, Shape};
        // The scan comes first in a pair of two kinds, and the mesh before the shape.
        let is_swapped = match self {
            Self::MeshAndScan { mesh_is_first, .. } => *mesh_is_first,
            Self::ShapeAndScan { shape_is_first, .. } | Self::ShapeAndMesh { shape_is_first, .. } => {
                *shape_is_first
            }
            Self::Scans(_) | Self::Meshes(_) | Self::Shapes(_) => false,
        };
        let [a, b] = interiors;
        let of_kind = if is_swapped { [b, a] } else { [a, b] };
        let mut found = match (self.within(budget), of_kind) {
            (Self::Scans(pair), [Scan(a), Scan(b)]) => pair.penetration(plan, [a, b], scratch),
            (Self::MeshAndScan { pair, .. }, [Scan(scan), Mesh(mesh)]) => {
                pair.penetration(&MeshScanPlan::of_pair(plan), (scan, mesh), scratch)
            }
            (Self::Meshes(pair), [Mesh(a), Mesh(b)]) => pair.penetration([a, b], scratch.meshes()),
            (Self::ShapeAndScan { pair, .. }, [Scan(scan), Shape]) => {
                pair.penetration(&ShapePlan::of_plan(plan), scan, budget, scratch)
            }
            (Self::ShapeAndMesh { pair, .. }, [Mesh(mesh), Shape]) => pair.penetration(mesh, budget, scratch),
            (Self::Shapes(pair), [Shape, Shape]) => pair.penetration(),
            _ => Penetration::UNKNOWN,
        };
        if is_swapped {
            found.direction = found.direction.map(|c| 0.0 - c);
        }
        found
    }
}
