//! `touch`: tests many shapes against a scan, by its points or by its surface.

mod args;
mod shapes;
mod surface;
mod swept;

use std::path::Path;

use nearmiss::{NearestPoint, Placed, Scan, Shape, ShapeIndex, Target};
use serde::Serialize;

use crate::console::{Console, Results, micros_since, now};
use crate::digits::{place, short};
use crate::error::CliError;
use crate::input::Opening;
use crate::label::Label;
use crate::posing;
use crate::sentence::world_bounds;
pub use crate::touch::args::TouchArgs;
use crate::touch::shapes::ShapeFile;
use crate::touch::surface::{Asked, of_surface};
use crate::touch::swept::{Route, along_path};
use crate::units::UnitCheck;

/// The JSON output of `touch`.
#[derive(Debug, Serialize)]
struct TouchReport {
    #[serde(flatten)]
    label: Label,
    touches: bool,
    nearest: [f64; 3],
    gap: f64,
    source: u32,
    micros: f64,
}

pub(crate) fn run(args: &TouchArgs) -> Result<(), CliError> {
    let matrix = posing::in_metres("--pose", args.pose.as_deref(), args.units)?;
    let mut shapes = ShapeFile::open(&args.shapes)?;
    let asked = Asked::new(args)?;
    if args.path.as_deref() == Some(Path::new("-")) && args.shapes == Path::new("-") {
        let what = "--path: expected a file, got `-`, which --shapes reads; give one of them as a file";
        return Err(CliError::Usage(what.to_owned()));
    }
    let route = args.path.as_deref().map(Route::read).transpose()?;
    let console = Console::new(args.quiet);
    let opening = Opening { threads: args.threads.unwrap_or(0), verify: args.verify, console };
    let scan = opening.open(&args.scan)?;
    let pose = posing::of_object(&matrix, &scan)
        .map_err(|refused| CliError::Pose { place: "--pose".into(), refused })?;
    // The sampling radius in world units.
    let r = scan.sampling_radius() * pose.scale();
    let placed = scan.at(&pose);
    let told = (UnitCheck::new(world_bounds(&placed), r, args.units), r, args.json);
    match asked {
        Some(asked) => {
            let plan = asked.plan(&scan)?;
            let target = Target::new(placed, &plan);
            match &route {
                Some(route) => along_path((&target, asked), route, &mut shapes, told),
                None => of_surface(&target, asked, &mut shapes, told),
            }
        }
        None => of_points(&scan, &placed, &mut shapes, told),
    }
}

/// Tests shapes against the points of a scan.
fn of_points(
    scan: &Scan,
    placed: &Placed<'_>,
    shapes: &mut ShapeFile,
    (mut check, r, is_json): (UnitCheck, f64, bool),
) -> Result<(), CliError> {
    let (mut index, mut results) = (None, Results::new());
    let mut asked = 0;
    while let Some((line, text)) = shapes.next_line()? {
        // Answers to the lines before a faulty one are written before the error.
        let read = shapes.shape(line, &text, r);
        let (shape, label) = read.or_else(|fault| results.flush().and(Err(fault)))?;
        shape.compare(&mut check, line);
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
            results.json(&TouchReport { label, touches, nearest: point, gap, source: source.0, micros })?;
        } else {
            results.line(format_args!("line {line}{label}: {}", sentence(touches, &nearest, 0.01 * r)))?;
        }
    }
    results.flush()
}

/// The least number of shapes for which an index pays off.
const MANY: u32 = 256;

fn answer(placed: &Placed<'_>, shape: &Shape<'_>) -> (bool, Option<NearestPoint>, f64) {
    let start = now();
    let (touches, nearest) = (placed.touches(shape), placed.nearest(shape, f64::INFINITY));
    let micros = micros_since(start);
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
