//! Paths whose points are computed on demand.
//!
//! A search along a path looks at few of its points, while the path between two distant points has
//! many: O(√n) on a surface of n points. Instead of being rebuilt completely (Klein & Zachmann
//! 2005, Algorithm 2), the path is composed of edges of the coarsest possible [levels](Levels).
//! Only the edge around the requested position is expanded, level by level, into edges of the next
//! finer level. [`LazyPath::look`] takes O(log n) time, however long the path is.

use crate::length::distance;
use crate::{GeodesicScratch, Levels, Network};

/// Greatest distance of the ends, in local sampling radii of the next level, at which a path
/// continues on a level instead of ascending.
const SHORT: f32 = 1.5;

/// A point of a path and the edge by which the path continues.
#[derive(Debug, Clone, Copy)]
struct Stop {
    point: u32,
    /// Distance from the start.
    along: f64,
    /// Level of that edge; 0 for an edge between points.
    level: usize,
    /// Ends of that edge, on its level.
    ends: [u32; 2],
}

/// A point of a path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathPoint {
    /// Index of the point.
    pub point: u32,
    /// Distance from the start along the path.
    pub along: f64,
}

/// A path between two points of a graph whose points are computed on demand. Its memory is reused
/// for the next path.
///
/// It is a path of the graph, and on average 1.5 times as long as the shortest.
#[derive(Debug, Clone, Default)]
pub struct LazyPath {
    stops: Vec<Stop>,
    /// Stops of the part that was found from the second point.
    back: Vec<Stop>,
    ids: Vec<u32>,
    search: GeodesicScratch,
}

/// Returns the graph of a level, or `points` for level 0.
fn network<'a>(levels: &'a Levels, points: Network<'a>, level: usize) -> Network<'a> {
    level.checked_sub(1).map_or(points, |coarser| levels.cells()[coarser].network())
}

/// Returns the point at the centre of a cell; on level 0 the point itself.
fn point_of(levels: &Levels, level: usize, id: u32) -> u32 {
    level.checked_sub(1).map_or(id, |coarser| levels.cells()[coarser].points[id as usize])
}

/// Returns the length of an edge, or 0 if it is invalid, as in a forged file.
fn sound(length: f32) -> f64 {
    if length >= 0.0 && length.is_finite() { f64::from(length) } else { 0.0 }
}

/// Returns the length of an edge, if it exists.
fn edge(network: Network<'_>, [u, v]: [u32; 2]) -> Option<f64> {
    network.length(u as usize, v).map(sound)
}

impl LazyPath {
    /// Sets this path to one from `a` to `b` in `points`, the graph that `levels` are over. Only
    /// the ends and some of the points between them are computed. Returns `false`, and clears the
    /// path, if the ends are not connected.
    ///
    /// From both ends the path ascends from cell to coarser cell, until the cells are only a few
    /// times smaller than the distance of the ends. Then it continues on that level. Takes O(log n)
    /// time, except where the coarsest level has to be searched. Does not allocate once warm.
    ///
    /// # Panics
    /// Panics if `a` or `b` is not a point, or if there are fewer positions than points.
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
        // The stops in `back` hold the distances of the ends of their edges from b.
        let whole = along + beyond;
        let mut from = along;
        for stop in self.back.drain(..).rev() {
            self.stops.push(Stop { along: from, ..stop });
            from = whole - stop.along;
        }
        self.stops.push(Stop { point: b, along: from, level: 0, ends: [b; 2] });
        true
    }

    /// Continues on one level from cell to cell, each time to the one whose centre is nearest to
    /// the centre of the last cell. Returns `false`, and changes nothing, if that does not lead
    /// there.
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

    /// Continues on one level by a shortest path. Returns `false` if no path exists.
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

    /// Sets this path to a complete shortest path from `a` to `b` in `network`, through points that
    /// are `open`. For paths that levels do not contain, such as those over virtual edges. Returns
    /// `false` if there is no path.
    ///
    /// # Panics
    /// Panics if `a` or `b` is not a point.
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

    /// Returns the number of points computed so far.
    #[must_use]
    pub fn len(&self) -> usize {
        self.stops.len()
    }

    /// Returns the length of the path.
    #[must_use]
    pub fn length(&self) -> f64 {
        self.stops.last().map_or(0.0, |stop| stop.along)
    }

    /// Returns `true` if there is no path.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.stops.is_empty()
    }

    /// Returns the `k`-th point computed so far.
    ///
    /// # Panics
    /// Panics if `k` is not below [`Self::len`].
    #[must_use]
    pub fn point(&self, k: usize) -> PathPoint {
        PathPoint { point: self.stops[k].point, along: self.stops[k].along }
    }

    /// Expands the edges around the position `along`, between the computed points `left` and
    /// `right`, until that position is on an edge between points. Returns the end of this edge that
    /// is nearer to the position; if that end is `left` or `right`, the other end. `None` if a
    /// single edge joins `left` and `right`.
    ///
    /// Afterwards the index of the point `left` is the same, and the index of the point `right` has
    /// grown by the growth of [`Self::len`].
    ///
    /// Takes O(log n) time, however long the path is.
    ///
    /// # Panics
    /// Panics if `left` or `right` is not below [`Self::len`].
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

    /// As [`Self::look`], but at the first position between `left` and `right` where `guess`, a
    /// function of points, changes its sign. `None` if `guess` has the same sign at both.
    ///
    /// # Panics
    /// Panics if `left` or `right` is not below [`Self::len`].
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
        // As long as the sign has not changed, a change follows.
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

    /// Replaces an edge between cells by the edges of the next finer level that it stands for.
    fn take_apart(&mut self, levels: &Levels, k: usize) {
        let Stop { along, level, ends, .. } = self.stops[k];
        let until = self.stops[k + 1].along;
        let cells = &levels.cells()[level - 1];
        self.ids.clear();
        self.ids.push(cells.centres[ends[0] as usize]);
        let crossed = cells.cross(ends, &mut self.ids);
        // Within a cell, lengths are the stored distances from its centre. The edge between the
        // cells takes the rest.
        let (ids, to_centre): (&[u32], &[f32]) = (&self.ids, &cells.to_centre);
        let parts = ids.windows(2).enumerate().map(|(i, two)| {
            let to_centre = sound(to_centre[two[0] as usize]);
            let from = if i < crossed { along + to_centre } else { until - to_centre };
            let point = point_of(levels, level - 1, two[0]);
            Stop { point, along: from.clamp(along, until), level: level - 1, ends: [two[0], two[1]] }
        });
        self.stops.splice(k..=k, parts);
    }

    /// Returns all points of the path, expanding every edge.
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
