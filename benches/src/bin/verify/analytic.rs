//! Scores verdicts on the shapes with known answers, by family and noise.
//!
//! The check fails if a verdict outside the band is wrong or missing. `Ambiguous` is allowed for
//! one in twenty of the separate thin pairs.

use std::collections::BTreeMap;

use nearmiss::{BuildOptions, CollidePlan, Pair, PointCloud, Reason, Scan, Scratch, Verdict};
use nearmiss_benches::Failure;
use nearmiss_benches::asked::Asking;
use nearmiss_testdata::pairs::{self, SetOptions, analytic_set};

/// Thin pairs for each one that may be `Ambiguous`.
const THIN_ALLOWANCE: usize = 20;

/// Counts of one family at one level of noise.
#[derive(Debug, Clone, Copy, Default)]
struct Row {
    outside: usize,
    false_hits: usize,
    misses: usize,
    undecided: usize,
    excused: usize,
    band: usize,
    band_wrong: usize,
}

impl Row {
    fn count(&mut self, pair: &pairs::Pair, verdict: &Verdict) -> bool {
        let undecided = matches!(verdict, Verdict::Undecided(_));
        let wrong = !undecided && verdict.is_intersecting() != pair.truth;
        if pair.is_in_band() {
            self.band += 1;
            self.band_wrong += usize::from(wrong);
            return true;
        }
        self.outside += 1;
        if pair.thin && matches!(verdict, Verdict::Undecided(Reason::Ambiguous)) {
            self.excused += 1;
            return true;
        }
        self.undecided += usize::from(undecided);
        self.misses += usize::from(wrong && pair.truth);
        self.false_hits += usize::from(wrong && !pair.truth);
        !undecided && !wrong
    }
}

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Repeats of every pair
    #[arg(long, value_name = "N", default_value_t = 3)]
    repeats: u32,
    /// Seed of the random numbers
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// List every wrong or missing verdict outside the band
    #[arg(long)]
    list: bool,
    #[command(flatten)]
    asking: Asking,
}

/// Returns `true` if the check passes.
pub(crate) fn run(arguments: &Arguments) -> Result<bool, Failure> {
    let &Arguments { repeats, seed, list, asking } = arguments;
    let options = asking.options();
    let set = analytic_set(seed, &SetOptions { repeats, ..SetOptions::default() });
    let build = |points: &Vec<[f64; 3]>| -> Result<Scan, Failure> {
        Ok(Scan::build(&PointCloud::from_positions(points)?, &BuildOptions::default())?)
    };
    let scans: Vec<Scan> = set.shapes.iter().map(|shape| build(&shape.points)).collect::<Result<_, _>>()?;
    let mut scratch = Scratch::default();
    // By family and noise in tenths of a percent.
    let mut rows: BTreeMap<(&str, String), Row> = BTreeMap::new();
    let mut clean = true;
    for pair in &set.pairs {
        let (a, b) = (&scans[pair.a], &scans[pair.b]);
        let plan = CollidePlan::new(&options, a, b)?;
        let (va, vb) = (a.at(&pair.pose_a), b.at(&pair.pose_b));
        let verdict = Pair::new(va, vb).collide(&plan, &mut scratch).verdict;
        let row = rows.entry((pair.family, format!("{:4.2}", pair.noise))).or_default();
        let right = row.count(pair, &verdict);
        clean &= right;
        if list && !right {
            println!("{} noise {}, gap {:+.2} r: {verdict:?}", pair.family, pair.noise, pair.gap / pair.r);
        }
    }
    let thin = set.pairs.iter().filter(|pair| pair.thin && !pair.is_in_band()).count();
    let excused: usize = rows.values().map(|row| row.excused).sum();
    clean &= excused * THIN_ALLOWANCE <= thin;
    print_rows(&rows);
    println!("\n{excused} of {thin} thin pairs ambiguous; {}", if clean { "passed" } else { "FAILED" });
    Ok(clean)
}

fn print_rows(rows: &BTreeMap<(&str, String), Row>) {
    println!(
        "| family | noise | outside | false hits | misses | undecided | thin, ambiguous | band | wrong |"
    );
    println!("| --- | --: | --: | --: | --: | --: | --: | --: | --: |");
    for ((family, noise), row) in rows {
        println!(
            "| {family} | {noise} | {} | {} | {} | {} | {} | {} | {} |",
            row.outside, row.false_hits, row.misses, row.undecided, row.excused, row.band, row.band_wrong
        );
    }
}
