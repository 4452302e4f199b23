//! `preprocess` for points that do not fit into memory. Intermediate results are kept in files
//! beside the output, and an interrupted run is resumed.

use std::cell::Cell;

use nearmiss::io::{Pieces, PointPieces, Points, read_in_pieces};
use nearmiss::{Aabb, GatheredPoints, Intake, IntakeError, PointGatherer, Scan, Workspace};

use super::args::{PreprocessArgs, options};
use super::outcome::{Seconds, save, tell};
use crate::console::{Console, now};
use crate::error::CliError;
use crate::filters::{ClassList, Filtered};
use crate::progress::short_name;
use crate::report::ScanReport;
use crate::{input, output};

/// The number of bytes of a file that are read at a time.
const BLOCK: usize = 1 << 20;

/// Prepares `points` points within `memory` bytes.
pub(super) fn run(args: &PreprocessArgs, memory: u64, points: u64, console: Console) -> Result<(), CliError> {
    let unsuitable = |what: String| CliError::UnsuitableFile { path: args.input.clone(), what };
    let limit = input::limit_reading(&args.input, args.format.0);
    let pieces = match read_in_pieces(&args.input, args.format.0, BLOCK)? {
        Pieces::Points(pieces) => pieces,
        Pieces::Mesh { .. } => {
            let what = "expected points, got a mesh, which cannot be prepared on disk; raise --memory".into();
            return Err(unsuitable(what));
        }
    };
    let folder = output::work_folder(&args.output);
    let work = Workspace::in_folder(&folder, &key(args)?, memory)?;
    let place = folder.display();
    let start = now();
    let (gathered, filtered) = match GatheredPoints::kept(&work)? {
        Some(kept) => {
            console.note(format_args!("resuming an interrupted run in {place}"));
            (kept, Filtered::default())
        }
        None => {
            console.note(format_args!("working on disk in {place}, which is removed at the end"));
            match gather(args, &pieces, &work, points, console) {
                Ok(gathered) => gathered,
                Err(cause) => {
                    work.remove();
                    return Err(cause);
                }
            }
        }
    };
    let read = start.elapsed().as_secs_f64();
    drop(limit);

    let start = now();
    let points = gathered.points();
    let name = short_name(&args.input);
    let bar = console.watch_points(format_args!("preparing {name}"), work.progress(), points.len());
    let scan = Scan::build_in(&points, &options(args), &work)
        .map_err(|cause| CliError::Build { path: args.input.clone(), cause })?;
    drop(bar);
    input::check_step(&args.input, &scan);
    let hierarchy = start.elapsed().as_secs_f64();

    let (bytes, write) = save(args, &scan, console)?;
    let report = ScanReport::new(&scan, bytes).with_filtered(filtered);
    let seconds = Seconds { read, hierarchy, graph: 0.0, write };
    tell(args, &scan, report, seconds)?;
    drop((scan, gathered));
    work.remove();
    Ok(())
}

/// Returns the key of the work in a folder: the identity of the input, and the options that change
/// the result.
fn key(args: &PreprocessArgs) -> Result<String, CliError> {
    let options = options(args).with_threads(0);
    let (crop, class, format) = (args.filters.crop, &args.filters.class, args.format.0);
    Ok(format!("{} {format:?} {options:?} {crop:?} {class:?}", input::identity(&args.input)?))
}

/// Reads the points twice: first to find their frame, then to gather them.
fn gather(
    args: &PreprocessArgs,
    pieces: &PointPieces,
    work: &Workspace,
    expected: u64,
    console: Console,
) -> Result<(GatheredPoints, Filtered), CliError> {
    let unsuitable = |cause: IntakeError| match cause {
        IntakeError::Work(cause) => CliError::Work(cause),
        other => CliError::UnsuitableFile { path: args.input.clone(), what: other.to_string() },
    };
    let name = args.input.display();
    let bar = console.rate(format_args!("measuring {name}"), expected);
    let mut intake = Intake::default();
    pieces.each(|points| {
        points.positions.iter().for_each(|p| intake.add(*p));
        bar.advance(points.len() as u64);
    })?;
    drop(bar);
    let bar = console.rate(format_args!("reading {name}"), intake.given() as u64);
    let mut gatherer = PointGatherer::new(work, &intake).map_err(unsuitable)?;
    let crop = args.filters.crop.map(|crop| Aabb { min: crop.min, max: crop.max });
    let (cropped, of_other_class) = (Cell::new(0), Cell::new(0));
    let mut without_classes = false;
    pieces.each(|points| {
        let classes = wanted_classes(args, points, &mut without_classes);
        gatherer.add(&points.positions, |i, place| {
            let is_inside = crop.is_none_or(|crop| crop.contains(place));
            let is_wanted = classes.is_none_or(|(classes, wanted)| wanted.contains(&classes[i]));
            let left_out = if is_inside { &of_other_class } else { &cropped };
            left_out.set(left_out.get() + usize::from(!(is_inside && is_wanted)));
            is_inside && is_wanted
        });
        bar.advance(points.len() as u64);
    })?;
    drop(bar);
    if without_classes {
        let what = "expected points with classes for --class, got points without; leave it out".into();
        return Err(CliError::UnsuitableFile { path: args.input.clone(), what });
    }
    let bar = console.spinner("removing duplicate points");
    let gathered = gatherer.finish().map_err(unsuitable)?;
    drop(bar);
    let of_class = args.filters.class.as_ref().map(|_| of_other_class.get());
    let filtered = Filtered::by_point(crop.map(|_| cropped.get()), of_class);
    Ok((gathered, filtered))
}

/// Returns the classes of the points and those to keep, or `None` without `--class`. Sets `without`
/// if points have no classes.
fn wanted_classes<'a>(
    args: &'a PreprocessArgs,
    points: &'a Points,
    without: &mut bool,
) -> Option<(&'a [u8], &'a [u8])> {
    let ClassList(wanted) = args.filters.class.as_ref()?;
    *without |= points.classes.len() != points.len();
    (!*without).then_some((&*points.classes, &**wanted))
}
