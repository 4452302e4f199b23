//! The sampling density: local radii, the sampling radius, and the points with their support radii.

use nearmiss_index::{BlockBoxes, PointBlock};
use nearmiss_lanes::id32;
use nearmiss_lanes::parallel::{both, change_each, fill, ranges};
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
        const WIDTH: usize = PointBlock::WIDTH;
        let mut blocks = work.room(positions.len().div_ceil(WIDTH))?;
        let places = |number: usize| number * WIDTH..positions.len().min((number + 1) * WIDTH);
        fill(&mut blocks, |number| PointBlock::of(&positions[places(number)]));
        let neighbours = BlockBoxes::new_in(work, &blocks, positions.len())?;
        let tree = neighbours.over(&blocks);
        let mut spacings = spacings(positions, &tree, options.radius_neighbours as usize, work)?;
        work.progress().reach(share::SPACINGS);
        let mut radii = smooth(&tree, &spacings, work)?;
        work.progress().reach(share::RADII);
        let mut counts = Vec::new();
        let reach = reach_of(options, quantile(&radii, &mut counts), unit);
        check_reach(reach, extent(positions), unit)?;
        limit(&mut spacings, &mut radii, reach);
        let sampling_radius = quantile(&radii, &mut counts);
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

/// Returns the [sampling radius](sampling_rank) of radii, none of which may be negative. Numbers
/// that are not negative have the same order as their bits. So the highest digits of the bits are
/// counted first, then lower ones. `counts` is reused memory.
pub(crate) fn quantile(radii: &[f32], counts: &mut Vec<u32>) -> f32 {
    /// The number of bits of a digit. With fewer, most numbers have the same one, and its count waits for
    /// itself.
    const DIGIT: u32 = 16;
    let mut rank = id32(sampling_rank(radii.len()));
    let (left, right) = radii.split_at(radii.len() / 2);
    // The bits found so far, and the number of lower ones.
    let (mut found, mut below) = (0_u32, u32::BITS);
    while below > 0 {
        let digit = below.min(DIGIT);
        counts.clear();
        counts.resize(2 << digit, 0);
        let (counts, more) = counts.split_at_mut(1 << digit);
        let count = |radii: &[f32], counts: &mut [u32]| {
            for bits in radii.iter().map(|radius| radius.to_bits()) {
                // The first digit has nothing above it.
                if u64::from(bits) >> below == u64::from(found) {
                    counts[(bits >> (below - digit)) as usize % counts.len()] += 1;
                }
            }
        };
        both(|| count(left, counts), || count(right, more));
        let here = counts.iter().zip(more).position(|(count, more)| {
            let count = *count + *more;
            let is_here = rank < count;
            rank -= if is_here { 0 } else { count };
            is_here
        });
        found = found << digit | id32(here.unwrap_or_default());
        below -= digit;
    }
    f32::from_bits(found)
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
