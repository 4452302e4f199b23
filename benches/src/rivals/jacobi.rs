//! Eigenpairs of a symmetric 3×3 matrix by cyclic Jacobi rotations (Golub & Van Loan, "Matrix
//! Computations", 4th ed. 2013, §8.5). The method converges for every symmetric matrix, and its
//! eigenvectors are orthogonal up to rounding.

use nearmiss::surface::Eigen3;

/// Off-diagonal entries below this are rounding errors in a matrix whose largest entry is 1.
const NEGLIGIBLE: f64 = 1e-16;

/// The index pairs of the three off-diagonal entries.
const PAIRS: [(usize, usize); 3] = [(0, 1), (0, 2), (1, 2)];

/// The eigenpairs of the symmetric matrix with rows [xx xy xz], [xy yy yz], [xz yz zz].
///
/// The input is scaled by its largest entry, so any finite magnitudes are valid. A matrix that is
/// zero or not finite gives its largest absolute entry three times, with the coordinate axes. Three
/// to five sweeps.
#[must_use]
pub fn jacobi([xx, xy, xz, yy, yz, zz]: [f64; 6]) -> Eigen3 {
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

/// A Jacobi rotation that makes `a[p][q]` zero; `v` holds the eigenvectors in its rows.
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
