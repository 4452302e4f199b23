//! A picture of a sweep: b along its motion with the clearance as colour, and the clearance over
//! time.

use nearmiss::geometry::nalgebra::Vector3;
use nearmiss::{Motion, Moving, Placed, Pose, Prepared, Scan, SweepAnswer, SweepPlan, SweepVerdict};
use nearmiss_draw::canvas::{Area, Camera, Canvas, Colour, FINE, Splat, blend};
use nearmiss_draw::legend;
use nearmiss_draw::marks::{frame, label, mark, title};
use nearmiss_draw::picture::Picture;

use super::swept::Swept;
use crate::digits::short;
use crate::motion_words::time;
use crate::path_plot::ticks;
use crate::picture::{
    GAP, GROUND, HALO, INK, LARGEST, LEGEND, PANEL, PANEL_GROUND, SMALL, Style, dot, half_diagonal,
    paint_sized, sample as sample_of, scale_bar_in, splat,
};

/// The number of intervals at whose ends the clearance is measured.
const SAMPLES: u32 = 160;

/// The side of the picture of the whole of a, if the view shows the motion alone.
const INSET: usize = PANEL / 4;

/// Half the width of the view of a motion that is small beside a, in radii of the motion.
const AROUND: f64 = 1.2;

/// The number of intervals at whose ends b is shown.
const SHOWN: usize = 6;

const OF_A: Colour = [172, 200, 230];

/// Colours of the clearance: at 0, at a third and two thirds of the greatest, and at the greatest.
const CLEARANCE: [Colour; 4] = [[178, 24, 43], [239, 120, 50], [244, 205, 90], [62, 150, 104]];

const PROVEN: Colour = [76, 159, 112];
const UNKNOWN: Colour = [168, 168, 168];
const HIT: Colour = [204, 59, 59];
const GRID: Colour = [214, 217, 222];

/// Size of letters in the plot.
const LETTERS: usize = 2 * FINE;

/// The radius of points in fine pixels, if points are compared.
const POINT: f64 = 2.5;

/// The clearance at one time.
struct Sample {
    time: f64,
    lower: f64,
    upper: f64,
    /// The pose of b's input, with a where it is at the time of the main view.
    pose: Pose,
    /// The centre of b there.
    centre: Vector3<f64>,
}

/// Paints b along its motion as seen from a, and a plot of the clearance beside it. `shown` are the scans,
/// and the points of meshes.
pub(super) fn paint(
    (swept, shown, motions): (&Swept, &[Scan; 2], &[Motion; 2]),
    plan: &SweepPlan,
    answer: &SweepAnswer,
    style: &Style,
) -> Picture {
    let mut canvas = Canvas::new(2 * PANEL + 3 * GAP, PANEL + LEGEND + 2 * GAP, GROUND);
    let key = key_time(answer);
    let moving = [shown[0].along(&motions[0]), shown[1].along(&motions[1])];
    let a = moving[0].at(key);
    let samples = sample(swept, &moving, plan, key);
    let highest =
        samples.iter().map(|sample| sample.upper).filter(|upper| upper.is_finite()).fold(0.0, f64::max);
    let area = Area { left: GAP, top: GAP, width: PANEL, height: PANEL };
    canvas.fill(area, PANEL_GROUND);
    view(&mut canvas, area, (&a, &moving[1]), &samples, (key, highest), (answer, style));
    let area = Area { left: 2 * GAP + PANEL, ..area };
    canvas.fill(area, PANEL_GROUND);
    plot(&mut canvas, area, &samples, highest, plan.options().clearance, answer);
    let [left, top] = [GAP + 4 * FINE, PANEL + 2 * GAP + 4 * FINE];
    let width = 2 * PANEL + GAP - 4 * FINE;
    let far = format!("{} apart", style.unit.length(highest));
    let near = format!("{} apart", style.unit.length(highest / 3.0));
    let entries = [
        (Some(OF_A), style.names[0].as_str()),
        (None, style.names[1].as_str()),
        (None, "coloured by its distance from A:"),
        (Some(CLEARANCE[0]), "0"),
        (Some(CLEARANCE[1]), near.as_str()),
        (Some(CLEARANCE[3]), far.as_str()),
    ];
    legend::entries(&mut canvas, [left, top], width, &entries);
    let ring = nearest(&samples, key, answer).map_or(key, |sample| sample.time);
    legend::sentence(&mut canvas, [left, top + legend::LINE], width, &told(answer, ring));
    canvas.picture()
}

/// The time of the contact, or else of the least distance or of the end of the proof.
fn key_time(answer: &SweepAnswer) -> f64 {
    match answer.verdict {
        SweepVerdict::Free { at, .. } => at,
        SweepVerdict::Impact { t_hit, .. } => t_hit,
        SweepVerdict::Undecided { t_free, .. } => t_free,
    }
}

fn told(answer: &SweepAnswer, ring: f64) -> String {
    match answer.verdict {
        SweepVerdict::Free { clearance, .. } => {
            format!(
                "Proven free: always more than {} apart. The ring marks b where it is nearest, at t = {}.",
                short(clearance),
                time(ring)
            )
        }
        SweepVerdict::Impact { t_free, t_hit, .. } => {
            format!("They meet at the ring, at t = {}. Proven free up to t = {}.", time(t_hit), time(t_free))
        }
        SweepVerdict::Undecided { t_free, .. } => {
            format!("Proven free up to t = {}; undecided after it.", time(t_free))
        }
    }
}

/// Returns the sample that the picture marks: of a free motion the one with the least distance, otherwise
/// the one at the time `key`.
fn nearest<'s>(samples: &'s [Sample], key: f64, answer: &SweepAnswer) -> Option<&'s Sample> {
    let off = |sample: &Sample| {
        if answer.verdict.is_free() { sample.upper } else { (sample.time - key).abs() }
    };
    samples.iter().min_by(|p, q| off(p).total_cmp(&off(q)))
}

/// Measures the clearance at evenly spaced times.
fn sample(swept: &Swept, moving: &[Moving<'_>; 2], plan: &SweepPlan, key: f64) -> Vec<Sample> {
    let [a, b] = moving;
    let duration = a.motion().duration().max(b.motion().duration());
    let count = if duration > 0.0 { SAMPLES } else { 0 };
    let first_b = b.at(0.0);
    let to_key = |time: f64| a.motion().at(key).after(&a.motion().at(time).inverse());
    let times: Vec<f64> = (0..=count).map(|i| duration * f64::from(i) / f64::from(count.max(1))).collect();
    let poses: Vec<[Pose; 2]> =
        times.iter().map(|&time| [a, b].map(|moving| moving.motion().at(time))).collect();
    let distances = swept.distances(&poses, plan);
    times
        .into_iter()
        .zip(distances)
        .map(|(time, [lower, upper])| {
            let pose = to_key(time).after(&b.motion().at(time));
            let placed = Placed::new(first_b.scan(), &pose);
            let centre = placed.stored_to_world().apply(first_b.scan().outline().discs.centre);
            Sample { time, lower, upper, pose, centre: centre.into() }
        })
        .collect()
}

/// Returns the colour of a clearance as a share of the greatest one.
fn colour(share: f64) -> Colour {
    let place = 3.0 * if share.is_finite() { share.clamp(0.0, 1.0) } else { 1.0 };
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 2")]
    let step = (place as usize).min(2);
    #[expect(clippy::cast_precision_loss, reason = "0 to 2")]
    let within = place - step as f64;
    blend(CLEARANCE[step], CLEARANCE[step + 1], within)
}

/// Paints a, b at several times, and the way of its centre.
fn view(
    canvas: &mut Canvas,
    area: Area,
    (a, b): (&Placed<'_>, &Moving<'_>),
    samples: &[Sample],
    (key, highest): (f64, f64),
    (answer, style): (&SweepAnswer, &Style),
) {
    let Some(nearest) = nearest(samples, key, answer) else { return };
    let scan = b.at(0.0).scan();
    let at_key = Placed::new(scan, &nearest.pose);
    // After an impact b is inside a.
    let last = if answer.verdict.is_impact() { key } else { f64::INFINITY };
    let count = samples.iter().take_while(|sample| sample.time <= last).count();
    let evenly = (0..=SHOWN).filter_map(|i| samples.get(i * count.saturating_sub(1) / SHOWN));
    let shown: Vec<&Sample> = evenly.chain([nearest]).collect();
    let corners = |sample: &&Sample| scan.bounds().corners().map(|corner| sample.pose.apply(corner).into());
    let places: Vec<Vector3<f64>> = shown.iter().flat_map(corners).collect();
    let way = Way::new(&places);
    let sizes = [half_diagonal(a), way.radius];
    let is_small = way.radius < SMALL * sizes[0];
    let camera = if is_small {
        let points = sample_of([a, &at_key]);
        let hides = |toward: &Vector3<f64>| {
            let front = way.front(toward);
            let kept: Vec<_> = points.iter().filter(|p| toward.dot(p) <= front).copied().collect();
            hidden(&kept, &shown, *toward)
        };
        style.view.close_camera([a, &at_key], area, (way.centre, AROUND * way.radius), hides)
    } else {
        let hides = |points: &[Vector3<f64>], toward: &Vector3<f64>| hidden(points, &shown, *toward);
        style.view.camera([a, &at_key], area, &places, hides)
    };
    let toward = camera.axes[2];
    let front = if is_small { way.front(&toward) } else { f64::INFINITY };
    paint_sized(canvas, area, sizes, |canvas, side| {
        if side == 0 {
            paint_scan(canvas, &camera, a, (OF_A, |p| toward.dot(&p) <= front), style);
            return;
        }
        for sample in &shown {
            let placed = Placed::new(scan, &sample.pose);
            paint_scan(canvas, &camera, &placed, (colour(sample.upper / highest), |_| true), style);
        }
    });
    let place = |sample: &Sample| {
        let [x, y, _] = camera.project(sample.centre);
        [x, y]
    };
    for (width, tint) in [(5.0 + 2.0 * HALO, Some(GROUND)), (5.0, None)] {
        for pair in samples.windows(2) {
            let own = colour(0.5 * (pair[0].upper + pair[1].upper) / highest);
            canvas.line(area, [place(&pair[0]), place(&pair[1])], width, tint.unwrap_or(own));
        }
    }
    if let SweepVerdict::Impact { contact, .. } = answer.verdict {
        mark(canvas, &camera, contact.point.into(), 1.0);
    } else if answer.verdict.is_free() {
        mark(canvas, &camera, nearest.centre, 1.0);
    }
    scale_bar_in(canvas, &camera, style.unit);
    if is_small {
        title(canvas, area, "The motion of b as seen from a; what is in front of it is cut away");
        inset(canvas, area, (a, &at_key), &way, style);
    } else {
        title(canvas, area, "The motion of b as seen from a");
    }
}

/// Paints the whole of a in a corner of the view, and frames the motion.
fn inset(canvas: &mut Canvas, area: Area, (a, b): (&Placed<'_>, &Placed<'_>), way: &Way, style: &Style) {
    let area = Area {
        left: area.left + area.width - INSET - GAP,
        top: area.top + area.height - INSET - GAP,
        width: INSET,
        height: INSET,
    };
    let border = Area {
        left: area.left - FINE,
        top: area.top - FINE,
        width: INSET + 2 * FINE,
        height: INSET + 2 * FINE,
    };
    canvas.fill(border, INK);
    canvas.fill(area, PANEL_GROUND);
    let camera = style.view.camera([a, b], area, &[], |_, _| 0.0);
    paint_scan(canvas, &camera, a, (OF_A, |_| true), style);
    if !frame(canvas, &camera, way.centre, AROUND * way.radius) {
        mark(canvas, &camera, way.centre, 1.0);
    }
}

/// The space that the motion of b needs.
struct Way {
    places: Vec<Vector3<f64>>,
    centre: Vector3<f64>,
    /// Half the diagonal of the box about the places.
    radius: f64,
}

impl Way {
    fn new(places: &[Vector3<f64>]) -> Self {
        let mut corners = [Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY)];
        for place in places {
            corners = [corners[0].inf(place), corners[1].sup(place)];
        }
        let [low, high] = corners;
        Self { places: places.to_vec(), centre: 0.5 * (low + high), radius: 0.5 * (high - low).norm() }
    }

    /// Returns the coordinate in the direction `toward` beyond which points are in front of all places.
    fn front(&self, toward: &Vector3<f64>) -> f64 {
        self.places.iter().map(|place| toward.dot(place)).fold(f64::NEG_INFINITY, f64::max)
    }
}

/// Paints the points of a scan for which `is_shown` is `true`.
fn paint_scan(
    canvas: &mut Canvas,
    camera: &Camera,
    view: &Placed<'_>,
    (colour, is_shown): (Colour, impl Fn(Vector3<f64>) -> bool),
    style: &Style,
) {
    for i in (0..view.scan().len()).filter(|&i| is_shown(view.point(i).into())) {
        let disc = splat(view, i);
        let disc = Splat { radius: disc.radius.min(LARGEST / camera.scale), ..disc };
        canvas.splat(camera, &if style.points { dot(&disc, camera, POINT) } else { disc }, colour);
    }
}

/// Estimates how much of the way is hidden by points, seen from `toward`: 0 to about 1.
fn hidden(points: &[Vector3<f64>], shown: &[&Sample], toward: Vector3<f64>) -> f64 {
    let length: f64 = shown.windows(2).map(|pair| (pair[1].centre - pair[0].centre).norm()).sum();
    let near = (0.02 * length).max(f64::MIN_POSITIVE);
    #[expect(clippy::cast_precision_loss, reason = "counts")]
    let share = |sample: &&Sample| {
        let before = points.iter().filter(|p| {
            let offset = *p - sample.centre;
            let depth = toward.dot(&offset);
            depth > near && (offset - toward * depth).norm() < near
        });
        let count = before.count() as f64;
        count / (count + 4.0)
    };
    #[expect(clippy::cast_precision_loss, reason = "a count")]
    let count = shown.len().max(1) as f64;
    4.0 * shown.iter().map(share).sum::<f64>() / count
}

/// The axes of the plot.
struct Axes {
    /// The left, right, top and bottom of the plot, in fine pixels.
    frame: [f64; 4],
    duration: f64,
    /// The length at the top.
    top: f64,
}

impl Axes {
    fn x(&self, time: f64) -> f64 {
        let [left, right, ..] = self.frame;
        left + (right - left) * if self.duration > 0.0 { time / self.duration } else { 0.5 }
    }

    fn y(&self, length: f64) -> f64 {
        let [_, _, top, bottom] = self.frame;
        bottom - (bottom - top) * (length / self.top).clamp(0.0, 1.0)
    }
}

/// Plots both bounds of the clearance over time, the wanted clearance, and what is proven.
fn plot(
    canvas: &mut Canvas,
    area: Area,
    samples: &[Sample],
    highest: f64,
    wanted: f64,
    answer: &SweepAnswer,
) {
    let (step, count) = ticks(highest.max(wanted));
    #[expect(clippy::cast_precision_loss, reason = "pixels")]
    let [left, top, width, height] = [area.left, area.top, area.width, area.height].map(|c| c as f64);
    let fine = f64::from(u32::try_from(FINE).unwrap_or(1));
    let frame =
        [left + 80.0 * fine, left + width - 30.0 * fine, top + 50.0 * fine, top + height - 90.0 * fine];
    let duration = samples.last().map_or(0.0, |last| last.time);
    let axes = Axes { frame, duration, top: step * f64::from(count) };
    for tick in 0..=count {
        let length = step * f64::from(tick);
        let level = axes.y(length);
        canvas.line(area, [[frame[0], level], [frame[1], level]], 2.0, GRID);
        write(canvas, [frame[0] - 10.0 * fine, level], 1.0, &short(length));
    }
    for (time_at, share) in [(0.0, 0.0), (duration, 1.0)] {
        write(canvas, [axes.x(time_at), frame[3] + 46.0 * fine], share, &format!("t = {}", time(time_at)));
    }
    for (bound, width, colour_of_line) in [(0, 3.0, Some(INK)), (1, 7.0, None)] {
        for pair in samples.windows(2) {
            let value = |sample: &Sample| [sample.lower, sample.upper][bound];
            let ends = [&pair[0], &pair[1]].map(|sample| [axes.x(sample.time), axes.y(value(sample))]);
            let own = colour(0.5 * (pair[0].upper + pair[1].upper) / highest);
            canvas.line(area, ends, width, colour_of_line.unwrap_or(own));
        }
    }
    if wanted > 0.0 {
        canvas.line(area, [[frame[0], axes.y(wanted)], [frame[1], axes.y(wanted)]], 3.0, HIT);
    }
    let (free, hit) = match answer.verdict {
        SweepVerdict::Free { .. } => (duration, None),
        SweepVerdict::Impact { t_free, t_hit, .. } => (t_free, Some(t_hit)),
        SweepVerdict::Undecided { t_free, .. } => (t_free, None),
    };
    let strip = frame[3] + 18.0 * fine;
    for (from, to, colour) in [(free, duration, UNKNOWN), (0.0, free, PROVEN)] {
        if to > from || duration == 0.0 {
            canvas.line(area, [[axes.x(from), strip], [axes.x(to), strip]], 14.0 * fine, colour);
        }
    }
    if let Some(hit) = hit {
        canvas.line(area, [[axes.x(hit), frame[2]], [axes.x(hit), strip + 8.0 * fine]], 3.0, HIT);
        label(canvas, area, [axes.x(hit) + 6.0 * fine, frame[2]], &format!("impact at t = {}", time(hit)));
    }
    title(canvas, area, "Distance over t. Upper line: measured. Thin line and green strip: proven.");
}

/// Writes text beside a place: to the right of it for `share` 0, to the left for 1.
fn write(canvas: &mut Canvas, [x, y]: [f64; 2], share: f64, text: &str) {
    #[expect(clippy::cast_precision_loss, reason = "pixels")]
    let left = x - share * Canvas::text_width(LETTERS, text) as f64;
    #[expect(clippy::cast_precision_loss, reason = "pixels")]
    let top = y - 3.5 * LETTERS as f64;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "pixels; the cast saturates")]
    let corner = [left, top].map(|c| c as usize);
    canvas.text(corner, LETTERS, INK, text);
}
