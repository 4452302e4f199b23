//! The data of a prepared scan: metadata, and arrays that are each a section of a file. Increase
//! `VERSION` in `nearmiss/src/scan.rs` with every change here.

use nearmiss_geometry::{Aabb, Dropped, Frame};
use nearmiss_index::PointBlock;
use nearmiss_store::{Array, File, OpenError, WriteError, Writer};
use nearmiss_surface::{Metric, SurfaceOptions};
use serde::{Deserialize, Serialize};

use crate::patch::covering::Covering;
use crate::point::disc::PointCode;
use crate::point::gather::NeighbourList;
use crate::point::leaf_block::LeafBlock;
use crate::scan::outline::Outline;
use crate::tree::wide::{Growths, Lanes, Root, Siblings};

/// The metadata of a hierarchy: everything stored that is not an array.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HierarchyMeta {
    pub(crate) frame: Frame,
    pub(crate) bounds: Aabb,
    pub(crate) dropped: Dropped,
    pub(crate) step: f64,
    pub(crate) sampling_radius: f32,
    pub(crate) reach: f32,
    pub(crate) dense: u32,
    pub(crate) leaf_size: u32,
    pub(crate) radius_neighbours: u32,
    pub(crate) samples: u32,
    pub(crate) is_oriented: bool,
    pub(crate) metric: Metric,
    pub(crate) surface: SurfaceOptions,
    pub(crate) root: Root,
    pub(crate) outline: Outline,
}

/// Declares the arrays of a scan with the tags and the parts of their sections, in the order of a
/// file.
macro_rules! arrays {
    ($($(#[$doc:meta])* $name:ident: [$of:ty] = $tag:literal $part:literal,)*) => {
        /// The arrays of a scan.
        #[derive(Debug, Clone, Default)]
        pub(crate) struct Arrays {
            $($(#[$doc])* pub(crate) $name: Array<$of>,)*
        }

        impl Arrays {
            /// Adds all arrays to a container, one section each.
            pub(crate) fn add_to<'a>(&'a self, writer: &mut Writer<'a>) -> Result<(), WriteError> {
                $(writer.section(*$tag, $part, &self.$name)?;)*
                Ok(())
            }

            /// Loads all arrays from a container, in place.
            pub(crate) fn load(file: &File) -> Result<Self, OpenError> {
                Ok(Self { $($name: file.array(*$tag, $part)?,)* })
            }
        }
    };
}

arrays! {
    /// The boxes of the children of each inner node.
    siblings: [Siblings] = b"TREE" 0,
    /// The greatest local radius of the points under the same children.
    reaches: [Lanes] = b"REAC" 0,
    /// The growths of the children's enclosures of the surface.
    surface_growths: [Growths] = b"GROW" 0,
    /// The growths of the children's enclosures of the obstacle.
    obstacle_growths: [Growths] = b"GROW" 1,
    /// The discs of each leaf, in the form that queries compare.
    leaf_blocks: [LeafBlock] = b"LEAF" 0,
    /// The marks of each leaf: it has sparse points, it has balls, it is loose.
    marks: [u8] = b"MARK" 0,
    /// The positions and support radii of the points.
    blocks: [PointBlock] = b"BLCK" 0,
    /// The samples of each inner node.
    sample_lists: [u32] = b"SMPL" 0,
    /// The sphere covering of each node.
    coverings: [Covering] = b"COVR" 0,
    /// A ball around each block and its support.
    groups: [PointBlock] = b"GRUP" 0,
    /// The neighbour list of each block.
    lists: [NeighbourList] = b"LIST" 0,
    /// The entries of all neighbour lists.
    listed: [u32] = b"NEAR" 0,
    /// The normals of the points.
    normals: [[f32; 3]] = b"NRML" 0,
    /// The local radii of the points.
    radii: [f32] = b"RADI" 0,
    /// The kinds of the points and the borders near them. With the radii they determine the radii
    /// of the discs.
    codes: [PointCode] = b"KIND" 0,
    /// The indices of the points in the input.
    source: [u32] = b"SRCE" 0,
}
