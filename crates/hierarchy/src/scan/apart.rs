//! The disjointness test for the coverings of two nodes (Klein & Zachmann 2004, §5.1).

use nearmiss_geometry::NodeId;

use crate::bounds::boxes::{OrientedBox, Relative};
use crate::bounds::part::Part;
use crate::patch::centres::Centres;
use crate::scan::arrays::ScanArrays;
use crate::tree::topology::NodePair;

/// Bound on the rounding error of the distance of two positions, in units of [`Relative::slack`],
/// which bounds the error of a coordinate: √3 for either of two transformed positions, the same
/// again for the distance itself and for the radii.
const ROUNDINGS: f32 = 8.0;

/// The contents of two nodes that are tested.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Extent {
    /// Tangent discs with their thickness, and the balls of sparse points, as in leaf tests.
    Discs,
    /// The surface as well, as in certificates.
    Surface,
}

/// Returns `true` if the coverings show that the contents of two nodes are further than `reach`
/// apart. `relative` is the relative pose of `b` in the frame of `a`, in which `reach` is measured.
///
/// As in the paper, balls further than that from the volume of the other node are dropped first.
/// The volume is the box for discs, the [enclosure](ScanArrays::enclosure) for the surface. Rounding is
/// included: excluded nodes have nothing within `reach` of each other. Each remaining ball of one
/// node is compared with sixteen of the other at a time. Does not allocate.
///
/// # Panics
/// If there are no such nodes.
#[must_use]
pub fn apart(
    a: &ScanArrays<'_>,
    b: &ScanArrays<'_>,
    pair: NodePair,
    relative: &Relative,
    reach: f32,
    extent: Extent,
) -> bool {
    let (node_a, node_b) = (pair.a.index(), pair.b.index());
    let (radius_a, bounds_a) = extent.of(a, pair.a);
    let (radius_b, bounds_b) = extent.of(b, pair.b);
    let radius_b = radius_b * relative.scale();
    let reach = reach + ROUNDINGS * relative.slack();
    let of_a = a.samples(node_a).iter().map(|i| a.position(i));
    let near_a = within(of_a, &relative.moved(&bounds_b), radius_a + reach);
    let of_b = b.samples(node_b).iter().map(|i| relative.point(b.position(i)));
    let near_b = within(of_b, &bounds_a, radius_b + reach);
    let least = radius_a + radius_b + reach;
    let (few, many) = if near_a.len() < near_b.len() { (&near_a, &near_b) } else { (&near_b, &near_a) };
    few.iter().all(|p| many.nearest_sq(p) > least * least)
}

impl Extent {
    /// Returns the radius of a node's balls, and its volume.
    #[inline]
    fn of(self, arrays: &ScanArrays<'_>, node: NodeId) -> (f32, OrientedBox) {
        match self {
            Self::Discs => (arrays.sampling_radius_of(node.index()), arrays.tree.bounds(node)),
            Self::Surface => {
                (arrays.covering_radius(node.index()), arrays.tree.enclosure(Part::Surface, node))
            }
        }
    }
}

/// Returns the positions that are within `distance` of the box.
#[inline]
fn within(places: impl Iterator<Item = [f32; 3]>, bounds: &OrientedBox, distance: f32) -> Centres {
    let mut near = Centres::default();
    for p in places {
        // NaN counts as near.
        if bounds.distance_sq(p) > distance * distance {
            continue;
        }
        near.push(p);
    }
    near
}
