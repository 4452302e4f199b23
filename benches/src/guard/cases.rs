//! The cases of the regression checks: scans, and pairs of them at fixed poses.

use std::path::Path;

use nearmiss::{BuildOptions, GraphOptions, Paths, PointCloud, Pose, Scan};
use nearmiss_testdata::arbitrary::{point_in, rng, rotation};
use nearmiss_testdata::pairs::{SetOptions, analytic_set};
use nearmiss_testdata::scanner::{self, Frame};

use crate::object::Object;
use crate::{Failure, poses, truth};

/// Poses for each distance of a sweep.
const PER_DISTANCE: usize = 16;

/// Poses of an object in a scan of a room.
const IN_ROOM: usize = 150;

/// Length of that object's longest side, as a share of the scan's diagonal.
const SHARE: f64 = 0.04;

/// Interval at which the poses of a truth set are sampled.
const ONE_OF: usize = 8;

/// Two scans, each with a pose.
#[derive(Debug, Clone, Copy)]
pub struct Question {
    /// Index of scan a in its case.
    pub a: usize,
    /// Index of scan b in its case.
    pub b: usize,
    /// Poses of a and b.
    pub poses: [Pose; 2],
}

/// Scans and the questions about them.
#[derive(Debug)]
pub struct Case {
    /// The name of the record.
    pub name: String,
    /// The scans.
    pub scans: Vec<Scan>,
    /// The questions, in the order of the record.
    pub questions: Vec<Question>,
}

impl Case {
    /// The object against itself, at these pairs of poses.
    pub(super) fn with_itself(name: &str, scan: Scan, at: impl IntoIterator<Item = [Pose; 2]>) -> Self {
        let questions = at.into_iter().map(|poses| Question { a: 0, b: 0, poses }).collect();
        Self { name: name.into(), scans: vec![scan], questions }
    }
}

/// The cases about shipped and generated scans: objects against themselves with either kernel, a
/// dragon in a simulated LiDAR frame, and shapes with known answers.
///
/// # Errors
/// When a scan cannot be prepared.
pub fn shipped() -> Result<Vec<Case>, Failure> {
    let sweep = |seed| poses::sweep(PER_DISTANCE, seed, 0).into_iter().flatten();
    let resting = |pose| [Pose::IDENTITY, pose];
    let dragon = Object::read("dragon-23k")?.scaled()?;
    let small = Object::read("dragon-5k")?.scaled()?;
    let bumpy = Object::read("bumpy:4000")?.scaled()?;
    let geodesic = prepared(&bumpy.cloud)?
        .with_graph(&bumpy.cloud, &GraphOptions::default().with_close_pairs(Some(Paths::Rebuilt)), None)?
        .with_geodesic_kernel()?;
    let hall =
        PointCloud::from_positions(&scanner::frame(&Frame { beams: 32, steps: 900, noise: 0.01, seed: 1 }))?;
    Ok(vec![
        Case::with_itself("dragon-23k", prepared(&dragon.cloud)?, sweep(1).map(resting)),
        Case::with_itself("bumpy-geodesic", geodesic, sweep(2).map(resting)),
        in_room("hall", &hall, &small.cloud, 3)?,
        analytic()?,
    ])
}

/// The cases about the scans and truth sets that the folder contains.
///
/// # Errors
/// When a file exists but cannot be read.
pub fn of_folder(folder: &Path) -> Result<Vec<Case>, Failure> {
    let mut cases = Vec::new();
    for set in ["dragon70k", "happy-buddha"] {
        let path = folder.join("truth").join(format!("{set}.ply"));
        if path.is_file() {
            let object = Object::read(&path.to_string_lossy())?;
            let questions = truth::read(&path.with_extension("jsonl"), &object.cloud.bounds())?;
            let at = questions.iter().step_by(ONE_OF).map(|question| [question.a, question.b]);
            cases.push(Case::with_itself(set, prepared(&object.cloud)?, at));
        }
    }
    let small = Object::read("dragon-5k")?;
    for file in [
        "scans/room-113k-compressed.pcd",
        "scans/lidar-70k-source.ply",
        "scans/rgbd-normals-120k.ply",
        "buildings/facade-100k.ply",
    ] {
        let path = folder.join(file);
        if path.is_file() {
            let scan = Object::read(&path.to_string_lossy())?;
            cases.push(in_room(&scan.name, &scan.cloud, &small.cloud, 7)?);
        }
    }
    Ok(cases)
}

fn prepared(cloud: &PointCloud) -> Result<Scan, Failure> {
    Ok(Scan::build(cloud, &BuildOptions::default())?)
}

/// An object at random poses within the bounds of a scan.
pub(super) fn in_room(
    name: &str,
    room: &PointCloud,
    object: &PointCloud,
    seed: u64,
) -> Result<Case, Failure> {
    let (bounds, own) = (room.bounds(), object.bounds());
    let diagonal = 2.0 * bounds.half_extents().iter().map(|x| x * x).sum::<f64>().sqrt();
    let scale = SHARE * diagonal / (2.0 * own.half_extents().into_iter().fold(0.0, f64::max));
    let (half, centre, middle) = (bounds.half_extents(), bounds.centre(), own.centre());
    let rng = &mut rng(seed);
    let questions = (0..IN_ROOM)
        .map(|_| {
            let turned = rotation(rng).with_scale(scale);
            let (unit, from) = (point_in(rng, 1.0), turned.apply(middle));
            let shift = [0, 1, 2].map(|k| centre[k] + unit[k] * half[k] - from[k]);
            Question { a: 0, b: 1, poses: [Pose::IDENTITY, turned.with_translation(shift)] }
        })
        .collect();
    Ok(Case { name: name.into(), scans: vec![prepared(room)?, prepared(object)?], questions })
}

/// The shapes with known answers.
fn analytic() -> Result<Case, Failure> {
    let set = analytic_set(1, &SetOptions { repeats: 1, noises: vec![0.0, 0.1] });
    let scans = set.shapes.iter().map(|shape| prepared(&PointCloud::from_positions(&shape.points)?));
    let question = |pair: &nearmiss_testdata::pairs::Pair| Question {
        a: pair.a,
        b: pair.b,
        poses: [pair.pose_a, pair.pose_b],
    };
    Ok(Case {
        name: "analytic".into(),
        scans: scans.collect::<Result<_, _>>()?,
        questions: set.pairs.iter().map(question).collect(),
    })
}
