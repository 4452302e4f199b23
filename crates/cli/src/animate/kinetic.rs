//! Two meshes under kinetic trees.

use nearmiss::Mesh;
use nearmiss::kinetic::{Counts, FlightPlan, KineticError, KineticTree, SeparationList};
use nearmiss::mesh::triangles_meet;

use super::body::{Found, Partner, Still};
use super::frames::Frames;
use super::moment::Moment;
use crate::console::now;
use crate::error::CliError;
use crate::mesh::two_meshes::micros_since;

/// Two meshes whose boxes are kinetic, and the pairs of boxes that are apart.
pub(super) struct KineticMeshes {
    trees: [KineticTree; 2],
    list: SeparationList,
}

impl KineticMeshes {
    /// Builds both trees, and compares them. The frames are the knots of the vertices' plans.
    pub(super) fn new(frames: &Frames, partner: Partner<'_>) -> Result<Self, CliError> {
        let other = match partner {
            Partner::Moving(others) => of_frames(others)?,
            Partner::Still(Still::Mesh(mesh)) => of_still(mesh).map_err(|cause| fault(&cause))?,
            Partner::Still(Still::Scan(_)) | Partner::Nothing => return Err(expected("no second mesh")),
        };
        let mut meshes = Self { trees: [of_frames(frames)?, other], list: SeparationList::new() };
        meshes.advance(0.0)?;
        Ok(meshes)
    }

    /// Moves both meshes to time `t`, and tests the triangles of leaves that meet.
    pub(super) fn at(&mut self, t: f64) -> Result<Moment, CliError> {
        let before = self.work();
        let start = now();
        self.advance(t)?;
        let update_micros = micros_since(start);
        let after = self.work();
        let start = now();
        let found = if self.meets() { "intersecting" } else { "separated" };
        let query_micros = micros_since(start);
        Ok(Moment {
            t,
            bv_updates: after[0] - before[0],
            events: after[1] - before[1],
            rebuilt: 0,
            update_micros,
            query_micros,
            found: Some(Found::exact(found)),
        })
    }

    fn advance(&mut self, t: f64) -> Result<(), CliError> {
        let [a, b] = &mut self.trees;
        self.list.advance(a, b, t).map_err(|cause| fault(&cause))
    }

    /// Returns the numbers of changes of boxes and of events so far.
    fn work(&self) -> [u64; 2] {
        let counts = self.trees.each_ref().map(KineticTree::counts);
        let events: u64 = counts.iter().map(Counts::events).sum();
        [counts.iter().map(|counts| counts.updates).sum(), events + self.list.events()]
    }

    /// Returns `true` if two triangles have a point in common.
    fn meets(&self) -> bool {
        let [a, b] = &self.trees;
        let corners = |tree: &KineticTree, triangle: u32| {
            let points = tree.primitive(triangle)?;
            let [i, j, k] = [0, 1, 2].map(|n| tree.position(points[n]));
            Some([i?, j?, k?])
        };
        let mut meets = false;
        self.list.for_each_overlap(a, b, |i, j| {
            let pair = || Some(triangles_meet(&corners(a, i)?, &corners(b, j)?));
            meets = meets || pair().unwrap_or(false);
        });
        meets
    }
}

/// Builds the tree of a mesh in motion.
fn of_frames(frames: &Frames) -> Result<KineticTree, CliError> {
    let triangles = frames.triangles.as_deref().ok_or_else(|| expected("points without faces"))?;
    let times: Vec<f64> = (0..frames.len()).map(|i| frames.time(i)).collect();
    let plan = |vertex: usize| FlightPlan::through(&times, &frames.places(vertex));
    let plans = (0..frames.first().1.len()).map(plan).collect::<Result<Vec<_>, KineticError>>();
    plans.and_then(|plans| KineticTree::new(0.0, plans, triangles)).map_err(|cause| fault(&cause))
}

/// Builds the tree of a mesh at rest.
fn of_still(mesh: &Mesh) -> Result<KineticTree, KineticError> {
    let arrays = mesh.arrays();
    let plans = arrays.vertices.iter().map(|&place| FlightPlan::at_rest(0.0, place));
    KineticTree::new(0.0, plans.collect::<Result<Vec<_>, _>>()?, arrays.triangles)
}

fn expected(got: &str) -> CliError {
    CliError::Usage(format!(
        "--method kinetic: expected two meshes, got {got}; use --method refit, or give frames with faces and a mesh \
         to --against or --against-frames"
    ))
}

fn fault(cause: &KineticError) -> CliError {
    CliError::Usage(format!("--method kinetic: {cause}"))
}
