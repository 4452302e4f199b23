#![doc = include_str!("../README.md")]

mod animate;
mod bus;
mod cast;
mod clash;
mod collide;
mod collide_args;
mod console;
mod convert;
mod curve;
mod density;
mod distance;
mod error;
mod eval;
mod evidence;
mod export;
mod inspect;
mod mesh;
mod poses;
mod preprocess;
mod proof;
mod sample;
mod slices;
mod sweep;
mod touch;

mod as_mesh;
mod bodies;
mod estimate;
mod filters;
mod guarded;
mod input;
mod json_lines;
mod label;
mod matrix;
mod memory;
mod motion_words;
mod output;
mod parse;
mod path;
mod path_entry;
mod path_plot;
mod penetration;
mod pose_batch;
mod pose_text;
mod posing;
mod progress;
mod threads;
mod units;

mod advice;
mod answer_report;
mod contacts;
mod digits;
mod health;
mod html;
mod meaning;
mod report;
mod search;
mod sentence;

mod curve_picture;
mod distance_picture;
mod geodesic;
mod kinds_picture;
mod level;
mod no_curve;
mod picture;
mod viewpoint;

#[cfg(test)]
mod defaults;

use std::ffi::OsString;
use std::iter;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};

pub use animate::{AnimateArgs, AnimateMethod};
pub use as_mesh::AsMeshName;
pub use cast::CastArgs;
pub use clap;
pub use clash::ClashArgs;
pub use collide_args::{CollideArgs, DetailName, EvidenceName};
pub use contacts::ContactArgs;
pub use convert::ConvertArgs;
pub use curve::CurveArgs;
pub use curve_picture::curve_picture;
pub use density::DensityArgs;
pub use distance::DistanceArgs;
pub use error::CliError;
pub use eval::{EvalArgs, KernelName};
pub use export::ExportArgs;
pub use filters::{ClassList, CropBox, FilterArgs, LeastNeighbours, Outliers};
pub use geodesic::geodesic_picture;
pub use inspect::InspectArgs;
pub use kinds_picture::kinds_picture;
pub use level::level_picture;
pub use matrix::PoseRefused;
pub use meaning::MeaningArgs;
pub use memory::MemoryArgs;
pub use mesh::args::MeshCollideArgs;
pub use output::save_picture;
pub use path::PathArgs;
pub use penetration::SolidName;
pub use picture::contact_picture;
pub use poses::PosesArgs;
pub use posing::PairArgs;
pub use preprocess::{FormatChoice, PathsName, PreprocessArgs, ScannerPosition, WeightName};
pub use sample::{PatternName, SampleArgs};
pub use search::{BracketsName, MethodName, OrderName, RefinementName, SearchArgs};
pub use slices::{
    AvatarArgs, AvatarBox, BuildArgs, FloorName, PixelArgs, QueryArgs, ReachArgs, ResponseName, RouteArgs,
    SlicesCommand, SlicesExportArgs, SlicesInspectArgs, Spot, StartArgs, WalkArgs,
};
pub use sweep::SweepArgs;
pub use touch::TouchArgs;
pub use units::UnitName;
pub use viewpoint::{Angles, ViewArgs};

/// Tells whether, where and how near scanned things meet, straight from their points.
///
/// Exit status: 0 on success, whatever the verdict; 1 on failure; 2 on wrong usage.
#[derive(Debug, Parser)]
#[command(name = "nearmiss", version, propagate_version = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

const COLLIDE_EXAMPLES: &str = "\
Examples:
  nearmiss collide a.nm b.nm --pose-b \"1 0 0 0.09  0 1 0 0.03  0 0 1 0.01  0 0 0 1\"
  nearmiss collide a.nm b.nm --poses near.jsonl --work 2000 --json
  nearmiss collide ring-1.nm ring-2.nm --thickened 0.15 --image contact.png";

const CLASH_EXAMPLES: &str = "\
Examples:
  nearmiss clash pump.nm hall.nm --pose-a \"1 0 0 2.5  0 1 0 0.8  0 0 1 0  0 0 0 1\" --clearance 0.05
  nearmiss clash pump.nm hall.nm --csv clashes.csv --html clashes.html
  nearmiss clash pump.nm hall.nm --json";

const MESH_COLLIDE_EXAMPLES: &str = "\
Examples:
  nearmiss mesh-collide part.nm hall.nm --pose-a \"1 0 0 2.5  0 1 0 0.8  0 0 1 0  0 0 0 1\"
  nearmiss mesh-collide part.nm hall.nm --poses path.txt --csv path.csv --plot path.svg
  nearmiss mesh-collide part.stl hall.obj --all --ply contacts.ply";

const CONVERT_EXAMPLES: &str = "\
Examples:
  nearmiss convert survey.laz survey.ply --class 2,6
  nearmiss convert hall.e57 hall.laz --voxel 0.01
  nearmiss convert part.ply part-in-mm.pcd --units mm";

const POSES_EXAMPLES: &str = "\
Example:
  nearmiss poses a.nm b.nm --near --per-distance 100 -o near.jsonl
  nearmiss collide a.nm b.nm --poses near.jsonl --json

Each line of the output is {\"a\":[16 numbers],\"b\":[16 numbers],\"d\":d}; with --near also \"offset\". The \
matrices are row-major and map an object to the world. Scan A stays where it is; d is the distance between the \
centres of the bounding boxes, in the units of the files. offset is the shift from first contact along the line \
between the centres: positive if the scans are apart, negative if they overlap.";

const ANIMATE_EXAMPLES: &str = "\
Examples:
  nearmiss animate horse-*.ply
  nearmiss animate horse-*.ply --against wall.nm --rate 30 --json
  nearmiss animate cloth-*.ply --against-frames ball-*.ply --method refit";

const SWEEP_EXAMPLES: &str = "\
Examples, where each line of path.jsonl is {\"b\":[16 numbers]} or `x y z qx qy qz qw`:
  nearmiss sweep room.nm gripper.nm --path path.jsonl
  nearmiss sweep room.nm gripper.nm --path path.jsonl --clearance 0.02 --image sweep.png
  nearmiss sweep room.nm gripper.obj --as-mesh b --path path.jsonl
  nearmiss sweep cell.obj gripper.obj --as-mesh both --path path.jsonl --json";

const TOUCH_EXAMPLE: &str = "\
Example; robot.jsonl has a line {\"sphere\":{\"centre\":[0.02,0.1,0.04],\"radius\":0.01}} for each shape:
  nearmiss touch room.nm --shapes robot.jsonl --json
  nearmiss touch room.nm --shapes robot.jsonl --surface --margin 0.01";

const CAST_EXAMPLE: &str = "\
Examples; rays.jsonl has a line {\"origin\":[0,0,1],\"direction\":[0,0,-1],\"max\":5} for each ray:
  nearmiss cast room.nm --from=0,0,1 --to=0,0,0
  nearmiss cast room.nm --rays rays.jsonl --json
  nearmiss cast room.nm --from=0,0,1 --to=2,1,1 --image depth.png";

const SAMPLE_EXAMPLES: &str = "\
Examples:
  nearmiss sample atrium.obj -o atrium.ply --spacing 0.02
  nearmiss sample part.stl -o part.ply --points 50000 --seed 7
  nearmiss sample part.stl -o part.ply --spacing 0.5 --pattern regular

Every place on the surface is within --spacing of a point, in all patterns. In blue noise, points on the same side of \
a surface are at least 0.95 of the spacing apart, and both sides of a thin sheet get points of their own.";

/// The commands, each with its options. `xtask` flattens them into its own.
#[derive(Debug, Clone, Subcommand)]
#[non_exhaustive]
pub enum Command {
    /// Prepare a point cloud or mesh for fast queries, and save it
    #[command(
        after_long_help = "Examples:\n  nearmiss preprocess dragon.ply -o dragon.nm\n  nearmiss preprocess part.stl -o part.nm --as-mesh"
    )]
    Preprocess(PreprocessArgs),
    /// Convert points from one file format to another; files may be larger than memory
    #[command(after_long_help = CONVERT_EXAMPLES)]
    Convert(ConvertArgs),
    /// Describe a prepared scan or mesh: size, spacing, health, advice
    #[command(after_long_help = "Example:\n  nearmiss inspect dragon.nm --verify")]
    Inspect(InspectArgs),
    /// Evaluate the implicit surface of a scan at given points
    #[command(
        after_long_help = "Example, where each line of at.txt is a point `x y z`:\n  nearmiss eval dragon.nm --points at.txt"
    )]
    Eval(EvalArgs),
    /// Test whether two scans touch, where, and how near they come
    #[command(after_long_help = COLLIDE_EXAMPLES)]
    Collide(CollideArgs),
    /// Test whether the triangles of two meshes meet, and where
    #[command(
        after_long_help = MESH_COLLIDE_EXAMPLES,
        mut_arg("a", |a| a.help("First mesh: prepared (.nm), or a file with faces, which is prepared on the fly")),
        mut_arg("b", |b| b.help("Second mesh")),
    )]
    MeshCollide(MeshCollideArgs),
    /// List all places where two scans touch or come too close: table, CSV, HTML page
    #[command(after_long_help = CLASH_EXAMPLES)]
    Clash(ClashArgs),
    /// Find all curves in which two surfaces intersect
    #[command(after_long_help = "Example:\n  nearmiss curve a.nm b.nm --image curves.png -o curves.ply")]
    Curve(CurveArgs),
    /// Find the distance between two scans, with a proven lower bound
    #[command(
        after_long_help = "Example:\n  nearmiss distance a.nm b.nm --pose-b \"1 0 0 2  0 1 0 0  0 0 1 0  0 0 0 1\""
    )]
    Distance(DistanceArgs),
    /// Decide whether a whole motion is free, and find the first impact otherwise
    #[command(after_long_help = SWEEP_EXAMPLES)]
    Sweep(SweepArgs),
    /// Test spheres, boxes and other convex shapes against the points or the surface of a scan
    #[command(after_long_help = TOUCH_EXAMPLE)]
    Touch(TouchArgs),
    /// Find the first place where each of many rays hits a scan
    #[command(after_long_help = CAST_EXAMPLE)]
    Cast(CastArgs),
    /// Follow a mesh or scan that deforms from frame to frame, and test it for contact at regular times
    #[command(after_long_help = ANIMATE_EXAMPLES)]
    Animate(AnimateArgs),
    /// Find the number of random points that keeps the error rate below a limit, for `collide --method
    /// interpolation --flat`
    #[command(after_long_help = "Example:\n  nearmiss density dragon.nm --store")]
    Density(DensityArgs),
    /// Generate test poses for `collide`: at thirteen distances, or near contact
    #[command(after_long_help = POSES_EXAMPLES)]
    Poses(PosesArgs),
    /// Export what is inside a prepared scan: points with normals, graph, boxes
    #[command(
        after_long_help = "Example:\n  nearmiss export dragon.nm --points normals.ply --boxes level-6.obj --level 6"
    )]
    Export(ExportArgs),
    /// Sample points on the surface of a mesh
    #[command(after_long_help = SAMPLE_EXAMPLES)]
    Sample(SampleArgs),
    /// Make and query slice maps, which hold a building as a stack of images and can be walked through
    #[command(subcommand)]
    Slices(SlicesCommand),
}

impl Command {
    /// Returns the input files: points, meshes or prepared scans.
    fn inputs(&self) -> Vec<&Path> {
        match self {
            Self::Preprocess(args) => vec![&args.input],
            Self::Convert(args) => vec![&args.input],
            Self::Inspect(args) => vec![&args.file],
            Self::Eval(args) => vec![&args.file],
            Self::Collide(args) => vec![&args.pair.a, &args.pair.b],
            Self::MeshCollide(args) => vec![&args.pair.a, &args.pair.b],
            Self::Clash(args) => vec![&args.pair.a, &args.pair.b],
            Self::Curve(args) => vec![&args.pair.a, &args.pair.b],
            Self::Distance(args) => vec![&args.pair.a, &args.pair.b],
            Self::Sweep(args) => vec![&args.pair.a, &args.pair.b],
            Self::Touch(args) => vec![&args.scan],
            Self::Cast(args) => vec![&args.scan],
            Self::Animate(args) => {
                let all = args.frames.iter().chain(&args.against_frames).chain(&args.against);
                all.map(PathBuf::as_path).collect()
            }
            Self::Density(args) => vec![&args.a],
            Self::Poses(args) => vec![&args.a, &args.b],
            Self::Export(args) => vec![&args.file],
            Self::Sample(args) => vec![&args.input],
            Self::Slices(SlicesCommand::Build(args)) => vec![&args.input],
            Self::Slices(_) => vec![],
        }
    }

    /// Runs the command. Results go to standard output, all else to standard error.
    #[must_use]
    pub fn run(&self) -> ExitCode {
        let done = match self {
            Self::Preprocess(args) => preprocess::run(args),
            Self::Convert(args) => convert::run(args),
            Self::Inspect(args) => inspect::run(args),
            Self::Eval(args) => eval::run(args),
            Self::Collide(args) => collide::run(args),
            Self::MeshCollide(args) => mesh::collide::run(args),
            Self::Clash(args) => clash::run(args),
            Self::Curve(args) => curve::run(args),
            Self::Density(args) => density::run(args),
            Self::Distance(args) => distance::run(args),
            Self::Sweep(args) => sweep::run(args),
            Self::Touch(args) => touch::run(args),
            Self::Cast(args) => cast::run(args),
            Self::Animate(args) => animate::run(args),
            Self::Poses(args) => poses::run(args),
            Self::Export(args) => export::run(args),
            Self::Sample(args) => sample::run(args),
            Self::Slices(command) => slices::run(command),
        };
        done.map_or_else(|error| console::fail(&error), |()| ExitCode::SUCCESS)
    }
}

/// Returns the names of all commands, with a line about each.
pub fn commands() -> impl Iterator<Item = (String, String)> {
    let commands: Vec<_> = Cli::command().get_subcommands().cloned().collect();
    commands.into_iter().map(|command| {
        let about = command.get_about().map(ToString::to_string).unwrap_or_default();
        (command.get_name().to_owned(), about)
    })
}

/// Runs a command line that starts with the name of the program, as [`std::env::args_os`] does. Help and
/// errors use that name.
pub fn run(args: impl IntoIterator<Item = OsString>) -> ExitCode {
    bus::tell_of_lost_files();
    let args: Vec<OsString> = args.into_iter().collect();
    let bin_name =
        match args.first().map(Path::new).unwrap_or(Path::new("")).file_stem().and_then(|stem| stem.to_str())
        {
            // Users call xtask by an alias in the repository's configuration.
            Some("xtask") => "cargo xtask",
            Some(stem) => stem,
            None => "nearmiss",
        };
    let parsed = Cli::command()
        .bin_name(bin_name)
        .try_get_matches_from(iter::once(bin_name.into()).chain(args.iter().skip(1).cloned()))
        .and_then(|matches| Cli::from_arg_matches(&matches));
    match parsed {
        Ok(cli) => {
            let in_child = guarded::run_in_child(&args, &cli.command.inputs());
            in_child.unwrap_or_else(|| cli.command.run())
        }
        Err(mut refused) => {
            suggest_output(&mut refused);
            suggest_quotes(&mut refused);
            // Help and version go to standard output, errors to standard error. A closed pipe is
            // ignored.
            let _ = refused.print();
            ExitCode::from(u8::try_from(refused.exit_code()).unwrap_or(2))
        }
    }
}

/// Adds a suggestion to quote several numbers if one was given as an argument of its own.
fn suggest_quotes(refused: &mut clap::Error) {
    let Some(ContextValue::String(extra)) = refused.get(ContextKind::InvalidArg) else { return };
    if refused.kind() == ErrorKind::UnknownArgument && extra.parse::<f64>().is_ok() {
        let tip = r#"to give an option several numbers, make them one argument: `--pose="0 0 1 0 0 0 1"`, `--from=0,0,1`"#;
        refused.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![tip.to_owned().into()]));
    }
}

/// Adds a suggestion to use `-o` if the output of `preprocess` was given without it.
fn suggest_output(refused: &mut clap::Error) {
    let Some(ContextValue::String(extra)) = refused.get(ContextKind::InvalidArg) else { return };
    if refused.kind() == ErrorKind::UnknownArgument && !extra.starts_with('-') && extra.ends_with(".nm") {
        let tip = format!("to write to {extra}, use `-o {extra}`");
        refused.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![tip.into()]));
    }
}
