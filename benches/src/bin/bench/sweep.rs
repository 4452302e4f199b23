//! The sweep: times of ours and of the rivals in the same run, as Markdown.
//!
//! An object is a file of points, with or without a mesh, or a name that `Object::read` knows.

use std::path::PathBuf;

use nearmiss::{
    BuildOptions, CollideOptions, Detail, Evidence, GraphOptions, Metric, Order, Paths, PointKind, Scan,
};
use nearmiss_benches::asked;
use nearmiss_benches::clock::timed;
use nearmiss_benches::object::Object;
use nearmiss_benches::rivals::ours::Ours;
use nearmiss_benches::rivals::{self, Method, program};
use nearmiss_benches::sample::count;
use nearmiss_benches::sweep::{self, Track};
use nearmiss_benches::{Failure, machine, poses};
use nearmiss_testdata::instructions::levels;

#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// Objects to measure: files, `dragon-5k`, `dragon-23k` or `bumpy:POINTS`
    #[arg(required = true, value_name = "OBJECT")]
    objects: Vec<String>,
    /// Poses at each distance
    #[arg(long, value_name = "N", default_value_t = 1000)]
    per_distance: usize,
    /// Passes, each with new poses
    #[arg(long, value_name = "N", default_value_t = 1)]
    passes: u64,
    /// Poses near contact
    #[arg(long, value_name = "N", default_value_t = 1000)]
    near: usize,
    /// A rival to measure beside; repeatable
    #[arg(long = "rival", value_name = "NAME", value_parser = rivals::NAMES)]
    rivals: Vec<String>,
    /// A program that times rivals of other languages, built by `benches/rivals/build.sh`
    #[arg(long, value_name = "FILE")]
    program: Option<PathBuf>,
    /// Also measure queries for a witness
    #[arg(long)]
    witness: bool,
    /// Also measure queries for certified evidence
    #[arg(long)]
    certified: bool,
    /// Also measure each available instruction set
    #[arg(long)]
    levels: bool,
    /// Also measure with cold caches
    #[arg(long)]
    evicted: bool,
    /// The order in which node pairs are visited
    #[arg(long, value_parser = asked::orders())]
    order: Option<Order>,
    /// The kernel; `geodesic` adds the object prepared for the geodesic kernel
    #[arg(long, default_value = "euclidean", value_parser = asked::kernels())]
    kernel: Metric,
    /// Seed of the random numbers
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Threads that preprocess the scan; 0 means all
    #[arg(long, value_name = "N", default_value_t = 0)]
    threads: usize,
}

pub(crate) fn run(options: &Options) -> Result<(), Failure> {
    println!("{}", machine::description());
    options.objects.iter().try_for_each(|source| measure(source, options))
}

fn measure(source: &str, options: &Options) -> Result<(), Failure> {
    let object = Object::read(source)?.scaled()?;
    let build = BuildOptions::default().with_threads(options.threads);
    let (scan, time) = timed(|| Scan::build(&object.cloud, &build));
    let scan = scan?;
    let along = match options.kernel {
        Metric::Euclidean => None,
        Metric::Geodesic => Some(for_geodesic(&object, &scan)?),
    };
    let asked = CollideOptions::estimated();
    let asked = options.order.map_or(asked, |order| asked.with_order(order));
    let verdict = asked.with_detail(Detail::Verdict);
    let mut methods: Vec<Box<dyn Method + '_>> = vec![Box::new(Ours::new(&scan, &verdict)?)];
    if options.certified {
        methods.push(Box::new(Ours::new(&scan, &verdict.with_evidence(Evidence::Certified))?));
    }
    if options.witness {
        methods.push(Box::new(Ours::new(&scan, &asked)?));
    }
    if options.levels {
        for level in levels() {
            methods.push(Box::new(Ours::new(&scan, &verdict)?.by_level(level)));
        }
    }
    if options.evicted {
        methods.push(Box::new(Ours::new(&scan, &verdict)?.evicted()));
    }
    if let Some(along) = &along {
        methods.push(Box::new(Ours::new(along, &verdict)?));
        if options.witness {
            methods.push(Box::new(Ours::new(along, &asked)?));
        }
    }
    let mut left_out = Vec::new();
    for name in &options.rivals {
        match rivals::rival(name, &object)? {
            Some(rival) => methods.push(rival),
            None => left_out.push(name.as_str()),
        }
    }
    let mut tracks = sweep::tracks(&methods);
    let warm = poses::sweep(20, options.seed, u64::from(u32::MAX));
    let mut all = Vec::new();
    for number in 0..options.passes {
        let poses = poses::sweep(options.per_distance, options.seed, number);
        sweep::pass(&mut methods, &mut tracks, &poses, &warm);
        all.extend(poses.into_iter().flatten());
    }
    let near = poses::near(&object, options.near, options.seed)?;
    sweep::near(&mut methods, &mut tracks, &near);
    if let Some(program) = &options.program {
        all.extend(near.iter().map(|near| near.pose));
        let engines = program::run(program, &object, &all, false)?;
        for engine in &engines {
            println!("{} prepared in {:.0} ms", engine.name, engine.prepared);
        }
        let passes = usize::try_from(options.passes)?;
        tracks.extend(engines.iter().map(|engine| Track::of_engine(engine, passes, options.per_distance)));
    }

    println!(
        "## {}\n\n{} points, r {:.5}, {:.0} points a unit of volume; prepared in {time:.2?}; {} poses a \
         distance, {} passes, {} near contact\n",
        object.name,
        object.cloud.len(),
        object.r,
        object.density(),
        options.per_distance,
        options.passes,
        near.len(),
    );
    if !left_out.is_empty() {
        println!("Skipped, because they need a mesh: {}\n", left_out.join(", "));
    }
    print_summary(&tracks);
    tracks.iter().for_each(print_distances);
    Ok(())
}

/// Angle in degrees from which a normal counts as turned.
const TURNED: f32 = 5.0;

/// Prepares the scan for the geodesic kernel; prints the time and the results.
fn for_geodesic(object: &Object, scan: &Scan) -> Result<Scan, Failure> {
    let scan = scan.clone().with_graph(
        &object.cloud,
        &GraphOptions::default().with_close_pairs(Some(Paths::Rebuilt)),
        None,
    )?;
    let (along, time) = timed(|| scan.clone().with_geodesic_kernel());
    let along = along?;
    let turned = |(p, q): &(&[f32; 3], &[f32; 3])| {
        let cosine: f32 = (0..3).map(|k| p[k] * q[k]).sum();
        cosine.abs() < TURNED.to_radians().cos()
    };
    let count_turned = scan.normals().iter().zip(along.normals()).filter(turned).count();
    println!(
        "for the geodesic kernel in {time:.2?}, {:.2} µs a point; {:.2} % of the normals turned by more than {TURNED}°; usable \
         {:.2} % and {:.2} %, ambiguous {:.2} % and {:.2} %, isolated {:.2} % and {:.2} %\n",
        1e6 * time.as_secs_f64() / count(scan.len()),
        100.0 * count(count_turned) / count(scan.len()),
        100.0 * scan.usable(),
        100.0 * along.usable(),
        100.0 * scan.share(PointKind::Noisy),
        100.0 * along.share(PointKind::Noisy),
        100.0 * scan.share(PointKind::Stray),
        100.0 * along.share(PointKind::Stray),
    );
    Ok(along)
}

fn print_summary(tracks: &[Track]) {
    println!("| µs | sweep mean | worst d | mean, d ≤ 1.5 | near contact: mean | median | p99 | hits |");
    println!("| --- | --: | --: | --: | --: | --: | --: | --: |");
    for track in tracks {
        let (worst, mean) = track.worst_distance();
        let near = track.near.times.summary();
        println!(
            "| {} | {:.3} | {:.3} (d = {}) | {:.3} | {:.3} | {:.3} | {:.3} | {} |",
            track.name,
            track.sweep_mean() / 1e3,
            mean / 1e3,
            poses::distance(worst),
            track.inner_mean() / 1e3,
            near.mean / 1e3,
            near.median / 1e3,
            near.p99 / 1e3,
            track.near.hits,
        );
    }
    if tracks.iter().any(|track| track.pass_means.len() > 1) {
        println!("\nsweep means of the passes, µs:\n");
        for track in tracks {
            let means: Vec<String> = track.pass_means.iter().map(|m| format!("{:.3}", m / 1e3)).collect();
            println!("* {}: {}", track.name, means.join(" "));
        }
    }
    println!();
}

fn print_distances(track: &Track) {
    println!("### {}\n", track.name);
    println!("| d | mean µs | median | p99 | worst | hits | evaluations | node pairs |");
    println!("| --: | --: | --: | --: | --: | --: | --: | --: |");
    for (i, column) in track.columns.iter().enumerate() {
        let all = column.times.summary();
        println!(
            "| {} | {:.3} | {:.3} | {:.3} | {:.3} | {} of {} | {:.2} | {:.1} |",
            poses::distance(i),
            all.mean / 1e3,
            all.median / 1e3,
            all.p99 / 1e3,
            all.worst / 1e3,
            column.hits,
            column.times.len(),
            column.mean_evaluations(),
            column.mean_node_pairs(),
        );
    }
    println!();
}
