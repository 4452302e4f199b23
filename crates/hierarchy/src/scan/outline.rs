//! The data of a whole scan that a query reads before it visits any node.

use bytemuck::{bytes_of, cast_slice};
use serde::{Deserialize, Serialize};
use xxhash_rust::xxh3::Xxh3;

use crate::bounds::boxes::OrientedBox;
use crate::point::disc::PointCode;
use crate::scan::data::HierarchyMeta;

/// A ball in the stored frame.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Ball {
    /// The centre.
    pub centre: [f64; 3],
    /// The radius.
    pub radius: f64,
}

impl Ball {
    pub(crate) fn about(bounds: &OrientedBox) -> Self {
        Self { centre: bounds.centre.map(f64::from), radius: f64::from(bounds.radius()) }
    }
}

/// The hash that identifies a scan, and its bounding balls.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Outline {
    /// A hash of all points, their frame, their discs and the parameters of the tree.
    pub identity: u64,
    /// Bounding ball of the surface.
    pub surface: Ball,
    /// Bounding ball of the obstacle.
    pub obstacle: Ball,
    /// Bounding ball of the points with their discs.
    pub discs: Ball,
}

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
