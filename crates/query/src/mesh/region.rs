//! The intersection of two oriented boxes, approximately.

use nearmiss_hierarchy::{NodePair, OrientedBox};
use nearmiss_lanes::vector::{dot, sub};

use crate::mesh::answer::ContactRegion;
use crate::mesh::mesh_pair::MeshPairing;

/// The interval along each axis of `own` that `own` and `other` have in common, relative to the centre
/// of `own`. `cosines` has the magnitudes of the products of own axes with the others.
fn common(own: &OrientedBox, other: &OrientedBox, cosines: &[[f32; 3]; 3]) -> [[f32; 2]; 3] {
    let d = sub(other.centre, own.centre);
    let mut parts = [[0.0; 2]; 3];
    for k in 0..3 {
        let (middle, reach) = (dot(own.axes[k], d), dot(other.half, cosines[k]));
        let low = (-own.half[k]).max(middle - reach);
        parts[k] = [low, own.half[k].min(middle + reach).max(low)];
    }
    parts
}

/// The intersection of the boxes of two nodes: the smaller of the parts that the boxes cut out of
/// each other.
pub(crate) fn region(pair: &MeshPairing<'_>, nodes: NodePair) -> ContactRegion {
    let a = pair.a.tree.bounds(nodes.a);
    let b = pair.relative.moved(&pair.b.tree.bounds(nodes.b));
    let (mut cosines, mut transposed) = ([[0.0; 3]; 3], [[0.0; 3]; 3]);
    for i in 0..3 {
        for j in 0..3 {
            cosines[i][j] = dot(a.axes[i], b.axes[j]).abs();
            transposed[j][i] = cosines[i][j];
        }
    }
    let parts = [(&a, common(&a, &b, &cosines)), (&b, common(&b, &a, &transposed))];
    let radius = |part: &[[f32; 2]; 3]| {
        let half = part.map(|[low, high]| 0.5 * (high - low));
        dot(half, half).sqrt()
    };
    let [p, q] = parts.each_ref().map(|(_, part)| radius(part));
    let (own, part) = if p <= q { &parts[0] } else { &parts[1] };
    let mut centre = own.centre;
    for (axis, [low, high]) in own.axes.iter().zip(part) {
        for j in 0..3 {
            centre[j] += 0.5 * (low + high) * axis[j];
        }
    }
    let placed = pair.meshes[0].stored_to_world();
    ContactRegion {
        centre: placed.apply(centre.map(f64::from)),
        radius: f64::from(p.min(q)) * placed.scale(),
    }
}
