//! The proximity graph of a scan, with what follows from it.

use nearmiss_lanes::parallel::map;
use nearmiss_store::Array;
use serde::{Deserialize, Serialize};

use crate::adjacency::Adjacency;
use crate::border::borders;
use crate::components::components;
use crate::influence::{distance, influence, radii_sq};
use crate::options::{GraphError, GraphOptions, Prune, check_positions};
use crate::prune::split;

/// Who is whose neighbour on the surface: the r-SIG of S1 §3.2 without its long edges.
///
/// Long edges are kept as *virtual* (S1 §4.5): a search may follow them, the surface does not. Points go by
/// their place in the order that the graph was built from; lengths are in the units of those positions.
#[derive(Debug, Clone)]
pub struct PointGraph {
    pub(crate) options: GraphOptions,
    pub(crate) edges: Adjacency,
    pub(crate) virtual_edges: Adjacency,
    pub(crate) radii: Array<f32>,
    pub(crate) reaches: Array<f32>,
    pub(crate) components: Array<u32>,
    pub(crate) borders: Array<u8>,
    pub(crate) component_count: u32,
}

/// What there is to say of a graph in numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct GraphCounts {
    /// Points.
    pub points: usize,
    /// Edges on the surface.
    pub edges: usize,
    /// Edges that were pruned from it.
    pub virtual_edges: usize,
    /// Parts that no edge joins, virtual ones not counted.
    pub components: usize,
    /// Points at a border.
    pub border: usize,
}

impl PointGraph {
    /// The graph over distinct `positions`, in an order in which near ones are mostly near, as a hierarchy's
    /// is; in others it is the same and takes longer.
    ///
    /// O(n log n) in such orders, as the number of edges is O(r n); on all cores with the feature `rayon`,
    /// and the same on any number of them.
    ///
    /// # Errors
    /// When an option is out of range, a coordinate not finite or beyond ±1e18, or there are too many edges.
    pub fn build(positions: &[[f32; 3]], options: &GraphOptions) -> Result<Self, GraphError> {
        options.check()?;
        check_positions(positions)?;
        let radii_sq = radii_sq(positions, options.neighbours);
        let all = influence(positions, &radii_sq)?;
        let (edges, virtual_edges) = match options.prune {
            Prune::Never => {
                let none = Adjacency::from_edges(positions.len(), &[]);
                (all, none)
            }
            Prune::Quartiles(k) => split(positions, &all, k)?,
        };
        #[expect(clippy::cast_possible_truncation, reason = "radii are stored in single precision")]
        let reaches = map(positions.len(), |i| {
            let lengths = edges.of(i).iter().map(|&j| distance(positions[i], positions[j as usize]));
            lengths.fold(0.0, f64::max) as f32
        });
        let (labels, count) = components(&edges);
        let borders = borders(positions, &edges);
        Ok(Self {
            options: *options,
            edges,
            virtual_edges,
            radii: radii_sq.iter().map(|sq| sq.sqrt()).collect::<Vec<f32>>().into(),
            reaches: reaches.into(),
            components: labels.into(),
            borders: borders.into(),
            #[expect(clippy::cast_possible_truncation, reason = "no more than points")]
            component_count: count as u32,
        })
    }

    /// Number of points.
    #[must_use]
    pub fn len(&self) -> usize {
        self.edges.len()
    }

    /// Whether there are no points.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.edges.is_empty()
    }

    /// What it was built with.
    #[must_use]
    pub fn options(&self) -> &GraphOptions {
        &self.options
    }

    /// Who is joined to whom on the surface.
    #[must_use]
    pub fn edges(&self) -> &Adjacency {
        &self.edges
    }

    /// Who is joined to whom in the r-SIG by an edge too long for the surface.
    #[must_use]
    pub fn virtual_edges(&self) -> &Adjacency {
        &self.virtual_edges
    }

    /// `d_i` of each point: the distance of its r-th nearest neighbour.
    #[must_use]
    pub fn radii(&self) -> &[f32] {
        &self.radii
    }

    /// `r_i` of each point: the length of its longest edge on the surface; zero where it has none.
    #[must_use]
    pub fn reaches(&self) -> &[f32] {
        &self.reaches
    }

    /// Points per unit of area about point `i`: r over the area of a disc of radius `d_i`.
    ///
    /// # Panics
    /// When there is no such point.
    #[must_use]
    pub fn density(&self, i: usize) -> f64 {
        let d = f64::from(self.radii[i]);
        f64::from(self.options.neighbours) / (std::f64::consts::PI * d * d)
    }

    /// For each point the least of those it is joined to by edges on the surface, over any number of them.
    #[must_use]
    pub fn components(&self) -> &[u32] {
        &self.components
    }

    /// Whether point `i` is at a border of the surface: what is near it on the graph lies to one side.
    ///
    /// # Panics
    /// When there is no such point.
    #[must_use]
    pub fn is_border(&self, i: usize) -> bool {
        self.borders[i] != 0
    }

    /// How many there are of what.
    #[must_use]
    pub fn counts(&self) -> GraphCounts {
        GraphCounts {
            points: self.len(),
            edges: self.edges.edge_count(),
            virtual_edges: self.virtual_edges.edge_count(),
            components: self.component_count as usize,
            border: self.borders.iter().filter(|&&border| border != 0).count(),
        }
    }

    /// Bytes of all its arrays.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.edges.bytes()
            + self.virtual_edges.bytes()
            + size_of_val::<[_]>(&self.radii)
            + size_of_val::<[_]>(&self.reaches)
            + size_of_val::<[_]>(&self.components)
            + size_of_val::<[_]>(&self.borders)
    }
}
