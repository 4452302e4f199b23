//! The answers at query times, and their summary.

use serde::Serialize;

use super::body::Found;
use crate::console::Results;
use crate::digits::{count, short};
use crate::error::CliError;
use crate::report::median;

/// The JSON output of `animate`.
#[derive(Debug, Serialize)]
struct AnimateReport {
    t: f64,
    bv_updates: u64,
    events: u64,
    update_micros: f64,
    query_micros: f64,
    verdict: Option<&'static str>,
    evidence: Option<&'static str>,
}

/// One query time.
#[derive(Debug, Clone, Copy)]
pub(super) struct Moment {
    pub(super) t: f64,
    pub(super) bv_updates: u64,
    pub(super) events: u64,
    /// The number of bodies that were prepared anew.
    pub(super) rebuilt: usize,
    pub(super) update_micros: f64,
    pub(super) query_micros: f64,
    pub(super) found: Option<Found>,
}

impl Moment {
    pub(super) fn print(&self, json: bool, results: &mut Results) -> Result<(), CliError> {
        let Self { t, bv_updates, events, update_micros, query_micros, found, .. } = *self;
        if json {
            let verdict = found.map(|found| found.verdict);
            let evidence = found.and_then(|found| found.evidence);
            let report =
                AnimateReport { t, bv_updates, events, update_micros, query_micros, verdict, evidence };
            return results.json(&report);
        }
        let said = found.map_or("moved".to_owned(), Found::words);
        results.line(format_args!(
            "{} s: {said} (moved in {} µs, asked in {} µs)",
            short(t),
            short(update_micros),
            short(query_micros)
        ))
    }
}

/// The verdicts and times of all query times.
#[derive(Debug, Default)]
pub(super) struct Summary {
    verdicts: Vec<&'static str>,
    rebuilt: usize,
    events: u64,
    updates: Vec<f32>,
    queries: Vec<f32>,
}

impl Summary {
    #[expect(clippy::cast_possible_truncation, reason = "times to show with three digits")]
    pub(super) fn add(&mut self, moment: &Moment) {
        self.verdicts.extend(moment.found.map(|found| found.verdict));
        self.rebuilt += moment.rebuilt;
        self.events += moment.events;
        self.updates.push(moment.update_micros as f32);
        self.queries.push(moment.query_micros as f32);
    }

    /// Returns the times in microseconds that the last update and the last query took.
    pub(super) fn last(&self) -> [f64; 2] {
        [&self.updates, &self.queries].map(|times| times.last().map_or(0.0, |micros| f64::from(*micros)))
    }

    pub(super) fn text(&self) -> String {
        let times = count(self.updates.len() as u64, "query time");
        let of = |word: &str| self.verdicts.iter().filter(|verdict| **verdict == word).count();
        let verdicts = ["intersecting", "separated", "undecided"];
        let verdicts: Vec<String> = verdicts
            .map(|word| (of(word), word))
            .into_iter()
            .filter(|(count, _)| *count > 0)
            .map(|(count, word)| format!("{count} {word}"))
            .collect();
        let verdicts = if verdicts.is_empty() { "no test".to_owned() } else { verdicts.join(", ") };
        let (update, query) = (median(&self.updates), median(&self.queries));
        format!(
            "{times}: {verdicts}; {}; medians: moved in {} µs, asked in {} µs",
            if self.events > 0 {
                count(self.events, "event")
            } else {
                format!("prepared anew {}", count(self.rebuilt as u64, "time"))
            },
            short(update.into()),
            short(query.into())
        )
    }
}
