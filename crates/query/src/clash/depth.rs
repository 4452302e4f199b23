//! The depths of hard clashes.

use nearmiss_geometry::Aabb;
use nearmiss_hierarchy::PointHierarchy;
use nearmiss_lanes::parallel::map_with;

use crate::ask::answer::Contact;
use crate::ask::options::CollidePlan;
use crate::clash::components::components;
use crate::clash::group::ContactGroup;
use crate::clash::{LINK, default_link};
use crate::pair::placed::Placed;
use crate::penetration::answer::{Interior, Penetration};
use crate::penetration::interior::TESTED;
use crate::penetration::probe::Vector;
use crate::penetration::scans::{Piece, of_pieces};
use crate::question::{Pair, Scratch};

/// The maximum number of points of a part that is prepared anew. The whole scans answer for a clash with a
/// greater part.
const MOST_POINTS: usize = 200_000;

/// The first part around a clash reaches this share of the diagonal of the contacts further.
const FIRST: f64 = 0.25;

/// A part is large enough if it reaches this many times as far beyond the contacts as the scans are shifted.
const ROOM: f64 = 2.0;

/// A depth of more than this share of the penetration of the whole scans counts as that.
const NEARLY: f64 = 0.98;

/// The clashes between two reports of the progress.
const TOLD: usize = 16;

impl Pair<'_> {
    /// Bounds, for each of some groups of contacts, how far b must at least be shifted so that the scans do not
    /// meet around the contacts.
    ///
    /// Let B be the bounding box of the contacts of a group, and let the *part* of a scan be its points in B
    /// grown by a length m to every side. The depth is the penetration of both parts for the smallest tried m
    /// that is at least twice its upper bound. After that shift, the scans do not meet in B grown by m/2, as
    /// every point that comes there is in a part. Other clashes that are so near are separated too. A depth is never greater than the [penetration](Self::penetration) of the whole scans, which
    /// separates all groups at once.
    ///
    /// The inside of a [solid](Interior::Solid) scan is that of the whole scan. The lower bound is that of the
    /// parts.
    ///
    /// Parts are prepared as scans of their own, so a depth costs about a microsecond for each point around
    /// the clash, and some hundred collision queries. If a part has more than 200,000 points, the whole scans
    /// answer. The groups are shared among all threads; each query may spend the whole budget. Passes the share
    /// of the groups that are done to `told`, again and again. Allocates. Deterministic unless the budget has a
    /// deadline.
    #[must_use]
    pub fn depths(
        &self,
        (contacts, groups): (&[Contact], &[&ContactGroup]),
        (plan, interiors): (&CollidePlan, [Interior; 2]),
        scratch: &mut Scratch,
        told: &mut dyn FnMut(f64),
    ) -> Vec<Penetration> {
        if groups.is_empty() {
            return Vec::new();
        }
        let whole = self.penetration(plan, interiors, scratch);
        let depths = Depths { pair: self, contacts, plan, interiors, whole };
        let mut found = Vec::with_capacity(groups.len());
        for some in groups.chunks(TOLD) {
            found.extend(map_with(some.len(), Scratch::default, |scratch, i| depths.of(some[i], scratch)));
            #[expect(clippy::cast_precision_loss, reason = "a share")]
            told(found.len() as f64 / groups.len() as f64);
        }
        found
    }
}

/// What the depths of all groups have in common.
struct Depths<'d, 'a> {
    pair: &'d Pair<'a>,
    contacts: &'d [Contact],
    plan: &'d CollidePlan,
    interiors: [Interior; 2],
    /// The penetration of the whole scans.
    whole: Penetration,
}

impl Depths<'_, '_> {
    fn of(&self, group: &ContactGroup, scratch: &mut Scratch) -> Penetration {
        let scans = self.pair.scans().each_ref();
        let most = ROOM * self.whole.upper;
        let mut room = (FIRST * group.diagonal()).max(0.5 * default_link(scans));
        loop {
            room = room.min(most);
            let [a, b] = scans.map(|scan| self.part(scan, group, room));
            if matches!([&a, &b], [Part::Whole, Part::Whole]) || !most.is_finite() {
                return self.whole;
            }
            if let (Some(a), Some(b)) = (a.of(scans[0]), b.of(scans[1])) {
                let found = self.of_parts([a, b], group, scratch);
                if found.upper > self.whole.upper * NEARLY {
                    return self.whole;
                }
                if ROOM * found.upper <= room {
                    return found;
                }
                // A greater part needs a shift that is at least about as long.
                room = room.max(0.5 * ROOM * found.upper);
            }
            if room >= most {
                return self.whole;
            }
            room *= 2.0;
        }
    }

    /// The pieces of a placed scan with some contacts, in the bounding box of these, grown by `room` to every
    /// side.
    fn part(&self, scan: &Placed<'_>, group: &ContactGroup, room: f64) -> Part {
        let (stored, frame) = (scan.scan(), scan.stored_to_world());
        let Aabb { min, max } = group.bounds;
        let grown = Aabb { min: min.map(|c| c - room), max: max.map(|c| c + room) };
        let radius = grown.half_extents().into_iter().fold(0.0, f64::hypot) / frame.scale();
        let centre = frame.apply_inverse(grown.centre());
        let Some(mut points) = stored.points_in_ball(centre, radius, MOST_POINTS) else { return Part::Whole };
        points.retain(|&i| grown.contains(scan.point(i as usize)));
        let places = points.iter().map(|&i| scan.point(i as usize));
        let places = places.chain(group.contacts.iter().map(|&i| self.contacts[i].point)).collect::<Vec<_>>();
        let numbers = components(&places, LINK * scan.sampling_radius());
        let (of_points, of_contacts) = numbers.split_at(points.len());
        let mut of_points = of_points.iter();
        points.retain(|_| of_points.next().is_some_and(|number| of_contacts.contains(number)));
        stored.part(&points).map_or(Part::None, |part| Part::Own(Box::new(part)))
    }

    fn of_parts(&self, parts: [Placed<'_>; 2], group: &ContactGroup, scratch: &mut Scratch) -> Penetration {
        let Scratch { contact, solid, penetration: own, .. } = scratch;
        let piece = |k: usize| {
            let (part, whole) = (parts[k], self.pair.scans()[k]);
            Piece { part, whole, points: self.beside(&part, group) }
        };
        let working = (contact, &mut solid.crossings);
        of_pieces([piece(0), piece(1)], (self.plan, self.interiors), &self.pair.budget, working, own)
    }

    /// Points of a part next to some of the contacts: other points may be inside something else.
    fn beside(&self, part: &Placed<'_>, group: &ContactGroup) -> [Vector; TESTED] {
        std::array::from_fn(|n| {
            let contact = &self.contacts[group.contacts[group.contacts.len() * n / TESTED]];
            let stored = part.stored_to_world().apply_inverse(contact.point);
            part.point(part.scan().nearest_point(stored) as usize).into()
        })
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
