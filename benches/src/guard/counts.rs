//! Instruction counts of queries, by valgrind. Unlike times they do not depend on the load of the
//! machine.
//!
//! Valgrind runs the AVX2 code on every processor that has AVX2. On other processors the counts
//! differ.

use std::fs;
use std::path::Path;
use std::process::Command;

use nearmiss::{
    BuildOptions, Check, CollideOptions, CollidePlan, Detail, DistanceOptions, DistancePlan, Evidence, Mesh,
    MeshBuildOptions, MeshPair, MeshQuality, MeshScanPair, MeshScanPlan, MeshScratch, Pair, PairHint,
    PointCloud, Pose, Ray, Scan, Scratch, Shape, ShapePlan, Target,
};
use nearmiss_testdata::arbitrary::{point_in, rng, rotation, unit_vector};
use nearmiss_testdata::scanner::{self, Frame};
use object::{Object as _, ObjectSymbol as _};
use rand::RngExt as _;

use super::cases::{Case, in_room};
use crate::object::Object;
use crate::{Failure, poses};

/// A scenario whose instructions are counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scenario {
    /// Estimated verdicts of the sweep.
    Sweep,
    /// Estimated verdicts near contact.
    Near,
    /// Certified verdicts of the sweep, with witnesses.
    Certified,
    /// Certified verdicts of an object in a simulated scan of a hall.
    Hall,
    /// Distances over the sweep.
    Distance,
    /// Distances in the hall.
    HallDistance,
    /// Certified verdicts of a scan against its mesh over the sweep.
    MeshScan,
    /// Distances of the same.
    MeshScanDistance,
    /// Distances of an object's mesh in the hall.
    MeshHallDistance,
    /// Exact verdicts of two meshes over the sweep.
    Meshes,
    /// Time-critical verdicts of the same, stopped by `p_min`.
    MeshesLikely,
    /// Distances of the same.
    MeshesDistance,
    /// Hinted verdicts of small steps near contact.
    Hinted,
    /// Estimated verdicts of spheres, capsules and boxes near a scan.
    Touches,
    /// Contacts of the same.
    Contacts,
    /// First hits of rays that pass near a scan.
    Rays,
    /// Views of scans.
    View,
    /// Opening a prepared scan, its structure checked.
    Open,
    /// Reading a file and preprocessing a scan on one thread; counts the whole process.
    Build,
}

impl Scenario {
    /// All scenarios with their names.
    pub const ALL: [(Self, &'static str); 19] = [
        (Self::Sweep, "sweep"),
        (Self::Near, "near"),
        (Self::Certified, "certified"),
        (Self::Hall, "hall"),
        (Self::Distance, "distance"),
        (Self::HallDistance, "hall-distance"),
        (Self::MeshScan, "mesh-scan"),
        (Self::MeshScanDistance, "mesh-scan-distance"),
        (Self::MeshHallDistance, "mesh-hall-distance"),
        (Self::Meshes, "meshes"),
        (Self::MeshesLikely, "meshes-likely"),
        (Self::MeshesDistance, "meshes-distance"),
        (Self::Hinted, "hinted"),
        (Self::Touches, "touches"),
        (Self::Contacts, "contacts"),
        (Self::Rays, "rays"),
        (Self::View, "view"),
        (Self::Open, "open"),
        (Self::Build, "build"),
    ];

    /// The scenario of this name.
    ///
    /// # Errors
    /// When there is none.
    pub fn named(name: &str) -> Result<Self, Failure> {
        let known = Self::ALL.iter().find(|(_, known)| *known == name);
        known
            .map(|(scenario, _)| *scenario)
            .ok_or_else(|| format!("expected the name of a scenario, got {name:?}").into())
    }

    /// Prepares the scenario, then runs it once; valgrind counts the run only.
    ///
    /// # Errors
    /// When it cannot be prepared.
    pub fn run(self) -> Result<(), Failure> {
        let quick =
            CollideOptions::estimated().with_detail(Detail::Verdict).with_evidence(Evidence::Estimated);
        let certified = CollideOptions::estimated().with_evidence(Evidence::Certified);
        match self {
            Self::Sweep => verdicts(&sweep()?, &quick),
            Self::Near => verdicts(&near()?, &quick),
            Self::Certified => verdicts(&sweep()?, &certified),
            Self::Hall => verdicts(&hall()?, &certified),
            Self::Distance => distances(&sweep()?),
            Self::HallDistance => distances(&hall()?),
            Self::MeshScan => mesh_verdicts(&sweep()?, "dragon-23k", &certified),
            Self::MeshScanDistance => mesh_distances(&sweep()?, "dragon-23k"),
            Self::MeshHallDistance => mesh_distances(&hall()?, "dragon-5k"),
            Self::Meshes => meshes(|pair, scratch| pair.collide(scratch).likely_meets()),
            Self::MeshesLikely => {
                let quality = MeshQuality::default().with_p_min(0.99);
                meshes(|pair, scratch| pair.collide_likely(&quality, scratch).likely_meets())
            }
            Self::MeshesDistance => meshes(|pair, scratch| pair.distance(scratch).upper > 0.0),
            Self::Hinted => hinted(&near()?, &quick),
            Self::Touches => shapes(|target, (shapes, _), scratch| {
                shapes.iter().filter(|shape| target.touch(shape, scratch).verdict.is_touching()).count()
            }),
            Self::Contacts => shapes(|target, (shapes, _), scratch| {
                let mut found = Vec::new();
                shapes
                    .iter()
                    .map(|shape| {
                        target.contacts(shape, &mut found, scratch);
                        found.len()
                    })
                    .sum()
            }),
            Self::Rays => shapes(|target, (_, rays), scratch| {
                rays.iter().filter(|ray| target.cast(ray, scratch).hit.is_some()).count()
            }),
            Self::View => {
                let Case { scans, questions, .. } = sweep()?;
                counted(&mut || {
                    for question in &questions {
                        std::hint::black_box(scans[0].at(&question.poses[1]));
                    }
                });
                Ok(())
            }
            Self::Open => {
                let folder = tempfile::tempdir()?;
                let path = folder.path().join("dragon.nm");
                dragon()?.save(&path)?;
                let mut opened = None;
                counted(&mut || opened = Some(Scan::open(&path, Check::Structure)));
                Ok(opened.transpose().map(|_| ())?)
            }
            Self::Build => dragon().map(|_| ()),
        }
    }

    /// Valgrind's option that limits the count to one function; empty if the whole process is
    /// counted.
    fn toggle(self) -> &'static [&'static str] {
        if self == Self::Build { &[] } else { &["--toggle-collect=*counts::counted*"] }
    }
}

/// The reason why counts cannot be compared with the record here, or `None`.
#[must_use]
pub fn obstacle() -> Option<&'static str> {
    let installed =
        || Command::new("valgrind").arg("--version").output().is_ok_and(|told| told.status.success());
    if !has_avx2() {
        Some("the processor has no AVX2")
    } else if !installed() {
        Some("valgrind is not installed")
    } else {
        None
    }
}

#[cfg(target_arch = "x86_64")]
fn has_avx2() -> bool {
    std::arch::is_x86_feature_detected!("avx2")
}

#[cfg(not(target_arch = "x86_64"))]
const fn has_avx2() -> bool {
    false
}

/// Returns the names of vector instructions that `program` calls as functions. A closure, or a function
/// that is not inlined, is compiled without the instruction set of its caller; each operation in it is
/// then a call.
///
/// # Errors
/// When the program cannot be read or has no symbols.
pub fn called_instructions(program: &Path) -> Result<Vec<String>, Failure> {
    const KERNEL: &str = "__fearless_simd_kernel";
    let bytes = fs::read(program)?;
    let file = object::File::parse(&*bytes)?;
    let names: Vec<&str> = file.symbols().filter_map(|symbol| symbol.name().ok()).collect();
    if names.is_empty() {
        return Err(format!("expected symbols in {}, got none; do not strip it", program.display()).into());
    }
    Ok(names.into_iter().filter(|name| name.contains(KERNEL)).map(Into::into).collect())
}

/// Counts a scenario with valgrind. `program` runs the scenario when given `arguments`.
///
/// # Errors
/// When valgrind is not installed, or the scenario fails.
pub fn count(scenario: Scenario, program: &Path, arguments: &[&str]) -> Result<u64, Failure> {
    let output = Command::new("valgrind")
        .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
        .args(scenario.toggle())
        .arg(program)
        .args(arguments)
        .output()
        .map_err(|cause| format!("cannot run valgrind ({cause}); install the package valgrind"))?;
    let told = String::from_utf8_lossy(&output.stderr);
    let collected = told.lines().find_map(|line| line.split("Collected :").nth(1));
    match collected.map(str::trim).and_then(|number| number.parse().ok()) {
        Some(count) if output.status.success() && count > 0 => Ok(count),
        _ => Err(format!("expected a count from valgrind, got:\n{told}").into()),
    }
}

/// The only function whose instructions valgrind counts.
#[inline(never)]
fn counted(work: &mut dyn FnMut()) {
    work();
}

fn build(cloud: &PointCloud) -> Result<Scan, Failure> {
    Ok(Scan::build(cloud, &BuildOptions::default().with_threads(1))?)
}

fn dragon() -> Result<Scan, Failure> {
    build(&Object::read("dragon-23k")?.scaled()?.cloud)
}

fn sweep() -> Result<Case, Failure> {
    let at = poses::sweep(8, 1, 0).into_iter().flatten().map(|pose| [Pose::IDENTITY, pose]);
    Ok(Case::with_itself("sweep", dragon()?, at))
}

fn near() -> Result<Case, Failure> {
    let object = Object::read("dragon-23k")?.scaled()?;
    let at = poses::near(&object, 100, 1)?.into_iter().map(|near| [Pose::IDENTITY, near.pose]);
    Ok(Case::with_itself("near", build(&object.cloud)?, at))
}

fn hall() -> Result<Case, Failure> {
    let frame = Frame { beams: 32, steps: 900, noise: 0.01, seed: 1 };
    let hall = PointCloud::from_positions(&scanner::frame(&frame))?;
    in_room("hall", &hall, &Object::read("dragon-5k")?.cloud, 3)
}

/// Verdicts for a case whose questions are all about its first and last scan.
fn verdicts(case: &Case, options: &CollideOptions) -> Result<(), Failure> {
    let [a, b] = [&case.scans[0], &case.scans[case.scans.len() - 1]];
    let (plan, mut scratch) = (CollidePlan::new(options, a, b)?, Scratch::default());
    counted(&mut || {
        for question in &case.questions {
            let [at_a, at_b] = &question.poses;
            std::hint::black_box(Pair::new(a.at(at_a), b.at(at_b)).collide(&plan, &mut scratch));
        }
    });
    Ok(())
}

fn distances(case: &Case) -> Result<(), Failure> {
    let [a, b] = [&case.scans[0], &case.scans[case.scans.len() - 1]];
    let plan = DistancePlan::new(&DistanceOptions::default(), a, b)?;
    let mut scratch = Scratch::default();
    counted(&mut || {
        for question in &case.questions {
            let [at_a, at_b] = &question.poses;
            std::hint::black_box(Pair::new(a.at(at_a), b.at(at_b)).distance(&plan, &mut scratch));
        }
    });
    Ok(())
}

/// The mesh of an object, in the size of its scan in `case`.
fn mesh(case: &Case, name: &str) -> Result<Mesh, Failure> {
    let object = Object::read(name)?;
    let object = if case.scans.len() == 1 { object.scaled()? } else { object };
    let mesh = object.mesh.ok_or("expected an object with a mesh")?;
    Ok(Mesh::build(&mesh, &MeshBuildOptions::default().with_threads(1))?)
}

/// Verdicts for the same questions, with a mesh for the last scan.
fn mesh_verdicts(case: &Case, name: &str, options: &CollideOptions) -> Result<(), Failure> {
    let (a, b) = (&case.scans[0], mesh(case, name)?);
    let (plan, mut scratch) = (MeshScanPlan::new(options, a)?, Scratch::default());
    counted(&mut || {
        for question in &case.questions {
            let [at_a, at_b] = &question.poses;
            std::hint::black_box(MeshScanPair::new(a.at(at_a), b.at(at_b)).collide(&plan, &mut scratch));
        }
    });
    Ok(())
}

fn mesh_distances(case: &Case, name: &str) -> Result<(), Failure> {
    let (a, b) = (&case.scans[0], mesh(case, name)?);
    let plan = DistancePlan::against_mesh(&DistanceOptions::default(), a)?;
    let mut scratch = Scratch::default();
    counted(&mut || {
        for question in &case.questions {
            let [at_a, at_b] = &question.poses;
            std::hint::black_box(MeshScanPair::new(a.at(at_a), b.at(at_b)).distance(&plan, &mut scratch));
        }
    });
    Ok(())
}

/// Asks about two copies of a mesh at the poses of the sweep.
fn meshes(ask: impl Fn(&MeshPair<'_>, &mut MeshScratch) -> bool) -> Result<(), Failure> {
    let case = sweep()?;
    let (mesh, mut scratch) = (mesh(&case, "dragon-23k")?, MeshScratch::default());
    // The first time-critical query makes a table.
    let _warm = ask(&MeshPair::new(mesh.at(&Pose::IDENTITY), mesh.at(&Pose::IDENTITY)), &mut scratch);
    counted(&mut || {
        for question in &case.questions {
            let [at_a, at_b] = &question.poses;
            std::hint::black_box(ask(&MeshPair::new(mesh.at(at_a), mesh.at(at_b)), &mut scratch));
        }
    });
    Ok(())
}

/// Asks about shapes, up to three sampling radii off points of a scan with a shape index, and about rays
/// towards the same places.
fn shapes(ask: impl Fn(&Target<'_>, (&[Shape<'_>], &[Ray]), &mut Scratch) -> usize) -> Result<(), Failure> {
    const PLACES: usize = 200;
    let scan = dragon()?.with_shapes();
    let plan = ShapePlan::new(&CollideOptions::estimated().with_detail(Detail::Verdict), &scan)?;
    let (target, mut scratch) = (Target::new(scan.at(&Pose::IDENTITY), &plan), Scratch::default());
    let (rng, radius) = (&mut rng(1), f64::from(scan.arrays().sampling_radius));
    let (mut shapes, mut rays) = (Vec::new(), Vec::new());
    for _ in 0..PLACES {
        let point = scan.arrays().position(rng.random_range(0..scan.len())).map(f64::from);
        let (off, along) = (point_in(rng, 3.0 * radius), unit_vector(rng));
        let centre = [0, 1, 2].map(|k| point[k] + off[k]);
        let end = [0, 1, 2].map(|k| centre[k] + 4.0 * radius * along[k]);
        let pose = rotation(rng).with_translation(centre);
        shapes.push(Shape::Sphere { centre, radius });
        shapes.push(Shape::Capsule { ends: [centre, end], radius });
        shapes.push(Shape::Box { pose, half: [2.0, 1.0, 0.5].map(|half| half * radius), radius: 0.0 });
        rays.push(Ray::new([0, 1, 2].map(|k| centre[k] - 3.0 * along[k]), along));
    }
    // The index computes what is near the surface when it is first asked.
    let _found = ask(&target, (&shapes, &rays), &mut scratch);
    counted(&mut || {
        std::hint::black_box(ask(&target, (&shapes, &rays), &mut scratch));
    });
    Ok(())
}

fn hinted(case: &Case, options: &CollideOptions) -> Result<(), Failure> {
    const STEPS: u32 = 10;
    let scan = &case.scans[0];
    let (plan, mut scratch) = (CollidePlan::new(options, scan, scan)?, Scratch::default());
    let (still, step) = (scan.at(&Pose::IDENTITY), 0.1 * f64::from(scan.arrays().sampling_radius));
    let rng = &mut rng(1);
    let walks: Vec<(Pose, [f64; 3])> = case
        .questions
        .iter()
        .map(|question| (question.poses[1], unit_vector(rng).map(|x| x * step)))
        .collect();
    counted(&mut || {
        for (start, step) in &walks {
            let mut hint = PairHint::default();
            for i in 0..STEPS {
                let [x, y, z] = start.translation();
                let shift = step.map(|d| d * f64::from(i));
                let at = start.with_translation([x + shift[0], y + shift[1], z + shift[2]]);
                std::hint::black_box(
                    Pair::new(still, scan.at(&at)).hinted(&mut hint).collide(&plan, &mut scratch),
                );
            }
        }
    });
    Ok(())
}
