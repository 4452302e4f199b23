//! `slices build`: builds a slice map.

use std::path::{Path, PathBuf};

use clap::Args;
use nearmiss::io::{Pieces, PointPieces, ReadError, glance, read_in_pieces};
use nearmiss::slices::{Obstacle, Pixel, SliceBuilder, SliceError, SliceOptions, SlicePlan, SliceTarget, Up};
use nearmiss::{Aabb, CloudError, Workspace};

use super::report::{Report, open};
use crate::console::{Bar, Console, now};
use crate::digits::short;
use crate::error::CliError;
use crate::memory::MemoryArgs;
use crate::parse::parse_length;
use crate::preprocess::{FormatChoice, about_formats, parse_format, parse_threads};
use crate::progress::short_name;
use crate::threads::pool;
use crate::{input, output};

/// Options of `slices build`.
#[derive(Debug, Clone, Args)]
pub struct BuildArgs {
    /// Point cloud or mesh
    ///
    /// A point cloud (PLY, PCD, LAS, LAZ, E57, NPY or text) is read in pieces, so it may be larger than
    /// memory. The surface of a mesh (OBJ, STL, OFF, glTF, PLY with faces) is sampled so densely that
    /// it fills every pixel it meets.
    pub input: PathBuf,
    /// Folder for the map: new, empty, or with a map to replace
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Size of pixels
    #[command(flatten)]
    pub pixel: PixelArgs,
    /// Height of a slice; by default three pixels
    #[arg(long, value_name = "S", allow_hyphen_values = true, value_parser = parse_length)]
    pub slice_height: Option<f64>,
    /// Share of a slice's height: if the points of a pixel span more, they are an obstacle
    ///
    /// Anjos et al. 2012 use 0.07. By default, it is computed from --max-slope and --noise.
    #[arg(long, value_name = "E", allow_hyphen_values = true, conflicts_with_all = ["max_slope", "noise"])]
    pub obstacle: Option<f64>,
    /// Slope above which a surface is an obstacle, in degrees
    #[arg(long, value_name = "DEG", allow_hyphen_values = true, default_value_t = 45.0)]
    pub max_slope: f64,
    /// Noise: the height that the points of a level floor span within a pixel
    ///
    /// By default, it is 0 for a mesh and estimated for points. An estimate never raises the share of
    /// --obstacle above 0.9; only a steep --max-slope can make it greater.
    #[arg(long, value_name = "LEN", allow_hyphen_values = true)]
    pub noise: Option<f64>,
    /// Axis that points up: x, y, z, -x, -y or -z
    #[arg(long, value_name = "AXIS", default_value = "z", allow_hyphen_values = true)]
    pub up: Up,
    /// Format of the input; auto decides by content, then by name
    #[arg(long, default_value = "auto", value_parser = parse_format, long_help = about_formats())]
    pub format: FormatChoice,
    /// The memory limit
    #[command(flatten)]
    pub memory: MemoryArgs,
    /// Threads; 0 for all cores
    ///
    /// The result does not depend on it.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = parse_threads)]
    pub threads: usize,
    /// Print one JSON object instead of sentences
    ///
    /// The number of points in it includes duplicates.
    #[arg(long)]
    pub json: bool,
    /// Show no progress
    #[arg(long)]
    pub quiet: bool,
}

/// Options for the size of a pixel.
#[derive(Debug, Clone, Copy, Args)]
#[group(multiple = false)]
pub struct PixelArgs {
    /// Side of a pixel, in the units of the input
    #[arg(long, value_name = "T", allow_hyphen_values = true, value_parser = parse_length)]
    pub pixel: Option<f64>,
    /// Pixels along the longer side of the map; 700 if neither --pixel nor --resolution is given
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub resolution: Option<u32>,
}

/// Bytes of a file that are read at a time.
const BLOCK: usize = 1 << 22;

/// Least number of distinct points of a cloud.
const LEAST_POINTS: usize = 8;

pub(super) fn run(args: &BuildArgs) -> Result<(), CliError> {
    let console = Console::new(args.quiet);
    let start = now();
    // Options that can be checked without points are checked before reading, which may take
    // minutes.
    options(args, false).check().map_err(|cause| CliError::Usage(cause.to_string()))?;
    input::check_raw(&args.input)?;
    let target = SliceTarget::new(&args.output)?;
    let name = args.input.display();
    let limit = input::limit_reading(&args.input, args.format.0);
    let source = read_in_pieces(&args.input, args.format.0, BLOCK)?;
    let (bounds, given) = match &source {
        Pieces::Points(points) => {
            let expected = glance(&args.input, args.format.0).map_or(0, |seen| seen.points);
            bounds(&args.input, points, &console.rate(format_args!("looking through {name}"), expected))?
        }
        Pieces::Mesh { mesh, .. } => {
            let corners = mesh.triangles().iter().flatten();
            (Aabb::of(corners.map(|&v| mesh.vertices()[v as usize])), 0)
        }
    };
    drop(limit);
    if let Some(other) = other_up(args.up, &bounds) {
        let [height, length] = [args.up, other].map(|up| short(extent(up, &bounds)));
        let up = args.up;
        console.note(format_args!(
            "{name} extends {height} along {up} and {length} along {other}; if {other} points up, pass --up {other}"
        ));
    }
    let unsuitable = |cause| CliError::Slices { path: args.input.clone(), cause };
    let (plan, work) = place(args, &options(args, matches!(source, Pieces::Mesh { .. })), &bounds, console)?;
    let [width, height, slices] = plan.grid().counts;
    let what = format!("filling {slices} slices of {width} × {height} pixels");
    pool(args.threads)?.install(|| {
        let mut builder = SliceBuilder::new_in(&plan, &work).map_err(unsuitable)?;
        if builder.is_filled() {
            console.note("resuming an interrupted run");
        } else {
            match &source {
                Pieces::Points(points) => {
                    let bar = console.rate(what, given);
                    points.each(|piece| {
                        builder.add(&piece.positions);
                        bar.advance(piece.len() as u64);
                    })?;
                }
                Pieces::Mesh { mesh, .. } => {
                    let count = mesh.triangles().len();
                    let _bar = console.watch_share(what, "triangles", work.progress(), count);
                    builder.add_mesh(mesh);
                }
            }
            builder.keep(&work).map_err(unsuitable)?;
        }
        work.progress().reach(0.0);
        let what = format!("making and writing {}", short_name(&args.output));
        let _bar = console.watch_share(what, "slices", work.progress(), slices as usize);
        target.build(builder).map_err(CliError::from)
    })?;
    work.remove();
    let folder = open(&args.output)?;
    Report::new(&folder, start.elapsed()).tell(&folder, args.json)
}

/// Returns the extent of the bounds along an axis.
fn extent(up: Up, bounds: &Aabb) -> f64 {
    up.to_map(bounds.half_extents())[2].abs() * 2.0
}

/// Returns the axis that points up more probably than `up`: the shortest one, if the bounds are much
/// longer along `up`, because buildings are seldom higher than wide.
fn other_up(up: Up, bounds: &Aabb) -> Option<Up> {
    /// The ratio of the extents at which a note is given. A stairwell may be this high.
    const MUCH: f64 = 1.5;
    let longer = |other: &Up| extent(up, bounds) > MUCH * extent(*other, bounds);
    let by_extent = |a: &Up, b: &Up| extent(*a, bounds).total_cmp(&extent(*b, bounds));
    [Up::X, Up::Y, Up::Z].into_iter().filter(longer).min_by(by_extent)
}

/// Chooses where the voxels are kept: in memory, or on disk if `--memory` was given and they need
/// more.
fn place(
    args: &BuildArgs,
    options: &SliceOptions,
    bounds: &Aabb,
    console: Console,
) -> Result<(SlicePlan, Workspace), CliError> {
    let unsuitable = |cause| CliError::Slices { path: args.input.clone(), cause };
    let folder = output::work_folder(&args.output);
    let plan = SlicePlan::new(options, bounds);
    let Some(memory) = args.memory.memory.filter(|_| matches!(plan, Err(SliceError::Memory { .. }))) else {
        let plan = plan.map_err(unsuitable)?;
        // Removes the files of a killed run on disk.
        Workspace::clear(&folder);
        return Ok((plan, Workspace::in_memory()));
    };
    let plan = SlicePlan::on_disk(options, bounds).map_err(unsuitable)?;
    let key = format!("slices {} {plan:?}", input::identity(&args.input)?);
    let work = Workspace::in_folder(&folder, &key, memory)?;
    console.note(format_args!("working on disk, in {}, which is removed at the end", folder.display()));
    Ok((plan, work))
}

/// Returns the bounds of all finite points and the number of all points. Fails if there are too few
/// points for a cloud.
fn bounds(path: &Path, points: &PointPieces, bar: &Bar) -> Result<(Aabb, u64), CliError> {
    let mut bounds = Aabb::EMPTY;
    let mut distinct: Vec<[f64; 3]> = Vec::with_capacity(LEAST_POINTS);
    let mut given = 0;
    points.each(|piece| {
        given += piece.len();
        bar.advance(piece.len() as u64);
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
    Ok((bounds, given as u64))
}

pub(crate) fn options(args: &BuildArgs, is_mesh: bool) -> SliceOptions {
    let pixel = match (args.pixel.pixel, args.pixel.resolution) {
        (Some(side), _) => Pixel::Side(side),
        (None, count) => Pixel::Count(count.unwrap_or(700)),
    };
    let obstacle = match args.obstacle {
        Some(share) => Obstacle::Share(share),
        None => {
            // Samples of a mesh are exactly on its surface.
            let of_mesh = is_mesh.then_some(0.0);
            Obstacle::Slope { degrees: args.max_slope, noise: args.noise.or(of_mesh) }
        }
    };
    let options = SliceOptions::default()
        .with_pixel(pixel)
        .with_slice_height(args.slice_height)
        .with_obstacle(obstacle)
        .with_up(args.up);
    args.memory.memory.map_or(options, |memory| options.with_memory(memory))
}
