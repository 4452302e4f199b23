//! Poses from the command line and from files.

use std::path::{Path, PathBuf};

use clap::Args;
use nearmiss::{Aabb, Pose, PoseError, Scan};

use crate::console::{Console, Results};
use crate::error::CliError;
use crate::input::{Opening, TextLines, pieces};
use crate::matrix::{Matrix, PoseRefused};
use crate::pose_text::{self, FILE_FORMS, FORMS, PoseFormat};
use crate::progress::{Counter, Told, Watch};
use crate::units::{SizeCheck, UnitName, WorldUnit, scaled};

/// Two scans, and where they are.
#[derive(Debug, Clone, Args)]
pub struct PairArgs {
    /// First scan: prepared (.nm), or a point cloud or mesh, which is prepared on the fly
    pub a: PathBuf,
    /// Second scan
    pub b: PathBuf,
    /// Pose of A: `x y z qx qy qz qw`, or a 4×4 matrix
    ///
    /// The pose maps the object to the world. Give, as one argument, 7 numbers (a position and a unit
    /// quaternion), 12 (the first three rows of a matrix) or 16 (a row-major 4×4 matrix, uniform scale
    /// allowed); or give a file that holds them.
    #[arg(long, value_name = "M", allow_hyphen_values = true)]
    pub pose_a: Option<String>,
    /// Pose of b, in the same form
    #[arg(long, value_name = "M", allow_hyphen_values = true)]
    pub pose_b: Option<String>,
    /// Unit of A; if given, the world is in metres
    ///
    /// With --units-a or --units-b, scans are scaled to metres before their poses are applied.
    /// A scan without a unit is taken to be in metres.
    #[arg(long, value_enum, value_name = "U")]
    pub units_a: Option<UnitName>,
    /// Unit of B; if given, the world is in metres
    #[arg(long, value_enum, value_name = "U")]
    pub units_b: Option<UnitName>,
    /// Check prepared scans in full before use: checksums and all values
    #[arg(long, help_heading = "Advanced", hide_short_help = true)]
    pub verify: bool,
}

impl PairArgs {
    /// Returns the paths of both scans.
    pub(crate) fn inputs(&self) -> [&Path; 2] {
        [&self.a, &self.b]
    }

    /// Returns the settings for opening the scans.
    pub(crate) fn opening(&self, threads: Option<usize>, console: Console) -> Opening {
        Opening { threads: threads.unwrap_or(0), verify: self.verify, console }
    }

    /// Returns the matrices of both poses, with the units applied.
    pub(crate) fn matrices(&self) -> Result<[Matrix; 2], CliError> {
        let [a, b] = [("--pose-a", &self.pose_a), ("--pose-b", &self.pose_b)]
            .map(|(name, given)| from_option(name, given.as_deref()));
        let [by_a, by_b] = self.factors().unwrap_or([1.0; 2]);
        Ok([scaled(a?, by_a), scaled(b?, by_b)])
    }

    /// Opens the file of poses, if there is one.
    pub(crate) fn pose_file(&self, path: Option<&PathBuf>) -> Result<Option<PoseFile>, CliError> {
        path.map(|path| self.path_file(path)).transpose()
    }

    /// Opens a file of poses.
    pub(crate) fn path_file(&self, path: &Path) -> Result<PoseFile, CliError> {
        let given = |option: &str, given: &Option<String>| {
            given.as_ref().map(|given| from_option(option, Some(given))).transpose()
        };
        let fixed = [given("--pose-a", &self.pose_a)?, given("--pose-b", &self.pose_b)?];
        PoseFile::open(path, fixed, self.factors().unwrap_or([1.0; 2]))
    }

    /// Returns a check that warns about units once if the scans differ too much in size.
    pub(crate) fn size_check(&self, console: Console) -> SizeCheck {
        SizeCheck::new(console, self.factors())
    }

    /// Returns the unit of lengths in the world.
    pub(crate) fn world_unit(&self) -> WorldUnit {
        if self.factors().is_some() { WorldUnit::Metres } else { WorldUnit::OfFile }
    }

    /// Returns the units in metres if at least one is given.
    fn factors(&self) -> Option<[f64; 2]> {
        let units = [self.units_a, self.units_b];
        units.iter().any(Option::is_some).then(|| units.map(|unit| unit.map_or(1.0, UnitName::metres)))
    }
}

/// An object that poses place in the world.
pub(crate) trait Posable {
    /// Returns the bounds in the frame of the input.
    fn bounds(&self) -> &Aabb;

    /// Returns the length by which making a matrix a pose may move the bounds, in the units of the
    /// object, and that length in words.
    fn tolerance(&self) -> (f64, &'static str);
}

impl Posable for Scan {
    fn bounds(&self) -> &Aabb {
        nearmiss::PointHierarchy::bounds(self)
    }

    fn tolerance(&self) -> (f64, &'static str) {
        (0.1 * self.sampling_radius(), "a tenth of the sampling radius")
    }
}

/// Returns the poses nearest to the matrices of `--pose-a` and `--pose-b`.
pub(crate) fn of_options<T: Posable + ?Sized>(
    matrices: &[Matrix; 2],
    objects: [&T; 2],
) -> Result<[Pose; 2], CliError> {
    let placed = |name: &str, side: usize| {
        of_object(&matrices[side], objects[side])
            .map_err(|refused| CliError::Pose { place: name.into(), refused })
    };
    Ok([placed("--pose-a", 0)?, placed("--pose-b", 1)?])
}

/// Returns the pose that an option gives as [`from_option`] does, of an object that is scaled from its unit,
/// if that is named, to metres before.
pub(crate) fn in_metres(name: &str, given: Option<&str>, unit: Option<UnitName>) -> Result<Matrix, CliError> {
    Ok(scaled(from_option(name, given)?, unit.map_or(1.0, UnitName::metres)))
}

/// Returns the pose that an option gives, as numbers or as a file that holds them; the identity if the option
/// is absent.
pub(crate) fn from_option(option: &str, given: Option<&str>) -> Result<Matrix, CliError> {
    let Some(given) = given else { return Ok(Pose::IDENTITY.to_row_major()) };
    let what = match pose_text::parse(given) {
        Ok(matrix) => return Ok(matrix),
        Err(what) => what,
    };
    let path = Path::new(given);
    if path.is_file() {
        let text = std::fs::read_to_string(path).map_err(CliError::reading(path))?;
        return pose_text::parse(&text)
            .map_err(|what| CliError::UnsuitableFile { path: path.to_owned(), what });
    }
    if pieces(given).nth(1).is_some() {
        return Err(CliError::Usage(format!("{option}: {what}")));
    }
    let got = match given.parse::<f64>() {
        Ok(_) => "got 1 number".to_owned(),
        Err(_) => format!("found no file `{given}`"),
    };
    Err(CliError::Usage(format!("{option}: expected {FORMS}, or a file that holds them; {got}")))
}

/// Returns the pose nearest to `matrix`. Fails if it moves the object's bounds by more than its
/// [tolerance](Posable::tolerance).
pub(crate) fn of_object<T: Posable + ?Sized>(matrix: &Matrix, object: &T) -> Result<Pose, PoseRefused> {
    let row = |i: usize| [matrix[4 * i], matrix[4 * i + 1], matrix[4 * i + 2]];
    let [x, y, z] = [row(0), row(1), row(2)];
    let determinant = x[0] * (y[1] * z[2] - y[2] * z[1]) - x[1] * (y[0] * z[2] - y[2] * z[0])
        + x[2] * (y[0] * z[1] - y[1] * z[0]);
    // In world units, so the tolerance is scaled as the object is.
    let (tolerance, allowed) = object.tolerance();
    let tolerance = tolerance * determinant.abs().cbrt();
    Pose::from_row_major(matrix, object.bounds(), tolerance).map_err(|cause| {
        let last_column = [3, 7, 11, 15].map(|i| matrix[i]);
        let is_transposed = cause == PoseError::NotAffine && last_column == [0.0, 0.0, 0.0, 1.0];
        PoseRefused { cause, is_transposed, allowed }
    })
}

/// The poses of a query, from a line of a file.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Posed {
    /// The poses of a and b.
    pub(crate) poses: [Pose; 2],
    /// The time of the line, if it has one.
    pub(crate) time: Option<f64>,
}

/// A file with the poses of one query on each line. Lines are read in order, but can be parsed on
/// many threads.
#[derive(Debug)]
pub(crate) struct PoseFile {
    lines: TextLines,
    /// The format, once the first line has been read.
    format: Option<PoseFormat>,
    /// `true` until a line with poses has been read.
    is_empty: bool,
    /// The poses given on the command line, for scans whose pose lines leave out.
    fixed: [Option<Matrix>; 2],
    /// The units of both scans in metres.
    factors: [f64; 2],
    progress: PoseProgress,
}

/// The progress of answers to a file of poses.
#[derive(Debug, Clone, Default)]
struct PoseProgress {
    /// The lines and the bytes that were read so far.
    lines: Counter,
    bytes: Counter,
    /// The lines that were answered.
    answered: Counter,
}

impl PoseProgress {
    /// Returns the progress in a file of `length` bytes, if that is known. The number of all lines
    /// is estimated from the length of the lines so far.
    fn told(&self, length: Option<u64>) -> Told {
        let count = self.answered.get();
        #[expect(clippy::cast_precision_loss, reason = "a rough figure")]
        let share = length.map(|length| {
            let read = self.bytes.get().min(length) as f64 / length as f64;
            read * count as f64 / self.lines.get().max(1) as f64
        });
        Told { share, count, may_end_early: false }
    }
}

impl PoseFile {
    /// Opens a file of poses. `fixed` are the poses of things that lines leave out, `factors` the units.
    pub(crate) fn open(path: &Path, fixed: [Option<Matrix>; 2], factors: [f64; 2]) -> Result<Self, CliError> {
        let (lines, progress) = (TextLines::open(path)?, PoseProgress::default());
        Ok(Self { lines, format: None, is_empty: true, fixed, factors, progress })
    }

    /// Shows the progress of answers until the result is dropped. `results` are printed above it.
    pub(crate) fn watch(&self, console: Console, results: &mut Results) -> Watch {
        let (progress, length) = (self.progress.clone(), self.lines.length().filter(|&length| length > 0));
        let watch = console.watch("answering", "poses", move || progress.told(length));
        results.hide(watch.bar());
        watch
    }

    /// Returns an error about the poses on line `number`.
    pub(crate) fn fault_on(&self, number: u64, what: impl Into<String>) -> CliError {
        self.lines.fault_on(number, what)
    }

    /// Counts an answered line.
    pub(crate) fn answered(&self) {
        self.progress.answered.add(1);
    }

    /// Returns the next line with poses, and its number, counted from 1.
    pub(crate) fn next_line(&mut self) -> Result<Option<(u64, String)>, CliError> {
        loop {
            let Some((number, text)) = self.lines.next_filled()? else {
                if self.is_empty {
                    return Err(self.lines.unsuitable(format!("expected poses, got none; {FILE_FORMS}")));
                }
                return Ok(None);
            };
            if self.format.is_none() {
                let format = PoseFormat::of(&text).map_err(|what| self.lines.fault_on(number, what))?;
                let has_header = format.has_header();
                self.format = Some(format);
                if has_header {
                    continue;
                }
            }
            self.is_empty = false;
            self.progress.lines.add(1);
            self.progress.bytes.set(self.lines.bytes_read());
            return Ok(Some((number, text)));
        }
    }

    /// Parses the poses on line `number`, whose text is `text`.
    pub(crate) fn poses<T: Posable + ?Sized>(
        &self,
        number: u64,
        text: &str,
        objects: [&T; 2],
    ) -> Result<Posed, CliError> {
        let format = self.format.as_ref().unwrap_or(&PoseFormat::Json);
        let row = format.read(text).map_err(|what| self.lines.fault_on(number, what))?;
        let pose = |side: usize| {
            let name = ["a", "b"][side];
            let matrix = match (row.matrices[side], self.fixed[side]) {
                (Some(_), Some(_)) => {
                    return Err(format!(
                        "expected one pose of {name}, got one here and one in --pose-{name}; leave one out"
                    ));
                }
                (Some(matrix), None) => matrix,
                (None, Some(fixed)) => fixed,
                (None, None) => Pose::IDENTITY.to_row_major(),
            };
            of_object(&scaled(matrix, self.factors[side]), objects[side])
                .map_err(|refused| format!("`{name}`: {refused}"))
        };
        let placed = pose(0).and_then(|a| Ok([a, pose(1)?]));
        let poses = placed.map_err(|what| self.lines.fault_on(number, what))?;
        Ok(Posed { poses, time: row.time })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_number_of_poses_is_estimated_from_the_length_of_lines() {
        let progress = PoseProgress::default();
        assert_eq!(progress.told(Some(1000)).share, Some(0.0));
        progress.lines.add(20);
        progress.bytes.set(200);
        progress.answered.add(5);
        let told = progress.told(Some(1000));
        assert_eq!((told.share, told.count), (Some(0.05), 5), "5 of about 100");
        assert_eq!(progress.told(None).share, None, "standard input");
    }
}
