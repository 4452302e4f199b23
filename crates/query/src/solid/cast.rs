//! Rays against the discs and balls of a scan, nearest node first.
//!
//! A ray that crosses a sheet crosses several of its discs. The one whose centre is nearest to the
//! crossing, in disc radii, tells where. Between discs that leave a hole, the surface continues in the
//! cells of points (docs/theory/obstacle.md): a crossing of a cell's plane counts if its point is the
//! nearest one, or if the implicit function vanishes there.

use std::ops::ControlFlow;

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, f32x4, mask32x4};
use nearmiss_geometry::NodeId;
use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::{PlaceVisitor, PointKind, Siblings};
use nearmiss_index::{BoxRay, CutBoxVisitor};
use nearmiss_lanes::wide::{Bits, product};
use nearmiss_surface::Status;

use crate::ask::answer::Evidence;
use crate::ask::options::{Detail, Semantics};
use crate::leaf::disc_triangle::FlatDisc;
use crate::pair::placed::ViewScratch;
use crate::solid::core::Solid;
use crate::solid::crossing::{Crossing, enters, meets, passes_cell};
use crate::solid::elements::{Element, Elements};
use crate::solid::meeting::verified_in;
use crate::solid::ray::{RayHit, StoredRay};
use crate::solid::ray_lanes::{LEAST_SPEED, LaneRay};

type Vector = Vector3<f64>;

/// Rounding of places, relative to all coordinates.
const ROUNDING: f64 = 8e-6;

/// Rounding of a place along a ray in double precision, relative to the origin.
const FAR_ROUNDING: f64 = 1e-15;

/// Rounding of places along a ray, in sampling radii, from which on nothing is proven, and from which on
/// the ray is not compared.
const FAR_LOST: [f64; 2] = [1e-3, 0.1];

/// The greatest |f| on the surface, in bandwidths.
const ON_SURFACE: f64 = 1e-6;

/// Evaluations along a ray.
const ROUNDS: u32 = 8;

/// The least cosine of a ray and a normal at which the crossing is refined.
const GRAZING: f64 = 0.02;

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
    let spacing = f64::from(elements.arrays.sampling_radius);
    if off.is_nan() || lost > FAR_LOST[1] * spacing {
        return Evidence::Estimated;
    }
    if off > size * 1.001 || middle + size < 0.0 || middle - size * 1.001 > ray.max {
        return elements.of_separation(lost > FAR_LOST[0] * spacing);
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
        is_doubtful: elements.of_separation(lost > FAR_LOST[0] * spacing) == Evidence::Estimated,
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
    while let Some((hit, layer)) = next_hit(elements, ray, found, &mut next, scratch) {
        // Crossings of one sheet may end at the same place once they are moved onto the surface.
        if hit.t - last > layer {
            last = hit.t;
            each(hit);
        }
    }
}

/// Returns the first of the crossings from number `next` on that counts, as a hit, and the thickness of
/// the sheet there in the world; sets `next` to the crossing after those of the same sheet.
pub(crate) fn next_hit(
    elements: &Elements<'_>,
    ray: &StoredRay,
    found: &[Crossing],
    next: &mut usize,
    scratch: &mut ViewScratch,
) -> Option<(RayHit, f64)> {
    let all = found;
    while let Some(first) = all.get(*next) {
        let start = *next;
        if !elements.is_disc(first.i) {
            *next += 1;
            return hit(elements, ray, first, scratch).map(|hit| (hit, 0.0));
        }
        let layer = first.layer(elements);
        // As far as a search for the first hit looks.
        let mut end = first.t + layer;
        let is_same = |it: &&Crossing| {
            let is_same = it.t <= end;
            if is_same && it.is_sure() {
                end = end.min(it.t + it.layer(elements));
            }
            is_same
        };
        let count = all[start..].iter().take_while(is_same).count();
        *next += count;
        // A ball that touches before it moves has a hit there, wherever it touches next.
        let starts = ray.radius > 0.0 && first.t == 0.0;
        let counts = |it: &&Crossing| elements.is_disc(it.i) && (!starts || it.t == 0.0);
        let sheet = || all[start..start + count].iter().filter(counts);
        // At the start the nearest point may be in the ball, which certifies the hit.
        let rank = |it: &Crossing| match starts {
            true => (elements.position(it.i) - ray.origin).norm_squared(),
            false => it.beside,
        };
        let Some(best) = sheet().min_by(|a, b| rank(a).total_cmp(&rank(b))) else { continue };
        let found = hit(elements, ray, best, scratch);
        // In a hole, the point nearest to the ray may be another one.
        let found = found.or_else(|| sheet().find_map(|it| hit(elements, ray, it, scratch)));
        if let Some(found) = found {
            return Some((found, layer * elements.scale()));
        }
        // A ball among the crossings of a hole still counts.
        let is_ball = |it: &Crossing| !elements.is_disc(it.i);
        *next = start + all[start..start + count].iter().position(is_ball).unwrap_or(count);
    }
    None
}

/// The hit at a crossing. `None` if it is in a hole between discs where there is no surface.
fn hit(
    elements: &Elements<'_>,
    ray: &StoredRay,
    crossing: &Crossing,
    scratch: &mut ViewScratch,
) -> Option<RayHit> {
    let i = crossing.i;
    let (placed, scale) = (&elements.placed, elements.scale());
    let source = placed.scan().id(i);
    let told = |t: f64, point: Vector, normal: Vector, evidence| RayHit {
        t: t * scale,
        point: elements.in_world(&point),
        normal: elements.turned(&normal),
        source,
        evidence,
    };
    let disc = match elements.element(i) {
        Element::Ball(centre, radius) => {
            let t = crossing.t;
            let normal = (ray.at(t) - centre).try_normalize(0.0).unwrap_or(-ray.direction);
            return Some(told(t, centre + normal * radius, normal, Evidence::Certified));
        }
        Element::Disc(disc) => disc,
    };
    // The crossing may be known in single precision only.
    let cell = f64::from(elements.arrays.cell_radius(i)).max(disc.radius);
    let Crossing { t, beside, .. } = meets(ray, &disc, i, cell).unwrap_or(*crossing);
    if t == 0.0 && ray.radius > 0.0 && beside <= 1.0 {
        let (point, normal, evidence) = at_start(elements, ray, (i, &disc), scratch);
        return Some(told(t, point, normal, evidence));
    }
    let x = ray.at(t);
    let towards = disc.normal * 1.0_f64.copysign(-disc.normal.dot(&ray.direction));
    let side = |normal: Vector| {
        // A ball may touch the flank of a bend that it moves along.
        let right = match placed.scan().is_oriented() {
            true => disc.normal,
            false if ray.radius > 0.0 => towards,
            false => -ray.direction,
        };
        if normal.dot(&right) < 0.0 { -normal } else { normal }
    };
    let is_wanted = elements.detail == Detail::Witness && placed.verifies();
    if is_wanted
        && let Some((t, point, normal, evidence)) = refined(elements, ray, (i, t, towards), scratch)
        && (beside <= 1.0 || evidence == Evidence::Certified)
    {
        return Some(told(t, point, side(normal), evidence));
    }
    let on_disc = disc.nearest(&x);
    if beside <= 1.0 {
        let is_edge = placed.scan().kind(i) == PointKind::Edge;
        let way = x - on_disc;
        let rim = is_edge && beside >= 1.0 - 1e-9 && ray.radius > 0.0;
        let normal = if rim { way.try_normalize(0.0).unwrap_or(towards) } else { side(towards) };
        return Some(told(t, on_disc, normal, Evidence::Estimated));
    }
    // The surface between the discs, to first order.
    let place = x - disc.normal * disc.normal.dot(&(x - disc.centre));
    let is_inner = placed.scan().kind(i) == PointKind::Sheet;
    let is_part = is_inner && placed.scan().nearest_point_near(i, place.into()) as usize == i;
    is_part.then(|| told(t, place, side(towards), Evidence::Estimated))
}

/// The contact of a ball that touches a disc before it moves: the point, the normal and the evidence. The
/// normal is outwards if the scan is oriented, otherwise on the side of the ball's centre.
fn at_start(
    elements: &Elements<'_>,
    ray: &StoredRay,
    (i, disc): (usize, &FlatDisc),
    scratch: &mut ViewScratch,
) -> (Vector, Vector, Evidence) {
    let on_disc = disc.nearest(&ray.origin);
    let height = disc.normal.dot(&(ray.origin - disc.centre));
    let side = if height == 0.0 { -disc.normal.dot(&ray.direction) } else { height };
    let is_turned = !elements.placed.scan().is_oriented() && side < 0.0;
    let normal = if is_turned { -disc.normal } else { disc.normal };
    let verified = Solid::ball((ray.origin, ray.radius)).and_then(|ball| {
        elements.held(&ball, i).or_else(|| {
            let is_wanted = elements.detail == Detail::Witness;
            let found = is_wanted.then(|| verified_in(elements, &ball, (i, on_disc), scratch))??;
            Some(elements.placed.stored_to_world().apply_inverse(found).into())
        })
    });
    let evidence = if verified.is_some() { Evidence::Certified } else { Evidence::Estimated };
    (verified.unwrap_or(on_disc), normal, evidence)
}

/// Looks for the place along a ray, near distance `t`, where it is its radius away from the surface
/// near point `i`, on the side of `towards`. Returns the distance, the point of the surface, the
/// normal, turned to that side, and the evidence: estimated if the place is not part of the obstacle.
fn refined(
    elements: &Elements<'_>,
    ray: &StoredRay,
    (i, start, towards): (usize, f64, Vector),
    scratch: &mut ViewScratch,
) -> Option<(f64, Vector, Vector, Evidence)> {
    let (placed, scale) = (&elements.placed, elements.scale());
    let frame = placed.stored_to_world();
    let most = f64::from(elements.arrays.radii[i]);
    let mut field = placed.near(i, scratch);
    let mut t = start;
    for _ in 0..ROUNDS {
        let x = ray.at(t);
        // A thick ray looks at the surface beside its ball.
        let foot = x - towards * ray.radius;
        let at = field.evaluate(elements.in_world(&foot));
        if at.status == Status::Outside {
            return None;
        }
        let normal = Vector::from(frame.rotate_inverse(at.normal));
        let cosine = normal.dot(&ray.direction);
        let f = at.f / scale;
        if f.abs() <= ON_SURFACE * at.bandwidth / scale {
            let is_part =
                elements.semantics == Semantics::Surface || placed.is_obstacle(i, elements.in_world(&foot));
            let normal = normal * 1.0_f64.copysign(normal.dot(&towards));
            let evidence =
                if at.status == Status::Ok && is_part { Evidence::Certified } else { Evidence::Estimated };
            return (t >= 0.0 && t <= ray.max).then_some((t, foot, normal, evidence));
        }
        if cosine.abs() < GRAZING {
            return None;
        }
        // f is positive below the surface.
        t += f / cosine;
        let moved = (t - start).abs();
        if moved.is_nan() || moved > most / cosine.abs() {
            return None;
        }
    }
    None
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
