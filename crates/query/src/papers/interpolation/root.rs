//! A zero of a function along a path, by an interpolation search that terminates.
//!
//! Algorithm 1 of Klein & Zachmann 2005 evaluates where the straight line through the values at the
//! ends of the bracket is zero. As printed it need not terminate, and for curved functions it may
//! advance one point at a time (docs/theory). This version evaluates strictly between the ends,
//! halves the value at an end that stays (the Illinois rule), and bisects if two evaluations have
//! not halved the interval. It takes at most three times as many evaluations as a bisection by
//! length, and a few in total if the function is nearly linear.

use nearmiss_graph::{LazyPath, Levels};

/// A sequence of points, only some of which are known.
pub(crate) trait Path {
    /// The number of known points.
    fn len(&self) -> usize;
    /// The distance of the `k`-th known point from the start.
    fn along(&self, k: usize) -> f64;
    /// See [`LazyPath::look`]. The path may choose a better point than the one at `along`, unless
    /// `exactly` is set.
    fn look(&mut self, left: usize, right: usize, along: f64, exactly: bool) -> Option<usize>;
}

/// A path of a graph with levels, over points in space.
pub(crate) struct GraphPath<'a> {
    pub(crate) path: &'a mut LazyPath,
    pub(crate) levels: &'a Levels,
    pub(crate) positions: &'a [[f32; 3]],
    /// The function to first order about the last evaluated point.
    pub(crate) slope: Slope,
}

/// A function to first order: its value at a place and its gradient.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Slope {
    pub(crate) place: [f32; 3],
    pub(crate) value: f64,
    pub(crate) gradient: [f32; 3],
}

impl Slope {
    fn at(&self, x: [f32; 3]) -> f64 {
        (0..3).map(|k| f64::from(self.gradient[k]) * f64::from(x[k] - self.place[k])).sum::<f64>()
            + self.value
    }
}

impl Path for GraphPath<'_> {
    fn len(&self) -> usize {
        self.path.len()
    }

    fn along(&self, k: usize) -> f64 {
        self.path.point(k).along
    }

    fn look(&mut self, left: usize, right: usize, along: f64, exactly: bool) -> Option<usize> {
        let (slope, positions) = (self.slope, self.positions);
        let guess = |point: u32| slope.at(positions[point as usize]);
        let guessed = if exactly { None } else { self.path.look_where(self.levels, left, right, guess) };
        // Expanded parts of the path stay expanded.
        guessed.or_else(|| self.path.look(self.levels, left, right, along))
    }
}

/// The result of a search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Root {
    /// A known point at which the function is within the tolerance.
    Point(usize),
    /// An edge between a known point and the next, at which the function has different signs.
    Edge {
        /// The index of the first point.
        first: usize,
        /// The values at both points.
        values: [f64; 2],
    },
    /// A known point at which the function is undefined.
    Undefined(usize),
}

/// Evaluations in a row that may leave more than half of the interval.
const PATIENCE: u32 = 2;

/// Searches for a zero between the ends of `path`, which has at least two points. `values` are the
/// function's values at the ends, with different signs; `value` returns the value at a known point.
/// Returns `None` as soon as `value` does.
pub(crate) fn find_root<P: Path>(
    path: &mut P,
    values: [f64; 2],
    tolerance: f64,
    mut value: impl FnMut(&mut P, usize) -> Option<Option<f64>>,
) -> Option<Root> {
    let (mut left, mut right) = (0, path.len() - 1);
    let (mut at_left, mut at_right) = (values[0], values[1]);
    if at_left.abs() <= tolerance {
        return Some(Root::Point(left));
    }
    if at_right.abs() <= tolerance {
        return Some(Root::Point(right));
    }
    // Weights of the end values in the interpolation, halved for an end that stayed twice.
    let (mut weight_left, mut weight_right) = (1.0, 1.0);
    let mut left_moved = None;
    let (mut goal, mut idle) = (0.5 * (path.along(right) - path.along(left)), 0);
    loop {
        let [from, to] = [path.along(left), path.along(right)];
        let share = if idle < PATIENCE {
            let [l, r] = [(weight_left * at_left).abs(), (weight_right * at_right).abs()];
            l / (l + r)
        } else {
            0.5
        };
        let before = path.len();
        // The values may be so large that their sum overflows.
        let share = if share.is_finite() { share } else { 0.5 };
        let found = path.look(left, right, from + share * (to - from), idle == PATIENCE);
        right += path.len() - before;
        let Some(k) = found else {
            return Some(Root::Edge { first: left, values: [at_left, at_right] });
        };
        let Some(here) = value(path, k)?.filter(|value| !value.is_nan()) else {
            return Some(Root::Undefined(k));
        };
        if here.abs() <= tolerance {
            return Some(Root::Point(k));
        }
        if (here < 0.0) == (at_left < 0.0) {
            weight_right *= if left_moved == Some(true) { 0.5 } else { 1.0 };
            (left, at_left, weight_left, left_moved) = (k, here, 1.0, Some(true));
        } else {
            weight_left *= if left_moved == Some(false) { 0.5 } else { 1.0 };
            (right, at_right, weight_right, left_moved) = (k, here, 1.0, Some(false));
        }
        let span = path.along(right) - path.along(left);
        if span <= goal || idle == PATIENCE {
            (goal, idle) = (0.5 * span, 0);
        } else {
            idle += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Path, Root, find_root};

    /// Points at these positions, all known.
    struct Places(Vec<f64>);

    impl Path for Places {
        fn len(&self) -> usize {
            self.0.len()
        }

        fn along(&self, k: usize) -> f64 {
            self.0[k]
        }

        fn look(&mut self, left: usize, right: usize, along: f64, _: bool) -> Option<usize> {
            let nearer = |a: &usize, b: &usize| {
                let to = |k: usize| (self.0[k] - along).abs();
                to(*a).total_cmp(&to(*b))
            };
            (left + 1..right).min_by(nearer)
        }
    }

    /// Returns the result and the number of evaluations.
    fn search(places: Vec<f64>, f: impl Fn(usize, f64) -> f64) -> (Root, usize) {
        let last = places.len() - 1;
        let values = [f(0, places[0]), f(last, places[last])];
        let mut looks = 0;
        let found = find_root(&mut Places(places), values, 0.0, |path, k| {
            looks += 1;
            Some(Some(f(k, path.along(k))))
        });
        (found.unwrap_or(Root::Undefined(usize::MAX)), looks)
    }

    fn even(m: usize) -> Vec<f64> {
        (0..m).map(|k| f64::from(u32::try_from(k).unwrap_or(0))).collect()
    }

    /// Evaluations for every position of the root in a path of `m` points: maximum and mean.
    fn looks(m: usize, f: impl Fn(f64, f64) -> f64) -> (usize, f64) {
        let (mut most, mut all, mut count) = (0, 0, 0.0);
        for k in (0..m - 1).step_by((m / 256).max(1)) {
            let root = f64::from(u32::try_from(k).unwrap_or(0)) + 0.37;
            let (found, looks) = search(even(m), |_, x| f(x, root));
            assert!(matches!(found, Root::Edge { first, .. } if first == k), "{found:?} for {root}");
            (most, all, count) = (most.max(looks), all + looks, count + 1.0);
        }
        #[expect(clippy::cast_precision_loss, reason = "a few thousand")]
        let mean = all as f64 / count;
        (most, mean)
    }

    /// Algorithm 1 of Klein & Zachmann 2005 never terminates on a line of 50 points. This version
    /// takes two evaluations, whatever the length.
    #[test]
    fn a_line_takes_two_looks() {
        for m in [2, 3, 50, 4000, 100_000] {
            let (most, mean) = looks(m, |x, root| x - root);
            assert!(most <= 2 && mean <= 2.0, "{most}, {mean} looks for {m} points");
        }
    }

    /// Functions on which pure interpolation advances point by point.
    #[test]
    fn bent_functions_take_logarithmically_many_looks() {
        type Function = fn(f64, f64) -> f64;
        let functions: [(&str, Function); 5] = [
            ("exponential", |x, root| ((x - root) * 0.05).exp() - 1.0),
            ("a step", |x, root| if x < root { -1e-9 } else { 1.0 }),
            ("a power", |x, root| (x - root).powi(9)),
            ("a root", |x, root| (x - root).cbrt()),
            ("an odd one", |x, root| if x < root { (x - root) * 1e12 } else { x - root }),
        ];
        for (name, f) in functions {
            for (m, log) in [(64, 6), (4096, 12), (65_536, 16)] {
                let (most, _) = looks(m, f);
                assert!(most <= 3 * log + 3, "{name}: {most} looks for {m} points");
            }
        }
    }

    /// Distances along a path over a curved and noisy surface.
    #[test]
    fn a_distance_takes_a_few_looks_however_many_points_there_are() {
        let mut means = Vec::new();
        for m in [64_u32, 1024, 16_384, 262_144] {
            let all = f64::from(m);
            let (_, mean) = looks(m as usize, |x, root| {
                let bump = 0.05 * all * ((7.0 * x / all).sin() - (7.0 * root / all).sin());
                x - root + bump + 0.15 * ((x * 1.7).sin() - (root * 1.7).sin())
            });
            means.push(mean);
        }
        assert!(means[3] <= 6.0 && means[3] <= 2.0 * means[0], "{means:?} looks");
    }

    /// A change of sign is found however many there are, also if points are unevenly spaced. NaN
    /// ends the search.
    #[test]
    fn searches_end_on_any_path() {
        let (found, looks) = search(even(4096), |k, _| if k == 0 || k % 2 == 0 { -1.0 } else { 1.0 });
        assert!(matches!(found, Root::Edge { values, .. } if values[0] * values[1] < 0.0), "{found:?}");
        assert!(looks <= 40, "{looks} looks where signs alternate");
        let spaced: Vec<f64> = (0..400).map(|k| 2.0_f64.powi(k - 500)).collect();
        let (found, looks) = search(spaced, |k, _| if k < 123 { -1.0 } else { 1.0 });
        assert!(matches!(found, Root::Edge { first: 122, .. }), "{found:?}");
        assert!(looks <= 400, "{looks} looks");
        let (found, _) = search(vec![0.0; 100], |k, _| if k < 70 { -1.0 } else { 1.0 });
        assert!(matches!(found, Root::Edge { first: 69, .. }), "{found:?} where all are in one place");
        let (found, _) = search(even(100), |k, _| {
            if k == 0 {
                -1.0
            } else if k < 99 {
                f64::NAN
            } else {
                1.0
            }
        });
        assert!(matches!(found, Root::Undefined(_)), "{found:?}");
        let (found, _) = search(even(100), |_, _| 0.0);
        assert_eq!(found, Root::Point(0), "constant");
        let (found, _) = search(even(64), |k, _| if k == 0 { f64::NEG_INFINITY } else { f64::MAX });
        assert!(matches!(found, Root::Edge { first: 0, .. }), "{found:?}");
        let mut path = Places(even(10));
        assert_eq!(find_root(&mut path, [-1.0, 1.0], 0.0, |_, _| None), None, "time is up");
    }
}
