//! Prepared meshes and answers about them, as JSON and as text.

use nearmiss::{ContactRegion, Mesh, MeshAnswer, MeshDistance, MeshVerdict, Penetration};
use serde::Serialize;

use super::contacts::{MeshClashReport, MeshContactReport, MeshContacts};
use crate::answer_report::{AnswerReport, between};
use crate::digits::{counts, place, work};
use crate::path_entry::PathVerdict;
use crate::penetration::PenetrationReport;
use crate::report::{file_line, hierarchy_line, leaves};
use crate::units::diagonal;

/// The description of a prepared mesh.
#[derive(Debug, Serialize)]
pub(crate) struct MeshReport {
    triangles: usize,
    vertices: usize,
    dropped: DroppedReport,
    welded_vertices: u32,
    bounds: [[f64; 3]; 2],
    nodes: usize,
    leaves: usize,
    depth_mean: f64,
    bytes: u64,
}

/// Triangles that were dropped.
#[derive(Debug, Serialize)]
struct DroppedReport {
    degenerate: u32,
    duplicate: u32,
}

impl MeshReport {
    /// Creates the description of a mesh whose file has `bytes` bytes.
    pub(crate) fn new(mesh: &Mesh, bytes: u64) -> Self {
        let dropped = mesh.dropped();
        let (leaves, depth_mean) = leaves(mesh.topology());
        Self {
            triangles: mesh.len(),
            vertices: mesh.vertices(),
            dropped: DroppedReport { degenerate: dropped.degenerate, duplicate: dropped.duplicate },
            welded_vertices: dropped.welded_vertices,
            bounds: [mesh.bounds().min, mesh.bounds().max],
            nodes: mesh.topology().len(),
            leaves,
            depth_mean,
            bytes,
        }
    }

    /// Returns the description as lines of text.
    pub(crate) fn lines(&self, mesh: &Mesh) -> Vec<String> {
        let unit = 1e-5 * diagonal(mesh.bounds());
        let [min, max] = self.bounds.map(|p| place(p, unit));
        let DroppedReport { degenerate, duplicate } = self.dropped;
        let dropped = counts([(degenerate.into(), "degenerate triangle"), (duplicate.into(), "duplicate")]);
        let dropped = if dropped.is_empty() { dropped } else { format!(" ({dropped} dropped)") };
        let welded = self.welded_vertices;
        let welded = if welded == 0 { String::new() } else { format!(" ({welded} welded to others)") };
        vec![
            format!("triangles  {}{dropped}", self.triangles),
            format!("vertices   {}{welded}", self.vertices),
            format!("bounds     {min} to {max}"),
            hierarchy_line(self.nodes, self.leaves, self.depth_mean),
            file_line(self.bytes, self.triangles, "triangle"),
        ]
    }
}

/// The JSON output of `mesh-collide`: the fields of `collide`, of which meshes leave some null, and
/// some more.
#[derive(Debug, Serialize)]
pub(crate) struct MeshAnswerReport {
    #[serde(flatten)]
    answer: AnswerReport,
    /// The likelihood of contact.
    probability: Option<f64>,
    /// The place where a contact is likeliest, if undecided.
    region: Option<ContactRegion>,
    /// The triangles that meet at the witness.
    triangles: Option<[u32; 2]>,
    /// Absent if it was not asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    penetration: Option<Option<PenetrationReport>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    contacts: Option<Vec<MeshContactReport>>,
    /// The groups of contacts, the greatest first.
    #[serde(skip_serializing_if = "Option::is_none")]
    clashes: Option<Vec<MeshClashReport>>,
}

impl MeshAnswerReport {
    /// Creates the report of an answer, and of all contacts and their completeness and of the
    /// penetration if these were asked for.
    pub(crate) fn new(
        answer: &MeshAnswer,
        all: Option<(&MeshContacts<'_>, bool)>,
        penetration: Option<&Penetration>,
        micros: f64,
    ) -> Self {
        let contact = match answer.verdict {
            MeshVerdict::Intersecting(contact) => Some(contact),
            _ => None,
        };
        let contacts = all.map(|(all, _)| all.reports());
        let mut of_scans = AnswerReport::undecided(&answer.statistics, 0.0, micros);
        of_scans.verdict = kind(&answer.verdict).word();
        (of_scans.evidence, of_scans.reason) = evidence_and_reason(&answer.verdict);
        of_scans.witness = contact.map(|contact| contact.point);
        of_scans.normal_a = contact.map(|contact| contact.normals[0]);
        of_scans.normal_b = contact.map(|contact| contact.normals[1]);
        of_scans.gap = answer.verdict.is_separated().then_some(0.0);
        of_scans.complete = all.map(|(_, complete)| complete);
        of_scans.contact_count = contacts.as_ref().map(Vec::len);
        of_scans.link = all.map(|(all, _)| all.link());
        Self {
            answer: of_scans,
            probability: probability(answer),
            region: match answer.verdict {
                MeshVerdict::Undecided(region) => Some(region),
                _ => None,
            },
            triangles: contact.map(|contact| contact.triangles),
            penetration: penetration.map(PenetrationReport::new),
            contacts,
            clashes: all.map(|(all, _)| all.clashes()),
        }
    }

    /// Returns a line of text with the triangles that meet and the work of the search.
    pub(crate) fn details(&self) -> String {
        let met = self.triangles.map_or(String::new(), |met| between(["triangle"; 2], met) + "; ");
        format!("{met}{}", self.answer.details())
    }
}

/// Returns the verdict of a row in a table.
pub(crate) fn kind(verdict: &MeshVerdict) -> PathVerdict {
    match verdict {
        MeshVerdict::Intersecting(_) => PathVerdict::Intersecting,
        MeshVerdict::Separated => PathVerdict::Separated,
        _ => PathVerdict::Undecided,
    }
}

/// Returns the evidence of a verdict, and the reason for an undecided one.
pub(crate) fn evidence_and_reason(verdict: &MeshVerdict) -> (Option<&'static str>, Option<&'static str>) {
    match verdict {
        MeshVerdict::Intersecting(_) | MeshVerdict::Separated => (Some("certified"), None),
        MeshVerdict::Pose => (None, Some("pose")),
        _ => (None, Some("budget")),
    }
}

/// Returns the likelihood of contact; `None` for invalid poses.
fn probability(answer: &MeshAnswer) -> Option<f64> {
    match answer.verdict {
        MeshVerdict::Pose => None,
        _ => Some(answer.likelihood),
    }
}

/// The JSON output of `distance` for meshes.
#[derive(Debug, Serialize)]
pub(crate) struct MeshDistanceReport {
    lower: f64,
    upper: f64,
    points: [[f64; 3]; 2],
    /// The length up to which the surfaces may deviate from the inputs.
    band: f64,
    /// Null for invalid poses.
    evidence: Option<&'static str>,
    /// The triangles of the points.
    triangles: [u32; 2],
    /// `false` if the budget ended the search; absent otherwise.
    #[serde(skip_serializing_if = "Option::is_none")]
    complete: Option<bool>,
    evaluations: u64,
    node_pairs: u64,
    leaf_pairs: u64,
    micros: f64,
}

impl MeshDistanceReport {
    pub(crate) fn new(found: &MeshDistance, micros: f64) -> Self {
        Self {
            lower: found.lower,
            upper: found.upper,
            points: found.points,
            band: 0.0,
            evidence: found.upper.is_finite().then_some("certified"),
            triangles: found.triangles,
            complete: (!found.complete).then_some(false),
            evaluations: found.statistics.evaluations,
            node_pairs: found.statistics.node_pairs,
            leaf_pairs: found.statistics.leaf_pairs,
            micros,
        }
    }

    /// Returns a line of text with the nearest triangles and the work of the search.
    pub(crate) fn details(&self) -> String {
        let counts = [(self.node_pairs, "node pair"), (self.leaf_pairs, "leaf pair")];
        format!("{}; {}", between(["triangle"; 2], self.triangles), work(counts, self.micros))
    }
}
