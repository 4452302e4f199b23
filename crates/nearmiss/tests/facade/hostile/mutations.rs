//! Thousands of damaged files. `NEARMISS_MUTATIONS` sets the number of each kind, `NEARMISS_SEED`
//! the first seed.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};

use nearmiss::{
    Bandwidth, BuildOptions, Check, GraphOptions, Paths, PointCloud, Scan, SurfaceOptions, Verdict,
};
use nearmiss_testdata::arbitrary::{self, CloudKind};

use crate::hostile::damage::{Random, damage, restate_length};
use crate::hostile::exercise::{Answers, exercise};
use crate::hostile::repair::repair;

/// Time limit for a single file, on any machine that runs the tests.
const LONGEST: Duration = Duration::from_secs(20);

/// Every error message contains one of these.
const REMEDIES: [&str; 5] =
    ["prepare", "copy it again", "update the program", "name another file", "unpack it"];

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

fn setting(name: &str, default: u64) -> u64 {
    std::env::var(name).ok().and_then(|value| value.parse().ok()).unwrap_or(default)
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
    longest: Duration,
}

/// Opens files damaged by `spoil`, and runs all queries on those that open.
fn run(seed: u64, check: Check, spoil: impl Fn(&mut Vec<u8>, &mut Random)) -> Tally {
    let samples = samples();
    let mut tally = Tally::default();
    for case in 0..setting("NEARMISS_MUTATIONS", 1500) {
        let mut random = Random(seed + (setting("NEARMISS_SEED", 1) << 32) + 1000 * case);
        let sample = &samples[random.below(samples.len())];
        let mut bytes = sample.bytes.clone();
        spoil(&mut bytes, &mut random);
        let start = now();
        let outcome = catch_unwind(AssertUnwindSafe(|| match Scan::from_bytes(bytes, check) {
            Ok(scan) => Some(exercise(&scan, &sample.scan)),
            Err(error) => {
                let message = error.to_string();
                let remedy = REMEDIES.iter().any(|words| message.contains(words));
                assert!(remedy, "what would mend it? {message}");
                None
            }
        }));
        tally.longest = tally.longest.max(start.elapsed());
        match outcome.unwrap_or_else(|_| panic!("case {case} of seed {seed}")) {
            None => tally.refused += 1,
            Some(answers) if answers == sample.answers => tally.same += 1,
            Some(answers) => {
                tally.other += 1;
                let undecided = answers.collide.iter().filter(|a| matches!(a.verdict, Verdict::Undecided(_)));
                tally.undecided += u32::from(undecided.count() > 0);
            }
        }
    }
    assert!(tally.longest < LONGEST, "a file that takes {:?}", tally.longest);
    println!("{check:?}: {tally:?}");
    tally
}

#[expect(clippy::disallowed_methods, reason = "a test may read the clock")]
fn now() -> Instant {
    Instant::now()
}

#[test]
fn damage_is_refused_or_does_no_harm() {
    let tally = run(1, Check::Full, damage);
    assert_eq!(tally.other, 0, "an answer that differs from the sound file's");
    assert!(tally.refused > 0 && tally.same > 0, "{tally:?}: most damage shows, some undoes itself");
}

fn repaired(bytes: &mut Vec<u8>, random: &mut Random) {
    damage(bytes, random);
    if random.below(2) == 0 {
        restate_length(bytes);
    }
    repair(bytes);
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
