//! The picture of a walk: from above, in several views where it crosses above itself, and its
//! height over its length.

use nearmiss::slices::{Avatar, AvatarOptions, SliceMap, Storey};
use nearmiss_draw::canvas::{Area, Canvas, Colour, FINE};
use nearmiss_draw::picture::Picture;

use super::labels::Labels;
use super::storey_view::{
    AIM, EMPTY, FLOOR, GAP, IN_THE_WAY, INK, LETTER, LINE, SMALL, STEP, STOP, Sheet, View, cross, whole,
    window,
};
use super::track::Track;
use crate::digits::{rounded, short};

/// Height of the curve, in fine pixels.
const CURVE: usize = 210 * FINE;

const GROUND: Colour = [255, 255, 255];
const WAY: Colour = [208, 60, 40];
const ELSEWHERE: Colour = [226, 166, 158];

/// Height of one of several views, as a multiple of the avatar's height, unless there would be more
/// than `MOST_VIEWS`.
const STOREY: f64 = 2.0;
const MOST_VIEWS: f64 = 9.0;

/// Greatest number of places that are compared with each other.
const MOST_PLACES: usize = 1500;

/// Draws a view for each storey of the walk, lowest first, and below them its height over its
/// length. Pixels are coloured by their kind for the avatar where it came nearest to them. `floors`
/// are the known storeys of the map.
pub(super) fn paint(map: &SliceMap, track: &Track, avatar: &Avatar, floors: &[Storey]) -> Picture {
    let options = avatar.options();
    let storeys = storeys(track, options, floors);
    let places = track.places.iter().map(|p| [p[0], p[1]]).chain(track.targets.iter().copied());
    let told = format!(
        "walk of {}, pixels of {}, avatar of {} x {} x {}",
        short(track.distances.last().copied().unwrap_or(0.0)),
        short(map.grid().pixel),
        options.base[0],
        options.base[1],
        options.height
    );
    let titles = storeys.iter().map(|heights| {
        let [low, high] = heights.map(|z| rounded(z, map.grid().pixel));
        format!("heights from {low} to {high}")
    });
    let titles: Vec<String> = titles.collect();
    let entries = entries(storeys.len() > 1, !track.stops.is_empty());
    let mut sheet =
        Sheet::new((map, avatar), window(map, avatar, places), (&told, &titles), &entries, CURVE + LINE);
    for (i, &heights) in storeys.iter().enumerate() {
        let view = sheet.view(i);
        paint_storey(&mut sheet.canvas, &view, track, heights);
    }
    let curve = Area { left: GAP, top: sheet.below, width: sheet.full - 2 * GAP, height: CURVE };
    heights_over_way(&mut sheet.canvas, curve, track, options);
    sheet.picture()
}

fn paint_storey(canvas: &mut Canvas, view: &View<'_>, track: &Track, heights: [f64; 2]) {
    let here: Vec<[f64; 3]> = track.places.iter().copied().filter(|p| is_within(p[2], heights)).collect();
    view.ground(canvas, &here);
    let is_here = |pair: &[[f64; 3]]| is_within(pair[1][2], heights);
    for (colour, width, here) in [(ELSEWHERE, 3.0, false), (WAY, 5.0, true)] {
        for pair in track.places.windows(2).filter(|pair| is_here(pair) == here) {
            let ends = [pair[0], pair[1]].map(|p| view.at([p[0], p[1]]));
            canvas.line(view.area, ends, width, colour);
        }
    }
    let start = track.places.first().filter(|p| is_within(p[2], heights)).map(|p| [p[0], p[1]]);
    let mut labels = Labels::default();
    if let Some(start) = start {
        let again = track.targets.iter().position(|target| *target == start);
        let name = again.map_or_else(|| "start".into(), |i| format!("start, {}", i + 1));
        view.base(canvas, &mut labels, start, &name);
    }
    for ((i, &number), &target) in (1..).zip(&track.numbers).zip(&track.targets) {
        if number == i && start != Some(target) {
            view.goal(canvas, &mut labels, target, &number.to_string());
        }
    }
    for (place, _) in track.stops.iter().filter(|(place, _)| is_within(place[2], heights)) {
        view.cross(canvas, [place[0], place[1]]);
    }
}

/// Returns ranges of height that contain all places; none of them is empty. It is a single range
/// unless the walk crosses above itself. If it does, the ranges are those of the storeys that the
/// walk was on, or equal parts if it was on a single storey.
fn storeys(track: &Track, avatar: &AvatarOptions, floors: &[Storey]) -> Vec<[f64; 2]> {
    let heights = || track.places.iter().map(|p| p[2]);
    let low = heights().fold(f64::INFINITY, f64::min);
    let high = heights().fold(f64::NEG_INFINITY, f64::max);
    if !is_over_itself(track, avatar) {
        return vec![[low, high]];
    }
    let is_used = |range: &[f64; 2]| heights().any(|z| is_within(z, *range));
    let by_floor = floors.iter().map(|floor| [floor.heights[0].max(low), floor.heights[1].min(high)]);
    let by_floor: Vec<[f64; 2]> = by_floor.filter(|range| range[0] <= range[1]).filter(is_used).collect();
    if by_floor.len() > 1 {
        return by_floor;
    }
    let rise = high - low;
    let count = (rise / (STOREY * avatar.height)).ceil().clamp(1.0, MOST_VIEWS);
    let bounds = |i: f64| [low + rise * i / count, low + rise * (i + 1.0) / count];
    let all = std::iter::successors(Some(0.0), |i| Some(i + 1.0)).take_while(|i| *i < count).map(bounds);
    all.filter(is_used).collect()
}

/// Returns `true` if the avatar was at two heights of nearly the same place, one above its head at
/// the other.
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
    // The tolerance keeps the lowest and the highest place within in spite of rounding.
    let off = 1e-9 * (1.0 + low.abs().max(high.abs()));
    low - off <= z && z <= high + off
}

/// Draws the height over the distance.
fn heights_over_way(canvas: &mut Canvas, outer: Area, track: &Track, avatar: &AvatarOptions) {
    let margin = 64 * FINE;
    let area = Area {
        left: outer.left + margin,
        top: outer.top + LINE,
        width: outer.width - margin,
        height: outer.height - 2 * LINE,
    };
    canvas.text([outer.left, outer.top + 4 * FINE], LETTER, INK, "height over the way");
    canvas.fill(area, EMPTY);
    // A very short walk gets a scale of at least the avatar's width.
    let length = track.distances.last().copied().unwrap_or(0.0).max(avatar.base[0].max(avatar.base[1]));
    let ends = track.places.iter().map(|p| p[2]);
    let [least, most] = ends.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], z| [l.min(z), h.max(z)]);
    // The unevenness of a level walk is not spread over the whole height.
    let rise = (most - least).max(0.02 * length).max(avatar.height);
    let low = least - 0.5 * (rise - (most - least));
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
    let at = |i: usize| [across(track.distances[i]), up(track.places[i][2])];
    for i in 1..track.places.len() {
        canvas.line(area, [at(i - 1), at(i)], 4.0, WAY);
    }
    if track.places.len() == 1 {
        canvas.line(area, [at(0), at(0)], 10.0, WAY);
    }
    for &(place, way) in &track.stops {
        cross(canvas, area, [across(way), up(place[2])]);
    }
}

/// Returns round numbers in a range, about `most` of them at most.
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

/// Returns the entries of the legend.
fn entries(several: bool, stopped: bool) -> Vec<(Colour, &'static str)> {
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
    if stopped {
        entries.push((STOP, "stopped here"));
    }
    entries
}

#[cfg(test)]
mod tests {
    use nearmiss::Aabb;
    use nearmiss::slices::{Grid, Pixel, Route, SliceBuilder, SliceOptions, SlicePlan, Up};

    use super::*;

    const GRID: Grid = Grid { up: Up::Z, origin: [0.0; 3], pixel: 1.0, slice_height: 1.0, counts: [1; 3] };

    /// Creates a track through these places, one unit of length a step.
    fn track(places: &[[f64; 3]], points: &[[f64; 2]], grid: &Grid) -> Track {
        let route = Route { start: places[0], points: points.to_vec() };
        let mut track = Track::new(&route, grid, places[0]);
        (1_u32..).zip(&places[1..]).for_each(|(i, place)| track.add(*place, f64::from(i)));
        track
    }

    /// A floor with a wall at the end, and a step of 0.2 across the middle.
    fn room() -> SliceMap {
        let row = |x: f64| (0..80_u8).map(move |i| [x, 0.05 * f64::from(i)]);
        let ground = (0..80_u8).flat_map(|i| row(0.05 * f64::from(i))).map(|[x, y]| [x, y, 0.0]);
        let wall = row(3.9).flat_map(|[x, y]| (0..50_u8).map(move |i| [x, y, 0.05 * f64::from(i)]));
        let step = row(2.0).flat_map(|[x, y]| (0..5_u8).map(move |i| [x, y, 0.05 * f64::from(i)]));
        let points: Vec<[f64; 3]> = ground.chain(wall).chain(step).collect();
        let options = SliceOptions::default().with_pixel(Pixel::Side(0.05));
        let plan = SlicePlan::new(&options, &Aabb::of(points.iter().copied())).unwrap();
        let mut builder = SliceBuilder::new(&plan).unwrap();
        builder.add(&points);
        builder.finish()
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
        let of = |places: &[[f64; 3]]| storeys(&track(places, &[], &GRID), &AvatarOptions::default(), &[]);
        assert_eq!(of(&[[0.0, 0.0, 1.0], [9.0, 0.0, 7.0]]), [[1.0, 7.0]], "beside each other");
        let over = of(&[[0.0, 0.0, 0.0], [5.0, 0.0, 3.0], [0.1, 0.0, 6.0]]);
        assert_eq!(over, [[0.0, 3.0], [3.0, 6.0]]);
        assert_eq!(of(&[[0.0; 3], [0.0, 0.0, 9.0]]).len(), 2, "nothing was in between");
        assert_eq!(of(&[[0.0; 3], [0.0, 0.0, 0.5], [0.0, 0.0, 1e6]]).len(), 2, "long falls have few views");
    }

    #[test]
    fn storeys_of_the_map_divide_a_walk_that_was_on_them() {
        let over = track(&[[0.0, 0.0, 0.0], [5.0, 0.0, 3.0], [0.1, 0.0, 6.0]], &[], &GRID);
        let floor = |height: f64, heights: [f64; 2]| {
            let mut storeys = room().storeys(&Avatar::new(&AvatarOptions::default()).unwrap()).unwrap();
            let mut storey = storeys.remove(0);
            (storey.height, storey.heights) = (height, heights);
            storey
        };
        let floors = [floor(0.0, [f64::NEG_INFINITY, 5.0]), floor(5.4, [5.0, f64::INFINITY])];
        let of = |floors: &[Storey]| storeys(&over, &AvatarOptions::default(), floors);
        assert_eq!(of(&floors), [[0.0, 5.0], [5.0, 6.0]]);
        assert_eq!(of(&floors[..1]), [[0.0, 3.0], [3.0, 6.0]], "on one floor alone");
    }

    #[test]
    fn stops_and_points_out_of_the_way_are_in_the_picture() {
        let map = room();
        let avatar = Avatar::new(&AvatarOptions::default()).unwrap();
        let shown = |places: &[[f64; 3]], points: &[[f64; 2]], stops: bool| {
            let mut track = track(places, points, map.grid());
            if stops {
                track.stop(places[places.len() - 1], 1.0);
            }
            paint(&map, &track, &avatar, &[])
        };
        let count = |picture: &Picture, colour: Colour| {
            picture.pixels.chunks(3).filter(|pixel| *pixel == colour).count()
        };
        let way: Vec<[f64; 3]> = (0..20_u8).map(|i| [0.5 + 0.05 * f64::from(i), 2.0, 0.0]).collect();
        // The legend has a patch of either colour.
        let plain = shown(&way, &[], false);
        let stopped = shown(&way, &[], true);
        assert_eq!(count(&plain, STOP), 0);
        assert!(count(&stopped, STOP) > 14 * 12 + 20, "{} pixels of crosses", count(&stopped, STOP));
        // The half of the picture on the side of a far point, without the legend, contains the ring
        // alone: the walk is a few pixels at the other end.
        for (far, is_right) in [([30.0, 2.0], true), ([-30.0, 2.0], false)] {
            let picture = shown(&way, &[far], false);
            let (width, height) = picture.size();
            let rows = picture.pixels.chunks(3 * width).take(height / 3);
            let half = |row: &[u8]| {
                let row =
                    if is_right { row[3 * (width / 2)..].to_vec() } else { row[..3 * (width / 2)].to_vec() };
                row.chunks(3).filter(|pixel| *pixel == AIM).count()
            };
            let ring: usize = rows.map(half).sum();
            assert!(ring > 10, "{far:?}: {ring} pixels of its ring");
        }
        // An empty walk, and a level one whose unevenness stays small.
        let empty = shown(&way[..1], &[], false);
        // The patch of the legend is below the drawing, in the last rows.
        let (width, height) = empty.size();
        let drawn = empty.pixels.chunks(3).take(width * (height - 60)).filter(|pixel| *pixel == WAY).count();
        assert!((2..40).contains(&drawn), "{drawn} pixels of the dot at the start");
        let uneven: Vec<[f64; 3]> =
            way.iter().zip(0_u8..).map(|(p, i)| [p[0], p[1], 0.01 * f64::from(i % 2)]).collect();
        let [flat, uneven] = [&way, &uneven].map(|way| count(&shown(way, &[], false), WAY));
        assert!(uneven < flat + flat / 2, "{uneven} pixels of an uneven way, {flat} of a level one");
    }

    #[test]
    fn a_picture_shows_floor_walls_and_the_way() {
        let map = room();
        let places: Vec<[f64; 3]> = (0..20_u8).map(|i| [0.5 + 0.05 * f64::from(i), 2.0, 0.0]).collect();
        let track = track(&places, &[[1.45, 2.0]], map.grid());
        let picture = paint(&map, &track, &Avatar::new(&AvatarOptions::default()).unwrap(), &[]);
        let share = |colour: Colour| {
            let all = picture.pixels.chunks(3);
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
