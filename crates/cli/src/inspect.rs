//! `inspect`: describes a prepared scan or mesh.

use std::path::PathBuf;

use clap::Args;
use nearmiss::store::File;
use nearmiss::{Check, Mesh, Scan};
use serde::Serialize;

use crate::advice::health;
use crate::console::Results;
use crate::error::CliError;
use crate::input;
use crate::mesh::report::MeshReport;
use crate::report::ScanReport;

/// Options of `inspect`.
#[derive(Debug, Clone, Args)]
pub struct InspectArgs {
    /// Prepared scan or mesh (.nm)
    #[arg(value_name = "FILE.nm")]
    pub file: PathBuf,
    /// Check the whole file: checksums, point indices and all values
    #[arg(long)]
    pub verify: bool,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Serialize)]
struct Report<T> {
    format_version: u32,
    #[serde(flatten)]
    content: T,
}

pub(crate) fn run(args: &InspectArgs) -> Result<(), CliError> {
    input::check_there(&args.file)?;
    let loading = || CliError::loading(&args.file);
    let check = if args.verify { Check::Full } else { Check::Structure };
    let file = File::open(&args.file, Check::Structure).map_err(|e| loading()(e.into()))?;
    if file.kind() == Mesh::KIND {
        let mesh = Mesh::open(&args.file, check).map_err(loading())?;
        let content = MeshReport::new(&mesh, file.byte_len());
        let lines = content.lines(&mesh);
        return tell(args, &Report { format_version: file.version(), content }, lines);
    }
    let scan = Scan::open(&args.file, check).map_err(loading())?;
    if args.verify {
        scan.sanity_check()
            .map_err(|flaw| CliError::CorruptScan { path: args.file.clone(), what: flaw.to_string() })?;
    }
    let content = ScanReport::new(&scan, file.byte_len());
    let lines = content.lines().into_iter().chain(health(&scan, &content.health)).collect();
    tell(args, &Report { format_version: file.version(), content }, lines)
}

fn tell<T: Serialize>(args: &InspectArgs, report: &Report<T>, lines: Vec<String>) -> Result<(), CliError> {
    let mut results = Results::new();
    if args.json {
        results.json(report)?;
        return results.flush();
    }
    results.line(format_args!("format     version {}", report.format_version))?;
    lines.into_iter().try_for_each(|line| results.line(line))?;
    if args.verify {
        results.line("verified   all checksums, ids and numbers are valid")?;
    }
    results.flush()
}
