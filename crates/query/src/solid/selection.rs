//! The selection of contacts among candidates.
//!
//! The deepest is selected first, then the deepest of other walls, then those that continue contacts of the
//! last frame, then those whose discs or balls are furthest from all before. A shape may touch hundreds of
//! discs, so a place is computed only where the selection depends on it: the bounds of
//! [`gather`](crate::solid::gather) tell where the deepest may be.

use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::ops::Range;

use fearless_simd::Level;
use nearmiss_lanes::id32;

use crate::solid::answer::ShapeContact;
use crate::solid::candidates::{Among, Candidate, CandidateBlocks, single};
use crate::solid::core::Solid;
use crate::solid::elements::Elements;
use crate::solid::gather::SPREAD;
use crate::solid::hint::{MOST, ShapeHint};
use crate::solid::place::{Place, from_behind, most_depth, place_at, place_beside};
use crate::solid::places::{LANES, places_at};
use crate::solid::sides::Sides;

/// Another contact may be this much deeper than the first, in local radii.
pub(crate) const LEVEL: f64 = 0.01;

/// Candidates that are looked for one by one, before all others are ordered.
const SCANS: u32 = 8;

/// Further walls that have a contact where they are deepest.
const OTHER_WALLS: usize = 3;

/// Candidates that are compared with a contact of the last frame.
const TRIES: usize = 3;

/// A place, and the index of its point.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Met {
    pub(crate) place: Place,
    pub(crate) i: usize,
    /// `true` if the shape moves out past the end of the sheet.
    pub(crate) is_past_end: bool,
}

/// Reusable memory of a selection.
#[derive(Debug, Clone, Default)]
pub(crate) struct Selected {
    /// The places that are known.
    pub(crate) places: Vec<Met>,
    /// Candidates whose places are computed at once.
    chosen: Vec<Candidate>,
    /// The normals of the walls that have contacts, or candidates that are chosen.
    directions: Vec<[f32; 3]>,
    /// The candidates by depth, once so many have been tried.
    order: BinaryHeap<(u64, Candidate)>,
}

/// The selection of contacts among candidates.
pub(crate) struct Selection<'s, 'a> {
    elements: &'s Elements<'a>,
    solid: &'s Solid<'s>,
    sides: &'s Sides,
    level: Level,
    found: &'s mut CandidateBlocks,
    scratch: &'s mut Selected,
    /// The number of candidates that have been tried by their depth.
    tries: u32,
    /// The numbers of the places that are contacts.
    taken: [usize; MOST],
    count: usize,
}

impl<'s, 'a> Selection<'s, 'a> {
    pub(crate) fn new(
        (elements, solid, sides): (&'s Elements<'a>, &'s Solid<'s>, &'s Sides),
        level: Level,
        found: &'s mut CandidateBlocks,
        scratch: &'s mut Selected,
    ) -> Self {
        Self { elements, solid, sides, level, found, scratch, tries: 0, taken: [0; MOST], count: 0 }
    }

    /// Selects the contacts.
    pub(crate) fn run(&mut self, hint: Option<&ShapeHint>) {
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
                if let Some(candidate) = self.found.of_point(self.scratch.places[number].i) {
                    self.found.remove(candidate);
                }
                self.spread_out(hint);
            }
        }
    }

    /// Takes the deepest contact of a shape that is only beside discs: no candidate has a place.
    fn take_beside(&mut self) {
        let places = self.found.missed().filter_map(|it| {
            let i = self.found.point(it);
            let own = (i, self.found.sign(it), self.sides.are_open(self.elements, i));
            let place = place_beside(self.elements, self.solid, own)?;
            Some(Met { place, i, is_past_end: false })
        });
        if let Some(deepest) = places.max_by(Met::deeper) {
            self.scratch.places.push(deepest);
            self.take(self.scratch.places.len() - 1);
        }
    }

    /// The contacts so far.
    pub(crate) fn taken(&self) -> impl Iterator<Item = &Met> {
        self.taken[..self.count].iter().map(|&number| &self.scratch.places[number])
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
        for &candidate in self.scratch.chosen.iter() {
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

    /// Keeps the place of a candidate, and returns its number. Removes the candidate if it has none, or if
    /// the shape is behind its disc.
    fn keep(&mut self, candidate: Candidate, place: Option<Place>) -> Option<usize> {
        let (i, sign) = (self.found.point(candidate), self.found.sign(candidate));
        let other = place
            .filter(|_| self.sides.are_open(self.elements, i))
            .and_then(|place| from_behind(self.elements, self.solid, (i, sign), &place));
        let Some(place) = other.unwrap_or(place) else {
            self.found.miss(candidate);
            return None;
        };
        let number = self.scratch.places.len();
        self.scratch.places.push(Met { place, i, is_past_end: false });
        if other.is_some() {
            // Beside contacts that push the other way it would hold the shape.
            self.found.remove(candidate);
        } else {
            self.found.set_place(candidate, number);
        }
        Some(number)
    }

    /// Returns the number of the deepest place, up to [`LEVEL`], of some candidates. Computes places as long
    /// as another one may be deeper.
    fn deepest(&mut self, among: Among) -> Option<usize> {
        let mut best: Option<usize> = None;
        self.tries = 0;
        while let Some(candidate) = self.next(among) {
            if let Some(Met { place, i, .. }) = best.map(|best| &self.scratch.places[best]) {
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
                && best.is_none_or(|best| {
                    self.scratch.places[best].deeper(&self.scratch.places[own]) == Ordering::Less
                })
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
            self.scratch.order.clear();
            self.scratch.order.extend(self.found.ordered(among));
        }
        self.scratch.order.pop().map(|(_, candidate)| candidate)
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
                && self.found.place(candidate).is_some()
                && continues(&self.scratch.places[own])
                && self.is_free(own)
            {
                self.take(own);
                self.found.remove(candidate);
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
            self.scratch.chosen.clear();
            self.scratch.directions.clear();
            for n in 0..before {
                self.scratch.directions.push(single(&self.scratch.places[self.taken[n]].place.normal));
            }
            let walls = (other_walls.min(wanted), &mut self.scratch.chosen);
            self.found.choose_walls(self.level, &mut self.scratch.directions, walls);
            let walls = self.scratch.chosen.len();
            let known = hint.into_iter().flat_map(ShapeHint::contacts_of_points);
            let known = known.filter_map(|(_, point)| self.found.of_point(point)).take(LANES - walls);
            self.scratch.chosen.extend(known);
            let fresh = self.scratch.chosen.len();
            self.choose_furthest(wanted);
            self.prepare();
            self.accept(0..walls);
            // Others may stand for those that were refused.
            other_walls = walls - (self.count - before);
            for known in hint.take().into_iter().flat_map(ShapeHint::contacts_of_points) {
                self.continue_from(known);
            }
            self.accept(fresh..self.scratch.chosen.len());
            if self.scratch.chosen.is_empty() {
                return;
            }
            spare += self.scratch.chosen.len().saturating_sub(self.count - before);
        }
    }

    /// Chooses up to `wanted` candidates in all, each of which is the furthest from the contacts and from
    /// those already chosen.
    fn choose_furthest(&mut self, wanted: usize) {
        let mut centres = [[0.0; 3]; MOST + LANES];
        let count = self.count + self.scratch.chosen.len();
        for (centre, met) in centres.iter_mut().zip(self.taken()) {
            *centre = single(&met.place.point);
        }
        for (centre, &candidate) in centres[self.count..].iter_mut().zip(self.scratch.chosen.iter()) {
            *centre = self.found.centre(candidate);
        }
        let wanted = (wanted.saturating_sub(self.scratch.chosen.len()), &mut self.scratch.chosen);
        self.found.choose(self.level, &centres[..count], wanted);
    }

    /// Takes the places of some of the chosen candidates that are apart from all contacts.
    fn accept(&mut self, some: Range<usize>) {
        for n in some {
            if let Some(own) = self.found.place(self.scratch.chosen[n])
                && self.count < MOST
                && self.is_free(own)
            {
                self.take(own);
            }
        }
    }

    /// Returns `true` if a place is apart from all contacts.
    fn is_free(&self, own: usize) -> bool {
        let Met { place, i, .. } = self.scratch.places[own];
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
    pub(crate) fn contact(&self, elements: &Elements<'_>) -> ShapeContact {
        let Place { point, normal, depth } = &self.place;
        ShapeContact {
            point: elements.in_world(point),
            normal: elements.turned(normal),
            depth: depth * elements.scale(),
            id: u64::from(elements.placed.scan().id(self.i).0),
        }
    }

    /// Compares the depths; of equal ones the first point is deeper.
    pub(crate) fn deeper(&self, other: &Self) -> Ordering {
        self.place.depth.total_cmp(&other.place.depth).then(other.i.cmp(&self.i))
    }
}
