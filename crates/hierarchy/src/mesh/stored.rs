//! A prepared mesh in a container, and the checks of a load.

use nearmiss_geometry::{Aabb, Frame};
use nearmiss_lanes::id32;
use nearmiss_lanes::parallel::ranges;
use nearmiss_store::{Check, File, Flaw, LoadError, WriteError, Writer};

use crate::bounds::cells::CELLS;
use crate::file::sanity::{check_boxes, frame_is_valid, is_in_range};
use crate::mesh::block::{LEAF_TRIANGLES, TriangleBlock};
use crate::mesh::build::MeshHierarchy;
use crate::mesh::data::{MeshArrays, MeshMeta};
use crate::scan::outline::Ball;
use crate::tree::topology::Topology;

impl MeshHierarchy {
    /// Returns the metadata that are stored beside the arrays.
    #[must_use]
    pub fn meta(&self) -> &MeshMeta {
        &self.meta
    }

    /// Adds the arrays to a container.
    ///
    /// # Errors
    /// If the container already has sections of these names.
    pub fn add_to<'a>(&'a self, writer: &mut Writer<'a>) -> Result<(), WriteError> {
        self.arrays.add_to(writer)
    }

    /// Loads the mesh in `file`, with its arrays in place. [`Check::Structure`] validates the
    /// metadata and the lengths of arrays, so that queries stay within them; damaged numbers can
    /// give wrong answers. [`Check::Full`] also validates every number.
    ///
    /// # Errors
    /// If a section is missing, holds values that a build never writes, or contradicts another.
    pub fn load(file: &File, meta: MeshMeta, check: Check) -> Result<Self, LoadError> {
        let arrays = MeshArrays::load(file)?;
        let Some(count) = u32::try_from(arrays.triangles.len()).ok().filter(|&count| count > 0) else {
            return Err(Flaw::Metadata { what: "the number of triangles" }.into());
        };
        let topology = Topology::new(count, id32(LEAF_TRIANGLES));
        let mesh = Self { meta, topology, arrays };
        mesh.check_structure()?;
        if check == Check::Full {
            mesh.check_contents()?;
        }
        Ok(mesh)
    }

    /// Checks what queries need to stay within their arrays and to terminate. O(1).
    fn check_structure(&self) -> Result<(), Flaw> {
        let (arrays, topology) = (&self.arrays, &self.topology);
        Flaw::length("boxes", arrays.siblings.len(), topology.inner())?;
        Flaw::length("leaves", arrays.blocks.len(), topology.leaves())?;
        Flaw::length("source", arrays.source.len(), self.len())?;
        if !arrays.cells.is_empty() {
            Flaw::length("cells", arrays.cells.len(), topology.len())?;
        }
        let Aabb { min, max } = self.meta.bounds;
        let what = if !frame_is_valid(&self.meta.frame) {
            "the frame of the stored positions"
        } else if !(0..3).all(|k| min[k].is_finite() && max[k].is_finite() && min[k] <= max[k]) {
            "the box of bounds"
        } else if !is_in_range(&self.meta.root.bounds) {
            "the box of the root"
        } else {
            return Ok(());
        };
        Err(Flaw::Metadata { what })
    }

    /// Checks that every triangle has a place of its own in an input of `given` triangles.
    fn check_sources(&self, given: u32) -> Result<(), Flaw> {
        const WHAT: &str = "the place in the input of triangle";
        Flaw::first(WHAT, self.arrays.source.iter().position(|&place| place >= given))?;
        let mut order: Vec<usize> = (0..self.len()).collect();
        order.sort_by_key(|&i| (self.arrays.source[i], i));
        let is_same = |two: &&[usize]| self.arrays.source[two[0]] == self.arrays.source[two[1]];
        Flaw::first(WHAT, order.windows(2).find(is_same).map(|two| two[1]))
    }

    /// Checks what correct answers need in addition, given a valid structure: boxes within their
    /// parents', leaves that hold their triangles, vertices within the bounds. One pass over the
    /// whole.
    ///
    /// # Errors
    /// Names the first value that a build would not have written.
    pub fn check_contents(&self) -> Result<(), Flaw> {
        let MeshMeta { frame, bounds, root, given, .. } = &self.meta;
        check_boxes(&self.arrays().tree)?;
        let (vertices, triangles) = (&*self.arrays.vertices, &*self.arrays.triangles);
        Flaw::first("vertex", vertices.iter().position(|p| !bounds.contains(*p)))?;
        let is_known = |t: &[u32; 3]| t.iter().all(|&v| (v as usize) < vertices.len());
        Flaw::first("triangle", triangles.iter().position(|t| !is_known(t)))?;
        self.check_sources(*given)?;
        let wrong = self.arrays.cells.iter().position(|&count| !(1..=CELLS).contains(&count));
        Flaw::first("the number of filled cells of node", wrong)?;
        if *bounds != Aabb::of(vertices.iter().copied()) || *frame != Frame::around(bounds.min, bounds.max) {
            return Err(Flaw::Metadata { what: "the box of bounds" });
        }
        if self.meta.ball != Ball::about(&root.bounds) {
            return Err(Flaw::Metadata { what: "the ball around the mesh" });
        }
        if self.meta.identity != self.hashed() {
            return Err(Flaw::Metadata { what: "the hash of the mesh" });
        }
        let tree = self.arrays().tree;
        let found = ranges(self.topology.leaves(), |numbers| {
            for number in numbers {
                let own = self.topology.points_of_leaf(number);
                let corners: Vec<_> =
                    own.map(|i| triangles[i].map(|v| frame.to_local(vertices[v as usize]))).collect();
                if self.arrays.blocks[number] != TriangleBlock::new(&corners) {
                    return Err(Flaw::Value { what: "leaf", index: number });
                }
                // A box may lie within its parent's and still be too small for its triangles.
                let mut node = Some(self.topology.leaf(number));
                while let Some(id) = node {
                    if !tree.bounds(id).holds(corners.iter().flatten().copied()) {
                        return Err(Flaw::Value { what: "the box of node", index: id.index() });
                    }
                    node = self.topology.parent(id).map(|(parent, _)| parent);
                }
            }
            Ok(())
        });
        found.into_iter().collect()
    }
}
