//! Options that the programs for figures of papers share, and the writing of figures.

use std::path::PathBuf;

use clap::Args;

use crate::Failure;
use crate::plot::{Panel, figure};

/// Options of a program that makes the figures of a paper.
#[derive(Debug, Clone, Args)]
pub struct FigureOptions {
    /// The folder to write to; created if it does not exist
    #[arg(short = 'o', value_name = "FOLDER")]
    pub out: PathBuf,
    /// The folder of objects
    #[arg(long, value_name = "FOLDER", env = "NEARMISS_DATA")]
    pub data: Option<PathBuf>,
    /// Poses at each distance
    #[arg(long, value_name = "N")]
    pub poses: Option<usize>,
    /// Seed of the random numbers
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Only the figure with this number
    #[arg(long, value_name = "NUMBER")]
    pub only: Option<u32>,
    /// A quick look, with fewer poses
    #[arg(long)]
    pub quick: bool,
}

impl FigureOptions {
    /// Poses at each distance: by default `quick` with `--quick`, otherwise `full`.
    #[must_use]
    pub fn poses(&self, [quick, full]: [usize; 2]) -> usize {
        self.poses.unwrap_or(if self.quick { quick } else { full })
    }

    /// Returns `true` if any of these figures is wanted.
    #[must_use]
    pub fn wants(&self, figures: &[u32]) -> bool {
        self.only.is_none_or(|only| figures.contains(&only))
    }

    /// Writes a figure of `panels` as SVG.
    ///
    /// # Errors
    /// When the figure cannot be drawn or written.
    pub fn save(&self, name: &str, panels: &[Panel]) -> Result<(), Failure> {
        Ok(std::fs::write(self.out.join(name), figure(panels)?)?)
    }
}
