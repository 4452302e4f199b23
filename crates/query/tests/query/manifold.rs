//! Contact manifolds: positions, depths, normals, and that no deeper point was missed.
use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_geometry::{PointCloud, PointId, Pose};
use nearmiss_hierarchy::{BuildOptions, PointHierarchy, PointKind};
use nearmiss_query::{
    Budget, CollideOptions, CollidePlan, ManifoldPoint, Pair, Placed, Scratch, Semantics, Verdict,
};
use nearmiss_testdata::arbitrary::{self, CloudKind};
use nearmiss_testdata::shapes::{Form, Sampling, cuboid, patch, shells, sphere};

fn prepared(points: &[[f64; 3]]) -> PointHierarchy {
    PointHierarchy::build(&PointCloud::cleaned(points).unwrap(), &BuildOptions::default()).unwrap()
}

fn sampled(form: Form, spacing: f64) -> PointHierarchy {
    prepared(&form.sample(Sampling::clean(spacing)).points)
}

/// The verdict and the manifold.
fn asked(
    scans: [&PointHierarchy; 2],
    poses: [Pose; 2],
    options: &CollideOptions,
) -> (Verdict, Vec<ManifoldPoint>) {
    let plan = CollidePlan::new(options, scans[0], scans[1]).unwrap();
    let [a, b] = [0, 1].map(|k: usize| Placed::new(scans[k], &poses[k]));
    let mut places = Vec::new();
    let answer = Pair::new(a, b).manifold(&mut places).collide(&plan, &mut Scratch::default());
    (answer.verdict, places)
}

fn lifted(height: f64) -> Pose {
    Pose::from_translation([0.013, -0.017, height])
}

fn length(v: [f64; 3]) -> f64 {
    Vector3::from(v).norm()
}

#[test]
fn a_ball_in_a_floor_is_as_deep_as_it_is() {
    let (ball, floor) = (sampled(sphere(1.0), 0.05), sampled(patch(4.0, 4.0), 0.05));
    for depth in [0.01, 0.03, 0.06] {
        let poses = [lifted(1.0 - depth), Pose::IDENTITY];
        let (verdict, places) = asked([&ball, &floor], poses, &CollideOptions::estimated());
        assert!(verdict.is_intersecting(), "{depth}");
        let first = places[0];
        // A point of the ball is within the sagitta of half a spacing from its pole.
        assert!((first.gap + depth).abs() < 1e-3, "{depth}: {first:?}");
        for place in &places {
            let [x, y, z] = place.point;
            assert!(place.normal[2] > 0.92 && (length(place.normal) - 1.0).abs() < 1e-6, "{place:?}");
            assert!(z.abs() <= depth && x.hypot(y) < (2.0 * depth).sqrt() + 0.05, "{place:?}");
            assert!(place.gap <= 0.0 && place.gap >= first.gap);
        }
        // With the scans swapped, the normal is reversed.
        let (_, turned) = asked([&floor, &ball], [poses[1], poses[0]], &CollideOptions::estimated());
        assert!((turned[0].gap - first.gap).abs() < 1e-6 && turned[0].normal[2] < -0.92, "{turned:?}");
    }
}

#[test]
fn the_places_under_a_box_are_spread() {
    let (brick, floor) = (sampled(cuboid([1.0, 0.6, 0.4]), 0.03), sampled(patch(4.0, 4.0), 0.03));
    let (_, places) = asked([&brick, &floor], [lifted(0.19), Pose::IDENTITY], &CollideOptions::estimated());
    assert_eq!(places.len(), 8);
    // There is a manifold point near each corner of the face.
    for (x, y) in [(0.5, 0.3), (-0.5, 0.3), (0.5, -0.3), (-0.5, -0.3)] {
        let corner = |place: &&ManifoldPoint| (place.point[0] - x).hypot(place.point[1] - y) < 0.25;
        let near = places.iter().find(corner).unwrap_or_else(|| panic!("none at {x} {y}: {places:?}"));
        assert!((-0.0101..0.0).contains(&near.gap), "{near:?}");
    }
    // Slightly more because of the normals next to the edges, which are rounded.
    assert!((places[0].gap + 0.01).abs() < 2e-4, "{places:?}");
    for (i, p) in places.iter().enumerate() {
        for q in &places[..i] {
            assert!(length([0, 1, 2].map(|k| p.point[k] - q.point[k])) >= floor.sampling_radius());
        }
    }
}

#[test]
fn a_solver_that_goes_the_way_out_gets_out() {
    let (ball, room) = (sampled(sphere(0.3), 0.03), sampled(shells(0.9, 1.0), 0.03));
    // A ball inside a hollow ball, near both sides of its wall.
    let mut at = Vector3::new(0.35, 0.45, 0.23).normalize() * 0.63;
    let start = at.norm();
    let mut steps = 0;
    loop {
        let poses = [Pose::from_translation(at.into()), Pose::IDENTITY];
        let (verdict, places) = asked([&ball, &room], poses, &CollideOptions::estimated());
        if !verdict.is_intersecting() {
            assert!(places.is_empty());
            break;
        }
        let deepest = places[0];
        at += Vector3::from(deepest.normal) * (1e-4 - deepest.gap.min(0.0));
        steps += 1;
        assert!(steps < 30, "{at} {deepest:?}");
    }
    assert!(start - at.norm() > 0.02 && at.norm() > 0.58 && steps > 0, "{start} {} {steps}", at.norm());
}

#[test]
fn normals_that_lead_out_tell_the_way() {
    let shell = sampled(sphere(1.0), 0.05);
    let mut solid = sampled(sphere(1.0), 0.05);
    let outwards: Vec<[f32; 3]> = solid.positions().to_vec();
    solid.turn_normals(&outwards);
    let ball = sampled(sphere(0.2), 0.02);
    let inside = [Pose::from_translation([0.0, 0.0, 0.82]), Pose::IDENTITY];
    // For a shell, the centre of the ball decides: the ball is inside. From a solid, the ball is
    // pushed out.
    let (_, places) = asked([&ball, &shell], inside, &CollideOptions::estimated());
    assert!(places[0].normal[2] < -0.95 && (places[0].gap + 0.02).abs() < 5e-3, "{places:?}");
    let (_, places) = asked([&ball, &solid], inside, &CollideOptions::estimated());
    assert!(places[0].normal[2] > 0.5 && places[0].gap < -0.02, "{places:?}");
    // The same from the side of the ball, which has no oriented normals.
    let (_, places) = asked([&solid, &ball], [inside[1], inside[0]], &CollideOptions::estimated());
    assert!(places[0].normal[2] < -0.5 && places[0].gap < -0.02, "{places:?}");
}

#[test]
fn within_a_margin_gaps_are_positive() {
    let (ball, floor) = (sampled(sphere(1.0), 0.05), sampled(patch(4.0, 4.0), 0.05));
    let options = CollideOptions::estimated().with_margin(0.1);
    let (verdict, places) = asked([&ball, &floor], [lifted(1.04), Pose::IDENTITY], &options);
    assert!(verdict.is_intersecting());
    assert!((places[0].gap - 0.04).abs() < 1e-3 && places.len() > 3, "{places:?}");
    assert!(places.iter().all(|place| place.gap <= 0.1 && place.normal[2] > 0.9), "{places:?}");
}

/// For every point of either scan the nearest point of the other by brute force, as (of b, i, j).
fn neighbours(views: &[Placed<'_>; 2]) -> Vec<(bool, usize, usize)> {
    let points = [0, 1].map(|k: usize| -> Vec<Vector3<f64>> {
        (0..views[k].scan().len()).map(|i| views[k].point(i).into()).collect()
    });
    let nearest = |p: &Vector3<f64>, others: &[Vector3<f64>]| {
        let distance = |j: &usize| (p - others[*j]).norm();
        (0..others.len()).min_by(|i, j| distance(i).total_cmp(&distance(j))).unwrap()
    };
    let of_a = points[0].iter().enumerate().map(|(i, p)| (false, i, nearest(p, &points[1])));
    let of_b = points[1].iter().enumerate().map(|(j, q)| (true, nearest(q, &points[0]), j));
    of_a.chain(of_b).collect()
}

#[test]
fn nothing_deeper_is_left_out() {
    let kinds = [CloudKind::Sphere, CloudKind::Lattice, CloudKind::Clustered, CloudKind::Rings];
    let rng = &mut arbitrary::rng(4);
    let mut met = [0, 0];
    for round in 0..120_u32 {
        let kind = kinds[round as usize % 4];
        let scans = [400, 300].map(|n| prepared(&arbitrary::cloud(kind, n, u64::from(n + round % 7))));
        let size = scans[0].bounds().half_extents().into_iter().fold(0.0, f64::max);
        let scale = [1.0, 1e-3, 1e3][round as usize % 3];
        let poses = [arbitrary::pose(rng, 1.2 * size), arbitrary::pose(rng, 1.2 * size)]
            .map(|pose| Pose::IDENTITY.with_scale(scale).after(&pose));
        let r = scans.iter().map(PointHierarchy::sampling_radius).fold(0.0, f64::max) * scale;
        let balls = round % 2 == 1;
        let semantics = if balls { Semantics::Thickened(0.4 * r) } else { Semantics::Surface };
        let options = CollideOptions::estimated().with_semantics(semantics);
        let (verdict, places) = asked([&scans[0], &scans[1]], poses, &options);
        let Verdict::Intersecting { contact, .. } = verdict else {
            assert!(places.is_empty(), "round {round}");
            continue;
        };
        met[usize::from(balls)] += 1;
        let views = [Placed::new(&scans[0], &poses[0]), Placed::new(&scans[1], &poses[1])];
        let heights = neighbours(&views).into_iter().filter_map(|(of_b, i, j)| {
            let between = Vector3::from(views[0].point(i)) - Vector3::from(views[1].point(j));
            if balls {
                return Some(between.norm() - 0.8 * r).filter(|gap| *gap <= 0.0);
            }
            let sound = |kind| matches!(kind, PointKind::Sheet | PointKind::Edge);
            if !(sound(scans[0].kind(i)) && sound(scans[1].kind(j))) || between.norm() > r {
                return None;
            }
            let (side, k) = if of_b { (0, i) } else { (1, j) };
            let normal = scans[side].normals()[k].map(f64::from);
            let height = Vector3::from(views[side].stored_to_world().rotate(normal)).dot(&between).abs();
            let disc = f64::from(scans[side].discs().get(k)) * views[side].stored_to_world().scale();
            (between.norm_squared() - height * height <= disc * disc).then_some(height)
        });
        let heights: Vec<f64> = heights.collect();
        let tolerance = 1e-5 * size * scale;
        for place in &places {
            let known = heights.iter().any(|height| (height.abs() - place.gap.abs()).abs() < tolerance);
            let alone = places.len() == 1 && place.point == contact.point;
            assert!(known || alone, "round {round}, {kind:?}: {place:?}");
            assert!((length(place.normal) - 1.0).abs() < 1e-6, "{place:?}");
        }
        if balls {
            let least = heights.iter().copied().fold(f64::INFINITY, f64::min);
            assert!((places[0].gap - least).abs() < tolerance, "round {round}: {least} {:?}", places[0]);
        }
    }
    assert!(met[0] > 15 && met[1] > 15, "{met:?}");
}

#[test]
fn a_budget_leaves_at_least_the_contact() {
    let (ball, floor) = (sampled(sphere(1.0), 0.05), sampled(patch(4.0, 4.0), 0.05));
    let plan = CollidePlan::new(&CollideOptions::estimated(), &ball, &floor).unwrap();
    let (a, b) = (Placed::new(&ball, &lifted(0.97)), Placed::new(&floor, &Pose::IDENTITY));
    let (mut scratch, mut places) = (Scratch::default(), Vec::new());
    let mut counts = Vec::new();
    for work in [64, 128, 256, 512, 1024, 4096] {
        let pair = Pair::new(a, b).within(&Budget::UNLIMITED.with_work(work));
        let answer = pair.manifold(&mut places).collide(&plan, &mut scratch);
        assert_eq!(answer.verdict.is_intersecting(), !places.is_empty(), "{work}");
        if let Verdict::Intersecting { contact, .. } = answer.verdict {
            let [PointId(_), PointId(_)] = contact.sources;
            counts.push(places.len());
        }
    }
    assert!(counts.len() > 2 && counts.last() > Some(&3), "{counts:?}");
}
