//! The penetration of two meshes: how far and in which direction to shift one out of the other.

mod contacts;
mod deepest;
mod probe;
mod search;
mod triangle_depth;

use std::ops::ControlFlow;

use fearless_simd::Level;
use nearmiss_hierarchy::Stack;
use serde::{Deserialize, Serialize};

use crate::ask::answer::Statistics;
use crate::ask::budget::Budget;
use crate::mesh::placed::PlacedMesh;
use crate::mesh::solid::MeshSolid;
use contacts::ContactSurvey;
use probe::{Probe, Vector};
use search::{Search, Shift};

/// The penetration of two meshes, in world units: lower ≤ length of the least shift of b that
/// separates them ≤ upper.
///
/// Separated means that their [solids](MeshSolid) have no point in common: no triangles meet, and
/// no closed part of one encloses a part of the other.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MeshPenetration {
    /// A lower bound: every shift that is shorter leaves a common point.
    pub lower: f64,
    /// The length of a shift that separates the meshes: 0 if they are separate, infinite if a pose is
    /// invalid or a solid is that of another mesh.
    pub upper: f64,
    /// The unit vector along which b, shifted by [`Self::upper`], is separate from a. 0 if none is
    /// needed or known.
    pub direction: [f64; 3],
    /// `true` if the search ended before the budget did. The bounds may still differ.
    pub complete: bool,
    /// The cost of the query.
    pub statistics: Statistics,
}

impl MeshPenetration {
    /// A penetration that is not known.
    const UNKNOWN: Self = Self {
        lower: 0.0,
        upper: f64::INFINITY,
        direction: [0.0; 3],
        complete: false,
        statistics: Statistics { evaluations: 0, node_pairs: 0, leaf_pairs: 0, neighbour_steps: 0 },
    };
}

/// Working memory of a search.
#[derive(Debug, Clone, Default)]
pub(crate) struct PenetrationScratch(ContactSurvey);

/// Bounds the penetration of two placed meshes with these solids.
pub(crate) fn penetration(
    meshes: [PlacedMesh<'_>; 2],
    solids: [&MeshSolid; 2],
    budget: &Budget,
    (level, stack): (Level, &mut Stack),
    scratch: &mut PenetrationScratch,
) -> MeshPenetration {
    if !(solids[0].is_of(meshes[0].mesh()) && solids[1].is_of(meshes[1].mesh())) {
        return MeshPenetration::UNKNOWN;
    }
    let views = meshes.map(|placed| placed.mesh().arrays());
    let mut probe = Probe::new(meshes, &views, solids, budget, (level, stack));
    let Some(out) = probe.out_of_balls() else { return MeshPenetration::UNKNOWN };
    let mut search =
        Search { probe: &mut probe, contacts: &mut scratch.0, best: Shift::new(out), lower: 0.0 };
    let flow = match search.probe.is_apart(Vector::zeros()) {
        ControlFlow::Continue(true) => {
            let statistics = probe.spent;
            return MeshPenetration { upper: 0.0, complete: true, statistics, ..MeshPenetration::UNKNOWN };
        }
        ControlFlow::Continue(false) => search.narrow(),
        ControlFlow::Break(()) => ControlFlow::Break(()),
    };
    let Search { best, lower, .. } = search;
    MeshPenetration {
        lower: lower.min(best.length),
        upper: best.length,
        direction: best.way.into(),
        complete: flow.is_continue(),
        statistics: probe.spent,
    }
}
