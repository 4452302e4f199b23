//! Near contacts: the surroundings of hard clashes, and the distances of clearance clashes.

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

/// The contacts that are divided between two reports of the progress.
const TOLD: usize = 4096;

/// Near contacts, divided into those linked to hard contacts and all others.
pub(crate) struct NearContacts {
    /// For each hard group, the near contacts around it, in ascending order.
    pub(crate) surroundings: Vec<Vec<usize>>,
    /// The groups of the near contacts that are not linked to a hard contact, in the order of their
    /// first contacts.
    pub(crate) misses: Vec<ContactGroup>,
}

impl NearContacts {
    /// Divides the near contacts. The first `hard_count` of `contacts` are hard, and `hard` holds
    /// their groups. Passes the share of the near contacts that are divided to `told`, again and
    /// again.
    pub(crate) fn new(
        contacts: &[Contact],
        hard_count: usize,
        hard: &[ContactGroup],
        link: f64,
        told: &mut dyn FnMut(f64),
    ) -> Self {
        let mut divided = 0_usize;
        let of_groups = hard.iter().enumerate().flat_map(|(number, group)| {
            group.contacts.iter().map(move |&i| GeomWithData::new(contacts[i].point, number))
        });
        let tree = RTree::bulk_load(of_groups.collect());
        let mut surroundings = vec![Vec::new(); hard.len()];
        let mut misses = Vec::new();
        for group in ContactGroup::all(contacts, link) {
            // Indices ascend: if the first contact is not hard, none is.
            if group.contacts[0] >= hard_count {
                misses.push(group);
                continue;
            }
            for i in group.contacts.into_iter().filter(|&i| i >= hard_count) {
                divided += 1;
                if divided.is_multiple_of(TOLD) {
                    #[expect(clippy::cast_precision_loss, reason = "a share")]
                    told(divided as f64 / (contacts.len() - hard_count) as f64);
                }
                if let Some(nearest) = tree.nearest_neighbor(contacts[i].point) {
                    surroundings[nearest.data].push(i);
                }
            }
        }
        surroundings.iter_mut().for_each(|list: &mut Vec<usize>| list.sort_unstable());
        Self { surroundings, misses }
    }
}

/// Bounds of the distance of two scans within one clearance clash.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Nearness {
    pub(crate) lower: f64,
    pub(crate) upper: f64,
    /// The evidence for the upper bound.
    pub(crate) evidence: Evidence,
}

/// Returns the bounds for each group of `contacts`, over the pairs of leaves that hold the stored
/// `points` of these contacts.
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
    let arrays = views.map(|view| view.scan().arrays());
    let meter = Meter::new(&Budget::UNLIMITED, views, 0);
    let semantics = plan.options().semantics;
    let pair = ScanPair::new(views, arrays.each_ref(), relative, meter, (level, semantics.part()));
    let proves_upper = !matches!(semantics, Semantics::Surface);
    // The distance of the two places of a contact, less their balls. A residual is half the
    // distance with the balls.
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
