//! `convert`: converts points from one file format to another, piece by piece.

mod spill;
mod voxel;

use std::path::PathBuf;

use clap::Args;
use nearmiss::Aabb;
use nearmiss::io::{
    Glance, OutputFormat, Pieces, PointPieces, PointWriter, Points, ScaleOffset, Survey, glance,
    read_in_pieces,
};
use nearmiss::store::replace_file;
use serde::Serialize;

use crate::console::{self, Bar, Console, Results, now};
use crate::digits::{grouped, grouped_count};
use crate::error::CliError;
use crate::filters::{ClassList, CropBox, parse_classes, parse_crop};
use crate::parse::parse_length;
use crate::preprocess::{FormatChoice, about_formats, parse_format};
use crate::units::UnitName;
use crate::{input, output};
use spill::Spill;

/// Options of `convert`.
#[derive(Debug, Clone, Args)]
pub struct ConvertArgs {
    /// Point cloud or mesh; of a mesh, only the vertices are converted
    pub input: PathBuf,
    /// File to write; its name gives the format: ply, pcd, las, laz, xyz, txt, csv or npy
    pub output: PathBuf,
    /// Keep the points within a box, given by its lower and upper corner
    ///
    /// Coordinates are in the units of the input. Steps are applied in the order --crop,
    /// --class, --voxel, --units.
    #[arg(long, value_name = "X0,Y0,Z0,X1,Y1,Z1", allow_hyphen_values = true, value_parser = parse_crop)]
    pub crop: Option<CropBox>,
    /// Keep the points of these LAS classes; 2 is ground, 6 is buildings
    #[arg(long, value_name = "C,C,...", value_parser = parse_classes)]
    pub class: Option<ClassList>,
    /// Read a COPC file only down to the level with this distance between points
    #[arg(long, value_name = "R", allow_hyphen_values = true, value_parser = parse_length)]
    pub resolution: Option<f64>,
    /// Keep one point for each cube with edges of this length
    ///
    /// The point nearest to the mean of the cube's points is kept. Points are sorted on disk,
    /// in the folder of the output.
    #[arg(long, value_name = "S", allow_hyphen_values = true, value_parser = parse_length)]
    pub voxel: Option<f64>,
    /// Unit of the output
    #[arg(long, value_enum, value_name = "UNIT")]
    pub units: Option<UnitName>,
    /// Unit of the input
    #[arg(long, value_enum, value_name = "UNIT", default_value = "m", requires = "units")]
    pub from_units: UnitName,
    /// Format of the input; auto decides by content, then by name
    #[arg(long, default_value = "auto", value_parser = parse_format, long_help = about_formats())]
    pub format: FormatChoice,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
    /// Show no progress
    #[arg(long)]
    pub quiet: bool,
}

/// The number of bytes of a file that are read at a time.
const BLOCK: usize = 1 << 20;

/// The JSON output of `convert`.
#[derive(Debug, Serialize)]
struct Report {
    read: u64,
    written: u64,
    dropped: Dropped,
    bytes: u64,
    seconds: f64,
}

/// The points that are removed whatever the options are.
#[derive(Debug, Serialize)]
struct Dropped {
    not_finite: u64,
}

/// A source of points that can be read repeatedly.
enum Source {
    Pieces(PointPieces),
    Vertices(Points),
    Spilled(Spill),
}

/// The changes applied to points.
struct Steps<'a> {
    args: &'a ConvertArgs,
    factor: f64,
}

pub(crate) fn run(args: &ConvertArgs) -> Result<(), CliError> {
    let usage = |cause: String| CliError::Usage(format!("{}: {cause}", args.output.display()));
    let format = OutputFormat::of(&args.output).map_err(|unknown| usage(unknown.to_string()))?;
    output::check_apart(&args.output, &[&args.input])?;
    input::check_raw(&args.input)?;
    let console = Console::new(args.quiet);
    let start = now();
    let expected = glance(&args.input, args.format.0).map(|Glance { points, .. }| points);
    let factor = args.units.map_or(1.0, |unit| args.from_units.metres() / unit.metres());
    let steps = Steps { args, factor };
    let _limit = input::limit_reading(&args.input, args.format.0);
    let bar = progress(console, "reading", expected);
    let (source, found) = look(open(args)?, &steps, expected, &bar)?;
    drop(bar);
    let Found { read, not_finite, survey } = found;
    if survey.points() == 0 {
        let what = format!(
            "expected points to write, got none of its {}; widen --crop or --class, or check the input",
            grouped_count(read, "point")
        );
        return Err(CliError::UnsuitableFile { path: args.input.clone(), what });
    }
    let lost = format.loses(&survey);
    if !lost.is_empty() {
        console::warn(format_args!(
            "{}: written without {}, which this format cannot store",
            args.output.display(),
            lost.join(", ")
        ));
    }
    let bar = progress(console, "writing", Some(read));
    write(args, format, &survey, |take| {
        source.each(|points| {
            bar.advance(points.len() as u64);
            if let Source::Spilled(_) = source {
                return take(points);
            }
            let mut points = points.clone();
            steps.select(&mut points)?;
            steps.scale(&mut points);
            take(&points)
        })
    })?;
    drop(bar);
    let bytes = args.output.metadata().map_err(CliError::reading(&args.output))?.len();
    let seconds = start.elapsed().as_secs_f64();
    tell(args, &Report { read, written: survey.points(), dropped: Dropped { not_finite }, bytes, seconds })
}

/// Opens the input.
fn open(args: &ConvertArgs) -> Result<Source, CliError> {
    let (vertices, mesh) = match read_in_pieces(&args.input, args.format.0, BLOCK)? {
        Pieces::Points(points) => return part(args, points).map(Source::Pieces),
        Pieces::Mesh { vertices, mesh } => (vertices, mesh),
    };
    console::warn(format_args!(
        "{}: the output comes of the {} of this mesh, without points on its {}; use `sample` for points on the faces",
        args.input.display(),
        grouped_count(mesh.vertices().len() as u64, "corner"),
        grouped_count(mesh.triangles().len() as u64, "triangle"),
    ));
    Ok(Source::Vertices(vertices))
}

/// Restricts reading to the parts of the file that the options need.
fn part(args: &ConvertArgs, points: PointPieces) -> Result<PointPieces, CliError> {
    let points = match args.crop {
        Some(CropBox { min, max }) => points.near(Aabb { min, max }),
        None => points,
    };
    let Some(spacing) = args.resolution else { return Ok(points) };
    if points.has_levels() {
        return Ok(points.at_resolution(spacing));
    }
    let what =
        "expected a COPC file for --resolution, got a file that has no levels of detail; use `--voxel`"
            .into();
    Err(CliError::UnsuitableFile { path: args.input.clone(), what })
}

/// The results of the first pass over the points.
struct Found {
    read: u64,
    not_finite: u64,
    survey: Survey,
}

/// Makes the first pass over all points, and surveys the points that will be written.
fn look(
    source: Source,
    steps: &Steps<'_>,
    expected: Option<u64>,
    bar: &Bar,
) -> Result<(Source, Found), CliError> {
    let (mut read, mut not_finite) = (0, 0);
    let mut survey = Survey::default();
    let mut each = |points: &Points| -> Result<Points, CliError> {
        bar.advance(points.len() as u64);
        read += points.len() as u64;
        let mut points = points.clone();
        not_finite += steps.select(&mut points)?;
        Ok(points)
    };
    // A change of units changes the steps of the lattice.
    let lattice = source.lattice().filter(|_| !steps.changes_units());
    let source = match steps.args.voxel {
        None => {
            source.each(|points| {
                let mut points = each(points)?;
                steps.scale(&mut points);
                survey.add(&points);
                Ok(())
            })?;
            source
        }
        Some(size) => {
            let mut grid = voxel::Grid::new(size, expected, &steps.args.output)?;
            source.each(|points| grid.add(&each(points)?))?;
            Source::Spilled(grid.thin(|points| {
                steps.scale(points);
                survey.add(points);
            })?)
        }
    };
    Ok((source, Found { read, not_finite, survey: survey.with_lattice(lattice) }))
}

fn progress(console: Console, what: &str, points: Option<u64>) -> Bar {
    match points {
        Some(points) => console.rate(what, points),
        None => console.spinner(what),
    }
}

/// A function that takes points piece by piece.
type Take<'a> = &'a mut dyn FnMut(&Points) -> Result<(), CliError>;

fn write(
    args: &ConvertArgs,
    format: OutputFormat,
    survey: &Survey,
    each: impl FnOnce(Take<'_>) -> Result<(), CliError>,
) -> Result<(), CliError> {
    let path = &args.output;
    let refused = |error| match error {
        nearmiss::io::OutError::Io(cause) => CliError::writing(path)(cause),
        error => CliError::UnsuitableFile { path: path.clone(), what: error.to_string() },
    };
    replace_file(path, |file| {
        let file = file.try_clone().map_err(CliError::writing(path))?;
        let mut writer = PointWriter::new(file, format, survey).map_err(refused)?;
        each(&mut |points| writer.write(points).map_err(refused))?;
        writer.finish().map(drop).map_err(refused)
    })
}

fn tell(args: &ConvertArgs, report: &Report) -> Result<(), CliError> {
    let mut results = Results::new();
    if args.json {
        results.json(report)?;
    } else {
        let Report { read, written, dropped: Dropped { not_finite }, bytes, seconds } = *report;
        #[expect(clippy::cast_precision_loss, reason = "a rate to two digits")]
        let rate = read as f64 / seconds.max(1e-9) / 1e6;
        let dropped = if not_finite > 0 {
            format!(", {} dropped as not finite", grouped(not_finite))
        } else {
            String::new()
        };
        results.line(format_args!(
            "{} of {} written to {} ({} bytes{dropped}), {seconds:.2} s, {rate:.1} million points/s",
            grouped(written),
            grouped_count(read, "point"),
            args.output.display(),
            grouped(bytes),
        ))?;
    }
    results.flush()
}

impl Source {
    fn each(&self, mut take: impl FnMut(&Points) -> Result<(), CliError>) -> Result<(), CliError> {
        match self {
            Self::Pieces(pieces) => pieces.try_each(take),
            Self::Vertices(points) => take(points),
            Self::Spilled(spill) => spill.each(take),
        }
    }

    fn lattice(&self) -> Option<ScaleOffset> {
        match self {
            Self::Pieces(pieces) => pieces.lattice(),
            Self::Vertices(_) | Self::Spilled(_) => None,
        }
    }
}

impl Steps<'_> {
    /// Removes the points that do not pass the filters. Returns the number of points that are not
    /// finite.
    fn select(&self, points: &mut Points) -> Result<u64, CliError> {
        let Points { positions, classes, .. } = &*points;
        let wanted = self.args.class.as_ref().map(|ClassList(wanted)| wanted);
        if wanted.is_some() && classes.is_empty() && !positions.is_empty() {
            let what =
                "expected points with classes for --class, got points that have no classes; leave it out"
                    .into();
            return Err(CliError::UnsuitableFile { path: self.args.input.clone(), what });
        }
        let finite = |p: &[f64; 3]| p.iter().all(|x| x.is_finite());
        let not_finite = positions.iter().filter(|p| !finite(p)).count() as u64;
        let is_wanted = |i: usize| wanted.is_none_or(|wanted| wanted.contains(&classes[i]));
        let stays = |i: usize| finite(&positions[i]) && self.is_within(positions[i]) && is_wanted(i);
        let stays: Vec<bool> = (0..positions.len()).map(stays).collect();
        if stays.contains(&false) {
            points.retain(|i| stays[i]);
        }
        Ok(not_finite)
    }

    fn is_within(&self, p: [f64; 3]) -> bool {
        self.args.crop.is_none_or(|CropBox { min, max }| (0..3).all(|k| min[k] <= p[k] && p[k] <= max[k]))
    }

    fn changes_units(&self) -> bool {
        self.factor.to_bits() != 1.0_f64.to_bits()
    }

    fn scale(&self, points: &mut Points) {
        if self.changes_units() {
            points.positions.iter_mut().flatten().for_each(|x| *x *= self.factor);
        }
    }
}
