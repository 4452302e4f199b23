//! Orientation of normals: one sign for each normal, so that neighbours agree and normals point
//! outwards.
//!
//! As in Hoppe et al. 1992, the sign spreads from point to point along a spanning tree. The tree
//! consists of the edges whose two normals agree best. Two things differ.
//!
//! Hoppe et al. measure agreement by how parallel two normals are, which fails at sharp edges and
//! across thin plates. Here two normals agree if they mirror each other in the plane halfway
//! between their points. This holds for normals of a circle, sphere or plane, and for both sides of
//! a ridge, a groove or a plate. With e the direction of the edge, n' is compared with
//! n − 2 (n·e) e.
//!
//! In their tree a single edge decides between two sides of an ambiguous region. Here the tree
//! grows edge by edge (Kruskal's algorithm) only along smooth sheets, which yields patches. Then
//! patches are joined. Every edge between two patches votes on whether their signs match, and each
//! patch joins the neighbour with the clearest vote, until no edge is left. `benches` (`geodesics`)
//! counts wrong signs.

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

/// Least agreement of normals on one smooth sheet. If a cycle of such edges reverses the normal,
/// the sheet is one-sided.
const SMOOTH: f32 = 0.95;

/// Result of [`orient()`]: confidences and parts. The normals are changed in place.
#[derive(Debug, Clone, PartialEq)]
pub struct Orientation {
    /// Confidence in the sign of each point's normal: 255 for certain, 0 for arbitrary. It is the
    /// lesser of two measures. One is the net agreement along the point's edges. The other is the
    /// least certainty among the steps by which the sign reached the point.
    pub confidence: Vec<u8>,
    /// Connected parts, by their first points.
    pub parts: Vec<OrientedPart>,
}

/// Orients `normals` so that neighbours in `graph` agree, and outwards as far as the outside is
/// known.
///
/// The side of a component is the one that `sides` suggests for most of its points. If `sides`
/// suggests nothing, normals point away from the volume that the component encloses. The volume is
/// a sum of cones from the centre of the component to its points, each with a base of area r² for a
/// local sampling radius r. The initial signs only matter if none of this decides.
///
/// Takes O(e log e) time for e edges, of which only ambiguous ones are sorted. Some of it runs on
/// all cores; the result does not depend on their number.
///
/// # Panics
/// Panics if the number of positions, normals, radii or, if given, normals in `sides` differs from
/// the number of points.
pub fn orient(
    graph: &Adjacency,
    positions: &[[f32; 3]],
    radii: &[f32],
    sides: Sides<'_>,
    normals: &mut [[f32; 3]],
) -> Orientation {
    let count = graph.len();
    let lengths = [positions.len(), radii.len(), normals.len(), sides.normals.map_or(count, <[_]>::len)];
    assert_eq!(lengths, [count; 4], "expected a position, a radius and a normal for each point");
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
