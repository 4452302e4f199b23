//! `eval`: evaluates the implicit function at given points.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use nearmiss::graph::{GeodesicKernel, KernelScratch};
use nearmiss::{Evaluation, GraphOptions, Metric, Paths, Placed, Pose, Scan, Scratch, Status};
use serde::Serialize;

use crate::console::{Console, Results};
use crate::digits::{place, short};
use crate::error::CliError;
use crate::input::{self, Opening, TextLines, pieces, prepare_again};

/// Options of `eval`.
#[derive(Debug, Clone, Args)]
pub struct EvalArgs {
    /// Prepared scan (.nm), or a point cloud or mesh, which is prepared on the fly
    #[arg(value_name = "FILE.nm")]
    pub file: PathBuf,
    /// Points at which f is evaluated: a line `x y z` for each, in the frame of the scan; `-` reads
    /// standard input
    #[arg(long, value_name = "FILE")]
    pub points: PathBuf,
    /// Metric of the kernel that defines the surface; by default the one the scan was prepared for
    #[arg(long, value_enum)]
    pub kernel: Option<KernelName>,
    /// Print one JSON object for each point
    #[arg(long)]
    pub json: bool,
    /// Check prepared scans in full before use: checksums and all values
    #[arg(long)]
    pub verify: bool,
}

/// The names of the metrics.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum KernelName {
    /// Straight distances
    Euclidean,
    /// Distances along the proximity graph; needs close pairs
    Geodesic,
}

impl KernelName {
    /// Returns the metric of this name.
    pub(crate) const fn metric(self) -> Metric {
        match self {
            Self::Euclidean => Metric::Euclidean,
            Self::Geodesic => Metric::Geodesic,
        }
    }
}

#[derive(Debug, Serialize)]
struct Report {
    f: Option<f64>,
    normal: Option<[f64; 3]>,
    centroid: [f64; 3],
    support: u32,
    status: Status,
}

pub(crate) fn run(args: &EvalArgs) -> Result<(), CliError> {
    if input::is_prepared(&args.points) {
        let what = "expected text with a line x y z for each point, got a prepared scan (by its content or name); \
                    check that the two files are not swapped";
        return Err(CliError::UnsuitableFile { path: args.points.clone(), what: what.into() });
    }
    let mut lines = TextLines::open(&args.points)?;
    // The points are read before the scan is opened, for a clear error if the two files are
    // swapped.
    let mut next = next_point(&mut lines)?;
    if next.is_none() {
        return Err(lines.unsuitable("expected points, got none; a line is x y z"));
    }
    let opening = Opening::new(args.verify, Console::new(false));
    let scan = match args.kernel {
        None | Some(KernelName::Euclidean) => opening.open(&args.file)?,
        Some(KernelName::Geodesic) => {
            let options = GraphOptions::default().with_close_pairs(Some(Paths::Rebuilt));
            opening.open_with_graph(&args.file, &options)?
        }
    };
    let unit = scan.sampling_radius() / 100.0;
    let kernel = kernel(&scan, args)?;
    // Without a graph, distances are straight.
    let placed = Placed::new(&scan, &Pose::IDENTITY);
    let (mut scratch, mut geodesic) = (Scratch::default(), KernelScratch::default());
    let mut results = Results::new();
    while let Some(x) = next {
        let at = match &kernel {
            None => placed.evaluate(x, &mut scratch),
            Some(kernel) => placed.evaluate_by(kernel, x, &mut geodesic),
        };
        if args.json {
            let defined = at.status == Status::Ok;
            results.json(&Report {
                f: defined.then_some(at.f),
                normal: defined.then_some(at.normal),
                centroid: at.centroid,
                support: at.support,
                status: at.status,
            })?;
        } else {
            results.line(sentence(&at, unit))?;
        }
        next = next_point(&mut lines)?;
    }
    results.flush()
}

/// Returns the geodesic kernel, or `None` for the euclidean one. Fails if the scan lacks the map of
/// close pairs.
fn kernel<'a>(scan: &'a Scan, args: &EvalArgs) -> Result<Option<GeodesicKernel<'a>>, CliError> {
    match args.kernel.map_or(scan.metric(), KernelName::metric) {
        Metric::Euclidean => Ok(None),
        Metric::Geodesic => {
            let missing = || {
                let what = format!(
                    "expected a scan with close pairs for the geodesic kernel, got one without; {}",
                    prepare_again(&args.file, "--close-pairs")
                );
                CliError::UnsuitableFile { path: args.file.clone(), what }
            };
            scan.geodesic_kernel().ok_or_else(missing).map(Some)
        }
    }
}

fn sentence(at: &Evaluation, unit: f64) -> String {
    let support = at.support;
    match at.status {
        Status::Ok => {
            let normal = place(at.normal, 0.001);
            format!(
                "f = {}, normal {normal}, mean {}, support {support}",
                short(at.f),
                place(at.centroid, unit)
            )
        }
        Status::Outside => format!("outside: too few points nearby, or too far away, support {support}"),
        Status::Border => format!("border: too far off the surface, or beyond its border, support {support}"),
        _ => format!("ambiguous: the points nearby do not look like a single surface, support {support}"),
    }
}

/// Starts of the first line of point clouds that are not plain rows of coordinates.
const STARTS_OF_SCANS: [&str; 2] = ["ply", "VERSION"];

/// Returns the next point. Blank lines are skipped, and comments, which start with `#` or `//`.
fn next_point(lines: &mut TextLines) -> Result<Option<[f64; 3]>, CliError> {
    while let Some((_, text)) = lines.next_filled()? {
        if text.starts_with("//") {
            continue;
        }
        if STARTS_OF_SCANS.iter().any(|start| text.starts_with(start)) {
            let what = "expected text with a line x y z for each point, got a scan; check that the two files are not \
                        swapped";
            return Err(lines.unsuitable(what));
        }
        let mut columns = pieces(&text);
        let mut point = [0.0; 3];
        for (name, slot) in ["x", "y", "z"].into_iter().zip(&mut point) {
            let Some(piece) = columns.next() else {
                return Err(
                    lines.fault(format!("expected a number in column `{name}`, got none; a line is x y z"))
                );
            };
            let number = piece.parse::<f64>().ok().filter(|c| c.is_finite());
            *slot = number.ok_or_else(|| {
                let shown: String = piece.chars().take(40).flat_map(char::escape_debug).collect();
                lines.fault(format!(
                    "expected a finite number in column `{name}`, got `{shown}`; a line is x y z"
                ))
            })?;
        }
        return Ok(Some(point));
    }
    Ok(None)
}
