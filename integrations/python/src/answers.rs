//! Answers about two scans: a record in arrays, and a class with the same names for one question.

use nearmiss::{BodyVerdict, Evidence, MeshVerdict, Reason, ShapeVerdict, Verdict};
use pyo3::prelude::*;

use crate::codes::{
    BUDGET, NONE, NOWHERE, answer, bounds_in_words, contact_in_words, evidence_code, evidence_name, index,
    is_one, is_touching, number, plain, reason_code, reason_name, vector, verdict_name,
};
use crate::record::{Record, record};

/// An answer about two things.
pub(crate) trait PairRecord: Record + Send {
    /// The answer with both sides exchanged.
    fn swapped(self) -> Self;
}

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
        complete: u8 = "?",
        _padding: [u8; 4] = "4u1",
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
            complete: 1,
            _padding: [0; 4],
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
                Self { likelihood, ..none.undecided(reason_code(reason)) }
            }
        }
    }
}

impl PairRecord for AnswerRecord {
    fn swapped(self) -> Self {
        let Self { normal_a, normal_b, source_a, source_b, .. } = self;
        Self { normal_a: normal_b, normal_b: normal_a, source_a: source_b, source_b: source_a, ..self }
    }
}

impl AnswerRecord {
    /// An answer of which nothing is known but the band.
    fn unasked(band: f64) -> Self {
        Self { likelihood: NONE, band, reason: 0, complete: 1, ..Self::new(&nearmiss::Answer::UNASKED) }
    }

    /// An undecided answer, incomplete if the reason is a limit.
    fn undecided(self, reason: i8) -> Self {
        Self { reason, complete: (reason != BUDGET).into(), ..self }
    }

    /// The same answer, with a list that is complete or not.
    pub(crate) fn with_list(self, is_complete: bool) -> Self {
        Self { complete: is_complete.into(), ..self }
    }

    /// An answer about a scan and a shape.
    pub(crate) fn of_shape(answer: &nearmiss::ShapeAnswer) -> Self {
        let none = Self::unasked(answer.band);
        match answer.verdict {
            ShapeVerdict::Touching { point: witness, source, evidence } => {
                let (source_a, evidence) = (source.0.into(), evidence_code(evidence));
                Self { verdict: 1, witness, source_a, evidence, ..none }
            }
            ShapeVerdict::Separated { evidence } => {
                Self { verdict: 0, evidence: evidence_code(evidence), ..none }
            }
            ShapeVerdict::Undecided(reason) => none.undecided(reason_code(reason)),
        }
    }

    /// An answer about two bodies.
    pub(crate) fn of_bodies(answer: &nearmiss::BodyAnswer) -> Self {
        let none = Self::unasked(answer.band);
        match answer.verdict {
            BodyVerdict::Touching { point: witness, evidence } => {
                Self { verdict: 1, witness, evidence: evidence_code(evidence), ..none }
            }
            BodyVerdict::Separated { evidence } => {
                Self { verdict: 0, evidence: evidence_code(evidence), ..none }
            }
            BodyVerdict::Undecided(reason) => none.undecided(reason_code(reason)),
        }
    }

    /// An answer about two meshes, which is exact unless it is undecided. Sources are triangles.
    pub(crate) fn of_meshes(answer: &nearmiss::MeshAnswer) -> Self {
        let mut record = Self { likelihood: answer.likelihood, ..Self::unasked(0.0) };
        let statistics = answer.statistics;
        (record.node_pairs, record.leaf_pairs) = (statistics.node_pairs, statistics.leaf_pairs);
        match answer.verdict {
            MeshVerdict::Intersecting(contact) => {
                let best = MeshContactRecord::new(&contact);
                (record.verdict, record.evidence, record.residual) = (1, 1, 0.0);
                (record.witness, record.normal_a, record.normal_b) =
                    (best.point, best.normal_a, best.normal_b);
                (record.source_a, record.source_b) = (best.triangle_a, best.triangle_b);
            }
            MeshVerdict::Separated => (record.verdict, record.evidence, record.gap) = (0, 1, 0.0),
            MeshVerdict::Pose => record = record.undecided(reason_code(Reason::Pose)),
            _ => record = record.undecided(BUDGET),
        }
        record
    }
}

answer! {
    /// The answer of `collide`.
    Answer of AnswerRecord by answer_in_words {
        @verdict touches: ["separated", "intersecting"],
        /// The evidence of the verdict: "certified" or "estimated"; None if it is undecided.
        evidence: Option<&'static str> = evidence_name,
        /// The reason why the verdict is undecided, in a word, such as "budget"; else None.
        reason: Option<&'static str> = reason_name,
        /// False if a limit ended the search, so that the verdict is undecided, or the list that belongs to
        /// it may lack contacts.
        complete: bool = is_one,
        /// A place where the two touch, in the world; None if they are apart or undecided.
        witness: Option<[f64; 3]> = vector,
        /// The unit normal of the first thing at the witness, in the world; None if it has none.
        normal_a: Option<[f64; 3]> = vector,
        /// The unit normal of the second thing at the witness, in the world; None if it has none.
        normal_b: Option<[f64; 3]> = vector,
        /// The distance of the witness from the two surfaces, a length; None without a witness.
        residual: Option<f64> = number,
        /// A proven lower bound of the distance of the two, a length; None without a proof.
        gap: Option<f64> = number,
        /// The local spacing, below which the two do not determine the truth, a length.
        band: f64 = plain,
        /// The likelihood of contact, from 0 to 1, if a limit ended the search; else None.
        likelihood: Option<f64> = number,
        /// The index of a point (of a triangle, for a mesh) of the first thing near the witness, in its
        /// input; None without one.
        source_a: Option<i64> = index,
        /// The same for the second thing.
        source_b: Option<i64> = index,
        /// The number of evaluations of the surface.
        evaluations: u64 = plain,
        /// The number of pairs of nodes that were compared.
        node_pairs: u64 = plain,
        /// The number of pairs of leaves that were compared.
        leaf_pairs: u64 = plain,
    }
}

fn answer_in_words(record: &AnswerRecord) -> String {
    if record.gap > 0.0 {
        return format!("apart by at least {}, certified", record.gap);
    }
    contact_in_words(record.verdict, record.witness, record.evidence, record.reason)
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
    /// The record of a distance that is not known.
    pub(crate) const UNKNOWN: Self = Self {
        point_a: NOWHERE,
        point_b: NOWHERE,
        lower: 0.0,
        upper: f64::INFINITY,
        band: NONE,
        source_a: -1,
        source_b: -1,
        evaluations: 0,
        node_pairs: 0,
        leaf_pairs: 0,
        evidence: -1,
        complete: 0,
        _padding: [0; 6],
    };

    /// The record of the distance of two bodies. The evidence and the band are not known, unless neither body
    /// is a scan: bounds about meshes and shapes are exact.
    pub(crate) fn of_bodies(
        (lower, upper): (f64, f64),
        [point_a, point_b]: [[f64; 3]; 2],
        has_scan: bool,
    ) -> Self {
        let (evidence, band) = if has_scan { (-1, NONE) } else { (evidence_code(Evidence::Certified), 0.0) };
        Self { point_a, point_b, lower, upper, evidence, band, complete: 1, ..Self::UNKNOWN }
    }

    /// The record of the distance of a scan and a shape.
    pub(crate) fn of_shape(distance: &nearmiss::ShapeDistance) -> Self {
        let (band, source_a) = (distance.band, distance.source.0.into());
        let evidence = evidence_code(distance.evidence);
        let bounds = (distance.lower, distance.upper);
        Self { band, source_a, evidence, ..Self::of_bodies(bounds, distance.points, true) }
    }

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
    /// The answer of `distance`.
    Distance of DistanceRecord by distance_in_words {
        /// A lower bound of the distance, a length; 0 if the two may touch, or if nothing is known.
        lower: f64 = plain,
        /// An upper bound of the distance: that of the two points; infinite if nothing is known.
        upper: f64 = plain,
        /// A point of the first thing, in the world; None if nothing is known.
        point_a: Option<[f64; 3]> = vector,
        /// A point of the second thing near it, in the world; None if nothing is known.
        point_b: Option<[f64; 3]> = vector,
        /// The local spacing, below which the two do not determine the truth, a length; 0 for meshes and
        /// shapes. None if it is not known, as for a scan in `World.nearest`.
        band: Option<f64> = number,
        /// The index of the point (of the triangle, for a mesh) of the first thing, in its input. None for a
        /// shape, for a mesh with a shape, and in `World.nearest`.
        source_a: Option<i64> = index,
        /// The same for the second thing.
        source_b: Option<i64> = index,
        /// The evidence of the upper bound: "certified" if the two points were verified to be on the
        /// surfaces, else "estimated". None if it is not known, as for a scan in `World.nearest`.
        evidence: Option<&'static str> = evidence_name,
        /// False if a limit ended the search before the bounds were as near as requested.
        complete: bool = is_one,
        /// The number of evaluations of the surface.
        evaluations: u64 = plain,
        /// The number of pairs of nodes that were compared.
        node_pairs: u64 = plain,
        /// The number of pairs of leaves that were compared.
        leaf_pairs: u64 = plain,
    }
}

fn distance_in_words(record: &DistanceRecord) -> String {
    bounds_in_words([record.lower, record.upper], record.evidence)
}

impl PairRecord for DistanceRecord {
    fn swapped(self) -> Self {
        let Self { point_a, point_b, source_a, source_b, .. } = self;
        Self { point_a: point_b, point_b: point_a, source_a: source_b, source_b: source_a, ..self }
    }
}

impl DistanceRecord {
    /// The distance of two meshes, which is exact. Sources are triangles.
    pub(crate) fn of_meshes(distance: &nearmiss::MeshDistance) -> Self {
        let [point_a, point_b] = distance.points;
        let [source_a, source_b] = distance.triangles.map(i64::from);
        let statistics = distance.statistics;
        Self {
            point_a,
            point_b,
            lower: distance.lower,
            upper: distance.upper,
            band: 0.0,
            source_a,
            source_b,
            evaluations: 0,
            node_pairs: statistics.node_pairs,
            leaf_pairs: statistics.leaf_pairs,
            evidence: 1,
            complete: distance.complete.into(),
            _padding: [0; 6],
        }
    }
}

record! {
    /// A contact of two triangles.
    MeshContactRecord {
        point: [f64; 3] = "3f8",
        ends: [[f64; 3]; 2] = "(2,3)f8",
        normal_a: [f64; 3] = "3f8",
        normal_b: [f64; 3] = "3f8",
        triangle_a: i64 = "i8",
        triangle_b: i64 = "i8",
    }
}

impl MeshContactRecord {
    pub(crate) fn new(contact: &nearmiss::MeshContact) -> Self {
        let [normal_a, normal_b] = contact.normals;
        let [triangle_a, triangle_b] = contact.triangles.map(i64::from);
        Self { point: contact.point, ends: contact.ends, normal_a, normal_b, triangle_a, triangle_b }
    }
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
    /// A clash.
    ClashRecord {
        centre: [f64; 3] = "3f8",
        size: [f64; 3] = "3f8",
        lower: f64 = "f8",
        upper: f64 = "f8",
        depth: f64 = "f8",
        depth_lower: f64 = "f8",
        depth_direction: [f64; 3] = "3f8",
        point: [f64; 3] = "3f8",
        residual: f64 = "f8",
        source_a: i64 = "i8",
        source_b: i64 = "i8",
        contacts: u64 = "u8",
        surroundings: u64 = "u8",
        hard: u8 = "?",
        evidence: i8 = "i1",
        _padding: [u8; 6] = "6u1",
    }
}

impl ClashRecord {
    /// `contacts` are those of all clashes.
    pub(crate) fn new(clash: &nearmiss::Clash, contacts: &[nearmiss::Contact]) -> Self {
        let best = ContactRecord::new(&contacts[clash.group.nearest]);
        let depth = clash.depth.filter(|depth| depth.upper.is_finite());
        Self {
            centre: clash.group.centre(),
            size: clash.group.size(),
            lower: clash.lower,
            upper: clash.upper,
            depth: depth.map_or(NONE, |depth| depth.upper),
            depth_lower: depth.map_or(NONE, |depth| depth.lower),
            depth_direction: depth.map_or(NOWHERE, |depth| depth.direction),
            point: best.point,
            residual: best.residual,
            source_a: best.source_a,
            source_b: best.source_b,
            contacts: clash.group.contacts.len() as u64,
            surroundings: clash.surroundings.len() as u64,
            hard: (clash.kind == nearmiss::ClashKind::Hard).into(),
            evidence: evidence_code(clash.evidence),
            _padding: [0; 6],
        }
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
