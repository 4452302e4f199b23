//! A saved mesh equals the original and gives the same answers.

use nearmiss::{Check, Mesh, MeshBuildOptions, MeshHint, MeshPair, MeshScratch, Pose, TriangleMesh};
use nearmiss_testdata::dragon::{Dragon, dragon_mesh};

use crate::hostile::exercise_mesh::{MeshAnswers, exercise_mesh};

fn dragon() -> TriangleMesh {
    dragon_mesh(Dragon::Points5k).unwrap()
}

/// Opens a saved copy of `mesh` in every way.
fn copies(mesh: &Mesh) -> Vec<Mesh> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mesh.nm");
    let length = mesh.save(&path).unwrap();
    let mut bytes = Vec::new();
    assert_eq!(mesh.write_to(&mut bytes).unwrap(), length, "written and saved alike");
    assert_eq!(std::fs::read(&path).unwrap(), bytes, "byte for byte");
    let mut copies = Vec::new();
    for check in [Check::Full, Check::Structure] {
        copies.push(Mesh::open(&path, check).unwrap());
        copies.push(Mesh::from_bytes(bytes.clone(), check).unwrap());
    }
    // Memory that is not aligned.
    let mut shifted = vec![0];
    shifted.extend(&bytes);
    copies.push(Mesh::from_bytes(shifted[1..].to_vec(), Check::Full).unwrap());
    copies
}

#[test]
fn a_saved_mesh_gives_equal_answers_with_each_check() {
    let mesh = Mesh::build(&dragon(), &MeshBuildOptions::default()).unwrap();
    let answers: MeshAnswers = exercise_mesh(&mesh, &mesh);
    let hits = answers.collide.iter().filter(|answer| answer.verdict.is_intersecting()).count();
    assert!((3..12).contains(&hits), "{hits} of 12 queries hit");
    for copy in copies(&mesh) {
        assert_eq!(copy.meta(), mesh.meta(), "metadata");
        assert_eq!(copy.topology(), mesh.topology(), "nodes");
        let (found, expected) = (copy.arrays(), mesh.arrays());
        assert_eq!(found.blocks, expected.blocks, "leaves");
        assert_eq!(found.vertices, expected.vertices, "vertices");
        assert_eq!(found.triangles, expected.triangles, "triangles");
        assert_eq!(found.source, expected.source, "numbers in the input");
        assert_eq!(copy.check_contents(), Ok(()), "a valid mesh");
        assert_eq!(exercise_mesh(&copy, &copy), answers, "answers");
        assert_eq!(exercise_mesh(&copy, &mesh), answers, "answers about a copy and the original");
    }
}

#[test]
fn a_path_of_a_saved_mesh_is_answered_as_that_of_the_original() {
    let mesh = Mesh::build(&dragon(), &MeshBuildOptions::default()).unwrap();
    let [copy, ..] = &copies(&mesh)[..] else { panic!() };
    let (mut scratch, mut hints) = (MeshScratch::default(), [MeshHint::default(), MeshHint::default()]);
    let (mut hits, mut apart) = (0, 0);
    for i in 0..200_u32 {
        let t = f64::from(i) / 200.0;
        let pose = Pose::from_axis_angle([0.2, 1.0, 0.1], 3.0 * t).with_translation([0.35 * t, 0.02, 0.0]);
        let ask = |mesh: &Mesh, hint: &mut MeshHint, scratch: &mut MeshScratch| {
            let pair = MeshPair::new(mesh.at(&Pose::IDENTITY), mesh.at(&pose));
            (pair.collide_hinted(hint, scratch), pair.distance_hinted(hint, scratch))
        };
        let original = ask(&mesh, &mut hints[0], &mut scratch);
        assert_eq!(ask(copy, &mut hints[1], &mut scratch), original, "pose {i}");
        let (answer, distance) = original;
        assert_eq!(
            answer.verdict.is_intersecting(),
            distance.upper == 0.0,
            "pose {i}: {answer:?}, {distance:?}"
        );
        if answer.verdict.is_intersecting() { hits += 1 } else { apart += 1 }
    }
    assert!(hits > 30 && apart > 30, "{hits} hits, {apart} misses");
}

/// The golden file of the current version.
const GOLDEN: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/golden/tetrahedron-v3.nm");

fn tetrahedron() -> Mesh {
    let vertices = vec![[0.1, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.1, 0.0, 0.0]];
    let triangles = vec![[0, 2, 1], [4, 1, 3], [0, 3, 2], [1, 2, 3], [0, 4, 1], [1, 3, 0]];
    Mesh::build(&TriangleMesh::new(vertices, triangles).unwrap(), &MeshBuildOptions::default()).unwrap()
}

/// After a change of the format: raise `VERSION` in `src/prepared_mesh.rs`, name the new file in
/// [`GOLDEN`], test that the old one is refused by name, and run
/// `cargo test -p nearmiss --test facade record_golden_mesh -- --ignored`.
#[test]
#[ignore = "writes the golden file"]
fn record_golden_mesh() {
    tetrahedron().save(GOLDEN).unwrap();
}

#[test]
fn golden_meshes_of_older_versions_are_refused_by_name() {
    for version in 1..=2 {
        let folder = env!("CARGO_MANIFEST_DIR");
        let path = format!("{folder}/tests/golden/tetrahedron-v{version}.nm");
        let refused = Mesh::open(path, Check::Full).unwrap_err().to_string();
        let is_named = refused.contains(&format!("version {version}")) && refused.contains("prepare");
        assert!(is_named, "{refused}");
    }
}

#[test]
fn the_golden_mesh_of_this_version_opens() {
    let golden = Mesh::open(GOLDEN, Check::Full).unwrap();
    let dropped = golden.dropped();
    assert_eq!((golden.len(), golden.vertices()), (4, 4));
    assert_eq!((dropped.degenerate, dropped.duplicate, dropped.welded_vertices), (1, 1, 1));
    let built = tetrahedron();
    let [mut found, mut expected] = [Vec::new(), Vec::new()];
    golden.write_to(&mut found).unwrap();
    built.write_to(&mut expected).unwrap();
    assert!(found == expected, "byte for byte as this version builds it");
}
