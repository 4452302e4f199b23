//! Results of proximity graphs: oriented normals, close pairs, coarser levels, the geodesic kernel.
//! Speed, size and accuracy.

use std::hint::black_box;

use nearmiss::graph::{
    ClosePairs, GeodesicKernel, GeodesicScratch, GraphOptions, KernelScratch, LevelScratch, Levels, Network,
    Paths, PointGraph, Sides, edge_lengths, orient,
};
use nearmiss::hierarchy::GatherScratch;
use nearmiss::surface::project;
use nearmiss::{BuildOptions, Evaluation, PointCloud, Scan, Status, TriangleMesh};
use nearmiss_benches::clock::{processor_time, timed};
use nearmiss_benches::object::Object;
use nearmiss_benches::sample::count;
use nearmiss_benches::{Failure, machine};
use nearmiss_testdata::arbitrary::{point_in, rng};
use nearmiss_testdata::oracle::{Signs, falls, winding};
use nearmiss_testdata::shapes::{Order, Sampling, plates};

/// Runs `work` `runs` times; returns its last result and its least time in seconds.
fn least<T>(runs: usize, mut work: impl FnMut() -> T) -> (T, f64) {
    let (mut result, mut best) = timed(&mut work);
    for _ in 1..runs {
        let (again, time) = timed(&mut work);
        (result, best) = (again, best.min(time));
    }
    (result, best.as_secs_f64())
}

fn support_radii(scan: &Scan) -> Vec<f32> {
    scan.radii().iter().map(|&r| scan.plan().support_radius(r)).collect()
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Sums of the normals of the faces around each vertex.
fn vertex_normals(mesh: &TriangleMesh) -> Vec<[f64; 3]> {
    let mut normals = vec![[0.0; 3]; mesh.vertices().len()];
    for corners in mesh.triangles() {
        let [a, b, c] = corners.map(|i| mesh.vertices()[i as usize]);
        let (u, v) = ([0, 1, 2].map(|k| b[k] - a[k]), [0, 1, 2].map(|k| c[k] - a[k]));
        let cross = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        for i in corners {
            for k in 0..3 {
                normals[*i as usize][k] += cross[k];
            }
        }
    }
    normals
}

/// Orients the normals and compares them with the mesh, if there is one.
fn orientation(object: &Object, scan: &Scan, graph: &PointGraph, runs: usize) {
    let ((normals, found), time) = least(runs, || {
        let mut normals = scan.normals().to_vec();
        let found = orient(graph.edges(), scan.positions(), scan.radii(), Sides::default(), &mut normals);
        (normals, found)
    });
    let doubtful = found.confidence.iter().filter(|&&c| c < 128).count();
    let largest = found.parts.iter().max_by_key(|part| part.points);
    println!(
        "* orientation: {:.2} µs a point; {} parts, {} of one side; doubtful {:.2} %; the largest by {:?}",
        time * 1e6 / count(scan.len()),
        found.parts.len(),
        found.parts.iter().filter(|part| !part.orientable).count(),
        100.0 * count(doubtful) / count(scan.len()),
        largest.map(|part| part.decision),
    );
    if let Some(mesh) = &object.mesh {
        against(mesh, scan, &normals, &found.confidence);
    }
}

/// Counts normals that point into the mesh, and normals opposed to the sum of the face normals
/// around their vertex.
fn against(mesh: &TriangleMesh, scan: &Scan, normals: &[[f32; 3]], confidence: &[u8]) {
    let mut at_vertices = vec![[0.0; 3]; mesh.vertices().len()];
    for (normal, &source) in normals.iter().zip(scan.source()) {
        at_vertices[source as usize] = normal.map(f64::from);
    }
    let falls = falls(mesh, &at_vertices);
    let signs = Signs::of(&falls);
    let (mut folded, mut sure) = (0, 0);
    for (i, &source) in scan.source().iter().enumerate() {
        if Signs::is_wrong(falls[source as usize]) {
            let (p, n) = (mesh.vertices()[source as usize], normals[i].map(f64::from));
            let r = f64::from(scan.radii()[i]) / scan.frame().scale;
            let at = |side: f64| winding(mesh, [0, 1, 2].map(|k| p[k] + side * r * n[k]));
            folded += usize::from(!Signs::is_wrong(at(-1.0) - at(1.0)));
            sure += usize::from(confidence[i] >= 128);
        }
    }
    println!(
        "* against the mesh: {} of {} wrong, {:.3} % right; {sure} of the wrong ones not doubtful, {folded} where the mesh comes \
         back within a sampling radius",
        signs.wrong,
        signs.judged,
        100.0 * signs.right(),
    );
    let expected = vertex_normals(mesh);
    let sums =
        expected.iter().zip(&at_vertices).filter(|(sum, n)| dot(**sum, **sum) > 0.0 && dot(**n, **n) > 0.0);
    let by_sums: Vec<usize> = sums.map(|(sum, n)| usize::from(dot(*sum, *n) <= 0.0)).collect();
    println!(
        "* against sums of the normals of its faces: {} of {} wrong",
        by_sums.iter().sum::<usize>(),
        by_sums.len()
    );
}

fn close_pairs(scan: &Scan, graph: &PointGraph, runs: usize) {
    let n = count(scan.len());
    let support_radii = support_radii(scan);
    let lengths = edge_lengths(graph.edges(), scan.positions());
    let network = Network::new(graph.edges(), &lengths);
    for paths in [Paths::Rebuilt, Paths::Stored] {
        let spent = processor_time();
        let (pairs, time) = least(runs, || {
            let lengths = edge_lengths(graph.edges(), scan.positions());
            ClosePairs::build(Network::new(graph.edges(), &lengths), &support_radii, paths)
        });
        println!(
            "* close pairs, paths {paths:?}: {:.0} points/s, {:.2} µs of processor time a point; {:.1} close pairs per point, {:.0} \
             bytes a point",
            n / time,
            (processor_time() - spent).as_secs_f64() * 1e6 / n / count(runs),
            count(pairs.pair_count()) / n,
            count(pairs.byte_len()) / n
        );
        paths_of(&pairs, network, runs);
    }
}

/// Measures paths to the furthest close point of each point, and the error of the stored distances.
fn paths_of(pairs: &ClosePairs, network: Network<'_>, runs: usize) {
    let ends: Vec<([u32; 2], f32)> = (0..pairs.len())
        .step_by(pairs.len() / 4096 + 1)
        .filter_map(|i| Some((u32::try_from(i).ok()?, pairs.of(i).last()?)))
        .map(|(i, close)| ([i, close.point], close.distance))
        .collect();
    let (mut scratch, mut path) = (GeodesicScratch::default(), Vec::new());
    let ((points, off), time) = least(runs, || {
        let (mut points, mut off) = (0, 0.0_f32);
        for &(ends, distance) in &ends {
            let length = pairs.path(network, ends, &mut scratch, &mut path).unwrap_or(f32::INFINITY);
            points += path.len();
            off = off.max((distance - length).abs() / length.max(f32::MIN_POSITIVE));
        }
        (points, off)
    });
    let each = count(ends.len());
    println!(
        "* paths to the furthest: {:.1} points, {:.0} ns; distances off by {off:.1e} at most",
        count(points) / each,
        time * 1e9 / each
    );
}

/// Builds the levels and compares their distances with those of a search of the whole graph.
fn levels(scan: &Scan, graph: &PointGraph, runs: usize, pairs: usize) {
    let n = scan.len();
    let lengths = edge_lengths(graph.edges(), scan.positions());
    let network = Network::new(graph.edges(), &lengths);
    let (levels, time) = least(runs, || Levels::build(network, scan.radii()));
    let factor = scan.plan().support_radius(1.0);
    let maps = levels.cells().iter().map(|cells| {
        let support_radii: Vec<f32> = cells.radii().iter().map(|r| factor * r).collect();
        ClosePairs::build(cells.network(), &support_radii, Paths::Rebuilt).byte_len()
    });
    let maps: usize = maps.sum();
    let cells: Vec<String> = levels.cells().iter().map(|cells| cells.len().to_string()).collect();
    println!(
        "* levels of {} cells: {:.0} points/s; {:.0} bytes a point, their close pairs {:.0}",
        cells.join(", "),
        count(n) / time,
        count(levels.byte_len()) / count(n),
        count(maps) / count(n),
    );
    let (mut scratch, mut whole) = (LevelScratch::default(), GeodesicScratch::default());
    let [mut excess, mut worst, mut reached, mut reached_whole, mut ours, mut theirs, mut found] =
        [0.0_f64; 7];
    for k in 0..pairs {
        let ends = [k * 7919 % n, (k * 104_729 + n / 2) % n].map(|i| u32::try_from(i).unwrap_or(0));
        let (distance, time) = timed(|| levels.distance(network, ends[0], ends[1], &mut scratch));
        let (exact, time_whole) = timed(|| whole.distance(network, ends[0], ends[1]));
        ours += time.as_secs_f64();
        theirs += time_whole.as_secs_f64();
        reached += count(scratch.reached());
        reached_whole += count(whole.reached());
        if let (Some(distance), Some(exact)) = (distance, exact.filter(|d| *d > 0.0)) {
            let over = (f64::from(distance) / f64::from(exact) - 1.0).max(0.0);
            (excess, worst, found) = (excess + over, worst.max(over), found + 1.0);
        }
    }
    println!(
        "* {found} distances over the whole: {:.3} % too long in the mean, {:.2} % at worst; {:.2} of the points that Dijkstra's \
         algorithm reaches, {:.0} µs for its {:.0}",
        100.0 * excess / found,
        100.0 * worst,
        reached / reached_whole,
        ours * 1e6 / count(pairs),
        theirs * 1e6 / count(pairs),
    );
}

/// Measures one evaluation near points of the scan, with either kernel.
fn kernels(scan: &Scan, graph: &PointGraph, runs: usize) {
    let lengths = edge_lengths(graph.edges(), scan.positions());
    let pairs =
        ClosePairs::build(Network::new(graph.edges(), &lengths), &support_radii(scan), Paths::Rebuilt);
    let kernel = GeodesicKernel::new(scan.plan(), scan.positions(), scan.radii(), graph.edges(), &pairs);
    let rng = &mut rng(1);
    let places: Vec<(usize, [f64; 3])> = (0..4096)
        .map(|k| {
            let i = k * 7919 % scan.len();
            let (p, r) = (scan.positions()[i].map(f64::from), f64::from(scan.radii()[i]));
            let d = point_in(rng, 0.1 * r);
            (i, [0, 1, 2].map(|k| p[k] + d[k]))
        })
        .collect();
    let (mut scratch, mut gather) = (KernelScratch::default(), GatherScratch::default());
    let (_, geodesic) = least(runs, || {
        let at =
            places.iter().map(|&(i, x)| kernel.evaluate(x, u32::try_from(i).unwrap_or(0), &mut scratch).f);
        black_box(at.sum::<f64>())
    });
    let (_, at_points) = least(runs, || {
        let at = places.iter().map(|&(i, _)| {
            let x = scan.positions()[i].map(f64::from);
            kernel.evaluate(x, u32::try_from(i).unwrap_or(0), &mut scratch).f
        });
        black_box(at.sum::<f64>())
    });
    let (_, straight) = least(runs, || {
        black_box(places.iter().map(|&(i, x)| scan.evaluate_near(i, x, &mut gather).f).sum::<f64>())
    });
    let each = 1e9 / count(places.len());
    println!(
        "* f near a point: geodesic {:.0} ns, at one {:.0} ns; straight {:.0} ns",
        geodesic * each,
        at_points * each,
        straight * each
    );
}

fn measure(object: &Object, runs: usize, pairs: usize) -> Result<(), Failure> {
    let scan = Scan::build(&object.cloud, &BuildOptions::default())?;
    let graph = PointGraph::build(scan.positions(), &GraphOptions::default())?;
    let edges = count(graph.edges().edge_count()) / count(scan.len());
    println!("\n## {}, {} points, {edges:.1} edges a point\n", object.name, scan.len());
    orientation(object, &scan, &graph, runs);
    close_pairs(&scan, &graph, runs);
    levels(&scan, &graph, runs, pairs);
    kernels(&scan, &graph, runs);
    Ok(())
}

/// Distances of the recovered sheets from the plates, in bandwidths, and the number of projections
/// that reach one.
#[derive(Debug, Clone, Copy, Default)]
struct Recovered {
    off: f64,
    found: usize,
}

impl Recovered {
    /// Projects a point of a plate onto the recovered surface.
    fn add(&mut self, start: [f64; 3], at: impl FnMut([f64; 3]) -> Evaluation, h: f64) {
        let mut at = at;
        let foot = project(start, &mut at);
        if foot.converged && at(foot.point).status == Status::Ok {
            self.off += (foot.point[2] - start[2]).abs() / h;
            self.found += 1;
        }
    }
}

/// Reconstructs two parallel plates, evenly or randomly sampled, `gap` bandwidths apart, with both
/// kernels.
fn two_plates(gap: f64, order: Order) -> Result<[Recovered; 2], Failure> {
    const SPACING: f64 = 0.05;
    let sample = |distance: f64| {
        let sampling = Sampling { spacing: SPACING, noise: 0.0, order, seed: 1 };
        PointCloud::from_positions(&plates(2.0, 2.0, distance).sample(sampling).points)
    };
    let apart = Scan::build(&sample(1.0)?, &BuildOptions::default())?;
    let mut bandwidths: Vec<f32> = apart.radii().iter().map(|&r| apart.plan().bandwidth(r)).collect();
    bandwidths.sort_unstable_by(f32::total_cmp);
    let h = f64::from(bandwidths[bandwidths.len() / 2]) / apart.frame().scale;
    let scan = Scan::build(&sample(gap * h)?, &BuildOptions::default())?;
    let h = h * scan.frame().scale;
    let graph = PointGraph::build(scan.positions(), &GraphOptions::default())?;
    let lengths = edge_lengths(graph.edges(), scan.positions());
    let pairs =
        ClosePairs::build(Network::new(graph.edges(), &lengths), &support_radii(&scan), Paths::Rebuilt);
    let kernel = GeodesicKernel::new(scan.plan(), scan.positions(), scan.radii(), graph.edges(), &pairs);
    let (mut scratch, mut gather) = (KernelScratch::default(), GatherScratch::default());
    let mut recovered = [Recovered::default(); 2];
    let inner = 0.6 * scan.frame().scale;
    let middle = scan.positions().iter().fold([0.0; 3], |s, p| [0, 1, 2].map(|k| s[k] + f64::from(p[k])));
    let middle = middle.map(|c| c / count(scan.len()));
    for i in 0..scan.len() {
        let start = scan.positions()[i].map(f64::from);
        if (0..2).any(|k| (start[k] - middle[k]).abs() > inner) {
            continue;
        }
        recovered[0].add(start, |x| scan.evaluate_near(i, x, &mut gather), h);
        recovered[1].add(start, |x| kernel.evaluate(x, u32::try_from(i).unwrap_or(0), &mut scratch), h);
    }
    Ok(recovered)
}

fn plates_table() -> Result<(), Failure> {
    println!("| s/h | order | straight: off by, of h | found | geodesic: off by, of h | found |");
    println!("| --: | --- | --: | --: | --: | --: |");
    for order in [Order::Regular, Order::Random] {
        for gap in [1.5, 1.75, 2.0, 2.25, 2.5, 3.0, 3.5, 4.0] {
            let cells = two_plates(gap, order)?.map(|sheets| match sheets.found {
                0 => "– | 0".into(),
                found => format!("{:.4} | {found}", sheets.off / count(found)),
            });
            println!("| {gap} | {order:?} | {} |", cells.join(" | "));
        }
    }
    Ok(())
}

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Objects to measure: files, `dragon-5k`, `dragon-23k` or `bumpy:POINTS`
    #[arg(value_name = "OBJECT", default_values = ["dragon-5k", "dragon-23k"])]
    objects: Vec<String>,
    /// Runs; the fastest one counts
    #[arg(long, value_name = "N", default_value_t = 3)]
    runs: usize,
    /// Pairs of points whose distances are compared
    #[arg(long, value_name = "N", default_value_t = 200)]
    pairs: usize,
    /// Compare both kernels on two parallel plates instead
    #[arg(long)]
    plates: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    println!("{}", machine::description());
    if arguments.plates {
        return plates_table();
    }
    for object in &arguments.objects {
        measure(&Object::read(object)?, arguments.runs.max(1), arguments.pairs.max(1))?;
    }
    Ok(())
}
