//! A scan whose points are all fitted anew, without what takes longest to prepare: enclosures from
//! neighbours, coverings and neighbour lists (`docs/theory/moving.md`).

use std::sync::OnceLock;

use bytemuck::{Pod, Zeroable};
use nearmiss_geometry::NodeId;
use nearmiss_index::PointBlock;
use nearmiss_lanes::id32;
use nearmiss_lanes::parallel::{fill_runs, map_all, ranges};
use nearmiss_store::Array;

use crate::patch::alignment::align_leaves;
use crate::patch::surfels::{Fit, gaps_of};
use crate::point::disc::PointCode;
use crate::point::gather::{Index, NeighbourList};
use crate::point::leaf_block::LeafParts;
use crate::point::neighbours::supports;
use crate::scan::build::PointHierarchy;
use crate::scan::closing::Closing;
use crate::scan::data::Arrays;
use crate::scan::options::BuildOptions;
use crate::scan::ordered::Ordered;
use crate::scan::points::Placement;
use crate::scan::prepare::about;
use crate::tree::topology::Topology;
use crate::tree::wide::Root;

const WIDTH: usize = PointBlock::WIDTH;

/// Makes a scan of points that are in order and fitted, and bounds the nodes as a refit does. The arrays
/// `before` are memory to reuse.
pub(crate) fn fitted_anew(
    placement: Placement,
    ordered: Ordered,
    options: &BuildOptions,
    closing: &mut Closing,
    before: Arrays,
) -> PointHierarchy {
    let Ordered { topology, positions, source, radii, fits, blocks, plan, summary, .. } = ordered;
    let mut normals = map_all(&fits, |fit| fit.normal);
    align_leaves(&mut normals, topology.leaf_size());
    let arrays = Arrays {
        blocks: blocks.into(),
        normals: normals.into(),
        radii: radii.into(),
        codes: map_all(&fits, |fit| fit.point_code().0).into(),
        source: source.into(),
        ..before
    };
    let meta = about(placement, options, *plan.options(), summary, Root::default());
    let positions = OnceLock::from(Array::from(positions));
    let mut scan = PointHierarchy { meta, plan, topology, arrays, positions };
    resize(&mut scan, topology);
    closing.spread(&scan);
    closing.support(&mut scan);
    find_gaps(&mut scan, &fits);
    closing.bound(&mut scan);
    scan
}

/// Finds the gaps of the points whose `fits` do not tell them.
fn find_gaps(scan: &mut PointHierarchy, fits: &[Fit]) {
    let is_unknown = |i: &usize| !fits[*i].point_code().1;
    let unknown: Vec<u32> =
        ranges(fits.len(), |range| range.filter(is_unknown).map(id32).collect::<Vec<_>>()).concat();
    let supports = supports(&scan.arrays.groups);
    let index = Index { supports: Some(&supports), ..scan.index() };
    let gaps = gaps_of(&index, scan.positions(), |i| fits[i].normal, &unknown);
    let codes = scan.arrays.codes.to_mut();
    for (&i, gap) in unknown.iter().zip(gaps) {
        codes[i as usize] = PointCode::new(fits[i as usize].kind(), gap);
    }
}

/// Gives the arrays of a scan the sizes for a topology. Neighbour lists become empty, samples are
/// spread evenly over the points of each node, and the other arrays are to be filled.
pub(crate) fn resize(scan: &mut PointHierarchy, topology: Topology) {
    let points = topology.points(NodeId::ROOT).len();
    let blocks = points.div_ceil(WIDTH);
    scan.topology = topology;
    let arrays = &mut scan.arrays;
    sized(&mut arrays.siblings, topology.inner());
    sized(&mut arrays.reaches, topology.inner());
    sized(&mut arrays.surface_growths, topology.inner());
    sized(&mut arrays.obstacle_growths, topology.inner());
    sized(&mut arrays.leaf_blocks, topology.leaves() * LeafParts::blocks_a_leaf(&topology));
    sized(&mut arrays.marks, topology.leaves());
    sized(&mut arrays.blocks, blocks);
    sized(&mut arrays.coverings, topology.len());
    sized(&mut arrays.groups, blocks.div_ceil(WIDTH));
    sized(&mut arrays.lists, blocks);
    arrays.lists.to_mut().fill(NeighbourList { within: -1.0, first: 0, count: 0 });
    arrays.listed = Array::default();
    sized(&mut arrays.normals, points);
    sized(&mut arrays.radii, points);
    sized(&mut arrays.codes, points);
    sized(&mut arrays.source, points);
    let samples = scan.meta.samples as usize;
    sized(&mut arrays.sample_lists, topology.inner() * samples);
    fill_runs(arrays.sample_lists.to_mut(), samples, |node, list| {
        let points = topology.points(NodeId(id32(node)));
        // k · all / samples for each k, without a division for each.
        let all = points.len().max(samples);
        let (step, share) = (all / samples, all % samples);
        let (mut place, mut rest) = (0, 0);
        for sample in list {
            *sample = id32(points.start + place.min(points.len() - 1));
            (place, rest) = (place + step, rest + share);
            if rest >= samples {
                (place, rest) = (place + 1, rest - samples);
            }
        }
    });
    if let Some(positions) = scan.positions.get_mut() {
        sized(positions, points);
    }
}

/// Changes the length of an array that is not shared, without a copy.
fn sized<T: Pod + Zeroable + Send>(array: &mut Array<T>, len: usize) {
    if array.len() != len {
        let mut elements = std::mem::take(array).into_vec();
        elements.resize(len, T::zeroed());
        *array = elements.into();
    }
}
