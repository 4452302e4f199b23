//! Lengths of edges and of paths.

use crate::Adjacency;

/// A graph with the length of each edge, borrowed for searches.
#[derive(Debug, Clone, Copy)]
pub struct Network<'a> {
    starts: &'a [u32],
    neighbours: &'a [u32],
    lengths: &'a [f32],
}

impl<'a> Network<'a> {
    /// Creates a network from `graph` and a length for each entry of its neighbour lists, in order,
    /// as [`edge_lengths`] returns them. Lengths must not be negative and must be equal from both
    /// ends.
    ///
    /// # Panics
    /// Panics if the number of lengths differs from the number of entries.
    #[must_use]
    pub fn new(graph: &'a Adjacency, lengths: &'a [f32]) -> Self {
        let (starts, neighbours) = graph.slices();
        assert_eq!(neighbours.len(), lengths.len(), "expected a length for each end of an edge");
        Self { starts, neighbours, lengths }
    }

    /// Returns the number of points.
    #[must_use]
    pub fn len(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// Returns `true` if there are no points.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the length of the edge between two points, if there is one. Takes O(log d) time for
    /// d neighbours.
    ///
    /// # Panics
    /// Panics if `i` is not a point.
    #[inline]
    #[must_use]
    pub fn length(&self, i: usize, j: u32) -> Option<f32> {
        let range = self.starts[i] as usize..self.starts[i + 1] as usize;
        let place = self.neighbours[range.clone()].binary_search(&j).ok()?;
        self.lengths.get(range.start + place).copied()
    }

    /// Returns the neighbours of point `i`, ascending, and the lengths of the edges to them.
    ///
    /// # Panics
    /// Panics if `i` is not a point.
    #[inline]
    pub fn edges(&self, i: usize) -> impl Iterator<Item = (u32, f32)> + use<'a> {
        let range = self.starts[i] as usize..self.starts[i + 1] as usize;
        self.neighbours[range.clone()].iter().copied().zip(self.lengths[range].iter().copied())
    }
}

/// Returns the Euclidean length of every edge, for [`Network::new`]. Computed in single precision
/// with a relative error of at most 2e-7.
///
/// Runs on one core, because graphs compute the lengths inside a lock at first use. A pool thread
/// that waits for others inside that lock might start work that needs the same lengths.
///
/// # Panics
/// Panics if there are fewer positions than points.
#[must_use]
pub fn edge_lengths(graph: &Adjacency, positions: &[[f32; 3]]) -> Vec<f32> {
    let lengths = (0..graph.len()).flat_map(|i| {
        let from = positions[i];
        graph.of(i).iter().map(move |&j| distance(from, positions[j as usize]))
    });
    lengths.collect()
}

/// Returns the distance of two points.
#[inline]
pub(crate) fn distance(a: [f32; 3], b: [f32; 3]) -> f32 {
    let [x, y, z] = [b[0] - a[0], b[1] - a[1], b[2] - a[2]];
    (x * x + y * y + z * z).sqrt()
}

/// Returns `along` plus an edge, but always more than `along`, however short the edge is. The
/// distances along a shortest path thus increase strictly, so the path can be recovered from
/// distances alone.
#[inline]
pub(crate) fn step(along: f32, edge: f32) -> f32 {
    (along + edge).max(along.next_up())
}
