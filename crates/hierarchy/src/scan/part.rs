//! Parts of a scan as scans of their own.

use std::ops::ControlFlow;

use fearless_simd::{Level, Simd};
use nearmiss_geometry::{Aabb, Dropped, LEAST_POINTS};
use nearmiss_index::PointBlock;
use nearmiss_lanes::id32;
use nearmiss_store::Workspace;
use nearmiss_surface::Bandwidth;

use crate::descent::PlaceVisitor;
use crate::scan::build::PointHierarchy;
use crate::scan::options::BuildOptions;
use crate::scan::points::ScanPoints;

impl PointHierarchy {
    /// Returns the stored points within `radius` of a place of the stored frame, up to rounding to single
    /// precision, in ascending order. `None` if there are more than `most`. O(log n) for each.
    #[must_use]
    pub fn points_in_ball(&self, centre: [f64; 3], radius: f64, most: usize) -> Option<Vec<u32>> {
        // In single precision, boxes are off by a few steps of the greatest coordinate.
        let far = centre.iter().fold(self.bounds_radius(), |far, c| far.max(c.abs()));
        #[expect(clippy::cast_possible_truncation, reason = "counted in the reach")]
        let (place, reach) = (centre.map(|c| c as f32), (radius + 4e-6 * far) as f32);
        let square = radius * radius;
        let mut search =
            InBall { scan: self, centre, square, most_sq: reach * reach, most, found: Vec::new() };
        let flow = self.tree().descend_to(Level::new(), place, &mut search);
        flow.is_continue().then_some(search.found)
    }

    /// Prepares some stored points as a scan of their own, with the options and the frame of this one, and
    /// its reach. [`Self::source`] of the part holds the ids of this scan. `points` are in ascending order;
    /// in another order, equally near points may be told apart otherwise. `None` for fewer than 8 points.
    ///
    /// Costs as much as a [build](Self::build). Radii, normals and kinds are computed anew: near the border
    /// of the part they may differ. The [metric](Self::metric) is Euclidean, as a graph of the whole scan
    /// does not fit a part.
    ///
    /// # Panics
    /// If there is no such point.
    #[must_use]
    pub fn part(&self, points: &[u32]) -> Option<Self> {
        if points.len() < LEAST_POINTS {
            return None;
        }
        let positions: Vec<[f32; 3]> =
            points.iter().map(|&i| PointBlock::position_in(self.blocks(), i as usize)).collect();
        let source: Vec<u32> = points.iter().map(|&i| self.source()[i as usize]).collect();
        let mut bounds = Aabb::EMPTY;
        positions.iter().for_each(|&p| bounds.grow(self.frame().to_world(p)));
        let dropped = Dropped { not_finite: 0, duplicate: 0, filtered: self.len() - points.len() };
        let (frame, step) = (*self.frame(), self.step());
        let part = ScanPoints { positions: &positions, source: &source, frame, bounds, dropped, step };
        Self::build_in(&part, &self.build_options(), &Workspace::in_memory()).ok()
    }

    /// The options with which a part is prepared: those of the scan, with its reach and its bandwidth.
    fn build_options(&self) -> BuildOptions {
        let mut surface = *self.plan.options();
        if surface.bandwidth == Bandwidth::Global {
            // The same for all points.
            let stored = self.plan.bandwidth(self.meta.sampling_radius);
            surface.bandwidth = Bandwidth::Fixed(f64::from(stored) * self.frame().scale);
        }
        BuildOptions {
            surface,
            radius_neighbours: self.radius_neighbours(),
            leaf_size: self.leaf_size(),
            samples: self.samples_a_node(),
            reach: Some(self.reach()),
            threads: 0,
        }
    }
}

/// The search for the points in a ball.
struct InBall<'s> {
    scan: &'s PointHierarchy,
    centre: [f64; 3],
    /// The squared radius, and that up to which boxes are visited.
    square: f64,
    most_sq: f32,
    most: usize,
    found: Vec<u32>,
}

impl PlaceVisitor for InBall<'_> {
    const IN_ORDER: bool = true;

    fn most_sq(&self) -> f32 {
        self.most_sq
    }

    fn leaf<S: Simd>(&mut self, _: S, number: usize) -> ControlFlow<()> {
        for i in self.scan.topology().points_of_leaf(number) {
            let position = PointBlock::position_in(self.scan.blocks(), i);
            let away = [0, 1, 2].map(|k| f64::from(position[k]) - self.centre[k]);
            if away.iter().map(|c| c * c).sum::<f64>() <= self.square {
                if self.found.len() == self.most {
                    return ControlFlow::Break(());
                }
                self.found.push(id32(i));
            }
        }
        ControlFlow::Continue(())
    }
}
