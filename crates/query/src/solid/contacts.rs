//! The contact manifold of a shape and a scan: up to eight points, each with a normal and a depth.
//!
//! Each disc that the shape touches can give one contact, the deepest place of the shape over the disc.
//! Each ball can give one along the way from its centre. The deepest is selected first, then the deepest of
//! other walls, then those that continue contacts of the last frame, then those whose discs or balls are
//! furthest from all before. A shape may touch hundreds of discs, so a place is computed only where the
//! selection depends on it: the bounds of [`gather`](crate::solid::gather) tell where the deepest may be.

use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::ops::Range;

use fearless_simd::Level;
use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::PointKind;
use nearmiss_lanes::id32;

use crate::ask::options::Detail;
use crate::pair::placed::ViewScratch;
use crate::solid::answer::ShapeContact;
use crate::solid::candidates::{Among, Candidate, CandidateBlocks, single};
use crate::solid::core::Solid;
use crate::solid::descent::Near;
use crate::solid::elements::Elements;
use crate::solid::ends::SheetEnds;
use crate::solid::gather::{Gather, SPREAD};
use crate::solid::hint::{MOST, ShapeHint};
use crate::solid::place::{Place, most_depth, place_at, place_beside};
use crate::solid::places::{LANES, places_at};
use crate::solid::probe::is_far;
use crate::solid::refine::refine;
use crate::solid::sides::Sides;

type Vector = Vector3<f64>;

/// Another contact may be this much deeper than the first, in local radii.
const LEVEL: f64 = 0.01;

/// Candidates that are looked for one by one, before all others are ordered.
const SCANS: u32 = 8;

/// Further walls that have a contact where they are deepest.
const OTHER_WALLS: usize = 3;

/// Candidates that are compared with a contact of the last frame.
const TRIES: usize = 3;

/// Evaluations that move the deepest contact over the surface.
const SLIDES: u32 = 3;

/// Reusable memory.
#[derive(Debug, Clone, Default)]
pub(crate) struct Candidates {
    found: CandidateBlocks,
    places: Vec<Met>,
    chosen: Vec<Candidate>,
    directions: Vec<[f32; 3]>,
    order: BinaryHeap<(u64, Candidate)>,
    ends: SheetEnds,
}

/// A place, and the index of its point.
#[derive(Debug, Clone, Copy)]
struct Met {
    place: Place,
    i: usize,
    /// `true` if the shape moves out past the end of the sheet.
    is_past_end: bool,
}

/// The selection of contacts among candidates.
struct Selection<'s, 'a> {
    elements: &'s Elements<'a>,
    solid: &'s Solid<'s>,
    level: Level,
    found: &'s mut CandidateBlocks,
    places: &'s mut Vec<Met>,
    /// Candidates whose places are computed at once.
    chosen: &'s mut Vec<Candidate>,
    /// The normals of the walls that have contacts, or candidates that are chosen.
    directions: &'s mut Vec<[f32; 3]>,
    /// The candidates by depth, once so many have been tried.
    order: &'s mut BinaryHeap<(u64, Candidate)>,
    /// The number of candidates that have been tried by their depth.
    tries: u32,
    /// The numbers of the places that are contacts.
    taken: [usize; MOST],
    count: usize,
}

/// Writes the manifold of `solid` and the scan to `out`.
pub(crate) fn contacts(
    elements: &Elements<'_>,
    solid: Option<&Solid<'_>>,
    hint: Option<&mut ShapeHint>,
    out: &mut Vec<ShapeContact>,
    (level, scratch, candidates): (Level, &mut ViewScratch, &mut Candidates),
) {
    out.clear();
    let (mut points, mut bands, mut at_ends) = ([0; MOST], [0.0; MOST], [false; MOST]);
    if let Some(solid) = solid {
        let own = hint.as_deref().and_then(|hint| hint.centre);
        let own = own.map(|own| Vector::from(elements.placed.stored_to_world().apply_inverse(own)));
        let sides = Sides::new(elements, own.unwrap_or(solid.inside), hint.as_deref());
        let Candidates { found, places, chosen, directions, order, ends } = candidates;
        found.clear();
        places.clear();
        // About a longer core the clearance of the centre rarely tells more than the list of boxes.
        if !(solid.is_point() && is_far(elements, solid, (elements.margin, false))) {
            let mut near = Near::new(elements, solid, false, &mut scratch.corners);
            near.limit(elements.margin);
            let search = &mut Gather { near, sides: &sides, found: &mut *found };
            // The search never ends early.
            let _whole = near.search(level, elements.margin, search);
            found.arrange();
        }
        for &(i, place) in ends.settle(elements, solid, level, (found, scratch)) {
            places.push(Met { place, i, is_past_end: true });
        }
        let mut selection = Selection {
            elements,
            solid,
            level,
            found,
            places,
            chosen,
            directions,
            order,
            tries: 0,
            taken: [0; MOST],
            count: 0,
        };
        selection.run(hint.as_deref());
        for (n, met) in selection.taken().enumerate() {
            (points[n], bands[n], at_ends[n]) = (met.i, elements.band(met.i), met.is_past_end);
            out.push(met.contact(elements));
        }
        if elements.detail == Detail::Witness && elements.placed.verifies() {
            for (n, (contact, i)) in out.iter_mut().zip(points).enumerate() {
                let is_within = elements.placed.scan().kind(i) != PointKind::Edge && !at_ends[n];
                if elements.is_disc(i) && is_within {
                    let slides = if n == 0 { SLIDES } else { 0 };
                    refine(elements, (solid, &sides.inside), (i, slides), contact, scratch);
                }
            }
            let deepest = (0..out.len()).max_by(|&a, &b| out[a].depth.total_cmp(&out[b].depth));
            if let Some(deepest) = deepest.filter(|&n| out[n].depth > out[0].depth) {
                out.swap(0, deepest);
                points.swap(0, deepest);
                bands.swap(0, deepest);
            }
        }
    }
    if let Some(hint) = hint {
        hint.number(out, (&points, &bands));
    }
}

impl Selection<'_, '_> {
    fn run(&mut self, hint: Option<&ShapeHint>) {
        // Behind a thin plate there is another surface, which would push the shape through.
        let deepest = match self.deepest(Among::Front) {
            Some(front) => {
                self.found.remove_behind();
                Some(front)
            }
            None => self.deepest(Among::Behind),
        };
        match deepest {
            // A shape that touches has a contact.
            None => self.take_beside(),
            Some(number) => {
                self.take(number);
                self.spread_out(hint);
            }
        }
    }

    /// Takes the deepest contact of a shape that is only beside discs: no candidate has a place.
    fn take_beside(&mut self) {
        let places = self.found.missed().filter_map(|it| {
            let i = self.found.point(it);
            let place = place_beside(self.elements, self.solid, i, self.found.sign(it))?;
            Some(Met { place, i, is_past_end: false })
        });
        if let Some(deepest) = places.max_by(Met::deeper) {
            self.places.push(deepest);
            self.take(self.places.len() - 1);
        }
    }

    /// The contacts so far.
    fn taken(&self) -> impl Iterator<Item = &Met> {
        self.taken[..self.count].iter().map(|&number| &self.places[number])
    }

    /// Returns the number of the place of a candidate.
    fn place(&mut self, candidate: Candidate) -> Option<usize> {
        if let Some(number) = self.found.place(candidate) {
            return Some(number);
        }
        let i = self.found.point(candidate);
        let place = place_at(self.elements, self.solid, i, self.found.sign(candidate));
        self.keep(candidate, place)
    }

    /// Computes the places of the chosen candidates at once, at most [`LANES`].
    fn prepare(&mut self) {
        let (mut open, mut points) = ([Candidate::default(); LANES], [(0, 0.0); LANES]);
        let mut count = 0;
        for &candidate in self.chosen.iter() {
            if self.found.place(candidate).is_none() {
                open[count] = candidate;
                points[count] = (self.found.point(candidate), self.found.sign(candidate));
                count += 1;
            }
        }
        let (elements, solid, level) = (self.elements, self.solid, self.level);
        places_at(elements, solid, level, &points[..count], |n, place| {
            self.keep(open[n], place);
        });
    }

    /// Keeps the place of a candidate, and returns its number. Removes the candidate if it has none.
    fn keep(&mut self, candidate: Candidate, place: Option<Place>) -> Option<usize> {
        let Some(place) = place else {
            self.found.miss(candidate);
            return None;
        };
        let number = self.places.len();
        self.places.push(Met { place, i: self.found.point(candidate), is_past_end: false });
        self.found.set_place(candidate, number);
        Some(number)
    }

    /// Returns the number of the deepest place, up to [`LEVEL`], of some candidates. Computes places as long
    /// as another one may be deeper.
    fn deepest(&mut self, among: Among) -> Option<usize> {
        let mut best: Option<usize> = None;
        self.tries = 0;
        while let Some(candidate) = self.next(among) {
            if let Some(Met { place, i, .. }) = best.map(|best| &self.places[best]) {
                let local = f64::from(self.elements.arrays.radii[*i]);
                if place.depth + LEVEL * local >= self.found.most(candidate) {
                    break;
                }
                let i = self.found.point(candidate);
                let is_settled = self.found.is_settled(candidate);
                let most = most_depth(self.elements, self.solid, i, self.found.sign(candidate));
                // It is not deeper than what is found later, either.
                if !is_settled && place.depth >= most {
                    self.found.set_most(candidate, most);
                    continue;
                }
            }
            if let Some(own) = self.place(candidate)
                && best.is_none_or(|best| self.places[best].deeper(&self.places[own]) == Ordering::Less)
            {
                best = Some(own);
            }
        }
        best
    }

    /// Returns the next candidate by its depth. The caller computes its place, or lowers its bound.
    fn next(&mut self, among: Among) -> Option<Candidate> {
        self.tries += 1;
        if self.tries <= SCANS {
            return self.found.first(self.level, among);
        }
        if self.tries == SCANS + 1 {
            self.order.clear();
            self.order.extend(self.found.ordered(among));
        }
        self.order.pop().map(|(_, candidate)| candidate)
    }

    /// Takes the place of a candidate that continues a contact of the last frame: of the same point or,
    /// without that, near the contact.
    fn continue_from(&mut self, (known, point): (&ShapeContact, usize)) {
        let elements = self.elements;
        let continues = |own: &Met| ShapeHint::continues(known, &own.contact(elements), elements.band(own.i));
        if self.count == MOST || self.taken().any(continues) {
            return;
        }
        let at = self.elements.placed.stored_to_world().apply_inverse(known.point);
        let at = single(&at.into());
        let mut tried = [u32::MAX; TRIES];
        for attempt in 0..TRIES {
            let own = if attempt == 0 { self.found.of_point(point) } else { None };
            let own = own.map(|candidate| (0.0, candidate));
            let nearest = own.or_else(|| self.found.nearest(self.level, at, &tried[..attempt]));
            let Some((away_sq, candidate)) = nearest else { return };
            tried[attempt] = id32(self.found.point(candidate));
            // A place is within its disc, whose radius is at most the local radius.
            let band = self.elements.band(tried[attempt] as usize);
            if f64::from(away_sq.sqrt()) * self.elements.scale() > 2.0 * band {
                return;
            }
            if let Some(own) = self.place(candidate)
                && continues(&self.places[own])
                && self.is_free(own)
            {
                self.take(own);
                return;
            }
        }
    }

    /// Takes further contacts, in rounds.
    ///
    /// The first round chooses the disc with the greatest bound of its depth in each other wall, and those of
    /// the last frame. All rounds choose the discs or balls that are furthest from the contacts and from
    /// those already chosen. One more is chosen than there is room for, and one more for each that was
    /// refused before: it has no place, or one that is not apart from the contacts.
    fn spread_out(&mut self, mut hint: Option<&ShapeHint>) {
        let (mut spare, mut other_walls) = (1, OTHER_WALLS);
        while self.count < MOST {
            let before = self.count;
            let wanted = (MOST - before + spare).min(LANES);
            self.chosen.clear();
            self.directions.clear();
            for n in 0..before {
                self.directions.push(single(&self.places[self.taken[n]].place.normal));
            }
            let walls = (other_walls.min(wanted), &mut *self.chosen);
            self.found.choose_walls(self.level, self.directions, walls);
            let walls = self.chosen.len();
            let known = hint.into_iter().flat_map(ShapeHint::contacts_of_points);
            let known = known.filter_map(|(_, point)| self.found.of_point(point)).take(LANES - walls);
            self.chosen.extend(known);
            let fresh = self.chosen.len();
            self.choose_furthest(wanted);
            self.prepare();
            self.accept(0..walls);
            // Others may stand for those that were refused.
            other_walls = walls - (self.count - before);
            for known in hint.take().into_iter().flat_map(ShapeHint::contacts_of_points) {
                self.continue_from(known);
            }
            self.accept(fresh..self.chosen.len());
            if self.chosen.is_empty() {
                return;
            }
            spare += self.chosen.len().saturating_sub(self.count - before);
        }
    }

    /// Chooses up to `wanted` candidates in all, each of which is the furthest from the contacts and from
    /// those already chosen.
    fn choose_furthest(&mut self, wanted: usize) {
        let mut centres = [[0.0; 3]; MOST + LANES];
        let count = self.count + self.chosen.len();
        for (centre, met) in centres.iter_mut().zip(self.taken()) {
            *centre = single(&met.place.point);
        }
        for (centre, &candidate) in centres[self.count..].iter_mut().zip(self.chosen.iter()) {
            *centre = self.found.centre(candidate);
        }
        let wanted = (wanted.saturating_sub(self.chosen.len()), &mut *self.chosen);
        self.found.choose(self.level, &centres[..count], wanted);
    }

    /// Takes the places of some of the chosen candidates that are apart from all contacts.
    fn accept(&mut self, some: Range<usize>) {
        for n in some {
            if let Some(own) = self.found.place(self.chosen[n])
                && self.count < MOST
                && self.is_free(own)
            {
                self.take(own);
            }
        }
    }

    /// Returns `true` if a place is apart from all contacts.
    fn is_free(&self, own: usize) -> bool {
        let Met { place, i, .. } = self.places[own];
        let least = f64::from(SPREAD * self.elements.arrays.radii[i]);
        self.taken().all(|other| (other.place.point - place.point).norm_squared() >= least * least)
    }

    /// Adds a place to the contacts.
    fn take(&mut self, own: usize) {
        self.taken[self.count] = own;
        self.count += 1;
    }
}

impl Met {
    /// The contact in the world.
    fn contact(&self, elements: &Elements<'_>) -> ShapeContact {
        let Place { point, normal, depth } = &self.place;
        ShapeContact {
            point: elements.in_world(point),
            normal: elements.turned(normal),
            depth: depth * elements.scale(),
            id: u64::from(elements.placed.scan().id(self.i).0),
        }
    }

    /// Compares the depths; of equal ones the first point is deeper.
    fn deeper(&self, other: &Self) -> Ordering {
        self.place.depth.total_cmp(&other.place.depth).then(other.i.cmp(&self.i))
    }
}

#[cfg(test)]
mod tests {
    use nearmiss_geometry::{PointCloud, Pose};
    use nearmiss_hierarchy::{BuildOptions, PointHierarchy};
    use nearmiss_testdata::arbitrary::{point_in, rng, rotation, unit_vector};
    use nearmiss_testdata::dragon::{Dragon, dragon_mesh};
    use rand::RngExt;

    use super::*;
    use crate::ask::options::CollideOptions;
    use crate::leaf::disc_triangle::FlatDisc;
    use crate::pair::placed::Placed;
    use crate::solid::plan::ShapePlan;
    use crate::solid::shape::Shape;

    /// The places of all discs and balls, before and behind the surface.
    fn all_places(elements: &Elements<'_>, solid: &Solid<'_>) -> [Vec<Met>; 2] {
        let sides = Sides::new(elements, solid.inside, None);
        let mut all = [Vec::new(), Vec::new()];
        for i in 0..elements.placed.scan().len() {
            let (normal, radius) = (elements.normal(i), f64::from(elements.arrays.discs.get(i)));
            let disc = FlatDisc { centre: elements.position(i), normal, radius };
            let (sign, is_behind) =
                if elements.is_disc(i) { sides.of(&disc, elements.band(i)) } else { (1.0, false) };
            if let Some(place) = place_at(elements, solid, i, sign) {
                all[usize::from(is_behind)].push(Met { place, i, is_past_end: false });
            }
        }
        all
    }

    #[test]
    fn contacts_are_places_far_from_each_other() {
        let mesh = dragon_mesh(Dragon::Points5k).unwrap();
        // A strip of random width, whose borders are not straight.
        let rng = &mut rng(5);
        let strip: Vec<[f64; 3]> = (0..2000)
            .map(|_| {
                let [x, y] = [rng.random_range(0.0..4.0_f64), rng.random_range(-0.5..0.5)];
                [x, y * (0.2 + (3.0 * x).sin().powi(2)), 0.0]
            })
            .collect();
        for (name, points, full) in [("dragon", mesh.vertices(), 600), ("strip", &strip, 100)] {
            let found = compare_with_all_places(name, points);
            assert!(found > full, "{found} full manifolds of {name}");
        }
    }

    /// Compares manifolds on a scan of `points` with all places. Returns the number of full ones.
    fn compare_with_all_places(name: &str, points: &[[f64; 3]]) -> usize {
        let cloud = PointCloud::from_positions(points).unwrap();
        let scan = PointHierarchy::build(&cloud, &BuildOptions::default()).unwrap();
        let r = scan.sampling_radius();
        let rng = &mut rng(77);
        let (mut full, mut past, mut spread) = (0, 0, Vec::new());
        for round in 0..1200 {
            let options = CollideOptions::estimated().with_detail(Detail::Verdict);
            let options = options.with_margin([0.0, 0.3 * r][round % 2]);
            let plan = ShapePlan::new(&options, &scan).unwrap();
            let pose = if round % 3 == 0 { rotation(rng).with_scale(3.0) } else { Pose::IDENTITY };
            let elements = Elements::new(Placed::new(&scan, &pose), &plan);
            let size = r * pose.scale();
            let i = rng.random_range(0..scan.len());
            let at = pose.apply(scan.arrays().position(i).map(f64::from));
            let (off, along) = (point_in(rng, 1.5 * size), unit_vector(rng));
            let centre = [0, 1, 2].map(|k| at[k] + off[k]);
            let end = [0, 1, 2].map(|k| centre[k] + 4.0 * size * along[k]);
            let half = [2.0, 1.0, 0.5].map(|h| h * size);
            let body = rotation(rng).with_translation(centre);
            let shape = match round % 5 {
                0 => Shape::Sphere { centre, radius: [1.0, 0.0, 0.3][round % 3] * size },
                1 => Shape::Capsule { ends: [centre, end], radius: 0.7 * size },
                2 => Shape::Box { pose: body, half, radius: 0.0 },
                3 => Shape::Box { pose: body, half, radius: 0.4 * size },
                _ => Shape::Cylinder { pose: body, half_height: size, radius: size, rounding: 0.0 },
            };
            let solid = Solid::new(&shape, elements.placed.stored_to_world()).unwrap();
            let (mut out, mut candidates) = (Vec::new(), Candidates::default());
            let working = (Level::new(), &mut ViewScratch::default(), &mut candidates);
            contacts(&elements, Some(&solid), None, &mut out, working);
            let [mut front, mut behind] = all_places(&elements, &solid);
            for met in candidates.places.iter().filter(|met| met.is_past_end) {
                front.retain(|other| other.i != met.i);
                behind.retain(|other| other.i != met.i);
                front.push(*met);
                past += 1;
            }
            // Leaves are searched for discs without their thickness at the rim, so others may be missed.
            let is_near = |met: &&Met| {
                let gap = elements.element(met.i).gap(&solid, elements.margin).0;
                gap.distance <= solid.radius + elements.margin
            };
            let all = if front.iter().any(|met| is_near(&met)) { front } else { [front, behind].concat() };
            let near: Vec<Met> = all.iter().filter(is_near).copied().collect();
            if near.is_empty() {
                assert!(out.len() <= all.len().max(1), "{name}, round {round}: {out:?}");
                continue;
            }
            let deepest = near.iter().max_by(|a, b| a.deeper(b)).unwrap();
            let band = all
                .iter()
                .find(|met| met.contact(&elements).id == out[0].id)
                .map_or(0.0, |met| elements.band(met.i));
            let least = deepest.contact(&elements).depth - LEVEL * band;
            assert!(out[0].depth >= least, "{name}, round {round}: {:?}, deepest {deepest:?}", out[0]);
            let ids: Vec<u64> = all.iter().map(|met| met.contact(&elements).id).collect();
            let own = |contact: &ShapeContact| {
                let n = ids.iter().position(|&id| id == contact.id);
                let n = n.unwrap_or_else(|| panic!("{name}, round {round}: {contact:?} is no place"));
                assert_eq!(all[n].contact(&elements), *contact, "{name}, round {round}");
                all[n]
            };
            let taken: Vec<Met> = out.iter().map(own).collect();
            let free = Free { elements: &elements, near: &near };
            let close = too_close(&elements, &taken);
            assert!(close.is_none(), "{name}, round {round}: {close:?} is too near another contact");
            if taken.len() < MOST {
                let left = free.next(&taken);
                assert!(left.is_none(), "{name}, round {round}: room for {left:?}");
            }
            spread.push([free.gap(&taken), free.gap(&free.one_by_one(taken[0]))]);
            full += usize::from(out.len() == MOST);
        }
        assert!(past > 100, "{past} places past ends of {name}");
        // A round that chooses by centres leaves about the gaps that one by one leaves.
        let [rounds, one_by_one] = [0, 1].map(|k| spread.iter().map(|gaps| gaps[k]).sum::<f64>());
        assert!(rounds <= 1.02 * one_by_one, "{name}: gaps of {rounds}, one by one {one_by_one}");
        full
    }

    /// A contact that is not apart from one before, if there is one.
    fn too_close(elements: &Elements<'_>, taken: &[Met]) -> Option<Met> {
        let is_close = |&n: &usize| {
            let least = f64::from(SPREAD * elements.arrays.radii[taken[n].i]) * (1.0 - 1e-9);
            taken[..n].iter().any(|it| (it.place.point - taken[n].place.point).norm() < least)
        };
        (0..taken.len()).find(is_close).map(|n| taken[n])
    }

    /// Places among which contacts are selected.
    struct Free<'s, 'a> {
        elements: &'s Elements<'a>,
        near: &'s [Met],
    }

    impl Free<'_, '_> {
        /// The place whose disc or ball is furthest, of those that are apart from all contacts.
        fn next(&self, taken: &[Met]) -> Option<Met> {
            let apart = |met: &Met| {
                let centre = self.elements.position(met.i);
                let away =
                    |x: Vector| taken.iter().map(|it| (x - it.place.point).norm()).fold(f64::MAX, f64::min);
                let least = f64::from(SPREAD * self.elements.arrays.radii[met.i]) * (1.0 + 1e-4);
                let [away, of_centre] = [away(met.place.point), away(centre)];
                (away.min(of_centre) > least).then_some((of_centre, *met))
            };
            self.near.iter().filter_map(apart).max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, met)| met)
        }

        /// The contacts that are selected one by one.
        fn one_by_one(&self, deepest: Met) -> Vec<Met> {
            let mut taken = vec![deepest];
            while taken.len() < MOST {
                let Some(next) = self.next(&taken) else { break };
                taken.push(next);
            }
            taken
        }

        /// The greatest distance of a place from the nearest contact.
        fn gap(&self, taken: &[Met]) -> f64 {
            let away = |met: &Met| {
                taken.iter().map(|it| (met.place.point - it.place.point).norm()).fold(f64::MAX, f64::min)
            };
            self.near.iter().map(away).fold(0.0, f64::max)
        }
    }
}
