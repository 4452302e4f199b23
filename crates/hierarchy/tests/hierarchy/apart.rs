//! Exclusion by coverings compared with a naive implementation.
use nearmiss_geometry::{NodeId, PointCloud, Pose};
use nearmiss_hierarchy::{BuildOptions, Extent, NodePair, OrientedBox, PointHierarchy, Relative, apart};
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

/// Returns the balls of a node in a pose (centres and radius), and its volume.
fn covering(scan: &PointHierarchy, node: usize, pose: &Pose, extent: Extent) -> (Vec<[f64; 3]>, f64, Solid) {
    let arrays = scan.arrays();
    let centres = arrays.samples(node).iter().map(|i| pose.apply(arrays.position(i).map(f64::from)));
    let (radius, volume) = match extent {
        Extent::Discs => {
            (arrays.sampling_radius_of(node), arrays.tree.bounds(NodeId(u32::try_from(node).unwrap())))
        }
        Extent::Surface => (arrays.covering_radius(node), arrays.enclosure(node)),
    };
    (centres.collect(), pose.scale() * f64::from(radius), moved(pose, &volume))
}

/// Returns the number of node pairs, of excluded ones, and of those that only the naive
/// implementation excludes.
fn compare(a: &PointHierarchy, b: &PointHierarchy, pose: &Pose, reach: f64, extent: Extent) -> [u32; 3] {
    let relative = Relative::new(pose, 10.0);
    let id = |k: usize| NodeId(u32::try_from(k).unwrap());
    let mut counts = [0; 3];
    for i in 0..a.topology().len() {
        let (centres_a, radius_a, volume_a) = covering(a, i, &Pose::IDENTITY, extent);
        for j in 0..b.topology().len() {
            let (centres_b, radius_b, volume_b) = covering(b, j, pose, extent);
            let clear = clearance((&centres_a, radius_a, &volume_a), (&centres_b, radius_b, &volume_b));
            let pair = NodePair { a: id(i), b: id(j) };
            #[expect(clippy::cast_possible_truncation, reason = "a reach")]
            let found = apart(&a.arrays(), &b.arrays(), pair, &relative, reach as f32, extent);
            assert!(!found || clear > reach, "{i} and {j} are excluded at {clear}");
            counts[0] += 1;
            counts[1] += u32::from(found);
            counts[2] += u32::from(!found && clear > reach);
        }
    }
    counts
}

#[test]
fn what_is_excluded_is_what_the_twin_excludes() {
    let a = build(CloudKind::Sphere, 9, &BuildOptions::default().with_samples(8));
    for extent in [Extent::Discs, Extent::Surface] {
        let mut sums = [0; 3];
        for (kind, seed) in
            [(CloudKind::Sphere, 1), (CloudKind::Random, 2), (CloudKind::Rings, 3), (CloudKind::Coplanar, 4)]
        {
            let b = build(kind, seed, &BuildOptions::default().with_leaf_size(8));
            let mut random = arbitrary::rng(seed);
            for round in 0..4 {
                let pose = arbitrary::pose(&mut random, 1.5);
                let counts = compare(&a, &b, &pose, 0.05 * f64::from(round), extent);
                sums = [0, 1, 2].map(|k| sums[k] + counts[k]);
            }
        }
        let [pairs, excluded, missed] = sums;
        assert!(excluded > pairs / 20 && excluded < pairs - pairs / 20, "{extent:?}: {sums:?}");
        assert!(missed < pairs / 500, "{extent:?}: {sums:?}");
    }
}
