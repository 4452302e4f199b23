//! The curves on which the contacts of two meshes lie.

use nearmiss_geometry::Aabb;
use nearmiss_lanes::id32;

use crate::clash::components::{components, numbered};
use crate::mesh::answer::MeshContact;
use crate::mesh::solid::Parts;

/// Ends of segments are the same if they are at most this share of the greatest coordinate apart, or that
/// share of the size of all contacts. They are computed from different triangles, and rounded, also in the
/// frames of the meshes, where coordinates may be greater.
const SAME: [f64; 2] = [1e-12, 1e-8];

/// The sine of the angle of triangles in one plane, at most.
const FLAT: f64 = 1e-9;

/// Returns the number of the connected curve of each contact, counted from 0 in the order of their first
/// contacts.
///
/// Segments that share an end are connected: where a curve crosses an edge of a mesh, it ends on one triangle
/// and begins on the next one at the same place. Triangles in one plane have an area in common instead; their
/// contacts are connected if their middles are no further apart than the widest of these areas.
pub(crate) fn curves(contacts: &[MeshContact]) -> Vec<usize> {
    let ends: Vec<[f64; 3]> = contacts.iter().flat_map(|contact| contact.ends).collect();
    let far = ends.as_flattened().iter().fold(0.0_f64, |far, x| far.max(x.abs()));
    let size = Aabb::of(ends.iter().copied()).half_extents().into_iter().fold(0.0, f64::hypot);
    let same = if contacts.is_empty() { 0.0 } else { (SAME[0] * far).max(SAME[1] * size) };
    let mut sets = Parts::new(contacts.len());
    join_by(&components(&ends, same), &mut sets, |end| id32(end / 2));

    let flat: Vec<usize> = (0..contacts.len()).filter(|&i| is_flat(&contacts[i])).collect();
    let middles: Vec<[f64; 3]> = flat.iter().map(|&i| contacts[i].point).collect();
    let width =
        |i: &usize| 2.0 * Aabb::of(contacts[*i].ends).half_extents().into_iter().fold(0.0, f64::hypot);
    let widest = flat.iter().map(width).fold(0.0, f64::max);
    join_by(&components(&middles, widest), &mut sets, |k| id32(flat[k]));

    numbered(contacts.len(), |i| sets.root(id32(i)) as usize)
}

/// Joins the items with equal numbers. `contact` returns the contact of an item.
fn join_by(numbers: &[usize], sets: &mut Parts, contact: impl Fn(usize) -> u32) {
    let mut first = vec![None; numbers.len()];
    for (item, &number) in numbers.iter().enumerate() {
        sets.join(*first[number].get_or_insert(contact(item)), contact(item));
    }
}

/// Returns `true` if the triangles of a contact are in one plane.
fn is_flat(contact: &MeshContact) -> bool {
    let [[a, b, c], [d, e, f]] = contact.normals;
    let sine = [b * f - c * e, c * d - a * f, a * e - b * d].into_iter().fold(0.0, f64::hypot);
    sine <= FLAT
}
