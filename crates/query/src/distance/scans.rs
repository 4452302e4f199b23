//! Two scans as a [`Measured`] pair.

use nearmiss_geometry::nalgebra::Vector3;

use super::DistancePlan;
use super::apart::{Measured, Place};
use super::approach::{Approach, Feet};
use crate::ask::answer::Answer;
use crate::ask::budget::Budget;
use crate::contact::collide::{Asked, ContactScratch, Outputs, collide};
use crate::pair::placed::ViewScratch;
use crate::pair::scan_pair::ScanPair;

impl Measured for ScanPair<'_> {
    const THICK: f64 = 2.0;

    fn place(&self, items: [usize; 2]) -> Place {
        let half = |k: usize| {
            let view = self.views[k];
            0.5 * f64::from(view.scan().radii()[items[k]]) * view.stored_to_world().scale()
        };
        let centres = [0, 1].map(|k| self.views[k].point(items[k]));
        let balls = if self.is_of_balls(items) { self.balls(items) } else { [0.0; 2] };
        Place {
            points: nearest_of_balls(centres, balls),
            sources: [0, 1].map(|k| self.views[k].scan().id(items[k])),
            band: self.band(items),
            off: half(0) + half(1),
        }
    }

    fn touches(&self, plan: &DistancePlan, budget: &Budget, scratch: &mut ContactScratch) -> Answer {
        collide(Asked { scans: self.views, plan: plan.touching(), budget }, scratch, Outputs::default())
    }

    fn approach(&mut self, items: [usize; 2], gathers: &mut [ViewScratch; 2]) -> Option<Feet> {
        let [a, b] = self.views;
        if !(a.verifies() && b.verifies()) {
            return None;
        }
        Approach { views: [a, b], samples: items, gathers, meter: &mut self.meter }.run()
    }

    fn are_obstacle(&self, items: [usize; 2], feet: &Feet) -> bool {
        (0..2).all(|k| self.views[k].is_obstacle(items[k], feet.points[k]))
    }
}

/// The nearest points of two balls with these centres.
fn nearest_of_balls(centres: [[f64; 3]; 2], balls: [f64; 2]) -> [[f64; 3]; 2] {
    let [p, q] = centres.map(Vector3::from);
    let (way, both) = (q - p, balls[0] + balls[1]);
    let length = way.norm();
    if both == 0.0 || length == 0.0 {
        return centres;
    }
    // Overlapping balls share a point.
    let shares =
        if both < length { balls.map(|ball| ball / length) } else { [balls[0] / both, balls[1] / both] };
    [(p + way * shares[0]).into(), (q - way * shares[1]).into()]
}
