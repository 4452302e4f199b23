//! The two things that `sweep` moves: scans, meshes, or one of each.

use std::fmt::Display;
use std::path::Path;

use nearmiss::mesh::{self, SampleOptions, SamplePattern, SampleSize};
use nearmiss::{
    Budget, BuildOptions, DistanceOptions, DistancePlan, Mesh, MeshScanSweep, MeshScratch, MeshSweep, Motion,
    PlanError, PointCloud, Pose, Prepared, Scan, Scratch, Sweep, SweepAnswer, SweepOptions, SweepPlan,
    SweepVerdict, TriangleMesh,
};

use super::args::SweepArgs;
use crate::as_mesh::AsMeshName;
use crate::bodies::{Bodies, swap};
use crate::console::{Console, now};
use crate::error::CliError;
use crate::eval::KernelName;
use crate::mesh::two_meshes::TwoMeshes;
use crate::posing::Posable;

/// The number of points that show a mesh.
const POINTS: u32 = 20_000;

/// Two things that move, in the order of the command line.
#[derive(Debug)]
pub(super) enum Swept {
    Bodies(Bodies),
    Meshes(TwoMeshes),
}

impl Swept {
    /// Opens or prepares the inputs.
    pub(super) fn open(args: &SweepArgs, console: Console) -> Result<Self, CliError> {
        let (inputs, kernel) = (args.pair.inputs(), args.kernel.map(KernelName::metric));
        if let Some(AsMeshName::Both) = args.as_mesh {
            return TwoMeshes::open(&args.pair, args.threads, (None, None), console).map(Self::Meshes);
        }
        let opening = args.pair.opening(args.threads, console);
        Ok(Self::Bodies(match args.as_mesh {
            Some(which) => opening.open_mesh_and_scan(which, kernel, inputs)?,
            None if args.meaning.thickened.is_some() => Bodies::Scans(opening.open_points(inputs)?),
            None => Bodies::Scans(opening.open_both(kernel, inputs)?),
        }))
    }

    /// Returns both, to be posed.
    pub(super) fn posable(&self) -> [&(dyn Posable + Sync); 2] {
        match self {
            Self::Bodies(bodies) => bodies.posable(),
            Self::Meshes(meshes) => {
                let [a, b] = meshes.both();
                [a, b]
            }
        }
    }

    /// Returns `true` if both are meshes.
    pub(super) const fn are_meshes(&self) -> bool {
        matches!(self, Self::Meshes(_))
    }

    /// Validates the options.
    pub(super) fn plan(&self, args: &SweepArgs) -> Result<SweepPlan, PlanError> {
        let options = SweepOptions::default().with_clearance(args.clearance);
        match self {
            Self::Meshes(_) => SweepPlan::of_meshes(&options),
            Self::Bodies(bodies) => {
                let options = options.with_semantics(args.meaning.semantics(bodies.scan()));
                match bodies {
                    Bodies::Scans([a, b]) => SweepPlan::new(&options, a, b),
                    Bodies::MeshAndScan { scan, .. } => SweepPlan::against_mesh(&options, scan),
                }
            }
        }
    }

    /// Warns about units if the sizes differ too much. Returns the length to which places are rounded.
    pub(super) fn compare_sizes(&self, poses: &[Pose; 2], args: &SweepArgs, console: Console) -> f64 {
        match self {
            Self::Meshes(meshes) => {
                meshes.compare_sizes(poses);
                meshes.unit(poses)
            }
            Self::Bodies(bodies) => {
                let first = bodies.at(poses);
                first.compare_sizes(&args.pair.size_check(console));
                first.unit()
            }
        }
    }

    /// Answers the question.
    pub(super) fn sweep(&self, motions: &[Motion; 2], plan: &SweepPlan, budget: &Budget) -> SweepAnswer {
        let scratch = &mut Scratch::default();
        match self {
            Self::Bodies(Bodies::Scans([a, b])) => {
                let sweep = Sweep::new(a.along(&motions[0]), b.along(&motions[1]));
                sweep.within(budget).first_impact(plan, scratch)
            }
            Self::Bodies(Bodies::MeshAndScan { mesh, scan, mesh_is_a }) => {
                let of_mesh = usize::from(!mesh_is_a);
                let moving = scan.along(&motions[1 - of_mesh]);
                let sweep = MeshScanSweep::new(moving, mesh, &motions[of_mesh]).within(budget);
                let mut answer = sweep.first_impact(plan, scratch);
                if let (true, SweepVerdict::Impact { contact, .. }) = (mesh_is_a, &mut answer.verdict) {
                    swap(contact);
                }
                answer
            }
            Self::Meshes(meshes) => {
                let [a, b] = meshes.both();
                let sweep = MeshSweep::new([a, b], motions.each_ref()).within(budget);
                sweep.first_impact(plan, scratch)
            }
        }
    }

    /// Returns lower and upper bounds of the distance at each pair of poses.
    pub(super) fn distances(&self, poses: &[[Pose; 2]], plan: &SweepPlan) -> Vec<[f64; 2]> {
        match self {
            Self::Bodies(bodies) => {
                let options = DistanceOptions::default().with_semantics(plan.options().semantics);
                let plan: Option<DistancePlan> = bodies.distance_plan(&options).ok();
                let mut scratch = Scratch::default();
                let distance = |poses: &[Pose; 2]| {
                    let views = bodies.at(poses);
                    let found =
                        plan.as_ref().map(|plan| views.distance(plan, &Budget::UNLIMITED, &mut scratch));
                    found.map_or([0.0, f64::INFINITY], |found| [found.lower, found.upper])
                };
                poses.iter().map(distance).collect()
            }
            Self::Meshes(meshes) => {
                let mut scratch = MeshScratch::default();
                let distance = |poses: &[Pose; 2]| {
                    let found = meshes.pair(poses, now()).distance(&mut scratch);
                    [found.lower, found.upper]
                };
                poses.iter().map(distance).collect()
            }
        }
    }

    /// Returns the scans that show both: points that are spread over a mesh stand for it.
    pub(super) fn shown(&self, args: &SweepArgs) -> Result<[Scan; 2], CliError> {
        let inputs = args.pair.inputs();
        let of_mesh = |mesh: &Mesh, k: usize| points_of(mesh, inputs[k]);
        Ok(match self {
            Self::Bodies(Bodies::Scans(scans)) => scans.clone(),
            Self::Bodies(Bodies::MeshAndScan { mesh, scan, mesh_is_a: true }) => {
                [of_mesh(mesh, 0)?, scan.clone()]
            }
            Self::Bodies(Bodies::MeshAndScan { mesh, scan, mesh_is_a: false }) => {
                [scan.clone(), of_mesh(mesh, 1)?]
            }
            Self::Meshes(meshes) => {
                let [a, b] = meshes.both();
                [of_mesh(a, 0)?, of_mesh(b, 1)?]
            }
        })
    }
}

/// Returns points that are spread over a mesh, with which the picture shows it.
fn points_of(mesh: &Mesh, path: &Path) -> Result<Scan, CliError> {
    let corrupt =
        |cause: &dyn Display| CliError::CorruptScan { path: path.to_owned(), what: cause.to_string() };
    let view = mesh.arrays();
    let mesh = TriangleMesh::new(view.vertices.to_vec(), view.triangles.to_vec());
    let spread = SampleOptions::new(SampleSize::Count(POINTS)).with_pattern(SamplePattern::BlueNoise);
    let points = mesh::sample(&mesh.map_err(|cause| corrupt(&cause))?, &spread)
        .map_err(|cause| CliError::Sample { path: path.to_owned(), cause })?;
    let cloud = PointCloud::from_positions(&points).map_err(|cause| corrupt(&cause))?;
    Scan::build(&cloud, &BuildOptions::default())
        .map_err(|cause| CliError::Build { path: path.to_owned(), cause })
}
