//! Views of storeys from above, with the kinds of pixels for an avatar, marks and names; and the
//! sheet that holds the views.

use nearmiss::geometry::nalgebra::Vector3;
use nearmiss::slices::{Avatar, AvatarOptions, SliceMap};
use nearmiss_draw::canvas::{Area, Camera, Canvas, Colour, FINE};
use nearmiss_draw::picture::Picture;

use super::labels::Labels;
use crate::picture::scale_bar;

/// Sizes in fine pixels: the longer side of a single view and of one of several; the least width;
/// margins, letters and lines of text.
const ALONE: f64 = 900.0 * FINE as f64;
const ONE_OF_MANY: f64 = 560.0 * FINE as f64;
const LEAST_WIDTH: usize = 560 * FINE;
pub(super) const GAP: usize = 12 * FINE;
pub(super) const LETTER: usize = 2 * FINE;
pub(super) const SMALL: usize = 3 * FINE / 2;
pub(super) const LINE: usize = 22 * FINE;

/// Wanted ratio of width to height of all views together.
const SHAPE: f64 = 1.3;

const GROUND: Colour = [255, 255, 255];
pub(super) const EMPTY: Colour = [238, 240, 243];
pub(super) const FLOOR: Colour = [188, 214, 190];
pub(super) const STEP: Colour = [214, 180, 120];
pub(super) const IN_THE_WAY: Colour = [70, 74, 82];
pub(super) const AIM: Colour = [40, 90, 200];
pub(super) const STOP: Colour = [150, 20, 150];
pub(super) const INK: Colour = [30, 34, 40];

/// Margin around places: a multiple of the avatar's height plus a share of their extent.
const AROUND: f64 = 1.5;
const MORE: f64 = 0.1;

/// Greatest number of places that a pixel is compared with.
const SAMPLE: usize = 150;

/// The part of a map that is shown: its least and its greatest corner.
pub(super) type Window = [[f64; 2]; 2];

/// Returns the window around at least one place: with a margin inside the map, and all places even
/// if they are off the map.
pub(super) fn window(
    map: &SliceMap,
    avatar: &Avatar,
    places: impl Iterator<Item = [f64; 2]> + Clone,
) -> Window {
    let grid = map.grid();
    let end = |k: usize, fold: fn(f64, f64) -> f64, from: f64| places.clone().map(|p| p[k]).fold(from, fold);
    let low = [0, 1].map(|k| end(k, f64::min, f64::INFINITY));
    let high = [0, 1].map(|k| end(k, f64::max, f64::NEG_INFINITY));
    let extent = (high[0] - low[0]).max(high[1] - low[1]);
    let margin = AROUND * avatar.options().height + MORE * extent;
    let end = |k: usize| grid.origin[k] + f64::from(grid.counts[k]) * grid.pixel;
    // Places off the map get enough margin for names and the scale.
    let off = 0.5 * margin;
    [
        [0, 1].map(|k| (low[k] - margin).max(grid.origin[k].min(low[k] - off))),
        [0, 1].map(|k| (high[k] + margin).min(end(k).max(high[k] + off))),
    ]
}

/// Views of storeys side by side, with a caption above and a legend below.
pub(super) struct Sheet<'a> {
    pub(super) canvas: Canvas,
    views: Vec<View<'a>>,
    /// Width, and top of the part below the views.
    pub(super) full: usize,
    pub(super) below: usize,
}

impl<'a> Sheet<'a> {
    /// Creates a sheet with a view for each title, and `space` rows between the views and the
    /// legend.
    pub(super) fn new(
        (map, avatar): (&'a SliceMap, &'a Avatar),
        window: Window,
        (told, titles): (&str, &[String]),
        entries: &[(Colour, &str)],
        space: usize,
    ) -> Self {
        // A window far off the map may have no extent.
        let size = [0, 1].map(|k| (window[1][k] - window[0][k]).max(map.grid().pixel));
        let side = if titles.len() == 1 { ALONE } else { ONE_OF_MANY };
        let scale = side / size[0].max(size[1]);
        let [width, height] = size.map(|length| whole(length * scale).max(FINE));
        let columns = columns(titles.len(), [width, height + LINE]);
        let widest = titles.iter().map(|title| Canvas::text_width(LETTER, title)).max().unwrap_or(0);
        let text = Canvas::text_width(SMALL, told).max(widest) + 2 * GAP;
        let full = (columns * (width + GAP) + GAP).max(LEAST_WIDTH).max(text);
        let top = |row: usize| GAP + LINE + row * (LINE + height + GAP);
        let below = top(titles.len().div_ceil(columns));
        let legend = below + space;
        let mut canvas = Canvas::new(full, legend + rows(entries, full) * LINE + GAP, GROUND);
        canvas.text([GAP, GAP], SMALL, INK, told);
        draw_legend(&mut canvas, entries, [legend, full]);
        let area = |i: usize| Area {
            left: GAP + i % columns * (width + GAP),
            top: top(i / columns) + LINE,
            width,
            height,
        };
        let views: Vec<View<'_>> =
            (0..titles.len()).map(|i| View { map, avatar, window, scale, area: area(i) }).collect();
        for (view, title) in views.iter().zip(titles) {
            canvas.text([view.area.left, view.area.top - LINE + 4 * FINE], LETTER, INK, title);
            canvas.fill(view.area, EMPTY);
        }
        Self { canvas, views, full, below }
    }

    /// Returns the view of the `i`-th title.
    pub(super) fn view(&self, i: usize) -> View<'a> {
        self.views[i]
    }

    /// Returns the picture.
    pub(super) fn picture(mut self) -> Picture {
        if let Some(view) = self.views.first() {
            scale_bar(&mut self.canvas, &view.camera());
        }
        self.canvas.picture()
    }
}

/// A view of one storey.
#[derive(Clone, Copy)]
pub(super) struct View<'a> {
    map: &'a SliceMap,
    avatar: &'a Avatar,
    window: Window,
    /// Fine pixels in a unit of length.
    scale: f64,
    pub(super) area: Area,
}

impl View<'_> {
    fn camera(&self) -> Camera {
        let [low, high] = self.window;
        let centre = Vector3::new(0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1]), 0.0);
        Camera {
            axes: [Vector3::x(), Vector3::y(), Vector3::z()],
            centre,
            scale: self.scale,
            area: self.area,
        }
    }

    pub(super) fn at(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [x, y, _] = self.camera().project(Vector3::new(x, y, 0.0));
        [x, y]
    }

    /// Fills a square of the world around a place.
    pub(super) fn square(&self, canvas: &mut Canvas, [x, y]: [f64; 2], side: f64, colour: Colour) {
        let half = 0.5 * side;
        self.fill(canvas, [[x - half, y - half], [x + half, y + half]], colour);
    }

    /// Fills a rectangle of the world, at least one fine pixel.
    fn fill(&self, canvas: &mut Canvas, [low, high]: Window, colour: Colour) {
        let [x0, y0] = self.at([low[0], high[1]]);
        let [x1, y1] = self.at([high[0], low[1]]);
        let inside = |x: f64, from: usize, size: usize| whole(x.max(0.0)).clamp(from, from + size);
        let [left, right] = [x0, x1].map(|x| inside(x, self.area.left, self.area.width));
        let [top, bottom] = [y0, y1].map(|y| inside(y, self.area.top, self.area.height));
        // If several pixels share a fine one, the last is visible.
        let (width, height) = ((right - left).max(1), (bottom - top).max(1));
        canvas.fill(Area { left, top, width, height }, colour);
    }

    /// Draws a cross where the avatar was stopped.
    pub(super) fn cross(&self, canvas: &mut Canvas, place: [f64; 2]) {
        cross(canvas, self.area, self.at(place));
    }

    /// Draws a ring at a goal, with a name.
    pub(super) fn goal(&self, canvas: &mut Canvas, labels: &mut Labels, place: [f64; 2], name: &str) {
        let [x, y] = self.at(place);
        canvas.ring(self.area, [x, y], 9.0, 3.0, AIM);
        self.label(canvas, labels, [x + 14.0, y - 24.0], name);
    }

    /// Draws the avatar's base at a place, with a name.
    pub(super) fn base(&self, canvas: &mut Canvas, labels: &mut Labels, place: [f64; 2], name: &str) {
        let half = self.map.grid().up.across(self.avatar.options().base).map(|side| 0.5 * side);
        let corner = |s: f64, t: f64| self.at([place[0] + s * half[0], place[1] + t * half[1]]);
        let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        for i in 0..4 {
            canvas.line(self.area, [corners[i], corners[(i + 1) % 4]], 3.0, AIM);
        }
        let [x, y] = corners[2];
        self.label(canvas, labels, [x + 4.0, y - 20.0], name);
    }

    /// Draws a label within the view, on a background of its own, unless it would cover another
    /// label.
    fn label(&self, canvas: &mut Canvas, labels: &mut Labels, [x, y]: [f64; 2], text: &str) {
        let Area { left, top, width, height } = self.area;
        let long = Canvas::text_width(SMALL, text);
        let place = |x: f64, least: usize, most: usize| whole(x.max(0.0)).clamp(least, most.max(least));
        let x = place(x, left, (left + width).saturating_sub(long + SMALL));
        let y = place(y, top, (top + height).saturating_sub(9 * SMALL));
        let ground = Area {
            left: x.saturating_sub(SMALL),
            top: y.saturating_sub(SMALL),
            width: long + SMALL,
            height: 9 * SMALL,
        };
        if labels.has_room(ground) {
            canvas.fill(ground, GROUND);
            canvas.text([x, y], SMALL, AIM, text);
        }
    }

    /// Colours each pixel by its kind for an avatar at the nearest of these places.
    pub(super) fn ground(&self, canvas: &mut Canvas, places: &[[f64; 3]]) {
        let here: Vec<[f64; 3]> =
            places.iter().copied().step_by(places.len().div_ceil(SAMPLE).max(1)).collect();
        let grid = self.map.grid();
        let [low, high] = self.window;
        let ranges = [0, 1].map(|k| grid.range(k, [low[k], high[k]]));
        let [Some(columns), Some(rows)] = ranges else { return };
        // If pixels are finer than a fine one, only one of several neighbours is drawn.
        let stride = whole((1.0 / (self.scale * grid.pixel)).max(1.0));
        let reach = u32::try_from(stride).unwrap_or(u32::MAX);
        for row in rows.step_by(stride) {
            for column in columns.clone().step_by(stride) {
                let middle = grid.middle(column, row);
                let away = |p: &[f64; 3]| (p[0] - middle[0]).powi(2) + (p[1] - middle[1]).powi(2);
                let nearest = here.iter().min_by(|a, b| away(a).total_cmp(&away(b)));
                let Some(colour) = nearest.and_then(|p| self.kind([column, row], p[2])) else { continue };
                // Borders between pixels are computed alike from both sides, so that no gap is
                // left.
                let wall = |k: usize, i: u32| grid.origin[k] + f64::from(i) * grid.pixel;
                let low = [wall(0, column), wall(1, row)];
                let high = [wall(0, column.saturating_add(reach)), wall(1, row.saturating_add(reach))];
                self.fill(canvas, [low, high], colour);
            }
        }
    }

    /// Returns the colour of a column for feet at this height.
    fn kind(&self, [column, row]: [u32; 2], feet: f64) -> Option<Colour> {
        let grid = self.map.grid();
        let AvatarOptions { height, climb, .. } = *self.avatar.options();
        let mut kind = None;
        for s in grid.range(2, [feet - climb, feet + height])? {
            let found = self.map.slice(s).ok().and_then(|slice| slice.pixel(column, row));
            let Some(found) = found else { continue };
            let [bottom, top] = [found.bottom, found.top].map(|level| grid.height(s, level));
            if top > feet + climb && bottom < feet + height {
                return Some(IN_THE_WAY);
            }
            if top >= feet - climb && bottom < feet + height {
                kind = Some(if found.is_obstacle { STEP } else { FLOOR });
            }
        }
        kind
    }
}

/// Draws a cross.
pub(super) fn cross(canvas: &mut Canvas, area: Area, [x, y]: [f64; 2]) {
    const ARM: f64 = 8.0;
    for side in [-1.0, 1.0] {
        canvas.line(area, [[x - ARM, y - side * ARM], [x + ARM, y + side * ARM]], 4.0, STOP);
    }
}

/// Returns the number of columns of views that comes nearest to the wanted shape and leaves little
/// of it empty.
fn columns(views: usize, [width, height]: [usize; 2]) -> usize {
    #[expect(clippy::cast_precision_loss, reason = "pixels")]
    let off = |columns: usize| {
        let rows = views.div_ceil(columns);
        let shape = (columns * width) as f64 / (rows * height) as f64;
        (shape / SHAPE).ln().abs() + 1.0 - views as f64 / (columns * rows) as f64
    };
    (1..=views).min_by(|a, b| off(*a).total_cmp(&off(*b))).unwrap_or(1)
}

/// Returns the width of an entry of the legend.
fn entry_width(text: &str) -> usize {
    40 * FINE + Canvas::text_width(SMALL, text)
}

/// Returns the number of lines of the legend.
fn rows(entries: &[(Colour, &str)], full: usize) -> usize {
    let mut left = GAP;
    let mut rows = 1;
    for (_, text) in entries {
        if left > GAP && left + entry_width(text) > full {
            (left, rows) = (GAP, rows + 1);
        }
        left += entry_width(text);
    }
    rows
}

fn draw_legend(canvas: &mut Canvas, entries: &[(Colour, &str)], [top, full]: [usize; 2]) {
    let (mut left, mut top) = (GAP, top);
    for (colour, text) in entries {
        if left > GAP && left + entry_width(text) > full {
            (left, top) = (GAP, top + LINE);
        }
        canvas.fill(Area { left, top, width: 14 * FINE, height: 12 * FINE }, *colour);
        canvas.text([left + 20 * FINE, top + FINE], SMALL, INK, text);
        left += entry_width(text);
    }
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "pixels, not negative")]
pub(super) fn whole(x: f64) -> usize {
    x.round() as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn views_lie_in_a_shape_that_fits_a_page() {
        assert_eq!(columns(1, [100, 100]), 1);
        assert_eq!(columns(4, [100, 100]), 2);
        assert_eq!(columns(3, [100, 300]), 3);
        assert_eq!(columns(2, [300, 100]), 1);
    }
}
