//! Rays against the discs and balls of a scan, nearest node first.
//!
//! A ray that crosses a sheet crosses several of its discs, and cells between them. All crossings up to a
//! layer behind the first are collected, of which [`ray_hits`](crate::solid::ray_hits) makes hits.

use std::ops::ControlFlow;

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, f32x4, mask32x4};
use nearmiss_geometry::NodeId;
use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::{PlaceVisitor, Siblings};
use nearmiss_index::{BoxRay, CutBoxVisitor};
use nearmiss_lanes::wide::{Bits, product};

use crate::ask::answer::Evidence;
use crate::ask::options::Semantics;
use crate::pair::placed::ViewScratch;
use crate::solid::crossing::{Crossing, enters, meets, passes_cell};
use crate::solid::elements::{Element, Elements};
use crate::solid::ray::{RayHit, StoredRay};
use crate::solid::ray_hits::next_hit;
use crate::solid::ray_lanes::{LEAST_SPEED, LaneRay};

type Vector = Vector3<f64>;

/// Rounding of places, relative to all coordinates.
const ROUNDING: f64 = 8e-6;

/// Rounding of a place along a ray in double precision, relative to the origin.
const FAR_ROUNDING: f64 = 1e-15;

/// Rounding of places along a ray, in sampling radii, from which on the ray is not compared.
const FAR_LOST: f64 = 1e-3;

/// The places that a search wants.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Wanted {
    First,
    Any,
    All,
}

struct Cast<'s, 'a> {
    elements: &'s Elements<'a>,
    ray: StoredRay,
    wanted: Wanted,
    /// The ray from where it comes near the scan, in single precision.
    lanes: LaneRay,
    /// The distance of that place from the origin.
    skipped: f64,
    /// The radius and the rounding error.
    thick: f32,
    /// The distance from that place beyond which nothing is of interest.
    most: f32,
    most_sq: f32,
    /// The distance from the origin beyond which no crossing belongs to the first hit.
    end: f64,
    found: &'s mut Vec<Crossing>,
    /// `true` if the ray passes through a volume that may contain the obstacle.
    is_doubtful: bool,
}

/// Writes the crossings of a ray with the parts of all points to `found`, up to some beyond the first
/// if only that is wanted. Returns the evidence for there being no others.
pub(crate) fn crossings(
    elements: &Elements<'_>,
    ray: &StoredRay,
    wanted: Wanted,
    (level, found): (Level, &mut Vec<Crossing>),
) -> Evidence {
    found.clear();
    let bounds = elements.arrays.tree.root_box();
    let centre = Vector::from(bounds.centre.map(f64::from));
    // Of a ball about the discs and balls, and of one about all enclosures.
    let enclosure = elements.arrays.tree.enclosure(elements.part(), NodeId::ROOT);
    let around = Vector::from(enclosure.centre.map(f64::from)) - centre;
    let size = f64::from(bounds.radius() + bounds.reach).max(around.norm() + f64::from(enclosure.radius()));
    let size = size + elements.beyond_boxes() + ray.radius;
    let middle = (centre - ray.origin).dot(&ray.direction);
    let off = (centre - ray.at(middle)).norm();
    // By how much double precision may miss a place along the ray.
    let lost = FAR_ROUNDING * (ray.origin.amax() + middle.abs());
    if off.is_nan() || lost > FAR_LOST * f64::from(elements.arrays.sampling_radius) {
        return Evidence::Estimated;
    }
    if off > size * 1.001 || middle + size < 0.0 || middle - size * 1.001 > ray.max {
        return elements.of_separation(false);
    }
    let skipped = (middle - 1.01 * size).max(0.0);
    #[expect(clippy::cast_possible_truncation, reason = "counted in `thick`")]
    let (single, slack) = (
        |v: Vector| [v.x as f32, v.y as f32, v.z as f32],
        (ROUNDING * (elements.far + 2.0 * size) + lost) as f32,
    );
    #[expect(clippy::cast_possible_truncation, reason = "counted in `thick`")]
    let thick = (ray.radius + elements.beyond_boxes()) as f32 + slack;
    #[expect(clippy::cast_possible_truncation, reason = "those near the ends are compared again")]
    let ends = [-skipped as f32, (ray.max - skipped) as f32];
    let (from, along) = (single(ray.at(skipped)), single(ray.direction));
    let mut search = Cast {
        elements,
        ray: *ray,
        wanted,
        lanes: LaneRay { from, along, lost: slack, ends },
        skipped,
        thick,
        most: f32::INFINITY,
        most_sq: f32::INFINITY,
        end: f64::INFINITY,
        found,
        is_doubtful: elements.of_separation(false) == Evidence::Estimated,
    };
    search.limit(ray.max);
    // Ends early if any hit will do.
    let _ended = match elements.leaves {
        Some(leaves) => leaves.visit_along(level, &BoxRay::new(from, along, thick), &mut search),
        None => elements.arrays.tree.descend_to(level, from, &mut search),
    };
    let evidence = elements.of_separation(search.is_doubtful);
    // All crossings up to the end are known. Which others are depends on the order of the leaves.
    let end = search.end;
    found.retain(|crossing| crossing.t <= end);
    found.sort_unstable_by(|a, b| a.t.total_cmp(&b.t).then(a.i.cmp(&b.i)));
    evidence
}

/// Calls `each` with all places where a ray hits the scan, the nearest first: one for each sheet that it
/// crosses, and for each ball. `found` is working memory.
pub(crate) fn all_hits(
    elements: &Elements<'_>,
    ray: &StoredRay,
    (level, found, scratch): (Level, &mut Vec<Crossing>, &mut ViewScratch),
    mut each: impl FnMut(RayHit),
) {
    let _evidence = crossings(elements, ray, Wanted::All, (level, &mut *found));
    let (mut next, mut last) = (0, f64::NEG_INFINITY);
    while let Some((hit, layer)) = next_hit(elements, ray, (found, true), &mut next, scratch) {
        // Crossings of one sheet may end at the same place once they are moved onto the surface.
        if hit.t - last > layer {
            last = hit.t;
            each(hit);
        }
    }
}

impl Cast<'_, '_> {
    /// Ends the search at this distance from the origin.
    #[expect(clippy::cast_possible_truncation, reason = "rounded up")]
    fn limit(&mut self, t: f64) {
        self.most = (((t - self.skipped) * (1.0 + 1e-6)) as f32).next_up() + self.thick;
        self.most = self.most.max(0.0);
        // Finite, as nodes beside the ray are infinitely far.
        self.most_sq = (self.most * self.most).next_up().min(f32::MAX);
    }

    /// Compares the ray with the part of a point.
    fn compare(&mut self, i: usize) -> ControlFlow<()> {
        let (elements, ray) = (self.elements, self.ray);
        if elements.is_doubtful(i) {
            self.is_doubtful = true;
            return ControlFlow::Continue(());
        }
        let crossing = match elements.element(i) {
            Element::Ball(centre, radius) => {
                let t = enters(&ray, &centre, radius + ray.radius);
                t.map(|t| Crossing { t, i, beside: 0.0, cosine: 1.0 })
            }
            Element::Disc(disc) => {
                let cell = f64::from(elements.arrays.cell_radius(i));
                self.is_doubtful = self.is_doubtful || passes_cell(elements, &ray, i, cell);
                meets(&ray, &disc, i, cell.max(disc.radius))
            }
        };
        let Some(crossing) = crossing.filter(|it| it.t <= ray.max) else {
            return ControlFlow::Continue(());
        };
        self.note(crossing)
    }

    /// Adds a crossing. Ends the search if it is enough.
    fn note(&mut self, crossing: Crossing) -> ControlFlow<()> {
        self.found.push(crossing);
        // The hit is one of the crossings.
        self.elements.placed.scan().prefetch_point(crossing.i);
        if !crossing.is_sure() {
            return ControlFlow::Continue(());
        }
        match self.wanted {
            Wanted::Any => return ControlFlow::Break(()),
            Wanted::First => {
                let end = (crossing.t + crossing.layer(self.elements)).min(self.ray.max);
                self.end = self.end.min(end);
                if end < self.skipped + f64::from(self.most) {
                    self.limit(end);
                }
            }
            Wanted::All => {}
        }
        ControlFlow::Continue(())
    }
}

impl CutBoxVisitor for Cast<'_, '_> {
    #[inline(always)]
    fn most_sq(&self) -> f32 {
        self.most_sq
    }

    #[inline(always)]
    fn foresee(&self, number: usize) {
        self.elements.arrays.prefetch_leaf(number);
    }

    #[inline(always)]
    fn visit<S: Simd>(&mut self, simd: S, number: usize, _: f32) -> ControlFlow<()> {
        self.look(simd, number)
    }
}

impl PlaceVisitor for Cast<'_, '_> {
    #[inline(always)]
    fn most_sq(&self) -> f32 {
        self.most_sq
    }

    /// The squared distances along the ray at which it enters the enclosures of four nodes, grown by
    /// its radius; infinite where it passes beside.
    #[inline(always)]
    fn distances_sq<S: Simd>(&self, simd: S, node: NodeId, _: &Siblings, _: [f32; 3]) -> f32x4<S> {
        let elements = self.elements;
        let nodes = elements.arrays.tree.bounds_of_children(simd, elements.part(), node);
        let [fx, fy, fz] = self.lanes.from;
        let d = [nodes.centre[0] - fx, nodes.centre[1] - fy, nodes.centre[2] - fz];
        let zero = f32x4::splat(simd, 0.0);
        let infinite = f32x4::splat(simd, f32::INFINITY);
        let tiny = f32x4::splat(simd, LEAST_SPEED);
        let (mut enter, mut exit) = (zero, f32x4::splat(simd, f32::MAX));
        for k in 0..3 {
            let [x, y, z] = nodes.axes[k];
            let at = product([x, y, z], d);
            let [ax, ay, az] = self.lanes.along;
            let speed = x * ax + y * ay + z * az;
            let is_still: mask32x4<S> = speed.abs().simd_lt(tiny);
            let speed = is_still.select(tiny, speed);
            let per_speed = f32x4::splat(simd, 1.0) / speed;
            let half = nodes.half[k] + self.thick;
            let near = (at - half - nodes.low[k]) * per_speed;
            let far = (at + half + nodes.high[k]) * per_speed;
            enter = enter.max(near.min(far));
            exit = exit.min(near.max(far));
        }
        let passes: mask32x4<S> = enter.simd_le(exit);
        passes.select(enter * enter, infinite)
    }

    #[inline(always)]
    fn leaf<S: Simd>(&mut self, simd: S, number: usize) -> ControlFlow<()> {
        self.look(simd, number)
    }
}

impl Cast<'_, '_> {
    /// Compares the ray with the points of a leaf.
    #[inline(always)]
    fn look<S: Simd>(&mut self, simd: S, number: usize) -> ControlFlow<()> {
        let elements = self.elements;
        if elements.certifies && elements.semantics == Semantics::Surface {
            self.is_doubtful = true;
        }
        // Single precision decides about rays without thickness.
        let is_thin = self.ray.radius == 0.0 && elements.semantics == Semantics::Obstacle;
        for (block, first, count) in elements.arrays.leaves.blocks(number) {
            let parts = elements.parts(simd, number, (block, first, count), true);
            let found = self.lanes.crossings(simd, (block, count), &parts, (self.most, self.thick));
            if found.near == 0 {
                continue;
            }
            let met = if is_thin { found.met } else { 0 };
            // A ray that crosses a cell passes through what may contain the obstacle.
            self.is_doubtful |= met != 0;
            for lane in Bits(met) {
                let [t, beside, cosine] =
                    [found.t[lane], found.beside[lane], found.cosine[lane]].map(f64::from);
                self.note(Crossing { t: (self.skipped + t).max(0.0), i: first + lane, beside, cosine })?;
            }
            let missed = if is_thin && self.is_doubtful { found.missed } else { 0 };
            for lane in Bits(found.near & !met & !missed) {
                self.compare(first + lane)?;
            }
        }
        ControlFlow::Continue(())
    }
}
