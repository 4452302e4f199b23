//! Progress of long steps on a terminal: the share that is done, the rate, and the time left.

use std::fmt::Display;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::Duration;

use indicatif::{HumanDuration, ProgressBar};
use nearmiss::store::Progress;

use crate::console::{Console, now};
use crate::digits::{grouped, percent};

/// Steps that take less time show nothing.
const FIRST: Duration = Duration::from_millis(500);

/// The time between two updates.
const NEXT: Duration = Duration::from_millis(200);

/// The width of a bar, in characters.
const WIDTH: u8 = 20;

/// Returns the name of a file without its folder, which would not fit on a line with a bar.
pub(crate) fn short_name(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

/// The progress of a step at one time.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Told {
    /// The finished share, from 0 to 1, if the length of the step is known.
    pub(crate) share: Option<f64>,
    /// The number of things that are done.
    pub(crate) count: u64,
    /// `true` if the step may end before the share is 1.
    pub(crate) may_end_early: bool,
}

impl Told {
    /// Returns the progress of work on `count` things.
    fn of_share(progress: &Progress, count: usize) -> Self {
        let share = progress.share();
        #[expect(
            clippy::cast_precision_loss,
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a rough figure"
        )]
        let count = (share * count as f64) as u64;
        Self { share: Some(share), count, may_end_early: false }
    }
}

impl Console {
    /// Shows the progress of work on things, `things` being their plural, until the result is
    /// dropped. A thread calls `told` at intervals.
    pub(crate) fn watch(
        self,
        what: impl Display,
        things: &'static str,
        told: impl Fn() -> Told + Send + 'static,
    ) -> Watch {
        let bar = self.line_of_text();
        let (end, ended) = channel();
        let (start, what, shown) = (now(), what.to_string(), bar.clone());
        let watch = move || {
            let mut wait = FIRST;
            while ended.recv_timeout(wait) == Err(RecvTimeoutError::Timeout) {
                wait = NEXT;
                shown.set_message(line(&what, things, told(), start.elapsed().as_secs_f64()));
            }
            shown.finish_and_clear();
        };
        let thread = self.shows_bars().then(|| std::thread::Builder::new().spawn(watch).ok()).flatten();
        Watch { end: Some(end), thread, bar }
    }

    /// Shows the progress of work on `count` things, `things` being their plural.
    pub(crate) fn watch_share(
        self,
        what: impl Display,
        things: &'static str,
        progress: &Progress,
        count: usize,
    ) -> Watch {
        let progress = progress.clone();
        self.watch(what, things, move || Told::of_share(&progress, count))
    }

    /// Shows the progress of work on `points` points.
    pub(crate) fn watch_points(self, what: impl Display, progress: &Progress, points: usize) -> Watch {
        self.watch_share(what, "points", progress, points)
    }
}

/// Returns a bar with the share that is done, the number of things per second and the time left;
/// the number of things, if any, and the time so far if the share is unknown.
fn line(what: &str, things: &str, told: Told, seconds: f64) -> String {
    #[expect(
        clippy::cast_precision_loss,
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a rough figure"
    )]
    let rate = grouped((told.count as f64 / seconds) as u64);
    let Some(share) = told.share.map(|share| share.clamp(0.0, 1.0)) else {
        if told.count == 0 {
            return format!("{what}, {}", duration(seconds));
        }
        return format!("{what}: {} {things}, {rate}/s, {}", grouped(told.count), duration(seconds));
    };
    let left = if share > 0.0 {
        let most = if told.may_end_early { "at most " } else { "" };
        format!("{rate} {things}/s, {most}{} left", duration(seconds * (1.0 - share) / share))
    } else {
        duration(seconds)
    };
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most the width")]
    let full = (share * f64::from(WIDTH)) as usize;
    let (full, empty) = ("█".repeat(full), "░".repeat(usize::from(WIDTH) - full));
    format!("{what} [{full}{empty}] {}, {left}", percent(share))
}

/// Formats a duration with its largest unit.
fn duration(seconds: f64) -> String {
    /// A year, so that the conversion cannot fail.
    const LONGEST: f64 = 3.2e7;
    format!("{:#}", HumanDuration(Duration::from_secs_f64(seconds.clamp(0.0, LONGEST))))
}

/// Progress that a thread shows at intervals, until this is dropped.
#[derive(Debug)]
pub(crate) struct Watch {
    /// Ends the thread when dropped.
    end: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
    bar: ProgressBar,
}

impl Watch {
    /// Returns the bar, to be hidden while something else is printed.
    pub(crate) fn bar(&self) -> ProgressBar {
        self.bar.clone()
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        self.end = None;
        if let Some(thread) = self.thread.take() {
            let _ended = thread.join();
        }
    }
}

/// A counter that is shared with the thread that shows it.
#[derive(Debug, Clone, Default)]
pub(crate) struct Counter(Arc<AtomicU64>);

impl Counter {
    pub(crate) fn get(&self) -> u64 {
        self.0.load(Ordering::Relaxed)
    }

    pub(crate) fn set(&self, count: u64) {
        self.0.store(count, Ordering::Relaxed);
    }

    pub(crate) fn add(&self, count: u64) {
        self.0.fetch_add(count, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_has_share_rate_and_time() {
        let told = Told { share: Some(0.25), count: 250_000, may_end_early: false };
        let bar = format!("[{}{}]", "█".repeat(5), "░".repeat(15));
        let expected = format!("preparing {bar} 25 %, 125,000 points/s, 6s left");
        assert_eq!(line("preparing", "points", told, 2.0), expected);
        let told = Told { may_end_early: true, ..told };
        assert!(line("preparing", "points", told, 2.0).ends_with(" points/s, at most 6s left"));
        let told = Told { count: 30, ..Told::default() };
        assert_eq!(line("answering", "poses", told, 2.0), "answering: 30 poses, 15/s, 2s");
        assert_eq!(line("reading part.obj", "points", Told::default(), 2.0), "reading part.obj, 2s");
        let told = Told { share: Some(0.0), ..Told::default() };
        assert!(line("answering", "poses", told, 2.0).ends_with("] 0 %, 2s"));
        let told = Told { share: Some(1.5), count: 7, may_end_early: false };
        assert!(line("answering", "poses", told, 1.0).ends_with("█] 100 %, 7 poses/s, 0s left"));
    }

    #[test]
    fn counters_are_shared_and_shares_become_points() {
        let (counter, progress) = (Counter::default(), Progress::default());
        let other = counter.clone();
        counter.set(3);
        other.add(4);
        assert_eq!(counter.get(), 7);
        progress.reach(0.5);
        let told = Told::of_share(&progress, 1000);
        assert_eq!((told.share, told.count), (Some(0.5), 500));
    }
}
