//! The proof that two things stay apart during a time interval.
//!
//! Node pairs are compared in the middle of the interval. A pair is proven for the whole interval
//! if its gap exceeds the clearance by more than any point of b's node moves in half the interval.
//! A pair that is not proven is split if its nodes are larger than its way. Otherwise it is left
//! for the halves of the interval.

use std::ops::ControlFlow;

use nearmiss_geometry::{Pose, Screw};
use nearmiss_hierarchy::{Ball, Frontier, NodeBounds, NodePair, Open, PairVisitor, Stack, resume};

use super::course::Look;
use super::travel::{Travel, radius};
use crate::ask::answer::Statistics;
use crate::pair::bounds::{BoundVisitor, Bounds};
use crate::pair::pairing::Pairing;
use crate::pair::relative_pose::{Limits, RelativePose};

/// The way of b, in bands, up to which intervals are divided.
const FINEST: f64 = 0.125;

/// A time interval of two motions by screws.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Interval<'i> {
    pub(crate) screws: &'i [Screw; 2],
    /// Half its length.
    pub(crate) half: f64,
    pub(crate) balls: &'i [Ball; 2],
    /// The distance to prove, in the world.
    pub(crate) clearance: f64,
    /// The sum of the radii of the balls about points, if points are compared.
    pub(crate) thickness: Option<f64>,
}

/// The outcome of a proof for an interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Outcome {
    /// All pairs are proven, except those that are left for the halves of the interval.
    Proven,
    /// These leaves cannot be proven apart, and dividing the interval does not help.
    Stalled,
    /// The budget was spent.
    Spent,
}

/// A search for the proof of an interval, from the pairs `open[from..]`.
pub(crate) struct IntervalProof<'i> {
    pub(crate) interval: Interval<'i>,
    /// The pairs to prove. Those that are left for the halves are added at the end.
    pub(crate) pairs: &'i mut Vec<NodePair>,
    /// The numbers of the first pair to prove, and of the one after the last.
    pub(crate) from: usize,
    pub(crate) to: usize,
    pub(crate) stack: &'i mut Stack,
}

impl Look for IntervalProof<'_> {
    type Found = (Outcome, Statistics);

    fn look<P: Pairing>(self, pair: P, pose: &Pose) -> Self::Found {
        let Self { interval, pairs, from, to, stack } = self;
        let relative_pose = pair.relative_pose(pose);
        let travel = Travel::new(interval.screws, interval.half, pair.placed(), interval.balls);
        let of_b = &interval.balls[1];
        let most = travel.of_ball(of_b.centre, of_b.radius);
        let apart = interval.clearance + interval.thickness.unwrap_or(0.0) + travel.rounding;
        let needed = (travel.stored(apart) + pair.slack()).next_up();
        let of_points = interval.thickness.is_some();
        let limit = relative_pose.beyond_gap(needed + travel.stored(most), pair.slack());
        let limits = match of_points {
            true => Limits { boxes: limit, enclosures: f32::NEG_INFINITY },
            false => Limits { boxes: f32::NEG_INFINITY, enclosures: limit },
        };
        let mut proving = Proving {
            pair,
            relative_pose: &relative_pose,
            travel: &travel,
            needed,
            most,
            limits,
            of_points,
            left: pairs,
            is_stalled: false,
        };
        stack.clear();
        let flow = proving.run(from..to, stack);
        let outcome = match flow {
            ControlFlow::Continue(()) => Outcome::Proven,
            ControlFlow::Break(()) if proving.is_stalled => Outcome::Stalled,
            ControlFlow::Break(()) => Outcome::Spent,
        };
        (outcome, proving.pair.meter().spent)
    }
}

/// A proof in progress. Lengths are in a's stored frame.
struct Proving<'p, P> {
    pair: P,
    relative_pose: &'p RelativePose,
    travel: &'p Travel,
    /// The gap that a pair needs if nothing moves.
    needed: f32,
    /// The way of b, in the world.
    most: f64,
    /// Pairs beyond these limits are proven.
    limits: Limits,
    /// `true` if points are compared instead of enclosures.
    of_points: bool,
    /// The pairs that are left for the halves of the interval.
    left: &'p mut Vec<NodePair>,
    is_stalled: bool,
}

impl<P: Pairing> Proving<'_, P> {
    /// Proves the pairs with these numbers among `self.left`.
    fn run(&mut self, numbers: std::ops::Range<usize>, stack: &mut Stack) -> ControlFlow<()> {
        let (level, part) = (self.pair.level(), self.pair.part());
        let bounds = Bounds { trees: self.pair.both(), relative_pose: self.relative_pose, part };
        for number in numbers {
            let pair = self.left[number];
            let gaps = bounds.of(level, pair);
            if let Some(key) = self.judge(pair, gaps.boxes[0], gaps.enclosures[0]) {
                stack.push(Open { pair, key });
            }
            self.compared(1)?;
            resume(&bounds, level, stack, self)?;
        }
        ControlFlow::Continue(())
    }

    /// Returns the key of a pair that must be split. Keeps a pair that is left for the halves of
    /// the interval, and notes if leaves cannot be proven apart.
    fn judge(&mut self, pair: NodePair, boxes: f32, enclosures: f32) -> Option<f32> {
        let slack = self.pair.slack();
        let mut gap = self.relative_pose.gap(if self.of_points { boxes } else { enclosures }, slack);
        let [a, b] = self.pair.both();
        let part = self.pair.part();
        let (of_a, of_b) = (a.bounds_of(part, pair.a), b.bounds_of(part, pair.b));
        let way = self.travel.of_node(&of_b);
        let needed = (self.needed + way).next_up();
        // Comparisons are `false` for NaN, which proves nothing.
        if gap > needed {
            return None;
        }
        let leaves = self.pair.which_are_leaves(pair);
        if leaves != [false; 2] {
            gap = self.closer(pair, leaves == [true; 2], gap);
            if gap > needed {
                return None;
            }
        }
        if gap > self.needed && self.slides([&of_a, &of_b]) {
            return None;
        }
        let is_finest = self.most <= FINEST * self.pair.band_of(pair);
        let larger = radius(&of_a).max(radius(&of_b) * self.relative_pose.scale);
        match leaves == [true; 2] {
            true if is_finest => self.is_stalled = true,
            false if is_finest || way <= larger => return Some(boxes),
            _ => self.left.push(pair),
        }
        None
    }

    /// Returns `true` if two nodes that are apart in the middle of the interval stay so because they
    /// move past each other.
    fn slides(&self, [a, b]: [&NodeBounds<f32>; 2]) -> bool {
        let bare = |bounds: &NodeBounds<f32>| NodeBounds { low: [0.0; 3], high: [0.0; 3], ..*bounds };
        let way = self.travel.of_ball(b.centre.map(f64::from), f64::from(radius(b)));
        let gap = match self.of_points {
            true => self.travel.gap_along_normals([&bare(a), &bare(b)], way),
            false => self.travel.gap_along_normals([a, b], way),
        };
        self.travel.stored(gap) * (1.0 - 4e-6) > self.needed
    }

    /// A better gap of two nodes, at least one of which is a leaf, than `gap`.
    fn closer(&mut self, pair: NodePair, are_leaves: bool, gap: f32) -> f32 {
        if !self.of_points {
            let better = self.pair.better_gap(pair, gap);
            return if are_leaves { better.max(self.pair.gap_of_enclosures(pair)) } else { better };
        }
        if !are_leaves {
            return gap;
        }
        let [a, b] = self.pair.both().map(|tree| tree.topology());
        self.pair.count_leaves([a.leaf_number(pair.a), b.leaf_number(pair.b)]);
        let first = [a.points(pair.a).start, b.points(pair.b).start];
        let nearest = self.pair.items(first);
        let nearest = self.pair.nearest(pair, nearest).distance;
        #[expect(clippy::cast_possible_truncation, reason = "rounded down")]
        let stored = (nearest / self.pair.to_world() * (1.0 - 1e-6)) as f32;
        gap.max(stored)
    }
}

impl<P: Pairing> PairVisitor for Proving<'_, P> {
    #[inline]
    fn compared(&mut self, pairs: u32) -> ControlFlow<()> {
        let meter = self.pair.meter();
        meter.spent.node_pairs += u64::from(pairs);
        if self.is_stalled { ControlFlow::Break(()) } else { meter.go_on() }
    }

    /// Pairs of leaves are judged before they are opened.
    fn leaf_pair(&mut self, _: [usize; 2], _: &Open) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

impl<P: Pairing> BoundVisitor<f32> for Proving<'_, P> {
    #[inline]
    fn limits(&self) -> Limits {
        self.limits
    }

    #[inline]
    fn key(&mut self, _: &Open, pair: NodePair, boxes: f32, enclosures: f32) -> Option<f32> {
        self.judge(pair, boxes, enclosures)
    }
}
