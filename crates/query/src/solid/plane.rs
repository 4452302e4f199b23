//! A plane before a core, which tells that discs are far from it.

use nearmiss_geometry::nalgebra::Vector3;

use crate::leaf::disc_triangle::FlatDisc;

type Vector = Vector3<f64>;

/// More than the rounding of a height, relative to coordinates.
const ROUNDING: f64 = 4e-15;

/// A plane with a side above it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Plane {
    /// A unit vector, which points to the side above.
    normal: Vector,
    height: f64,
    /// The greatest coordinate of a point of the plane.
    far: f64,
}

impl Plane {
    /// The plane through a point with this unit normal.
    pub(crate) fn through(point: &Vector, normal: Vector) -> Self {
        Self { normal, height: normal.dot(point), far: point.amax() }
    }

    /// A lower bound on the distance of anything above the plane from a disc.
    pub(crate) fn above(&self, disc: &FlatDisc) -> f64 {
        let rim = disc.radius * self.normal.cross(&disc.normal).norm();
        let at = self.normal.dot(&disc.centre);
        self.height - at - rim - ROUNDING * (self.far + disc.centre.amax() + disc.radius)
    }
}
