//! Slice maps: points built per second, boxes against a map, steps of avatars, slices loaded. The
//! rivals are parry's voxels and a kd-tree on the same points.
//!
//! A scan is a file with z up, or `house` for the generated one.

use std::hint::black_box;

use kiddo::{Chebyshev, ImmutableKdTree};
use nearmiss::slices::{
    Avatar, AvatarOptions, Floor, Obstacle, Pixel, SliceBuilder, SliceFolder, SliceMap, SliceOptions,
    SlicePlan, Slide, Walker, step_each,
};
use nearmiss::{Aabb, PointCloud};
use nearmiss_benches::clock::{nanoseconds, timed};
use nearmiss_benches::object::Object;
use nearmiss_benches::sample::count;
use nearmiss_benches::{Failure, machine};
use nearmiss_testdata::arbitrary::rng;
use nearmiss_testdata::house::{house, scanned};
use parry3d::math::Vector;
use parry3d::shape::Voxels;
use rand::seq::SliceRandom;
use rand::{Rng, RngExt};

/// Size of the avatar.
const BODY: [f64; 3] = [0.6, 0.6, 1.8];

/// Frames that are timed.
const FRAMES: usize = 240;

#[derive(Debug, clap::Args)]
pub(crate) struct Asked {
    /// Scans to measure: files, or `house` for the generated one
    #[arg(value_name = "SCAN", default_values = ["house"])]
    scans: Vec<String>,
    /// Points of the generated house
    #[arg(long, value_name = "N", default_value_t = 5e6)]
    points: f64,
    /// The side of a pixel, in the units of the scan
    #[arg(long, value_name = "T", default_value_t = 0.05)]
    pixel: f64,
    /// Boxes that are tested against the map
    #[arg(long, value_name = "N", default_value_t = 100_000)]
    queries: usize,
    /// Avatars
    #[arg(long, value_name = "N", default_value_t = 10_000)]
    avatars: usize,
    /// Passes; the least time counts
    #[arg(long, value_name = "N", default_value_t = 7)]
    passes: u32,
    /// Seed of the random numbers
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
}

pub(crate) fn run(asked: &Asked) -> Result<(), Failure> {
    println!("{}", machine::description());
    for scan in &asked.scans {
        let (name, cloud) = read(scan, asked)?;
        println!("## {name}: {} points\n", cloud.len());
        building(&cloud, asked)?;
        let map = built(&cloud, &options(0.04))?;
        floors(&cloud, &map)?;
        boxes(&cloud, &map, asked)?;
        avatars(&map, asked)?;
        disk(&cloud)?;
    }
    Ok(())
}

fn read(scan: &str, asked: &Asked) -> Result<(String, PointCloud), Failure> {
    if scan == "house" {
        let quads = house();
        let area: f64 = count(scanned(&quads, 0.1, 0.0, 0).len()) * 0.01;
        let points = scanned(&quads, (area / asked.points).sqrt(), 0.003, asked.seed);
        return Ok(("the generated house".into(), PointCloud::from_positions(&points)?));
    }
    let object = Object::read(scan)?;
    Ok((object.name, object.cloud))
}

fn options(pixel: f64) -> SliceOptions {
    SliceOptions::default().with_pixel(Pixel::Side(pixel))
}

fn built(cloud: &PointCloud, options: &SliceOptions) -> Result<SliceMap, Failure> {
    let mut builder = SliceBuilder::new(&SlicePlan::new(options, &cloud.bounds())?)?;
    builder.add_cloud(cloud);
    Ok(builder.finish())
}

/// The least time of several passes, in nanoseconds, and the last result.
fn least<T>(passes: u32, mut pass: impl FnMut() -> T) -> (f64, T) {
    let (mut made, time) = timed(&mut pass);
    let mut best = nanoseconds(time);
    for _ in 1..passes {
        let (again, time) = timed(&mut pass);
        made = again;
        best = best.min(nanoseconds(time));
    }
    (best, made)
}

fn building(cloud: &PointCloud, asked: &Asked) -> Result<(), Failure> {
    let plan = SlicePlan::new(&options(asked.pixel), &cloud.bounds())?;
    let [width, height, slices] = plan.grid().counts;
    println!("Pixels of {}: {slices} slices of {width} × {height}.\n", asked.pixel);
    println!("| points in memory to map | Mpoints/s | of it points alone |\n| --- | --: | --: |");
    let mut points: Vec<[f64; 3]> = (0..cloud.len()).map(|i| cloud.point(i)).collect();
    let n = count(points.len());
    let row = |name: &str, [whole, alone]: [f64; 2]| {
        println!("| {name} | {:.1} | {:.1} |", n / whole * 1e3, n / alone * 1e3);
    };
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
        let times = pool.install(|| times(&plan, asked.passes, |builder| builder.add_cloud(cloud)));
        row(&format!("ours, {threads} threads"), times);
    }
    points.shuffle(&mut rng(asked.seed));
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build()?;
    let shuffled = pool.install(|| times(&plan, asked.passes, |builder| builder.add(&points)));
    row("ours, 2 threads, doubles in random order", shuffled);
    let singles: Vec<Vector> = (0..cloud.len()).map(|i| vector(cloud.point(i))).collect();
    let size = vector([plan.grid().pixel, plan.grid().pixel, plan.grid().slice_height]);
    let (voxels, _) = least(asked.passes.min(3), || Voxels::from_points(size, &singles));
    row("parry Voxels", [voxels; 2]);
    let flat: Vec<[f32; 3]> = singles.iter().map(|p| [p.x, p.y, p.z]).collect();
    let (tree, _) = least(asked.passes.min(3), || ImmutableKdTree::<f32, 3>::new_from_slice(&flat).is_ok());
    row("kiddo, a tree", [tree; 2]);
    println!();
    Ok(())
}

/// The time of building, and of adding the points alone, in nanoseconds.
fn times(plan: &SlicePlan, passes: u32, add: impl Fn(&mut SliceBuilder)) -> [f64; 2] {
    let mut best = [f64::INFINITY; 2];
    for _ in 0..passes {
        let (alone, whole) = timed(|| {
            let mut builder = SliceBuilder::new(plan).ok()?;
            let ((), alone) = timed(|| add(&mut builder));
            black_box(builder.finish());
            Some(alone)
        });
        let alone = alone.map_or(f64::INFINITY, nanoseconds);
        best = [best[0].min(nanoseconds(whole)), best[1].min(alone)];
    }
    best
}

#[expect(clippy::cast_possible_truncation, reason = "the rival is single precision")]
fn vector(p: [f64; 3]) -> Vector {
    let [x, y, z] = p.map(|c| c as f32);
    Vector::new(x, y, z)
}

/// Prints the share of floor pixels that count as obstacles, by both rules.
fn floors(cloud: &PointCloud, map: &SliceMap) -> Result<(), Failure> {
    println!(
        "Pixels of floor, {:.4} of noise estimated: surface all around at the same height, and nothing above for a metre.\n",
        map.about().noise
    );
    println!(
        "| rule | of a slice, % | pixels of floor | taken for obstacles, % |\n| --- | --: | --: | --: |"
    );
    let paper = built(cloud, &options(0.04).with_obstacle(Obstacle::Share(0.07)))?;
    for (name, map) in [("slope of 45°", map), ("the paper's", &paper)] {
        let [floor, wrong] = false_obstacles(map)?;
        println!(
            "| {name} | {:.1} | {floor} | {:.2} |",
            100.0 * map.about().share,
            100.0 * count(wrong) / count(floor.max(1))
        );
    }
    println!();
    Ok(())
}

/// The number of floor pixels, and of those that count as obstacles. A floor pixel has tops in at
/// least twelve of the 24 pixels around it in the same slice, half of them within a pixel's side of
/// its own. Nothing lies above the nine pixels around it for a metre.
fn false_obstacles(map: &SliceMap) -> Result<[usize; 2], Failure> {
    let grid = map.grid();
    let [width, depth, slices] = grid.counts;
    let mut counts = [0; 2];
    for s in 0..slices {
        let slice = map.slice(s)?;
        let bottom = grid.origin[2] + f64::from(s + 1) * grid.slice_height;
        for row in 2..depth - 2 {
            for column in 2..width - 2 {
                let Some(own) = slice.pixel(column, row) else { continue };
                let around = (0..25_u32)
                    .filter(|i| *i != 12)
                    .filter_map(|i| slice.pixel(column + i % 5 - 2, row + i / 5 - 2));
                let tops: Vec<u8> = around.map(|content| content.top).collect();
                let step = grid.pixel / grid.slice_height * 255.0;
                let level = tops.iter().filter(|top| f64::from(top.abs_diff(own.top)) <= step).count();
                if tops.len() < 12 || 2 * level < tops.len() {
                    continue;
                }
                let [x, y] = grid.middle(column, row);
                let above = Aabb {
                    min: [x - grid.pixel, y - grid.pixel, bottom + 1e-9],
                    max: [x + grid.pixel, y + grid.pixel, bottom + 1.0],
                };
                if !map.touches(&above)? {
                    counts[0] += 1;
                    counts[1] += usize::from(own.is_obstacle);
                }
            }
        }
    }
    Ok(counts)
}

/// A random point of the map's ground, at a given height.
fn place(rng: &mut impl Rng, bounds: &Aabb, height: f64) -> [f64; 3] {
    let top = [bounds.max[0], bounds.max[1], (bounds.max[2] - height).max(bounds.min[2] + 1e-3)];
    [0, 1, 2].map(|k| rng.random_range(bounds.min[k]..top[k]))
}

fn boxes(cloud: &PointCloud, map: &SliceMap, asked: &Asked) -> Result<(), Failure> {
    let bounds = cloud.bounds();
    let rng = &mut rng(asked.seed);
    let boxes: Vec<Aabb> = (0..asked.queries)
        .map(|_| {
            let min = place(rng, &bounds, BODY[2]);
            Aabb { min, max: [0, 1, 2].map(|k| min[k] + BODY[k]) }
        })
        .collect();
    let n = count(boxes.len());
    let grid = map.grid();
    let (touch, hits) = least(asked.passes, || {
        boxes.iter().filter(|b| map.touches(black_box(b)).is_ok_and(|hit| hit)).count()
    });
    let (query, _) = least(asked.passes, || {
        let all = boxes.iter().filter_map(|b| map.query(black_box(b), Floor::Max).ok());
        all.map(|found| found.pixels).sum::<u64>()
    });

    // The same lattice, hence the same answers.
    let shifted = |p: [f64; 3]| vector([0, 1, 2].map(|k| p[k] - grid.origin[k]));
    let points: Vec<Vector> = (0..cloud.len()).map(|i| shifted(cloud.point(i))).collect();
    let voxels = Voxels::from_points(vector([grid.pixel, grid.pixel, grid.slice_height]), &points);
    let parry_boxes: Vec<parry3d::bounding_volume::Aabb> =
        boxes.iter().map(|b| parry3d::bounding_volume::Aabb::new(shifted(b.min), shifted(b.max))).collect();
    let (parry, parry_hits) = least(asked.passes.min(3), || {
        let filled = |b: &&parry3d::bounding_volume::Aabb| {
            voxels.voxels_intersecting_local_aabb(black_box(b)).any(|voxel| !voxel.state.is_empty())
        };
        parry_boxes.iter().filter(filled).count()
    });
    drop(voxels);

    // Heights are scaled so that the box becomes a cube. Its points are those within half a side in
    // the maximum norm.
    let squeezed = |p: [f64; 3]| {
        let Vector { x, y, z } = vector([0, 1, 2].map(|k| p[k] * BODY[0] / BODY[k]));
        [x, y, z]
    };
    let flat: Vec<[f32; 3]> = (0..cloud.len()).map(|i| squeezed(cloud.point(i))).collect();
    let tree = ImmutableKdTree::<f32, 3>::new_from_slice(&flat).map_err(|e| format!("{e:?}"))?;
    let centres: Vec<[f32; 3]> = boxes.iter().map(|b| squeezed(b.centre())).collect();
    #[expect(clippy::cast_possible_truncation, reason = "the rival is single precision")]
    let half = 0.5 * BODY[0] as f32;
    let (kiddo, kiddo_hits) = least(asked.passes.min(3), || {
        let near = |c: &&[f32; 3]| {
            tree.query(black_box(*c)).nearest_one::<Chebyshev<f32>>().execute().distance <= half
        };
        centres.iter().filter(near).count()
    });
    if hits.abs_diff(parry_hits) > boxes.len() / 1000 || kiddo_hits > hits {
        return Err(
            format!("{hits} boxes touch something, {parry_hits} by parry, {kiddo_hits} by kiddo").into()
        );
    }
    println!(
        "Boxes of {BODY:?} anywhere, pixels of 0.04, one thread: ns each, and how many touch something.\n"
    );
    println!("| | ns | touching |\n| --- | --: | --: |");
    for (name, time, hits) in [
        ("ours, touches or not", touch, hits),
        ("ours, with obstacle, floor and number of pixels", query, hits),
        ("parry Voxels", parry, parry_hits),
        ("kiddo, nearest point by greatest coordinate (points, no pixels)", kiddo, kiddo_hits),
    ] {
        println!("| {name} | {:.0} | {:.3} |", time / n, count(hits) / n);
    }
    println!();
    Ok(())
}

fn avatars(map: &SliceMap, asked: &Asked) -> Result<(), Failure> {
    let options = AvatarOptions::default().with_box([BODY[0], BODY[1]], BODY[2]);
    let avatar = Avatar::new(&options)?;
    let grid = map.grid();
    let [width, depth, slices] = grid.counts.map(f64::from);
    let far = [width * grid.pixel, depth * grid.pixel, slices * grid.slice_height];
    let bounds = Aabb { min: grid.origin, max: [0, 1, 2].map(|k| grid.origin[k] + far[k]) };
    let rng = &mut rng(asked.seed);
    let mut walkers: Vec<Walker> = Vec::new();
    while walkers.len() < asked.avatars {
        let start = place(rng, &bounds, BODY[2]);
        // Only walkers that find a floor.
        walkers.extend(Walker::new(avatar, map, start).ok().filter(|walker| !walker.is_falling()));
    }
    let targets: Vec<[f64; 2]> = walkers
        .iter()
        .map(|_| {
            let [x, y, _] = place(rng, &bounds, 0.0);
            [x, y]
        })
        .collect();
    let mut steps = Vec::new();
    for (walker, target) in walkers.iter().zip(&targets) {
        steps.push(walker.clone().step(map, *target, &Slide));
    }
    println!(
        "{} avatars of {BODY:?} stepping {}, sliding along walls: {FRAMES} frames.\n",
        walkers.len(),
        options.step
    );
    println!(
        "| threads | ms a frame, median | worst | µs a step and thread | frames a second |\n| --: | --: | --: | --: | --: |"
    );
    for threads in [1, 2_u8] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.into()).build()?;
        let mut crowd = walkers.clone();
        let mut frames: Vec<f64> = Vec::new();
        for _ in 0..FRAMES {
            let ((), time) =
                timed(|| pool.install(|| step_each(map, &mut crowd, &targets, &Slide, &mut steps)));
            frames.push(nanoseconds(time) / 1e6);
        }
        frames.sort_unstable_by(f64::total_cmp);
        let (median, worst) = (frames[FRAMES / 2], frames[FRAMES - 1]);
        let each = median * 1e3 * f64::from(threads) / count(walkers.len());
        println!("| {threads} | {median:.2} | {worst:.2} | {each:.2} | {:.0} |", 1e3 / median);
    }
    println!();
    Ok(())
}

fn disk(cloud: &PointCloud) -> Result<(), Failure> {
    let folder = std::env::temp_dir().join(format!("nearmiss-slices-{}", std::process::id()));
    println!("700 pixels along the longer side, saved and loaded again.\n");
    println!(
        "| rule | slices | distinct | MB in memory | bytes a pixel | MB on disk | of memory, % | save, ms | load a slice, µs, least of 7, mean | the slowest |"
    );
    println!("| --- |{}", " --: |".repeat(9));
    let map = built(cloud, &SliceOptions::default())?;
    let (bytes, save) = timed(|| map.save(&folder));
    let bytes = count(usize::try_from(bytes?)?);
    let opened = SliceFolder::open(&folder)?;
    let mut times = Vec::new();
    for slice in 0..opened.grid().counts[2] {
        let (time, loaded) = least(7, || opened.load(slice));
        black_box(loaded?);
        times.push(time / 1e3);
    }
    std::fs::remove_dir_all(&folder)?;
    let worst = times.iter().copied().fold(0.0, f64::max);
    let memory = count(map.bytes());
    println!(
        "| slope | {} | {} | {:.1} | {:.2} | {:.2} | {:.1} | {:.0} | {:.0} | {worst:.0} |\n",
        map.slices().len(),
        map.distinct(),
        memory / 1e6,
        memory / count(map.distinct() * map.grid().area()),
        bytes / 1e6,
        100.0 * bytes / memory,
        nanoseconds(save) / 1e6,
        times.iter().sum::<f64>() / count(times.len()),
    );
    Ok(())
}
