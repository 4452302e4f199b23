//! `slices inspect`.

use std::path::PathBuf;

use clap::Args;

use super::report::{Report, open};
use crate::console::{self, now};
use crate::error::CliError;

/// Options of `slices inspect`.
#[derive(Debug, Clone, Args)]
pub struct SlicesInspectArgs {
    /// Folder of the map
    pub folder: PathBuf,
    /// Load every slice and check that it is the one that was saved
    #[arg(long)]
    pub verify: bool,
    /// One object of JSON instead of sentences
    #[arg(long)]
    pub json: bool,
}

pub(super) fn run(args: &SlicesInspectArgs) -> Result<(), CliError> {
    let start = now();
    let folder = open(&args.folder)?;
    if args.verify {
        let (_, mut faults) = folder.load_all();
        let last = faults.pop();
        for fault in faults {
            console::warn(fault);
        }
        if let Some(fault) = last {
            return Err(fault.into());
        }
    }
    Report::new(&folder, start.elapsed()).tell(&folder, args.json)
}
