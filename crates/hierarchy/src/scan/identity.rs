//! The identity of a scan: a hash of what its answers follow from.

use bytemuck::{bytes_of, cast_slice};
use xxhash_rust::xxh3::Xxh3;

use crate::point::disc::PointCode;
use crate::scan::data::HierarchyMeta;

/// Computes the hash that identifies a scan. `normals` are those of a scan whose normals do not follow
/// from the rest.
pub(crate) fn identity(
    meta: &HierarchyMeta,
    positions: &[[f32; 3]],
    codes: &[PointCode],
    radii: &[f32],
    normals: Option<&[[f32; 3]]>,
) -> u64 {
    let (mut hash, frame) = (Xxh3::new(), &meta.frame);
    hash.update(bytes_of(&[frame.origin[0], frame.origin[1], frame.origin[2], frame.scale]));
    hash.update(bytes_of(&[meta.leaf_size, meta.samples, meta.dense]));
    hash.update(bytes_of(&[meta.sampling_radius, meta.reach]));
    hash.update(cast_slice(positions));
    hash.update(cast_slice(codes));
    hash.update(cast_slice(radii));
    hash.update(normals.map_or(&[], cast_slice));
    hash.digest()
}
