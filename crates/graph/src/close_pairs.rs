//! The close-pairs shortest-paths map: for every point the points that are heard there, and how far they are along
//! the graph.
//!
//! Klein & Zachmann 2005 (§3.2): shortest paths from each point, only as far as its influence reaches. How far that
//! is differs from point to point here, so a search goes out from the one that is heard, to its own horizon, and what it
//! finds is entered with those that hear it. O(N) in time and space where each point hears a bounded number.
//!
//! Paths need not be stored: the search that found i from j came over a neighbour of i that it had reached before,
//! which therefore hears j too, and whose distance plus the edge is that of i, to the last bit.

use bytemuck::{Pod, Zeroable};
use nearmiss_store::Array;
use serde::{Deserialize, Serialize};

use crate::Adjacency;
use crate::geodesic::Reached;
use crate::length::{Network, distance, step};
use crate::parallel::{for_each, ranges_with};

/// No more stretches than this are searched from: memory is made for each.
const STRETCHES: usize = 64;

/// Lists that are sorted together.
const SORTED: usize = 1024;

/// Points that are reached are sorted into as many shells.
const SHELLS: usize = 32;
const SHELLS_F32: f32 = 32.0;

/// Where the way goes on is not stored: it stands among too many neighbours.
const ELSEWHERE: u8 = u8::MAX;

/// A point that is heard, and how far it is along the graph.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Close {
    /// Its index.
    pub point: u32,
    /// Sum of the lengths of the edges of a shortest path, as [`GeodesicScratch::within`](crate::GeodesicScratch::within) adds them from there.
    pub distance: f32,
}

/// What is kept of paths.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Paths {
    /// Nothing: each step is looked for among the neighbours.
    #[default]
    Rebuilt,
    /// A byte a pair: the rank among the neighbours of where the path goes on.
    Stored,
}

/// For every point the points that are heard there, nearest first.
#[derive(Debug, Clone, PartialEq)]
pub struct ClosePairs {
    /// Where the list of each point begins, and where the last one ends.
    pub(crate) starts: Array<u32>,
    /// All lists, each by distance, then index.
    pub(crate) pairs: Array<Close>,
    /// Beside each pair the rank of where the path goes on; or none at all.
    pub(crate) onward: Array<u8>,
}

/// By distance, then index.
#[inline]
fn rank(close: &Close) -> u64 {
    u64::from(close.distance.to_bits()) << 32 | u64::from(close.point)
}

impl ClosePairs {
    /// The pairs of points (i, j) with a way from j to i no longer than the horizon of j, on all cores; the result does
    /// not depend on how many there are.
    ///
    /// # Panics
    /// When there is not a horizon for each point, or there are 2³² pairs.
    #[must_use]
    pub fn build(network: Network<'_>, horizons: &[f32], paths: Paths) -> Self {
        let count = network.len();
        assert_eq!(count, horizons.len(), "a horizon a point");
        let length = count.div_ceil(STRETCHES).max(1);
        let stretches = ranges_with(
            count,
            length,
            || Spread::new(count),
            |spread, sources| {
                let mut ends = Vec::with_capacity(sources.len());
                let mut reached = Vec::new();
                for source in sources {
                    spread.within(network, id32(source), horizons[source], &mut reached);
                    ends.push(reached.len());
                }
                (ends, reached)
            },
        );
        let mut starts = vec![0_u32; count + 1];
        let mut total = 0;
        for (_, reached) in &stretches {
            total += reached.len();
            for found in reached {
                starts[found.point as usize + 1] += 1;
            }
        }
        assert!(u32::try_from(total).is_ok(), "{total} pairs are more than a list can number");
        for i in 0..count {
            starts[i + 1] += starts[i];
        }
        let mut next = starts.clone();
        let mut pairs = vec![Close::zeroed(); total];
        let mut source = 0;
        for (ends, reached) in stretches {
            let mut first = 0;
            for end in ends {
                for found in &reached[first..end] {
                    let to = &mut next[found.point as usize];
                    pairs[*to as usize] = Close { point: source, distance: found.distance };
                    *to += 1;
                }
                first = end;
                source += 1;
            }
        }
        sort_lists(&starts, &mut pairs);
        let mut built = Self { starts: starts.into(), pairs: pairs.into(), onward: Array::default() };
        if paths == Paths::Stored {
            built.onward = built.all_onward(network).into();
        }
        built
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

    /// Number of pairs.
    #[must_use]
    pub fn pair_count(&self) -> usize {
        self.pairs.len()
    }

    /// Whether paths are stored.
    #[must_use]
    pub fn paths(&self) -> Paths {
        if self.onward.is_empty() { Paths::Rebuilt } else { Paths::Stored }
    }

    /// What all of it takes, in bytes.
    #[must_use]
    pub fn byte_len(&self) -> usize {
        size_of_val(&*self.starts) + size_of_val(&*self.pairs) + self.onward.len()
    }

    /// The points heard at `i`, itself first, by distance, then index.
    ///
    /// # Panics
    /// When there is no such point.
    #[must_use]
    pub fn of(&self, i: usize) -> &[Close] {
        self.view().of(i)
    }

    /// How far `j` is from `i`, if it is heard there. A pass over the list of `i`.
    ///
    /// # Panics
    /// When there is no point `i`.
    #[must_use]
    pub fn distance(&self, i: u32, j: u32) -> Option<f32> {
        self.view().distance(i, j)
    }

    /// As [`Self::distance`]; `path` holds the points from `i` to `j` afterwards, both included, or none. Given the
    /// graph and the positions that the map was built from; with [`Paths::Stored`] positions matter only at points of 255
    /// neighbours or more, where a step does not fit its byte.
    ///
    /// Klein & Zachmann 2005 (Algorithm 2) keep a queue of all neighbours that are nearer to the target. We go straight
    /// to the one that the shortest path comes over, which the map knows.
    ///
    /// # Panics
    /// When there is no point `i`.
    pub fn path(
        &self,
        graph: &Adjacency,
        positions: &[[f32; 3]],
        i: u32,
        j: u32,
        path: &mut Vec<u32>,
    ) -> Option<f32> {
        path.clear();
        let view = self.view();
        let whole = view.distance(i, j)?;
        let (mut at, mut left) = (i, whole);
        path.push(at);
        while at != j {
            let next = self.stored_step(graph, at, j).or_else(|| {
                let edge = |k: u32| distance(positions[at as usize], positions[k as usize]);
                view.searched_step(graph, at, j, left, edge)
            });
            // Only a file that lies has no next step, or one that is no nearer.
            let Some((next, nearer)) = next.filter(|&(_, d)| d < left) else {
                path.clear();
                return None;
            };
            (at, left) = (next, nearer);
            path.push(at);
        }
        Some(whole)
    }

    /// Where the path from `at` to `j` goes on, and how far it is from there, if that is stored.
    fn stored_step(&self, graph: &Adjacency, at: u32, j: u32) -> Option<(u32, f32)> {
        let first = self.starts[at as usize] as usize;
        let place = self.of(at as usize).iter().position(|close| close.point == j)?;
        let rank = *self.onward.get(first + place)?;
        if rank == ELSEWHERE {
            return None;
        }
        let next = *graph.of(at as usize).get(usize::from(rank))?;
        Some((next, self.distance(next, j)?))
    }

    /// Where paths go on, beside each pair.
    fn all_onward(&self, network: Network<'_>) -> Vec<u8> {
        let view = self.view();
        let length = self.len().div_ceil(STRETCHES).max(1);
        let stretches = ranges_with(
            self.len(),
            length,
            || vec![0_u32; self.len()],
            |place, points| {
                let mut ranks = Vec::new();
                for i in points {
                    let (list, first) = (view.of(i), ranks.len());
                    ranks.resize(first + list.len(), ELSEWHERE);
                    for (k, close) in (1..).zip(list) {
                        place[close.point as usize] = k;
                    }
                    for (rank, (k, edge)) in (0..ELSEWHERE).zip(network.edges(i)) {
                        for close in view.of(k as usize) {
                            let here = place[close.point as usize] as usize;
                            if here > 0 && step(close.distance, edge) == list[here - 1].distance {
                                let to = &mut ranks[first + here - 1];
                                *to = rank.min(*to);
                            }
                        }
                    }
                    for close in list {
                        place[close.point as usize] = 0;
                    }
                }
                ranks
            },
        );
        stretches.concat()
    }

    /// The arrays, taken once.
    pub(crate) fn view(&self) -> Lists<'_> {
        Lists { starts: &self.starts, pairs: &self.pairs }
    }
}

/// The lists of a map, borrowed.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lists<'a> {
    starts: &'a [u32],
    pairs: &'a [Close],
}

impl<'a> Lists<'a> {
    #[inline]
    pub(crate) fn of(&self, i: usize) -> &'a [Close] {
        &self.pairs[self.starts[i] as usize..self.starts[i + 1] as usize]
    }

    #[inline]
    pub(crate) fn distance(&self, i: u32, j: u32) -> Option<f32> {
        self.of(i as usize).iter().find(|close| close.point == j).map(|close| close.distance)
    }

    /// The neighbour of `at` over which the way of length `left` to `j` goes on, and how far it is from there: of
    /// several the first.
    fn searched_step(
        &self,
        graph: &Adjacency,
        at: u32,
        j: u32,
        left: f32,
        edge: impl Fn(u32) -> f32,
    ) -> Option<(u32, f32)> {
        graph.of(at as usize).iter().find_map(|&k| {
            let nearer = self.distance(k, j)?;
            (step(nearer, edge(k)) == left).then_some((k, nearer))
        })
    }
}

/// Searches that reach the same points at the same distances as
/// [`GeodesicScratch::within`](crate::GeodesicScratch::within), in any order. A shortest distance is the least over all
/// ways, in whichever order they are tried; so nothing has to be kept sorted but roughly, and a point whose way is
/// improved after it was left is left once more.
struct Spread {
    /// The least distance known; infinite between searches.
    least: Vec<f32>,
    touched: Vec<u32>,
    /// Points to be left, by their distances.
    shells: [Vec<Reached>; SHELLS],
}

impl Spread {
    fn new(count: usize) -> Self {
        Self {
            least: vec![f32::INFINITY; count],
            touched: Vec::new(),
            shells: [const { Vec::new() }; SHELLS],
        }
    }

    /// Appends all points within `reach` of `source`.
    fn within(&mut self, network: Network<'_>, source: u32, reach: f32, reached: &mut Vec<Reached>) {
        let per_length = SHELLS_F32 / reach;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "it saturates")]
        let shell_of = |distance: f32| ((distance * per_length) as usize).min(SHELLS - 1);
        self.least[source as usize] = 0.0;
        self.touched.push(source);
        self.shells[0].push(Reached { point: source, distance: 0.0 });
        for shell in 0..SHELLS {
            while let Some(Reached { point, distance: along }) = self.shells[shell].pop() {
                if self.least[point as usize] < along {
                    continue;
                }
                for (to, length) in network.edges(point as usize) {
                    let distance = step(along, length);
                    let least = &mut self.least[to as usize];
                    if distance <= reach && distance < *least {
                        if *least == f32::INFINITY {
                            self.touched.push(to);
                        }
                        *least = distance;
                        self.shells[shell_of(distance)].push(Reached { point: to, distance });
                    }
                }
            }
        }
        reached.extend(self.touched.drain(..).map(|point| {
            let distance = std::mem::replace(&mut self.least[point as usize], f32::INFINITY);
            Reached { point, distance }
        }));
    }
}

/// Sorts each list by distance, then index.
fn sort_lists(starts: &[u32], pairs: &mut [Close]) {
    let mut rest = pairs;
    let mut stretches = Vec::with_capacity(starts.len() / SORTED + 1);
    let count = starts.len() - 1;
    for first in (0..count).step_by(SORTED) {
        let starts = &starts[first..=(first + SORTED).min(count)];
        let (some, others) = rest.split_at_mut((starts[starts.len() - 1] - starts[0]) as usize);
        stretches.push((starts, some));
        rest = others;
    }
    for_each(stretches, |(starts, pairs)| {
        for two in starts.windows(2) {
            let list = (two[0] - starts[0]) as usize..(two[1] - starts[0]) as usize;
            pairs[list].sort_unstable_by_key(rank);
        }
    });
}

/// An index as it is stored.
///
/// # Panics
/// When it is 2³² or more.
pub(crate) fn id32(i: usize) -> u32 {
    u32::try_from(i).unwrap_or_else(|_| panic!("point {i} is more than an index holds"))
}
