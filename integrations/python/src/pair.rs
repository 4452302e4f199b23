//! Questions about two things: two scans, two meshes, or a scan and a mesh.

use nearmiss::{
    CollidePlan, DistanceOptions, DistancePlan, Interior, Mesh, MeshPair, MeshScanPair, MeshScanPlan, Metric,
    Pair, PairHint, PlanError, PointHierarchy, Pose, Prepared as _, Scratch,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::answers::{AnswerRecord, DistanceRecord, PairRecord};
use crate::each::each;
use crate::failure::refused;
use crate::frame::Frame;
use crate::options::{OF_BUDGET, OF_DISTANCE, OF_MESHES, OF_SCANS, Options};
use crate::penetration::{Penetration, PenetrationRecord};
use crate::pool::ask;
use crate::poses::{Placeable, both};
use crate::things::{Mesh as Closable, Side};

/// A question about two things, with its options.
pub(crate) trait Question<'a>: Sized + Sync {
    type Record: PairRecord;

    /// Validates the options.
    fn new(sides: [Side<'a>; 2], options: Option<&Bound<'_, PyDict>>) -> PyResult<Self>;

    /// Returns both things.
    fn things(&self) -> [&dyn Placeable; 2];

    /// Answers the question at these poses.
    fn at(&self, poses: &[Pose; 2], scratch: &mut Scratch) -> Self::Record;

    /// Answers the question at one pose of each.
    fn one(&self, py: Python<'_>, poses: [Option<&Bound<'_, PyAny>>; 2]) -> PyResult<Self::Record> {
        let poses = both(self.things(), poses)?;
        Ok(ask(py, |scratch| self.at(&poses, scratch)))
    }

    /// Answers the question at many poses, on all cores.
    fn each<'py>(
        &self,
        py: Python<'py>,
        poses: [Option<&Bound<'py, PyAny>>; 2],
    ) -> PyResult<Bound<'py, PyAny>> {
        each(py, self.things(), poses, |poses, scratch| self.at(&poses, scratch))
    }
}

/// Two things, with the plan of two scans, `S`, or that of a scan and a mesh, `M`. Two meshes need none.
enum Planned<'a, S, M> {
    Scans([Frame<'a>; 2], S),
    Meshes([&'a Mesh; 2]),
    Mixed(Mixed<'a>, M),
}

/// A scan and a mesh.
struct Mixed<'a> {
    scan: Frame<'a>,
    mesh: &'a Mesh,
    /// `true` if the mesh was given first.
    is_swapped: bool,
}

impl Mixed<'_> {
    /// Returns the pair at poses in the order given.
    fn pair(&self, [a, b]: &[Pose; 2]) -> MeshScanPair<'_> {
        let [scan, mesh] = if self.is_swapped { [b, a] } else { [a, b] };
        MeshScanPair::new(self.scan.at(scan), self.mesh.at(mesh))
    }

    /// Returns the answer of the pair in the order given.
    fn in_order<R: PairRecord>(&self, record: R) -> R {
        if self.is_swapped { record.swapped() } else { record }
    }
}

impl<'a, S, M> Planned<'a, S, M> {
    fn new(
        sides: [Side<'a>; 2],
        scans: impl FnOnce(&PointHierarchy, &PointHierarchy) -> Result<S, PlanError>,
        mixed: impl FnOnce(&PointHierarchy) -> Result<M, PlanError>,
    ) -> PyResult<Self> {
        let mixed = |scan: Frame<'a>, mesh, is_swapped| {
            let plan = mixed(&scan)?;
            Ok(Self::Mixed(Mixed { scan, mesh, is_swapped }, plan))
        };
        let planned = match sides {
            [Side::Scan(a), Side::Scan(b)] => scans(&a, &b).map(|plan| Self::Scans([a, b], plan)),
            [Side::Mesh(a), Side::Mesh(b)] => Ok(Self::Meshes([&a.mesh, &b.mesh])),
            [Side::Scan(scan), Side::Mesh(mesh)] => mixed(scan, &mesh.mesh, false),
            [Side::Mesh(mesh), Side::Scan(scan)] => mixed(scan, &mesh.mesh, true),
        };
        planned.map_err(refused)
    }

    fn things(&self) -> [&dyn Placeable; 2] {
        match self {
            Self::Scans([a, b], _) => [&**a, &**b],
            Self::Meshes([a, b]) => [*a, *b],
            Self::Mixed(Mixed { scan, mesh, is_swapped: false }, _) => [&**scan, *mesh],
            Self::Mixed(Mixed { scan, mesh, is_swapped: true }, _) => [*mesh, &**scan],
        }
    }
}

/// Reads options that are among `of_scans`, or `of_meshes` for two meshes.
pub(crate) fn options_of(
    given: Option<&Bound<'_, PyDict>>,
    sides: &[Side<'_>; 2],
    [of_scans, of_meshes]: [&[&str]; 2],
) -> PyResult<Options> {
    match sides {
        [Side::Scan(scan), _] | [_, Side::Scan(scan)] => Options::new(given, of_scans, scan.metric()),
        [Side::Mesh(_), Side::Mesh(_)] => Options::new(given, of_meshes, Metric::Euclidean),
    }
}

/// The question about the contact of two things.
pub(crate) struct Contact<'a> {
    pair: Planned<'a, CollidePlan, MeshScanPlan>,
    options: Options,
}

impl<'a> Question<'a> for Contact<'a> {
    type Record = AnswerRecord;

    fn new(sides: [Side<'a>; 2], options: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let options = options_of(options, &sides, [OF_SCANS, OF_MESHES])?;
        let asked = &options.collide;
        let scans = |a: &_, b: &_| CollidePlan::new(asked, a, b);
        let pair = Planned::new(sides, scans, |scan| MeshScanPlan::new(asked, scan))?;
        Ok(Self { pair, options })
    }

    fn things(&self) -> [&dyn Placeable; 2] {
        self.pair.things()
    }

    fn at(&self, poses: &[Pose; 2], scratch: &mut Scratch) -> AnswerRecord {
        let budget = self.options.budget();
        match &self.pair {
            Planned::Scans(scans, plan) => {
                AnswerRecord::new(&pair_of(scans, poses).within(&budget).collide(plan, scratch))
            }
            Planned::Meshes(meshes) => {
                let pair = mesh_pair_of(meshes, poses).within(&budget);
                AnswerRecord::of_meshes(&match &self.options.quality {
                    Some(quality) => pair.collide_likely(quality, scratch.meshes()),
                    None => pair.collide(scratch.meshes()),
                })
            }
            Planned::Mixed(mixed, plan) => {
                let answer = mixed.pair(poses).within(&budget).collide(plan, scratch);
                mixed.in_order(AnswerRecord::new(&answer))
            }
        }
    }
}

impl Contact<'_> {
    /// Answers the question about two scans at one pose of each with a hint.
    pub(crate) fn hinted(
        &self,
        py: Python<'_>,
        poses: [Option<&Bound<'_, PyAny>>; 2],
        hint: &mut PairHint,
    ) -> PyResult<AnswerRecord> {
        let Planned::Scans(scans, plan) = &self.pair else {
            return Err(refused("expected two scans with a hint, got a mesh; ask without a hint"));
        };
        let poses = both(self.things(), poses)?;
        Ok(ask(py, |scratch| {
            let pair = pair_of(scans, &poses).within(&self.options.budget());
            AnswerRecord::new(&pair.hinted(hint).collide(plan, scratch))
        }))
    }
}

/// The question about the distance of two things.
pub(crate) struct Apart<'a> {
    pair: Planned<'a, Box<DistancePlan>, Box<DistancePlan>>,
    options: Options,
}

impl<'a> Question<'a> for Apart<'a> {
    type Record = DistanceRecord;

    fn new(sides: [Side<'a>; 2], options: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let options = options_of(options, &sides, [OF_DISTANCE, OF_BUDGET])?;
        let asked = DistanceOptions::default()
            .with_semantics(options.collide.semantics)
            .with_relative(options.relative);
        let scans = |a: &_, b: &_| DistancePlan::new(&asked, a, b).map(Box::new);
        let pair = Planned::new(sides, scans, |scan| DistancePlan::against_mesh(&asked, scan).map(Box::new))?;
        Ok(Self { pair, options })
    }

    fn things(&self) -> [&dyn Placeable; 2] {
        self.pair.things()
    }

    fn at(&self, poses: &[Pose; 2], scratch: &mut Scratch) -> DistanceRecord {
        let budget = self.options.budget();
        match &self.pair {
            Planned::Scans(scans, plan) => {
                DistanceRecord::new(&pair_of(scans, poses).within(&budget).distance(plan, scratch))
            }
            Planned::Meshes(meshes) => {
                let pair = mesh_pair_of(meshes, poses).within(&budget);
                DistanceRecord::of_meshes(&pair.distance(scratch.meshes()))
            }
            Planned::Mixed(mixed, plan) => {
                let distance = mixed.pair(poses).within(&budget).distance(plan, scratch);
                mixed.in_order(DistanceRecord::new(&distance))
            }
        }
    }
}

/// The question how far to move the second of two things out of the first.
pub(crate) struct Overlap<'a> {
    pair: Planned<'a, CollidePlan, MeshScanPlan>,
    /// The insides of scans.
    interiors: [Interior; 2],
    meshes: [Option<&'a Closable>; 2],
    options: Options,
}

impl<'a> Overlap<'a> {
    /// Validates the options. `solid` names scans whose surface encloses a solid.
    pub(crate) fn new(
        sides: [Side<'a>; 2],
        solid: Option<&str>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let options = options_of(options, &sides, [OF_SCANS, OF_BUDGET])?;
        let meshes = sides.each_ref().map(|side| match side {
            Side::Mesh(mesh) => Some(*mesh),
            Side::Scan(_) => None,
        });
        let interiors = interiors(solid, meshes.map(|mesh| mesh.is_none()))?;
        let asked = &options.collide;
        let scans = |a: &_, b: &_| CollidePlan::new(asked, a, b);
        let pair = Planned::new(sides, scans, |scan| MeshScanPlan::new(asked, scan))?;
        Ok(Self { pair, interiors, meshes, options })
    }

    /// Answers the question at one pose of each.
    pub(crate) fn one(&self, py: Python<'_>, poses: [Option<&Bound<'_, PyAny>>; 2]) -> PyResult<Penetration> {
        let poses = both(self.pair.things(), poses)?;
        let budget = self.options.budget();
        // The closed parts are found when first asked for, without the interpreter.
        let found = ask(py, |scratch| match (&self.pair, self.meshes) {
            (Planned::Scans(scans, plan), _) => {
                Some(pair_of(scans, &poses).within(&budget).penetration(plan, self.interiors, scratch))
            }
            (Planned::Meshes(meshes), [Some(a), Some(b)]) => Some(
                mesh_pair_of(meshes, &poses)
                    .within(&budget)
                    .penetration([a.mesh.solid(), b.mesh.solid()], scratch.meshes()),
            ),
            (Planned::Mixed(mixed, plan), [Some(mesh), _] | [_, Some(mesh)]) => {
                let inside = (self.interiors[usize::from(mixed.is_swapped)], mesh.mesh.solid());
                let mut found = mixed.pair(&poses).within(&budget).penetration(plan, inside, scratch);
                if mixed.is_swapped {
                    // The mesh moves out of the scan.
                    found.direction = found.direction.map(|c| -c);
                }
                Some(found)
            }
            _ => None,
        });
        let Some(found) = found else { return Err(refused("expected the closed parts of a mesh")) };
        Ok(Penetration(PenetrationRecord::new(&found)))
    }
}

/// Returns the insides of two things, given which of them are scans. `solid` names scans whose surface
/// encloses a solid.
pub(crate) fn interiors(solid: Option<&str>, are_scans: [bool; 2]) -> PyResult<[Interior; 2]> {
    let are_solid = match solid {
        None => [false, false],
        Some("a") => [true, false],
        Some("b") => [false, true],
        Some("both") => [true, true],
        Some(name) => {
            return Err(refused(format!("expected `solid` to be \"a\", \"b\" or \"both\", got {name:?}")));
        }
    };
    if let Some(name) = solid.filter(|_| (0..2).any(|k| are_solid[k] && !are_scans[k])) {
        return Err(refused(format!(
            "expected `solid` to name scans, got {name:?} with another thing; shapes and the closed parts of a mesh \
             are solid anyway"
        )));
    }
    Ok(are_solid.map(|is| if is { Interior::Solid } else { Interior::Hollow }))
}

/// Returns the pair of two scans at these poses.
pub(crate) fn pair_of<'s>([a, b]: &'s [Frame<'_>; 2], [at, other]: &[Pose; 2]) -> Pair<'s> {
    Pair::new(a.at(at), b.at(other))
}

/// Returns the pair of two meshes at these poses.
pub(crate) fn mesh_pair_of<'s>([a, b]: &[&'s Mesh; 2], [at, other]: &[Pose; 2]) -> MeshPair<'s> {
    MeshPair::new(a.at(at), b.at(other))
}
