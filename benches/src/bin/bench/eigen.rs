//! Solvers of the symmetric 3×3 eigenproblem: time, and errors over families of matrices, as one
//! table.
//!
//! Every repeat runs each solver once, in turn, so that other load affects all of them.

use std::hint::black_box;

use nearmiss_benches::clock::{nanoseconds, timed};
use nearmiss_benches::object::Object;
use nearmiss_benches::rivals::eigen::{Answer, Contender, contenders};
use nearmiss_benches::sample::{count, quantile};
use nearmiss_benches::{Failure, machine};
use nearmiss_testdata::matrices::{Family, orthogonality_error, residual};

/// Problems timed together. With their results they fit into the L1 cache.
const TOGETHER: usize = 192;

/// Passes over the problems per measurement.
const PASSES: u32 = 10;

/// Points of a real neighbourhood, including the point itself.
const NEAR: usize = 20;

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// The object whose neighbourhoods give the matrices
    #[arg(default_value = "dragon-5k")]
    object: String,
    /// Repeats; the median counts
    #[arg(long, value_name = "N", default_value_t = 201)]
    repeats: usize,
    /// Matrices per family
    #[arg(long, value_name = "N", default_value_t = 20_000)]
    count: u32,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let (repeats, problems) = (arguments.repeats.max(1), arguments.count.max(1));
    let object = Object::read(&arguments.object)?;
    let real = neighbourhoods(&object);
    let mut solvers = contenders();

    println!("{}", machine::description());
    println!(
        "Median of {repeats} repeats, {TOGETHER} problems at a time; errors over {problems} matrices a family, real \
         neighbourhoods being {} of {}: worst ‖Bn − λn‖ / ‖B‖, worst error of orthonormality, number of failures \
         and NaN. No solver has a fallback.\n",
        real.len(),
        object.name
    );
    let names: Vec<String> = solvers.iter().map(|solver| solver.name()).collect();
    println!("| | {} |\n| --- |{}", names.join(" | "), " --: |".repeat(names.len()));
    let random = Family::Random.matrices(problems, 1);
    for (what, matrices) in [("ns, real neighbourhoods", &real), ("ns, random", &random)] {
        let times = times(&mut solvers, matrices, repeats);
        let cells: Vec<String> = times.iter().map(|ns| format!("{ns:.1}")).collect();
        println!("| {what} | {} |", cells.join(" | "));
        let relative: Vec<String> = times.iter().map(|ns| format!("{:.2}", ns / times[0])).collect();
        println!("| … of single | {} |", relative.join(" | "));
    }
    errors("real neighbourhoods", &real, &mut solvers);
    for family in Family::ALL {
        errors(&format!("{family:?}"), &family.matrices(problems, 1), &mut solvers);
    }
    Ok(())
}

/// Median nanoseconds per problem, for each solver.
fn times(solvers: &mut [Box<dyn Contender>], matrices: &[[f64; 6]], repeats: usize) -> Vec<f64> {
    let matrices = &matrices[..matrices.len().min(TOGETHER)];
    for solver in solvers.iter_mut() {
        solver.take(matrices);
    }
    let mut times = vec![Vec::new(); solvers.len()];
    for _ in 0..repeats {
        for (solver, times) in solvers.iter_mut().zip(&mut times) {
            let ((), time) = timed(|| {
                for _ in 0..PASSES {
                    black_box(&mut *solver).solve();
                }
            });
            times.push(nanoseconds(time) / f64::from(PASSES) / count(matrices.len()));
        }
    }
    times
        .iter_mut()
        .map(|times| {
            times.sort_unstable_by(f64::total_cmp);
            quantile(times, 0.5)
        })
        .collect()
}

/// Prints a table row of the worst errors.
fn errors(what: &str, matrices: &[[f64; 6]], solvers: &mut [Box<dyn Contender>]) {
    let cells = solvers.iter_mut().map(|solver| {
        solver.take(matrices);
        solver.solve();
        let (mut worst, mut skew, mut bad) = (0.0_f64, 0.0_f64, 0);
        for (&matrix, answer) in matrices.iter().zip(solver.answers()) {
            let (fit, frame) = match answer {
                Some(Answer::All(e)) => {
                    let fits = (0..3).map(|i| residual(matrix, e.values[i], e.vectors[i]));
                    (
                        fits.fold(0.0, |worst, fit| if fit <= worst { worst } else { fit }),
                        orthogonality_error(e.vectors),
                    )
                }
                Some(Answer::Least(value, vector)) => {
                    let length = vector.iter().map(|x| x * x).sum::<f64>();
                    (residual(matrix, value, vector), (length - 1.0).abs())
                }
                None => (f64::NAN, f64::NAN),
            };
            if fit.is_finite() && frame.is_finite() {
                (worst, skew) = (worst.max(fit), skew.max(frame));
            } else {
                bad += 1;
            }
        }
        format!("{worst:.0e}, {skew:.0e}, {bad}")
    });
    println!("| {what} | {} |", cells.collect::<Vec<_>>().join(" | "));
}

/// Covariances of the points nearest to each point of the object, at most 4000 of them.
fn neighbourhoods(object: &Object) -> Vec<[f64; 6]> {
    let points: Vec<[f64; 3]> = (0..object.cloud.len()).map(|i| object.cloud.point(i)).collect();
    let step = points.len().div_ceil(4000);
    points.iter().step_by(step).map(|x| covariance_about(&points, *x)).collect()
}

fn covariance_about(points: &[[f64; 3]], x: [f64; 3]) -> [f64; 6] {
    let mut offsets: Vec<[f64; 3]> = points.iter().map(|p| [p[0] - x[0], p[1] - x[1], p[2] - x[2]]).collect();
    let distance = |p: &[f64; 3]| p[0] * p[0] + p[1] * p[1] + p[2] * p[2];
    let near = NEAR.min(offsets.len());
    offsets.select_nth_unstable_by(near - 1, |a, b| distance(a).total_cmp(&distance(b)));
    let (mut first, mut second) = ([0.0; 3], [0.0; 6]);
    for &[x, y, z] in &offsets[..near] {
        first = [first[0] + x, first[1] + y, first[2] + z];
        for (sum, product) in second.iter_mut().zip([x * x, x * y, x * z, y * y, y * z, z * z]) {
            *sum += product;
        }
    }
    let [x, y, z] = first.map(|s| s / count(near));
    let [xx, xy, xz, yy, yz, zz] = second.map(|s| s / count(near));
    [xx - x * x, xy - x * y, xz - x * z, yy - y * y, yz - y * z, zz - z * z]
}
