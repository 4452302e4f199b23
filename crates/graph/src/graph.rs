//! The proximity graph of a scan, with components, borders and densities.

use nearmiss_lanes::parallel::map;
use nearmiss_store::Array;
use serde::{Deserialize, Serialize};

use crate::adjacency::Adjacency;
use crate::border::borders;
use crate::components::components;
use crate::influence::{distance, influence, radii_sq};
use crate::options::{GraphError, GraphOptions, Prune, check_positions};
use crate::prune::split;

/// A proximity graph: the r-SIG of Klein & Zachmann 2005, §3.2, without its long edges.
///
/// Long edges are kept as *virtual* edges (Klein & Zachmann 2005, §4.5), which searches may follow
/// but which do not belong to the surface. A point is identified by its index among the positions
/// that the graph was built from. Lengths are in the units of these positions.
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

/// Numbers of points, edges and components of a graph.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct GraphCounts {
    /// Number of points.
    pub points: usize,
    /// Number of edges, without virtual ones.
    pub edges: usize,
    /// Number of virtual edges, which were pruned.
    pub virtual_edges: usize,
    /// Number of connected components, ignoring virtual edges.
    pub components: usize,
    /// Number of points at a border.
    pub border: usize,
}

impl PointGraph {
    /// Builds the graph over distinct `positions`. The build is fastest if consecutive positions
    /// are mostly near each other, as in the order of a hierarchy.
    ///
    /// Takes O(n log n) time in such an order, as the number of edges is O(r n). With the feature
    /// `rayon` the build uses all cores; the result is the same for any number of cores.
    ///
    /// # Errors
    /// Fails if an option is out of range, if a coordinate is not finite or beyond ±1e18, or if
    /// there are too many edges.
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

    /// Returns the number of points.
    #[must_use]
    pub fn len(&self) -> usize {
        self.edges.len()
    }

    /// Returns `true` if there are no points.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.edges.is_empty()
    }

    /// Returns the options that the graph was built with.
    #[must_use]
    pub fn options(&self) -> &GraphOptions {
        &self.options
    }

    /// Returns the edges on the surface.
    #[must_use]
    pub fn edges(&self) -> &Adjacency {
        &self.edges
    }

    /// Returns the virtual edges: edges of the r-SIG that are too long for the surface.
    #[must_use]
    pub fn virtual_edges(&self) -> &Adjacency {
        &self.virtual_edges
    }

    /// Returns `d_i` of each point, the distance to its r-th nearest neighbour.
    #[must_use]
    pub fn radii(&self) -> &[f32] {
        &self.radii
    }

    /// Returns `r_i` of each point, the length of its longest edge, ignoring virtual edges; zero
    /// without edges.
    #[must_use]
    pub fn reaches(&self) -> &[f32] {
        &self.reaches
    }

    /// Returns the number of points per unit of area near point `i`: r over the area of a disc of
    /// radius `d_i`.
    ///
    /// # Panics
    /// Panics if `i` is not below [`Self::len`].
    #[must_use]
    pub fn density(&self, i: usize) -> f64 {
        let d = f64::from(self.radii[i]);
        f64::from(self.options.neighbours) / (std::f64::consts::PI * d * d)
    }

    /// Returns for each point the least index of a point in its connected component, ignoring
    /// virtual edges.
    #[must_use]
    pub fn components(&self) -> &[u32] {
        &self.components
    }

    /// Returns `true` if point `i` is at a border of the surface, where its neighbours are on one
    /// side.
    ///
    /// # Panics
    /// Panics if `i` is not below [`Self::len`].
    #[must_use]
    pub fn is_border(&self, i: usize) -> bool {
        self.borders[i] != 0
    }

    /// Returns the numbers of points, edges and components.
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

    /// Returns the size of all arrays in bytes.
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
