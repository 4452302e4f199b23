//! Exact signs of areas and volumes, and weights of crossing points.
//!
//! A determinant is first evaluated in floating point with a bound on its rounding error. If the
//! bound does not settle the sign, the adaptive expansions of Shewchuk 1997 do (crate `robust`).
//! They are exact unless a product underflows or overflows: with coordinates that are 0 or of
//! magnitude [`LEAST`] to [`MOST`] neither happens. Other finite coordinates go to integers of
//! fixed width, which take up to 35 µs a sign and are exact always.

use std::cmp::Ordering;

use robust::{Coord, Coord3D, orient2d, orient3d};

use crate::triangle::between;
use crate::wide::{ANY, MEDIUM, MEDIUM_SPAN, SMALL, SMALL_SPAN, Wide, lowest_bit};

/// 2^-250. All bits of such numbers are at or above 2^-302, so each product of three differences is
/// a multiple of 2^-906, and the least error bound of the expansions, 2^-104 times that, is normal.
const LEAST: f64 = f64::from_bits((1023 - 250) << 52);

/// 2^300. Volumes stay below 2^906.
const MOST: f64 = f64::from_bits((1023 + 300) << 52);

/// Eight units of rounding (2^-53). Shewchuk 1997 proves 7 + 56 · 2^-53 of them for volumes and 3 +
/// 16 · 2^-53 for areas, relative to the sum of the magnitudes of the products; the rest covers the
/// rounding of the bound.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// Covers underflow: a product is off by at most 2^-1075, which is far below this times
/// [`ROUNDING`].
const UNDERFLOW: f64 = 1e-290;

/// Evaluates an expression with the least width of integers that is enough for determinants of the
/// points.
macro_rules! wide_enough {
    ($points:expr, |$unit:ident, $width:ident| $value:expr) => {{
        let ($unit, span) = span($points);
        if span <= SMALL_SPAN {
            const $width: usize = SMALL;
            $value
        } else if span <= MEDIUM_SPAN {
            const $width: usize = MEDIUM;
            $value
        } else {
            const $width: usize = ANY;
            $value
        }
    }};
}

/// The plane of a triangle, ready to tell the sides of many points.
///
/// A point is `Greater` if it lies on the side of the normal (b − a) × (c − a), `Equal` if it lies
/// in the plane. If the triangle has no area, every point is `Equal`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PlaneSides<'a> {
    corners: &'a [[f64; 3]; 3],
    normal: [f64; 3],
    /// Magnitudes of the products that make up the normal.
    scale: [f64; 3],
}

impl<'a> PlaneSides<'a> {
    #[inline]
    pub(crate) fn new(corners: &'a [[f64; 3]; 3]) -> Self {
        let [e, f] = [between(corners[0], corners[1]), between(corners[0], corners[2])];
        let products = [0, 1, 2].map(|k| [e[(k + 1) % 3] * f[(k + 2) % 3], e[(k + 2) % 3] * f[(k + 1) % 3]]);
        Self {
            corners,
            normal: products.map(|[p, q]| p - q),
            scale: products.map(|[p, q]| p.abs() + q.abs() + UNDERFLOW),
        }
    }

    /// The volume of `p` and a bound on its rounding error. Overflow makes the bound infinite or
    /// NaN.
    #[inline]
    fn rounded(&self, p: [f64; 3]) -> [f64; 2] {
        let d = between(self.corners[0], p);
        let volume = self.normal[0] * d[0] + self.normal[1] * d[1] + self.normal[2] * d[2];
        let scale = self.scale[0] * d[0].abs() + self.scale[1] * d[1].abs() + self.scale[2] * d[2].abs();
        [volume, ROUNDING * scale + UNDERFLOW]
    }

    /// The side of `p`, exactly.
    #[inline]
    pub(crate) fn side(&self, p: [f64; 3]) -> Ordering {
        let [volume, bound] = self.rounded(p);
        settled(volume, bound).unwrap_or_else(|| exact_side(self.corners, p))
    }

    /// The sides of the corners of a triangle, exactly; `None` if all lie strictly on one side.
    #[inline]
    pub(crate) fn sides(&self, corners: &[[f64; 3]; 3]) -> Option<[Ordering; 3]> {
        let [p, q, r] = corners.map(|p| self.rounded(p));
        // Without branches for single corners, which would be mispredicted.
        let above = [p, q, r].map(|[volume, bound]| volume > bound);
        let below = [p, q, r].map(|[volume, bound]| volume < -bound);
        if above[0] & above[1] & above[2] | below[0] & below[1] & below[2] {
            return None;
        }
        let sides = [0, 1, 2].map(|k| i8::from(above[k]).cmp(&i8::from(below[k])));
        if sides.iter().all(|side| side.is_ne()) {
            return Some(sides);
        }
        let open = |k: usize| if sides[k].is_ne() { sides[k] } else { exact_side(self.corners, corners[k]) };
        let exact = [open(0), open(1), open(2)];
        (exact[0].is_eq() || exact != [exact[0]; 3]).then_some(exact)
    }
}

#[inline]
fn settled(value: f64, bound: f64) -> Option<Ordering> {
    if value > bound {
        Some(Ordering::Greater)
    } else if value < -bound {
        Some(Ordering::Less)
    } else {
        None
    }
}

/// The sign of the volume of the tetrahedron, exactly: `Greater` if `d` lies on the side of (b − a)
/// × (c − a).
#[inline]
pub(crate) fn volume_sign(a: [f64; 3], b: [f64; 3], c: [f64; 3], d: [f64; 3]) -> Ordering {
    PlaneSides::new(&[a, b, c]).side(d)
}

#[cold]
#[inline(never)]
fn exact_side(corners: &[[f64; 3]; 3], p: [f64; 3]) -> Ordering {
    let [a, b, c] = *corners;
    if plainly_flat(&[a, b, c, p]) {
        return Ordering::Equal;
    }
    if [a, b, c, p].iter().flatten().all(|&x| in_range(x)) {
        let [a, b, c, p] = [a, b, c, p].map(|[x, y, z]| Coord3D { x, y, z });
        // Shewchuk's sign is that of the side from which a, b, c turn clockwise.
        return sign(-orient3d(a, b, c, p));
    }
    wide_enough!(&[a, b, c, p], |unit, N| volume::<N>(corners, p, unit).signum().cmp(&0))
}

/// The sign of the area of a triangle in the plane, exactly: `Greater` if a, b, c turn
/// counterclockwise.
#[inline]
pub(crate) fn area_sign(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> Ordering {
    let [left, right] = [(b[0] - a[0]) * (c[1] - a[1]), (b[1] - a[1]) * (c[0] - a[0])];
    let bound = ROUNDING * (left.abs() + right.abs()) + UNDERFLOW;
    settled(left - right, bound).unwrap_or_else(|| exact_area(a, b, c))
}

#[cold]
#[inline(never)]
fn exact_area(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> Ordering {
    if plainly_flat(&[a, b, c]) {
        return Ordering::Equal;
    }
    if [a, b, c].iter().flatten().all(|&x| in_range(x)) {
        let [a, b, c] = [a, b, c].map(|[x, y]| Coord { x, y });
        return sign(orient2d(a, b, c));
    }
    wide_enough!(&[a, b, c], |unit, N| area::<N>([a, b], c, unit).signum().cmp(&0))
}

/// Returns `true` if two points are equal, or all points share a coordinate: then they have no
/// volume, or no area. This is common in meshes: neighbours share corners, and walls are aligned.
fn plainly_flat<const D: usize>(points: &[[f64; D]]) -> bool {
    let aligned = (0..D).any(|k| points.iter().all(|p| p[k] == points[0][k]));
    aligned || points.iter().enumerate().any(|(i, p)| points[..i].contains(p))
}

fn in_range(x: f64) -> bool {
    x == 0.0 || (LEAST..=MOST).contains(&x.abs())
}

fn sign(x: f64) -> Ordering {
    // Adding 0 turns -0 into 0.
    (x + 0.0).total_cmp(&0.0)
}

/// The place of the lowest bit of some coordinates, and the number of bits from there to the
/// highest.
fn span<const D: usize>(points: &[[f64; D]]) -> (i32, i32) {
    let bits = points.iter().flatten().filter_map(|&x| lowest_bit(x));
    let widen = |[low, high]: [i32; 2], bit: i32| [low.min(bit), high.max(bit + 53)];
    let [low, high] = bits.fold([i32::MAX, i32::MIN], widen);
    // Without any number but 0 the unit does not matter.
    if low > high { (0, 0) } else { (low, high - low) }
}

/// Six times the volume of the tetrahedron, in cubic units.
fn volume<const N: usize>([a, b, c]: &[[f64; 3]; 3], p: [f64; 3], unit: i32) -> Wide<N> {
    let [a, b, c, p] = [*a, *b, *c, p].map(|point| point.map(|x| Wide::<N>::scaled(x, unit)));
    let [b, c, p] = [b, c, p].map(|point| [0, 1, 2].map(|k| point[k].minus(&a[k])));
    let term = |k: usize| {
        let [i, j] = [(k + 1) % 3, (k + 2) % 3];
        b[i].times(&c[j]).minus(&b[j].times(&c[i])).times(&p[k])
    };
    term(0).plus(&term(1)).plus(&term(2))
}

/// Twice the area of the triangle, in square units.
fn area<const N: usize>([a, b]: [[f64; 2]; 2], c: [f64; 2], unit: i32) -> Wide<N> {
    let [a, b, c] = [a, b, c].map(|point| point.map(|x| Wide::<N>::scaled(x, unit)));
    let [b, c] = [b, c].map(|point| [0, 1].map(|k| point[k].minus(&a[k])));
    b[0].times(&c[1]).minus(&b[1].times(&c[0]))
}

/// Greatest error of a weight that is computed in floating point, in units of rounding (2^-52).
/// Typical errors are 10 to 40.
pub(crate) const WEIGHT_ERROR: f64 = 64.0;

/// The weights of `p` and `q` at the point where the segment between them meets a plane. The error
/// is below [`WEIGHT_ERROR`]: if that of the rounded volumes may be greater, the volumes are
/// computed exactly. `p` and `q` must not lie strictly on the same side, nor both in the plane.
pub(crate) fn plane_weights(corners: &[[f64; 3]; 3], p: [f64; 3], q: [f64; 3]) -> [f64; 2] {
    let [a, b, c] = *corners;
    let plane = PlaneSides::new(corners);
    let [[of_p, off_p], [of_q, off_q]] = [p, q].map(|x| plane.rounded(x));
    let sum = of_p.abs() + of_q.abs();
    // Overflow makes the comparison fail.
    if 2.0 * (off_p + off_q) <= WEIGHT_ERROR * f64::EPSILON * sum && sum < f64::MAX {
        return [of_q.abs() / sum, of_p.abs() / sum];
    }
    wide_enough!(&[a, b, c, p, q], |unit, N| weights([p, q].map(|x| volume::<N>(corners, x, unit))))
}

/// The weights of `p` and `q` at the point where the segment between them meets a line in the
/// plane.
pub(crate) fn line_weights(line: [[f64; 2]; 2], p: [f64; 2], q: [f64; 2]) -> [f64; 2] {
    let [a, b] = line;
    wide_enough!(&[a, b, p, q], |unit, N| weights([p, q].map(|x| area::<N>(line, x, unit))))
}

fn weights<const N: usize>(sides: [Wide<N>; 2]) -> [f64; 2] {
    let [p, q] = sides.map(Wide::magnitude);
    let sum = p.plus(&q);
    if sum.signum() == 0 { [1.0, 0.0] } else { [q.ratio(&sum), p.ratio(&sum)] }
}

/// The point of the segment with these weights of its ends, within the box of the ends.
pub(crate) fn weighted(p: [f64; 3], q: [f64; 3], [of_p, of_q]: [f64; 2]) -> [f64; 3] {
    [0, 1, 2].map(|k| (of_p * p[k] + of_q * q[k]).max(p[k].min(q[k])).min(p[k].max(q[k])))
}
