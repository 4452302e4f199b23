//! The speed of reading files: in pieces, with a check for finite coordinates and without removal
//! of duplicates, and whole, with removal.

use std::path::PathBuf;

use nearmiss::io::{Pieces, read, read_in_pieces};
use nearmiss_benches::clock::timed;
use nearmiss_benches::{Failure, machine};

#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// Files of points
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Reads per file; the shortest time counts
    #[arg(long, value_name = "N", default_value_t = 3)]
    runs: u32,
}

/// Bytes per read.
const BLOCK: usize = 1 << 20;

pub(crate) fn run(options: &Options) -> Result<(), Failure> {
    println!("{}\n", machine::description());
    println!("| file | points | MB | in pieces, s | million points/s | MB/s | whole, s |");
    println!("| --- | --: | --: | --: | --: | --: | --: |");
    for file in &options.files {
        let (mut least, mut whole) = (f64::INFINITY, f64::INFINITY);
        let (mut points, mut finite) = (0_u64, 0_u64);
        for _ in 0..options.runs.max(1) {
            let (done, time) = timed(|| in_pieces(file));
            (points, finite) = done?;
            least = least.min(time.as_secs_f64());
            let (done, time) = timed(|| read(file, None));
            done?;
            whole = whole.min(time.as_secs_f64());
        }
        #[expect(clippy::cast_precision_loss, reason = "sizes in two digits")]
        let (count, megabytes) = (points as f64 / 1e6, file.metadata()?.len() as f64 / 1e6);
        let name = file.file_name().unwrap_or_default().display();
        println!(
            "| {name} | {finite} of {points} | {megabytes:.1} | {least:.3} | {:.1} | {:.0} | {whole:.3} |",
            count / least,
            megabytes / least
        );
    }
    Ok(())
}

/// The number of points, and how many of them are finite.
fn in_pieces(file: &PathBuf) -> Result<(u64, u64), Failure> {
    let (mut points, mut finite) = (0, 0);
    match read_in_pieces(file, None, BLOCK)? {
        Pieces::Points(pieces) => pieces.each(|some| {
            points += some.len() as u64;
            finite += some.positions.iter().filter(|p| p.iter().all(|x| x.is_finite())).count() as u64;
        })?,
        Pieces::Mesh { mesh, .. } => {
            points = mesh.vertices().len() as u64;
            finite = points;
        }
    }
    Ok((points, finite))
}
