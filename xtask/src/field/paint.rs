//! The picture: two slices side by side, with a legend.

use nearmiss::PointHierarchy;
use nearmiss_draw::canvas::{Area, Canvas, Colour, FINE};
use nearmiss_draw::picture::Picture;

use super::place::Centre;
use super::slice::{Field, Slice, Value};

/// Side of either slice, in pixels.
pub(crate) const SIDE: usize = 560;

/// Side of either slice, in fine pixels.
const PANEL: usize = SIDE * FINE;
const GAP: usize = 14 * FINE;
const TITLE: usize = 26 * FINE;
const LEGEND: usize = 58 * FINE;

const GROUND: Colour = [255, 255, 255];
const INK: Colour = [30, 34, 40];
const UNDEFINED: Colour = [38, 42, 50];
const ZERO: Colour = [255, 0, 255];
const FLIP: Colour = [255, 222, 0];

/// Colours of f, with f in bandwidths.
const SCALE: [(f64, Colour); 5] = [
    (-1.0, [20, 40, 170]),
    (-0.3, [92, 120, 235]),
    (0.0, [226, 160, 226]),
    (0.3, [238, 104, 98]),
    (1.0, [176, 14, 14]),
];

/// Width of the bands in which f is painted, in bandwidths.
const BAND: f64 = 1.0 / 16.0;

/// Share of the colour that remains where a condition beside f = 0 fails.
const FADED: f64 = 0.55;

/// Half the width of the painted zero set, in pixels.
const ZERO_WIDTH: f64 = 1.5;

/// Greatest distance of painted points from the slice, in sampling radii.
pub(crate) const THICK: f64 = 0.35;

/// The subject of the picture.
pub(crate) struct Subject {
    pub(crate) name: String,
    /// Standard deviation of the noise, in spacings.
    pub(crate) noise: f64,
    /// Length of a stored unit in the caller's units.
    pub(crate) unit: f64,
}

/// Paints both fields over `slice`, about x and about a(x).
pub(crate) fn paint(scan: &PointHierarchy, slice: &Slice, fields: &[Field; 2], subject: &Subject) -> Picture {
    let height = TITLE + PANEL + LEGEND + GAP;
    let mut canvas = Canvas::new(2 * PANEL + 3 * GAP, height, GROUND);
    let h = typical_bandwidth(scan);
    for ((field, centre), left) in fields.iter().zip(Centre::BOTH).zip([GAP, 2 * GAP + PANEL]) {
        let area = Area { left, top: TITLE, width: PANEL, height: PANEL };
        let title = format!("covariance about {}, {} flips", centre.name(), field.flips.len());
        canvas.text([left, 6 * FINE], 2 * FINE, INK, &title);
        fill(&mut canvas, area, field, slice);
        cut(&mut canvas, area, field);
        dots(&mut canvas, area, slice, &slice.points(scan, THICK * scan.sampling_radius() / subject.unit));
        scale_bar(&mut canvas, area, slice, [h, subject.unit]);
    }
    legend(&mut canvas, subject);
    canvas.picture()
}

/// Returns the bandwidth of the point with the median radius.
fn typical_bandwidth(scan: &PointHierarchy) -> f64 {
    let mut radii = scan.radii().to_vec();
    let middle = radii.len() / 2;
    f64::from(scan.plan().bandwidth(*radii.select_nth_unstable_by(middle, f32::total_cmp).1))
}

fn fill(canvas: &mut Canvas, area: Area, field: &Field, slice: &Slice) {
    #[expect(clippy::cast_precision_loss, reason = "pixels")]
    let zero = ZERO_WIDTH * 2.0 * slice.half / SIDE as f64;
    for (i, value) in field.values.iter().enumerate() {
        let colour = value.map_or(UNDEFINED, |value| colour(value, zero));
        let (left, top) = (area.left + i % SIDE * FINE, area.top + i / SIDE * FINE);
        canvas.fill(Area { left, top, width: FINE, height: FINE }, colour);
    }
}

fn colour(value: Value, zero: f64) -> Colour {
    if value.counts && value.f.abs() < zero {
        return ZERO;
    }
    let full = along((value.f / value.bandwidth / BAND).round() * BAND);
    if value.counts { full } else { mix(UNDEFINED, full, FADED) }
}

fn along(share: f64) -> Colour {
    let next = SCALE.iter().position(|(at, _)| share < *at);
    match next {
        Some(0) => SCALE[0].1,
        None => SCALE[SCALE.len() - 1].1,
        Some(i) => {
            let ((low, below), (high, above)) = (SCALE[i - 1], SCALE[i]);
            mix(below, above, (share - low) / (high - low))
        }
    }
}

fn mix(below: Colour, above: Colour, share: f64) -> Colour {
    std::array::from_fn(|k| {
        let mixed = f64::from(below[k]) * (1.0 - share) + f64::from(above[k]) * share;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the cast saturates")]
        let mixed = mixed.round() as u8;
        mixed
    })
}

/// Paints a dashed line between neighbours whose normals point to opposite sides.
fn cut(canvas: &mut Canvas, area: Area, field: &Field) {
    const DASH: usize = 6;
    for pair in &field.flips {
        let [x, y] = [0, 1].map(|axis| {
            let sum: usize = pair.iter().map(|i| if axis == 0 { i % SIDE } else { i / SIDE }).sum();
            sum * FINE / 2 + FINE / 2
        });
        if ((pair[0] % SIDE + pair[0] / SIDE) / DASH).is_multiple_of(2) {
            let place = [coordinate(area.left + x), coordinate(area.top + y)];
            canvas.line(area, [place; 2], 3.2, FLIP);
        }
    }
}

fn dots(canvas: &mut Canvas, area: Area, slice: &Slice, points: &[[f64; 2]]) {
    let scale = coordinate(PANEL) / (2.0 * slice.half);
    for [x, y] in points {
        let place = [
            coordinate(area.left) + (x + slice.half) * scale,
            coordinate(area.top) + (slice.half - y) * scale,
        ];
        canvas.line(area, [place; 2], 8.0, GROUND);
        canvas.line(area, [place; 2], 5.5, [0; 3]);
    }
}

#[expect(clippy::cast_precision_loss, reason = "pixels")]
fn coordinate(pixels: usize) -> f64 {
    pixels as f64
}

/// Paints a length of 1, 2 or 5 times a power of ten, also given in bandwidths.
fn scale_bar(canvas: &mut Canvas, area: Area, slice: &Slice, [h, unit]: [f64; 2]) {
    let longest = 0.7 * slice.half * unit;
    let power = longest.log10().floor();
    let digit = [5.0, 2.0, 1.0].into_iter().find(|d| d * 10.0_f64.powf(power) <= longest).unwrap_or(1.0);
    let length = digit * 10.0_f64.powf(power);
    let text = if (-4.0..4.0).contains(&power) {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 4")]
        let decimals = (-power).max(0.0) as usize;
        format!("{length:.decimals$} = {:.1} h", length / unit / h)
    } else {
        format!("{digit}E{power} = {:.1} h", length / unit / h)
    };
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "less than the panel")]
    let long = (length / unit / (2.0 * slice.half) * coordinate(PANEL)) as usize;
    let wide = long.max(Canvas::text_width(3 * FINE / 2, &text)) + 16 * FINE;
    let ground = Area { left: area.left, top: area.top + PANEL - 42 * FINE, width: wide, height: 42 * FINE };
    canvas.fill(ground, GROUND);
    let [x, y] = [area.left + 8 * FINE, area.top + PANEL - 12 * FINE];
    canvas.text([x, y - 22 * FINE], 3 * FINE / 2, INK, &text);
    let [from, to, level] = [x, x + long, y].map(coordinate);
    canvas.line(area, [[from, level], [to, level]], 5.0, INK);
    for end in [from, to] {
        canvas.line(area, [[end, level - 9.0], [end, level + 9.0]], 5.0, INK);
    }
}

fn legend(canvas: &mut Canvas, subject: &Subject) {
    const LETTERS: usize = 3 * FINE / 2;
    let top = TITLE + PANEL + 10 * FINE;
    let mut left = GAP;
    let bar = 180 * FINE;
    for x in 0..bar {
        let share = 2.0 * coordinate(x) / coordinate(bar) - 1.0;
        let colour = if share.abs() < 0.015 { ZERO } else { along(share) };
        canvas.fill(Area { left: left + x, top, width: 1, height: 16 * FINE }, colour);
    }
    for (share, text) in [(0, "-h"), (bar / 2, "f=0"), (bar, "h")] {
        let half = Canvas::text_width(LETTERS, text) / 2;
        let at = (left + share).saturating_sub(half).max(left).min(left + bar - 2 * half);
        canvas.text([at, top + 20 * FINE], LETTERS, INK, text);
    }
    left += bar + 28 * FINE;
    canvas.text([left, top + 24 * FINE], LETTERS, INK, &about(subject));
    let whole = Area { left: 0, top: 0, width: 2 * PANEL + 3 * GAP, height: top + LEGEND };
    let middle = coordinate(top + 8 * FINE);
    let entries = ["point", "flip: n changes sides", "outside the domain", "too few points reach x"];
    for (i, text) in entries.into_iter().enumerate() {
        let sample = Area { left, top, width: 20 * FINE, height: 16 * FINE };
        let x = coordinate(left);
        match i {
            0 => canvas.line(whole, [[x + 20.0, middle]; 2], 9.0, [0; 3]),
            1 => {
                canvas.fill(sample, along(0.6));
                for dash in [4.0, 26.0] {
                    canvas.line(whole, [[x + dash, middle], [x + dash + 10.0, middle]], 4.0, FLIP);
                }
            }
            2 => {
                let half = Area { width: 10 * FINE, ..sample };
                canvas.fill(half, mix(UNDEFINED, along(-0.5), FADED));
                canvas.fill(Area { left: left + 10 * FINE, ..half }, mix(UNDEFINED, along(0.5), FADED));
            }
            _ => canvas.fill(sample, UNDEFINED),
        }
        canvas.text([left + 26 * FINE, top + 3 * FINE], LETTERS, INK, text);
        left += 26 * FINE + Canvas::text_width(LETTERS, text) + 16 * FINE;
    }
}

fn about(subject: &Subject) -> String {
    let Subject { name, noise, .. } = subject;
    format!("f over a slice of {name}, noise of {:.0} % of the spacing", 100.0 * noise)
}
