//! The convex parts of a shape that may be near a scan.

use parry3d::bounding_volume::{Aabb, BoundingVolume};
use parry3d::math::{Pose, Real};
use parry3d::query::Unsupported;
use parry3d::shape::{Shape as ParryShape, TypedShape};

use nearmiss::{Shape, Target};

use crate::convert::{from_vector, with_convex};
use crate::scan_shape::{ScanShape, with_scratch};

/// A convex part of a shape near a scan.
pub(crate) struct Part<'a> {
    /// The number of the part in its shape; 0 for a convex shape.
    pub(crate) id: u32,
    /// The pose of the part in its shape; `None` for the identity.
    pub(crate) pose: Option<Pose>,
    /// The part in the frame of the scan.
    pub(crate) shape: &'a Shape<'a>,
    /// The centre of a shape that has parts, in the frame of the scan: they are all on its side.
    pub(crate) centre: Option<[f64; 3]>,
}

/// Calls `visit` with each convex part of `shape` that is within `margin` of the obstacle of `scan`.
/// `pose` maps the shape to the frame of the scan. Without a margin all parts are visited.
pub(crate) fn for_parts(
    scan: &ScanShape,
    shape: &dyn ParryShape,
    pose: &Pose,
    margin: Option<Real>,
    visit: &mut dyn FnMut(&Part<'_>),
) -> Result<(), Unsupported> {
    let bounds = scan.bounds();
    let reach = &bounds.loosened(margin.unwrap_or(0.0));
    let is_convex = with_convex(shape, pose, reach, |convex| {
        visit(&Part { id: 0, pose: None, shape: convex, centre: None });
    });
    if is_convex.is_some() {
        return Ok(());
    }
    let centre = Some(from_vector(pose * shape.compute_local_bounding_sphere().center()));
    let mut are_convex = true;
    let mut part = |id: u32, part_pose: Option<&Pose>, part: &dyn ParryShape| {
        let placed = part_pose.map_or(*pose, |inner| pose * inner);
        let is_convex = with_convex(part, &placed, reach, |convex| {
            visit(&Part { id, pose: part_pose.copied(), shape: convex, centre });
        });
        are_convex &= is_convex.is_some();
    };
    if let Some(composite) = shape.as_composite_shape() {
        let near = margin.map(|margin| (margin, scan.target_within(margin)));
        let is_near = |local: &Aabb| near.is_none_or(|near| is_near(&near.1, bounds, local, pose, near.0));
        for id in composite.bvh().leaves(|node| is_near(&node.aabb())) {
            composite.map_part_at(id, &mut |inner, shape, _| part(id, inner, shape));
        }
        return are_convex.then_some(()).ok_or(Unsupported);
    }
    match shape.as_typed_shape() {
        TypedShape::HeightField(field) => {
            let near = match margin {
                Some(margin) => bounds.loosened(margin).transform_by(&pose.inverse()),
                None => *field.root_aabb(),
            };
            field.map_elements_in_local_aabb(&near, &mut |id, triangle| part(id, None, triangle));
            Ok(())
        }
        _ => Err(Unsupported),
    }
}

/// Returns `false` if a box of a shape is further than `margin` from the obstacle of a scan.
fn is_near(target: &Target<'_>, bounds: &Aabb, local: &Aabb, pose: &Pose, margin: Real) -> bool {
    if !local.transform_by(pose).loosened(margin).intersects(bounds) {
        return false;
    }
    let centre = Pose::from_parts(pose * local.center(), pose.rotation);
    let solid =
        Shape::Box { pose: crate::from_pose(&centre), half: from_vector(local.half_extents()), radius: 0.0 };
    !with_scratch(|scratch| target.touch(&solid, scratch)).verdict.is_separated()
}
