//! The greatest height of a box that fits up a staircase, by the points alone and by walks on slice
//! maps.

use std::fmt::Write;

use nearmiss::PointCloud;
use nearmiss::slices::{Avatar, AvatarOptions, Back, Ended, Pixel, Route, SliceMap, SliceOptions, SlicePlan};

use super::{Source, Walked, made};
use crate::Failure;

const WIDTHS: [f64; 4] = [0.3, 0.4, 0.5, 0.6];
const PIXELS: [f64; 4] = [0.03, 0.04, 0.05, 0.06];

/// Heights that are tried, in centimetres.
const HEIGHTS: std::ops::RangeInclusive<u16> = 100..=220;

/// Step of the box along the route, greatest sideways offset at which headroom is measured, and
/// step of that offset.
const STEP: f64 = 0.04;
const ASIDE: f64 = 0.5;
const ASIDE_STEP: f64 = 0.05;

/// Points at most this far above the highest point of a step belong to the step, because points are
/// rounded to a centimetre.
const SAME: f64 = 0.02;

/// Writes the greatest height at which boxes of several widths get up the stairs, by the points and
/// by maps of several pixel sizes.
///
/// # Errors
/// When a map cannot be built.
pub fn table(text: &mut String, walked: &Walked) -> Result<(), Failure> {
    let up = Route {
        start: walked.route.start,
        points: walked.route.points[..walked.route.points.len() / 2].to_vec(),
    };
    write!(
        text,
        "\n## How high a box gets up the scan's staircase\n\nThe greatest height, to a centimetre, of a square box that stands on the highest point under it. By the points: the height from there to the lowest point above, \
         along the route, and the greatest such height within {ASIDE} to either side of the route, which no route can exceed. By walking: the tallest box that arrives, with a climb of {}.\n\n| width |{}\n| --- |{}\n",
        AvatarOptions::default().climb,
        WIDTHS.map(|width| format!(" {width} |")).concat(),
        " --: |".repeat(WIDTHS.len()),
    )?;
    let mut row = |name: &str, heights: &[f64]| {
        let cells: String = heights.iter().map(|height| format!(" {height:.2} |")).collect();
        writeln!(text, "| {name} |{cells}")
    };
    let free = WIDTHS.map(|width| room(&walked.cloud, &up, width));
    row("by the points, along the route", &free.map(|[along, _]| along))?;
    row("by the points, at most", &free.map(|[_, most]| most))?;
    let source = Source::Points(walked.cloud.clone());
    for pixel in PIXELS {
        let options = SliceOptions::default().with_pixel(Pixel::Side(pixel));
        let (map, _) = made(&SlicePlan::new(&options, &walked.cloud.bounds())?, &source)?;
        let mut heights = Vec::new();
        for width in WIDTHS {
            heights.push(highest(&map, &up, width)?);
        }
        row(&format!("walking, pixels of {pixel}"), &heights)?;
    }
    Ok(())
}

/// The greatest height at which a box of this width arrives; 0 if none of the tried heights does.
fn highest(map: &SliceMap, up: &Route, width: f64) -> Result<f64, Failure> {
    for height in HEIGHTS.rev().map(|height| f64::from(height) / 100.0) {
        let options = AvatarOptions::default().with_box([width; 2], height).with_step(map.grid().pixel);
        let avatar = Avatar::new(&options)?;
        let ended = up.walk(&mut &*map, &avatar, &Back, |_, _| Ok(()));
        if ended.is_ok_and(|ended| ended == Ended::Arrived) {
            return Ok(height);
        }
    }
    Ok(0.0)
}

/// The least headroom along the route, and the least of the greatest headrooms found beside it.
fn room(cloud: &PointCloud, up: &Route, width: f64) -> [f64; 2] {
    let near = near(cloud, up);
    let places: Vec<[f64; 2]> =
        std::iter::once([up.start[0], up.start[1]]).chain(up.points.iter().copied()).collect();
    let mut feet = up.start[2];
    let mut least = [f64::INFINITY; 2];
    for pair in places.windows(2) {
        let way = [0, 1].map(|k| pair[1][k] - pair[0][k]);
        let length = way[0].hypot(way[1]);
        let [dx, dy] = way.map(|x| x / length);
        for along in steps(0.0, length, STEP) {
            let at =
                |aside: f64| [pair[0][0] + along * dx - aside * dy, pair[0][1] + along * dy + aside * dx];
            let Some([step, free]) = above(&near, at(0.0), width, feet) else { continue };
            feet = step;
            let beside =
                steps(-ASIDE, ASIDE, ASIDE_STEP).filter_map(|aside| above(&near, at(aside), width, feet));
            let most = beside.map(|[_, free]| free).fold(free, f64::max);
            least = [least[0].min(free), least[1].min(most)];
        }
    }
    least
}

/// Numbers from `from` to `to`, `step` apart.
fn steps(from: f64, to: f64, step: f64) -> impl Iterator<Item = f64> {
    std::iter::successors(Some(0.0), |i| Some(i + 1.0))
        .map(move |i| from + i * step)
        .take_while(move |x| *x <= to)
}

/// Points within 1 of the bounding rectangle of the route.
fn near(cloud: &PointCloud, up: &Route) -> Vec<[f64; 3]> {
    let places = || up.points.iter().copied().chain([[up.start[0], up.start[1]]]);
    let ends = |k: usize| {
        places().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], p| [low.min(p[k]), high.max(p[k])])
    };
    let (x, y) = (ends(0), ends(1));
    let is_near = |p: &[f64; 3]| {
        [(p[0], x), (p[1], y)].iter().all(|(c, [low, high])| low - 1.0 < *c && *c < high + 1.0)
    };
    (0..cloud.len()).map(|i| cloud.point(i)).filter(is_near).collect()
}

/// Height of the highest step within a square that can be reached from `feet`, and the headroom
/// above it.
fn above(points: &[[f64; 3]], [x, y]: [f64; 2], width: f64, feet: f64) -> Option<[f64; 2]> {
    let climb = AvatarOptions::default().climb;
    let under = || {
        points
            .iter()
            .filter(|p| (p[0] - x).abs() < 0.5 * width && (p[1] - y).abs() < 0.5 * width)
            .map(|p| p[2])
    };
    let step = under().filter(|z| (z - feet).abs() <= climb).fold(f64::NEG_INFINITY, f64::max);
    let ceiling = under().filter(|z| *z > step + SAME).fold(f64::INFINITY, f64::min);
    (step > f64::NEG_INFINITY).then_some([step, ceiling - step])
}
