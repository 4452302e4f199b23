//! Compares answers with those on record.

use std::fs;
use std::path::{Path, PathBuf};

use nearmiss_benches::Failure;
use nearmiss_benches::guard::{answers, cases};

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Also check the scans in this folder
    #[arg(long, value_name = "FOLDER")]
    data: Option<PathBuf>,
    /// Rewrite the record
    #[arg(long)]
    record: bool,
}

/// Returns `true` if no answer is worse than that on record.
pub(crate) fn run(arguments: &Arguments) -> Result<bool, Failure> {
    let mut all = cases::shipped()?;
    if let Some(folder) = &arguments.data {
        all.extend(cases::of_folder(folder)?);
    }
    let records = Path::new(env!("CARGO_MANIFEST_DIR")).join("record/answers");
    let mut is_clean = true;
    for case in &all {
        let path = records.join(format!("{}.csv", case.name));
        let rows = answers::ask(case)?;
        if arguments.record {
            fs::write(&path, answers::written(&rows))?;
            println!("{}: {} answers recorded", case.name, rows.len());
            continue;
        }
        let text = fs::read_to_string(&path).map_err(|cause| format!("{}: {cause}", path.display()))?;
        let old = answers::read(&text).map_err(|cause| format!("{}: {cause}", path.display()))?;
        let faults = answers::faults(&rows, &old);
        println!("{}: {} answers, {} faults", case.name, rows.len(), faults.len());
        for fault in &faults {
            println!("  {fault}");
        }
        is_clean &= faults.is_empty();
    }
    Ok(is_clean)
}
