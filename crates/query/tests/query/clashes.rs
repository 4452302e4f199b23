//! Clash lists: contact components against brute force, clearances of shapes with known distances.
use std::collections::BTreeSet;

use nearmiss_geometry::{PointCloud, Pose};
use nearmiss_hierarchy::{BuildOptions, PointHierarchy};
use nearmiss_query::{
    Budget, Clash, ClashKind, ClashOptions, ClashPlan, Clashes, CollideOptions, CollidePlan, Contact,
    ContactGroup, Contacts, Deadline, Detail, Interior, Pair, Penetration, Placed, PlanError, Scratch,
    Semantics,
};
use nearmiss_testdata::arbitrary::{self, CloudKind};
use nearmiss_testdata::oracle;
use nearmiss_testdata::shapes::{Form, Order, Sampling, cuboid, patch, sphere};

fn prepared(points: &[[f64; 3]]) -> PointHierarchy {
    let leaf = BuildOptions::default().with_leaf_size(8);
    PointHierarchy::build(&PointCloud::from_positions(points).unwrap(), &leaf).unwrap()
}

fn list(a: &Placed<'_>, b: &Placed<'_>, options: &ClashOptions) -> Clashes {
    let plan = ClashPlan::new(options, a.scan(), b.scan()).unwrap();
    Pair::new(*a, *b).clashes(&plan, &mut Scratch::default())
}

/// Returns the components of contacts, found by comparing all pairs, in the order of their first
/// contacts.
fn components(contacts: &[Contact], link: f64) -> Vec<Vec<usize>> {
    let distance = |i: usize, j: usize| {
        let (p, q): ([f64; 3], [f64; 3]) = (contacts[i].point, contacts[j].point);
        (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt()
    };
    let mut seen = vec![false; contacts.len()];
    let mut all = Vec::new();
    for first in 0..contacts.len() {
        if seen[first] {
            continue;
        }
        seen[first] = true;
        let (mut own, mut next) = (vec![first], 0);
        while next < own.len() {
            for j in 0..contacts.len() {
                if !seen[j] && distance(own[next], j) <= link {
                    seen[j] = true;
                    own.push(j);
                }
            }
            next += 1;
        }
        own.sort_unstable();
        all.push(own);
    }
    all
}

fn of_kind(found: &Clashes, kind: ClashKind) -> Vec<&Clash> {
    found.clashes.iter().filter(|clash| clash.kind == kind).collect()
}

fn sorted(mut lists: Vec<Vec<usize>>) -> Vec<Vec<usize>> {
    lists.sort();
    lists
}

/// Returns a square of `n` × `n` points, 0.1 apart, at height `z`.
fn square(n: u32, z: f64) -> Vec<[f64; 3]> {
    (0..n * n).map(|i| [f64::from(i % n) * 0.1, f64::from(i / n) * 0.1, z]).collect()
}

#[test]
fn clashes_are_components_of_all_contacts() {
    let mut rng = arbitrary::rng(71);
    let (mut several, mut surrounded, mut misses) = (0, 0, 0);
    let kinds = [CloudKind::Sphere, CloudKind::Random, CloudKind::Lattice, CloudKind::Coplanar];
    for (n, kind) in (0_u64..).zip(kinds.iter().cycle().take(12)) {
        let a = prepared(&arbitrary::cloud(*kind, 250, n));
        let b = prepared(&arbitrary::cloud(*kind, 200, n + 100));
        let size = a.bounds().half_extents().into_iter().fold(0.0, f64::max);
        for round in 0..6 {
            let pose =
                arbitrary::rotation(&mut rng).with_translation(arbitrary::point_in(&mut rng, 1.5 * size));
            let (va, vb) = (Placed::new(&a, &Pose::IDENTITY), Placed::new(&b, &pose));
            let semantics = [Semantics::Obstacle, Semantics::Thickened(0.05 * size)][round % 2];
            let link = [0.0, 0.05, 0.2, 1.0][round % 4] * size;
            let options = ClashOptions::default().with_semantics(semantics).with_link(link);

            let touching = CollideOptions::estimated().with_semantics(semantics).with_detail(Detail::Verdict);
            let plan = CollidePlan::new(&touching, &a, &b).unwrap();
            let mut contacts = Contacts::default();
            Pair::new(va, vb).contacts(&mut contacts).collide(&plan, &mut Scratch::default());

            let hard = list(&va, &vb, &options);
            assert_eq!(hard.contacts, contacts.contacts, "{kind:?} {n}: all contacts, and no others");
            let groups = |found: &Clashes, kind| {
                let of_kind = of_kind(found, kind).into_iter();
                sorted(of_kind.map(|clash| clash.group.contacts.clone()).collect())
            };
            assert_eq!(groups(&hard, ClashKind::Hard), components(&hard.contacts, link), "{kind:?} {n}");
            several += u32::from(hard.clashes.len() > 1);

            // A clearance changes no hard clash, and each near contact is in some clash.
            let near = list(&va, &vb, &options.with_clearance(0.2 * size));
            assert_eq!(groups(&near, ClashKind::Hard), groups(&hard, ClashKind::Hard), "{kind:?} {n}");
            let all = components(&near.contacts, link);
            let without: Vec<Vec<usize>> = all.into_iter().filter(|own| own[0] >= near.hard).collect();
            assert_eq!(groups(&near, ClashKind::Clearance), without, "{kind:?} {n}");
            let lists =
                near.clashes.iter().flat_map(|clash| clash.group.contacts.iter().chain(&clash.surroundings));
            let mut told: Vec<usize> = lists.copied().collect();
            told.sort_unstable();
            assert!(told.into_iter().eq(0..near.contacts.len()), "{kind:?} {n}: each contact once");
            let leaf = |scan: &PointHierarchy, id: u32| {
                let stored = scan.source().iter().position(|&source| source == id).unwrap();
                (0..).find(|&leaf| scan.topology().points_of_leaf(leaf).contains(&stored))
            };
            let pair = |c: &Contact| [leaf(&a, c.sources[0].0), leaf(&b, c.sources[1].0)];
            let (touching, others) = near.contacts.split_at(near.hard);
            let touching: BTreeSet<_> = touching.iter().map(pair).collect();
            assert!(others.iter().all(|c| !touching.contains(&pair(c))), "{kind:?} {n}: leaves that meet");
            surrounded += near.clashes.iter().filter(|clash| !clash.surroundings.is_empty()).count();
            misses += without.len();
            for clash in &near.clashes {
                let contained = |&i: &usize| clash.group.bounds.contains(near.contacts[i].point);
                assert!(clash.group.contacts.iter().all(contained), "{kind:?} {n}: boxes contain contacts");
                assert!(0.0 <= clash.lower && clash.lower <= clash.upper, "{kind:?} {n}: {clash:?}");
                assert!(clash.upper <= 0.2 * size * (1.0 + 1e-6), "nearer than the clearance: {clash:?}");
            }
            let order = near
                .clashes
                .is_sorted_by(|p, q| (p.kind, -p.group.diagonal()) <= (q.kind, -q.group.diagonal()));
            assert!(order, "{kind:?} {n}: by kind, then by size");
        }
    }
    assert!(several > 10 && surrounded > 10 && misses > 10, "{several} {surrounded} {misses}");
}

#[test]
fn two_feet_on_a_floor_are_two_clashes_and_one_above_it_is_a_clearance_clash() {
    let floor = prepared(&square(60, 0.0));
    // Upright sheets: two cut the floor, a third ends 0.45 above it.
    let sheet = |x: f64, low: f64| {
        (0..100_u32).map(move |i| [x + 0.01, 1.03 + f64::from(i % 10) * 0.1, low + f64::from(i / 10) * 0.1])
    };
    let feet: Vec<[f64; 3]> = sheet(1.0, -0.25).chain(sheet(3.0, -0.25)).chain(sheet(5.0, 0.45)).collect();
    let feet = prepared(&feet);
    let (a, b) = (Placed::new(&feet, &Pose::IDENTITY), Placed::new(&floor, &Pose::IDENTITY));
    let found = list(&a, &b, &ClashOptions::default());
    assert!(found.complete && found.clashes.len() == 2, "{:?}", found.clashes);
    let mut at: Vec<f64> = found.clashes.iter().map(|clash| clash.group.centre()[0]).collect();
    at.sort_by(f64::total_cmp);
    assert!((at[0] - 1.0).abs() < 0.1 && (at[1] - 3.0).abs() < 0.1, "{at:?}");
    for clash in &found.clashes {
        assert_eq!((clash.kind, clash.lower, clash.upper, clash.depth), (ClashKind::Hard, 0.0, 0.0, None));
        let size = clash.group.size();
        assert!(size[1] > 0.5 && size[1] < 1.1 && size[0] < 0.15 && size[2] < 0.15, "{size:?}");
    }

    let near = list(&a, &b, &ClashOptions::default().with_clearance(0.5));
    let misses = of_kind(&near, ClashKind::Clearance);
    assert_eq!((near.clashes.len(), misses.len()), (3, 1), "{:?}", near.clashes);
    assert!((misses[0].group.centre()[0] - 5.0).abs() < 0.1, "{:?}", misses[0]);
    // The lowest row of the sheet is 0.45 above the floor; its discs may reach a radius lower.
    assert!(misses[0].lower < 0.45 && misses[0].upper > 0.25, "{:?}", misses[0]);
    assert!(misses[0].upper < 0.46 && misses[0].lower > 0.1, "{:?}", misses[0]);
    assert_eq!(list(&a, &b, &ClashOptions::default().with_clearance(0.2)).clashes.len(), 2, "too far off");
}

#[test]
fn the_distance_of_a_clearance_clash_is_that_of_the_nearest_points() {
    let mut rng = arbitrary::rng(72);
    let mut proven = 0;
    for n in 0..8 {
        let points_a = arbitrary::cloud(CloudKind::Sphere, 400, n);
        let points_b = arbitrary::cloud(CloudKind::Sphere, 300, n + 50);
        let (a, b) = (prepared(&points_a), prepared(&points_b));
        let size = a.bounds().half_extents().into_iter().fold(0.0, f64::max);
        let pose = arbitrary::rotation(&mut rng).with_translation([4.0 * size, 0.3 * size, 0.0]);
        let (va, vb) = (Placed::new(&a, &Pose::IDENTITY), Placed::new(&b, &pose));
        let in_world =
            |view: &Placed<'_>| -> Vec<[f64; 3]> { (0..view.scan().len()).map(|i| view.point(i)).collect() };
        let same = Pose::IDENTITY;
        let nearest = oracle::least_distance(&in_world(&va), &same, &in_world(&vb), &same).unwrap();
        for radius in [None, Some(0.1 * nearest.distance)] {
            let semantics = radius.map_or(Semantics::Obstacle, Semantics::Thickened);
            let options = ClashOptions::default()
                .with_semantics(semantics)
                .with_link(10.0 * size)
                .with_clearance(1.05 * nearest.distance);
            let found = list(&va, &vb, &options);
            let [clash] = found.clashes.as_slice() else { panic!("{n}: {:?}", found.clashes) };
            let expected = nearest.distance - 2.0 * radius.unwrap_or(0.0);
            assert_eq!(clash.kind, ClashKind::Clearance, "{n}: {clash:?}");
            assert!(clash.upper <= expected * (1.0 + 1e-9), "{n}: {clash:?} for {expected}");
            if radius.is_some() {
                assert!((clash.upper - expected).abs() < 1e-9 * expected, "{n}: {clash:?} for {expected}");
                assert_eq!(clash.lower.to_bits(), clash.upper.to_bits(), "balls are exact");
            }
            proven += u32::from(clash.lower > 0.5 * expected);
        }
    }
    assert!(proven > 8, "lower bounds say something: {proven} of 16");
}

#[test]
fn scans_that_are_apart_have_no_clash_and_bad_lengths_are_refused() {
    let floor = prepared(&square(20, 0.0));
    let above = Pose::IDENTITY.with_translation([0.0, 0.0, 1.0]);
    let (a, b) = (Placed::new(&floor, &Pose::IDENTITY), Placed::new(&floor, &above));
    let found = list(&a, &b, &ClashOptions::default().with_clearance(0.5));
    assert!(found.complete && found.clashes.is_empty() && found.contacts.is_empty());
    assert!(ContactGroup::all(&[], 1.0).is_empty());
    for bad in [-1.0, f64::NAN, f64::INFINITY] {
        let of_link = ClashPlan::new(&ClashOptions::default().with_link(bad), &floor, &floor);
        assert!(matches!(of_link, Err(PlanError::Link(_))), "{bad}");
        let of_clearance = ClashPlan::new(&ClashOptions::default().with_clearance(bad), &floor, &floor);
        assert!(matches!(of_clearance, Err(PlanError::Margin(_))), "{bad}");
    }
}

/// Returns points of forms, each placed at a pose.
pub(crate) fn scene(forms: &[(Form, Pose)], spacing: f64) -> PointHierarchy {
    let sampling = Sampling { spacing, noise: 0.0, order: Order::Random, seed: 4 };
    let points: Vec<[f64; 3]> = forms
        .iter()
        .flat_map(|(form, pose)| {
            let points = form.clone().sample(sampling).points;
            points.into_iter().map(|p| pose.apply(p)).collect::<Vec<_>>()
        })
        .collect();
    PointHierarchy::build(&PointCloud::from_positions(&points).unwrap(), &BuildOptions::default()).unwrap()
}

/// Returns the depths of the hard clashes in the order of their centres along x.
fn depths(found: &Clashes) -> Vec<(f64, Penetration)> {
    let of = |clash: &&Clash| (clash.group.centre()[0], clash.depth.unwrap());
    let mut all: Vec<_> = of_kind(found, ClashKind::Hard).iter().map(of).collect();
    all.sort_by(|p, q| p.0.total_cmp(&q.0));
    all
}

#[test]
fn each_clash_has_the_depth_of_its_own_place() {
    const SPACING: f64 = 0.03;
    const HOLLOW: Interior = Interior::Hollow;
    const SOLID: Interior = Interior::Solid;
    let rows = [0.02, 0.05, 0.1, 0.15, 0.25, 0.3];
    let floor = scene(&[(patch(14.0, 2.0), Pose::IDENTITY)], SPACING);
    // Balls of radius 0.3, sunk to these depths. The way out of a floor is up or down.
    let row = |apart: f64| {
        let place = |i: u32, depth: f64| [apart * (f64::from(i) - 2.5), 0.0, 0.3 - depth];
        let balls = (0..).zip(rows).map(|(i, depth)| (sphere(0.3), Pose::from_translation(place(i, depth))));
        scene(&balls.collect::<Vec<_>>(), SPACING)
    };
    let (balls, narrow) = (row(2.0), row(0.85));
    let radius = balls.sampling_radius().max(floor.sampling_radius());
    for (turn, scale) in [(0.0, 1.0), (0.7, 20.0)] {
        let frame = Pose::from_axis_angle([0.0, 0.0, turn], turn).with_scale(scale);
        let (a, b) = (Placed::new(&floor, &frame), Placed::new(&balls, &frame));
        let told = depths(&list(&a, &b, &ClashOptions::default().with_depths([HOLLOW; 2])));
        assert_eq!(told.len(), rows.len(), "{told:?}");
        for ((_, found), depth) in told.iter().zip(rows) {
            assert!((found.upper / scale - depth).abs() < radius, "{depth}: {found:?}");
            assert!(found.direction.map(f64::abs)[2] > 0.8, "{depth}: {found:?}");
        }
        // Neighbours are no pieces of a clash.
        let near = Placed::new(&narrow, &frame);
        let told = depths(&list(&a, &near, &ClashOptions::default().with_depths([HOLLOW; 2])));
        for ((_, found), depth) in told.iter().zip(rows) {
            assert!((found.upper / scale - depth).abs() < radius, "{depth}: {found:?}");
        }
        // As surfaces of solids, the balls have lower bounds.
        let told = depths(&list(&a, &b, &ClashOptions::default().with_depths([HOLLOW, SOLID])));
        for ((_, found), depth) in told.iter().zip(rows) {
            assert!(found.lower / scale > depth - radius && found.lower <= found.upper, "{depth}: {found:?}");
            assert!((found.upper / scale - depth).abs() < radius, "{depth}: {found:?}");
        }
        // No group needs more than all together.
        let plan = CollidePlan::new(&CollideOptions::estimated(), &floor, &balls).unwrap();
        let whole = Pair::new(a, b).penetration(&plan, [HOLLOW; 2], &mut Scratch::default());
        assert!(told.iter().all(|(_, found)| found.upper <= whole.upper * 1.001), "{whole:?}");
    }

    // Balls of radius 0.2 in the top of a block. Most of the third is below: it is pulled out of a solid, and
    // pushed into a shell.
    let block = scene(&[(cuboid([6.0, 1.0, 1.0]), Pose::IDENTITY)], SPACING);
    let top = block.bounds().max[2];
    let sunk = [0.05, 0.15, 0.3];
    let balls: Vec<(Form, Pose)> = (-1_i32..)
        .zip(sunk)
        .map(|(i, depth)| (sphere(0.2), Pose::from_translation([2.0 * f64::from(i), 0.0, top + 0.2 - depth])))
        .collect();
    let balls = scene(&balls, SPACING);
    let (a, b) = (Placed::new(&block, &Pose::IDENTITY), Placed::new(&balls, &Pose::IDENTITY));
    for (interiors, last) in [([SOLID; 2], 0.3), ([HOLLOW; 2], 0.1)] {
        let told = depths(&list(&a, &b, &ClashOptions::default().with_depths(interiors)));
        for ((_, found), depth) in told.iter().zip([sunk[0], sunk[1], last]) {
            assert!((found.upper - depth).abs() < radius, "{interiors:?} {depth}: {found:?}");
            let lower = if interiors[0] == SOLID { depth - 1.5 * radius } else { 0.0 };
            assert!(
                found.lower >= lower && found.lower <= depth + radius,
                "{interiors:?} {depth}: {found:?}"
            );
        }
    }
}

/// The parts around a clash hold the points of its contacts, however far the places of these are; lower
/// bounds are those of each clash; and what leaves one surface of a solid must leave the solid.
#[test]
fn depths_of_balls_about_points_and_of_a_hollow_block() {
    let floor = scene(&[(patch(3.0, 1.5), Pose::IDENTITY)], 0.03);
    let at = |x: f64, z: f64| (sphere(0.3), Pose::from_translation([x, 0.0, z]));
    let balls = scene(&[at(-0.75, 0.05), at(0.75, 0.8)], 0.03);
    let (a, b) = (Placed::new(&floor, &Pose::IDENTITY), Placed::new(&balls, &Pose::IDENTITY));
    let options = ClashOptions::default().with_semantics(Semantics::Thickened(0.3));
    let told = depths(&list(&a, &b, &options.with_depths([Interior::Hollow; 2])));
    assert_eq!(told.len(), 2, "{told:?}");
    // Balls of radius 0.3 about the points meet up to a distance of 0.6.
    for ((_, found), exact) in told.iter().zip([0.85, 0.1]) {
        assert!((found.upper - exact).abs() < 0.03 && found.lower <= exact + 0.01, "{exact}: {found:?}");
        assert!(found.direction[2] > 0.9, "{exact}: {found:?}");
    }

    // A lower bound for all clashes together does not hold for one, also if a budget ends the search.
    for work in [100, 300, 1000, 2000, 3000, 5000, 10_000, 20_000] {
        let plan = ClashPlan::new(&options.with_depths([Interior::Hollow; 2]), &floor, &balls).unwrap();
        let pair = Pair::new(a, b).within(&Budget::UNLIMITED.with_work(work));
        let told = depths(&pair.clashes(&plan, &mut Scratch::default()));
        for (x, found) in told.iter().filter(|_| told.len() == 2) {
            assert!(found.lower <= if *x < 0.0 { 0.86 } else { 0.11 }, "{work}: {told:?}");
        }
    }

    // A ball in a small hollow of a large block, whose outer faces are not near the contacts.
    let block = scene(&[(cuboid([12.0; 3]), Pose::IDENTITY), (sphere(0.5), Pose::IDENTITY)], 0.1);
    let ball = scene(&[(sphere(0.5), Pose::IDENTITY)], 0.1);
    let pose = Pose::from_translation([0.1, 0.0, 0.0]);
    let (a, b) = (Placed::new(&block, &Pose::IDENTITY), Placed::new(&ball, &pose));
    let solid = [Interior::Solid, Interior::Hollow];
    let plan = CollidePlan::new(&CollideOptions::estimated(), &block, &ball).unwrap();
    let whole = Pair::new(a, b).penetration(&plan, solid, &mut Scratch::default());
    for (_, found) in depths(&list(&a, &b, &ClashOptions::default().with_depths(solid))) {
        assert!(found.upper > 6.3 && found.upper <= whole.upper, "out of the block: {found:?} {whole:?}");
    }
}

#[test]
#[expect(clippy::disallowed_methods, reason = "the test is about time")]
fn depths_end_with_their_budget() {
    let floor = scene(&[(patch(6.0, 2.0), Pose::IDENTITY)], 0.03);
    let place =
        |i: u32| Pose::from_translation([0.25 * f64::from(i % 20) - 2.4, 0.25 * f64::from(i / 20), 0.0]);
    let balls: Vec<(Form, Pose)> = (0..60).map(|i| (sphere(0.08), place(i))).collect();
    let balls = scene(&balls, 0.03);
    let pair = Pair::new(Placed::new(&floor, &Pose::IDENTITY), Placed::new(&balls, &Pose::IDENTITY));
    let plan = CollidePlan::new(&CollideOptions::estimated(), &floor, &balls).unwrap();
    let mut contacts = Contacts::default();
    let scratch = &mut Scratch::default();
    pair.contacts(&mut contacts).collide(&plan, scratch);
    let groups = ContactGroup::all(&contacts.contacts, 0.05);
    assert!(groups.len() >= 60, "{}", groups.len());
    let groups: Vec<&ContactGroup> = groups.iter().collect();
    let asked = (contacts.contacts.as_slice(), groups.as_slice());
    let deadline = Deadline::within(std::time::Duration::from_micros(1));
    let hasty = pair.within(&Budget::UNLIMITED.with_deadline(deadline));
    let mut shares = Vec::new();
    let start = std::time::Instant::now();
    let hollow = [Interior::Hollow; 2];
    let whole = hasty.penetration(&plan, hollow, scratch);
    let found = hasty.depths(asked, (&plan, hollow), &whole, &mut |share| shares.push(share));
    let in_haste = start.elapsed();
    assert!(shares.last() == Some(&1.0) && shares.is_sorted(), "{shares:?}");
    // No part is prepared: all answers are those of the whole scans.
    assert!(found.iter().all(|depth| depth == &found[0] && !depth.complete), "{found:?}");
    let whole = pair.penetration(&plan, hollow, scratch);
    let found = pair.depths(asked, (&plan, hollow), &whole, &mut |_| ());
    assert!(found.iter().all(|depth| depth.complete && depth.upper < 0.2), "{found:?}");
    assert!(in_haste < 2 * (start.elapsed() - in_haste), "{in_haste:?}");
    // Groups may be the caller's own.
    let strange = ContactGroup { contacts: vec![usize::MAX], ..groups[0].clone() };
    let odd = pair.depths((asked.0, &[&strange]), (&plan, hollow), &whole, &mut |_| ());
    assert!(odd[0].upper.is_finite(), "{odd:?}");
}

#[test]
fn depths_of_a_pipe_and_of_clearance_clashes() {
    // A pipe passes through a wall, and another one ends before it.
    let wall = scene(&[(patch(2.0, 2.0), Pose::IDENTITY)], 0.03);
    let pipes = [
        (cuboid([0.2, 0.2, 1.6]), Pose::from_translation([-0.5, 0.0, 0.1])),
        (cuboid([0.2, 0.2, 1.6]), Pose::from_translation([0.5, 0.0, 0.85])),
    ];
    let pipes = scene(&pipes, 0.03);
    let (a, b) = (Placed::new(&wall, &Pose::IDENTITY), Placed::new(&pipes, &Pose::IDENTITY));
    let options = ClashOptions::default().with_clearance(0.1).with_depths([Interior::Hollow; 2]);
    let found = list(&a, &b, &options);
    let [hard] = of_kind(&found, ClashKind::Hard)[..] else { panic!("{:?}", found.clashes) };
    let [near] = of_kind(&found, ClashKind::Clearance)[..] else { panic!("{:?}", found.clashes) };
    assert_eq!(near.depth, None);
    // It leaves sideways over the border of the wall, 0.6 away, sooner than along its axis.
    let depth = hard.depth.unwrap();
    assert!((depth.upper - 0.6).abs() < 0.04 && depth.direction[0] < -0.99, "{depth:?}");
    // A small budget still gives a shift that separates.
    let plan = ClashPlan::new(&options, &wall, &pipes).unwrap();
    let budget = Budget::UNLIMITED.with_work(200);
    let hasty = Pair::new(a, b).within(&budget).clashes(&plan, &mut Scratch::default());
    let depth = of_kind(&hasty, ClashKind::Hard)[0].depth;
    assert!(depth.is_none_or(|depth| depth.upper >= 0.5), "{depth:?}");
}
