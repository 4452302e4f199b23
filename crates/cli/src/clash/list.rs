//! A clash list with its inputs and plan, and its reports for scripts.

use std::path::Path;

use nearmiss::{Clash, ClashKind, ClashPlan, Clashes, Contact, Placed};
use serde::Serialize;

use crate::evidence::word;
use crate::sentence::unit;

/// A clash list with its inputs and plan.
pub(crate) struct List<'a> {
    pub(crate) inputs: [&'a Path; 2],
    pub(crate) views: [&'a Placed<'a>; 2],
    /// `true` if balls about the points are compared instead of surfaces.
    pub(crate) of_points: bool,
    pub(crate) plan: &'a ClashPlan,
    pub(crate) found: &'a Clashes,
}

impl List<'_> {
    pub(crate) fn count(&self, kind: ClashKind) -> usize {
        self.found.clashes.iter().filter(|clash| clash.kind == kind).count()
    }

    /// The unit to which lengths are rounded.
    pub(crate) fn unit(&self) -> f64 {
        unit(self.views)
    }

    /// The clashes, for scripts.
    pub(crate) fn reports(&self) -> impl Iterator<Item = ClashReport> {
        (1..).zip(&self.found.clashes).map(|(id, clash)| ClashReport::new(id, clash, &self.found.contacts))
    }
}

/// A clash, for scripts.
#[derive(Debug, Serialize)]
pub(crate) struct ClashReport {
    pub(crate) id: usize,
    pub(crate) kind: &'static str,
    pub(crate) centre: [f64; 3],
    pub(crate) size: [f64; 3],
    bounds: [[f64; 3]; 2],
    pub(crate) lower: f64,
    pub(crate) upper: f64,
    pub(crate) evidence: &'static str,
    pub(crate) contacts: usize,
    /// The number of near contacts around a hard clash.
    pub(crate) surroundings: usize,
    /// The length of the move of b out of a hard clash. Null unless asked for.
    pub(crate) depth: Option<f64>,
    pub(crate) depth_lower: Option<f64>,
    pub(crate) depth_direction: Option<[f64; 3]>,
    /// The place of the contact with the least residual.
    pub(crate) point: [f64; 3],
    residual: f64,
    pub(crate) source_a: u32,
    pub(crate) source_b: u32,
}

impl ClashReport {
    fn new(id: usize, clash: &Clash, contacts: &[Contact]) -> Self {
        let nearest = &contacts[clash.group.nearest];
        let depth = clash.depth.filter(|depth| depth.upper.is_finite());
        Self {
            id,
            kind: kind_word(clash.kind),
            centre: clash.group.centre(),
            size: clash.group.size(),
            bounds: [clash.group.bounds.min, clash.group.bounds.max],
            lower: clash.lower,
            upper: clash.upper,
            evidence: word(clash.evidence),
            contacts: clash.group.contacts.len(),
            surroundings: clash.surroundings.len(),
            depth: depth.map(|depth| depth.upper),
            depth_lower: depth.map(|depth| depth.lower),
            depth_direction: depth.map(|depth| depth.direction),
            point: nearest.point,
            residual: nearest.residual,
            source_a: nearest.sources[0].0,
            source_b: nearest.sources[1].0,
        }
    }
}

fn kind_word(kind: ClashKind) -> &'static str {
    match kind {
        ClashKind::Hard => "hard",
        ClashKind::Clearance => "clearance",
    }
}
