//! Meshes under kinetic trees.

use nearmiss::Mesh;
use nearmiss::kinetic::{Counts, FlightPlan, KineticError, KineticTree, SelfSeparationList, SeparationList};
use nearmiss::mesh::triangles_meet;

use super::body::{Found, Partner, Still};
use super::frames::Frames;
use super::moment::Moment;
use crate::console::now;
use crate::error::CliError;
use crate::mesh::two_meshes::micros_since;

/// Meshes whose boxes are kinetic, and the pairs of boxes that are apart.
pub(super) enum KineticMeshes {
    Two {
        trees: Box<[KineticTree; 2]>,
        list: SeparationList,
    },
    /// One mesh, tested against itself.
    One {
        tree: Box<KineticTree>,
        list: SelfSeparationList,
    },
}

impl KineticMeshes {
    /// Builds the trees, and compares them. The frames are the knots of the vertices' plans.
    pub(super) fn new(frames: &Frames, partner: Partner<'_>) -> Result<Self, CliError> {
        let tree = of_frames(frames)?;
        let other = match partner {
            Partner::Moving(others) => Some(of_frames(others)?),
            Partner::Still(Still::Mesh(mesh)) => Some(of_still(mesh).map_err(|cause| fault(&cause))?),
            Partner::Still(Still::Scan(_)) => return Err(expected("a scan")),
            Partner::Nothing => None,
        };
        let mut meshes = match other {
            Some(other) => Self::Two { trees: Box::new([tree, other]), list: SeparationList::new() },
            None => Self::One { tree: Box::new(tree), list: SelfSeparationList::new() },
        };
        meshes.advance(0.0)?;
        Ok(meshes)
    }

    /// Moves the meshes to time `t`, and tests the triangles of leaves that meet.
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

    /// Moves the meshes through the first second, then tests them. `None` as soon as moving them has
    /// taken more than `most` microseconds.
    pub(super) fn first_second(mut self, most: f64) -> Result<Option<Moment>, CliError> {
        /// The time is looked at this many times.
        const STEPS: u32 = 64;
        let start = now();
        for step in 1..=STEPS {
            self.advance(f64::from(step) / f64::from(STEPS))?;
            if micros_since(start) > most {
                return Ok(None);
            }
        }
        let update_micros = micros_since(start);
        Ok(Some(Moment { update_micros, ..self.at(1.0)? }))
    }

    fn advance(&mut self, t: f64) -> Result<(), CliError> {
        match self {
            Self::Two { trees, list } => {
                let [a, b] = &mut **trees;
                list.advance(a, b, t)
            }
            Self::One { tree, list } => list.advance(tree, t),
        }
        .map_err(|cause| fault(&cause))
    }

    /// Returns the numbers of changes of boxes and of events so far.
    fn work(&self) -> [u64; 2] {
        let (trees, events) = match self {
            Self::Two { trees, list } => (&trees[..], list.events()),
            Self::One { tree, list } => (std::slice::from_ref(&**tree), list.events()),
        };
        let counts: Vec<Counts> = trees.iter().map(KineticTree::counts).collect();
        let of_trees: u64 = counts.iter().map(Counts::events).sum();
        [counts.iter().map(|counts| counts.updates).sum(), of_trees + events]
    }

    /// Returns `true` if two triangles have a point in common. Those of one mesh that share a corner do
    /// not count.
    fn meets(&self) -> bool {
        match self {
            Self::Two { trees, list } => {
                let [a, b] = &**trees;
                list.any_overlap(a, b, |i, j| Some(true) == pair_meets([a, b], [i, j]))
            }
            Self::One { tree, list } => list.any_overlap(tree, |i, j| {
                let corners = [i, j].map(|triangle| tree.primitive(triangle).unwrap_or_default());
                let are_apart = !corners[0].iter().any(|corner| corners[1].contains(corner));
                are_apart && Some(true) == pair_meets([tree; 2], [i, j])
            }),
        }
    }
}

/// Returns `true` if a triangle of each tree have a point in common, `None` if there are no such triangles.
fn pair_meets(trees: [&KineticTree; 2], [i, j]: [u32; 2]) -> Option<bool> {
    let corners = |tree: &KineticTree, triangle: u32| {
        let points = tree.primitive(triangle)?;
        let [a, b, c] = [0, 1, 2].map(|n| tree.position(points[n]));
        Some([a?, b?, c?])
    };
    Some(triangles_meet(&corners(trees[0], i)?, &corners(trees[1], j)?))
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
        "--method kinetic: expected meshes, got {got}; use --method refit, or give frames with faces, and a mesh to \
         --against or --against-frames"
    ))
}

fn fault(cause: &KineticError) -> CliError {
    CliError::Usage(format!("--method kinetic: {cause}"))
}
