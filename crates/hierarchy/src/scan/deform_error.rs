//! Why new positions cannot replace those of a deforming mesh or scan.

use fearless_simd::{Level, Simd, dispatch};
use nearmiss_geometry::{Aabb, CloudError};
use nearmiss_lanes::parallel::both;
use thiserror::Error;

use crate::scan::options::BuildError;

/// The error of a deformation. What was to be deformed is unchanged.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum DeformError {
    /// The number of positions differs from that of the first frame.
    #[error("expected {expected} {what}, as in the first frame, got {got}; start anew from this frame")]
    Count {
        /// "points" or "vertices".
        what: &'static str,
        /// The number in the first frame.
        expected: usize,
        /// The number of positions given.
        got: usize,
    },
    /// A coordinate is NaN or infinite.
    #[error("expected finite coordinates, got {position:?} ({what} {index}); correct it")]
    NotFinite {
        /// "point" or "vertex".
        what: &'static str,
        /// Its index.
        index: usize,
        /// Its coordinates.
        position: [f64; 3],
    },
    /// The positions are so far away, or the extent so large, that coordinates overflow.
    #[error(
        "expected coordinates below {limit:e}, got {got:e}; scale the positions, or start anew from this frame"
    )]
    TooFar {
        /// The limit.
        limit: f64,
        /// The greatest coordinate.
        got: f64,
    },
    /// A depth frame whose number of points is not that of some rows of pixels.
    #[error(
        "expected {width} points in each row of pixels, got {got} points in all; give one for each pixel, NaN for holes"
    )]
    Image {
        /// The number of pixels in a row.
        width: usize,
        /// The number of points.
        got: usize,
    },
    /// Points that were repeated in the first frame are not any longer.
    #[error(
        "expected point {index} to stay with point {twin}, with which it coincided in the first frame, \
         got a distance of {distance}; start anew from this frame"
    )]
    Apart {
        /// The index of the repeated point.
        index: u32,
        /// The index of the point that represents it.
        twin: u32,
        /// Their distance now.
        distance: f64,
    },
    /// The scan that is to deform was prepared from repeated points, and it is not known which.
    #[error("expected distinct points, got {count} repeated ones; start from the points of the first frame")]
    Repeated {
        /// Their number.
        count: usize,
    },
    /// The scan has a graph, or uses distances along one.
    #[error(
        "expected a scan without a graph, got one with: paths along it do not follow a deformation; \
         prepare the scan without a graph, or prepare each frame anew with one"
    )]
    Graph,
    /// The points of a frame are no cloud.
    #[error(transparent)]
    Cloud(#[from] CloudError),
    /// A frame cannot be prepared.
    #[error(transparent)]
    Build(#[from] BuildError),
}

/// Returns the bounds of positions, all of which must be finite. `what` names one of them.
pub(crate) fn bounds_of(what: &'static str, positions: &[[f64; 3]]) -> Result<Aabb, DeformError> {
    // NaN and infinities survive in the sum, so that one pass decides in almost all cases.
    let (bounds, sum) = bounds_and_sum(positions);
    if sum.is_finite() {
        return Ok(bounds);
    }
    let is_bad = |p: &[f64; 3]| p.iter().any(|x| !x.is_finite());
    match positions.iter().position(is_bad) {
        Some(index) => Err(DeformError::NotFinite { what, index, position: positions[index] }),
        // Finite coordinates whose sum overflows.
        None => Ok(bounds),
    }
}

/// Returns the bounds of positions, and a sum that is finite if all of them are.
fn bounds_and_sum(positions: &[[f64; 3]]) -> (Aabb, f64) {
    const TASK: usize = 1 << 14;
    if positions.len() > TASK {
        let (left, right) = positions.split_at(positions.len() / 2);
        let ((mut bounds, sum), (other, more)) = both(|| bounds_and_sum(left), || bounds_and_sum(right));
        bounds.grow(other.min);
        bounds.grow(other.max);
        return (bounds, sum + more);
    }
    dispatch!(Level::new(), simd => simd.vectorize(
        #[inline(always)]
        || bounds_of_few(positions),
    ))
}

#[inline(always)]
fn bounds_of_few(positions: &[[f64; 3]]) -> (Aabb, f64) {
    // The coordinates of eight points, which fill whole registers.
    const ROW: usize = 24;
    const PLACES: usize = 8;
    let (mut low, mut high, mut sums) = ([f64::INFINITY; ROW], [f64::NEG_INFINITY; ROW], [0.0; ROW]);
    let (rows, rest) = positions.as_flattened().as_chunks::<ROW>();
    let mut take = |i: usize, x: f64| {
        low[i] = if x < low[i] { x } else { low[i] };
        high[i] = if x > high[i] { x } else { high[i] };
        sums[i] += 0.0 * x;
    };
    // Several places are read by turns, as a core reads one after the other at a fraction of the speed.
    let (places, left) = rows.split_at(rows.len() / PLACES * PLACES);
    let part = places.len() / PLACES;
    for k in 0..part {
        for place in 0..PLACES {
            let row = &places[place * part + k];
            for i in 0..ROW {
                take(i, row[i]);
            }
        }
    }
    for (i, x) in left.as_flattened().iter().chain(rest).enumerate() {
        take(i % ROW, *x);
    }
    let mut bounds = Aabb::EMPTY;
    for i in 0..ROW {
        bounds.min[i % 3] = bounds.min[i % 3].min(low[i]);
        bounds.max[i % 3] = bounds.max[i % 3].max(high[i]);
    }
    (bounds, sums.iter().sum())
}
