//! Points of a in the box of b, drawn with probabilities proportional to their areas.

use std::ops::Range;

use nearmiss_geometry::NodeId;
use rand_xoshiro::rand_core::Rng;

use crate::papers::random::uniform_f64;

/// A range of points of a, with the area of all ranges before it.
#[derive(Debug, Clone)]
pub(crate) struct Row {
    pub(crate) points: Range<u32>,
    pub(crate) before: f64,
}

/// Ranges that contain the points of a in the box of b, and some near it.
#[derive(Debug, Clone, Default)]
pub(crate) struct Volume {
    pub(crate) nodes: Vec<NodeId>,
    pub(crate) finer: Vec<NodeId>,
    pub(crate) rows: Vec<Row>,
    /// The total area divided by π, in a's stored frame.
    pub(crate) area: f64,
    /// The total number of points.
    pub(crate) count: u32,
}

impl Volume {
    /// All points of all ranges, in order.
    pub(crate) fn points(&self) -> impl Iterator<Item = u32> {
        self.rows.iter().flat_map(|row| row.points.clone())
    }

    /// Draws a point with a probability proportional to its area. `areas` holds the prefix sums of
    /// the areas.
    pub(crate) fn draw(&self, areas: &[f64], rng: &mut impl Rng) -> Option<u32> {
        let at = uniform_f64(rng) * self.area;
        let row = self.rows.partition_point(|row| row.before <= at).checked_sub(1)?;
        let Row { points, before } = &self.rows[row];
        let own = points.start as usize..points.end as usize;
        let within = areas[own.start] + (at - before);
        u32::try_from(last_below(areas, own, within)).ok()
    }
}

/// The last of these ascending sums that is at most `wanted`; the first must be. Searches with
/// doubling steps from where the sum would be if they rose evenly.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    reason = "a guess, kept in range"
)]
fn last_below(sums: &[f64], range: Range<usize>, wanted: f64) -> usize {
    let Range { start, end } = range;
    let share = (wanted - sums[start]) / (sums[end] - sums[start]);
    let guess = start + (share * (end - start) as f64) as usize;
    let (mut low, mut high) = (guess.clamp(start, end - 1), guess.clamp(start, end - 1) + 1);
    let mut step = 1;
    while low > start && sums[low] > wanted {
        high = low;
        low = low.saturating_sub(step).max(start);
        step *= 2;
    }
    while high < end && sums[high] <= wanted {
        low = high;
        high = (high + step).min(end);
        step *= 2;
    }
    low + sums[low..high].partition_point(|&sum| sum <= wanted).max(1) - 1
}

#[cfg(test)]
mod tests {
    use super::last_below;

    /// Even and uneven sums, with equal ones among them, compared with a linear search.
    #[test]
    fn a_place_is_found_as_by_looking_at_all() {
        let uneven: [fn(f64) -> f64; 4] = [|_| 1.0, |x| x * x, |x| (-x).exp(), |x| (x.sin() > 0.0).into()];
        for area in uneven {
            let mut sums = vec![0.0];
            for i in 0..500 {
                let before: f64 = sums[i];
                sums.push(before + area(0.1 * f64::from(u16::try_from(i).unwrap_or(0))));
            }
            for (start, end) in [(0, 500), (13, 14), (100, 377)] {
                for k in 0..200 {
                    let wanted = sums[start] + f64::from(k) / 200.0 * (sums[end] - sums[start]);
                    let expected = (start..end).rev().find(|&i| sums[i] <= wanted);
                    assert_eq!(
                        Some(last_below(&sums, start..end, wanted)),
                        expected,
                        "{wanted} from {start} to {end}"
                    );
                }
            }
        }
    }
}
