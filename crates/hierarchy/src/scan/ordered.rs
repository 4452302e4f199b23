//! The points in the order of their final tree, whose root parts dense from sparse ones, and what is known of
//! them then.

use nearmiss_geometry::PointCloud;
use nearmiss_index::{BlockBoxes, PointBlock};
use nearmiss_lanes::id32;

use crate::bounds::boxes::OrientedBox;
use crate::patch::classes::{dense_first, vote};
use crate::patch::surfels::{Fit, fits};
use crate::point::gather::Index;
use crate::point::neighbours::{self, groups as groups_of};
use crate::scan::options::{BuildError, BuildOptions};
use crate::scan::sampling::{Sampling, set_reaches};
use crate::tree::split::{Item, split};
use crate::tree::topology::Topology;
use crate::tree::wide::Bare;

/// Points in order, with their classes.
pub(crate) struct Ordered {
    pub(crate) topology: Topology,
    /// About the points alone, in the order of the nodes' ids.
    pub(crate) boxes: Vec<OrientedBox>,
    pub(crate) positions: Vec<[f32; 3]>,
    /// Their numbers in the input.
    pub(crate) source: Vec<u32>,
    pub(crate) fits: Vec<Fit>,
    /// Sparse points come from here on.
    pub(crate) dense: usize,
    /// A bounding ball for each block of `sampling.blocks`.
    pub(crate) groups: Vec<PointBlock>,
    pub(crate) sampling: Sampling,
}

impl Ordered {
    /// Orders the points of a cloud. A first tree of all points tells their spacing and the surface that they
    /// sample. If some are sparse, a second tree parts these from the others.
    pub(crate) fn of(cloud: &PointCloud, options: &BuildOptions) -> Result<Self, BuildError> {
        let leaf_size = options.leaf_size as usize;
        let mut items: Vec<Item> =
            (0..).zip(cloud.positions()).map(|(index, &position)| Item { position, index }).collect();
        let points = id32(items.len());
        let topology = Topology::new(points, options.leaf_size);
        let mut boxes = split(&mut items, &topology, cloud.positions().len());
        let mut positions: Vec<[f32; 3]> = items.iter().map(|item| item.position).collect();
        let mut source: Vec<u32> = items.iter().map(|item| cloud.source()[item.index as usize]).collect();
        drop(items);

        let mut sampling =
            Sampling::of(&positions, (&topology, &mut boxes), options, 1.0 / cloud.frame().scale)?;
        let mut groups = groups_of(&sampling.blocks);
        let bare = Bare::new(topology, &boxes);
        let index = Index::without_lists(bare.tree(), (&sampling.blocks, &groups), &sampling.plan);
        let mut fits = fits(&index, &positions, (&sampling.radii, &sampling.spacings));
        sampling.spacings = Vec::new();
        let neighbours = BlockBoxes::new(&sampling.blocks, positions.len());
        vote(&neighbours.over(&sampling.blocks), &positions, &sampling.radii, &mut fits);
        drop(neighbours);
        let mut dense = positions.len();
        if let Some((mut items, count)) = dense_first(&positions, &fits, leaf_size) {
            dense = count;
            boxes = split(&mut items, &topology, dense);
            positions = items.iter().map(|item| item.position).collect();
            source = reordered(&items, &source);
            fits = reordered(&items, &fits);
            sampling.radii = reordered(&items, &sampling.radii);
            set_reaches(&topology, &mut boxes, &sampling.radii);
            sampling.blocks = neighbours::blocks(&sampling.plan, &positions, &sampling.radii);
            groups = groups_of(&sampling.blocks);
        }
        Ok(Self { topology, boxes, positions, source, fits, dense, groups, sampling })
    }
}

/// The values of points in the order of `items`, whose indices are their places before.
fn reordered<T: Copy>(items: &[Item], values: &[T]) -> Vec<T> {
    items.iter().map(|item| values[item.index as usize]).collect()
}
