//! A preprocessed scan along a motion.

use nearmiss_geometry::Motion;

use crate::pair::placed::Placed;

/// A preprocessed scan and its motion in the world.
#[derive(Debug, Clone, Copy)]
pub struct Moving<'a> {
    scan: Placed<'a>,
    motion: &'a Motion,
}

impl<'a> Moving<'a> {
    /// Moves `scan` along `motion`, whose poses map the frame of the scan's input to the world. The
    /// pose of `scan` does not matter.
    #[must_use]
    pub fn new(scan: Placed<'a>, motion: &'a Motion) -> Self {
        Self { scan, motion }
    }

    /// The scan, at any pose.
    pub(crate) fn scan(&self) -> &Placed<'a> {
        &self.scan
    }

    /// The motion.
    #[must_use]
    pub fn motion(&self) -> &'a Motion {
        self.motion
    }

    /// The scan at its pose at `time`.
    #[must_use]
    pub fn at(&self, time: f64) -> Placed<'a> {
        self.scan.moved_to(&self.motion.at(time))
    }
}
