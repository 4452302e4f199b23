//! `export`: look inside a prepared scan.

use std::io::{self, Write};
use std::path::PathBuf;

use clap::Args;
use nearmiss::Scan;
use nearmiss::io::{PlyPoints, WriteError};

use crate::console::Console;
use crate::error::CliError;
use crate::{input, output, report};

/// Options of `export`. At least one output is asked for.
#[derive(Debug, Clone, Args)]
#[command(group = clap::ArgGroup::new("outputs").required(true).multiple(true).args(["points", "boxes", "radii"]))]
pub struct ExportArgs {
    /// Prepared scan, or a raw input, prepared on the fly
    #[arg(value_name = "FILE.nm")]
    pub file: PathBuf,
    /// Points with normals in the order of the prepared file, and their index in its input as `source`
    #[arg(long, value_name = "P.ply")]
    pub points: Option<PathBuf>,
    /// Boxes of the hierarchy's nodes, as lines
    #[arg(long, value_name = "B.obj")]
    pub boxes: Option<PathBuf>,
    /// Sampling radius and bandwidth of each point: i,r,h
    #[arg(long, value_name = "R.csv")]
    pub radii: Option<PathBuf>,
    /// Only boxes at this depth, the root's being 0, and of leaves above it
    #[arg(long, value_name = "L", requires = "boxes")]
    pub level: Option<u32>,
}

pub(crate) fn run(args: &ExportArgs) -> Result<(), CliError> {
    let outputs = [&args.points, &args.boxes, &args.radii].map(Option::as_ref);
    for (i, path) in outputs.iter().enumerate().filter_map(|(i, p)| p.map(|p| (i, p))) {
        output::check_apart(path, &[&args.file])?;
        if outputs[..i].contains(&Some(path)) {
            return Err(CliError::Usage(format!("{}: named for two outputs", path.display())));
        }
    }
    let scan = input::open(&args.file, 0, Console::new(false))?;
    if let Some(path) = &args.points {
        output::replace(path, |out| {
            points(&scan, out).map_err(|e| match e {
                WriteError::Io { cause } => CliError::writing(path)(cause),
                e => CliError::Unfit { path: path.clone(), what: e.to_string() },
            })
        })?;
    }
    if let Some(path) = &args.boxes {
        output::replace_plain(path, |out| boxes(&scan, args.level, out))?;
    }
    if let Some(path) = &args.radii {
        output::replace_plain(path, |out| radii(&scan, out))?;
    }
    Ok(())
}

/// In the frame of the input: in single precision where that is what is stored, else in double.
fn points(scan: &Scan, out: &mut impl Write) -> Result<(), WriteError> {
    let frame = scan.frame();
    if *frame == nearmiss::geometry::Frame::default() {
        let ply = PlyPoints::single(scan.positions());
        return ply.with_normals(scan.normals()).with_source(scan.source()).write(out);
    }
    let positions: Vec<[f64; 3]> = scan.positions().iter().map(|&p| frame.to_world(p)).collect();
    PlyPoints::double(&positions).with_normals(scan.normals()).with_source(scan.source()).write(out)
}

/// Corners of a box that an edge joins: those that differ in one bit.
const EDGES: [[u64; 2]; 12] =
    [[0, 1], [2, 3], [4, 5], [6, 7], [0, 2], [1, 3], [4, 6], [5, 7], [0, 4], [1, 5], [2, 6], [3, 7]];

fn boxes(scan: &Scan, level: Option<u32>, out: &mut impl Write) -> io::Result<()> {
    let depths = report::depths(scan);
    writeln!(out, "# node boxes, eight corners and twelve edges each")?;
    let mut first = 1_u64;
    for (i, (node, b)) in scan.nodes().iter().zip(scan.boxes()).enumerate() {
        let wanted = level.is_none_or(|level| depths[i] == level || node.is_leaf() && depths[i] < level);
        if !wanted {
            continue;
        }
        writeln!(out, "o node{i}_depth{}", depths[i])?;
        for corner in 0..8 {
            let mut p = b.centre.map(f64::from);
            for k in 0..3 {
                let side = if corner >> k & 1 == 0 { -1.0 } else { 1.0 };
                for (c, axis) in p.iter_mut().zip(b.axes[k]) {
                    *c += side * f64::from(b.half[k]) * f64::from(axis);
                }
            }
            let frame = scan.frame();
            let [x, y, z] = [0, 1, 2].map(|k| frame.origin[k] + frame.scale * p[k]);
            writeln!(out, "v {x} {y} {z}")?;
        }
        for [from, to] in EDGES {
            writeln!(out, "l {} {}", first + from, first + to)?;
        }
        first += 8;
    }
    Ok(())
}

fn radii(scan: &Scan, out: &mut impl Write) -> io::Result<()> {
    let scale = scan.frame().scale;
    writeln!(out, "i,r,h")?;
    for (i, &r) in scan.radii().iter().enumerate() {
        let h = f64::from(scan.plan().bandwidth(r)) * scale;
        writeln!(out, "{i},{},{h}", f64::from(r) * scale)?;
    }
    Ok(())
}
