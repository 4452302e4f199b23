//! A walk from above, storey by storey where it comes over itself, and its height over its length.

use nearmiss::geometry::nalgebra::Vector3;
use nearmiss::slices::{Avatar, AvatarOptions, SliceMap};

use super::labels::Labels;
use super::track::Track;
use crate::canvas::{Area, Camera, Canvas, Colour, FINE};
use crate::digits::{rounded, short};
use crate::image::Picture;
use crate::picture::scale_bar;

/// In fine pixels: the longer side of a view, alone or one of several; the curve, margins, letters.
const ALONE: f64 = 900.0 * FINE as f64;
const ONE_OF_MANY: f64 = 560.0 * FINE as f64;
const LEAST_WIDTH: usize = 560 * FINE;
const CURVE: usize = 210 * FINE;
const GAP: usize = 12 * FINE;
const LETTER: usize = 2 * FINE;
const SMALL: usize = 3 * FINE / 2;
const LINE: usize = 22 * FINE;

/// Views are laid out in a shape not far from this, width to height.
const SHAPE: f64 = 1.3;

const GROUND: Colour = [255, 255, 255];
const EMPTY: Colour = [238, 240, 243];
const FLOOR: Colour = [188, 214, 190];
const STEP: Colour = [214, 180, 120];
const IN_THE_WAY: Colour = [70, 74, 82];
const WAY: Colour = [208, 60, 40];
const ELSEWHERE: Colour = [226, 166, 158];
const AIM: Colour = [40, 90, 200];
const INK: Colour = [30, 34, 40];

/// Where there are several, a view holds so many times the avatar's height, unless there would be more than
/// `MOST_VIEWS`.
const STOREY: f64 = 2.0;
const MOST_VIEWS: f64 = 9.0;

/// What is shown around the way: so many times the avatar's height, and this share of the way's extent.
const AROUND: f64 = 1.5;
const MORE: f64 = 0.1;

/// Places of the way that pixels, and each other, are held against.
const SAMPLE: usize = 150;
const MOST_PLACES: usize = 1500;

/// A view for each storey that the walk was on, lowest first; below them its height over its length. Pixels
/// are shown as they are to the avatar where it came nearest to them.
pub(super) fn paint(map: &SliceMap, track: &Track, avatar: &Avatar) -> Picture {
    let storeys = storeys(track, avatar.options());
    let window = window(map, track, avatar);
    // So far off the map that nothing is around it.
    let size = [0, 1].map(|k| (window[1][k] - window[0][k]).max(map.grid().pixel));
    let side = if storeys.len() == 1 { ALONE } else { ONE_OF_MANY };
    let scale = side / size[0].max(size[1]);
    let [width, height] = size.map(|length| whole(length * scale));
    let columns = columns(storeys.len(), [width, height + LINE]);
    let full = (columns * (width + GAP) + GAP).max(LEAST_WIDTH);
    let top = |row: usize| GAP + LINE + row * (LINE + height + GAP);
    let curve = top(storeys.len().div_ceil(columns));
    let legend = curve + CURVE + LINE;
    let entries = entries(storeys.len() > 1);
    let mut canvas = Canvas::new(full, legend + rows(&entries, full) * LINE + GAP, GROUND);
    let options = avatar.options();
    let told = format!(
        "walk of {}, pixels of {}, avatar of {} x {} x {}",
        short(track.distances.last().copied().unwrap_or(0.0)),
        short(map.grid().pixel),
        options.base[0],
        options.base[1],
        options.height
    );
    canvas.text([GAP, GAP], SMALL, INK, &told);
    for (i, &heights) in storeys.iter().enumerate() {
        let area =
            Area { left: GAP + i % columns * (width + GAP), top: top(i / columns) + LINE, width, height };
        let [low, high] = heights.map(|z| rounded(z, map.grid().pixel));
        let title = format!("heights from {low} to {high}");
        canvas.text([area.left, area.top - LINE + 4 * FINE], LETTER, INK, &title);
        let view = View { map, track, avatar, window, scale, area };
        view.paint(&mut canvas, heights);
        if i == 0 {
            scale_bar(&mut canvas, &view.camera());
        }
    }
    heights_over_way(
        &mut canvas,
        Area { left: GAP, top: curve, width: full - 2 * GAP, height: CURVE },
        track,
    );
    draw_legend(&mut canvas, &entries, [legend, full]);
    canvas.picture()
}

/// Ranges of height that hold all places, none empty: a single one, unless the walk comes over itself.
fn storeys(track: &Track, avatar: &AvatarOptions) -> Vec<[f64; 2]> {
    let heights = || track.places.iter().map(|p| p[2]);
    let low = heights().fold(f64::INFINITY, f64::min);
    let rise = heights().fold(f64::NEG_INFINITY, f64::max) - low;
    let count = if is_over_itself(track, avatar) { rise / (STOREY * avatar.height) } else { 1.0 };
    let count = count.ceil().clamp(1.0, MOST_VIEWS);
    let bounds = |i: f64| [low + rise * i / count, low + rise * (i + 1.0) / count];
    let all = std::iter::successors(Some(0.0), |i| Some(i + 1.0)).take_while(|i| *i < count).map(bounds);
    all.filter(|range| heights().any(|z| is_within(z, *range))).collect()
}

/// Whether at one place there was an avatar above the head of itself.
fn is_over_itself(track: &Track, avatar: &AvatarOptions) -> bool {
    let places: Vec<&[f64; 3]> =
        track.places.iter().step_by(track.places.len().div_ceil(MOST_PLACES)).collect();
    let width = avatar.base[0].max(avatar.base[1]);
    let is_over = |a: &[f64; 3], b: &[f64; 3]| {
        (a[0] - b[0]).hypot(a[1] - b[1]) < 2.0 * width && (a[2] - b[2]).abs() > avatar.height
    };
    places.iter().enumerate().any(|(i, a)| places[..i].iter().any(|b| is_over(a, b)))
}

fn is_within(z: f64, [low, high]: [f64; 2]) -> bool {
    // Whatever rounding says of the lowest and the highest.
    let off = 1e-9 * (1.0 + low.abs().max(high.abs()));
    low - off <= z && z <= high + off
}

/// What of the map is shown: its least and its greatest corner.
fn window(map: &SliceMap, track: &Track, avatar: &Avatar) -> [[f64; 2]; 2] {
    let grid = map.grid();
    let all = || track.places.iter().map(|p| [p[0], p[1]]);
    let [low, high] = [0, 1].map(|end| {
        [0, 1].map(|k| {
            let values = all().map(|p| p[k]);
            if end == 0 {
                values.fold(f64::INFINITY, f64::min)
            } else {
                values.fold(f64::NEG_INFINITY, f64::max)
            }
        })
    });
    let extent = (high[0] - low[0]).max(high[1] - low[1]);
    let margin = AROUND * avatar.options().height + MORE * extent;
    let end = |k: usize| grid.origin[k] + f64::from(grid.counts[k]) * grid.pixel;
    // A walk that left the map is shown off it.
    [
        [0, 1].map(|k| (low[k] - margin).max(grid.origin[k].min(low[k]))),
        [0, 1].map(|k| (high[k] + margin).min(end(k).max(high[k]))),
    ]
}

/// How many views beside each other come nearest to the shape, and leave little of it empty.
fn columns(views: usize, [width, height]: [usize; 2]) -> usize {
    #[expect(clippy::cast_precision_loss, reason = "pixels")]
    let off = |columns: usize| {
        let rows = views.div_ceil(columns);
        let shape = (columns * width) as f64 / (rows * height) as f64;
        (shape / SHAPE).ln().abs() + 1.0 - views as f64 / (columns * rows) as f64
    };
    (1..=views).min_by(|a, b| off(*a).total_cmp(&off(*b))).unwrap_or(1)
}

/// One storey.
struct View<'a> {
    map: &'a SliceMap,
    track: &'a Track,
    avatar: &'a Avatar,
    window: [[f64; 2]; 2],
    /// Fine pixels of a unit of length.
    scale: f64,
    area: Area,
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

    fn at(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [x, y, _] = self.camera().project(Vector3::new(x, y, 0.0));
        [x, y]
    }

    fn paint(&self, canvas: &mut Canvas, heights: [f64; 2]) {
        canvas.fill(self.area, EMPTY);
        self.ground(canvas, heights);
        let pairs = || self.track.places.windows(2);
        let is_here = |pair: &[[f64; 3]]| is_within(pair[1][2], heights);
        for (colour, width, here) in [(ELSEWHERE, 3.0, false), (WAY, 5.0, true)] {
            for pair in pairs().filter(|pair| is_here(pair) == here) {
                let ends = [pair[0], pair[1]].map(|p| self.at([p[0], p[1]]));
                canvas.line(self.area, ends, width, colour);
            }
        }
        let start = self.track.places.first().filter(|p| is_within(p[2], heights)).map(|p| [p[0], p[1]]);
        let mut labels = Labels::default();
        if let Some(start) = start {
            self.base(canvas, &mut labels, start);
        }
        for ((i, &number), &target) in (1..).zip(&self.track.numbers).zip(&self.track.targets) {
            if number == i && start != Some(target) {
                let [x, y] = self.at(target);
                canvas.ring(self.area, [x, y], 9.0, 3.0, AIM);
                self.label(canvas, &mut labels, [x + 14.0, y - 24.0], &number.to_string());
            }
        }
    }

    /// The avatar's base at a place.
    fn base(&self, canvas: &mut Canvas, labels: &mut Labels, place: [f64; 2]) {
        let half = self.map.grid().up.across(self.avatar.options().base).map(|side| 0.5 * side);
        let corner = |s: f64, t: f64| self.at([place[0] + s * half[0], place[1] + t * half[1]]);
        let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        for i in 0..4 {
            canvas.line(self.area, [corners[i], corners[(i + 1) % 4]], 3.0, AIM);
        }
        let [x, y] = corners[2];
        let again = self.track.targets.iter().position(|target| *target == place);
        let name = again.map_or_else(|| "start".into(), |i| format!("start, {}", i + 1));
        self.label(canvas, labels, [x + 4.0, y - 20.0], &name);
    }

    /// Letters that stay in the view, on a ground of their own, unless others are there.
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

    /// What pixels are to an avatar that stands where the way on this storey comes nearest to them.
    fn ground(&self, canvas: &mut Canvas, heights: [f64; 2]) {
        let here: Vec<[f64; 3]> =
            self.track.places.iter().copied().filter(|p| is_within(p[2], heights)).collect();
        let here: Vec<[f64; 3]> = here.iter().copied().step_by(here.len().div_ceil(SAMPLE).max(1)).collect();
        let grid = self.map.grid();
        let [low, high] = self.window;
        let ranges = [0, 1].map(|k| grid.range(k, [low[k], high[k]]));
        let [Some(columns), Some(rows)] = ranges else { return };
        // Of pixels finer than can be seen one speaks for its neighbours.
        let stride = whole((1.0 / (self.scale * grid.pixel)).max(1.0));
        let reach = u32::try_from(stride).unwrap_or(u32::MAX);
        for row in rows.step_by(stride) {
            for column in columns.clone().step_by(stride) {
                let middle = grid.middle(column, row);
                let away = |p: &[f64; 3]| (p[0] - middle[0]).powi(2) + (p[1] - middle[1]).powi(2);
                let nearest = here.iter().min_by(|a, b| away(a).total_cmp(&away(b)));
                let Some(colour) = nearest.and_then(|p| self.kind([column, row], p[2])) else { continue };
                // Walls between pixels reckoned alike from both sides, so that no gap is left.
                let wall = |k: usize, i: u32| grid.origin[k] + f64::from(i) * grid.pixel;
                let [x0, y0] = self.at([wall(0, column), wall(1, row.saturating_add(reach))]);
                let [x1, y1] = self.at([wall(0, column.saturating_add(reach)), wall(1, row)]);
                let inside = |x: f64, from: usize, size: usize| whole(x.max(0.0)).clamp(from, from + size);
                let [left, right] = [x0, x1].map(|x| inside(x, self.area.left, self.area.width));
                let [top, bottom] = [y0, y1].map(|y| inside(y, self.area.top, self.area.height));
                // Where several pixels share a fine one, the last is seen.
                let (width, height) = ((right - left).max(1), (bottom - top).max(1));
                canvas.fill(Area { left, top, width, height }, colour);
            }
        }
    }

    /// What a column is to feet at this height.
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

/// Height over distance.
fn heights_over_way(canvas: &mut Canvas, outer: Area, track: &Track) {
    let margin = 64 * FINE;
    let area = Area {
        left: outer.left + margin,
        top: outer.top + LINE,
        width: outer.width - margin,
        height: outer.height - 2 * LINE,
    };
    canvas.text([outer.left, outer.top + 4 * FINE], LETTER, INK, "height over the way");
    canvas.fill(area, EMPTY);
    let length = track.distances.last().copied().unwrap_or(0.0).max(f64::MIN_POSITIVE);
    let ends = track.places.iter().map(|p| p[2]);
    let [low, high] = ends.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], z| [l.min(z), h.max(z)]);
    // A level way is shown as one.
    let rise = (high - low).max(0.02 * length);
    #[expect(clippy::cast_precision_loss, reason = "pixels")]
    let [left, top, w, h] = [area.left, area.top, area.width, area.height].map(|n| n as f64);
    let across = |way: f64| left + 0.01 * w + 0.98 * w * way / length;
    let up = |z: f64| top + 0.93 * h - 0.78 * h * (z - low) / rise;
    for z in ticks([low, low + rise], 5.0) {
        canvas.line(area, [[left, up(z)], [left + w, up(z)]], 1.5, GROUND);
        let text = short(z);
        let x = area.left - Canvas::text_width(SMALL, &text) - 2 * SMALL;
        canvas.text([x, whole(up(z)).saturating_sub(4 * SMALL)], SMALL, INK, &text);
    }
    for way in ticks([0.0, length], 10.0) {
        canvas.line(area, [[across(way), top], [across(way), top + h]], 1.5, GROUND);
        let text = short(way);
        let x = whole(across(way)).min(area.left + area.width - Canvas::text_width(SMALL, &text));
        canvas.text([x, area.top + area.height + 2 * SMALL], SMALL, INK, &text);
    }
    let mut labels = Labels::default();
    for (number, &[way, z]) in track.numbers.iter().zip(&track.reached) {
        let [x, y] = [across(way), up(z)];
        canvas.ring(area, [x, y], 7.0, 2.5, AIM);
        let name = number.to_string();
        let long = Canvas::text_width(SMALL, &name);
        let left = whole(x).saturating_sub(long / 2).min(area.left + area.width - long);
        let top = whole(y).saturating_sub(13 * SMALL).max(area.top);
        if labels.has_room(Area { left, top, width: long + SMALL, height: 9 * SMALL }) {
            canvas.text([left, top], SMALL, AIM, &name);
        }
    }
    for i in 1..track.places.len() {
        let at = |i: usize| [across(track.distances[i]), up(track.places[i][2])];
        canvas.line(area, [at(i - 1), at(i)], 4.0, WAY);
    }
}

/// Round numbers in a range, at most about so many.
fn ticks([low, high]: [f64; 2], most: f64) -> impl Iterator<Item = f64> {
    let least = (high - low) / most;
    let power = 10.0_f64.powf(least.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].into_iter().map(|m| m * power).find(|step| *step >= least);
    let step = step.unwrap_or(10.0 * power);
    let first = (low / step - 1e-9).ceil();
    let count = ((high / step + 1e-9).floor() - first).clamp(0.0, 100.0);
    std::iter::successors(Some(0.0), |i| Some(i + 1.0))
        .take_while(move |i| *i <= count)
        .map(move |i| (first + i) * step)
}

/// What colours mean.
fn entries(several: bool) -> Vec<(Colour, &'static str)> {
    let mut entries = vec![
        (FLOOR, "floor"),
        (STEP, "steep, but low enough to climb"),
        (IN_THE_WAY, "in the way"),
        (EMPTY, "nothing at this height"),
        (WAY, "the walk"),
        (AIM, "points of the route"),
    ];
    if several {
        entries.insert(5, (ELSEWHERE, "the walk, on another storey"));
    }
    entries
}

/// Width of an entry of the legend.
fn entry_width(text: &str) -> usize {
    40 * FINE + Canvas::text_width(SMALL, text)
}

/// How many lines the legend takes.
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
fn whole(x: f64) -> usize {
    x.round() as usize
}

#[cfg(test)]
mod tests {
    use nearmiss::Aabb;
    use nearmiss::slices::{Grid, Pixel, Route, SliceBuilder, SliceOptions, SlicePlan, Up};

    use super::*;

    const GRID: Grid = Grid { up: Up::Z, origin: [0.0; 3], pixel: 1.0, slice_height: 1.0, counts: [1; 3] };

    /// A way through these places, a unit of length a step.
    fn track(places: &[[f64; 3]], points: &[[f64; 2]], grid: &Grid) -> Track {
        let route = Route { start: places[0], points: points.to_vec() };
        let mut track = Track::new(&route, grid, places[0]);
        (1_u32..).zip(&places[1..]).for_each(|(i, place)| track.add(*place, f64::from(i)));
        track
    }

    #[test]
    fn ticks_are_round_and_within() {
        let of = |low, high| ticks([low, high], 5.0).map(short).collect::<Vec<_>>();
        assert_eq!(of(-1.3, 4.5), ["0", "2", "4"]);
        assert_eq!(of(0.0, 1.0), ["0", "0.2", "0.4", "0.6", "0.8", "1"]);
        assert_eq!(of(2.0, 2.05), ["2", "2.01", "2.02", "2.03", "2.04", "2.05"]);
    }

    #[test]
    fn storeys_are_told_apart_where_a_walk_comes_over_itself() {
        let of = |places: &[[f64; 3]]| storeys(&track(places, &[], &GRID), &AvatarOptions::default());
        assert_eq!(of(&[[0.0, 0.0, 1.0], [9.0, 0.0, 7.0]]), [[1.0, 7.0]], "beside each other");
        let over = of(&[[0.0, 0.0, 0.0], [5.0, 0.0, 3.0], [0.1, 0.0, 6.0]]);
        assert_eq!(over, [[0.0, 3.0], [3.0, 6.0]]);
        assert_eq!(of(&[[0.0; 3], [0.0, 0.0, 9.0]]).len(), 2, "nothing was in between");
        assert_eq!(of(&[[0.0; 3], [0.0, 0.0, 0.5], [0.0, 0.0, 1e6]]).len(), 2, "long falls have few views");
    }

    #[test]
    fn views_lie_in_a_shape_that_fits_a_page() {
        assert_eq!(columns(1, [100, 100]), 1);
        assert_eq!(columns(4, [100, 100]), 2);
        assert_eq!(columns(3, [100, 300]), 3);
        assert_eq!(columns(2, [300, 100]), 1);
    }

    #[test]
    fn a_picture_shows_floor_walls_and_the_way() {
        let row = |x: f64| (0..80_u8).map(move |i| [x, 0.05 * f64::from(i)]);
        let ground = (0..80_u8).flat_map(|i| row(0.05 * f64::from(i))).map(|[x, y]| [x, y, 0.0]);
        // A wall at the end, and a step of 0.2 across the middle.
        let wall = row(3.9).flat_map(|[x, y]| (0..50_u8).map(move |i| [x, y, 0.05 * f64::from(i)]));
        let step = row(2.0).flat_map(|[x, y]| (0..5_u8).map(move |i| [x, y, 0.05 * f64::from(i)]));
        let points: Vec<[f64; 3]> = ground.chain(wall).chain(step).collect();
        let options = SliceOptions::default().with_pixel(Pixel::Side(0.05));
        let plan = SlicePlan::new(&options, &Aabb::of(points.iter().copied())).unwrap();
        let mut builder = SliceBuilder::new(&plan).unwrap();
        builder.add(&points);
        let places: Vec<[f64; 3]> = (0..20_u8).map(|i| [0.5 + 0.05 * f64::from(i), 2.0, 0.0]).collect();
        let map = builder.finish();
        let track = track(&places, &[[1.45, 2.0]], map.grid());
        let picture = paint(&map, &track, &Avatar::new(&AvatarOptions::default()).unwrap());
        let share = |colour: Colour| {
            let all = picture.pixels().chunks(3);
            #[expect(clippy::cast_precision_loss, reason = "pixels")]
            let share = all.clone().filter(|pixel| *pixel == colour).count() as f64 / all.len() as f64;
            share
        };
        assert!(share(FLOOR) > 0.3, "{} are floor", share(FLOOR));
        for (colour, what) in [(IN_THE_WAY, "the wall"), (STEP, "the step"), (WAY, "the way")] {
            assert!((5e-4..0.05).contains(&share(colour)), "{} are {what}", share(colour));
        }
    }
}
