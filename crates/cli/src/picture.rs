//! Pictures of two scans and of the place where they meet.

use std::path::Path;

use nearmiss::geometry::nalgebra::Vector3;
use nearmiss::{Answer, Contact, Evidence, Placed, PointId, Verdict};
use nearmiss_draw::canvas::{Area, Camera, Canvas, Colour, FINE, Splat, shade};
use nearmiss_draw::legend;
use nearmiss_draw::marks::{self, arrow, frame, mark, title};
use nearmiss_draw::picture::Picture;

use crate::error::CliError;
use crate::units::WorldUnit;
use crate::viewpoint::{Upright, ViewArgs, scale_of};

pub(crate) use crate::viewpoint::{across, directions, sample, scan_camera};
pub(crate) use nearmiss_draw::marks::{GROUND, HALO, INK, PANEL_GROUND};

/// Sizes in fine pixels.
pub(crate) const PANEL: usize = 780 * FINE;
pub(crate) const GAP: usize = 12 * FINE;
pub(crate) const LEGEND: usize = 2 * legend::LINE + 2 * FINE;

pub(crate) const OF_A: Colour = [74, 144, 217];
pub(crate) const OF_B: Colour = [240, 140, 46];

/// Half the width of the close view, in local sampling radii.
const CLOSE: f64 = 12.0;

/// The greatest half width of the close view, in half diagonals of the smaller scan.
const AROUND: f64 = 1.5;

/// Factor of the half width if points are shown, for a nearer view of the two points of the
/// contact.
const NEARER: f64 = 0.4;

/// Points this near to the cutting plane are painted darker, as a share of the half width.
const CUT: f64 = 0.045;

/// The greatest radius of a disc in the whole view, in fine pixels. Far returns of a LiDAR would
/// otherwise hide the rest.
pub(crate) const LARGEST: f64 = 14.0;

/// If the extent of a scan is less than this share of the other's, its hidden parts are shown with
/// this opacity.
pub(crate) const SMALL: f64 = 0.5;
const OPACITY: f64 = 0.6;

/// Rejects a file name whose extension is not that of a PNG.
pub(crate) fn check_name(path: &Path) -> Result<(), CliError> {
    match path.extension() {
        Some(extension) if !extension.eq_ignore_ascii_case("png") => Err(CliError::Usage(format!(
            "{}: expected a file name that ends in .png, got .{}; pictures are PNG files",
            path.display(),
            extension.display()
        ))),
        _ => Ok(()),
    }
}

/// Returns the names of the scans in a legend.
pub(crate) fn names(paths: [&Path; 2]) -> [String; 2] {
    let mut letters = ["A", "B"].into_iter();
    paths.map(|path| {
        let letter = letters.next().unwrap_or_default();
        path.file_name().map_or(letter.into(), |name| format!("{letter}: {}", name.to_string_lossy()))
    })
}

/// Paints both scans in the world and, if they touch, a close view of the contact. The close view
/// looks along the line of intersection, with the near half cut away, and shows the witness and
/// both normals.
#[must_use]
pub fn contact_picture(a: &Placed<'_>, b: &Placed<'_>, answer: &Answer) -> Picture {
    paint([a, b], answer, &Style { names: ["A", "B"].map(Into::into), ..Style::default() })
}

/// The style in which scans are shown.
#[derive(Debug, Default)]
pub(crate) struct Style {
    /// The names of both scans.
    pub(crate) names: [String; 2],
    /// `true` to show points instead of surfaces.
    pub(crate) points: bool,
    /// The viewpoint.
    pub(crate) view: ViewArgs,
    /// The unit of lengths.
    pub(crate) unit: WorldUnit,
}

/// Draws a scale bar for lengths in the unit of the file.
pub(crate) fn scale_bar(canvas: &mut Canvas, camera: &Camera) {
    scale_bar_in(canvas, camera, WorldUnit::OfFile);
}

/// Draws a scale bar for lengths in this unit.
pub(crate) fn scale_bar_in(canvas: &mut Canvas, camera: &Camera, unit: WorldUnit) {
    marks::scale_bar(canvas, camera, |length| unit.scale(length));
}

/// Paints a [`contact_picture`] in a style.
pub(crate) fn paint(views: [&Placed<'_>; 2], answer: &Answer, style: &Style) -> Picture {
    let mut canvas = Canvas::new(2 * PANEL + 3 * GAP, PANEL + LEGEND + 2 * GAP, GROUND);
    let contact = match answer.verdict {
        Verdict::Intersecting { contact, .. } => Some(Close::new(views, &contact, style)),
        _ => None,
    };
    let width = if contact.is_some() { PANEL } else { 2 * PANEL + GAP };
    let area = Area { left: GAP, top: GAP, width, height: PANEL };
    canvas.fill(area, PANEL_GROUND);
    let whole = style.view.camera(
        views,
        area,
        contact.as_ref().map_or(&[], |close| std::slice::from_ref(&close.point)),
        |points, toward| 4.0 * contact.as_ref().map_or(0.0, |close| hidden(close, points, *toward)),
    );
    paint_both(&mut canvas, area, views, |canvas, side| {
        let view = views[side];
        for i in 0..view.scan().len() {
            let splat = splat(view, i);
            let splat = Splat { radius: splat.radius.min(LARGEST / whole.scale), ..splat };
            let splat = if style.points { dot(&splat, &whole, WHOLE_DOT) } else { splat };
            canvas.splat(&whole, &splat, [OF_A, OF_B][side]);
        }
    });
    if let Some(close) = &contact {
        let area = Area { left: 2 * GAP + PANEL, ..area };
        canvas.fill(area, PANEL_GROUND);
        close.paint(&mut canvas, views, area, style.unit);
        frame(&mut canvas, &whole, close.point, close.reach);
        mark(&mut canvas, &whole, close.point, 1.0);
    }
    scale_bar_in(&mut canvas, &whole, style.unit);
    let sure = |evidence| if evidence == Evidence::Certified { "certified" } else { "estimated" };
    let told = match answer.verdict {
        Verdict::Intersecting { evidence, .. } => {
            format!("They touch at the ringed point ({}). {}", sure(evidence), close_told(style.points))
        }
        Verdict::Separated { evidence, .. } => format!("They do not touch ({}).", sure(evidence)),
        Verdict::Undecided(_) => "It is undecided whether they touch.".to_owned(),
    };
    legend(&mut canvas, &told, &style.names);
    canvas.picture()
}

/// Describes the close view of a contact.
pub(crate) fn close_told(points: bool) -> &'static str {
    if points {
        "The close view shows the two points whose balls meet, and the line between them."
    } else {
        "The close view is cut open there, dark along the cut. The arrows are normals of the surfaces."
    }
}

/// Paints both scans by calling `paint` with 0 for a and 1 for b. If one scan is much smaller than
/// the other, its hidden parts are painted faintly.
pub(crate) fn paint_both(
    canvas: &mut Canvas,
    area: Area,
    views: [&Placed<'_>; 2],
    paint: impl FnMut(&mut Canvas, usize),
) {
    paint_sized(canvas, area, views.map(half_diagonal), paint);
}

/// Does the same for two things with these half diagonals.
pub(crate) fn paint_sized(
    canvas: &mut Canvas,
    area: Area,
    [a, b]: [f64; 2],
    mut paint: impl FnMut(&mut Canvas, usize),
) {
    (0..2).for_each(|side| paint(canvas, side));
    let small = if a < SMALL * b { 0 } else { 1 };
    if a.min(b) < SMALL * a.max(b) {
        let (width, height) = canvas.size();
        let mut alone = Canvas::new(width, height, GROUND);
        paint(&mut alone, small);
        canvas.veil(&alone, area, OPACITY);
    }
}

/// Returns half the diagonal of a scan's bounding box, in the world.
pub(crate) fn half_diagonal(view: &Placed<'_>) -> f64 {
    let half = Vector3::from(view.scan().bounds().half_extents());
    half.norm() * view.stored_to_world().scale() / view.scan().frame().scale
}

/// Returns the disc of the `i`-th stored point in the world.
pub(crate) fn splat(view: &Placed<'_>, i: usize) -> Splat {
    let scan = view.scan();
    Splat {
        centre: view.point(i).into(),
        normal: view.stored_to_world().rotate(scan.normals()[i].map(f64::from)).into(),
        radius: f64::from(scan.discs().get(i)) * view.stored_to_world().scale(),
    }
}

/// Paints the `i`-th stored point of the obstacle as a disc or a ball, with a radius of at most
/// `largest` fine pixels. Balls have a radius of at least `SEEN` fine pixels.
pub(crate) fn obstacle(
    canvas: &mut Canvas,
    camera: &Camera,
    view: &Placed<'_>,
    i: usize,
    colour: Colour,
    largest: f64,
) {
    let largest = largest / camera.scale;
    let ball = f64::from(view.scan().arrays().obstacle_ball(i)) * view.stored_to_world().scale();
    if ball > 0.0 {
        canvas.ball(camera, view.point(i).into(), ball.min(largest).max(SEEN / camera.scale), colour);
    } else {
        let splat = splat(view, i);
        canvas.splat(camera, &Splat { radius: splat.radius.min(largest), ..splat }, colour);
    }
}

/// The least radius of a ball, in fine pixels.
const SEEN: f64 = 2.0;

/// Radii of points in fine pixels.
const WHOLE_DOT: f64 = 2.5;
const CLOSE_DOT: f64 = 9.0;

/// Returns a dot in place of a disc, facing the viewer.
pub(crate) fn dot(splat: &Splat, camera: &Camera, pixels: f64) -> Splat {
    Splat { normal: camera.axes[2], radius: pixels / camera.scale, ..*splat }
}

/// The close view of a contact.
pub(crate) struct Close {
    pub(crate) point: Vector3<f64>,
    pub(crate) normals: [Vector3<f64>; 2],
    /// Half the width of the view.
    pub(crate) reach: f64,
    /// The two points of the contact, if points are shown.
    pub(crate) pair: Option<[Vector3<f64>; 2]>,
    pub(crate) upright: Option<Upright>,
}

impl Close {
    fn new(views: [&Placed<'_>; 2], contact: &Contact, style: &Style) -> Self {
        let at = |k: usize| stored_index(views[k], contact.sources[k]);
        let indices = [at(0), at(1)];
        let normals = match contact.normals {
            Some(normals) => normals.map(Vector3::from),
            None => [0, 1].map(|k| splat(views[k], indices[k]).normal),
        };
        let radius =
            |k: usize| f64::from(views[k].scan().radii()[indices[k]]) * views[k].stored_to_world().scale();
        let pair = style.points.then(|| [0, 1].map(|k| Vector3::from(views[k].point(indices[k]))));
        // A scan that is small compared with the spacing of the other fills the view.
        let small = half_diagonal(views[0]).min(half_diagonal(views[1]));
        let least = (CLOSE * radius(0).min(radius(1))).max(AROUND * small);
        let reach = (CLOSE * radius(0).max(radius(1))).min(least);
        let reach = if style.points { NEARER * reach } else { reach };
        Self { point: contact.point.into(), normals, reach, pair, upright: style.view.upright(views) }
    }

    /// Returns the direction of the line of intersection. If the surfaces are nearly parallel,
    /// returns a direction along both.
    pub(crate) fn chord(&self) -> Vector3<f64> {
        let [na, nb] = self.normals;
        let chord = na.cross(&nb);
        let chord = if chord.norm() > 0.1 { chord.normalize() } else { across(na) };
        let is_from_below = self.upright.is_some_and(|upright| upright.up().dot(&chord) < 0.0);
        if is_from_below { -chord } else { chord }
    }

    /// Returns a camera that looks obliquely along the chord. The cut is seen as a line, and the
    /// surfaces behind it as surfaces. The normals point up unless the picture is upright.
    pub(crate) fn camera(&self, area: Area) -> Camera {
        let chord = self.chord();
        let scale = scale_of(area, self.reach);
        if let Some(upright) = self.upright {
            let axes = upright.axes_towards((chord + 0.25 * upright.up()).normalize());
            return Camera { axes, centre: self.point, scale, area };
        }
        let [na, nb] = self.normals;
        let between = if na.dot(&nb) < 0.0 { na - nb } else { na + nb };
        let up = (between - chord * chord.dot(&between)).normalize();
        let toward = (chord + 0.25 * up).normalize();
        let up = (up - toward * toward.dot(&up)).normalize();
        Camera { axes: [up.cross(&toward), up, toward], centre: self.point, scale, area }
    }

    fn paint(&self, canvas: &mut Canvas, views: [&Placed<'_>; 2], area: Area, unit: WorldUnit) {
        let camera = self.camera(area);
        let chord = self.chord();
        for (view, colour) in views.into_iter().zip([OF_A, OF_B]) {
            for i in 0..view.scan().len() {
                let splat = splat(view, i);
                let offset = splat.centre - self.point;
                let depth = chord.dot(&offset);
                if depth <= 0.0 && offset.norm() < 1.5 * self.reach {
                    if self.pair.is_some() {
                        canvas.splat(&camera, &dot(&splat, &camera, CLOSE_DOT), colour);
                        continue;
                    }
                    let is_cut = depth > -CUT * self.reach;
                    canvas.splat(&camera, &splat, if is_cut { shade(colour, 0.45) } else { colour });
                }
            }
        }
        if let Some(pair) = self.pair {
            let ends = pair.map(|p| camera.project(p)).map(|[x, y, _]| [x, y]);
            for (width, colour) in [(5.0 + 2.0 * HALO, GROUND), (5.0, INK)] {
                canvas.line(area, ends, width, colour);
            }
            for (p, colour) in pair.into_iter().zip([OF_A, OF_B]) {
                let [x, y, _] = camera.project(p);
                canvas.line(area, [[x, y]; 2], 2.0 * CLOSE_DOT + 2.0 * HALO, INK);
                canvas.line(area, [[x, y]; 2], 2.0 * CLOSE_DOT, colour);
            }
        } else {
            self.paint_normals(canvas, &camera);
        }
        self.finish(canvas, &camera, unit);
    }

    /// Draws arrows along the normals, upwards in the picture.
    pub(crate) fn paint_normals(&self, canvas: &mut Canvas, camera: &Camera) {
        let colours = [shade(OF_A, 0.7), shade(OF_B, 0.75)];
        for (normal, colour) in self.normals.into_iter().zip(colours) {
            let n = camera.turn(normal);
            let side = if n[1] < 0.0 { -1.0 } else { 1.0 };
            arrow(canvas, camera, self.point, normal * (side * 0.4 * self.reach), colour);
        }
    }

    /// Marks the point, and adds the title and the scale.
    pub(crate) fn finish(&self, canvas: &mut Canvas, camera: &Camera, unit: WorldUnit) {
        mark(canvas, camera, self.point, 1.3);
        title(canvas, camera.area, "Close view");
        scale_bar_in(canvas, camera, unit);
    }
}

pub(crate) fn stored_index(view: &Placed<'_>, id: PointId) -> usize {
    view.scan().source().iter().position(|&s| s == id.0).unwrap_or_default()
}

/// Estimates how much of the close view other points hide, seen from `toward`: 0 to about 1.
fn hidden(close: &Close, points: &[Vector3<f64>], toward: Vector3<f64>) -> f64 {
    let radius = 0.4 * close.reach;
    let before = points.iter().filter(|p| {
        let offset = *p - close.point;
        let depth = toward.dot(&offset);
        depth > radius && (offset - toward * depth).norm() < radius
    });
    #[expect(clippy::cast_precision_loss, reason = "a count")]
    let count = before.count() as f64;
    count / (count + 4.0)
}

/// Writes the names of both scans with their colours, and a sentence below them.
pub(crate) fn legend(canvas: &mut Canvas, told: &str, names: &[String; 2]) {
    let [left, top] = [GAP + 4 * FINE, PANEL + 2 * GAP + 4 * FINE];
    let width = 2 * PANEL + GAP - 4 * FINE;
    let names = [(Some(OF_A), names[0].as_str()), (Some(OF_B), names[1].as_str())];
    legend::entries(canvas, [left, top], width, &names);
    legend::sentence(canvas, [left, top + legend::LINE], width, told);
}
