//! Forged boxes must not make a query compare all pairs of leaves.

use nearmiss::store::File;
use nearmiss::{
    Budget, BuildOptions, Check, CollideOptions, CollidePlan, Pair, PointCloud, Pose, Reason, Scan, Scratch,
    Semantics, Verdict,
};
use nearmiss_testdata::arbitrary::{self, CloudKind};

/// Returns the scan with every box replaced by one that contains everything, and with valid
/// checksums.
fn with_boundless_boxes(scan: &Scan, half: f32) -> Scan {
    let mut bytes = Vec::new();
    scan.write_to(&mut bytes).unwrap();
    let sections = File::from_bytes(bytes.clone(), Check::Full).unwrap().sections().to_vec();
    let boxes = sections.iter().find(|s| s.id.tag == *b"TREE").unwrap();
    let start = usize::try_from(boxes.offset).unwrap();
    let end = start + usize::try_from(boxes.length).unwrap();
    let vast = [0.0, 0.0, 0.0, half, half, half, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    // A row of four siblings for each number.
    let vast: Vec<u8> = vast.iter().flat_map(|x: &f32| x.to_le_bytes().repeat(4)).collect();
    for siblings in bytes[start..end].chunks_exact_mut(vast.len()) {
        siblings.copy_from_slice(&vast);
    }
    crate::hostile::repair::repair(&mut bytes);
    Scan::from_bytes(bytes, Check::Structure).unwrap()
}

#[test]
fn boundless_boxes_end_a_query_undecided_unless_told_otherwise() {
    let points = arbitrary::cloud(CloudKind::Sphere, 12_000, 1);
    let cloud = PointCloud::from_positions(&points).unwrap();
    let scan = Scan::build(&cloud, &BuildOptions::default()).unwrap();
    let leaves = scan.topology().leaves() as u64;
    // A sphere within a sphere, which bounding balls cannot separate.
    let away = Pose::IDENTITY.with_scale(0.5);
    for half in [10.0, 1e12] {
        let lying = with_boundless_boxes(&scan, half);
        for semantics in [Semantics::Surface, Semantics::Thickened(0.01)] {
            let options = CollideOptions::estimated().with_semantics(semantics);
            let plan = CollidePlan::new(&options, &lying, &lying).unwrap();
            let ask = |budget: &Budget| {
                Pair::new(lying.at(&Pose::IDENTITY), lying.at(&away))
                    .within(budget)
                    .collide(&plan, &mut Scratch::default())
            };
            let answer = ask(&Budget::UNLIMITED);
            let Verdict::Undecided(Reason::Budget { likelihood }) = answer.verdict else {
                panic!("{answer:?}")
            };
            assert!((0.0..=1.0).contains(&likelihood), "a likelihood of {likelihood}");
            let least = 100 * 2 * leaves;
            assert!(
                (least..3 * least).contains(&answer.statistics.leaf_pairs),
                "{:?} of {leaves} leaves",
                answer.statistics
            );

            let lifted = ask(&Budget::UNLIMITED.with_work(u64::MAX));
            assert!(lifted.verdict.is_separated(), "{lifted:?}");
            assert_eq!(lifted.statistics.leaf_pairs, leaves * leaves, "every leaf with every leaf");
        }
    }
}

/// Two clouds of solid noise in each other's midst, separated by a small gap: the most expensive
/// query known for valid scans.
#[test]
fn sound_scans_stay_far_below_the_limit() {
    let noise = |seed| {
        let cloud = PointCloud::from_positions(&arbitrary::cloud(CloudKind::Random, 20_000, seed)).unwrap();
        Scan::build(&cloud, &BuildOptions::default()).unwrap()
    };
    let (a, b) = (noise(1), noise(2));
    let options = CollideOptions::estimated().with_semantics(Semantics::Thickened(1e-9));
    let plan = CollidePlan::new(&options, &a, &b).unwrap();
    let answer =
        Pair::new(a.at(&Pose::IDENTITY), b.at(&Pose::IDENTITY)).collide(&plan, &mut Scratch::default());
    assert!(answer.verdict.is_separated(), "{answer:?}");
    let leaves = (a.topology().leaves() + b.topology().leaves()) as u64;
    assert!(answer.statistics.leaf_pairs < 128 * leaves / 6, "{:?} of {leaves} leaves", answer.statistics);
}
