//! Naive twins in exact arithmetic, by the convex hull of all differences of corners.
//!
//! Two convex sets meet if and only if the origin is a difference of their points, and their
//! distance is that of the origin from the differences. The differences of two triangles are the
//! convex hull of the nine differences of corners. By Carathéodory's theorem, the origin lies in
//! the hull if and only if it lies in a simplex of at most four of the nine points.

use nearmiss_mesh::Corners;
use num_bigint::BigInt;
use num_rational::BigRational;
use num_traits::{Num, Signed, ToPrimitive};

type Vector<T> = [T; 3];

/// An exact integer type.
pub(crate) trait Exact: Clone + Num + Signed + PartialOrd {}
impl Exact for i128 {}
impl Exact for BigInt {}

fn minus<T: Exact>(a: &Vector<T>, b: &Vector<T>) -> Vector<T> {
    [0, 1, 2].map(|k| a[k].clone() - b[k].clone())
}

fn dot<T: Exact>(a: &Vector<T>, b: &Vector<T>) -> T {
    (0..3).fold(T::zero(), |sum, k| sum + a[k].clone() * b[k].clone())
}

fn cross<T: Exact>(a: &Vector<T>, b: &Vector<T>) -> Vector<T> {
    let minor = |i: usize, j: usize| a[i].clone() * b[j].clone() - a[j].clone() * b[i].clone();
    [minor(1, 2), minor(2, 0), minor(0, 1)]
}

fn det<T: Exact>(a: &Vector<T>, b: &Vector<T>, c: &Vector<T>) -> T {
    dot(a, &cross(b, c))
}

fn differences<T: Exact>(a: &[Vector<T>; 3], b: &[Vector<T>; 3]) -> Vec<Vector<T>> {
    a.iter().flat_map(|p| b.iter().map(|q| minus(p, q))).collect()
}

/// Returns `true` if the triangles share a point.
pub(crate) fn meet<T: Exact>(a: &[Vector<T>; 3], b: &[Vector<T>; 3]) -> bool {
    let points = differences(a, b);
    let n = points.len();
    for i in 0..n {
        for j in i + 1..n {
            if in_segment(&points[i], &points[j]) {
                return true;
            }
            for k in j + 1..n {
                if in_triangle(&points[i], &points[j], &points[k]) {
                    return true;
                }
                if (k + 1..n).any(|l| in_tetrahedron([&points[i], &points[j], &points[k], &points[l]])) {
                    return true;
                }
            }
        }
    }
    false
}

/// Equal points are a segment too.
fn in_segment<T: Exact>(p: &Vector<T>, q: &Vector<T>) -> bool {
    cross(p, q).iter().all(T::is_zero) && !dot(p, q).is_positive()
}

/// Returns `true` if the foot of the origin in the plane of three points lies in their triangle.
fn foot_in_triangle<T: Exact>(points: [&Vector<T>; 3], normal: &Vector<T>) -> bool {
    (0..3).all(|i| {
        let edge = cross(points[(i + 1) % 3], points[(i + 2) % 3]);
        !dot(&edge, normal).is_negative()
    })
}

fn in_triangle<T: Exact>(p: &Vector<T>, q: &Vector<T>, r: &Vector<T>) -> bool {
    let normal = cross(&minus(q, p), &minus(r, p));
    normal.iter().any(|x| !x.is_zero()) && dot(&normal, p).is_zero() && foot_in_triangle([p, q, r], &normal)
}

fn in_tetrahedron<T: Exact>(points: [&Vector<T>; 4]) -> bool {
    // Four volumes with the origin in place of a corner. The volume of all is their sum.
    let [p, q, r, s] = points;
    let shares = [det(q, r, s), -det(p, r, s), det(p, q, s), -det(p, q, r)];
    let whole = shares.iter().fold(T::zero(), |sum, x| sum + x.clone());
    let inside = |x: &T| if whole.is_positive() { !x.is_negative() } else { !x.is_positive() };
    !whole.is_zero() && shares.iter().all(inside)
}

/// The square of the distance of triangles that do not meet. The point of the hull nearest to the
/// origin is the foot of the origin in a simplex of at most three points.
fn square_distance(a: &[Vector<BigInt>; 3], b: &[Vector<BigInt>; 3]) -> f64 {
    let points = differences(a, b);
    let ratio = |x: BigInt, y: BigInt| BigRational::new_raw(x, y).to_f64().unwrap();
    let mut least = f64::INFINITY;
    for (i, p) in points.iter().enumerate() {
        least = least.min(ratio(dot(p, p), BigInt::from(1)));
        for (j, q) in points.iter().enumerate().skip(i + 1) {
            let along = minus(q, p);
            let (length, foot) = (dot(&along, &along), -dot(p, &along));
            if foot.is_positive() && foot < length {
                least = least.min(ratio(dot(p, p) * &length - &foot * &foot, length));
            }
            for r in &points[j + 1..] {
                let normal = cross(&along, &minus(r, p));
                let height = dot(&normal, p);
                if normal.iter().any(|x| *x != BigInt::ZERO) && foot_in_triangle([p, q, r], &normal) {
                    least = least.min(ratio(&height * &height, dot(&normal, &normal)));
                }
            }
        }
    }
    least
}

/// The corners as integers, in units of the returned power of two.
fn integers(triangles: [&Corners; 2]) -> ([[Vector<BigInt>; 3]; 2], i32) {
    let rational = |x: f64| BigRational::from_float(x).unwrap();
    let all = triangles.iter().flat_map(|t| t.iter().flatten());
    // Denominators are powers of two.
    let unit = all.map(|&x| rational(x).denom().clone()).max().unwrap();
    let integer = |x: f64| (rational(x) * BigRational::from_integer(unit.clone())).to_integer();
    let exponent = i32::try_from(unit.bits()).unwrap() - 1;
    (triangles.map(|t| t.map(|p| p.map(integer))), -exponent)
}

/// Returns `true` if triangles with any finite coordinates share a point.
pub(crate) fn floats_meet(a: &Corners, b: &Corners) -> bool {
    let ([a, b], _) = integers([a, b]);
    meet(&a, &b)
}

/// The distance of triangles with any finite coordinates, accurate to rounding.
pub(crate) fn distance(a: &Corners, b: &Corners) -> f64 {
    let ([a, b], exponent) = integers([a, b]);
    if meet(&a, &b) {
        return 0.0;
    }
    square_distance(&a, &b).sqrt() * 2.0_f64.powi(exponent)
}

/// The distance of a point from a triangle.
pub(crate) fn distance_to(p: [f64; 3], triangle: &Corners) -> f64 {
    distance(&[p; 3], triangle)
}
