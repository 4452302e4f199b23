//! Sixteen vectors side by side, one in each SIMD lane.
//!
//! Products are summed in the order of [`vector::dot`](crate::vector::dot). Each lane therefore has
//! the same bits as the scalar computation, with any instruction set.

use std::ops::Range;

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x4, f32x16, i32x16, mask32x16};

/// The number of lanes: one register of AVX-512, two of AVX2, four of SSE2 or NEON.
pub const WIDTH: usize = 16;

/// Sixteen vectors, as one array of lanes for each coordinate.
pub type Vectors<S> = [f32x16<S>; 3];

/// Runs `f`, whose caller runs with the instruction set of `simd`. A build with debug assertions compiles `f`
/// as a function of its own, others compile it as part of each caller.
///
/// For long code that many searches have in common: in the query library, copies of two such functions took
/// half of the time that the compiler needed, and save 4 % of the instructions of a distance query.
#[inline(always)]
pub fn common<S: Simd, R>(simd: S, f: impl FnOnce() -> R) -> R {
    if cfg!(debug_assertions) { alone(simd, f) } else { f() }
}

#[inline(never)]
fn alone<S: Simd, R>(simd: S, f: impl FnOnce() -> R) -> R {
    simd.vectorize(f)
}

/// Loads vectors from their coordinates.
#[inline(always)]
#[must_use]
pub fn load<S: Simd>(simd: S, [x, y, z]: &[[f32; WIDTH]; 3]) -> Vectors<S> {
    [f32x16::load_array_ref(simd, x), f32x16::load_array_ref(simd, y), f32x16::load_array_ref(simd, z)]
}

/// Puts vectors side by side, from the first lane on. Other lanes stay, and so do surplus vectors.
#[inline(always)]
pub fn spread_out(vectors: &[[f32; 3]], [x, y, z]: &mut [[f32; WIDTH]; 3]) {
    // A loop of known length is compiled to permutations of registers.
    if let Some(vectors) = vectors.first_chunk::<WIDTH>() {
        for i in 0..WIDTH {
            (x[i], y[i], z[i]) = (vectors[i][0], vectors[i][1], vectors[i][2]);
        }
        return;
    }
    for (((x, y), z), v) in x.iter_mut().zip(y).zip(z).zip(vectors) {
        (*x, *y, *z) = (v[0], v[1], v[2]);
    }
}

/// Stores vectors that are side by side one after the other, from the first lane on.
#[inline(always)]
pub fn put_together([x, y, z]: &[[f32; WIDTH]; 3], vectors: &mut [[f32; 3]]) {
    if let Some(vectors) = vectors.first_chunk_mut::<WIDTH>() {
        for i in 0..WIDTH {
            vectors[i] = [x[i], y[i], z[i]];
        }
        return;
    }
    for (((x, y), z), v) in x.iter().zip(y).zip(z).zip(vectors) {
        *v = [*x, *y, *z];
    }
}

/// Loads points relative to `p`.
#[inline(always)]
#[must_use]
pub fn seen_from<S: Simd>(simd: S, points: &[[f32; WIDTH]; 3], p: [f32; 3]) -> Vectors<S> {
    let [x, y, z] = load(simd, points);
    [x - p[0], y - p[1], z - p[2]]
}

/// Returns the component of each vector along `axis`.
#[inline(always)]
#[must_use]
pub fn along<S: Simd>([x, y, z]: Vectors<S>, axis: [f32; 3]) -> f32x16<S> {
    x * axis[0] + y * axis[1] + z * axis[2]
}

/// Returns the dot product of each vector in `a` with the vector in the same lane of `b`, for any
/// number of lanes.
#[inline(always)]
#[must_use]
pub fn product<S: Simd, V: SimdBase<S>>(a: [V; 3], b: [V; 3]) -> V {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Returns the cross product of each vector in `a` with the vector in the same lane of `b`, for any
/// number of lanes.
#[inline(always)]
#[must_use]
pub fn cross<S: Simd, V: SimdBase<S>>(a: [V; 3], b: [V; 3]) -> [V; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Returns the [tangents](crate::vector::tangents) of each unit vector.
#[inline(always)]
#[must_use]
pub fn tangents<S: Simd>(simd: S, [x, y, z]: Vectors<S>) -> [Vectors<S>; 2] {
    let one = f32x16::splat(simd, 1.0);
    let sign = one.copysign(z);
    let a = -one / (sign + z);
    let b = x * y * a;
    [[sign * x * x * a + 1.0, sign * b, -sign * x], [b, sign + y * y * a, -y]]
}

/// Returns the squared length of each vector.
#[inline(always)]
#[must_use]
pub fn squared<S: Simd, V: SimdBase<S>>(vectors: [V; 3]) -> V {
    product(vectors, vectors)
}

/// Returns the cube root of each number, which must be 0 or normal, positive and at most 1e38. The
/// relative error is at most 1e-6; the root of 0 is below 1e-12.
#[inline(always)]
#[must_use]
pub fn cube_root<S: Simd>(numbers: f32x16<S>) -> f32x16<S> {
    // The bits of a number are about its logarithm, in units of 2^-23 and from 2^-127 on. A third of
    // them, and two thirds of the bits of 1, give the root within 5 %.
    const BITS: i32 = 709_921_077;
    let logarithm: i32x16<S> = numbers.bitcast();
    let third = i32x16::truncate_from(f32x16::float_from(logarithm) * (1.0 / 3.0));
    let mut root: f32x16<S> = (third + BITS).bitcast();
    // Halley's method triples the number of valid digits.
    for _ in 0..2 {
        let cube = root * root * root;
        root *= (cube + numbers + numbers) / (cube + cube + numbers);
    }
    root
}

/// Repeats four numbers four times: number i in lanes i, 4 + i, 8 + i and 12 + i.
#[inline(always)]
#[must_use]
pub fn repeated<S: Simd>(four: f32x4<S>) -> f32x16<S> {
    f32x16::block_splat(four)
}

/// Puts each of four numbers into four consecutive lanes: number i in lanes 4i to 4i + 3.
#[inline(always)]
#[must_use]
pub fn spread<S: Simd>(four: f32x4<S>) -> f32x16<S> {
    let row = repeated(four);
    let row = row.zip_low(row);
    row.zip_low(row)
}

/// Repeats four vectors as [`repeated`] does.
#[inline(always)]
#[must_use]
pub fn each_repeated<S: Simd>([x, y, z]: [f32x4<S>; 3]) -> Vectors<S> {
    [repeated(x), repeated(y), repeated(z)]
}

/// Puts each of four vectors into four consecutive lanes as [`spread`] does.
#[inline(always)]
#[must_use]
pub fn each_spread<S: Simd>([x, y, z]: [f32x4<S>; 3]) -> Vectors<S> {
    [spread(x), spread(y), spread(z)]
}

/// Returns the set lanes as bits.
#[inline(always)]
#[must_use]
#[expect(clippy::cast_possible_truncation, reason = "sixteen bits")]
pub fn bits<S: Simd>(mask: mask32x16<S>) -> u32 {
    mask.to_bitmask() as u32
}

/// Returns the lanes of `block` that hold any of `points`, as bits. Point i is in lane i % 16 of
/// block i / 16.
#[inline(always)]
#[must_use]
pub fn lanes_of(block: usize, points: &Range<usize>) -> u32 {
    let first = block * WIDTH;
    let below = |i: usize| (1_u32 << i.saturating_sub(first).min(WIDTH)) - 1;
    below(points.end) & !below(points.start)
}

/// Returns the blocks that hold any of `points`, which must not be empty.
#[inline(always)]
#[must_use]
pub fn blocks_of(points: &Range<usize>) -> Range<usize> {
    points.start / WIDTH..points.end.div_ceil(WIDTH)
}

/// An iterator over the positions of the set bits, ascending.
#[derive(Debug, Clone, Copy)]
pub struct Bits(pub u32);

impl Iterator for Bits {
    type Item = usize;

    #[inline(always)]
    fn next(&mut self) -> Option<usize> {
        let place = self.0.trailing_zeros() as usize;
        self.0 &= self.0.wrapping_sub(1);
        (place < 32).then_some(place)
    }
}

/// Returns the minimum of all lanes and `least`. None of them may be NaN.
#[inline(always)]
#[must_use]
pub fn least<S: Simd>(lanes: f32x16<S>, least: f32) -> f32 {
    let own = lanes.reduce_min();
    if own < least { own } else { least }
}

/// Returns the maximum of all lanes and `greatest`. None of them may be NaN.
#[inline(always)]
#[must_use]
pub fn greatest<S: Simd>(lanes: f32x16<S>, greatest: f32) -> f32 {
    let own = lanes.reduce_max();
    if own > greatest { own } else { greatest }
}

/// Returns the sum of all lanes, added in halves: the same with any instruction set.
#[inline(always)]
#[must_use]
pub fn sum<S: Simd>(lanes: f32x16<S>) -> f32 {
    let (low, high) = lanes.split();
    let (low, high) = (low + high).split();
    let [a, b, c, d] = (low + high).to_array();
    (a + c) + (b + d)
}

/// Returns the minimum of each of sixteen rows. None of the numbers may be NaN.
#[inline(always)]
#[must_use]
pub fn least_of_each<S: Simd>(rows: [f32x16<S>; WIDTH]) -> [f32; WIDTH] {
    reduced(rows, |a, b| a.min(b))
}

/// Returns the maximum of each of sixteen rows. None of the numbers may be NaN.
#[inline(always)]
#[must_use]
pub fn greatest_of_each<S: Simd>(rows: [f32x16<S>; WIDTH]) -> [f32; WIDTH] {
    reduced(rows, |a, b| a.max(b))
}

/// Returns the sum of each of sixteen rows.
#[inline(always)]
#[must_use]
pub fn sum_of_each<S: Simd>(rows: [f32x16<S>; WIDTH]) -> [f32; WIDTH] {
    reduced(rows, |a, b| a + b)
}

/// Combines the lanes of each of sixteen rows.
#[inline(always)]
fn reduced<S: Simd>(r: [f32x16<S>; WIDTH], f: impl Fn(f32x16<S>, f32x16<S>) -> f32x16<S>) -> [f32; WIDTH] {
    // Each round leaves half as many rows, of twice as many inputs each. Unrolled by hand: a loop would
    // keep the rows in memory.
    let both = |a: f32x16<S>, b: f32x16<S>| f(a.zip_low(b), a.zip_high(b));
    let (a, b, c, d) = (both(r[0], r[8]), both(r[1], r[9]), both(r[2], r[10]), both(r[3], r[11]));
    let (e, f, g, h) = (both(r[4], r[12]), both(r[5], r[13]), both(r[6], r[14]), both(r[7], r[15]));
    let (a, b, c, d) = (both(a, e), both(b, f), both(c, g), both(d, h));
    let (a, b) = (both(a, c), both(b, d));
    both(a, b).to_array()
}

#[cfg(test)]
mod tests {
    use fearless_simd::{Level, dispatch};
    use nearmiss_testdata::arbitrary::{rng, unit_vector};

    use super::*;
    use crate::vector;

    #[test]
    fn vectors_are_spread_out_and_put_together() {
        for count in 0..=WIDTH + 1 {
            let vectors: Vec<[f32; 3]> = (0..count).map(|i| [0.0, 0.25, 0.5].map(|k| i as f32 + k)).collect();
            let mut lanes = [[-1.0; WIDTH]; 3];
            spread_out(&vectors, &mut lanes);
            for i in 0..WIDTH {
                let own = vectors.get(i).copied().unwrap_or([-1.0; 3]);
                assert_eq!([lanes[0][i], lanes[1][i], lanes[2][i]], own, "{count}, lane {i}");
            }
            let mut together = vec![[-2.0; 3]; count];
            put_together(&lanes, &mut together);
            let within = count.min(WIDTH);
            assert_eq!(together[..within], vectors[..within]);
            assert!(together[within..].iter().all(|v| *v == [-2.0; 3]), "surplus vectors stay");
        }
    }

    #[test]
    fn cube_roots_are_those_of_the_numbers() {
        let root = |x: f32| -> f32 {
            dispatch!(Level::new(), simd => cube_root(f32x16::splat(simd, x)).to_array()[7])
        };
        for exponent in -126..126_i32 {
            for step in 0..1000_u16 {
                let x = f32::from(step).mul_add(1e-3, 1.0) * 2.0_f32.powi(exponent);
                let (found, expected) = (f64::from(root(x)), f64::from(x).cbrt());
                assert!((found / expected - 1.0).abs() <= 1e-6, "{x}: {found}, {expected}");
            }
        }
        assert!((0.0..1e-12).contains(&root(0.0)), "{}", root(0.0));
    }

    #[test]
    #[expect(clippy::cast_possible_truncation, reason = "stored in single precision")]
    fn tangents_have_the_same_bits_as_those_of_one_vector() {
        let rng = &mut rng(4);
        let poles = [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [1.0, 0.0, -0.0], [0.0, -1.0, 0.0]];
        for step in 0..100 {
            let mut normals = [[0.0; WIDTH]; 3];
            let vectors: [[f32; 3]; WIDTH] = std::array::from_fn(|lane| match poles.get(lane) {
                Some(pole) if step == 0 => *pole,
                _ => unit_vector(rng).map(|x| x as f32),
            });
            for (lane, vector) in vectors.iter().enumerate() {
                for k in 0..3 {
                    normals[k][lane] = vector[k];
                }
            }
            let found = dispatch!(Level::new(), simd => {
                let [u, v] = tangents(simd, load(simd, &normals));
                [u, v].map(|v| v.map(|x| x.to_array()))
            });
            for (lane, vector) in vectors.into_iter().enumerate() {
                let (u, v) = vector::tangents(vector);
                let found = found.map(|v| v.map(|x| x[lane].to_bits()));
                assert_eq!(found, [u, v].map(|v| v.map(f32::to_bits)), "{vector:?}");
            }
        }
    }

    #[test]
    #[expect(clippy::cast_possible_truncation, reason = "arbitrary numbers")]
    fn rows_are_reduced_in_their_order() {
        let rng = &mut rng(5);
        let rows: [[f32; WIDTH]; WIDTH] =
            std::array::from_fn(|_| std::array::from_fn(|_| unit_vector(rng)[0] as f32));
        let found = dispatch!(Level::new(), simd => {
            let lanes = rows.map(|row| f32x16::load_array(simd, row));
            (least_of_each(lanes), greatest_of_each(lanes), lanes.map(sum))
        });
        let fold = |f: fn(f32, f32) -> f32| rows.map(|row| row.into_iter().reduce(f).unwrap());
        assert_eq!((found.0, found.1), (fold(f32::min), fold(f32::max)));
        for (found, row) in found.2.iter().zip(rows) {
            let expected: f64 = row.into_iter().map(f64::from).sum();
            assert!((f64::from(*found) - expected).abs() < 1e-5, "{found}, {expected}");
        }
    }

    #[test]
    fn lanes_and_blocks_are_those_of_the_points() {
        for start in 0..70 {
            for end in start + 1..100 {
                let points = start..end;
                let blocks: Vec<usize> = points.clone().map(|i| i / WIDTH).collect();
                assert_eq!(blocks_of(&points), blocks[0]..blocks[blocks.len() - 1] + 1, "{points:?}");
                for block in 0..8 {
                    let there: Vec<usize> =
                        points.clone().filter(|i| i / WIDTH == block).map(|i| i % WIDTH).collect();
                    assert_eq!(
                        Bits(lanes_of(block, &points)).collect::<Vec<_>>(),
                        there,
                        "{points:?}, {block}"
                    );
                }
            }
        }
    }
}
