//! Answers to collision queries, as JSON and as text.

use nearmiss::{
    Answer, Contact, Contacts, Evidence, ManifoldPoint, Penetration, Reason, Statistics, Verdict,
};
use serde::Serialize;

use crate::contacts::{GroupReport, Grouped, SHOWN};
use crate::digits::{count, place, rough, short, work};
use crate::evidence::word;
use crate::penetration::PenetrationReport;

/// The JSON output of `collide`.
#[derive(Debug, Serialize)]
pub(crate) struct AnswerReport {
    pub(crate) verdict: &'static str,
    pub(crate) evidence: Option<&'static str>,
    pub(crate) reason: Option<&'static str>,
    pub(crate) witness: Option<[f64; 3]>,
    pub(crate) normal_a: Option<[f64; 3]>,
    pub(crate) normal_b: Option<[f64; 3]>,
    residual: Option<f64>,
    source_a: Option<u32>,
    source_b: Option<u32>,
    pub(crate) gap: Option<f64>,
    distance_estimate: Option<f64>,
    /// The length up to which the scanned surfaces may deviate from the scans; null for invalid
    /// poses.
    band: f64,
    likelihood: Option<f64>,
    evaluations: u64,
    node_pairs: u64,
    leaf_pairs: u64,
    /// Steps of searches along graphs; absent for other searches.
    #[serde(skip_serializing_if = "Option::is_none")]
    neighbour_steps: Option<u64>,
    micros: f64,
    /// `true` if `contacts` lists all contacts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) complete: Option<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) contact_count: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    contacts: Option<Vec<ContactReport>>,
    /// Contacts up to this far apart are in one clash.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) link: Option<f64>,
    /// The groups of contacts, the greatest first.
    #[serde(skip_serializing_if = "Option::is_none")]
    clashes: Option<Vec<GroupReport>>,
    /// The manifold, the deepest point first.
    #[serde(skip_serializing_if = "Option::is_none")]
    manifold: Option<Vec<PlaceReport>>,
    /// Absent if it was not asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    penetration: Option<Option<PenetrationReport>>,
    /// The items that the sources count: points or triangles.
    #[serde(skip)]
    items: [&'static str; 2],
}

/// A point of a manifold.
#[derive(Debug, Serialize)]
struct PlaceReport {
    point: [f64; 3],
    normal: [f64; 3],
    gap: f64,
    source_a: u32,
    source_b: u32,
}

impl PlaceReport {
    fn new(place: &ManifoldPoint) -> Self {
        let ManifoldPoint { point, normal, gap, sources: [a, b] } = *place;
        Self { point, normal, gap, source_a: a.0, source_b: b.0 }
    }
}

/// A contact in the list of all contacts.
#[derive(Debug, Serialize)]
struct ContactReport {
    point: [f64; 3],
    normal_a: Option<[f64; 3]>,
    normal_b: Option<[f64; 3]>,
    residual: f64,
    source_a: u32,
    source_b: u32,
    /// The number of its clash, counted from 1.
    clash: u32,
}

impl ContactReport {
    fn new(contact: &Contact) -> Self {
        Self {
            point: contact.point,
            normal_a: contact.normals.map(|n| n[0]),
            normal_b: contact.normals.map(|n| n[1]),
            residual: contact.residual,
            source_a: contact.sources[0].0,
            source_b: contact.sources[1].0,
            clash: 0,
        }
    }
}

impl AnswerReport {
    /// Creates the report of an undecided answer at this cost.
    pub(crate) fn undecided(statistics: &Statistics, band: f64, micros: f64) -> Self {
        Self {
            verdict: "undecided",
            evidence: None,
            reason: None,
            witness: None,
            normal_a: None,
            normal_b: None,
            residual: None,
            source_a: None,
            source_b: None,
            gap: None,
            distance_estimate: None,
            band,
            likelihood: None,
            evaluations: statistics.evaluations,
            node_pairs: statistics.node_pairs,
            leaf_pairs: statistics.leaf_pairs,
            neighbour_steps: Some(statistics.neighbour_steps).filter(|&steps| steps > 0),
            micros,
            complete: None,
            contact_count: None,
            contacts: None,
            link: None,
            clashes: None,
            manifold: None,
            penetration: None,
            items: ["point"; 2],
        }
    }

    /// Creates the report of an answer, and of all contacts if these were asked for.
    pub(crate) fn new(answer: &Answer, all: Option<&Contacts>, micros: f64) -> Self {
        let mut report = Self {
            distance_estimate: answer.distance_estimate,
            complete: all.map(|all| all.complete),
            contact_count: all.map(|all| all.contacts.len()),
            contacts: all.map(|all| all.contacts.iter().map(ContactReport::new).collect()),
            ..Self::undecided(&answer.statistics, answer.band, micros)
        };
        match answer.verdict {
            Verdict::Intersecting { contact, evidence } => {
                report.verdict = "intersecting";
                report.evidence = Some(word(evidence));
                report.witness = Some(contact.point);
                report.normal_a = contact.normals.map(|n| n[0]);
                report.normal_b = contact.normals.map(|n| n[1]);
                report.residual = Some(contact.residual);
                report.source_a = Some(contact.sources[0].0);
                report.source_b = Some(contact.sources[1].0);
            }
            Verdict::Separated { gap, evidence } => {
                report.verdict = "separated";
                report.evidence = Some(word(evidence));
                report.gap = (evidence == Evidence::Certified).then_some(gap);
            }
            Verdict::Undecided(reason) => {
                report.reason = match reason {
                    Reason::Budget { likelihood } => {
                        report.likelihood = Some(likelihood);
                        Some("budget")
                    }
                    Reason::Undersampled => Some("undersampled"),
                    Reason::Ambiguous => Some("ambiguous"),
                    Reason::Pose => Some("pose"),
                    Reason::NoGraph => Some("no-graph"),
                    _ => None,
                };
            }
        }
        report
    }

    /// Returns the evidence of the verdict, and the reason for an undecided one.
    pub(crate) fn evidence_and_reason(&self) -> (Option<&'static str>, Option<&'static str>) {
        (self.evidence, self.reason)
    }

    /// Returns the report about sources that are these items instead of points.
    pub(crate) fn of(self, items: [&'static str; 2]) -> Self {
        Self { items, ..self }
    }

    /// Adds a manifold.
    pub(crate) fn with_manifold(self, places: Option<&[ManifoldPoint]>) -> Self {
        let manifold = places.map(|places| places.iter().map(PlaceReport::new).collect());
        Self { manifold, ..self }
    }

    /// Adds the penetration, if it was asked for.
    pub(crate) fn with_penetration(self, found: Option<&Penetration>) -> Self {
        Self { penetration: found.map(PenetrationReport::new), ..self }
    }

    /// Returns the report with the clashes into which the contacts are grouped.
    pub(crate) fn with_clashes(mut self, grouped: Option<&(&[Contact], Grouped)>) -> Self {
        if let Some((contacts, grouped)) = grouped {
            self.link = grouped.link;
            self.clashes = Some(grouped.reports(contacts));
            for (contact, &clash) in self.contacts.iter_mut().flatten().zip(&grouped.numbers) {
                contact.clash = clash;
            }
        }
        self
    }

    /// Returns a line of text for each point of the manifold, if there is one. Places are rounded
    /// to `unit`.
    pub(crate) fn manifold(&self, unit: f64) -> impl Iterator<Item = String> {
        self.manifold.iter().flatten().map(move |found| {
            let [u, v, w] = found.normal;
            let what = if found.gap < 0.0 { "penetration depth" } else { "gap" };
            let (at, gap) = (place(found.point, unit), short(found.gap.abs()));
            format!("  {at}, {what} {gap}, push a along ({u:.4}, {v:.4}, {w:.4})")
        })
    }

    /// Returns a line of text for each of the first contacts, if all were searched for, and a line
    /// about the others. Places are rounded to `unit`.
    pub(crate) fn contacts(&self, unit: f64) -> impl Iterator<Item = String> {
        let contacts = self.contacts.as_deref().unwrap_or_default();
        let [of_a, of_b] = self.items;
        let lines = contacts.iter().take(SHOWN).map(move |contact| {
            let (a, b) = (contact.source_a, contact.source_b);
            format!(
                "  {}, between {of_a} {a} of a and {of_b} {b} of b, residual {}",
                place(contact.point, unit),
                rough(contact.residual)
            )
        });
        let others = contacts.len().saturating_sub(SHOWN) as u64;
        let rest = format!("  … and {}; --csv, --ply and --json hold all", count(others, "other contact"));
        lines.chain((others > 0).then_some(rest))
    }

    /// Returns a line of text with the points of a contact and the work of the search.
    pub(crate) fn details(&self) -> String {
        let between = match (self.source_a, self.source_b) {
            (Some(a), Some(b)) => between(self.items, [a, b]) + "; ",
            _ => String::new(),
        };
        let counts = [
            (self.node_pairs, "node pair"),
            (self.leaf_pairs, "leaf pair"),
            (self.evaluations, "evaluation"),
            (self.neighbour_steps.unwrap_or(0), "neighbour step"),
        ];
        format!("{between}{}", work(counts, self.micros))
    }
}

/// Returns a clause that names two items by their numbers.
pub(crate) fn between([of_a, of_b]: [&str; 2], [a, b]: [u32; 2]) -> String {
    format!("between {of_a} {a} of a and {of_b} {b} of b (counted from 0)")
}
