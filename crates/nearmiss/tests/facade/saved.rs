//! A saved scan equals the original. Files of earlier releases open, or the error names their
//! version.
use nearmiss::graph::ClosePairs;
use nearmiss::store::ContainerFault;
use nearmiss::{
    BuildOptions, Check, GraphOptions, Pair, Paths, PointCloud, Pose, Scan, Scratch, Status, SurfaceGraph,
};
use nearmiss_testdata::arbitrary::{self, CloudKind};

fn small() -> Scan {
    let cloud = PointCloud::from_positions(&arbitrary::cloud(CloudKind::Sphere, 100, 1)).unwrap();
    let scan = Scan::build(&cloud, &BuildOptions::default()).unwrap();
    scan.with_graph(&cloud, &GraphOptions::default().with_close_pairs(Some(Paths::Rebuilt)), None).unwrap()
}

fn bytes(scan: &Scan) -> Vec<u8> {
    let mut bytes = Vec::new();
    scan.write_to(&mut bytes).unwrap();
    bytes
}

fn same(a: &Scan, b: &Scan) {
    assert_eq!(a.meta(), b.meta(), "metadata");
    assert_eq!(a.positions(), b.positions(), "positions");
    assert_eq!(a.normals(), b.normals(), "normals");
    assert_eq!(a.radii(), b.radii(), "radii");
    assert!(a.discs().iter().eq(b.discs().iter()), "discs");
    assert_eq!(a.source(), b.source(), "source");
    assert_eq!(a.topology(), b.topology(), "nodes");
    assert!(a.boxes().eq(b.boxes()), "boxes");
    assert!(a.enclosures().eq(b.enclosures()), "enclosures");
    assert_eq!(a.graph().map(SurfaceGraph::counts), b.graph().map(SurfaceGraph::counts), "graph");
    assert!(bytes(a) == bytes(b), "all of it");
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
    for version in [1, 2, 3, 4, 5, 6, 8, 9, 10] {
        let path = format!("{}/tests/golden/sphere-v{version}.nm", env!("CARGO_MANIFEST_DIR"));
        let refused = Scan::open(path, Check::Full).unwrap_err().to_string();
        assert!(refused.contains(&format!("version {version}")) && refused.contains("prepare"), "{refused}");
    }
}

/// The golden file of the current version.
const GOLDEN: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/golden/sphere-v11.nm");

/// After a change of the format: raise `VERSION` in `src/scan.rs`, name the new file in [`GOLDEN`],
/// add the old version to the list above, and run
/// `cargo test -p nearmiss --test facade record_golden -- --ignored`.
#[test]
#[ignore = "writes the golden file"]
fn record_golden() {
    small().save(GOLDEN).unwrap();
}

#[test]
fn the_golden_file_of_this_version_opens() {
    let golden = Scan::open(GOLDEN, Check::Full).unwrap();
    assert_eq!(golden.sanity_check(), Ok(()), "a valid scan");
    same(&golden, &small());
}

/// Scans without a graph, and with a graph that has no map, a map without paths, or one with paths.
#[test]
fn a_graph_is_kept_as_it_was_asked_for() {
    let cloud = PointCloud::from_positions(&arbitrary::cloud(CloudKind::Sphere, 500, 3)).unwrap();
    let bare = Scan::build(&cloud, &BuildOptions::default()).unwrap();
    assert!(bare.graph().is_none() && bare.geodesic_kernel().is_none() && !bare.is_oriented());
    let mut sizes = vec![bytes(&bare).len()];
    for pairs in [None, Some(Paths::Rebuilt), Some(Paths::Stored)] {
        let options = GraphOptions::default().with_close_pairs(pairs);
        let scan = bare.clone().with_graph(&cloud, &options, None).unwrap();
        let bytes = bytes(&scan);
        sizes.push(bytes.len());
        for check in [Check::Full, Check::Structure] {
            let read = Scan::from_bytes(bytes.clone(), check).unwrap();
            same(&read, &scan);
            assert_eq!(read.graph().unwrap().close_pairs().map(|map| map.paths()), pairs);
            assert_eq!(read.geodesic_kernel().is_some(), pairs.is_some());
            let graph = read.graph().unwrap();
            let levels = graph.levels(read.positions(), read.radii());
            for level in 0..levels.cells().len() {
                let map = graph.close_cells(level);
                assert_eq!(map.map(ClosePairs::len), pairs.map(|_| levels.cells()[level].len()));
            }
            assert!(!levels.cells().is_empty() && graph.close_cells(9).is_none(), "some levels");
            assert!(read.is_oriented(), "normals were turned");
        }
    }
    assert!(sizes.is_sorted_by(|a, b| a < b), "{sizes:?}");
}

/// Whatever their initial signs, normals of a closed surface point outwards, those of an open one
/// towards the scanner or as in the input. f has the same sign.
#[test]
fn normals_are_turned_outwards_to_the_scanner_or_as_given() {
    let ball = PointCloud::from_positions(&arbitrary::cloud(CloudKind::Sphere, 2000, 5)).unwrap();
    let scan = |cloud: &PointCloud, scanner| {
        let scan = Scan::build(cloud, &BuildOptions::default()).unwrap();
        scan.with_graph(cloud, &GraphOptions::default().with_close_pairs(Some(Paths::Rebuilt)), scanner)
            .unwrap()
    };
    let outwards = |scan: &Scan| {
        let along = |(p, n): (&[f32; 3], &[f32; 3])| (0..3).map(|k| p[k] * n[k]).sum::<f32>();
        scan.positions().iter().zip(scan.normals()).filter(|&pair| along(pair) > 0.0).count()
    };
    let closed = scan(&ball, None);
    assert_eq!(outwards(&closed), closed.len(), "out of the ball");
    assert_eq!(outwards(&scan(&ball, Some([0.0; 3]))), 0, "to the scanner within");
    let bare = Scan::build(&ball, &BuildOptions::default()).unwrap();
    let refused = bare.with_graph(&ball, &GraphOptions::default(), Some([0.0, f64::NAN, 1.0])).unwrap_err();
    assert!(refused.to_string().contains("scanner") && refused.to_string().contains("NaN"), "{refused}");
    #[expect(clippy::cast_possible_truncation, reason = "normals are single precision")]
    let inwards: Vec<[f32; 3]> = (0..ball.len()).map(|i| ball.point(i).map(|c| -c as f32)).collect();
    let given = ball.clone().with_normals(&inwards).unwrap();
    assert_eq!(outwards(&scan(&given, Some([9.0, 0.0, 0.0]))), 0, "the cloud's own come first");

    let view = closed.at(&Pose::IDENTITY);
    let (mut scratch, mut geodesic) = (Default::default(), Default::default());
    let (kernel, mut seen) = (closed.geodesic_kernel().unwrap(), 0);
    for i in 0..closed.len() {
        let p = closed.positions()[i].map(f64::from);
        for share in [0.95, 1.03] {
            let x = p.map(|c| c * share);
            for at in [view.evaluate(x, &mut scratch), view.evaluate_by(&kernel, x, &mut geodesic)] {
                // In a gap between samples there is no surface.
                if at.status == Status::Ok {
                    assert_eq!(at.f > 0.0, share < 1.0, "positive within: {at:?}");
                    let along: f64 = (0..3).map(|k| at.normal[k] * p[k]).sum();
                    assert!(along > 0.9 * p.iter().map(|c| c * c).sum::<f64>().sqrt(), "{at:?}");
                    seen += 1;
                }
            }
        }
    }
    assert!(seen > 7000, "{seen} places of 8000");
}

#[test]
fn another_version_is_refused_by_name() {
    let mut bytes = Vec::new();
    let mut writer = nearmiss::store::Writer::new(*b"SCAN", 999);
    writer.metadata(&0_u8).unwrap();
    writer.write_to(&mut bytes).unwrap();
    let refused = Scan::from_bytes(bytes, Check::Full).unwrap_err();
    let nearmiss::LoadError::Open(refused) = refused else { panic!("{refused}") };
    assert!(matches!(refused.fault, ContainerFault::Version { found: 999, .. }), "{refused}");
    let mut bytes = Vec::new();
    nearmiss::store::Writer::new(*b"MAPS", 1).write_to(&mut bytes).unwrap();
    let refused = Scan::from_bytes(bytes, Check::Full).unwrap_err();
    assert!(
        matches!(refused, nearmiss::LoadError::Open(e) if matches!(e.fault, ContainerFault::Kind { .. })),
        "a map is no scan"
    );
}

/// Invalid points, normals and discs must not make a query index out of bounds.
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
    let sound = scan.at(&Pose::IDENTITY);
    for value in [0.0, 1e20, -1.0, f32::MAX, f32::NAN, f32::INFINITY] {
        for tags in [
            &[b"KIND"][..],
            &[b"NRML"],
            &[b"TREE"],
            &[b"LEAF"],
            &[b"BLCK"],
            &[b"SMPL"],
            &[b"LIST"],
            &[b"NEAR"],
            &[b"RADI"],
            &[b"KIND", b"NRML"],
            &[b"GRUP"],
            &[b"COVR"],
        ] {
            let mut absurd = bytes.clone();
            for tag in tags {
                fill(&mut absurd, tag, value);
            }
            let Ok(absurd) = Scan::from_bytes(absurd, Check::Structure) else { continue };
            let plan =
                nearmiss::CollidePlan::new(&nearmiss::CollideOptions::estimated(), &absurd, &scan).unwrap();
            let view = absurd.at(&Pose::from_translation([0.3, 0.1, 0.0]));
            for (a, b) in [(&view, &sound), (&sound, &view), (&view, &view)] {
                let answer = Pair::new(*a, *b).collide(&plan, &mut Scratch::default());
                assert!(answer.statistics.node_pairs < 10_000, "{tags:?} {value}: {:?}", answer.statistics);
            }
        }
    }
}
