//! `slices export`: writes the images of Anjos et al. 2012.

use std::path::PathBuf;

use clap::Args;
use nearmiss_draw::picture::Picture;

use super::report::open;
use crate::console::{self, Console, Results};
use crate::digits::count;
use crate::error::CliError;
use crate::output;

/// Options of `slices export`.
#[derive(Debug, Clone, Args)]
pub struct SlicesExportArgs {
    /// Folder of the map
    pub folder: PathBuf,
    /// Folder for the images; made if missing
    ///
    /// The lowest slice is `slice-0000.png`. Other files in the folder stay, including images of
    /// other maps.
    #[arg(short, long, value_name = "FOLDER")]
    pub output: PathBuf,
    /// Show no progress
    #[arg(long)]
    pub quiet: bool,
}

pub(super) fn run(args: &SlicesExportArgs) -> Result<(), CliError> {
    let folder = open(&args.folder)?;
    std::fs::create_dir_all(&args.output).map_err(CliError::writing(&args.output))?;
    let slices = folder.grid().counts[2];
    let bar = Console::new(args.quiet).steps("slices", u64::from(slices));
    let mut faults = Vec::new();
    for slice in 0..slices {
        bar.advance(1);
        let image = match folder.load(slice) {
            Ok(image) => image,
            Err(fault) => {
                faults.push(fault);
                continue;
            }
        };
        let [width, height] = [image.width(), image.height()].map(|side| side as usize);
        let picture = Picture { width, height, pixels: image.rgb() };
        output::save_picture(&picture, &args.output.join(format!("slice-{slice:04}.png")))?;
    }
    drop(bar);
    let mut results = Results::new();
    results.line(format_args!(
        "{} written to {}",
        count(u64::from(slices) - faults.len() as u64, "image"),
        args.output.display()
    ))?;
    results.flush()?;
    // The other slices are usable.
    let last = faults.pop();
    faults.iter().for_each(console::warn);
    last.map_or(Ok(()), |fault| Err(fault.into()))
}
