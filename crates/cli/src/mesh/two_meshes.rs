//! Two meshes and what all queries about them share.

use std::time::{Duration, Instant};

use nearmiss::{Aabb, Budget, Deadline, Mesh, MeshPair, PlacedMesh, Pose};

use crate::console::Console;
use crate::error::CliError;
use crate::posing::PairArgs;
use crate::units::{SizeCheck, diagonal};

/// Lengths are rounded to this share of the diagonal of the smaller mesh.
const SHOWN: f64 = 1e-5;

/// Two meshes, and the budget of each query about them.
#[derive(Debug)]
pub(crate) struct TwoMeshes {
    meshes: [Mesh; 2],
    time: Option<Duration>,
    work: Option<u64>,
    sizes: SizeCheck,
}

impl TwoMeshes {
    /// Opens the meshes of a command.
    pub(crate) fn open(
        pair: &PairArgs,
        threads: Option<usize>,
        (time, work): (Option<Duration>, Option<u64>),
        console: Console,
    ) -> Result<Self, CliError> {
        let meshes = pair.opening(threads, console).open_meshes(pair.inputs())?;
        Ok(Self { meshes, time, work, sizes: pair.size_check(console) })
    }

    /// Returns both meshes.
    pub(crate) fn both(&self) -> [&Mesh; 2] {
        self.meshes.each_ref()
    }

    /// Places the meshes for a query that starts at `start`.
    pub(crate) fn pair(&self, poses: &[Pose; 2], start: Instant) -> MeshPair<'_> {
        let mut budget = Budget::UNLIMITED;
        if let Some(units) = self.work {
            budget = budget.with_work(units);
        }
        if let Some(end) = self.time.and_then(|time| start.checked_add(time)) {
            budget = budget.with_deadline(Deadline::at(end));
        }
        let [a, b] = self.placed(poses);
        MeshPair::new(a, b).within(&budget)
    }

    /// Places the meshes.
    pub(crate) fn placed(&self, poses: &[Pose; 2]) -> [PlacedMesh<'_>; 2] {
        [self.meshes[0].at(&poses[0]), self.meshes[1].at(&poses[1])]
    }

    /// Warns about units once if the meshes differ too much in size.
    pub(crate) fn compare_sizes(&self, poses: &[Pose; 2]) {
        self.sizes.compare_sizes(|| self.diagonals(poses));
    }

    /// Returns the unit to which lengths are rounded for people.
    pub(crate) fn unit(&self, poses: &[Pose; 2]) -> f64 {
        let [a, b] = self.diagonals(poses);
        SHOWN * a.min(b)
    }

    /// Returns the bounds of the placed meshes.
    pub(crate) fn world_bounds(&self, poses: &[Pose; 2]) -> [Aabb; 2] {
        [0, 1].map(|k| Aabb::of(self.meshes[k].bounds().corners().map(|p| poses[k].apply(p))))
    }

    /// Returns the diagonals of the bounds, in world units.
    fn diagonals(&self, poses: &[Pose; 2]) -> [f64; 2] {
        [0, 1].map(|k| diagonal(self.meshes[k].bounds()) * poses[k].scale())
    }
}

/// Returns the time since `start` in microseconds.
pub(crate) fn micros_since(start: Instant) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "nanoseconds of less than a month are exact")]
    let nanos = start.elapsed().as_nanos() as f64;
    nanos / 1e3
}
