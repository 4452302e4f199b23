//! Finds vertices that are to be one.

use std::collections::BTreeSet;

/// Cells are no smaller than this share of the greatest coordinate, so that their numbers are
/// exact.
const LEAST_CELL: f64 = 1.0 / 1_099_511_627_776.0;

/// For each vertex, the vertex that replaces it: of equal vertices, the one with the lowest index.
pub(crate) fn equal(vertices: &[[f64; 3]]) -> Vec<u32> {
    // Adding 0 turns -0 into 0, which is equal but ordered differently.
    let key = |v: u32| vertices[v as usize].map(|x| x + 0.0);
    let mut order: Vec<u32> = (0..).take(vertices.len()).collect();
    order.sort_unstable_by(|&v, &w| {
        let (a, b) = (key(v), key(w));
        let by_place = a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])).then(a[2].total_cmp(&b[2]));
        by_place.then(v.cmp(&w))
    });
    let mut replacements: Vec<u32> = vec![0; vertices.len()];
    let mut first = 0;
    for (i, &v) in order.iter().enumerate() {
        if i == 0 || key(v) != key(first) {
            first = v;
        }
        replacements[v as usize] = first;
    }
    replacements
}

/// For each vertex, the vertex that replaces it: in the order of indices, each vertex is replaced
/// by the nearest vertex kept before it if that is at most `tolerance` away, and kept otherwise.
pub(crate) fn within(vertices: &[[f64; 3]], tolerance: f64) -> Vec<u32> {
    let largest = vertices.iter().flatten().fold(0.0_f64, |most, x| most.max(x.abs()));
    let side = (2.0 * tolerance).max(largest * LEAST_CELL);
    let mut kept: BTreeSet<([i64; 3], u32)> = BTreeSet::new();
    let mut replacements = Vec::with_capacity(vertices.len());
    for (v, &p) in (0..).zip(vertices) {
        // Rounding is monotonic, so these cells contain every vertex within the tolerance.
        let low = p.map(|x| cell(x - tolerance, side));
        let high = p.map(|x| cell(x + tolerance, side));
        let mut nearest = (f64::INFINITY, v);
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                for z in low[2]..=high[2] {
                    let at = [x, y, z];
                    for &(_, w) in kept.range((at, 0)..=(at, u32::MAX)) {
                        let q = vertices[w as usize];
                        let square: f64 = (0..3).map(|k| ((p[k] - q[k]) / tolerance).powi(2)).sum();
                        if square <= 1.0 && (square, w) < nearest {
                            nearest = (square, w);
                        }
                    }
                }
            }
        }
        if nearest.1 == v {
            kept.insert((p.map(|x| cell(x, side)), v));
        }
        replacements.push(nearest.1);
    }
    replacements
}

#[expect(clippy::cast_possible_truncation, reason = "at most 2^40, as cells are no smaller than LEAST_CELL")]
fn cell(x: f64, side: f64) -> i64 {
    (x / side).floor() as i64
}
