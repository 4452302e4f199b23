//! The scene at a few times, side by side, from above and from the side.

use nearmiss::geometry::nalgebra::Vector3;
use nearmiss::{Pose, Scan};
use nearmiss_draw::canvas::{Area, Camera, Canvas, Splat};
use nearmiss_draw::marks;
use nearmiss_draw::picture::Picture;
use rapier3d::math::Vector;

/// Fine pixels of a side of a view.
const SIDE: usize = 1000;

/// A row of views from above over one of views from the side.
pub(crate) fn strip(scan: &Scan, shown: &[(f64, Vec<Vector>)]) -> Picture {
    let (bounds, placed) = (scan.bounds(), scan.at(&Pose::IDENTITY));
    let low = Vector3::from(bounds.min);
    let extent = Vector3::from(bounds.max) - low;
    let (x, y, z) = (Vector3::x(), Vector3::y(), Vector3::z());
    #[expect(clippy::cast_precision_loss, reason = "pixels")]
    let scale = 0.95 * SIDE as f64 / extent.max();
    let mut canvas = Canvas::new(SIDE * shown.len(), 2 * SIDE, [255, 255, 255]);
    for (column, (seconds, bodies)) in shown.iter().enumerate() {
        for (row, axes) in [[x, y, z], [x, z, -y]].into_iter().enumerate() {
            let area = Area { left: column * SIDE, top: row * SIDE, width: SIDE, height: SIDE };
            let camera = Camera { axes, centre: low + extent * 0.5, scale, area };
            for i in (0..scan.len()).step_by(scan.len().div_ceil(60_000)) {
                let normal = axes[2];
                let splat = Splat { centre: placed.point(i).into(), normal, radius: 0.8 / scale };
                canvas.splat(&camera, &splat, [190, 200, 215]);
            }
            for body in bodies {
                // Drawn before all of the scan, so that floors do not hide the bodies.
                let centre = Vector3::from(body.to_array().map(f64::from)) + axes[2] * 2.0 * extent.max();
                canvas.ball(&camera, centre, 0.2, [225, 110, 30]);
            }
            marks::title(&mut canvas, area, &format!("{seconds} s"));
        }
    }
    canvas.picture()
}
