//! Table 1 and Figs 8–12 of Klein & Zachmann 2004 on today's machine: `klein2004.md` and SVGs in a
//! folder.
//!
//! Without the folder of objects, the dragon that the tests ship stands in for them. The artificial
//! models are generated.

use std::fmt::Write;
use std::time::Duration;

use nearmiss::{
    BuildOptions, CollideOptions, CollidePlan, Detail, Method, Order, Pacer, Pair, Pose, Sampling, Scan,
    Scratch,
};
use nearmiss_benches::figures::FigureOptions;
use nearmiss_benches::klein2004::course::{Course, Questions};
use nearmiss_benches::klein2004::hierarchy::{Makeup, build_seconds};
use nearmiss_benches::klein2004::{artificial, objects, sizes, subset};
use nearmiss_benches::object::{Object, bumpy_sphere};
use nearmiss_benches::plot::{Axis, Line, Panel};
use nearmiss_benches::poses::{DISTANCES, distance, sweep};
use nearmiss_benches::rivals::Method as Rival;
use nearmiss_benches::rivals::ours::Ours;
use nearmiss_benches::rivals::parry::MeshTree;
use nearmiss_benches::sample::count;
use nearmiss_benches::sweep::Column;
use nearmiss_benches::{Failure, machine};

/// Points of the paper's grid.
const GRID: u32 = 197_315;

/// Poses that are queried repeatedly, as in the paper.
const REPEATED: usize = 200;

/// Passes over all poses; the faster time of a query counts, which reduces the effect of other
/// load.
const PASSES: usize = 2;

/// Shares of an object's points in Fig. 8.
const SHARES: [usize; 4] = [8, 4, 2, 1];

#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    #[command(flatten)]
    figures: FigureOptions,
    /// The target time of a query in the time-critical mode
    #[arg(long, value_name = "MICROSECONDS", default_value_t = 200)]
    target: u64,
}

impl Options {
    fn poses(&self) -> usize {
        self.figures.poses([40, 1000])
    }

    fn grid(&self) -> u32 {
        if self.figures.quick { GRID / 10 } else { GRID }
    }
}

pub(crate) fn run(options: &Options) -> Result<(), Failure> {
    std::fs::create_dir_all(&options.figures.out)?;
    let data = options.figures.data.as_deref();
    let (all, sizes) = (objects(data)?, sizes(data)?);
    let artificial = artificial(options.grid())?;
    let mut text =
        format!("# Klein & Zachmann 2004, Table 1 and Figs 8 to 12\n\n{}\n", machine::description());
    if options.figures.wants(&[1]) {
        table_1(&mut text, all.iter().chain(&artificial))?;
    }
    if options.figures.wants(&[8]) {
        figure_8(&mut text, options, all.iter().chain(&artificial))?;
    }
    let groups = [
        (9, "objects", &all[..]),
        (10, "sizes of one object", &sizes[..]),
        (11, "artificial models", &artificial[..]),
    ];
    for (number, what, objects) in groups.into_iter().filter(|group| options.figures.wants(&[group.0])) {
        let courses = objects.iter().map(|object| measure(object, options));
        courses_of(&mut text, options, (number, what), &courses.collect::<Result<Vec<_>, _>>()?)?;
    }
    let last = all.iter().rfind(|object| object.mesh.is_some());
    if let Some(object) = last.filter(|_| options.figures.wants(&[12])) {
        figure_12(&mut text, options, object)?;
    }
    let path = options.figures.out.join("klein2004.md");
    std::fs::write(&path, text)?;
    println!("{}", path.display());
    Ok(())
}

fn table_1<'a>(text: &mut String, objects: impl Iterator<Item = &'a Object>) -> Result<(), Failure> {
    text.push_str(
        "\n## Table 1: cloud points, sample points, depth\n\n\
         | object | cloud points | sample points | nodes | average depth of a node | bytes a node | bytes a point |\n\
         |---|--:|--:|--:|--:|--:|--:|\n",
    );
    for object in objects {
        eprintln!("Table 1: {}", object.name);
        let made = Makeup::of(&Scan::build(&object.cloud, &BuildOptions::default())?)?;
        writeln!(
            text,
            "| {} | {} | {} | {} | {:.1} | {:.0} | {:.0} |",
            object.name,
            made.points,
            made.samples,
            made.nodes,
            made.depth,
            made.bytes_a_node,
            made.bytes_a_point
        )?;
    }
    text.push_str(
        "\nBytes of the file; those a node without the 37 that every point keeps. In the paper: 35,056 to 197,315 points, \
         45,012 to 360,404 sample points, depth 11 to 14, at most 150 bytes a node.\n",
    );
    Ok(())
}

fn figure_8<'a>(
    text: &mut String,
    options: &Options,
    objects: impl Iterator<Item = &'a Object>,
) -> Result<(), Failure> {
    let mut lines = Vec::new();
    for (colour, object) in objects.enumerate() {
        eprintln!("Fig. 8: {}", object.name);
        let mut points = Vec::new();
        for share in SHARES {
            let cloud = subset(object, object.cloud.len() / share, options.figures.seed)?;
            points.push([count(cloud.len()), 1e3 * build_seconds(&cloud)?]);
        }
        lines.push(Line { name: object.name.clone(), points, colour, dashed: false });
    }
    let large: &[u32] = if options.figures.quick {
        &[10_000, 40_000]
    } else {
        &[10_000, 31_623, 100_000, 316_228, 1_000_000]
    };
    let mut one = Vec::new();
    for &n in large {
        eprintln!("Fig. 8: {n} points");
        let cloud = nearmiss::PointCloud::from_positions(&bumpy_sphere(n))?;
        one.push([f64::from(n), 1e3 * build_seconds(&cloud)?]);
    }
    // The same time per point and level as at the first size.
    let first = one[0];
    let scale = first[1] / (first[0] * first[0].log2());
    let expected = one.iter().map(|p| [p[0], scale * p[0] * p[0].log2()]).collect();
    text.push_str("\n## Fig. 8: time to build\n\n![](figure-8.svg)\n\n| object | points | ms of processor time | ns a point |\n|---|--:|--:|--:|\n");
    for line in &lines {
        for [n, ms] in &line.points {
            writeln!(text, "| {} | {n} | {ms:.1} | {:.0} |", line.name, 1e6 * ms / n)?;
        }
    }
    for [n, ms] in &one {
        writeln!(text, "| bumpy sphere | {n} | {ms:.1} | {:.0} |", 1e6 * ms / n)?;
    }
    let line = |name: &str, points, colour, dashed| Line { name: name.into(), points, colour, dashed };
    let panels = [
        Panel {
            title: "Processor time of a build".into(),
            axes: [Axis::even("points"), Axis::even("ms")],
            lines,
        },
        Panel {
            title: "Processor time of a build, larger".into(),
            axes: [Axis::logarithmic("points"), Axis::logarithmic("ms")],
            lines: vec![line("bumpy sphere", one, 0, false), line("n log n", expected, 6, true)],
        },
    ];
    options.figures.save("figure-8.svg", &panels)
}

/// An object measured with all methods.
struct Measured {
    name: String,
    has_mesh: bool,
    /// Ours; the paper's leaf test and order.
    ours: Course,
    papers: Course,
    /// The sweep mean of ours over repeated poses.
    repeated: f64,
}

fn measure(object: &Object, options: &Options) -> Result<Measured, Failure> {
    eprintln!("{}: {} points", object.name, object.cloud.len());
    let scan = Scan::build(&object.cloud, &BuildOptions::default())?;
    let fresh = sweep(options.poses(), options.figures.seed, 0);
    let repeated = fresh.each_ref().map(|poses| poses[..poses.len().min(REPEATED)].to_vec());
    let mut mesh = object.mesh.as_ref().map(MeshTree::new);
    let questions = Questions::new(fresh, &scan, mesh.as_mut().map(|mesh| mesh as &mut dyn Rival));
    let few = Questions::new(repeated.clone(), &scan, mesh.as_mut().map(|mesh| mesh as &mut dyn Rival));
    let ours = course(&scan, &verdict(), &questions)?;
    let again = again_and_again(&scan, &repeated)?;
    let papers = course(&scan, &as_in_the_paper(), &few)?;
    Ok(Measured {
        name: format!("{}, {} points", object.name, scan.len()),
        has_mesh: mesh.is_some(),
        ours,
        papers,
        repeated: again,
    })
}

/// The average over all distances of mean microseconds, with the poses of a distance queried three
/// times in a row.
fn again_and_again(scan: &Scan, poses: &[Vec<Pose>; DISTANCES]) -> Result<f64, Failure> {
    let mut ours = Ours::new(scan, &verdict())?;
    let means = poses.each_ref().map(|poses| {
        let passes = (0..3).map(|_| {
            let mut column = Column::default();
            column.ask(&mut ours, poses);
            column.times.summary().mean
        });
        passes.fold(f64::INFINITY, f64::min)
    });
    Ok(means.iter().sum::<f64>() / count(DISTANCES) / 1e3)
}

fn verdict() -> CollideOptions {
    CollideOptions::estimated().with_detail(Detail::Verdict)
}

/// The paper's options: random test points at leaves (§5.3), pairs ordered by sample points on
/// either side (§5.2), coverings (§5.1).
fn as_in_the_paper() -> CollideOptions {
    verdict().with_method(Method::Sampling(Sampling::default())).with_order(Order::Sides).with_coverings(true)
}

fn course(scan: &Scan, options: &CollideOptions, questions: &Questions) -> Result<Course, Failure> {
    let plan = CollidePlan::new(options, scan, scan)?;
    let mut scratch = Scratch::default();
    let a = scan.at(&Pose::IDENTITY);
    Ok(Course::run(questions, PASSES, |pose| Pair::new(a, scan.at(pose)).collide(&plan, &mut scratch)))
}

/// Writes a figure of times and differences over distance.
fn courses_of(
    text: &mut String,
    options: &Options,
    (number, what): (u32, &str),
    all: &[Measured],
) -> Result<(), Failure> {
    let file = format!("figure-{number}.svg");
    writeln!(text, "\n## Fig. {number}: {what}\n\n![]({file})\n")?;
    text.push_str(
        "| | sweep mean, µs | repeated poses | the paper's leaf test | differ, d 0.6–2, % | undecided, % | leaf test: differ, % |\n\
         |---|--:|--:|--:|--:|--:|--:|\n",
    );
    for one in all {
        write!(
            text,
            "| {} | {:.2} | {:.2} | {:.1} ",
            one.name,
            one.ours.sweep_mean(),
            one.repeated,
            one.papers.sweep_mean()
        )?;
        if one.has_mesh {
            let (ours, papers) = (one.ours.averaged(), one.papers.averaged());
            let undecided = 100.0 * count(ours.undecided) / count(ours.tests.max(1));
            writeln!(text, "| {:.2} | {undecided:.2} | {:.2} |", ours.percent(), papers.percent())?;
        } else {
            text.push_str("| no mesh | | |\n");
        }
    }
    by_distance(text, "mean µs", all.iter().map(|one| (one.name.as_str(), one.ours.mean_times())))?;
    let with_mesh = || all.iter().filter(|one| one.has_mesh);
    by_distance(text, "differ, %", with_mesh().map(|one| (one.name.as_str(), one.ours.percents())))?;
    let pair = |of: &dyn Fn(&Course) -> Vec<[f64; 2]>, meshes: bool| {
        let mut lines = Vec::new();
        for (colour, one) in all.iter().enumerate().filter(|(_, one)| one.has_mesh || !meshes) {
            lines.push(Line { name: one.name.clone(), points: of(&one.ours), colour, dashed: false });
            let name = if lines.len() == 1 { "broken: the paper's leaf test".into() } else { String::new() };
            lines.push(Line { name, points: of(&one.papers), colour, dashed: true });
        }
        lines
    };
    let across = || Axis::even("distance of the centres, longest side 2");
    let panels = [
        Panel {
            title: format!("Time of a query: {what}"),
            axes: [across(), Axis::logarithmic("mean µs")],
            lines: pair(&Course::mean_times, false),
        },
        Panel {
            title: format!("Differences to polygons: {what}"),
            axes: [across(), Axis::even("% of tests whose root boxes intersect")],
            lines: pair(&Course::percents, true),
        },
    ];
    options.figures.save(&file, &panels)
}

/// A table with a column per line and a row per distance.
fn by_distance<'a>(
    text: &mut String,
    what: &str,
    lines: impl Iterator<Item = (&'a str, Vec<[f64; 2]>)>,
) -> Result<(), Failure> {
    let lines: Vec<_> = lines.collect();
    let names: Vec<&str> = lines.iter().map(|line| line.0).collect();
    writeln!(text, "\n| d: {what} | {} |\n|--:|{}", names.join(" | "), "--:|".repeat(names.len()))?;
    for i in 0..DISTANCES {
        let at = |points: &Vec<[f64; 2]>| {
            let found = points.iter().find(|p| p[0].to_bits() == distance(i).to_bits());
            found.map_or_else(|| "–".to_owned(), |p| format!("{:.2}", p[1]))
        };
        let row: Vec<String> = lines.iter().map(|(_, points)| at(points)).collect();
        writeln!(text, "| {} | {} |", distance(i), row.join(" | "))?;
    }
    Ok(())
}

/// Compares the time-critical mode with the unlimited one, with the paper's leaf test.
fn figure_12(text: &mut String, options: &Options, object: &Object) -> Result<(), Failure> {
    eprintln!("Fig. 12: {}", object.name);
    let scan = Scan::build(&object.cloud, &BuildOptions::default())?;
    let mut mesh = object.mesh.as_ref().map(MeshTree::new);
    let poses = sweep(options.poses(), options.figures.seed, 1);
    let questions = Questions::new(poses, &scan, mesh.as_mut().map(|mesh| mesh as &mut dyn Rival));
    let plan = CollidePlan::new(&as_in_the_paper(), &scan, &scan)?;
    let target = Duration::from_micros(options.target);
    let (mut pacer, mut scratch) = (Pacer::new(target), Scratch::default());
    let a = scan.at(&Pose::IDENTITY);
    let paced = Course::run(&questions, 1, |pose| {
        let pair = Pair::new(a, scan.at(pose));
        pacer.pace(&plan, |plan, budget| pair.within(budget).collide(plan, &mut scratch))
    });
    let free = course(&scan, &as_in_the_paper(), &questions)?;
    let micros = target.as_micros();
    writeln!(
        text,
        "\n## Fig. 12: the time-critical mode, {}, t_max {micros} µs\n\n![](figure-12.svg)\n\n\
         | | sweep mean, µs | differ, d 0.6–2, % | of all tests unfinished, % |\n|---|--:|--:|--:|",
        object.name
    )?;
    let both = [("time-critical", &paced, 0), ("not time-critical", &free, 1)];
    for (name, course, _) in both {
        let sum = course.averaged();
        let unfinished = 100.0 * count(sum.unfinished) / count(sum.tests.max(1));
        writeln!(text, "| {name} | {:.1} | {:.2} | {unfinished:.1} |", course.sweep_mean(), sum.percent())?;
    }
    by_distance(text, "mean µs", both.iter().map(|(name, course, _)| (*name, course.mean_times())))?;
    by_distance(text, "median µs", both.iter().map(|(name, course, _)| (*name, course.median_times())))?;
    by_distance(text, "differ, %", both.iter().map(|(name, course, _)| (*name, course.percents())))?;
    let across = || Axis::even("distance of the centres, longest side 2");
    let lines = |of: &dyn Fn(&Course) -> Vec<[f64; 2]>| {
        let line = |(name, course, colour): &(&str, &Course, usize)| Line {
            name: (*name).into(),
            points: of(course),
            colour: *colour,
            dashed: false,
        };
        both.iter().map(line).collect::<Vec<_>>()
    };
    // Not means, which would include the load of other programs while a query reads the clock.
    let mut times = lines(&Course::median_times);
    let level = target.as_secs_f64() * 1e6;
    times.push(Line {
        name: "t_max".into(),
        points: vec![[0.0, level], [3.0, level]],
        colour: 6,
        dashed: true,
    });
    let panels = [
        Panel {
            title: format!("Time of a query: {}", object.name),
            axes: [across(), Axis::logarithmic("median µs")],
            lines: times,
        },
        Panel {
            title: "Differences to polygons".into(),
            axes: [across(), Axis::even("% of tests whose root boxes intersect")],
            lines: lines(&Course::percents),
        },
    ];
    options.figures.save("figure-12.svg", &panels)
}
