//! From filled voxels to slices: obstacles, heights of floors, and the noise of the points.
//!
//! Anjos et al. 2012, Fig. 2, marks a point that is more than ε from the previous one, so the
//! result depends on the order of points; it also overwrites the height that it compares with next.
//! Here a voxel is an obstacle if its highest point is more than ε σ above its lowest, in any
//! order.
//!
//! A surface that crosses from one slice into the next is one surface. The gap between the highest
//! point of a voxel and the lowest of the voxel above decides: if it is at most ε σ, both are
//! obstacles if together they span more than ε σ, otherwise they are one floor. Each voxel keeps
//! its own highest level, so a floor that is looked up in the lower slice has the height of a
//! point.

use nearmiss_lanes::parallel::map_each;
use nearmiss_store::Progress;

use crate::Grid;
use crate::grid::LEVELS;
use crate::layer::{Layer, Seen};
use crate::slice::{Canvas, Content, Slice};

/// Quantile of the spans of level voxels that is taken as noise: high enough that few floors become
/// obstacles, low enough that objects on the floor do not decide.
const QUANTILE: f64 = 0.95;

/// Least number of level voxels for an estimate of the noise.
const LEAST: u64 = 100;

/// Runs of layers whose spans are counted separately: enough for any number of threads, and few if
/// there are many thin layers.
const RUNS: usize = 256;

/// Returns the greatest number of levels that a floor may span, for ε. A small number is added
/// first, so that the rounding error of a tangent makes no difference.
pub(crate) fn most_levels(share: f64) -> i32 {
    #[expect(clippy::cast_possible_truncation, reason = "the cast saturates")]
    let most = (share * f64::from(LEVELS) + 1e-6).floor().min(f64::from(2 * LEVELS)) as i32;
    most
}

/// Estimates how far the points of a level floor spread upwards within a pixel: the 0.95-quantile
/// of the spans of level voxels, 0 if there are too few of them. A voxel is level if all four
/// neighbours are occupied and opposite neighbours differ by at most half a pixel's side in height.
/// The voxel's own span plays no part in the choice.
///
/// Voxels with an occupied voxel directly below or above are left out: they may hold only half of a
/// floor.
pub(crate) fn noise(grid: &Grid, layers: &[Layer]) -> f64 {
    let layers: Vec<Seen<'_>> = layers.iter().map(Layer::seen).collect();
    let width = grid.counts[0] as usize;
    #[expect(clippy::cast_possible_truncation, reason = "the cast saturates")]
    let step = (0.5 * grid.pixel / grid.slice_height * f64::from(LEVELS)) as i32;
    let add_layer = |spans: &mut [u64; LEVELS as usize], s: usize| {
        let layer = layers[s];
        let others = [s.checked_sub(1), Some(s + 1)].map(|s| s.and_then(|s| layers.get(s)));
        for row in 1..(grid.counts[1] as usize).saturating_sub(1) {
            for i in layer.filled(row * width + 1..((row + 1) * width).saturating_sub(1)) {
                if others.iter().flatten().any(|other| other.is_filled(i)) {
                    continue;
                }
                let beside = [i - 1, i + 1, i - width, i + width].map(|j| layer.span(j));
                let [Some(left), Some(right), Some(front), Some(back)] = beside else { continue };
                let is_level = (left[1] - right[1]).abs() <= step && (front[1] - back[1]).abs() <= step;
                if let Some([low, high]) = layer.span(i).filter(|_| is_level) {
                    spans[usize::try_from(high - low).unwrap_or(0)] += 1;
                }
            }
        }
    };
    let runs = layers.len().min(RUNS);
    let of_run = |run: usize| {
        let mut spans = [0_u64; LEVELS as usize];
        (run * layers.len() / runs..(run + 1) * layers.len() / runs).for_each(|s| add_layer(&mut spans, s));
        spans
    };
    let mut all = [0_u64; LEVELS as usize];
    for spans in map_each(runs, of_run) {
        all.iter_mut().zip(spans).for_each(|(sum, n)| *sum += n);
    }
    let count: u64 = all.iter().sum();
    if count < LEAST {
        return 0.0;
    }
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        clippy::cast_precision_loss,
        reason = "a rank"
    )]
    let rank = (QUANTILE * count as f64).ceil() as u64;
    let mut below = 0;
    let quantile = all.iter().position(|n| {
        below += n;
        below >= rank
    });
    let levels = u32::try_from(quantile.unwrap_or(0)).unwrap_or(LEVELS);
    f64::from(levels) / f64::from(LEVELS) * grid.slice_height
}

/// Passes the slices to `take`, lowest first, `together` at a time, until the first error. A floor
/// spans at most `most` levels. Frees the cells on the way, and tells `progress` the share of the
/// slices that are taken.
pub(crate) fn each<E>(
    grid: &Grid,
    layers: &mut [Layer],
    (most, together): (i32, usize),
    progress: &Progress,
    mut take: impl FnMut(Vec<Slice>) -> Result<(), E>,
) -> Result<(), E> {
    let mut first = 0;
    while first < layers.len() {
        let end = layers.len().min(first + together.max(1));
        take(map_each(end - first, |i| slice(grid, layers, first + i, most)))?;
        // The slice above still needs the last one.
        layers[first.saturating_sub(1)..end - 1].fill_with(Layer::empty);
        first = end;
        #[expect(clippy::cast_precision_loss, reason = "a share")]
        progress.reach(first as f64 / layers.len() as f64);
    }
    Ok(())
}

fn slice(grid: &Grid, layers: &[Layer], s: usize, most: i32) -> Slice {
    let [width, height, _] = grid.counts;
    let columns = width as usize;
    let mut canvas = Canvas::new(width, height);
    let own = layers[s].seen();
    let above = layers.get(s + 1).map(Layer::seen);
    let below = s.checked_sub(1).map(|s| layers[s].seen());
    for row in 0..height as usize {
        for i in own.filled(row * columns..(row + 1) * columns) {
            let Some(own) = own.span(i) else { continue };
            let up = above.and_then(|layer| layer.span(i));
            let down = below.and_then(|layer| layer.span(i));
            canvas.set(i - row * columns, row, judge(own, down, up, most));
        }
    }
    canvas.finish()
}

/// Returns the content of a voxel that spans these levels, given the spans directly below and
/// above.
fn judge([low, high]: [i32; 2], down: Option<[i32; 2]>, up: Option<[i32; 2]>, most: i32) -> Content {
    /// Levels from one slice to the next.
    const SLICE: i32 = 255;
    let [top, bottom] = [high, low].map(|level| u8::try_from(level).unwrap_or(u8::MAX - 1));
    let up = up.map(|span| span.map(|level| level + SLICE)).filter(|[from, _]| from - high <= most);
    let down = down.map(|span| span.map(|level| level - SLICE)).filter(|[_, to]| low - to <= most);
    let spans = [Some(high - low), up.map(|[_, to]| to - low), down.map(|[from, _]| high - from)];
    let is_obstacle = spans.iter().flatten().any(|span| *span > most);
    Content { top, bottom, is_obstacle }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn judged(own: [i32; 2], down: Option<[i32; 2]>, up: Option<[i32; 2]>) -> (u8, bool) {
        let content = judge(own, down, up, 17);
        assert_eq!(i32::from(content.bottom), own[0], "the bottom is its own");
        (content.top, content.is_obstacle)
    }

    #[test]
    fn spans_beyond_the_share_are_obstacles() {
        assert_eq!(judged([10, 27], None, None), (27, false));
        assert_eq!(judged([10, 28], None, None), (28, true));
    }

    #[test]
    fn a_floor_that_straddles_two_slices_is_one() {
        // Nine levels from 250 to 259.
        assert_eq!(judged([250, 253], None, Some([0, 4])), (253, false), "its own height");
        assert_eq!(judged([242, 244], None, Some([0, 4])), (244, false), "never the border of the slices");
        assert_eq!(judged([0, 4], Some([250, 253]), None), (4, false));
        // Too steep together: a wall cut by the border of two slices.
        assert_eq!(judged([240, 253], None, Some([0, 10])), (253, true));
        assert_eq!(judged([0, 10], Some([240, 253]), None), (10, true));
        // Far apart: a floor and something that hangs over it.
        assert_eq!(judged([100, 104], None, Some([10, 12])), (104, false));
        assert_eq!(judged([10, 12], Some([100, 104]), None), (12, false));
    }

    #[test]
    fn thresholds_do_not_hang_on_the_last_bit_of_a_tangent() {
        let share = |tan: f64| tan / 3.0;
        assert_eq!(most_levels(share(1.0)), most_levels(share(1.0_f64.next_down())));
        assert_eq!(most_levels(0.07), 17);
        assert_eq!(most_levels(1e300), 510);
    }
}
