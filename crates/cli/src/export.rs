//! `export`: writes the contents of a prepared scan to common file formats.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use clap::Args;
use nearmiss::geometry::Frame;
use nearmiss::geometry::nalgebra::Vector3;
use nearmiss::graph::{ClosePairs, PointGraph};
use nearmiss::io::{Column, PlyError, PlyPoints};
use nearmiss::{GraphOptions, Paths, Scan, SurfaceGraph};

use crate::console::Console;
use crate::error::CliError;
use crate::input::{Opening, prepare_again};
use crate::kinds_picture::{self, colour};
use crate::viewpoint::ViewArgs;
use crate::{digits, output, picture, report};

/// Options of `export`. At least one output is required.
#[derive(Debug, Clone, Args)]
#[command(group = clap::ArgGroup::new("outputs").required(true).multiple(true).args(["points", "samples", "boxes", "radii", "edges", "close_pairs", "image"]))]
#[command(group = clap::ArgGroup::new("levelled").multiple(true).args(["samples", "boxes"]))]
pub struct ExportArgs {
    /// Prepared scan (.nm), or a point cloud or mesh, which is prepared on the fly
    #[arg(value_name = "FILE.nm")]
    pub file: PathBuf,
    /// Points with normals and kinds, as PLY
    ///
    /// The points are in the order of the prepared file. `source` is the index in the input. `kind`
    /// is a number with a colour: 0 sheet, grey; 1 edge, blue; 2 noisy, yellow; 3 line, green; 4
    /// stray, red; 5 sparse, pink.
    #[arg(long, value_name = "P.ply")]
    pub points: Option<PathBuf>,
    /// Samples of the nodes at --level, with the node, its covering radius and its sampling radius, as
    /// PLY
    #[arg(long, value_name = "S.ply", requires = "level")]
    pub samples: Option<PathBuf>,
    /// Boxes of the nodes, as lines, as OBJ
    #[arg(long, value_name = "B.obj")]
    pub boxes: Option<PathBuf>,
    /// Local radius and bandwidth of each point: i,r,h
    #[arg(long, value_name = "R.csv")]
    pub radii: Option<PathBuf>,
    /// Edges of the graph: i,j,length,virtual, with i < j
    ///
    /// i and j are indices into the exported points. virtual is 1 for edges that are too long
    /// for the surface.
    #[arg(long, value_name = "E.csv")]
    pub edges: Option<PathBuf>,
    /// Close pairs of each point: i,j,distance along the graph, nearest first
    #[arg(long, value_name = "C.csv")]
    pub close_pairs: Option<PathBuf>,
    /// Draw the points in the colours of their kinds, with the percentage of each kind, as PNG
    #[arg(long, value_name = "OUT.png")]
    pub image: Option<PathBuf>,
    /// From where the picture is taken
    #[command(flatten)]
    pub view: ViewArgs,
    /// Depth of the nodes to export; the root has depth 0; leaves at lesser depths are included
    #[arg(long, value_name = "L", requires = "levelled")]
    pub level: Option<u32>,
    /// Check prepared scans in full before use: checksums and all values
    #[arg(long)]
    pub verify: bool,
    /// Show no progress
    #[arg(long)]
    pub quiet: bool,
}

pub(crate) fn run(args: &ExportArgs) -> Result<(), CliError> {
    let outputs = [&args.points, &args.samples, &args.boxes, &args.radii, &args.edges, &args.close_pairs];
    let outputs = [&outputs[..], &[&args.image]].concat();
    let outputs: Vec<Option<&PathBuf>> = outputs.into_iter().map(Option::as_ref).collect();
    if let Some(path) = &args.image {
        picture::check_name(path)?;
    }
    for (i, path) in outputs.iter().enumerate().filter_map(|(i, p)| p.map(|p| (i, p))) {
        if !output::is_stdout(path) {
            output::check_apart(path, &[&args.file])?;
        }
        if outputs[..i].contains(&Some(path)) {
            return Err(CliError::Usage(format!(
                "{}: expected one output for each file, got two outputs; name another file",
                path.display()
            )));
        }
    }
    let opening = Opening::new(args.verify, Console::new(args.quiet));
    let scan = if args.edges.is_some() || args.close_pairs.is_some() {
        let pairs = args.close_pairs.as_ref().map(|_| Paths::Rebuilt);
        opening.open_with_graph(&args.file, &GraphOptions::default().with_close_pairs(pairs))?
    } else {
        opening.open(&args.file)?
    };
    let pairs = scan.graph().and_then(SurfaceGraph::close_pairs);
    // Checked before anything is written.
    if args.close_pairs.is_some() && pairs.is_none() {
        let remedy = prepare_again(&args.file, "--close-pairs");
        let what = format!("expected a scan with close pairs, got one without; {remedy}");
        return Err(CliError::UnsuitableFile { path: args.file.clone(), what });
    }
    let console = Console::new(args.quiet);
    let wrote = |count: usize, what: &str, path: &Path| {
        if !output::is_stdout(path) {
            let counted = digits::count(count as u64, what);
            console.note(format_args!("wrote {counted} to {}", path.display()));
        }
    };
    if let (Some(path), Some(graph)) = (&args.edges, scan.graph()) {
        output::replace_or_print(path, |out| edges(&scan, graph.points(), out))?;
        let counts = graph.counts();
        wrote(counts.edges + counts.virtual_edges, "edge", path);
    }
    if let (Some(path), Some(pairs)) = (&args.close_pairs, pairs) {
        output::replace_or_print(path, |out| close_pairs(&scan, pairs, out))?;
        wrote(pairs.pair_count(), "close pair", path);
    }
    if let Some(path) = &args.points {
        output::replace(path, |out| points(&scan, out).map_err(CliError::writing_ply(path)))?;
        wrote(scan.len(), "point", path);
    }
    let depths = report::depths(scan.topology());
    let nodes = at_depth(&scan, &depths, args.level).count();
    if let (Some(path), Some(level)) = (&args.samples, args.level) {
        output::replace(path, |out| samples(&scan, level, out).map_err(CliError::writing_ply(path)))?;
        let of_node = |node| scan.arrays().samples(node).iter().count();
        wrote(at_depth(&scan, &depths, Some(level)).map(of_node).sum(), "sample", path);
    }
    if let Some(path) = &args.boxes {
        output::replace_or_print(path, |out| boxes(&scan, args.level, out))?;
        wrote(nodes, "node", path);
    }
    if let Some(path) = &args.radii {
        output::replace_or_print(path, |out| radii(&scan, out))?;
        wrote(scan.len(), "point", path);
    }
    if let Some(path) = &args.image {
        output::save_picture(&kinds_picture::paint(&scan, &args.view), path)?;
    }
    Ok(())
}

/// Writes the points in the frame of the input, in single precision if that is the stored frame,
/// else in double.
fn points(scan: &Scan, out: &mut impl Write) -> Result<(), PlyError> {
    let frame = scan.frame();
    let kinds = || (0..scan.len()).map(|i| scan.kind(i));
    let codes: Vec<u32> = kinds().map(|kind| u32::from(kind.code())).collect();
    let colours: Vec<[u8; 3]> = kinds().map(colour).collect();
    let columns = [Column::Uint("kind", &codes)];
    let told = |ply: PlyPoints<'_>, out| {
        let ply = ply.with_normals(scan.normals()).with_colours(&colours);
        ply.with_source(scan.source()).with_columns(&columns).write(out)
    };
    if *frame == Frame::default() {
        return told(PlyPoints::single(scan.positions()), out);
    }
    let positions: Vec<[f64; 3]> = scan.positions().iter().map(|&p| frame.to_world(p)).collect();
    told(PlyPoints::double(&positions), out)
}

/// Returns the nodes at a depth and the leaves above it, or all nodes if no depth is given.
pub(crate) fn at_depth<'a>(
    scan: &'a Scan,
    depths: &'a [u8],
    level: Option<u32>,
) -> impl Iterator<Item = usize> + 'a {
    let is_wanted = move |i: usize| match level {
        Some(level) => {
            let depth = u32::from(depths[i]);
            depth == level || i >= scan.topology().inner() && depth < level
        }
        None => true,
    };
    (0..depths.len()).filter(move |&i| is_wanted(i))
}

/// Writes the samples of all nodes at a depth, and of the leaves above it, with lengths in the
/// units of the input.
fn samples(scan: &Scan, level: u32, out: &mut impl Write) -> Result<(), PlyError> {
    let (arrays, frame) = (scan.arrays(), scan.frame());
    let (mut positions, mut source, mut nodes) = (Vec::new(), Vec::new(), Vec::new());
    let (mut covering, mut sampling) = (Vec::new(), Vec::new());
    #[expect(clippy::cast_possible_truncation, reason = "radii are single precision")]
    let length = |stored: f32| (f64::from(stored) * frame.scale) as f32;
    for node in at_depth(scan, &report::depths(scan.topology()), Some(level)) {
        for i in arrays.samples(node).iter() {
            positions.push(frame.to_world(arrays.position(i)));
            source.push(scan.source()[i]);
            nodes.push(u32::try_from(node).unwrap_or(u32::MAX));
            covering.push(length(arrays.covering_radius(node)));
            sampling.push(length(arrays.sampling_radius_of(node)));
        }
    }
    let columns = [
        Column::Uint("node", &nodes),
        Column::Float("covering_radius", &covering),
        Column::Float("sampling_radius", &sampling),
    ];
    PlyPoints::double(&positions).with_source(&source).with_columns(&columns).write(out)
}

/// The edges of a box, as pairs of corners whose numbers differ in one bit.
const EDGES: [[u64; 2]; 12] =
    [[0, 1], [2, 3], [4, 5], [6, 7], [0, 2], [1, 3], [4, 6], [5, 7], [0, 4], [1, 5], [2, 6], [3, 7]];

fn boxes(scan: &Scan, level: Option<u32>, out: &mut dyn Write) -> io::Result<()> {
    let depths = report::depths(scan.topology());
    writeln!(out, "# node boxes, eight corners and twelve edges each")?;
    let mut first = 1_u64;
    let all: Vec<_> = scan.boxes().collect();
    for i in at_depth(scan, &depths, level) {
        let b = &all[i];
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

fn radii(scan: &Scan, out: &mut dyn Write) -> io::Result<()> {
    let scale = scan.frame().scale;
    writeln!(out, "i,r,h")?;
    for (i, &r) in scan.radii().iter().enumerate() {
        let h = f64::from(scan.plan().bandwidth(r)) * scale;
        writeln!(out, "{i},{},{h}", f64::from(r) * scale)?;
    }
    Ok(())
}

fn edges(scan: &Scan, graph: &PointGraph, out: &mut dyn Write) -> io::Result<()> {
    let scale = scan.frame().scale;
    let length = |[i, j]: [u32; 2]| {
        let [p, q] = [i, j].map(|i| Vector3::from(scan.positions()[i as usize].map(f64::from)));
        (p - q).norm() * scale
    };
    writeln!(out, "i,j,length,virtual")?;
    for (mark, edges) in [(0, graph.edges()), (1, graph.virtual_edges())] {
        for [i, j] in edges.edges() {
            writeln!(out, "{i},{j},{},{mark}", length([i, j]))?;
        }
    }
    Ok(())
}

fn close_pairs(scan: &Scan, pairs: &ClosePairs, out: &mut dyn Write) -> io::Result<()> {
    let scale = scan.frame().scale;
    writeln!(out, "i,j,distance")?;
    for i in 0..pairs.len() {
        for close in pairs.of(i) {
            writeln!(out, "{i},{},{}", close.point, f64::from(close.distance) * scale)?;
        }
    }
    Ok(())
}
