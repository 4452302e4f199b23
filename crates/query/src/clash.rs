//! Clash lists: every place where two scans meet, or come nearer to each other than a clearance,
//! listed once.
//!
//! A first search finds one contact for each pair of leaves that meets. A second search, with the
//! clearance as its margin, finds one contact for each pair of leaves that comes nearer than the
//! clearance. Contacts of the first search are *hard*. Contacts of the second search are *near*
//! unless their leaves meet. Hard contacts are grouped into hard clashes. Near contacts that are
//! linked to a hard contact, directly or through others, are the surroundings of a hard clash. All
//! other near contacts are grouped into clearance clashes. Hard clashes therefore do not depend on
//! the clearance.
//!
//! A near contact is the first one found for two leaves, not the nearest. The distance of a
//! clearance clash is therefore bounded from above by the nearest points of the same leaves. It is
//! bounded from below by the enclosures of these leaves, or by the balls about their points.

mod components;
mod curves;
mod depths;
mod group;
mod least;
mod measure;
mod stored;

use std::collections::BTreeSet;

use nearmiss_hierarchy::PointHierarchy;
use nearmiss_surface::Metric;

pub use components::components;
pub use group::ContactGroup;

use crate::ask::answer::{Answer, Contact, Contacts, Evidence};
use crate::ask::options::{CollideOptions, CollidePlan, Detail, PlanError, Semantics};
use crate::pair::placed::Placed;
use crate::penetration::answer::{Interior, Penetration};
use crate::question::{Pair, Scratch};
use measure::{NearContacts, Nearness, nearness};
use stored::{leaves, stored};

/// Options of a clash list, as plain values; [`ClashPlan::new`] validates them. Lengths are in
/// world units.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[non_exhaustive]
pub struct ClashOptions {
    /// The meaning of the scans. Default: obstacles.
    pub semantics: Semantics,
    /// Places nearer than this are listed as well. Default: 0, contacts only.
    pub clearance: f64,
    /// Contacts at most this far from each other belong to one clash. With `None`, the default,
    /// [`ClashPlan::link`] chooses the length.
    pub link: Option<f64>,
    /// The distances that define the surfaces. Default: `None`, those that both scans were prepared
    /// for.
    pub metric: Option<Metric>,
    /// The insides of both scans, if the depths of hard clashes are wanted. Default: `None`.
    pub depths: Option<[Interior; 2]>,
}

impl ClashOptions {
    /// Returns the options with these semantics.
    #[must_use]
    pub const fn with_semantics(self, semantics: Semantics) -> Self {
        Self { semantics, ..self }
    }

    /// Returns the options with this clearance.
    #[must_use]
    pub const fn with_clearance(self, clearance: f64) -> Self {
        Self { clearance, ..self }
    }

    /// Returns the options with this link length.
    #[must_use]
    pub const fn with_link(self, link: f64) -> Self {
        Self { link: Some(link), ..self }
    }

    /// Returns the options with this metric.
    #[must_use]
    pub const fn with_metric(self, metric: Metric) -> Self {
        Self { metric: Some(metric), ..self }
    }

    /// Returns the options that ask for the depths of hard clashes, given the insides of both scans.
    #[must_use]
    pub const fn with_depths(self, interiors: [Interior; 2]) -> Self {
        Self { depths: Some(interiors), ..self }
    }
}

/// Validated options for two scans, in any poses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClashPlan {
    touching: CollidePlan,
    /// The search within the clearance, if that is above zero.
    near: Option<CollidePlan>,
    link: Option<f64>,
    depths: Option<[Interior; 2]>,
}

/// The default link length, in sampling radii of the coarser scan. A leaf of sixteen points is
/// about four of these wide, and there is one contact for each pair of leaves. In tests with
/// dragons of 23 and 100 thousand points, 2 split the contacts along one curve of intersection, 3
/// hardly did, and 6 joined curves that are well apart.
const LINK: f64 = 4.0;

impl ClashPlan {
    /// Validates `options` for two scans.
    ///
    /// # Errors
    /// [`PlanError::Radius`], [`PlanError::Margin`] and [`PlanError::Link`] for an invalid length.
    /// [`PlanError::Metric`] and [`PlanError::Metrics`] if the metrics of the scans differ from the
    /// requested one or from each other.
    pub fn new(options: &ClashOptions, a: &PointHierarchy, b: &PointHierarchy) -> Result<Self, PlanError> {
        if let Some(link) = options.link.filter(|&link| !(link >= 0.0 && link.is_finite())) {
            return Err(PlanError::Link(link));
        }
        let asked = CollideOptions { metric: options.metric, ..CollideOptions::estimated() }
            .with_semantics(options.semantics)
            .with_detail(Detail::Verdict)
            .with_evidence(Evidence::Estimated);
        let touching = CollidePlan::new(&asked, a, b)?;
        let near = CollidePlan::new(&asked.with_margin(options.clearance), a, b)?;
        Ok(Self {
            touching,
            near: (options.clearance > 0.0).then_some(near),
            link: options.link,
            depths: options.depths,
        })
    }

    /// The validated options of the search for contact.
    #[must_use]
    pub fn options(&self) -> &CollideOptions {
        self.touching.options()
    }

    /// The clearance, in world units.
    #[must_use]
    pub fn clearance(&self) -> f64 {
        self.near.map_or(0.0, |near| near.options().margin)
    }

    /// The link length for two placed scans, in world units: that of the options, or else
    /// [`default_link`].
    #[must_use]
    pub fn link(&self, views: [&Placed<'_>; 2]) -> f64 {
        self.link.unwrap_or_else(|| default_link(views))
    }
}

/// The default link length of two placed scans, in world units: four times the greater sampling
/// radius.
#[must_use]
pub fn default_link(views: [&Placed<'_>; 2]) -> f64 {
    LINK * views.map(Placed::sampling_radius).into_iter().fold(0.0, f64::max)
}

/// The kinds of clashes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum ClashKind {
    /// The scans meet.
    Hard,
    /// The scans come nearer than the clearance, and no contact was found there.
    Clearance,
}

/// A place where two scans meet or come too near.
#[derive(Debug, Clone, PartialEq)]
pub struct Clash {
    /// The kind of the clash.
    pub kind: ClashKind,
    /// The contacts, as indices into [`Clashes::contacts`]. Hard clashes hold hard contacts only.
    pub group: ContactGroup,
    /// The near contacts around a hard clash, as indices into [`Clashes::contacts`]. They are
    /// linked to the clash, directly or through others, and no hard clash is nearer to them. Empty
    /// for clearance clashes.
    pub surroundings: Vec<usize>,
    /// Proven lower bound of the distance of the scans over the pairs of leaves of this clash. Zero
    /// in a hard clash.
    pub lower: f64,
    /// Upper bound of that distance. Zero in a hard clash.
    pub upper: f64,
    /// The evidence for [`Self::upper`]. Certified: two measured points, or the balls about them,
    /// are that near. Estimated: tangent discs are.
    pub evidence: Evidence,
    /// How far, and in which direction, to shift b out of the clash: see [`Pair::depths`]. `None` in a
    /// clearance clash, and if the options do not ask for it.
    pub depth: Option<Penetration>,
}

/// All clashes of two scans.
#[derive(Debug, Clone, PartialEq)]
pub struct Clashes {
    /// The clashes: hard ones first, then by greatest box diagonal, then by most contacts, then in
    /// the order in which they were found.
    pub clashes: Vec<Clash>,
    /// The contacts of all clashes in the order of the searches: hard ones, then near ones.
    pub contacts: Vec<Contact>,
    /// The number of hard contacts.
    pub hard: usize,
    /// The link length, in world units.
    pub link: f64,
    /// `true` if the searches ended within the budget, so that no clash is missing. Each depth tells for
    /// itself whether its search did.
    pub complete: bool,
    /// The answers of the search for contacts and, with a clearance above zero, of the search
    /// within the clearance.
    pub answers: (Answer, Option<Answer>),
}

/// The progress of a list with a clearance, as shares of its running time: after the search for
/// contact, the search within the clearance, the comparison of both, and the groups.
const TOUCHING: f64 = 0.05;
const NEAR: f64 = 0.4;
const MERGED: f64 = 0.5;
const GROUPED: f64 = 0.98;

/// The progress of a list without a clearance after the search for contact.
const TOUCHING_ALONE: f64 = 0.9;

/// The progress before depths are measured, which take most of the time.
const LISTED: f64 = 0.1;

impl Pair<'_> {
    /// Lists every place where the scans meet or, with a clearance, come nearer than it.
    ///
    /// Costs two searches for [all contacts](Self::contacts), and n log n steps to group n
    /// contacts. If the clearance is large, the second search takes most of the time;
    /// [depths](Self::depths) take longer. Each search may spend the whole budget. Allocates. Deterministic
    /// unless the budget has a deadline.
    #[must_use]
    pub fn clashes(&self, plan: &ClashPlan, scratch: &mut Scratch) -> Clashes {
        self.clashes_watched(plan, scratch, &mut |_| ())
    }

    /// Like [`Self::clashes`], and passes the share of the work that is done to `told` after each
    /// step: the searches, the groups, and the distances.
    #[must_use]
    pub fn clashes_watched(
        &self,
        plan: &ClashPlan,
        scratch: &mut Scratch,
        told: &mut dyn FnMut(f64),
    ) -> Clashes {
        let Some(interiors) = plan.depths else { return self.list(plan, scratch, told) };
        let mut found = self.list(plan, scratch, &mut |share| told(LISTED * share));
        let hard: Vec<&mut Clash> =
            found.clashes.iter_mut().filter(|clash| clash.kind == ClashKind::Hard).collect();
        let groups: Vec<&ContactGroup> = hard.iter().map(|clash| &clash.group).collect();
        let mut told = |share| told(LISTED + (1.0 - LISTED) * share);
        let asked = (&found.contacts[..found.hard], groups.as_slice());
        let whole = if hard.is_empty() {
            Penetration::UNKNOWN
        } else {
            self.penetration(&plan.touching, interiors, scratch)
        };
        let depths = self.depths(asked, (&plan.touching, interiors), &whole, &mut told);
        for (clash, depth) in hard.into_iter().zip(depths) {
            clash.depth = Some(depth);
        }
        found
    }

    /// Lists the clashes without depths.
    fn list(&self, plan: &ClashPlan, scratch: &mut Scratch, told: &mut dyn FnMut(f64)) -> Clashes {
        let views = self.scans().each_ref();
        let link = plan.link(views);
        let mut hard = Contacts::default();
        let answer = self.contacts(&mut hard).collide(&plan.touching, scratch);
        told(if plan.near.is_some() { TOUCHING } else { TOUCHING_ALONE });
        let mut near = Contacts { contacts: Vec::new(), complete: true };
        let near_answer = plan.near.as_ref().map(|plan| self.contacts(&mut near).collide(plan, scratch));

        if plan.near.is_some() {
            told(NEAR);
        }
        let count = hard.contacts.len();
        let groups = ContactGroup::all(&hard.contacts, link);
        let mut contacts = hard.contacts;
        let mut clashes = Vec::new();
        if let Some(plan) = &plan.near {
            let mut points = stored(views, &contacts);
            let touching: BTreeSet<[usize; 2]> = points.iter().map(|&points| leaves(views, points)).collect();
            for (contact, near) in near.contacts.iter().zip(stored(views, &near.contacts)) {
                if !touching.contains(&leaves(views, near)) {
                    contacts.push(*contact);
                    points.push(near);
                }
            }
            told(MERGED);
            let NearContacts { surroundings, misses } =
                NearContacts::new(&contacts, count, &groups, link, &mut |share| {
                    told(MERGED + (GROUPED - MERGED) * share);
                });
            told(GROUPED);
            let nearness = nearness(views, plan, scratch.level(), (&contacts, &points), &misses);
            clashes
                .extend(groups.into_iter().zip(surroundings).map(|(group, near)| Clash::hard(group, near)));
            clashes.extend(misses.into_iter().zip(nearness).map(|(group, near)| Clash::miss(group, near)));
        } else {
            clashes.extend(groups.into_iter().map(|group| Clash::hard(group, Vec::new())));
        }
        clashes.sort_by(|p, q| p.kind.cmp(&q.kind).then_with(|| p.group.by_size(&q.group)));
        let complete = hard.complete && near.complete;
        Clashes { clashes, contacts, hard: count, link, complete, answers: (answer, near_answer) }
    }
}

impl Clash {
    fn hard(group: ContactGroup, surroundings: Vec<usize>) -> Self {
        let (kind, evidence) = (ClashKind::Hard, Evidence::Estimated);
        Self { kind, group, surroundings, lower: 0.0, upper: 0.0, evidence, depth: None }
    }

    fn miss(group: ContactGroup, Nearness { lower, upper, evidence }: Nearness) -> Self {
        let (kind, surroundings) = (ClashKind::Clearance, Vec::new());
        Self { kind, group, surroundings, lower, upper, evidence, depth: None }
    }
}
