//! The sample P' of a node: some of its points, spread over it (Klein & Zachmann 2004, §4.2.1).
//!
//! As in the paper, a quasi-random number chooses a leaf under the node, random weights a mean of
//! its points, and the nearest point is drawn. There are three differences, none of which affects
//! the correctness of coverings. The mean is that of three random points of the leaf, because means
//! of all points gather in its centre. The nearest point is searched for in that leaf only. Of
//! several draws the one furthest from the samples so far is kept (Mitchell 1991), so that
//! distances between samples are of the same order, as the paper requires.

use std::ops::Range;

use nearmiss_geometry::NodeId;
use nearmiss_lanes::id32;
use nearmiss_lanes::parallel::fill_runs;
use nearmiss_lanes::vector::{dot, sub};
use nearmiss_store::{Room, WorkError, Workspace};

use crate::patch::centres::Centres;
use crate::tree::topology::Topology;

/// The valid numbers of samples of a node.
pub(crate) const SAMPLES: std::ops::RangeInclusive<u32> = 8..=32;

/// The maximum number of samples of a node.
pub(crate) const MOST_SAMPLES: usize = 32;

/// The list of an inner node; only its first entries are used.
pub(crate) type List = [u32; MOST_SAMPLES];

/// The number of draws for each sample. With two the covering radii of large nodes are 7 % smaller
/// than with one (docs/decisions/0009-coverings-from-cells.md).
const DRAWS: usize = 2;

/// 2⁶⁴ over the golden ratio. Any number of its multiples modulo 2⁶⁴ are spread evenly.
const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// The sample of a node, as indices of points in leaf order, ascending.
#[derive(Debug, Clone, Copy)]
pub struct NodeSamples<'a> {
    /// The first of the points, all of which are samples if there is no list.
    first: usize,
    len: usize,
    list: &'a [u32],
    /// The last point of the node. Larger indices, as in a damaged file, are clamped to it.
    last: usize,
}

impl<'a> NodeSamples<'a> {
    /// Returns all points of a node as its sample.
    #[inline]
    pub(crate) fn all(points: &Range<usize>) -> Self {
        Self { first: points.start, len: points.len(), list: &[], last: points.end - 1 }
    }

    /// Returns the sample in `list` of a node with these points.
    #[inline]
    pub(crate) fn listed(list: &'a [u32], points: &Range<usize>) -> Self {
        Self { first: points.start, len: list.len(), list, last: points.end - 1 }
    }

    /// Returns the number of samples, at least one.
    #[inline]
    #[must_use]
    #[expect(clippy::len_without_is_empty, reason = "every node has a sample")]
    pub fn len(&self) -> usize {
        self.len
    }

    /// Returns the indices of the samples.
    #[inline]
    #[must_use]
    pub fn iter(&self) -> impl ExactSizeIterator<Item = usize> + use<'a> {
        let Self { first, len, list, last } = *self;
        (0..len).map(move |k| list.get(k).map_or(first + k, |&i| (i as usize).clamp(first, last)))
    }
}

/// Returns the sample of a node.
#[inline]
pub(crate) fn samples<'a>(lists: &'a [u32], topology: &Topology, id: NodeId, count: u32) -> NodeSamples<'a> {
    let points = topology.points(id);
    let count = count as usize;
    if topology.is_leaf(id) || points.len() <= count {
        return NodeSamples::all(&points);
    }
    NodeSamples::listed(&lists[id.index() * count..][..count], &points)
}

/// Draws `count` distinct points of the inner node `id`, ascending. If the node has no more,
/// returns all of them, padded with the last.
pub(crate) fn draw(positions: &[[f32; 3]], topology: &Topology, id: NodeId, count: usize) -> List {
    let (points, leaf_size) = (topology.points(id), id32(topology.leaf_size()));
    let (first, end) = (id32(points.start), id32(points.end));
    let mut list = [end - 1; MOST_SAMPLES];
    if points.len() <= count {
        for (entry, i) in list.iter_mut().zip(first..end) {
            *entry = i;
        }
        return list;
    }
    let leaves = u64::from((end - first).div_ceil(leaf_size));
    let mut random = Random::new(id.0);
    let mut chosen = Centres::default();
    // The leaves of successive draws are far from each other; those of later samples are between
    // them.
    let mut turn = random.next();
    for known in 0..count {
        let (mut furthest, mut best) = (-1.0, None);
        for _ in 0..DRAWS {
            turn = turn.wrapping_add(GOLDEN);
            let leaf = id32((((turn >> 32) * leaves) >> 32) as usize);
            let of_leaf = first + leaf * leaf_size;
            let points = &positions[of_leaf as usize..end.min(of_leaf + leaf_size) as usize];
            let i = of_leaf + random.point(points);
            let away = chosen.nearest_sq(positions[i as usize]);
            if away > furthest && !list[..known].contains(&i) {
                (furthest, best) = (away, Some(i));
            }
        }
        let start = first + id32((random.next() >> 32) as usize % points.len());
        let others = (start..end).chain(first..start);
        let Some(i) = best.or_else(|| others.into_iter().find(|i| !list[..known].contains(i))) else { break };
        list[known] = i;
        chosen.push(positions[i as usize]);
    }
    list[..count].sort_unstable();
    list
}

/// Returns the lists of all inner nodes, in order.
pub(crate) fn lists(
    positions: &[[f32; 3]],
    topology: &Topology,
    count: u32,
    work: &Workspace,
) -> Result<Room<u32>, WorkError> {
    let count = count as usize;
    let mut lists = work.room(topology.inner() * count)?;
    fill_runs(&mut lists, count, |id, list| {
        list.copy_from_slice(&draw(positions, topology, NodeId(id32(id)), count)[..list.len()]);
    });
    Ok(lists)
}

/// A pseudorandom sequence: `SplitMix64`, seeded with a node's id.
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(seed: u32) -> Self {
        Self(u64::from(seed) << 32)
    }

    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(GOLDEN);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Returns the index of the point nearest to a weighted mean of three of `points`.
    fn point(&mut self, points: &[[f32; 3]]) -> u32 {
        let (which, weights) = (self.next(), self.next());
        #[expect(clippy::cast_possible_truncation, reason = "a quarter of the bits")]
        let part = |bits: u64, k: u32| (bits >> (16 * k)) as u16;
        let (mut sum, mut mean) = (0.0_f32, [0.0_f32; 3]);
        for k in 0..3 {
            let p = points[(usize::from(part(which, k)) * points.len()) >> 16];
            let weight = 1.0 + f32::from(part(weights, k));
            sum += weight;
            for j in 0..3 {
                mean[j] += weight * p[j];
            }
        }
        let mean = mean.map(|m| m / sum);
        let mut nearest = (f32::INFINITY, 0);
        for (i, p) in (0_u32..).zip(points) {
            let d = sub(*p, mean);
            let d_sq = dot(d, d);
            nearest = if d_sq < nearest.0 { (d_sq, i) } else { nearest };
        }
        nearest.1
    }
}
