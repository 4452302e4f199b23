//! Poses from the command line and from files.

use std::path::{Path, PathBuf};

use clap::Args;
use nearmiss::{Pose, PoseError, Scan};
use serde::Deserialize;

use crate::console::Console;
use crate::error::CliError;
use crate::input::{Opening, TextLines, pieces};
use crate::matrix::{Matrix, PoseRefused};
use crate::units::{SizeCheck, UnitName, WorldUnit, scaled};

/// Two scans, and where they are.
#[derive(Debug, Clone, Args)]
pub struct PairArgs {
    /// The one scan: prepared, or a raw input, prepared on the fly
    pub a: PathBuf,
    /// The other scan
    pub b: PathBuf,
    /// Pose of a, object to world: 16 numbers, row-major, in one argument, or a file that holds them
    #[arg(long, value_name = "M", allow_hyphen_values = true)]
    pub pose_a: Option<String>,
    /// Pose of b
    #[arg(long, value_name = "M", allow_hyphen_values = true)]
    pub pose_b: Option<String>,
    /// Unit of the lengths of a. With --units-a or --units-b the world is in metres, and so is a scan without
    /// a unit: scans are scaled to metres before their poses are applied
    #[arg(long, value_enum, value_name = "U")]
    pub units_a: Option<UnitName>,
    /// Unit of the lengths of b
    #[arg(long, value_enum, value_name = "U")]
    pub units_b: Option<UnitName>,
    /// Compare prepared scans with their checksums, and check every number of theirs, before they are used
    #[arg(long)]
    pub verify: bool,
}

impl PairArgs {
    /// The files.
    pub(crate) fn inputs(&self) -> [&Path; 2] {
        [&self.a, &self.b]
    }

    /// How the scans are opened.
    pub(crate) fn opening(&self, threads: Option<usize>, console: Console) -> Opening {
        Opening { threads: threads.unwrap_or(0), verify: self.verify, console }
    }

    /// The matrices of both poses.
    pub(crate) fn matrices(&self) -> Result<[Matrix; 2], CliError> {
        let [a, b] = [("--pose-a", &self.pose_a), ("--pose-b", &self.pose_b)]
            .map(|(name, given)| from_option(name, given.as_deref()));
        let [by_a, by_b] = self.factors().unwrap_or([1.0; 2]);
        Ok([scaled(a?, by_a), scaled(b?, by_b)])
    }

    /// The file of poses, if there is one.
    pub(crate) fn pose_file(&self, path: Option<&PathBuf>) -> Result<Option<PoseFile>, CliError> {
        let open = |path: &PathBuf| PoseFile::open(path, self.factors().unwrap_or([1.0; 2]));
        path.map(open).transpose()
    }

    /// A check that asks about units once if the scans differ too much in size.
    pub(crate) fn size_check(&self, console: Console) -> SizeCheck {
        SizeCheck::new(console, self.factors())
    }

    /// The unit of lengths in the world.
    pub(crate) fn world_unit(&self) -> WorldUnit {
        if self.factors().is_some() { WorldUnit::Metres } else { WorldUnit::OfFile }
    }

    /// The units in metres, if any is given.
    fn factors(&self) -> Option<[f64; 2]> {
        let units = [self.units_a, self.units_b];
        units.iter().any(Option::is_some).then(|| units.map(|unit| unit.map_or(1.0, UnitName::metres)))
    }
}

/// The poses of two scans nearest to the matrices of their options.
pub(crate) fn of_options(matrices: &[Matrix; 2], scans: [&Scan; 2]) -> Result<[Pose; 2], CliError> {
    let placed = |name: &str, side: usize| {
        of_scan(&matrices[side], scans[side])
            .map_err(|refused| CliError::Pose { place: name.into(), refused })
    };
    Ok([placed("--pose-a", 0)?, placed("--pose-b", 1)?])
}

/// The matrix of an option: sixteen numbers, or a file that holds them; the identity if not given.
pub(crate) fn from_option(option: &str, given: Option<&str>) -> Result<Matrix, CliError> {
    let Some(given) = given else { return Ok(Pose::IDENTITY.to_row_major()) };
    if let Ok(matrix) = parse(given) {
        return Ok(matrix);
    }
    let path = Path::new(given);
    if !path.is_file() {
        let what = match parse(given) {
            Err(what) if pieces(given).nth(1).is_some() => what,
            _ => format!("`{given}` is neither sixteen numbers nor a file that holds them"),
        };
        return Err(CliError::Usage(format!(
            "{option}: {what}; a pose is a row-major 4×4 matrix, divided by commas or spaces, in one argument"
        )));
    }
    let text = std::fs::read_to_string(path).map_err(CliError::reading(path))?;
    parse(&text).map_err(|what| CliError::Unfit { path: path.to_owned(), what })
}

/// Sixteen numbers, brackets allowed.
fn parse(text: &str) -> Result<Matrix, String> {
    let bare = text.replace(['[', ']'], " ");
    let mut matrix = [0.0; 16];
    let mut count = 0;
    for piece in pieces(&bare) {
        let number = piece.parse().map_err(|_not_a_number| {
            let shown: String = piece.chars().take(40).flat_map(char::escape_debug).collect();
            format!("`{shown}` is not a number")
        })?;
        if let Some(slot) = matrix.get_mut(count) {
            *slot = number;
        }
        count += 1;
    }
    if count == 16 { Ok(matrix) } else { Err(format!("{count} numbers where 16 belong")) }
}

/// The pose nearest to `matrix`, unless that moves the scan's bounds by more than a tenth of its sampling
/// radius.
pub(crate) fn of_scan(matrix: &Matrix, scan: &Scan) -> Result<Pose, PoseRefused> {
    let row = |i: usize| [matrix[4 * i], matrix[4 * i + 1], matrix[4 * i + 2]];
    let [x, y, z] = [row(0), row(1), row(2)];
    let determinant = x[0] * (y[1] * z[2] - y[2] * z[1]) - x[1] * (y[0] * z[2] - y[2] * z[0])
        + x[2] * (y[0] * z[1] - y[1] * z[0]);
    // Both in world units, so lengths of the object scale.
    let tolerance = 0.1 * scan.sampling_radius() * determinant.abs().cbrt();
    Pose::from_row_major(matrix, scan.bounds(), tolerance).map_err(|cause| {
        let last_column = [3, 7, 11, 15].map(|i| matrix[i]);
        let is_transposed = cause == PoseError::NotAffine && last_column == [0.0, 0.0, 0.0, 1.0];
        PoseRefused { cause, is_transposed }
    })
}

/// What the messages show.
const POSE_LINE: &str = r#"a pose line is {"a":[16 numbers],"b":[16 numbers]}"#;

/// A line of a file of poses. Other fields are ignored.
#[derive(Debug, Deserialize)]
#[serde(expecting = "an object")]
struct PoseLine {
    a: Vec<f64>,
    b: Vec<f64>,
}

/// A file with a query's two poses on each line. Lines are read in order; what they say can be read by many
/// threads.
#[derive(Debug)]
pub(crate) struct PoseFile {
    lines: TextLines,
    /// No line with poses has been met so far.
    is_empty: bool,
    /// The units of both scans in metres.
    factors: [f64; 2],
}

impl PoseFile {
    fn open(path: &Path, factors: [f64; 2]) -> Result<Self, CliError> {
        Ok(Self { lines: TextLines::open(path)?, is_empty: true, factors })
    }

    /// The next line that is not blank, and its number, counted from 1.
    pub(crate) fn next_line(&mut self) -> Result<Option<(u64, String)>, CliError> {
        let line = self.lines.next_filled()?;
        if line.is_none() && self.is_empty {
            return Err(self.lines.unfit(format!("holds no poses; {POSE_LINE}, as `poses` makes them")));
        }
        self.is_empty = false;
        Ok(line)
    }

    /// The poses on a line of this number and text.
    pub(crate) fn poses(&self, number: u64, text: &str, scans: [&Scan; 2]) -> Result<[Pose; 2], CliError> {
        let line: PoseLine = serde_json::from_str(text).map_err(|e| {
            let message = e.to_string();
            let what = message.split(" at line ").next().unwrap_or_default();
            self.lines.fault_on(number, format!("column {}: {what}; {POSE_LINE}", e.column()))
        })?;
        let pose = |name: &str, numbers: &[f64], side: usize| {
            pose(numbers, self.factors[side], scans[side])
                .map_err(|what| self.lines.fault_on(number, format!("`{name}`{what}")))
        };
        Ok([pose("a", &line.a, 0)?, pose("b", &line.b, 1)?])
    }
}

fn pose(numbers: &[f64], factor: f64, scan: &Scan) -> Result<Pose, String> {
    let matrix: Matrix = numbers.try_into().map_err(|_wrong_count| {
        format!(" has {} numbers where 16 belong, a row-major 4×4 matrix", numbers.len())
    })?;
    of_scan(&scaled(matrix, factor), scan).map_err(|refused| format!(": {refused}"))
}
