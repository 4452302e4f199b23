//! The spacing of every point: the distance of its neighbours, smoothed.
//!
//! Raw spacing: the distance to the K-th nearest other point, K = 6. The point and its K nearest
//! may look like a line (λ2 < 0.05 λ3 of their covariance, as on a LiDAR ring). Then K grows by
//! one, at most to 256, until they do not, and one of them is, seen from the point, more across
//! their main direction than along it (an arc has none). If that does not happen, the distance to
//! the 6th counts. A point is a bend in a ring if its own six are no line, but it is among the six
//! nearest of three or more points whose six are a line. Its distance says nothing about a surface.
//!
//! Smoothed spacing: `r_i := min_j (r_j + 0.3 ‖p_i − p_j‖)`, so that a lone point cannot affect a
//! dense region. The minimum is over i itself, unless it is a bend, and all j that are neither
//! lines to the end nor bends.

use nalgebra::{Matrix3, Vector3};

use super::eigen::symmetric_eigen;

/// K: the rank of the neighbour that defines the spacing.
pub const RANK: usize = 6;

/// The greatest K where neighbours look like a line.
pub const GREATEST_RANK: usize = 256;

/// Points look like a line if λ2 is less than this share of λ3.
pub const LINE_RATIO: f64 = 0.05;

/// The greatest slope of smoothed spacing, per unit of distance.
pub const SLOPE: f64 = 0.3;

/// The spacing of a point, and the arrangement of its neighbours.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spacing {
    /// The distance, in the unit of the points.
    pub radius: f64,
    /// `true` if the first K look like a line.
    pub is_ring: bool,
    /// `true` if the radius measures the density of a surface: not on a line to the end, nor at a
    /// bend.
    pub speaks: bool,
}

/// Returns the smoothed spacing of every point: [`smoothed`] of [`spacings`]. In the unit of
/// `points`.
#[must_use]
pub fn radii(points: &[[f64; 3]]) -> Vec<f64> {
    smoothed(points, &spacings(points))
}

/// Returns the raw spacing of every point, in the unit of `points`.
#[must_use]
pub fn spacing(points: &[[f64; 3]]) -> Vec<f64> {
    spacings(points).iter().map(|s| s.radius).collect()
}

/// Returns the raw spacing of every point, and the arrangement of its neighbours.
///
/// Other points at the same place are not counted, and of several at one place only the first. Of
/// equally far neighbours, the one of lower index is the nearer. If fewer than K others exist, the
/// farthest counts; without any, the spacing is zero.
#[must_use]
pub fn spacings(points: &[[f64; 3]]) -> Vec<Spacing> {
    let mut all: Vec<Spacing> = (0..points.len()).map(|i| spacing_of(points, i)).collect();
    let mut votes = vec![0; points.len()];
    for i in (0..points.len()).filter(|&i| all[i].is_ring) {
        for (_, j) in others(points, i).into_iter().take(RANK) {
            votes[j] += 1;
        }
    }
    for (spacing, votes) in all.iter_mut().zip(votes) {
        spacing.speaks &= spacing.is_ring || 2 * votes < RANK;
    }
    all
}

/// Returns distance and index of the other points, the first at each place, by distance, then
/// index.
fn others(points: &[[f64; 3]], i: usize) -> Vec<(f64, usize)> {
    let mut all: Vec<(f64, usize)> =
        (0..points.len()).map(|j| (distance(points[i], points[j]), j)).filter(|&(d, _)| d > 0.0).collect();
    all.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut distinct: Vec<(f64, usize)> = Vec::new();
    for (d, j) in all {
        // Points at one place are equally far, so they are among the last kept.
        let same = |other: &&(f64, usize)| other.0.total_cmp(&d).is_eq();
        if distinct.iter().rev().take_while(same).all(|other| points[other.1] != points[j]) {
            distinct.push((d, j));
        }
    }
    distinct
}

fn spacing_of(points: &[[f64; 3]], i: usize) -> Spacing {
    let others = others(points, i);
    let first = others.get(..RANK).unwrap_or(&others);
    let radius = first.last().map_or(0.0, |other| other.0);
    let group = |k: usize| -> Vec<[f64; 3]> {
        [points[i]].into_iter().chain(others[..k].iter().map(|other| points[other.1])).collect()
    };
    if first.len() < RANK || !looks_like_a_line(&group(RANK)) {
        return Spacing { radius, is_ring: false, speaks: true };
    }
    let most = others.len().min(GREATEST_RANK);
    let grown = (RANK + 1..=most).find(|&k| !looks_like_a_line(&group(k)) && lies_across(&group(k)));
    let radius = grown.map_or(radius, |k| others[k - 1].0);
    Spacing { radius, is_ring: true, speaks: grown.is_some() }
}

/// Returns `true` if a point of `group` is more across its main direction than along it, seen from
/// the first.
fn lies_across(group: &[[f64; 3]]) -> bool {
    let main: Vector3<f64> = symmetric_eigen(&covariance(group)).vectors[2].into();
    group.iter().any(|&p| {
        let d = Vector3::from(p) - Vector3::from(group[0]);
        2.0 * d.dot(&main).powi(2) < d.norm_squared()
    })
}

/// Returns `true` if the covariance of `group` about its mean has λ2 < 0.05 λ3.
#[must_use]
pub fn looks_like_a_line(group: &[[f64; 3]]) -> bool {
    let [_, middle, greatest] = symmetric_eigen(&covariance(group)).values;
    middle < LINE_RATIO * greatest
}

/// Returns the covariance of `group` about its mean.
fn covariance(group: &[[f64; 3]]) -> Matrix3<f64> {
    let sum: Vector3<f64> = group.iter().map(|&p| Vector3::from(p)).sum();
    let n = count(group.len());
    let mean = sum / n;
    let mut covariance = Matrix3::zeros();
    for &p in group {
        let d = Vector3::from(p) - mean;
        covariance += d * d.transpose() / n;
    }
    covariance
}

/// Returns `r_i := min_j (r_j + 0.3 ‖p_i − p_j‖)` over i, unless it is a bend, and all j with
/// `speaks`.
///
/// # Panics
/// If there is not one value for each point.
#[must_use]
pub fn smoothed(points: &[[f64; 3]], raw: &[Spacing]) -> Vec<f64> {
    assert_eq!(points.len(), raw.len(), "one value for each point");
    let least = |(p, own): (&[f64; 3], &Spacing)| {
        let speaking = points.iter().zip(raw).filter(|(_, r)| r.speaks);
        let of_others =
            speaking.map(|(q, r)| r.radius + SLOPE * distance(*p, *q)).fold(f64::INFINITY, f64::min);
        let is_bend = !own.is_ring && !own.speaks;
        if is_bend && of_others.is_finite() { of_others } else { of_others.min(own.radius) }
    };
    points.iter().zip(raw).map(least).collect()
}

/// Returns the least of `values` that at least a share `q` of them does not exceed; `q` in (0, 1].
///
/// # Panics
/// If there is no value.
#[must_use]
pub fn quantile(values: &[f64], q: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "between 0 and the number of values"
    )]
    let rank = (q * count(sorted.len())).ceil().max(1.0) as usize;
    sorted[rank - 1]
}

/// Converts a number of points to `f64`.
#[expect(clippy::cast_precision_loss, reason = "far below 2^53 points")]
pub(crate) fn count(n: usize) -> f64 {
    n as f64
}

pub(super) fn distance(p: [f64; 3], q: [f64; 3]) -> f64 {
    (Vector3::from(p) - Vector3::from(q)).norm()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_square_lattice_has_spacing_root_two() {
        let points: Vec<_> = (0..121).map(|i| [f64::from(i % 11), f64::from(i / 11), 0.0]).collect();
        let raw = spacing(&points);
        assert!((raw[60] - 2.0_f64.sqrt()).abs() < 1e-15, "middle: {}", raw[60]);
        assert!((raw[0] - 5.0_f64.sqrt()).abs() < 1e-15, "corner: {}", raw[0]);
    }

    #[test]
    fn a_line_reaches_for_the_next_ring() {
        // Two rings of a scanner: steps of 0.1 along, 1.2 across.
        let ring = |y: f64| (0..41).map(move |i| [0.1 * f64::from(i), y, 0.0]);
        let points: Vec<_> = ring(0.0).chain(ring(1.2)).collect();
        let raw = spacing(&points);
        assert!((raw[20] - 1.2).abs() < 1e-12, "one point of the other ring ends the growth: {}", raw[20]);
        let single: Vec<_> = ring(0.0).collect();
        assert!((spacing(&single)[0] - 0.6).abs() < 1e-12, "alone, the sixth counts");
        let far: Vec<_> = ring(0.0).chain(ring(1e3)).chain([[0.0, -1e3, 0.0]]).collect();
        assert!((radii(&far)[20] - 0.3).abs() < 1e-12, "beyond the 256th nothing is looked for");
    }

    #[test]
    fn a_circle_alone_is_a_line() {
        let turn = |i: u32| (f64::from(i) * 0.01).sin_cos();
        let points: Vec<_> = (0..628).map(turn).map(|(s, c)| [3.0 * c, 3.0 * s, 0.0]).collect();
        let all = spacings(&points);
        assert!(all[300].is_ring && !all[300].speaks && all[300].radius < 0.1, "{:?}", all[300]);
    }

    #[test]
    fn a_bend_takes_the_spacing_about_it() {
        // Rings 1.2 apart with steps of 0.1 and a kink to one side in the middle of one.
        let ring = |y: f64| (0..41).map(move |i| [0.1 * f64::from(i), y, 0.0]);
        let mut points: Vec<_> = (0..5).flat_map(|k| ring(1.2 * f64::from(k))).collect();
        let kink = 2 * 41 + 20;
        points[kink][1] += 0.13;
        let raw = spacings(&points);
        assert!(!raw[kink].speaks && raw[kink].radius < 0.4, "{:?}", raw[kink]);
        assert!(radii(&points)[kink] > 1.0, "{}", radii(&points)[kink]);
    }

    #[test]
    fn duplicates_change_nothing() {
        let points: Vec<_> = (0..64).map(|i| [f64::from(i % 8), f64::from(i / 8), 0.0]).collect();
        let mut twice = points.clone();
        twice.extend(&points);
        assert_eq!(spacing(&twice)[..64], spacing(&points));
    }

    #[test]
    fn a_lone_point_takes_its_neighbours_spacing() {
        let mut points: Vec<_> = (0..64).map(|i| [f64::from(i % 8), f64::from(i / 8), 0.0]).collect();
        points.push([3.5, 3.5, 10.0]);
        let raw = spacings(&points);
        let smooth = smoothed(&points, &raw);
        assert!(raw[64].radius > 10.0 && smooth[64] < 5.0, "{} to {}", raw[64].radius, smooth[64]);
        assert!((quantile(&[3.0, 1.0, 2.0], 0.5) - 2.0).abs() < 1e-15);
        assert!((quantile(&[3.0, 1.0, 2.0], 1.0) - 3.0).abs() < 1e-15);
    }
}
