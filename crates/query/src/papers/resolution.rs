//! A resolution of the search: nodes that are fine enough are compared by their samples (Klein &
//! Zachmann 2004, §1).
//!
//! A node's sample points represent its points: balls about them cover their tangent discs (Klein &
//! Zachmann 2004, Definition 4). If no two balls overlap, no discs cross. If two overlap, the
//! surfaces come within the sum of four radii of each other.

use std::ops::ControlFlow;

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::NodePair;

use crate::ask::answer::Contact;
use crate::papers::Papers;

impl Papers<'_, '_> {
    /// Returns which nodes of a pair are fine enough not to be split.
    pub(crate) fn nodes_are_fine(&self, pair: NodePair) -> [bool; 2] {
        let a = self.search.pair.a.sampling_radius_of(pair.a.index());
        let b = self.search.pair.b.sampling_radius_of(pair.b.index()) * self.search.pair.relative.scale();
        [a <= self.resolution, b <= self.resolution]
    }

    /// Compares the samples of two nodes that are not both leaves.
    pub(crate) fn samples_meet(&mut self, pair: NodePair) -> ControlFlow<()> {
        let (a, b) = (self.search.pair.a, self.search.pair.b);
        let relative = self.search.pair.relative;
        let [samples_a, samples_b] = [a.samples(pair.a.index()), b.samples(pair.b.index())];
        self.search.pair.meter.leaf_pair(samples_a.len(), samples_b.len());
        let radius_a = a.sampling_radius_of(pair.a.index());
        let radius_b = b.sampling_radius_of(pair.b.index()) * relative.scale();
        let reach = radius_a + radius_b + self.search.reach + relative.slack();
        for j in samples_b.iter() {
            let q = Vector3::from(relative.point(b.position(j)));
            for i in samples_a.iter() {
                let p = Vector3::from(a.position(i));
                // NaN counts as near.
                if (p - q).norm() > reach {
                    continue;
                }
                let [va, vb] = self.search.pair.views;
                let between = p + (q - p) * (radius_a / (radius_a + radius_b).max(f32::MIN_POSITIVE));
                let scale = va.stored_to_world().scale();
                let contact = Contact {
                    point: va.stored_to_world().apply(between.map(f64::from).into()),
                    normals: Some([
                        va.stored_to_world().rotate(a.normals[i].map(f64::from)),
                        vb.stored_to_world().rotate(b.normals[j].map(f64::from)),
                    ]),
                    residual: f64::from(radius_a.max(radius_b)) * scale,
                    sources: [va.scan().id(i), vb.scan().id(j)],
                };
                return self.search.record(contact, None);
            }
        }
        ControlFlow::Continue(())
    }
}
