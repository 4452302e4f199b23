//! Answers along a path of poses, as a summary, a table and a plot.

use std::io::Write;
use std::path::{Path, PathBuf};

use clap::Args;

use crate::digits::{bounds, count, rounded_up, short};
use crate::error::CliError;
use crate::output;
use crate::path_entry::{PathEntry, PathVerdict};
use crate::path_plot::PathPlot;

/// Options of commands that answer for many poses.
#[derive(Debug, Clone, Args)]
pub struct PathArgs {
    /// Answer one query for each pose in this file, one pose on each line; `-` reads standard input
    ///
    /// A line is `{"a":[…],"b":[…]}` (either may be left out), or the pose of B alone. The latter is
    /// 16, 12 (KITTI) or 7 numbers (x y z qx qy qz qw), 8 with the time first (TUM), or a JSON array.
    /// The file may also be a table with columns x,y,z,qx,qy,qz,qw. Each pose gets one line of output,
    /// in order; a summary follows.
    #[arg(long, value_name = "FILE")]
    pub poses: Option<PathBuf>,
    /// Write a table with a row for each pose of --poses, or for each contact of --all
    ///
    /// Among the columns for a pose are line number, time, verdict, evidence, clearance and place.
    #[arg(long, value_name = "OUT.csv", help_heading = "Output")]
    pub csv: Option<PathBuf>,
    /// Plot clearance and verdict over --poses, as SVG
    #[arg(long, value_name = "OUT.svg", requires = "poses", help_heading = "Output")]
    pub plot: Option<PathBuf>,
}

impl PathArgs {
    /// Checks the outputs before any work is done. `all` is the option --all, where a command has it.
    pub(crate) fn check(&self, inputs: &[&Path], all: Option<bool>) -> Result<(), CliError> {
        if self.csv.is_some() && self.poses.is_none() && all != Some(true) {
            let or_all = if all.is_some() { " or --all" } else { "" };
            return Err(CliError::Usage(format!(
                "--csv writes a table of several answers; give --poses{or_all}"
            )));
        }
        let mut inputs = inputs.to_vec();
        inputs.extend(self.poses.as_deref());
        for path in self.csv.iter().chain(&self.plot) {
            output::check_apart(path, &inputs)?;
        }
        match &self.plot {
            Some(path) if !path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("svg")) => {
                let path = path.display();
                Err(CliError::Usage(format!("--plot: expected a name that ends in .svg, got `{path}`")))
            }
            _ => Ok(()),
        }
    }

    /// Returns `true` if an output file needs the clearance of each pose.
    pub(crate) fn wants_clearance(&self) -> bool {
        self.csv.is_some() || self.plot.is_some()
    }
}

/// Collects the answers along a path. All answers are kept only if there is a plot.
pub(crate) struct PathLog<'a> {
    csv: Option<(PathBuf, &'a mut (dyn Write + 'a))>,
    kept: Option<Vec<PathEntry>>,
    /// The number of separated, undecided and intersecting poses.
    counts: [u64; 3],
    /// The first contact.
    first: Option<PathEntry>,
    /// The separated pose with the smallest clearance.
    least: Option<PathEntry>,
    /// The number of separated poses without a known clearance, and the line of the first one.
    unknown: (u64, u64),
    /// `true` if the table has columns about penetrations.
    has_penetrations: bool,
    /// The number of poses with one thing inside the other.
    nested: u64,
    /// The pose with the greatest upper bound of the penetration.
    deepest: Option<PathEntry>,
}

impl<'a> PathLog<'a> {
    /// Starts a log that writes its table to `csv`, with penetrations if `has_penetrations`.
    pub(crate) fn new(
        args: &PathArgs,
        csv: Option<&'a mut (dyn Write + 'a)>,
        has_penetrations: bool,
    ) -> Result<Self, CliError> {
        let csv = args.csv.clone().zip(csv);
        let kept = args.plot.is_some().then(Vec::new);
        let mut log = Self {
            csv,
            kept,
            counts: [0; 3],
            first: None,
            least: None,
            unknown: (0, 0),
            has_penetrations,
            nested: 0,
            deepest: None,
        };
        let columns = "line,time,verdict,evidence,reason,clearance_lower,clearance_upper,x,y,z,micros";
        let more = if has_penetrations { ",penetration_lower,penetration_upper" } else { "" };
        log.write(&format!("{columns}{more}"))?;
        Ok(log)
    }

    fn write(&mut self, row: &str) -> Result<(), CliError> {
        match &mut self.csv {
            Some((path, out)) => writeln!(out, "{row}").map_err(CliError::writing(path)),
            None => Ok(()),
        }
    }

    /// Adds the answer for the next pose.
    pub(crate) fn add(&mut self, entry: PathEntry) -> Result<(), CliError> {
        let more = if self.has_penetrations { entry.penetration_columns() } else { String::new() };
        self.write(&format!("{}{more}", entry.row()))?;
        self.counts[entry.verdict as usize] += 1;
        self.nested += u64::from(entry.is_nested);
        let depth = |entry: &PathEntry| entry.penetration.map_or(0.0, |[_, upper]| upper);
        if depth(&entry) > self.deepest.as_ref().map_or(0.0, depth) {
            self.deepest = Some(entry);
        }
        if entry.verdict == PathVerdict::Intersecting {
            self.first.get_or_insert(entry);
        }
        let upper = |entry: &PathEntry| entry.clearance.map_or(f64::INFINITY, |[_, upper]| upper);
        let is_apart = entry.verdict == PathVerdict::Separated && !entry.is_nested;
        if is_apart && upper(&entry) < self.least.as_ref().map_or(f64::INFINITY, upper) {
            self.least = Some(entry);
        }
        if is_apart && entry.clearance.is_none() {
            let (count, first) = self.unknown;
            self.unknown = (count + 1, if count == 0 { entry.line } else { first });
        }
        if let Some(kept) = &mut self.kept {
            kept.push(entry);
        }
        Ok(())
    }

    /// Draws the plot, if there is one. `names` are those of the scans, `margin` is that of the
    /// queries.
    pub(crate) fn draw(&self, args: &PathArgs, names: &[String; 2], margin: f64) -> Result<(), CliError> {
        match (&args.plot, &self.kept) {
            (Some(path), Some(kept)) => PathPlot { names, margin }.save(path, kept),
            _ => Ok(()),
        }
    }

    /// Returns the summary as a sentence, with points rounded to `unit`. `margin` is that of the
    /// queries.
    pub(crate) fn summary(&self, unit: f64, margin: f64) -> String {
        let [apart, unknown, touching] = self.counts;
        let total = count(apart + unknown + touching, "pose");
        let first = self.first.as_ref().map(|first| format!(" (first on {})", first.where_found(unit)));
        let verb = match touching {
            _ if margin > 0.0 => format!("within {}", short(margin)),
            1 => "touches".to_owned(),
            _ => "touch".to_owned(),
        };
        let counts = [
            (touching, format!("{verb}{}", first.unwrap_or_default())),
            (apart - self.nested, "apart".to_owned()),
            (self.nested, "with one inside the other".to_owned()),
            (unknown, "undecided".to_owned()),
        ];
        let counts = counts.into_iter().filter(|(n, _)| *n > 0);
        let counts: Vec<String> = counts.map(|(n, verdict)| format!("{n} {verdict}")).collect();
        let mut text = format!("{total}: {}.", counts.join(", "));
        if let Some(PathEntry { clearance: Some(bounds), .. }) = &self.least {
            let where_found = self.least.as_ref().map(|least| least.where_found(unit)).unwrap_or_default();
            text +=
                &format!(" Smallest clearance of those apart: {}, on {where_found}.", between(*bounds, unit));
        }
        if let Some(PathEntry { penetration: Some([_, upper]), line, .. }) = &self.deepest {
            let upper = rounded_up(*upper, unit);
            text += &format!(" Greatest way out: moving b by {upper} separates them, on line {line}.");
        }
        if let (unknown @ 1.., line) = self.unknown {
            text += &format!(
                " No clearance is known for {} apart (first on line {line}): a search for the distance finds contact \
                 there.",
                count(unknown, "pose")
            );
        }
        text
    }
}

/// Returns the bounds of a clearance as text.
fn between([lower, upper]: [f64; 2], unit: f64) -> String {
    if lower.to_bits() == upper.to_bits() {
        return short(upper);
    }
    let [least, most] = bounds([lower, upper], unit);
    if lower > 0.0 { format!("between {least} and {most}") } else { format!("at most {most}") }
}
