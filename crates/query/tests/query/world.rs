//! Worlds against the loop over all pairs.
use std::sync::LazyLock;

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_geometry::{PointCloud, Pose};
use nearmiss_hierarchy::{BuildOptions, PointHierarchy};
use nearmiss_query::{
    Answer, Bodies, BodyId, CollideOptions, CollidePlan, DistanceOptions, DistancePlan, Evidence, Pair,
    Placed, Reason, Scratch, Semantics, Shape, Verdict, World,
};
use nearmiss_testdata::arbitrary::{self, CloudKind};
use proptest::prelude::*;
use rand::RngExt;

fn prepared(points: &[[f64; 3]]) -> PointHierarchy {
    let cloud = PointCloud::from_positions(points).unwrap();
    PointHierarchy::build(&cloud, &BuildOptions::default().with_leaf_size(8)).unwrap()
}

/// A sphere, noise, rings and a plate about the origin, and a sphere a million of its radii away
/// from it.
static SCANS: LazyLock<[PointHierarchy; 5]> = LazyLock::new(|| {
    let cloud = |kind| arbitrary::cloud(kind, 200, 1);
    let far: Vec<_> = cloud(CloudKind::Sphere).iter().map(|[x, y, z]| [x + 1e6, y - 2e6, z + 3e6]).collect();
    [
        prepared(&cloud(CloudKind::Sphere)),
        prepared(&cloud(CloudKind::Random)),
        prepared(&cloud(CloudKind::Rings)),
        prepared(&cloud(CloudKind::Coplanar)),
        prepared(&far),
    ]
});

fn options() -> [CollideOptions; 4] {
    let options = CollideOptions::estimated();
    [
        options,
        options.with_evidence(Evidence::Certified),
        options.with_margin(0.5),
        options.with_semantics(Semantics::Thickened(0.2)),
    ]
}

/// The bodies that a world should hold, in the order of their ids.
type Bodied = Vec<(BodyId, usize, Pose)>;

/// A valid pose that places the scan in a cube, whatever the scan's own origin; one in three is far
/// from the world's origin.
fn proper_pose(scan: usize, seed: u64) -> Pose {
    let rng = &mut arbitrary::rng(seed);
    let scale = [1.0, 0.3, 4.0, 1e3][usize::try_from(seed % 4).unwrap()];
    let spread = if scan == 2 { 30.0 } else { 6.0 };
    let turn = arbitrary::rotation(rng).with_scale(scale);
    let centre = Vector3::from(turn.apply(SCANS[scan].bounds().centre()));
    let away = if seed.is_multiple_of(3) { 1e6 } else { 0.0 };
    let place = Vector3::from(arbitrary::point_in(rng, spread)).add_scalar(away);
    turn.with_translation((place - centre).into())
}

/// Invalid poses, and poses at the limits of the number range.
fn hostile_pose(seed: u64) -> Pose {
    let nan = f64::NAN;
    let poses = [
        Pose::from_translation([nan, 0.0, 0.0]),
        Pose::from_translation([0.0, f64::INFINITY, 0.0]),
        Pose::from_translation([0.0, -f64::INFINITY, nan]),
        Pose::IDENTITY.with_scale(0.0),
        Pose::IDENTITY.with_scale(-1.0),
        Pose::IDENTITY.with_scale(nan),
        Pose::IDENTITY.with_scale(1e39),
        Pose::IDENTITY.with_scale(1e-300),
        Pose::from_axis_angle([1.0, 0.0, 0.0], nan),
        Pose::from_translation([1e160, 0.0, 0.0]),
        Pose::from_translation([1e120, -1e120, 0.0]),
        Pose::from_translation([-1e99, 1e99, 1e99]),
        Pose::from_translation([f64::MAX; 3]).with_scale(f64::MAX),
        (0..40).fold(Pose::from_axis_angle([1.0, 2.0, 3.0], 1.0), |pose, _| pose.after(&pose)),
    ];
    poses[usize::try_from(seed).unwrap() % poses.len()]
}

fn answer(placed: &Bodied, i: usize, j: usize, plan: &CollidePlan) -> Answer {
    let view = |k: usize| {
        let (_, scan, pose) = &placed[k];
        Placed::new(&SCANS[*scan], pose)
    };
    Pair::new(view(i), view(j)).collide(plan, &mut Scratch::default())
}

/// The near pairs of a world.
fn near(world: &World<&PointHierarchy>, bodies: Bodies<'_>, plan: &CollidePlan) -> Vec<[BodyId; 2]> {
    let mut pairs = Vec::new();
    world.near_pairs(bodies, plan.reach(), &mut pairs);
    pairs
}

/// The near pairs of a world, and whether they meet.
fn asked(
    world: &World<&PointHierarchy>,
    bodies: Bodies<'_>,
    plan: &CollidePlan,
) -> Vec<([BodyId; 2], Answer)> {
    let mut scratch = Scratch::default();
    let answer = |pair| (pair, world.pair(pair).unwrap().collide(plan, &mut scratch));
    near(world, bodies, plan).into_iter().map(answer).collect()
}

/// Compares the results of a world with the loop over all pairs. Returns the numbers of pairs and
/// of near pairs.
fn check(world: &World<&'static PointHierarchy>, placed: &Bodied, plan: &CollidePlan) -> [usize; 2] {
    let told = asked(world, Bodies::All, plan);
    assert!(told.is_sorted_by_key(|(pair, _)| *pair), "by ids");
    let mut remaining = told.iter();
    let mut pairs = 0;
    for (j, (b, ..)) in placed.iter().enumerate() {
        pairs += j;
        let told: Vec<_> = told.iter().filter(|(pair, _)| pair[1] == *b).collect();
        for (i, (a, ..)) in placed[..j].iter().enumerate() {
            let expected = answer(placed, i, j, plan);
            match told.iter().find(|(pair, _)| pair[0] == *a) {
                Some((_, answer)) => {
                    assert_eq!(*answer, expected, "{a:?} {b:?}");
                    remaining.next();
                }
                None => {
                    assert!(expected.verdict.is_separated(), "{a:?} {b:?} are left out, but {expected:?}")
                }
            }
        }
    }
    assert!(remaining.next().is_none(), "each pair once, of bodies that are there");

    // The pairs of some bodies are those of all pairs that contain one of them.
    let some: Vec<BodyId> = placed.iter().step_by(3).map(|(id, ..)| *id).collect();
    let of_some = near(world, Bodies::These(&some), plan);
    let all = near(world, Bodies::All, plan);
    let expected: Vec<_> =
        all.iter().filter(|pair| pair.iter().any(|id| some.contains(id))).copied().collect();
    assert_eq!(of_some, expected, "pairs of {some:?}");
    for (id, scan, pose) in placed {
        let mut with_itself = Vec::new();
        world.near(&Placed::new(&SCANS[*scan], pose), plan.reach(), &mut with_itself);
        let of_one: Vec<BodyId> = near(world, Bodies::These(&[*id]), plan)
            .iter()
            .map(|pair| if pair[0] == *id { pair[1] } else { pair[0] })
            .collect();
        assert!(with_itself.iter().filter(|other| *other != id).copied().eq(of_one), "{id:?}");
    }
    [pairs, told.len()]
}

#[derive(Debug, Clone)]
enum Change {
    Insert(usize, u64),
    Move(usize, u64),
    Remove(usize),
}

fn change() -> impl Strategy<Value = Change> {
    prop_oneof![
        3 => (0..5_usize, any::<u64>()).prop_map(|(scan, seed)| Change::Insert(scan, seed)),
        3 => (any::<usize>(), any::<u64>()).prop_map(|(which, seed)| Change::Move(which, seed)),
        1 => any::<usize>().prop_map(Change::Remove),
    ]
}

/// A pose of this scan; one in eight is hostile.
fn pose(scan: usize, seed: u64) -> Pose {
    if seed.is_multiple_of(8) { hostile_pose(seed / 8) } else { proper_pose(scan, seed) }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    #[test]
    fn whatever_changes_a_world_equals_the_loop(
        changes in prop::collection::vec(change(), 1..60),
        question in 0..4_usize,
    ) {
        let plan = CollidePlan::new(&options()[question], &SCANS[0], &SCANS[0]).unwrap();
        let mut world = World::new();
        let mut placed: Bodied = Vec::new();
        for change in changes {
            match change {
                Change::Insert(scan, seed) => {
                    let pose = pose(scan, seed);
                    let id = world.insert(&SCANS[scan], &pose);
                    prop_assert!(placed.iter().all(|(other, ..)| *other < id), "a new id");
                    placed.push((id, scan, pose));
                }
                Change::Move(which, seed) if !placed.is_empty() => {
                    let which = which % placed.len();
                    let (id, scan, pose_now) = &mut placed[which];
                    *pose_now = pose(*scan, seed);
                    prop_assert!(world.move_to(*id, pose_now));
                }
                Change::Remove(which) if !placed.is_empty() => {
                    let (id, scan, _) = placed.remove(which % placed.len());
                    prop_assert!(std::ptr::eq(world.remove(id).unwrap(), &SCANS[scan]));
                    prop_assert!(world.remove(id).is_none() && !world.move_to(id, &Pose::IDENTITY));
                    prop_assert!(world.placed(id).is_none() && world.pair([id, id]).is_none());
                }
                _ => {}
            }
            prop_assert_eq!(world.len(), placed.len());
        }
        prop_assert!(world.ids().eq(placed.iter().map(|(id, ..)| *id)));
        check(&world, &placed, &plan);
    }
}

/// A world of `count` bodies at valid poses.
fn crowd(count: u64) -> (World<&'static PointHierarchy>, Bodied) {
    let mut world = World::new();
    let mut placed = Vec::new();
    for seed in 0..count {
        let scan = usize::try_from(seed % 5).unwrap();
        let pose = proper_pose(scan, seed);
        placed.push((world.insert(&SCANS[scan], &pose), scan, pose));
    }
    (world, placed)
}

#[test]
fn a_crowd_equals_the_loop_and_much_is_left_out() {
    for options in options() {
        let (world, placed) = crowd(120);
        let plan = CollidePlan::new(&options, &SCANS[0], &SCANS[0]).unwrap();
        let [pairs, near] = check(&world, &placed, &plan);
        assert_eq!(pairs, 120 * 119 / 2);
        assert!(near > 100 && near < pairs / 2, "{near} of {pairs} are near");
    }
}

/// The world-space box of the corners of a scan's enclosure, by the formulas alone.
fn naive_bounds((_, scan, pose): &(BodyId, usize, Pose)) -> [[f64; 3]; 2] {
    let scan = &SCANS[*scan];
    let root = scan.enclosures().next().unwrap();
    let frame = scan.frame();
    let mut bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    for corner in 0..8 {
        let p = [0, 1, 2].map(|i| {
            let along = |k: usize| {
                let sign = if corner >> k & 1 == 0 { -1.0 } else { 1.0 };
                sign * f64::from(root.half[k]) * f64::from(root.axes[k][i])
            };
            let stored = f64::from(root.centre[i]) + along(0) + along(1) + along(2);
            frame.origin[i] + frame.scale * stored
        });
        let p = pose.apply(p);
        for k in 0..3 {
            bounds[0][k] = bounds[0][k].min(p[k]);
            bounds[1][k] = bounds[1][k].max(p[k]);
        }
    }
    bounds
}

#[test]
fn boxes_are_those_of_enclosures_and_no_larger() {
    let (world, placed) = crowd(200);
    for margin in [0.0, 0.5, 100.0] {
        let options = CollideOptions::estimated().with_margin(margin);
        let plan = CollidePlan::new(&options, &SCANS[0], &SCANS[0]).unwrap();
        let near = near(&world, Bodies::All, &plan);
        let mut seen = [0, 0];
        for (j, b) in placed.iter().enumerate() {
            for a in &placed[..j] {
                let (p, q) = (naive_bounds(a), naive_bounds(b));
                let bounds = world.bounds(a.0).unwrap();
                assert!(p.iter().all(|&corner| bounds.contains(corner)), "{p:?} in {bounds:?}");
                let gap = (0..3).map(|k| (p[0][k] - q[1][k]).max(q[0][k] - p[1][k])).fold(f64::MIN, f64::max);
                let size = [p, q].iter().map(|x| x[1][0] - x[0][0]).sum::<f64>();
                let is_near = near.binary_search(&[a.0, b.0]).is_ok();
                let allowed = 1e-4 * (size + margin) + 1e-7;
                if gap <= margin {
                    assert!(is_near, "{gap} apart within {margin}");
                } else if gap > margin + allowed {
                    assert!(!is_near, "{gap} apart beyond {margin}");
                }
                seen[usize::from(is_near)] += 1;
            }
        }
        assert!(seen.iter().all(|&n| n > 500), "{seen:?} at {margin}");
    }
}

#[test]
fn hostile_poses_are_near_everything_and_undecided() {
    let (mut world, mut placed) = crowd(12);
    for seed in 0..14 {
        let pose = hostile_pose(seed);
        placed.push((world.insert(&SCANS[0], &pose), 0, pose));
    }
    for options in options() {
        let plan = CollidePlan::new(&options, &SCANS[0], &SCANS[0]).unwrap();
        check(&world, &placed, &plan);
        let none = placed[12].0;
        let told = asked(&world, Bodies::These(&[none]), &plan);
        assert_eq!(told.len(), placed.len() - 1, "with all others");
        assert!(
            told.iter().all(|(_, answer)| answer.verdict == Verdict::Undecided(Reason::Pose)),
            "{told:?}"
        );
    }
    for (id, ..) in placed {
        assert!(world.remove(id).is_some());
    }
    assert!(world.is_empty());
}

#[test]
fn an_empty_world_and_one_of_a_single_body_say_nothing() {
    let plan = CollidePlan::new(&CollideOptions::estimated(), &SCANS[0], &SCANS[0]).unwrap();
    let mut world: World<&PointHierarchy> = World::new();
    let told = |world: &World<&PointHierarchy>| asked(world, Bodies::All, &plan);
    assert_eq!((world.len(), world.is_empty(), told(&world)), (0, true, vec![]));
    let id = world.insert(&SCANS[0], &Pose::IDENTITY);
    assert_eq!((world.len(), world.is_empty(), told(&world)), (1, false, vec![]));
    let mut ids = Vec::new();
    world.near(&world.placed(id).unwrap(), plan.reach(), &mut ids);
    assert_eq!(ids, [id], "what is not in the world meets what is");
    world.remove(id);
    let later = world.insert(&SCANS[0], &Pose::IDENTITY);
    assert!(later > id, "ids are not used again");
    assert_eq!(near(&world, Bodies::These(&[id, later]), &plan), [[id; 2]; 0]);
    assert!(world.pair([id, later]).is_none());
}

#[test]
fn one_scan_in_one_place_many_times() {
    let plan = CollidePlan::new(&CollideOptions::estimated(), &SCANS[0], &SCANS[0]).unwrap();
    let mut world = World::new();
    let ids: Vec<BodyId> = (0..40).map(|_| world.insert(&SCANS[0], &Pose::IDENTITY)).collect();
    let told = asked(&world, Bodies::All, &plan);
    assert_eq!(told.len(), 40 * 39 / 2);
    assert!(told.iter().all(|(_, answer)| answer.verdict.is_intersecting()));
    let twice = [ids[7], ids[3], ids[7]];
    assert_eq!(near(&world, Bodies::These(&twice), &plan).len(), 39 + 38, "a pair of two of them once");
}

#[test]
fn bodies_left_out_for_a_shape_do_not_touch_it() {
    let (world, placed) = crowd(200);
    let rng = &mut arbitrary::rng(7);
    let (mut ids, mut seen) = (Vec::new(), [0, 0]);
    for round in 0..300 {
        // Near a body, so that some touch.
        let (id, ..) = placed[round % placed.len()];
        let near = world.bounds(id).unwrap();
        let centre = [0, 1, 2].map(|k: usize| rng.random_range(near.min[k]..=near.max[k]));
        let size = near.half_extents()[0] * rng.random_range(0.01..0.5);
        let end = [0, 1, 2].map(|k: usize| centre[k] + rng.random_range(-size..=size));
        let pose = arbitrary::rotation(rng).with_translation(centre).with_scale(0.5);
        let shape = [
            Shape::Sphere { centre, radius: size },
            Shape::Capsule { ends: [centre, end], radius: 0.3 * size },
            Shape::Box { pose, half: [size, 0.5 * size, 0.1 * size], radius: 0.0 },
        ][round % 3];
        let reach = [0.0, size][round % 2];
        world.near_shape(&shape, reach, &mut ids);
        assert!(ids.is_sorted());
        for (id, ..) in &placed {
            let placed = world.placed(*id).unwrap();
            let is_near = placed.nearest(&shape, reach).is_some();
            assert!(!is_near || ids.binary_search(id).is_ok(), "{shape:?} and {id:?}");
            seen[usize::from(is_near)] += 1;
        }
    }
    assert!(seen[1] > 100 && seen[0] > seen[1], "{seen:?}");
    let nothing = Shape::Sphere { centre: [f64::NAN; 3], radius: 1.0 };
    world.near_shape(&nothing, 0.0, &mut ids);
    assert_eq!(ids.len(), placed.len(), "what is nowhere is left to the narrow phase");
}

#[test]
fn each_pair_has_its_own_reach() {
    let (world, placed) = crowd(60);
    // Bodies of one group are no pair; the others have a margin by their ids.
    let reaches = [0.0, 0.4, 0.8, 1.2, 1.6];
    let reach_of = |a: BodyId, b: BodyId| {
        let kind = usize::try_from((a.0 + b.0) % 5).unwrap();
        (a.0 % 3 != b.0 % 3).then(|| reaches[kind])
    };
    let (mut pairs, mut expected, mut near) = (Vec::new(), Vec::new(), Vec::new());
    for (i, (a, ..)) in placed.iter().enumerate() {
        for (b, ..) in &placed[i + 1..] {
            let pair = [*a.min(b), *a.max(b)];
            let Some(reach) = reach_of(pair[0], pair[1]) else { continue };
            world.near_pairs(Bodies::These(&[pair[0]]), reach, &mut near);
            if near.contains(&pair) {
                expected.push(pair);
            }
        }
    }
    expected.sort_unstable();
    world.near_pairs_by(Bodies::All, 1.6, reach_of, &mut pairs);
    assert_eq!(pairs, expected, "the same pairs as one by one");
    assert!(pairs.len() > 10, "{} pairs", pairs.len());
}

#[test]
fn the_nearest_pair_is_that_of_all_pairs() {
    let plan = DistancePlan::new(&DistanceOptions::default(), &SCANS[0], &SCANS[1]).unwrap();
    let (mut scratch, mut found) = (Scratch::default(), 0);
    for seed in 0..60_u64 {
        let mut world = World::new();
        let placed: Bodied = (0..6)
            .map(|k| {
                let scan = usize::try_from((seed + k) % 4).unwrap();
                let pose =
                    if k == 5 { hostile_pose(seed) } else { proper_pose(scan, 3 * (7 * seed + k) + 1) };
                (world.insert(&SCANS[scan], &pose), scan, pose)
            })
            .collect();
        // Neighbours do not count, as along the arm of a robot.
        let counts = |a: BodyId, b: BodyId| a.0.abs_diff(b.0) > 1;
        let reach = if seed % 3 == 0 { 2.0 } else { f64::INFINITY };
        let nearest = world.nearest_pair(Bodies::All, reach, counts, &plan, &mut scratch);
        let mut expected: Option<([BodyId; 2], f64, f64)> = None;
        let view = |k: usize| Placed::new(&SCANS[placed[k].1], &placed[k].2);
        for (i, j) in (0..6).flat_map(|i| (i + 2..6).map(move |j| (i, j))) {
            let all = Pair::new(view(i), view(j)).distance(&plan, &mut scratch);
            let is_near = all.upper < reach;
            if all.upper.is_finite() && is_near && expected.is_none_or(|(_, upper, _)| all.upper < upper) {
                expected = Some(([placed[i].0, placed[j].0], all.upper, all.lower));
            }
        }
        let Some((ids, upper, lower)) = expected else {
            assert!(nearest.is_none_or(|nearest| nearest.upper >= reach), "seed {seed}: {nearest:?}");
            continue;
        };
        let nearest = nearest.expect("a pair is near");
        assert_eq!((nearest.ids, nearest.upper), (ids, upper), "seed {seed}");
        assert!(nearest.lower <= lower && nearest.lower >= 0.0, "seed {seed}: {nearest:?}");
        let [p, q] = nearest.points.map(Vector3::from);
        assert!((p - q).norm() <= upper * (1.0 + 1e-9) + 1e-9, "seed {seed}: {nearest:?}");
        found += 1;
    }
    assert!(found > 40, "most worlds have a pair: {found}");
}
