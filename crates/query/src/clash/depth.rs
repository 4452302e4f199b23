//! The depths of hard clashes.

use nearmiss_geometry::Aabb;
use nearmiss_hierarchy::PointHierarchy;
use nearmiss_lanes::id32;
use nearmiss_lanes::parallel::map_with;
use nearmiss_surface::Metric;

use crate::ask::answer::Contact;
use crate::ask::options::CollidePlan;
use crate::clash::components::components;
use crate::clash::group::ContactGroup;
use crate::clash::stored::stored;
use crate::clash::{LINK, default_link};
use crate::pair::placed::Placed;
use crate::penetration::answer::{Interior, Penetration};
use crate::penetration::scans::{Piece, of_pieces};
use crate::question::{Pair, Scratch};

/// The maximum number of points around a clash. With more, the whole scan takes the place of its part.
const MOST_POINTS: usize = 200_000;

/// The first part extends beyond the contacts by this share of their diagonal.
const FIRST: f64 = 0.25;

/// A part is large enough if it extends this many times as far beyond the contacts as the scans are shifted.
const ROOM: f64 = 2.0;

/// A depth above this share of the penetration of the whole scans is replaced by it.
const NEARLY: f64 = 0.98;

/// The clashes between two reports of the progress.
const TOLD: usize = 64;

impl Pair<'_> {
    /// Bounds, for each of some groups of contacts, how far b must at least be shifted so that the surfaces
    /// that meet at these contacts are separate there.
    ///
    /// Let B be the bounding box of the contacts of a group, grown by a length m to every side. The *part*
    /// of a scan is what of it is in B and linked to these contacts, by steps of at most four sampling
    /// radii from point to point. Of a [solid](Interior::Solid) scan it is everything in B, as all of its
    /// surface bounds its inside. The depth is the penetration of both parts for the smallest tried m that
    /// is at least twice its upper bound: then nothing from outside B comes within m/2 of the contacts.
    /// After the shift the parts are separate, and the part of one scan is not inside the other scan if
    /// that is solid. They may meet other pieces of a hollow scan.
    ///
    /// `contacts` are all contacts of the pair, and `whole` is the [penetration](Self::penetration) of the
    /// pair with the same plan and insides. The upper bound is never greater than that of `whole`, whose
    /// shift separates all groups at once. It is also the upper bound for a clash through which a
    /// scan passes, for scans of the geodesic metric, whose parts are not known, and if the budget ends the
    /// search too early.
    ///
    /// Parts are prepared as scans of their own, so a depth costs about a microsecond for each point around
    /// the clash, and some hundred collision queries. A scan with more than 200,000 points in a ball about
    /// B is used as a whole. Groups are shared among all threads; each query may spend the whole budget.
    /// Passes the share of the groups that are done to `told`, again and again. Indices of groups that are
    /// out of range are ignored. Allocates. Deterministic unless the budget has a deadline.
    #[must_use]
    pub fn depths(
        &self,
        (contacts, groups): (&[Contact], &[&ContactGroup]),
        (plan, interiors): (&CollidePlan, [Interior; 2]),
        whole: &Penetration,
        told: &mut dyn FnMut(f64),
    ) -> Vec<Penetration> {
        let stored = stored(self.scans().each_ref(), contacts);
        let depths = Depths { pair: self, stored, plan, interiors, whole: *whole };
        let mut found = Vec::with_capacity(groups.len());
        for some in groups.chunks(TOLD) {
            found.extend(map_with(some.len(), Scratch::default, |scratch, i| depths.of(some[i], scratch)));
            #[expect(clippy::cast_precision_loss, reason = "a share")]
            told(found.len() as f64 / groups.len() as f64);
        }
        found
    }
}

/// The data that the depths of all groups have in common.
struct Depths<'d, 'a> {
    pair: &'d Pair<'a>,
    /// The stored points of all contacts.
    stored: Vec<[usize; 2]>,
    plan: &'d CollidePlan,
    interiors: [Interior; 2],
    /// The penetration of the whole scans.
    whole: Penetration,
}

impl Depths<'_, '_> {
    fn of(&self, group: &ContactGroup, scratch: &mut Scratch) -> Penetration {
        let scans = self.pair.scans().each_ref();
        let most = ROOM * self.whole.upper;
        let mut room = (FIRST * group.diagonal()).max(0.5 * default_link(scans)).max(self.plan.reach());
        // The shift of the whole scans frees this clash too. Their lower bound holds for all clashes
        // together.
        let is_only_one = group.contacts.len() == self.stored.len();
        let lower = if is_only_one { self.whole.lower } else { 0.0 };
        let mut answer = Penetration { lower, ..self.whole };
        if !most.is_finite() || self.plan.options().metric == Some(Metric::Geodesic) {
            return answer;
        }
        while self.pair.budget.go_on(0).is_continue() {
            room = room.min(most);
            let [a, b] = [0, 1].map(|k| self.part(k, group, room));
            if matches!([&a, &b], [Part::Whole, Part::Whole]) {
                break;
            }
            if let (Some(a), Some(b)) = (a.of(scans[0]), b.of(scans[1])) {
                let found = self.of_parts([a, b], scratch);
                answer.lower = answer.lower.max(found.lower).min(answer.upper);
                if found.upper <= self.whole.upper * NEARLY && ROOM * found.upper <= room {
                    return found;
                }
                if found.upper > self.whole.upper * NEARLY || !found.complete {
                    break;
                }
                // A greater part needs a shift that is at least about as long.
                room = room.max(0.5 * ROOM * found.upper);
            }
            if room >= most {
                break;
            }
            room *= 2.0;
        }
        answer
    }

    /// The part of scan `k` around some contacts, in their bounding box, grown by `room` to every side.
    fn part(&self, k: usize, group: &ContactGroup, room: f64) -> Part {
        let scan = &self.pair.scans()[k];
        let (stored, frame) = (scan.scan(), scan.stored_to_world());
        let Aabb { min, max } = group.bounds;
        let grown = Aabb { min: min.map(|c| c - room), max: max.map(|c| c + room) };
        let radius = grown.half_extents().into_iter().fold(0.0, f64::hypot) / frame.scale();
        let centre = frame.apply_inverse(grown.centre());
        let Some(mut points) = stored.points_in_ball(centre, radius, MOST_POINTS) else { return Part::Whole };
        points.retain(|&i| grown.contains(scan.point(i as usize)));
        if self.interiors[k] == Interior::Hollow {
            self.keep_linked(k, group, &mut points);
        }
        stored.part(&points).map_or(Part::None, |part| Part::Own(Box::new(part)))
    }

    /// Keeps the points of scan `k`, in ascending order, that are linked to the contacts.
    fn keep_linked(&self, k: usize, group: &ContactGroup, points: &mut Vec<u32>) {
        let scan = &self.pair.scans()[k];
        let places: Vec<[f64; 3]> = points.iter().map(|&i| scan.point(i as usize)).collect();
        let numbers = components(&places, LINK * scan.sampling_radius());
        let mut is_linked = vec![false; points.len()];
        for stored in group.contacts.iter().filter_map(|&i| self.stored.get(i)) {
            if let Ok(at) = points.binary_search(&id32(stored[k])) {
                is_linked[numbers[at]] = true;
            }
        }
        let mut numbers = numbers.into_iter();
        points.retain(|_| numbers.next().is_some_and(|number| is_linked[number]));
    }

    fn of_parts(&self, parts: [Placed<'_>; 2], scratch: &mut Scratch) -> Penetration {
        let Scratch { contact, solid, penetration: own, .. } = scratch;
        let [a, b] = [0, 1].map(|k: usize| Piece { part: parts[k], whole: self.pair.scans()[k] });
        let working = (contact, &mut solid.crossings);
        of_pieces([a, b], (self.plan, self.interiors), &self.pair.budget, working, own)
    }
}

/// A part of a scan.
enum Part {
    /// The scan itself.
    Whole,
    Own(Box<PointHierarchy>),
    /// Too few points for a scan.
    None,
}

impl Part {
    /// The part, placed as its scan is.
    fn of<'p>(&'p self, scan: &Placed<'p>) -> Option<Placed<'p>> {
        match self {
            Self::Whole => Some(*scan),
            Self::Own(part) => Some(scan.with_part(part)),
            Self::None => None,
        }
    }
}
