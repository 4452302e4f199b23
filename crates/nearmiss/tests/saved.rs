//! A saved scan is the scan, and a file of an earlier release opens or is refused by name.
#![expect(clippy::unwrap_used, reason = "a test may panic")]

use nearmiss::store::Fault;
use nearmiss::{BuildOptions, Check, PointCloud, Scan};
use nearmiss_testdata::arbitrary::{self, CloudKind};

fn small() -> Scan {
    let points = arbitrary::cloud(CloudKind::Sphere, 100, 1);
    Scan::build(&PointCloud::from_positions(&points).unwrap(), &BuildOptions::default()).unwrap()
}

fn same(a: &Scan, b: &Scan) {
    assert_eq!(a.meta(), b.meta(), "metadata");
    assert_eq!(a.positions(), b.positions(), "positions");
    assert_eq!(a.normals(), b.normals(), "normals");
    assert_eq!(a.radii(), b.radii(), "radii");
    assert_eq!(a.discs(), b.discs(), "discs");
    assert_eq!(a.source(), b.source(), "source");
    assert_eq!(a.nodes(), b.nodes(), "nodes");
    assert_eq!(a.boxes(), b.boxes(), "boxes");
    assert!(a.enclosures().eq(b.enclosures()), "enclosures");
    assert_eq!(a.cones(), b.cones(), "cones");
}

#[test]
fn what_is_saved_is_what_opens() {
    let scan = small();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("small.nm");
    let length = scan.save(&path).unwrap();
    let mut bytes = Vec::new();
    assert_eq!(scan.write_to(&mut bytes).unwrap(), length, "written and saved alike");
    assert_eq!(std::fs::read(&path).unwrap(), bytes, "byte for byte");
    for check in [Check::Full, Check::Structure] {
        same(&Scan::open(&path, check).unwrap(), &scan);
        same(&Scan::read(&path, check).unwrap(), &scan);
        same(&Scan::from_bytes(bytes.clone(), check).unwrap(), &scan);
    }
}

#[test]
fn golden_files_of_older_versions_are_refused_by_name() {
    for version in [1, 2] {
        let path = format!("{}/tests/golden/sphere-v{version}.nm", env!("CARGO_MANIFEST_DIR"));
        let refused = Scan::open(path, Check::Full).unwrap_err().to_string();
        assert!(refused.contains(&format!("version {version}")) && refused.contains("prepare"), "{refused}");
    }
}

#[test]
fn the_golden_file_of_version_three_opens() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/golden/sphere-v3.nm");
    let golden = Scan::open(path, Check::Full).unwrap();
    assert_eq!(golden.sanity_check(), Ok(()), "a valid scan");
    same(&golden, &small());
}

#[test]
fn another_version_is_refused_by_name() {
    let mut bytes = Vec::new();
    let mut writer = nearmiss::store::Writer::new(*b"SCAN", 999);
    writer.metadata(&0_u8).unwrap();
    writer.write_to(&mut bytes).unwrap();
    let refused = Scan::from_bytes(bytes, Check::Full).unwrap_err();
    let nearmiss::LoadError::Open(refused) = refused else { panic!("{refused}") };
    assert!(matches!(refused.fault, Fault::Version { found: 999, .. }), "{refused}");
    let mut bytes = Vec::new();
    nearmiss::store::Writer::new(*b"MAPS", 1).write_to(&mut bytes).unwrap();
    let refused = Scan::from_bytes(bytes, Check::Full).unwrap_err();
    assert!(
        matches!(refused, nearmiss::LoadError::Open(e) if matches!(e.fault, Fault::Kind { .. })),
        "a map is no scan"
    );
}

#[test]
fn a_tree_that_lies_is_refused() {
    let scan = small();
    let mut bytes = Vec::new();
    scan.write_to(&mut bytes).unwrap();
    let file = nearmiss::store::File::from_bytes(bytes.clone(), Check::Full).unwrap();
    let nodes = file.sections().iter().find(|s| s.id.tag == *b"NODE").unwrap();
    let at = usize::try_from(nodes.offset).unwrap();
    let mut refused = 0;
    for field in 0..9 {
        let mut lying = bytes.clone();
        lying[at + 4 * field..at + 4 * field + 4].copy_from_slice(&77_u32.to_le_bytes());
        refused += u32::from(Scan::from_bytes(lying, Check::Structure).is_err());
    }
    assert_eq!(refused, 9, "every field of the first three nodes is checked without checksums");
}

/// Points, normals and discs that no build would write must not lead a query out of its arrays.
#[test]
fn absurd_numbers_do_not_panic() {
    let points = arbitrary::cloud(CloudKind::Sphere, 101, 1);
    let scan = Scan::build(&PointCloud::from_positions(&points).unwrap(), &BuildOptions::default()).unwrap();
    let mut bytes = Vec::new();
    scan.write_to(&mut bytes).unwrap();
    let sections = nearmiss::store::File::from_bytes(bytes.clone(), Check::Full).unwrap().sections().to_vec();
    let fill = |bytes: &mut [u8], tag: &[u8; 4], value: f32| {
        let section = sections.iter().find(|s| s.id.tag == *tag).unwrap();
        let start = usize::try_from(section.offset).unwrap();
        let end = start + usize::try_from(section.length).unwrap();
        for word in bytes[start..end].chunks_exact_mut(4) {
            word.copy_from_slice(&value.to_le_bytes());
        }
    };
    let sound = scan.at(&nearmiss::Pose::IDENTITY);
    for value in [0.0, 1e20, -1.0, f32::MAX, f32::NAN, f32::INFINITY] {
        for tags in [
            &[b"DISC"][..],
            &[b"NRML"],
            &[b"BOXS"],
            &[b"RADI"],
            &[b"PNTS"],
            &[b"DISC", b"NRML"],
            &[b"BLOK"],
            &[b"GRUP"],
            &[b"COVR"],
        ] {
            let mut absurd = bytes.clone();
            for tag in tags {
                fill(&mut absurd, tag, value);
            }
            let Ok(absurd) = Scan::from_bytes(absurd, Check::Structure) else { continue };
            let plan =
                nearmiss::CollidePlan::new(&nearmiss::CollideOptions::default(), &absurd, &scan).unwrap();
            let view = absurd.at(&nearmiss::Pose::from_translation([0.3, 0.1, 0.0]));
            for (a, b) in [(&view, &sound), (&sound, &view), (&view, &view)] {
                let answer = nearmiss::collide(a, b, &plan, &nearmiss::Budget::UNLIMITED);
                assert!(answer.statistics.node_pairs < 10_000, "{tags:?} {value}: {:?}", answer.statistics);
            }
        }
    }
}
