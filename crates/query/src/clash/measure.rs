//! Near contacts: which surround hard clashes, and how near the scans come in all others.

use fearless_simd::Level;
use rstar::RTree;
use rstar::primitives::GeomWithData;

use crate::ask::answer::{Contact, Evidence};
use crate::ask::budget::Budget;
use crate::ask::options::{CollidePlan, Semantics};
use crate::clash::group::ContactGroup;
use crate::clash::least::Least;
use crate::pair::meter::Meter;
use crate::pair::placed::Placed;
use crate::pair::scan_pair::{ScanPair, relative};

/// Contacts linked to hard ones, and the others.
pub(crate) struct NearContacts {
    /// Of each hard group, the near contacts that surround it, in ascending order.
    pub(crate) surroundings: Vec<Vec<usize>>,
    /// The groups of contacts that no hard contact is linked to, in the order of their first contacts.
    pub(crate) misses: Vec<ContactGroup>,
}

impl NearContacts {
    /// Of `contacts`, those before `hard_count` are hard, and these are grouped into `hard` already.
    pub(crate) fn new(contacts: &[Contact], hard_count: usize, hard: &[ContactGroup], link: f64) -> Self {
        let of_groups = hard.iter().enumerate().flat_map(|(number, group)| {
            group.contacts.iter().map(move |&i| GeomWithData::new(contacts[i].point, number))
        });
        let tree = RTree::bulk_load(of_groups.collect());
        let mut surroundings = vec![Vec::new(); hard.len()];
        let mut misses = Vec::new();
        for group in ContactGroup::all(contacts, link) {
            // Indices ascend: where the first contact is not hard, none is.
            if group.contacts[0] >= hard_count {
                misses.push(group);
                continue;
            }
            for i in group.contacts.into_iter().filter(|&i| i >= hard_count) {
                if let Some(nearest) = tree.nearest_neighbor(contacts[i].point) {
                    surroundings[nearest.data].push(i);
                }
            }
        }
        surroundings.iter_mut().for_each(|list: &mut Vec<usize>| list.sort_unstable());
        Self { surroundings, misses }
    }
}

/// Bounds of the distance of two scans where they come near each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Nearness {
    pub(crate) lower: f64,
    pub(crate) upper: f64,
    /// Of the upper bound.
    pub(crate) evidence: Evidence,
}

/// The nearness of each group of `contacts`, which are of stored `points`, over the pairs of leaves with these.
pub(crate) fn nearness(
    views: [&Placed<'_>; 2],
    plan: &CollidePlan,
    level: Level,
    (contacts, points): (&[Contact], &[[usize; 2]]),
    groups: &[ContactGroup],
) -> Vec<Nearness> {
    let Ok((_, relative)) = relative(views[0], views[1], plan) else {
        let unknown = Nearness { lower: 0.0, upper: f64::INFINITY, evidence: Evidence::Estimated };
        return vec![unknown; groups.len()];
    };
    let slices = views.map(|view| view.scan().slices());
    let meter = Meter::new(&Budget::UNLIMITED, views, 0);
    let semantics = plan.options().semantics;
    let pair = ScanPair::new(views, slices.each_ref(), relative, meter, (level, semantics.part()));
    let proves_upper = !matches!(semantics, Semantics::Surface);
    // The distance of the places that a contact lies between; residuals are halves of it, balls included.
    let between = |i: usize| {
        let balls = match semantics {
            Semantics::Thickened(radius) => 2.0 * radius,
            _ if pair.is_of_balls(points[i]) => pair.balls(points[i]).iter().sum(),
            _ => 0.0,
        };
        (2.0 * contacts[i].residual - balls).max(0.0)
    };
    let of_group = |group: &ContactGroup| {
        let mut all = Nearness { lower: f64::INFINITY, upper: f64::INFINITY, evidence: Evidence::Estimated };
        for &i in &group.contacts {
            let least = Least::of(&pair, plan, pair.leaves_of(points[i]));
            all.lower = all.lower.min(least.lower);
            let of_points = if proves_upper { Evidence::Certified } else { Evidence::Estimated };
            for (upper, evidence) in [(least.upper.max(0.0), of_points), (between(i), Evidence::Estimated)] {
                if upper < all.upper {
                    (all.upper, all.evidence) = (upper, evidence);
                }
            }
        }
        Nearness { lower: all.lower.min(all.upper), ..all }
    };
    groups.iter().map(of_group).collect()
}
