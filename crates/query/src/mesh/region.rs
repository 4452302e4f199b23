//! The intersection of two oriented boxes, approximately.

use nearmiss_hierarchy::{NodePair, OrientedBox};
use nearmiss_lanes::vector::{dot, sub};

use crate::mesh::answer::ContactRegion;
use crate::mesh::mesh_pair::MeshPairing;

/// The part of `own` that is within the extents of `other` along the axes of `own`.
fn cut(own: &OrientedBox, other: &OrientedBox) -> OrientedBox {
    let d = sub(other.centre, own.centre);
    let mut part = *own;
    for k in 0..3 {
        let axis = own.axes[k];
        let middle = dot(axis, d);
        let reach: f32 = (0..3).map(|j| other.half[j] * dot(axis, other.axes[j]).abs()).sum();
        let (low, high) = ((-own.half[k]).max(middle - reach), own.half[k].min(middle + reach));
        part.half[k] = 0.5 * (high - low).max(0.0);
        for j in 0..3 {
            part.centre[j] += 0.5 * (low + high) * axis[j];
        }
    }
    part
}

/// The intersection of the boxes of two nodes: the smaller of the parts that the boxes cut out of
/// each other.
pub(crate) fn region(pair: &MeshPairing<'_>, nodes: NodePair) -> ContactRegion {
    let a = pair.a.tree.bounds(nodes.a);
    let b = pair.relative.moved(&pair.b.tree.bounds(nodes.b));
    let parts = [cut(&a, &b), cut(&b, &a)];
    let [p, q] = parts.map(|part| part.radius());
    let part = if p <= q { parts[0] } else { parts[1] };
    let placed = pair.meshes[0].stored_to_world();
    ContactRegion {
        centre: placed.apply(part.centre.map(f64::from)),
        radius: f64::from(part.radius()) * placed.scale(),
    }
}
