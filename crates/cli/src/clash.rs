//! `clash`: lists every place where two scans meet or come nearer than a clearance.

mod html;
mod list;
mod pictures;
mod table;

use std::path::{Path, PathBuf};

use clap::Args;
use nearmiss::store::Progress;
use nearmiss::{Budget, ClashOptions, ClashPlan, Pair, Scan, Scratch};

use crate::bodies::Views;
use crate::console::{Console, Results, micros_since, now};
use crate::contacts::{SHOWN, check_outputs};
use crate::error::CliError;
use crate::eval::KernelName;
use crate::meaning::MeaningArgs;
use crate::output;
use crate::parse::parse_radius;
use crate::penetration::{SolidName, interiors};
use crate::posing::{self, PairArgs};
use crate::preprocess::parse_threads;
use list::List;
use table::Summary;

/// Options of `clash`.
#[derive(Debug, Clone, Args)]
pub struct ClashArgs {
    /// The scans and their poses
    #[command(flatten)]
    pub pair: PairArgs,
    /// Metric of the kernel that defines the surfaces; by default the one the scans were prepared for
    ///
    /// Raw inputs are prepared for this kernel, or for straight distances without the option.
    #[arg(long, value_enum, conflicts_with = "thickened")]
    pub kernel: Option<KernelName>,
    /// The meaning of the scans
    #[command(flatten)]
    pub meaning: MeaningArgs,
    /// List clearance clashes as well: places that come nearer than this, in world units
    #[arg(long, value_name = "D", allow_hyphen_values = true, value_parser = parse_radius, default_value = "0")]
    pub clearance: f64,
    /// Put contacts into one clash if they are at most this far apart, in world units
    ///
    /// The default is four times the larger sampling radius.
    #[arg(long, value_name = "LEN", allow_hyphen_values = true, value_parser = parse_radius)]
    pub link: Option<f64>,
    /// Measure how deep each hard clash is: how far B must move so that the scans do not meet there
    ///
    /// This takes a few milliseconds for each clash, or seconds for large ones. Name scans with a closed
    /// surface by --solid.
    #[arg(long)]
    pub depth: bool,
    /// Scans whose closed surface encloses a solid, for --depth
    ///
    /// A body inside a solid overlaps it. A scan that is not solid is a surface, such as a room: the way out
    /// may lead to either side of it.
    #[arg(long, value_enum, value_name = "WHICH", requires = "depth", conflicts_with = "thickened")]
    pub solid: Option<SolidName>,
    /// Write the list as a table for spreadsheets, one line for each clash
    #[arg(long, value_name = "OUT.csv")]
    pub csv: Option<PathBuf>,
    /// Write the list as one HTML file, with pictures
    #[arg(long, value_name = "OUT.html")]
    pub html: Option<PathBuf>,
    /// Largest number of clashes that get a close-up on the page
    #[arg(long, value_name = "N", requires = "html", default_value_t = 50)]
    pub pictures: usize,
    /// Threads to prepare raw inputs; 0 for all cores
    #[arg(long, value_name = "N", value_parser = parse_threads)]
    pub threads: Option<usize>,
    /// Print lines of JSON instead of a table: one for the whole list, then one for each clash
    #[arg(long)]
    pub json: bool,
    /// Show no progress
    #[arg(long)]
    pub quiet: bool,
}

pub(crate) fn run(args: &ClashArgs) -> Result<(), CliError> {
    let console = Console::new(args.quiet);
    let inputs = args.pair.inputs();
    let outputs: Vec<&Path> = args.csv.iter().chain(&args.html).map(PathBuf::as_path).collect();
    check_outputs(&outputs, &inputs)?;
    let matrices = args.pair.matrices()?;
    let [a, b] = open(args, console)?;
    let plan = ClashPlan::new(&options(args, &a), &a, &b)?;
    let [pose_a, pose_b] = posing::of_options(&matrices, [&a, &b])?;
    let [a, b] = [a.at(&pose_a), b.at(&pose_b)];
    args.pair.size_check(console).compare([&a, &b]);

    let start = now();
    let progress = Progress::default();
    let leaves = a.scan().topology().leaves() + b.scan().topology().leaves();
    let bar = console.watch_share("looking for clashes", "leaves", &progress, leaves);
    let found =
        Pair::new(a, b).clashes_watched(&plan, &mut Scratch::default(), &mut |share| progress.reach(share));
    drop(bar);
    let micros = micros_since(start);

    let of_points = args.meaning.thickened.is_some();
    let list = List { inputs, views: [&a, &b], of_points, plan: &plan, found: &found };
    if let Some(path) = &args.csv {
        output::replace_plain(path, |out| table::write_csv(&list, out))?;
    }
    if let Some(path) = &args.html {
        let pictured = found.clashes.len().min(args.pictures);
        let bar = console.steps(format_args!("painting {}", path.display()), pictured as u64 + 1);
        let pictures = pictures::paint(&list, pictured, &bar);
        output::replace_plain(path, |out| html::write(&list, &pictures, out))?;
        drop(bar);
    }
    tell(&list, args.json, micros)
}

/// Returns the options of the list. `a` is the first scan.
pub(crate) fn options(args: &ClashArgs, a: &Scan) -> ClashOptions {
    let mut options =
        ClashOptions::default().with_semantics(args.meaning.semantics(a)).with_clearance(args.clearance);
    options.link = args.link;
    options.depths = args.depth.then(|| interiors(args.solid));
    options
}

/// Opens both scans. The kernel does not matter for balls about points, so scans prepared for any
/// kernel are accepted for these.
fn open(args: &ClashArgs, console: Console) -> Result<[Scan; 2], CliError> {
    let opening = args.pair.opening(args.threads, console);
    if args.meaning.thickened.is_some() {
        return opening.open_points(args.pair.inputs());
    }
    opening.open_both(args.kernel.map(KernelName::metric), args.pair.inputs())
}

/// Prints the list on standard output.
fn tell(list: &List<'_>, json: bool, micros: f64) -> Result<(), CliError> {
    let mut results = Results::new();
    if json {
        results.json(&Summary::new(list, micros))?;
        list.reports().try_for_each(|clash| results.json(&clash))?;
        return results.flush();
    }
    for line in table::lines(list, SHOWN) {
        results.line(line)?;
    }
    let distance = if list.found.clashes.is_empty() {
        Views::Scans(list.views.map(|view| *view)).beside(list.plan.options().semantics, &Budget::UNLIMITED)
    } else {
        None
    };
    results.line(table::sentence(list, distance.as_ref()))?;
    results.flush()
}
