//! The contact manifold of a shape and a scan: up to eight points, each with a normal and a depth.
//!
//! Each disc that the shape touches gives one contact, the deepest place of the shape over the disc.
//! Each ball gives one along the way from its centre. The deepest is selected first, then always the
//! one furthest from those selected, as for two scans (`contact::manifold`).

use std::ops::ControlFlow;

use fearless_simd::{Level, Simd, f32x4};
use nearmiss_geometry::NodeId;
use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::{PlaceVisitor, PointKind, Siblings, THICKNESS};
use nearmiss_lanes::wide::Bits;
use nearmiss_surface::Status;

use crate::ask::options::Detail;
use crate::leaf::disc_triangle::FlatDisc;
use crate::pair::placed::ViewScratch;
use crate::solid::answer::ShapeContact;
use crate::solid::core::{Gap, Solid};
use crate::solid::descent::Near;
use crate::solid::elements::{Element, Elements};
use crate::solid::hint::{MOST, ShapeHint};

type Vector = Vector3<f64>;

/// Two contacts of a manifold are at least this far apart, in local radii.
const SPREAD: f64 = 0.5;

/// A contact of the last frame within this distance decides the side, in local radii.
const SIDE: f64 = 4.0;

/// Steps to the deepest place over a disc; two are enough over a plane.
const ROUNDS: u32 = 8;

/// Evaluations that move the deepest contact over the surface.
const SLIDES: u32 = 3;

/// The precision of a depth, in disc radii.
const PRECISION: f64 = 1e-3;

/// A place where the shape touches a disc or a ball, in the world.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Candidate {
    contact: ShapeContact,
    /// The index and the local radius of the point.
    i: usize,
    band: f64,
    /// The squared distance from the nearest selected contact.
    away_sq: f64,
    /// `true` if the shape's centre is behind the surface.
    is_behind: bool,
}

struct Gather<'s, 'a> {
    near: Near<'s, 'a>,
    hint: Option<&'s ShapeHint>,
    /// The point whose side of a surface is that of the shape, in the stored frame.
    inside: Vector,
    is_oriented: bool,
    found: &'s mut Vec<Candidate>,
    /// The nearest disc whose thickness the shape touches beside its rim, where it has no depth.
    beside: Option<Candidate>,
}

/// Writes the manifold of `solid` and the scan to `contacts`.
pub(crate) fn contacts(
    elements: &Elements<'_>,
    solid: Option<&Solid<'_>>,
    hint: Option<&mut ShapeHint>,
    contacts: &mut Vec<ShapeContact>,
    (level, scratch, found): (Level, &mut ViewScratch, &mut Vec<Candidate>),
) {
    contacts.clear();
    found.clear();
    let own = hint.as_deref().and_then(|hint| hint.centre);
    let own = own.map(|own| Vector::from(elements.placed.stored_to_world().apply_inverse(own)));
    if let Some(solid) = solid {
        let starts = elements.starts(solid, elements.margin);
        let mut near = Near::new(elements, solid, false);
        near.limit(elements.margin);
        let is_oriented = elements.placed.scan().is_oriented();
        let inside = own.unwrap_or(solid.inside);
        let mut search = Gather { near, hint: hint.as_deref(), inside, is_oriented, found, beside: None };
        // The visitor never breaks.
        let _whole = near.descend(level, &starts, &mut search);
        // A shape that touches has a contact.
        if let (true, Some(beside)) = (search.found.is_empty(), search.beside) {
            search.found.push(beside);
        }
    }
    // Behind a thin plate there is another surface, which would push the shape through.
    if found.iter().any(|it| !it.is_behind) {
        found.retain(|it| !it.is_behind);
    }
    let mut bands = [0.0; MOST];
    let mut points = [0; MOST];
    let known = hint.as_deref();
    while contacts.len() < MOST {
        let Some(next) = select(found, known, contacts) else { break };
        let Candidate { contact, i, band, .. } = found[next];
        (points[contacts.len()], bands[contacts.len()]) = (i, band);
        contacts.push(contact);
        for other in found.iter_mut() {
            let away = Vector::from(other.contact.point) - Vector::from(contact.point);
            other.away_sq = other.away_sq.min(away.norm_squared());
        }
    }
    let is_refined = elements.detail == Detail::Witness && elements.placed.verifies();
    if let Some(solid) = solid.filter(|_| is_refined) {
        let inside = own.unwrap_or(solid.inside);
        for (n, (contact, i)) in contacts.iter_mut().zip(points).enumerate() {
            if elements.is_disc(i) && elements.placed.scan().kind(i) != PointKind::Edge {
                refine(elements, (solid, &inside), (i, if n == 0 { SLIDES } else { 0 }), contact, scratch);
            }
        }
        let deepest = (0..contacts.len()).max_by(|&a, &b| contacts[a].depth.total_cmp(&contacts[b].depth));
        if let Some(deepest) = deepest.filter(|&n| contacts[n].depth > contacts[0].depth) {
            contacts.swap(0, deepest);
            bands.swap(0, deepest);
        }
    }
    if let Some(hint) = hint {
        hint.number(contacts, &bands);
    }
}

/// Selects the deepest candidate, then those that continue contacts of the last frame, then always the
/// one furthest from all selected ones.
fn select(found: &[Candidate], hint: Option<&ShapeHint>, taken: &[ShapeContact]) -> Option<usize> {
    let is_apart = |it: &Candidate| it.away_sq >= (SPREAD * it.band).powi(2);
    let deepest = |a: &Candidate, b: &Candidate| a.contact.depth.total_cmp(&b.contact.depth);
    let candidates = || found.iter().enumerate().filter(|(_, it)| is_apart(it));
    if taken.is_empty() {
        return candidates().max_by(|a, b| deepest(a.1, b.1).then(b.0.cmp(&a.0))).map(|(n, _)| n);
    }
    let known = hint.map(ShapeHint::contacts).into_iter().flatten();
    for known in known {
        let away =
            |it: &Candidate| (Vector::from(it.contact.point) - Vector::from(known.point)).norm_squared();
        let is_taken = |band: f64| taken.iter().any(|own| ShapeHint::continues(known, own, band));
        let continues =
            |it: &Candidate| ShapeHint::continues(known, &it.contact, it.band) && !is_taken(it.band);
        let nearest =
            candidates().filter(|(_, it)| continues(it)).min_by(|a, b| away(a.1).total_cmp(&away(b.1)));
        if let Some((n, _)) = nearest {
            return Some(n);
        }
    }
    let further = |a: &Candidate, b: &Candidate| a.away_sq.total_cmp(&b.away_sq);
    let best =
        candidates().max_by(|a, b| further(a.1, b.1).then_with(|| deepest(a.1, b.1)).then(b.0.cmp(&a.0)));
    best.map(|(n, _)| n)
}

/// Moves a contact from the tangent disc of point `i` onto the surface, with one evaluation. The deepest
/// contact of the disc also moves over the surface to where that is nearest to the shape, with up to
/// `slides` more. Leaves the contact on its disc where the surface turns away from the disc by more than
/// 60°, or `inside` is on another side of it: in noise, or beside another sheet.
fn refine(
    elements: &Elements<'_>,
    (solid, inside): (&Solid<'_>, &Vector),
    (i, slides): (usize, u32),
    contact: &mut ShapeContact,
    scratch: &mut ViewScratch,
) {
    /// A contact that moves by less than this is near enough, in disc radii.
    const NEAR: f64 = 0.05;
    /// A place of the surface, as a disc, in disc radii.
    const PLACE: f64 = 0.01;
    /// The cosine of the greatest angle between the surface and the disc.
    const TURN: f64 = 0.5;
    let (placed, band) = (&elements.placed, elements.band(i));
    let frame = placed.stored_to_world();
    let radius = f64::from(elements.arrays.discs.get(i));
    let deepest = |disc: FlatDisc| {
        of_disc(solid, &solid.gap(&disc, f64::INFINITY), &disc, (disc.normal, false, elements.margin))
    };
    let (mut x, own) = (contact.point, Vector::from(contact.normal));
    let is_before =
        own.dot(&(Vector::from(placed.stored_to_world().apply((*inside).into())) - Vector::from(x))) >= 0.0;
    let mut slides = slides;
    loop {
        let at = placed.evaluate_near(i, x, scratch);
        if at.status != Status::Ok || at.f.abs() > band {
            return;
        }
        let upright = Vector::from(at.normal);
        // f is positive below the surface.
        let foot = Vector::from(x) + upright * at.f;
        let disc = FlatDisc {
            centre: frame.apply_inverse(foot.into()).into(),
            normal: frame.rotate_inverse((upright * 1.0_f64.copysign(upright.dot(&own))).into()).into(),
            radius,
        };
        let stays = disc.normal.dot(&(inside - disc.centre)) >= 0.0;
        if upright.dot(&own).abs() < TURN || stays != is_before {
            return;
        }
        if slides > 0
            && let Some((point, ..)) = deepest(disc)
            && (point - disc.centre).norm() > NEAR * radius
        {
            slides -= 1;
            x = elements.in_world(&point);
            continue;
        }
        // A shape that is beside this place has no depth there.
        let least = -elements.margin.max(f64::from(THICKNESS) * radius);
        if let Some((_, normal, depth)) =
            deepest(FlatDisc { radius: PLACE * radius, ..disc }).filter(|found| found.2 >= least)
        {
            contact.point = foot.into();
            contact.depth = depth * elements.scale();
            contact.normal = elements.turned(&normal);
        }
        return;
    }
}

impl Gather<'_, '_> {
    /// Adds the contact of the shape and the part of a point, if they touch.
    fn compare(&mut self, i: usize) {
        let Near { elements, solid, .. } = self.near;
        if elements.is_doubtful(i) {
            return;
        }
        let gap = || {
            let (gap, thick) = elements.gap(solid, i, elements.margin);
            (gap.distance <= solid.radius + elements.margin.max(thick)).then_some(gap)
        };
        let mut is_beside = false;
        let found = match elements.element(i) {
            Element::Ball(centre, radius) => {
                gap().and_then(|gap| of_ball(solid, &gap, (centre, radius))).map(|it| (it, false))
            }
            Element::Disc(disc) => {
                let out = self.way_out(i, &disc);
                let is_edge = elements.placed.scan().kind(i) == PointKind::Edge;
                let is_behind = out.dot(&(self.inside - disc.centre)) < 0.0;
                let crosses = solid.crosses(&disc);
                let near = if crosses { None } else { gap() };
                let place = if crosses {
                    Some(deepest(solid, &disc, out))
                } else {
                    near.as_ref().and_then(|gap| of_disc(solid, gap, &disc, (out, is_edge, elements.margin)))
                };
                // The part of the shape over the disc may be far above it, while another part is at the rim.
                let least = -elements.margin.max(f64::from(THICKNESS) * disc.radius);
                let place = place.filter(|it| it.2 >= least);
                is_beside = place.is_none();
                let place = place.or_else(|| {
                    let near = if crosses { gap() } else { near };
                    near.map(|gap| (gap.on_disc, out, solid.radius - gap.distance))
                });
                place.map(|it| (it, is_behind))
            }
        };
        let Some(((point, normal, depth), is_behind)) = found else { return };
        let contact = ShapeContact {
            point: elements.in_world(&point),
            normal: elements.turned(&normal),
            depth: depth * elements.scale(),
            id: u64::from(elements.placed.scan().id(i).0),
        };
        let found = Candidate { contact, i, band: elements.band(i), away_sq: f64::INFINITY, is_behind };
        if !is_beside {
            self.found.push(found);
        } else if self.beside.is_none_or(|beside| beside.contact.depth < contact.depth) {
            self.beside = Some(found);
        }
    }

    /// The normal of a disc, in the direction in which the shape moves out: outwards if the scan is
    /// oriented, otherwise as in the last frame, or to the side of the shape's centre.
    fn way_out(&self, i: usize, disc: &FlatDisc) -> Vector {
        let elements = self.near.elements;
        if self.is_oriented {
            return disc.normal;
        }
        let known = self.hint.and_then(|hint| {
            let placed = elements.placed.stored_to_world();
            let (point, normal) = (placed.apply(disc.centre.into()), placed.rotate(disc.normal.into()));
            let side = hint.side(&point.into(), &normal.into(), SIDE * elements.band(i))?;
            Some(Vector::from(placed.rotate_inverse(side.into())))
        });
        known.unwrap_or_else(|| {
            let side = disc.normal.dot(&(self.inside - disc.centre));
            disc.normal * 1.0_f64.copysign(side)
        })
    }
}

/// A point of the surface, the normal, and the depth of a contact.
type Place = (Vector, Vector, f64);

/// The contact with a ball: along the way from its centre to the core or, if the core contains it, to
/// the inside of the shape.
fn of_ball(solid: &Solid<'_>, gap: &Gap, (centre, radius): (Vector, f64)) -> Option<Place> {
    let way = gap.on_core - centre;
    let normal = way.try_normalize(0.0).or_else(|| (solid.inside - centre).try_normalize(0.0));
    let normal = normal.unwrap_or_else(Vector::z);
    let inside = if way == Vector::zeros() { -normal.dot(&(solid.support(&-normal) - centre)) } else { 0.0 };
    let depth = solid.radius + radius - way.norm() + inside;
    Some((centre + normal * radius, normal, depth)).filter(|it| it.2.is_finite())
}

/// The contact with a disc: the deepest place of the shape over the disc.
fn of_disc(
    solid: &Solid<'_>,
    gap: &Gap,
    disc: &FlatDisc,
    (out, is_edge, margin): (Vector, bool, f64),
) -> Option<Place> {
    let way = gap.on_core - gap.on_disc;
    let (length, height) = (way.norm(), out.dot(&way));
    // The core is before the disc.
    if height > 0.0 && length > PRECISION * disc.radius {
        let beside_sq = (way - out * height).norm_squared();
        if beside_sq <= (PRECISION * length).powi(2) {
            return Some((gap.on_disc, out, solid.radius - height));
        }
        if is_edge {
            return Some((gap.on_disc, way / length, solid.radius - length));
        }
        // The sphere about the nearest point of the core reaches this far below the rim.
        let below = solid.radius * solid.radius - beside_sq;
        let depth = if below >= 0.0 { below.sqrt() - height } else { f64::NEG_INFINITY };
        return (depth >= -margin).then_some((gap.on_disc, out, depth));
    }
    Some(deepest(solid, disc, out))
}

/// The deepest place of the shape over a disc that crosses its core, or that it is behind of. The disc
/// moves up from below the shape until it touches the core.
fn deepest(solid: &Solid<'_>, disc: &FlatDisc, out: Vector) -> Place {
    let lowest = solid.support(&-out);
    let mut depth = -out.dot(&(lowest - disc.centre));
    let across = lowest - disc.centre + out * depth;
    if across.norm_squared() <= disc.radius * disc.radius {
        return (disc.centre + across, out, depth + solid.radius);
    }
    if let Some(lowest) = solid.lowest_over(disc, &out) {
        let height = out.dot(&(lowest - disc.centre));
        return (lowest - out * height, out, solid.radius - height);
    }
    let mut place = disc.centre;
    for _ in 0..ROUNDS {
        let below = FlatDisc { centre: disc.centre - out * depth, ..*disc };
        let gap = solid.gap(&below, f64::INFINITY);
        place = gap.on_disc + out * depth;
        let rise = out.dot(&(gap.on_core - gap.on_disc));
        if gap.distance <= PRECISION * disc.radius || rise <= PRECISION * gap.distance {
            break;
        }
        // No place of the core is below the plane through the nearest point, across the way to it.
        depth -= gap.distance * gap.distance / rise;
    }
    (place, out, depth + solid.radius)
}

impl PlaceVisitor for Gather<'_, '_> {
    #[inline(always)]
    fn most_sq(&self) -> f32 {
        self.near.most_sq
    }

    #[inline(always)]
    fn distances_sq<S: Simd>(&self, simd: S, node: NodeId, _: &Siblings, _: [f32; 3]) -> f32x4<S> {
        self.near.distances_sq(simd, &self.near.elements.arrays.tree, node)
    }

    #[inline(always)]
    fn leaf<S: Simd>(&mut self, simd: S, number: usize) -> ControlFlow<()> {
        let elements = self.near.elements;
        for (block, first, count) in elements.arrays.leaves.blocks(number) {
            let gaps = elements.leaf_gaps(simd, &self.near.lane_box, (number, block, first, count));
            for lane in Bits(Elements::within(simd, (&gaps.elements, count), self.near.most)) {
                self.compare(first + lane);
            }
        }
        ControlFlow::Continue(())
    }
}
