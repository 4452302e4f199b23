//! Points of a in the box of b, drawn by area.

use std::ops::{ControlFlow, Range};

use nearmiss_geometry::NodeId;
use nearmiss_hierarchy::OrientedBox;
use rand_xoshiro::rand_core::Rng;

use crate::sampling::uniform_f64;
use crate::surface::Surfaces;

/// The part of a that lies in the box of b is told by no fewer nodes than these, if it has so many.
const NODES: usize = 128;

/// Points of a in a row, with the area of all rows before them.
#[derive(Debug, Clone)]
struct Row {
    points: Range<u32>,
    before: f64,
}

/// Points of a in the box of b, and some around.
#[derive(Debug, Clone, Default)]
pub(crate) struct Volume {
    nodes: Vec<NodeId>,
    finer: Vec<NodeId>,
    rows: Vec<Row>,
    /// Of all rows, over π, in a's stored frame.
    pub(crate) area: f64,
    /// Of all rows.
    pub(crate) count: u32,
}

impl Volume {
    /// All points of all rows, in order.
    pub(crate) fn points(&self) -> impl Iterator<Item = u32> {
        self.rows.iter().flat_map(|row| row.points.clone())
    }

    /// A point with a probability by its area, of which `areas` has the sums.
    pub(crate) fn draw(&self, areas: &[f64], rng: &mut impl Rng) -> Option<u32> {
        let at = uniform_f64(rng) * self.area;
        let row = self.rows.partition_point(|row| row.before <= at).checked_sub(1)?;
        let Row { points, before } = &self.rows[row];
        let own = points.start as usize..points.end as usize;
        let within = areas[own.start] + (at - before);
        u32::try_from(last_below(areas, own, within)).ok()
    }
}

/// The last of some ascending sums that is not above `wanted`, as the first is: looked for about where it
/// would be if they rose evenly, in steps that double.
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

/// Where b is, in a's stored frame, and how far outside of it a point of a may reach in.
#[derive(Debug, Clone)]
pub(crate) struct Bounds {
    volume: OrientedBox,
    reach_sq: f32,
}

impl Bounds {
    pub(crate) fn holds(&self, place: [f32; 3]) -> bool {
        self.volume.distance_sq(place) <= self.reach_sq
    }
}

impl Surfaces<'_> {
    pub(crate) fn bounds_of_b(&self) -> Bounds {
        let volume = self.pair.relative.moved(&self.pair.b.enclosure(0));
        let own = self.pair.a.boxes[0].reach;
        Bounds { volume, reach_sq: own * own }
    }

    /// Looks for the part of a in the box of b, as coarsely as will do. `areas` has the areas of all points
    /// before each.
    pub(crate) fn survey(&mut self, areas: &[f64], volume: &mut Volume) -> ControlFlow<()> {
        volume.nodes.clear();
        volume.nodes.push(NodeId::ROOT);
        let root = [NodeId::ROOT; 2];
        loop {
            volume.finer.clear();
            let mut is_finest = true;
            for &id in &volume.nodes {
                self.pair.meter.go_on()?;
                if self.pair.gaps([id; 2], root, 1)[0] > self.reach {
                    continue;
                }
                let node = self.pair.a.nodes[id.index()];
                if node.is_leaf() {
                    volume.finer.push(id);
                } else {
                    is_finest = false;
                    volume.finer.extend([NodeId(id.0 + 1), NodeId(node.right)]);
                }
            }
            std::mem::swap(&mut volume.nodes, &mut volume.finer);
            if is_finest || volume.nodes.len() >= 2 * NODES {
                break;
            }
        }
        volume.rows.clear();
        (volume.area, volume.count) = (0.0, 0);
        for id in &volume.nodes {
            let node = self.pair.a.nodes[id.index()];
            let points = node.first..node.first + node.count;
            volume.count += node.count;
            let own = areas[points.end as usize] - areas[points.start as usize];
            match volume.rows.last_mut() {
                Some(last) if last.points.end == points.start => last.points.end = points.end,
                _ => volume.rows.push(Row { points, before: volume.area }),
            }
            volume.area += own;
        }
        ControlFlow::Continue(())
    }
}

#[cfg(test)]
mod tests {
    use super::last_below;

    /// Even and uneven sums, with equal ones among them, against looking at all.
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
