//! Pictures of two scans, their nearest places and the segment between these.

use nearmiss::geometry::nalgebra::Vector3;
use nearmiss::{Distance, Evidence, Placed};
use nearmiss_draw::canvas::{Area, Camera, Canvas, FINE};
use nearmiss_draw::marks::{frame, label, label_size, mark, title};
use nearmiss_draw::picture::Picture;

use crate::picture::{
    GAP, GROUND, HALO, INK, LARGEST, LEGEND, OF_A, OF_B, PANEL, PANEL_GROUND, Style, across, directions, dot,
    legend, obstacle, paint_both, sample, scale_bar_in, splat,
};
use crate::sentence::{bracket, unit};
use crate::viewpoint::{Upright, scale_of};

/// Half width of the close view: the greater of `OF_LENGTH` segment lengths and `OF_BAND` bands.
const OF_LENGTH: f64 = 0.8;
const OF_BAND: f64 = 5.0;

/// Tangent of the angle by which the close view is turned towards the first scan. These 15 degrees
/// shorten the segment by 4 %.
const TILT: f64 = 0.27;

/// Radii of points in fine pixels, and of the ends of the segment.
const WHOLE_DOT: f64 = 2.5;
const CLOSE_DOT: f64 = 7.0;
const END: f64 = 9.0;

/// Paints both scans in the world, and beside them a close view across the segment between the
/// nearest places. The part in front of the segment is cut away.
pub(crate) fn paint_distance(views: [&Placed<'_>; 2], found: &Distance, style: &Style) -> Picture {
    let told = if found.upper > 0.0 {
        let apart = bracket(found, unit(views));
        format!("They are {apart}{}. The line joins the nearest points.", style.unit.aside())
    } else {
        "They touch at the marked point.".to_owned()
    };
    let told = if style.points || found.lower > 0.0 {
        told
    } else {
        format!("{told} Gaps below {} cannot be distinguished from contact.", style.unit.length(found.band))
    };
    paint_told(views, found, &told, style)
}

/// Paints the same picture for two scans that `collide` found separated.
pub(crate) fn paint_apart(
    views: [&Placed<'_>; 2],
    found: &Distance,
    evidence: Evidence,
    style: &Style,
) -> Picture {
    let sure = if evidence == Evidence::Certified { "certified" } else { "estimated" };
    let told = format!(
        "They do not touch ({sure}): {}{}. The line joins the nearest points.",
        bracket(found, unit(views)),
        style.unit.aside()
    );
    paint_told(views, found, &told, style)
}

fn paint_told(views: [&Placed<'_>; 2], found: &Distance, told: &str, style: &Style) -> Picture {
    let mut canvas = Canvas::new(2 * PANEL + 3 * GAP, PANEL + LEGEND + 2 * GAP, GROUND);
    let segment = Segment::new(found, style);
    let area = Area { left: GAP, top: GAP, width: PANEL, height: PANEL };
    canvas.fill(area, PANEL_GROUND);
    let whole = segment.whole(views, area, style);
    let look = Look { points: style.points, largest: LARGEST, dot: WHOLE_DOT };
    segment.paint(&mut canvas, &whole, views, &look, |_| true);
    let is_framed = frame(&mut canvas, &whole, segment.middle(), segment.reach);
    let ends = segment.mark(&mut canvas, &whole);
    if !is_framed {
        mark(&mut canvas, &whole, segment.middle(), 1.0);
    }
    segment.label(&mut canvas, area, ends);
    scale_bar_in(&mut canvas, &whole, style.unit);

    let area = Area { left: 2 * GAP + PANEL, ..area };
    canvas.fill(area, PANEL_GROUND);
    let (close, cut) = segment.camera(&sample(views), area, style.view.upright(views));
    let is_behind = |p: Vector3<f64>| {
        let offset = p - segment.middle();
        cut.dot(&offset) <= 0.5 * segment.band && offset.norm() < 1.5 * segment.reach
    };
    let look = Look { largest: f64::INFINITY, dot: CLOSE_DOT, ..look };
    segment.paint(&mut canvas, &close, views, &look, is_behind);
    let ends = segment.mark(&mut canvas, &close);
    segment.label(&mut canvas, area, ends);
    title(&mut canvas, area, "Close view");
    scale_bar_in(&mut canvas, &close, style.unit);
    legend(&mut canvas, told, &style.names);
    canvas.picture()
}

/// The style of the points in a view.
struct Look {
    /// `true` to show points instead of obstacles.
    points: bool,
    /// The greatest radius of a disc or ball, in fine pixels.
    largest: f64,
    /// The radius of points, in fine pixels.
    dot: f64,
}

/// The segment between the nearest places.
struct Segment {
    ends: [Vector3<f64>; 2],
    band: f64,
    /// Half the width of the close view.
    reach: f64,
    label: String,
}

impl Segment {
    fn new(found: &Distance, style: &Style) -> Self {
        let ends = found.points.map(Vector3::from);
        let length = (ends[1] - ends[0]).norm();
        let band = if found.band.is_finite() { found.band } else { length };
        let reach = (OF_LENGTH * length).max(OF_BAND * band).max(f64::MIN_POSITIVE);
        Self { ends, band, reach, label: style.unit.length(found.upper) }
    }

    fn middle(&self) -> Vector3<f64> {
        0.5 * (self.ends[0] + self.ends[1])
    }

    /// Returns a camera that shows both scans and the segment.
    fn whole(&self, views: [&Placed<'_>; 2], area: Area, style: &Style) -> Camera {
        let hides = |points: &[Vector3<f64>], toward: &Vector3<f64>| 4.0 * self.hidden(points, *toward);
        style.view.camera(views, area, &self.ends, hides)
    }

    /// Estimates how much of the segment is hidden, seen from `toward`: 0 to about 1.
    fn hidden(&self, points: &[Vector3<f64>], toward: Vector3<f64>) -> f64 {
        let before = points.iter().filter(|p| {
            let offset = *p - self.middle();
            let depth = toward.dot(&offset);
            depth > self.band && (offset - toward * depth).norm() < 0.5 * self.reach
        });
        #[expect(clippy::cast_precision_loss, reason = "a count")]
        let count = before.count() as f64;
        count / (count + 4.0)
    }

    /// Returns a camera that looks obliquely across the segment with little in front of it, so that
    /// a surface perpendicular to the segment is not seen edge-on. Also returns the direction,
    /// perpendicular to the segment, in which everything in front is cut away. The segment is level
    /// in the picture unless the picture is upright.
    fn camera(
        &self,
        points: &[Vector3<f64>],
        area: Area,
        upright: Option<Upright>,
    ) -> (Camera, Vector3<f64>) {
        let along = self.ends[1] - self.ends[0];
        let along = along.try_normalize(0.0).unwrap_or_else(Vector3::x);
        let turned = |d: Vector3<f64>| (d - along * along.dot(&d)).try_normalize(0.1);
        let about_up = upright.map_or_else(|| Vector3::new(0.0, 0.7, 0.7), |upright| upright.up());
        let cost = |toward: &Vector3<f64>| {
            let rise = toward.dot(&about_up);
            // Walls are seen edge-on from above.
            let steep = if upright.is_some() { (rise - 0.7).max(0.0) } else { 0.0 };
            self.hidden(points, *toward) + 0.3 * (-rise).max(0.0) + steep
        };
        let toward = directions().filter_map(turned).min_by(|p, q| cost(p).total_cmp(&cost(q)));
        let cut = toward.unwrap_or_else(|| across(along));
        let from_above = if upright.is_some() && along.dot(&about_up) < 0.0 { -1.0 } else { 1.0 };
        let toward = (cut + from_above * TILT * along).normalize();
        let axes = upright.map_or_else(
            || {
                let along = (along - toward * toward.dot(&along)).normalize();
                let up = toward.cross(&along);
                if up.y + up.z < 0.0 { [-along, -up, toward] } else { [along, up, toward] }
            },
            |upright| upright.axes_towards(toward),
        );
        (Camera { axes, centre: self.middle(), scale: scale_of(area, self.reach), area }, cut)
    }

    /// Paints the points of both scans for which `shown` is `true`.
    fn paint(
        &self,
        canvas: &mut Canvas,
        camera: &Camera,
        views: [&Placed<'_>; 2],
        look: &Look,
        shown: impl Fn(Vector3<f64>) -> bool,
    ) {
        paint_both(canvas, camera.area, views, |canvas, side| {
            let (view, colour) = (views[side], [OF_A, OF_B][side]);
            for i in (0..view.scan().len()).filter(|&i| shown(view.point(i).into())) {
                if look.points {
                    canvas.splat(camera, &dot(&splat(view, i), camera, look.dot), colour);
                } else {
                    obstacle(canvas, camera, view, i, colour, look.largest);
                }
            }
        });
    }

    /// Draws the segment over everything, even if it is hidden, and returns its ends.
    fn mark(&self, canvas: &mut Canvas, camera: &Camera) -> [[f64; 2]; 2] {
        let ends = self.ends.map(|p| camera.project(p)).map(|[x, y, _]| [x, y]);
        for (width, colour) in [(5.0 + 2.0 * HALO, GROUND), (5.0, INK)] {
            canvas.line(camera.area, ends, width, colour);
        }
        for (end, colour) in ends.into_iter().zip([OF_A, OF_B]) {
            canvas.line(camera.area, [end; 2], 2.0 * END + 2.0 * HALO, INK);
            canvas.line(camera.area, [end; 2], 2.0 * END, colour);
        }
        ends
    }

    /// Writes the length beside the middle of the segment.
    fn label(&self, canvas: &mut Canvas, area: Area, ends: [[f64; 2]; 2]) {
        const AWAY: f64 = 18.0 * FINE as f64;
        let [dx, dy] = [0, 1].map(|k| (ends[1][k] - ends[0][k]).abs());
        let middle = [0, 1].map(|k| 0.5 * (ends[0][k] + ends[1][k]));
        let (width, height) = label_size(&self.label);
        #[expect(clippy::cast_precision_loss, reason = "pixels")]
        let half = [0.5 * width as f64, 0.5 * height as f64];
        // Below a level segment, to the right of a steep one.
        let corner = if dx >= dy {
            [middle[0] - half[0], middle[1] + AWAY]
        } else {
            [middle[0] + AWAY, middle[1] - half[1]]
        };
        label(canvas, area, corner, &self.label);
    }
}

#[cfg(test)]
mod tests {
    use nearmiss::{BuildOptions, DistanceOptions, DistancePlan, Pair, PointCloud, Pose, Scan, Scratch};

    use super::*;
    use crate::viewpoint::ViewArgs;

    /// Returns a square plate in the plane of x and y, and the same plate scaled by `size` and
    /// raised by `height`.
    fn plates(height: f64, size: f64) -> (Scan, [Pose; 2]) {
        let points: Vec<[f64; 3]> =
            (0..40_u32).flat_map(|i| (0..40).map(move |j| [i, j, 0].map(f64::from))).collect();
        let scan =
            Scan::build(&PointCloud::from_positions(&points).unwrap(), &BuildOptions::default()).unwrap();
        let at = 0.5 * 39.0 * (1.0 - size);
        let above = [size, 0.0, 0.0, at, 0.0, size, 0.0, at, 0.0, 0.0, size, height, 0.0, 0.0, 0.0, 1.0];
        let above = Pose::from_row_major(&above, scan.bounds(), 0.1).unwrap();
        (scan, [Pose::IDENTITY, above])
    }

    fn found(views: [&Placed<'_>; 2]) -> Distance {
        let plan = DistancePlan::new(&DistanceOptions::default(), views[0].scan(), views[1].scan()).unwrap();
        Pair::new(*views[0], *views[1]).distance(&plan, &mut Scratch::default())
    }

    #[test]
    fn hidden_places_are_in_the_picture_and_marked() {
        let (scan, poses) = plates(3.0, 0.2);
        let [a, b] = poses.each_ref().map(|pose| scan.at(pose));
        let found = found([&a, &b]);
        // From below: the large plate hides the small one behind it.
        let view = ViewArgs { up: None, view: Some("30,-70".parse().unwrap()) };
        let style = Style { names: ["A", "B"].map(Into::into), view, ..Style::default() };
        let picture = paint_distance([&a, &b], &found, &style);
        let segment = Segment::new(&found, &style);
        let area = Area { left: GAP, top: GAP, width: PANEL, height: PANEL };
        let camera = segment.whole([&a, &b], area, &style);
        let [x, y, near] = camera.project(segment.ends[1]);
        let hides = |i: usize| {
            let [u, v, nearer] = camera.project(a.point(i).into());
            (u - x).hypot(v - y) < 40.0 && nearer > near
        };
        assert!((0..scan.len()).any(hides), "hidden");
        for (end, colour) in segment.ends.into_iter().zip([OF_A, OF_B]) {
            let [x, y, _] = camera.project(end);
            let fine = f64::from(u32::try_from(FINE).unwrap());
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "pixels")]
            let [column, row] = [x, y].map(|c| (c / fine) as usize);
            assert!((GAP / FINE..(GAP + PANEL) / FINE).contains(&column), "{column}");
            let pixel = &picture.pixels[3 * (row * picture.size().0 + column)..][..3];
            assert_eq!(pixel, colour, "at {column}, {row}");
        }
    }

    #[test]
    fn the_segment_is_seen_in_both_panels() {
        let (scan, poses) = plates(9.0, 1.0);
        let [a, b] = poses.each_ref().map(|pose| scan.at(pose));
        let found = found([&a, &b]);
        assert!((found.upper - 9.0).abs() < 1e-6, "{found:?}");
        let style = Style { names: ["A", "B"].map(Into::into), ..Style::default() };
        let picture = paint_distance([&a, &b], &found, &style);
        let is_ink = |p: &[u8]| p.iter().zip(INK).all(|(x, y)| x.abs_diff(y) < 8);
        let width = picture.size().0;
        for half in [0, width / 2] {
            let rows = picture.pixels.chunks(3 * width);
            let count: usize = rows
                .take(PANEL / FINE)
                .map(|r| r[3 * half..][..3 * (width / 2)].chunks(3).filter(|p| is_ink(p)).count())
                .sum();
            assert!(count > 300, "{count} pixels of ink");
        }
    }
}
