//! Damaged files of prepared meshes.

use nearmiss::store::{ContainerFault, File, Writer};
use nearmiss::{Check, LoadError, Mesh, MeshBuildOptions, TriangleMesh};
use nearmiss_testdata::arbitrary::{point_in, rng};
use rand::RngExt;

use crate::hostile::cases::{self, cut_anywhere, repaired};
use crate::hostile::damage::{Random, damage};
use crate::hostile::exercise_mesh::{MeshAnswers, exercise_mesh};
use crate::hostile::repair::repair;

/// A sphere of triangles: `rings` rings of `2 rings` vertices, and two poles.
fn sphere(rings: u32) -> TriangleMesh {
    let around = 2 * rings;
    let point = |ring: u32, i: u32| {
        let (polar, turn) = (
            std::f64::consts::PI * f64::from(ring + 1) / f64::from(rings + 1),
            std::f64::consts::TAU * f64::from(i) / f64::from(around),
        );
        [polar.sin() * turn.cos(), polar.sin() * turn.sin(), polar.cos()]
    };
    let mut vertices: Vec<_> = (0..rings).flat_map(|ring| (0..around).map(move |i| point(ring, i))).collect();
    vertices.extend([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]);
    let (north, south) = (rings * around, rings * around + 1);
    let mut triangles = Vec::new();
    for i in 0..around {
        let next = (i + 1) % around;
        triangles.push([north, i, next]);
        triangles.push([south, (rings - 1) * around + next, (rings - 1) * around + i]);
        for ring in 1..rings {
            let [p, q] = [(ring - 1) * around, ring * around];
            triangles.extend([[p + i, q + i, q + next], [p + i, q + next, p + next]]);
        }
    }
    TriangleMesh::new(vertices, triangles).unwrap()
}

/// Triangles of random sizes in disorder, some of them twice and some without area.
fn soup(count: u32, scale: f64, seed: u64) -> TriangleMesh {
    let mut random = rng(seed);
    let mut vertices = Vec::new();
    for _ in 0..count {
        let (at, size) = (point_in(&mut random, scale), scale * random.random_range(0.01..0.5));
        for _ in 0..3 {
            let by = point_in(&mut random, size);
            vertices.push([0, 1, 2].map(|k| at[k] + by[k]));
        }
    }
    let mut triangles: Vec<[u32; 3]> = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    triangles.extend([[0, 2, 1], [4, 4, 5], [6, 7, 8]]);
    TriangleMesh::new(vertices, triangles).unwrap()
}

/// A valid mesh, its file, and its answers.
struct Sample {
    mesh: Mesh,
    bytes: Vec<u8>,
    answers: MeshAnswers,
}

impl Sample {
    fn of(mesh: &TriangleMesh) -> Self {
        let mesh = Mesh::build(mesh, &MeshBuildOptions::default()).unwrap();
        let bytes = bytes_of(&mesh);
        let answers = exercise_mesh(&mesh, &mesh);
        Self { mesh, bytes, answers }
    }
}

impl cases::Sample for Sample {
    type Answers = MeshAnswers;

    fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    fn ask(&self, bytes: Vec<u8>, check: Check) -> Result<MeshAnswers, LoadError> {
        Mesh::from_bytes(bytes, check).map(|mesh| exercise_mesh(&mesh, &self.mesh))
    }
}

fn bytes_of(mesh: &Mesh) -> Vec<u8> {
    let mut bytes = Vec::new();
    mesh.write_to(&mut bytes).unwrap();
    bytes
}

fn samples() -> Vec<Sample> {
    let one = TriangleMesh::new(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], vec![[0, 1, 2]]).unwrap();
    [sphere(5), soup(61, 1.0, 3), soup(40, 1e9, 4), soup(6, 1e-7, 5), one].iter().map(Sample::of).collect()
}

/// Outcomes of the damaged files.
#[derive(Debug, Default)]
struct Tally {
    refused: u32,
    /// Opened, with unchanged answers.
    same: u32,
    /// Opened, with other answers about an unchanged shape: other triangle numbers or other costs.
    alike: u32,
    /// Opened, with answers about another shape.
    other: u32,
}

/// Opens files damaged by `spoil`, and runs all queries on those that open.
fn run(seed: u64, check: Check, spoil: impl Fn(&mut Vec<u8>, &mut Random)) -> Tally {
    let mut tally = Tally::default();
    cases::run(&samples(), seed, check, spoil, |sample, answers| match answers {
        None => tally.refused += 1,
        Some(answers) if answers == sample.answers => tally.same += 1,
        Some(answers) if answers.of_shape() == sample.answers.of_shape() => tally.alike += 1,
        Some(_) => tally.other += 1,
    });
    println!("{check:?}: {tally:?}");
    tally
}

#[test]
fn damage_to_a_mesh_is_refused_or_does_no_harm() {
    let tally = run(11, Check::Full, damage);
    assert_eq!((tally.other, tally.alike), (0, 0), "an answer that differs from the sound file's");
    assert!(tally.refused > 0 && tally.same > 0, "{tally:?}: most damage shows, some undoes itself");
}

#[test]
fn damage_to_a_mesh_with_fitting_checksums_never_changes_an_answer_about_its_shape() {
    let tally = run(12, Check::Full, repaired);
    assert_eq!(tally.other, 0, "{tally:?}: vertices and triangles are hashed, boxes contain them");
    assert!(tally.refused > 10 * tally.alike, "{tally:?}");
}

#[test]
fn damage_to_a_mesh_with_fitting_checksums_does_not_stop_a_query_that_trusts_the_file() {
    let tally = run(13, Check::Structure, repaired);
    assert!(tally.refused > 0 && tally.other > 0, "{tally:?}: both ways are taken");
}

/// Overwrites the section of a file, number by number.
fn fill(bytes: &mut [u8], tag: [u8; 4], value: &[u8]) {
    let sections = File::from_bytes(bytes.to_vec(), Check::Structure).unwrap().sections().to_vec();
    let section = sections.iter().find(|section| section.id.tag == tag).unwrap();
    let start = usize::try_from(section.offset).unwrap();
    let end = start + usize::try_from(section.length).unwrap();
    for word in bytes[start..end].chunks_exact_mut(value.len()) {
        word.copy_from_slice(value);
    }
}

const TAGS: [[u8; 4]; 6] = [*b"TREE", *b"LEAF", *b"VERT", *b"TRIS", *b"SRCE", *b"CELL"];

#[test]
fn absurd_numbers_in_a_mesh_do_not_panic() {
    let sample = Sample::of(&sphere(6));
    let single = [0.0, 1e20, -1.0, f32::MAX, f32::NAN, f32::INFINITY].map(|x| x.to_le_bytes().to_vec());
    let double =
        [1e-300, 1e150, 1e300, f64::MAX, f64::NAN, f64::NEG_INFINITY].map(|x| x.to_le_bytes().to_vec());
    for value in single.iter().chain(&double) {
        for tags in [&TAGS[..1], &TAGS[1..2], &TAGS[2..3], &TAGS[3..4], &TAGS[4..], &TAGS[..3], &TAGS] {
            let mut absurd = sample.bytes.clone();
            tags.iter().for_each(|tag| fill(&mut absurd, *tag, value));
            repair(&mut absurd);
            let mesh = Mesh::from_bytes(absurd.clone(), Check::Structure).unwrap();
            let _any = exercise_mesh(&mesh, &sample.mesh);
            assert!(Mesh::from_bytes(absurd, Check::Full).is_err(), "{tags:?} {value:?}");
        }
    }
}

/// Changes one number of each section to a value that a build could not have written there, with
/// fitting checksums.
#[test]
fn a_full_check_finds_a_changed_number_in_every_section() {
    let sample = Sample::of(&sphere(6));
    let sections = File::from_bytes(sample.bytes.clone(), Check::Full).unwrap().sections().to_vec();
    let changed = |tag: [u8; 4], at: usize, change: &dyn Fn(&mut [u8])| {
        let section = sections.iter().find(|section| section.id.tag == tag).unwrap();
        let start = usize::try_from(section.offset).unwrap() + at;
        let mut bytes = sample.bytes.clone();
        change(&mut bytes[start..]);
        assert!(bytes != sample.bytes, "a change");
        repair(&mut bytes);
        assert!(
            Mesh::from_bytes(bytes.clone(), Check::Structure).is_ok(),
            "found without reading the numbers"
        );
        let refused = Mesh::from_bytes(bytes, Check::Full).unwrap_err();
        assert!(matches!(refused, LoadError::Flaw(_)), "{refused}");
        refused.to_string()
    };
    let scaled = |by: f32| {
        move |bytes: &mut [u8]| {
            let value = f32::from_le_bytes(*bytes.first_chunk().unwrap()) * by;
            bytes[..4].copy_from_slice(&value.to_le_bytes());
        }
    };
    let flipped = |bytes: &mut [u8]| bytes[0] ^= 1;
    // The half extents of the first child of the root follow the four centres.
    let told = changed(*b"TREE", 12 * 4, &scaled(0.9));
    assert!(told.contains("box"), "{told}");
    for place in [0, 4 * 17] {
        assert_eq!(
            changed(*b"LEAF", place, &scaled(1.0 + 1e-6)),
            "leaf 0 is invalid; prepare the scan again"
        );
    }
    // The last bit of a coordinate changes the hash of the mesh.
    assert!(changed(*b"VERT", 8 * 10, &flipped).contains("is invalid"));
    assert!(changed(*b"TRIS", 4 * 31, &flipped).contains("is invalid"));
    let beyond = changed(*b"TRIS", 4 * 31, &|bytes| bytes[..4].copy_from_slice(&9999_u32.to_le_bytes()));
    assert!(beyond.contains("triangle 10 is invalid"), "{beyond}");
    let doubled = changed(*b"SRCE", 4 * 7, &|bytes| bytes.copy_within(4..8, 0));
    assert!(doubled.contains("the place in the input of triangle"), "{doubled}");
}

#[test]
fn lengths_that_contradict_each_other_are_refused() {
    let mesh = Mesh::build(&sphere(4), &MeshBuildOptions::default()).unwrap();
    let file = File::from_bytes(bytes_of(&mesh), Check::Full).unwrap();
    let arrays = mesh.arrays();
    // All sections, of which `cut` has lost its last element.
    let without = |cut: usize| {
        let mut writer = Writer::new(Mesh::KIND, file.version());
        writer.metadata(mesh.meta()).unwrap();
        fn shorter<T>(all: &[T], cut: bool) -> &[T] {
            &all[..all.len() - usize::from(cut)]
        }
        let siblings = file.array::<[[u8; 64]; 3]>(TAGS[0], 0).unwrap();
        writer.section(TAGS[0], 0, shorter(&siblings, cut == 0)).unwrap();
        writer.section(TAGS[1], 0, shorter(arrays.blocks, cut == 1)).unwrap();
        writer.section(TAGS[2], 0, shorter(arrays.vertices, cut == 2)).unwrap();
        writer.section(TAGS[3], 0, shorter(arrays.triangles, cut == 3)).unwrap();
        writer.section(TAGS[4], 0, shorter(arrays.source, cut == 4)).unwrap();
        writer.section(*b"SEAM", 0, arrays.seams).unwrap();
        writer.section(TAGS[5], 0, shorter(arrays.cells, cut == 5)).unwrap();
        let mut bytes = Vec::new();
        writer.write_to(&mut bytes).unwrap();
        bytes
    };
    assert!(without(6) == bytes_of(&mesh), "nothing is cut");
    for (cut, name) in [(0, "boxes"), (1, "leaves"), (3, ""), (4, "source"), (5, "cells")] {
        for check in [Check::Structure, Check::Full] {
            let refused = Mesh::from_bytes(without(cut), check).unwrap_err();
            assert!(matches!(refused, LoadError::Flaw(_)), "{cut}: {refused}");
            assert!(refused.to_string().contains(name), "{cut}: {refused}");
        }
    }
    // Without its last vertex, the mesh is another one, and corners may be missing.
    let short = Mesh::from_bytes(without(2), Check::Structure).unwrap();
    let _any = exercise_mesh(&short, &mesh);
    assert!(Mesh::from_bytes(without(2), Check::Full).is_err());
    // No triangles at all.
    let mut writer = Writer::new(Mesh::KIND, file.version());
    writer.metadata(mesh.meta()).unwrap();
    writer.section(TAGS[0], 0, &[] as &[[[u8; 64]; 3]]).unwrap();
    writer.section(TAGS[1], 0, &arrays.blocks[..0]).unwrap();
    writer.section(TAGS[2], 0, arrays.vertices).unwrap();
    writer.section(TAGS[3], 0, &arrays.triangles[..0]).unwrap();
    writer.section(TAGS[4], 0, &arrays.source[..0]).unwrap();
    writer.section(*b"SEAM", 0, arrays.seams).unwrap();
    writer.section(TAGS[5], 0, &arrays.cells[..0]).unwrap();
    let mut empty = Vec::new();
    writer.write_to(&mut empty).unwrap();
    let refused = Mesh::from_bytes(empty, Check::Structure).unwrap_err().to_string();
    assert!(refused.contains("the number of triangles"), "{refused}");
}

#[test]
fn a_mesh_cut_anywhere_is_refused_even_if_its_header_owns_up() {
    cut_anywhere(&Sample::of(&sphere(5)).bytes, |bytes| {
        [Check::Full, Check::Structure].map(|check| Mesh::from_bytes(bytes.to_vec(), check).unwrap_err())
    });
}

#[test]
fn a_mesh_of_another_version_or_another_kind_is_refused_by_name() {
    for (version, remedy) in [(0, "prepare it again"), (4, "update the program"), (999, "update the program")]
    {
        let mut bytes = Vec::new();
        let mut writer = Writer::new(Mesh::KIND, version);
        writer.metadata(&0_u8).unwrap();
        writer.write_to(&mut bytes).unwrap();
        let refused = Mesh::from_bytes(bytes, Check::Full).unwrap_err();
        let told = refused.to_string();
        assert!(told.contains(&format!("version {version}")) && told.contains(remedy), "{told}");
    }
    for kind in [nearmiss::Scan::KIND, *b"MAPS"] {
        let mut bytes = Vec::new();
        Writer::new(kind, 1).write_to(&mut bytes).unwrap();
        let refused = Mesh::from_bytes(bytes, Check::Full).unwrap_err();
        let LoadError::Open(refused) = refused else { panic!("{refused}") };
        assert!(
            matches!(refused.fault, ContainerFault::Kind { found, expected } if found == kind && expected == Mesh::KIND),
            "{refused}"
        );
    }
    let mesh = bytes_of(&Sample::of(&sphere(4)).mesh);
    let refused = nearmiss::Scan::from_bytes(mesh, Check::Full).unwrap_err().to_string();
    assert!(refused.contains("expected content `SCAN`, got `MESH`"), "{refused}");
}
