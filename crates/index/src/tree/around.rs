//! Boxes near a body, the nearest ones first.

use std::ops::ControlFlow;

use fearless_simd::{Level, Simd, dispatch};

use super::bodies::BoxBody;
use super::cut::{BoxSearch, BoxTree};
use super::starts::BoxStarts;
use super::walk::{CutBoxVisitor, Stack};

impl BoxTree {
    /// Visits the boxes near a body, the nearest ones of a group first, until `visitor` ends the search.
    /// Starts at the groups of a [grid](super::BoxGrid) or at the root. Does not allocate.
    ///
    /// Distances are lower bounds up to rounding, which is below 8e-6 of the greatest coordinate of the
    /// boxes and the body.
    #[inline]
    pub fn visit_near<V: CutBoxVisitor>(
        &self,
        level: Level,
        (body, starts): (&BoxBody, Option<&BoxStarts<'_>>),
        visitor: &mut V,
    ) -> ControlFlow<()> {
        if self.is_empty() {
            return ControlFlow::Continue(());
        }
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || {
                let (mut search, mut stack) = (BoxSearch { tree: self, query: body, visitor }, Stack::new());
                let root = if starts.is_none() { Some(self.groups().root()) } else { None };
                let top = starts.map_or(0, |starts| stack.put(starts.all()));
                self.groups().walk_on(simd, root, (&mut stack, top), &mut search)
            },
        ))
    }
}

#[cfg(test)]
mod tests {
    use nearmiss_testdata::arbitrary::{point_in, rng, rotation};
    use nearmiss_testdata::instructions::levels;
    use rand::RngExt;

    use super::*;
    use crate::tree::cut::CutBox;
    use crate::tree::cut::samples::{Visited, random_boxes, single};

    type Vector = [f64; 3];

    fn dot(a: Vector, b: Vector) -> f64 {
        a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    }

    /// The greatest of three distances, in double precision: along the upright axes, along the normals of the
    /// slabs, and along the axes of the body.
    fn distance(of: &CutBox, body: &BoxBody) -> f64 {
        let double = |v: [f32; 3]| v.map(f64::from);
        let (centre, half) = (double(body.centre), double(body.half));
        let reach = |way: Vector| (0..3).map(|j| half[j] * dot(way, double(body.axes[j])).abs()).sum::<f64>();
        let beyond = |low: f64, high: f64, way: Vector| {
            let at = dot(way, centre);
            ((low - at).max(at - high) - reach(way)).max(0.0).powi(2)
        };
        let unit = |k: usize| [0, 1, 2].map(|j| if j == k { 1.0 } else { 0.0 });
        let upright = (0..3).map(|k| beyond(of.min[k].into(), of.max[k].into(), unit(k))).sum::<f64>();
        let slabs = of.slabs.map(|slab| {
            let [low, high] = if body.is_inner { slab.inner } else { slab.between };
            (double(slab.normal), f64::from(low), f64::from(high))
        });
        let across = slabs.iter().map(|&(normal, low, high)| beyond(low, high, normal)).sum::<f64>();
        let own = (0..3).filter(|&j| half[j] > 0.0).map(|j| {
            let axis = double(body.axes[j]);
            let middle: f64 =
                slabs.iter().map(|&(normal, low, high)| dot(normal, axis) * 0.5 * (low + high)).sum();
            let wide: f64 =
                slabs.iter().map(|&(normal, low, high)| dot(normal, axis).abs() * 0.5 * (high - low)).sum();
            ((middle - dot(axis, centre)).abs() - wide - half[j]).max(0.0).powi(2)
        });
        upright.max(across).max(own.sum()).sqrt()
    }

    #[test]
    fn all_boxes_near_a_body_are_visited_and_no_others() {
        let rng = &mut rng(43);
        let (mut near, mut far) = (0, 0);
        for count in [0, 1, 15, 16, 17, 256, 257, 700, 5000] {
            let boxes = random_boxes(rng, count);
            let tree = BoxTree::new(boxes.len(), |i| boxes[i]);
            let grid = tree.cells(Level::new(), 0.3, 1e4);
            assert_eq!(grid.is_some(), count > 0);
            for round in 0..240 {
                let centre = point_in(rng, 1.5);
                let turn = rotation(rng);
                let axes =
                    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|axis| single(turn.rotate(axis)));
                let lengths = [0.2, 0.1, 0.03].map(|most| rng.random_range(0.0..most));
                let half = [0, 1, 2].map(|k| if k < round % 4 { lengths[k] } else { 0.0 });
                let core = dot(half, half).sqrt();
                let most = single([0.28 - core, rng.random_range(0.0..0.2), 1.0])[round % 3].max(0.0);
                let body = BoxBody::new(single(centre), axes, single(half), round % 2 == 0);
                let starts = grid.as_ref().and_then(|grid| grid.near(centre, core, f64::from(most) + 1e-5));
                // Of 5,000 boxes too many are near.
                let may_not_tell = count == 0 || count == 5000 || core + f64::from(most) > 0.29;
                assert!(may_not_tell || starts.is_some(), "{count}, {round}: the grid tells");
                for level in levels() {
                    for starts in [None, starts.as_ref()] {
                        let mut found = Visited { most, ..Visited::default() };
                        assert!(tree.visit_near(level, (&body, starts), &mut found).is_continue());
                        let mut numbers = found.numbers.clone();
                        numbers.sort_unstable();
                        assert!(numbers.windows(2).all(|pair| pair[0] < pair[1]), "each once");
                        for (number, own) in boxes.iter().enumerate() {
                            let is_visited = numbers.binary_search(&number).is_ok();
                            let off = distance(own, &body) - f64::from(most);
                            if off < -1e-5 {
                                near += 1;
                                assert!(is_visited, "{count}, {round}: {own:?}, {body:?}");
                            } else if off > 1e-5 {
                                far += 1;
                                assert!(!is_visited, "{count}, {round}: {own:?}, {body:?}");
                            }
                        }
                        // The search ends where the visitor ends it.
                        if let Some(&last) = found.numbers.get(found.numbers.len() / 2) {
                            let mut half = Visited { most, last: Some(last), ..Visited::default() };
                            assert!(tree.visit_near(level, (&body, starts), &mut half).is_break());
                            assert_eq!(half.numbers, found.numbers[..=found.numbers.len() / 2]);
                        }
                    }
                }
            }
        }
        assert!(near > 20_000 && far > 1_000_000, "{near} near, {far} far");
    }

    /// A cell near more groups than it can list starts at the root, and a place far away at none.
    #[test]
    fn the_grid_tells_where_nothing_is() {
        let boxes = random_boxes(&mut rng(47), 256);
        let crowd = BoxTree::new(1000, |i| boxes[i % 256]);
        let grid = crowd.cells(Level::new(), 0.3, 1e4).unwrap();
        assert!(grid.near([0.25, 0.5, -0.5], 0.0, 0.1).is_none());
        assert!(grid.near([0.25, 0.5, f64::NAN], 0.0, 0.1).is_none_or(|starts| starts.is_empty()));
        assert!(grid.near([9.0; 3], 0.0, 0.1).is_some_and(|starts| starts.is_empty()));
        assert!(grid.near([9.0; 3], 0.0, 1e9).is_none());
        assert!(grid.near([9.0; 3], 0.0, f64::NAN).is_none());
        // As many groups as a cell lists.
        let few = BoxTree::new(32 * 16, |i| boxes[i % 256]);
        let grid = few.cells(Level::new(), 0.3, 1e4).unwrap();
        assert!(grid.near([0.25, 0.5, -0.5], 0.0, 0.1).is_some_and(|starts| !starts.is_empty()));
    }
}
