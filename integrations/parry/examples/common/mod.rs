//! Input and errors of the example programs.

use std::path::Path;
use std::process::ExitCode;

use nearmiss::io::read;
use nearmiss::{BuildOptions, Check, PointCloud, Pose, Scan};

pub(crate) type Failure = Box<dyn std::error::Error>;

/// Opens a prepared scan (`.nm`), or prepares a file in any other format that nearmiss reads. Also returns
/// the points.
pub(crate) fn open(path: &str) -> Result<(Scan, PointCloud), Failure> {
    let named = |cause: &dyn std::fmt::Display| {
        let cause = cause.to_string();
        if cause.contains(path) { cause } else { format!("{path}: {cause}") }
    };
    if Path::new(path).extension().is_some_and(|ending| ending.eq_ignore_ascii_case("nm")) {
        let scan = Scan::open(path, Check::Full).map_err(|cause| named(&cause))?;
        let placed = scan.at(&Pose::IDENTITY);
        let points: Vec<[f64; 3]> = (0..scan.len()).map(|i| placed.point(i)).collect();
        let cloud = PointCloud::from_positions(&points)?;
        return Ok((scan, cloud));
    }
    let cloud = read(path, None).map_err(|cause| named(&cause))?.cloud;
    let scan = Scan::build(&cloud, &BuildOptions::default()).map_err(|cause| named(&cause))?;
    Ok((scan, cloud))
}

/// Prints the error of a program, if it failed. Returns the exit status.
#[expect(clippy::print_stderr, reason = "a program may print")]
pub(crate) fn finish(result: Result<(), Failure>) -> ExitCode {
    let Err(cause) = result else { return ExitCode::SUCCESS };
    eprintln!("error: {cause}");
    ExitCode::FAILURE
}
