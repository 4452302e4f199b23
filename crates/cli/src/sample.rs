//! `sample`: samples points on the surface of a mesh.

use std::path::PathBuf;

use clap::Args;
use nearmiss::io::PlyPoints;
use nearmiss::mesh::{SampleOptions, SampleSize, sample};
use serde::Serialize;

use crate::console::{Console, Results, now};
use crate::digits::count;
use crate::error::CliError;
use crate::estimate::check_sampling;
use crate::memory::MemoryArgs;
use crate::{input, output};

/// Options of `sample`.
#[derive(Debug, Clone, Args)]
#[command(group = clap::ArgGroup::new("samples").required(true).args(["spacing", "points"]))]
pub struct SampleArgs {
    /// Mesh: OBJ, STL, OFF, glTF, or PLY with faces
    pub input: PathBuf,
    /// PLY file for the points
    #[arg(short, long, value_name = "CLOUD.ply")]
    pub output: PathBuf,
    /// Largest distance of any place on the surface from a point, in the units of the mesh
    #[arg(long, value_name = "S", allow_hyphen_values = true)]
    pub spacing: Option<f64>,
    /// Number of points, drawn at random, uniformly by area
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub points: Option<u32>,
    /// Seed; with --spacing, it moves points at random instead of leaving them in rows
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
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
    seconds: f64,
}

pub(crate) fn run(args: &SampleArgs) -> Result<(), CliError> {
    output::check_apart(&args.output, &[&args.input])?;
    let start = now();
    let console = Console::new(args.quiet);
    let bar = console.spinner(format_args!("sampling {}", args.input.display()));
    input::check_there(&args.input)?;
    let limit = input::limit_reading(&args.input, None);
    let mesh = nearmiss::io::read_mesh(&args.input, None)?;
    drop(limit);
    if let Some(spacing) = args.spacing {
        check_sampling(&args.input, args.memory.limit(), console, &mesh, (spacing, args.seed.is_some()))?;
    }
    let samples = match (args.spacing, args.points) {
        (Some(spacing), _) => SampleSize::Spacing(spacing),
        (None, points) => SampleSize::Count(points.unwrap_or(0)),
    };
    let mut options = SampleOptions::new(samples);
    options.seed = args.seed;
    let points =
        sample(&mesh, &options).map_err(|cause| CliError::Sample { path: args.input.clone(), cause })?;
    output::replace(&args.output, |out| {
        PlyPoints::double(&points).write(out).map_err(CliError::writing_ply(&args.output))
    })?;
    drop(bar);
    let report = Report {
        points: points.len(),
        triangles: mesh.triangles().len(),
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
