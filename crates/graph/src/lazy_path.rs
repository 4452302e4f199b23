//! A path between two points of which only those are known that someone looks at.
//!
//! A search along a path looks at few of its points, and the path of two far points has many: O(√n) of a
//! surface of n. So that it is not rebuilt whole (S1, Algorithm 2), it is put together from edges of
//! [levels](Levels) as coarse as may be, and only the edge about the place that is looked at is taken apart,
//! level by level, into the edges of the finer one that it stands for. O(log n) a look, whatever the length.

use crate::length::distance;
use crate::{GeodesicScratch, Levels, Network};

/// A path goes straight on on the first level where the ends are no more than so many local sampling radii of
/// the next apart.
const SHORT: f32 = 1.5;

/// A point of a path, and the edge by which it goes on.
#[derive(Debug, Clone, Copy)]
struct Stop {
    point: u32,
    /// How far from the beginning.
    along: f64,
    /// The level of that edge, 0 for one between points.
    level: usize,
    /// What it joins on that level.
    ends: [u32; 2],
}

/// A point of a path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathPoint {
    /// Which point.
    pub point: u32,
    /// How far it is from the beginning along the path.
    pub along: f64,
}

/// A path between two points of a graph, known as far as it was looked at; its memory is used again for the
/// next.
///
/// It is a path of the graph, on average half as long again as the shortest.
#[derive(Debug, Clone, Default)]
pub struct LazyPath {
    stops: Vec<Stop>,
    /// For the way back from the second point.
    back: Vec<Stop>,
    ids: Vec<u32>,
    search: GeodesicScratch,
}

/// The graph of a level, or `points` for level 0.
fn network<'a>(levels: &'a Levels, points: Network<'a>, level: usize) -> Network<'a> {
    level.checked_sub(1).map_or(points, |coarser| levels.cells()[coarser].network())
}

/// The point at the centre of a cell of a level; itself on level 0.
fn point_of(levels: &Levels, level: usize, id: u32) -> u32 {
    level.checked_sub(1).map_or(id, |coarser| levels.cells()[coarser].points[id as usize])
}

/// Of an edge that a file lies about nothing is known.
fn sound(length: f32) -> f64 {
    if length >= 0.0 && length.is_finite() { f64::from(length) } else { 0.0 }
}

/// The length of an edge, if there is one.
fn edge(network: Network<'_>, [u, v]: [u32; 2]) -> Option<f64> {
    network.length(u as usize, v).map(sound)
}

impl LazyPath {
    /// Makes this a path from `a` to `b` in `points`, the graph that `levels` are over, with the points at
    /// its ends and no more than some of the points between. False, with no path, where no way leads from one
    /// to the other.
    ///
    /// From either end it leads inwards, from cell to coarser cell, and straight on where the cells are a few
    /// times smaller than the ends are apart. O(log n) but where the coarsest level has to be searched; no
    /// allocation once warm.
    ///
    /// # Panics
    /// When there is no such point, or not a position for each.
    pub fn lead(
        &mut self,
        levels: &Levels,
        points: Network<'_>,
        positions: &[[f32; 3]],
        [a, b]: [u32; 2],
    ) -> bool {
        let apart = distance(positions[a as usize], positions[b as usize]);
        self.stops.clear();
        self.back.clear();
        let (mut along, mut beyond) = (0.0, 0.0);
        let mut at = [a, b];
        let mut level = 0;
        loop {
            let here = network(levels, points, level);
            if at[0] == at[1] {
                break;
            }
            let coarser = levels.cells().get(level);
            // Radii double from level to level.
            let radius = match (coarser, level.checked_sub(1)) {
                (Some(cells), _) => cells.radii[cells.owner[at[0] as usize] as usize],
                (None, Some(own)) => 2.0 * levels.cells()[own].radii[at[0] as usize],
                (None, None) => 0.0,
            };
            let is_fit = SHORT * radius >= apart;
            if is_fit && self.walk((levels, positions), (here, level), at, &mut along) {
                break;
            }
            let Some(cells) = coarser else {
                if self.search_level(levels, (here, level), at, &mut along) {
                    break;
                }
                self.stops.clear();
                return false;
            };
            let [u, v] = at.map(|id| id as usize);
            let mut id = at[0];
            while cells.inwards[id as usize] != id {
                let next = cells.inwards[id as usize];
                let length = sound(cells.to_centre[id as usize] - cells.to_centre[next as usize]);
                self.step(levels, level, [id, next], &mut along, length);
                id = next;
            }
            let mut id = at[1];
            while cells.inwards[id as usize] != id {
                let next = cells.inwards[id as usize];
                let point = point_of(levels, level, next);
                self.back.push(Stop { point, along: beyond, level, ends: [next, id] });
                beyond += sound(cells.to_centre[id as usize] - cells.to_centre[next as usize]);
                id = next;
            }
            at = [cells.owner[u], cells.owner[v]];
            level += 1;
        }
        // What `back` knows is how far from b its edges end.
        let whole = along + beyond;
        let mut from = along;
        for stop in self.back.drain(..).rev() {
            self.stops.push(Stop { along: from, ..stop });
            from = whole - stop.along;
        }
        self.stops.push(Stop { point: b, along: from, level: 0, ends: [b; 2] });
        true
    }

    /// Goes on from cell to cell of one level, each time to the one whose centre is nearest to that of the
    /// last, if it gets there.
    fn walk(
        &mut self,
        (levels, positions): (&Levels, &[[f32; 3]]),
        (here, level): (Network<'_>, usize),
        [mut at, to]: [u32; 2],
        along: &mut f64,
    ) -> bool {
        let place = |id: u32| positions[point_of(levels, level, id) as usize];
        let goal = place(to);
        let mut left = distance(place(at), goal);
        let (known, before) = (self.stops.len(), *along);
        while at != to {
            let nearer = |id: u32| if id == to { -1.0 } else { distance(place(id), goal) };
            let next = here.edges(at as usize).map(|(id, length)| (nearer(id), id, length));
            let next = next.min_by(|a, b| a.0.total_cmp(&b.0));
            let Some((distance, next, length)) = next.filter(|next| next.0 < left) else {
                self.stops.truncate(known);
                *along = before;
                return false;
            };
            self.step(levels, level, [at, next], along, sound(length));
            (at, left) = (next, distance);
        }
        true
    }

    /// Goes on by a shortest path on one level, if there is one.
    fn search_level(
        &mut self,
        levels: &Levels,
        (here, level): (Network<'_>, usize),
        at: [u32; 2],
        along: &mut f64,
    ) -> bool {
        let mut ids = std::mem::take(&mut self.ids);
        let found = self.search.path(here, at[0], at[1], &mut ids).is_some();
        for two in ids.windows(2) {
            let ends = [two[0], two[1]];
            self.step(levels, level, ends, along, edge(here, ends).unwrap_or(0.0));
        }
        self.ids = ids;
        found
    }

    /// Makes this a shortest path from `a` to `b` in `network`, found whole, through points that are `open`:
    /// for ways that levels do not know, as over virtual edges.
    ///
    /// # Panics
    /// When there is no such point.
    pub fn lead_through(
        &mut self,
        network: Network<'_>,
        [a, b]: [u32; 2],
        open: impl Fn(u32) -> bool,
    ) -> bool {
        self.stops.clear();
        self.search.search(network, [(a, 0.0)], f32::MAX, |i, _| open(i), |i| i == b);
        if self.search.found(b).is_none() {
            return false;
        }
        self.ids.clear();
        self.search.trace(b, &mut self.ids);
        let mut next = b;
        for &point in &self.ids {
            let along = self.search.found(point).map_or(0.0, f64::from);
            self.stops.push(Stop { point, along, level: 0, ends: [point, next] });
            next = point;
        }
        self.stops.reverse();
        true
    }

    fn step(&mut self, levels: &Levels, level: usize, ends: [u32; 2], along: &mut f64, length: f64) {
        let point = point_of(levels, level, ends[0]);
        self.stops.push(Stop { point, along: *along, level, ends });
        *along += length;
    }

    /// Number of points that are known.
    #[must_use]
    pub fn len(&self) -> usize {
        self.stops.len()
    }

    /// How long it is.
    #[must_use]
    pub fn length(&self) -> f64 {
        self.stops.last().map_or(0.0, |stop| stop.along)
    }

    /// Whether there is no path.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.stops.is_empty()
    }

    /// The `k`-th of the points that are known.
    ///
    /// # Panics
    /// When there are not so many.
    #[must_use]
    pub fn point(&self, k: usize) -> PathPoint {
        PathPoint { point: self.stops[k].point, along: self.stops[k].along }
    }

    /// Takes apart what is about the place `along` the path, between the known points of numbers `left` and
    /// `right`, until an edge between points is there: the number of the end of it nearer to that place, as
    /// far as it is neither of those two. Their numbers afterwards are `left`, which does not change, and
    /// `right` more by what the path grew. None if one edge joins them.
    ///
    /// O(log n), however long the path is.
    ///
    /// # Panics
    /// When there are not so many points.
    pub fn look(&mut self, levels: &Levels, left: usize, right: usize, along: f64) -> Option<usize> {
        let end = self.stops.len() - right;
        loop {
            let right = self.stops.len() - end;
            if left + 1 > right {
                return None;
            }
            let inner = &self.stops[left + 1..right];
            let first = left + inner.partition_point(|stop| stop.along <= along);
            let Stop { level, .. } = self.stops[first];
            if level > 0 {
                self.take_apart(levels, first);
                continue;
            }
            let to = |k: usize| (self.stops[k].along - along).abs();
            let nearer = if to(first) <= to(first + 1) { [first, first + 1] } else { [first + 1, first] };
            return nearer.into_iter().find(|&k| left < k && k < right);
        }
    }

    /// As [`Self::look`], about the first place where `guess`, a function of points, changes its sign between
    /// those two; nothing where it has the same sign at both.
    ///
    /// # Panics
    /// When there are not so many points.
    pub fn look_where(
        &mut self,
        levels: &Levels,
        left: usize,
        right: usize,
        guess: impl Fn(u32) -> f64,
    ) -> Option<usize> {
        let end = self.stops.len() - right;
        let value = |stop: &Stop| guess(stop.point);
        let (mut first, mut here) = (left, value(&self.stops[left]));
        if (here < 0.0) == (value(&self.stops[right]) < 0.0) {
            return None;
        }
        // It changes further on, until it has changed.
        while first + end < self.stops.len() {
            let next = value(&self.stops[first + 1]);
            if (here < 0.0) == (next < 0.0) {
                (first, here) = (first + 1, next);
            } else if self.stops[first].level > 0 {
                self.take_apart(levels, first);
            } else {
                let right = self.stops.len() - end;
                let nearer = if here.abs() <= next.abs() { [first, first + 1] } else { [first + 1, first] };
                return nearer.into_iter().find(|&k| left < k && k < right);
            }
        }
        None
    }

    /// Replaces an edge between cells by the edges between their points that it stands for.
    fn take_apart(&mut self, levels: &Levels, k: usize) {
        let Stop { along, level, ends, .. } = self.stops[k];
        let until = self.stops[k + 1].along;
        let cells = &levels.cells()[level - 1];
        self.ids.clear();
        self.ids.push(cells.centres[ends[0] as usize]);
        let crossed = cells.cross(ends, &mut self.ids);
        // Within a cell ways are as long as the distances from its centre; the one edge between the two takes
        // the rest.
        let (ids, to_centre): (&[u32], &[f32]) = (&self.ids, &cells.to_centre);
        let parts = ids.windows(2).enumerate().map(|(i, two)| {
            let to_centre = sound(to_centre[two[0] as usize]);
            let from = if i < crossed { along + to_centre } else { until - to_centre };
            let point = point_of(levels, level - 1, two[0]);
            Stop { point, along: from.clamp(along, until), level: level - 1, ends: [two[0], two[1]] }
        });
        self.stops.splice(k..=k, parts);
    }

    /// All points of the path.
    pub fn all<'a>(&'a mut self, levels: &Levels) -> impl ExactSizeIterator<Item = PathPoint> + use<'a> {
        let mut k = 0;
        while k < self.stops.len() {
            if self.stops[k].level > 0 {
                self.take_apart(levels, k);
            } else {
                k += 1;
            }
        }
        self.stops.iter().map(|stop| PathPoint { point: stop.point, along: stop.along })
    }
}
