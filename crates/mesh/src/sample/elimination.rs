//! A number of Poisson-disc samples: the candidates that remain after the elimination of those with
//! the nearest neighbours (Yuksel 2015).

use std::collections::BinaryHeap;
use std::collections::binary_heap::PeekMut;

use super::cells::Cells;

/// Candidates for each sample.
pub(crate) const CANDIDATES: u32 = 5;

/// The power of the weight (α) and the parameters of weight limiting (β, γ) of Yuksel 2015, sections
/// 3 and 4.
const ALPHA: i32 = 8;
const BETA: f64 = 0.65;
const GAMMA: f64 = 1.5;

/// Least mean number of neighbours of a candidate. On a large surface there are 18.
const NEIGHBOURS: usize = 8;

/// Radius beyond which it is not increased, as its square must be finite.
const WIDEST: f64 = 1e150;

/// Returns an empty table with memory for `all` candidates, of which `count` are to be kept, on a
/// surface of area `area`.
pub(crate) fn table(all: u32, count: u32, area: f64) -> Cells {
    // Twice the radius of the discs of the densest packing of `count` points.
    let reach = 2.0 * (area / (2.0 * 3.0_f64.sqrt() * f64::from(count))).sqrt();
    Cells::new(reach, all as usize)
}

/// Returns `count` of the candidates, in the order in which they were added. They are to sample the
/// surface uniformly.
///
/// A candidate has a weight for each neighbour that faces the same side, greater for nearer ones.
/// The candidate with the greatest total is eliminated, over and over. O(n log n).
pub(crate) fn eliminate(mut candidates: Cells, count: u32) -> Vec<[f64; 3]> {
    let all = candidates.len();
    let reach = widen(&mut candidates);
    let least = reach * BETA * (1.0 - (f64::from(count) / whole(all)).powf(GAMMA));
    let weight = |square: f64| (1.0 - square.sqrt().max(least) / reach).powi(ALPHA);

    let mut weights: Vec<f64> = Vec::with_capacity(all);
    let mut heap = Vec::with_capacity(all);
    for i in (0..all).map(id) {
        let mut total = 0.0;
        candidates.any_near(&candidates.site(i), |j, _, square| {
            total += if i == j { 0.0 } else { weight(square) };
            false
        });
        weights.push(total);
        heap.push((order(total), scrambled(i), i));
    }
    // Eliminations only reduce weights, so an outdated item of the heap is an upper bound.
    let mut heap = BinaryHeap::from(heap);
    let mut left = all;
    while left > count as usize {
        let Some(mut top) = heap.peek_mut() else { break };
        let (known, _, i) = *top;
        let now = order(weights[i as usize]);
        if now != known {
            top.0 = now;
            continue;
        }
        PeekMut::pop(top);
        candidates.remove(i);
        weights[i as usize] = f64::NAN;
        left -= 1;
        candidates.any_near(&candidates.site(i), |j, _, square| {
            let of_neighbour = &mut weights[j as usize];
            *of_neighbour = (*of_neighbour - weight(square)).max(0.0);
            false
        });
    }
    let kept = candidates.positions().zip(weights).filter(|(_, weight)| !weight.is_nan());
    kept.map(|(at, _)| at).collect()
}

/// Increases the radius until candidates have neighbours, and returns it.
///
/// Needles and ribbons narrower than the radius are sampled along a line: if the radius follows
/// from their area, few candidates have neighbours.
fn widen(cells: &mut Cells) -> f64 {
    let enough = NEIGHBOURS.min(cells.len() / 4);
    loop {
        // A fixed number of candidates, spread evenly.
        let asked = || (0..cells.len()).step_by(cells.len().div_ceil(1000).max(1));
        let mut near = 0;
        for i in asked() {
            let mut seen = 0;
            cells.any_near(&cells.site(id(i)), |_, _, _| {
                near += 1;
                seen += 1;
                seen > 2 * NEIGHBOURS
            });
        }
        if near >= enough * asked().count() || cells.radius() > WIDEST {
            return cells.radius();
        }
        cells.resize(std::f64::consts::SQRT_2 * cells.radius());
    }
}

/// Returns an integer that orders numbers of at least 0 as they are.
fn order(weight: f64) -> u64 {
    weight.to_bits()
}

/// Returns a different number for each index, so that candidates of equal weight are eliminated
/// from everywhere.
fn scrambled(i: u32) -> u32 {
    i.wrapping_mul(0x9E37_79B1)
}

#[expect(clippy::cast_possible_truncation, reason = "fewer than 2^32")]
fn id(i: usize) -> u32 {
    i as u32
}

#[expect(clippy::cast_precision_loss, reason = "fewer than 2^32")]
fn whole(n: usize) -> f64 {
    n as f64
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::super::cells::Site;
    use super::*;

    /// Eliminates one by one, with all weights computed anew from all pairs.
    fn naive(sites: &[Site], count: u32, reach: f64) -> Vec<[f64; 3]> {
        let least = 0.65 * reach * (1.0 - (f64::from(count) / whole(sites.len())).powf(1.5));
        let mut left: Vec<Site> = sites.to_vec();
        while left.len() > count as usize {
            let weight = |i: usize| -> f64 {
                let of = |j: usize| {
                    let [p, q] = [left[i], left[j]];
                    let distance = (0..3).map(|k| (p.at[k] - q.at[k]).powi(2)).sum::<f64>().sqrt();
                    let angle: f32 = (0..3).map(|k| p.normal[k] * q.normal[k]).sum();
                    let is_near = i != j && distance <= reach && angle >= -0.5;
                    if is_near { (1.0 - distance.max(least) / reach).powi(8) } else { 0.0 }
                };
                (0..left.len()).map(of).sum()
            };
            let weights: Vec<f64> = (0..left.len()).map(weight).collect();
            let most = (0..left.len()).fold(0, |best, i| if weights[i] > weights[best] { i } else { best });
            left.remove(most);
        }
        left.iter().map(|site| site.at).collect()
    }

    #[test]
    fn the_same_candidates_remain_as_by_all_pairs() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(11);
        for count in [40, 80, 150] {
            // Two sheets that face away from each other, nearer than the samples.
            let mut site = |i: u32| {
                let up = if i.is_multiple_of(2) { 1.0 } else { -1.0 };
                Site { at: [rng.random(), rng.random(), 0.001 * f64::from(up)], normal: [0.0, 0.0, up] }
            };
            let sites: Vec<Site> = (0..300).map(&mut site).collect();
            let mut candidates = table(300, count, 2.0);
            sites.iter().for_each(|site| candidates.add(*site));
            let expected = naive(&sites, count, widen(&mut candidates));
            assert_eq!(eliminate(candidates, count), expected);
        }
    }
}
