//! Options that the programs share which make the figures of a paper, and where these figures go.

use std::path::PathBuf;

use clap::Args;

use crate::Failure;
use crate::plot::{Panel, figure};

/// Which figures are made, of what, and where they go.
#[derive(Debug, Clone, Args)]
pub struct FigureOptions {
    /// The folder to write to; it is made if it is not there
    #[arg(short = 'o', value_name = "FOLDER")]
    pub out: PathBuf,
    /// The folder of objects
    #[arg(long, value_name = "FOLDER", env = "NEARMISS_DATA")]
    pub data: Option<PathBuf>,
    /// Poses at each distance
    #[arg(long, value_name = "N")]
    pub poses: Option<usize>,
    /// The seed of all that is random
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Only the figure of this number
    #[arg(long, value_name = "NUMBER")]
    pub only: Option<u32>,
    /// A look rather than a measurement
    #[arg(long)]
    pub quick: bool,
}

impl FigureOptions {
    /// Poses at each distance: by default the first number if quick, otherwise the second.
    #[must_use]
    pub fn poses(&self, [quick, full]: [usize; 2]) -> usize {
        self.poses.unwrap_or(if self.quick { quick } else { full })
    }

    /// Whether any of these figures is asked for.
    #[must_use]
    pub fn wants(&self, figures: &[u32]) -> bool {
        self.only.is_none_or(|only| figures.contains(&only))
    }

    /// Writes a figure of `panels`, as SVG.
    ///
    /// # Errors
    /// When it cannot be drawn or written.
    pub fn save(&self, name: &str, panels: &[Panel]) -> Result<(), Failure> {
        Ok(std::fs::write(self.out.join(name), figure(panels)?)?)
    }
}
