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

/// The nearness of each group of `contacts`, over the pairs of leaves that these are of.
pub(crate) fn nearness(
    views: [&Placed<'_>; 2],
    plan: &CollidePlan,
    level: Level,
    contacts: &[Contact],
    groups: &[ContactGroup],
) -> Vec<Nearness> {
    let by_discs = |group: &ContactGroup| Nearness {
        lower: 0.0,
        upper: 2.0 * contacts[group.nearest].residual,
        evidence: Evidence::Estimated,
    };
    let Ok((_, relative)) = relative(views[0], views[1], plan) else {
        return groups.iter().map(by_discs).collect();
    };
    let slices = views.map(|view| view.scan().slices());
    let meter = Meter::new(&Budget::UNLIMITED, views, 0);
    let semantics = plan.options().semantics;
    let pair = ScanPair::new(views, slices.each_ref(), relative, meter, (level, semantics.part()));
    let sources = |side: usize| {
        let of_groups = groups.iter().flat_map(|group| &group.contacts);
        Sources::new(views[side], of_groups.map(|&i| contacts[i].sources[side].0).collect())
    };
    let stored = [sources(0), sources(1)];
    let proves_upper = !matches!(semantics, Semantics::Surface);
    let of_group = |group: &ContactGroup| {
        let mut all = Nearness { lower: f64::INFINITY, ..by_discs(group) };
        for &i in &group.contacts {
            let [a, b] = [0, 1].map(|side| stored[side].stored(contacts[i].sources[side].0));
            let least = Least::of(&pair, plan, pair.leaves_of([a, b]));
            all.lower = all.lower.min(least.lower);
            if least.upper <= all.upper {
                all.upper = least.upper.max(0.0);
                all.evidence = if proves_upper { Evidence::Certified } else { Evidence::Estimated };
            }
        }
        Nearness { lower: all.lower.min(all.upper), ..all }
    };
    groups.iter().map(of_group).collect()
}

/// Where some of the caller's points are stored.
struct Sources {
    /// Pairs of the caller's number and the index of the stored point, by number.
    known: Vec<(u32, usize)>,
}

impl Sources {
    fn new(view: &Placed<'_>, mut wanted: Vec<u32>) -> Self {
        wanted.sort_unstable();
        wanted.dedup();
        let of_scan = view.scan().source().iter().enumerate();
        let known = of_scan.filter(|(_, id)| wanted.binary_search(id).is_ok()).map(|(i, &id)| (id, i));
        let mut known: Vec<(u32, usize)> = known.collect();
        known.sort_unstable();
        Self { known }
    }

    /// The stored point with a number that was wanted.
    fn stored(&self, id: u32) -> usize {
        self.known.binary_search_by_key(&id, |&(id, _)| id).map_or(0, |at| self.known[at].1)
    }
}
