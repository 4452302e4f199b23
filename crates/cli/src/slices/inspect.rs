//! `slices inspect`: reports on a slice map.

use std::path::PathBuf;

use clap::Args;
use nearmiss::slices::{Avatar, AvatarOptions};

use super::report::{Detail, Report, open};
use crate::console::{self, Console, now};
use crate::error::CliError;

/// Options of `slices inspect`.
#[derive(Debug, Clone, Args)]
pub struct SlicesInspectArgs {
    /// Folder of the map
    pub folder: PathBuf,
    /// Load every slice and check that it is the one that was saved
    #[arg(long)]
    pub verify: bool,
    /// Print one JSON object instead of sentences
    #[arg(long)]
    pub json: bool,
    /// Show no progress
    #[arg(long)]
    pub quiet: bool,
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
    // The default avatar of the other commands.
    let options = AvatarOptions::default();
    let avatar = Avatar::new(&options).map_err(|e| CliError::Usage(e.to_string()))?;
    let bar = Console::new(args.quiet).spinner("looking for floors");
    let storeys = folder.storeys(&avatar);
    drop(bar);
    let storeys = storeys.map_err(|fault| console::warn(format_args!("cannot find floors: {fault}"))).ok();
    let detail = Detail::new(folder.grid(), storeys.as_deref());
    Report::new(&folder, start.elapsed()).with_detail(detail).tell(&folder, args.json)
}
