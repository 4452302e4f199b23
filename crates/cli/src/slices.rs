//! `slices`: a building as a stack of images, and queries of it.

mod avatar_args;
mod build;
mod export;
mod inspect;
mod labels;
mod query;
mod reach;
mod reach_picture;
mod refusal;
mod report;
mod route;
mod searching;
mod start;
mod storey_view;
mod track;
mod walk;
mod walk_picture;

use clap::Subcommand;

pub use avatar_args::{AvatarArgs, AvatarBox, Spot};
pub use build::{BuildArgs, PixelArgs};
pub use export::SlicesExportArgs;
pub use inspect::SlicesInspectArgs;
pub use query::{FloorName, QueryArgs};
pub use reach::ReachArgs;
pub use route::RouteArgs;
pub use start::StartArgs;
pub use walk::{ResponseName, WalkArgs};

use crate::error::CliError;

const BUILD_EXAMPLES: &str = "\
Examples:
  nearmiss slices build building.ply -o building.slices --pixel 0.04
  nearmiss slices build atrium.obj -o atrium.slices --resolution 700 --up y --max-slope 35";

const QUERY_EXAMPLES: &str = "\
Example; boxes.jsonl has a line {\"min\":[x,y,z],\"max\":[x,y,z]} for each box:
  nearmiss slices query building.slices --boxes boxes.jsonl --json";

const WALK_EXAMPLES: &str = "\
Example; route.json contains {\"start\":[x,y,z],\"points\":[[x,y],…]}:
  nearmiss slices walk building.slices --route route.json --image walk.png --trace walk.csv";

const START_EXAMPLES: &str = "\
Examples:
  nearmiss slices start building.slices --near 3,4,0
  nearmiss slices start building.slices --json";

const REACH_EXAMPLES: &str = "\
Example:
  nearmiss slices reach building.slices --start 3,4,0 --image reach.png --csv reach.csv";

const ROUTE_EXAMPLES: &str = "\
Example, a route that is found and then walked:
  nearmiss slices route building.slices --from 3,4,0 --to 12,7,3.2 -o route.json
  nearmiss slices walk building.slices --route route.json --image walk.png";

/// The subcommands of `slices`.
#[derive(Debug, Clone, Subcommand)]
pub enum SlicesCommand {
    /// Build a slice map of a point cloud or mesh
    #[command(after_long_help = BUILD_EXAMPLES)]
    Build(BuildArgs),
    /// Report the size, bounds and storeys of a slice map
    Inspect(SlicesInspectArgs),
    /// Test boxes, or another map in given poses, for collision, and find the floor below
    #[command(after_long_help = QUERY_EXAMPLES)]
    Query(QueryArgs),
    /// Find a place where an avatar can stand
    #[command(after_long_help = START_EXAMPLES)]
    Start(StartArgs),
    /// Find all places that an avatar can walk to
    #[command(after_long_help = REACH_EXAMPLES)]
    Reach(ReachArgs),
    /// Find a short walkable route between two places
    #[command(after_long_help = ROUTE_EXAMPLES)]
    Route(RouteArgs),
    /// Walk an avatar along a route
    #[command(after_long_help = WALK_EXAMPLES)]
    Walk(WalkArgs),
    /// Write the slices as images, encoded as in Anjos et al. 2012
    Export(SlicesExportArgs),
}

pub(crate) fn run(command: &SlicesCommand) -> Result<(), CliError> {
    match command {
        SlicesCommand::Build(args) => build::run(args),
        SlicesCommand::Inspect(args) => inspect::run(args),
        SlicesCommand::Query(args) => query::run(args),
        SlicesCommand::Start(args) => start::run(args),
        SlicesCommand::Reach(args) => reach::run(args),
        SlicesCommand::Route(args) => route::run(args),
        SlicesCommand::Walk(args) => walk::run(args),
        SlicesCommand::Export(args) => export::run(args),
    }
}
