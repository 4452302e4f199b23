//! Eigenpairs of many symmetric 3×3 matrices, one in each SIMD lane.

use fearless_simd::prelude::*;
use fearless_simd::{Level, dispatch, f64x8};

use crate::Eigen3;
use crate::eigen::solve;

/// Matrices in a block: one AVX-512 register of doubles, two of AVX, four of SSE2 or NEON.
const LANES: usize = 8;

/// Eight symmetric matrices, one in each lane.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(align(64))]
pub struct MatrixBlock {
    entries: [[f64; LANES]; 6],
}

impl MatrixBlock {
    /// Number of matrices in a block.
    pub const WIDTH: usize = LANES;

    /// Sets the matrix in a lane to the one with rows [xx xy xz], [xy yy yz], [xz yz zz]. Initially
    /// all matrices are zero.
    ///
    /// # Panics
    /// Panics if `lane` is not below [`Self::WIDTH`].
    #[inline]
    pub fn put(&mut self, lane: usize, matrix: [f64; 6]) {
        for (entries, x) in self.entries.iter_mut().zip(matrix) {
            entries[lane] = x;
        }
    }
}

/// The eigenpairs of eight matrices, one in each lane.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(align(64))]
pub struct EigenBlock {
    /// The eigenvalues, ascending in each lane.
    pub values: [[f64; LANES]; 3],
    /// The unit eigenvectors; `vectors[i][k]` holds the k-th components of the vectors of
    /// `values[i]`.
    pub vectors: [[[f64; LANES]; 3]; 3],
}

impl EigenBlock {
    /// Returns the eigenpairs of the matrix in a lane.
    ///
    /// # Panics
    /// Panics if `lane` is not below [`MatrixBlock::WIDTH`].
    #[inline]
    #[must_use]
    pub fn get(&self, lane: usize) -> Eigen3 {
        let (mut values, mut vectors) = ([0.0; 3], [[0.0; 3]; 3]);
        for i in 0..3 {
            values[i] = self.values[i][lane];
            for k in 0..3 {
                vectors[i][k] = self.vectors[i][k][lane];
            }
        }
        Eigen3 { values, vectors }
    }
}

/// Writes the eigenpairs of each block of `matrices` to the block of `eigen` with the same index,
/// up to the end of the shorter slice. The results equal those of
/// [`symmetric_eigen`](crate::symmetric_eigen) bit for bit.
///
/// `level` is the instruction set to use, as `Level::new()` detects it; it affects speed only.
pub fn symmetric_eigen_batch(level: Level, matrices: &[MatrixBlock], eigen: &mut [EigenBlock]) {
    dispatch!(level, simd => solve_blocks(simd, matrices, eigen));
}

#[inline(always)]
fn solve_blocks<S: Simd>(simd: S, matrices: &[MatrixBlock], eigen: &mut [EigenBlock]) {
    for (matrices, eigen) in matrices.iter().zip(eigen) {
        let [a, b, c, d, e, f] = matrices.entries;
        let load = |x: [f64; LANES]| f64x8::simd_from(simd, x);
        let (values, vectors) = solve([load(a), load(b), load(c), load(d), load(e), load(f)]);
        for i in 0..3 {
            eigen.values[i] = values[i].to_array();
            for k in 0..3 {
                eigen.vectors[i][k] = vectors[i][k].to_array();
            }
        }
    }
}
