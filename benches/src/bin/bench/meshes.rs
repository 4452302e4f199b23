//! Meshes: preparing, exact and time-critical collision, distance; parry's tree in the same run.
//!
//! Two copies of an object over the poses of the sweep whose root volumes meet, separated ones
//! included. Each pose is queried once by each method. The error of a time-critical query is the
//! share of poses whose best answer differs from the exact one.

use std::hint::black_box;
use std::path::PathBuf;

use nearmiss::hierarchy::Relative;
use nearmiss::{Budget, Mesh, MeshBuildOptions, MeshHint, MeshPair, MeshQuality, MeshScratch, Pose};
use nearmiss_benches::clock::{nanoseconds, timed};
use nearmiss_benches::object::Object;
use nearmiss_benches::plot::{self, Axis, Line, Panel};
use nearmiss_benches::rivals::parry::MeshTree;
use nearmiss_benches::rivals::{Method, program};
use nearmiss_benches::sample::{Sample, count};
use nearmiss_benches::{Failure, machine, poses};

use crate::mesh_answers;

#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// Objects to measure: mesh files, or `dragon-5k` or `dragon-23k`
    #[arg(required = true, value_name = "OBJECT")]
    objects: Vec<String>,
    /// Poses at each distance
    #[arg(long, value_name = "N", default_value_t = 300)]
    per_distance: usize,
    /// A program that times rivals of other languages, built by `benches/rivals/build.sh`
    #[arg(long, value_name = "FILE")]
    program: Option<PathBuf>,
    /// Draws time over error as an SVG
    #[arg(long, value_name = "FILE")]
    image: Option<PathBuf>,
    /// Numbers of probable pairs at which a query stops
    #[arg(long, value_name = "K", default_values_t = [1, 3, 10])]
    k_min: Vec<u32>,
    /// Numbers of cells in a collision
    #[arg(long, value_name = "X", default_values_t = [1, 4])]
    shared: Vec<u32>,
    /// Seed of the random numbers
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
}

pub(crate) fn run(options: &Options) -> Result<(), Failure> {
    println!("{}", machine::description());
    let mut panels =
        [panel("stopped by k_min = 3 pairs of p_min and more"), panel("stopped after 16 to 256 node pairs")];
    for (colour, source) in options.objects.iter().enumerate() {
        let (name, curves) = measure(source, options)?;
        for (panel, points) in panels.iter_mut().zip([curves.by_quality, curves.by_budget]) {
            panel.lines.push(Line { name: name.clone(), points, colour, dashed: false });
        }
    }
    if let Some(path) = &options.image {
        std::fs::write(path, plot::figure(&panels)?)?;
    }
    Ok(())
}

fn panel(title: &str) -> Panel {
    let axes = [Axis::even("wrong answers, %"), Axis::even("mean time, µs")];
    Panel { title: title.into(), axes, lines: Vec::new() }
}

/// Time over error of one object, from the exact query on: the curve of the slides.
#[derive(Debug)]
struct Curves {
    by_quality: Vec<[f64; 2]>,
    by_budget: Vec<[f64; 2]>,
}

/// The times of one method, and its wrong answers.
#[derive(Debug, Default)]
struct Column {
    times: Sample,
    false_hits: usize,
    misses: usize,
}

impl Column {
    /// Queries all poses.
    fn ask(poses: &[Pose], truth: Option<&[bool]>, mut ask: impl FnMut(&Pose) -> bool) -> (Self, Vec<bool>) {
        let mut column = Self::default();
        for pose in poses.iter().take(100) {
            black_box(ask(pose));
        }
        let mut hits = Vec::new();
        for (i, pose) in poses.iter().enumerate() {
            let (hit, time) = timed(|| black_box(ask(black_box(pose))));
            column.times.push(nanoseconds(time));
            if let Some(truth) = truth {
                column.false_hits += usize::from(hit && !truth[i]);
                column.misses += usize::from(!hit && truth[i]);
            }
            hits.push(hit);
        }
        (column, hits)
    }

    /// The answers of another program.
    fn of_verdicts(verdicts: &[(bool, f64)], truth: &[bool]) -> Self {
        let mut column = Self::default();
        for (&(hit, time), &truth) in verdicts.iter().zip(truth) {
            column.times.push(time);
            column.false_hits += usize::from(hit && !truth);
            column.misses += usize::from(!hit && truth);
        }
        column
    }

    /// Error in percent and mean time in microseconds.
    fn place(&self) -> [f64; 2] {
        let wrong = count(self.false_hits + self.misses) / count(self.times.len());
        [100.0 * wrong, self.times.summary().mean / 1000.0]
    }

    fn row(&self, name: &str) {
        let summary = self.times.summary();
        let n = count(self.times.len());
        let share = |wrong: usize| 100.0 * count(wrong) / n;
        println!(
            "| {name} | {:.2} | {:.2} | {:.2} | {:.1} | {:.2} | {:.2} | {:.2} |",
            summary.mean / 1000.0,
            summary.median / 1000.0,
            summary.p99 / 1000.0,
            summary.p99 / summary.median,
            share(self.false_hits + self.misses),
            share(self.false_hits),
            share(self.misses),
        );
    }
}

fn prepared(object: &Object) -> Result<Mesh, Failure> {
    let mesh = object.mesh.as_ref().ok_or("the object has no mesh")?;
    let mut times = [const { Vec::new() }; 3];
    for _ in 0..5 {
        for (cells, times) in [false, true].into_iter().zip(&mut times) {
            let options = MeshBuildOptions::default().with_cells(cells);
            times.push(nanoseconds(timed(|| Mesh::build(mesh, &options)).1) / 1e6);
        }
        times[2].push(nanoseconds(timed(|| MeshTree::new(mesh)).1) / 1e6);
    }
    let [bare, cells, parry] = times.map(|mut times| {
        times.sort_by(f64::total_cmp);
        times[times.len() / 2]
    });
    let own = Mesh::build(mesh, &MeshBuildOptions::default())?;
    let bytes = own.write_to(std::io::sink())?;
    println!(
        "\n## {}: {} triangles\n\nprepared in {bare:.1} ms, with cells {cells:.1} ms; parry's tree {parry:.1} ms; \
         {:.1} bytes a triangle\n",
        object.name,
        own.len(),
        count(usize::try_from(bytes)?) / count(own.len()),
    );
    Ok(own)
}

fn measure(source: &str, options: &Options) -> Result<(String, Curves), Failure> {
    let object = Object::read(source)?.scaled()?;
    let mesh = prepared(&object)?;
    let root = *mesh.arrays().tree.root_box();
    let meet = |pose: &Pose| {
        let relative = Relative::new(pose, 10.0);
        relative.gap(&root, &root) <= relative.slack()
    };
    let columns = poses::sweep(options.per_distance, options.seed, 0);
    let all: Vec<Pose> = columns.into_iter().flatten().filter(meet).collect();
    let mut scratch = MeshScratch::default();
    let pair = |pose: &Pose| MeshPair::new(mesh.at(&Pose::IDENTITY), mesh.at(pose));
    println!("{} poses whose root volumes meet\n", all.len());
    println!("| µs | mean | median | p99 | p99 / median | error % | false hits | misses |");
    println!("| --- | --: | --: | --: | --: | --: | --: | --: |");
    let (exact, truth) =
        Column::ask(&all, None, |pose| pair(pose).collide(&mut scratch).verdict.is_intersecting());
    exact.row("exact");
    let mut rival = MeshTree::new(object.mesh.as_ref().ok_or("the object has no mesh")?);
    let (parry, _) = Column::ask(&all, Some(&truth), |pose| rival.ask(&Pose::IDENTITY, pose).hit);
    parry.row("parry BVH + f64 triangles");
    let engines = match &options.program {
        Some(program) => program::run(program, &object, &all, true)?,
        None => Vec::new(),
    };
    for engine in &engines {
        Column::of_verdicts(&engine.verdicts, &truth).row(&engine.name);
    }
    let (ordered, _) = Column::ask(&all, Some(&truth), |pose| {
        pair(pose).collide_likely(&MeshQuality::default(), &mut scratch).likely_meets()
    });
    ordered.row("exact, most probable first");
    let mut curves = Curves { by_quality: vec![exact.place()], by_budget: vec![exact.place()] };
    for &shared in &options.shared {
        for &k_min in &options.k_min {
            for p_min in [0.9999, 0.999, 0.99, 0.95, 0.9, 0.8, 0.5] {
                let quality = MeshQuality::default().with_p_min(p_min).with_k_min(k_min).with_shared(shared);
                let (column, _) = Column::ask(&all, Some(&truth), |pose| {
                    let answer = pair(pose).collide_likely(&quality, &mut scratch);
                    !answer.verdict.is_separated()
                });
                column.row(&format!("p_min {p_min}, k_min {k_min}, x {shared}"));
                if (k_min, shared) == (MeshQuality::default().k_min, MeshQuality::default().shared) {
                    curves.by_quality.push(column.place());
                }
            }
        }
    }
    for work in [256, 192, 128, 96, 64, 48, 32, 16] {
        let budget = Budget::UNLIMITED.with_work(work);
        let (column, _) = Column::ask(&all, Some(&truth), |pose| {
            pair(pose).within(&budget).collide(&mut scratch).likely_meets()
        });
        column.row(&format!("{work} node pairs"));
        curves.by_budget.push(column.place());
    }
    let apart: Vec<Pose> = all.iter().zip(&truth).filter(|(_, hit)| !**hit).map(|(pose, _)| *pose).collect();
    let (distance, _) = Column::ask(&apart, None, |pose| pair(pose).distance(&mut scratch).upper > 0.0);
    distance.row("distance of separated copies");
    for engine in engines.iter().filter(|engine| !engine.distances.is_empty()) {
        let mut column = Column::default();
        engine.distances.iter().for_each(|&(_, time)| column.times.push(time));
        column.row(&format!("distance by {}", engine.name));
    }
    coherent(&mesh, &object, &apart, &mut scratch);
    let meeting: Vec<Pose> = all.iter().zip(&truth).filter(|(_, hit)| **hit).map(|(pose, _)| *pose).collect();
    mesh_answers::regions(&mesh, &meeting, &mut scratch);
    mesh_answers::penetrations(&mesh, &meeting, &mut scratch);
    Ok((object.name, curves))
}

/// Measures steps of r/100, r/10 and r from separated poses, towards the other copy and sideways.
fn coherent(mesh: &Mesh, object: &Object, apart: &[Pose], scratch: &mut MeshScratch) {
    const STEPS: u32 = 50;
    for (name, share) in [("r/100", 0.01), ("r/10", 0.1), ("r", 1.0)] {
        let step = share * object.r;
        let starts = apart.iter().step_by((apart.len() / 200).max(1));
        let walks: Vec<Vec<Pose>> = starts
            .map(|start| {
                let [x, y, z] = start.translation();
                let per_length = step / (x * x + y * y + z * z).sqrt();
                let at = |i: u32| f64::from(i) * per_length;
                (0..STEPS)
                    .map(|i| start.with_translation([x - x * at(i), y - y * at(i) + z * at(i), z]))
                    .collect()
            })
            .collect();
        let all = walks.concat();
        let mut ask = |hinted: bool| {
            let mut hint = MeshHint::default();
            let (column, _) = Column::ask(&all, None, |pose| {
                let pair = MeshPair::new(mesh.at(&Pose::IDENTITY), mesh.at(pose));
                let answer =
                    if hinted { pair.collide_hinted(&mut hint, scratch) } else { pair.collide(scratch) };
                answer.verdict.is_intersecting()
            });
            column
        };
        ask(false).row(&format!("steps of {name}"));
        ask(true).row(&format!("steps of {name}, hinted"));
    }
}
