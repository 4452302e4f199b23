//! Bounding boxes of bodies in the world.

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_geometry::{Aabb, NodeId, Pose};
use nearmiss_hierarchy::{OrientedBox, Part, SLACK};

use crate::many::body::PlacedBody;
use crate::pair::placed::Placed;
use crate::pair::placed_balls::is_proper;

/// Rounding error of a point far from the world's origin in double precision: twice the allowance
/// of a query.
const DOUBLE_ROUNDING: f64 = 4e-15;

/// Beyond this, the volumes of boxes leave the range of double precision.
const FARTHEST: f64 = 1e100;

/// Scans whose stored frames are scaled up or down by more than this count as unbounded. The others
/// then differ by at most the 2⁶⁰ that single queries allow.
const GREATEST_SCALE: f64 = (1_u64 << 30) as f64;

impl Placed<'_> {
    /// Returns a bounding box, in the world, of all that a query compares: discs and balls of the scan,
    /// and the surface between them. `None` if the pose is invalid or out of range.
    #[must_use]
    pub fn bounds(&self) -> Option<Aabb> {
        bounds(self)
    }
}

/// The bounding box of a body in the broad phase. `None` if it counts as unbounded.
pub(crate) fn bounds_of_body(body: &PlacedBody<'_>) -> Option<Aabb> {
    match body {
        PlacedBody::Scan(scan) => bounds(scan),
        PlacedBody::Mesh(mesh) => bounds_of(mesh.mesh().arrays().tree.root_box(), mesh.stored_to_world()),
        PlacedBody::Shape(shape) => shape.bounds().filter(is_moderate),
    }
}

/// Returns `true` if the volume of a box is in the range of double precision.
pub(crate) fn is_moderate(bounds: &Aabb) -> bool {
    bounds.min.iter().chain(&bounds.max).all(|x| x.abs() <= FARTHEST)
}

/// The world-space bounding box of all parts of a scan that a query compares, enlarged by half of
/// the rounding error that the query allows for. `None` if the pose is invalid or out of range.
pub(crate) fn bounds(view: &Placed<'_>) -> Option<Aabb> {
    bounds_of(&view.scan().tree().enclosure(Part::Surface, NodeId::ROOT), view.stored_to_world())
}

/// The same for a thing that is within `root` in its stored frame, which is `placed` in the world.
fn bounds_of(root: &OrientedBox, placed: &Pose) -> Option<Aabb> {
    let scale = placed.scale();
    let centre = placed.apply(root.centre.map(f64::from));
    let edges = [0, 1, 2].map(|j: usize| {
        let half = f64::from(root.half[j]) * scale;
        placed.rotate(root.axes[j].map(f64::from)).map(|x| (x * half).abs())
    });
    // A query in single precision allows for SLACK times the coordinates of either scan about the
    // other's origin. For two scans whose boxes touch, these are at most twice the distances of
    // both centres from their origins plus four radii of each.
    let own = Vector3::from(root.centre.map(f64::from)).norm();
    let single = f64::from(SLACK) * (2.0 * own + 4.0 * f64::from(root.radius())) * scale;
    let far = Vector3::from(placed.translation()).norm() + Vector3::from(centre).norm();
    let more = single + DOUBLE_ROUNDING * far;
    let half = [0, 1, 2].map(|k: usize| edges.iter().map(|edge| edge[k]).sum::<f64>() + more);
    let bounds =
        Aabb { min: [0, 1, 2].map(|k| centre[k] - half[k]), max: [0, 1, 2].map(|k| centre[k] + half[k]) };
    let is_near_one = (1.0 / GREATEST_SCALE..=GREATEST_SCALE).contains(&scale);
    (is_moderate(&bounds) && is_near_one && is_proper(placed)).then_some(bounds)
}
