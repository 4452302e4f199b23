//! The hierarchy in a container: one section an array, the rest in the metadata.

use nearmiss_geometry::{Aabb, Dropped, Frame};
use nearmiss_store::{Array, Check, File, OpenError, WriteError, Writer};
use nearmiss_surface::{Metric, SurfaceError, SurfaceOptions, SurfacePlan};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::build::PointHierarchy;
use crate::neighbours::blocks;
use crate::outline::Outline;
use crate::sanity::Flaw;
use crate::wide::WideTree;

const POSITIONS: [u8; 4] = *b"PNTS";
const NORMALS: [u8; 4] = *b"NRML";
const RADII: [u8; 4] = *b"RADI";
const DISCS: [u8; 4] = *b"DISC";
const KINDS: [u8; 4] = *b"KIND";
const SOURCE: [u8; 4] = *b"SRCE";
const NODES: [u8; 4] = *b"NODE";
const BOXES: [u8; 4] = *b"BOXS";
const GROWTHS: [u8; 4] = *b"GROW";
const OBSTACLE_GROWTHS: [u8; 4] = *b"OBST";
const SAMPLES: [u8; 4] = *b"SMPL";
const COVERINGS: [u8; 4] = *b"COVR";
const CONES: [u8; 4] = *b"CONE";
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
}

/// Why a container does not hold a hierarchy.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum LoadError {
    /// A section is missing or damaged.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// The surface is defined by numbers out of range.
    #[error("{0}; prepare the scan again")]
    Surface(#[from] SurfaceError),
    /// The sections contradict each other.
    #[error(transparent)]
    Flaw(#[from] Flaw),
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
        }
    }

    /// Adds the arrays to a container.
    ///
    /// # Errors
    /// When the container has sections of these names already.
    pub fn add_to<'a>(&'a self, writer: &mut Writer<'a>) -> Result<(), WriteError> {
        writer
            .section(NODES, 0, &self.nodes)?
            .section(BOXES, 0, &self.boxes)?
            .section(GROWTHS, 0, &self.growths)?
            .section(OBSTACLE_GROWTHS, 0, &self.obstacle_growths)?
            .section(SAMPLES, 0, &self.sample_lists)?
            .section(COVERINGS, 0, &self.coverings)?
            .section(CONES, 0, &self.cones)?
            .section(GROUPS, 0, &self.groups)?
            .section(LISTS, 0, &self.lists)?
            .section(LISTED, 0, &self.listed)?
            .section(POSITIONS, 0, &self.positions)?
            .section(NORMALS, 0, &self.normals)?
            .section(RADII, 0, &self.radii)?
            .section(DISCS, 0, &self.discs)?
            .section(KINDS, 0, &self.kinds)?
            .section(SOURCE, 0, &self.source)?;
        Ok(())
    }

    /// The hierarchy in `file`, its arrays in place. With either `check` the structure is looked through:
    /// lengths agree, every node's children and points are there, numbers of boxes and lists lie in their
    /// ranges. With [`Check::Full`] each box also lies within its parent's, and the numbers of every point
    /// are looked at.
    ///
    /// # Errors
    /// When a section is missing, holds what no build writes, or the sections contradict each other.
    pub fn load(file: &File, meta: HierarchyMeta, check: Check) -> Result<Self, LoadError> {
        let mut hierarchy = Self {
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
            plan: SurfacePlan::new(&meta.surface, f64::from(meta.sampling_radius), 1.0 / meta.frame.scale)?,
            positions: file.array(POSITIONS, 0)?,
            normals: file.array(NORMALS, 0)?,
            radii: file.array(RADII, 0)?,
            discs: file.array(DISCS, 0)?,
            kinds: file.array(KINDS, 0)?,
            source: file.array(SOURCE, 0)?,
            nodes: file.array(NODES, 0)?,
            boxes: file.array(BOXES, 0)?,
            wide: WideTree::default(),
            outline: Outline::default(),
            growths: file.array(GROWTHS, 0)?,
            obstacle_growths: file.array(OBSTACLE_GROWTHS, 0)?,
            sample_lists: file.array(SAMPLES, 0)?,
            coverings: file.array(COVERINGS, 0)?,
            cones: file.array(CONES, 0)?,
            blocks: Array::default(),
            groups: file.array(GROUPS, 0)?,
            lists: file.array(LISTS, 0)?,
            listed: file.array(LISTED, 0)?,
        };
        hierarchy.check_structure()?;
        // They say nothing that points and radii do not.
        hierarchy.blocks = blocks(&hierarchy.plan, &hierarchy.positions, &hierarchy.radii).into();
        hierarchy.derive();
        if check == Check::Full {
            hierarchy.check_contents()?;
        }
        Ok(hierarchy)
    }
}
