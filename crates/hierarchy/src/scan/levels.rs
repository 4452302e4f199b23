//! The samples of nodes as coarser levels of the scan: the samples, their radii and bandwidths, and
//! f' over them.

use nearmiss_geometry::NodeId;
use nearmiss_index::PointBlock;
use nearmiss_lanes::id32;
use nearmiss_surface::{Evaluation, Moments};

use crate::patch::samples::{NodeSamples, samples};
use crate::point::gather::GatherScratch;
use crate::scan::arrays::ScanArrays;
use crate::scan::build::PointHierarchy;

impl<'a> ScanArrays<'a> {
    /// Returns the sample P' of a node: [`BuildOptions::samples`](crate::BuildOptions::samples) of
    /// its points, or all if it is a leaf or has no more.
    ///
    /// # Panics
    /// If there is no such node.
    #[inline]
    #[must_use]
    pub fn samples(&self, node: usize) -> NodeSamples<'a> {
        samples(self.sample_lists, self.tree.topology, NodeId(id32(node)), self.samples_a_node)
    }

    /// Returns the covering radius: balls of this radius around the samples of a node provably
    /// contain its part of the surface, its points and discs. Infinite if nothing is proven.
    ///
    /// # Panics
    /// If there is no such node.
    #[inline]
    #[must_use]
    pub fn covering_radius(&self, node: usize) -> f32 {
        self.coverings[node].radius
    }

    /// Returns r(P') of Definition 4 (Klein & Zachmann 2004), as measured: balls of this radius
    /// around the samples of a node cover its surface.
    ///
    /// # Panics
    /// If there is no such node.
    #[inline]
    #[must_use]
    pub fn sampling_radius_of(&self, node: usize) -> f32 {
        self.coverings[node].sampling
    }

    /// Returns the support radius of a node's samples: m·r(P'), with r(P') by eq. 10 of Klein &
    /// Zachmann 2004. This is the support radius of points with the node's spacing times
    /// √(|P|/|P'|).
    ///
    /// # Panics
    /// If there is no such node.
    #[must_use]
    pub fn node_support_radius(&self, node: usize) -> f32 {
        self.plan.support_radius(self.coverings[node].spacing) * self.thinning(node)
    }

    /// Returns the bandwidth of a node's samples, by eq. 9 of Klein & Zachmann 2004 with r(P') by
    /// eq. 10; see [`Self::node_support_radius`].
    ///
    /// # Panics
    /// If there is no such node.
    #[must_use]
    pub fn node_bandwidth(&self, node: usize) -> f32 {
        self.plan.bandwidth(self.coverings[node].spacing) * self.thinning(node)
    }

    /// Returns √(|P|/|P'|).
    #[expect(clippy::cast_precision_loss, reason = "a ratio")]
    fn thinning(&self, node: usize) -> f32 {
        let count = self.tree.topology.points(NodeId(id32(node))).len();
        (count as f32 / self.samples(node).len() as f32).sqrt()
    }
}

impl PointHierarchy {
    /// Evaluates f' of a node at `x`, in the stored frame: f over the node's samples, each with the
    /// node's [bandwidth](ScanArrays::node_bandwidth) (Klein & Zachmann 2004, §5.5). Costs about as
    /// much as f.
    ///
    /// # Panics
    /// If there is no such node.
    pub fn evaluate_node_with(&self, node: usize, x: [f64; 3], scratch: &mut GatherScratch) -> Evaluation {
        let arrays = self.arrays();
        let (samples, support_radius) = (arrays.samples(node), arrays.node_support_radius(node));
        let mut samples = samples.iter();
        let blocks = std::iter::from_fn(|| {
            let mut block = PointBlock::EMPTY;
            for (lane, i) in samples.by_ref().take(PointBlock::WIDTH).enumerate() {
                self.plan().put(&mut block, lane, arrays.position(i), support_radius);
            }
            (block.support_radius[0] > 0.0).then_some(block)
        });
        Moments::about(scratch.level, self.plan(), x, blocks).evaluate(self.plan(), x)
    }
}
