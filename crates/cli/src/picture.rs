//! Pictures of two scans and of the place where they meet.

use std::path::Path;

use nearmiss::geometry::nalgebra::Vector3;
use nearmiss::surface::symmetric_eigen;
use nearmiss::{Answer, Contact, Evidence, Placed, PointId, Verdict};

use crate::canvas::{Area, Camera, Canvas, Colour, FINE, Splat, shade};
use crate::digits::short;
use crate::error::CliError;
use crate::font;
use crate::image::Picture;

/// In fine pixels.
pub(crate) const PANEL: usize = 780 * FINE;
pub(crate) const GAP: usize = 12 * FINE;
pub(crate) const LEGEND: usize = 44 * FINE;

pub(crate) const GROUND: Colour = [255, 255, 255];
pub(crate) const PANEL_GROUND: Colour = [238, 240, 243];
pub(crate) const INK: Colour = [30, 34, 40];
pub(crate) const OF_A: Colour = [74, 144, 217];
pub(crate) const OF_B: Colour = [240, 140, 46];

/// Half the width of the close view, in local sampling radii.
const CLOSE: f64 = 12.0;

/// What lies this near the cutting plane is painted darker, as a share of that half width.
const CUT: f64 = 0.045;

/// In the whole view no disc is larger than this, in fine pixels: far returns of a LiDAR would hide the rest.
pub(crate) const LARGEST: f64 = 14.0;

/// Points that are looked at to choose a view.
const SAMPLE: usize = 20_000;

/// Refuses a name that promises another format than the one written.
pub(crate) fn check_name(path: &Path) -> Result<(), CliError> {
    match path.extension() {
        Some(extension) if !extension.eq_ignore_ascii_case("png") => Err(CliError::Usage(format!(
            "{}: pictures are PNG; name a file that ends in .png",
            path.display()
        ))),
        _ => Ok(()),
    }
}

/// What a legend calls the scans.
pub(crate) fn names(paths: [&Path; 2]) -> [String; 2] {
    let mut letters = ["A", "B"].into_iter();
    paths.map(|path| {
        let letter = letters.next().unwrap_or_default();
        path.file_name().map_or(letter.into(), |name| format!("{letter}: {}", name.to_string_lossy()))
    })
}

/// Both scans as they lie in the world; where they meet, beside that, a close view along the line in which
/// the surfaces cut each other, the near half taken away, with the witness and both normals.
#[must_use]
pub fn contact_picture(a: &Placed<'_>, b: &Placed<'_>, answer: &Answer) -> Picture {
    paint([a, b], answer, &Style { names: ["A", "B"].map(Into::into), points: false })
}

/// How scans are shown.
#[derive(Debug)]
pub(crate) struct Style {
    /// Of both scans.
    pub(crate) names: [String; 2],
    /// Points instead of surfaces.
    pub(crate) points: bool,
}

/// [`contact_picture`] in a style.
pub(crate) fn paint(views: [&Placed<'_>; 2], answer: &Answer, style: &Style) -> Picture {
    let mut canvas = Canvas::new(2 * PANEL + 3 * GAP, PANEL + LEGEND + 2 * GAP, GROUND);
    let contact = match answer.verdict {
        Verdict::Intersecting { contact, .. } => Some(Close::new(views, &contact, style.points)),
        _ => None,
    };
    let width = if contact.is_some() { PANEL } else { 2 * PANEL + GAP };
    let area = Area { left: GAP, top: GAP, width, height: PANEL };
    canvas.fill(area, PANEL_GROUND);
    let whole = whole_camera(views, area, |points, toward| {
        4.0 * contact.as_ref().map_or(0.0, |close| hidden(close, points, *toward))
    });
    for (view, colour) in views.into_iter().zip([OF_A, OF_B]) {
        for i in 0..view.scan().len() {
            let splat = splat(view, i);
            let splat = Splat { radius: splat.radius.min(LARGEST / whole.scale), ..splat };
            let splat = if style.points { dot(&splat, &whole, WHOLE_DOT) } else { splat };
            canvas.splat(&whole, &splat, colour);
        }
    }
    scale_bar(&mut canvas, &whole);
    if let Some(close) = &contact {
        let area = Area { left: 2 * GAP + PANEL, ..area };
        canvas.fill(area, PANEL_GROUND);
        close.paint(&mut canvas, views, area);
        mark(&mut canvas, &whole, close.point, 1.0);
        frame(&mut canvas, &whole, close);
    }
    let sure = |evidence| if evidence == Evidence::Certified { "CERTIFIED" } else { "ESTIMATED" };
    let verdict = match answer.verdict {
        Verdict::Intersecting { evidence, .. } => format!("CONTACT, {}", sure(evidence)),
        Verdict::Separated { evidence, .. } => format!("NO CONTACT, {}", sure(evidence)),
        Verdict::Undecided(_) => "UNDECIDED".to_owned(),
    };
    legend(&mut canvas, &verdict, &style.names);
    canvas.picture()
}

/// The disc of the `i`-th stored point in the world.
pub(crate) fn splat(view: &Placed<'_>, i: usize) -> Splat {
    let scan = view.scan();
    Splat {
        centre: view.point(i).into(),
        normal: view.placed().rotate(scan.normals()[i].map(f64::from)).into(),
        radius: f64::from(scan.discs().get(i)) * view.placed().scale(),
    }
}

/// Paints what stands for the `i`-th stored point in the obstacle: a disc, or a ball. Neither is larger than
/// `largest`, in fine pixels, nor a ball too small to be seen.
pub(crate) fn obstacle(
    canvas: &mut Canvas,
    camera: &Camera,
    view: &Placed<'_>,
    i: usize,
    colour: Colour,
    largest: f64,
) {
    let largest = largest / camera.scale;
    let ball = f64::from(view.scan().slices().obstacle_ball(i)) * view.placed().scale();
    if ball > 0.0 {
        canvas.ball(camera, view.point(i).into(), ball.min(largest).max(SEEN / camera.scale), colour);
    } else {
        let splat = splat(view, i);
        canvas.splat(camera, &Splat { radius: splat.radius.min(largest), ..splat }, colour);
    }
}

/// No ball is smaller, in fine pixels.
const SEEN: f64 = 2.0;

/// Radii of points in fine pixels.
const WHOLE_DOT: f64 = 2.5;
const CLOSE_DOT: f64 = 9.0;

/// A point in place of a disc, facing the viewer.
pub(crate) fn dot(splat: &Splat, camera: &Camera, pixels: f64) -> Splat {
    Splat { normal: camera.axes[2], radius: pixels / camera.scale, ..*splat }
}

/// What the close view shows.
struct Close {
    point: Vector3<f64>,
    normals: [Vector3<f64>; 2],
    /// Half the width of the view.
    reach: f64,
    /// The two points nearest to it, where points are shown.
    pair: Option<[Vector3<f64>; 2]>,
}

impl Close {
    fn new(views: [&Placed<'_>; 2], contact: &Contact, points: bool) -> Self {
        let at = |k: usize| stored_index(views[k], contact.sources[k]);
        let indices = [at(0), at(1)];
        let normals = match contact.normals {
            Some(normals) => normals.map(Vector3::from),
            None => [0, 1].map(|k| splat(views[k], indices[k]).normal),
        };
        let radius = |k: usize| f64::from(views[k].scan().radii()[indices[k]]) * views[k].placed().scale();
        let pair = points.then(|| [0, 1].map(|k| Vector3::from(views[k].point(indices[k]))));
        Self { point: contact.point.into(), normals, reach: CLOSE * radius(0).max(radius(1)), pair }
    }

    /// The direction of the line in which the surfaces cut each other, or any along both.
    fn chord(&self) -> Vector3<f64> {
        let [na, nb] = self.normals;
        let chord = na.cross(&nb);
        if chord.norm() > 0.1 { chord.normalize() } else { across(na) }
    }

    /// Obliquely along the chord, so that the cut is seen as a line and the surfaces behind it as surfaces.
    fn camera(&self, area: Area) -> Camera {
        let chord = self.chord();
        let [na, nb] = self.normals;
        let between = if na.dot(&nb) < 0.0 { na - nb } else { na + nb };
        let up = (between - chord * chord.dot(&between)).normalize();
        let toward = (chord + 0.25 * up).normalize();
        let up = (up - toward * toward.dot(&up)).normalize();
        #[expect(clippy::cast_precision_loss, reason = "pixels")]
        let scale = 0.5 * area.width as f64 / self.reach;
        Camera { axes: [up.cross(&toward), up, toward], centre: self.point, scale, area }
    }

    fn paint(&self, canvas: &mut Canvas, views: [&Placed<'_>; 2], area: Area) {
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
            let colours = [shade(OF_A, 0.7), shade(OF_B, 0.75)];
            for (normal, colour) in self.normals.into_iter().zip(colours) {
                let n = camera.turn(normal);
                let side = if n[1] < 0.0 { -1.0 } else { 1.0 };
                arrow(canvas, &camera, self.point, normal * (side * 0.4 * self.reach), colour);
            }
        }
        mark(canvas, &camera, self.point, 1.3);
        scale_bar(canvas, &camera);
    }
}

pub(crate) fn stored_index(view: &Placed<'_>, id: PointId) -> usize {
    view.scan().source().iter().position(|&s| s == id.0).unwrap_or_default()
}

/// Some unit direction at right angles to `v`.
pub(crate) fn across(v: Vector3<f64>) -> Vector3<f64> {
    let least = v.iamin();
    let axis = Vector3::from_fn(|k, _| if k == least { 1.0 } else { 0.0 });
    v.cross(&axis).normalize()
}

/// Some points of both scans.
pub(crate) fn sample(views: [&Placed<'_>; 2]) -> Vec<Vector3<f64>> {
    let points = |view: &Placed<'_>| {
        let view = *view;
        let stride = view.scan().len().div_ceil(SAMPLE);
        (0..view.scan().len()).step_by(stride).map(move |i| Vector3::from(view.point(i))).collect::<Vec<_>>()
    };
    views.into_iter().flat_map(points).collect()
}

/// A view of everything: what matters unhidden, as `hides` says of points and a direction towards the viewer,
/// else the scans beside each other; the longest extent lies across.
pub(crate) fn whole_camera(
    views: [&Placed<'_>; 2],
    area: Area,
    hides: impl Fn(&[Vector3<f64>], &Vector3<f64>) -> f64,
) -> Camera {
    let points = sample(views);
    let (long, apart) = extent(&points, views);
    let cost = |toward: &Vector3<f64>| {
        let below = (-toward.dot(&Vector3::new(0.0, 0.7, 0.7))).max(0.0);
        hides(&points, toward) + toward.dot(&apart).abs() + 0.5 * toward.dot(&long).abs() + below
    };
    let toward = directions().min_by(|p, q| cost(p).total_cmp(&cost(q))).unwrap_or_else(Vector3::z);
    let right = long - toward * toward.dot(&long);
    let right = if right.norm() > 1e-3 * long.norm() { right.normalize() } else { across(toward) };
    let up = toward.cross(&right);
    let (right, up) = if up.y + up.z < 0.0 { (-right, -up) } else { (right, up) };
    let mut camera = Camera { axes: [right, up, toward], centre: Vector3::zeros(), scale: 1.0, area };
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for p in &points {
        for (k, c) in camera.turn(*p).into_iter().enumerate() {
            low[k] = low[k].min(c);
            high[k] = high[k].max(c);
        }
    }
    #[expect(clippy::cast_precision_loss, reason = "pixels")]
    let (width, height) = (area.width as f64, area.height as f64);
    let size = [0, 1].map(|k| (high[k] - low[k]).max(f64::MIN_POSITIVE));
    camera.scale = 0.92 * (width / size[0]).min(height / size[1]).min(f64::MAX);
    camera.centre = (0..3).map(|k| camera.axes[k] * (0.5 * (low[k] + high[k]))).sum();
    camera
}

/// A view of one scan.
pub(crate) fn scan_camera(view: &Placed<'_>, area: Area) -> Camera {
    whole_camera([view, view], area, |_, _| 0.0)
}

/// The direction of greatest extent, and the unit direction from one scan's middle to the other's, or zero.
fn extent(points: &[Vector3<f64>], views: [&Placed<'_>; 2]) -> (Vector3<f64>, Vector3<f64>) {
    #[expect(clippy::cast_precision_loss, reason = "a count")]
    let mean = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
    let mut s = [0.0; 6];
    for p in points {
        let [x, y, z]: [f64; 3] = (p - mean).into();
        for (sum, v) in s.iter_mut().zip([x * x, x * y, x * z, y * y, y * z, z * z]) {
            *sum += v;
        }
    }
    let [ca, cb] = views.map(|v| Vector3::from(v.placed().apply(v.scan().outline().discs.centre)));
    let apart = (cb - ca).try_normalize(0.0).unwrap_or_default();
    (Vector3::from(symmetric_eigen(s).vectors[2]), apart)
}

/// How much of the close view is hidden behind other points, seen from `toward`: about 0 to 1.
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

/// Directions spread evenly over the sphere, on a Fibonacci spiral.
pub(crate) fn directions() -> impl Iterator<Item = Vector3<f64>> {
    const COUNT: u32 = 128;
    (0..COUNT).map(|i| {
        let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(COUNT);
        let turn = f64::from(i) * std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
        let level = (1.0 - z * z).sqrt();
        Vector3::new(level * turn.cos(), level * turn.sin(), z)
    })
}

/// Lines are drawn wider in white first, to stand out from what is behind them.
pub(crate) const HALO: f64 = 3.0;

fn mark(canvas: &mut Canvas, camera: &Camera, point: Vector3<f64>, size: f64) {
    let [x, y, _] = camera.project(point);
    let fine = 2.0 * size;
    for (width, colour) in [(fine * 1.2 + 2.0 * HALO, GROUND), (fine * 1.2, INK)] {
        canvas.ring(camera.area, [x, y], 9.0 * fine, width, colour);
        for (dx, dy) in [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)] {
            let ends = [5.0, 13.0].map(|r| [x + r * fine * dx, y + r * fine * dy]);
            canvas.line(camera.area, ends, width, colour);
        }
    }
}

fn arrow(canvas: &mut Canvas, camera: &Camera, from: Vector3<f64>, along: Vector3<f64>, colour: Colour) {
    let [[x, y, _], [u, v, _]] = [from, from + along].map(|p| camera.project(p));
    let length = (u - x).hypot(v - y).max(1.0);
    let [dx, dy] = [(u - x) / length, (v - y) / length];
    let head = 30.0_f64.min(0.4 * length);
    let barb = |side: f64| [u - head * (dx - 0.5 * side * dy), v - head * (dy + 0.5 * side * dx)];
    for (width, colour) in [(7.0 + 2.0 * HALO, GROUND), (7.0, colour)] {
        for from in [[x, y], barb(1.0), barb(-1.0)] {
            canvas.line(camera.area, [from, [u, v]], width, colour);
        }
    }
}

/// A square about what the close view shows.
fn frame(canvas: &mut Canvas, camera: &Camera, close: &Close) {
    let [x, y, _] = camera.project(close.point);
    let half = camera.scale * close.reach;
    if half < 40.0 {
        return;
    }
    let corners =
        [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[u, v]| [x + half * u, y + half * v]);
    for (width, colour) in [(3.0 + HALO, GROUND), (3.0, INK)] {
        for k in 0..4 {
            canvas.line(camera.area, [corners[k], corners[(k + 1) % 4]], width, colour);
        }
    }
}

/// A length of 1, 2 or 5 times a power of ten, a sixth to a third of the panel's height.
pub(crate) fn scale_bar(canvas: &mut Canvas, camera: &Camera) {
    #[expect(clippy::cast_precision_loss, reason = "pixels")]
    let longest = camera.area.height as f64 / 3.0 / camera.scale;
    let power = 10.0_f64.powf(longest.log10().floor());
    let length = [5.0, 2.0, 1.0].into_iter().map(|m| m * power).find(|&l| l <= longest).unwrap_or(power);
    let Area { left, top, height, .. } = camera.area;
    let [x, y] = [left + 16 * FINE, top + height - 18 * FINE];
    #[expect(clippy::cast_precision_loss, reason = "pixels")]
    let (from, level) = (x as f64, y as f64);
    let to = from + length * camera.scale;
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a third of the panel at most"
    )]
    let long = (to - from) as usize;
    // On a ground of its own, whatever lies behind.
    let ground = Area { left: x - 8 * FINE, top: y - 28 * FINE, width: long + 16 * FINE, height: 38 * FINE };
    canvas.fill(ground, PANEL_GROUND);
    canvas.line(camera.area, [[from, level], [to, level]], 5.0, INK);
    for end in [from, to] {
        canvas.line(camera.area, [[end, level - 10.0], [end, level + 10.0]], 5.0, INK);
    }
    canvas.text([x, y - 22 * FINE], 3 * FINE / 2, INK, &short(length));
}

/// Longer names are cut short.
pub(crate) const LONGEST_NAME: usize = 32;

pub(crate) fn legend(canvas: &mut Canvas, told: &str, names: &[String; 2]) {
    let top = PANEL + 2 * GAP + 8 * FINE;
    let mut left = GAP + 4 * FINE;
    for (name, colour) in names.iter().zip([OF_A, OF_B]) {
        let name: String = name.chars().take(LONGEST_NAME).collect();
        canvas.fill(Area { left, top, width: 14 * FINE, height: 14 * FINE }, colour);
        canvas.text([left + 20 * FINE, top], 2 * FINE, INK, &name);
        left += (40 + 2 * font::ADVANCE * name.chars().count()) * FINE;
    }
    canvas.text([left + 10 * FINE, top], 2 * FINE, INK, told);
}
