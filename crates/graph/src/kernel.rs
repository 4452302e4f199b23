//! The geodesic kernel: f with distances along the graph instead of straight ones.
//!
//! Klein & Zachmann 2005, eq. 5, and off the cloud as in their "Proximity graphs for defining surfaces over
//! point clouds" (2004): x is replaced by its foot on the edge that is nearest to it, of those at its nearest
//! point p1, and distances from the foot are interpolated between those from the two ends. So they do not
//! jump where another point becomes the nearest, and x stays as near as the foot however high it is above the
//! cloud; its domain ends that (`nearmiss_surface::Status`).
//!
//! Two things we do otherwise. The ways from the foot to both ends are not added before interpolating: with
//! them the foot half way between two points would be a whole edge from either, and from everything else by
//! half an edge too far. And where only one of the ends is heard by a point, the other end takes its distance
//! from there along the edge, instead of none: or points would fall silent as soon as x left p1, those too
//! that weigh a tenth.

use nearmiss_index::PointBlock;
use nearmiss_surface::{Evaluation, Level, MeasuredBlock, Moments, SurfacePlan};

use crate::Adjacency;
use crate::close_list::{Close, Lists};
use crate::close_pairs::ClosePairs;
use crate::length::distance;

/// The place on an edge of the graph that stands for x.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Foot {
    /// The points that the edge joins, the nearest to x first; twice that where it has no edge.
    pub ends: [u32; 2],
    /// Where between them: 0 at the first, 1 at the second, and never nearer to that.
    pub share: f64,
    /// The length of the edge.
    pub length: f32,
}

/// What is needed to evaluate f with the geodesic kernel, borrowed.
#[derive(Debug, Clone, Copy)]
pub struct GeodesicKernel<'a> {
    plan: &'a SurfacePlan,
    positions: &'a [[f32; 3]],
    radii: &'a [f32],
    starts: &'a [u32],
    neighbours: &'a [u32],
    lists: Lists<'a>,
}

/// What one of two points is heard at.
#[derive(Debug, Clone, Copy)]
struct Both {
    point: u32,
    /// Distance to the first end and to the second; infinite where it is not heard.
    distances: [f32; 2],
}

/// Memory for evaluations, used again by the next: four bytes a point, and what is heard.
#[derive(Debug, Clone)]
pub struct KernelScratch {
    /// The instructions that weigh.
    level: Level,
    /// One more than where a point stands among `both`, 0 for none.
    place: Vec<u32>,
    both: Vec<Both>,
    /// What is heard at the ends of an edge.
    ends: [Vec<Close>; 2],
    heard: Vec<Close>,
    blocks: Vec<MeasuredBlock>,
}

impl Default for KernelScratch {
    fn default() -> Self {
        Self::at(Level::new())
    }
}

impl KernelScratch {
    /// For evaluations by the instructions of `level`, which change no bit.
    #[must_use]
    pub fn at(level: Level) -> Self {
        let (place, both, ends) = (Vec::new(), Vec::new(), [Vec::new(), Vec::new()]);
        Self { level, place, both, ends, heard: Vec::new(), blocks: Vec::new() }
    }
}

impl<'a> GeodesicKernel<'a> {
    /// Given positions, local sampling radii, a graph over them, and the map of close pairs with the horizons
    /// of `plan`.
    ///
    /// # Panics
    /// When these are not of equally many points.
    #[must_use]
    pub fn new(
        plan: &'a SurfacePlan,
        positions: &'a [[f32; 3]],
        radii: &'a [f32],
        graph: &'a Adjacency,
        pairs: &'a ClosePairs,
    ) -> Self {
        assert_eq!([positions.len(), radii.len(), graph.len()], [pairs.len(); 3], "one of each a point");
        let (starts, neighbours) = graph.slices();
        Self { plan, positions, radii, starts, neighbours, lists: pairs.view() }
    }

    fn neighbours(&self, i: u32) -> &'a [u32] {
        &self.neighbours[self.starts[i as usize] as usize..self.starts[i as usize + 1] as usize]
    }

    /// The place on the edges at `nearest` that is nearest to `x`; of several edges the one to the least
    /// index.
    ///
    /// # Panics
    /// When there is no such point.
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

    /// The points that are heard at `foot` and how far they are from there along the graph: in the order of
    /// the list of its first end, then the others in that of its second.
    ///
    /// # Panics
    /// When its ends are no points.
    pub fn hear<'s>(&self, foot: &Foot, scratch: &'s mut KernelScratch) -> &'s [Close] {
        let KernelScratch { place, both, ends: [first, second], heard, .. } = scratch;
        both.clear();
        heard.clear();
        // No distance, not even one that a file makes up, is less than that of a point that is not there.
        let horizon =
            |point: u32| self.radii.get(point as usize).map_or(f32::NEG_INFINITY, |&r| self.plan.horizon(r));
        self.lists.read(foot.ends[0] as usize, first);
        if foot.share <= 0.0 {
            heard.extend(first.iter().filter(|close| close.distance < horizon(close.point)));
            return heard;
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
        heard.extend(both.iter().filter_map(|&Both { point, distances: [a, b] }| {
            let along = |own: f32, other: f32| if own < f32::INFINITY { own } else { other + foot.length };
            let distance = (1.0 - share) * along(a, b) + share * along(b, a);
            (distance < horizon(point)).then_some(Close { point, distance })
        }));
        heard
    }

    /// f at `x`, whose nearest point is `nearest`.
    ///
    /// O(points heard there); no allocation once warm.
    ///
    /// # Panics
    /// When there is no such point.
    pub fn evaluate(&self, x: [f64; 3], nearest: u32, scratch: &mut KernelScratch) -> Evaluation {
        let foot = self.foot(x, nearest);
        self.hear(&foot, scratch);
        self.sum(x, scratch)
    }

    /// f at the point `i` itself, and the points that are heard there: as [`Self::evaluate`] at its position.
    ///
    /// # Panics
    /// When there is no such point.
    pub fn evaluate_at<'s>(&self, i: u32, scratch: &'s mut KernelScratch) -> (Evaluation, &'s [Close]) {
        // Its list is all, whatever edge it is at the end of.
        self.hear(&Foot { ends: [i; 2], share: 0.0, length: 0.0 }, scratch);
        let at = self.sum(self.positions[i as usize].map(f64::from), scratch);
        (at, &scratch.heard)
    }

    /// f at `x`, at which is heard what was heard last.
    fn sum(&self, x: [f64; 3], scratch: &mut KernelScratch) -> Evaluation {
        let KernelScratch { level, heard, blocks, .. } = scratch;
        blocks.clear();
        for some in heard.chunks(PointBlock::WIDTH) {
            let mut block = MeasuredBlock::EMPTY;
            for (lane, close) in some.iter().enumerate() {
                // What is heard has a radius, so it has a position.
                let i = close.point as usize;
                let horizon = self.plan.horizon(self.radii[i]);
                self.plan.put(&mut block.points, lane, self.positions[i], horizon);
                block.distance[lane] = close.distance;
            }
            blocks.push(block);
        }
        Moments::measured(*level, self.plan, x, &*blocks).evaluate(self.plan, x)
    }

    /// The local sampling radius that the graph alone suggests at `foot`: the longest edges at its ends,
    /// interpolated. It stands for r in [`SurfacePlan::bandwidth`], the bandwidth of Klein & Zachmann 2004.
    ///
    /// # Panics
    /// When its ends are no points.
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
