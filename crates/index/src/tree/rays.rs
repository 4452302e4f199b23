//! Boxes along a ray, the first ones first.

use std::ops::ControlFlow;

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x16, mask32x16};
use nearmiss_lanes::parallel::{both, map};
use nearmiss_lanes::wide::{WIDTH, along, load};
use nearmiss_store::Room;

use super::walk::{Groups, NearWalker, Stack};
use super::{Boxes, fill_above, levels};

/// The least component of a direction by which lengths are divided.
const LEAST: f32 = 1e-12;

/// The number of slabs that cut a box.
const SLABS: usize = 3;

/// A tree over boxes, sixteen to a group, for rays.
///
/// Every box is upright, and cut by three slabs: a slab is the space between two parallel planes. The tree is
/// packed: all groups are full but the last ones, and boxes of a group are close (Leutenegger, Lopez and
/// Edgington 1997; here the longest axis is halved until a group is left).
#[derive(Debug)]
pub struct BoxTree {
    /// The number of each box, in the order of the tree.
    numbers: Vec<u32>,
    levels: Vec<Room<Boxes>>,
    /// The slabs of the boxes of each group of the first level.
    slabs: Vec<[Slabs; SLABS]>,
}

/// A box of a [`BoxTree`].
#[derive(Debug, Clone, Copy)]
pub struct RayBox {
    /// The least corner.
    pub min: [f32; 3],
    /// The greatest corner.
    pub max: [f32; 3],
    /// The slabs that cut it. A search compares them in this order, and takes least if the first ones exclude
    /// most rays.
    pub slabs: [Slab; SLABS],
}

/// The space between two parallel planes.
#[derive(Debug, Clone, Copy)]
pub struct Slab {
    /// The unit normal.
    pub normal: [f32; 3],
    /// The least and the greatest product of the normal and a position in the slab.
    pub between: [f32; 2],
}

/// Sixteen slabs side by side.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
struct Slabs {
    normal: [[f32; WIDTH]; 3],
    between: [[f32; WIDTH]; 2],
}

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

/// The callbacks of [`BoxTree::visit_along`].
pub trait RayVisitor {
    /// Returns the square of the distance along the ray beyond which boxes are skipped.
    fn most_sq(&self) -> f32;

    /// Told of a box that is visited later, unless the search ends before: the time to load what it is about.
    fn foresee(&self, number: usize);

    /// Visits a box, by its number. May end the search.
    fn visit<S: Simd>(&mut self, simd: S, number: usize) -> ControlFlow<()>;
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
    /// Builds the tree over `count` boxes. O(n log n).
    #[must_use]
    pub fn new(count: usize, of: impl Fn(usize) -> RayBox + Sync + Send) -> Self {
        let boxes = map(count, of);
        let mut order: Vec<([f32; 3], u32)> = (0..).zip(&boxes).map(|(i, own)| (own.middle(), i)).collect();
        pack(&mut order);
        let numbers: Vec<u32> = order.into_iter().map(|(_, number)| number).collect();
        let empty = |groups| Ok::<_, std::convert::Infallible>(vec![Boxes::EMPTY; groups].into());
        let mut levels = levels(count, empty).unwrap_or_else(|never| match never {});
        let none = Slabs { normal: [[0.0; WIDTH]; 3], between: [[0.0; WIDTH]; 2] };
        let mut slabs = vec![[none; SLABS]; count.div_ceil(WIDTH)];
        if let Some((first, above)) = levels.split_first_mut() {
            for (place, &number) in numbers.iter().enumerate() {
                let (group, lane, own) = (place / WIDTH, place % WIDTH, &boxes[number as usize]);
                let (boxes, slabs) = (&mut first[group], &mut slabs[group]);
                for k in 0..3 {
                    (boxes.min[k][lane], boxes.max[k][lane]) = (own.min[k], own.max[k]);
                }
                for (slabs, own) in slabs.iter_mut().zip(own.slabs) {
                    for k in 0..3 {
                        slabs.normal[k][lane] = own.normal[k];
                    }
                    (slabs.between[0][lane], slabs.between[1][lane]) = (own.between[0], own.between[1]);
                }
            }
            fill_above(Level::new(), first, above);
        }
        Self { numbers, levels, slabs }
    }

    /// Returns the number of boxes.
    #[must_use]
    pub fn len(&self) -> usize {
        self.numbers.len()
    }

    /// Returns `true` if there are no boxes.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.numbers.is_empty()
    }

    /// Visits the boxes along a ray, those of a group that it enters first before the others, until
    /// `visitor` ends the search. Does not allocate.
    #[inline]
    pub fn visit_along<V: RayVisitor>(&self, level: Level, ray: &BoxRay, visitor: &mut V) -> ControlFlow<()> {
        if self.is_empty() {
            return ControlFlow::Continue(());
        }
        let groups = Groups { count: self.len(), levels: &self.levels };
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || {
                let mut search = Along { tree: self, ray, visitor };
                let root = (self.levels.len() - 1, 0, u32::MAX);
                groups.walk_near(simd, root, &mut Stack::new(), &mut search)
            },
        ))
    }
}

impl RayBox {
    fn middle(&self) -> [f32; 3] {
        [0, 1, 2].map(|k| 0.5 * self.min[k] + 0.5 * self.max[k])
    }
}

/// Orders places so that runs of 16, 256, … are close together, with their numbers.
fn pack(places: &mut [([f32; 3], u32)]) {
    if places.len() <= WIDTH {
        return;
    }
    // The places below a box of the highest level.
    let mut below = WIDTH;
    while below * WIDTH < places.len() {
        below *= WIDTH;
    }
    halve(places, below);
}

/// Orders places so that runs of `below` are close together, and the places in each of these.
fn halve(places: &mut [([f32; 3], u32)], below: usize) {
    if places.len() <= below {
        return pack(places);
    }
    let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    for (place, _) in &*places {
        for k in 0..3 {
            (low[k], high[k]) = (low[k].min(place[k]), high[k].max(place[k]));
        }
    }
    let length = |k: &usize| high[*k] - low[*k];
    let axis = (0..3).max_by(|a, b| length(a).total_cmp(&length(b))).unwrap_or(0);
    let half = places.len().div_ceil(below).div_ceil(2) * below;
    places.select_nth_unstable_by(half, |(a, i), (b, j)| a[axis].total_cmp(&b[axis]).then(i.cmp(j)));
    let (left, right) = places.split_at_mut(half);
    both(|| halve(left, below), || halve(right, below));
}

struct Along<'a, V> {
    tree: &'a BoxTree,
    ray: &'a BoxRay,
    visitor: &'a mut V,
}

impl<S: Simd, V: RayVisitor> NearWalker<S> for Along<'_, V> {
    /// The squared distances along the ray at which it enters the boxes; infinite where it passes beside.
    #[inline(always)]
    fn distances_sq(&self, simd: S, (level, group): (usize, usize), boxes: &Boxes) -> f32x16<S> {
        let mut stretches = boxes.stretches(simd, self.ray);
        let mut passes: mask32x16<S> = stretches[0].simd_le(stretches[1]);
        if level == 0 {
            for slabs in &self.tree.slabs[group] {
                if passes.all_false() {
                    break;
                }
                stretches = slabs.cut(simd, self.ray, stretches);
                passes = stretches[0].simd_le(stretches[1]);
            }
        }
        let [enter, _] = stretches;
        passes.select(enter * enter, f32x16::splat(simd, f32::INFINITY))
    }

    #[inline(always)]
    fn most_sq(&self) -> f32 {
        self.visitor.most_sq()
    }

    #[inline(always)]
    fn foresee(&self, id: usize) {
        self.visitor.foresee(self.tree.numbers[id] as usize);
    }

    #[inline(always)]
    fn block(&mut self, simd: S, id: usize) -> ControlFlow<()> {
        self.visitor.visit(simd, self.tree.numbers[id] as usize)
    }
}

#[cfg(test)]
mod tests {
    use nearmiss_testdata::arbitrary::{point_in, rng, unit_vector};
    use nearmiss_testdata::instructions::levels;

    use super::*;

    /// Notes the boxes that are visited, and the order.
    #[derive(Default)]
    struct Visited {
        most: f32,
        numbers: Vec<usize>,
        last: Option<usize>,
    }

    impl RayVisitor for Visited {
        fn most_sq(&self) -> f32 {
            self.most * self.most
        }

        fn foresee(&self, _: usize) {}

        fn visit<S: Simd>(&mut self, _: S, number: usize) -> ControlFlow<()> {
            self.numbers.push(number);
            if self.last == Some(number) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        }
    }

    /// Where a ray enters a box that is grown by `radius`, in double precision; `None` where it passes
    /// beside.
    fn entry(of: &RayBox, [from, way]: [[f32; 3]; 2], radius: f64) -> Option<f64> {
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

    #[expect(clippy::cast_possible_truncation, reason = "random numbers")]
    fn single(v: [f64; 3]) -> [f32; 3] {
        v.map(|c| c as f32)
    }

    #[test]
    fn all_boxes_along_a_ray_are_visited_and_no_others() {
        let rng = &mut rng(41);
        let (mut passed, mut missed) = (0, 0);
        for count in [0, 1, 15, 16, 17, 256, 257, 700, 5000] {
            let boxes: Vec<RayBox> = (0..count)
                .map(|i| {
                    let [middle, [half, ..]] = [1.0, 0.1].map(|size| single(point_in(rng, size)));
                    let half = half.abs();
                    // Some are flat, some are all in one place.
                    let middle = if count == 256 { [0.25, 0.5, -0.5] } else { middle };
                    let slabs = [0, 1, 2].map(|k: usize| {
                        let normal = if (i + k).is_multiple_of(3) {
                            [0.0, 1.0, 0.0]
                        } else {
                            single(unit_vector(rng))
                        };
                        let at: f32 = (0..3).map(|k| normal[k] * middle[k]).sum();
                        let thick = if (i + k).is_multiple_of(5) { 0.0 } else { [0.3, 0.6, 0.9][k] * half };
                        Slab { normal, between: [at - thick, at + thick] }
                    });
                    RayBox { min: middle.map(|c| c - half), max: middle.map(|c| c + half), slabs }
                })
                .collect();
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
