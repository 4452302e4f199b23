//! `World`: many placed scans.

use std::sync::Mutex;

use nearmiss::{Bodies, BodyId, CollidePlan, Pose, Scan as Prepared, World as Placed};
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::answers::AnswerRecord;
use crate::cloud::rows;
use crate::failure::refused;
use crate::options::{OF_SCANS, Options};
use crate::pool::ask_each;
use crate::poses::Poses;
use crate::record::array;
use crate::scan::Scan;

/// Placed scans, each with an id.
#[pyclass(frozen, module = "nearmiss")]
#[derive(Debug, Default)]
pub(crate) struct World(Mutex<Placed<Prepared>>);

fn no_body(id: u64) -> PyErr {
    PyKeyError::new_err(format!("expected the id of a body of this world, got {id}"))
}

impl World {
    fn with<T>(&self, work: impl FnOnce(&mut Placed<Prepared>) -> T) -> T {
        let mut world = self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        work(&mut world)
    }

    fn pose(&self, id: u64, pose: Option<&Bound<'_, PyAny>>) -> PyResult<Pose> {
        let poses = Poses::new(pose)?;
        self.with(|world| poses.one(world.placed(BodyId(id)).ok_or_else(|| no_body(id))?.scan()))
    }
}

#[pymethods]
impl World {
    #[new]
    fn new() -> Self {
        Self::default()
    }

    fn __len__(&self) -> usize {
        self.with(|world| world.len())
    }

    fn __repr__(&self) -> String {
        format!("<World of {} scans>", self.__len__())
    }

    /// The ids of all bodies, in the order of insertion.
    #[getter]
    fn ids(&self) -> Vec<u64> {
        self.with(|world| world.ids().map(|id| id.0).collect())
    }

    /// Place `scan` at `pose`, of shape (4, 4), and return the id of the new body.
    #[pyo3(signature = (scan, pose = None))]
    fn insert(&self, scan: &Bound<'_, Scan>, pose: Option<&Bound<'_, PyAny>>) -> PyResult<u64> {
        let scan = &scan.get().0;
        let pose = Poses::new(pose)?.one(&**scan)?;
        Ok(self.with(|world| world.insert(scan.clone(), &pose).0))
    }

    /// Remove a body. Raises `KeyError` for an unknown id.
    fn remove(&self, id: u64) -> PyResult<()> {
        self.with(|world| world.remove(BodyId(id))).map(drop).ok_or_else(|| no_body(id))
    }

    /// Move a body to `pose`, of shape (4, 4). Raises `KeyError` for an unknown id.
    fn move_to(&self, id: u64, pose: &Bound<'_, PyAny>) -> PyResult<()> {
        let pose = self.pose(id, Some(pose))?;
        if self.with(|world| world.move_to(BodyId(id), &pose)) { Ok(()) } else { Err(no_body(id)) }
    }

    /// Return the pairs of ids, of shape (N, 2), whose bounding boxes come within the length `reach`; of
    /// all bodies, or those with a body in the list `of`. All other pairs are further apart.
    #[pyo3(signature = (reach = 0.0, of = None))]
    fn near_pairs<'py>(
        &self,
        py: Python<'py>,
        reach: f64,
        of: Option<Vec<u64>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        if reach.is_nan() || reach < 0.0 {
            return Err(refused(format!("expected a reach of at least 0, got {reach}")));
        }
        let world = self.with(|world| world.clone());
        let pairs = near(py, &world, reach, of.as_deref());
        let flat: Vec<u64> = pairs.iter().flatten().map(|id| id.0).collect();
        rows(py, flat, &[pairs.len(), 2])
    }

    /// Answer `collide` for all pairs that may touch, or those with a body in the list `of`, on all cores.
    ///
    /// Returns the pairs of ids, of shape (N, 2), and a structured array of answers, of shape (N,), as
    /// `Scan.collide_each` does. Options are those of `Scan.collide`.
    #[pyo3(signature = (of = None, **options))]
    fn collide<'py>(
        &self,
        py: Python<'py>,
        of: Option<Vec<u64>>,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        // A copy costs references of scans, and other threads can change the world meanwhile.
        let world = self.with(|world| world.clone());
        let Some(first) = world.ids().next().and_then(|id| world.placed(id)) else {
            return Ok((rows(py, Vec::<u64>::new(), &[0, 2])?, array::<AnswerRecord>(py, Vec::new())?));
        };
        let options = Options::new(options, OF_SCANS, first.scan().metric())?;
        let plan = CollidePlan::new(&options.collide, first.scan(), first.scan()).map_err(refused)?;
        if let Some(id) = world
            .ids()
            .find(|&id| world.placed(id).is_some_and(|other| other.scan().metric() != first.scan().metric()))
        {
            return Err(refused(format!(
                "expected scans prepared for one kernel, got another one of body {}",
                id.0
            )));
        }
        let pairs = near(py, &world, plan.reach(), of.as_deref());
        let answers = ask_each(py, pairs.len(), |i, scratch| {
            let answer =
                world.pair(pairs[i]).map(|pair| pair.within(&options.budget()).collide(&plan, scratch));
            AnswerRecord::new(&answer.unwrap_or(nearmiss::Answer::UNASKED))
        })?;
        let flat: Vec<u64> = pairs.iter().flatten().map(|id| id.0).collect();
        Ok((rows(py, flat, &[pairs.len(), 2])?, array(py, answers)?))
    }
}

/// Returns the pairs near each other, without the interpreter.
fn near(py: Python<'_>, world: &Placed<Prepared>, reach: f64, of: Option<&[u64]>) -> Vec<[BodyId; 2]> {
    py.detach(|| {
        let mut pairs = Vec::new();
        let ids: Option<Vec<BodyId>> = of.map(|ids| ids.iter().map(|&id| BodyId(id)).collect());
        let bodies = ids.as_deref().map_or(Bodies::All, Bodies::These);
        world.near_pairs(bodies, reach, &mut pairs);
        pairs
    })
}
