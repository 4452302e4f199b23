//! Standard error (progress, notes, warnings and errors), standard output, and the clock.

use std::fmt::{self, Display};
use std::io::{self, BufWriter, IsTerminal, StdoutLock, Write};
use std::process::ExitCode;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use serde::Serialize;

use crate::digits::grouped;
use crate::error::CliError;

/// Standard error. Errors of writing to it are ignored, because they could not be reported.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Console {
    bars: bool,
    quiet: bool,
}

impl Console {
    pub(crate) fn new(quiet: bool) -> Self {
        Self { bars: !quiet && io::stderr().is_terminal(), quiet }
    }

    /// Prints a line, unless `--quiet` is given.
    pub(crate) fn note(self, what: impl Display) {
        if !self.quiet {
            let _ = writeln!(io::stderr().lock(), "{what}");
        }
    }

    /// Returns a spinner, for a step of unknown length; it disappears when dropped.
    pub(crate) fn spinner(self, what: impl Display) -> Bar {
        let bar = self.bar(ProgressBar::new_spinner(), "{spinner} {msg} {elapsed}");
        bar.set_message(what.to_string());
        if self.bars {
            bar.enable_steady_tick(Duration::from_millis(100));
        }
        Bar(bar)
    }

    /// Returns a progress bar for `length` steps, with the rate and the time left; it disappears
    /// when dropped.
    pub(crate) fn steps(self, what: impl Display, length: u64) -> Bar {
        let bar = self.bar(ProgressBar::new(length), "{msg} [{bar:20}] {percent} %, {rate}/s, {eta} left");
        bar.set_message(what.to_string());
        Bar(bar)
    }

    /// Returns a progress bar for about `length` points, with the rate and the time left; it
    /// disappears when dropped.
    pub(crate) fn rate(self, what: impl Display, length: u64) -> Bar {
        let template = "{msg} [{bar:30}] {human_pos} points, {rate}/s, {eta} left";
        let bar = self.bar(ProgressBar::new(length), template);
        bar.set_message(what.to_string());
        Bar(bar)
    }

    /// Returns `true` if bars are shown.
    pub(crate) fn shows_bars(self) -> bool {
        self.bars
    }

    /// Returns a line of text, which is not drawn before its first update.
    pub(crate) fn line_of_text(self) -> ProgressBar {
        self.bar(ProgressBar::new_spinner(), "{msg}")
    }

    fn bar(self, bar: ProgressBar, template: &str) -> ProgressBar {
        let target = if self.bars { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
        bar.set_draw_target(target);
        let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
        bar.with_style(style.with_key("rate", |state: &ProgressState, out: &mut dyn fmt::Write| {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a rough figure")]
            let rate = state.per_sec() as u64;
            let _ = out.write_str(&grouped(rate));
        }))
    }
}

/// Progress on a terminal, which disappears when dropped.
#[derive(Debug)]
pub(crate) struct Bar(ProgressBar);

impl Bar {
    pub(crate) fn advance(&self, steps: u64) {
        self.0.inc(steps);
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}

/// Prints a warning on standard error.
pub(crate) fn warn(what: impl Display) {
    let _ = writeln!(io::stderr().lock(), "warning: {what}");
}

/// Prints an error, unless it is silent, and returns the exit status.
pub(crate) fn fail(error: &CliError) -> ExitCode {
    if !error.is_silent() {
        say_error(error);
    }
    ExitCode::from(error.status())
}

/// Prints an error on standard error.
pub(crate) fn say_error(what: impl Display) {
    let _ = writeln!(io::stderr().lock(), "error: {what}");
}

/// Standard output, which carries nothing but results.
#[derive(Debug)]
pub(crate) struct Results {
    out: BufWriter<Uncovered>,
}

/// Standard output. A bar is hidden while it is written.
#[derive(Debug)]
struct Uncovered {
    out: StdoutLock<'static>,
    bar: Option<ProgressBar>,
}

impl Write for Uncovered {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let Self { out, bar } = self;
        match bar {
            Some(bar) => bar.suspend(|| out.write_all(bytes).map(|()| bytes.len())),
            None => out.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        let Self { out, bar } = self;
        match bar {
            Some(bar) => bar.suspend(|| out.flush()),
            None => out.flush(),
        }
    }
}

impl Results {
    pub(crate) fn new() -> Self {
        let out = Uncovered { out: io::stdout().lock(), bar: None };
        Self { out: BufWriter::with_capacity(1 << 16, out) }
    }

    /// Hides this bar whenever results are written.
    pub(crate) fn hide(&mut self, bar: ProgressBar) {
        self.out.get_mut().bar = Some(bar);
    }

    /// Writes a line of text.
    pub(crate) fn line(&mut self, text: impl Display) -> Result<(), CliError> {
        writeln!(self.out, "{text}").map_err(CliError::Stdout)
    }

    /// Writes a line of JSON.
    pub(crate) fn json(&mut self, value: &impl Serialize) -> Result<(), CliError> {
        serde_json::to_writer(&mut self.out, value).map_err(|e| CliError::Stdout(e.into()))?;
        self.line("")
    }

    /// Writes out the buffer. Without this call, an error of the last write would go unnoticed.
    pub(crate) fn flush(&mut self) -> Result<(), CliError> {
        self.out.flush().map_err(CliError::Stdout)
    }
}

/// Returns the current time. This is the only place where the binary reads a clock.
#[expect(clippy::disallowed_methods, reason = "answers and reports say how long they took")]
pub(crate) fn now() -> Instant {
    Instant::now()
}

/// Returns the time since `start` in microseconds.
#[expect(clippy::cast_precision_loss, reason = "nanoseconds of less than a month are exact")]
pub(crate) fn micros_since(start: Instant) -> f64 {
    now().duration_since(start).as_nanos() as f64 / 1e3
}
