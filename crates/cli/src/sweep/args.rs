//! The options of `sweep`.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;

use crate::as_mesh::AsMeshName;
use crate::error::CliError;
use crate::eval::KernelName;
use crate::meaning::MeaningArgs;
use crate::parse::{parse_duration, parse_radius, parse_work};
use crate::posing::PairArgs;
use crate::preprocess::parse_threads;
use crate::viewpoint::ViewArgs;

/// Options of `sweep`.
#[derive(Debug, Clone, Args)]
pub struct SweepArgs {
    /// The scans and their poses
    #[command(flatten)]
    pub pair: PairArgs,
    /// Poses of the path, one on each line of this file; `-` reads standard input
    ///
    /// Lines have the forms that `collide --poses` takes: `{"a":[…],"b":[…]}`, where either may be left
    /// out, or the pose of b alone. From line to line each scan moves by a screw: a steady rotation
    /// about an axis and a steady shift along it. A rotation takes the shorter way, at most half a
    /// turn; for larger rotations, give intermediate poses. The scale must stay the same.
    #[arg(long, alias = "poses", value_name = "FILE")]
    pub path: PathBuf,
    /// Distance that the scans must keep, in world units
    #[arg(long, alias = "margin", value_name = "D", allow_hyphen_values = true, value_parser = parse_radius, default_value = "0")]
    pub clearance: f64,
    /// Metric of the kernel that defines the surfaces; by default the one the scans were prepared for
    ///
    /// With the geodesic kernel, nothing is proven.
    #[arg(long, value_enum, conflicts_with = "thickened", help_heading = "Research", hide_short_help = true)]
    pub kernel: Option<KernelName>,
    /// The meaning of the scans
    #[command(flatten)]
    pub meaning: MeaningArgs,
    /// Compare the triangles of these inputs, a, b or both, instead of their points
    ///
    /// Like scans, meshes are hollow: what is wholly inside one does not touch it.
    #[arg(long, value_name = "WHICH", value_enum)]
    pub as_mesh: Option<AsMeshName>,
    /// Time limit for the whole motion, such as 50ms
    ///
    /// The unit is ns, us, ms or s. When time runs out, the answer states what has been proven.
    #[arg(long, value_name = "50ms", allow_hyphen_values = true, value_parser = parse_duration, help_heading = "Budget and evidence")]
    pub budget: Option<Duration>,
    /// Work limit for the whole motion; reproducible, unlike time
    ///
    /// A unit is one evaluation of f or one node pair.
    #[arg(long, value_name = "N", value_parser = parse_work, help_heading = "Budget and evidence")]
    pub work: Option<u64>,
    /// Threads to prepare raw inputs; 0 for all cores
    #[arg(long, value_name = "N", value_parser = parse_threads, help_heading = "Budget and evidence")]
    pub threads: Option<usize>,
    /// Draw the motion, coloured by clearance, and a plot of clearance over time, as PNG
    #[arg(long, value_name = "OUT.png", help_heading = "Output")]
    pub image: Option<PathBuf>,
    /// From where the picture is taken
    #[command(flatten)]
    pub view: ViewArgs,
    /// Print one JSON object
    #[arg(long, help_heading = "Output")]
    pub json: bool,
    /// Show no progress
    #[arg(long, help_heading = "Output")]
    pub quiet: bool,
}

impl SweepArgs {
    /// Fails if an option was given that does not apply to two meshes.
    pub(super) fn check_as_mesh(&self) -> Result<(), CliError> {
        let Some(AsMeshName::Both) = self.as_mesh else { return Ok(()) };
        AsMeshName::Both.refuse(&[
            ("--kernel", self.kernel.is_some()),
            ("--surface-only", self.meaning.surface_only),
            ("--thickened", self.meaning.thickened.is_some()),
        ])
    }
}
