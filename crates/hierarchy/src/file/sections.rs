//! The hierarchy in a container: one section an array, the rest in the metadata.
//!
//! The sections are declared in `scan/data.rs`. The version of their layout is `VERSION` in
//! `nearmiss/src/scan.rs`.

use std::sync::OnceLock;

use nearmiss_store::{Check, File, Flaw, LoadError, WriteError, Writer};
use nearmiss_surface::SurfacePlan;

use crate::file::sanity::checked_topology;
use crate::scan::build::PointHierarchy;
use crate::scan::data::{Arrays, HierarchyMeta};

impl PointHierarchy {
    /// What is stored beside the arrays.
    #[must_use]
    pub fn meta(&self) -> &HierarchyMeta {
        &self.meta
    }

    /// Adds the arrays to a container.
    ///
    /// # Errors
    /// When the container has sections of these names already.
    pub fn add_to<'a>(&'a self, writer: &mut Writer<'a>) -> Result<(), WriteError> {
        self.arrays.add_to(writer)
    }

    /// The hierarchy in `file`, its arrays in place: nothing is made that grows with the scan. With
    /// [`Check::Structure`] the metadata and the lengths of arrays are looked at, so that no query leaves
    /// them; damaged numbers can give wrong answers. With [`Check::Full`] every number is compared with what
    /// a build writes.
    ///
    /// # Errors
    /// When a section is missing, holds what no build writes, or the sections contradict each other.
    pub fn load(file: &File, meta: HierarchyMeta, check: Check) -> Result<Self, LoadError> {
        let arrays = Arrays::load(file)?;
        let topology = checked_topology(arrays.source.len(), meta.leaf_size, meta.dense)?;
        let plan = SurfacePlan::new(&meta.surface, f64::from(meta.sampling_radius), 1.0 / meta.frame.scale)
            .map_err(Flaw::options)?;
        let hierarchy = Self { meta, plan, topology, arrays, positions: OnceLock::new() };
        hierarchy.check_structure()?;
        if check == Check::Full {
            hierarchy.check_contents()?;
        }
        Ok(hierarchy)
    }
}
