//! Conformance tests on families of matrices, run for each eigen solver.
use nearmiss_geometry::nalgebra::Matrix3;
use nearmiss_surface::{
    Eigen3, EigenBlock, Level, MatrixBlock, cubic_cholesky_eigen, symmetric_eigen, symmetric_eigen_batch,
};
use nearmiss_testdata::instructions::levels;
use nearmiss_testdata::matrices::{Family, orthogonality_error, residual};
use nearmiss_testdata::oracle;
use proptest::prelude::*;

const COUNT: u32 = 20_000;

fn worst_residual(matrix: [f64; 6], eigen: &Eigen3) -> f64 {
    (0..3).map(|i| residual(matrix, eigen.values[i], eigen.vectors[i])).fold(0.0, f64::max)
}

fn handedness([x, y, z]: [[f64; 3]; 3]) -> f64 {
    Matrix3::from_columns(&[x.into(), y.into(), z.into()]).determinant()
}

/// Checks that `eigen` holds the eigenpairs of `matrix` with the guarantees of [`symmetric_eigen`].
fn check(matrix: [f64; 6], eigen: &Eigen3) {
    let finite = eigen.values.iter().chain(eigen.vectors.iter().flatten()).all(|x| x.is_finite());
    assert!(finite, "{matrix:?}: {eigen:?}");
    let [l1, l2, l3] = eigen.values;
    assert!(l1 <= l2 && l2 <= l3, "{matrix:?}: {eigen:?} ascends");
    let error = worst_residual(matrix, eigen);
    assert!(error <= 4e-15, "{matrix:?}: {eigen:?} is off by {error:e}");
    let error = orthogonality_error(eigen.vectors);
    assert!(error < 3e-15, "{matrix:?}: {eigen:?} is no frame by {error:e}");
    assert!(handedness(eigen.vectors) > 0.0, "{matrix:?}: {eigen:?} is left-handed");
}

#[test]
fn closed_form_on_every_family() {
    for family in Family::ALL {
        for matrix in family.matrices(COUNT, 1) {
            check(matrix, &symmetric_eigen(matrix));
        }
    }
}

#[test]
fn closed_form_agrees_with_rotations() {
    for family in Family::ALL {
        for matrix in family.matrices(COUNT / 10, 2) {
            let largest = matrix.iter().fold(f64::MIN_POSITIVE, |m, x| m.max(x.abs()));
            if largest > 1e300 {
                continue;
            }
            let [xx, xy, xz, yy, yz, zz] = matrix.map(|x| x / largest);
            let twin = oracle::symmetric_eigen(&Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz));
            let eigen = symmetric_eigen(matrix);
            for i in 0..3 {
                let difference = (eigen.values[i] / largest - twin.values[i]).abs();
                assert!(difference < 4e-15, "{family:?} {matrix:?}: {eigen:?} for {twin:?}");
                // A vector rotates by the error over the distance to the nearest other eigenvalue.
                let gap = (0..3).filter(|&j| j != i).map(|j| (twin.values[i] - twin.values[j]).abs());
                let gap = gap.fold(f64::MAX, f64::min);
                let along: f64 = (0..3).map(|k| eigen.vectors[i][k] * twin.vectors[i][k]).sum();
                let across = (1.0 - along * along).max(0.0).sqrt();
                assert!(across <= 1e-7 + 4e-15 / gap, "{family:?} {matrix:?}: {eigen:?} for {twin:?}");
            }
        }
    }
}

fn bits(eigen: &Eigen3) -> [u64; 12] {
    let mut all = eigen.values.iter().chain(eigen.vectors.iter().flatten());
    [0; 12].map(|_| all.next().unwrap().to_bits())
}

#[test]
fn batches_have_the_bits_of_single_solves() {
    for level in levels() {
        for family in Family::ALL {
            let matrices = family.matrices(COUNT, 3);
            let mut blocks = vec![MatrixBlock::default(); matrices.len().div_ceil(MatrixBlock::WIDTH)];
            for (i, matrix) in matrices.iter().enumerate() {
                blocks[i / MatrixBlock::WIDTH].put(i % MatrixBlock::WIDTH, *matrix);
            }
            let mut solved = vec![EigenBlock::default(); blocks.len()];
            symmetric_eigen_batch(level, &blocks, &mut solved);
            for (i, matrix) in matrices.iter().enumerate() {
                let one = symmetric_eigen(*matrix);
                let of_many = solved[i / MatrixBlock::WIDTH].get(i % MatrixBlock::WIDTH);
                assert_eq!(bits(&of_many), bits(&one), "{level:?} {family:?} {matrix:?}");
            }
        }
    }
}

#[test]
fn batches_end_with_the_shorter_slice() {
    let mut matrices = [MatrixBlock::default(); 3];
    matrices[2].put(7, [3.0, 0.0, 0.0, 2.0, 0.0, 1.0]);
    let mut solved = [EigenBlock::default(); 4];
    symmetric_eigen_batch(Level::new(), &matrices, &mut solved);
    assert_eq!(solved[3], EigenBlock::default());
    assert!((solved[2].get(7).values[2] - 3.0).abs() < 1e-15, "{:?}", solved[2]);
    symmetric_eigen_batch(Level::new(), &matrices, &mut solved[..1]);
}

#[test]
fn what_is_no_number_gives_none() {
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for slot in 0..6 {
            let mut matrix = [1.0, 0.2, 0.3, 2.0, 0.4, 3.0];
            matrix[slot] = bad;
            let eigen = symmetric_eigen(matrix);
            assert!(eigen.values.iter().all(|x| x.is_nan()), "{matrix:?}: {eigen:?}");
            assert!(cubic_cholesky_eigen(matrix).values[0].is_nan(), "{matrix:?}");
        }
    }
}

#[test]
fn special_matrices() {
    for (matrix, values) in [
        ([0.0; 6], [0.0; 3]),
        ([1.0, 0.0, 0.0, 1.0, 0.0, 1.0], [1.0; 3]),
        ([1.0; 6], [0.0, 0.0, 3.0]),
        ([2.0, 0.0, 0.0, -1.0, 0.0, 0.5], [-1.0, 0.5, 2.0]),
        ([0.0, 1.0, 0.0, 0.0, 0.0, 0.0], [-1.0, 0.0, 1.0]),
        ([5e-324, 0.0, 0.0, 0.0, 0.0, 0.0], [0.0, 0.0, 5e-324]),
        ([f64::MAX; 6], [0.0, 0.0, f64::MAX]),
        ([f64::MIN; 6], [f64::MIN, 0.0, 0.0]),
    ] {
        let eigen = symmetric_eigen(matrix);
        check(matrix, &eigen);
        let largest = matrix.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        for (value, expected) in eigen.values.into_iter().zip(values) {
            assert!((value - expected).abs() <= 1e-15 * largest, "{matrix:?}: {eigen:?}");
        }
    }
}

proptest! {
    #[test]
    fn closed_form_on_any_bits(words in prop::array::uniform6(any::<u64>())) {
        let matrix = words.map(f64::from_bits);
        prop_assume!(matrix.iter().all(|x| x.is_finite()));
        check(matrix, &symmetric_eigen(matrix));
    }

    #[test]
    fn closed_form_near_a_multiple_of_the_identity(
        x in 0.1_f64..1.0, size in -20_i32..0, part in prop::array::uniform6(-1.0_f64..1.0),
    ) {
        let [a, b, c, d, e, f] = part.map(|y| y * 10.0_f64.powi(size));
        let matrix = [x + a, b, c, x + d, e, x + f];
        check(matrix, &symmetric_eigen(matrix));
    }

    #[test]
    fn closed_form_of_few_different_entries(parts in prop::array::uniform6(-2_i8..3), power in -1000_i32..1000) {
        let matrix = parts.map(|x| f64::from(x) * 2.0_f64.powi(power));
        check(matrix, &symmetric_eigen(matrix));
    }
}

/// Returns the greatest residual of the least eigenpair by the cubic and Cholesky.
fn worst_of_cubic(family: Family) -> f64 {
    let mut worst = 0.0_f64;
    for matrix in family.matrices(COUNT, 4) {
        let least = cubic_cholesky_eigen(matrix);
        let finite = least.values.iter().chain(&least.vector).all(|x| x.is_finite());
        assert!(finite, "{family:?} {matrix:?}: {least:?}");
        assert!(least.values.is_sorted(), "{family:?} {matrix:?}: {least:?}");
        let length: f64 = least.vector.iter().map(|x| x * x).sum();
        assert!((length - 1.0).abs() < 1e-14, "{family:?} {matrix:?}: {least:?}");
        worst = worst.max(residual(matrix, least.values[0], least.vector));
    }
    worst
}

#[test]
fn cubic_is_exact_where_the_least_eigenvalue_is_apart() {
    for family in [Family::Planar, Family::Neighbourhood, Family::Zero] {
        let worst = worst_of_cubic(family);
        assert!(worst < 1e-13, "{family:?}: {worst:e}");
    }
}

#[test]
fn cubic_loses_half_the_digits_where_eigenvalues_are_close() {
    for family in Family::ALL {
        let worst = worst_of_cubic(family);
        assert!(worst < 2e-5, "{family:?}: {worst:e}");
        if matches!(family, Family::Isotropic | Family::Linear | Family::RankOne | Family::OneBit) {
            assert!(worst > 1e-9, "{family:?}: {worst:e}; better than documented");
        }
    }
}
