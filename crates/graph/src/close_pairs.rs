//! The close-pairs shortest-paths map: for each point, its close points and their distances along
//! the graph.
//!
//! Klein & Zachmann 2005, §3.2: shortest paths from each point, only as far as its support radius.
//! A point j is close to i if the distance from j to i is at most the support radius of j, which
//! differs from point to point here. Searches therefore start at j, and enter their results in the
//! lists of the points reached. Takes O(N) time and memory if the number of close points of each
//! point is bounded.
//!
//! Paths need not be stored: every point on the path from i to j has j in its list, with the
//! remaining distance. But distances are rounded. They need not decrease along each edge, and the
//! neighbour that seems best is not always on a shortest path. If the resulting path may be longer
//! than promised, a search among all points that could be on a shorter path follows.

use nearmiss_lanes::id32;
use nearmiss_lanes::parallel::{change_each, ranges, ranges_with};
use nearmiss_store::Array;

use crate::close_list::{BESIDE, Beside, Close, CloseList, Lists, floor, kept, pack};
use crate::geodesic::{GeodesicScratch, Reached};
use crate::length::{Network, step};
use crate::options::Paths;

/// Greatest number of parts searched separately, each of which needs memory of its own.
const STRETCHES: usize = 64;

/// Number of lists that are sorted as one unit of work.
const SORTED: usize = 1024;

/// Number of distance buckets in a search.
const SHELLS: usize = 32;
const SHELLS_F32: f32 = 32.0;

/// Marks a next point whose rank among the neighbours does not fit into a byte.
const ELSEWHERE: u8 = u8::MAX;

/// Greatest relative rounding error of distances.
const ROUNDING: f32 = 1.0 / 16384.0;

/// A path that exceeds the rounded distance by at most this fraction is at most 1e-4 longer than
/// the shortest.
const SURE: f32 = 1e-4 - ROUNDING;

/// Greatest relative excess with which a point of a shortest path can appear: one rounding for the
/// whole distance, one for the remaining distance, one for sums.
const DOUBT: f32 = 3.0 * ROUNDING;

/// For each point its close points, nearest first.
#[derive(Debug, Clone, PartialEq)]
pub struct ClosePairs {
    /// Start of the list of each point, and the end of the last list.
    pub(crate) starts: Array<u32>,
    /// Exponent of the least distance that fits the list of each point.
    pub(crate) floors: Array<u8>,
    /// All lists, sorted by exact distance, then index. An offset is the index of the close point
    /// minus that of the list's point.
    pub(crate) offsets: Array<i16>,
    /// Code of the distance of each offset.
    pub(crate) codes: Array<u16>,
    /// Pairs that do not fit, in order.
    pub(crate) beside: Array<Beside>,
    /// Rank of the next point of the path, for each pair; or empty.
    pub(crate) onward: Array<u8>,
}

/// Sorts by distance, then index.
#[inline]
fn rank(close: &Close) -> u64 {
    u64::from(close.distance.to_bits()) << 32 | u64::from(close.point)
}

impl ClosePairs {
    /// Builds the map of all pairs of points (i, j) where the distance from j to i is at most the
    /// support radius of j. Uses all cores; the result does not depend on their number.
    ///
    /// # Panics
    /// Panics if the number of support radii differs from the number of points, or if there are 2³²
    /// pairs or more.
    #[must_use]
    pub fn build(network: Network<'_>, support_radii: &[f32], paths: Paths) -> Self {
        Self::build_watched(network, support_radii, paths, &|_| ())
    }

    /// Like [`Self::build`]. Each thread passes the shares of the points that it has finished to
    /// `told`; they add up to 1 before the lists are sorted.
    pub(crate) fn build_watched(
        network: Network<'_>,
        support_radii: &[f32],
        paths: Paths,
        told: &(dyn Fn(f64) + Sync),
    ) -> Self {
        let count = network.len();
        assert_eq!(count, support_radii.len(), "expected a support radius for each point");
        let length = count.div_ceil(STRETCHES).max(1);
        let stretches = ranges_with(
            count,
            length,
            || Spread::new(count),
            |spread, sources| {
                let mut ends = Vec::with_capacity(sources.len());
                let mut reached = Vec::new();
                #[expect(clippy::cast_precision_loss, reason = "a share")]
                let share = sources.len() as f64 / count as f64;
                for source in sources {
                    spread.within(network, id32(source), support_radii[source], &mut reached);
                    ends.push(reached.len());
                }
                told(share);
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
        assert!(u32::try_from(total).is_ok(), "expected fewer than 2^32 close pairs, got {total}");
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

    /// Returns the number of pairs.
    #[must_use]
    pub fn pair_count(&self) -> usize {
        self.offsets.len()
    }

    /// Returns the data stored for paths.
    #[must_use]
    pub fn paths(&self) -> Paths {
        if self.onward.is_empty() { Paths::Rebuilt } else { Paths::Stored }
    }

    /// Returns the size of all arrays in bytes.
    #[must_use]
    pub fn byte_len(&self) -> usize {
        let lists = size_of_val(&*self.starts) + self.floors.len();
        lists + 4 * self.pair_count() + size_of_val(&*self.beside) + self.onward.len()
    }

    /// Returns the close points of `i`, sorted by distance, `i` itself first. Distances that are
    /// equal after rounding are in the order before rounding, then in the order of indices.
    ///
    /// # Panics
    /// Panics if `i` is not below [`Self::len`].
    #[must_use]
    pub fn of(&self, i: usize) -> CloseList<'_> {
        self.view().of(i)
    }

    /// Returns the distance of `j` from `i`, with a relative error of at most 2⁻¹⁴, if `j` is close
    /// to `i`. Scans the list of `i`.
    ///
    /// # Panics
    /// Panics if `i` is not a point.
    #[must_use]
    pub fn distance(&self, i: u32, j: u32) -> Option<f32> {
        Some(self.view().find(i, j)?.1)
    }

    /// Returns the length of a path from `i` to `j` if `j` is close to `i`, and sets `path` to its
    /// points, both ends included. `path` is empty if the points are not connected.
    ///
    /// The path is longer than the shortest by at most a fraction of 1e-4. `network` must hold the
    /// graph and the lengths that the map was built from. Does not allocate once warm.
    ///
    /// Algorithm 2 of Klein & Zachmann 2005 goes to the neighbour nearest to the target and keeps a
    /// queue of all neighbours that are nearer than the point left. Its result need not be a
    /// shortest path. Here the path goes to the neighbour with the least sum of edge and remaining
    /// distance. If the sum of the edges then is too long, which happens in at most 5 % of all
    /// cases, a search finds a shortest path.
    ///
    /// # Panics
    /// Panics if `i` is not a point.
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
        // Sums of a thousand edges that are lost in rounding may exceed the first limit.
        let length = [(1.0 + DOUBT) * whole, f32::INFINITY].into_iter().find_map(|most| {
            let is_on_the_way = |k, along| view.find(k, j).is_some_and(|(_, left)| along + left <= most);
            scratch.search(network, [(i, 0.0)], f32::MAX, is_on_the_way, |k| k == j);
            scratch.found(j)
        })?;
        scratch.trace(j, path);
        path.reverse();
        Some(length)
    }

    /// Follows the stored ranks, if they are stored for the whole path.
    fn stored_path(&self, network: Network<'_>, [i, j]: [u32; 2], path: &mut Vec<u32>) -> Option<f32> {
        let (view, mut at, mut length) = (self.view(), i, 0.0);
        path.push(i);
        while at != j {
            let rank = *self.onward.get(view.find(at, j)?.0).filter(|&&rank| rank != ELSEWHERE)?;
            let (next, edge) = network.edges(at as usize).nth(rank.into())?;
            (at, length) = (next, step(length, edge));
            path.push(at);
            // A cycle occurs with a forged file only.
            if path.len() > self.len() {
                return None;
            }
        }
        Some(length)
    }

    /// Goes to the neighbour with the least sum of edge and remaining distance, always nearer to
    /// `j`. Returns `None` if that is impossible, or if the path is too long for the stored
    /// distance.
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

    /// Returns the arrays. Call this once, outside of loops.
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

/// Returns the rank of the next point of the path, for each pair of lists of exact distances. The
/// search reached that neighbour before, and its distance plus the edge equals the distance of the
/// pair, to the last bit. Of several, the first counts.
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

/// Packs lists of exact distances; starts and ranks of paths are left empty.
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
/// [`GeodesicScratch::within`](crate::GeodesicScratch::within), in any order. A shortest distance
/// is a minimum over all paths, whatever the order of the search. Sorting points into coarse
/// buckets is therefore enough; a point whose distance improves after it was expanded is expanded
/// again.
struct Spread {
    /// Least distance known of each point; infinite between searches.
    least: Vec<f32>,
    touched: Vec<u32>,
    /// Points to expand, bucketed by distance.
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
    change_each(&mut stretches, 1, |_, (starts, pairs)| {
        for two in starts.windows(2) {
            let list = (two[0] - starts[0]) as usize..(two[1] - starts[0]) as usize;
            pairs[list].sort_unstable_by_key(rank);
        }
    });
}
