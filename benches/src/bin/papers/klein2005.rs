//! Figs 7 and 9 to 11 of Klein & Zachmann 2005 on today's machine: `klein2005.md` and SVGs in a
//! folder.
//!
//! Without the folder of objects, the dragon that the tests ship stands in for them.

use std::fmt::Write;
use std::hint::black_box;

use nearmiss::{
    Answer, BuildOptions, CollideOptions, CollidePlan, Contacts, Detail, GraphOptions, Interpolation, Method,
    Pair, Pose, Sampling, Scan, Scratch, SurfelSize,
};
use nearmiss_benches::clock::{nanoseconds, timed};
use nearmiss_benches::figures::FigureOptions;
use nearmiss_benches::klein2004::objects;
use nearmiss_benches::object::{Object, bumpy_sphere};
use nearmiss_benches::plot::{Axis, Line, Panel};
use nearmiss_benches::poses::{DISTANCES, distance, sweep};
use nearmiss_benches::sample::count;
use nearmiss_benches::{Failure, machine};

/// The paper's sampling density.
const POINTS: u32 = 200;

/// Upper limit of the rival's test points (§5.2).
const CAP: u32 = 500;

/// Numbers of surfels for Fig. 7.
const SURFELS: [u32; 10] = [2, 4, 7, 12, 20, 29, 45, 80, 160, 320];

/// The number of distances in Fig. 9: 0 to 1.5.
const WITHIN: usize = 7;

#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    #[command(flatten)]
    figures: FigureOptions,
    /// Points of the largest cloud of Fig. 9; by default 3,000,000, or 30,000 with `--quick`
    #[arg(long, value_name = "N")]
    points: Option<u32>,
}

impl Options {
    fn poses(&self) -> usize {
        self.figures.poses([10, 100])
    }

    fn points(&self) -> u32 {
        self.points.unwrap_or(if self.figures.quick { 30_000 } else { 3_000_000 })
    }
}

pub(crate) fn run(options: &Options) -> Result<(), Failure> {
    std::fs::create_dir_all(&options.figures.out)?;
    let mut text = format!("# Klein & Zachmann 2005, Figs 7 and 9 to 11\n\n{}\n", machine::description());
    if options.figures.wants(&[7, 10, 11]) {
        let mut asked = Vec::new();
        for object in objects(options.figures.data.as_deref())? {
            eprintln!("{}: {} points", object.name, object.cloud.len());
            let scan = prepared(&object)?;
            asked.push((object.name.clone(), scan));
        }
        if options.figures.wants(&[7]) {
            figure_7(&mut text, options, &asked)?;
        }
        if options.figures.wants(&[10, 11]) {
            figures_10_and_11(&mut text, options, &asked)?;
        }
    }
    if options.figures.wants(&[9]) {
        figure_9(&mut text, options)?;
    }
    let path = options.figures.out.join("klein2005.md");
    std::fs::write(&path, text)?;
    println!("{}", path.display());
    Ok(())
}

/// Prepares the scan with its graph.
fn prepared(object: &Object) -> Result<Scan, Failure> {
    let scan = Scan::build(&object.cloud, &BuildOptions::default())?;
    Ok(scan.with_graph(&object.cloud, &GraphOptions::default(), None)?)
}

fn verdict(method: Method) -> CollideOptions {
    CollideOptions::estimated().with_detail(Detail::Verdict).with_method(method)
}

/// The interpolation search without hierarchy, by brackets alone as in the paper or, with
/// `approaches`, by approaches too.
fn interpolation(surfels: u32, approaches: bool) -> Interpolation {
    let search = Interpolation::default().with_flat(true).with_surfels(SurfelSize::Count(surfels));
    if approaches { search } else { search.with_approaches(0) }
}

/// A method applied to one scan.
struct Asking<'a> {
    scan: &'a Scan,
    plan: CollidePlan,
    scratch: Scratch,
}

impl<'a> Asking<'a> {
    fn new(scan: &'a Scan, method: Method) -> Result<Self, Failure> {
        let plan = CollidePlan::new(&verdict(method), scan, scan)?;
        Ok(Self { scan, plan, scratch: Scratch::default() })
    }

    fn ask(&mut self, pose: &Pose) -> Answer {
        let (a, b) = (self.scan.at(&Pose::IDENTITY), self.scan.at(pose));
        Pair::new(a, b).collide(&self.plan, &mut self.scratch)
    }
}

/// The results of one method over some poses.
#[derive(Clone, Copy, Default)]
struct Tally {
    asked: usize,
    nanoseconds: f64,
    evaluations: u64,
    steps: u64,
    hits: usize,
    /// Intersections of the traversal that the method missed, and intersections that it found
    /// beyond them.
    missed: usize,
    extra: usize,
}

impl Tally {
    /// Queries all poses twice; the faster time counts.
    fn over(asking: &mut Asking<'_>, poses: &[Pose], truth: &[bool]) -> Self {
        let mut tally = Self::default();
        for (pose, &hit) in poses.iter().zip(truth) {
            let (answer, time) = timed(|| black_box(asking.ask(black_box(pose))));
            let again = timed(|| black_box(asking.ask(black_box(pose)))).1;
            let found = answer.verdict.is_intersecting();
            tally.asked += 1;
            tally.nanoseconds += nanoseconds(time.min(again));
            tally.evaluations += answer.statistics.evaluations;
            tally.steps += answer.statistics.neighbour_steps;
            tally.hits += usize::from(hit);
            tally.missed += usize::from(hit && !found);
            tally.extra += usize::from(found && !hit);
        }
        tally
    }

    fn add(&mut self, other: &Self) {
        self.asked += other.asked;
        self.nanoseconds += other.nanoseconds;
        self.evaluations += other.evaluations;
        self.steps += other.steps;
        self.hits += other.hits;
        self.missed += other.missed;
        self.extra += other.extra;
    }

    fn micros(&self) -> f64 {
        self.nanoseconds / 1e3 / count(self.asked.max(1))
    }

    #[expect(clippy::cast_precision_loss, reason = "far fewer than 2⁵²")]
    fn evaluations(&self) -> f64 {
        self.evaluations as f64 / count(self.asked.max(1))
    }

    #[expect(clippy::cast_precision_loss, reason = "far fewer than 2⁵²")]
    fn steps(&self) -> f64 {
        self.steps as f64 / count(self.asked.max(1))
    }

    /// Errors in percent of all tests.
    fn error(&self) -> f64 {
        100.0 * count(self.missed + self.extra) / count(self.asked.max(1))
    }
}

/// The verdicts of the traversal for all poses.
fn truths(scan: &Scan, poses: &[Vec<Pose>; DISTANCES]) -> Result<[Vec<bool>; DISTANCES], Failure> {
    let mut traversal = Asking::new(scan, Method::Traversal)?;
    Ok(poses
        .each_ref()
        .map(|poses| poses.iter().map(|pose| traversal.ask(pose).verdict.is_intersecting()).collect()))
}

/// Writes the errors over the number of drawn points.
fn figure_7(text: &mut String, options: &Options, asked: &[(String, Scan)]) -> Result<(), Failure> {
    text.push_str("\n## Fig. 7: errors over the number of drawn points\n\n![](figure-7.svg)\n\n");
    text.push_str(
        "Tests of the sweep whose verdict differs from the traversal, in percent: by brackets alone, and with approaches \
         (the default).\n\n| object |",
    );
    let points = |surfels| interpolation(surfels, false).points().map_or(0.0, f64::from);
    for surfels in SURFELS {
        write!(text, " n = {} |", points(surfels))?;
    }
    writeln!(text, "\n|---|{}", "--:|".repeat(SURFELS.len()))?;
    let mut lines = Vec::new();
    for (colour, (name, scan)) in asked.iter().enumerate() {
        let poses = sweep(options.poses(), options.figures.seed, 0);
        let truth = truths(scan, &poses)?;
        for approaches in [false, true] {
            let what = if approaches { "with approaches" } else { "brackets" };
            write!(text, "| {name}, {what} |")?;
            let mut line = Vec::new();
            for surfels in SURFELS {
                let mut asking =
                    Asking::new(scan, Method::Interpolation(interpolation(surfels, approaches)))?;
                let mut sum = Tally::default();
                for (poses, truth) in poses.iter().zip(&truth) {
                    sum.add(&Tally::over(&mut asking, poses, truth));
                }
                write!(text, " {:.2} |", sum.error())?;
                line.push([points(surfels), sum.error()]);
            }
            text.push('\n');
            let name = if approaches { String::new() } else { name.clone() };
            lines.push(Line { name, points: line, colour, dashed: approaches });
        }
    }
    let panel = Panel {
        title: "Errors over drawn points (broken: with approaches)".into(),
        axes: [Axis::logarithmic("drawn points n"), Axis::even("% of all tests")],
        lines,
    };
    options.figures.save("figure-7.svg", &[panel])
}

/// Writes times and evaluations over distance, against random test points.
fn figures_10_and_11(text: &mut String, options: &Options, asked: &[(String, Scan)]) -> Result<(), Failure> {
    text.push_str(
        "\n## Figs 10 and 11: times and evaluations of f over distance\n\n![](figure-10-11.svg)\n\n",
    );
    text.push_str("Means over the sweep, d from 0 to 3; recall is the share of the traversal's hits that are found.\n\n");
    let sampling = Sampling::default().with_flat(true);
    let default = Interpolation::default();
    let ways = [
        ("interpolation, brackets alone", Method::Interpolation(interpolation(29, false)), 1),
        ("interpolation", Method::Interpolation(interpolation(29, true)), 1),
        ("interpolation at leaves", Method::Interpolation(default), 1),
        ("traversal", Method::Traversal, 1),
        ("test points, at most 500", Method::Sampling(sampling.with_most(CAP)), 1),
        ("test points, as many as it takes", Method::Sampling(sampling), 20),
    ];
    text.push_str(
        "| object | way | µs | evaluations | steps to nearest points | recall, % | false hits | tests |\n",
    );
    text.push_str("|---|---|--:|--:|--:|--:|--:|--:|\n");
    let mut panels: [Vec<Line>; 2] = Default::default();
    for (colour, (name, scan)) in asked.iter().enumerate() {
        let poses = sweep(options.poses(), options.figures.seed, 0);
        let truth = truths(scan, &poses)?;
        for (way, (what, method, part)) in ways.into_iter().enumerate() {
            eprintln!("{name}: {what}");
            let mut asking = Asking::new(scan, method)?;
            let (mut sum, mut times, mut evaluations) = (Tally::default(), Vec::new(), Vec::new());
            for (i, (poses, truth)) in poses.iter().zip(&truth).enumerate() {
                let few = (poses.len() / part).max(1);
                let tally = Tally::over(&mut asking, &poses[..few], &truth[..few]);
                times.push([distance(i), tally.micros()]);
                evaluations.push([distance(i), tally.evaluations()]);
                sum.add(&tally);
            }
            writeln!(
                text,
                "| {name} | {what} | {:.1} | {:.0} | {:.0} | {:.2} | {} | {} |",
                sum.micros(),
                sum.evaluations(),
                sum.steps(),
                100.0 * count(sum.hits - sum.missed) / count(sum.hits.max(1)),
                sum.extra,
                sum.asked
            )?;
            if way == 1 || way == 5 {
                let name = if way == 1 { name.clone() } else { String::new() };
                for (panel, points) in panels.iter_mut().zip([times, evaluations]) {
                    panel.push(Line { name: name.clone(), points, colour, dashed: way == 5 });
                }
            }
        }
    }
    let across = || Axis::even("distance of the centres, longest side 2");
    let [times, evaluations] = panels;
    let title = |what: &str| format!("{what} (broken: test points)");
    let panels = [
        Panel { title: title("Time"), axes: [across(), Axis::logarithmic("mean µs")], lines: times },
        Panel {
            title: title("Evaluations"),
            axes: [across(), Axis::logarithmic("mean evaluations of f")],
            lines: evaluations,
        },
    ];
    options.figures.save("figure-10-11.svg", &panels)
}

/// Writes the time to find all intersections over the density of one shape.
fn figure_9(text: &mut String, options: &Options) -> Result<(), Failure> {
    text.push_str("\n## Fig. 9: all intersections over density\n\n![](figure-9.svg)\n\n");
    writeln!(
        text,
        "A bumpy sphere, n = {POINTS} drawn points, means over d from 0 to 1.5; relative to the first row in brackets.\n"
    )?;
    text.push_str("| points | µs | evaluations | steps to nearest points | contacts | log log N |\n");
    text.push_str("|--:|--:|--:|--:|--:|--:|\n");
    let sizes = [10_000, 30_000, 100_000, 300_000, 1_000_000, 3_000_000];
    let mut lines: [Vec<[f64; 2]>; 3] = Default::default();
    let mut first: Option<[f64; 2]> = None;
    for points in sizes.into_iter().filter(|&points| points <= options.points()) {
        eprintln!("{points} points");
        let cloud = nearmiss::PointCloud::from_positions(&bumpy_sphere(points))?;
        let object = Object { name: "bumpy sphere".into(), r: 1.0, cloud, mesh: None }.scaled()?;
        let density = object.density();
        let scan = prepared(&object)?;
        let plan = CollidePlan::new(&verdict(Method::Interpolation(interpolation(29, false))), &scan, &scan)?;
        let (mut scratch, mut contacts) = (Scratch::default(), Contacts::default());
        let a = scan.at(&Pose::IDENTITY);
        let poses = sweep(options.poses(), options.figures.seed, 0);
        let (mut tally, mut found) = (Tally::default(), 0);
        for pose in poses[..WITHIN].iter().flatten() {
            let b = scan.at(pose);
            let mut ask = || timed(|| Pair::new(a, b).contacts(&mut contacts).collide(&plan, &mut scratch));
            let (answer, time) = ask();
            let again = ask().1;
            tally.asked += 1;
            tally.nanoseconds += nanoseconds(time.min(again));
            tally.evaluations += answer.statistics.evaluations;
            tally.steps += answer.statistics.neighbour_steps;
            found += contacts.contacts.len();
        }
        let [micros, evaluations] = [tally.micros(), tally.evaluations()];
        let [micros_1, evaluations_1] = *first.get_or_insert([micros, evaluations]);
        let loglog = f64::from(points).log2().log2();
        writeln!(
            text,
            "| {points} | {micros:.1} ({:.2}) | {evaluations:.0} ({:.2}) | {:.0} | {:.1} | {loglog:.2} ({:.2}) |",
            micros / micros_1,
            evaluations / evaluations_1,
            tally.steps(),
            count(found) / count(tally.asked),
            loglog / 10_000.0_f64.log2().log2(),
        )?;
        lines[0].push([density, micros]);
        lines[1].push([density, evaluations]);
        lines[2].push([density, micros_1 * loglog / 10_000.0_f64.log2().log2()]);
    }
    let [times, evaluations, loglog] = lines;
    let across = || Axis::logarithmic("points over the volume of the box");
    let line = |name: &str, points, dashed| Line { name: name.into(), points, colour: 0, dashed };
    let panels = [
        Panel {
            title: "Time for all intersections".into(),
            axes: [across(), Axis::even("mean µs")],
            lines: vec![line("measured", times, false), line("c log log N", loglog, true)],
        },
        Panel {
            title: "Evaluations for all intersections".into(),
            axes: [across(), Axis::even("mean evaluations of f")],
            lines: vec![line("measured", evaluations, false)],
        },
    ];
    options.figures.save("figure-9.svg", &panels)
}
