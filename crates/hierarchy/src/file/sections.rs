//! The hierarchy in a container: one section for each array, the rest in the metadata.
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
    /// Returns the metadata that are stored beside the arrays.
    #[must_use]
    pub fn meta(&self) -> &HierarchyMeta {
        &self.meta
    }

    /// Adds the arrays to a container.
    ///
    /// # Errors
    /// If the container already has sections of these names.
    pub fn add_to<'a>(&'a self, writer: &mut Writer<'a>) -> Result<(), WriteError> {
        self.arrays.add_to(writer)
    }

    /// Loads the hierarchy in `file`, with its arrays in place: the memory allocated does not grow
    /// with the scan. [`Check::Structure`] validates the metadata and the lengths of arrays, so
    /// that queries stay within them; damaged numbers can give wrong answers. [`Check::Full`] also
    /// validates every number.
    ///
    /// # Errors
    /// If a section is missing, holds values that a build never writes, or contradicts another.
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
