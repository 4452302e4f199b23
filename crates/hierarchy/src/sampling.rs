//! How densely points lie: local radii, the sampling radius, and the points with their horizons.

use nearmiss_surface::{BlockTree, PointBlock, SurfacePlan};

use crate::boxes::OrientedBox;
use crate::options::{BuildError, BuildOptions};
use crate::spacing::{Spacing, fold_nodes, smooth, spacings};
use crate::topology::Node;

/// Share of the points whose local radius is at most the scan's sampling radius.
const SAMPLING_QUANTILE: f64 = 0.9;

/// How densely points lie, and what follows from it.
pub(crate) struct Sampling {
    pub(crate) spacings: Vec<Spacing>,
    pub(crate) radii: Vec<f32>,
    pub(crate) sampling_radius: f32,
    pub(crate) plan: SurfacePlan,
    /// The points with their horizons.
    pub(crate) blocks: Vec<PointBlock>,
}

impl Sampling {
    /// That of points under `nodes`, in whose boxes the reaches are set; `unit` of the points' are one of the caller's.
    pub(crate) fn of(
        positions: &[[f32; 3]],
        (nodes, boxes): (&[Node], &mut [OrientedBox]),
        options: &BuildOptions,
        unit: f64,
    ) -> Result<Self, BuildError> {
        let mut blocks: Vec<PointBlock> = PointBlock::silent(positions).collect();
        let tree = BlockTree::new(&blocks, positions.len());
        let spacings = spacings(positions, &tree, options.radius_neighbours as usize);
        let radii = smooth(&tree, &spacings);
        let sampling_radius = quantile(&radii);
        let plan = SurfacePlan::new(&options.surface, f64::from(sampling_radius), unit)?;
        let reaches = fold_nodes(nodes, |range| radii[range].iter().copied().fold(0.0, f32::max), f32::max);
        for (bounds, reach) in boxes.iter_mut().zip(reaches) {
            bounds.reach = reach;
        }
        for (block, radii) in blocks.iter_mut().zip(radii.chunks(PointBlock::WIDTH)) {
            block.tune(&plan, radii);
        }
        Ok(Self { spacings, radii, sampling_radius, plan, blocks })
    }
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
