//! Tables 1 to 3 and Figs 5 and 6 of dos Anjos, Pereira & Oliveira 2012 for comparable scenes,
//! beside the paper's figures, as `anjos2012.md` and SVGs in a folder. It also measures the round
//! columns of §4 and the height of a box that fits up a real staircase.
//!
//! Without the folder of scenes a generated house stands in for them.

use std::fmt::Write;
use std::hint::black_box;
use std::path::Path;

use kiddo::{Chebyshev, ImmutableKdTree};
use nearmiss::Aabb;
use nearmiss::slices::{Avatar, AvatarOptions, Back, Obstacle, Pixel, SliceOptions, SlicePlan, Up};
use nearmiss_benches::anjos2012::steps::{PIXELS, figures_5_and_6};
use nearmiss_benches::anjos2012::{Source, Walked, columns, headroom, made};
use nearmiss_benches::clock::{nanoseconds, timed};
use nearmiss_benches::figures::FigureOptions;
use nearmiss_benches::sample::count;
use nearmiss_benches::{Failure, machine};
use nearmiss_testdata::house::{house, triangles};

use crate::ALLOCATOR;

/// Slices that the paper's Fig. 5 keeps in memory.
const LOADED: usize = 6;

/// Passes; the least time counts.
const PASSES: usize = 5;

/// A scene, the paper's scene that it stands for, and the paper's figures for that: given and
/// sampled points, seconds, MB.
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
        name: "two-storey-scan",
        file: "two-storey-scan-zup-753k.ply",
        up: Up::Z,
        stands_for: "Entrance (Batalha)",
        paper: ["580,062", "580,062", "13.90", "122.88"],
    },
];

pub(crate) fn run(options: &FigureOptions) -> Result<(), Failure> {
    std::fs::create_dir_all(&options.out)?;
    let mut text = format!(
        "# Dos Anjos, Pereira & Oliveira 2012, Tables 1 to 3, Figs 5 and 6\n\n{}\n",
        machine::description()
    );
    let folder = options.out.join("maps");
    tables(&mut text, options, &folder)?;
    let spacing = if options.quick { 0.05 } else { 0.02 };
    let walked = match &options.data {
        Some(data) => Walked::scan(data)?,
        None => Walked::house(spacing, options.seed)?,
    };
    figures_5_and_6(&mut text, options, &walked, &folder)?;
    table_3(&mut text, &walked, &folder)?;
    columns::table(&mut text, options.seed)?;
    if options.data.is_some() {
        headroom::table(&mut text, &walked)?;
    }
    std::fs::remove_dir_all(&folder)?;
    let path = options.out.join("anjos2012.md");
    std::fs::write(&path, text)?;
    println!("{}", path.display());
    Ok(())
}

fn tables(text: &mut String, options: &FigureOptions, folder: &Path) -> Result<(), Failure> {
    text.push_str(
        "## Tables 1 and 2, Fig. 5\n\nPoints or triangles in memory become slices on disk, with 700 pixels along the longer side, σ = 3 t and the paper's rule (7 %). \
         Peak memory is without the input. Numbers in brackets are the paper's, for the scene that ours stands for.\n\n\
         | scene | for | type | points or corners | with samples | seconds | MB, peak | MB of 6 slices in memory | all slices | distinct | MB on disk |\n\
         | --- | --- | --- | --: | --: | --: | --: | --: | --: | --: | --: |\n",
    );
    if let Some(data) = &options.data {
        for scene in &SCENES {
            let path = data.join("buildings").join(scene.file);
            eprintln!("{}", path.display());
            let model = nearmiss::io::read(&path, None)?;
            let source = model.mesh.map_or(Source::Points(model.cloud), Source::Mesh);
            row(text, scene, &source, folder)?;
        }
    }
    let generated =
        Scene { name: "generated house", file: "", up: Up::Z, stands_for: "–", paper: ["–"; 4] };
    row(text, &generated, &Source::Mesh(triangles(&house())), folder)
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
    let run = || {
        timed(|| {
            let (map, points) = made(&plan, source)?;
            let bytes = map.save(&place)?;
            Ok::<_, Failure>((map, points, bytes))
        })
    };
    let (done, mut time) = run();
    let megabytes = |bytes: usize| count(bytes) / 1e6;
    let peak = megabytes(ALLOCATOR.peak() - before);
    for _ in 1..PASSES {
        let (again, other) = run();
        again?;
        time = time.min(other);
    }
    let (map, points, bytes) = done?;
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

/// Writes the comparison of slice maps with a tree of points.
fn table_3(text: &mut String, walked: &Walked, folder: &Path) -> Result<(), Failure> {
    let options = SliceOptions::default().with_pixel(Pixel::Count(PIXELS));
    let place = folder.join("walked");
    let (folder, mut seconds) = walked.folder(&place, &options)?;
    for _ in 1..PASSES {
        seconds = seconds.min(walked.folder(&place, &options)?.1);
    }
    let (map, _) = folder.load_all();
    let avatar = &Avatar::new(&AvatarOptions::default().with_step(map.grid().pixel))?;
    let mut boxes = Vec::new();
    walked.route.walk(&mut &map, avatar, &Back, |_, step| {
        boxes.push(avatar.bounds(map.grid(), step.position));
        Ok(())
    })?;
    let each = |work: &dyn Fn() -> usize| {
        let least =
            (0..PASSES).map(|_| nanoseconds(timed(|| black_box(work())).1)).fold(f64::INFINITY, f64::min);
        least / 1e3 / count(boxes.len())
    };
    let steady = each(&|| usize::from(walked.route.walk(&mut &map, avatar, &Back, |_, _| Ok(())).is_ok()));
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
    let near = |b: &&Aabb| {
        let found = tree.query(&squeezed(b.centre())).nearest_one::<Chebyshev<f32>>().execute();
        f64::from(found.distance) <= 0.5 * base[0]
    };
    let by_tree = each(&|| boxes.iter().filter(near).count());
    let by_map = each(&|| boxes.iter().filter(|b| map.touches(b).is_ok_and(|hit| hit)).count());
    let image = map.slices().iter().flatten().map(|slice| slice.bytes()).max().unwrap_or(0);
    let megabytes = |bytes: usize| count(bytes) / 1e6;
    write!(
        text,
        "\n## Table 3: slices against a tree of points\n\nThe paper compares with an octree of 4096 cells of boxes around the points. Here a kd-tree (kiddo) looks for any point in \
         the avatar's box, at the places of the walk. A step of the walk, including falls and climbs, takes {steady:.2} µs with every slice in memory.\n\n\
         | | slices | kd-tree | paper: image-based | paper: octree |\n| --- | --: | --: | --: | --: |\n\
         | box checks per second | {:.0} | {:.0} | 30 frames per second | 16 to 30 |\n\
         | MB | {:.1} ({:.1} with {} slices in memory) | {:.1} with the points | 143.36 | 225.44 |\n\
         | preparation, s | {:.2} | {:.2} | 13.9 | 1500 |\n",
        1e6 / by_map,
        1e6 / by_tree,
        megabytes(map.bytes()),
        megabytes(image * avatar.slices(map.grid()) as usize),
        avatar.slices(map.grid()),
        megabytes(of_tree),
        seconds,
        made.as_secs_f64(),
    )?;
    Ok(())
}
