//! Thousands of damaged files.

use nearmiss::{
    Bandwidth, BuildOptions, Check, GraphOptions, LoadError, Paths, PointCloud, Scan, SurfaceOptions, Verdict,
};
use nearmiss_testdata::arbitrary::{self, CloudKind};

use crate::hostile::cases::{self, repaired};
use crate::hostile::damage::{Random, damage};
use crate::hostile::exercise::{Answers, exercise};

/// A valid scan, its file, and its answers.
struct Sample {
    scan: Scan,
    bytes: Vec<u8>,
    answers: Answers,
}

impl Sample {
    fn of(scan: Scan) -> Self {
        let mut bytes = Vec::new();
        scan.write_to(&mut bytes).unwrap();
        let answers = exercise(&scan, &scan);
        Self { scan, bytes, answers }
    }
}

impl cases::Sample for Sample {
    type Answers = Answers;

    fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    fn ask(&self, bytes: Vec<u8>, check: Check) -> Result<Answers, LoadError> {
        Scan::from_bytes(bytes, check).map(|scan| exercise(&scan, &self.scan))
    }
}

fn samples() -> Vec<Sample> {
    let global = SurfaceOptions::default().with_bandwidth(Bandwidth::Global);
    let kinds = [
        (CloudKind::Sphere, 120, BuildOptions::default()),
        (CloudKind::Random, 150, BuildOptions::default().with_leaf_size(4)),
        (CloudKind::Rings, 300, BuildOptions::default().with_leaf_size(64)),
        (CloudKind::FarClusters, 110, BuildOptions::default().with_surface(global)),
        (CloudKind::Lattice, 125, BuildOptions::default()),
        (CloudKind::Outlier, 130, BuildOptions::default().with_radius_neighbours(3)),
    ];
    let sample = |(kind, n, options)| {
        let cloud = PointCloud::cleaned(&arbitrary::cloud(kind, n, 7)).unwrap();
        Sample::of(Scan::build(&cloud, &options).unwrap())
    };
    let bare = kinds.into_iter().map(sample);
    let graphs = [
        (CloudKind::Sphere, 400, GraphOptions::default().with_close_pairs(Some(Paths::Rebuilt))),
        (CloudKind::Clustered, 300, GraphOptions::default().with_close_pairs(Some(Paths::Stored))),
        (CloudKind::FarClusters, 330, GraphOptions::default()),
    ];
    let joined = |(kind, n, options): (CloudKind, u32, GraphOptions)| {
        let cloud = PointCloud::cleaned(&arbitrary::cloud(kind, n, 7)).unwrap();
        let scan = Scan::build(&cloud, &BuildOptions::default()).unwrap();
        Sample::of(scan.with_graph(&cloud, &options, None).unwrap())
    };
    bare.chain(graphs.into_iter().map(joined)).collect()
}

/// Outcomes of the damaged files.
#[derive(Debug, Default)]
struct Tally {
    refused: u32,
    /// Opened, with unchanged answers.
    same: u32,
    /// Opened, with changed answers.
    other: u32,
    /// Changed answers that are undecided.
    undecided: u32,
}

/// Opens files damaged by `spoil`, and runs all queries on those that open.
fn run(seed: u64, check: Check, spoil: impl Fn(&mut Vec<u8>, &mut Random)) -> Tally {
    let mut tally = Tally::default();
    cases::run(&samples(), seed, check, spoil, |sample, answers| match answers {
        None => tally.refused += 1,
        Some(answers) if answers == sample.answers => tally.same += 1,
        Some(answers) => {
            tally.other += 1;
            let undecided = answers.collide.iter().filter(|a| matches!(a.verdict, Verdict::Undecided(_)));
            tally.undecided += u32::from(undecided.count() > 0);
        }
    });
    println!("{check:?}: {tally:?}");
    tally
}

#[test]
fn damage_is_refused_or_does_no_harm() {
    let tally = run(1, Check::Full, damage);
    assert_eq!(tally.other, 0, "an answer that differs from the sound file's");
    assert!(tally.refused > 0 && tally.same > 0, "{tally:?}: most damage shows, some undoes itself");
}

#[test]
fn damage_with_fitting_checksums_is_refused_or_harmless() {
    let tally = run(2, Check::Full, repaired);
    assert!(tally.refused > 10 * tally.other, "{tally:?}: little gets past the checks of every number");
}

#[test]
fn damage_with_fitting_checksums_does_not_stop_a_query_that_trusts_the_file() {
    let tally = run(3, Check::Structure, repaired);
    assert!(tally.refused > 0 && tally.other > 0, "{tally:?}: both ways are taken");
}
