//! The sampling density: local radii, the sampling radius, and the points with their support radii.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x16, mask32x16};
use nearmiss_index::{BlockBoxes, PointBlock};
use nearmiss_lanes::parallel::{both, change_each, fill, ranges};
use nearmiss_lanes::wide::{WIDTH, greatest};
use nearmiss_store::{Room, Workspace};
use nearmiss_surface::SurfacePlan;

use crate::bounds::boxes::OrientedBox;
use crate::point::spacing::{Spacing, fold_nodes, limit, smooth, spacings};
use crate::scan::options::{BuildError, BuildOptions};
use crate::scan::share;
use crate::tree::topology::Topology;

/// The share of points whose local radius is at most the scan's sampling radius.
const SAMPLING_QUANTILE: f64 = 0.9;

/// The default reach divided by the 0.9-quantile of the radii, before radii are limited. With 2,
/// the middle of the widest bridged gap is that quantile away from either side.
const REACH: f32 = 2.0;

/// The sampling density of a scan, and the quantities derived from it.
pub(crate) struct Sampling {
    pub(crate) spacings: Room<Spacing>,
    pub(crate) radii: Room<f32>,
    pub(crate) sampling_radius: f32,
    /// The upper limit of all radii.
    pub(crate) reach: f32,
    pub(crate) plan: SurfacePlan,
    /// The points in blocks, with their support radii.
    pub(crate) blocks: Room<PointBlock>,
}

impl Sampling {
    /// Computes the sampling density of points under the nodes of `topology`, and sets the greatest
    /// radii in `boxes`. `unit` is the length of the caller's unit in the coordinates of the
    /// points.
    pub(crate) fn of(
        positions: &[[f32; 3]],
        (topology, boxes): (&Topology, &mut [OrientedBox]),
        options: &BuildOptions,
        unit: f64,
        work: &Workspace,
    ) -> Result<Self, BuildError> {
        let mut blocks = work.room(positions.len().div_ceil(WIDTH))?;
        let places = |number: usize| number * WIDTH..positions.len().min((number + 1) * WIDTH);
        fill(&mut blocks, |number| PointBlock::of(&positions[places(number)]));
        let neighbours = BlockBoxes::new_in(work, &blocks, positions.len())?;
        let tree = neighbours.over(&blocks);
        let mut spacings = spacings(positions, &tree, options.radius_neighbours as usize, work)?;
        work.progress().reach(share::SPACINGS);
        let mut radii = smooth(&tree, &spacings, work)?;
        work.progress().reach(share::RADII);
        let mut selection = Selection::default();
        let reach = reach_of(options, selection.of(&radii), unit);
        let far = extent(positions);
        check_reach(reach, far, unit).map_err(|refused| match options.reach {
            Some(_) => refused,
            None => {
                let [spacing, extent] = [reach / REACH, far].map(|x| f64::from(x) / unit);
                BuildError::Spread { spacing, extent }
            }
        })?;
        limit(&mut spacings, &mut radii, reach);
        let sampling_radius = selection.of(&radii);
        let plan = SurfacePlan::new(&options.surface, f64::from(sampling_radius), unit)?;
        set_reaches(topology, boxes, &radii);
        change_each(&mut blocks, 1 << 8, |number, block| plan.tune(block, &radii[places(number)]));
        Ok(Self { spacings, radii, sampling_radius, reach, plan, blocks })
    }
}

/// Returns the upper limit of all radii, given the 0.9-quantile of those that are not limited yet.
#[expect(clippy::cast_possible_truncation, reason = "stored in single precision")]
pub(crate) fn reach_of(options: &BuildOptions, quantile: f32, unit: f64) -> f32 {
    options.reach.map_or(REACH * quantile, |reach| (reach * unit) as f32)
}

/// Checks that a reach is positive, finite, and more than the rounding error of coordinates up to
/// `extent`.
pub(crate) fn check_reach(reach: f32, extent: f32, unit: f64) -> Result<(), BuildError> {
    let is_sound = reach.is_normal() && reach >= f32::EPSILON * extent;
    if is_sound { Ok(()) } else { Err(BuildError::Reach(f64::from(reach) / unit)) }
}

/// Sets the greatest radius of the points in the boxes of all nodes, if there are any.
pub(crate) fn set_reaches(topology: &Topology, boxes: &mut [OrientedBox], radii: &[f32]) {
    if boxes.is_empty() {
        return;
    }
    let reaches = fold_nodes(topology, |range| radii[range].iter().copied().fold(0.0, f32::max), f32::max);
    for (bounds, reach) in boxes.iter_mut().zip(reaches) {
        bounds.reach = reach;
    }
}

/// Returns the greatest absolute coordinate.
fn extent(positions: &[[f32; 3]]) -> f32 {
    /// The coordinates of four points, which fill registers.
    const ROW: usize = 12;
    let greatest = ranges(positions.len(), |range| {
        let (rows, rest) = positions[range].as_flattened().as_chunks::<ROW>();
        let mut most = [0.0_f32; ROW];
        let mut take = |i: usize, x: f32| most[i] = if x.abs() > most[i] { x.abs() } else { most[i] };
        for row in rows {
            for i in 0..ROW {
                take(i, row[i]);
            }
        }
        rest.iter().for_each(|x| take(0, *x));
        most.into_iter().fold(0.0, f32::max)
    });
    greatest.into_iter().fold(0.0, f32::max)
}

/// Selects the [sampling radius](sampling_rank), with memory that is reused.
#[derive(Debug, Clone, Default)]
pub(crate) struct Selection {
    sample: Vec<f32>,
    /// The radii of both halves between two bounds.
    between: [Vec<f32>; 2],
    greatest: f32,
}

impl Selection {
    /// Returns the sampling radius of radii, none of which may be NaN. O(n): a sample gives two bounds,
    /// and the few radii between them are selected from (Floyd & Rivest 1975).
    pub(crate) fn of(&mut self, radii: &[f32]) -> f32 {
        const SAMPLE: usize = 1 << 10;
        /// Four standard deviations of the rank of the quantile in a random sample.
        const MARGIN: usize = 38;
        /// One in this many radii is expected in each half.
        const USUAL: usize = 16;
        let Self { sample, between: [found, more], greatest } = self;
        sample.clear();
        sample.extend(radii.iter().step_by(radii.len().div_ceil(SAMPLE)));
        sample.sort_unstable_by(f32::total_cmp);
        let place = sampling_rank(sample.len());
        let bounds = [place.saturating_sub(MARGIN), (place + MARGIN).min(sample.len() - 1)];
        let bounds = bounds.map(|place| sample[place]);
        found.clear();
        more.clear();
        found.reserve(2 * radii.len() / USUAL);
        more.reserve(radii.len() / USUAL);
        let (left, right) = radii.split_at(radii.len() / 2);
        let (left, right) = both(|| ranks(left, bounds, found), || ranks(right, bounds, more));
        found.append(more);
        *greatest = left.1.max(right.1);
        let [below, to_low, to_high] = [0, 1, 2].map(|k| left.0[k] + right.0[k]);
        let rank = sampling_rank(radii.len());
        if (below..to_low).contains(&rank) {
            bounds[0]
        } else if (to_low..to_low + found.len()).contains(&rank) {
            *found.select_nth_unstable_by(rank - to_low, f32::total_cmp).1
        } else if (to_low..to_high).contains(&rank) {
            bounds[1]
        } else {
            // The sample differs from the whole.
            found.clear();
            found.extend_from_slice(radii);
            *found.select_nth_unstable_by(rank, f32::total_cmp).1
        }
    }

    /// Returns the greatest of the radii that were last selected from, at least 0.
    pub(crate) const fn greatest(&self) -> f32 {
        self.greatest
    }
}

/// Appends the radii between `low` and `high` to `between`. Returns the numbers of radii that are less
/// than `low`, at most `low`, and at most `high`, with the greatest radius.
fn ranks(radii: &[f32], bounds: [f32; 2], between: &mut Vec<f32>) -> ([usize; 3], f32) {
    dispatch!(Level::new(), simd => simd.vectorize(
        #[inline(always)]
        || ranks_in_lanes(simd, radii, bounds, between),
    ))
}

#[inline(always)]
fn ranks_in_lanes<S: Simd>(
    simd: S,
    radii: &[f32],
    [low, high]: [f32; 2],
    between: &mut Vec<f32>,
) -> ([usize; 3], f32) {
    let (lows, highs) = (f32x16::splat(simd, low), f32x16::splat(simd, high));
    let mut most = f32x16::splat(simd, 0.0);
    let mut counts = [0; 3];
    let (rows, rest) = radii.as_chunks::<WIDTH>();
    for row in rows {
        let lanes = f32x16::load_array_ref(simd, row);
        most = most.max(lanes);
        // No closure: it may be compiled without the instruction set of the caller.
        let below: mask32x16<S> = lanes.simd_lt(lows);
        let to_low: mask32x16<S> = lanes.simd_le(lows);
        let to_high: mask32x16<S> = lanes.simd_le(highs);
        let below_high: mask32x16<S> = lanes.simd_lt(highs);
        let (below, to_low, to_high) = (below.to_bitmask(), to_low.to_bitmask(), to_high.to_bitmask());
        for (count, lanes) in counts.iter_mut().zip([below, to_low, to_high]) {
            *count += lanes.count_ones() as usize;
        }
        let mut inner = below_high.to_bitmask() & !to_low;
        while inner != 0 {
            between.push(row[inner.trailing_zeros() as usize]);
            inner &= inner - 1;
        }
    }
    for &radius in rest {
        counts[0] += usize::from(radius < low);
        counts[1] += usize::from(radius <= low);
        counts[2] += usize::from(radius <= high);
        between.extend((radius > low && radius < high).then_some(radius));
    }
    (counts, greatest(most, rest.iter().copied().fold(0.0, f32::max)))
}

/// Returns the index of the sampling radius among `count` ascending radii.
#[expect(
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "an index below 2^32"
)]
pub(crate) fn sampling_rank(count: usize) -> usize {
    ((count - 1) as f64 * SAMPLING_QUANTILE).round() as usize
}

#[cfg(test)]
mod tests {
    use nearmiss_testdata::arbitrary::rng;
    use rand::RngExt;

    use super::*;

    #[test]
    fn the_sampling_radius_is_that_of_sorted_radii() {
        let (rng, mut selection) = (&mut rng(5), Selection::default());
        let mut few: Vec<Vec<f32>> = vec![vec![0.0], vec![2.0, 1.0], vec![1.0; 5000]];
        // Multiples of the step of the sample: it holds the least radii only, then the greatest.
        few.extend(
            [0.0, 9.0].map(|x| (0..10_240_u16).map(|i| if i % 10 == 0 { x } else { f32::from(i) }).collect()),
        );
        few.extend([1, 2, 10, 1000].map(|values| {
            (0..20_000)
                .map(|_| if rng.random_range(0..10) < 9 { 1.0 } else { rng.random_range(0..=values) as f32 })
                .collect()
        }));
        few.extend(
            [10, 1023, 1024, 1025, 30_000]
                .map(|count| (0..count).map(|_| rng.random_range(0.0..1e-20)).collect()),
        );
        for radii in few {
            let mut sorted = radii.clone();
            sorted.sort_unstable_by(f32::total_cmp);
            let expected = sorted[sampling_rank(radii.len())];
            assert_eq!(selection.of(&radii), expected, "of {} radii", radii.len());
            assert_eq!(selection.greatest(), sorted[radii.len() - 1], "of {} radii", radii.len());
        }
    }
}
