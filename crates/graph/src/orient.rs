//! Which side is out: one sign for each normal, so that neighbours agree.
//!
//! As in Hoppe et al. 1992, a spanning tree of the edges along which normals agree best carries the sign from
//! point to point. We differ twice.
//!
//! They hold normals to agree that are parallel, which fails at sharp edges and through thin plates. Ours
//! mirror each other in the plane half way between the points, as two normals of one circle do, of a sphere,
//! a plane, of both sides of a ridge, a groove or a plate: with e the direction of the edge, n' is held
//! against n − 2 (n·e) e.
//!
//! And their tree lets one edge decide between two sides of a doubtful place. Only along smooth sheets do we
//! grow it edge by edge (Kruskal's algorithm); the patches that this leaves are joined by what all edges
//! between two of them say together, each patch to the one that it is surest of, until no edge is left.
//! `benches` (`geodesics`) counts what comes out wrong.

mod agreement;
mod outwards;
mod patches;
mod sides;

use nearmiss_lanes::id32;
use nearmiss_lanes::parallel::ranges;

use crate::Adjacency;
use agreement::{Weights, agreement, strongest_first};
use outwards::outwards;
use patches::{Signed, Tree, Votes};
pub use sides::{Decision, OrientedPart, Sides, Viewpoint};

/// Normals that agree like this lie on one smooth sheet. If a ring of such edges still turns a normal round,
/// the sheet has one side only.
const SMOOTH: f32 = 0.95;

/// How well normals could be oriented.
#[derive(Debug, Clone, PartialEq)]
pub struct Orientation {
    /// For each point 255 where its sign is certain, 0 where it might as well be the other: the lesser of the
    /// agreement of its edges, those against it taken off, and of the doubt in the least certain step by
    /// which its sign came from the greater part.
    pub confidence: Vec<u8>,
    /// The connected parts, by their first points.
    pub parts: Vec<OrientedPart>,
}

/// Turns `normals` so that neighbours in `graph` agree, and outwards where that can be told: by what `sides`
/// says, where the greater part of a component follows it, else so that the component encloses a positive
/// volume about its centre, each point standing for the square of its local sampling radius. What the signs
/// are beforehand does not matter but where all of that says nothing.
///
/// O(e log e) in the number of edges, of which only those in doubt are sorted, in part on all cores; the
/// result does not depend on how many there are.
///
/// # Panics
/// When there is not a position, a normal and a radius for each point, and a normal of its own if `sides` has
/// these.
pub fn orient(
    graph: &Adjacency,
    positions: &[[f32; 3]],
    radii: &[f32],
    sides: Sides<'_>,
    normals: &mut [[f32; 3]],
) -> Orientation {
    let count = graph.len();
    let lengths = [positions.len(), radii.len(), normals.len(), sides.normals.map_or(count, <[_]>::len)];
    assert_eq!(lengths, [count; 4], "one of each a point");
    let mut tree = Tree::new(count);
    let edges = strongest_first(graph, positions, normals);
    let (smooth, rest) = edges.split_at(edges.partition_point(|edge| edge.along() >= SMOOTH));
    smooth.iter().for_each(|&edge| tree.join(edge));
    let patches: Vec<Signed> = (0..id32(count)).map(|i| tree.root(i)).collect();
    let weights = Weights::new();
    let votes = tree.between(rest.iter().map(|&edge| Votes::new(edge, &weights)).collect());
    tree.join_by_votes(votes.clone());
    let turned = tree.settle(&votes);
    let in_component = |patch: &Signed| Signed {
        point: tree.root(patch.point).point,
        turned: patch.turned ^ turned[patch.point as usize],
    };
    let roots: Vec<Signed> = patches.iter().map(in_component).collect();
    let out = outwards(&roots, positions, radii, sides, normals);
    for (normal, (root, out)) in normals.iter_mut().zip(roots.iter().zip(&out.turned)) {
        if root.turned != *out {
            *normal = normal.map(|c| -c);
        }
    }
    let confidence = confidences(graph, positions, normals, &tree);
    let mut parts = out.parts;
    for part in &mut parts {
        part.orientable = !tree.twisted[roots[part.first as usize].point as usize];
    }
    Orientation { confidence, parts }
}

fn confidences(graph: &Adjacency, positions: &[[f32; 3]], normals: &[[f32; 3]], tree: &Tree) -> Vec<u8> {
    let stretches = ranges(graph.len(), |points| {
        let confidence = |i: usize| {
            let (mut votes, mut all) = (0.0, 0.0);
            for &j in graph.of(i) {
                let j = j as usize;
                let found = agreement(positions[i], normals[i], positions[j], normals[j]);
                let weight = found.strength * found.strength;
                votes += if found.same { weight } else { -weight };
                all += weight;
            }
            let share = if all > 0.0 { (votes / all).max(0.0) } else { 0.0 };
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 255")]
            let byte = (255.0 * share.min(tree.weakest(id32(i)))).round() as u8;
            byte
        };
        points.map(confidence).collect::<Vec<u8>>()
    });
    stretches.concat()
}
