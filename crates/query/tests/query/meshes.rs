//! Queries of two meshes against all pairs of their triangles.

use nearmiss_geometry::{Pose, TriangleMesh};
use nearmiss_hierarchy::{MeshBuildOptions, MeshHierarchy};
use nearmiss_mesh::{Corners, triangle_distance, triangles_meet};
use nearmiss_query::{Budget, MeshHint, MeshPair, MeshScratch, PlacedMesh};
use nearmiss_testdata::arbitrary::{point_in, pose, rng};
use nearmiss_testdata::instructions::levels;
use rand::RngExt;

type Random = rand_xoshiro::Xoshiro256PlusPlus;

/// The index and the corners of each triangle that the build kept.
fn kept(mesh: &TriangleMesh, prepared: &MeshHierarchy) -> Vec<(u32, Corners)> {
    let view = prepared.arrays();
    let mut all: Vec<_> = view
        .source
        .iter()
        .map(|&i| (i, mesh.triangles()[i as usize].map(|v| mesh.vertices()[v as usize])))
        .collect();
    all.sort_by_key(|(i, _)| *i);
    all
}

/// The pairs of triangles that meet, and the least distance of any, by comparing all.
fn brute(meshes: [&[(u32, Corners)]; 2], poses: &[Pose; 2]) -> (Vec<[u32; 2]>, f64) {
    let relative = poses[0].inverse().after(&poses[1]);
    let (mut met, mut least) = (Vec::new(), f64::INFINITY);
    for (i, a) in meshes[0] {
        for (j, b) in meshes[1] {
            let b = b.map(|p| relative.apply(p));
            if triangles_meet(a, &b) {
                met.push([*i, *j]);
            }
            least = least.min(triangle_distance(a, &b).distance * poses[0].scale());
        }
    }
    (met, least)
}

/// Compares every answer with that of all pairs of triangles. Returns `true` if the meshes meet.
fn check(meshes: &[TriangleMesh; 2], poses: &[Pose; 2]) -> bool {
    let prepared =
        meshes.each_ref().map(|mesh| MeshHierarchy::build(mesh, &MeshBuildOptions::default()).unwrap());
    let kept = [kept(&meshes[0], &prepared[0]), kept(&meshes[1], &prepared[1])];
    let (expected, least) = brute([&kept[0], &kept[1]], poses);
    let pair =
        MeshPair::new(PlacedMesh::new(&prepared[0], &poses[0]), PlacedMesh::new(&prepared[1], &poses[1]));
    let mut hint = MeshHint::default();
    for level in levels() {
        let scratch = &mut MeshScratch::by_level(level);
        let answer = pair.collide(scratch);
        assert_eq!(answer.verdict.is_intersecting(), !expected.is_empty(), "{poses:?}");
        assert_eq!(answer.verdict.is_separated(), expected.is_empty(), "{answer:?}");
        let mut contacts = Vec::new();
        let (all, complete) = pair.contacts(&mut contacts, scratch);
        let mut found: Vec<_> = contacts.iter().map(|contact| contact.triangles).collect();
        found.sort_unstable();
        assert!(complete && found == expected, "{found:?}, expected {expected:?}");
        assert_eq!(all.verdict.is_intersecting(), !expected.is_empty(), "{all:?}");
        let distance = pair.distance(scratch);
        assert!(distance.complete && distance.lower == distance.upper, "{distance:?}");
        assert!((distance.upper - least).abs() <= 1e-9 * least, "{distance:?}, expected {least}");
        let length = (0..3).map(|k| (distance.points[1][k] - distance.points[0][k]).powi(2)).sum::<f64>();
        let far: f64 = distance.points.iter().flatten().map(|x| x.abs()).sum();
        assert!((length.sqrt() - least).abs() <= 1e-9 * least + 1e-13 * far, "{distance:?}");
        for _ in 0..2 {
            let hinted = pair.collide_hinted(&mut hint, scratch);
            assert_eq!(hinted.verdict.is_intersecting(), !expected.is_empty(), "{hinted:?}");
            assert_eq!(pair.distance_hinted(&mut hint, scratch).upper, distance.upper, "with a hint");
        }
        // Under any budget the bounds hold, and a verdict is right.
        for work in [0, 1, 20, 100] {
            let pair = pair.within(&Budget::UNLIMITED.with_work(work));
            let distance = pair.distance(scratch);
            assert!(distance.lower <= least * (1.0 + 1e-9), "{distance:?}, expected {least}");
            assert!(distance.upper >= least * (1.0 - 1e-9), "{distance:?}, expected {least}");
            let verdict = pair.collide(scratch).verdict;
            assert!(!verdict.is_intersecting() || !expected.is_empty(), "{work} units: {verdict:?}");
            assert!(!verdict.is_separated() || expected.is_empty(), "{work} units: {verdict:?}");
        }
    }
    !expected.is_empty()
}

/// Triangles anywhere within `half`, of about `size`.
pub(crate) fn soup(rng: &mut Random, count: u32, half: f64, size: f64, origin: [f64; 3]) -> TriangleMesh {
    let mut vertices = Vec::new();
    for _ in 0..count {
        let place = point_in(rng, half);
        let flat = rng.random_bool(0.2);
        for _ in 0..3 {
            let [x, y, z] = point_in(rng, size);
            // Some are needles.
            let away = if flat { [x, 1e-6 * y, 1e-9 * z] } else { [x, y, z] };
            vertices.push([0, 1, 2].map(|k| origin[k] + place[k] + away[k]));
        }
    }
    let triangles = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    TriangleMesh::new(vertices, triangles).unwrap()
}

/// A height field over a lattice with heights of 0 or 1, so that copies of it touch in corners,
/// along edges and in faces. Some triangles are repeated, some have no area.
fn steps(rng: &mut Random, side: u32) -> TriangleMesh {
    let mut vertices = Vec::new();
    for i in 0..side * side {
        let (x, y) = (f64::from(i % side), f64::from(i / side));
        vertices.push([x, y, f64::from(rng.random_range(0..2_u8))]);
    }
    let mut triangles = Vec::new();
    for i in (0..side * (side - 1)).filter(|i| i % side + 1 < side) {
        triangles.extend([[i, i + 1, i + side], [i + 1, i + side + 1, i + side]]);
        if rng.random_bool(0.1) {
            triangles.extend([[i + side, i, i + 1], [i, i, i + 1]]);
        }
    }
    TriangleMesh::new(vertices, triangles).unwrap()
}

#[test]
fn soups_answer_as_all_pairs_of_triangles_do() {
    let rng = &mut rng(2201);
    let mut hits = 0;
    for round in 0..150 {
        let origin = [[0.0; 3], [5e6, -2e6, 100.0]][round % 2];
        let count = |rng: &mut Random| rng.random_range(1..80);
        let meshes = [(count(rng), [0.1, 0.4][round % 2], [0.0; 3]), (count(rng), 0.2, origin)]
            .map(|(count, size, origin)| soup(rng, count, 1.0, size, origin));
        let mut poses = [pose(rng, 0.7), pose(rng, 0.7)];
        // The second mesh is far from the origin of its own frame.
        let shift = poses[1].rotate(origin.map(|x| -x));
        let placed = poses[1].translation();
        poses[1] = poses[1].with_translation([0, 1, 2].map(|k| placed[k] + shift[k]));
        if round % 3 == 0 {
            poses[1] =
                poses[1].with_scale(0.5).with_translation([0, 1, 2].map(|k| placed[k] + 0.5 * shift[k]));
        }
        hits += u32::from(check(&meshes, &poses));
    }
    assert!((30..120).contains(&hits), "{hits} hits");
}

#[test]
fn meshes_that_touch_answer_as_all_pairs_of_triangles_do() {
    let rng = &mut rng(2202);
    let mut hits = 0;
    for _ in 0..120 {
        let sides = [rng.random_range(2..7), rng.random_range(2..7)];
        let meshes = sides.map(|side| steps(rng, side));
        let whole = |rng: &mut Random, most: i32| f64::from(rng.random_range(-most..=most));
        let shift = [whole(rng, 2), whole(rng, 2), whole(rng, 1)];
        // Also upside down and by right angles, exactly.
        let turn = [[0.0, 0.0, 0.0, 1.0], [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];
        let turned = Pose::from_quaternion(turn[rng.random_range(0..5_usize).saturating_sub(2)])
            .with_translation(shift);
        hits += u32::from(check(&meshes, &[Pose::IDENTITY, turned]));
    }
    assert!((40..110).contains(&hits), "{hits} hits");
}

#[test]
fn a_mesh_touches_its_own_copy_in_every_triangle() {
    let rng = &mut rng(2203);
    let mesh = steps(rng, 12);
    let prepared = MeshHierarchy::build(&mesh, &MeshBuildOptions::default()).unwrap();
    for pose in [Pose::IDENTITY, pose(rng, 10.0)] {
        let pair = MeshPair::new(PlacedMesh::new(&prepared, &pose), PlacedMesh::new(&prepared, &pose));
        let (mut contacts, scratch) = (Vec::new(), &mut MeshScratch::default());
        pair.contacts(&mut contacts, scratch);
        let mut own: Vec<u32> =
            contacts.iter().map(|c| c.triangles).filter(|[i, j]| i == j).map(|[i, _]| i).collect();
        own.sort_unstable();
        if pose == Pose::IDENTITY {
            assert_eq!(own.len(), prepared.len());
        }
        assert_eq!(pair.distance(scratch).upper, 0.0);
    }
}
