//! Eigenpairs of a symmetric 3×3 matrix by cyclic Jacobi rotations, in double precision.
//!
//! Jacobi's method (Golub & Van Loan, "Matrix Computations", 4th ed., §8.5) converges for every symmetric
//! matrix, repeated eigenvalues included, and its eigenvectors are orthogonal to rounding: the cases in which
//! closed forms and S0's Cholesky route fail (docs/theory) do not arise.

/// Eigenvalues in ascending order with unit eigenvectors, a right-handed frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Eigen3 {
    /// Ascending.
    pub values: [f64; 3],
    /// `vectors[i]` belongs to `values[i]`.
    pub vectors: [[f64; 3]; 3],
}

/// An off-diagonal entry this small, of a matrix whose largest entry is 1, is rounding.
const NEGLIGIBLE: f64 = 1e-16;

/// The index pairs of the three off-diagonal entries.
const PAIRS: [(usize, usize); 3] = [(0, 1), (0, 2), (1, 2)];

/// The eigenpairs of the symmetric matrix with rows [xx xy xz], [xy yy yz], [xz yz zz].
///
/// The input is scaled by its largest entry, so any finite magnitudes do; a matrix that is zero or not finite
/// gives zeros (or its own non-finite trace) with the coordinate axes. Three to five sweeps.
#[must_use]
pub fn symmetric_eigen([xx, xy, xz, yy, yz, zz]: [f64; 6]) -> Eigen3 {
    /// Convergence is quadratic: six sweeps reduce any off-diagonal part below rounding.
    const SWEEPS: usize = 8;
    let largest = [xx, xy, xz, yy, yz, zz].iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    let mut v = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    if !(largest > 0.0 && largest.is_finite()) {
        return Eigen3 { values: [largest; 3], vectors: v };
    }
    let mut a = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]].map(|row| row.map(|x| x / largest));
    for _ in 0..SWEEPS {
        let off = PAIRS.iter().map(|&(p, q)| a[p][q].abs()).fold(0.0, f64::max);
        if off < NEGLIGIBLE {
            break;
        }
        for (p, q) in PAIRS {
            rotate(&mut a, &mut v, p, q);
        }
    }
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| a[i][i].total_cmp(&a[j][j]));
    let mut vectors = order.map(|i| v[i]);
    let [x, y, _] = vectors;
    vectors[2] = [x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]];
    Eigen3 { values: order.map(|i| a[i][i] * largest), vectors }
}

/// One Jacobi rotation that makes `a[p][q]` zero; `v` holds the eigenvectors in its rows.
fn rotate(a: &mut [[f64; 3]; 3], v: &mut [[f64; 3]; 3], p: usize, q: usize) {
    let off = a[p][q];
    if off.abs() < NEGLIGIBLE {
        return;
    }
    let theta = (a[q][q] - a[p][p]) / (2.0 * off);
    let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
    let c = 1.0 / (t * t + 1.0).sqrt();
    let s = t * c;
    a[p][p] -= t * off;
    a[q][q] += t * off;
    a[p][q] = 0.0;
    a[q][p] = 0.0;
    let r = 3 - p - q;
    let (rp, rq) = (a[r][p], a[r][q]);
    a[r][p] = c * rp - s * rq;
    a[r][q] = s * rp + c * rq;
    a[p][r] = a[r][p];
    a[q][r] = a[r][q];
    for k in 0..3 {
        let (vp, vq) = (v[p][k], v[q][k]);
        v[p][k] = c * vp - s * vq;
        v[q][k] = s * vp + c * vq;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn residual(m: [f64; 6], e: &Eigen3) -> f64 {
        let [xx, xy, xz, yy, yz, zz] = m;
        let rows = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
        let scale = m.iter().fold(f64::MIN_POSITIVE, |s, x| s.max(x.abs()));
        let mut worst = 0.0_f64;
        for i in 0..3 {
            for row in 0..3 {
                let bv: f64 = (0..3).map(|k| rows[row][k] * e.vectors[i][k]).sum();
                worst = worst.max((bv - e.values[i] * e.vectors[i][row]).abs() / scale);
            }
            for j in 0..3 {
                let dot: f64 = (0..3).map(|k| e.vectors[i][k] * e.vectors[j][k]).sum();
                worst = worst.max((dot - f64::from(u8::from(i == j))).abs());
            }
        }
        worst
    }

    #[test]
    fn special_matrices() {
        let cases = [
            [0.0; 6],
            [1.0, 0.0, 0.0, 1.0, 0.0, 1.0],
            [1.0, 1.0, 1.0, 1.0, 1.0, 1.0],
            [1.0, 0.0, 0.0, 1.0 + f64::EPSILON, 0.0, 1.0],
            [1e-30, 0.0, 0.0, 1e-30, 1e-46, 1e-30],
            [1e30, 1e14, -1e29, 3e30, 1e29, 1e30],
            [0.5, 0.0, 0.0, 0.5, 1e-18, 1e-17],
        ];
        for m in cases {
            let e = symmetric_eigen(m);
            assert!(residual(m, &e) < 1e-14, "{m:?}: {e:?}");
            assert!(e.values[0] <= e.values[1] && e.values[1] <= e.values[2], "ascending: {e:?}");
        }
    }

    proptest! {
        #[test]
        fn residuals_are_rounding(m in prop::array::uniform6(-1.0_f64..1.0), e in -100_i32..100) {
            let m = m.map(|x| x * 2.0_f64.powi(e));
            prop_assert!(residual(m, &symmetric_eigen(m)) < 1e-14);
        }

        #[test]
        fn nearly_equal_eigenvalues(a in 0.1_f64..1.0, d in 0.0_f64..1e-14, n in prop::array::uniform3(-1.0_f64..1.0)) {
            // aI + d n nᵀ: all three within d.
            let m = [a + d*n[0]*n[0], d*n[0]*n[1], d*n[0]*n[2], a + d*n[1]*n[1], d*n[1]*n[2], a + d*n[2]*n[2]];
            prop_assert!(residual(m, &symmetric_eigen(m)) < 1e-14);
        }
    }
}
