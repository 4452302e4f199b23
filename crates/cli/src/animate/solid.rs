//! Bodies as they are painted.

use nearmiss::geometry::nalgebra::Vector3;
use nearmiss_draw::canvas::{Camera, Canvas, Colour, Splat};

use crate::viewpoint::{Shown, stride};

/// The greatest radius of a disc, in fine pixels.
const LARGEST: f64 = 10.0;

/// The visible parts of a body.
pub(super) enum Solid {
    /// Corners of triangles.
    Triangles(Vec<[Vector3<f64>; 3]>),
    /// The discs of points.
    Discs(Vec<Splat>),
}

impl Shown for Solid {
    fn points(&self) -> Vec<Vector3<f64>> {
        match self {
            Self::Triangles(all) => all.iter().step_by(stride(all.len())).map(|corners| corners[0]).collect(),
            Self::Discs(all) => all.iter().step_by(stride(all.len())).map(|splat| splat.centre).collect(),
        }
    }

    fn level_share(&self) -> f64 {
        // Bodies that deform are seldom rooms.
        0.0
    }

    fn centre(&self) -> Vector3<f64> {
        let points = self.points();
        #[expect(clippy::cast_precision_loss, reason = "a count")]
        let count = points.len().max(1) as f64;
        points.iter().sum::<Vector3<f64>>() / count
    }
}

impl Solid {
    /// Paints it in one colour.
    pub(super) fn paint(&self, canvas: &mut Canvas, camera: &Camera, colour: Colour) {
        match self {
            Self::Triangles(all) => all.iter().for_each(|corners| canvas.triangle(camera, corners, colour)),
            Self::Discs(all) => {
                for splat in all {
                    let splat = Splat { radius: splat.radius.min(LARGEST / camera.scale), ..*splat };
                    canvas.splat(camera, &splat, colour);
                }
            }
        }
    }
}
