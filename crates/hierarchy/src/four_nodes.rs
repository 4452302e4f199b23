//! The boxes of four nodes side by side, with what their enclosures reach further.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x4, u32x4};
use nearmiss_geometry::NodeId;

use crate::boxes::OrientedBox;
use crate::build::Slices;
use crate::growth::Growth;

/// Boxes and enclosures of four nodes, a lane each.
#[derive(Debug, Clone, Copy)]
pub struct FourNodes<S: Simd> {
    /// The middles of the boxes.
    pub centre: [f32x4<S>; 3],
    /// Half their edge lengths.
    pub half: [f32x4<S>; 3],
    /// Unit directions of the edges.
    pub axes: [[f32x4<S>; 3]; 3],
    /// By how much the enclosures reach further against the axes; infinite where nothing bounds them.
    pub low: [f32x4<S>; 3],
    /// The same along the axes.
    pub high: [f32x4<S>; 3],
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
        // Of two upper halves in a number the first is its lower one.
        let halves = |pair: usize| {
            let both = u32x4::load_array(simd, [a[pair], b[pair], c[pair], d[pair]]);
            let (first, second): (f32x4<S>, f32x4<S>) =
                ((both << 16).bitcast(), (both & 0xffff_0000).bitcast());
            (first, second)
        };
        let ((lx, ly), (lz, gx), (gy, gz)) = (halves(0), halves(1), halves(2));
        Self {
            centre: [cx, cy, cz],
            half: [hx, hy, hz],
            axes: [[ux, uy, uz], [vx, vy, vz], [wx, wy, wz]],
            low: [lx, ly, lz],
            high: [gx, gy, gz],
        }
    }
}

impl Slices<'_> {
    /// Four nodes.
    ///
    /// # Panics
    /// When there are no such nodes.
    #[inline(always)]
    #[must_use]
    pub fn four_nodes<S: Simd>(&self, simd: S, [a, b, c, d]: [NodeId; 4]) -> FourNodes<S> {
        let (boxes, growths) = (self.boxes, self.growths);
        FourNodes::new(
            simd,
            [&boxes[a.index()], &boxes[b.index()], &boxes[c.index()], &boxes[d.index()]],
            [&growths[a.index()], &growths[b.index()], &growths[c.index()], &growths[d.index()]],
        )
    }
}

#[inline(always)]
fn transposed<S: Simd>([a, b, c, d]: [f32x4<S>; 4]) -> [f32x4<S>; 4] {
    let (ac_low, ac_high, bd_low, bd_high) = (a.zip_low(c), a.zip_high(c), b.zip_low(d), b.zip_high(d));
    [ac_low.zip_low(bd_low), ac_low.zip_high(bd_low), ac_high.zip_low(bd_high), ac_high.zip_high(bd_high)]
}

#[cfg(test)]
mod tests {
    use fearless_simd::{Level, dispatch};

    use super::*;
    use crate::boxes::dot;

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
}
