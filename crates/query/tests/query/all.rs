//! All contacts against brute force: every pair of discs or points of every pair of leaves.
use std::collections::BTreeSet;

use nearmiss_geometry::{PointCloud, Pose};
use nearmiss_hierarchy::{BuildOptions, PointHierarchy, PointKind};
use nearmiss_query::{
    Budget, CollideOptions, CollidePlan, Contacts, Detail, Method, Pair, Placed, Sampling, Scratch,
    Semantics, Verdict,
};
use nearmiss_testdata::arbitrary::{self, CloudKind};
use nearmiss_testdata::oracle;

fn prepared(points: &[[f64; 3]]) -> PointHierarchy {
    let leaf = BuildOptions::default().with_leaf_size(8);
    PointHierarchy::build(&PointCloud::from_positions(points).unwrap(), &leaf).unwrap()
}

/// The leaf of every stored point.
fn leaves(scan: &PointHierarchy) -> Vec<usize> {
    let mut of = vec![0; scan.len()];
    let topology = scan.topology();
    for leaf in 0..topology.leaves() {
        of[topology.points_of_leaf(leaf)].fill(leaf);
    }
    of
}

/// The leaf pairs of the contacts.
fn found(contacts: &Contacts, scans: [&PointHierarchy; 2]) -> Vec<[usize; 2]> {
    let [leaves_a, leaves_b] = scans.map(leaves);
    let stored = |side: usize, contact: &nearmiss_query::Contact| {
        scans[side].source().iter().position(|&s| s == contact.sources[side].0).unwrap()
    };
    contacts.contacts.iter().map(|c| [leaves_a[stored(0, c)], leaves_b[stored(1, c)]]).collect()
}

/// The leaf pairs with reliable discs that certainly cross, and those with discs that possibly
/// cross.
fn crossing(a: &Placed<'_>, b: &Placed<'_>) -> [BTreeSet<[usize; 2]>; 2] {
    let disc = |view: &Placed<'_>, i: usize| oracle::Disc {
        centre: view.point(i),
        normal: view.stored_to_world().rotate(view.scan().normals()[i].map(f64::from)),
        radius: f64::from(view.scan().discs().get(i)) * view.stored_to_world().scale(),
    };
    let trusted =
        |view: &Placed<'_>, i: usize| matches!(view.scan().kind(i), PointKind::Sheet | PointKind::Edge);
    let radius =
        |view: &Placed<'_>, i: usize| f64::from(view.scan().radii()[i]) * view.stored_to_world().scale();
    let (leaves_a, leaves_b) = (leaves(a.scan()), leaves(b.scan()));
    let [mut surely, mut maybe] = [BTreeSet::new(), BTreeSet::new()];
    for i in 0..a.scan().len() {
        for j in 0..b.scan().len() {
            let (p, q) = (disc(a, i), disc(b, j));
            let apart = (0..3).map(|k| (p.centre[k] - q.centre[k]).powi(2)).sum::<f64>().sqrt();
            let far = 0.9 * radius(a, i).max(radius(b, j));
            let slack = oracle::crossing(&p, &q).slack / p.radius.min(q.radius);
            let pair = [leaves_a[i], leaves_b[j]];
            if slack > 1e-3 && apart < far * (1.0 - 1e-5) && trusted(a, i) && trusted(b, j) {
                surely.insert(pair);
            }
            // Nearly parallel discs have some thickness.
            if slack > -0.2 && apart < far * (1.0 + 1e-5) {
                maybe.insert(pair);
            }
        }
    }
    [surely, maybe]
}

#[test]
fn one_contact_of_every_pair_of_leaves_whose_discs_cross() {
    let mut rng = arbitrary::rng(31);
    let mut scratch = Scratch::default();
    let (mut contacts, mut pairs, mut several) = (Contacts::default(), 0, 0);
    let kinds =
        [CloudKind::Sphere, CloudKind::Random, CloudKind::Lattice, CloudKind::Coplanar, CloudKind::Outlier];
    for (n, kind) in (0_u64..).zip(kinds.iter().cycle().take(25)) {
        let a = prepared(&arbitrary::cloud(*kind, 250, n));
        let b = prepared(&arbitrary::cloud(*kind, 200, n + 100));
        let size = a.bounds().half_extents().into_iter().fold(0.0, f64::max);
        for _ in 0..4 {
            let spread = arbitrary::point_in(&mut rng, 1.5 * size);
            let pose = arbitrary::rotation(&mut rng).with_translation(spread);
            let (va, vb) = (Placed::new(&a, &Pose::IDENTITY), Placed::new(&b, &pose));
            let [surely, maybe] = crossing(&va, &vb);
            for detail in [Detail::Verdict, Detail::Witness] {
                let options =
                    CollideOptions::estimated().with_semantics(Semantics::Surface).with_detail(detail);
                let plan = CollidePlan::new(&options, &a, &b).unwrap();
                let answer = Pair::new(va, vb).contacts(&mut contacts).collide(&plan, &mut scratch);
                assert!(contacts.complete, "without a budget");
                let first = Pair::new(va, vb).collide(&plan, &mut Scratch::default()).verdict;
                match first {
                    Verdict::Intersecting { contact, .. } if detail == Detail::Verdict => {
                        assert!(contacts.contacts.contains(&contact), "{kind:?} {n}: one of them");
                    }
                    Verdict::Intersecting { .. } => {}
                    _ => assert_eq!(answer.verdict, first, "{kind:?} {n}"),
                }
                assert_eq!(answer.verdict.is_intersecting(), first.is_intersecting());
                assert_eq!(answer.verdict.is_intersecting(), !contacts.contacts.is_empty());
                let list = found(&contacts, [&a, &b]);
                let set: BTreeSet<_> = list.iter().copied().collect();
                assert_eq!(set.len(), list.len(), "{kind:?} {n}: one of each pair");
                assert!(set.is_superset(&surely), "{kind:?} {n}: missed {:?}", surely.difference(&set));
                assert!(set.is_subset(&maybe), "{kind:?} {n}: made up {:?}", set.difference(&maybe));
                pairs += set.len();
                several += usize::from(set.len() > 20);
            }
        }
    }
    assert!(pairs > 2000 && several > 20, "{pairs} pairs, {several} questions with many");
}

#[test]
fn one_contact_of_every_pair_of_leaves_with_near_points() {
    let (a, b) = (
        prepared(&arbitrary::cloud(CloudKind::Sphere, 250, 1)),
        prepared(&arbitrary::cloud(CloudKind::Random, 200, 2)),
    );
    let (va, vb) = (Placed::new(&a, &Pose::IDENTITY), Placed::new(&b, &Pose::IDENTITY));
    let (leaves_a, leaves_b) = (leaves(&a), leaves(&b));
    let (mut contacts, mut scratch) = (Contacts::default(), Scratch::default());
    for share in [0.01, 0.1, 0.3] {
        let radius = share * a.bounds().half_extents()[0];
        let mut expected = BTreeSet::new();
        for i in 0..a.len() {
            for j in 0..b.len() {
                let (p, q) = (va.point(i), vb.point(j));
                if (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt() <= 2.0 * radius {
                    expected.insert([leaves_a[i], leaves_b[j]]);
                }
            }
        }
        let options = CollideOptions::estimated().with_semantics(Semantics::Thickened(radius));
        let plan = CollidePlan::new(&options, &a, &b).unwrap();
        Pair::new(va, vb).contacts(&mut contacts).collide(&plan, &mut scratch);
        let list = found(&contacts, [&a, &b]);
        assert_eq!(list.len(), expected.len(), "one of each pair");
        assert_eq!(list.into_iter().collect::<BTreeSet<_>>(), expected, "within {radius}");
    }
}

#[test]
fn a_budget_leaves_the_first_contacts() {
    let sphere = prepared(&arbitrary::cloud(CloudKind::Sphere, 3000, 1));
    let size = sphere.bounds().half_extents()[0];
    let pose = Pose::from_translation([size, 0.1 * size, 0.0]);
    let (a, b) = (Placed::new(&sphere, &Pose::IDENTITY), Placed::new(&sphere, &pose));
    let plan = CollidePlan::new(
        &CollideOptions::estimated().with_order(nearmiss_query::Order::DepthFirst),
        &sphere,
        &sphere,
    )
    .unwrap();
    let mut scratch = Scratch::default();
    let mut all = Contacts::default();
    let answer = Pair::new(a, b).contacts(&mut all).collide(&plan, &mut scratch);
    let whole = answer.statistics.evaluations + answer.statistics.node_pairs;
    assert!(all.complete && all.contacts.len() > 50, "{}", all.contacts.len());
    let mut some = Contacts::default();
    let mut counts = BTreeSet::new();
    for share in [0, 1, 2, 3, 5, 8, 10] {
        let budget = Budget::default().with_work(whole * share / 10 + 1);
        let answer = Pair::new(a, b).within(&budget).contacts(&mut some).collide(&plan, &mut scratch);
        assert_eq!(some.complete, share == 10, "{share} tenths of the work");
        assert_eq!(some.contacts, all.contacts[..some.contacts.len()], "{share} tenths: the first of all");
        assert_eq!(answer.verdict.is_intersecting(), !some.contacts.is_empty());
        counts.insert(some.contacts.len());
    }
    assert!(counts.len() > 4, "{counts:?}");
}

#[test]
fn test_points_and_margins_find_all_along_a_circle() {
    let sphere = prepared(&arbitrary::cloud(CloudKind::Sphere, 3000, 1));
    let size = sphere.bounds().half_extents()[0];
    let pose = Pose::from_translation([size, 0.0, 0.0]);
    let (a, b) = (Placed::new(&sphere, &Pose::IDENTITY), Placed::new(&sphere, &pose));
    let (mut contacts, mut scratch) = (Contacts::default(), Scratch::default());
    let sampling = CollideOptions::estimated().with_method(Method::Sampling(Sampling::default()));
    for options in [sampling, CollideOptions::estimated().with_margin(0.05 * size)] {
        let plan = CollidePlan::new(&options, &sphere, &sphere).unwrap();
        let answer = Pair::new(a, b).contacts(&mut contacts).collide(&plan, &mut scratch);
        assert!(matches!(answer.verdict, Verdict::Intersecting { .. }), "{answer:?}");
        let set: BTreeSet<_> = found(&contacts, [&sphere; 2]).into_iter().collect();
        assert_eq!(set.len(), contacts.contacts.len(), "one of each pair");
        // There are contacts in all twelve sectors of the circle.
        let hour = |c: &nearmiss_query::Contact| {
            let angle = c.point[1].atan2(c.point[2]).rem_euclid(std::f64::consts::TAU);
            (0..12).rfind(|&hour| f64::from(hour) * std::f64::consts::TAU / 12.0 <= angle)
        };
        let hours: BTreeSet<Option<i32>> = contacts.contacts.iter().map(hour).collect();
        assert_eq!(hours.len(), 12, "{hours:?}");
    }
}
