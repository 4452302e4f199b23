//! The search for a short shift that separates two things.

use std::ops::ControlFlow;

use crate::penetration::cover::{Cover, ENOUGH, WayOut, cover};
use crate::penetration::deepest::climb;
use crate::penetration::probe::{Deep, Probe, Vector};
use crate::penetration::survey::{ContactSurvey, KEPT, Surveyed};

/// Bounds of the least shift that separates two things.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bounds {
    /// A lower bound of its length.
    pub(crate) lower: f64,
    /// A shift that separates them.
    pub(crate) shift: Vector,
    /// `true` if the search ended by itself.
    pub(crate) complete: bool,
}

/// Reusable memory of a search.
#[derive(Debug, Clone, Default)]
pub(crate) struct SearchScratch {
    contacts: ContactSurvey,
    cover: Cover,
}

/// Bounds the least shift that separates two things. `out` is any shift that does.
pub(crate) fn search<P: Probe>(
    probe: &mut P,
    out: Vector,
    SearchScratch { contacts, cover }: &mut SearchScratch,
) -> Bounds {
    let mut search = Search { probe, contacts, cover, best: Shift::new(out), lower: 0.0, deepest: None };
    let flow = match search.probe.is_apart(Vector::zeros()) {
        ControlFlow::Continue(true) => {
            return Bounds { lower: 0.0, shift: Vector::zeros(), complete: true };
        }
        ControlFlow::Continue(false) => search.narrow(),
        ControlFlow::Break(()) => ControlFlow::Break(()),
    };
    let Search { probe, best, mut lower, contacts, .. } = search;
    let excess = lower - best.length;
    if excess > probe.slack() {
        // A deep place that contradicts the shift by so much is outside one of the things.
        lower = contacts.least;
    } else if excess > best.length * FINE {
        // Holes between discs explain it.
        lower = (best.length - excess).max(contacts.least);
    }
    Bounds { lower: lower.min(best.length), shift: best.vector(), complete: flow.is_continue() }
}

/// A shift that was found to separate the things.
#[derive(Debug, Clone, Copy)]
struct Shift {
    /// A unit vector.
    way: Vector,
    length: f64,
    /// A shorter length at which the solids were found to meet.
    meets: f64,
}

impl Shift {
    /// The shift by `t`.
    fn new(t: Vector) -> Self {
        Self { way: t.try_normalize(0.0).unwrap_or_else(Vector::x), length: t.norm(), meets: 0.0 }
    }

    /// Returns the shift as a vector.
    fn vector(&self) -> Vector {
        self.way * self.length
    }
}

/// A shift is replaced by one that is shorter by at least this share.
const GAIN: f64 = 1.0 / 64.0;

/// The relative error of the length of the final shift along its direction.
const FINE: f64 = 1e-6;

/// The number of directions that are tried first: of the contacts, of their normals, of the boxes.
const DIRECTIONS: usize = 3 + 2 * KEPT + 7;

/// The share of the upper bound that the lower one has to reach, however short it is.
const SHARE: f64 = 0.6;

/// Shifts along the normal of a contact that are tried, in its depth.
const LONGER: [f64; 3] = [1.0 + GAIN, 1.06, 1.15];

/// Rounds of each refinement.
const ROUNDS: usize = 8;

/// Sets of directions around the best one that are tried in a row.
const TURNS: usize = 32;

/// Shares of the way back from the last contact at which a place inside both solids is looked for. The
/// middle is best for a shallow overlap. A small solid deep inside another one is near an end.
const WAYS_BACK: [f64; 5] = [0.5, 0.9, 0.1, 0.98, 0.02];

/// The number of those places, and of others.
const STARTS: usize = 3 * WAYS_BACK.len() + 1 + KEPT;

/// The number of places from which deeper ones are looked for.
const CLIMBS: usize = 2;

/// A search, and its results so far, which hold whenever it is ended.
struct Search<'p, P> {
    probe: &'p mut P,
    contacts: &'p mut ContactSurvey,
    cover: &'p mut Cover,
    /// The best shift so far.
    best: Shift,
    /// The greatest lower bound so far.
    lower: f64,
    /// The deepest place so far.
    deepest: Option<Deep>,
}

impl<P: Probe> Search<'_, P> {
    /// Shortens the shift and raises the lower bound of things that meet. Breaks if the budget ends.
    fn narrow(&mut self) -> ControlFlow<()> {
        self.probe.survey(self.contacts)?;
        self.lower = self.lower.max(self.contacts.least - self.probe.rounding());
        self.leave_contacts()?;
        self.try_directions()?;
        self.raise()?;
        self.look_across()?;
        for _ in 0..ROUNDS {
            let before = self.best.length;
            self.follow_contacts()?;
            self.turn()?;
            if self.best.length > before * (1.0 - GAIN) {
                break;
            }
        }
        self.bisect(FINE)?;
        self.settle()?;
        self.lengthen()?;
        self.raise()?;
        self.look_across()?;
        let enough = ENOUGH * self.enough();
        let Some(deepest) = self.deepest.filter(|_| self.lower < enough) else {
            return ControlFlow::Continue(());
        };
        let shift = self.best.way * self.best.meets;
        let last = self.probe.touch(shift)?.map(|(place, _)| (shift, place));
        let out = WayOut { apart: self.best.vector(), last };
        cover(self.probe, (&deepest, &out), enough, (self.cover, &mut self.lower))
    }

    /// Lengthens the shift a little if a longer one, by rounding, does not separate the things.
    fn lengthen(&mut self) -> ControlFlow<()> {
        let start = self.best.length;
        let (mut length, mut was_apart, mut more) = (start, true, FINE);
        for _ in 0..ROUNDS {
            let longer = start * (1.0 + more);
            let is_apart = self.probe.is_apart(self.best.way * longer)?;
            if is_apart && was_apart {
                self.best.length = length;
                break;
            }
            (length, was_apart) = (longer, is_apart);
            more *= 2.0;
        }
        ControlFlow::Continue(())
    }

    /// Projects the best shift onto the directions that separate the last contacts, for gains that the
    /// other steps do not look for.
    fn settle(&mut self) -> ControlFlow<()> {
        for _ in 0..ROUNDS {
            let Some((_, way)) = self.probe.touch(self.best.way * self.best.meets)? else { break };
            let reach = way.dot(&self.best.vector());
            let length = reach * (1.0 + FINE);
            if reach <= 0.0 || length >= self.best.length || !self.probe.is_apart(way * length)? {
                break;
            }
            self.best = Shift { way, length, meets: reach * (1.0 - FINE) };
        }
        ControlFlow::Continue(())
    }

    /// Tries shifts that are a little longer than a contact is deep. A longer one along the same normal may
    /// lead into another part of a hollow thing.
    fn leave_contacts(&mut self) -> ControlFlow<()> {
        for i in 0..self.contacts.some.len() {
            let Surveyed { normals: [normal, _], depths, .. } = self.contacts.some[i];
            for (way, depth) in [normal, -normal].into_iter().zip(depths) {
                for length in LONGER.map(|longer| longer * depth) {
                    let is_shorter = length > 0.0 && length < self.best.length * (1.0 - GAIN);
                    if is_shorter && self.probe.is_apart(way * length)? {
                        self.best = Shift { way, length, meets: 0.0 };
                        self.bisect(GAIN)?;
                        break;
                    }
                }
            }
        }
        ControlFlow::Continue(())
    }

    /// Tries the axes of all contacts, their normals, and the axes of the boxes, in both directions.
    fn try_directions(&mut self) -> ControlFlow<()> {
        let mut ways = [Vector::zeros(); DIRECTIONS];
        // The contacts of a small overlap surround it; the axis of their ring crosses it.
        let axes = if self.contacts.count > 0 { self.contacts.axes() } else { [Vector::zeros(); 3] };
        let found = axes.into_iter().chain(self.contacts.some.iter().flat_map(|contact| contact.normals));
        let ([a, b], boxes) = (self.probe.centres(), self.probe.axes());
        for (way, found) in ways.iter_mut().zip(found.chain([b - a]).chain(boxes.into_iter().flatten())) {
            *way = found;
        }
        for way in ways.into_iter().filter_map(|way| way.try_normalize(1e-9)) {
            self.along(way, 0.0)?;
            self.along(-way, 0.0)?;
        }
        ControlFlow::Continue(())
    }

    /// Tries shifts along `way` of more than `from`, each twice as long as the one before.
    fn along(&mut self, way: Vector, from: f64) -> ControlFlow<()> {
        let most = self.best.length * (1.0 - GAIN);
        let (mut meets, mut length) = (from, from.max(self.best.length / 256.0));
        // The least numbers have no half.
        while meets < most && length > 0.0 {
            length = length.min(most);
            if self.probe.is_apart(way * length)? {
                self.best = Shift { way, length, meets };
                return self.bisect(GAIN);
            }
            (meets, length) = (length, 2.0 * length);
        }
        ControlFlow::Continue(())
    }

    /// Shortens the best shift along its direction, up to a relative error or the rounding of coordinates.
    fn bisect(&mut self, relative: f64) -> ControlFlow<()> {
        let rounding = self.probe.rounding().max(f64::MIN_POSITIVE);
        while self.best.length - self.best.meets > (relative * self.best.length).max(rounding) {
            let middle = 0.5 * (self.best.length + self.best.meets);
            if self.probe.is_apart(self.best.way * middle)? {
                self.best.length = middle;
            } else {
                self.best.meets = middle;
            }
        }
        ControlFlow::Continue(())
    }

    /// Turns the best shift towards the direction that separates the triangles that keep it from
    /// being shorter.
    fn follow_contacts(&mut self) -> ControlFlow<()> {
        for _ in 0..ROUNDS {
            let before = self.best.length;
            let Some((_, way)) = self.probe.touch(self.best.way * self.best.meets)? else { break };
            // As far along it as the best shift reaches, or less.
            let reach = way.dot(&self.best.vector());
            if reach <= 0.0 || reach >= before * (1.0 - GAIN) {
                break;
            }
            self.along(way, reach * (1.0 - GAIN))?;
            if self.best.length > before * (1.0 - GAIN) {
                break;
            }
        }
        ControlFlow::Continue(())
    }

    /// Tries directions around the best one, at smaller and smaller angles.
    fn turn(&mut self) -> ControlFlow<()> {
        let mut angle = 0.4;
        for _ in 0..TURNS {
            if angle < 0.02 {
                break;
            }
            let (way, before) = (self.best.way, self.best.length);
            let across = way.cross(&if way.x.abs() < 0.6 { Vector::x() } else { Vector::y() }).normalize();
            let other = way.cross(&across);
            for k in 0..6_u8 {
                let (sin, cos) = (std::f64::consts::FRAC_PI_3 * f64::from(k)).sin_cos();
                let turned = (way + (across * cos + other * sin) * angle).normalize();
                let length = before * (1.0 - 0.25 * angle * angle).min(1.0 - 0.25 * GAIN);
                if self.probe.is_apart(turned * length)? {
                    self.best = Shift { way: turned, length, meets: 0.0 };
                    self.bisect(0.25 * GAIN)?;
                    break;
                }
            }
            if self.best.length >= before {
                angle *= 0.5;
            }
        }
        ControlFlow::Continue(())
    }

    /// Raises the lower bound, from places on both sides of a surface.
    fn look_across(&mut self) -> ControlFlow<()> {
        if self.lower < ENOUGH * self.enough() {
            let across = self.probe.across(self.best.way, self.contacts)?;
            self.lower = self.lower.max(across - self.probe.rounding());
        }
        ControlFlow::Continue(())
    }

    /// A lower bound that need not be raised.
    fn enough(&self) -> f64 {
        let length = self.best.length;
        (length * (1.0 - 2.0 * FINE)).min((length - self.probe.slack()).max(length * SHARE))
    }

    /// Raises the lower bound, from the deepest of some places.
    fn raise(&mut self) -> ControlFlow<()> {
        let enough = self.enough();
        if self.lower >= enough {
            return ControlFlow::Continue(());
        }
        let mut deepest: [Option<Deep>; CLIMBS] = [None; CLIMBS];
        let (starts, count) = self.starts()?;
        for &start in &starts[..count] {
            let Some(mut found) = self.probe.deep(start, Vector::zeros())? else { continue };
            for kept in &mut deepest {
                match kept {
                    Some(kept) if kept.depth >= found.depth => {}
                    Some(kept) => std::mem::swap(kept, &mut found),
                    None => {
                        *kept = Some(found);
                        break;
                    }
                }
            }
        }
        let step = 0.125 * self.best.length;
        for start in deepest.into_iter().flatten() {
            let found = climb(self.probe, start, step, enough, &mut self.lower)?;
            if self.deepest.is_none_or(|deepest| deepest.depth < found.depth) {
                self.deepest = Some(found);
            }
        }
        ControlFlow::Continue(())
    }

    /// Places that may be inside both things: where they last touch on the way out, and part of the way back,
    /// and the centre of the contacts and some of them.
    fn starts(&mut self) -> ControlFlow<(), ([Vector; STARTS], usize)> {
        let (mut starts, mut count) = ([Vector::zeros(); STARTS], 0);
        let mut add = |start: Vector| {
            starts[count] = start;
            count += 1;
        };
        if let Some((place, _)) = self.probe.touch(self.best.way * self.best.meets)? {
            // The contact may be at a corner; places towards the centres are within.
            let centres = self.probe.centres();
            for share in WAYS_BACK {
                let start = place - self.best.way * (share * self.best.meets);
                for to in [start, centres[0], centres[1]] {
                    add(start + (to - start) * 0.1);
                }
            }
        }
        if self.contacts.count > 0 {
            add(self.contacts.centre());
            self.contacts.some.iter().for_each(|contact| add(contact.point));
        }
        ControlFlow::Continue((starts, count))
    }
}
