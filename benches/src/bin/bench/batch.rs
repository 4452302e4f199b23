//! Many poses of a pair on several threads, and the broad phase of a world of many scans, as
//! Markdown.
//!
//! Each time is the least of several runs.

use std::ops::ControlFlow;
use std::time::Duration;

use nearmiss::{
    Aabb, Answer, BatchScratch, Bodies, BodyId, Budget, BuildOptions, CollideOptions, CollidePlan, Deadline,
    Detail, Pair, Pose, Scan, Scratch, World, each,
};
use nearmiss_benches::clock::{nanoseconds, timed};
use nearmiss_benches::object::Object;
use nearmiss_benches::sample::{Sample, Summary, count};
use nearmiss_benches::{Failure, machine, poses};
use nearmiss_testdata::arbitrary::{point_in, rng, rotation};
use parry3d::bounding_volume::Aabb as SingleAabb;
use parry3d::math::Vector;
use parry3d::partitioning::{Bvh, BvhBuildStrategy, BvhWorkspace};

/// Distances of a sweep.
const DISTANCES: usize = 13;

/// Bodies per unit of volume. A scaled object has a radius of about 1, so each body is near a
/// handful of others.
const BODIES_A_VOLUME: f64 = 0.125;

/// Poses of a batch that a deadline ends early, and the number of runs.
const SHORT_BATCH: usize = 13_000;
const REPEATS: usize = 1000;

#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// Object to measure: a file, `dragon-5k`, `dragon-23k` or `bumpy:POINTS`
    #[arg(default_value = "dragon-23k")]
    object: String,
    /// Poses of the pair
    #[arg(long, value_name = "N", default_value_t = 1_000_000)]
    poses: usize,
    /// Bodies of the world
    #[arg(long, value_name = "N", default_value_t = 1000)]
    bodies: usize,
    /// Runs; the fastest one counts
    #[arg(long, value_name = "N", default_value_t = 3)]
    runs: usize,
    /// Thread counts
    #[arg(long, value_name = "N", default_values_t = [1, 2])]
    threads: Vec<usize>,
}

impl Options {
    /// Runs `work` several times; returns the last result and the shortest time.
    fn fastest<T>(&self, mut work: impl FnMut() -> T) -> (T, Duration) {
        let (mut result, mut least) = timed(&mut work);
        for _ in 1..self.runs {
            let (again, time) = timed(&mut work);
            (result, least) = (again, least.min(time));
        }
        (result, least)
    }
}

pub(crate) fn run(options: &Options) -> Result<(), Failure> {
    println!("{}", machine::description());
    let object = Object::read(&options.object)?.scaled()?;
    let scan = Scan::build(&object.cloud, &BuildOptions::default())?;
    let plan = CollidePlan::new(&CollideOptions::estimated().with_detail(Detail::Verdict), &scan, &scan)?;
    many_poses(&object.name, &scan, &plan, options)?;
    deadlines(&scan, &plan);
    world(&object.name, &scan, &plan, options)
}

/// Measures the poses of a sweep as one batch.
fn many_poses(name: &str, scan: &Scan, plan: &CollidePlan, options: &Options) -> Result<(), Failure> {
    let sweep = poses::sweep(options.poses.div_ceil(DISTANCES), 1, 0);
    let poses: Vec<[Pose; 2]> = sweep.into_iter().flatten().map(|b| [Pose::IDENTITY, b]).collect();
    println!("## {} poses of {name}, {} points\n", poses.len(), scan.len());
    println!("| | time | µs a pose | speed-up |\n| --- | --: | --: | --: |");
    let mut scratch = Scratch::default();
    let singly = || -> Vec<Answer> {
        let ask = |pair: &[Pose; 2]| {
            let [a, b] = pair.map(|pose| scan.at(&pose));
            Pair::new(a, b).collide(plan, &mut scratch)
        };
        poses.iter().map(ask).collect()
    };
    let (expected, single) = options.fastest(singly);
    let row = |what: &str, time: Duration| {
        let micros = time.as_secs_f64() * 1e6 / count(poses.len());
        println!("| {what} | {time:.2?} | {micros:.3} | {:.2} |", single.as_secs_f64() / time.as_secs_f64());
    };
    row("loop of single queries", single);
    for &threads in &options.threads {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
        let (mut scratch, mut answers) = (BatchScratch::default(), vec![Answer::UNASKED; poses.len()]);
        let (whole, time) = pool.install(|| {
            options.fastest(|| {
                collide_all([scan, scan], &poses, plan, &Budget::UNLIMITED, (&mut answers, &mut scratch));
                answers == expected
            })
        });
        row(&format!("batch, {threads} threads"), time);
        if !whole {
            return Err("expected the answers of single queries, got others from a batch".into());
        }
    }
    println!();
    Ok(())
}

/// Measures how far a batch overruns its deadline, with all threads.
fn deadlines(scan: &Scan, plan: &CollidePlan) {
    println!("| deadline of {SHORT_BATCH} poses | answered | too late by: median | p99 | worst |");
    println!("| --- | --: | --: | --: | --: |");
    let sweep = poses::sweep(SHORT_BATCH / DISTANCES, 2, 0);
    let poses: Vec<[Pose; 2]> = sweep.into_iter().flatten().map(|b| [Pose::IDENTITY, b]).collect();
    let (mut scratch, mut answers) = (BatchScratch::default(), vec![Answer::UNASKED; poses.len()]);
    for micros in [100, 1000, 5000] {
        let (mut overruns, mut answered) = (Sample::default(), 0);
        for _ in 0..REPEATS {
            let time = Duration::from_micros(micros);
            answers.fill(Answer::UNASKED);
            let ((), taken) = timed(|| {
                let budget = Budget::UNLIMITED.with_deadline(Deadline::within(time));
                collide_all([scan, scan], &poses, plan, &budget, (&mut answers, &mut scratch));
            });
            answered += answers.iter().filter(|answer| answer.statistics.node_pairs > 0).count();
            overruns.push(nanoseconds(taken.saturating_sub(time)));
        }
        let Summary { median, p99, worst, .. } = overruns.summary();
        let [median, p99, worst] = [median, p99, worst].map(|ns| ns / 1e3);
        let answered = answered / REPEATS;
        println!("| {micros} µs | {answered} | {median:.1} µs | {p99:.1} µs | {worst:.1} µs |");
    }
    println!();
}

/// Answers the collision query of each pair of poses.
fn collide_all(
    [a, b]: [&Scan; 2],
    poses: &[[Pose; 2]],
    plan: &CollidePlan,
    budget: &Budget,
    (answers, scratch): (&mut [Answer], &mut BatchScratch),
) {
    each(answers, budget.deadline, scratch, |i, scratch| {
        let pair = Pair::new(a.at(&poses[i][0]), b.at(&poses[i][1])).within(budget);
        ControlFlow::Continue(pair.collide(plan, scratch))
    });
}

/// Measures bodies in a cube, some of which move.
fn world(name: &str, scan: &Scan, plan: &CollidePlan, options: &Options) -> Result<(), Failure> {
    let rng = &mut rng(3);
    let half = 0.5 * (count(options.bodies) / BODIES_A_VOLUME).cbrt();
    let mut pose = || rotation(rng).with_translation(point_in(rng, half));
    let [placed, moved] = [0; 2].map(|_| (0..options.bodies).map(|_| pose()).collect::<Vec<Pose>>());

    let (mut world, insert) = options.fastest(|| {
        let mut world = World::new();
        placed.iter().for_each(|pose| _ = world.insert(scan.clone(), pose));
        world
    });
    println!("## A world of {} times {name}\n", world.len());
    println!("| broad phase | time | pairs |\n| --- | --: | --: |");
    let row = |what: &str, time: Duration, pairs: usize| println!("| {what} | {time:.2?} | {pairs} |");
    let ids: Vec<BodyId> = world.ids().collect();
    row("inserting all bodies", insert, 0);

    let mut pairs = Vec::new();
    let (_, time) = options.fastest(|| world.near_pairs(Bodies::All, plan.reach(), &mut pairs));
    row("all near pairs", time, pairs.len());
    let mut some = Vec::new();
    let (_, time) = options.fastest(|| {
        ids.iter().for_each(|&id| world.near_pairs(Bodies::These(&[id]), plan.reach(), &mut some));
    });
    row("near pairs of one body, for each", time, 2 * pairs.len());

    let boxes: Vec<Aabb> = ids.iter().filter_map(|&id| world.bounds(id)).collect();
    let (brute, time) = options.fastest(|| brute_force(&boxes));
    row("brute force over boxes", time, brute);
    let rivals: Vec<SingleAabb> = boxes.iter().map(single).collect();
    let (tree, time) = options.fastest(|| Bvh::from_leaves(BvhBuildStrategy::Binned, &rivals));
    row("parry: building the tree at once", time, 0);
    let mut workspace = BvhWorkspace::default();
    let (found, time) = options.fastest(|| {
        let mut found = Vec::new();
        tree.traverse_bvtt_single_tree::<false>(&mut workspace, &mut |a, b| found.push([a, b]));
        found.len()
    });
    row("parry: all near pairs", time, found);

    let (_, time) = timed(|| {
        ids.iter().zip(&moved).for_each(|(&id, pose)| _ = world.move_to(id, pose));
    });
    row("moving all bodies anywhere", time, 0);
    let (_, time) = options.fastest(|| world.near_pairs(Bodies::All, plan.reach(), &mut pairs));
    row("all near pairs after that", time, pairs.len());
    for _ in 0..20 {
        for poses in [&placed, &moved] {
            ids.iter().zip(poses).for_each(|(&id, pose)| _ = world.move_to(id, pose));
        }
    }
    let (_, time) = options.fastest(|| world.near_pairs(Bodies::All, plan.reach(), &mut pairs));
    row("all near pairs after forty more such moves", time, pairs.len());

    println!("\n| narrow phase, its near pairs | time | hits |\n| --- | --: | --: |");
    for &threads in &options.threads {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
        let (mut scratch, mut meets) = (BatchScratch::default(), vec![false; pairs.len()]);
        let (hits, time) = pool.install(|| {
            options.fastest(|| {
                each(&mut meets, None, &mut scratch, |i, scratch| {
                    let pair = world.pair(pairs[i]);
                    ControlFlow::Continue(
                        pair.is_some_and(|pair| pair.collide(plan, scratch).verdict.is_intersecting()),
                    )
                });
                meets.iter().filter(|&&meets| meets).count()
            })
        });
        row(&format!("{threads} threads"), time, hits);
    }
    Ok(())
}

/// The number of pairs of boxes that overlap.
fn brute_force(boxes: &[Aabb]) -> usize {
    let overlap = |a: &Aabb, b: &Aabb| (0..3).all(|k| a.min[k] <= b.max[k] && b.min[k] <= a.max[k]);
    let of_one = |i: usize| boxes[..i].iter().filter(|other| overlap(&boxes[i], other)).count();
    (0..boxes.len()).map(of_one).sum()
}

#[expect(clippy::cast_possible_truncation, reason = "a rival in single precision")]
fn single(bounds: &Aabb) -> SingleAabb {
    let [min, max] = [bounds.min, bounds.max].map(|[x, y, z]| Vector::new(x as f32, y as f32, z as f32));
    SingleAabb::new(min, max)
}
