//! Computes all arrays of a scan from its points, except the leaf blocks.

use nearmiss_geometry::NodeId;
use nearmiss_lanes::id32;
use nearmiss_lanes::parallel::fill;
use nearmiss_store::{Room, WorkError, Workspace};
use nearmiss_surface::{Metric, SurfaceOptions, SurfacePlan};

use crate::bounds::boxes::OrientedBox;
use crate::bounds::growth::Growth;
use crate::patch::alignment::align_leaves;
use crate::patch::covering::{Ground, Solid, coverings};
use crate::patch::enclosure::growths;
use crate::patch::extents::{Discs, boxes_of_discs};
use crate::patch::samples::{lists as lists_of_samples, samples};
use crate::patch::surfels::{Known, Surfels, surfels};
use crate::point::disc::DiscRadii;
use crate::point::gather::Index;
use crate::point::neighbours::{groups, neighbours};
use crate::scan::data::{Arrays, HierarchyMeta};
use crate::scan::options::{BuildError, BuildOptions};
use crate::scan::ordered::{Ordered, Summary};
use crate::scan::outline::Outline;
use crate::scan::points::{Placement, ScanPoints};
use crate::scan::share;
use crate::tree::topology::Topology;
use crate::tree::wide::{Bare, Root, growths_of_siblings, reaches, siblings};

/// A scan without leaf blocks, marks and outline.
pub(crate) struct Prepared {
    pub(crate) meta: HierarchyMeta,
    pub(crate) plan: SurfacePlan,
    pub(crate) topology: Topology,
    pub(crate) arrays: Arrays,
    pub(crate) positions: Room<[f32; 3]>,
}

/// Orders the points, fits the surface at each, and bounds the result.
pub(crate) fn prepare(
    points: &ScanPoints<'_>,
    options: &BuildOptions,
    work: &Workspace,
) -> Result<Prepared, BuildError> {
    finish(points, Ordered::of(points, options, work)?, options, work)
}

/// Does the rest for points that are in order.
pub(crate) fn finish(
    points: &ScanPoints<'_>,
    ordered: Ordered,
    options: &BuildOptions,
    work: &Workspace,
) -> Result<Prepared, BuildError> {
    let Ordered { topology, mut boxes, positions, source, radii, fits, blocks, plan, summary } = ordered;
    let Summary { dense, sampling_radius, reach } = summary;
    let groups = groups(&blocks, work)?;
    let bare = Bare::new(work, topology, &boxes)?;
    let index = Index::without_lists(bare.tree(), (&blocks, &groups), &plan);
    let (lists, listed) = neighbours(&index, &positions, &radii, work)?;
    work.progress().reach(share::LISTS);
    let known = Known { positions: &positions, radii: &radii, ordinary: sampling_radius, reach, dense };
    let Surfels { mut normals, codes, balls, cells, leaves, obstacles } =
        surfels(&index, &known, &fits, work)?;
    drop((fits, bare));
    work.progress().reach(share::SURFELS);
    align_leaves(&mut normals, options.leaf_size as usize);
    let discs = DiscRadii { codes: &codes, radii: &radii, reach, sampling_radius };
    let of_points = Discs { normals: &normals, discs, balls: &balls };
    let mut side_by_side = work.room(blocks.len())?;
    fill(&mut side_by_side, |number| of_points.block(number));
    boxes_of_discs(&topology, &mut boxes, &blocks, &side_by_side);
    drop(side_by_side);
    work.progress().reach(share::BOXES);
    let obstacle_growths = growths(&topology, &boxes, &obstacles, work)?;
    let surface_growths = growths(&topology, &boxes, &leaves, work)?;
    drop((obstacles, leaves));
    work.progress().reach(share::ENCLOSURES);
    let mut flat = work.room(positions.len())?;
    fill(&mut flat, |i| Solid::of_disc(discs.get(i), balls[i]));
    drop(balls);
    let sample_lists = lists_of_samples(&positions, &topology, options.samples, work)?;
    let ground = Ground {
        topology: &topology,
        boxes: &boxes,
        growths: &surface_growths,
        positions: &positions,
        normals: &normals,
        radii: &radii,
        discs: &flat,
        cells: &cells,
    };
    let mut covered = work.room(topology.len())?;
    coverings(&ground, |id| samples(&sample_lists, &topology, id, options.samples), &mut covered);
    drop((flat, cells));
    work.progress().reach(share::COVERINGS);
    let root = Root {
        bounds: boxes[NodeId::ROOT.index()],
        growths: [&surface_growths, &obstacle_growths].map(|growths| growths[NodeId::ROOT.index()]),
    };
    let arrays = Arrays {
        blocks: blocks.into(),
        sample_lists: sample_lists.into(),
        coverings: covered.into(),
        groups: groups.into(),
        lists: lists.into(),
        listed: listed.into(),
        normals: normals.into(),
        radii: radii.into(),
        codes: codes.into(),
        source: source.into(),
        ..bounds(&topology, &boxes, [&surface_growths, &obstacle_growths], work)?
    };
    let meta = about(points.placement(), options, *plan.options(), summary, root);
    Ok(Prepared { meta, plan, topology, arrays, positions })
}

/// Returns the arrays of bounds, given the bounds of all nodes in the order of their ids.
fn bounds(
    topology: &Topology,
    boxes: &[OrientedBox],
    [surface, obstacle]: [&[Growth]; 2],
    work: &Workspace,
) -> Result<Arrays, WorkError> {
    let mut of_siblings = work.room(topology.inner())?;
    siblings(topology, boxes, &mut of_siblings);
    let mut greatest = work.room(topology.inner())?;
    reaches(topology, boxes, &mut greatest);
    let growths = |growths: &[Growth]| {
        let mut of_siblings = work.room(topology.inner())?;
        growths_of_siblings(topology, |id| growths[id], &mut of_siblings);
        Ok::<_, WorkError>(of_siblings.into())
    };
    Ok(Arrays {
        siblings: of_siblings.into(),
        reaches: greatest.into(),
        surface_growths: growths(surface)?,
        obstacle_growths: growths(obstacle)?,
        ..Arrays::default()
    })
}

/// Returns the metadata of a scan, without its outline.
pub(crate) fn about(
    placement: Placement,
    options: &BuildOptions,
    surface: SurfaceOptions,
    summary: Summary,
    root: Root,
) -> HierarchyMeta {
    let Summary { dense, sampling_radius, reach } = summary;
    HierarchyMeta {
        frame: placement.frame,
        bounds: placement.bounds,
        dropped: placement.dropped,
        step: placement.step,
        sampling_radius,
        reach,
        dense: id32(dense),
        leaf_size: options.leaf_size,
        radius_neighbours: options.radius_neighbours,
        samples: options.samples,
        is_oriented: false,
        metric: Metric::Euclidean,
        surface,
        root,
        outline: Outline::default(),
    }
}
