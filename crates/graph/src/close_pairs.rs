//! The close-pairs shortest-paths map: for every point the points that are heard there, and how far they are
//! along the graph.
//!
//! Klein & Zachmann 2005 (§3.2): shortest paths from each point, only as far as its influence reaches. How
//! far that is differs from point to point here, so a search goes out from the one that is heard, to its own
//! horizon, and what it finds is entered with those that hear it. O(N) in time and space where each point
//! hears a bounded number.
//!
//! Paths need not be stored: every point on the way from i to j hears j too, and says how far it still is.
//! Distances are rounded, though, so neither do they grow along each edge, nor is the neighbour over which
//! the way looks shortest always on a shortest one. Where the way that they show may be longer than promised,
//! a search looks at all that might be shorter.

use nearmiss_lanes::id32;
use nearmiss_lanes::parallel::{for_each, ranges, ranges_with};
use nearmiss_store::Array;

use crate::close_list::{BESIDE, Beside, Close, CloseList, Lists, floor, kept, pack};
use crate::geodesic::{GeodesicScratch, Reached};
use crate::length::{Network, step};
use crate::options::Paths;

/// No more stretches than this are searched from: memory is made for each.
const STRETCHES: usize = 64;

/// Lists that are sorted together.
const SORTED: usize = 1024;

/// Points that are reached are sorted into as many shells.
const SHELLS: usize = 32;
const SHELLS_F32: f32 = 32.0;

/// Where the way goes on is not stored: it stands among too many neighbours.
const ELSEWHERE: u8 = u8::MAX;

/// Distances are rounded by this share of them at most.
const ROUNDING: f32 = 1.0 / 16384.0;

/// A way that is no longer than the rounded distance by more is longer than the shortest by 1e-4 at most.
const SURE: f32 = 1e-4 - ROUNDING;

/// And a shortest one seems no longer by more, from any of its points: once for the whole, once for what is
/// left, once for sums.
const DOUBT: f32 = 3.0 * ROUNDING;

/// For every point the points that are heard there, nearest first.
#[derive(Debug, Clone, PartialEq)]
pub struct ClosePairs {
    /// Where the list of each point begins, and where the last one ends.
    pub(crate) starts: Array<u32>,
    /// The exponent of the least distance that fits the list of each point.
    pub(crate) floors: Array<u8>,
    /// All lists, each by exact distance, then index: by how much the index is more than that of the list's
    /// point.
    pub(crate) offsets: Array<i16>,
    /// Beside each offset the distance.
    pub(crate) codes: Array<u16>,
    /// The pairs that do not fit, in order.
    pub(crate) beside: Array<Beside>,
    /// Beside each pair the rank of where the path goes on; or none at all.
    pub(crate) onward: Array<u8>,
}

/// By distance, then index.
#[inline]
fn rank(close: &Close) -> u64 {
    u64::from(close.distance.to_bits()) << 32 | u64::from(close.point)
}

impl ClosePairs {
    /// The pairs of points (i, j) with a way from j to i no longer than the horizon of j, on all cores; the
    /// result does not depend on how many there are.
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
        let mut pairs = vec![Close { point: 0, distance: 0.0 }; total];
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
        let onward = match paths {
            Paths::Rebuilt => Vec::new(),
            Paths::Stored => ranks_onward(network, &starts, &pairs),
        };
        let mut built = pack_lists(&starts, &pairs);
        (built.starts, built.onward) = (starts.into(), onward.into());
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
        self.offsets.len()
    }

    /// Whether paths are stored.
    #[must_use]
    pub fn paths(&self) -> Paths {
        if self.onward.is_empty() { Paths::Rebuilt } else { Paths::Stored }
    }

    /// What all of it takes, in bytes.
    #[must_use]
    pub fn byte_len(&self) -> usize {
        let lists = size_of_val(&*self.starts) + self.floors.len();
        lists + 4 * self.pair_count() + size_of_val(&*self.beside) + self.onward.len()
    }

    /// The points heard at `i`, itself first, by distance; of equal ones those that were nearer before
    /// rounding, then those of lesser index first.
    ///
    /// # Panics
    /// When there is no such point.
    #[must_use]
    pub fn of(&self, i: usize) -> CloseList<'_> {
        self.view().of(i)
    }

    /// How far `j` is from `i`, within 2⁻¹⁴ of it, if it is heard there. A pass over the list of `i`.
    ///
    /// # Panics
    /// When there is no point `i`.
    #[must_use]
    pub fn distance(&self, i: u32, j: u32) -> Option<f32> {
        Some(self.view().find(i, j)?.1)
    }

    /// The length of a path from `i` to `j`, if `j` is heard at `i`, longer than the shortest by 1e-4 of it
    /// at most; `path` holds its points afterwards, both included, or none. Given the graph with the lengths
    /// that the map was built from. No allocation once warm.
    ///
    /// Klein & Zachmann 2005 (Algorithm 2) go to the neighbour nearest to the target, keeping a queue of all
    /// that are nearer than those they leave; what they find need not be shortest. We go where the edge and
    /// the distance left are shortest together. Should the sum of the edges be too long then, which is one
    /// time in twenty or fewer, a search finds a shortest path.
    ///
    /// # Panics
    /// When there is no point `i`.
    pub fn path(
        &self,
        network: Network<'_>,
        [i, j]: [u32; 2],
        scratch: &mut GeodesicScratch,
        path: &mut Vec<u32>,
    ) -> Option<f32> {
        path.clear();
        let view = self.view();
        let whole = self.distance(i, j).filter(|_| (j as usize) < self.len())?;
        let known = match self.paths() {
            Paths::Stored => self.stored_path(network, [i, j], path),
            Paths::Rebuilt => None,
        };
        if let Some(length) = known.or_else(|| self.walked_path(network, [i, j], whole, path)) {
            return Some(length);
        }
        path.clear();
        // Sums of a thousand edges that vanish in them may err by more.
        let length = [(1.0 + DOUBT) * whole, f32::INFINITY].into_iter().find_map(|most| {
            let is_on_the_way = |k, along| view.find(k, j).is_some_and(|(_, left)| along + left <= most);
            scratch.search(network, [(i, 0.0)], f32::MAX, is_on_the_way, |k| k == j);
            scratch.found(j)
        })?;
        scratch.trace(j, path);
        path.reverse();
        Some(length)
    }

    /// Follows the ranks that are stored, if all are.
    fn stored_path(&self, network: Network<'_>, [i, j]: [u32; 2], path: &mut Vec<u32>) -> Option<f32> {
        let (view, mut at, mut length) = (self.view(), i, 0.0);
        path.push(i);
        while at != j {
            let rank = *self.onward.get(view.find(at, j)?.0).filter(|&&rank| rank != ELSEWHERE)?;
            let (next, edge) = network.edges(at as usize).nth(rank.into())?;
            (at, length) = (next, step(length, edge));
            path.push(at);
            // Only in a file that lies it goes round.
            if path.len() > self.len() {
                return None;
            }
        }
        Some(length)
    }

    /// Goes from neighbour to neighbour where the whole way looks shortest, each nearer to `j` than the one
    /// before, if that is possible and short enough for the distance that is stored.
    fn walked_path(
        &self,
        network: Network<'_>,
        [i, j]: [u32; 2],
        whole: f32,
        path: &mut Vec<u32>,
    ) -> Option<f32> {
        let (view, mut at, mut left, mut length) = (self.view(), i, whole, 0.0);
        path.clear();
        path.push(i);
        while at != j {
            let mut best = (f32::INFINITY, None);
            for (k, edge) in network.edges(at as usize) {
                let Some((_, onward)) = view.find(k, j).filter(|&(_, onward)| onward < left) else {
                    continue;
                };
                if edge + onward < best.0 {
                    best = (edge + onward, Some((k, onward, step(length, edge))));
                }
            }
            (at, left, length) = best.1?;
            path.push(at);
        }
        (length <= (1.0 + SURE) * whole).then_some(length)
    }

    /// The arrays, taken once.
    pub(crate) fn view(&self) -> Lists<'_> {
        Lists {
            starts: &self.starts,
            floors: &self.floors,
            offsets: &self.offsets,
            codes: &self.codes,
            beside: &self.beside,
        }
    }
}

/// Where paths go on, beside each pair of lists of exact distances: there is a neighbour that the search
/// reached before, whose distance plus the edge is that of the pair, to the last bit; of several the first.
fn ranks_onward(network: Network<'_>, starts: &[u32], pairs: &[Close]) -> Vec<u8> {
    let count = network.len();
    let list_of = |i: usize| &pairs[starts[i] as usize..starts[i + 1] as usize];
    let length = count.div_ceil(STRETCHES).max(1);
    let stretches = ranges_with(
        count,
        length,
        || vec![0_u32; count],
        |place, points| {
            let mut ranks = Vec::new();
            for i in points {
                let (list, first) = (list_of(i), ranks.len());
                ranks.resize(first + list.len(), ELSEWHERE);
                for (k, close) in (1..).zip(list) {
                    place[close.point as usize] = k;
                }
                for (rank, (k, edge)) in (0..ELSEWHERE).zip(network.edges(i)) {
                    for close in list_of(k as usize) {
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

/// Lists of exact distances as they are stored, without starts and steps of paths.
fn pack_lists(starts: &[u32], pairs: &[Close]) -> ClosePairs {
    let is_beside = |(_, (offset, _)): &(u32, (&i16, &Close))| **offset == BESIDE;
    let stretches = ranges(starts.len() - 1, |points| {
        let count = (starts[points.end] - starts[points.start]) as usize;
        let (mut offsets, mut codes) = (Vec::with_capacity(count), Vec::with_capacity(count));
        let (mut floors, mut beside) = (Vec::with_capacity(points.len()), Vec::new());
        for i in points {
            let list = starts[i]..starts[i + 1];
            let closes = &pairs[list.start as usize..list.end as usize];
            let (own, floor, first) = (id32(i), floor(closes), offsets.len());
            floors.push(floor);
            offsets.extend(closes.iter().map(|&close| pack(own, floor, close).0));
            codes.extend(closes.iter().map(|&close| pack(own, floor, close).1));
            for (pair, (_, close)) in list.zip(offsets[first..].iter().zip(closes)).filter(is_beside) {
                beside.push(Beside { pair, point: close.point, distance: kept(close.distance) });
            }
        }
        (floors, offsets, codes, beside)
    });
    let (mut floors, mut beside) = (Vec::with_capacity(starts.len()), Vec::new());
    let (mut offsets, mut codes) = (Vec::with_capacity(pairs.len()), Vec::with_capacity(pairs.len()));
    for mut stretch in stretches {
        floors.append(&mut stretch.0);
        offsets.append(&mut stretch.1);
        codes.append(&mut stretch.2);
        beside.append(&mut stretch.3);
    }
    ClosePairs {
        starts: Array::default(),
        floors: floors.into(),
        offsets: offsets.into(),
        codes: codes.into(),
        beside: beside.into(),
        onward: Array::default(),
    }
}

/// Searches that reach the same points at the same distances as
/// [`GeodesicScratch::within`](crate::GeodesicScratch::within), in any order. A shortest distance is the
/// least over all ways, in whichever order they are tried; so nothing has to be kept sorted but roughly, and
/// a point whose way is improved after it was left is left once more.
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
