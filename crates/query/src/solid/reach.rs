//! The test whether a core is near a disc, without their nearest points.

use std::ops::ControlFlow;

use nearmiss_geometry::nalgebra::Vector3;

use crate::leaf::disc_triangle::FlatDisc;
use crate::solid::core::Solid;

/// Projections before the nearest points are computed.
const ROUNDS: u32 = 12;

impl Solid<'_> {
    /// Returns a point of the disc that is at most `within` from the core, if there is one.
    pub(crate) fn reaches(&self, disc: &FlatDisc, within: f64) -> Option<Vector3<f64>> {
        match self.project(disc, within) {
            ControlFlow::Break(found) => found,
            ControlFlow::Continue(()) => {
                let gap = self.gap_within(disc, within);
                (gap.distance <= within).then_some(gap.on_disc)
            }
        }
    }

    /// Returns `true` if a plane proves that the disc is further than `within` from the core.
    pub(crate) fn is_beyond(&self, disc: &FlatDisc, within: f64) -> bool {
        match self.project(disc, within) {
            ControlFlow::Break(found) => found.is_none(),
            ControlFlow::Continue(()) => self.gap(disc, within).lower > within,
        }
    }

    /// Decides whether a point of the disc is at most `within` from the core, and returns it.
    ///
    /// Projects a point from one onto the other and back. Each pair of points is an upper bound of the
    /// distance, and the plane across the way between them gives a lower one. Most discs are decided in
    /// the first round.
    fn project(&self, disc: &FlatDisc, within: f64) -> ControlFlow<Option<Vector3<f64>>> {
        if !self.has_projection() {
            return ControlFlow::Continue(());
        }
        let within_sq = within * within;
        let mut on_core = self.nearest(&disc.centre);
        for _ in 0..ROUNDS {
            let on_disc = disc.nearest(&on_core);
            on_core = self.nearest(&on_disc);
            let way = on_core - on_disc;
            let square = way.norm_squared();
            if square <= within_sq {
                return ControlFlow::Break(Some(on_disc));
            }
            // The core is beyond the plane through its point.
            let apart = way.dot(&(on_core - disc.centre - disc.rim(&way)));
            if apart > 0.0 && apart * apart > within_sq * square {
                return ControlFlow::Break(None);
            }
        }
        ControlFlow::Continue(())
    }
}

#[cfg(test)]
mod tests {
    use nearmiss_geometry::Pose;
    use nearmiss_testdata::arbitrary::{point_in, rng, rotation, unit_vector};
    use rand::RngExt;

    use super::*;
    use crate::solid::shape::Shape;

    /// A core is within a distance of a disc if its nearest point is, and the point returned proves it.
    #[test]
    fn reaches_what_its_nearest_points_say() {
        let rng = &mut rng(7341);
        let (mut near, mut far) = (0, 0);
        for round in 0..6000 {
            let corners: Vec<[f64; 3]> = (0..6).map(|_| point_in(rng, 1.5)).collect();
            let pose = rotation(rng).with_translation(point_in(rng, 1.5));
            let half = [0, 1, 2].map(|_| rng.random_range(0.0..1.0));
            let shape = match round % 6 {
                0 => Shape::Sphere { centre: corners[0], radius: 0.0 },
                1 => Shape::Capsule { ends: [corners[0], corners[1]], radius: 0.0 },
                2 => Shape::Box { pose, half, radius: 0.0 },
                3 => Shape::Cylinder { pose, half_height: half[0], radius: half[1], rounding: 0.0 },
                4 => Shape::Triangle { points: [corners[0], corners[1], corners[2]], radius: 0.0 },
                _ => Shape::Hull { points: &corners, radius: 0.0 },
            };
            let solid = Solid::new(&shape, &Pose::IDENTITY).expect("a valid shape");
            let normal = Vector3::from(unit_vector(rng));
            let disc =
                FlatDisc { centre: point_in(rng, 1.0).into(), normal, radius: rng.random_range(0.0..0.5) };
            let distance = solid.gap(&disc, f64::INFINITY).distance;
            let close = [(distance - 1e-6).max(1e-9), distance + 1e-6, rng.random_range(1e-9..1.0)];
            for within in close {
                let found = solid.reaches(&disc, within);
                assert_eq!(found.is_some(), distance <= within, "{shape:?} {disc:?} {within}");
                // Between the bounds of a search, neither is proven.
                if (distance - within).abs() > 1e-7 {
                    assert_eq!(
                        solid.is_beyond(&disc, within),
                        found.is_none(),
                        "{shape:?} {disc:?} {within}"
                    );
                }
                let Some(point) = found else {
                    far += 1;
                    continue;
                };
                near += 1;
                assert!(solid.distance(&point) <= within + 1e-9, "{shape:?} {disc:?} {within}");
                let off = (point - disc.nearest(&point)).norm();
                assert!(off < 1e-9, "{off} {shape:?} {disc:?} {within} {distance}");
            }
        }
        assert!(near > 5000 && far > 5000, "{near} near, {far} far");
    }
}
