//! `cargo xtask field`: the picture of Klein & Zachmann 2004, Fig. 6, and its content in numbers.
//!
//! The picture shows f over a slice of a noisy scan, with the covariance about x and about a(x). A
//! table counts how often the normal changes sides near the surface.

mod flips;
mod paint;
mod place;
mod roughen;
mod signs;
mod slice;

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use nearmiss::geometry::nalgebra::Vector3;
use nearmiss::{BuildOptions, Check, PointCloud, Scan};
use nearmiss_cli::clap::{self, Parser};
use nearmiss_testdata::dragon::{Dragon, dragon_path};
use nearmiss_testdata::shapes::{Form, Sampling, building, plates, step, torus};

use crate::repository::Outcome;
use place::Centre;
use roughen::roughened;
use slice::Slice;

/// Noise of the table, in spacings.
const NOISES: [f64; 5] = [0.0, 0.05, 0.1, 0.15, 0.2];

/// Paint f over a slice of a noisy scan, as Klein & Zachmann 2004, Fig. 6; or count where its normal flips
#[derive(Debug, Parser)]
#[command(bin_name = "cargo xtask field")]
struct Args {
    /// Preprocessed scans, or raw inputs. Without any, the table is about the scans of the
    /// repository
    scans: Vec<PathBuf>,
    /// File of the picture
    #[arg(short, long, value_name = "OUT.png", required_unless_present = "table")]
    output: Option<PathBuf>,
    /// Count flips near the surface instead, for noise of 0 to 20 % of the spacing
    #[arg(long, conflicts_with_all = ["output", "noise", "at", "normal", "width"])]
    table: bool,
    /// Standard deviation of the noise, in spacings
    #[arg(long, default_value_t = 0.1)]
    noise: f64,
    /// Seed of the noise, and of the places of the table
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Middle of the slice; by default where the surface turns most
    #[arg(long, value_name = "X,Y,Z", value_parser = vector, requires = "normal", allow_hyphen_values = true)]
    at: Option<Vector3<f64>>,
    /// Normal of the slice, towards the viewer
    #[arg(long, value_name = "X,Y,Z", value_parser = vector, requires = "at", allow_hyphen_values = true)]
    normal: Option<Vector3<f64>>,
    /// Side of the slice, in sampling radii
    #[arg(long, default_value_t = 24.0)]
    width: f64,
    /// Number of pairs of places for each line of the table
    #[arg(long, default_value_t = 500_000)]
    pairs: u64,
}

/// Paints or counts according to `args`, whose first word is the command's name.
pub(crate) fn run(args: impl IntoIterator<Item = OsString>) -> Outcome {
    let args = Args::parse_from(args);
    if args.table {
        return table(&args);
    }
    let ([scan], Some(output)) = (args.scans.as_slice(), &args.output) else {
        return Err("expected one scan and -o OUT.png for a picture; give --table for several scans".into());
    };
    if !(args.width > 0.0 && args.width.is_finite() && args.noise >= 0.0 && args.noise.is_finite()) {
        return Err("expected a finite --width above 0 and a finite --noise of at least 0".into());
    }
    paint(&args, scan, output)
}

fn vector(text: &str) -> Result<Vector3<f64>, String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|t| t.trim().parse::<f64>()).collect();
    match numbers.as_deref() {
        Ok(&[x, y, z]) if [x, y, z].iter().all(|c| c.is_finite()) => Ok(Vector3::new(x, y, z)),
        _ => Err("expected three numbers separated by commas".into()),
    }
}

fn open(path: &Path) -> Outcome<Scan> {
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("nm")) {
        return Ok(Scan::open(path, Check::Full).map_err(|e| format!("{}: {e}", path.display()))?);
    }
    Ok(Scan::build(&nearmiss::io::read(path, None)?.cloud, &BuildOptions::default())?)
}

fn name(path: &Path) -> String {
    path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default()
}

fn paint(args: &Args, path: &Path, output: &Path) -> Outcome {
    let clean = open(path)?;
    let unit = clean.frame().scale;
    let half = 0.5 * args.width * clean.sampling_radius() / unit;
    let slice = match (args.at, args.normal) {
        (Some(at), Some(normal)) => {
            let middle = Vector3::from(clean.frame().to_local(at.into()).map(f64::from));
            let normal = normal.try_normalize(0.0).ok_or("expected a normal that is not zero")?;
            Slice::facing(middle, normal, half)
        }
        _ => Slice::telling(&clean, half),
    };
    let world = |v: Vector3<f64>| Vector3::from(clean.frame().origin) + v * unit;
    let ([x, y, z], [u, v, w]): ([f64; 3], [f64; 3]) = (world(slice.middle).into(), slice.axes[2].into());
    println!("--at {x:.6},{y:.6},{z:.6} --normal {u:.6},{v:.6},{w:.6}");
    let rough = roughened(&clean, args.noise, args.seed)?;
    // Noise may move the origin of the stored frame.
    let slice = Slice { middle: slice.middle - Vector3::from(rough.frame().origin), ..slice };
    let fields = Centre::BOTH.map(|centre| {
        let field = slice.evaluate(&rough, centre, paint::SIDE);
        println!(
            "covariance about {}: {} flips between neighbouring pixels",
            centre.name(),
            field.flips.len()
        );
        field
    });
    let subject = paint::Subject { name: name(path), noise: args.noise, unit };
    nearmiss_cli::save_picture(&paint::paint(&rough, &slice, &fields, &subject), output)?;
    Ok(())
}

/// Prints a line for each object and noise as soon as it is counted.
fn table(args: &Args) -> Outcome {
    println!(
        "Flips of n per million evaluations of f within h of the surface; pairs of places 0.1 h apart, {} a line.\n",
        args.pairs
    );
    println!(
        "| object | points | noise, % | about x | about a(x) | status ok, % | ok: about x | ok: about a(x) |"
    );
    println!("|---|--:|--:|--:|--:|--:|--:|--:|");
    for (name, clean) in subjects(&args.scans)? {
        for noise in NOISES {
            let rough = roughened(&clean, noise, args.seed)?;
            let tally = flips::count(&clean, &rough, args.pairs, args.seed);
            let ([x, a], [trusted_x, trusted_a]) = (tally.rates(), tally.trusted_rates());
            let share = 100.0 * tally.trusted_share();
            println!(
                "| {name} | {} | {:.0} | {x:.0} | {a:.0} | {share:.0} | {trusted_x:.0} | {trusted_a:.1} |",
                clean.len(),
                100.0 * noise
            );
        }
    }
    Ok(())
}

/// Returns the scans of the table with their names.
fn subjects(paths: &[PathBuf]) -> Outcome<Vec<(String, Scan)>> {
    if !paths.is_empty() {
        return paths.iter().map(|path| Ok((name(path), open(path)?))).collect();
    }
    let generated = |form: Form, points: u32| -> Outcome<(String, Scan)> {
        let spacing = form.spacing_for(points);
        let name = form.name.to_owned();
        let cloud = PointCloud::from_positions(&form.sample(Sampling::clean(spacing)).points)?;
        Ok((name, Scan::build(&cloud, &BuildOptions::default())?))
    };
    let dragon = dragon_path(Dragon::Points23k);
    Ok(vec![
        (name(&dragon), open(&dragon)?),
        generated(torus(1.0, 0.4), 20_000)?,
        generated(step(1.0, 0.5, 1.2), 20_000)?,
        generated(building(), 20_000)?,
        generated(plates(1.0, 1.0, 0.03), 20_000)?,
    ])
}
