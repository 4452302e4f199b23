//! A mesh that was refitted gives the answers of one that was prepared anew.

use nearmiss::mesh::{Corners, triangles_meet};
use nearmiss::{
    DeformError, MeshBuildOptions, MeshContact, MeshDistance, MeshHint, MeshItself, MeshPair, MeshScratch,
    MovingMesh, PlacedMesh, Pose, Renewal, TriangleMesh,
};
use nearmiss_testdata::arbitrary::{point_in, pose, rng};
use nearmiss_testdata::dragon::{Dragon, dragon_mesh};

/// A closed, wavy tube of 2 × `around` × `along` triangles.
fn tube(around: u32, along: u32) -> TriangleMesh {
    let mut vertices = Vec::new();
    for i in 0..=along {
        for k in 0..around {
            let (turn, x) = (std::f64::consts::TAU * f64::from(k) / f64::from(around), f64::from(i));
            let radius = 3.0 + 0.4 * (0.7 * x).sin();
            vertices.push([x, radius * turn.cos(), radius * turn.sin()]);
        }
    }
    let triangles = (0..along)
        .flat_map(|i| (0..around).map(move |k| [i * around + k, i * around + (k + 1) % around, i, k]))
        .flat_map(|[a, b, _, _]| [[a, b, a + around], [b, b + around, a + around]]);
    TriangleMesh::new(vertices, triangles.collect()).unwrap()
}

/// Deformations of some vertices, with names.
fn frames(vertices: &[[f64; 3]], seed: u64) -> Vec<(&'static str, Vec<[f64; 3]>)> {
    let rng = &mut rng(seed);
    let turn = pose(rng, 3.0);
    let noise: Vec<[f64; 3]> = vertices.iter().map(|_| point_in(rng, 0.3)).collect();
    let all = |f: &dyn Fn(usize, [f64; 3]) -> [f64; 3]| {
        vertices.iter().enumerate().map(|(i, p)| f(i, *p)).collect::<Vec<_>>()
    };
    vec![
        ("identity", vertices.to_vec()),
        ("rigid", all(&|_, p| turn.apply(p))),
        ("shear", all(&|_, [x, y, z]| [x + 0.8 * z, y, z - 0.3 * x])),
        ("bend", all(&|_, [x, y, z]| [(0.15 * x).sin() * (y + 9.0), (0.15 * x).cos() * (y + 9.0), z])),
        (
            "twist",
            all(&|_, [x, y, z]| {
                let (s, c) = (0.3 * x).sin_cos();
                [x, c * y - s * z, s * y + c * z]
            }),
        ),
        ("noise", all(&|i, p| [0, 1, 2].map(|k| p[k] + noise[i][k]))),
        ("soup", all(&|i, _| noise[i].map(|x| 20.0 * x))),
        ("far", all(&|_, p| [p[0] + 4e6, p[1], p[2] - 1e6])),
        ("tiny", all(&|_, p| p.map(|x| 1e-9 * x))),
        ("flat", all(&|_, [x, y, _]| [x, y, 0.25])),
        ("line", all(&|_, [x, ..]| [x, 2.0 * x, 3.0])),
        ("point", all(&|_, _| [1.0, 2.0, 3.0])),
        ("identity again", vertices.to_vec()),
    ]
}

/// All answers about two placed meshes: verdicts, triangles that meet, distance.
fn answers(a: PlacedMesh<'_>, b: PlacedMesh<'_>, hint: &mut MeshHint) -> (bool, Vec<[u32; 2]>, MeshDistance) {
    let scratch = &mut MeshScratch::default();
    let pair = MeshPair::new(a, b);
    let verdict = pair.collide(scratch).verdict.is_intersecting();
    assert_eq!(pair.collide_hinted(hint, scratch).verdict.is_intersecting(), verdict, "with an old hint");
    let mut contacts = Vec::new();
    assert!(pair.contacts(&mut contacts, scratch).1, "without a budget all contacts are found");
    let distance = pair.distance(scratch);
    assert_eq!(pair.distance_hinted(hint, scratch).upper, distance.upper, "with an old hint");
    (verdict, sorted(&contacts), distance)
}

fn sorted(contacts: &[MeshContact]) -> Vec<[u32; 2]> {
    let mut triangles: Vec<_> = contacts.iter().map(|contact| contact.triangles).collect();
    triangles.sort_unstable();
    triangles
}

#[test]
fn a_refitted_mesh_answers_as_one_prepared_anew() {
    let (first, other) = (tube(12, 10), tube(9, 7));
    let options = MeshBuildOptions::default();
    let mut moving = MovingMesh::new(&first, &options).unwrap();
    let still = MovingMesh::new(&other, &options).unwrap();
    let (mut hint, mut hits, rng) = (MeshHint::default(), 0, &mut rng(3));
    for (name, vertices) in frames(first.vertices(), 1) {
        moving.refit(&vertices).unwrap();
        assert_eq!(moving.check_contents(), Ok(()), "{name}: boxes hold their triangles");
        let frame = TriangleMesh::new(vertices, first.triangles().to_vec()).unwrap();
        let anew = MovingMesh::new(&frame, &options).unwrap();
        assert_eq!(moving.bounds(), anew.bounds(), "{name}");
        let centre = anew.bounds().centre();
        for _ in 0..8 {
            let place = pose(rng, 6.0);
            let place = place.with_translation([0, 1, 2].map(|k| place.translation()[k] + centre[k]));
            let found = answers(moving.at(&Pose::IDENTITY), still.at(&place), &mut hint);
            let expected = answers(anew.at(&Pose::IDENTITY), still.at(&place), &mut MeshHint::default());
            assert_eq!(found.0, expected.0, "{name}: verdict");
            assert_eq!(found.1, expected.1, "{name}: triangles that meet");
            assert_eq!(found.2.upper, expected.2.upper, "{name}: distance");
            assert_eq!(found.2.lower, expected.2.lower, "{name}: distance");
            hits += usize::from(found.0);
        }
    }
    assert!((10..95).contains(&hits), "{hits} of 104 poses meet");
}

#[test]
fn a_mesh_that_loosens_is_prepared_anew() {
    // Small triangles in a row, and in another order.
    let row = |stride: u32| -> Vec<[f64; 3]> {
        let places = (0..600_u32).map(|i| f64::from(i * stride % 600));
        places.flat_map(|x| [[x, 0.0, 0.0], [x + 0.5, 0.1, 0.0], [x, 0.5, 0.2]]).collect()
    };
    let triangles = (0..600).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let first = TriangleMesh::new(row(1), triangles).unwrap();
    let mut moving = MovingMesh::new(&first, &MeshBuildOptions::default()).unwrap();
    moving.refit(&row(1)).unwrap();
    assert!((moving.looseness() - 1.0).abs() < 1e-3, "boxes fit at first: {}", moving.looseness());
    moving.refit(&row(241)).unwrap();
    assert!(moving.looseness() > 3.0, "boxes about far triangles are loose: {}", moving.looseness());
    assert_eq!(moving.move_to(&row(241)), Ok(Renewal::Rebuilt));
    assert!((moving.looseness() - 1.0).abs() < 1e-12, "{}", moving.looseness());
    assert_eq!(moving.check_contents(), Ok(()), "the mesh is valid");
    let shear: Vec<[f64; 3]> = row(241).iter().map(|[x, y, z]| [x + 0.1 * y, *y, *z]).collect();
    assert_eq!(moving.move_to(&shear), Ok(Renewal::Refitted));
}

#[test]
fn faulty_frames_are_refused_and_change_nothing() {
    let first = tube(5, 3);
    let mut moving = MovingMesh::new(&first, &MeshBuildOptions::default()).unwrap();
    let identity = moving.identity();
    let mut vertices = first.vertices().to_vec();
    let short = moving.move_to(&vertices[1..]);
    assert_eq!(short, Err(DeformError::Count { what: "vertices", expected: 20, got: 19 }));
    vertices[7][1] = f64::NAN;
    let message = moving.move_to(&vertices).unwrap_err().to_string();
    assert!(message.contains("vertex 7") && message.contains("NaN"), "{message}");
    vertices[7][1] = -1e200;
    assert!(matches!(moving.rebuild(&vertices), Err(DeformError::TooFar { .. })), "too far");
    assert_eq!(moving.identity(), identity, "the mesh is unchanged");
}

#[test]
fn a_mesh_meets_itself_where_triangles_without_common_corners_meet() {
    let first = tube(10, 8);
    let mut moving = MovingMesh::new(&first, &MeshBuildOptions::default()).unwrap();
    let scratch = &mut MeshScratch::default();
    let mut seen = [0; 2];
    for (name, vertices) in frames(first.vertices(), 5) {
        moving.refit(&vertices).unwrap();
        let corners = |t: &[u32; 3]| t.map(|v| vertices[v as usize]);
        let all: Vec<Corners> = first.triangles().iter().map(corners).collect();
        let mut expected = Vec::new();
        for (i, a) in (0_u32..).zip(&all) {
            for (j, b) in (i + 1..).zip(&all[i as usize + 1..]) {
                if !a.iter().any(|p| b.contains(p)) && triangles_meet(a, b) {
                    expected.push([i, j]);
                }
            }
        }
        let question = MeshItself::new(moving.at(&Pose::from_translation([0.5, 0.25, -2.0])));
        let mut contacts = Vec::new();
        let (answer, complete) = question.contacts(&mut contacts, scratch);
        let mut found: Vec<_> = contacts.iter().map(|contact| contact.triangles).collect();
        found.iter_mut().for_each(|pair| pair.sort_unstable());
        found.sort_unstable();
        assert!(complete && found == expected, "{name}: {found:?}, expected {expected:?}");
        assert_eq!(answer.verdict.is_intersecting(), !expected.is_empty(), "{name}");
        assert_eq!(question.collide(scratch).verdict.is_intersecting(), !expected.is_empty(), "{name}");
        seen[usize::from(expected.is_empty())] += 1;
    }
    assert!(seen[0] > 1 && seen[1] > 2, "some meet themselves, some do not: {seen:?}");
}

#[test]
fn a_bent_dragon_answers_as_one_prepared_anew() {
    let first = dragon_mesh(Dragon::Points5k).unwrap();
    let options = MeshBuildOptions::default();
    let mut moving = MovingMesh::new(&first, &options).unwrap();
    let size = moving.bounds().half_extents()[0];
    let mut loosest = 1.0_f64;
    for step in 1..5 {
        let bend = 0.3 * f64::from(step) / size;
        let bent = |[x, y, z]: &[f64; 3]| {
            let (s, c) = (bend * x).sin_cos();
            [s * (y + 1.0 / bend), c * (y + 1.0 / bend), *z]
        };
        let vertices: Vec<[f64; 3]> = first.vertices().iter().map(bent).collect();
        moving.refit(&vertices).unwrap();
        loosest = loosest.max(moving.looseness());
        let anew = TriangleMesh::new(vertices, first.triangles().to_vec()).unwrap();
        let anew = MovingMesh::new(&anew, &options).unwrap();
        let place = Pose::from_translation([1.2 * size, 0.1 * size, 0.0]);
        let found = answers(moving.at(&Pose::IDENTITY), moving.at(&place), &mut MeshHint::default());
        let expected = answers(anew.at(&Pose::IDENTITY), anew.at(&place), &mut MeshHint::default());
        assert!(
            found == expected || found.2.upper == expected.2.upper && found.1 == expected.1,
            "step {step}"
        );
    }
    assert!(loosest < 2.0, "kept axes stay useful: {loosest}");
}
