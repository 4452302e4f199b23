//! Storage of the graph in a container: one section for each array, the rest in the metadata.

use nearmiss_store::{Check, File, Flaw, LoadError, WriteError, Writer};
use serde::{Deserialize, Serialize};

use crate::adjacency::Adjacency;
use crate::graph::PointGraph;
use crate::options::GraphOptions;

/// Part 0 holds edges on the surface, part 1 virtual edges.
const STARTS: [u8; 4] = *b"ESTA";
const NEIGHBOURS: [u8; 4] = *b"EDGE";
const RADII: [u8; 4] = *b"INFL";
const REACHES: [u8; 4] = *b"RECH";
const COMPONENTS: [u8; 4] = *b"COMP";
const BORDERS: [u8; 4] = *b"BORD";

/// Metadata of a graph: everything except the arrays.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct GraphMeta {
    options: GraphOptions,
    components: u32,
}

impl PointGraph {
    /// Returns the metadata.
    #[must_use]
    pub fn meta(&self) -> GraphMeta {
        GraphMeta { options: self.options, components: self.component_count }
    }

    /// Adds the arrays to a container.
    ///
    /// # Errors
    /// Fails if the container already has sections of these names.
    pub fn add_to<'a>(&'a self, writer: &mut Writer<'a>) -> Result<(), WriteError> {
        for (part, adjacency) in [(0, &self.edges), (1, &self.virtual_edges)] {
            writer.section(STARTS, part, &adjacency.starts)?.section(
                NEIGHBOURS,
                part,
                &adjacency.neighbours,
            )?;
        }
        writer
            .section(RADII, 0, &self.radii)?
            .section(REACHES, 0, &self.reaches)?
            .section(COMPONENTS, 0, &self.components)?
            .section(BORDERS, 0, &self.borders)?;
        Ok(())
    }

    /// Loads the graph over `points` points from `file` without copying arrays.
    ///
    /// With either `check` the structure is validated in one pass: lengths agree, and all indices
    /// are in range, so that no method fails afterwards. [`Check::Full`] also checks that each edge
    /// is stored at both ends, and that a build could have written every number.
    ///
    /// # Errors
    /// Fails if a section is missing, holds values that no build writes, or contradicts another
    /// section.
    pub fn load(file: &File, meta: GraphMeta, points: usize, check: Check) -> Result<Self, LoadError> {
        meta.options.check().map_err(Flaw::options)?;
        let adjacency = |part| -> Result<Adjacency, LoadError> {
            Ok(Adjacency { starts: file.array(STARTS, part)?, neighbours: file.array(NEIGHBOURS, part)? })
        };
        let graph = Self {
            options: meta.options,
            edges: adjacency(0)?,
            virtual_edges: adjacency(1)?,
            radii: file.array(RADII, 0)?,
            reaches: file.array(REACHES, 0)?,
            components: file.array(COMPONENTS, 0)?,
            borders: file.array(BORDERS, 0)?,
            component_count: meta.components,
        };
        graph.check_structure(points)?;
        if check == Check::Full {
            graph.check_contents()?;
        }
        Ok(graph)
    }
}
