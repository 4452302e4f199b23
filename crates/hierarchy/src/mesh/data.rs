//! The data of a prepared mesh: metadata, and arrays that are each a section of a file. Increase
//! `VERSION` in `nearmiss/src/prepared_mesh.rs` with every change here.

use nearmiss_geometry::{Aabb, Frame};
use nearmiss_store::{Array, File, OpenError, WriteError, Writer};
use serde::{Deserialize, Serialize};

use crate::mesh::block::TriangleBlock;
use crate::scan::outline::Ball;
use crate::tree::wide::{Root, Siblings};

/// The metadata of a prepared mesh: everything stored that is not an array.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MeshMeta {
    pub(crate) frame: Frame,
    pub(crate) bounds: Aabb,
    pub(crate) root: Root,
    pub(crate) ball: Ball,
    /// A hash of all triangles.
    pub(crate) identity: u64,
    /// Number of triangles in the mesh that was prepared.
    pub(crate) given: u32,
    pub(crate) dropped: DroppedTriangles,
}

/// Counts of what a build dropped from a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct DroppedTriangles {
    /// Triangles without area.
    pub degenerate: u32,
    /// Triangles with the same corners as another.
    pub duplicate: u32,
    /// Vertices that were welded to another.
    pub welded_vertices: u32,
}

/// The arrays of a prepared mesh.
#[derive(Debug, Clone, Default)]
pub(crate) struct MeshArrays {
    /// The boxes of the children of each inner node.
    pub(crate) siblings: Array<Siblings>,
    /// The triangles of each leaf, in the form that queries compare.
    pub(crate) blocks: Array<TriangleBlock>,
    /// The vertices in the caller's frame, in the order of their first use.
    pub(crate) vertices: Array<[f64; 3]>,
    /// The vertex indices of each triangle, in leaf order.
    pub(crate) triangles: Array<[u32; 3]>,
    /// The indices of the triangles in the input.
    pub(crate) source: Array<u32>,
    /// The vertex indices of dropped triangles that may connect others.
    pub(crate) seams: Array<[u32; 3]>,
    /// The well-filled cells of each node; empty if they were not counted.
    pub(crate) cells: Array<u8>,
}

impl MeshArrays {
    /// Adds all arrays to a container, one section each.
    pub(crate) fn add_to<'a>(&'a self, writer: &mut Writer<'a>) -> Result<(), WriteError> {
        writer.section(*b"TREE", 0, &self.siblings)?;
        writer.section(*b"LEAF", 0, &self.blocks)?;
        writer.section(*b"VERT", 0, &self.vertices)?;
        writer.section(*b"TRIS", 0, &self.triangles)?;
        writer.section(*b"SRCE", 0, &self.source)?;
        writer.section(*b"SEAM", 0, &self.seams)?;
        writer.section(*b"CELL", 0, &self.cells)?;
        Ok(())
    }

    /// Loads all arrays from a container, in place.
    pub(crate) fn load(file: &File) -> Result<Self, OpenError> {
        Ok(Self {
            siblings: file.array(*b"TREE", 0)?,
            blocks: file.array(*b"LEAF", 0)?,
            vertices: file.array(*b"VERT", 0)?,
            triangles: file.array(*b"TRIS", 0)?,
            source: file.array(*b"SRCE", 0)?,
            seams: file.array(*b"SEAM", 0)?,
            cells: file.array(*b"CELL", 0)?,
        })
    }
}
