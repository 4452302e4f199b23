//! `slices build`.

use std::path::{Path, PathBuf};

use clap::Args;
use nearmiss::geometry::TriangleMesh;
use nearmiss::io::ReadError;
use nearmiss::slices::{Obstacle, Pixel, SliceBuilder, SliceOptions, SlicePlan, Up};
use nearmiss::{Aabb, CloudError, PointCloud};

use super::{Report, open, parse_length};
use crate::console::{Console, now};
use crate::error::CliError;
use crate::input;
use crate::preprocess::{FormatChoice, parse_format, parse_threads};

/// Options of `slices build`.
#[derive(Debug, Clone, Args)]
pub struct BuildArgs {
    /// Point cloud (PLY, PCD, XYZ or CSV text) or mesh (OBJ, PLY with faces), whose surface is sampled so that no pixel of it stays empty
    pub input: PathBuf,
    /// Folder for the map: new, empty, or with a map, which is replaced
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Size of pixels
    #[command(flatten)]
    pub pixel: PixelArgs,
    /// Height of a slice; by default three pixels
    #[arg(long, value_name = "S", allow_hyphen_values = true, value_parser = parse_length)]
    pub slice_height: Option<f64>,
    /// What spans more than this share of a slice upwards, within a pixel, is an obstacle; 0.07 is the paper's rule
    #[arg(long, value_name = "E", allow_hyphen_values = true, conflicts_with_all = ["max_slope", "noise"])]
    pub obstacle: Option<f64>,
    /// What is steeper than this is an obstacle, in degrees
    #[arg(long, value_name = "DEG", allow_hyphen_values = true, default_value_t = 45.0)]
    pub max_slope: f64,
    /// How far points of a level floor spread upwards within a pixel; by default estimated from points, and 0 for a mesh
    #[arg(long, value_name = "LEN", allow_hyphen_values = true)]
    pub noise: Option<f64>,
    /// Which way is up: x, y, z, -x, -y or -z
    #[arg(long, value_name = "AXIS", default_value = "z", allow_hyphen_values = true)]
    pub up: Up,
    /// Format of the input: ply, pcd, xyz, obj, or auto, by content and name
    #[arg(long, default_value = "auto", value_parser = parse_format)]
    pub format: FormatChoice,
    /// Mebibytes that building may take
    #[arg(long, value_name = "MIB", default_value_t = 4096)]
    pub memory: u32,
    /// Threads to work on, 0 for all cores; the result is the same
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = parse_threads)]
    pub threads: usize,
    /// One object of JSON instead of sentences
    #[arg(long)]
    pub json: bool,
    /// No progress on the terminal
    #[arg(long)]
    pub quiet: bool,
}

/// How large pixels are.
#[derive(Debug, Clone, Copy, Args)]
#[group(multiple = false)]
pub struct PixelArgs {
    /// Side of a pixel, in the units of the input
    #[arg(long, value_name = "T", allow_hyphen_values = true, value_parser = parse_length)]
    pub pixel: Option<f64>,
    /// Pixels along the longer side; 700 if neither is given
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub resolution: Option<u32>,
}

/// What maps are made of.
enum Source {
    Points(PointCloud),
    Mesh(TriangleMesh),
}

pub(super) fn run(args: &BuildArgs) -> Result<(), CliError> {
    let console = Console::new(args.quiet);
    let start = now();
    let bar = console.spinner(format_args!("reading {}", args.input.display()));
    let source = read(args)?;
    drop(bar);
    let bounds = match &source {
        Source::Points(cloud) => cloud.bounds(),
        Source::Mesh(mesh) => {
            let corners = mesh.triangles().iter().flatten();
            Aabb::of(corners.map(|&v| mesh.vertices()[v as usize]))
        }
    };
    let unfit = |cause| CliError::Slices { path: args.input.clone(), cause };
    let plan = SlicePlan::new(&options(args, &source), &bounds).map_err(unfit)?;
    let [width, height, slices] = plan.grid().counts;
    let bar = console.spinner(format_args!("filling {slices} slices of {width} × {height} pixels"));
    let pool = rayon::ThreadPoolBuilder::new().num_threads(args.threads).build();
    let pool = pool.or(Err(CliError::Threads(args.threads)))?;
    let map = pool.install(|| {
        let mut builder = SliceBuilder::new(&plan)?;
        match &source {
            Source::Points(cloud) => builder.add_cloud(cloud),
            Source::Mesh(mesh) => _ = builder.add_mesh(mesh),
        }
        Ok(builder.finish())
    });
    let map = map.map_err(unfit)?;
    drop(bar);
    let bar = console.spinner(format_args!("writing {}", args.output.display()));
    pool.install(|| map.save(&args.output))?;
    drop(bar);
    let folder = open(&args.output)?;
    Report::new(&folder, start.elapsed()).tell(&folder, args.json)
}

/// A mesh if there are faces, otherwise points.
fn read(args: &BuildArgs) -> Result<Source, CliError> {
    let path: &Path = &args.input;
    match input::read(path, args.format.0) {
        Ok(model) => Ok(model.mesh.map_or_else(|| Source::Points(model.cloud), Source::Mesh)),
        // Faces may have fewer corners than a cloud needs points.
        Err(few @ CliError::Read(ReadError::Cloud { cause: CloudError::TooFew { .. }, .. })) => {
            nearmiss::io::read_mesh(path, args.format.0).map(Source::Mesh).or(Err(few))
        }
        Err(other) => Err(other),
    }
}

fn options(args: &BuildArgs, source: &Source) -> SliceOptions {
    let pixel = match (args.pixel.pixel, args.pixel.resolution) {
        (Some(side), _) => Pixel::Side(side),
        (None, count) => Pixel::Count(count.unwrap_or(700)),
    };
    let obstacle = match args.obstacle {
        Some(share) => Obstacle::Share(share),
        None => {
            // What is sampled for the map lies where the mesh is.
            let of_mesh = matches!(source, Source::Mesh(_)).then_some(0.0);
            Obstacle::Slope { degrees: args.max_slope, noise: args.noise.or(of_mesh) }
        }
    };
    SliceOptions::default()
        .with_pixel(pixel)
        .with_slice_height(args.slice_height)
        .with_obstacle(obstacle)
        .with_up(args.up)
        .with_memory(u64::from(args.memory) << 20)
}
