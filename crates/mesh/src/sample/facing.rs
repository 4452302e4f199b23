//! Normals of triangles, turned consistently over shared edges.

use crate::contact::unit_normal;
use crate::triangle::Corners;

/// No triangle.
const NONE: u32 = u32::MAX;

/// Returns the unit normal of each triangle, zero where the area is zero. `welded` holds the
/// vertices of each triangle, with one number for equal vertices.
///
/// Two triangles that share an edge with no third get normals on the same side, whatever the
/// order of their corners, unless the surface has only one side. The first triangle of each
/// connected part keeps its normal. O(n log n).
pub(crate) fn consistent_normals(triangles: &[Corners], welded: &[[u32; 3]]) -> Vec<[f32; 3]> {
    let neighbours = neighbours(welded);
    let mut normals: Vec<[f32; 3]> = triangles.iter().map(normal).collect();
    let mut is_turned: Vec<Option<bool>> = vec![None; triangles.len()];
    let mut open = Vec::new();
    for start in 0..triangles.len() {
        if is_turned[start].is_none() {
            is_turned[start] = Some(false);
            open.push(start);
        }
        while let Some(i) = open.pop() {
            let turned = is_turned[i] == Some(true);
            if turned {
                normals[i] = normals[i].map(|x| -x);
            }
            for neighbour in neighbours[i] {
                let j = neighbour.triangle as usize;
                if neighbour.triangle != NONE && is_turned[j].is_none() {
                    is_turned[j] = Some(turned != neighbour.is_opposed);
                    open.push(j);
                }
            }
        }
    }
    normals
}

#[expect(clippy::cast_possible_truncation, reason = "a direction needs no more")]
fn normal(triangle: &Corners) -> [f32; 3] {
    unit_normal(triangle).map_or([0.0; 3], |n| n.map(|x| x as f32))
}

#[derive(Debug, Clone, Copy)]
struct Neighbour {
    triangle: u32,
    /// `true` if the corners of the two triangles turn in opposite directions.
    is_opposed: bool,
}

/// Returns the neighbour of each triangle at each of its edges, where there is exactly one.
fn neighbours(welded: &[[u32; 3]]) -> Vec<[Neighbour; 3]> {
    // The ends of each edge, the triangle, the place of the edge in it.
    let mut edges: Vec<(u32, u32, u32, u8)> = Vec::with_capacity(3 * welded.len());
    for (t, corners) in (0..).zip(welded) {
        let [a, b, c] = *corners;
        let sides = [(a, b, 0), (b, c, 1), (c, a, 2)].into_iter().filter(|(a, b, _)| a != b);
        edges.extend(sides.map(|(a, b, k)| (a.min(b), a.max(b), t, k)));
    }
    edges.sort_unstable();
    let none = Neighbour { triangle: NONE, is_opposed: false };
    let mut neighbours = vec![[none; 3]; welded.len()];
    for shared in edges.chunk_by(|e, f| (e.0, e.1) == (f.0, f.1)) {
        let [(a, _, s, j), (_, _, t, k)] = *shared else { continue };
        let starts_at = |t: u32, k: u8| welded[t as usize][usize::from(k)] == a;
        let is_opposed = starts_at(s, j) == starts_at(t, k);
        neighbours[s as usize][usize::from(j)] = Neighbour { triangle: t, is_opposed };
        neighbours[t as usize][usize::from(k)] = Neighbour { triangle: s, is_opposed };
    }
    neighbours
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_point_out_of_a_solid_whose_triangles_turn_at_random() {
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let outwards = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        for turns in 0..8_u32 {
            let mut welded: Vec<[u32; 3]> = outwards.to_vec();
            for t in 1..4 {
                if turns >> (t - 1) & 1 == 1 {
                    welded[t].swap(0, 1);
                }
            }
            let triangles: Vec<Corners> = welded.iter().map(|t| t.map(|v| corners[v as usize])).collect();
            let normals = consistent_normals(&triangles, &welded);
            let slope = 1.0 / 3.0_f32.sqrt();
            let expected = [[0.0, 0.0, -1.0], [0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [slope; 3]];
            for (n, e) in normals.iter().zip(expected) {
                assert!((0..3).all(|k| (n[k] - e[k]).abs() < 1e-6), "{n:?}, expected {e:?}");
            }
        }
    }

    #[test]
    fn an_edge_of_three_triangles_joins_none() {
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]];
        let welded = [[0, 1, 2], [0, 1, 3], [0, 1, 4], [0, 0, 1]];
        let triangles = welded.map(|t: [u32; 3]| t.map(|v| corners[v as usize]));
        let normals = consistent_normals(&triangles, &welded);
        assert_eq!(normals, [[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [0.0; 3]]);
    }
}
