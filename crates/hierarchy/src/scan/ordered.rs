//! The points in the order of their final tree, with their radii and classes. Dense points come
//! first, sparse points last.

use bytemuck::Pod;
use nearmiss_index::{BlockBoxes, PointBlock};
use nearmiss_lanes::id32;
use nearmiss_lanes::parallel::fill;
use nearmiss_store::{Room, WorkError, Workspace};
use nearmiss_surface::SurfacePlan;
use serde::{Deserialize, Serialize};

use crate::bounds::boxes::OrientedBox;
use crate::patch::classes::{dense_first, vote};
use crate::patch::surfels::{Fit, fits};
use crate::point::gather::Index;
use crate::point::neighbours::{self, rough_groups, supports};
use crate::scan::options::{BuildError, BuildOptions};
use crate::scan::points::ScanPoints;
use crate::scan::sampling::{Sampling, set_reaches};
use crate::scan::share;
use crate::tree::items::{Item, Parts};
use crate::tree::split::split;
use crate::tree::topology::Topology;
use crate::tree::wide::Tree;

/// Points in order, with their classes.
pub(crate) struct Ordered {
    pub(crate) topology: Topology,
    /// The boxes around the points alone, in the order of the nodes' ids; empty if an order was kept.
    pub(crate) boxes: Room<OrientedBox>,
    pub(crate) positions: Room<[f32; 3]>,
    /// The indices of the points in the input.
    pub(crate) source: Room<u32>,
    pub(crate) radii: Room<f32>,
    pub(crate) fits: Room<Fit>,
    /// The points in blocks, with their support radii.
    pub(crate) blocks: Room<PointBlock>,
    pub(crate) plan: SurfacePlan,
    pub(crate) summary: Summary,
}

/// The scalars of the whole scan.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(crate) struct Summary {
    /// The number of dense points; sparse points follow.
    pub(crate) dense: usize,
    pub(crate) sampling_radius: f32,
    /// The upper limit of all radii.
    pub(crate) reach: f32,
}

/// The purpose of the points in order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Aim {
    /// A scan that is prepared in full. Its gaps are found with its enclosures.
    Prepare,
    /// A frame of a scan that moves, with gaps at all points.
    Follow,
}

impl Aim {
    /// Returns the greatest share of sparse points that stay among the others, in leaves with loose boxes.
    /// A second tree without them would take a quarter of the time of a frame.
    const fn left(self) -> f64 {
        match self {
            Self::Prepare => 0.0,
            Self::Follow => 0.01,
        }
    }
}

impl Ordered {
    /// Orders the points of a scan, or returns the result of an earlier process.
    pub(crate) fn of(
        points: &ScanPoints<'_>,
        options: &BuildOptions,
        work: &Workspace,
    ) -> Result<Self, BuildError> {
        let count = points.positions.len();
        let topology = Topology::new(id32(count), options.leaf_size);
        let unit = 1.0 / points.frame.scale;
        let stage = work.stage("order");
        if let Some(summary) = stage.done::<Summary>() {
            return Ok(Self {
                topology,
                boxes: stage.room("boxes", topology.len())?,
                positions: stage.room("positions", count)?,
                source: stage.room("source", count)?,
                radii: stage.room("radii", count)?,
                fits: stage.room("fits", count)?,
                blocks: stage.room("blocks", count.div_ceil(PointBlock::WIDTH))?,
                plan: SurfacePlan::new(&options.surface, f64::from(summary.sampling_radius), unit)?,
                summary,
            });
        }
        let ordered = Self::new(points, options, Aim::Prepare, work)?;
        let ordered = Self {
            boxes: stage.keep("boxes", ordered.boxes)?,
            positions: stage.keep("positions", ordered.positions)?,
            source: stage.keep("source", ordered.source)?,
            radii: stage.keep("radii", ordered.radii)?,
            fits: stage.keep("fits", ordered.fits)?,
            blocks: stage.keep("blocks", ordered.blocks)?,
            ..ordered
        };
        stage.close(&ordered.summary)?;
        Ok(ordered)
    }

    /// Orders the points. A first tree of all points gives their spacing and the surface that they
    /// sample. If a greater share of the points is sparse than `aim` leaves among the others, a second
    /// tree separates them.
    pub(crate) fn new(
        points: &ScanPoints<'_>,
        options: &BuildOptions,
        aim: Aim,
        work: &Workspace,
    ) -> Result<Self, BuildError> {
        let (count, unit) = (points.positions.len(), 1.0 / points.frame.scale);
        let topology = Topology::new(id32(count), options.leaf_size);
        let mut items = work.room(count)?;
        // Points ascend by their indices in the input, so these break ties as their positions
        // would.
        fill(&mut items, |i| Item { position: points.positions[i], index: points.source[i] });
        let mut boxes = work.room(topology.len())?;
        split(&mut items, &topology, count, Parts::Points, &mut boxes);
        let mut positions = work.room(count)?;
        let mut source = work.room(count)?;
        {
            let items: &[Item] = &items;
            fill(&mut positions, |i| items[i].position);
            fill(&mut source, |i| items[i].index);
        }
        drop(items);
        work.progress().reach(share::TREE);
        let mut ordered =
            Self::classified(topology, boxes, (positions, source), (options, unit, count, aim), work)?;
        let Self { boxes, positions, source, radii, fits, blocks, plan, summary, .. } = &mut ordered;
        let sparse = fits.iter().filter(|fit| fit.kind().is_sparse()).count();
        #[expect(clippy::cast_precision_loss, reason = "counts below 2^32 are exact")]
        let are_many = sparse as f64 > aim.left() * count as f64;
        let known = (|i: usize| positions[i], |i: usize| fits[i].kind());
        if are_many
            && let Some((mut items, before)) = dense_first(count, known, options.leaf_size as usize, work)?
        {
            summary.dense = before;
            split(&mut items, &topology, before, Parts::Points, boxes);
            let items: &[Item] = &items;
            fill(positions, |i| items[i].position);
            *source = reordered(items, source, work)?;
            *fits = reordered(items, fits, work)?;
            *radii = reordered(items, radii, work)?;
            set_reaches(&topology, boxes, radii);
            neighbours::blocks(plan, positions, radii, blocks);
        }
        work.progress().reach(share::ORDERED);
        Ok(ordered)
    }

    /// Keeps the order of some points, the first `dense` of which fill leaves of their own. `unit` is the
    /// length of the caller's unit in their coordinates. There are no boxes.
    pub(crate) fn kept(
        (positions, source): (Room<[f32; 3]>, Room<u32>),
        dense: usize,
        options: &BuildOptions,
        unit: f64,
    ) -> Result<Self, BuildError> {
        let (topology, work) =
            (Topology::new(id32(positions.len()), options.leaf_size), Workspace::in_memory());
        let boxes = work.room(0)?;
        Self::classified(topology, boxes, (positions, source), (options, unit, dense, Aim::Follow), &work)
    }

    /// Computes radii and classes of points in the order of a tree, and sets the greatest radii in its
    /// boxes.
    fn classified(
        topology: Topology,
        mut boxes: Room<OrientedBox>,
        (positions, source): (Room<[f32; 3]>, Room<u32>),
        (options, unit, dense, aim): (&BuildOptions, f64, usize, Aim),
        work: &Workspace,
    ) -> Result<Self, BuildError> {
        let Sampling { spacings, radii, sampling_radius, reach, plan, blocks } =
            Sampling::of(&positions, (&topology, &mut boxes), options, unit, work)?;
        let groups = rough_groups(&blocks, work)?;
        let (supports, tree) = (supports(&groups), Tree::without_boxes(&topology));
        let index =
            Index { supports: Some(&supports), ..Index::without_lists(tree, (&blocks, &groups), &plan) };
        let mut fits = fits(&index, &positions, &spacings, aim == Aim::Follow, work)?;
        drop((supports, groups, spacings));
        work.progress().reach(share::FITS);
        let neighbours = BlockBoxes::new_in(work, &blocks, positions.len())?;
        vote(&neighbours.over(&blocks), &positions, &radii, &mut fits);
        let summary = Summary { dense, sampling_radius, reach };
        Ok(Self { topology, boxes, positions, source, radii, fits, blocks, plan, summary })
    }
}

/// Returns values in the order of `items`, whose indices are the previous positions.
fn reordered<T: Pod + Send + Sync>(
    items: &[Item],
    values: &[T],
    work: &Workspace,
) -> Result<Room<T>, WorkError> {
    let mut room = work.room(items.len())?;
    fill(&mut room, |i| values[items[i].index as usize]);
    Ok(room)
}
