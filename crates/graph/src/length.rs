//! Lengths of edges, and of ways along them.

use crate::Adjacency;

/// A graph with the length of each edge, borrowed for searches.
#[derive(Debug, Clone, Copy)]
pub struct Network<'a> {
    starts: &'a [u32],
    neighbours: &'a [u32],
    lengths: &'a [f32],
}

impl<'a> Network<'a> {
    /// `graph`, with a length for every entry of its neighbours, those of the first point first, as
    /// [`edge_lengths`] returns them. Lengths are not negative, and the same from both ends.
    ///
    /// # Panics
    /// When there are more or fewer lengths than entries.
    #[must_use]
    pub fn new(graph: &'a Adjacency, lengths: &'a [f32]) -> Self {
        let (starts, neighbours) = graph.slices();
        assert_eq!(neighbours.len(), lengths.len(), "a length for each entry");
        Self { starts, neighbours, lengths }
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

    /// How long the edge between two points is, if there is one. O(log d) for d neighbours.
    ///
    /// # Panics
    /// When there is no point `i`.
    #[inline]
    #[must_use]
    pub fn length(&self, i: usize, j: u32) -> Option<f32> {
        let range = self.starts[i] as usize..self.starts[i + 1] as usize;
        let place = self.neighbours[range.clone()].binary_search(&j).ok()?;
        self.lengths.get(range.start + place).copied()
    }

    /// The neighbours of point `i`, ascending, and how far they are.
    ///
    /// # Panics
    /// When there is no such point.
    #[inline]
    pub fn edges(&self, i: usize) -> impl Iterator<Item = (u32, f32)> + use<'a> {
        let range = self.starts[i] as usize..self.starts[i + 1] as usize;
        self.neighbours[range.clone()].iter().copied().zip(self.lengths[range].iter().copied())
    }
}

/// The Euclidean length of every edge, for [`Network::new`]: of differences in single precision the root of
/// the sum of squares, each step rounded, within 2e-7 of the true one.
///
/// On one core: graphs make these when first wanted, and where a thread of a pool waits for others of it
/// meanwhile, it may come to want them again.
///
/// # Panics
/// When the graph has a point that has no position.
#[must_use]
pub fn edge_lengths(graph: &Adjacency, positions: &[[f32; 3]]) -> Vec<f32> {
    let lengths = (0..graph.len()).flat_map(|i| {
        let from = positions[i];
        graph.of(i).iter().map(move |&j| distance(from, positions[j as usize]))
    });
    lengths.collect()
}

/// How far two points are from each other.
#[inline]
pub(crate) fn distance(a: [f32; 3], b: [f32; 3]) -> f32 {
    let [x, y, z] = [b[0] - a[0], b[1] - a[1], b[2] - a[2]];
    (x * x + y * y + z * z).sqrt()
}

/// What is `along` plus an edge: more than `along`, however short the edge is. So the points of a shortest
/// path are at ever greater distances, and it can be told from these alone.
#[inline]
pub(crate) fn step(along: f32, edge: f32) -> f32 {
    (along + edge).max(along.next_up())
}
