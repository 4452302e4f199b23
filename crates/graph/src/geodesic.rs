//! Shortest paths from a point along the edges of a graph (Dijkstra 1959).
//!
//! Lengths add up in single precision, from the source outwards, each sum rounded to nearest and greater than
//! the one before: after m edges the relative error is at most (m + 3) 6e-8. Of ways that come out equally
//! long the one stands whose last point but one was reached first, of points equally far the one with the
//! lesser index.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::length::{Network, step};

/// A point that a search reached.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reached {
    /// Its index.
    pub point: u32,
    /// How far it is along the graph.
    pub distance: f32,
}

/// What a search knows of a point.
#[derive(Debug, Clone, Copy)]
struct Known {
    /// The length of the shortest way found.
    distance: f32,
    /// The point before it on that way; itself at a source.
    before: u32,
}

const UNKNOWN: Known = Known { distance: f32::INFINITY, before: 0 };

/// Memory for searches, used again by the next. Twelve bytes a point of the largest graph, and what a search
/// reaches.
#[derive(Debug, Clone, Default)]
pub struct GeodesicScratch {
    known: Vec<Known>,
    /// Distance and point, the nearest on top; a point may stand there several times, the first counts.
    queue: BinaryHeap<Reverse<u64>>,
    /// Points of which something is known.
    touched: Vec<u32>,
    reached: Vec<Reached>,
}

/// Distances are not negative, so that they order like their bits.
#[inline]
fn key(distance: f32, point: u32) -> Reverse<u64> {
    Reverse(u64::from(distance.to_bits()) << 32 | u64::from(point))
}

impl GeodesicScratch {
    /// All points within `reach` of `source`, itself first, by distance, then index.
    ///
    /// O(m log m) for m edges at these points; no allocation once warm.
    ///
    /// # Panics
    /// When there is no such point.
    pub fn within(&mut self, network: Network<'_>, source: u32, reach: f32) -> &[Reached] {
        self.search(network, [(source, 0.0)], reach, |_, _| true, |_| false);
        &self.reached
    }

    /// The distance from `a` to `b`, or nothing where no way leads there.
    ///
    /// # Panics
    /// When there is no such point.
    pub fn distance(&mut self, network: Network<'_>, a: u32, b: u32) -> Option<f32> {
        self.search(network, [(a, 0.0)], f32::MAX, |_, _| true, |i| i == b);
        self.found(b)
    }

    /// As [`Self::distance`]; `path` holds the points of a shortest path from `a` to `b` afterwards, both
    /// included, or none.
    ///
    /// # Panics
    /// When there is no such point.
    pub fn path(&mut self, network: Network<'_>, a: u32, b: u32, path: &mut Vec<u32>) -> Option<f32> {
        path.clear();
        let distance = self.distance(network, a, b)?;
        self.trace(b, path);
        path.reverse();
        Some(distance)
    }

    /// How many points the last search reached.
    #[must_use]
    pub fn reached(&self) -> usize {
        self.reached.len()
    }

    /// Goes out from `sources`, which begin at the distances beside them, through points that are `open` to a
    /// way of some length there, as far as `reach` or until a point is reached that is the `goal`.
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

    /// Makes ready for the next search.
    fn forget(&mut self) {
        for point in self.touched.drain(..) {
            self.known[point as usize] = UNKNOWN;
        }
        self.queue.clear();
        self.reached.clear();
    }

    /// What the last search found of `point`, if it came there: its distance.
    pub(crate) fn found(&self, point: u32) -> Option<f32> {
        let known = self.known[point as usize].distance;
        (known < f32::INFINITY).then_some(known)
    }

    /// The point before `point` on the way the last search found there; itself at a source.
    #[inline]
    pub(crate) fn before(&self, point: u32) -> u32 {
        self.known[point as usize].before
    }

    /// The points the last search reached, in order.
    pub(crate) fn all_reached(&self) -> &[Reached] {
        &self.reached
    }

    /// Appends the points from `point`, which the last search found, back to the source.
    pub(crate) fn trace(&self, mut point: u32, path: &mut Vec<u32>) {
        path.push(point);
        while self.before(point) != point {
            point = self.before(point);
            path.push(point);
        }
    }
}
