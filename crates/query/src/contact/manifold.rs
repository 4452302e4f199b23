//! A contact manifold for a physics solver: a few well spread points, each with a normal and a
//! signed gap.
//!
//! For points of either scan that are near the other, the penetration depth is the height over the
//! tangent plane of the nearest point there. The deepest point is selected first, then always the
//! one furthest from all selected points, as in Gonzalez ("Clustering to minimize the maximum
//! intercluster distance", Theoretical Computer Science 38, 1985). Every prefix of the selection is
//! well spread.

use std::cmp::Ordering;
use std::ops::ControlFlow;

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x16, mask32x16};
use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::{BoxVisitor, Open, PairVisitor, Stack, TreePair, descend};
use nearmiss_index::PointBlock;
use nearmiss_lanes::wide::{bits, blocks_of, lanes_of, load};

use crate::ask::answer::{Contact, ManifoldPoint};
use crate::ask::options::{CollideOptions, Semantics};
use crate::pair::scan_pair::ScanPair;

const WIDTH: usize = PointBlock::WIDTH;

/// The lane numbers of a block.
const NUMBERS: [f32; WIDTH] =
    [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0];

/// The greatest number of points of a manifold.
const MOST: usize = 8;

/// Reusable memory for manifolds.
#[derive(Debug, Clone, Default)]
pub(crate) struct ManifoldScratch {
    stack: Stack,
    neighbours: Vec<Neighbour>,
    candidates: Vec<(ManifoldPoint, f64)>,
}

/// A point and the nearest point of the other scan.
#[derive(Debug, Clone, Copy)]
struct Neighbour {
    /// `true` if `point` is of b.
    of_b: bool,
    point: u32,
    nearest: u32,
    /// In b's stored frame.
    distance_sq: f32,
}

impl Neighbour {
    fn order(&self, other: &Self) -> Ordering {
        let key = |it: &Self| (it.of_b, it.point);
        let nearer = || self.distance_sq.total_cmp(&other.distance_sq);
        key(self).cmp(&key(other)).then_with(nearer).then_with(|| self.nearest.cmp(&other.nearest))
    }

    /// The points of a and b.
    fn points(&self) -> [usize; 2] {
        let [own, nearest] = [self.point as usize, self.nearest as usize];
        if self.of_b { [nearest, own] } else { [own, nearest] }
    }
}

/// Writes the manifold of two scans that meet at `contact` to `points`, as far as the budget lasts.
pub(crate) fn gather(
    pair: &mut ScanPair<'_>,
    options: &CollideOptions,
    contact: &Contact,
    scratch: &mut ManifoldScratch,
    points: &mut Vec<ManifoldPoint>,
) {
    let ManifoldScratch { stack, neighbours, candidates } = scratch;
    let solid = Solid::new(pair, options);
    neighbours.clear();
    let reach = pair.stored(solid.reach());
    let (a, b, relative) = (pair.a, pair.b, pair.relative);
    let trees = TreePair { a: &a.tree, b: &b.tree, relative: &relative, reach };
    stack.clear();
    let back = reach * relative.scale_back();
    let level = pair.level;
    let mut near = Near { pair: &mut *pair, level, reach_sq: back * back, neighbours };
    // A partial result is valid if the budget ends the search.
    let _ended = descend(trees, level, stack, &mut near);
    neighbours.sort_unstable_by(Neighbour::order);
    neighbours.dedup_by_key(|it| (it.of_b, it.point));
    candidates.clear();
    candidates.extend(neighbours.iter().filter_map(|it| Some((solid.place(pair, it)?, f64::INFINITY))));
    points.clear();
    spread(candidates, solid.spacing, points);
    if points.is_empty() {
        points.push(solid.alone(contact));
    }
}

/// Selects the deepest of `candidates`, then always the one furthest from all selected ones, as
/// long as it is at least `spacing` away from them.
fn spread(candidates: &mut [(ManifoldPoint, f64)], spacing: f64, taken: &mut Vec<ManifoldPoint>) {
    let deepest = |a: &ManifoldPoint, b: &ManifoldPoint| a.gap.total_cmp(&b.gap);
    while taken.len() < MOST {
        // The furthest; among equals the deepest, then the first.
        let next = candidates
            .iter()
            .min_by(|(p, far), (q, farther)| farther.total_cmp(far).then_with(|| deepest(p, q)));
        let Some(&(next, away_sq)) = next.filter(|(_, away_sq)| *away_sq >= spacing * spacing) else {
            return;
        };
        debug_assert!(!taken.is_empty() || away_sq == f64::INFINITY, "the first has none to be away from");
        taken.push(next);
        for (candidate, away_sq) in &mut *candidates {
            let d = Vector3::from(candidate.point) - Vector3::from(next.point);
            *away_sq = away_sq.min(d.norm_squared());
        }
    }
}

/// The geometry that defines manifold points, in the world.
struct Solid {
    semantics: Semantics,
    margin: f64,
    /// The greater sampling radius.
    spacing: f64,
    /// The centres of both scans.
    centres: [Vector3<f64>; 2],
    /// The index of the smaller scan.
    lesser: usize,
    /// For each scan, `true` if its normals are oriented outwards.
    oriented: [bool; 2],
}

impl Solid {
    fn new(pair: &ScanPair<'_>, options: &CollideOptions) -> Self {
        let spacing = pair.views.map(|view| view.sampling_radius());
        let radii =
            pair.views.map(|view| view.scan().outline().discs.radius * view.stored_to_world().scale());
        Self {
            semantics: options.semantics,
            margin: options.margin,
            spacing: spacing[0].max(spacing[1]),
            centres: pair
                .views
                .map(|view| view.stored_to_world().apply(view.scan().outline().discs.centre).into()),
            lesser: usize::from(radii[1] < radii[0]),
            oriented: pair.views.map(|view| view.scan().is_oriented()),
        }
    }

    /// The greatest distance of two points that may contribute to the manifold.
    fn reach(&self) -> f64 {
        match self.semantics {
            Semantics::Obstacle | Semantics::Surface => self.margin.max(self.spacing),
            Semantics::Thickened(radius) => 2.0 * radius + self.margin,
        }
    }

    fn place(&self, pair: &ScanPair<'_>, neighbour: &Neighbour) -> Option<ManifoldPoint> {
        let [i, j] = neighbour.points();
        let [p, q] = [pair.views[0].point(i), pair.views[1].point(j)].map(Vector3::from);
        let between = p - q;
        let (normal, gap) = match self.semantics {
            Semantics::Thickened(radius) => {
                let distance = between.norm();
                let normal = if distance > 0.0 { between / distance } else { self.apart() };
                (normal, distance - 2.0 * radius)
            }
            Semantics::Obstacle if !pair.are_sheets([i, j]) => {
                let distance = between.norm();
                let normal = if distance > 0.0 { between / distance } else { self.apart() };
                (normal, distance - pair.balls([i, j]).iter().sum::<f64>())
            }
            Semantics::Obstacle | Semantics::Surface => {
                if pair.doubt_about(i, j).is_some() {
                    return None;
                }
                let normal = self.way_out(pair, neighbour.of_b, [i, j]);
                let gap = normal.dot(&between);
                let side = usize::from(!neighbour.of_b);
                let disc = [pair.a.discs.get(i), pair.b.discs.get(j)][side];
                let disc = f64::from(disc) * pair.views[side].stored_to_world().scale();
                // Beside the disc its plane is meaningless.
                if between.norm_squared() - gap * gap > disc * disc || gap < -self.spacing {
                    return None;
                }
                (normal, gap)
            }
        };
        let own = if neighbour.of_b { q + 0.5 * gap * normal } else { p - 0.5 * gap * normal };
        let is_ball = match self.semantics {
            Semantics::Obstacle => !pair.are_sheets([i, j]),
            Semantics::Surface => false,
            Semantics::Thickened(_) => true,
        };
        let middle = if is_ball { 0.5 * (p + q) } else { own };
        (gap <= self.margin).then(|| ManifoldPoint {
            point: middle.into(),
            normal: normal.into(),
            gap,
            sources: [pair.views[0].scan().id(i), pair.views[1].scan().id(j)],
        })
    }

    /// The direction from the centre of b to that of a.
    fn apart(&self) -> Vector3<f64> {
        (self.centres[0] - self.centres[1]).try_normalize(0.0).unwrap_or_else(Vector3::z)
    }

    /// The normal at a point of one scan (of a if `of_b`), in the direction in which a moves out of
    /// b. Oriented normals of that scan decide its sign, otherwise those of the other scan. Without
    /// any, the smaller scan is assumed to be on the side of its own centre, like a cup on a table
    /// and a table in a room.
    fn way_out(&self, pair: &ScanPair<'_>, of_b: bool, points: [usize; 2]) -> Vector3<f64> {
        let normal = |side: usize| {
            let stored = pair.views[side].scan().normals()[points[side]].map(f64::from);
            Vector3::from(pair.views[side].stored_to_world().rotate(stored))
        };
        let own = usize::from(!of_b);
        let other = 1 - own;
        let (plane, foot) = (normal(own), Vector3::from(pair.views[own].point(points[own])));
        let out = if self.oriented[own] {
            1.0
        } else if self.oriented[other] {
            -plane.dot(&normal(other))
        } else {
            let towards = plane.dot(&(self.centres[self.lesser] - foot));
            if self.lesser == own { -towards } else { towards }
        };
        // The normal points from b to a; flip it if it was taken from a.
        let sign = if of_b { -1.0 } else { 1.0 };
        plane * (sign * 1.0_f64.copysign(out))
    }

    /// The manifold point for the contact itself, used if no point pair contributes one.
    fn alone(&self, contact: &Contact) -> ManifoldPoint {
        let towards = Vector3::from(contact.normals.map_or_else(|| self.apart().into(), |[_, of_b]| of_b));
        let middle = (self.centres[self.lesser] - Vector3::from(contact.point)) * [1.0, -1.0][self.lesser];
        let away = match contact.normals.filter(|_| self.oriented[1] || self.oriented[0]) {
            // Out of b, or into a.
            Some([_, of_b]) if self.oriented[1] => Vector3::from(of_b),
            Some([of_a, _]) => -Vector3::from(of_a),
            None => middle,
        };
        let gap = if self.margin > 0.0 { (2.0 * contact.residual).min(self.margin) } else { 0.0 };
        ManifoldPoint {
            point: contact.point,
            normal: (towards * 1.0_f64.copysign(towards.dot(&away))).into(),
            gap,
            sources: contact.sources,
        }
    }
}

/// The search for the nearest points of all leaf pairs within reach.
struct Near<'a, 'p> {
    pair: &'a mut ScanPair<'p>,
    level: Level,
    reach_sq: f32,
    neighbours: &'a mut Vec<Neighbour>,
}

impl PairVisitor for Near<'_, '_> {
    #[inline]
    fn compared(&mut self, pairs: u32) -> ControlFlow<()> {
        self.pair.meter.spent.node_pairs += u64::from(pairs);
        self.pair.meter.go_on()
    }

    fn leaf_pair(&mut self, [a, b]: [usize; 2], _: &Open) -> ControlFlow<()> {
        let (of_a, of_b) = (self.pair.a.leaves.points(a), self.pair.b.leaves.points(b));
        self.pair.meter.leaf_pair(of_a.len(), of_b.len());
        for block_a in blocks_of(&of_a) {
            for block_b in blocks_of(&of_b) {
                let lanes = [lanes_of(block_a, &of_a), lanes_of(block_b, &of_b)];
                dispatch!(self.level, simd => simd.vectorize(
                    #[inline(always)]
                    || self.blocks(simd, [block_a, block_b], lanes),
                ));
            }
        }
        ControlFlow::Continue(())
    }
}

impl BoxVisitor for Near<'_, '_> {}

impl Near<'_, '_> {
    /// For each point of either block, finds the nearest point of the other block within reach.
    #[inline(always)]
    fn blocks<S: Simd>(&mut self, simd: S, blocks: [usize; 2], [lanes_a, lanes_b]: [u32; 2]) {
        let own = load(simd, &self.pair.a.blocks[blocks[0]].position);
        let [x, y, z] = self.pair.relative.points_back(&own);
        let (x, y, z) = (x.to_array(), y.to_array(), z.to_array());
        let [px, py, pz] = load(simd, &self.pair.b.blocks[blocks[1]].position);
        let beyond = f32x16::splat(simd, f32::INFINITY);
        let there = mask32x16::from_bitmask(simd, u64::from(lanes_b));
        let (mut least, mut nearest) = (beyond, f32x16::splat(simd, 0.0));
        for lane in 0..WIDTH {
            if lanes_a >> lane & 1 != 0 {
                let d = [px - x[lane], py - y[lane], pz - z[lane]];
                let d_sq = there.select(d[0] * d[0] + d[1] * d[1] + d[2] * d[2], beyond);
                let closer: mask32x16<S> = d_sq.simd_lt(least);
                least = closer.select(d_sq, least);
                nearest = closer.select(f32x16::splat(simd, NUMBERS[lane]), nearest);
                let own = d_sq.reduce_min();
                if own <= self.reach_sq {
                    let other = bits(d_sq.simd_eq(own)).trailing_zeros() as usize;
                    self.found(false, blocks[0] * WIDTH + lane, blocks[1] * WIDTH + other, own);
                }
            }
        }
        let within: mask32x16<S> = least.simd_le(self.reach_sq);
        let mut within = bits(within) & lanes_b;
        let (least, nearest) = (least.to_array(), nearest.to_array());
        while within != 0 {
            let lane = within.trailing_zeros() as usize % WIDTH;
            within &= within - 1;
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 15")]
            let other = nearest[lane] as usize;
            self.found(true, blocks[1] * WIDTH + lane, blocks[0] * WIDTH + other, least[lane]);
        }
    }

    #[expect(clippy::cast_possible_truncation, reason = "points are counted in 32 bits")]
    fn found(&mut self, of_b: bool, point: usize, nearest: usize, distance_sq: f32) {
        let (point, nearest) = (point as u32, nearest as u32);
        self.neighbours.push(Neighbour { of_b, point, nearest, distance_sq });
    }
}
