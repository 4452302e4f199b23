//! Scans with all that they know, however they are held.

use std::rc::Rc;
use std::sync::Arc;

use nearmiss_geometry::Pose;
use nearmiss_hierarchy::PointHierarchy;

use crate::view::ScanView;

/// A scan that can be placed: a hierarchy, and the graph and kernel over it where it has them.
///
/// `nearmiss::Scan` is one, as are references to those that are, `Arc`, `Rc` and `Box`.
pub trait Prepared {
    /// The scan in `pose`, which leads from the frame of its input to the world, with all that it knows.
    fn at(&self, pose: &Pose) -> ScanView<'_>;
}

impl Prepared for PointHierarchy {
    fn at(&self, pose: &Pose) -> ScanView<'_> {
        ScanView::new(self, pose)
    }
}

impl<S: Prepared + ?Sized> Prepared for &S {
    fn at(&self, pose: &Pose) -> ScanView<'_> {
        (**self).at(pose)
    }
}

impl<S: Prepared + ?Sized> Prepared for Arc<S> {
    fn at(&self, pose: &Pose) -> ScanView<'_> {
        (**self).at(pose)
    }
}

impl<S: Prepared + ?Sized> Prepared for Rc<S> {
    fn at(&self, pose: &Pose) -> ScanView<'_> {
        (**self).at(pose)
    }
}

impl<S: Prepared + ?Sized> Prepared for Box<S> {
    fn at(&self, pose: &Pose) -> ScanView<'_> {
        (**self).at(pose)
    }
}
