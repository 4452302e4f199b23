//! Samples and sphere coverings: tightness, correctness, and the share of node pairs that they
//! prune.
//!
//! For some nodes of each level of each object it measures the following. The covering radius is
//! compared with the radius that the paper's growth ends with. The volume of the balls is compared
//! with that of the hulls and of the enclosures. The stored sampling radius is compared with its
//! value on projected surface points and by eq. 10.
//!
//! Then a million (`--points`) surface points are tested against the coverings of their leaves and
//! all ancestors. The last table counts the node pairs with overlapping boxes that coverings prune.
//! The program fails if a surface point lies outside.

use std::hint::black_box;

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use nearmiss::geometry::NodeId;
use nearmiss::hierarchy::{Extent, GatherScratch, NodePair, Part, Relative, ScanArrays, Tree, apart};
use nearmiss::surface::project;
use nearmiss::{BuildOptions, Pose, Scan};
use nearmiss_benches::clock::{nanoseconds, timed};
use nearmiss_benches::hulls::{Hulls, Volumes};
use nearmiss_benches::object::Object;
use nearmiss_benches::sample::count;
use nearmiss_benches::{Failure, machine, poses};
use nearmiss_testdata::arbitrary::{point_in, rng};

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Objects to measure: files, `dragon-5k`, `dragon-23k` or `bumpy:POINTS`
    #[arg(value_name = "OBJECT", default_values = ["dragon-23k"])]
    objects: Vec<String>,
    #[command(flatten)]
    effort: Effort,
}

/// Numbers of samples, points, nodes and poses to measure.
#[derive(Debug, Clone, Copy, clap::Args)]
struct Effort {
    /// Samples of a node
    #[arg(long, value_name = "N", default_value_t = BuildOptions::default().samples)]
    samples: u32,
    /// Surface points that are tested against the coverings
    #[arg(long, value_name = "N", default_value_t = 1_000_000)]
    points: usize,
    /// Nodes to measure per level
    #[arg(long, value_name = "N", default_value_t = 24)]
    nodes: usize,
    /// Random points for the volumes of a node
    #[arg(long, value_name = "N", default_value_t = 4000)]
    draws: usize,
    /// Poses at each distance of the sweep
    #[arg(long, value_name = "N", default_value_t = 4)]
    poses: usize,
    /// Seed of the random numbers
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let effort = arguments.effort;
    println!("{}", machine::description());
    let mut outside = 0;
    for name in &arguments.objects {
        let object = Object::read(name)?.scaled()?;
        let scan = Scan::build(&object.cloud, &BuildOptions::default().with_samples(effort.samples))?;
        println!("\n## {}, {} points, {} samples a node\n", object.name, scan.len(), effort.samples);
        bytes(&scan);
        let (found, radii) = surface_points(&scan, effort)?;
        outside += found;
        levels(&scan, effort, &radii);
        exclusions(&object, &scan, effort)?;
    }
    if outside > 0 {
        return Err(format!(
            "expected all surface points in the coverings, got {outside} nodes with one outside"
        )
        .into());
    }
    Ok(())
}

fn bytes(scan: &Scan) {
    let arrays = scan.arrays();
    let all = scan.bytes_of_nodes();
    println!(
        "{:.1} bytes a node, {:.1} a point for nodes\n",
        count(all) / count(arrays.tree.topology().len()),
        count(all) / count(scan.len())
    );
}

/// Projects random points near the scan onto the surface. Returns the number of nodes with a
/// surface point outside their balls, and for each node the greatest distance of its surface points
/// from its samples. A surface point belongs to the nodes that contain its nearest scan point.
fn surface_points(scan: &Scan, effort: Effort) -> Result<(usize, Vec<f64>), Failure> {
    let arrays = scan.arrays();
    let tree: ImmutableKdTree<f64, 3> = {
        let points: Vec<[f64; 3]> = scan.positions().iter().map(|p| p.map(f64::from)).collect();
        ImmutableKdTree::new_from_slice(&points).map_err(|e| format!("{e:?}"))?
    };
    let mut scratch = GatherScratch::default();
    let mut random = rng(effort.seed);
    let mut furthest_sq = vec![0.0_f64; arrays.tree.topology().len()];
    let mut found = 0;
    for i in 0.. {
        if found == effort.points || i > 4 * effort.points {
            break;
        }
        let i = i % scan.len();
        let away = point_in(&mut random, 1.5 * f64::from(arrays.radii[i]));
        let start = [0, 1, 2].map(|k| f64::from(arrays.position(i)[k]) + away[k]);
        let foot = project(start, |x| scan.evaluate_with(x, &mut scratch));
        if !foot.converged {
            continue;
        }
        found += 1;
        let nearest = tree.query(&foot.point).nearest_one::<SquaredEuclidean<f64>>().execute();
        let point = nearest.item;
        let topology = scan.topology();
        let mut next = Some(topology.leaf_of(usize::try_from(point)?));
        while let Some(id) = next.map(NodeId::index) {
            let far = arrays.samples(id).iter().map(|i| {
                (0..3).map(|k| (f64::from(arrays.position(i)[k]) - foot.point[k]).powi(2)).sum::<f64>()
            });
            furthest_sq[id] = furthest_sq[id].max(far.fold(f64::INFINITY, f64::min));
            next = next.and_then(|id| topology.parent(id)).map(|(parent, _)| parent);
        }
    }
    let radii: Vec<f64> = furthest_sq.into_iter().map(f64::sqrt).collect();
    let outside = (0..radii.len()).filter(|&id| radii[id] > f64::from(arrays.covering_radius(id))).count();
    println!("{found} surface points; {outside} of {} nodes have one outside their balls\n", radii.len());
    Ok((outside, radii))
}

/// The depth of each node.
fn depths(arrays: &ScanArrays<'_>) -> Vec<usize> {
    let mut depths = vec![0; arrays.tree.topology().len()];
    let topology = arrays.tree.topology();
    for id in topology.ids().take(topology.inner()) {
        for child in topology.children(id).iter() {
            depths[child.index()] = depths[id.index()] + 1;
        }
    }
    depths
}

fn levels(scan: &Scan, effort: Effort, projected: &[f64]) {
    let arrays = scan.arrays();
    let hulls = Hulls::new(scan);
    let depths = depths(&arrays);
    let mut random = rng(effort.seed);
    let mut share = || 0.5 + 0.5 * point_in(&mut random, 1.0)[0];
    println!(
        "Radii in sampling radii of the scan, means over a level; ratios of sums; `grown` is the paper's radius.\n"
    );
    println!(
        "| depth | nodes | certified | grown | certified/grown | too short | stored r(P′) | projected | eq. 10 | K/H | K/E |"
    );
    println!("| --: | --: | --: | --: | --: | --: | --: | --: | --: | --: | --: |");
    for depth in 0..=depths.iter().copied().max().unwrap_or(0) {
        let all: Vec<usize> = (0..depths.len()).filter(|&id| depths[id] == depth).collect();
        let step = all.len().div_ceil(effort.nodes);
        let some: Vec<usize> = all.iter().copied().step_by(step).collect();
        let mut sums = [0.0; 5];
        let (mut volumes, mut short) = (Volumes::default(), 0);
        for &id in &some {
            let grown = hulls.grown_radius(&arrays, id, &mut share);
            let own = [
                f64::from(arrays.covering_radius(id)),
                grown,
                f64::from(arrays.sampling_radius_of(id)),
                projected[id],
                f64::from(arrays.node_support_radius(id)) / scan.plan().options().support_radius,
            ];
            short += usize::from(grown < projected[id]);
            for (sum, x) in sums.iter_mut().zip(own) {
                *sum += x;
            }
            let v = hulls.volumes(&arrays, id, effort.draws, &mut share);
            volumes.balls += v.balls;
            volumes.hulls += v.hulls;
            volumes.enclosures += v.enclosures;
        }
        let [certified, grown, stored, measured, expected] =
            sums.map(|sum| sum / count(some.len()) / f64::from(arrays.sampling_radius));
        println!(
            "| {depth} | {} | {certified:.2} | {grown:.2} | {:.2} | {:.0} % | {stored:.2} | {measured:.2} | {expected:.2} | {:.2} | {:.2} |",
            all.len(),
            certified / grown,
            100.0 * count(short) / count(some.len()),
            volumes.balls / volumes.hulls,
            volumes.balls / volumes.enclosures,
        );
    }
}

/// Counts of node pairs with overlapping boxes: all of them, and those that coverings prune.
#[derive(Debug, Clone, Copy, Default)]
struct Pairs {
    inner: [usize; 2],
    leaves: [usize; 2],
    /// Pairs with overlapping enclosures, and those of them that coverings of the surface prune.
    enclosed: [usize; 2],
}

struct Descent<'a> {
    a: ScanArrays<'a>,
    b: ScanArrays<'a>,
    relative: Relative,
    /// `true` if pairs that coverings prune are not descended into.
    excludes: bool,
    pairs: Pairs,
    seen: Vec<NodePair>,
}

impl Descent<'_> {
    /// Visits the pairs of nodes with overlapping boxes; the children of both nodes replace a pair.
    fn run(&mut self) {
        let mut open = vec![NodePair::ROOTS];
        while let Some(pair) = open.pop() {
            let (a, b) = (&self.a.tree, &self.b.tree);
            if self.relative.gap(&a.bounds(pair.a), &b.bounds(pair.b)) > self.relative.slack() {
                continue;
            }
            self.seen.push(pair);
            let excluded = apart(&self.a, &self.b, pair, &self.relative, 0.0, Extent::Discs);
            let leaves = [a.topology().is_leaf(pair.a), b.topology().is_leaf(pair.b)];
            let kind = if leaves == [true; 2] { &mut self.pairs.leaves } else { &mut self.pairs.inner };
            kind[0] += 1;
            kind[1] += usize::from(excluded);
            let (of_a, of_b) = (a.enclosure(Part::Surface, pair.a), b.enclosure(Part::Surface, pair.b));
            if self.relative.gap(&of_a, &of_b) <= self.relative.slack() {
                self.pairs.enclosed[0] += 1;
                let excluded = apart(&self.a, &self.b, pair, &self.relative, 0.0, Extent::Surface);
                self.pairs.enclosed[1] += usize::from(excluded);
            }
            if leaves == [true; 2] || excluded && self.excludes {
                continue;
            }
            let below = |tree: &Tree<'_>, id: NodeId| -> Vec<NodeId> {
                let topology = tree.topology();
                if topology.is_leaf(id) { vec![id] } else { topology.children(id).iter().collect() }
            };
            for a in below(a, pair.a) {
                open.extend(below(b, pair.b).into_iter().map(|b| NodePair { a, b }));
            }
        }
    }
}

fn exclusions(object: &Object, scan: &Scan, effort: Effort) -> Result<(), Failure> {
    let near: Vec<Pose> =
        poses::near(object, 13 * effort.poses, effort.seed)?.iter().map(|near| near.pose).collect();
    let sweep: Vec<Pose> = poses::sweep(effort.poses, effort.seed, 0).into_iter().flatten().collect();
    println!("\nPairs of nodes that a descent by boxes visits, to the end; `excluded` by coverings.\n");
    println!(
        "| poses | inner pairs | excluded | leaf pairs | excluded | beyond enclosures | excluded | leaf pairs left in a descent with coverings |"
    );
    println!("| --- | --: | --: | --: | --: | --: | --: | --: |");
    let mut spent = (0, 0.0);
    for (name, poses) in [("sweep", sweep), ("near first touch", near)] {
        let mut sums = [Pairs::default(); 2];
        for pose in &poses {
            for (excludes, sum) in [false, true].into_iter().zip(&mut sums) {
                let frame = scan.frame();
                let stored = Pose::IDENTITY.with_scale(frame.scale).with_translation(frame.origin);
                let relative =
                    Relative::new(&stored.inverse().after(&pose.after(&stored)), 16.0 / frame.scale);
                let mut descent = Descent {
                    a: scan.arrays(),
                    b: scan.arrays(),
                    relative,
                    excludes,
                    pairs: *sum,
                    seen: Vec::new(),
                };
                descent.run();
                *sum = descent.pairs;
                let Descent { a, b, relative, seen, .. } = &descent;
                let parted = |pair: &&NodePair| apart(a, b, **pair, relative, 0.0, Extent::Discs);
                let (_, time) = timed(|| black_box(seen.iter().filter(parted).count()));
                spent = (spent.0 + seen.len(), spent.1 + nanoseconds(time));
            }
        }
        let [all, left] = sums;
        let percent = |[all, some]: [usize; 2]| 100.0 * count(some) / count(all.max(1));
        println!(
            "| {} {name} | {} | {:.2} % | {} | {:.2} % | {} | {:.2} % | {:.1} % |",
            poses.len(),
            all.inner[0],
            percent(all.inner),
            all.leaves[0],
            percent(all.leaves),
            all.enclosed[0],
            percent(all.enclosed),
            percent([all.leaves[0], left.leaves[0] - left.leaves[1]]),
        );
    }
    println!(
        "\nCoverings of a pair are compared in {:.0} ns, of {} in the order of the descent.",
        spent.1 / count(spent.0),
        spent.0
    );
    Ok(())
}
