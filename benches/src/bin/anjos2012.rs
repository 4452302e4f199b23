//! Tables 1 to 3 and Figs 5 and 6 of dos Anjos, Pereira & Oliveira 2012 (S4) for comparable scenes, with the paper's figures beside, and
//! what §4 says of round columns: `anjos2012.md` and an SVG in a folder.
//!
//! `anjos2012 -o FOLDER [--data FOLDER] [--seed N] [--quick]`
//!
//! Without the folder of scenes a generated house stands in for them.
#![expect(clippy::print_stdout, clippy::print_stderr, reason = "a program for people")]

use std::fmt::Write;
use std::path::Path;

use kiddo::{Chebyshev, ImmutableKdTree};
use nearmiss::slices::{
    Avatar, AvatarOptions, Back, CacheOptions, Ended, Obstacle, Pixel, Route, SliceBuilder, SliceCache,
    SliceFolder, SliceMap, SliceOptions, SlicePlan, StoreError, Up,
};
use nearmiss::{Aabb, PointCloud, TriangleMesh};
use nearmiss_benches::arguments::Arguments;
use nearmiss_benches::clock::{nanoseconds, now, timed};
use nearmiss_benches::counting::Counting;
use nearmiss_benches::figures::FigureOptions;
use nearmiss_benches::plot::{Axis, Line, Panel};
use nearmiss_benches::sample::count;
use nearmiss_benches::{Failure, machine};
use nearmiss_testdata::house::{COLUMN, COLUMNS, STAIRS, house, scanned, triangles};

#[global_allocator]
static ALLOCATOR: Counting = Counting::new();

/// The paper's resolution, and how many slices Fig. 5 has in memory.
const PIXELS: u32 = 700;
const LOADED: usize = 6;

/// A scene, what of the paper it stands for, and what the paper has for that: points given and sampled, seconds, MB.
struct Scene {
    name: &'static str,
    file: &'static str,
    up: Up,
    stands_for: &'static str,
    paper: [&'static str; 4],
}

const SCENES: [Scene; 6] = [
    Scene {
        name: "nav-test",
        file: "nav-test.obj",
        up: Up::Y,
        stands_for: "Street",
        paper: ["281,169", "7,142,361", "114.75", "598.02"],
    },
    Scene {
        name: "dungeon",
        file: "dungeon.obj",
        up: Up::Y,
        stands_for: "Church",
        paper: ["26,721", "6,475,125", "58.14", "536.58"],
    },
    Scene {
        name: "sponza",
        file: "sponza.obj",
        up: Up::Y,
        stands_for: "Sibenik",
        paper: ["47,658", "5,199,093", "78.87", "532.48"],
    },
    Scene {
        name: "pillars-145k",
        file: "pillars-145k.pcd",
        up: Up::Z,
        stands_for: "Columns",
        paper: ["143,591", "2,612,303", "42.92", "241.66"],
    },
    Scene {
        name: "room-113k",
        file: "../scans/room-113k-compressed.pcd",
        up: Up::Z,
        stands_for: "Room",
        paper: ["271,731", "271,731", "6.96", "67.58"],
    },
    Scene {
        name: TWO_STOREYS,
        file: "two-storey-scan-zup-753k.ply",
        up: Up::Z,
        stands_for: "Entrance (Batalha)",
        paper: ["580,062", "580,062", "13.90", "122.88"],
    },
];

const TWO_STOREYS: &str = "two-storey-scan";

/// Up the two flights of the scan's staircase, and down again.
const START: [f64; 3] = [-9.79, -4.4, -1.3];
const UP: [[f64; 2]; 7] = [
    [-10.9, -4.35],
    [-12.5, -4.17],
    [-14.2, -4.05],
    [-14.15, -2.55],
    [-13.5, -2.55],
    [-10.3, -2.9],
    [-9.0, -3.0],
];

enum Source {
    Points(PointCloud),
    Mesh(TriangleMesh),
}

fn main() -> Result<(), Failure> {
    let mut arguments = Arguments::of_process();
    let options = FigureOptions::take(&mut arguments, "anjos2012", [1, 1])?;
    arguments.nothing_left()?;
    let mut text = format!(
        "# Dos Anjos, Pereira & Oliveira 2012, Tables 1 to 3, Figs 5 and 6\n\n{}\n",
        machine::description()
    );
    let folder = options.out.join("maps");
    let walked = tables(&mut text, &options, &folder)?;
    walk(&mut text, &options, &walked)?;
    columns(&mut text, &options)?;
    std::fs::remove_dir_all(&folder)?;
    let path = options.out.join("anjos2012.md");
    std::fs::write(&path, text)?;
    println!("{}", path.display());
    Ok(())
}

/// What is walked in: its map, its points, and the way.
struct Walked {
    folder: SliceFolder,
    cloud: PointCloud,
    route: Route,
    /// Of making the map, in seconds.
    seconds: f64,
}

fn tables(text: &mut String, options: &FigureOptions, folder: &Path) -> Result<Walked, Failure> {
    text.push_str(
        "## Tables 1 and 2, Fig. 5\n\nFrom points or triangles in memory to slices on disk, 700 pixels along the longer side, σ = 3 t, the paper's rule (7 %); \
         memory above the input at its peak. The paper's own figures in brackets, of the scene that ours stands for.\n\n\
         | scene | for | type | points or corners | with samples | seconds | MB, peak | MB of 6 slices in memory | all slices | distinct | MB on disk |\n\
         | --- | --- | --- | --: | --: | --: | --: | --: | --: | --: | --: |\n",
    );
    let mut scan = None;
    if let Some(data) = &options.data {
        for scene in &SCENES {
            let path = data.join("buildings").join(scene.file);
            eprintln!("{}", path.display());
            let model = nearmiss::io::read(&path, None)?;
            if scene.name == TWO_STOREYS {
                scan = Some(model.cloud.clone());
            }
            let source = model.mesh.map_or(Source::Points(model.cloud), Source::Mesh);
            row(text, scene, &source, folder)?;
        }
    }
    let quads = house();
    let generated =
        Scene { name: "generated house", file: "", up: Up::Z, stands_for: "–", paper: ["–"; 4] };
    row(text, &generated, &Source::Mesh(triangles(&quads)), folder)?;
    let spacing = if options.quick { 0.05 } else { 0.02 };
    let y = 0.5 * (STAIRS[0] + STAIRS[1]);
    let (cloud, route) = match scan {
        Some(cloud) => {
            let back = UP.iter().rev().skip(1).copied().chain([[START[0], START[1]]]);
            (cloud, Route { start: START, points: UP.into_iter().chain(back).collect() })
        }
        None => {
            let points = vec![[1.2, y], [8.0, y], [8.0, 9.5], [8.0, y], [1.2, y]];
            let cloud = PointCloud::from_positions(&scanned(&quads, spacing, 0.003, options.seed))?;
            (cloud, Route { start: [1.2, 8.0, 0.2], points })
        }
    };
    let place = folder.join("walked");
    let plan = SlicePlan::new(&SliceOptions::default().with_pixel(Pixel::Count(PIXELS)), &cloud.bounds())?;
    let (saved, time) =
        timed(|| made(&plan, &Source::Points(cloud.clone())).map(|(map, _)| map.save(&place)));
    saved??;
    let folder = SliceFolder::open(&place)?;
    Ok(Walked { folder, cloud, route, seconds: time.as_secs_f64() })
}

fn made(plan: &SlicePlan, source: &Source) -> Result<(SliceMap, u64), Failure> {
    let mut builder = SliceBuilder::new(plan)?;
    match source {
        Source::Points(cloud) => builder.add_cloud(cloud),
        Source::Mesh(mesh) => _ = builder.add_mesh(mesh),
    }
    let [points, _] = builder.counts();
    Ok((builder.finish(), points))
}

fn row(text: &mut String, scene: &Scene, source: &Source, folder: &Path) -> Result<(), Failure> {
    let (bounds, given, kind) = match source {
        Source::Points(cloud) => (cloud.bounds(), cloud.len(), "points"),
        Source::Mesh(mesh) => {
            let corners = mesh.triangles().iter().flatten().map(|&v| mesh.vertices()[v as usize]);
            (Aabb::of(corners), mesh.vertices().len(), "polygons")
        }
    };
    let options = SliceOptions::default()
        .with_pixel(Pixel::Count(PIXELS))
        .with_up(scene.up)
        .with_obstacle(Obstacle::Share(0.07));
    let plan = SlicePlan::new(&options, &bounds)?;
    let place = folder.join(scene.name);
    let before = ALLOCATOR.live();
    ALLOCATOR.restart();
    let (done, time) = timed(|| {
        let (map, points) = made(&plan, source)?;
        let bytes = map.save(&place)?;
        Ok::<_, Failure>((map, points, bytes))
    });
    let (map, points, bytes) = done?;
    let megabytes = |bytes: usize| count(bytes) / 1e6;
    let peak = megabytes(ALLOCATOR.peak() - before);
    let image = map.slices().iter().flatten().map(|slice| slice.bytes()).max().unwrap_or(0);
    let [theirs_given, theirs_sampled, theirs_seconds, theirs_memory] = scene.paper;
    writeln!(
        text,
        "| {} | {} | {kind} | {given} [{theirs_given}] | {points} [{theirs_sampled}] | {:.2} [{theirs_seconds}] | {peak:.0} [{theirs_memory}] | {:.1} | {} | {} | {:.2} |",
        scene.name,
        scene.stands_for,
        time.as_secs_f64(),
        megabytes(LOADED * image),
        map.slices().len(),
        map.distinct(),
        megabytes(usize::try_from(bytes)?),
    )?;
    Ok(())
}

/// Table 3 and Fig. 6.
fn walk(text: &mut String, options: &FigureOptions, walked: &Walked) -> Result<(), Failure> {
    let avatar = Avatar::new(&AvatarOptions::default().with_step(walked.folder.grid().pixel))?;
    let span = avatar.slices(walked.folder.grid());
    let all = walked.folder.grid().counts[2];
    text.push_str(
        "\n## Fig. 6: steps of a walk over the number of slices in memory\n\nUp the stairs and down again, a step a pixel. A step is slow where a slice \
         is read from disk, as in the paper: nothing is loaded ahead unless said. The paper's avatar spans 6 slices, and 10 or 16 are kept.\n\n![](figure-6.svg)\n\n\
         | slices kept | ahead | MB | µs a step, mean | worst | steps above 1 ms | misses |\n| --: | --- | --: | --: | --: | --: | --: |\n",
    );
    let mut lines = Vec::new();
    let image = walked.folder.load(0)?.bytes();
    for (colour, (slices, prefetch)) in
        [(span, false), (span + 6, false), (span + 6, true), (all, false)].into_iter().enumerate()
    {
        let cache = CacheOptions::default().with_slices(slices).with_prefetch(prefetch);
        let mut cache = SliceCache::new(&walked.folder, &cache, span);
        let (mut times, mut last) = (Vec::new(), now());
        let ended = walked.route.walk(&mut cache, &avatar, &Back, |_, _| {
            times.push(nanoseconds(last.elapsed()) / 1e3);
            last = now();
            Ok::<(), StoreError>(())
        })?;
        if ended != Ended::Arrived {
            return Err(format!("the walk ended before its end: {ended:?}").into());
        }
        let mean = times.iter().sum::<f64>() / count(times.len());
        let worst = times.iter().copied().fold(0.0, f64::max);
        let slow = times.iter().filter(|time| **time > 1e3).count();
        let ahead = if prefetch { "yes" } else { "no" };
        writeln!(
            text,
            "| {slices} | {ahead} | {:.1} | {mean:.1} | {worst:.0} | {slow} of {} | {} |",
            count(slices as usize * image) / 1e6,
            times.len(),
            cache.counts().misses
        )?;
        // The worst of eight steps each, so that peaks are seen.
        let points = times
            .chunks(8)
            .enumerate()
            .map(|(i, steps)| [count(8 * i), steps.iter().copied().fold(0.0, f64::max)]);
        let name = format!("{slices} slices{}", if prefetch { ", ahead" } else { "" });
        lines.push(Line { name, points: points.collect(), colour, dashed: prefetch });
    }
    let axes = [Axis::even("step"), Axis::logarithmic("µs, worst of 8 steps")];
    options.save("figure-6.svg", &[Panel { title: "Steps of a walk".into(), axes, lines }])?;
    table_3(text, walked, &avatar)
}

/// Image-based against a tree of points.
fn table_3(text: &mut String, walked: &Walked, avatar: &Avatar) -> Result<(), Failure> {
    let (map, _) = walked.folder.load_all();
    let mut boxes = Vec::new();
    walked.route.walk(&mut &map, avatar, &Back, |_, step| {
        boxes.push(avatar.bounds(map.grid(), step.position));
        Ok(())
    })?;
    let each = |time| nanoseconds(time) / 1e3 / count(boxes.len());
    let (ended, steady) = timed(|| walked.route.walk(&mut &map, avatar, &Back, |_, _| Ok(())));
    ended?;
    let steady = each(steady);
    let AvatarOptions { base, height, .. } = *avatar.options();
    let squeezed = |p: [f64; 3]| {
        #[expect(clippy::cast_possible_truncation, reason = "the rival is single precision")]
        let p = [0, 1, 2].map(|k| (p[k] * base[0] / [base[0], base[1], height][k]) as f32);
        p
    };
    let points: Vec<[f32; 3]> = (0..walked.cloud.len()).map(|i| squeezed(walked.cloud.point(i))).collect();
    let before = ALLOCATOR.live();
    let (tree, made) = timed(|| ImmutableKdTree::<f32, 3>::new_from_slice(&points));
    let tree = tree.map_err(|e| format!("{e:?}"))?;
    let of_tree = ALLOCATOR.live() - before;
    let (_, by_tree) = timed(|| {
        let near = |b: &&Aabb| {
            let found = tree.query(&squeezed(b.centre())).nearest_one::<Chebyshev<f32>>().execute();
            f64::from(found.distance) <= 0.5 * base[0]
        };
        boxes.iter().filter(near).count()
    });
    let (_, by_map) = timed(|| boxes.iter().filter(|b| map.touches(b).is_ok_and(|hit| hit)).count());
    let image = map.slices().iter().flatten().map(|slice| slice.bytes()).max().unwrap_or(0);
    let megabytes = |bytes: usize| count(bytes) / 1e6;
    write!(
        text,
        "\n## Table 3: slices against a tree of points\n\nThe paper compares with an octree of 4096 cells of boxes about the points; here a kd-tree (kiddo) is asked \
         for any point in the avatar's box, at the places of the walk. A step of the walk itself, falls, climbs and all, takes {steady:.2} µs with every slice in memory.\n\n\
         | | slices | kd-tree | paper: image-based | paper: octree |\n| --- | --: | --: | --: | --: |\n\
         | box checks a second | {:.0} | {:.0} | 30 frames a second | 16 to 30 |\n\
         | MB | {:.1} ({:.1} with {} slices in memory) | {:.1} with the points | 143.36 | 225.44 |\n\
         | preparation, s | {:.2} | {:.2} | 13.9 | 1500 |\n",
        1e6 / each(by_map),
        1e6 / each(by_tree),
        megabytes(map.bytes()),
        megabytes(image * avatar.slices(map.grid()) as usize),
        avatar.slices(map.grid()),
        megabytes(of_tree),
        walked.seconds,
        made.as_secs_f64(),
    )?;
    Ok(())
}

/// How far from a round column an avatar is stopped.
fn columns(text: &mut String, options: &FigureOptions) -> Result<(), Failure> {
    /// Ways towards each column.
    const WAYS: u32 = 90;
    let spacing = 0.02;
    let points = scanned(&house(), spacing, 0.0, options.seed);
    let near: Vec<[f64; 3]> = points
        .iter()
        .copied()
        .filter(|p| {
            p[2] > 0.3
                && p[2] < 2.3
                && COLUMNS.iter().any(|c| (p[0] - c[0]).hypot(p[1] - c[1]) < 2.0 * COLUMN)
        })
        .collect();
    // Half the mean distance of a point from its nearest.
    let nearest = |p: &[f64; 3]| {
        let away = near.iter().map(|q| (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>());
        away.filter(|d| *d > 0.0).fold(f64::INFINITY, f64::min).sqrt()
    };
    let sample: Vec<&[f64; 3]> = near.iter().step_by(20).collect();
    let half = 0.5 * sample.iter().map(|p| nearest(p)).sum::<f64>() / count(sample.len());
    writeln!(
        text,
        "\n## Round columns (§4)\n\nColumns of radius {COLUMN}, scanned {spacing} apart, approached from {WAYS} sides by a box of 0.3 × 0.3 × 1.5: the gap between it and the true column where \
         it is first stopped, in pixels; negative is inside. Half-spacing boxes are cubes about every point, with half the mean distance of nearest points ({half:.4}) to each side.\n\n\
         | t | slices: mean | least | most | half-spacing boxes, in the same unit: mean | least | most |\n| --: |{}",
        " --: |".repeat(6)
    )?;
    let cloud = PointCloud::from_positions(&points)?;
    for pixel in [0.02, 0.04, 0.08, 0.16] {
        let plan = SlicePlan::new(&SliceOptions::default().with_pixel(Pixel::Side(pixel)), &cloud.bounds())?;
        let (map, _) = made(&plan, &Source::Points(cloud.clone()))?;
        let mut gaps: [Vec<f64>; 2] = [Vec::new(), Vec::new()];
        for [cx, cy] in COLUMNS {
            for way in 0..WAYS {
                let (s, c) = (f64::from(way) / f64::from(WAYS) * std::f64::consts::TAU).sin_cos();
                let body = |away: f64| {
                    let [x, y] = [cx + away * c, cy + away * s];
                    Aabb { min: [x - 0.15, y - 0.15, 0.6], max: [x + 0.15, y + 0.15, 2.1] }
                };
                let gap = |away: f64| {
                    let b = body(away);
                    let d = [cx - cx.clamp(b.min[0], b.max[0]), cy - cy.clamp(b.min[1], b.max[1])];
                    d[0].hypot(d[1]) - COLUMN
                };
                let in_box = |b: &Aabb| {
                    near.iter().any(|p| (0..3).all(|k| p[k] + half >= b.min[k] && p[k] - half <= b.max[k]))
                };
                let stopped: [&dyn Fn(&Aabb) -> bool; 2] =
                    [&|b| map.touches(b).is_ok_and(|hit| hit), &in_box];
                for (gaps, stopped) in gaps.iter_mut().zip(stopped) {
                    let first = (0..1000_u16)
                        .map(|i| 0.75 - 0.0005 * f64::from(i))
                        .find(|away| stopped(&body(*away)));
                    gaps.push(first.map_or(f64::NEG_INFINITY, &gap) / pixel);
                }
            }
        }
        let told = gaps.map(|gaps| {
            let mean = gaps.iter().sum::<f64>() / count(gaps.len());
            let least = gaps.iter().copied().fold(f64::INFINITY, f64::min);
            let most = gaps.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            format!("{mean:.2} | {least:.2} | {most:.2}")
        });
        writeln!(text, "| {pixel} | {} |", told.join(" | "))?;
    }
    Ok(())
}
