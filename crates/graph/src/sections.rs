//! The graph in a container: one section an array, the rest in the metadata.

use nearmiss_store::{Check, File, Flaw, LoadError, WriteError, Writer};
use serde::{Deserialize, Serialize};

use crate::adjacency::Adjacency;
use crate::graph::PointGraph;
use crate::options::GraphOptions;

/// Part 0 is of edges on the surface, part 1 of virtual ones.
const STARTS: [u8; 4] = *b"ESTA";
const NEIGHBOURS: [u8; 4] = *b"EDGE";
const RADII: [u8; 4] = *b"INFL";
const REACHES: [u8; 4] = *b"RECH";
const COMPONENTS: [u8; 4] = *b"COMP";
const BORDERS: [u8; 4] = *b"BORD";

/// What a graph stores beside its arrays.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct GraphMeta {
    options: GraphOptions,
    components: u32,
}

impl PointGraph {
    /// What is stored beside the arrays.
    #[must_use]
    pub fn meta(&self) -> GraphMeta {
        GraphMeta { options: self.options, components: self.component_count }
    }

    /// Adds the arrays to a container.
    ///
    /// # Errors
    /// When the container has sections of these names already.
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

    /// The graph over `points` points in `file`, its arrays in place. With either `check` the structure is
    /// looked through: lengths agree, and every point and edge named is there, so that no use of the graph
    /// can fail. With [`Check::Full`] each edge also stands with both of its ends, and numbers are such as a
    /// build writes.
    ///
    /// # Errors
    /// When a section is missing, holds what no build writes, or the sections contradict each other.
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
