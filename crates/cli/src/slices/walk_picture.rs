//! A walk from above, storey by storey, and its height over its length.

use nearmiss::slices::SliceMap;

use super::walk::Track;
use crate::canvas::{Area, Canvas, Colour, FINE};
use crate::digits::short;
use crate::picture::Picture;

/// Kept pixels: longest side of a view from above, height of the curve, margins.
const VIEW: usize = 900;
const CURVE: usize = 240;
const GAP: usize = 12;
const LEGEND: usize = 22;

const GROUND: Colour = [255, 255, 255];
const EMPTY: Colour = [238, 240, 243];
const FLOOR: Colour = [188, 214, 190];
const OBSTACLE: Colour = [70, 74, 82];
const WAY: Colour = [208, 60, 40];
const AIM: Colour = [40, 90, 200];
const INK: Colour = [30, 34, 40];

/// A view shows the walk where it was within so much of the avatar's height.
const STOREY: f64 = 1.5;

/// A long fall is not shown in more views than this.
const MOST_VIEWS: f64 = 12.0;

/// A view for each storey that the walk was on, lowest first, with the part of the walk on it; below them its height over its
/// length. `height` is the avatar's.
pub(super) fn paint(map: &SliceMap, track: &Track, height: f64) -> Picture {
    let low = track.places.iter().fold(f64::INFINITY, |least, p| least.min(p[2]));
    let high = track.places.iter().fold(f64::NEG_INFINITY, |most, p| most.max(p[2]));
    let storeys = storeys(track, (STOREY * height).max((high - low) / MOST_VIEWS));
    let [width, depth, _] = map.grid().counts.map(|n| n as usize);
    let zoom = (VIEW / width.max(depth)).max(1);
    let shrink = width.max(depth).div_ceil(VIEW);
    let [w, h] = [width, depth].map(|n| (n * zoom).div_ceil(shrink));
    let view = |i: usize| Area {
        left: GAP * FINE,
        top: (GAP + i * (h + LEGEND + GAP) + LEGEND) * FINE,
        width: w * FINE,
        height: h * FINE,
    };
    let curve = view(storeys.len());
    let full = [w.max(480) + 2 * GAP, curve.top / FINE + CURVE + GAP];
    let mut canvas = Canvas::new(full[0] * FINE, full[1] * FINE, GROUND);
    #[expect(clippy::cast_precision_loss, reason = "pixels")]
    let scale = w as f64 * FINE as f64 / (width as f64 * map.grid().pixel);
    for (i, &[low, high]) in storeys.iter().enumerate() {
        let area = view(i);
        let title = format!("height {} to {}", short(low), short(high));
        canvas.text([area.left, area.top - 18 * FINE], 2 * FINE, INK, &title);
        storey(&mut canvas, area, map, [low, high + height]);
        let at = |p: [f64; 2]| {
            let origin = map.grid().origin;
            #[expect(clippy::cast_precision_loss, reason = "pixels")]
            let [left, bottom] = [area.left as f64, (area.top + area.height) as f64];
            [left + scale * (p[0] - origin[0]), bottom - scale * (p[1] - origin[1])]
        };
        for target in &track.targets {
            canvas.ring(area, at(*target), 5.0 * 2.0, 3.0, AIM);
        }
        for pair in track.places.windows(2).filter(|pair| (low..=high).contains(&pair[1][2])) {
            canvas.line(area, [at([pair[0][0], pair[0][1]]), at([pair[1][0], pair[1][1]])], 4.0, WAY);
        }
    }
    let area = Area { height: CURVE * FINE, width: (full[0] - 2 * GAP) * FINE, ..curve };
    heights(&mut canvas, area, track);
    canvas.picture()
}

/// Ranges of height, each at most so high, that hold all places, none empty.
fn storeys(track: &Track, most: f64) -> Vec<[f64; 2]> {
    let mut heights: Vec<f64> = track.places.iter().map(|p| p[2]).collect();
    heights.sort_unstable_by(f64::total_cmp);
    let mut storeys: Vec<[f64; 2]> = Vec::new();
    for height in heights {
        match storeys.last_mut() {
            Some([low, high]) if height - *low <= most => *high = height,
            _ => storeys.push([height, height]),
        }
    }
    storeys
}

/// What is between two heights, from above: obstacles over floor.
fn storey(canvas: &mut Canvas, area: Area, map: &SliceMap, [low, high]: [f64; 2]) {
    let grid = map.grid();
    let [width, depth, _] = grid.counts;
    canvas.fill(area, EMPTY);
    let Some(slices) = grid.range(2, [low - grid.slice_height, high]) else { return };
    for row in 0..depth {
        for column in 0..width {
            let mut colour = EMPTY;
            for slice in slices.clone().filter_map(|s| map.slice(s).ok()) {
                match slice.pixel(column, row) {
                    Some(found) if found.is_obstacle => colour = OBSTACLE,
                    Some(_) if colour == EMPTY => colour = FLOOR,
                    _ => {}
                }
            }
            if colour != EMPTY {
                let [x0, x1] = [column, column + 1].map(|c| c as usize * area.width / width as usize);
                let [y0, y1] =
                    [depth - 1 - row, depth - row].map(|r| r as usize * area.height / depth as usize);
                let pixel = Area {
                    left: area.left + x0,
                    top: area.top + y0,
                    width: (x1 - x0).max(1),
                    height: (y1 - y0).max(1),
                };
                canvas.fill(pixel, colour);
            }
        }
    }
}

/// Height over distance.
fn heights(canvas: &mut Canvas, area: Area, track: &Track) {
    canvas.fill(area, EMPTY);
    let way = track.distances.last().copied().unwrap_or(0.0);
    let length = way.max(f64::MIN_POSITIVE);
    let ends = track.places.iter().map(|p| p[2]);
    let [low, high] = ends.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], z| [l.min(z), h.max(z)]);
    let rise = (high - low).max(1e-3 * length);
    #[expect(clippy::cast_precision_loss, reason = "pixels")]
    let [left, top, w, h] = [area.left, area.top, area.width, area.height].map(|n| n as f64);
    let at = |i: usize| {
        let x = left + 0.02 * w + 0.96 * w * track.distances[i] / length;
        [x, top + h - 0.1 * h - 0.75 * h * (track.places[i][2] - low) / rise]
    };
    for i in 1..track.places.len() {
        canvas.line(area, [at(i - 1), at(i)], 4.0, WAY);
    }
    let title = format!("height {} to {} over a way of {}", short(low), short(high), short(way));
    canvas.text([area.left + 8 * FINE, area.top + 6 * FINE], 2 * FINE, INK, &title);
}
