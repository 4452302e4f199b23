//! Clash lists: all places where two scans meet, or come nearer to each other than a clearance, each once.
//!
//! One search finds a contact of every pair of leaves that meets. A second one, with the clearance as its
//! margin, finds one of every pair of leaves that comes nearer. Contacts of the first are *hard*; those of the
//! second, but for leaves that meet, are *near*. Hard contacts are grouped into hard clashes. Near contacts
//! that are linked to hard ones, directly or by others, surround these; the rest is grouped into clearance
//! clashes. So hard clashes do not depend on the clearance.
//!
//! A near contact is the first one found of two leaves, not the nearest. So the nearest points of the same
//! leaves bound the distance of a clearance clash from above, and their enclosures or the balls about their
//! points from below.

mod components;
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
use crate::question::{Pair, Scratch};
use measure::{NearContacts, Nearness, nearness};
use stored::{leaves, stored};

/// What is asked. Plain values; [`ClashPlan::new`] validates them. Lengths are in the world.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[non_exhaustive]
pub struct ClashOptions {
    /// What it means to meet. Default: obstacles.
    pub semantics: Semantics,
    /// What comes nearer than this is a clash as well. Default: 0, contact alone.
    pub clearance: f64,
    /// Contacts at most this far from each other belong to one clash. None, the default:
    /// [`ClashPlan::link`] chooses.
    pub link: Option<f64>,
    /// By which distances surfaces are defined. None, the default: as both scans were prepared.
    pub metric: Option<Metric>,
}

impl ClashOptions {
    /// The same options with these semantics.
    #[must_use]
    pub const fn with_semantics(self, semantics: Semantics) -> Self {
        Self { semantics, ..self }
    }

    /// The same options with this clearance.
    #[must_use]
    pub const fn with_clearance(self, clearance: f64) -> Self {
        Self { clearance, ..self }
    }

    /// The same options with this link length.
    #[must_use]
    pub const fn with_link(self, link: f64) -> Self {
        Self { link: Some(link), ..self }
    }

    /// The same options by this metric.
    #[must_use]
    pub const fn with_metric(self, metric: Metric) -> Self {
        Self { metric: Some(metric), ..self }
    }
}

/// Validated options for two scans, in any poses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClashPlan {
    touching: CollidePlan,
    /// With a clearance above zero.
    near: Option<CollidePlan>,
    link: Option<f64>,
}

/// The default link length in sampling radii of the coarser scan. A leaf of sixteen points is about four of
/// these wide, and there is one contact of each pair of leaves: two of these lengths tear the contacts along
/// one curve of intersection apart, three hardly do, and six join curves that are well apart (dragons of 23 and
/// 100 thousand points).
const LINK: f64 = 4.0;

impl ClashPlan {
    /// Validates `options` for two scans.
    ///
    /// # Errors
    /// [`PlanError::Radius`], [`PlanError::Margin`] and [`PlanError::Link`] for what is no length;
    /// [`PlanError::Metric`] and [`PlanError::Metrics`] for scans whose surfaces are not defined as it is
    /// asked, or not alike.
    pub fn new(options: &ClashOptions, a: &PointHierarchy, b: &PointHierarchy) -> Result<Self, PlanError> {
        if let Some(link) = options.link.filter(|&link| !(link >= 0.0 && link.is_finite())) {
            return Err(PlanError::Link(link));
        }
        let asked = CollideOptions { metric: options.metric, ..CollideOptions::default() }
            .with_semantics(options.semantics)
            .with_detail(Detail::Verdict)
            .with_evidence(Evidence::Estimated);
        let touching = CollidePlan::new(&asked, a, b)?;
        let near = CollidePlan::new(&asked.with_margin(options.clearance), a, b)?;
        Ok(Self { touching, near: (options.clearance > 0.0).then_some(near), link: options.link })
    }

    /// The validated options of the search for contact.
    #[must_use]
    pub fn options(&self) -> &CollideOptions {
        self.touching.options()
    }

    /// The clearance, in the world.
    #[must_use]
    pub fn clearance(&self) -> f64 {
        self.near.map_or(0.0, |near| near.options().margin)
    }

    /// The link length for two placed scans, in the world: the one that was asked for, else
    /// [`default_link`].
    #[must_use]
    pub fn link(&self, views: [&Placed<'_>; 2]) -> f64 {
        self.link.unwrap_or_else(|| default_link(views))
    }
}

/// The default link length of two placed scans, in the world: four times the greater sampling radius.
#[must_use]
pub fn default_link(views: [&Placed<'_>; 2]) -> f64 {
    LINK * views.map(Placed::sampling_radius).into_iter().fold(0.0, f64::max)
}

/// Whether scans meet in a clash.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum ClashKind {
    /// They do.
    Hard,
    /// They come nearer than the clearance, and contact was found nowhere in it.
    Clearance,
}

/// One place where two scans meet or come too near.
#[derive(Debug, Clone, PartialEq)]
pub struct Clash {
    /// Which of both.
    pub kind: ClashKind,
    /// Its contacts, as indices into [`Clashes::contacts`]: of hard clashes the hard ones alone.
    pub group: ContactGroup,
    /// Of hard clashes, the near contacts that surround it: those linked to it, directly or by others, and to
    /// no hard clash nearer to them. Indices as above; empty for others.
    pub surroundings: Vec<usize>,
    /// The scans are no nearer to each other than this in any of its pairs of leaves: proven. Zero in a hard
    /// clash.
    pub lower: f64,
    /// They come as near as this. Zero in a hard clash.
    pub upper: f64,
    /// Of [`Self::upper`]. Certified: two measured points, or the balls about them, are that near.
    /// Estimated: tangent discs are.
    pub evidence: Evidence,
    /// How deep one scan is in the other. `None` always: no search tells it yet.
    pub depth: Option<f64>,
}

/// All clashes of two scans.
#[derive(Debug, Clone, PartialEq)]
pub struct Clashes {
    /// Hard clashes first, among them those with the greatest box diagonal, then those with most contacts,
    /// then those found first.
    pub clashes: Vec<Clash>,
    /// The contacts that they are made of, in the order of the searches: hard ones, then near ones.
    pub contacts: Vec<Contact>,
    /// The number of hard contacts.
    pub hard: usize,
    /// The link length, in the world.
    pub link: f64,
    /// Whether these are all: the budget lasted.
    pub complete: bool,
    /// The answers of the searches, for contact and, with a clearance above zero, for what comes nearer.
    pub answers: (Answer, Option<Answer>),
}

impl Pair<'_> {
    /// Lists all places where the scans meet or, with a clearance, come nearer than that.
    ///
    /// Costs two searches for [all contacts](Self::contacts), of which that within a great clearance takes
    /// longer, and n log n steps to group n contacts. Each search may spend the whole budget. Allocates.
    /// Deterministic, as long as the budget has no deadline.
    #[must_use]
    pub fn clashes(&self, plan: &ClashPlan, scratch: &mut Scratch) -> Clashes {
        let views = self.scans().each_ref();
        let link = plan.link(views);
        let mut hard = Contacts::default();
        let answer = self.contacts(&mut hard).collide(&plan.touching, scratch);
        let mut near = Contacts { contacts: Vec::new(), complete: true };
        let near_answer = plan.near.as_ref().map(|plan| self.contacts(&mut near).collide(plan, scratch));

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
            let NearContacts { surroundings, misses } = NearContacts::new(&contacts, count, &groups, link);
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
