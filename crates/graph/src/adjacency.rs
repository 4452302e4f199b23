//! Who is joined to whom.

use nearmiss_store::Array;

/// An undirected graph over points by their indices: each edge stands with both of its ends.
#[derive(Debug, Clone)]
pub struct Adjacency {
    /// Where the neighbours of each point begin, and where the last ones' end.
    starts: Array<u32>,
    /// The neighbours of all points, those of each ascending.
    neighbours: Array<u32>,
}

impl Adjacency {
    /// The graph of `count` points with these edges, in any order, each once and never from a point to itself.
    ///
    /// # Panics
    /// When an edge leads to a point that is not there, or there are 2³¹ edges.
    #[must_use]
    pub fn from_edges(count: usize, edges: &[[u32; 2]]) -> Self {
        let mut ends: Vec<[u32; 2]> = edges.iter().flat_map(|&[a, b]| [[a, b], [b, a]]).collect();
        ends.sort_unstable();
        let mut starts = vec![0; count + 1];
        for [from, _] in &ends {
            starts[*from as usize + 1] += 1;
        }
        for i in 0..count {
            starts[i + 1] += starts[i];
        }
        let neighbours: Vec<u32> = ends.into_iter().map(|[_, to]| to).collect();
        assert!(neighbours.iter().all(|&to| (to as usize) < count), "an edge leads to no point");
        Self { starts: starts.into(), neighbours: neighbours.into() }
    }

    /// Number of points.
    #[must_use]
    pub fn len(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// Whether there are no points.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number of edges.
    #[must_use]
    pub fn edge_count(&self) -> usize {
        self.neighbours.len() / 2
    }

    /// The neighbours of point `i`, ascending.
    ///
    /// # Panics
    /// When there is no such point.
    #[must_use]
    pub fn of(&self, i: usize) -> &[u32] {
        &self.neighbours[self.starts[i] as usize..self.starts[i + 1] as usize]
    }
}
