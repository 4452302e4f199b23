//! Answers about two scans: a record in arrays, and a class with the same names for one question.

use nearmiss::{Evidence, Reason, Verdict};
use pyo3::prelude::*;

use crate::codes::{
    NONE, NOWHERE, answer, evidence_code, evidence_name, index, is_one, is_touching, number, plain,
    reason_code, reason_name, shown, undecided, vector, verdict_name,
};
use crate::record::record;

record! {
    /// An answer of `collide`.
    AnswerRecord {
        witness: [f64; 3] = "3f8",
        normal_a: [f64; 3] = "3f8",
        normal_b: [f64; 3] = "3f8",
        residual: f64 = "f8",
        gap: f64 = "f8",
        band: f64 = "f8",
        likelihood: f64 = "f8",
        source_a: i64 = "i8",
        source_b: i64 = "i8",
        evaluations: u64 = "u8",
        node_pairs: u64 = "u8",
        leaf_pairs: u64 = "u8",
        verdict: i8 = "i1",
        evidence: i8 = "i1",
        reason: i8 = "i1",
        _padding: [u8; 5] = "5u1",
    }
}

impl AnswerRecord {
    pub(crate) fn new(answer: &nearmiss::Answer) -> Self {
        let statistics = answer.statistics;
        let none = Self {
            witness: NOWHERE,
            normal_a: NOWHERE,
            normal_b: NOWHERE,
            residual: NONE,
            gap: NONE,
            band: answer.band,
            likelihood: NONE,
            source_a: -1,
            source_b: -1,
            evaluations: statistics.evaluations,
            node_pairs: statistics.node_pairs,
            leaf_pairs: statistics.leaf_pairs,
            verdict: -1,
            evidence: -1,
            reason: 0,
            _padding: [0; 5],
        };
        match answer.verdict {
            Verdict::Intersecting { contact, evidence } => {
                let [normal_a, normal_b] = contact.normals.unwrap_or([NOWHERE; 2]);
                let [source_a, source_b] = contact.sources.map(|source| i64::from(source.0));
                let (witness, residual) = (contact.point, contact.residual);
                let evidence = evidence_code(evidence);
                Self {
                    verdict: 1,
                    witness,
                    normal_a,
                    normal_b,
                    residual,
                    source_a,
                    source_b,
                    evidence,
                    ..none
                }
            }
            Verdict::Separated { gap, evidence } => {
                let gap = if evidence == Evidence::Certified { gap } else { NONE };
                Self { verdict: 0, gap, evidence: evidence_code(evidence), ..none }
            }
            Verdict::Undecided(reason) => {
                let likelihood = if let Reason::Budget { likelihood } = reason { likelihood } else { NONE };
                Self { reason: reason_code(reason), likelihood, ..none }
            }
        }
    }
}

answer! {
    /// The answer of `Scan.collide`.
    Answer of AnswerRecord by answer_in_words {
        @verdict touches: ["separated", "intersecting"],
        evidence: Option<&'static str> = evidence_name,
        reason: Option<&'static str> = reason_name,
        witness: Option<[f64; 3]> = vector,
        normal_a: Option<[f64; 3]> = vector,
        normal_b: Option<[f64; 3]> = vector,
        residual: Option<f64> = number,
        gap: Option<f64> = number,
        band: f64 = plain,
        likelihood: Option<f64> = number,
        source_a: Option<i64> = index,
        source_b: Option<i64> = index,
        evaluations: u64 = plain,
        node_pairs: u64 = plain,
        leaf_pairs: u64 = plain,
    }
}

fn answer_in_words(record: &AnswerRecord) -> String {
    match record.verdict {
        1 => format!("touching at {:?}{}", record.witness, shown(record.evidence)),
        0 if record.evidence == 1 => format!("apart by at least {}, certified", record.gap),
        0 => format!("apart{}", shown(record.evidence)),
        _ => undecided(record.reason),
    }
}

record! {
    /// The bounds of `distance`.
    DistanceRecord {
        point_a: [f64; 3] = "3f8",
        point_b: [f64; 3] = "3f8",
        lower: f64 = "f8",
        upper: f64 = "f8",
        band: f64 = "f8",
        source_a: i64 = "i8",
        source_b: i64 = "i8",
        evaluations: u64 = "u8",
        node_pairs: u64 = "u8",
        leaf_pairs: u64 = "u8",
        evidence: i8 = "i1",
        complete: u8 = "?",
        _padding: [u8; 6] = "6u1",
    }
}

impl DistanceRecord {
    pub(crate) fn new(distance: &nearmiss::Distance) -> Self {
        let [point_a, point_b] = distance.points;
        let [source_a, source_b] = distance.sources.map(|source| i64::from(source.0));
        let statistics = distance.statistics;
        Self {
            point_a,
            point_b,
            lower: distance.lower,
            upper: distance.upper,
            band: distance.band,
            source_a,
            source_b,
            evaluations: statistics.evaluations,
            node_pairs: statistics.node_pairs,
            leaf_pairs: statistics.leaf_pairs,
            evidence: evidence_code(distance.evidence),
            complete: distance.complete.into(),
            _padding: [0; 6],
        }
    }
}

answer! {
    /// The answer of `Scan.distance`.
    Distance of DistanceRecord by distance_in_words {
        lower: f64 = plain,
        upper: f64 = plain,
        point_a: [f64; 3] = plain,
        point_b: [f64; 3] = plain,
        band: f64 = plain,
        source_a: i64 = plain,
        source_b: i64 = plain,
        evidence: Option<&'static str> = evidence_name,
        complete: bool = is_one,
        evaluations: u64 = plain,
        node_pairs: u64 = plain,
        leaf_pairs: u64 = plain,
    }
}

fn distance_in_words(record: &DistanceRecord) -> String {
    format!("between {} and {}{}", record.lower, record.upper, shown(record.evidence))
}

record! {
    /// A contact of all contacts of two scans.
    ContactRecord {
        point: [f64; 3] = "3f8",
        normal_a: [f64; 3] = "3f8",
        normal_b: [f64; 3] = "3f8",
        residual: f64 = "f8",
        source_a: i64 = "i8",
        source_b: i64 = "i8",
    }
}

impl ContactRecord {
    pub(crate) fn new(contact: &nearmiss::Contact) -> Self {
        let [normal_a, normal_b] = contact.normals.unwrap_or([NOWHERE; 2]);
        let [source_a, source_b] = contact.sources.map(|source| i64::from(source.0));
        Self { point: contact.point, normal_a, normal_b, residual: contact.residual, source_a, source_b }
    }
}

record! {
    /// A point of a contact manifold.
    ManifoldRecord {
        point: [f64; 3] = "3f8",
        normal: [f64; 3] = "3f8",
        gap: f64 = "f8",
        source_a: i64 = "i8",
        source_b: i64 = "i8",
    }
}

impl ManifoldRecord {
    pub(crate) fn new(place: &nearmiss::ManifoldPoint) -> Self {
        let [source_a, source_b] = place.sources.map(|source| i64::from(source.0));
        Self { point: place.point, normal: place.normal, gap: place.gap, source_a, source_b }
    }
}
