//! The box of a node, or the boxes of several side by side, with what their enclosures reach further.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x4, u32x4};
use nearmiss_geometry::NodeId;

use crate::boxes::{OrientedBox, Relative};
use crate::growth::Growth;
use crate::lanes::{Boxes, along_normals};
use crate::part::Part;
use crate::slices::Slices;

/// Box and enclosure of a node, with `f32` for `V`; of several nodes, a lane each, with a vector.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NodeBounds<V> {
    /// The middles of the boxes.
    pub centre: [V; 3],
    /// Half their edge lengths.
    pub half: [V; 3],
    /// Unit directions of the edges.
    pub axes: [[V; 3]; 3],
    /// By how much the enclosures reach further against the axes; infinite where nothing bounds them.
    pub low: [V; 3],
    /// The same along the axes.
    pub high: [V; 3],
}

/// Boxes and enclosures of four nodes.
pub type FourNodes<S> = NodeBounds<f32x4<S>>;

impl<V: Copy> NodeBounds<V> {
    /// The same bounds with each number replaced.
    #[inline(always)]
    #[must_use]
    pub fn map<W>(&self, replaced: impl Fn(V) -> W) -> NodeBounds<W> {
        let [u, v, w] = self.axes;
        NodeBounds {
            centre: each(self.centre, &replaced),
            half: each(self.half, &replaced),
            axes: [each(u, &replaced), each(v, &replaced), each(w, &replaced)],
            low: each(self.low, &replaced),
            high: each(self.high, &replaced),
        }
    }
}

#[inline(always)]
fn each<V, W>([x, y, z]: [V; 3], replaced: &impl Fn(V) -> W) -> [W; 3] {
    [replaced(x), replaced(y), replaced(z)]
}

impl NodeBounds<f32> {
    /// This box, and what it must grow by.
    #[inline(always)]
    pub(crate) fn of(bounds: &OrientedBox, growth: &Growth) -> Self {
        let (low, high) = growth.lengths();
        Self { centre: bounds.centre, half: bounds.half, axes: bounds.axes, low, high }
    }
}

impl<S: Simd> FourNodes<S> {
    /// These boxes, and what they must grow by.
    #[inline(always)]
    #[must_use]
    pub fn new(simd: S, boxes: [&OrientedBox; 4], growths: [&Growth; 4]) -> Self {
        // A box is four rows of four numbers.
        let [a, b, c, d] = boxes;
        let rows = |of: &OrientedBox| -> [[f32; 4]; 4] { bytemuck::cast(*of) };
        let (a, b, c, d) = (rows(a), rows(b), rows(c), rows(d));
        let columns = |row: usize| {
            let load = f32x4::load_array;
            transposed([load(simd, a[row]), load(simd, b[row]), load(simd, c[row]), load(simd, d[row])])
        };
        let [cx, cy, cz, hx] = columns(0);
        let [hy, hz, ux, uy] = columns(1);
        let [uz, vx, vy, vz] = columns(2);
        let [wx, wy, wz, _] = columns(3);
        let [a, b, c, d] = growths;
        let (a, b, c, d) = (a.pairs(), b.pairs(), c.pairs(), d.pairs());
        let pair = |pair: usize| u32x4::load_array(simd, [a[pair], b[pair], c[pair], d[pair]]);
        let (low, high) = Self::growth([pair(0), pair(1), pair(2)]);
        Self {
            centre: [cx, cy, cz],
            half: [hx, hy, hz],
            axes: [[ux, uy, uz], [vx, vy, vz], [wx, wy, wz]],
            low,
            high,
        }
    }

    /// By how much enclosures reach further against the axes and along them, from [`Growth::pairs`].
    #[inline(always)]
    pub(crate) fn growth([first, second, third]: [u32x4<S>; 3]) -> ([f32x4<S>; 3], [f32x4<S>; 3]) {
        // Of two upper halves in a number the first is its lower one.
        let halves = |both: u32x4<S>| -> (f32x4<S>, f32x4<S>) {
            ((both << 16).bitcast(), (both & 0xffff_0000).bitcast())
        };
        let ((lx, ly), (lz, gx), (gy, gz)) = (halves(first), halves(second), halves(third));
        ([lx, ly, lz], [gx, gy, gz])
    }
}

impl<S: Simd> FourNodes<S> {
    /// The enclosures instead of the boxes, in the order of operations of [`Growth::of`].
    #[inline(always)]
    fn grown(mut self) -> Self {
        for k in 0..3 {
            let shift = (self.high[k] - self.low[k]) * 0.5;
            for i in 0..3 {
                self.centre[i] += shift * self.axes[k][i];
            }
            self.half[k] += (self.high[k] + self.low[k]) * 0.5;
        }
        self
    }
}

impl Relative {
    /// How far the enclosures of this part of either of two nodes of the first scan and either of two of the
    /// second are apart: as [`Relative::gaps`] of [`Growth::of`] each, by any instructions.
    ///
    /// # Panics
    /// When there are no such nodes.
    #[inline]
    #[must_use]
    pub fn gaps_of_enclosures(
        &self,
        level: Level,
        part: Part,
        [of_a, of_b]: [&Slices<'_>; 2],
        a: [NodeId; 2],
        b: [NodeId; 2],
    ) -> [f32; 4] {
        let [a0, a1] = a.map(|id| (&of_a.boxes[id.index()], &of_a.growths_of(part)[id.index()]));
        let [b0, b1] = b.map(|id| (&of_b.boxes[id.index()], &of_b.growths_of(part)[id.index()]));
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || self.gaps_of_grown(simd, &FourNodes::new(simd, [a0.0, a1.0, b0.0, b1.0], [a0.1, a1.1, b0.1, b1.1])),
        ))
    }

    /// The first two nodes are of a, the others of b.
    #[inline(always)]
    fn gaps_of_grown<S: Simd>(&self, simd: S, four: &FourNodes<S>) -> [f32; 4] {
        let own = four.grown();
        let scale = self.scale();
        let a = Boxes {
            centre: first(own.centre),
            half: first(own.half),
            axes: [first(own.axes[0]), first(own.axes[1]), first(own.axes[2])],
        };
        let b = Boxes {
            centre: second(self.points_of_four(own.centre)),
            half: second([own.half[0] * scale, own.half[1] * scale, own.half[2] * scale]),
            axes: [
                second(self.directions_of_four(own.axes[0])),
                second(self.directions_of_four(own.axes[1])),
                second(self.directions_of_four(own.axes[2])),
            ],
        };
        let mut gap = f32x4::splat(simd, f32::MIN);
        along_normals(
            &a,
            &b,
            #[inline(always)]
            |away, reach| {
                let own = away - reach;
                // Of what is no number the second, as one by one.
                gap = simd.select_f32x4(gap.simd_gt(own), gap, own);
            },
        );
        gap.to_array()
    }
}

/// The first two lanes, either twice in a row.
#[inline(always)]
fn first<S: Simd>([x, y, z]: [f32x4<S>; 3]) -> [f32x4<S>; 3] {
    [x.zip_low(x), y.zip_low(y), z.zip_low(z)]
}

/// The last two lanes, both twice.
#[inline(always)]
fn second<S: Simd>([x, y, z]: [f32x4<S>; 3]) -> [f32x4<S>; 3] {
    [second_one(x), second_one(y), second_one(z)]
}

#[inline(always)]
fn second_one<S: Simd>(lanes: f32x4<S>) -> f32x4<S> {
    let twice = lanes.zip_high(lanes);
    twice.unzip_low(twice)
}

#[inline(always)]
fn transposed<S: Simd>([a, b, c, d]: [f32x4<S>; 4]) -> [f32x4<S>; 4] {
    let (ac_low, ac_high, bd_low, bd_high) = (a.zip_low(c), a.zip_high(c), b.zip_low(d), b.zip_high(d));
    [ac_low.zip_low(bd_low), ac_low.zip_high(bd_low), ac_high.zip_low(bd_high), ac_high.zip_high(bd_high)]
}

#[cfg(test)]
mod tests {
    use nearmiss_testdata::arbitrary::{point_in, rng, rotation};
    use nearmiss_testdata::instructions::levels;
    use rand::RngExt;

    use super::*;
    use nearmiss_lanes::vector::dot;

    #[test]
    fn four_nodes_are_those_one_by_one() {
        let boxes: [OrientedBox; 4] = [0, 1, 2, 3].map(|i| {
            let at = |k: u8| f32::from(16 * i + k);
            OrientedBox {
                centre: [at(0), at(1), at(2)],
                half: [at(3), at(4), at(5)],
                axes: [[at(6), at(7), at(8)], [at(9), at(10), at(11)], [at(12), at(13), at(14)]],
                reach: at(15),
            }
        });
        let about =
            OrientedBox { axes: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], ..Default::default() };
        let growths = [1.0, 2.0, 3.0, f32::INFINITY]
            .map(|x: f32| Growth::new(&about, [-x, -2.0 * x, -3.0 * x], [4.0 * x, 5.0 * x, 6.0 * x]));
        for level in [Level::new(), Level::baseline()] {
            dispatch!(level, simd => {
                let four = FourNodes::new(simd, boxes.each_ref(), growths.each_ref());
                for lane in 0..4 {
                    let of = |v: &[f32x4<_>; 3]| [v[0][lane], v[1][lane], v[2][lane]];
                    let (one, grown) = (&boxes[lane], growths[lane].of(&OrientedBox { half: [0.0; 3], ..about }));
                    assert_eq!((of(&four.centre), of(&four.half)), (one.centre, one.half), "lane {lane}");
                    assert_eq!(four.axes.each_ref().map(of), one.axes, "lane {lane}");
                    let (low, high) = (of(&four.low), of(&four.high));
                    for k in 0..3 {
                        let middle = dot(grown.centre, about.axes[k]);
                        let [below, above] = [low[k], high[k]];
                        if below.is_finite() {
                            assert_eq!([middle - grown.half[k], middle + grown.half[k]], [-below, above], "lane {lane}");
                        } else {
                            assert!(grown.half[k].is_infinite() && above.is_infinite(), "lane {lane}");
                        }
                    }
                }
            });
        }
    }

    #[expect(clippy::cast_possible_truncation, reason = "stored in single precision")]
    fn single(v: [f64; 3]) -> [f32; 3] {
        v.map(|c| c as f32)
    }

    #[test]
    fn gaps_of_enclosures_are_those_one_by_one_by_any_instructions() {
        let rng = &mut rng(31);
        let (mut apart, mut boundless) = (0, 0);
        for round in 0..500 {
            let boxes: [OrientedBox; 4] = std::array::from_fn(|_| {
                let turn = rotation(rng);
                let axis = |k: usize| single(turn.rotation().column(k).into_owned().into());
                OrientedBox {
                    centre: single(point_in(rng, 2.0)),
                    half: single(point_in(rng, 1.0)).map(f32::abs),
                    axes: [axis(0), axis(1), axis(2)],
                    reach: 0.1,
                }
            });
            let growths = boxes.map(|own| {
                let [low, high] =
                    [0.0, 0.3].map(|more| own.along(&own.axes).map(|[low, high]| [low - more, high + more]));
                let far = if rng.random_bool(0.1) { f32::INFINITY } else { high[0][1] };
                Growth::new(&own, low.map(|side| side[0]), [far, low[1][1], high[2][1]])
            });
            let [a0, a1, b0, b1] = std::array::from_fn(|i| growths[i].of(&boxes[i]));
            let scale = [1.0, 0.4][round % 2];
            let pose = rotation(rng).with_scale(scale).with_translation(point_in(rng, 2.0));
            let relative = Relative::new(&pose, 8.0);
            let expected = relative.gaps([&a0, &a1], [&b0, &b1]).map(f32::to_bits);
            for level in levels() {
                let found = dispatch!(level, simd => {
                    relative.gaps_of_grown(simd, &FourNodes::new(simd, boxes.each_ref(), growths.each_ref()))
                });
                let found = found.map(f32::to_bits);
                for (own, other) in found.iter().zip(&expected) {
                    let both = [own, other].map(|&bits| f32::from_bits(bits));
                    assert!(
                        own == other || both.iter().all(|x| x.is_nan()),
                        "round {round}, {level:?}: {both:?}"
                    );
                }
            }
            let gaps = expected.map(f32::from_bits);
            apart += gaps.iter().filter(|&&gap| gap > 0.0).count();
            boundless += gaps.iter().filter(|gap| gap.is_nan()).count();
        }
        assert!(apart > 300 && boundless > 100, "{apart} {boundless}");
    }
}
