//! Eigenpairs of a symmetric 3×3 matrix in closed form, in double precision.
//!
//! Let A be the matrix minus a third of its trace, scaled so that tr A² = 2. Its characteristic
//! polynomial is y³ − y = det A. Only the root of largest magnitude is computed. It differs from
//! both other roots by at least 1, so this root and its eigenvector are as exact as the matrix,
//! however close the other two are. Perpendicular to that eigenvector a 2×2 problem remains, which
//! one rotation solves. This is the order of Eberly, "A Robust Eigensolver for 3 × 3 Symmetric
//! Matrices", 2014. Two things differ: the other two eigenvalues are those of the 2×2 problem
//! instead of roots of the cubic, and a polynomial replaces arc cosine and cosine.
//! docs/theory/eigen.md derives the error bound.
//!
//! There are no branches and no calls, so the same code solves one matrix, or eight in SIMD lanes
//! ([`symmetric_eigen_batch`](crate::symmetric_eigen_batch)).

use nearmiss_lanes::lane::Lane;

/// Eigenvalues in ascending order with unit eigenvectors, which form a right-handed frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Eigen3 {
    /// The eigenvalues, ascending.
    pub values: [f64; 3],
    /// The unit eigenvectors; `vectors[i]` belongs to `values[i]`.
    pub vectors: [[f64; 3]; 3],
}

/// Returns the eigenpairs of the symmetric matrix with rows [xx xy xz], [xy yy yz], [xz yz zz].
///
/// For every finite matrix, ‖Bn − λn‖ is a few units in the last place of the largest entry, and
/// the vectors are orthonormal to rounding. This includes any magnitude, and equal or nearly equal
/// eigenvalues. A multiple of the identity yields an arbitrary frame. Eigenvalues beyond the range
/// of `f64` are clamped to it. A matrix that is not finite yields NaN throughout. The result has
/// the same bits on every machine. The function is inlined, so results that the caller does not use
/// are not computed.
#[must_use]
#[inline]
pub fn symmetric_eigen(matrix: [f64; 6]) -> Eigen3 {
    let (values, vectors) = solve(matrix);
    Eigen3 { values, vectors }
}

/// Below this sum of squares, of a matrix whose largest entry is about 1, every direction is
/// accepted as an eigenvector: eigenvalues differ by at most 10⁻⁴ units in the last place.
/// (Subnormal entries are scaled to at least 2⁻⁵², and differ by as much.)
const ISOTROPIC: f64 = 1e-40;

/// Returns eigenvalues and eigenvectors as [`symmetric_eigen`] does, of one matrix or of one in
/// each lane. Compiled for the instruction set of the caller.
#[inline(always)]
pub(crate) fn solve<L: Lane>(matrix: [L; 6]) -> ([L; 3], [[L; 3]; 3]) {
    let (down, up) = largest(matrix).powers_of_two();
    let (mut values, vectors) = solve_scaled(down.scale_all(matrix));
    let third = up * (1.0 / 3.0);
    for x in &mut values {
        *x = (*x * third).within(f64::MIN, f64::MAX);
    }
    (values, vectors)
}

/// Returns three times the eigenvalues, and the eigenvectors, of a matrix scaled so that its
/// largest entry is about 1, or much less where every direction may be an eigenvector.
#[inline(always)]
pub(crate) fn solve_scaled<L: Lane>([xx, xy, xz, yy, yz, zz]: [L; 6]) -> ([L; 3], [[L; 3]; 3]) {
    // Three times the matrix minus its trace times I. Differences come first, so that errors are
    // relative to the distance of the matrix from a multiple of the identity.
    let (x_y, y_z, z_x) = (xx - yy, yy - zz, zz - xx);
    let a = [x_y - z_x, xy * 3.0, xz * 3.0, y_z - x_y, yz * 3.0, z_x - y_z];
    // Half the sum of squares of `a`, whose trace is zero.
    let squares = (a[3] * a[3] - a[0] * a[5]) + ((a[1] * a[1] + a[2] * a[2]) + a[4] * a[4]);

    // In units of √squares the characteristic polynomial is y³ − y = det.
    let zero = squares.splat(0.0);
    let scale = squares.sqrt();
    let inverse = squares.splat(1.0) / squares;
    let inverse = L::select(squares.splat(ISOTROPIC).is_less(squares), inverse, zero);
    let det = determinant(a) * inverse * inverse * scale;
    let a = (inverse * scale).scale_all(a);
    let is_least = det.is_less(zero);
    let root = greatest_root(det.abs());
    let single = L::select(is_least, -root, root);
    let ([low, high, v], [l, m]) = frame(a, single);

    let vectors = [
        L::select_all(is_least, v, low),
        L::select_all(is_least, low, high),
        L::select_all(is_least, high, v),
    ];
    let mut values = L::select_all(is_least, [single, l, m], [l, m, single]);
    let trace = xx + yy + zz;
    for x in &mut values {
        *x = trace + *x * scale;
    }
    (values, vectors)
}

/// Returns the largest magnitude, clamped so that its power of two and the inverse of that are
/// normal.
#[inline(always)]
pub(crate) fn largest<L: Lane>([a, b, c, d, e, f]: [L; 6]) -> L {
    /// 2¹⁰²².
    const GREATEST: f64 = f64::from_bits(2045 << 52);
    let abc = a.abs().greater(b.abs()).greater(c.abs());
    let def = d.abs().greater(e.abs()).greater(f.abs());
    abc.greater(def).within(f64::MIN_POSITIVE, GREATEST)
}

#[inline(always)]
pub(crate) fn determinant<L: Lane>([xx, xy, xz, yy, yz, zz]: [L; 6]) -> L {
    xx * (yy * zz - yz * yz) + (xy * (xz * yz - xy * zz) + xz * (xy * yz - yy * xz))
}

/// Returns the greatest root of y³ − y = d for d from 0 to 2/√27, to rounding. The root is 2/√3 ·
/// cos(acos(√27/2 · d)/3).
///
/// Evaluates the polynomial of degree 17 that interpolates the root at Chebyshev nodes (error
/// 1e-16). In t = √27 d − 1, which ranges from −1 to 1, the root is analytic except for t ≤ −3, so
/// each degree reduces the error by a factor of 3 + √8.
#[inline(always)]
pub(crate) fn greatest_root<L: Lane>(d: L) -> L {
    const ROOT_27: f64 = 5.196_152_422_706_632;
    const C: [f64; 18] = [
        1.0850635751324982,
        0.07600447629459307,
        -0.007426357194084806,
        0.001277855073302754,
        -0.0002697903302152648,
        6.340970883330371e-05,
        -1.592479354547717e-05,
        4.183813612567211e-06,
        -1.1357061374244488e-06,
        3.1601890516276335e-07,
        -8.961635816434765e-08,
        2.582598435059582e-08,
        -7.613463605013604e-09,
        2.247599363158445e-09,
        -5.960819128919615e-10,
        1.7839953578976831e-10,
        -9.298569745910026e-11,
        2.839563213074071e-11,
    ];
    // Estrin's scheme. The chain of dependent operations is a third as long as with Horner's
    // scheme.
    let t = d * ROOT_27 - 1.0;
    let t2 = t * t;
    let t4 = t2 * t2;
    let t8 = t4 * t4;
    let low = cubic(&C[0..4], t, t2) + cubic(&C[4..8], t, t2) * t4;
    let high = (cubic(&C[8..12], t, t2) + (t * C[17] + C[16]) * t8) + cubic(&C[12..16], t, t2) * t4;
    low + high * t8
}

/// Evaluates the polynomial with these four coefficients, lowest power first.
#[inline(always)]
fn cubic<L: Lane>(c: &[f64], t: L, t2: L) -> L {
    (t * c[1] + c[0]) + (t * c[3] + c[2]) * t2
}

/// Returns right-handed unit eigenvectors of `a`, and two eigenvalues. The trace of `a` is 0 and
/// half its sum of squares is 1.
///
/// `single` is the eigenvalue of the third vector. The first two vectors belong to the lower and
/// the higher of the other two eigenvalues, which are returned in this order.
///
/// The adjugate of A − λI is a multiple of v vᵀ with norm at least 1; v is its column with the
/// greatest diagonal entry. Square roots and divisions are postponed, so that they run in parallel.
#[inline(always)]
fn frame<L: Lane>(a: [L; 6], single: L) -> ([[L; 3]; 3], [L; 2]) {
    /// Added to a length to keep it above zero; lengths that matter are above 1e-17.
    const TINY: f64 = 1e-30;
    let zero = single.splat(0.0);
    let [xx, xy, xz, yy, yz, zz] = a;
    let (mx, my, mz) = (xx - single, yy - single, zz - single);
    let (cxx, cyy, czz) = (my * mz - yz * yz, mx * mz - xz * xz, mx * my - xy * xy);
    let (cxy, cxz, cyz) = (xz * yz - xy * mz, xy * yz - my * xz, xy * xz - mx * yz);
    let v = L::select_all(cxx.is_less(cyy), [cxy, cyy, cyz], [cxx, cxy, cxz]);
    // Where z is the greatest, the axes are renamed y z x, so that v is never along the last axis.
    let is_z = cxx.is_less(czz) & cyy.is_less(czz);
    let [x, y, z] = L::select_all(is_z, [cyz, czz, cxz], v);
    let [xx, xy, xz, yy, yz] = L::select_all(is_z, [yy, yz, xy, zz, xz], [xx, xy, xz, yy, yz]);

    // f = [y −x 0] and e = v × f = [xz yz −f·f] span the plane perpendicular to v. As v is an
    // eigenvector, e·Af = −v·v (Af)z.
    let (x_sq, y_sq) = (x * x, y * y);
    let f_sq = x_sq + y_sq;
    let v_sq = f_sq + z * z;
    let faf = (y_sq * xx + x_sq * yy) - x * y * (xy * 2.0);
    let eaf = v_sq * (x * yz - y * xz);

    let inverse_v_sq = single.splat(1.0) / v_sq;
    let inverse_v = inverse_v_sq * v_sq.sqrt();
    let v = inverse_v.scale_all([x, y, z]);
    let (ex, ey, ez) = (z * v[0], z * v[1], f_sq * inverse_v);

    // The 2×2 matrix along f and e/|v|, times f·f. Its trace is −single.
    let half = single * -0.5 * f_sq - faf;
    let long = half.abs() + TINY;
    let spread = (long * long + eaf * eaf * inverse_v_sq).sqrt();
    let long = long + spread;
    // long² + short², times f·f.
    let square = spread * (f_sq + f_sq) * long;
    let unit = square.sqrt() * (single.splat(1.0) / square);
    let (long, short) = (long * unit, eaf * inverse_v * unit);
    let [c, s] = L::select_all(half.is_less(zero), [short, long], [long, short]);
    let low = [c * y - s * ex, -(c * x) - s * ey, s * ez];
    let high = [s * y + c * ex, c * ey - s * x, -(c * ez)];
    let (mean, spread) = (single * -0.5, spread / f_sq);
    ([named_back(is_z, low), named_back(is_z, high), named_back(is_z, v)], [mean - spread, mean + spread])
}

/// Returns a vector with renamed axes y z x in the original axis order, where `is_z`.
#[inline(always)]
fn named_back<L: Lane>(is_z: L::Mask, [x, y, z]: [L; 3]) -> [L; 3] {
    L::select_all(is_z, [z, x, y], [x, y, z])
}
