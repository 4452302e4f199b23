//! The options of `preprocess`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use nearmiss::io::Format;
use nearmiss::{Bandwidth, BuildOptions, GraphOptions, Kernel, Paths, SurfaceOptions};

use crate::eval::KernelName;
use crate::filters::FilterArgs;
use crate::input::pieces;
use crate::memory::MemoryArgs;

/// Options of `preprocess`.
#[derive(Debug, Clone, Args)]
pub struct PreprocessArgs {
    /// Point cloud (PLY, PCD, LAS, LAZ, E57, NPY or text) or mesh (OBJ, STL, OFF, glTF, PLY with faces), of
    /// which the vertices are the points
    pub input: PathBuf,
    /// Prepared scan to write, usually named `.nm`; replaced in one step if it is there
    #[arg(short, long, value_name = "OUT.nm")]
    pub output: PathBuf,
    /// Format of the input: ply, pcd, las, e57, npy, xyz, obj, stl, off, gltf, or auto, by content and name
    #[arg(long, default_value = "auto", value_parser = parse_format)]
    pub format: FormatChoice,
    /// Which points to leave out
    #[command(flatten)]
    pub filters: FilterArgs,
    /// K: local radii reach to the K-th neighbour, further where the points look like lines; 3 to 32
    #[arg(long, value_name = "K", default_value_t = 6, value_parser = clap::value_parser!(u32).range(3..=32))]
    pub radius_neighbours: u32,
    /// L: how far the scan may be interpolated, in the units of the input. No gap wider than this is bridged,
    /// and no ball is wider. By default twice the sampling radius, within which nine tenths of the points
    /// have six neighbours
    #[arg(long, value_name = "L", allow_hyphen_values = true, value_parser = parse_reach)]
    pub reach: Option<f64>,
    /// Weight of a point by its distance
    #[arg(long, value_enum, default_value_t = WeightName::Gaussian)]
    pub weight: WeightName,
    /// Width of the weight: local (follows the spacing), global (from the sampling radius), or a length
    #[arg(long, value_name = "local|global|M", default_value = "local", allow_hyphen_values = true, value_parser = parse_bandwidth)]
    pub bandwidth: Bandwidth,
    /// Points in a leaf of the hierarchy, 4 to 64
    #[arg(long, value_name = "N", default_value_t = 16, value_parser = clap::value_parser!(u32).range(4..=64))]
    pub leaf: u32,
    /// Add a graph over the points: normals are turned to one side, and searches can go along the surface
    #[arg(long)]
    pub graph: bool,
    /// R: two points are neighbours in the graph if the spheres about them that reach their R-th nearest
    /// points meet; 1 to 32, by default 4. Implies --graph
    #[arg(long, value_name = "R", value_parser = clap::value_parser!(u32).range(1..=32))]
    pub neighbours: Option<u32>,
    /// Add a map of close pairs to the graph, which takes most of the file; the geodesic kernel needs it.
    /// Implies --graph
    #[arg(long)]
    pub close_pairs: bool,
    /// Whether shortest paths of close pairs are stored, a byte a pair, or rebuilt when wanted, the default.
    /// Implies --close-pairs
    #[arg(long, value_enum)]
    pub paths: Option<PathsName>,
    /// Which distances define the surface: straight ones, or those along the graph, which keep sheets apart
    /// that are close to each other. The latter implies --close-pairs, and nothing but witnesses is certified
    /// of it
    #[arg(long, value_enum, default_value_t = KernelName::Euclidean)]
    pub kernel: KernelName,
    /// Where the scanner stood, in the frame of the input: normals are turned towards it. Implies --graph
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = parse_place)]
    pub scanner: Option<Place>,
    /// Threads to work on, 0 for all cores; the result is the same
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = parse_threads)]
    pub threads: usize,
    /// How much memory may be used
    #[command(flatten)]
    pub memory: MemoryArgs,
    /// One object of JSON instead of sentences
    #[arg(long)]
    pub json: bool,
    /// No progress on the terminal
    #[arg(long)]
    pub quiet: bool,
}

/// A format, or none for whatever content and name say.
#[derive(Debug, Clone, Copy)]
pub struct FormatChoice(
    /// The format.
    pub Option<Format>,
);

/// A weight function, by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum WeightName {
    /// exp(−d²/h²), cut off where it is small
    Gaussian,
    /// Wendland's C² function, zero from a finite distance on
    Wendland,
}

/// What becomes of shortest paths, by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum PathsName {
    /// Kept in the file
    Stored,
    /// Found again when wanted
    Rebuilt,
}

/// A place in the frame of the input.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place(
    /// Its coordinates.
    pub [f64; 3],
);

fn parse_place(text: &str) -> Result<Place, String> {
    let numbers: Vec<f64> = pieces(text).map_while(|piece| piece.parse().ok()).collect();
    match <[f64; 3]>::try_from(numbers) {
        Ok(place) if pieces(text).count() == 3 && place.iter().all(|c| c.is_finite()) => Ok(Place(place)),
        _ => Err("expected three numbers, x,y,z".into()),
    }
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
        _ => Err("expected local, global, or a positive length".into()),
    }
}

fn parse_reach(text: &str) -> Result<f64, String> {
    let reach = text.parse().ok().filter(|reach: &f64| *reach > 0.0 && reach.is_finite());
    reach.ok_or_else(|| "expected a positive length, in the units of the input".into())
}

/// More threads than this help nobody, and may not start.
const MOST_THREADS: usize = 1024;

pub(crate) fn parse_threads(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(n) if n <= MOST_THREADS => Ok(n),
        _ => Err(format!("expected a number from 0, for all cores, to {MOST_THREADS}")),
    }
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

/// What graph is wanted, if any, and where the scanner stood.
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
