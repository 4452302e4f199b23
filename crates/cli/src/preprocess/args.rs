//! The options of `preprocess`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use nearmiss::io::Format;
use nearmiss::{Bandwidth, BuildOptions, GraphOptions, Kernel, Paths, SurfaceOptions};

use crate::eval::KernelName;
use crate::filters::FilterArgs;
use crate::input::pieces;
use crate::memory::MemoryArgs;
use crate::parse::{parse_length, parse_threads};

/// Options of `preprocess`.
#[derive(Debug, Clone, Args)]
pub struct PreprocessArgs {
    /// Point cloud (PLY, PCD, LAS, LAZ, E57, NPY, text) or mesh (OBJ, STL, OFF, glTF, PLY with
    /// faces)
    ///
    /// The points of a mesh are its vertices; `nearmiss sample` puts points on its faces.
    pub input: PathBuf,
    /// Prepared scan or mesh to write, usually named .nm; an existing file is replaced atomically
    #[arg(short, long, value_name = "OUT.nm")]
    pub output: PathBuf,
    /// Format of the input; auto decides by content, then by name
    #[arg(long, default_value = "auto", value_parser = parse_format, long_help = about_formats())]
    pub format: FormatChoice,
    /// Prepare the triangles of a mesh, for `mesh-collide` and `--as-mesh` of other commands
    ///
    /// Triangles without area and repeated triangles are dropped. By default, only the vertices of
    /// a mesh are prepared, as points.
    #[arg(long, conflicts_with_all = OF_SCANS)]
    pub as_mesh: bool,
    /// Weld vertices up to this far apart, with --as-mesh; by default, only equal ones are welded
    #[arg(long, value_name = "LEN", requires = "as_mesh", allow_hyphen_values = true, value_parser = parse_length)]
    pub weld: Option<f64>,
    /// The filters
    #[command(flatten)]
    pub filters: FilterArgs,
    /// Number of neighbours within the local radius of a point, 3 to 32; where points lie on lines, the
    /// radius is widened
    #[arg(long, value_name = "K", default_value_t = 6, value_parser = clap::value_parser!(u32).range(3..=32), help_heading = "Surface")]
    pub radius_neighbours: u32,
    /// Largest gap to bridge between points, in the units of the input
    ///
    /// A wider gap counts as a hole. The balls around points that sample no sheet have at most this
    /// diameter. The default is twice the sampling radius (the 0.9-quantile of the local radii).
    #[arg(long, value_name = "L", allow_hyphen_values = true, value_parser = parse_reach, help_heading = "Surface")]
    pub reach: Option<f64>,
    /// Weight of a point as a function of its distance
    #[arg(long, value_enum, default_value_t = WeightName::Gaussian, help_heading = "Research", hide_short_help = true)]
    pub weight: WeightName,
    /// Width over which points are averaged: local (follows the spacing), global, or a length
    #[arg(long, value_name = "local|global|M", default_value = "local", allow_hyphen_values = true, value_parser = parse_bandwidth, help_heading = "Research", hide_short_help = true)]
    pub bandwidth: Bandwidth,
    /// Points in a leaf of the hierarchy, 4 to 64
    #[arg(long, value_name = "N", default_value_t = 16, value_parser = clap::value_parser!(u32).range(4..=64), help_heading = "Research", hide_short_help = true)]
    pub leaf: u32,
    /// Add the proximity graph, which orients normals and provides paths along the surface
    #[arg(long, help_heading = "Graph")]
    pub graph: bool,
    /// Rank of the neighbour that a point's sphere of influence reaches, 1 to 32; by default 4; implies
    /// --graph
    ///
    /// The sphere of influence of a point reaches to its R-th nearest neighbour. The graph joins
    /// two points if their spheres overlap.
    #[arg(long, value_name = "R", value_parser = clap::value_parser!(u32).range(1..=32), help_heading = "Research", hide_short_help = true)]
    pub neighbours: Option<u32>,
    /// Add the map of close pairs, which the geodesic kernel needs; implies --graph
    ///
    /// The map takes most of the space in the file.
    #[arg(long, help_heading = "Graph")]
    pub close_pairs: bool,
    /// Store the shortest paths of close pairs, or rebuild them when needed; implies
    /// --close-pairs
    #[arg(long, value_enum, help_heading = "Research", hide_short_help = true)]
    pub paths: Option<PathsName>,
    /// Metric of the kernel that defines the surface; `geodesic` implies --close-pairs
    ///
    /// Distances along the graph keep close sheets apart. With the geodesic kernel, contacts are
    /// certified, but separations are not.
    #[arg(long, value_enum, default_value_t = KernelName::Euclidean, help_heading = "Graph")]
    pub kernel: KernelName,
    /// Position of the scanner, in the frame of the input: normals are turned towards it;
    /// implies --graph
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = parse_place, help_heading = "Graph")]
    pub scanner: Option<ScannerPosition>,
    /// Threads; 0 for all cores; the result does not depend on it
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = parse_threads, help_heading = "Output")]
    pub threads: usize,
    /// The memory limit
    #[command(flatten)]
    pub memory: MemoryArgs,
    /// Print one JSON object
    #[arg(long, help_heading = "Output")]
    pub json: bool,
    /// Show no progress
    #[arg(long, help_heading = "Output")]
    pub quiet: bool,
}

/// The options that apply to scans and not to meshes.
const OF_SCANS: [&str; 16] = [
    "crop",
    "class",
    "voxel",
    "remove_outliers",
    "min_neighbours",
    "radius_neighbours",
    "reach",
    "weight",
    "bandwidth",
    "leaf",
    "graph",
    "neighbours",
    "close_pairs",
    "paths",
    "kernel",
    "scanner",
];

/// A format, or `None` to detect it from content and name.
#[derive(Debug, Clone, Copy)]
pub struct FormatChoice(
    /// The format.
    pub Option<Format>,
);

/// The names of the weight functions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum WeightName {
    /// exp(−d²/h²), cut off where it is small (Klein & Zachmann 2004)
    Gaussian,
    /// Wendland's C² function, which has compact support
    Wendland,
}

/// The names of the ways to keep shortest paths.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum PathsName {
    /// Stored in the file
    Stored,
    /// Rebuilt when needed
    Rebuilt,
}

/// A point in the frame of the input.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScannerPosition(
    /// Its coordinates.
    pub [f64; 3],
);

fn parse_place(text: &str) -> Result<ScannerPosition, String> {
    let numbers: Vec<f64> = pieces(text).map_while(|piece| piece.parse().ok()).collect();
    match <[f64; 3]>::try_from(numbers) {
        Ok(place) if pieces(text).count() == 3 && place.iter().all(|c| c.is_finite()) => {
            Ok(ScannerPosition(place))
        }
        _ => Err("expected three numbers, x,y,z".into()),
    }
}

/// Returns the help of `--format`.
pub(crate) fn about_formats() -> String {
    format!("Format of the input: {}; auto decides by content, then by name", Format::list())
}

pub(crate) fn parse_format(name: &str) -> Result<FormatChoice, String> {
    if name.eq_ignore_ascii_case("auto") {
        return Ok(FormatChoice(None));
    }
    name.parse().map(|f| FormatChoice(Some(f))).map_err(|e: nearmiss::io::UnknownFormatName| e.to_string())
}

fn parse_bandwidth(text: &str) -> Result<Bandwidth, String> {
    match (text, text.parse::<f64>()) {
        ("local", _) => Ok(Bandwidth::Local),
        ("global", _) => Ok(Bandwidth::Global),
        (_, Ok(h)) if h > 0.0 && h.is_finite() => Ok(Bandwidth::Fixed(h)),
        _ => Err("expected local, global, or a length of more than zero".into()),
    }
}

fn parse_reach(text: &str) -> Result<f64, String> {
    let reach = text.parse().ok().filter(|reach: &f64| *reach > 0.0 && reach.is_finite());
    reach.ok_or_else(|| "expected a length of more than zero, in the units of the input".into())
}

impl PreprocessArgs {
    pub(crate) fn wants_graph(&self) -> bool {
        self.graph || self.neighbours.is_some() || self.scanner.is_some() || self.wants_close_pairs()
    }

    pub(crate) fn wants_close_pairs(&self) -> bool {
        self.close_pairs || self.paths.is_some() || self.kernel == KernelName::Geodesic
    }
}

pub(crate) fn options(args: &PreprocessArgs) -> BuildOptions {
    let kernel = match args.weight {
        WeightName::Gaussian => Kernel::Gaussian,
        WeightName::Wendland => Kernel::Wendland,
    };
    let default = BuildOptions::default();
    let default = args.reach.map_or(default, |reach| default.with_reach(reach));
    default
        .with_surface(SurfaceOptions::default().with_kernel(kernel).with_bandwidth(args.bandwidth))
        .with_radius_neighbours(args.radius_neighbours)
        .with_leaf_size(args.leaf)
        .with_threads(args.threads)
}

/// Returns the options of the graph and the position of the scanner, or `None` without a graph.
pub(crate) fn graph_options(args: &PreprocessArgs) -> Option<(GraphOptions, Option<[f64; 3]>)> {
    if !args.wants_graph() {
        return None;
    }
    let paths = match args.paths {
        Some(PathsName::Stored) => Paths::Stored,
        Some(PathsName::Rebuilt) | None => Paths::Rebuilt,
    };
    let default = GraphOptions::default().with_close_pairs(args.wants_close_pairs().then_some(paths));
    let options = args.neighbours.map_or(default, |neighbours| default.with_neighbours(neighbours));
    Some((options, args.scanner.map(|place| place.0)))
}
