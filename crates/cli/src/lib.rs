#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod collide;
mod console;
mod error;
mod eval;
mod export;
mod inspect;
mod poses;
mod preprocess;

mod input;
mod output;
mod posing;
mod report;

mod canvas;
mod font;
mod picture;

use std::ffi::OsString;
use std::iter;
use std::path::Path;
use std::process::ExitCode;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};

pub use clap;
pub use collide::{CollideArgs, DetailName};
pub use error::CliError;
pub use eval::EvalArgs;
pub use export::ExportArgs;
pub use inspect::InspectArgs;
pub use picture::{Picture, contact_picture};
pub use poses::PosesArgs;
pub use preprocess::{FormatChoice, PreprocessArgs, WeightName};

/// Whether, where and how near scanned things meet, straight from their points.
///
/// Exit status: 0 the command did its job, whatever the verdict; 1 it failed; 2 wrong usage.
#[derive(Debug, Parser)]
#[command(name = "nearmiss", version, propagate_version = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

/// The commands, each with its options. `xtask` flattens them into its own.
#[derive(Debug, Clone, Subcommand)]
#[non_exhaustive]
pub enum Command {
    /// Prepare a point cloud or mesh for queries, once, and save it
    Preprocess(PreprocessArgs),
    /// Say what a prepared scan holds
    Inspect(InspectArgs),
    /// The implicit function f of a scan at given points
    Eval(EvalArgs),
    /// Whether, where and how near two scans meet
    Collide(CollideArgs),
    /// Make poses to ask `collide` about: a sweep, or poses about first contact
    Poses(PosesArgs),
    /// Look inside a prepared scan: points with normals, node boxes, radii
    Export(ExportArgs),
}

impl Command {
    /// Does what is asked: results on standard output, the rest on standard error.
    #[must_use]
    pub fn run(&self) -> ExitCode {
        let done = match self {
            Self::Preprocess(args) => preprocess::run(args),
            Self::Inspect(args) => inspect::run(args),
            Self::Eval(args) => eval::run(args),
            Self::Collide(args) => collide::run(args),
            Self::Poses(args) => poses::run(args),
            Self::Export(args) => export::run(args),
        };
        done.map_or_else(|error| console::fail(&error), |()| ExitCode::SUCCESS)
    }
}

/// Runs a command line, the program's own name first, as in [`std::env::args_os`]: help and errors call it so.
pub fn run(args: impl IntoIterator<Item = OsString>) -> ExitCode {
    let mut args = args.into_iter();
    let program = args.next().unwrap_or_default();
    let bin_name = match Path::new(&program).file_stem().and_then(|stem| stem.to_str()) {
        // The way to call it is an alias in the repository's configuration.
        Some("xtask") => "cargo xtask",
        Some(stem) => stem,
        None => "nearmiss",
    };
    let parsed = Cli::command()
        .bin_name(bin_name)
        .try_get_matches_from(iter::once(bin_name.into()).chain(args))
        .and_then(|matches| Cli::from_arg_matches(&matches));
    match parsed {
        Ok(cli) => cli.command.run(),
        Err(refused) => {
            // Help and version go to standard output, errors to standard error; a closed pipe is nobody's concern.
            let _ = refused.print();
            ExitCode::from(u8::try_from(refused.exit_code()).unwrap_or(2))
        }
    }
}
