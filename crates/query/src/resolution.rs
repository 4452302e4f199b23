//! A resolution of the search: nodes that are fine enough answer by their samples (S0 §1).
//!
//! A node's sample points stand for all below it: their tangent discs are made as wide as spheres about them must be to
//! cover the surface (S0 Definition 4), and cross, or not, as those of points do in leaves.

use std::ops::ControlFlow;

use nearmiss_hierarchy::{NodePair, Slices};

use crate::crossing::Disc;
use crate::surface::Surfaces;
use crate::verdict::Evidence;

/// The radius of the disc of a sample point of `node`, which is point `i`.
fn radius(slices: &Slices<'_>, node: usize, i: usize) -> f32 {
    if slices.nodes[node].is_leaf() { slices.discs[i] } else { slices.sampling_radius_of(node) }
}

impl Surfaces<'_> {
    /// Which nodes of a pair are not to be looked at more finely.
    pub(crate) fn is_fine(&self, pair: NodePair) -> [bool; 2] {
        let a = self.pair.a.sampling_radius_of(pair.a.index());
        let b = self.pair.b.sampling_radius_of(pair.b.index()) * self.pair.relative.scale();
        [a <= self.resolution, b <= self.resolution]
    }

    /// The samples of two nodes, of which not both are leaves.
    pub(crate) fn samples_cross(&mut self, pair: NodePair) -> ControlFlow<()> {
        let (slices_a, slices_b) = (self.pair.a, self.pair.b);
        let [samples_a, samples_b] = [slices_a.samples(pair.a.index()), slices_b.samples(pair.b.index())];
        self.pair.meter.leaf_pair(samples_a.len(), samples_b.len());
        for (lane, j) in samples_b.iter().enumerate() {
            let radius = radius(slices_b, pair.b.index(), j) * self.pair.relative.scale();
            let disc = Disc { radius, ..self.disc_b(j) };
            self.lanes.set(lane, &disc);
        }
        self.lanes.close(samples_b.len());
        for i in samples_a.iter() {
            let disc = Disc { radius: radius(slices_a, pair.a.index(), i), ..self.disc_a(i) };
            let bits = self.lanes.crossings(&disc);
            if let Some(j) = samples_b.iter().nth(bits.trailing_zeros() as usize) {
                let radii = [disc.radius, radius(slices_b, pair.b.index(), j)];
                self.found = Some((self.shared_chord(i, j, radii), Evidence::Estimated));
                return ControlFlow::Break(());
            }
        }
        ControlFlow::Continue(())
    }
}
