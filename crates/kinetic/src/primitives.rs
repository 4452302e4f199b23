//! `Primitives`: which points each primitive has, and which primitives each point is in.

use nearmiss_lanes::id32;

/// No leaf, no corner.
pub(crate) const NONE: u32 = u32::MAX;

/// Primitives of at most `arity` points. A primitive with fewer points repeats its last one.
#[derive(Debug, Clone)]
pub(crate) struct Primitives {
    pub(crate) arity: usize,
    /// The points of each primitive, `arity` numbers each.
    pub(crate) corners: Vec<u32>,
    /// The leaf of each primitive; [`NONE`] if it was removed.
    pub(crate) leaves: Vec<u32>,
    /// Indices of removed primitives, which are used again.
    pub(crate) free: Vec<u32>,
    /// The first corner of each point; [`NONE`] if no primitive uses it.
    first: Vec<u32>,
    /// The next corner of the same point, for each corner.
    next: Vec<u32>,
}

impl Primitives {
    pub(crate) fn new(arity: usize) -> Self {
        let [corners, leaves, free, first, next] = [const { Vec::new() }; 5];
        Self { arity, corners, leaves, free, first, next }
    }

    /// Returns the number of primitives.
    pub(crate) const fn len(&self) -> usize {
        self.leaves.len() - self.free.len()
    }

    /// Returns the number of indices, removed ones included.
    pub(crate) const fn slots(&self) -> usize {
        self.leaves.len()
    }

    /// Returns `true` if there is a primitive of this index.
    pub(crate) fn has(&self, primitive: u32) -> bool {
        self.leaves.get(primitive as usize).is_some_and(|&leaf| leaf != NONE)
    }

    /// Returns the points of a primitive, the last one repeated.
    #[inline]
    pub(crate) fn points(&self, primitive: u32) -> &[u32] {
        let start = primitive as usize * self.arity;
        &self.corners[start..start + self.arity]
    }

    /// Adds a primitive, in no leaf yet, and returns its index.
    pub(crate) fn add(&mut self, points: &[u32]) -> u32 {
        let primitive = self.free.pop().unwrap_or_else(|| {
            self.corners.resize(self.corners.len() + self.arity, 0);
            self.next.resize(self.corners.len(), NONE);
            self.leaves.push(NONE);
            id32(self.leaves.len() - 1)
        });
        let start = primitive as usize * self.arity;
        for k in 0..self.arity {
            self.corners[start + k] = points[k.min(points.len() - 1)];
        }
        self.link(primitive);
        primitive
    }

    /// Enters the corners of a primitive into the lists of its points, each point once.
    pub(crate) fn link(&mut self, primitive: u32) {
        let start = primitive as usize * self.arity;
        for k in 0..self.arity {
            let point = self.corners[start + k] as usize;
            if self.corners[start..start + k].contains(&id32(point)) {
                continue;
            }
            if self.first.len() <= point {
                self.first.resize(point + 1, NONE);
            }
            self.next[start + k] = self.first[point];
            self.first[point] = id32(start + k);
        }
    }

    /// Makes room for links that [`Self::link`] fills.
    pub(crate) fn clear_links(&mut self) {
        self.first.clear();
        self.next = vec![NONE; self.corners.len()];
    }

    /// Removes a primitive. Costs a pass over the primitives of its points.
    pub(crate) fn remove(&mut self, primitive: u32) {
        let start = primitive as usize * self.arity;
        for k in 0..self.arity {
            let (corner, point) = (id32(start + k), self.corners[start + k] as usize);
            if self.corners[start..start + k].contains(&id32(point)) {
                continue;
            }
            let after = self.next[corner as usize];
            let mut at = self.first[point];
            if at == corner {
                self.first[point] = after;
                continue;
            }
            while self.next[at as usize] != corner {
                at = self.next[at as usize];
            }
            self.next[at as usize] = after;
        }
        self.leaves[primitive as usize] = NONE;
        self.free.push(primitive);
    }

    /// Returns the primitives that a point is in.
    pub(crate) fn of(&self, point: u32) -> impl Iterator<Item = u32> {
        let some = |corner: u32| (corner != NONE).then_some(corner);
        let first = self.first.get(point as usize).copied().and_then(some);
        let corners = std::iter::successors(first, move |&corner| some(self.next[corner as usize]));
        corners.map(|corner| id32(corner as usize / self.arity))
    }

    /// Returns the bytes in use.
    pub(crate) const fn bytes(&self) -> usize {
        let words =
            self.corners.len() + self.leaves.len() + self.free.len() + self.first.len() + self.next.len();
        words * size_of::<u32>()
    }
}
