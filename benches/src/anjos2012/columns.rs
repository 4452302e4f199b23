//! §4: the gap at which a round column stops an avatar, by slices and by boxes of half the spacing.

use std::f64::consts::TAU;
use std::fmt::Write;

use nearmiss::slices::{Obstacle, Pixel, SliceMap, SliceOptions, SlicePlan};
use nearmiss::{Aabb, PointCloud};
use nearmiss_testdata::arbitrary::rng;
use nearmiss_testdata::house::{COLUMN, COLUMNS};
use rand::RngExt;

use super::{Source, made};
use crate::Failure;
use crate::sample::count;

/// Directions from which each column is approached.
const WAYS: u32 = 90;

/// Spacings of the points.
const SPACINGS: [f64; 6] = [0.01, 0.02, 0.04, 0.08, 0.16, 0.32];
const PIXELS: [f64; 2] = [0.04, 0.08];

/// Height of the columns. `BODY` is the vertical extent of the box.
const TALL: f64 = 2.5;
const BODY: [f64; 2] = [0.6, 2.1];

/// Half the width of the box.
const HALF: f64 = 0.15;

/// Mean, least and greatest gap at which the box is first stopped.
struct Gaps([f64; 3]);

impl Gaps {
    /// Moves the box towards every column from every direction until `stops` returns `true`.
    fn new(stops: impl Fn(&Aabb) -> bool) -> Self {
        let mut gaps = Vec::new();
        for [cx, cy] in COLUMNS {
            for way in 0..WAYS {
                let (s, c) = (f64::from(way) / f64::from(WAYS) * TAU).sin_cos();
                let body = |away: f64| {
                    let [x, y] = [cx + away * c, cy + away * s];
                    Aabb { min: [x - HALF, y - HALF, BODY[0]], max: [x + HALF, y + HALF, BODY[1]] }
                };
                let gap = |b: &Aabb| {
                    let d = [cx - cx.clamp(b.min[0], b.max[0]), cy - cy.clamp(b.min[1], b.max[1])];
                    d[0].hypot(d[1]) - COLUMN
                };
                let places = (0..1000_u16).map(|i| body(0.9 - 0.0009 * f64::from(i)));
                // A box that is never stopped ends in the middle of the column.
                gaps.push(places.into_iter().find(&stops).map_or(-COLUMN, |b| gap(&b)));
            }
        }
        let mean = gaps.iter().sum::<f64>() / count(gaps.len());
        let least = gaps.iter().copied().fold(f64::INFINITY, f64::min);
        Self([mean, least, gaps.iter().copied().fold(f64::NEG_INFINITY, f64::max)])
    }

    /// The gaps in millimetres, as cells of a table.
    fn told(&self) -> String {
        let [mean, least, most] = self.0.map(|gap| 1e3 * gap);
        format!("{mean:.0} | {least:.0} to {most:.0}")
    }
}

/// Points on the columns: a jittered lattice on each.
fn points(spacing: f64, seed: u64) -> Vec<[f64; 3]> {
    let rng = &mut rng(seed);
    let [around, rows] = [TAU * COLUMN, TALL].map(|length| (length / spacing).ceil());
    let cells = |n: f64| std::iter::successors(Some(0.0), |i| Some(i + 1.0)).take_while(move |i| *i < n);
    let mut points = Vec::new();
    for [cx, cy] in COLUMNS {
        for i in cells(around) {
            for j in cells(rows) {
                let turn: f64 = (i + rng.random::<f64>()) / around * TAU;
                let z = (j + rng.random::<f64>()) / rows * TALL;
                points.push([cx + COLUMN * turn.cos(), cy + COLUMN * turn.sin(), z]);
            }
        }
    }
    points
}

/// Half the mean distance of a point to its nearest neighbour.
fn half_spacing(points: &[[f64; 3]]) -> f64 {
    let nearest = |p: &[f64; 3]| {
        let away = points.iter().map(|q| (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>());
        away.filter(|d| *d > 0.0).fold(f64::INFINITY, f64::min).sqrt()
    };
    let sample: Vec<&[f64; 3]> = points.iter().step_by(points.len().div_ceil(1000)).collect();
    0.5 * sample.iter().map(|p| nearest(p)).sum::<f64>() / count(sample.len())
}

/// Writes the table that compares slices with boxes, by spacing.
///
/// # Errors
/// When a map cannot be built.
pub fn table(text: &mut String, seed: u64) -> Result<(), Failure> {
    let over = PIXELS.map(|pixel| format!(" slices, t = {pixel}: mean | least to most |")).concat();
    writeln!(
        text,
        "\n## Round columns (§4)\n\nA box of {} × {} × {} approaches columns of radius {COLUMN} from {WAYS} directions. The table shows the gap between the box and the true column where the box is first stopped, in millimetres; negative gaps are \
         inside. Half-spacing boxes are cubes around every point whose half side is half the mean distance of nearest points.\n\n\
         | points apart | half-spacing boxes: half a side | gap, mean | least to most |{over}\n| --: | --: |{}",
        2.0 * HALF,
        2.0 * HALF,
        BODY[1] - BODY[0],
        " --: |".repeat(2 + 2 * PIXELS.len())
    )?;
    for spacing in SPACINGS {
        let points = points(spacing, seed);
        let half = half_spacing(&points);
        let in_box = |b: &Aabb| {
            points.iter().any(|p| (0..3).all(|k| p[k] + half >= b.min[k] && p[k] - half <= b.max[k]))
        };
        let mut cells = vec![Gaps::new(in_box).told()];
        for pixel in PIXELS {
            let map = map(&points, pixel)?;
            cells.push(Gaps::new(|b| map.touches(b).is_ok_and(|hit| hit)).told());
        }
        writeln!(text, "| {spacing} | {:.0} | {} |", 1e3 * half, cells.join(" | "))?;
    }
    Ok(())
}

fn map(points: &[[f64; 3]], pixel: f64) -> Result<SliceMap, Failure> {
    let rule = Obstacle::Slope { degrees: 45.0, noise: Some(0.0) };
    let options = SliceOptions::default().with_pixel(Pixel::Side(pixel)).with_obstacle(rule);
    let cloud = PointCloud::from_positions(points)?;
    Ok(made(&SlicePlan::new(&options, &cloud.bounds())?, &Source::Points(cloud))?.0)
}
