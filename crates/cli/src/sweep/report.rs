//! The answer of `sweep` as JSON and as a sentence.

use nearmiss::{Contact, Evidence, SweepAnswer, SweepReason, SweepVerdict};
use serde::Serialize;

use crate::digits::{count, place, rough, rounded_down, rounded_up, short, work};
use crate::evidence::word;
use crate::motion_words::{reason_word, time, time_down};

/// The JSON output of `sweep`. Times count lines from the first one, which is at 0.
#[derive(Debug, Serialize)]
pub(super) struct Report {
    verdict: &'static str,
    evidence: Option<&'static str>,
    /// The motion is proven free up to this time.
    t_free: f64,
    t_hit: Option<f64>,
    contact: Option<ContactReport>,
    /// The distance that is proven for the whole motion.
    clearance: Option<f64>,
    /// The time of the least distance that was measured.
    clearance_at: Option<f64>,
    /// The least distance that was measured, from above.
    clearance_upper: Option<f64>,
    reason: Option<&'static str>,
    /// The local spacing of the scans where they were nearest, in world units.
    band: f64,
    distances: u32,
    contacts: u32,
    intervals: u32,
    evaluations: u64,
    node_pairs: u64,
    leaf_pairs: u64,
    micros: f64,
}

#[derive(Debug, Serialize)]
struct ContactReport {
    point: [f64; 3],
    normal_a: Option<[f64; 3]>,
    normal_b: Option<[f64; 3]>,
    residual: f64,
    source_a: u32,
    source_b: u32,
}

impl ContactReport {
    fn new(contact: &Contact) -> Self {
        Self {
            point: contact.point,
            normal_a: contact.normals.map(|normals| normals[0]),
            normal_b: contact.normals.map(|normals| normals[1]),
            residual: contact.residual,
            source_a: contact.sources[0].0,
            source_b: contact.sources[1].0,
        }
    }
}

impl Report {
    /// The report of an answer about a motion of this duration.
    pub(super) fn new(answer: &SweepAnswer, duration: f64, micros: f64) -> Self {
        let report = Self {
            verdict: "undecided",
            evidence: None,
            t_free: 0.0,
            t_hit: None,
            contact: None,
            clearance: None,
            clearance_at: None,
            clearance_upper: None,
            reason: None,
            band: answer.band,
            distances: answer.distances,
            contacts: answer.contacts,
            intervals: answer.intervals,
            evaluations: answer.statistics.evaluations,
            node_pairs: answer.statistics.node_pairs,
            leaf_pairs: answer.statistics.leaf_pairs,
            micros,
        };
        match answer.verdict {
            SweepVerdict::Free { clearance, upper, at } => Self {
                verdict: "free",
                evidence: Some(word(Evidence::Certified)),
                t_free: duration,
                clearance: Some(clearance),
                clearance_at: Some(at),
                clearance_upper: Some(upper),
                ..report
            },
            SweepVerdict::Impact { t_free, t_hit, contact, evidence } => Self {
                verdict: "impact",
                evidence: Some(word(evidence)),
                t_free,
                t_hit: Some(t_hit),
                contact: Some(ContactReport::new(&contact)),
                ..report
            },
            SweepVerdict::Undecided { t_free, reason } => {
                Self { t_free, reason: Some(reason_word(reason)), ..report }
            }
        }
    }

    /// The answer as a sentence. `wanted` is the clearance that was asked for, `unit` the length to which
    /// places are rounded. `are_meshes` if both are meshes.
    pub(super) fn sentence(
        &self,
        answer: &SweepAnswer,
        (wanted, unit): (f64, f64),
        are_meshes: bool,
    ) -> String {
        let within =
            if wanted > 0.0 { format!(" within {} of each other", short(wanted)) } else { String::new() };
        let free_to = |t: f64| match t > 0.0 {
            true => format!("The motion is proven free up to t = {}.", time_down(t)),
            false => "Nothing before that is proven free.".to_owned(),
        };
        match answer.verdict {
            SweepVerdict::Free { clearance, upper, at } => {
                let kept = match clearance > 0.0 {
                    // Rounding must not seem to fall short of what was asked.
                    true if wanted > 0.0 && clearance < wanted + unit => {
                        format!("at least {}", short(wanted))
                    }
                    true => format!("at least {}", rounded_down(clearance, unit)),
                    false => "more than 0".to_owned(),
                };
                let wanted = if wanted > 0.0 {
                    format!(" with the clearance of {}", short(wanted))
                } else {
                    String::new()
                };
                format!(
                    "The whole motion is free{wanted} (certified): the distance is always {kept}. The least measured is at \
                     most {}, at t = {}.",
                    rounded_up(upper, unit),
                    short(at)
                )
            }
            SweepVerdict::Impact { t_hit: 0.0, contact, evidence, .. } => {
                let verb = if wanted > 0.0 { "come" } else { "touch" };
                format!(
                    "They {verb}{within} at the start, at {} ({}).",
                    place(contact.point, unit),
                    word(evidence)
                )
            }
            SweepVerdict::Impact { t_free, t_hit, contact, evidence } => {
                let verb = if wanted > 0.0 { "come" } else { "touch" };
                let at = place(contact.point, unit);
                format!(
                    "They {verb}{within} at t = {}, at {at} ({}). {}",
                    time(t_hit),
                    word(evidence),
                    free_to(t_free)
                )
            }
            SweepVerdict::Undecided { t_free, reason } => {
                let why = match reason {
                    SweepReason::Near => format!(
                        "at t = {} they are nearer than can be proven apart (about {}{}); no contact was found up to the end",
                        time_down(t_free),
                        if are_meshes { "" } else { "two local spacings of " },
                        rough(answer.band)
                    ),
                    SweepReason::Budget => "the budget ran out; raise --budget or --work".to_owned(),
                    SweepReason::Pose => "a pose is invalid".to_owned(),
                    SweepReason::Geodesic => {
                        "the geodesic kernel proves no separation; prepare the scans with --kernel euclidean"
                            .to_owned()
                    }
                    _ => "for an unknown reason".to_owned(),
                };
                let proven = if t_free > 0.0 { format!(" {}", free_to(t_free)) } else { String::new() };
                format!("Cannot tell: {why}.{proven}")
            }
        }
    }

    /// Which of both move, and the cost, as a line.
    pub(super) fn details(&self, moving: [bool; 2]) -> String {
        let moving = match moving {
            [true, true] => "a and b move",
            [true, false] => "a moves, b stands still",
            [false, true] => "b moves, a stands still",
            [false, false] => "both stand still",
        };
        let queries = [
            count(u64::from(self.distances), "distance query").replace("querys", "queries"),
            count(u64::from(self.contacts), "contact test"),
            count(u64::from(self.intervals), "interval"),
        ];
        let cost = work(
            [
                (self.node_pairs, "node pair"),
                (self.leaf_pairs, "leaf pair"),
                (self.evaluations, "evaluation"),
            ],
            self.micros,
        );
        format!("{moving}; t counts poses, the first is 0; {}; {cost}", queries.join(", "))
    }
}
