//! Sweeps of two meshes against exact impact times, and against all pairs of triangles on random motions.

use std::f64::consts::PI;

use nearmiss_geometry::{Motion, Pose, Screw, TriangleMesh};
use nearmiss_hierarchy::{MeshBuildOptions, MeshHierarchy};
use nearmiss_mesh::triangle_distance;
use nearmiss_query::{
    Budget, MeshSweep, PlanError, Scratch, SweepAnswer, SweepOptions, SweepPlan, SweepReason, SweepVerdict,
};
use nearmiss_testdata::arbitrary::{rng, rotation, unit_vector};

use crate::mesh_scan_penetration::box_mesh;
use crate::meshes::soup;

fn prepare(mesh: &TriangleMesh) -> MeshHierarchy {
    MeshHierarchy::build(mesh, &MeshBuildOptions::default()).unwrap()
}

fn ask(meshes: [&MeshHierarchy; 2], motions: [&Motion; 2], clearance: f64) -> SweepAnswer {
    let plan = SweepPlan::of_meshes(&SweepOptions::default().with_clearance(clearance)).unwrap();
    MeshSweep::new(meshes, motions).first_impact(&plan, &mut Scratch::default())
}

fn through(poses: &[Pose]) -> Motion {
    Motion::through(poses).unwrap()
}

fn at(x: f64, y: f64, z: f64) -> Pose {
    Pose::from_translation([x, y, z])
}

/// The impact must be that at `time`, up to the band. `speed` is that of what meets.
fn meets(answer: &SweepAnswer, time: f64, speed: f64) {
    let SweepVerdict::Impact { t_free, t_hit, .. } = answer.verdict else { panic!("{answer:?}") };
    let band = answer.band / speed;
    assert!(t_free <= time && t_hit >= time - 1e-9, "expected {time}, got {answer:?}");
    assert!(time - t_free <= band && t_hit - time <= band, "expected {time}, got {answer:?}");
}

#[test]
fn boxes_meet_when_their_faces_or_corners_do() {
    let (a, b) = (box_mesh([1.0, 2.0, 3.0]), box_mesh([0.5; 3]));
    let still = Motion::still(Pose::IDENTITY);
    let head_on = through(&[at(6.5, 0.1, 0.2), at(-6.5, 0.1, 0.2)]);
    meets(&ask([&a, &b], [&still, &head_on], 0.0), 5.0 / 13.0, 13.0);
    meets(&ask([&b, &a], [&head_on, &still], 0.0), 5.0 / 13.0, 13.0);
    meets(&ask([&a, &b], [&still, &head_on], 0.7), 4.3 / 13.0, 13.0);
    // In another unit and frame, in which lengths are 2.5 times as great.
    let world =
        Pose::from_axis_angle([1.0, 1.0, 0.0], 0.7).with_scale(2.5).with_translation([9.0, 2.0, -3.0]);
    let [still, moved] = [
        Motion::still(world),
        through(&[at(6.5, 0.1, 0.2), at(-6.5, 0.1, 0.2)].map(|pose| world.after(&pose))),
    ];
    meets(&ask([&a, &b], [&still, &moved], 1.75), 4.3 / 13.0, 13.0 * 2.5);
    // A corner of the small box, which stands on its edge, meets the lid of the large one.
    let still = Motion::still(Pose::IDENTITY);
    let turned = Pose::from_axis_angle([1.0, 0.0, 0.0], PI / 4.0);
    let lowered =
        through(&[turned.with_translation([0.0, 0.0, 8.0]), turned.with_translation([0.0, 0.0, 2.0])]);
    meets(&ask([&a, &b], [&still, &lowered], 0.0), (5.0 - 0.5_f64.sqrt()) / 6.0, 6.0);
    // It turns about the vertical through its centre, 0.2 from a wall, which its edge reaches.
    let spun = Motion::of_screw(Screw::new(at(1.7, 0.0, 0.0), [0.0, 0.0, PI / 4.0], [0.0; 3]));
    let exact = ((0.7_f64 / 0.5_f64.sqrt()).asin() - PI / 4.0) / (PI / 4.0);
    meets(&ask([&a, &b], [&still, &spun], 0.0), exact, PI / 4.0 * 0.1);
}

#[test]
fn free_motions_tell_how_far_apart_they_stay() {
    let (a, b) = (box_mesh([1.0; 3]), box_mesh([0.5; 3]));
    let still = Motion::still(Pose::IDENTITY);
    // Along a face, at 0.25 from it, then away from it.
    let past = through(&[at(1.75, -5.0, 0.0), at(1.75, 5.0, 0.0), at(6.0, 5.0, 0.0)]);
    let answer = ask([&a, &b], [&still, &past], 0.0);
    let SweepVerdict::Free { clearance, upper, at: time } = answer.verdict else { panic!("{answer:?}") };
    assert!((0.75 * 0.25..=0.25).contains(&clearance), "{answer:?}");
    assert!((0.25..0.4).contains(&upper) && (0.3..0.7).contains(&time), "{answer:?}");
    assert!(ask([&a, &b], [&still, &past], 0.249).verdict.is_free());
    assert!(ask([&a, &b], [&still, &past], 0.251).verdict.is_impact());
    // One that is inside the other one touches nothing.
    let inside = through(&[at(-0.2, 0.0, 0.0), at(0.2, 0.0, 0.0)]);
    assert!(ask([&a, &b], [&still, &inside], 0.0).verdict.is_free());
    let plan = SweepPlan::of_meshes(&SweepOptions::default()).unwrap();
    let sweep = MeshSweep::new([&a, &b], [&still, &past]).within(&Budget::UNLIMITED.with_work(20));
    let answer = sweep.first_impact(&plan, &mut Scratch::default());
    let SweepVerdict::Undecided { t_free, reason: SweepReason::Budget } = answer.verdict else {
        panic!("{answer:?}")
    };
    assert!(t_free < 2.0, "{answer:?}");
    let refused = SweepPlan::of_meshes(&SweepOptions::default().with_clearance(-1.0));
    assert!(matches!(refused, Err(PlanError::Margin(_))), "{refused:?}");
}

/// The distance of the meshes at a time, from all pairs of their triangles.
fn apart(meshes: [&TriangleMesh; 2], motions: [&Motion; 2], time: f64) -> f64 {
    let [a, b] = [0, 1].map(|k| {
        let pose = motions[k].at(time);
        let placed: Vec<[f64; 3]> = meshes[k].vertices().iter().map(|&p| pose.apply(p)).collect();
        let corners = |triangle: &[u32; 3]| triangle.map(|v| placed[v as usize]);
        meshes[k].triangles().iter().map(corners).collect::<Vec<_>>()
    });
    a.iter().flat_map(|a| b.iter().map(|b| triangle_distance(a, b).distance)).fold(f64::INFINITY, f64::min)
}

#[test]
fn answers_agree_with_all_pairs_of_triangles_at_many_times() {
    const STEPS: u32 = 150;
    let rng = &mut rng(4117);
    let (mut free, mut hits, mut near) = (0, 0, 0);
    for round in 0..60 {
        let meshes = [soup(rng, 10, 1.0, 0.4, [0.0; 3]), soup(rng, 6, 0.3, [0.2, 0.01][round % 2], [0.0; 3])];
        let prepared = meshes.each_ref().map(prepare);
        let scale = [1.0, 0.01, 300.0][round % 3];
        let mut motion = |spread: f64| {
            let mut pose = || {
                let way = unit_vector(rng).map(|x| scale * spread * x);
                rotation(rng).with_scale(scale).with_translation(way)
            };
            through(&[pose(), pose()])
        };
        let motions = [motion(0.3), motion(1.6)];
        let motions = motions.each_ref();
        let wanted = [0.0, 0.1 * scale][round / 2 % 2];
        let answer = ask(prepared.each_ref(), motions, wanted);
        let (band, rounding) = (answer.band, 1e-9 * scale);
        let times = (0..=STEPS).map(|step| f64::from(step) / f64::from(STEPS));
        let found: Vec<[f64; 2]> = times.map(|t| [t, apart(meshes.each_ref(), motions, t)]).collect();
        let least = found.iter().map(|[_, d]| *d).fold(f64::INFINITY, f64::min);
        let free_until = |end: f64| {
            for [time, distance] in found.iter().filter(|[time, _]| *time <= end) {
                assert!(*distance > wanted - rounding, "round {round}: {distance} at {time}, {answer:?}");
            }
        };
        match answer.verdict {
            SweepVerdict::Free { clearance, upper, at } => {
                free += 1;
                free_until(1.0);
                assert!(clearance >= wanted && least >= clearance - rounding, "{least}, {answer:?}");
                let there = apart(meshes.each_ref(), motions, at);
                assert!((upper - there).abs() < rounding && upper >= clearance, "{there}, {answer:?}");
            }
            SweepVerdict::Impact { t_free, t_hit, contact, .. } => {
                hits += 1;
                free_until(t_free);
                let there = apart(meshes.each_ref(), motions, t_hit);
                assert!(there <= wanted + rounding, "round {round}: {there} at {t_hit}, {answer:?}");
                assert!(contact.residual <= 0.5 * wanted + rounding, "{answer:?}");
                // Nothing moves further than the band meanwhile, unless they stay near all the time.
                let between = 0.5 * (t_free + t_hit);
                let there = apart(meshes.each_ref(), motions, between);
                assert!(there <= wanted + 2.0 * band, "round {round}: {there} at {between}, {answer:?}");
            }
            SweepVerdict::Undecided { t_free, reason } => {
                near += 1;
                free_until(t_free);
                assert_eq!(reason, SweepReason::Near, "round {round}: {answer:?}");
                assert!(least <= wanted + 2.0 * band, "round {round}: {least}, {answer:?}");
            }
        }
    }
    assert!(free > 10 && hits > 10 && near < 3, "{free} free, {hits} hits, {near} near");
}
