//! `preprocess`: prepares a scan and saves it.

mod args;
mod as_mesh;
mod on_disk;
mod outcome;

use nearmiss::Workspace;

use crate::console::{Console, now};
use crate::error::CliError;
use crate::estimate::{Forecast, Preparation};
use crate::eval::KernelName;
use crate::input;
use crate::output;
use crate::report::ScanReport;
use crate::threads::pool;
use outcome::{Seconds, save, tell};

pub(crate) use crate::parse::parse_threads;
pub use args::{FormatChoice, PathsName, PreprocessArgs, ScannerPosition, WeightName};
pub(crate) use args::{about_formats, graph_options, options, parse_format};

pub(crate) fn run(args: &PreprocessArgs) -> Result<(), CliError> {
    output::check_apart(&args.output, &[&args.input])?;
    let console = Console::new(args.quiet);
    if args.as_mesh {
        return as_mesh::run(args, console);
    }

    let forecast = forecast(args, console);
    let is_announced = match foresee(args, &forecast)? {
        Plan::InMemory { is_announced } => is_announced,
        Plan::OnDisk { memory, points } => return on_disk::run(args, memory, points, console),
    };
    // Removes the files of a killed run on disk.
    Workspace::clear(&output::work_folder(&args.output));
    let start = now();
    let mut model = input::read(&args.input, args.format.0, console)?;
    let filtered = args.filters.apply(&args.input, &mut model.cloud, args.threads, console)?;
    let read = start.elapsed().as_secs_f64();
    let points = model.cloud.len() as u64;
    forecast.check_preparing(points, Some(&model.cloud.bounds()))?;
    if !is_announced {
        forecast.announce(points);
    }

    let start = now();
    let scan = input::build(&args.input, &model, &options(args), console)?;
    let hierarchy = start.elapsed().as_secs_f64();

    let start = now();
    let scan = match graph_options(args) {
        Some((options, scanner)) => pool(args.threads)?.install(|| {
            let scan = input::with_graph(&args.input, scan, &model, (&options, scanner), console)?;
            match args.kernel {
                KernelName::Euclidean => Ok(scan),
                KernelName::Geodesic => input::with_geodesic_kernel(&args.input, scan, console),
            }
        })?,
        None => scan,
    };
    let graph = start.elapsed().as_secs_f64();

    let (bytes, write) = save(args, &scan, console)?;
    let report = ScanReport::new(&scan, bytes).with_filtered(filtered);
    tell(args, &scan, report, Seconds { read, hierarchy, graph, write })
}

/// Returns the forecast of memory and time.
fn forecast(args: &PreprocessArgs, console: Console) -> Forecast<'_> {
    let preparation = match (args.wants_graph(), args.wants_close_pairs(), args.kernel) {
        (false, ..) => Preparation::Hierarchy,
        (_, false, _) => Preparation::Graph,
        (_, _, KernelName::Euclidean) => Preparation::ClosePairs,
        (_, _, KernelName::Geodesic) => Preparation::Geodesic,
    };
    let (limit, threads) = (args.memory.limit(), args.threads);
    let filters_on_disk = args.filters.is_by_point();
    Forecast { path: &args.input, limit, threads, console, preparation, filters_on_disk }
}

/// The way in which points are prepared.
enum Plan {
    /// In memory. `is_announced` is `true` if a long run would have been announced by now.
    InMemory { is_announced: bool },
    /// On disk, because the points do not fit into `memory` bytes.
    OnDisk { memory: u64, points: u64 },
}

/// Chooses the plan from the header and the length of the input, before it is read. Fails if the
/// input does not fit into memory.
fn foresee(args: &PreprocessArgs, forecast: &Forecast<'_>) -> Result<Plan, CliError> {
    input::check_raw(&args.input)?;
    let unknown = Plan::InMemory { is_announced: false };
    let Some(seen) = nearmiss::io::glance(&args.input, args.format.0) else { return Ok(unknown) };
    if let Some(memory) = forecast.on_disk(seen.points) {
        return Ok(Plan::OnDisk { memory, points: seen.points });
    }
    forecast.check_reading(seen.points, seen.bytes)?;
    if !args.filters.is_empty() {
        // The number of points that are kept is not known before they are filtered.
        return Ok(unknown);
    }
    forecast.check_preparing(seen.points, seen.bounds.as_ref())?;
    forecast.announce(seen.points);
    Ok(Plan::InMemory { is_announced: true })
}
