//! Validation of the numbers of a whole scan: the lengths of its arrays, and the metadata.

use nearmiss_geometry::{Aabb, Dropped, Frame};
use nearmiss_index::PointBlock;

use nearmiss_store::Flaw;

use super::limits::FARTHEST;
use super::nodes::is_in_range;
use crate::patch::samples::SAMPLES;
use crate::point::leaf_block::LeafParts;
use crate::scan::build::PointHierarchy;
use crate::scan::options::RADIUS_NEIGHBOURS;
use crate::scan::sampling::sampling_rank;
use crate::tree::topology::Topology;

/// Returns the tree over `points` points.
///
/// # Errors
/// Names the number that a build never writes.
pub(crate) fn checked_topology(points: usize, leaf_size: u32, dense: u32) -> Result<Topology, Flaw> {
    let wrong = |what| Err(Flaw::Metadata { what });
    let Some(count) = u32::try_from(points).ok().filter(|&count| count > 0) else {
        return wrong("the number of points");
    };
    if !(4..=64).contains(&leaf_size) {
        return wrong("the number of points of a leaf");
    }
    if dense > count || (dense < count && !dense.is_multiple_of(leaf_size)) {
        return wrong("the number of dense points");
    }
    Ok(Topology::new(count, leaf_size))
}

/// Returns `true` if nothing overflows on the way to the caller's frame and back.
pub(crate) fn frame_is_valid(&Frame { origin, scale }: &Frame) -> bool {
    let turns_back = scale > 0.0 && scale.is_normal() && scale.recip().is_normal();
    turns_back && origin.iter().all(|x| x.is_finite())
}

impl PointHierarchy {
    pub(super) fn check_lengths(&self) -> Result<(), Flaw> {
        let points = self.len();
        let (leaves, inner) = (self.topology.leaves(), self.topology.inner());
        let blocks = points.div_ceil(PointBlock::WIDTH);
        let expected = [
            ("normals", self.arrays.normals.len(), points),
            ("radii", self.arrays.radii.len(), points),
            ("kinds", self.arrays.codes.len(), points),
            ("source indices", self.arrays.source.len(), points),
            ("boxes", self.arrays.siblings.len(), inner),
            ("greatest radii", self.arrays.reaches.len(), inner),
            ("enclosures", self.arrays.surface_growths.len(), inner),
            ("enclosures of the obstacle", self.arrays.obstacle_growths.len(), inner),
            ("leaf blocks", self.arrays.leaf_blocks.len(), leaves * LeafParts::blocks_a_leaf(&self.topology)),
            ("leaf marks", self.arrays.marks.len(), leaves),
            ("blocks", self.arrays.blocks.len(), blocks),
            ("samples", self.arrays.sample_lists.len(), inner.saturating_mul(self.meta.samples as usize)),
            ("coverings", self.arrays.coverings.len(), self.topology.len()),
            ("groups", self.arrays.groups.len(), blocks.div_ceil(PointBlock::WIDTH)),
            ("neighbour lists", self.arrays.lists.len(), blocks),
        ];
        match expected.into_iter().find(|(_, found, expected)| found != expected) {
            Some((array, found, expected)) => Err(Flaw::Length { array, found, expected }),
            None => Ok(()),
        }
    }

    /// Checks the metadata, as far as possible without the points.
    pub(super) fn check_metadata(&self) -> Result<(), Flaw> {
        let wrong = |what| Err(Flaw::Metadata { what });
        if !frame_is_valid(&self.meta.frame) {
            return wrong("the frame of the stored positions");
        }
        let Aabb { min, max } = self.meta.bounds;
        if !(0..3).all(|k| min[k].is_finite() && max[k].is_finite() && min[k] <= max[k]) {
            return wrong("the bounding box");
        }
        if !(self.meta.step >= 0.0 && self.meta.step.is_finite()) {
            return wrong("the rounding error");
        }
        if !(self.meta.sampling_radius > 0.0 && self.meta.sampling_radius <= FARTHEST) {
            return wrong("the sampling radius");
        }
        if !(self.meta.reach > 0.0 && self.meta.reach <= FARTHEST) {
            return wrong("the reach");
        }
        if !is_in_range(&self.meta.root.bounds) {
            return wrong("the box of the root");
        }
        if !RADIUS_NEIGHBOURS.contains(&self.meta.radius_neighbours) {
            return wrong("the number of neighbours for local radii");
        }
        if !SAMPLES.contains(&self.meta.samples) {
            return wrong("the number of samples of a node");
        }
        if u32::try_from(self.given()).is_err() {
            return wrong("the number of dropped points");
        }
        Ok(())
    }

    /// Returns the number of points in the input; sources are below it.
    pub(super) fn given(&self) -> usize {
        let Dropped { not_finite, duplicate, filtered } = self.meta.dropped;
        let dropped = not_finite.saturating_add(duplicate).saturating_add(filtered);
        dropped.saturating_add(self.len())
    }

    /// Checks the metadata against the points, which are already validated.
    pub(super) fn check_summary(&self) -> Result<(), Flaw> {
        let [mut low, mut high] = [self.positions()[0]; 2];
        for p in self.positions() {
            for k in 0..3 {
                low[k] = if p[k] < low[k] { p[k] } else { low[k] };
                high[k] = if p[k] > high[k] { p[k] } else { high[k] };
            }
        }
        // The transform to the caller's frame is monotonic, rounding included.
        if (self.meta.frame.to_world(low), self.meta.frame.to_world(high))
            != (self.meta.bounds.min, self.meta.bounds.max)
        {
            return Err(Flaw::Metadata { what: "the bounding box" });
        }
        let (mut less, mut more) = (0_u32, 0_u32);
        for &r in &self.arrays.radii {
            less += u32::from(r < self.meta.sampling_radius);
            more += u32::from(r > self.meta.sampling_radius);
        }
        let (less, more) = (less as usize, more as usize);
        let rank = sampling_rank(self.len());
        if less > rank || more > self.len() - 1 - rank {
            return Err(Flaw::Metadata { what: "the sampling radius" });
        }
        // Compared as text, so that NaN equals itself.
        if format!("{:?}", self.outlined()) != format!("{:?}", self.meta.outline) {
            return Err(Flaw::Metadata { what: "the outline of the scan" });
        }
        Ok(())
    }
}
