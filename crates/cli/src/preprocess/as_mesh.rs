//! `preprocess --as-mesh`: prepares the triangles of a file.

use nearmiss::MeshBuildOptions;
use nearmiss::io::glance;
use nearmiss::mesh::CleanOptions;
use serde::Serialize;

use super::args::PreprocessArgs;
use crate::console::{Console, Results, now};
use crate::digits::count;
use crate::error::CliError;
use crate::estimate::{check_mesh, check_reading_mesh};
use crate::mesh::open::{build, read_mesh};
use crate::mesh::report::MeshReport;

#[derive(Debug, Serialize)]
struct Report {
    #[serde(flatten)]
    mesh: MeshReport,
    seconds: Seconds,
}

#[derive(Debug, Serialize)]
struct Seconds {
    read: f64,
    hierarchy: f64,
    write: f64,
}

/// Prepares the triangles of the input and saves them.
pub(super) fn run(args: &PreprocessArgs, console: Console) -> Result<(), CliError> {
    let limit = args.memory.limit();
    if let Some(seen) = glance(&args.input, args.format.0) {
        check_reading_mesh(&args.input, limit, seen.points, seen.bytes)?;
    }
    let start = now();
    let bar = console.spinner(format_args!("reading {}", args.input.display()));
    let triangles = read_mesh(&args.input, args.format.0)?;
    drop(bar);
    let read = start.elapsed().as_secs_f64();
    check_mesh(&args.input, (limit, args.threads), console, &triangles)?;

    let start = now();
    let bar =
        console.spinner(format_args!("preparing {}", count(triangles.triangles().len() as u64, "triangle")));
    let clean = CleanOptions::default().with_weld(args.weld.unwrap_or(0.0));
    let options = MeshBuildOptions::default().with_clean(clean).with_threads(args.threads);
    let mesh = build(&args.input, &triangles, &options)?;
    drop(bar);
    let hierarchy = start.elapsed().as_secs_f64();

    let start = now();
    let bar = console.spinner(format_args!("writing {}", args.output.display()));
    let bytes = mesh.save(&args.output)?;
    drop(bar);
    let seconds = Seconds { read, hierarchy, write: start.elapsed().as_secs_f64() };

    let report = Report { mesh: MeshReport::new(&mesh, bytes), seconds };
    let mut results = Results::new();
    if args.json {
        results.json(&report)?;
        return results.flush();
    }
    report.mesh.lines(&mesh).iter().try_for_each(|line| results.line(line))?;
    let Seconds { read, hierarchy, write } = report.seconds;
    results.line(format_args!("seconds    read {read:.2}, hierarchy {hierarchy:.2}, write {write:.2}"))?;
    results.flush()
}
