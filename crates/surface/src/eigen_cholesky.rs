//! The least eigenpair by the method of Klein & Zachmann 2004, §5.6: the roots of the cubic
//! characteristic polynomial, then a Cholesky decomposition of B − λI with full pivoting.
//!
//! Kept for comparison. The coefficients of the polynomial are as large as B. Where two eigenvalues
//! are close, their roots are accurate only to 1e-8 of ‖B‖, and to 1e-5 where all three are close.
//! The eigenvector is no more accurate; docs/theory/eigen.md has the figures.
//! [`symmetric_eigen`](crate::symmetric_eigen) is faster and has no such loss.

use crate::eigen::{determinant, greatest_root, largest};
use nearmiss_lanes::lane::Lane;

/// The eigenvalues, and the unit eigenvector of the least eigenvalue.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LeastEigen {
    /// The eigenvalues, ascending.
    pub values: [f64; 3],
    /// The unit eigenvector of `values[0]`.
    pub vector: [f64; 3],
}

/// Returns the eigenvalues and the least eigenvector of the symmetric matrix with rows [xx xy xz],
/// [xy yy yz], [xz yz zz], by the cubic and pivoted Cholesky.
///
/// Accurate to rounding where the least eigenvalue is well separated, as on a sheet. Where it is
/// close to another eigenvalue, values and residual are accurate to about 1e-8 of the largest
/// entry, and to 1e-5 where all three are close. The result is finite for every finite matrix, and
/// NaN otherwise. Klein & Zachmann 2004 compute the roots by arc cosine. Here the root of largest
/// magnitude is computed as in [`symmetric_eigen`](crate::symmetric_eigen), and the others from the
/// quadratic that remains. This is as accurate, and the same on every machine.
#[must_use]
pub fn cubic_cholesky_eigen(matrix: [f64; 6]) -> LeastEigen {
    let (down, up) = largest(matrix).powers_of_two();
    let b = matrix.map(|x| x * down);
    let values = cubic_roots(b);
    let vector = null_vector(b, values[0]);
    LeastEigen { values: values.map(|x| (x * up).within(f64::MIN, f64::MAX)), vector }
}

/// Returns the roots of the characteristic polynomial, ascending.
fn cubic_roots(b: [f64; 6]) -> [f64; 3] {
    let [xx, xy, xz, yy, yz, zz] = b;
    let trace = xx + yy + zz;
    let minors = (xx * yy - xy * xy) + (xx * zz - xz * xz) + (yy * zz - yz * yz);
    // With λ = trace/3 + s y, the characteristic polynomial reads y³ − y = d.
    let s_sq = trace * trace / 3.0 - minors;
    let mean = trace / 3.0;
    if s_sq <= 0.0 {
        return [mean; 3];
    }
    let s = s_sq.sqrt();
    let constant = trace * (2.0 * trace * trace - 9.0 * minors) / 27.0 + determinant(b);
    let d = (constant / (s_sq * s)).clamp(-GREATEST_CONSTANT, GREATEST_CONSTANT);
    let single = greatest_root(d.abs());
    let spread = (4.0 - 3.0 * single * single).max(0.0).sqrt();
    let [low, high] = [-0.5 * (single + spread), -0.5 * (single - spread)];
    let roots = if d < 0.0 { [-single, -high, -low] } else { [low, high, single] };
    roots.map(|y| mean + s * y)
}

/// 2/√27. Beyond it two of the roots are complex, which happens by rounding only.
const GREATEST_CONSTANT: f64 = 0.384_900_179_459_750_5;

/// Returns a unit vector that B − λI maps to about zero.
///
/// The Cholesky decomposition with full pivoting stops after as many steps as the rank, when no
/// remaining pivot exceeds 3u times the first pivot (Higham, "Analysis of the Cholesky
/// decomposition of a semi-definite matrix", 1990). One remaining coordinate is set to 1, and back
/// substitution yields the others.
fn null_vector([xx, xy, xz, yy, yz, zz]: [f64; 6], l: f64) -> [f64; 3] {
    let mut m = [[xx - l, xy, xz], [xy, yy - l, yz], [xz, yz, zz - l]];
    let mut order = [0, 1, 2];
    let mut rank = 0;
    let mut enough = 0.0;
    for step in 0..2 {
        let pivot = (step..3).fold(step, |best, i| if m[i][i] > m[best][best] { i } else { best });
        m.swap(step, pivot);
        for row in &mut m {
            row.swap(step, pivot);
        }
        order.swap(step, pivot);
        if step == 0 {
            enough = 3.0 * 0.5 * f64::EPSILON * m[0][0];
        }
        if m[step][step] <= enough {
            break;
        }
        // The row of the factor without the square root of the pivot, which cancels.
        for i in step + 1..3 {
            let factor = m[step][i] / m[step][step];
            for j in step + 1..3 {
                m[i][j] -= factor * m[step][j];
            }
        }
        rank += 1;
    }
    let mut y = [0.0; 3];
    y[rank] = 1.0;
    for step in (0..rank).rev() {
        let rest: f64 = (step + 1..3).map(|j| m[step][j] * y[j]).sum();
        y[step] = -rest / m[step][step];
    }
    let length = (y[0] * y[0] + y[1] * y[1] + y[2] * y[2]).sqrt();
    let mut vector = [0.0; 3];
    for (i, x) in order.into_iter().zip(y) {
        vector[i] = x / length;
    }
    vector
}
