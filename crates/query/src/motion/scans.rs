//! Two scans as a [`Course`].

use fearless_simd::Level;
use nearmiss_geometry::Pose;
use nearmiss_hierarchy::Ball;

use super::course::{Course, Look};
use super::plan::SweepPlan;
use crate::ask::answer::Answer;
use crate::ask::budget::Budget;
use crate::contact::collide::{Asked, ContactScratch, Outputs, collide};
use crate::distance::{Distance, Frontier, distance};
use crate::pair::meter::Meter;
use crate::pair::placed::Placed;
use crate::pair::scan_pair::{ScanPair, relative};

/// Two scans that move.
pub(crate) struct MovingScans<'a> {
    /// The scans, at any poses.
    pub(crate) scans: [&'a Placed<'a>; 2],
    pub(crate) plan: &'a SweepPlan,
    pub(crate) level: Level,
}

impl<'a> MovingScans<'a> {
    fn placed(&self, poses: &[Pose; 2]) -> [Placed<'a>; 2] {
        [0, 1].map(|k| self.scans[k].moved_to(&poses[k]))
    }
}

impl Course for MovingScans<'_> {
    const THICK: f64 = 2.0;

    fn balls(&self) -> [Ball; 2] {
        self.scans.map(|view| self.plan.ball(view.scan().outline()))
    }

    fn stored(&self, poses: &[Pose; 2]) -> [Pose; 2] {
        self.placed(poses).map(|view| *view.stored_to_world())
    }

    fn at<L: Look>(&self, poses: &[Pose; 2], budget: &Budget, look: L) -> Option<L::Found> {
        let placed = self.placed(poses);
        let views = placed.each_ref();
        let (pose, relative) = relative(views[0], views[1], self.plan.distance().boundless()).ok()?;
        let arrays = views.map(|view| view.scan().arrays());
        let part = self.plan.options().semantics.part();
        let meter = Meter::new(budget, views, 0);
        Some(look.look(ScanPair::new(views, arrays.each_ref(), relative, meter, (self.level, part)), &pose))
    }

    fn distance(
        &self,
        poses: &[Pose; 2],
        plan: &SweepPlan,
        budget: &Budget,
        nearest: &mut [usize; 2],
        scratch: (&mut Frontier, &mut ContactScratch),
    ) -> Distance {
        let placed = self.placed(poses);
        let (found, items) = distance(placed.each_ref(), *nearest, plan.distance(), budget, scratch);
        *nearest = items;
        found
    }

    fn touches(
        &self,
        poses: &[Pose; 2],
        plan: &SweepPlan,
        budget: &Budget,
        scratch: &mut ContactScratch,
    ) -> Answer {
        let placed = self.placed(poses);
        let asked = Asked { scans: placed.each_ref(), plan: plan.touching(), budget };
        collide(asked, scratch, Outputs::default())
    }
}
