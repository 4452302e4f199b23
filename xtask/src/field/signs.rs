//! Consistent signs for all normals of a grid, as far as they exist.
//!
//! The sign of an eigenvector is arbitrary. Signs are propagated over a grid of places from each to
//! its neighbours, the surest neighbours first, as Hoppe et al. 1992 orient the normals of a scan
//! along a spanning tree. A pair of neighbours that closes a loop then either agrees, or its
//! normals point to opposite sides: a flip. Where the grid has no flip, f distinguishes sides;
//! across a line of flips the sides change.

use nearmiss::geometry::nalgebra::Vector3;

/// Two neighbouring places of a grid.
pub(crate) type Pair = [usize; 2];

/// A forest of places, each with its sign relative to its parent.
struct Forest {
    parents: Vec<usize>,
    /// −1 or 1.
    signs: Vec<f64>,
}

impl Forest {
    fn root(&mut self, i: usize) -> (usize, f64) {
        let (mut top, mut sign) = (i, 1.0);
        while self.parents[top] != top {
            sign *= self.signs[top];
            top = self.parents[top];
        }
        // Shorten the path for later calls.
        let (mut at, mut left) = (i, sign);
        while self.parents[at] != top && at != top {
            let (next, own) = (self.parents[at], self.signs[at]);
            self.parents[at] = top;
            self.signs[at] = left;
            left *= own;
            at = next;
        }
        (top, sign)
    }
}

/// Returns the sign of every normal, and the pairs that flip. `pairs` come with a doubt, and are
/// processed in its order.
pub(crate) fn follow(normals: &[Vector3<f64>], mut pairs: Vec<(f64, Pair)>) -> (Vec<f64>, Vec<Pair>) {
    pairs.sort_by(|(s, p), (t, q)| s.total_cmp(t).then(p.cmp(q)));
    let count = normals.len();
    let mut forest = Forest { parents: (0..count).collect(), signs: vec![1.0; count] };
    let mut flips = Vec::new();
    for (_, [i, j]) in pairs {
        let agree = if normals[i].dot(&normals[j]) < 0.0 { -1.0 } else { 1.0 };
        let ((top, sign), (other, other_sign)) = (forest.root(i), forest.root(j));
        let relative = sign * other_sign * agree;
        if top != other {
            forest.parents[other] = top;
            forest.signs[other] = relative;
        } else if relative < 0.0 {
            flips.push([i, j]);
        }
    }
    ((0..count).map(|i| forest.root(i).1).collect(), flips)
}

#[cfg(test)]
mod tests {
    use nearmiss_testdata::arbitrary::rng;
    use rand::RngExt;

    use super::*;

    /// Returns the neighbours of a square grid, with equal doubts.
    fn grid(side: usize) -> Vec<(f64, Pair)> {
        let all = (0..side * side).flat_map(|i| {
            let right = (i % side + 1 < side).then_some((0.0, [i, i + 1]));
            let down = (i / side + 1 < side).then_some((0.0, [i, i + side]));
            right.into_iter().chain(down)
        });
        all.collect()
    }

    fn field(side: usize, angle: impl Fn(f64, f64) -> f64) -> Vec<Vector3<f64>> {
        let rng = &mut rng(3);
        let coordinate = |k: usize| {
            f64::from(u32::try_from(k).unwrap()) - 0.5 * f64::from(u32::try_from(side).unwrap() - 1)
        };
        let all = (0..side * side).map(|i| {
            let turn = angle(coordinate(i % side), coordinate(i / side));
            let sign = if rng.random_bool(0.5) { -1.0 } else { 1.0 };
            sign * Vector3::new(turn.cos(), turn.sin(), 0.0)
        });
        all.collect()
    }

    #[test]
    fn directions_that_have_a_sign_get_one_whatever_signs_they_came_with() {
        let normals = field(20, |x, y| 0.1 * x + 0.05 * y);
        let (signs, flips) = follow(&normals, grid(20));
        assert!(flips.is_empty(), "{flips:?}");
        for (_, [i, j]) in grid(20) {
            assert!((signs[i] * normals[i]).dot(&(signs[j] * normals[j])) > 0.9, "{i} and {j} agree");
        }
    }

    #[test]
    fn about_a_half_turn_there_is_no_sign_and_the_cut_leads_outward() {
        // Once around the middle, the direction turns by half a turn.
        let normals = field(20, |x, y| 0.5 * y.atan2(x));
        let (_, flips) = follow(&normals, grid(20));
        let on_ring = |i: usize| [i % 20, i / 20].iter().any(|k| [0, 19].contains(k));
        let through = flips.iter().filter(|[i, j]| on_ring(*i) && on_ring(*j)).count();
        assert_eq!(through % 2, 1, "round the outside an odd number of flips: {flips:?}");
    }
}
