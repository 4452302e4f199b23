//! Exclusion by coverings against its naive twin.
#![expect(clippy::unwrap_used, reason = "a test may panic")]

use nearmiss_geometry::{NodeId, PointCloud, Pose};
use nearmiss_hierarchy::{BuildOptions, NodePair, OrientedBox, PointHierarchy, Relative, apart};
use nearmiss_testdata::arbitrary::{self, CloudKind};
use nearmiss_testdata::oracle::{Solid, clearance};

fn build(kind: CloudKind, seed: u64, options: &BuildOptions) -> PointHierarchy {
    let cloud = PointCloud::from_positions(&arbitrary::cloud(kind, 200, seed)).unwrap();
    PointHierarchy::build(&cloud, options).unwrap()
}

fn moved(pose: &Pose, b: &OrientedBox) -> Solid {
    Solid {
        centre: pose.apply(b.centre.map(f64::from)),
        half: b.half.map(|h| pose.scale() * f64::from(h)),
        axes: b.axes.map(|axis| pose.rotate(axis.map(f64::from))),
    }
}

fn centres(scan: &PointHierarchy, node: usize, pose: &Pose) -> Vec<[f64; 3]> {
    scan.slices().samples(node).iter().map(|i| pose.apply(scan.positions()[i].map(f64::from))).collect()
}

#[test]
fn what_is_excluded_is_what_the_twin_excludes() {
    let (mut pairs, mut excluded, mut undecided) = (0, 0, 0);
    for (kind, seed) in
        [(CloudKind::Sphere, 1), (CloudKind::Random, 2), (CloudKind::Rings, 3), (CloudKind::Coplanar, 4)]
    {
        let a = build(CloudKind::Sphere, 9, &BuildOptions::default().with_samples(8));
        let b = build(kind, seed, &BuildOptions::default().with_leaf_size(8));
        let mut random = arbitrary::rng(seed);
        for round in 0..4 {
            let pose = arbitrary::pose(&mut random, 1.5);
            let reach = 0.05 * f64::from(round);
            let motion = Relative::new(&pose, 10.0);
            for i in 0..a.nodes().len() {
                for j in 0..b.nodes().len() {
                    let id = |k: usize| NodeId(u32::try_from(k).unwrap());
                    #[expect(clippy::cast_possible_truncation, reason = "a reach")]
                    let found = apart(
                        &a.slices(),
                        &b.slices(),
                        NodePair { a: id(i), b: id(j) },
                        &motion,
                        reach as f32,
                    );
                    let (ra, rb) = (a.slices().covering_radius(i), b.slices().covering_radius(j));
                    let rest = Pose::default();
                    let clear = clearance(
                        (&centres(&a, i, &rest), f64::from(ra), &moved(&rest, &a.slices().enclosure(i))),
                        (
                            &centres(&b, j, &pose),
                            pose.scale() * f64::from(rb),
                            &moved(&pose, &b.slices().enclosure(j)),
                        ),
                    );
                    assert!(!found || clear > reach, "{kind:?}: {i} and {j} are excluded at {clear}");
                    undecided += u32::from(!found && clear > reach);
                    pairs += 1;
                    excluded += u32::from(found);
                }
            }
        }
    }
    assert!(excluded > pairs / 20 && excluded < pairs / 2, "{excluded} of {pairs}");
    assert!(undecided < pairs / 500, "{undecided} of {pairs} within rounding");
}
