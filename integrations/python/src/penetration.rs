//! The answer of `penetration`.

use bytemuck::{Pod, Zeroable};
use pyo3::prelude::*;

use crate::codes::{answer, bounds_in_words, evidence_code, evidence_name, is_one, plain};

/// The numbers of a penetration. No array holds them.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct PenetrationRecord {
    direction: [f64; 3],
    lower: f64,
    upper: f64,
    band: f64,
    evaluations: u64,
    node_pairs: u64,
    leaf_pairs: u64,
    evidence: i8,
    complete: u8,
    _padding: [u8; 6],
}

impl PenetrationRecord {
    pub(crate) fn new(found: &nearmiss::Penetration) -> Self {
        let statistics = found.statistics;
        Self {
            direction: found.direction,
            lower: found.lower,
            upper: found.upper,
            band: found.band,
            evaluations: statistics.evaluations,
            node_pairs: statistics.node_pairs,
            leaf_pairs: statistics.leaf_pairs,
            evidence: evidence_code(found.evidence),
            complete: found.complete.into(),
            _padding: [0; 6],
        }
    }
}

answer! {
    /// The answer of `penetration`: bounds of the length of the shortest move that frees the second thing.
    Penetration of PenetrationRecord by penetration_in_words {
        /// A lower bound, a length: no shorter move frees it. 0 if no bound was found.
        lower: f64 = plain,
        /// An upper bound, a length: a move of this length along `direction` frees it. 0 if it is free,
        /// infinite if no move was found.
        upper: f64 = plain,
        /// The unit vector of that move, in the world; zero if none is needed or known.
        direction: [f64; 3] = plain,
        /// The evidence that the two are apart after that move: "certified" or "estimated".
        evidence: Option<&'static str> = evidence_name,
        /// The local spacing, below which scans do not determine whether the two are apart after that move, a
        /// length; 0 for meshes and shapes, infinite if nothing is known.
        band: f64 = plain,
        /// False if a limit ended the search. Both bounds hold even so, but may be further apart.
        complete: bool = is_one,
        /// The number of evaluations of the surface.
        evaluations: u64 = plain,
        /// The number of pairs of nodes that were compared.
        node_pairs: u64 = plain,
        /// The number of pairs of leaves that were compared.
        leaf_pairs: u64 = plain,
    }
}

fn penetration_in_words(record: &PenetrationRecord) -> String {
    bounds_in_words([record.lower, record.upper], record.evidence)
}
