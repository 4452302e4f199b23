//! `inspect`: describes a prepared scan.

use std::path::PathBuf;

use clap::Args;
use nearmiss::store::File;
use nearmiss::{Check, Scan};
use serde::Serialize;

use crate::advice::health;
use crate::console::Results;
use crate::error::CliError;
use crate::input;
use crate::report::ScanReport;

/// Options of `inspect`.
#[derive(Debug, Clone, Args)]
pub struct InspectArgs {
    /// Prepared scan (.nm)
    #[arg(value_name = "FILE.nm")]
    pub file: PathBuf,
    /// Check everything: checksums, ids, and every number
    #[arg(long)]
    pub verify: bool,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Serialize)]
struct Report {
    format_version: u32,
    #[serde(flatten)]
    scan: ScanReport,
}

pub(crate) fn run(args: &InspectArgs) -> Result<(), CliError> {
    input::check_there(&args.file)?;
    let loading = || CliError::loading(&args.file);
    let check = if args.verify { Check::Full } else { Check::Structure };
    let scan = Scan::open(&args.file, check).map_err(loading())?;
    let file = File::open(&args.file, Check::Structure).map_err(|e| loading()(e.into()))?;
    if args.verify {
        scan.sanity_check()
            .map_err(|flaw| CliError::CorruptScan { path: args.file.clone(), what: flaw.to_string() })?;
    }
    let report = Report { format_version: file.version(), scan: ScanReport::new(&scan, file.byte_len()) };
    let mut results = Results::new();
    if args.json {
        results.json(&report)?;
        return results.flush();
    }
    results.line(format_args!("format     version {}", report.format_version))?;
    for line in report.scan.lines().into_iter().chain(health(&scan, &report.scan.health)) {
        results.line(line)?;
    }
    if args.verify {
        results.line("verified   all checksums, ids and numbers are valid")?;
    }
    results.flush()
}
