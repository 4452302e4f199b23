//! A tree of upright boxes that slabs cut, sixteen to a group.

use std::ops::ControlFlow;

use fearless_simd::{Level, Simd, f32x16};
use nearmiss_lanes::parallel::{both, map};
use nearmiss_lanes::wide::WIDTH;
use nearmiss_store::Room;

use super::walk::{CutBoxVisitor, Groups, NearWalker};
use super::{Boxes, fill_above, levels};

/// The number of slabs that cut a box.
pub(super) const SLABS: usize = 3;

/// A tree over boxes, sixteen to a group. See [`Self::visit_along`] and [`Self::visit_near`].
///
/// Every box is upright, and cut by three slabs: a slab is the space between two parallel planes. The tree is
/// packed: all groups are full but the last ones, and boxes of a group are close (Leutenegger, Lopez and
/// Edgington 1997; here the longest axis is halved until a group is left).
#[derive(Debug)]
pub struct BoxTree {
    /// The number of each box, in the order of the tree.
    pub(super) numbers: Vec<u32>,
    pub(super) levels: Vec<Room<Boxes>>,
    /// The slabs of the boxes of each group of the first level.
    pub(super) slabs: Vec<[Slabs; SLABS]>,
}

/// A box of a [`BoxTree`].
#[derive(Debug, Clone, Copy)]
pub struct CutBox {
    /// The least corner.
    pub min: [f32; 3],
    /// The greatest corner.
    pub max: [f32; 3],
    /// The slabs that cut it, at right angles to each other. A search compares them in this order, and takes
    /// least if the first ones exclude most.
    pub slabs: [Slab; SLABS],
}

/// The space between two parallel planes.
#[derive(Debug, Clone, Copy)]
pub struct Slab {
    /// The unit normal.
    pub normal: [f32; 3],
    /// The least and the greatest product of the normal and a position in the slab.
    pub between: [f32; 2],
    /// The same for an inner part of the box, to which a search may be limited.
    pub inner: [f32; 2],
}

/// Sixteen slabs side by side.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
pub(super) struct Slabs {
    pub(super) normal: [[f32; WIDTH]; 3],
    pub(super) between: [[f32; WIDTH]; 2],
    pub(super) inner: [[f32; WIDTH]; 2],
}

impl BoxTree {
    /// Builds the tree over `count` boxes. O(n log n).
    #[must_use]
    pub fn new(count: usize, of: impl Fn(usize) -> CutBox + Sync + Send) -> Self {
        let boxes = map(count, of);
        let mut order: Vec<([f32; 3], u32)> = (0..).zip(&boxes).map(|(i, own)| (own.middle(), i)).collect();
        pack(&mut order);
        let numbers: Vec<u32> = order.into_iter().map(|(_, number)| number).collect();
        let empty = |groups| Ok::<_, std::convert::Infallible>(vec![Boxes::EMPTY; groups].into());
        let mut levels = levels(count, empty).unwrap_or_else(|never| match never {});
        let zeros = [[0.0; WIDTH]; 2];
        let none = Slabs { normal: [[0.0; WIDTH]; 3], between: zeros, inner: zeros };
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
                    for end in 0..2 {
                        slabs.between[end][lane] = own.between[end];
                        slabs.inner[end][lane] = own.inner[end];
                    }
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

    /// Returns the corners of the box about all boxes. `None` without boxes, or if it is unbounded.
    pub(super) fn bounds(&self) -> Option<[[f64; 3]; 2]> {
        let top = self.levels.last()?.first()?;
        let of = |rows: &[[f32; WIDTH]; 3], pick: fn(f32, f32) -> f32, none: f32| {
            [0, 1, 2].map(|k| f64::from(rows[k].iter().copied().fold(none, pick)))
        };
        let [min, max] = [of(&top.min, f32::min, f32::INFINITY), of(&top.max, f32::max, f32::NEG_INFINITY)];
        min.iter().chain(&max).all(|c| c.is_finite()).then_some([min, max])
    }

    pub(super) fn groups(&self) -> Groups<'_> {
        Groups { count: self.len(), levels: &self.levels }
    }
}

impl CutBox {
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

/// A ray or a body that the boxes of a tree are compared with.
pub(super) trait BoxQuery {
    /// Returns the squared distances of the boxes of a group, which is given with its level and its number.
    /// The search skips boxes beyond `most_sq`.
    fn distances_sq<S: Simd>(
        &self,
        simd: S,
        tree: &BoxTree,
        group: ((usize, usize), &Boxes),
        most_sq: f32,
    ) -> f32x16<S>;
}

/// A search for the boxes of a tree near a ray or a body.
pub(super) struct BoxSearch<'a, Q, V> {
    pub(super) tree: &'a BoxTree,
    pub(super) query: &'a Q,
    pub(super) visitor: &'a mut V,
}

impl<S: Simd, Q: BoxQuery, V: CutBoxVisitor> NearWalker<S> for BoxSearch<'_, Q, V> {
    #[inline(always)]
    fn distances_sq(&self, simd: S, group: (usize, usize), boxes: &Boxes) -> f32x16<S> {
        self.query.distances_sq(simd, self.tree, (group, boxes), self.visitor.most_sq())
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
    fn block(&mut self, simd: S, id: usize, least_sq: f32) -> ControlFlow<()> {
        self.visitor.visit(simd, self.tree.numbers[id] as usize, least_sq)
    }
}

#[cfg(test)]
pub(super) mod samples {
    use nearmiss_geometry::Pose;
    use nearmiss_testdata::arbitrary::{point_in, rotation};
    use rand::Rng;

    use super::*;
    use crate::tree::walk::CutBoxVisitor;

    #[expect(clippy::cast_possible_truncation, reason = "random numbers")]
    pub(crate) fn single(v: [f64; 3]) -> [f32; 3] {
        v.map(|c| c as f32)
    }

    /// Boxes about places of the unit ball. Some are flat, some upright; 256 are all in one place.
    pub(crate) fn random_boxes(rng: &mut impl Rng, count: usize) -> Vec<CutBox> {
        let random = |i: usize| {
            let [middle, [half, ..]] = [1.0, 0.1].map(|size| single(point_in(rng, size)));
            let half = half.abs();
            let middle = if count == 256 { [0.25, 0.5, -0.5] } else { middle };
            let turn = if i.is_multiple_of(3) { Pose::IDENTITY } else { rotation(rng) };
            let slabs = [0, 1, 2].map(|k: usize| {
                let normal = single(turn.rotate([0, 1, 2].map(|j| if j == k { 1.0 } else { 0.0 })));
                let at: f32 = (0..3).map(|k| normal[k] * middle[k]).sum();
                let thick = if (i + k).is_multiple_of(5) { 0.0 } else { [0.3, 0.6, 0.9][k] * half };
                let inner = [at - 0.5 * thick, at + 0.25 * thick];
                Slab { normal, between: [at - thick, at + thick], inner }
            });
            CutBox { min: middle.map(|c| c - half), max: middle.map(|c| c + half), slabs }
        };
        (0..count).map(random).collect()
    }

    /// Notes the boxes that are visited, and the order.
    #[derive(Default)]
    pub(crate) struct Visited {
        pub(crate) most: f32,
        pub(crate) numbers: Vec<usize>,
        pub(crate) last: Option<usize>,
    }

    impl CutBoxVisitor for Visited {
        fn most_sq(&self) -> f32 {
            self.most * self.most
        }

        fn foresee(&self, _: usize) {}

        fn visit<S: Simd>(&mut self, _: S, number: usize, _: f32) -> ControlFlow<()> {
            self.numbers.push(number);
            if self.last == Some(number) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        }
    }
}
