//! The options of `mesh-collide`.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;

use crate::contacts::ContactArgs;
use crate::parse::{parse_duration, parse_threads, parse_work};
use crate::path::PathArgs;
use crate::posing::PairArgs;
use crate::viewpoint::ViewArgs;

/// Options of `mesh-collide`.
#[derive(Debug, Clone, Args)]
pub struct MeshCollideArgs {
    /// The meshes and their poses
    #[command(flatten)]
    pub pair: PairArgs,
    /// The options for many poses
    #[command(flatten)]
    pub path: PathArgs,
    /// Stop at the first contact of --poses
    #[arg(long, requires = "poses")]
    pub first: bool,
    /// Find all contacts, not one
    ///
    /// One contact is reported for each pair of triangles that meet.
    #[arg(long)]
    pub all: bool,
    /// The treatment of the contacts
    #[command(flatten)]
    pub contacts: ContactArgs,
    /// Also report how far and in which direction to move B out of A
    ///
    /// Closed parts count as solid, other parts as surfaces. The distance is reported as a lower and an
    /// upper bound, which hold even if --budget or --work ends the search. With --all, each clash has its
    /// depth as well.
    #[arg(long)]
    pub penetration: bool,
    /// Time limit for each query, such as 200us
    ///
    /// The unit is ns, us, ms or s. When time runs out, the answer is undecided.
    #[arg(long, value_name = "200us", allow_hyphen_values = true, value_parser = parse_duration, help_heading = "Budget and evidence")]
    pub budget: Option<Duration>,
    /// Work limit for each query; reproducible, unlike time
    ///
    /// A unit is one node pair; 500 to 10000 is common.
    #[arg(long, value_name = "N", value_parser = parse_work, help_heading = "Budget and evidence")]
    pub work: Option<u64>,
    /// Probability at which a node pair starts to count as colliding
    ///
    /// The search then visits the most probable pairs first, and stops when --k-min pairs have this
    /// probability. The answers `separated` and `intersecting` stay exact; a search that stops early
    /// answers `undecided` (Klein & Zachmann 2003).
    #[arg(long, value_name = "P", value_parser = parse_probability, conflicts_with = "all", help_heading = "Budget and evidence")]
    pub p_min: Option<f64>,
    /// The search stops when this many node pairs have at least the probability --p-min [default: 3]
    #[arg(long, value_name = "K", requires = "p_min", value_parser = parse_pairs, help_heading = "Budget and evidence")]
    pub k_min: Option<u32>,
    /// Threads; 0 for all cores
    ///
    /// By default, raw inputs are prepared on all cores and --poses are answered on one. The answers do
    /// not depend on the number of threads.
    #[arg(long, value_name = "N", value_parser = parse_threads, help_heading = "Budget and evidence")]
    pub threads: Option<usize>,
    /// Draw both meshes and their contacts, as PNG
    #[arg(long, value_name = "OUT.png", conflicts_with = "poses", help_heading = "Output")]
    pub image: Option<PathBuf>,
    /// From where the picture is taken
    #[command(flatten)]
    pub view: ViewArgs,
    /// Print one JSON object for each query
    #[arg(long, help_heading = "Output")]
    pub json: bool,
    /// Show no progress
    #[arg(long, help_heading = "Output")]
    pub quiet: bool,
}

/// Parses a probability.
fn parse_probability(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|p| (0.0..=1.0).contains(p));
    number.ok_or_else(|| format!("expected a probability from 0 to 1, got `{text}`"))
}

/// Parses a number of pairs.
fn parse_pairs(text: &str) -> Result<u32, String> {
    text.parse().ok().filter(|&pairs| pairs > 0).ok_or_else(|| "expected a whole number of 1 or more".into())
}
