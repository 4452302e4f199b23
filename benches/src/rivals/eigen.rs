//! Solvers of the symmetric 3×3 eigenproblem: ours, and what users would pick instead.

use glamx::DSymmetricEigen3;
use glamx::glam::DMat3;
use nalgebra::{Matrix3, SVD, SymmetricEigen};
use nearmiss::surface::{
    Eigen3, EigenBlock, Level, MatrixBlock, cubic_cholesky_eigen, symmetric_eigen, symmetric_eigen_batch,
};

use super::jacobi::jacobi;

/// More iterations than any convergent matrix takes. The default of nalgebra is unlimited.
const ITERATIONS: usize = 1000;

/// A solver with its problems in its own format, and memory for its results.
pub trait Contender {
    /// The name shown in tables.
    fn name(&self) -> String;

    /// Converts the problems to the solver's format; not timed.
    fn take(&mut self, matrices: &[[f64; 6]]);

    /// Solves all problems.
    fn solve(&mut self);

    /// The results; `None` where the solver gave up. A solver of one eigenpair gives the least
    /// eigenvalue with its vector.
    fn answers(&self) -> Vec<Option<Answer>>;
}

/// A solved problem.
#[derive(Debug, Clone, Copy)]
pub enum Answer {
    /// Three eigenpairs.
    All(Eigen3),
    /// The least eigenvalue with its eigenvector.
    Least(f64, [f64; 3]),
}

/// A solver that takes one matrix at a time.
struct OneByOne<M, R, F, A> {
    name: &'static str,
    convert: fn([f64; 6]) -> M,
    solver: F,
    answer: A,
    problems: Vec<M>,
    results: Vec<R>,
}

impl<M, R, F: Fn(&M) -> R, A: Fn(&R) -> Option<Answer>> Contender for OneByOne<M, R, F, A> {
    fn name(&self) -> String {
        self.name.into()
    }

    fn take(&mut self, matrices: &[[f64; 6]]) {
        self.problems = matrices.iter().map(|&m| (self.convert)(m)).collect();
        self.results = self.problems.iter().map(&self.solver).collect();
    }

    fn solve(&mut self) {
        for (problem, result) in self.problems.iter().zip(&mut self.results) {
            *result = (self.solver)(problem);
        }
    }

    fn answers(&self) -> Vec<Option<Answer>> {
        self.results.iter().map(&self.answer).collect()
    }
}

/// Our batch solver with one instruction set.
struct Batch {
    name: &'static str,
    level: Level,
    len: usize,
    problems: Vec<MatrixBlock>,
    results: Vec<EigenBlock>,
}

impl Contender for Batch {
    fn name(&self) -> String {
        format!("batch, {}", self.name)
    }

    fn take(&mut self, matrices: &[[f64; 6]]) {
        self.len = matrices.len();
        self.problems = vec![MatrixBlock::default(); self.len.div_ceil(MatrixBlock::WIDTH)];
        for (i, matrix) in matrices.iter().enumerate() {
            self.problems[i / MatrixBlock::WIDTH].put(i % MatrixBlock::WIDTH, *matrix);
        }
        self.results = vec![EigenBlock::default(); self.problems.len()];
    }

    fn solve(&mut self) {
        symmetric_eigen_batch(self.level, &self.problems, &mut self.results);
    }

    fn answers(&self) -> Vec<Option<Answer>> {
        let one = |i: usize| self.results[i / MatrixBlock::WIDTH].get(i % MatrixBlock::WIDTH);
        (0..self.len).map(|i| Some(Answer::All(one(i)))).collect()
    }
}

/// All solvers, ours first; faer with the feature `faer`. The batch solver occurs once for each instruction
/// set of this machine.
#[must_use]
pub fn contenders() -> Vec<Box<dyn Contender>> {
    let mut all: Vec<Box<dyn Contender>> = vec![one_by_one("single", |m| m, |m| symmetric_eigen(*m), all_of)];
    for (name, level) in levels() {
        all.push(Box::new(Batch { name, level, len: 0, problems: vec![], results: vec![] }));
    }
    all.extend([
        one_by_one(
            "cubic, Cholesky (S0)",
            |m| m,
            |m| cubic_cholesky_eigen(*m),
            |e| Some(Answer::Least(e.values[0], e.vector)),
        ),
        one_by_one("Jacobi", |m| m, |m| jacobi(*m), all_of),
        one_by_one(
            "glamx",
            glam_matrix,
            |m| DSymmetricEigen3::new(*m),
            |e| {
                let values = e.eigenvalues.to_array();
                Some(Answer::All(Eigen3 { values, vectors: e.eigenvectors.to_cols_array_2d() }))
            },
        ),
        one_by_one(
            "nalgebra",
            matrix,
            |m| SymmetricEigen::try_new(*m, f64::EPSILON, ITERATIONS),
            |e| e.as_ref().map(|e| sorted(e.eigenvalues.into(), e.eigenvectors.into())),
        ),
        one_by_one(
            "nalgebra SVD",
            matrix,
            |m| SVD::try_new(*m, true, true, f64::EPSILON, ITERATIONS),
            of_svd,
        ),
    ]);
    #[cfg(feature = "faer")]
    all.push(one_by_one("faer", matrix, faer_eigen, |e| *e));
    all
}

fn one_by_one<M: 'static, R: 'static>(
    name: &'static str,
    convert: fn([f64; 6]) -> M,
    solver: impl Fn(&M) -> R + 'static,
    answer: impl Fn(&R) -> Option<Answer> + 'static,
) -> Box<dyn Contender> {
    Box::new(OneByOne { name, convert, solver, answer, problems: vec![], results: vec![] })
}

fn levels() -> Vec<(&'static str, Level)> {
    let best = Level::new();
    #[cfg(target_arch = "x86_64")]
    {
        let wide = best.as_avx512().map(|l| ("AVX-512", Level::Avx512(l)));
        let avx2 = best.as_avx2().map(|l| ("AVX2", Level::Avx2(l)));
        let sse4 = best.as_sse4_2().map(|l| ("SSE4.2", Level::Sse4_2(l)));
        let sse2 = best.as_sse2().map(|l| ("SSE2", Level::Sse2(l)));
        [wide, avx2, sse4, sse2].into_iter().flatten().collect()
    }
    #[cfg(not(target_arch = "x86_64"))]
    vec![("best", best)]
}

#[expect(clippy::unnecessary_wraps, reason = "others give up")]
fn all_of(eigen: &Eigen3) -> Option<Answer> {
    Some(Answer::All(*eigen))
}

fn matrix([xx, xy, xz, yy, yz, zz]: [f64; 6]) -> Matrix3<f64> {
    Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
}

fn glam_matrix([xx, xy, xz, yy, yz, zz]: [f64; 6]) -> DMat3 {
    DMat3::from_cols_array(&[xx, xy, xz, xy, yy, yz, xz, yz, zz])
}

fn sorted(values: [f64; 3], vectors: [[f64; 3]; 3]) -> Answer {
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| values[i].total_cmp(&values[j]));
    Answer::All(Eigen3 { values: order.map(|i| values[i]), vectors: order.map(|i| vectors[i]) })
}

/// Singular values are magnitudes: the eigenvalue is negative if its two singular vectors are
/// opposite.
fn of_svd(svd: &Option<SVD<f64, nalgebra::U3, nalgebra::U3>>) -> Option<Answer> {
    let svd = svd.as_ref()?;
    let (u, v) = (svd.u?, svd.v_t?.transpose());
    let values = [0, 1, 2].map(|i| svd.singular_values[i].copysign(u.column(i).dot(&v.column(i))));
    Some(sorted(values, v.into()))
}

#[cfg(feature = "faer")]
fn faer_eigen(m: &Matrix3<f64>) -> Option<Answer> {
    let eigen = faer::Mat::from_fn(3, 3, |i, j| m[(i, j)]).self_adjoint_eigen(faer::Side::Lower).ok()?;
    let (values, vectors) = (eigen.S(), eigen.U());
    let vectors = [0, 1, 2].map(|k| [0, 1, 2].map(|i| vectors[(i, k)]));
    Some(sorted([0, 1, 2].map(|i| values[i]), vectors))
}
