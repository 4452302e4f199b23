//! Boxes along a ray, the first ones first.

use std::ops::ControlFlow;

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x16, mask32x16};
use nearmiss_lanes::wide::{along, load};

use super::Boxes;
use super::cut::{BoxQuery, BoxSearch, BoxTree, Slabs};
use super::walk::{CutBoxVisitor, Stack};

/// The least component of a direction by which lengths are divided.
const LEAST: f32 = 1e-12;

/// A ray that boxes are compared with, or the path of a ball along it.
#[derive(Debug, Clone, Copy)]
pub struct BoxRay {
    /// Where the ray enters a box that is grown by its radius, relative to a corner of the box.
    before: [f32; 3],
    /// The same where it leaves.
    behind: [f32; 3],
    /// The length of the ray for a unit of each coordinate.
    per_unit: [f32; 3],
    from: [f32; 3],
    /// A unit vector.
    way: [f32; 3],
    /// The radius by which boxes are grown.
    radius: f32,
}

impl BoxRay {
    /// The ray from `from` along `way`, a unit vector. Boxes are grown by `radius`, which includes all
    /// rounding errors of lengths.
    #[must_use]
    pub fn new(from: [f32; 3], way: [f32; 3], radius: f32) -> Self {
        let way = way.map(|c| if c.abs() < LEAST { LEAST.copysign(c) } else { c });
        let grown = way.map(|c| radius.copysign(c));
        Self {
            before: [0, 1, 2].map(|k| from[k] + grown[k]),
            behind: [0, 1, 2].map(|k| from[k] - grown[k]),
            per_unit: way.map(|c| 1.0 / c),
            from,
            way,
            radius,
        }
    }
}

impl Boxes {
    /// Returns the distances along a ray at which it enters the boxes and leaves them. It passes beside those
    /// that it leaves before it enters them.
    #[inline(always)]
    fn stretches<S: Simd>(&self, simd: S, ray: &BoxRay) -> [f32x16<S>; 2] {
        let (mut enter, mut exit) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, f32::MAX));
        for k in 0..3 {
            let per_unit = ray.per_unit[k];
            let (first, last) =
                if per_unit > 0.0 { (&self.min[k], &self.max[k]) } else { (&self.max[k], &self.min[k]) };
            enter = enter.max((f32x16::load_array_ref(simd, first) - ray.before[k]) * per_unit);
            exit = exit.min((f32x16::load_array_ref(simd, last) - ray.behind[k]) * per_unit);
        }
        [enter, exit]
    }
}

impl Slabs {
    /// Shortens the stretches of a ray to those in the slabs.
    #[inline(always)]
    fn cut<S: Simd>(&self, simd: S, ray: &BoxRay, [enter, exit]: [f32x16<S>; 2]) -> [f32x16<S>; 2] {
        let normal = load(simd, &self.normal);
        let (at, speed) = (along(normal, ray.from), along(normal, ray.way));
        let is_still: mask32x16<S> = speed.abs().simd_lt(LEAST);
        let per_unit = f32x16::splat(simd, 1.0) / is_still.select(f32x16::splat(simd, LEAST), speed);
        let low = (f32x16::load_array_ref(simd, &self.between[0]) - at - ray.radius) * per_unit;
        let high = (f32x16::load_array_ref(simd, &self.between[1]) - at + ray.radius) * per_unit;
        [enter.max(low.min(high)), exit.min(low.max(high))]
    }
}

impl BoxTree {
    /// Visits the boxes along a ray, those of a group that it enters first before the others, until
    /// `visitor` ends the search. Does not allocate.
    #[inline]
    pub fn visit_along<V: CutBoxVisitor>(
        &self,
        level: Level,
        ray: &BoxRay,
        visitor: &mut V,
    ) -> ControlFlow<()> {
        if self.is_empty() {
            return ControlFlow::Continue(());
        }
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || {
                let mut search = BoxSearch { tree: self, query: ray, visitor };
                self.groups().walk_near(simd, self.groups().root(), &mut Stack::new(), &mut search)
            },
        ))
    }
}

impl BoxQuery for BoxRay {
    /// The squared distances along the ray at which it enters the boxes; infinite where it passes beside.
    #[inline(always)]
    fn distances_sq<S: Simd>(
        &self,
        simd: S,
        tree: &BoxTree,
        ((level, group), boxes): ((usize, usize), &Boxes),
        _: f32,
    ) -> f32x16<S> {
        let mut stretches = boxes.stretches(simd, self);
        let mut passes: mask32x16<S> = stretches[0].simd_le(stretches[1]);
        if level == 0 {
            for slabs in &tree.slabs[group] {
                if passes.all_false() {
                    break;
                }
                stretches = slabs.cut(simd, self, stretches);
                passes = stretches[0].simd_le(stretches[1]);
            }
        }
        let [enter, _] = stretches;
        passes.select(enter * enter, f32x16::splat(simd, f32::INFINITY))
    }
}

#[cfg(test)]
mod tests {
    use nearmiss_testdata::arbitrary::{point_in, rng, unit_vector};
    use nearmiss_testdata::instructions::levels;

    use super::*;
    use crate::tree::cut::CutBox;
    use crate::tree::cut::samples::{Visited, random_boxes, single};

    /// Where a ray enters a box that is grown by `radius`, in double precision; `None` where it passes
    /// beside.
    fn entry(of: &CutBox, [from, way]: [[f32; 3]; 2], radius: f64) -> Option<f64> {
        let (mut enter, mut exit) = (0.0_f64, f64::INFINITY);
        let mut cut = |low: f64, high: f64, speed: f64| {
            let (low, high) = (low - radius, high + radius);
            if speed == 0.0 {
                if low > 0.0 || high < 0.0 {
                    exit = -1.0;
                }
            } else {
                enter = enter.max((low / speed).min(high / speed));
                exit = exit.min((low / speed).max(high / speed));
            }
        };
        for k in 0..3 {
            let at = f64::from(from[k]);
            cut(f64::from(of.min[k]) - at, f64::from(of.max[k]) - at, way[k].into());
        }
        for slab in of.slabs {
            let dot = |v: [f32; 3]| (0..3).map(|k| f64::from(slab.normal[k]) * f64::from(v[k])).sum::<f64>();
            let at = dot(from);
            cut(f64::from(slab.between[0]) - at, f64::from(slab.between[1]) - at, dot(way));
        }
        (enter <= exit).then_some(enter)
    }

    #[test]
    fn all_boxes_along_a_ray_are_visited_and_no_others() {
        let rng = &mut rng(41);
        let (mut passed, mut missed) = (0, 0);
        for count in [0, 1, 15, 16, 17, 256, 257, 700, 5000] {
            let boxes = random_boxes(rng, count);
            let tree = BoxTree::new(boxes.len(), |i| boxes[i]);
            assert_eq!((tree.len(), tree.is_empty()), (count, count == 0));
            for round in 0..60 {
                let from = single(point_in(rng, 2.0));
                let way = [unit_vector(rng), [0.0, -1.0, 0.0], [0.6, 0.0, 0.8]][round % 3];
                let ray = [from, single(way)];
                let (radius, most) = ([1e-5, 0.1][round % 2], [f32::MAX, 1.0][round / 2 % 2]);
                for level in levels() {
                    let mut found = Visited { most: most.min(1e18), ..Visited::default() };
                    let along = BoxRay::new(ray[0], ray[1], radius);
                    assert!(tree.visit_along(level, &along, &mut found).is_continue());
                    let mut numbers = found.numbers.clone();
                    numbers.sort_unstable();
                    assert!(numbers.windows(2).all(|pair| pair[0] < pair[1]), "each once");
                    for (number, own) in boxes.iter().enumerate() {
                        let is_visited = numbers.binary_search(&number).is_ok();
                        // Within the rounding errors, either is right.
                        let limits = [-4e-6, 4e-6].map(|off| entry(own, ray, f64::from(radius) + off));
                        let reached = |t: f64, off: f64| t <= f64::from(most) * (1.0 + off) + off;
                        if limits[0].is_some_and(|t| reached(t, -1e-4)) {
                            passed += 1;
                            assert!(is_visited, "{count}, {round}: {own:?}, {ray:?}");
                        } else if !limits[1].is_some_and(|t| reached(t, 1e-4)) {
                            missed += 1;
                            assert!(!is_visited, "{count}, {round}: {own:?}, {ray:?}");
                        }
                    }
                    // The search ends where the visitor ends it.
                    if let Some(&last) = found.numbers.get(found.numbers.len() / 2) {
                        let mut half = Visited { most: found.most, last: Some(last), ..Visited::default() };
                        assert!(tree.visit_along(level, &along, &mut half).is_break());
                        assert_eq!(half.numbers, found.numbers[..=found.numbers.len() / 2]);
                    }
                }
            }
        }
        assert!(passed > 1000 && missed > 500_000, "{passed} passed, {missed} missed");
    }
}
