//! Shortest paths along the edges of a graph (Dijkstra 1959).
//!
//! Lengths are summed in single precision from the source outwards. Each sum is rounded to nearest
//! and greater than the previous one, so after m edges the relative error is at most (m + 3) 6e-8.
//! Of equally long paths, the one whose last but one point was reached first is kept. Equally
//! distant points are reached in the order of their indices.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::length::{Network, step};

/// A point that a search reached.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reached {
    /// Index of the point.
    pub point: u32,
    /// Distance along the graph.
    pub distance: f32,
}

/// State of a point during a search.
#[derive(Debug, Clone, Copy)]
struct Known {
    /// Length of the shortest path found.
    distance: f32,
    /// Previous point on that path; a source points to itself.
    before: u32,
}

const UNKNOWN: Known = Known { distance: f32::INFINITY, before: 0 };

/// Scratch memory for searches: twelve bytes for each point of the largest graph, plus the points
/// reached. Reuse it for later searches.
#[derive(Debug, Clone, Default)]
pub struct GeodesicScratch {
    known: Vec<Known>,
    /// Distance and point, nearest on top. Of several entries of a point, the first counts.
    queue: BinaryHeap<Reverse<u64>>,
    /// Points with a known distance.
    touched: Vec<u32>,
    reached: Vec<Reached>,
}

/// Distances are not negative, so they sort like their bits.
#[inline]
fn key(distance: f32, point: u32) -> Reverse<u64> {
    Reverse(u64::from(distance.to_bits()) << 32 | u64::from(point))
}

impl GeodesicScratch {
    /// Returns all points within `reach` of `source`, sorted by distance, then index; `source`
    /// comes first.
    ///
    /// Takes O(m log m) time for m edges at these points. Does not allocate once warm.
    ///
    /// # Panics
    /// Panics if `source` is not a point.
    pub fn within(&mut self, network: Network<'_>, source: u32, reach: f32) -> &[Reached] {
        self.search(network, [(source, 0.0)], reach, |_, _| true, |_| false);
        &self.reached
    }

    /// Returns the distance from `a` to `b`; `None` if they are not connected.
    ///
    /// # Panics
    /// Panics if `a` or `b` is not a point.
    pub fn distance(&mut self, network: Network<'_>, a: u32, b: u32) -> Option<f32> {
        self.search(network, [(a, 0.0)], f32::MAX, |_, _| true, |i| i == b);
        self.found(b)
    }

    /// Returns the distance as [`Self::distance`] does, and sets `path` to the points of a shortest
    /// path from `a` to `b`, both included. `path` is empty if `b` cannot be reached.
    ///
    /// # Panics
    /// Panics if `a` or `b` is not a point.
    pub fn path(&mut self, network: Network<'_>, a: u32, b: u32, path: &mut Vec<u32>) -> Option<f32> {
        path.clear();
        let distance = self.distance(network, a, b)?;
        self.trace(b, path);
        path.reverse();
        Some(distance)
    }

    /// Returns the number of points that the last search reached.
    #[must_use]
    pub fn reached(&self) -> usize {
        self.reached.len()
    }

    /// Searches from `sources`, each with an initial distance, until it reaches a point for which
    /// `goal` returns `true`. Only points that are `open` at their distance and within `reach` are
    /// visited.
    pub(crate) fn search(
        &mut self,
        network: Network<'_>,
        sources: impl IntoIterator<Item = (u32, f32)>,
        reach: f32,
        open: impl Fn(u32, f32) -> bool,
        goal: impl Fn(u32) -> bool,
    ) {
        self.forget();
        if self.known.len() < network.len() {
            self.known.resize(network.len(), UNKNOWN);
        }
        for (source, distance) in sources {
            self.offer(source, Known { distance, before: source });
        }
        while let Some(Reverse(next)) = self.queue.pop() {
            #[expect(clippy::cast_possible_truncation, reason = "its two halves")]
            let (distance, point) = (f32::from_bits((next >> 32) as u32), next as u32);
            if self.known[point as usize].distance < distance {
                continue;
            }
            self.reached.push(Reached { point, distance });
            if goal(point) {
                break;
            }
            for (to, length) in network.edges(point as usize) {
                let distance = step(distance, length);
                if distance <= reach && distance < self.known[to as usize].distance && open(to, distance) {
                    self.offer(to, Known { distance, before: point });
                }
            }
        }
    }

    #[inline]
    fn offer(&mut self, point: u32, known: Known) {
        let to = &mut self.known[point as usize];
        if to.distance == f32::INFINITY {
            self.touched.push(point);
        }
        *to = known;
        self.queue.push(key(known.distance, point));
    }

    /// Clears the state for the next search.
    fn forget(&mut self) {
        for point in self.touched.drain(..) {
            self.known[point as usize] = UNKNOWN;
        }
        self.queue.clear();
        self.reached.clear();
    }

    /// Returns the distance of `point` in the last search; `None` if it was not reached.
    pub(crate) fn found(&self, point: u32) -> Option<f32> {
        let known = self.known[point as usize].distance;
        (known < f32::INFINITY).then_some(known)
    }

    /// Returns the point before `point` on its path in the last search; a source returns itself.
    #[inline]
    pub(crate) fn before(&self, point: u32) -> u32 {
        self.known[point as usize].before
    }

    /// Returns the points that the last search reached, in order.
    pub(crate) fn all_reached(&self) -> &[Reached] {
        &self.reached
    }

    /// Appends the path from `point`, which the last search reached, back to its source.
    pub(crate) fn trace(&self, mut point: u32, path: &mut Vec<u32>) {
        path.push(point);
        while self.before(point) != point {
            point = self.before(point);
            path.push(point);
        }
    }
}
