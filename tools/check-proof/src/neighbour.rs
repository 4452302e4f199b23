//! Nearest points, by a tree of this checker's own.

use std::ops::Range;

/// The maximum number of points in a leaf.
const LEAF: usize = 8;

/// A balanced tree whose nodes are the middles of ranges.
pub(crate) struct Neighbours<'a> {
    points: &'a [[f32; 3]],
    /// Indices of the points in the order of the tree.
    order: Vec<u32>,
    /// The axis across which the range about each middle is split.
    axes: Vec<u8>,
}

/// The nearest point so far.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Nearest {
    pub(crate) index: u32,
    pub(crate) distance_sq: f64,
}

impl<'a> Neighbours<'a> {
    pub(crate) fn new(points: &'a [[f32; 3]]) -> Self {
        let mut tree =
            Self { points, order: (0..).take(points.len()).collect(), axes: vec![0; points.len()] };
        tree.split(0..points.len());
        tree
    }

    fn split(&mut self, range: Range<usize>) {
        if range.len() <= LEAF {
            return;
        }
        let points = self.points;
        let mut bounds = [[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]];
        for &i in &self.order[range.clone()] {
            for k in 0..3 {
                bounds[0][k] = bounds[0][k].min(points[i as usize][k]);
                bounds[1][k] = bounds[1][k].max(points[i as usize][k]);
            }
        }
        let width = |k: usize| bounds[1][k] - bounds[0][k];
        let axis = (0..3_u8).max_by(|x, y| width((*x).into()).total_cmp(&width((*y).into()))).unwrap_or(0);
        let middle = usize::midpoint(range.start, range.end);
        let along = |i: &u32| points[*i as usize][usize::from(axis)];
        self.order[range.clone()]
            .select_nth_unstable_by(middle - range.start, |x, y| along(x).total_cmp(&along(y)));
        self.axes[middle] = axis;
        self.split(range.start..middle);
        self.split(middle + 1..range.end);
    }

    /// Returns the point nearest to `x`; of equally near ones that of least index.
    pub(crate) fn nearest(&self, x: [f64; 3]) -> Nearest {
        let mut best = Nearest { index: u32::MAX, distance_sq: f64::INFINITY };
        self.search(0..self.order.len(), x, &mut best);
        best
    }

    fn search(&self, range: Range<usize>, x: [f64; 3], best: &mut Nearest) {
        if range.len() <= LEAF {
            for &index in &self.order[range] {
                self.offer(index, x, best);
            }
            return;
        }
        let middle = usize::midpoint(range.start, range.end);
        let axis = usize::from(self.axes[middle]);
        self.offer(self.order[middle], x, best);
        let beyond = x[axis] - f64::from(self.points[self.order[middle] as usize][axis]);
        let (near, far) = (range.start..middle, middle + 1..range.end);
        let (near, far) = if beyond < 0.0 { (near, far) } else { (far, near) };
        self.search(near, x, best);
        // An equally near point may have a lower index.
        if beyond * beyond <= best.distance_sq {
            self.search(far, x, best);
        }
    }

    fn offer(&self, index: u32, x: [f64; 3], best: &mut Nearest) {
        let p = self.points[index as usize];
        let distance_sq = (0..3).map(|k| (f64::from(p[k]) - x[k]).powi(2)).sum();
        if (distance_sq, index) < (best.distance_sq, best.index) {
            *best = Nearest { index, distance_sq };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::Source;

    #[test]
    fn agrees_with_all_points() {
        let mut source = Source::new(7);
        for size in [1, 8, 9, 100, 1000] {
            // A coarse grid, so that many points are equally near.
            #[expect(clippy::cast_possible_truncation, reason = "small integers")]
            let points: Vec<[f32; 3]> =
                (0..size).map(|_| source.in_ball().map(|x| (x * 5.0).round() as f32)).collect();
            let tree = Neighbours::new(&points);
            for _ in 0..300 {
                let x = source.in_ball().map(|x| (x * 12.0).round() * 0.5);
                let distance = |i: u32| -> f64 {
                    (0..3).map(|k| (f64::from(points[i as usize][k]) - x[k]).powi(2)).sum()
                };
                let expected = (0..size)
                    .map(|i| (distance(i), i))
                    .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
                let found = tree.nearest(x);
                assert_eq!(Some((found.distance_sq, found.index)), expected);
            }
        }
    }
}
