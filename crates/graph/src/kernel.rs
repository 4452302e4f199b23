//! The geodesic kernel: f with distances along the graph instead of straight-line distances.
//!
//! Klein & Zachmann 2005, eq. 5. Away from the cloud, x is replaced by a foot point, as in their
//! "Proximity graphs for defining surfaces over point clouds" (2004). The foot is the nearest point
//! to x on the edges of p1, the point nearest to x. Distances from the foot are interpolated
//! between the distances from the two ends of its edge. They are therefore continuous where the
//! nearest point changes. They do not grow with the height of x above the cloud. So the surface
//! does not end because of them; the domain of f ends it (`nearmiss_surface::Status`).
//!
//! Two things differ from the papers. The distances from the foot to both ends are not added before
//! interpolating. If they were, a foot halfway between two points would be a whole edge away from
//! either, and half an edge too far from all other points. The other difference concerns a point
//! whose support radius contains only one end. Its distance to the other end is not taken as
//! infinite, but as the distance to the contained end plus the length of the edge. Otherwise points
//! with weights up to a tenth would drop out as soon as x leaves p1.

use nearmiss_index::PointBlock;
use nearmiss_surface::{Evaluation, Level, MeasuredBlock, Moments, SurfacePlan};

use crate::Adjacency;
use crate::close_list::{Close, Lists};
use crate::close_pairs::ClosePairs;
use crate::length::distance;

/// The position on an edge of the graph that stands for x.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Foot {
    /// The points that the edge joins, nearest to x first; the same point twice if it has no edge.
    pub ends: [u32; 2],
    /// Position between the ends: 0 at the first, 1 at the second. At most 0.5, because the first
    /// end is nearer to x.
    pub share: f64,
    /// Length of the edge.
    pub length: f32,
}

/// Borrowed data to evaluate f with the geodesic kernel.
#[derive(Debug, Clone, Copy)]
pub struct GeodesicKernel<'a> {
    plan: &'a SurfacePlan,
    positions: &'a [[f32; 3]],
    radii: &'a [f32],
    starts: &'a [u32],
    neighbours: &'a [u32],
    lists: Lists<'a>,
}

/// A point's distances from the two ends of an edge.
#[derive(Debug, Clone, Copy)]
struct Both {
    point: u32,
    /// Distance to the first and to the second end; infinite beyond the point's support radius.
    distances: [f32; 2],
}

/// Scratch memory for evaluations: four bytes a point, plus the points found. Reuse it for later
/// evaluations.
#[derive(Debug, Clone)]
pub struct KernelScratch {
    /// Instruction set of the weighted sums.
    level: Level,
    /// Index in `both` plus one, for each point; 0 if it is not in `both`.
    place: Vec<u32>,
    both: Vec<Both>,
    /// Close lists of the ends of an edge.
    ends: [Vec<Close>; 2],
    supporting: Vec<Close>,
    blocks: Vec<MeasuredBlock>,
}

impl Default for KernelScratch {
    fn default() -> Self {
        Self::at(Level::new())
    }
}

impl KernelScratch {
    /// Creates scratch memory for evaluations with the instruction set `level`, which does not
    /// affect the results.
    #[must_use]
    pub fn at(level: Level) -> Self {
        let (place, both, ends) = (Vec::new(), Vec::new(), [Vec::new(), Vec::new()]);
        Self { level, place, both, ends, supporting: Vec::new(), blocks: Vec::new() }
    }
}

impl<'a> GeodesicKernel<'a> {
    /// Creates a kernel from positions, local sampling radii, a graph over the points, and a map of
    /// close pairs with the support radii of `plan`.
    ///
    /// # Panics
    /// Panics if the numbers of points differ.
    #[must_use]
    pub fn new(
        plan: &'a SurfacePlan,
        positions: &'a [[f32; 3]],
        radii: &'a [f32],
        graph: &'a Adjacency,
        pairs: &'a ClosePairs,
    ) -> Self {
        assert_eq!(
            [positions.len(), radii.len(), graph.len()],
            [pairs.len(); 3],
            "expected a position, a radius and two lists for each point"
        );
        let (starts, neighbours) = graph.slices();
        Self { plan, positions, radii, starts, neighbours, lists: pairs.view() }
    }

    fn neighbours(&self, i: u32) -> &'a [u32] {
        &self.neighbours[self.starts[i as usize] as usize..self.starts[i as usize + 1] as usize]
    }

    /// Returns the foot of `x`: the nearest position on the edges of the point `nearest`. Of
    /// equally near edges, the one to the least index counts.
    ///
    /// # Panics
    /// Panics if `nearest` is not a point.
    #[must_use]
    pub fn foot(&self, x: [f64; 3], nearest: u32) -> Foot {
        let from = self.positions[nearest as usize].map(f64::from);
        let to_x = [0, 1, 2].map(|k| x[k] - from[k]);
        let mut best = (f64::INFINITY, Foot { ends: [nearest; 2], share: 0.0, length: 0.0 });
        for &other in self.neighbours(nearest) {
            let Some(to) = self.positions.get(other as usize) else { continue };
            let edge = [0, 1, 2].map(|k| f64::from(to[k]) - from[k]);
            let square: f64 = edge.iter().map(|c| c * c).sum();
            let along: f64 = (0..3).map(|k| to_x[k] * edge[k]).sum();
            let share = if square > 0.0 { (along / square).clamp(0.0, 1.0) } else { 0.0 };
            let off: f64 = (0..3).map(|k| (to_x[k] - share * edge[k]).powi(2)).sum();
            if off < best.0 {
                #[expect(clippy::cast_possible_truncation, reason = "lengths are single precision")]
                let length = square.sqrt() as f32;
                best = (off, Foot { ends: [nearest, other], share, length });
            }
        }
        best.1
    }

    /// Finds the points whose support radius, along the graph, contains `foot`, and their
    /// distances. Points come in the order of the list of the foot's first end, followed by the
    /// remaining points of its second end.
    ///
    /// # Panics
    /// Panics if an end of `foot` is not a point.
    pub fn find_supporting<'s>(&self, foot: &Foot, scratch: &'s mut KernelScratch) -> &'s [Close] {
        let KernelScratch { place, both, ends: [first, second], supporting, .. } = scratch;
        both.clear();
        supporting.clear();
        // No distance, not even one from a forged file, is less than this support radius of a
        // missing point.
        let support_radius = |point: u32| {
            self.radii.get(point as usize).map_or(f32::NEG_INFINITY, |&r| self.plan.support_radius(r))
        };
        self.lists.read(foot.ends[0] as usize, first);
        if foot.share <= 0.0 {
            supporting.extend(first.iter().filter(|close| close.distance < support_radius(close.point)));
            return supporting;
        }
        if place.len() < self.positions.len() {
            place.resize(self.positions.len(), 0);
        }
        for (place_of, close) in (1..).zip(&*first) {
            both.push(Both { point: close.point, distances: [close.distance, f32::INFINITY] });
            if let Some(to) = place.get_mut(close.point as usize) {
                *to = place_of;
            }
        }
        self.lists.read(foot.ends[1] as usize, second);
        for close in second {
            match place.get(close.point as usize) {
                Some(&known) if known > 0 => both[known as usize - 1].distances[1] = close.distance,
                _ => both.push(Both { point: close.point, distances: [f32::INFINITY, close.distance] }),
            }
        }
        for close in first {
            if let Some(to) = place.get_mut(close.point as usize) {
                *to = 0;
            }
        }
        #[expect(clippy::cast_possible_truncation, reason = "a share")]
        let share = foot.share as f32;
        supporting.extend(both.iter().filter_map(|&Both { point, distances: [a, b] }| {
            let along = |own: f32, other: f32| if own < f32::INFINITY { own } else { other + foot.length };
            let distance = (1.0 - share) * along(a, b) + share * along(b, a);
            (distance < support_radius(point)).then_some(Close { point, distance })
        }));
        supporting
    }

    /// Evaluates f at `x`, whose nearest point is `nearest`.
    ///
    /// Takes time proportional to the number of points within support distance. Does not allocate
    /// once warm.
    ///
    /// # Panics
    /// Panics if `nearest` is not a point.
    pub fn evaluate(&self, x: [f64; 3], nearest: u32, scratch: &mut KernelScratch) -> Evaluation {
        let foot = self.foot(x, nearest);
        self.find_supporting(&foot, scratch);
        self.sum(x, scratch)
    }

    /// Evaluates f at point `i`, as [`Self::evaluate`] does at its position, and returns the points
    /// that contribute.
    ///
    /// # Panics
    /// Panics if `i` is not a point.
    pub fn evaluate_at<'s>(&self, i: u32, scratch: &'s mut KernelScratch) -> (Evaluation, &'s [Close]) {
        // The foot is the point itself, so its own list suffices.
        self.find_supporting(&Foot { ends: [i; 2], share: 0.0, length: 0.0 }, scratch);
        let at = self.sum(self.positions[i as usize].map(f64::from), scratch);
        (at, &scratch.supporting)
    }

    /// Evaluates f at `x` with the points of the last [`Self::find_supporting`].
    fn sum(&self, x: [f64; 3], scratch: &mut KernelScratch) -> Evaluation {
        let KernelScratch { level, supporting, blocks, .. } = scratch;
        blocks.clear();
        for some in supporting.chunks(PointBlock::WIDTH) {
            let mut block = MeasuredBlock::EMPTY;
            for (lane, close) in some.iter().enumerate() {
                // Points found have a radius, so they have a position.
                let i = close.point as usize;
                let support_radius = self.plan.support_radius(self.radii[i]);
                self.plan.put(&mut block.points, lane, self.positions[i], support_radius);
                block.distance[lane] = close.distance;
            }
            blocks.push(block);
        }
        Moments::measured(*level, self.plan, x, &*blocks).evaluate(self.plan, x)
    }

    /// Returns the local sampling radius that the graph suggests at `foot`: the longest edges at
    /// its ends, interpolated. It can replace r in [`SurfacePlan::bandwidth`], the bandwidth of
    /// Klein & Zachmann 2004.
    ///
    /// # Panics
    /// Panics if an end of `foot` is not a point.
    #[must_use]
    pub fn radius(&self, foot: &Foot) -> f32 {
        let longest = foot.ends.map(|end| {
            let from = self.positions[end as usize];
            let edges = self.neighbours(end).iter().filter_map(|&j| self.positions.get(j as usize));
            edges.map(|&to| distance(from, to)).fold(0.0, f32::max)
        });
        #[expect(clippy::cast_possible_truncation, reason = "a share")]
        let share = foot.share as f32;
        (1.0 - share) * longest[0] + share * longest[1]
    }
}
