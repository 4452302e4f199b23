//! A picture of two scans and their curves of intersection.

use nearmiss::geometry::nalgebra::Vector3;
use nearmiss::{Curve, Curves, Placed};
use nearmiss_draw::canvas::{Area, Camera, Canvas, Colour, FINE, Splat};
use nearmiss_draw::legend;
use nearmiss_draw::marks::{frame, mark, title};
use nearmiss_draw::picture::Picture;

use crate::digits::count;
use crate::picture::{self, GAP, LEGEND, PANEL, Style, paint_both, scale_bar_in, splat};
use crate::viewpoint::sample;

/// Size in fine pixels of the whole view, or of the whole view and the close view beside it.
const HEIGHT: usize = PANEL;
const WIDTH: usize = 2 * PANEL + GAP;

const GROUND: Colour = [255, 255, 255];
const PANEL_GROUND: Colour = [246, 247, 249];
/// Paler than in pictures of contacts, so that the curves stand out.
const SOFT: [Colour; 2] = [[176, 205, 236], [246, 210, 170]];
const CURVE: Colour = [200, 0, 70];
/// The colour of hidden parts of curves.
const BEHIND: Colour = [216, 104, 146];

/// A curve counts as visible up to this many sampling radii behind a surface, because discs
/// protrude that far.
const LIFT: f64 = 1.5;

/// The number of points of curves, and of scans, that are sampled to choose a view.
const CURVE_SAMPLE: usize = 64;
const POINT_SAMPLE: usize = 3000;

/// The close view is left out if its half width exceeds this share of the radius of both scans.
const SMALL: f64 = 0.35;

/// Half width of a close view: `AROUND` times the radius of its curves, and at least `LEAST`
/// sampling radii.
const AROUND: f64 = 1.3;
const LEAST: f64 = 8.0;

/// Paints both scans in pale colours with their curves, from a direction in which most of the
/// curves are visible. Hidden parts of curves are thin. If the curves are small, a close view of
/// all of them or of the longest is added.
#[must_use]
pub fn curve_picture(a: &Placed<'_>, b: &Placed<'_>, found: &Curves) -> Picture {
    paint([a, b], found, &Style { names: ["A", "B"].map(Into::into), ..Style::default() })
}

/// Paints a [`curve_picture`] in a style.
pub(crate) fn paint(views: [&Placed<'_>; 2], found: &Curves, style: &Style) -> Picture {
    let mut canvas = Canvas::new(WIDTH + 2 * GAP, HEIGHT + LEGEND + 2 * GAP, GROUND);
    let radius = |view: &Placed<'_>| view.sampling_radius();
    let radius = views.map(radius).into_iter().fold(0.0, f64::max);
    let close = Close::new(found, &sample(views), radius);
    let width = if close.is_some() { PANEL } else { WIDTH };
    let area = Area { left: GAP, top: GAP, width, height: HEIGHT };
    canvas.fill(area, PANEL_GROUND);
    let seen = Visibility::new(found.points.iter().map(|&p| p.into()), radius);
    let camera =
        style.view.camera(views, area, &seen.points, |points, toward| 8.0 * seen.hidden(points, toward));
    paint_both(&mut canvas, area, views, |canvas, side| {
        for i in 0..views[side].scan().len() {
            let disc = splat(views[side], i);
            let most = picture::LARGEST / camera.scale;
            canvas.splat(&camera, &Splat { radius: disc.radius.min(most), ..disc }, SOFT[side]);
        }
    });
    draw(&mut canvas, &camera, found, LIFT * radius);
    if let Some(close) = &close {
        if !frame(&mut canvas, &camera, close.centre, close.reach) {
            mark(&mut canvas, &camera, close.centre, 1.0);
        }
        let area = Area { left: 2 * GAP + PANEL, ..area };
        close.paint(&mut canvas, area, views, found, style);
    }
    scale_bar_in(&mut canvas, &camera, style.unit);
    write_legend(&mut canvas, found, style);
    canvas.picture()
}

/// A close view of all curves, or of the longest.
struct Close {
    centre: Vector3<f64>,
    /// Half the width of the view.
    reach: f64,
    /// The points of the curves in the view.
    points: Vec<Vector3<f64>>,
    is_of_all: bool,
    /// The greater sampling radius.
    radius: f64,
}

impl Close {
    /// Returns `None` if the curves are not small compared with the scans. `points` is a sample of
    /// both scans.
    fn new(found: &Curves, points: &[Vector3<f64>], radius: f64) -> Option<Self> {
        let small = SMALL * ball(points).1;
        let all: Vec<Vector3<f64>> = found.points.iter().map(|&p| p.into()).collect();
        let length = |curve: &&Curve| {
            curve.edges().map(|[i, j]| (all[i] - all[j]).norm()).fold(0.0, |sum, length| sum + length)
        };
        let longest = found.curves.iter().max_by(|p, q| length(p).total_cmp(&length(q)))?;
        let longest = all.get(longest.first..longest.first + longest.count)?.to_vec();
        [(all, true), (longest, false)].into_iter().find_map(|(points, is_of_all)| {
            let (centre, reach) = ball(&points);
            let is_all = is_of_all || found.curves.len() == 1;
            let view = Self {
                centre,
                reach: (AROUND * reach).max(LEAST * radius),
                points,
                is_of_all: is_all,
                radius,
            };
            (view.reach < small).then_some(view)
        })
    }

    fn paint(&self, canvas: &mut Canvas, area: Area, views: [&Placed<'_>; 2], found: &Curves, style: &Style) {
        canvas.fill(area, PANEL_GROUND);
        // Points further away are neither shown nor count as hiding the curves.
        let is_near = |p: Vector3<f64>| (p - self.centre).norm() < 1.5 * self.reach;
        let mut near = sample(views);
        near.retain(|&p| is_near(p));
        let seen = Visibility::new(self.points.iter().copied(), self.radius);
        let cost = |toward: &Vector3<f64>| 4.0 * seen.hidden(&near, toward);
        let camera = style.view.close_camera(views, area, (self.centre, self.reach), cost);
        for (view, colour) in views.into_iter().zip(SOFT) {
            for i in (0..view.scan().len()).filter(|&i| is_near(view.point(i).into())) {
                canvas.splat(&camera, &splat(view, i), colour);
            }
        }
        draw(canvas, &camera, found, LIFT * self.radius);
        title(canvas, area, if self.is_of_all { "Close view" } else { "Close view of the longest curve" });
        scale_bar_in(canvas, &camera, style.unit);
    }
}

/// Returns the centre of the bounding box of some points, and their greatest distance from it.
fn ball(points: &[Vector3<f64>]) -> (Vector3<f64>, f64) {
    let Some(&first) = points.first() else { return (Vector3::zeros(), 0.0) };
    let (low, high) = points.iter().fold((first, first), |(low, high), p| (low.inf(p), high.sup(p)));
    let centre = 0.5 * (low + high);
    (centre, points.iter().map(|p| (p - centre).norm()).fold(0.0, f64::max))
}

/// Draws every curve as a thin line and its visible parts as a thick line. Points where the
/// surfaces only touch are dots.
fn draw(canvas: &mut Canvas, camera: &Camera, found: &Curves, lift: f64) {
    let place = |i: usize| Vector3::from(found.points[i]);
    let edges = || found.curves.iter().flat_map(Curve::edges).map(|edge| edge.map(place));
    for edge in edges() {
        let ends = edge.map(|p| camera.project(p)).map(|[x, y, _]| [x, y]);
        canvas.line(camera.area, ends, 4.0, BEHIND);
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

/// A sample of the points of the curves, and the sampling radius.
struct Visibility {
    points: Vec<Vector3<f64>>,
    radius: f64,
}

impl Visibility {
    fn new(points: impl ExactSizeIterator<Item = Vector3<f64>>, radius: f64) -> Self {
        let stride = points.len().div_ceil(CURVE_SAMPLE).max(1);
        Self { points: points.step_by(stride).collect(), radius }
    }

    /// Estimates the share of the curves that is hidden by points, seen from `toward`.
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

fn write_legend(canvas: &mut Canvas, found: &Curves, style: &Style) {
    let [left, top] = [GAP + 4 * FINE, HEIGHT + 2 * GAP + 4 * FINE];
    let width = WIDTH - 4 * FINE;
    let [a, b] = [0, 1].map(|k| (Some(SOFT[k]), style.names[k].as_str()));
    let entries = [a, b, (Some(CURVE), "curve of intersection"), (Some(BEHIND), "hidden part of a curve")];
    legend::entries(canvas, [left, top], width, &entries);
    let closed = match (found.closed(), found.curves.len()) {
        (0, _) => "not closed".to_owned(),
        (closed, all) if closed == all => "closed".to_owned(),
        (closed, _) => format!("{closed} of them closed"),
    };
    let told = if found.curves.is_empty() {
        "No curve of intersection was found.".to_owned()
    } else {
        format!(
            "The surfaces intersect in {}, {closed}, with a total length of {}.{}",
            count(found.curves.len() as u64, "curve"),
            style.unit.length(found.length()),
            if found.complete { "" } else { " The budget ran out, so curves may be missing." }
        )
    };
    legend::sentence(canvas, [left, top + legend::LINE], width, &told);
}

#[cfg(test)]
mod tests {
    use nearmiss::{BuildOptions, CurveOptions, CurvePlan, Pair, PointCloud, Pose, Scan, Scratch};

    use super::*;

    /// Returns the picture of a plate of 20 by 20 and of the same plate on edge, which cuts into it
    /// by `depth`.
    fn cut(depth: f64) -> (Curves, Picture) {
        let points: Vec<[f64; 3]> =
            (0..3600_u32).map(|i| [f64::from(i % 60), f64::from(i / 60), 0.0].map(|c| c / 3.0)).collect();
        let scan =
            Scan::build(&PointCloud::from_positions(&points).unwrap(), &BuildOptions::default()).unwrap();
        let along = 59.0 / 3.0 - depth;
        let edge = [1.0, 0.0, 0.0, along, 0.0, 0.0, -1.0, 10.0, 0.0, 1.0, 0.0, -10.0, 0.0, 0.0, 0.0, 1.0];
        let poses = [Pose::IDENTITY, Pose::from_row_major(&edge, scan.bounds(), 0.1).unwrap()];
        let [a, b] = poses.each_ref().map(|pose| scan.at(pose));
        let plan = CurvePlan::new(&CurveOptions::default(), &scan, &scan).unwrap();
        let mut found = Curves::default();
        Pair::new(a, b).curves(&plan, &mut found, &mut Scratch::default());
        let picture = curve_picture(&a, &b, &found);
        (found, picture)
    }

    #[test]
    fn small_curves_have_a_close_view_and_others_do_not() {
        for (depth, is_close) in [(3.0, true), (18.0, false)] {
            let (found, picture) = cut(depth);
            assert!((found.length() - depth).abs() < 0.7, "{} for {depth}", found.length());
            let (width, _) = picture.size();
            let middle = (GAP + PANEL + GAP / 2) / FINE;
            let pixel = &picture.pixels[3 * (2 * GAP / FINE * width + middle)..][..3];
            assert_eq!(pixel == GROUND, is_close, "{depth}: {pixel:?} between the views");
            let is_curve = |p: &&[u8]| p.iter().zip(CURVE).all(|(&x, y)| x.abs_diff(y) < 30);
            let count = |columns: std::ops::Range<usize>| {
                let rows = picture.pixels.chunks(3 * width).take((GAP + HEIGHT) / FINE);
                rows.flat_map(|row| row[3 * columns.start..3 * columns.end].chunks(3))
                    .filter(is_curve)
                    .count()
            };
            let (left, right) = (count(0..middle), count(middle..width));
            assert!(!is_close || right > 2 * left && left > 30, "{left} and {right} pixels of curve");
        }
    }
}
