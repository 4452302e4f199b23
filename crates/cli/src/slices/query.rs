//! `slices query`: tests boxes, or another map in given poses.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use nearmiss::slices::{Floor, ObjectError, Occupancy, SliceFolder, SliceMap, StoreError, Unloaded};
use nearmiss::{Aabb, Pose};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::report::open;
use crate::console::{self, Results, now};
use crate::digits::{count, short};
use crate::error::CliError;
use crate::json_lines::JsonLines;
use crate::matrix::Matrix;
use crate::pose_text::JsonPose;

/// Tolerance of a rotation in a pose, in pixels of the object.
const OFF: f64 = 0.1;

/// Options of `slices query`.
#[derive(Debug, Clone, Args)]
#[command(group = clap::ArgGroup::new("what").required(true).args(["boxes", "map"]))]
pub struct QueryArgs {
    /// Folder of the map
    pub folder: PathBuf,
    /// Boxes, each on a line `{"min":[x,y,z],"max":[x,y,z]}`
    #[arg(long, value_name = "FILE.jsonl")]
    pub boxes: Option<PathBuf>,
    /// Another map to test against this one in the poses of --poses
    #[arg(long, value_name = "DIR", requires = "poses")]
    pub map: Option<PathBuf>,
    /// Poses of --map; they may rotate about the vertical axis only
    ///
    /// Each is a line `{"a":[16 numbers],"b":[16 numbers]}`, where `a` is the pose of this map
    /// (optional) and `b` that of the other.
    #[arg(long, value_name = "FILE.jsonl", requires = "map")]
    pub poses: Option<PathBuf>,
    /// Height of the floor below a box: that of its highest pixel, or the mean of all
    #[arg(long, value_enum, default_value_t = FloorName::Max)]
    pub floor: FloorName,
    /// Print one JSON object for each query
    #[arg(long)]
    pub json: bool,
}

/// The names of the kinds of floor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum FloorName {
    /// The highest pixel
    Max,
    /// The mean of all pixels
    Mean,
}

/// A line of a file of boxes. Other fields are ignored.
#[derive(Debug, Deserialize)]
struct BoxLine {
    min: [f64; 3],
    max: [f64; 3],
}

/// A line of a file of poses. Other fields are ignored.
#[derive(Debug, Deserialize)]
struct PoseLine {
    a: Option<JsonPose>,
    b: JsonPose,
}

/// An answer.
#[derive(Debug, Serialize)]
struct Answer {
    #[serde(flatten)]
    found: Occupancy,
    micros: f64,
}

pub(super) fn run(args: &QueryArgs) -> Result<(), CliError> {
    let floor = match args.floor {
        FloorName::Max => Floor::Max,
        FloorName::Mean => Floor::Mean,
    };
    let folder = open(&args.folder)?;
    let (map, mut faults) = folder.load_all();
    let mut folders = vec![folder];
    let mut results = Results::new();
    let mut failed = None;
    let mut tell = |found: Result<Occupancy, ObjectError>, micros: f64| match found {
        Ok(found) if args.json => results.json(&Answer { found, micros }),
        Ok(found) => results.line(sentence(&found)),
        Err(ObjectError::Unloaded(cause)) => {
            // The other answers are valid; this one is null, and the command fails at the end.
            failed.get_or_insert(cause);
            let text = format!("Cannot tell: {cause}.");
            if args.json { results.json(&serde_json::Value::Null) } else { results.line(text) }
        }
        Err(other) => Err(CliError::Usage(other.to_string())),
    };
    if let Some(path) = &args.boxes {
        each_line(path, ["boxes", BOX_LINE], |line: BoxLine| {
            let bounds = Aabb { min: line.min, max: line.max };
            if !(0..3).all(|k| bounds.min[k] <= bounds.max[k]) {
                return Err(format!(
                    "expected min at most max, got min {:?} and max {:?}",
                    line.min, line.max
                ));
            }
            let start = now();
            let found = map.query(&bounds, floor);
            Ok(tell(found.map_err(Into::into), micros(start)))
        })?;
    }
    if let (Some(other), Some(path)) = (&args.map, &args.poses) {
        let folder = open(other)?;
        let (object, more) = folder.load_all();
        faults.extend(more);
        // Every query needs the whole object.
        folders.insert(0, folder);
        each_line(path, ["poses", POSE_LINE], |line: PoseLine| {
            let pose = pose(&line, &map, &object)?;
            let start = now();
            let found = map.meets(&object, &pose, floor);
            let took = micros(start);
            match found {
                Err(ObjectError::Tilted { .. }) => {
                    Err(found.map_or_else(|e| e.to_string(), |_| String::new()))
                }
                found => Ok(tell(found, took)),
            }
        })?;
    }
    results.flush()?;
    let cause = failed.and_then(|missing| why(&folders, missing));
    let text = cause.as_ref().map(ToString::to_string);
    faults.iter().filter(|fault| Some(fault.to_string()) != text).for_each(console::warn);
    cause.map_or(Ok(()), |cause| Err(cause.into()))
}

/// Returns the error of a missing slice.
fn why(folders: &[SliceFolder], Unloaded { slice }: Unloaded) -> Option<StoreError> {
    let with_it = folders.iter().filter(|folder| slice < folder.grid().counts[2]);
    with_it.filter_map(|folder| folder.load(slice).err()).next()
}

const BOX_LINE: &str = r#"a box is {"min":[x,y,z],"max":[x,y,z]}"#;
const POSE_LINE: &str = r#"a pose line is {"a":[16 numbers],"b":[16 numbers]}, where `a` may be left out"#;

/// Reads and answers each line; errors name the number of the line.
fn each_line<L: DeserializeOwned>(
    path: &Path,
    [wanted, form]: [&'static str; 2],
    mut answer: impl FnMut(L) -> Result<Result<(), CliError>, String>,
) -> Result<(), CliError> {
    let mut lines = JsonLines::open(path, wanted, form)?;
    while let Some((number, text)) = lines.next_line()? {
        answer(lines.parse(number, &text)?).map_err(|what| lines.fault_on(number, what))??;
    }
    Ok(())
}

/// Returns the object's pose in the building.
fn pose(line: &PoseLine, map: &SliceMap, object: &SliceMap) -> Result<Pose, String> {
    let read = |given: &JsonPose, map: &SliceMap| {
        let matrix: Matrix = given.matrix()?;
        let grid = map.grid();
        let far = [0, 1, 2].map(|k| {
            let size = if k == 2 { grid.slice_height } else { grid.pixel };
            grid.origin[k] + f64::from(grid.counts[k]) * size
        });
        let bounds = Aabb::of([grid.origin, far].map(|corner| grid.up.from_map(corner)));
        Pose::from_row_major(&matrix, &bounds, OFF * grid.pixel).map_err(|e| e.to_string())
    };
    let b = read(&line.b, object)?;
    match &line.a {
        Some(a) => Ok(read(a, map)?.inverse().after(&b)),
        None => Ok(b),
    }
}

fn micros(start: std::time::Instant) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "nanoseconds of less than a month are exact")]
    let nanos = start.elapsed().as_nanos() as f64;
    nanos / 1e3
}

/// Formats an answer as text.
fn sentence(found: &Occupancy) -> String {
    let what = match (found.collides, found.obstacle) {
        (false, _) => "Free".to_owned(),
        (true, true) => format!("Occupied in {}, with obstacles", count(found.pixels, "pixel")),
        (true, false) => format!("Occupied in {}, without obstacles", count(found.pixels, "pixel")),
    };
    match found.floor {
        Some(floor) => format!("{what}; the floor below is at {}.", short(floor)),
        None => format!("{what}; no floor below."),
    }
}
