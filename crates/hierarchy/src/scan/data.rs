//! The data of a prepared scan: metadata, and arrays that are each a section of a file. Raise `VERSION` in
//! `nearmiss/src/scan.rs` with every change here.

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
use crate::tree::wide::{Growths, Root, Siblings};

/// The metadata of a hierarchy: everything stored that is no array.
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

/// Declares the arrays of a scan with the tags and the parts of their sections, in the order of a file.
macro_rules! arrays {
    ($($(#[$doc:meta])* $name:ident: [$of:ty] = $tag:literal $part:literal,)*) => {
        /// The arrays of a scan.
        #[derive(Debug, Clone, Default)]
        pub(crate) struct Arrays {
            $($(#[$doc])* pub(crate) $name: Array<$of>,)*
        }

        impl Arrays {
            /// Adds all to a container, a section each.
            pub(crate) fn add_to<'a>(&'a self, writer: &mut Writer<'a>) -> Result<(), WriteError> {
                $(writer.section(*$tag, $part, &self.$name)?;)*
                Ok(())
            }

            /// Loads all from a container, in place.
            pub(crate) fn load(file: &File) -> Result<Self, OpenError> {
                Ok(Self { $($name: file.array(*$tag, $part)?,)* })
            }
        }
    };
}

arrays! {
    /// The boxes of the children of each inner node.
    siblings: [Siblings] = b"TREE" 0,
    /// The lengths by which their enclosures of the surface exceed those boxes.
    surface_growths: [Growths] = b"GROW" 0,
    /// The lengths by which their enclosures of the obstacle exceed them.
    obstacle_growths: [Growths] = b"GROW" 1,
    /// The discs of each leaf, as queries compare them.
    leaf_blocks: [LeafBlock] = b"LEAF" 0,
    /// The marks of each leaf: whether it holds sparse points or balls, and whether it is loose.
    marks: [u8] = b"MARK" 0,
    /// The positions and the horizons of the points.
    blocks: [PointBlock] = b"BLCK" 0,
    /// The samples of each inner node.
    sample_lists: [u32] = b"SMPL" 0,
    /// The sphere covering of each node.
    coverings: [Covering] = b"COVR" 0,
    /// A ball about each block.
    groups: [PointBlock] = b"GRUP" 0,
    /// The neighbour list of each block.
    lists: [NeighbourList] = b"LIST" 0,
    /// The entries of all lists.
    listed: [u32] = b"NEAR" 0,
    /// The normals of the points.
    normals: [[f32; 3]] = b"NRML" 0,
    /// Their local radii.
    radii: [f32] = b"RADI" 0,
    /// Their kinds and the borders near them, from which with the radii those of their discs follow.
    codes: [PointCode] = b"KIND" 0,
    /// Their indices in the input.
    source: [u32] = b"SRCE" 0,
}
