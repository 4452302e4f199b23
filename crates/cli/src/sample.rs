//! `sample`: samples points on the surface of a mesh.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use nearmiss::io::PlyPoints;
use nearmiss::mesh::{SampleOptions, SamplePattern, SampleSize, sample};
use serde::Serialize;

use crate::console::{Console, Results, now};
use crate::digits::count;
use crate::error::CliError;
use crate::estimate::check_sampling;
use crate::memory::MemoryArgs;
use crate::{input, output};

/// Names of the patterns of samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum PatternName {
    /// Random places, none of which is near another (Poisson discs)
    BlueNoise,
    /// Rows on each triangle; needs --spacing
    Regular,
    /// With --spacing, rows with each point moved at random; with --points, independent places
    Random,
}

impl PatternName {
    pub(crate) fn pattern(self) -> SamplePattern {
        match self {
            Self::BlueNoise => SamplePattern::BlueNoise,
            Self::Regular => SamplePattern::Regular,
            Self::Random => SamplePattern::Random,
        }
    }
}

/// Options of `sample`.
#[derive(Debug, Clone, Args)]
#[command(group = clap::ArgGroup::new("samples").required(true).args(["spacing", "points"]))]
pub struct SampleArgs {
    /// Mesh: OBJ, STL, OFF, glTF, or PLY with faces
    pub input: PathBuf,
    /// PLY file for the points
    #[arg(short, long, value_name = "CLOUD.ply")]
    pub output: PathBuf,
    /// Largest distance from any place on the surface to the nearest point, in the units of the mesh
    #[arg(long, value_name = "S", allow_hyphen_values = true)]
    pub spacing: Option<f64>,
    /// Number of points, spread uniformly by area
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub points: Option<u32>,
    /// Arrangement of the points
    #[arg(long, value_enum, default_value = "blue-noise", value_name = "PATTERN")]
    pub pattern: PatternName,
    /// Seed of the random places
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// The memory limit
    #[command(flatten)]
    pub memory: MemoryArgs,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
    /// Show no progress
    #[arg(long)]
    pub quiet: bool,
}

/// The JSON output of `sample`.
#[derive(Debug, Serialize)]
struct Report {
    points: usize,
    triangles: usize,
    pattern: PatternName,
    seconds: f64,
}

pub(crate) fn run(args: &SampleArgs) -> Result<(), CliError> {
    let samples = match (args.spacing, args.points) {
        (Some(spacing), _) => SampleSize::Spacing(spacing),
        (None, points) => SampleSize::Count(points.unwrap_or(0)),
    };
    if let (SampleSize::Count(_), PatternName::Regular) = (samples, args.pattern) {
        let what = "expected --spacing with --pattern regular, got --points; choose another pattern";
        return Err(CliError::Usage(what.to_owned()));
    }
    output::check_apart(&args.output, &[&args.input])?;
    let start = now();
    let console = Console::new(args.quiet);
    let bar = console.spinner(format_args!("sampling {}", args.input.display()));
    input::check_there(&args.input)?;
    let limit = input::limit_reading(&args.input, None);
    let mesh = nearmiss::io::read_mesh(&args.input, None)?;
    drop(limit);
    let options = SampleOptions::new(samples).with_pattern(args.pattern.pattern()).with_seed(args.seed);
    check_sampling(&args.input, args.memory.limit(), console, &mesh, &options)?;
    let points =
        sample(&mesh, &options).map_err(|cause| CliError::Sample { path: args.input.clone(), cause })?;
    output::replace(&args.output, |out| {
        PlyPoints::double(&points).write(out).map_err(CliError::writing_ply(&args.output))
    })?;
    drop(bar);
    let report = Report {
        points: points.len(),
        triangles: mesh.triangles().len(),
        pattern: args.pattern,
        seconds: start.elapsed().as_secs_f64(),
    };
    let mut results = Results::new();
    if args.json {
        results.json(&report)?;
    } else {
        results.line(format_args!(
            "{} on {} written to {}",
            count(report.points as u64, "point"),
            count(report.triangles as u64, "triangle"),
            args.output.display()
        ))?;
    }
    results.flush()
}
