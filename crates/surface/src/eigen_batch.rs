//! Many symmetric 3×3 matrices at once, one in each SIMD lane.

use fearless_simd::prelude::*;
use fearless_simd::{Level, dispatch, f64x8};

use crate::Eigen3;
use crate::eigen::solve;

/// Matrices side by side: one AVX-512 register of doubles, two of AVX, four of SSE2 or NEON.
const LANES: usize = 8;

/// Eight symmetric matrices side by side.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(align(64))]
pub struct MatrixBlock {
    entries: [[f64; LANES]; 6],
}

impl MatrixBlock {
    /// How many fit.
    pub const WIDTH: usize = LANES;

    /// Puts the matrix with rows [xx xy xz], [xy yy yz], [xz yz zz] into a lane. All are zero at first.
    ///
    /// # Panics
    /// When there is no such lane.
    #[inline]
    pub fn put(&mut self, lane: usize, matrix: [f64; 6]) {
        for (entries, x) in self.entries.iter_mut().zip(matrix) {
            entries[lane] = x;
        }
    }
}

/// The eigenpairs of eight matrices side by side.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(align(64))]
pub struct EigenBlock {
    /// Ascending in each lane.
    pub values: [[f64; LANES]; 3],
    /// `vectors[i][k]` are the k-th components of the vectors that belong to `values[i]`.
    pub vectors: [[[f64; LANES]; 3]; 3],
}

impl EigenBlock {
    /// The eigenpairs of the matrix in a lane.
    ///
    /// # Panics
    /// When there is no such lane.
    #[inline]
    #[must_use]
    pub fn get(&self, lane: usize) -> Eigen3 {
        Eigen3 {
            values: self.values.each_ref().map(|x| x[lane]),
            vectors: self.vectors.each_ref().map(|v| v.each_ref().map(|x| x[lane])),
        }
    }
}

/// The eigenpairs of each block of `matrices`, in the block of `eigen` of the same index, as far as both go;
/// bit for bit those of [`symmetric_eigen`](crate::symmetric_eigen).
///
/// `level` is the instruction set to use, as `Level::new()` finds it; it changes the time alone.
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
