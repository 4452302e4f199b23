//! The proofs of answers, one line of JSON each, for an independent checker.

use std::io::{self, Write};
use std::ops::Range;

use nearmiss::geometry::NodeId;
use nearmiss::hierarchy::{NodePair, OrientedBox, Part};
use nearmiss::{Answer, CollideOptions, Evidence, Placed, Proof, Semantics, Verdict};
use serde::Serialize;

use crate::evidence::word;

/// A line of the file.
#[derive(Serialize)]
struct Line {
    /// The line in the file of poses, or 0 without one.
    query: u64,
    /// The row-major matrix that the search used from stored positions of a to the world.
    placed_a: [f64; 16],
    /// The same for b.
    placed_b: [f64; 16],
    margin: f64,
    /// The set that is enclosed: `obstacle`, `surface`, or `points`.
    semantics: &'static str,
    verdict: &'static str,
    evidence: Option<&'static str>,
    gap: Option<f64>,
    witness: Option<[f64; 3]>,
    residual: Option<f64>,
    /// The nodes of a in the pairs, without duplicates.
    nodes_a: Vec<Enclosure>,
    /// The same for b.
    nodes_b: Vec<Enclosure>,
    /// The pairs, as indices into the lists of nodes.
    pairs: Vec<[usize; 2]>,
}

/// A node: its range of stored points, and its enclosure in the stored frame.
#[derive(Serialize)]
struct Enclosure {
    first: usize,
    count: usize,
    centre: [f32; 3],
    half: [f32; 3],
    axes: [[f32; 3]; 3],
}

impl Enclosure {
    fn new(points: &Range<usize>, bounds: &OrientedBox) -> Self {
        let OrientedBox { centre, half, axes, .. } = *bounds;
        Self { first: points.start, count: points.len(), centre, half, axes }
    }
}

/// Writes the proof of `answer`, the answer to a query with these `options`.
pub(crate) fn write(
    out: &mut impl Write,
    query: u64,
    views: [&Placed<'_>; 2],
    options: &CollideOptions,
    answer: &Answer,
    proof: &Proof,
) -> io::Result<()> {
    let pairs: Vec<NodePair> = proof.pairs.iter().map(|(pair, _)| *pair).collect();
    let of = options.semantics;
    let (nodes_a, index_a) = nodes(views[0], of, pairs.iter().map(|pair| pair.a));
    let (nodes_b, index_b) = nodes(views[1], of, pairs.iter().map(|pair| pair.b));
    let (verdict, evidence, gap, contact) = match answer.verdict {
        Verdict::Intersecting { contact, evidence } => ("intersecting", Some(evidence), None, Some(contact)),
        Verdict::Separated { gap, evidence } => ("separated", Some(evidence), Some(gap), None),
        Verdict::Undecided(_) => ("undecided", None, None, None),
    };
    let contact = contact.filter(|_| evidence == Some(Evidence::Certified));
    let line = Line {
        query,
        placed_a: views[0].stored_to_world().to_row_major(),
        placed_b: views[1].stored_to_world().to_row_major(),
        margin: options.margin,
        semantics: match of {
            Semantics::Obstacle => "obstacle",
            Semantics::Surface => "surface",
            _ => "points",
        },
        verdict,
        evidence: evidence.map(word),
        gap,
        witness: contact.map(|c| c.point),
        residual: contact.map(|c| c.residual),
        nodes_a,
        nodes_b,
        pairs: index_a.into_iter().zip(index_b).map(|(a, b)| [a, b]).collect(),
    };
    serde_json::to_writer(&mut *out, &line)?;
    out.write_all(b"\n")
}

/// Returns the enclosures of the distinct nodes in `ids`, and the index of each id among them.
fn nodes(
    view: &Placed<'_>,
    of: Semantics,
    ids: impl Iterator<Item = NodeId>,
) -> (Vec<Enclosure>, Vec<usize>) {
    let ids: Vec<NodeId> = ids.collect();
    let mut distinct = ids.clone();
    distinct.sort_unstable();
    distinct.dedup();
    let tree = view.scan().tree();
    let part = if of == Semantics::Obstacle { Part::Obstacle } else { Part::Surface };
    let enclosure = |&id: &NodeId| Enclosure::new(&tree.topology().points(id), &tree.enclosure(part, id));
    let enclosures = distinct.iter().map(enclosure).collect();
    let place = |id: &NodeId| distinct.binary_search(id).unwrap_or_default();
    (enclosures, ids.iter().map(place).collect())
}
