//! The trait of preprocessed scans.

use std::rc::Rc;
use std::sync::Arc;

use nearmiss_geometry::{Motion, Pose};
use nearmiss_hierarchy::PointHierarchy;

use crate::pair::moving::Moving;
use crate::pair::placed::Placed;

/// A preprocessed scan, however it is owned: `nearmiss::Scan`, [`PointHierarchy`], or a reference,
/// `Arc`, `Rc` or `Box` of one.
pub trait Prepared {
    /// Places the scan at `pose`, which maps the frame of its input to the world. Includes the
    /// graph and the shape index of the scan, if there are any.
    fn at(&self, pose: &Pose) -> Placed<'_>;

    /// Moves the scan along `motion`, whose poses map the frame of its input to the world.
    fn along<'m>(&'m self, motion: &'m Motion) -> Moving<'m> {
        Moving::new(self.at(&motion.at(0.0)), motion)
    }
}

impl Prepared for PointHierarchy {
    fn at(&self, pose: &Pose) -> Placed<'_> {
        Placed::new(self, pose)
    }
}

impl<S: Prepared + ?Sized> Prepared for &S {
    fn at(&self, pose: &Pose) -> Placed<'_> {
        (**self).at(pose)
    }
}

impl<S: Prepared + ?Sized> Prepared for Arc<S> {
    fn at(&self, pose: &Pose) -> Placed<'_> {
        (**self).at(pose)
    }
}

impl<S: Prepared + ?Sized> Prepared for Rc<S> {
    fn at(&self, pose: &Pose) -> Placed<'_> {
        (**self).at(pose)
    }
}

impl<S: Prepared + ?Sized> Prepared for Box<S> {
    fn at(&self, pose: &Pose) -> Placed<'_> {
        (**self).at(pose)
    }
}
