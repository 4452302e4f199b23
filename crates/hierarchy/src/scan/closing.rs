//! The last steps of every frame of a scan that moves: support radii, boxes, enclosures and leaf
//! records of the current points, radii, normals and classes (`docs/theory/moving.md`).

use nearmiss_geometry::NodeId;
use nearmiss_index::PointBlock;
use nearmiss_lanes::id32;
use nearmiss_lanes::parallel::{both, change_each, runs};
use nearmiss_store::Array;
use nearmiss_surface::SurfacePlan;

use crate::bounds::boxes::OrientedBox;
use crate::bounds::growth::Growth;
use crate::patch::covering::Covering;
use crate::patch::parts::{Low, bound_above, bound_leaves};
use crate::point::disc::DiscRadii;
use crate::point::gather::NeighbourList;
use crate::point::leaf_block::LeafParts;
use crate::point::neighbours::groups_in_motion;
use crate::scan::build::PointHierarchy;
use crate::scan::identity::identity;
use crate::scan::sampling::Selection;
use crate::tree::axes::{Spread, principal_axes, spread_leaves};
use crate::tree::topology::Topology;
use crate::tree::wide::{Root, growths_of_siblings, reaches, siblings};

const WIDTH: usize = PointBlock::WIDTH;

/// Memory that frames reuse.
#[derive(Debug, Clone, Default)]
pub(crate) struct Closing {
    boxes: Vec<OrientedBox>,
    growths: Vec<[Growth; 2]>,
    spreads: Vec<Spread>,
    selection: Selection,
}

impl Closing {
    /// Returns the moments of the leaves, to be set.
    pub(crate) fn spreads_of_leaves(&mut self, topology: &Topology) -> &mut [Spread] {
        self.spreads.resize(topology.len(), Spread::default());
        &mut self.spreads[topology.inner()..]
    }

    /// Computes the moments of the leaves from the points.
    pub(crate) fn spread(&mut self, scan: &PointHierarchy) {
        let leaves = self.spreads_of_leaves(&scan.topology);
        spread_leaves(scan.positions(), &scan.topology, leaves);
    }

    /// Sets the sampling radius, the support radii of the points, the balls around blocks, and the axes
    /// of boxes, from the moments of leaves. There are no neighbour lists afterwards.
    pub(crate) fn support(&mut self, scan: &mut PointHierarchy) {
        let PointHierarchy { meta, plan, topology, arrays, .. } = scan;
        let Self { boxes, spreads, selection, .. } = self;
        boxes.resize(topology.len(), OrientedBox::default());
        // Each has a part on one thread, which the other fills.
        both(
            || principal_axes(topology, boxes, spreads),
            || {
                meta.sampling_radius = selection.of(&arrays.radii);
                let (radius, unit) = (f64::from(meta.sampling_radius), 1.0 / meta.frame.scale);
                // The options were valid for the first frame.
                *plan = SurfacePlan::new(&meta.surface, radius, unit).unwrap_or(*plan);
                let (radii, blocks): (&[f32], _) = (&arrays.radii, arrays.blocks.to_mut());
                change_each(blocks, WIDTH, |number, block| {
                    plan.tune(block, &radii[number * WIDTH..radii.len().min((number + 1) * WIDTH)]);
                });
                groups_in_motion(blocks, arrays.groups.to_mut());
            },
        );
        if !arrays.listed.is_empty() {
            arrays.lists.to_mut().fill(NeighbourList { within: -1.0, first: 0, count: 0 });
            arrays.listed = Array::default();
        }
    }

    /// Bounds all nodes along their axes, and sets all that depends on boxes.
    pub(crate) fn bound(&mut self, scan: &mut PointHierarchy) {
        self.growths.resize(scan.topology.len(), Default::default());
        self.bound_leaves(scan);
        self.finish(scan);
    }

    /// Fits boxes and enclosures along the axes to leaves and to the nodes whose children are leaves, and
    /// sets the records of leaves.
    fn bound_leaves(&mut self, scan: &mut PointHierarchy) {
        // Unpacks the positions of a scan from a file.
        let _unpacked = scan.positions();
        let PointHierarchy { meta, plan, topology, arrays, positions } = scan;
        let Self { boxes, growths, .. } = self;
        let parts = LeafParts {
            positions: positions.get().map_or(&[], |positions| positions),
            normals: &arrays.normals,
            discs: DiscRadii {
                codes: &arrays.codes,
                radii: &arrays.radii,
                reach: meta.reach,
                sampling_radius: meta.sampling_radius,
            },
            dense: meta.dense as usize,
        };
        let beyond = 0.5 * plan.support_radius(self.selection.greatest());
        let (bottoms, leaves) = (topology.first_bottom(), topology.inner());
        let (boxes, leaf_boxes) = boxes.split_at_mut(leaves);
        let (growths, leaf_growths) = growths.split_at_mut(leaves);
        let blocks = runs(arrays.leaf_blocks.to_mut(), LeafParts::blocks_a_leaf(topology));
        let low = Low {
            topology,
            first: 0,
            bottoms: (runs(&mut boxes[bottoms..], 1), runs(&mut growths[bottoms..], 1)),
            leaves: (
                (runs(leaf_boxes, 1), runs(leaf_growths, 1)),
                (blocks, (runs(arrays.marks.to_mut(), 1), runs(&mut arrays.coverings.to_mut()[leaves..], 1))),
            ),
        };
        bound_leaves(&parts, beyond, low);
    }

    /// Bounds the other nodes, and sets all that depends on boxes.
    fn finish(&mut self, scan: &mut PointHierarchy) {
        let PointHierarchy { meta, topology, arrays, positions, .. } = scan;
        let positions: &[[f32; 3]] = positions.get().map_or(&[], |positions| positions);
        let (normals, codes, radii): (&[_], &[_], &[_]) = (&arrays.normals, &arrays.codes, &arrays.radii);
        let Self { boxes, growths, spreads, .. } = self;
        let bound = || {
            spacings(topology, spreads, arrays.coverings.to_mut());
            bound_above(topology, (boxes, growths));
            let (boxes, growths): (&[_], &[[Growth; 2]]) = (boxes, growths);
            siblings(topology, boxes, arrays.siblings.to_mut());
            reaches(topology, boxes, arrays.reaches.to_mut());
            growths_of_siblings(topology, |id| growths[id][0], arrays.surface_growths.to_mut());
            growths_of_siblings(topology, |id| growths[id][1], arrays.obstacle_growths.to_mut());
            Root { bounds: boxes[NodeId::ROOT.index()], growths: growths[NodeId::ROOT.index()] }
        };
        let (identity, root) = both(|| identity(meta, positions, codes, radii, Some(normals)), bound);
        scan.meta.root = root;
        scan.meta.outline = scan.outlined_as(identity);
    }
}

/// Sets the spacings of the inner nodes from those of leaves, and withholds their radii.
fn spacings(topology: &Topology, spreads: &[Spread], coverings: &mut [Covering]) {
    // Children come after their parent.
    for id in (0..topology.inner()).rev() {
        let mut squares = 0.0;
        for child in topology.children(NodeId(id32(id))).iter() {
            squares += f64::from(coverings[child.index()].spacing).powi(2) * spreads[child.index()].count;
        }
        #[expect(clippy::cast_possible_truncation, reason = "stored in single precision")]
        let spacing = (squares / spreads[id].count).sqrt() as f32;
        coverings[id] = Covering::withheld(spacing);
    }
}
