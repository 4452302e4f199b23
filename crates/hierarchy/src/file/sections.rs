//! The hierarchy in a container: one section an array, the rest in the metadata.
//!
//! The version of this layout is `VERSION` in `nearmiss/src/scan.rs`; raise it with every change here.

use std::sync::OnceLock;

use nearmiss_geometry::{Aabb, Dropped, Frame};
use nearmiss_store::{Array, Check, File, Flaw, LoadError, WriteError, Writer};
use nearmiss_surface::{Metric, SurfaceOptions, SurfacePlan};
use serde::{Deserialize, Serialize};

use crate::file::sanity::checked_topology;
use crate::scan::build::PointHierarchy;
use crate::scan::outline::Outline;
use crate::tree::wide::Root;

const NORMALS: [u8; 4] = *b"NRML";
const RADII: [u8; 4] = *b"RADI";
const DISCS: [u8; 4] = *b"DISC";
const KINDS: [u8; 4] = *b"KIND";
const SOURCE: [u8; 4] = *b"SRCE";
const SIBLINGS: [u8; 4] = *b"TREE";
/// One for each [`Part`](crate::Part).
const GROWTHS: [u8; 4] = *b"GROW";
const LEAVES: [u8; 4] = *b"LEAF";
const MARKS: [u8; 4] = *b"MARK";
const BLOCKS: [u8; 4] = *b"BLCK";
const SAMPLES: [u8; 4] = *b"SMPL";
const COVERINGS: [u8; 4] = *b"COVR";
const GROUPS: [u8; 4] = *b"GRUP";
const LISTS: [u8; 4] = *b"LIST";
const LISTED: [u8; 4] = *b"NEAR";

/// What a hierarchy stores beside its arrays.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HierarchyMeta {
    frame: Frame,
    bounds: Aabb,
    dropped: Dropped,
    step: f64,
    sampling_radius: f32,
    reach: f32,
    dense: u32,
    leaf_size: u32,
    radius_neighbours: u32,
    samples: u32,
    is_oriented: bool,
    metric: Metric,
    surface: SurfaceOptions,
    root: Root,
    outline: Outline,
}

impl PointHierarchy {
    /// What is stored beside the arrays.
    #[must_use]
    pub fn meta(&self) -> HierarchyMeta {
        HierarchyMeta {
            frame: self.frame,
            bounds: self.bounds,
            dropped: self.dropped,
            step: self.step,
            sampling_radius: self.sampling_radius,
            reach: self.reach,
            dense: self.dense,
            leaf_size: self.leaf_size,
            radius_neighbours: self.radius_neighbours,
            samples: self.samples_a_node,
            is_oriented: self.is_oriented,
            metric: self.metric,
            surface: *self.plan.options(),
            root: self.root,
            outline: self.outline,
        }
    }

    /// Adds the arrays to a container.
    ///
    /// # Errors
    /// When the container has sections of these names already.
    pub fn add_to<'a>(&'a self, writer: &mut Writer<'a>) -> Result<(), WriteError> {
        writer
            .section(SIBLINGS, 0, &self.siblings)?
            .section(GROWTHS, 0, &self.growths[0])?
            .section(GROWTHS, 1, &self.growths[1])?
            .section(LEAVES, 0, &self.leaf_blocks)?
            .section(MARKS, 0, &self.marks)?
            .section(BLOCKS, 0, &self.blocks)?
            .section(SAMPLES, 0, &self.sample_lists)?
            .section(COVERINGS, 0, &self.coverings)?
            .section(GROUPS, 0, &self.groups)?
            .section(LISTS, 0, &self.lists)?
            .section(LISTED, 0, &self.listed)?
            .section(NORMALS, 0, &self.normals)?
            .section(RADII, 0, &self.radii)?
            .section(DISCS, 0, &self.discs)?
            .section(KINDS, 0, &self.kinds)?
            .section(SOURCE, 0, &self.source)?;
        Ok(())
    }

    /// The hierarchy in `file`, its arrays in place: nothing is made that grows with the scan. With
    /// [`Check::Structure`] the metadata and the lengths of arrays are looked at, so that no query leaves
    /// them; damaged numbers can give wrong answers. With [`Check::Full`] every number is compared with what
    /// a build writes.
    ///
    /// # Errors
    /// When a section is missing, holds what no build writes, or the sections contradict each other.
    pub fn load(file: &File, meta: HierarchyMeta, check: Check) -> Result<Self, LoadError> {
        let source: Array<u32> = file.array(SOURCE, 0)?;
        let plan = SurfacePlan::new(&meta.surface, f64::from(meta.sampling_radius), 1.0 / meta.frame.scale);
        let topology = checked_topology(source.len(), meta.leaf_size, meta.dense)?;
        let hierarchy = Self {
            frame: meta.frame,
            bounds: meta.bounds,
            dropped: meta.dropped,
            step: meta.step,
            sampling_radius: meta.sampling_radius,
            reach: meta.reach,
            dense: meta.dense,
            leaf_size: meta.leaf_size,
            radius_neighbours: meta.radius_neighbours,
            samples_a_node: meta.samples,
            is_oriented: meta.is_oriented,
            metric: meta.metric,
            plan: plan.map_err(Flaw::options)?,
            positions: OnceLock::new(),
            normals: file.array(NORMALS, 0)?,
            radii: file.array(RADII, 0)?,
            discs: file.array(DISCS, 0)?,
            kinds: file.array(KINDS, 0)?,
            source,
            topology,
            root: meta.root,
            siblings: file.array(SIBLINGS, 0)?,
            growths: [file.array(GROWTHS, 0)?, file.array(GROWTHS, 1)?],
            leaf_blocks: file.array(LEAVES, 0)?,
            marks: file.array(MARKS, 0)?,
            outline: meta.outline,
            sample_lists: file.array(SAMPLES, 0)?,
            coverings: file.array(COVERINGS, 0)?,
            blocks: file.array(BLOCKS, 0)?,
            groups: file.array(GROUPS, 0)?,
            lists: file.array(LISTS, 0)?,
            listed: file.array(LISTED, 0)?,
        };
        hierarchy.check_structure()?;
        if check == Check::Full {
            hierarchy.check_contents()?;
        }
        Ok(hierarchy)
    }
}
