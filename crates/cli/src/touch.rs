//! `touch`: tests many shapes against a scan, by its points or by its surface.

mod shapes;
mod surface;

use std::path::PathBuf;

use clap::Args;
use nearmiss::{NearestPoint, Placed, Scan, Shape, ShapeIndex};
use serde::Serialize;

use crate::console::{Console, Results, now};
use crate::digits::{place, short};
use crate::error::CliError;
use crate::input::Opening;
use crate::parse::parse_radius;
use crate::posing;
use crate::preprocess::parse_threads;
use crate::touch::shapes::ShapeFile;
use crate::touch::surface::{Asked, of_surface};

/// Options of `touch`.
#[derive(Debug, Clone, Args)]
pub struct TouchArgs {
    /// Prepared scan (.nm), or a point cloud or mesh, which is prepared on the fly
    pub scan: PathBuf,
    /// Shapes in world units, one JSON object on each line; `-` reads standard input
    ///
    /// `{"sphere":{"centre":[x,y,z],"radius":r}}`,
    /// `{"capsule":{"ends":[[x,y,z],[x,y,z]],"radius":r}}`, `{"box":{"pose":[16
    /// numbers],"half":[x,y,z]}}`, `{"cylinder":{"pose":[…],"half_height":h,"radius":r}}` about the y
    /// axis of its pose, `{"cone":{…}}` alike with its tip at the top,
    /// `{"hull":{"points":[[x,y,z],…]}}`, `{"triangle":{"points":[…]}}` or
    /// `{"segment":{"points":[…]}}`. A `radius` also rounds boxes, hulls, triangles and segments;
    /// `rounding` rounds cylinders and cones. Each shape gets one line of output, in order.
    #[arg(long, value_name = "FILE.jsonl")]
    pub shapes: PathBuf,
    /// Pose of the scan: `x y z qx qy qz qw`, a 4×4 matrix, or a file that holds either
    #[arg(long, value_name = "M", allow_hyphen_values = true)]
    pub pose: Option<String>,
    /// Test the surface between the points, and report bounds of the distance and contacts
    ///
    /// The surface is the obstacle: tangent discs where points sample a sheet, balls of half the
    /// local spacing about all other points. Normals of contacts point outwards if the scan is
    /// oriented (`preprocess --graph`), otherwise to the side of the shape's centre.
    #[arg(long)]
    pub surface: bool,
    /// Test balls of this radius about the points instead, with the same report
    #[arg(long, value_name = "R", allow_hyphen_values = true, value_parser = parse_radius)]
    pub thickened: Option<f64>,
    /// Shapes within this distance of the surface touch it; needs --surface or --thickened
    #[arg(long, value_name = "D", allow_hyphen_values = true, value_parser = parse_radius)]
    pub margin: Option<f64>,
    /// Threads to prepare a raw input; 0 for all cores
    #[arg(long, value_name = "N", value_parser = parse_threads, help_heading = "Advanced", hide_short_help = true)]
    pub threads: Option<usize>,
    /// Check prepared scans in full before use: checksums, and every number
    #[arg(long, help_heading = "Advanced", hide_short_help = true)]
    pub verify: bool,
    /// Print one JSON object for each shape
    #[arg(long, help_heading = "Output")]
    pub json: bool,
    /// Show no progress
    #[arg(long, help_heading = "Output")]
    pub quiet: bool,
}

/// The JSON output of `touch`.
#[derive(Debug, Serialize)]
struct TouchReport {
    touches: bool,
    nearest: [f64; 3],
    gap: f64,
    source: u32,
    micros: f64,
}

pub(crate) fn run(args: &TouchArgs) -> Result<(), CliError> {
    let matrix = posing::from_option("--pose", args.pose.as_deref())?;
    let mut shapes = ShapeFile::open(&args.shapes)?;
    let asked = Asked::new(args)?;
    let console = Console::new(args.quiet);
    let opening = Opening { threads: args.threads.unwrap_or(0), verify: args.verify, console };
    let scan = opening.open(&args.scan)?;
    let pose = posing::of_object(&matrix, &scan)
        .map_err(|refused| CliError::Pose { place: "--pose".into(), refused })?;
    // The sampling radius in world units.
    let r = scan.sampling_radius() * pose.scale();
    match asked {
        Some(asked) => of_surface(&scan.at(&pose), asked, &mut shapes, (r, args.json)),
        None => of_points(&scan, &scan.at(&pose), &mut shapes, (r, args.json)),
    }
}

/// Tests shapes against the points of a scan.
fn of_points(
    scan: &Scan,
    placed: &Placed<'_>,
    shapes: &mut ShapeFile,
    (r, is_json): (f64, bool),
) -> Result<(), CliError> {
    let mut index = None;
    let mut results = Results::new();
    let mut asked = 0;
    while let Some((line, text)) = shapes.next_line()? {
        // Answers to the lines before a faulty one are written before the error.
        let read = shapes.shape(line, &text, r);
        let shape = read.or_else(|fault| results.flush().and(Err(fault)))?;
        asked += 1;
        if asked == MANY {
            index = Some(ShapeIndex::new(scan));
        }
        let placed = index.as_ref().map_or(*placed, |index| placed.with_shapes(index));
        let (touches, nearest, micros) = answer(&placed, &shape.shape());
        let Some(nearest) = nearest else {
            return Err(shapes.too_far(line));
        };
        if is_json {
            let NearestPoint { source, point, gap } = nearest;
            results.json(&TouchReport { touches, nearest: point, gap, source: source.0, micros })?;
        } else {
            results.line(format_args!("line {line}: {}", sentence(touches, &nearest, 0.01 * r)))?;
        }
    }
    results.flush()
}

/// The least number of shapes for which an index pays off.
const MANY: u32 = 256;

fn answer(placed: &Placed<'_>, shape: &Shape<'_>) -> (bool, Option<NearestPoint>, f64) {
    let start = now();
    let (touches, nearest) = (placed.touches(shape), placed.nearest(shape, f64::INFINITY));
    #[expect(clippy::cast_precision_loss, reason = "nanoseconds of less than a month are exact")]
    let micros = start.elapsed().as_nanos() as f64 / 1e3;
    (touches, nearest, micros)
}

/// Returns the answer as a sentence.
fn sentence(touches: bool, nearest: &NearestPoint, unit: f64) -> String {
    let at = format!("point {} at {}", nearest.source.0, place(nearest.point, unit));
    if touches {
        return format!("It touches {at}.");
    }
    format!("No contact; {} from {at}.", short(nearest.gap))
}
