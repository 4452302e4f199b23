//! Eigenvalues of a symmetric 3×3 matrix by cyclic Jacobi rotations (Golub & Van Loan, *Matrix
//! Computations*, 4th ed. 2013, §8.5). Slow and accurate to rounding, even for equal eigenvalues.

use nalgebra::{Matrix3, Vector3};

/// Eigenvalues in ascending order with their unit eigenvectors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Eigen {
    /// λ1 ≤ λ2 ≤ λ3.
    pub values: [f64; 3],
    /// Unit vectors, one for each value; their signs are arbitrary.
    pub vectors: [[f64; 3]; 3],
}

/// Returns the eigenvalues and eigenvectors of the symmetric part of `m`.
#[must_use]
pub fn symmetric_eigen(m: &Matrix3<f64>) -> Eigen {
    /// Number of sweeps. Convergence is quadratic; six sweeps reach rounding, the rest is margin.
    const SWEEPS: usize = 20;
    let mut a = 0.5 * (m + m.transpose());
    let mut v = Matrix3::identity();
    for _ in 0..SWEEPS {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if a[(p, q)] == 0.0 {
                continue;
            }
            // The smaller root of t² + 2 t cot 2φ = 1 annihilates a_pq.
            let cot = (a[(q, q)] - a[(p, p)]) / (2.0 * a[(p, q)]);
            let t = cot.signum() / (cot.abs() + cot.hypot(1.0));
            let c = 1.0 / t.hypot(1.0);
            let s = t * c;
            let mut turn = Matrix3::identity();
            turn[(p, p)] = c;
            turn[(q, q)] = c;
            turn[(p, q)] = s;
            turn[(q, p)] = -s;
            a = turn.transpose() * a * turn;
            a[(p, q)] = 0.0;
            a[(q, p)] = 0.0;
            v *= turn;
        }
    }
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| a[(i, i)].total_cmp(&a[(j, j)]));
    Eigen {
        values: order.map(|i| a[(i, i)]),
        vectors: order.map(|i| Vector3::from(v.column(i)).normalize().into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    #[test]
    fn the_parts_make_the_matrix_again() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
        for case in 0..200 {
            let mut m = Matrix3::from_fn(|_, _| rng.random_range(-1.0..1.0));
            m = m * m.transpose();
            if case % 4 == 0 {
                m = Matrix3::from_diagonal(&Vector3::new(1e-9, 1.0, 1.0));
            }
            let e = symmetric_eigen(&m);
            assert!(e.values[0] <= e.values[1] && e.values[1] <= e.values[2], "{e:?}");
            let mut sum = Matrix3::zeros();
            for k in 0..3 {
                let v = Vector3::from(e.vectors[k]);
                sum += e.values[k] * v * v.transpose();
            }
            assert!((sum - m).amax() < 1e-14 * (1.0 + m.amax()), "case {case}: {sum} {m}");
        }
    }
}
