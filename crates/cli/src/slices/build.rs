//! `slices build`.

use std::path::{Path, PathBuf};

use clap::Args;
use nearmiss::io::{Pieces, PointPieces, ReadError, read_in_pieces};
use nearmiss::slices::{Obstacle, Pixel, SliceBuilder, SliceOptions, SlicePlan, SliceTarget, Up};
use nearmiss::{Aabb, CloudError};

use super::report::{Report, open};
use crate::console::{Console, now};
use crate::error::CliError;
use crate::input;
use crate::parse::parse_length;
use crate::preprocess::{FormatChoice, parse_format, parse_threads};

/// Options of `slices build`.
#[derive(Debug, Clone, Args)]
pub struct BuildArgs {
    /// Point cloud (PLY, PCD, LAS, LAZ, E57, NPY or text), read piece by piece, so it may be larger than
    /// memory; or mesh (OBJ, STL, OFF, glTF, PLY with faces), whose surface is sampled so that no pixel of it
    /// stays empty
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
    /// What spans more than this share of a slice upwards, within a pixel, is an obstacle; 0.07 is the
    /// paper's rule
    #[arg(long, value_name = "E", allow_hyphen_values = true, conflicts_with_all = ["max_slope", "noise"])]
    pub obstacle: Option<f64>,
    /// What is steeper than this is an obstacle, in degrees
    #[arg(long, value_name = "DEG", allow_hyphen_values = true, default_value_t = 45.0)]
    pub max_slope: f64,
    /// How far points of a level floor spread upwards within a pixel; by default 0 for a mesh, and estimated
    /// from points, of which no more counts than makes 90 % of a slice an obstacle
    #[arg(long, value_name = "LEN", allow_hyphen_values = true)]
    pub noise: Option<f64>,
    /// Which way is up: x, y, z, -x, -y or -z
    #[arg(long, value_name = "AXIS", default_value = "z", allow_hyphen_values = true)]
    pub up: Up,
    /// Format of the input: ply, pcd, las, e57, npy, xyz, obj, stl, off, gltf, or auto, by content and name
    #[arg(long, default_value = "auto", value_parser = parse_format)]
    pub format: FormatChoice,
    /// Mebibytes that building may take
    #[arg(long, value_name = "MIB", default_value_t = 4096, value_parser = clap::value_parser!(u32).range(1..))]
    pub memory: u32,
    /// Threads to work on, 0 for all cores; the result is the same
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = parse_threads)]
    pub threads: usize,
    /// One object of JSON instead of sentences; its points are all that are in the map, those that are given
    /// twice twice
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

/// Bytes of a file that are read at a time.
const BLOCK: usize = 1 << 22;

/// Fewer different points than this make no cloud.
const LEAST_POINTS: usize = 8;

pub(super) fn run(args: &BuildArgs) -> Result<(), CliError> {
    let console = Console::new(args.quiet);
    let start = now();
    // What needs no points is refused before they are read, which may take minutes.
    options(args, false).check().map_err(|cause| CliError::Usage(cause.to_string()))?;
    input::check_raw(&args.input)?;
    let target = SliceTarget::new(&args.output)?;
    let bar = console.spinner(format_args!("reading {}", args.input.display()));
    let source = read_in_pieces(&args.input, args.format.0, BLOCK)?;
    let bounds = match &source {
        Pieces::Points(points) => bounds(&args.input, points)?,
        Pieces::Mesh(mesh) => {
            let corners = mesh.triangles().iter().flatten();
            Aabb::of(corners.map(|&v| mesh.vertices()[v as usize]))
        }
    };
    drop(bar);
    let unfit = |cause| CliError::Slices { path: args.input.clone(), cause };
    let plan = SlicePlan::new(&options(args, matches!(source, Pieces::Mesh(_))), &bounds).map_err(unfit)?;
    let [width, height, slices] = plan.grid().counts;
    let bar = console.spinner(format_args!("filling {slices} slices of {width} × {height} pixels"));
    let pool = rayon::ThreadPoolBuilder::new().num_threads(args.threads).build();
    let pool = pool.or(Err(CliError::Threads(args.threads)))?;
    let map = pool.install(|| {
        let mut builder = SliceBuilder::new(&plan).map_err(unfit)?;
        match &source {
            Pieces::Points(points) => points.each(|piece| builder.add(&piece.positions))?,
            Pieces::Mesh(mesh) => _ = builder.add_mesh(mesh),
        }
        Ok::<_, CliError>(builder.finish())
    })?;
    drop(bar);
    let bar = console.spinner(format_args!("writing {}", args.output.display()));
    pool.install(|| target.save(&map))?;
    drop(bar);
    let folder = open(&args.output)?;
    Report::new(&folder, start.elapsed()).tell(&folder, args.json)
}

/// Of all points that are finite, of which there must be enough for a cloud.
fn bounds(path: &Path, points: &PointPieces) -> Result<Aabb, CliError> {
    let mut bounds = Aabb::EMPTY;
    let mut distinct: Vec<[f64; 3]> = Vec::with_capacity(LEAST_POINTS);
    let mut given = 0;
    points.each(|piece| {
        given += piece.len();
        for &p in piece.positions.iter().filter(|p| p.iter().all(|x| x.is_finite())) {
            bounds.grow(p);
            if distinct.len() < LEAST_POINTS && !distinct.contains(&p) {
                distinct.push(p);
            }
        }
    })?;
    if distinct.len() < LEAST_POINTS {
        let cause = CloudError::TooFew { distinct: distinct.len(), given };
        return Err(ReadError::Cloud { path: path.to_owned(), cause }.into());
    }
    Ok(bounds)
}

fn options(args: &BuildArgs, is_mesh: bool) -> SliceOptions {
    let pixel = match (args.pixel.pixel, args.pixel.resolution) {
        (Some(side), _) => Pixel::Side(side),
        (None, count) => Pixel::Count(count.unwrap_or(700)),
    };
    let obstacle = match args.obstacle {
        Some(share) => Obstacle::Share(share),
        None => {
            // What is sampled for the map lies where the mesh is.
            let of_mesh = is_mesh.then_some(0.0);
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
