//! Discs over which shapes are deepest: one, or eight side by side.

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_lanes::lane::Lane;

use crate::leaf::disc_triangle::FlatDisc;

/// One disc, or one in each lane.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Discs<L> {
    pub(crate) centre: [L; 3],
    /// The unit vector along the axis against which a shape is deepest.
    pub(crate) out: [L; 3],
    pub(crate) radius: L,
}

/// The deepest places of a shape over discs.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Over<L: Lane> {
    /// `true` where a part of the shape is over the disc. Nothing else is told of the others.
    pub(crate) is_over: L::Mask,
    /// The point of the disc over which the shape is deepest.
    pub(crate) on_disc: [L; 3],
    pub(crate) depth: L,
    /// `true` where the core is beside the disc.
    pub(crate) is_beside: L::Mask,
    /// The core is at most this far from the disc if the place is not further before it than that.
    pub(crate) apart: L,
}

impl Discs<f64> {
    pub(crate) fn of(disc: &FlatDisc, out: &Vector3<f64>) -> Self {
        Self { centre: disc.centre.into(), out: (*out).into(), radius: disc.radius }
    }
}
