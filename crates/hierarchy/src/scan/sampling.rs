//! How densely points lie: local radii, the sampling radius, and the points with their horizons.

use nearmiss_index::{BlockBoxes, PointBlock};
use nearmiss_surface::SurfacePlan;

use crate::bounds::boxes::OrientedBox;
use crate::point::spacing::{Spacing, fold_nodes, limit, smooth, spacings};
use crate::scan::options::{BuildError, BuildOptions};
use crate::tree::topology::Topology;

/// Share of the points whose local radius is at most the scan's sampling radius.
const SAMPLING_QUANTILE: f64 = 0.9;

/// The default reach over the quantile of the radii that it has yet to limit: a gap whose middle is such a
/// radius from either side is bridged, and no wider one.
const REACH: f32 = 2.0;

/// How densely points lie, and what follows from it.
pub(crate) struct Sampling {
    pub(crate) spacings: Vec<Spacing>,
    pub(crate) radii: Vec<f32>,
    pub(crate) sampling_radius: f32,
    /// No radius exceeds it.
    pub(crate) reach: f32,
    pub(crate) plan: SurfacePlan,
    /// The points with their horizons.
    pub(crate) blocks: Vec<PointBlock>,
}

impl Sampling {
    /// That of points under the nodes of `topology`, in whose boxes the reaches are set; `unit` of the
    /// points' are one of the caller's.
    pub(crate) fn of(
        positions: &[[f32; 3]],
        (topology, boxes): (&Topology, &mut [OrientedBox]),
        options: &BuildOptions,
        unit: f64,
    ) -> Result<Self, BuildError> {
        let mut blocks: Vec<PointBlock> = PointBlock::silent(positions).collect();
        let neighbours = BlockBoxes::new(&blocks, positions.len());
        let tree = neighbours.over(&blocks);
        let mut spacings = spacings(positions, &tree, options.radius_neighbours as usize);
        let mut radii = smooth(&tree, &spacings);
        #[expect(clippy::cast_possible_truncation, reason = "stored in single precision")]
        let reach = options.reach.map_or_else(|| REACH * quantile(&radii), |reach| (reach * unit) as f32);
        if !(reach.is_normal() && reach >= f32::EPSILON * extent(positions)) {
            return Err(BuildError::Reach(f64::from(reach) / unit));
        }
        limit(&mut spacings, &mut radii, reach);
        let sampling_radius = quantile(&radii);
        let plan = SurfacePlan::new(&options.surface, f64::from(sampling_radius), unit)?;
        set_reaches(topology, boxes, &radii);
        for (block, radii) in blocks.iter_mut().zip(radii.chunks(PointBlock::WIDTH)) {
            plan.tune(block, radii);
        }
        Ok(Self { spacings, radii, sampling_radius, reach, plan, blocks })
    }
}

/// Sets in the boxes of all nodes the greatest radius of their points.
pub(crate) fn set_reaches(topology: &Topology, boxes: &mut [OrientedBox], radii: &[f32]) {
    let reaches = fold_nodes(topology, |range| radii[range].iter().copied().fold(0.0, f32::max), f32::max);
    for (bounds, reach) in boxes.iter_mut().zip(reaches) {
        bounds.reach = reach;
    }
}

/// The greatest coordinate.
fn extent(positions: &[[f32; 3]]) -> f32 {
    positions.iter().flatten().fold(0.0, |most, x| most.max(x.abs()))
}

fn quantile(radii: &[f32]) -> f32 {
    let mut sorted = radii.to_vec();
    *sorted.select_nth_unstable_by(sampling_rank(radii.len()), f32::total_cmp).1
}

/// Which of `count` ascending radii, from 0, is the sampling radius.
#[expect(
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "an index below 2^32"
)]
pub(crate) fn sampling_rank(count: usize) -> usize {
    ((count - 1) as f64 * SAMPLING_QUANTILE).round() as usize
}
