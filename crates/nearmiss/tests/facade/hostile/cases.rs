//! Cases of damaged files, the same for scans and meshes. `NEARMISS_MUTATIONS` sets the number of each
//! kind, `NEARMISS_SEED` the first seed.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};

use nearmiss::store::{ContainerFault, File};
use nearmiss::{Check, LoadError};

use crate::hostile::damage::{Random, damage, restate_length};
use crate::hostile::repair::{HEADER, ROW, repair};

/// Time limit for a single file, on any machine that runs the tests.
const LONGEST: Duration = Duration::from_secs(20);

/// Every error message contains one of these.
const REMEDIES: [&str; 5] =
    ["prepare", "copy it again", "update the program", "name another file", "unpack it"];

/// A valid file, and the queries about it.
pub(crate) trait Sample {
    type Answers;

    /// The bytes of the file.
    fn bytes(&self) -> &[u8];

    /// Opens a file, and runs all queries against the valid one.
    fn ask(&self, bytes: Vec<u8>, check: Check) -> Result<Self::Answers, LoadError>;
}

fn setting(name: &str, default: u64) -> u64 {
    std::env::var(name).ok().and_then(|value| value.parse().ok()).unwrap_or(default)
}

/// Opens files damaged by `spoil`, and passes the answers of those that open to `tell`, and `None` for
/// the others.
pub(crate) fn run<S: Sample>(
    samples: &[S],
    seed: u64,
    check: Check,
    spoil: impl Fn(&mut Vec<u8>, &mut Random),
    mut tell: impl FnMut(&S, Option<S::Answers>),
) {
    let mut longest = Duration::ZERO;
    for case in 0..setting("NEARMISS_MUTATIONS", 1500) {
        let mut random = Random(seed + (setting("NEARMISS_SEED", 1) << 32) + 1000 * case);
        let sample = &samples[random.below(samples.len())];
        let mut bytes = sample.bytes().to_vec();
        spoil(&mut bytes, &mut random);
        let start = now();
        let outcome = catch_unwind(AssertUnwindSafe(|| match sample.ask(bytes, check) {
            Ok(answers) => Some(answers),
            Err(error) => {
                let message = error.to_string();
                let remedy = REMEDIES.iter().any(|words| message.contains(words));
                assert!(remedy, "what would mend it? {message}");
                None
            }
        }));
        longest = longest.max(start.elapsed());
        tell(sample, outcome.unwrap_or_else(|_| panic!("case {case} of seed {seed}")));
    }
    assert!(longest < LONGEST, "a file that takes {longest:?}");
}

#[expect(clippy::disallowed_methods, reason = "a test may read the clock")]
fn now() -> Instant {
    Instant::now()
}

/// Damage with checksums that fit it.
pub(crate) fn repaired(bytes: &mut Vec<u8>, random: &mut Random) {
    damage(bytes, random);
    if random.below(2) == 0 {
        restate_length(bytes);
    }
    repair(bytes);
}

/// Cuts a file after each section and at many other places. `refusals` returns the errors of opening
/// such a file; it panics if the file opens.
pub(crate) fn cut_anywhere(whole: &[u8], refusals: impl Fn(&[u8]) -> [LoadError; 2]) {
    let sections = File::from_bytes(whole.to_vec(), Check::Full).unwrap().sections().to_vec();
    let ends = sections.iter().flat_map(|s| [s.offset, s.offset + s.length]);
    let boundaries = ends.map(|end| usize::try_from(end).unwrap()).chain([0, 1, 63, 64, HEADER + ROW]);
    let mut cuts = 0;
    for end in boundaries.chain((0..whole.len()).step_by(61)).filter(|&end| end < whole.len()) {
        let mut cut = whole[..end].to_vec();
        for refused in refusals(&cut) {
            let LoadError::Open(refused) = refused else { panic!("cut after {end}: {refused}") };
            let told = match refused.fault {
                ContainerFault::Empty => end == 0,
                ContainerFault::Truncated { found, .. } => found == end as u64,
                _ => false,
            };
            assert!(told, "cut after {end}: {refused}");
        }
        // Padding may follow the last section. If only padding is missing, this restores it.
        restate_length(&mut cut);
        repair(&mut cut);
        if cut.len() < whole.len() {
            refusals(&cut);
        }
        cuts += 1;
    }
    assert!(cuts > 90, "{cuts} cuts");
}
