//! `touch`: tests many shapes against the points of a scan.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use clap::Args;
use nearmiss::{Aabb, NearestPoint, Placed, Pose, PoseError, Shape, ShapeIndex};
use serde::de::IgnoredAny;
use serde::{Deserialize, Serialize};

use crate::console::{Console, Results, now};
use crate::digits::{place, short};
use crate::error::CliError;
use crate::input::{Opening, TextLines};
use crate::matrix::PoseRefused;
use crate::posing;
use crate::preprocess::parse_threads;

/// Options of `touch`.
#[derive(Debug, Clone, Args)]
pub struct TouchArgs {
    /// Prepared scan (.nm), or a point cloud or mesh, which is prepared on the fly
    pub scan: PathBuf,
    /// Shapes in world units, one JSON object on each line; `-` reads standard input
    ///
    /// `{"sphere":{"centre":[x,y,z],"radius":r}}`,
    /// `{"capsule":{"ends":[[x,y,z],[x,y,z]],"radius":r}}` or `{"box":{"pose":[16
    /// numbers],"half":[x,y,z]}}`. Each shape gets one line of output, in order.
    #[arg(long, value_name = "FILE.jsonl")]
    pub shapes: PathBuf,
    /// Pose of the scan: `x y z qx qy qz qw`, a 4×4 matrix, or a file that holds either
    #[arg(long, value_name = "M", allow_hyphen_values = true)]
    pub pose: Option<String>,
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
    let console = Console::new(args.quiet);
    let opening = Opening { threads: args.threads.unwrap_or(0), verify: args.verify, console };
    let scan = opening.open(&args.scan)?;
    let pose = posing::of_object(&matrix, &scan)
        .map_err(|refused| CliError::Pose { place: "--pose".into(), refused })?;
    let (placed, mut index) = (scan.at(&pose), None);
    // The sampling radius in world units.
    let r = scan.sampling_radius() * pose.scale();
    let mut results = Results::new();
    let mut asked = 0;
    while let Some((line, text)) = shapes.next_line()? {
        // Answers to the lines before a faulty one are written before the error.
        let read = shapes.shape(line, &text, r);
        let shape = read.or_else(|fault| results.flush().and(Err(fault)))?;
        asked += 1;
        if asked == MANY {
            index = Some(ShapeIndex::new(&scan));
        }
        let placed = index.as_ref().map_or(placed, |index| placed.with_shapes(index));
        let (touches, nearest, micros) = answer(&placed, &shape);
        let Some(nearest) = nearest else {
            let what = "expected a shape within measurable distance, got one too far away or too large; check its units";
            return Err(shapes.lines.fault_on(line, what));
        };
        if args.json {
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

fn answer(placed: &Placed<'_>, shape: &Shape) -> (bool, Option<NearestPoint>, f64) {
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

/// The form of a line, for messages.
const SHAPE_LINE: &str = r#"a line is {"sphere":{"centre":[x,y,z],"radius":r}}, {"capsule":{"ends":[[x,y,z],[x,y,z]],"radius":r}} or {"box":{"pose":[16 numbers],"half":[x,y,z]}}"#;

/// The names of the shapes.
const SHAPES: [&str; 3] = ["sphere", "capsule", "box"];

/// A line of a file of shapes, which holds one shape. Other fields are ignored.
#[derive(Debug, Deserialize)]
#[serde(expecting = "an object")]
struct ShapeLine {
    sphere: Option<SphereLine>,
    capsule: Option<CapsuleLine>,
    r#box: Option<BoxLine>,
    #[serde(flatten)]
    others: BTreeMap<String, IgnoredAny>,
}

impl ShapeLine {
    /// Returns the error about a line without a shape, or with several.
    fn fault(&self) -> String {
        let count = [self.sphere.is_some(), self.capsule.is_some(), self.r#box.is_some()];
        match (count.iter().filter(|is_there| **is_there).count(), self.others.keys().next()) {
            (0, Some(name)) => {
                let name: String = name.chars().take(40).flat_map(char::escape_debug).collect();
                format!("unknown shape `{name}`; known: {}", SHAPES.join(", "))
            }
            (count, _) => format!("expected one shape, got {count}; {SHAPE_LINE}"),
        }
    }
}

#[derive(Debug, Deserialize)]
struct SphereLine {
    #[serde(alias = "center")]
    centre: [f64; 3],
    radius: f64,
}

#[derive(Debug, Deserialize)]
struct CapsuleLine {
    ends: [[f64; 3]; 2],
    radius: f64,
}

#[derive(Debug, Deserialize)]
struct BoxLine {
    pose: [f64; 16],
    half: [f64; 3],
}

/// A file with a shape on each line.
struct ShapeFile {
    lines: TextLines,
    /// `true` until a line with a shape has been read.
    is_empty: bool,
}

impl ShapeFile {
    fn open(path: &Path) -> Result<Self, CliError> {
        Ok(Self { lines: TextLines::open(path)?, is_empty: true })
    }

    /// Returns the number of the next line that is not blank, counted from 1, and its text.
    fn next_line(&mut self) -> Result<Option<(u64, String)>, CliError> {
        let line = self.lines.next_filled()?;
        if line.is_none() && self.is_empty {
            return Err(self.lines.unsuitable(format!("expected shapes, got none; {SHAPE_LINE}")));
        }
        self.is_empty = false;
        Ok(line)
    }

    /// Parses the shape on line `number`, whose text is `text`. The pose of a box may deviate from
    /// a rotation by a tenth of `r`.
    fn shape(&self, number: u64, text: &str, r: f64) -> Result<Shape, CliError> {
        let line: ShapeLine = serde_json::from_str(text).map_err(|e| {
            let message = e.to_string();
            let what = message.split(" at line ").next().unwrap_or_default();
            self.lines.fault_on(number, format!("column {}: {what}; {SHAPE_LINE}", e.column()))
        })?;
        let shape = match line {
            ShapeLine { sphere: Some(SphereLine { centre, radius }), capsule: None, r#box: None, .. } => {
                positive("radius", radius).map(|radius| Shape::Sphere { centre, radius })
            }
            ShapeLine { sphere: None, capsule: Some(CapsuleLine { ends, radius }), r#box: None, .. } => {
                positive("radius", radius).map(|radius| Shape::Capsule { ends, radius })
            }
            ShapeLine { sphere: None, capsule: None, r#box: Some(BoxLine { pose, half }), .. } => {
                solid(&pose, half, r)
            }
            line => Err(line.fault()),
        };
        shape.map_err(|what| self.lines.fault_on(number, what))
    }
}

fn solid(pose: &[f64; 16], half: [f64; 3], r: f64) -> Result<Shape, String> {
    let half = [positive("half", half[0])?, positive("half", half[1])?, positive("half", half[2])?];
    let bounds = Aabb { min: half.map(|h| -h), max: half };
    let pose = Pose::from_row_major(pose, &bounds, 0.1 * r);
    let pose = pose.map_err(|cause| format!("`pose`: {}", refused(cause)))?;
    Ok(Shape::Box { pose, half })
}

fn refused(cause: PoseError) -> PoseRefused {
    PoseRefused { cause, is_transposed: false, allowed: "a tenth of the sampling radius" }
}

fn positive(name: &str, length: f64) -> Result<f64, String> {
    if length >= 0.0 {
        Ok(length)
    } else {
        Err(format!("expected a length of zero or more in `{name}`, got {}", short(length)))
    }
}
