//! Two things that move: the operations that proofs and searches along their motions share.

use nearmiss_geometry::Pose;
use nearmiss_hierarchy::Ball;

use super::plan::SweepPlan;
use crate::ask::answer::Answer;
use crate::ask::budget::Budget;
use crate::contact::collide::ContactScratch;
use crate::distance::{Distance, Frontier};
use crate::pair::pairing::Pairing;

/// Something done with a pair at a moment of its motion.
pub(crate) trait Look {
    type Found;

    /// Looks at a pair. `pose` is the pose of b's stored frame in a's.
    fn look<P: Pairing>(self, pair: P, pose: &Pose) -> Self::Found;
}

/// Two things whose poses change. Poses map the frames of their inputs to the world.
pub(crate) trait Course {
    /// The number of sides that have balls about their points if points are compared.
    const THICK: f64;

    /// The balls that contain each thing, in their stored frames.
    fn balls(&self) -> [Ball; 2];

    /// Returns the poses of the stored frames.
    fn stored(&self, poses: &[Pose; 2]) -> [Pose; 2];

    /// Shows the pair at `poses` to `look`. Returns `None` if a pose is invalid.
    fn at<L: Look>(&self, poses: &[Pose; 2], budget: &Budget, look: L) -> Option<L::Found>;

    /// Bounds the distance at `poses`, from the nearest items of the last call, which it updates.
    fn distance(
        &self,
        poses: &[Pose; 2],
        plan: &SweepPlan,
        budget: &Budget,
        nearest: &mut [usize; 2],
        scratch: (&mut Frontier, &mut ContactScratch),
    ) -> Distance;

    /// Tests for contact within the clearance at `poses`.
    fn touches(
        &self,
        poses: &[Pose; 2],
        plan: &SweepPlan,
        budget: &Budget,
        scratch: &mut ContactScratch,
    ) -> Answer;
}
