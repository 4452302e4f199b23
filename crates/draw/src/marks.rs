//! Marks over a painted view: titles, scale bars, marked places, arrows, frames.

use nearmiss_geometry::nalgebra::Vector3;

use crate::canvas::{Area, Camera, Canvas, Colour, FINE};
use crate::font;

/// The colour of the space about panels, and of what is behind letters.
pub const GROUND: Colour = [255, 255, 255];
/// The colour of a panel on which nothing is painted.
pub const PANEL_GROUND: Colour = [238, 240, 243];
/// The colour of letters and lines.
pub const INK: Colour = [30, 34, 40];

/// Width of the white border on each side of a line, which sets it off from the background.
pub const HALO: f64 = 3.0;

/// Size of letters; see [`Canvas::text`].
const LETTERS: usize = 2 * FINE;

/// Space between letters and the border of their background.
const PAD: usize = 6 * FINE;

/// Distance of titles and scale bars from the border of a panel.
const MARGIN: usize = 8 * FINE;

/// Writes `text` on a background whose upper left corner is at `[left, top]`, moved into `area` if
/// necessary. Returns the area of the background.
pub fn label(canvas: &mut Canvas, area: Area, [left, top]: [f64; 2], text: &str) -> Area {
    let text = font::elided(LETTERS, text, area.width.saturating_sub(2 * PAD));
    let (width, height) = label_size(&text);
    #[expect(
        clippy::cast_precision_loss,
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "pixels within the area"
    )]
    let within = |c: f64, start: usize, length: usize, size: usize| {
        c.clamp(start as f64, (start + length.saturating_sub(size)) as f64) as usize
    };
    let left = within(left, area.left, area.width, width);
    let top = within(top, area.top, area.height, height);
    let ground = Area { left, top, width, height };
    canvas.fill(ground, GROUND);
    canvas.text([left + PAD, top + PAD], LETTERS, INK, &text);
    ground
}

/// Returns the width and height of the background of a [`label`].
#[must_use]
pub fn label_size(text: &str) -> (usize, usize) {
    (Canvas::text_width(LETTERS, text) + 2 * PAD, font::LINE * LETTERS + 2 * PAD)
}

/// Writes the title of a panel into its upper left corner.
pub fn title(canvas: &mut Canvas, area: Area, text: &str) {
    #[expect(clippy::cast_precision_loss, reason = "pixels")]
    let corner = [area.left + MARGIN, area.top + MARGIN].map(|c| c as f64);
    label(canvas, area, corner, text);
}

/// Marks a place by a ring and four lines that point to it.
pub fn mark(canvas: &mut Canvas, camera: &Camera, point: Vector3<f64>, size: f64) {
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

/// Draws an arrow from the point `from` along the vector `along`.
pub fn arrow(canvas: &mut Canvas, camera: &Camera, from: Vector3<f64>, along: Vector3<f64>, colour: Colour) {
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

/// Draws a square around the part that a close view shows, `reach` to every side of `point`.
/// Returns `false` without drawing if the square would be too small to see.
pub fn frame(canvas: &mut Canvas, camera: &Camera, point: Vector3<f64>, reach: f64) -> bool {
    let [x, y, _] = camera.project(point);
    let half = camera.scale * reach;
    if half < 40.0 {
        return false;
    }
    let corners =
        [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[u, v]| [x + half * u, y + half * v]);
    for (width, colour) in [(3.0 + HALO, GROUND), (3.0, INK)] {
        for k in 0..4 {
            canvas.line(camera.area, [corners[k], corners[(k + 1) % 4]], width, colour);
        }
    }
    true
}

/// Draws a scale bar into the lower left corner. Its length is 1, 2 or 5 times a power of ten, and
/// an eighth to a third of the panel's height. `told` says how long it is.
pub fn scale_bar(canvas: &mut Canvas, camera: &Camera, told: impl Fn(f64) -> String) {
    #[expect(clippy::cast_precision_loss, reason = "pixels")]
    let longest = camera.area.height as f64 / 3.0 / camera.scale;
    let power = 10.0_f64.powf(longest.log10().floor());
    let length = [5.0, 2.0, 1.0].into_iter().map(|m| m * power).find(|&l| l <= longest).unwrap_or(power);
    let text = told(length);
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a third of the panel at most"
    )]
    let long = (length * camera.scale) as usize;
    // A background makes the bar readable over anything.
    let Area { left, top, height, .. } = camera.area;
    let wide = Canvas::text_width(LETTERS, &text).max(long) + 2 * PAD;
    let high = font::LINE * LETTERS + 3 * PAD + BAR;
    let ground = Area { left: left + MARGIN, top: top + height - MARGIN - high, width: wide, height: high };
    canvas.fill(ground, GROUND);
    canvas.text([ground.left + PAD, ground.top + PAD], LETTERS, INK, &text);
    #[expect(clippy::cast_precision_loss, reason = "pixels")]
    let [from, to, level] =
        [ground.left + PAD, ground.left + PAD + long, ground.top + high - PAD - BAR / 2].map(|c| c as f64);
    canvas.line(camera.area, [[from, level], [to, level]], 5.0, INK);
    for end in [from, to] {
        canvas.line(camera.area, [[end, level - 10.0], [end, level + 10.0]], 5.0, INK);
    }
}

/// Height of a scale bar.
const BAR: usize = 10 * FINE;
