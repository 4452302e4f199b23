//! Adjacency lists.

use nearmiss_store::Array;

use crate::options::GraphError;

/// An undirected graph over points, which are identified by index. Each edge is stored at both
/// ends.
#[derive(Debug, Clone, PartialEq)]
pub struct Adjacency {
    /// Start of each point's neighbours, and the end of the last point's.
    pub(crate) starts: Array<u32>,
    /// Neighbours of all points, ascending for each point.
    pub(crate) neighbours: Array<u32>,
}

/// Neighbours of consecutive points, ascending for each point.
#[derive(Debug, Default)]
pub(crate) struct Lists {
    ends: Vec<usize>,
    neighbours: Vec<u32>,
}

impl Lists {
    /// Adds the neighbours of the next point.
    pub(crate) fn push(&mut self, neighbours: impl Iterator<Item = u32>) {
        self.neighbours.extend(neighbours);
        self.ends.push(self.neighbours.len());
    }
}

impl Adjacency {
    /// Creates a graph of `count` points from edges in any order. Each edge must occur once, and
    /// must not join a point to itself.
    ///
    /// # Panics
    /// Panics if an edge leads to a point out of range, or if there are 2³¹ edges or more.
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
        assert!(
            neighbours.iter().all(|&to| (to as usize) < count),
            "expected edges between points below {count}"
        );
        Self { starts: starts.into(), neighbours: neighbours.into() }
    }

    /// Creates a graph from neighbour lists, one part after the other. Each edge must be in the
    /// lists of both ends.
    pub(crate) fn from_lists(parts: Vec<Lists>) -> Result<Self, GraphError> {
        let ends = parts.iter().map(|part| part.neighbours.len()).sum();
        if u32::try_from(ends).is_err() {
            return Err(GraphError::TooLarge { ends });
        }
        let mut starts = Vec::with_capacity(parts.iter().map(|part| part.ends.len()).sum::<usize>() + 1);
        starts.push(0);
        let mut neighbours = Vec::with_capacity(ends);
        for part in parts {
            #[expect(clippy::cast_possible_truncation, reason = "there are fewer than 2^32")]
            starts.extend(part.ends.iter().map(|end| (neighbours.len() + end) as u32));
            neighbours.extend(part.neighbours);
        }
        Ok(Self { starts: starts.into(), neighbours: neighbours.into() })
    }

    /// Returns the edges of both graphs, which must have the same points and no common edge.
    ///
    /// # Panics
    /// Panics if the numbers of points differ.
    #[must_use]
    pub(crate) fn union(&self, other: &Self) -> Self {
        assert_eq!(self.len(), other.len(), "expected two graphs over the same points");
        let mut starts = Vec::with_capacity(self.starts.len());
        let mut neighbours = Vec::with_capacity(self.neighbours.len() + other.neighbours.len());
        starts.push(0);
        for i in 0..self.len() {
            let first = neighbours.len();
            neighbours.extend_from_slice(self.of(i));
            neighbours.extend_from_slice(other.of(i));
            neighbours[first..].sort_unstable();
            starts.push(self.starts[i + 1] + other.starts[i + 1]);
        }
        Self { starts: starts.into(), neighbours: neighbours.into() }
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

    /// Returns the number of edges.
    #[must_use]
    pub fn edge_count(&self) -> usize {
        self.neighbours.len() / 2
    }

    /// Returns each edge once, lesser end first, ascending.
    pub fn edges(&self) -> impl Iterator<Item = [u32; 2]> {
        (0_u32..).zip(0..self.len()).flat_map(|(a, i)| {
            let later = self.of(i).iter().copied().filter(move |&b| a < b);
            later.map(move |b| [a, b])
        })
    }

    /// Returns the size of all arrays in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val::<[_]>(&self.starts) + size_of_val::<[_]>(&self.neighbours)
    }

    /// Returns the neighbours of point `i`, ascending.
    ///
    /// # Panics
    /// Panics if `i` is not below [`Self::len`].
    #[must_use]
    pub fn of(&self, i: usize) -> &[u32] {
        &self.neighbours[self.starts[i] as usize..self.starts[i + 1] as usize]
    }

    /// Returns the starts of the neighbour lists, and the lists. Call this once, outside of loops.
    #[must_use]
    pub(crate) fn slices(&self) -> (&[u32], &[u32]) {
        (&self.starts, &self.neighbours)
    }
}
