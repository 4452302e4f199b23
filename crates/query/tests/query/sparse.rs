//! Isolated points and points on lines: a near miss of them leaves the query undecided, and nothing
//! else does.
use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_geometry::{PointCloud, Pose};
use nearmiss_hierarchy::{BuildOptions, PointHierarchy};
use nearmiss_query::{CollideOptions, CollidePlan, Pair, Placed, Reason, Scratch, Semantics, Verdict};
use nearmiss_testdata::{arbitrary, oracle};

fn prepared(points: &[[f64; 3]]) -> PointHierarchy {
    PointHierarchy::build(&PointCloud::from_positions(points).unwrap(), &BuildOptions::default()).unwrap()
}

fn ask(a: &Placed<'_>, b: &Placed<'_>) -> Verdict {
    let surfaces = CollideOptions::estimated().with_semantics(Semantics::Surface);
    let plan = CollidePlan::new(&surfaces, a.scan(), b.scan()).unwrap();
    Pair::new(*a, *b).collide(&plan, &mut Scratch::default()).verdict
}

/// A patch with a wire above it and an isolated point above that.
fn scene(seed: u64) -> Vec<[f64; 3]> {
    let mut rng = arbitrary::rng(seed);
    let patch = (0..900).map(|_| arbitrary::point_in(&mut rng, 1.0)).map(|[x, y, _]| [x, y, 0.0]);
    let mut points: Vec<[f64; 3]> = patch.collect();
    points.extend((0..300).map(|i| [f64::from(i) * 0.01 - 1.5, 0.2, 1.0]));
    points.push([0.3, -0.4, 2.0]);
    points
}

/// The least ratio of distance to reach between points with balls and the discs or points of the
/// other scan.
fn nearest_ball(a: &Placed<'_>, b: &Placed<'_>) -> f64 {
    let all = |view: &Placed<'_>| -> Vec<(oracle::Disc, f64)> {
        let (scan, scale) = (view.scan(), view.stored_to_world().scale());
        let disc = |i: usize| oracle::Disc {
            centre: view.point(i),
            normal: view.stored_to_world().rotate(scan.normals()[i].map(f64::from)),
            radius: f64::from(scan.discs().get(i)) * scale,
        };
        let ball = |i: usize| f64::from(scan.arrays().ball(i)) * scale;
        (0..scan.len()).map(|i| (disc(i), ball(i))).collect()
    };
    let off = |p: &oracle::Disc, (q, ball): &(oracle::Disc, f64)| {
        let d = Vector3::from(p.centre) - Vector3::from(q.centre);
        let height = d.dot(&Vector3::from(q.normal));
        let beside = (d - height * Vector3::from(q.normal)).norm();
        let radius = if *ball > 0.0 { 0.0 } else { q.radius };
        height.hypot((beside - radius).max(0.0))
    };
    let mut least = f64::INFINITY;
    let others = all(b);
    for p in &all(a) {
        for q in &others {
            let in_p = if p.1 > 0.0 { off(&p.0, q) / p.1 } else { f64::INFINITY };
            let in_q = if q.1 > 0.0 { off(&q.0, p) / q.1 } else { f64::INFINITY };
            least = least.min(in_p).min(in_q);
        }
    }
    least
}

#[test]
fn who_comes_near_a_wire_or_a_lone_point_leaves_it_open() {
    let a = prepared(&scene(1));
    let probe = prepared(&arbitrary::cloud(arbitrary::CloudKind::Sphere, 600, 2));
    let mut rng = arbitrary::rng(7);
    let (mut open, mut apart) = (0, 0);
    for _ in 0..400 {
        let place = arbitrary::point_in(&mut rng, 1.2);
        let pose = arbitrary::rotation(&mut rng).with_scale(0.3);
        let pose = pose.with_translation([place[0], place[1], 1.2 + place[2]]);
        let (va, vb) = (Placed::new(&a, &Pose::IDENTITY), Placed::new(&probe, &pose));
        for verdict in [ask(&va, &vb), ask(&vb, &va)] {
            if verdict.is_intersecting() {
                continue;
            }
            let near = nearest_ball(&va, &vb);
            let is_open = verdict == Verdict::Undecided(Reason::Undersampled);
            if near < 0.999 {
                assert!(is_open, "{near} of a ball: {verdict:?}");
                open += 1;
            } else if near > 1.001 {
                assert!(!is_open, "{near} of a ball: {verdict:?}");
                apart += u32::from(verdict.is_separated());
            }
        }
    }
    assert!(open > 50 && apart > 100, "{open} open, {apart} apart");
}
