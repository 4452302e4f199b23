//! The output of `preprocess`.

use nearmiss::Scan;
use serde::Serialize;

use super::args::PreprocessArgs;
use crate::advice::health;
use crate::console::{Console, Results, now};
use crate::error::CliError;
use crate::report::ScanReport;

#[derive(Debug, Serialize)]
struct Report {
    #[serde(flatten)]
    scan: ScanReport,
    seconds: Seconds,
}

#[derive(Debug, Serialize)]
pub(super) struct Seconds {
    pub(super) read: f64,
    pub(super) hierarchy: f64,
    pub(super) graph: f64,
    pub(super) write: f64,
}

/// Saves the scan. Returns its length in bytes and the time in seconds.
pub(super) fn save(args: &PreprocessArgs, scan: &Scan, console: Console) -> Result<(u64, f64), CliError> {
    let start = now();
    let _bar = console.spinner(format_args!("writing {}", args.output.display()));
    let bytes = scan.save(&args.output)?;
    Ok((bytes, start.elapsed().as_secs_f64()))
}

pub(super) fn tell(
    args: &PreprocessArgs,
    scan: &Scan,
    report: ScanReport,
    seconds: Seconds,
) -> Result<(), CliError> {
    let report = Report { scan: report, seconds };
    let mut results = Results::new();
    if args.json {
        results.json(&report)?;
    } else {
        for line in report.scan.lines() {
            results.line(line)?;
        }
        let Seconds { read, hierarchy, graph, write } = report.seconds;
        let graph = if scan.graph().is_some() { format!("graph {graph:.2}, ") } else { String::new() };
        results.line(format_args!(
            "seconds    read {read:.2}, hierarchy {hierarchy:.2}, {graph}write {write:.2}"
        ))?;
        for line in health(scan, &report.scan.health) {
            results.line(line)?;
        }
    }
    results.flush()
}
