//! Answers about shapes and rays.

use nearmiss::ShapeVerdict;
use pyo3::prelude::*;

use crate::codes::{
    NONE, NOWHERE, answer, bounds_in_words, contact_in_words, evidence_code, evidence_name, index, is_one,
    is_touching, number, plain, reason_code, reason_name, shown, vector, verdict_name,
};
use crate::record::record;

record! {
    /// An answer of `touch`.
    ShapeRecord {
        point: [f64; 3] = "3f8",
        band: f64 = "f8",
        source: i64 = "i8",
        verdict: i8 = "i1",
        evidence: i8 = "i1",
        reason: i8 = "i1",
        _padding: [u8; 5] = "5u1",
    }
}

impl ShapeRecord {
    pub(crate) fn new(answer: &nearmiss::ShapeAnswer) -> Self {
        let band = answer.band;
        let none =
            Self { point: NOWHERE, band, source: -1, verdict: -1, evidence: -1, reason: 0, _padding: [0; 5] };
        match answer.verdict {
            ShapeVerdict::Touching { point, source, evidence } => {
                Self { point, source: source.0.into(), verdict: 1, evidence: evidence_code(evidence), ..none }
            }
            ShapeVerdict::Separated { evidence } => {
                Self { verdict: 0, evidence: evidence_code(evidence), ..none }
            }
            ShapeVerdict::Undecided(reason) => Self { reason: reason_code(reason), ..none },
        }
    }
}

answer! {
    /// The answer of `Target.touch`.
    ShapeAnswer of ShapeRecord by touch_in_words {
        @verdict touches: ["separated", "touching"],
        /// The evidence of the verdict: "certified" or "estimated"; None if it is undecided.
        evidence: Option<&'static str> = evidence_name,
        /// The reason why the verdict is undecided, in a word; else None.
        reason: Option<&'static str> = reason_name,
        /// A place of the scan that touches the shape, in the world; None if they are apart.
        point: Option<[f64; 3]> = vector,
        /// The index of the scanned point at that place, in the input; None if they are apart.
        source: Option<i64> = index,
        /// The local spacing, below which the scan does not determine the truth, a length.
        band: f64 = plain,
    }
}

fn touch_in_words(record: &ShapeRecord) -> String {
    contact_in_words(record.verdict, record.point, record.evidence, record.reason)
}

record! {
    /// Bounds on the distance of a shape.
    ShapeDistanceRecord {
        point: [f64; 3] = "3f8",
        point_of_shape: [f64; 3] = "3f8",
        lower: f64 = "f8",
        upper: f64 = "f8",
        band: f64 = "f8",
        source: i64 = "i8",
        evidence: i8 = "i1",
        _padding: [u8; 7] = "7u1",
    }
}

impl ShapeDistanceRecord {
    /// The record of a distance of which only this lower bound is known.
    pub(crate) fn beyond(lower: f64) -> Self {
        Self {
            point: NOWHERE,
            point_of_shape: NOWHERE,
            lower,
            upper: f64::INFINITY,
            band: NONE,
            source: -1,
            evidence: -1,
            _padding: [0; 7],
        }
    }

    pub(crate) fn new(distance: &nearmiss::ShapeDistance) -> Self {
        let [point, point_of_shape] = distance.points;
        Self {
            point,
            point_of_shape,
            lower: distance.lower,
            upper: distance.upper,
            band: distance.band,
            source: distance.source.0.into(),
            evidence: evidence_code(distance.evidence),
            _padding: [0; 7],
        }
    }
}

answer! {
    /// The answer of `Target.distance`.
    ShapeDistance of ShapeDistanceRecord by shape_distance_in_words {
        /// A lower bound of the distance, a length, proven; 0 if the two may touch, or if nothing is known.
        lower: f64 = plain,
        /// An upper bound of the distance: that of the two points; infinite if it is too far.
        upper: f64 = plain,
        /// The nearest place of the scan, in the world; None if it is too far.
        point: Option<[f64; 3]> = vector,
        /// The nearest place of the shape, in the world; None if it is too far.
        point_of_shape: Option<[f64; 3]> = vector,
        /// The index of the scanned point at the nearest place, in the input; None if it is too far.
        source: Option<i64> = index,
        /// The local spacing, below which the scan does not determine the truth, a length; None if it is too
        /// far.
        band: Option<f64> = number,
        /// The evidence of the upper bound: "certified" if the nearest place belongs to a ball about a
        /// point, "estimated" if it belongs to a tangent disc; None if it is too far.
        evidence: Option<&'static str> = evidence_name,
    }
}

fn shape_distance_in_words(record: &ShapeDistanceRecord) -> String {
    bounds_in_words([record.lower, record.upper], record.evidence)
}

record! {
    /// A contact of a shape.
    ShapeContactRecord {
        point: [f64; 3] = "3f8",
        normal: [f64; 3] = "3f8",
        depth: f64 = "f8",
        id: u64 = "u8",
    }
}

impl ShapeContactRecord {
    pub(crate) fn new(contact: &nearmiss::ShapeContact) -> Self {
        Self { point: contact.point, normal: contact.normal, depth: contact.depth, id: contact.id }
    }
}

record! {
    /// An answer of `cast`.
    RayRecord {
        point: [f64; 3] = "3f8",
        normal: [f64; 3] = "3f8",
        t: f64 = "f8",
        source: i64 = "i8",
        hit: u8 = "?",
        evidence: i8 = "i1",
        _padding: [u8; 6] = "6u1",
    }
}

impl RayRecord {
    pub(crate) fn new(answer: &nearmiss::RayAnswer) -> Self {
        let evidence = evidence_code(answer.evidence);
        let _padding = [0; 6];
        match answer.hit {
            Some(hit) => Self {
                point: hit.point,
                normal: hit.normal,
                t: hit.t,
                source: hit.source.0.into(),
                hit: 1,
                evidence,
                _padding,
            },
            None => Self { point: NOWHERE, normal: NOWHERE, t: NONE, source: -1, hit: 0, evidence, _padding },
        }
    }
}

answer! {
    /// The answer of `Target.cast`.
    RayAnswer of RayRecord by ray_in_words {
        /// True if the ray hits the scan.
        hit: bool = is_one,
        /// The distance from the origin to the hit, or how far a ball moves until it touches; None without a
        /// hit. A length in the world, whatever the length of the direction.
        t: Option<f64> = number,
        /// The place that is hit, in the world; None without a hit.
        point: Option<[f64; 3]> = vector,
        /// The unit normal there: outwards if the scan is oriented (`Scan.is_oriented`), which may be along
        /// the ray; otherwise to the side from which the ray comes. None without a hit.
        normal: Option<[f64; 3]> = vector,
        /// The index of the scanned point at the hit, in the input; None without a hit.
        source: Option<i64> = index,
        /// The evidence of the hit, or of there being none: "certified" or "estimated".
        evidence: Option<&'static str> = evidence_name,
    }
}

fn ray_in_words(record: &RayRecord) -> String {
    let evidence = shown(record.evidence);
    if record.hit == 1 { format!("hit at t = {}{evidence}", record.t) } else { format!("no hit{evidence}") }
}
