//! Kinetic trees: events by number of points, work per event, and refitting beside it.
//!
//! Random points cross each other in straight lines. Smooth motion has a knot every ten frames of
//! 60 Hz: a generated surface with waves, and meshes of a folder of sequences, whose frames become
//! the knots.

use std::hint::black_box;
use std::path::{Path, PathBuf};

use nearmiss::Aabb;
use nearmiss::io::{Pieces, read_in_pieces};
use nearmiss::kinetic::{Counts, FlightPlan, KineticTree};
use nearmiss_benches::clock::{nanoseconds, timed};
use nearmiss_benches::object::bumpy_sphere;
use nearmiss_benches::plot::{Axis, Line, Panel, figure};
use nearmiss_benches::rivals::refit::FlatTree;
use nearmiss_benches::sample::count;
use nearmiss_benches::{Failure, machine};
use nearmiss_testdata::arbitrary::{point_in, rng};

/// Frames a second of the refit.
const RATE: f64 = 60.0;

/// Runs of which the fastest is reported: other programs slow some of them down.
const RUNS: usize = 5;

#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// Numbers of random points
    #[arg(long, value_name = "N", default_values_t = [1_000, 10_000, 100_000, 1_000_000])]
    points: Vec<u32>,
    /// Points of the surface with waves
    #[arg(long, value_name = "N", default_value_t = 100_000)]
    surface: u32,
    /// A folder of sequences: folders of files with one mesh, frame by frame
    #[arg(long, value_name = "FOLDER")]
    data: Option<PathBuf>,
    /// Frames from one knot to the next
    #[arg(long, value_name = "N", default_value_t = 10.0)]
    frames: f64,
    /// Draw updates, update time and total time over the rate of frames, as SVG
    #[arg(long, value_name = "OUT.svg")]
    image: Option<PathBuf>,
    /// Seed of the random numbers
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
}

pub(crate) fn run(options: &Options) -> Result<(), Failure> {
    println!("{}", machine::description());
    crossing(options)?;
    rates(options)?;
    smooth(options)?;
    options.image.as_deref().map_or(Ok(()), |path| plots(options, path))
}

/// Points in a cube, with velocities up to 1 along each axis.
fn random(points: u32, seed: u64) -> Result<KineticTree, Failure> {
    let rng = &mut rng(seed);
    let plans = (0..points).map(|_| FlightPlan::linear(0.0, point_in(rng, 0.5), point_in(rng, 1.0)));
    Ok(KineticTree::of_points(0.0, plans.collect::<Result<Vec<_>, _>>()?)?)
}

fn per(total: u64, of: u64) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "counts for people")]
    let ratio = total as f64 / of.max(1) as f64;
    ratio
}

/// Events by number of points.
fn crossing(options: &Options) -> Result<(), Failure> {
    println!("## Random points in straight lines, 4 s, the fastest of {RUNS} runs\n");
    println!(
        "| points | build, ms | events | per point | per n log₂ n | of leaves, % | updates | certificates / event \
         | nodes compared / event | events / ms | certificates / point | of one point, mean | most | bytes / point |"
    );
    println!("| --: |{}", " --: |".repeat(13));
    for &points in &options.points {
        let (start, build) = timed(|| random(points, options.seed));
        let start = start?;
        let of_one: Vec<usize> = (0..points).step_by(97).map(|point| start.certificates_of(point)).collect();
        let mut tree = start.clone();
        let mut time = f64::INFINITY;
        for _ in 0..RUNS {
            tree.clone_from(&start);
            let (result, took) = timed(|| tree.advance(4.0));
            result?;
            time = time.min(nanoseconds(took) / 1e6);
        }
        let counts = tree.counts();
        let (events, n) = (counts.events(), f64::from(points));
        println!(
            "| {points} | {:.1} | {events} | {:.2} | {:.3} | {:.0} | {} | {:.2} | {:.1} | {:.0} | {:.2} | {:.1} | {} | {:.0} |",
            nanoseconds(build) / 1e6,
            per(events, points.into()),
            per(events, points.into()) / n.log2(),
            100.0 * per(counts.leaf_events, events),
            counts.updates,
            per(counts.certificates, events),
            per(counts.steps, events),
            per(events, 1) / time,
            6.0 * count(tree.node_count()) / n,
            count(of_one.iter().sum()) / count(of_one.len()),
            of_one.iter().max().copied().unwrap_or(0),
            count(tree.bytes()) / n,
        );
    }
    Ok(())
}

/// Events do not depend on queries.
fn rates(options: &Options) -> Result<(), Failure> {
    println!("\n## Queries a second, 10000 random points, 4 s\n");
    println!("| queries / s | events | updates | certificates | ms |\n| --: | --: | --: | --: | --: |");
    for rate in [1_u32, 60, 1000] {
        let mut tree = random(10_000, options.seed)?;
        let (result, time) = timed(|| {
            (1..=4 * rate).try_for_each(|i| {
                tree.advance(f64::from(i) / f64::from(rate))?;
                black_box(tree.bounds());
                Ok::<(), Failure>(())
            })
        });
        result?;
        let Counts { updates, certificates, .. } = tree.counts();
        println!(
            "| {rate} | {} | {updates} | {certificates} | {:.1} |",
            tree.counts().events(),
            nanoseconds(time) / 1e6
        );
    }
    Ok(())
}

/// A sequence: the place of each point at each knot.
struct Sequence {
    name: String,
    knots: Vec<Vec<[f64; 3]>>,
    triangles: Vec<[u32; 3]>,
}

/// Waves that run over a bumpy sphere.
fn waves(points: u32, knot: f64) -> Sequence {
    let places = bumpy_sphere(points);
    let at = |t: f64| {
        let wave = |&[x, y, z]: &[f64; 3]| {
            let phase = 4.0 * x + 3.0 * y - 5.0 * z + 6.0 * t;
            [x + 0.05 * phase.sin(), y + 0.05 * (phase + 1.0).cos(), z + 0.05 * (0.7 * phase).sin()]
        };
        places.iter().map(wave).collect()
    };
    let knots = (0..13_u32).map(|i| at(f64::from(i) * knot)).collect();
    Sequence { name: format!("waves, {points} points"), knots, triangles: Vec::new() }
}

/// Reads the frames in a folder, in the order of their names.
fn sequence(folder: &Path) -> Result<Option<Sequence>, Failure> {
    let mut paths: Vec<PathBuf> =
        std::fs::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect::<Result<_, Failure>>()?;
    paths.sort();
    let mut triangles = Vec::new();
    let mut knots: Vec<Vec<[f64; 3]>> = Vec::new();
    for path in &paths {
        let mut places = Vec::new();
        match read_in_pieces(path, None, 1 << 20)? {
            Pieces::Points(pieces) => pieces.each(|points| places.extend_from_slice(&points.positions))?,
            Pieces::Mesh { vertices, mesh } => {
                places = vertices.positions;
                triangles = mesh.triangles().to_vec();
            }
        }
        if knots.first().is_some_and(|first| first.len() != places.len()) {
            return Err(format!("expected as many points in every frame, got {}", path.display()).into());
        }
        knots.push(places);
    }
    let name = folder.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    Ok((knots.len() > 1).then_some(Sequence { name, knots, triangles }))
}

fn smooth(options: &Options) -> Result<(), Failure> {
    let knot = options.frames / RATE;
    println!("\n## Smooth motion, a knot every {} frames of {RATE} Hz\n", options.frames);
    println!(
        "An update is a change of one side of one box; a refit updates every box once a frame, all six sides together. \
         Times are per second of motion. The refit takes positions as given; a kinetic tree computes them. At the \
         crossover frame rate both take the same time.\n"
    );
    println!(
        "| motion | primitives | nodes | updates / s | refit's / s | ratio | events / s | certificates / s, at events \
         | at knots | ms at events | ms at knots | refit, ms | one refit, µs | crossover, Hz |"
    );
    println!("| --- | --: |{}", " --: |".repeat(12));
    compare(&waves(options.surface, knot), knot, false)?;
    let Some(folder) = &options.data else { return Ok(()) };
    let mut folders: Vec<PathBuf> =
        std::fs::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect::<Result<_, Failure>>()?;
    folders.sort();
    for folder in folders.iter().filter(|path| path.is_dir()) {
        if let Some(sequence) = sequence(folder)? {
            compare(&sequence, knot, false)?;
            if !sequence.triangles.is_empty() {
                compare(&sequence, knot, true)?;
            }
        }
    }
    Ok(())
}

/// The boxes about points that are sought in each frame, and half their size.
const BOXES: usize = 20;
const HALF: f64 = 0.05;

/// Draws the three plots of the slides for the surface with waves, with a knot every ten frames of
/// 60 Hz: changes of boxes, time of an update, and with queries for the primitives in some boxes.
fn plots(options: &Options, path: &Path) -> Result<(), Failure> {
    let knot = options.frames / RATE;
    let Sequence { knots, name, .. } = waves(options.surface, knot);
    let times: Vec<f64> = (0_u32..).zip(&knots).map(|(i, _)| f64::from(i) * knot).collect();
    let plan = |point: usize| {
        let places: Vec<[f64; 3]> = knots.iter().map(|places| places[point]).collect();
        FlightPlan::through(&times, &places)
    };
    let plans = (0..knots[0].len()).map(plan).collect::<Result<Vec<_>, _>>()?;
    let start = KineticTree::of_points(0.0, plans.iter().cloned())?;
    let nodes = count(start.node_count());
    let mut lines: [[Vec<[f64; 2]>; 2]; 3] = Default::default();
    println!("\n## Over the rate of frames: {name}\n");
    println!(
        "| frames / s | updates / frame | refit's | update, ms | refit, ms | with queries, ms | refit, with queries, ms |"
    );
    println!("| --: |{}", " --: |".repeat(6));
    let seconds = times[times.len() - 1];
    for rate in [15_u32, 30, 60, 120, 240, 480, 960, 1920, 3840] {
        let mut tree = start.clone();
        let (mut own, mut asked, mut refit) = (0.0, 0.0, f64::INFINITY);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a number of frames")]
        let frames = (seconds * f64::from(rate)) as u32;
        for frame in 1..=frames {
            let (result, time) = timed(|| tree.advance(f64::from(frame) / f64::from(rate)));
            result?;
            own += nanoseconds(time) / 1e6;
            let (_, time) = timed(|| {
                for i in 0..BOXES {
                    let point = u32::try_from(i * knots[0].len() / BOXES).unwrap_or_default();
                    let place = tree.position(point).unwrap_or_default();
                    let bounds = Aabb { min: place.map(|x| x - HALF), max: place.map(|x| x + HALF) };
                    tree.in_box(&bounds, |primitive| {
                        black_box(primitive);
                    });
                }
            });
            asked += nanoseconds(time) / 1e6;
        }
        let (mut flat, positions) = flattened(&tree, knots[0].len(), false)?;
        for _ in 0..20 {
            refit =
                f64::min(refit, nanoseconds(timed(|| black_box(flat.refit(black_box(&positions)))).1) / 1e6);
        }
        let each = |total: f64| total / f64::from(frames);
        let (updates, own, asked) = (each(per(tree.counts().updates, 1)), each(own), each(asked));
        let rows = [[updates, nodes], [own, refit], [own + asked, refit + asked]];
        for (lines, row) in lines.iter_mut().zip(rows) {
            for (line, y) in lines.iter_mut().zip(row) {
                line.push([f64::from(rate), y]);
            }
        }
        println!(
            "| {rate} | {updates:.0} | {nodes:.0} | {own:.3} | {refit:.3} | {:.3} | {:.3} |",
            own + asked,
            refit + asked
        );
    }
    let titles = [
        ("Bounding-volume updates", "updates per frame"),
        ("Update time", "ms per frame"),
        ("Total time with queries", "ms per frame"),
    ];
    let panels: Vec<Panel> = titles
        .into_iter()
        .zip(lines)
        .map(|((title, y), lines)| Panel {
            title: title.into(),
            axes: [Axis::logarithmic("frames per second"), Axis::logarithmic(y)],
            lines: lines
                .into_iter()
                .zip(["kinetic", "refit"])
                .enumerate()
                .map(|(colour, (points, name))| Line { name: name.into(), points, colour, dashed: false })
                .collect(),
        })
        .collect();
    std::fs::write(path, figure(&panels)?)?;
    println!("\nDrawn in {}", path.display());
    Ok(())
}

/// The flat tree over the primitives of a kinetic one, in the same order, and the present places.
fn flattened(
    tree: &KineticTree,
    points: usize,
    by_triangles: bool,
) -> Result<(FlatTree, Vec<[f32; 4]>), Failure> {
    let mut order = Vec::new();
    tree.for_each_node(|_, primitives| order = primitives.to_vec());
    #[expect(clippy::cast_possible_truncation, reason = "a refit in single precision")]
    let single = |p: [f64; 3]| [p[0] as f32, p[1] as f32, p[2] as f32, 0.0];
    let ids = 0..u32::try_from(points)?;
    let positions = ids.map(|i| single(tree.position(i).unwrap_or_default())).collect();
    let corners = order.iter().flat_map(|&primitive| tree.primitive(primitive).unwrap_or_default());
    Ok((FlatTree::new(corners.copied().collect(), if by_triangles { 12 } else { 8 }), positions))
}

/// Times in milliseconds, and counts, of the advance through all knots.
#[derive(Debug, Default)]
struct Run {
    at_events: f64,
    at_knots: f64,
    certificates_at_knots: u64,
}

impl Run {
    fn through(tree: &mut KineticTree, knots: &[f64]) -> Result<Self, Failure> {
        let mut run = Self::default();
        for &knot in knots {
            let (result, time) = timed(|| tree.advance(knot.next_down()));
            result?;
            run.at_events += nanoseconds(time) / 1e6;
            let before = tree.counts().certificates;
            let (result, time) = timed(|| tree.advance(knot));
            result?;
            run.at_knots += nanoseconds(time) / 1e6;
            run.certificates_at_knots += tree.counts().certificates - before;
        }
        Ok(run)
    }
}

fn compare(sequence: &Sequence, knot: f64, by_triangles: bool) -> Result<(), Failure> {
    let points = sequence.knots[0].len();
    let times: Vec<f64> = (0_u32..).zip(&sequence.knots).map(|(i, _)| f64::from(i) * knot).collect();
    let plan = |point: usize| {
        let places: Vec<[f64; 3]> = sequence.knots.iter().map(|places| places[point]).collect();
        FlightPlan::through(&times, &places)
    };
    let plans = (0..points).map(plan).collect::<Result<Vec<_>, _>>()?;
    let mut tree = if by_triangles {
        KineticTree::new(0.0, plans.iter().cloned(), &sequence.triangles)?
    } else {
        KineticTree::of_points(0.0, plans.iter().cloned())?
    };
    let (mut flat, _) = flattened(&tree, points, by_triangles)?;
    let run = Run::through(&mut tree, &times[1..])?;
    let counts = tree.counts();
    let seconds = times[times.len() - 1];
    let frames = seconds * RATE;
    let (_, positions) = flattened(&tree, points, by_triangles)?;
    let refits = (0..50).map(|_| nanoseconds(timed(|| black_box(flat.refit(black_box(&positions)))).1) / 1e3);
    let refit = refits.fold(f64::INFINITY, f64::min);
    let nodes = count(tree.node_count());
    let rate = |total: u64| per(total, 1) / seconds;
    let own = (run.at_events + run.at_knots) / seconds;
    println!(
        "| {} | {} {} | {nodes} | {:.0} | {:.0} | {:.1} | {:.0} | {:.0} | {:.0} | {:.1} | {:.1} | {:.1} | {refit:.0} | {:.0} |",
        sequence.name,
        tree.len(),
        if by_triangles { "triangles" } else { "points" },
        rate(counts.updates),
        nodes * RATE,
        nodes * frames / per(counts.updates, 1),
        rate(counts.events()),
        rate(counts.certificates - run.certificates_at_knots),
        rate(run.certificates_at_knots),
        run.at_events / seconds,
        run.at_knots / seconds,
        refit * RATE / 1e3,
        own * 1e3 / refit,
    );
    Ok(())
}
