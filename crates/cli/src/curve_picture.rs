//! A picture of two scans and the curves in which they cut each other.

use nearmiss::geometry::nalgebra::Vector3;
use nearmiss::{Curve, Curves, Placed};

use crate::canvas::{Area, Camera, Canvas, Colour, FINE, Splat};
use crate::digits::{count, short};
use crate::font;
use crate::image::Picture;
use crate::picture::{self, scale_bar, splat, whole_camera};

/// In fine pixels.
const WIDTH: usize = 1400 * FINE;
const HEIGHT: usize = 900 * FINE;
const GAP: usize = 12 * FINE;
const LEGEND: usize = 44 * FINE;

const GROUND: Colour = [255, 255, 255];
const PANEL_GROUND: Colour = [246, 247, 249];
const INK: Colour = [30, 34, 40];
/// Paler than where a contact is shown: the curves count.
const SOFT: [Colour; 2] = [[176, 205, 236], [246, 210, 170]];
const CURVE: Colour = [200, 0, 70];
/// Where a curve runs behind a surface.
const BEHIND: Colour = [222, 130, 160];

/// A curve that is within so many sampling radii behind what is painted is seen: discs stand out as far.
const LIFT: f64 = 1.5;

/// Points of curves and of scans that are looked at to choose a view.
const CURVE_SAMPLE: usize = 64;
const POINT_SAMPLE: usize = 3000;

/// Both scans, softly, and their curves, from where most of these are seen; thin where they are hidden.
#[must_use]
pub fn curve_picture(a: &Placed<'_>, b: &Placed<'_>, found: &Curves) -> Picture {
    paint([a, b], found, &["A", "B"].map(Into::into))
}

/// [`curve_picture`] with names for the scans.
pub(crate) fn paint(views: [&Placed<'_>; 2], found: &Curves, names: &[String; 2]) -> Picture {
    let mut canvas = Canvas::new(WIDTH + 2 * GAP, HEIGHT + LEGEND + 2 * GAP, GROUND);
    let area = Area { left: GAP, top: GAP, width: WIDTH, height: HEIGHT };
    canvas.fill(area, PANEL_GROUND);
    let radius = |view: &Placed<'_>| view.sampling_radius();
    let radii = views.map(radius);
    let seen = Visibility::new(found, radii[0].max(radii[1]));
    let camera = whole_camera(views, area, |points, toward| 8.0 * seen.hidden(points, toward));
    for (view, colour) in views.into_iter().zip(SOFT) {
        for i in 0..view.scan().len() {
            let disc = splat(view, i);
            let most = picture::LARGEST / camera.scale;
            canvas.splat(&camera, &Splat { radius: disc.radius.min(most), ..disc }, colour);
        }
    }
    draw(&mut canvas, &camera, found, LIFT * radii[0].max(radii[1]));
    scale_bar(&mut canvas, &camera);
    legend(&mut canvas, found, names);
    canvas.picture()
}

/// Every curve thinly, and what is seen of it strongly; points of mere touching as dots.
fn draw(canvas: &mut Canvas, camera: &Camera, found: &Curves, lift: f64) {
    let place = |i: usize| Vector3::from(found.points[i]);
    let edges = || found.curves.iter().flat_map(Curve::edges).map(|edge| edge.map(place));
    for edge in edges() {
        let ends = edge.map(|p| camera.project(p)).map(|[x, y, _]| [x, y]);
        canvas.line(camera.area, ends, 3.0, BEHIND);
    }
    for (width, colour) in [(10.0, GROUND), (6.0, CURVE)] {
        for edge in edges() {
            canvas.edge(camera, edge, width, colour, lift);
        }
    }
    for curve in found.curves.iter().filter(|curve| curve.count == 1) {
        let [x, y, _] = camera.project(place(curve.first));
        canvas.line(camera.area, [[x, y]; 2], 10.0, CURVE);
    }
}

/// Some points of the curves.
struct Visibility {
    points: Vec<Vector3<f64>>,
    radius: f64,
}

impl Visibility {
    fn new(found: &Curves, radius: f64) -> Self {
        let stride = found.points.len().div_ceil(CURVE_SAMPLE).max(1);
        Self { points: found.points.iter().step_by(stride).map(|&p| p.into()).collect(), radius }
    }

    /// The share of the curves that lies behind points, seen from `toward`.
    fn hidden(&self, points: &[Vector3<f64>], toward: &Vector3<f64>) -> f64 {
        if self.points.is_empty() {
            return 0.0;
        }
        let stride = points.len().div_ceil(POINT_SAMPLE).max(1);
        #[expect(clippy::cast_precision_loss, reason = "counts")]
        let wide = self.radius * (stride as f64).sqrt().max(2.0);
        let is_hidden = |x: &&Vector3<f64>| {
            points.iter().step_by(stride).any(|p| {
                let offset = p - *x;
                let depth = toward.dot(&offset);
                depth > 3.0 * wide && (offset - toward * depth).norm_squared() < wide * wide
            })
        };
        #[expect(clippy::cast_precision_loss, reason = "counts")]
        let share = self.points.iter().filter(is_hidden).count() as f64 / self.points.len() as f64;
        share
    }
}

fn legend(canvas: &mut Canvas, found: &Curves, names: &[String; 2]) {
    let top = HEIGHT + 2 * GAP + 8 * FINE;
    let mut left = GAP + 4 * FINE;
    let curves = format!(
        "{}, {} CLOSED, {} LONG{}",
        count(found.curves.len() as u64, "CURVE").to_uppercase(),
        found.closed(),
        short(found.length()),
        if found.complete { "" } else { ", UNFINISHED" }
    );
    let colours = [SOFT[0], SOFT[1], CURVE];
    for (name, colour) in names.iter().chain([&curves]).zip(colours) {
        let name: String = name.chars().take(picture::LONGEST_NAME).collect();
        canvas.fill(Area { left, top, width: 14 * FINE, height: 14 * FINE }, colour);
        canvas.text([left + 20 * FINE, top], 2 * FINE, INK, &name);
        left += (40 + 2 * font::ADVANCE * name.chars().count()) * FINE;
    }
}
