//! Thickened semantics: balls of one radius about the points of both clouds.

use nearmiss_geometry::Pose;

use super::radii::distance;

/// The nearest points of two clouds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nearest {
    /// Their distance, in world units.
    pub distance: f64,
    /// Their indices, in A and in B.
    pub pair: [usize; 2],
}

/// Returns the least distance between a point of `a` and a point of `b` in the world, from all
/// pairs; `None` if either is empty. Of equally near pairs it takes the one of lower indices, A's
/// first.
#[must_use]
pub fn least_distance(a: &[[f64; 3]], pose_a: &Pose, b: &[[f64; 3]], pose_b: &Pose) -> Option<Nearest> {
    let b: Vec<_> = b.iter().map(|&q| pose_b.apply(q)).collect();
    let mut best: Option<Nearest> = None;
    for (i, &p) in a.iter().enumerate() {
        if let Some((j, d)) = nearest(&b, pose_a.apply(p))
            && best.is_none_or(|n| d < n.distance)
        {
            best = Some(Nearest { distance: d, pair: [i, j] });
        }
    }
    best
}

/// Returns `true` if balls of `radius` about the points of both clouds come within `margin` of each
/// other: iff the least point distance is at most 2 radius + margin. World units.
#[must_use]
pub fn touches(least_distance: f64, radius: f64, margin: f64) -> bool {
    least_distance <= 2.0 * radius + margin
}

/// Returns index and distance of the point nearest to `x`; of equally near points the first.
#[must_use]
pub fn nearest(points: &[[f64; 3]], x: [f64; 3]) -> Option<(usize, f64)> {
    let all = points.iter().enumerate().map(|(i, &p)| (i, distance(p, x)));
    all.min_by(|a, b| a.1.total_cmp(&b.1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_pair_of_two_lattices() {
        let a: Vec<_> = (0..27).map(|i| [f64::from(i % 3), f64::from(i / 3 % 3), f64::from(i / 9)]).collect();
        let shift = Pose::from_translation([5.0, 0.0, 0.25]);
        let n = least_distance(&a, &Pose::IDENTITY, &a, &shift).unwrap();
        assert!((n.distance - 3.0_f64.hypot(0.25)).abs() < 1e-15, "{n:?}");
        assert_eq!(n.pair, [2, 0], "lower indices first");
        assert!(touches(n.distance, 1.5, 0.1) && !touches(n.distance, 1.5, 0.0));
        assert_eq!(least_distance(&[], &Pose::IDENTITY, &a, &shift), None);
    }
}
