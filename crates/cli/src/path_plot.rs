//! An SVG plot of clearance and verdict along a path of poses.

use std::fmt::Write as _;
use std::path::Path;

use crate::digits::short;
use crate::error::CliError;
use crate::output;
use crate::path_entry::{PathEntry, PathVerdict};

/// Width and height of the picture.
const SIZE: [f64; 2] = [960.0, 360.0];

/// The left, right, top and bottom of the plot area.
const AREA: [f64; 4] = [72.0, 944.0, 40.0, 268.0];

/// The height of the strip of verdicts, and its distance from the plot area above.
const STRIP: [f64; 2] = [14.0, 8.0];

/// The largest number of columns; if there are more poses, several share a column.
const COLUMNS: usize = 800;

const CLEARANCE: &str = "#1f6fb2";
const MARGIN: &str = "#b2541f";
const FRAME: &str = "#555";

/// Returns the colour of a verdict.
fn colour(verdict: PathVerdict) -> &'static str {
    match verdict {
        PathVerdict::Separated => "#4c9f70",
        PathVerdict::Undecided => "#a8a8a8",
        PathVerdict::Intersecting => "#cc3b3b",
    }
}

/// The settings of the plot.
#[derive(Debug)]
pub(crate) struct PathPlot<'a> {
    /// The names of both scans.
    pub(crate) names: &'a [String; 2],
    /// The distance below which scans count as touching.
    pub(crate) margin: f64,
}

/// A summary of the answers that share a column.
#[derive(Debug, Clone, Copy)]
struct Column {
    /// The coordinates of its first and last answer on the horizontal axis.
    from: f64,
    to: f64,
    /// The smallest lower and the smallest upper bound.
    clearance: Option<[f64; 2]>,
    /// The most severe verdict.
    verdict: PathVerdict,
}

impl PathPlot<'_> {
    /// Saves the plot, whole or not at all.
    pub(crate) fn save(&self, path: &Path, entries: &[PathEntry]) -> Result<(), CliError> {
        let svg = self.draw(entries);
        output::replace_plain(path, |out| std::io::Write::write_all(out, svg.as_bytes()))
    }

    fn draw(&self, entries: &[PathEntry]) -> String {
        let (label, columns) = columns(entries);
        let [left, right, top, bottom] = AREA;
        let first = columns.first().map_or(0.0, |column| column.from);
        let last = columns.last().map_or(1.0, |column| column.to);
        let span = if last > first { last - first } else { 1.0 };
        let x = |place: f64| left + (right - left) * (place - first) / span;
        let highest = columns.iter().filter_map(|column| column.clearance).map(|[_, upper]| upper);
        let highest = highest.chain([self.margin]).fold(0.0, f64::max);
        let (step, ticks) = ticks(highest);
        let full = if highest > 0.0 { step * f64::from(ticks) } else { 1.0 };
        let y = |length: f64| bottom - (bottom - top) * (length.max(0.0) / full).min(1.0);

        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" font-family=\"system-ui, \
             'DejaVu Sans', sans-serif\" font-size=\"13\" fill=\"#222\">\n<rect width=\"100%\" height=\"100%\" \
             fill=\"#fff\"/>\n",
            SIZE[0], SIZE[1]
        );
        let mut put = |text: &str| {
            svg.push_str(text);
            svg.push('\n');
        };
        put(&format!(
            "<text x=\"{left}\" y=\"22\" font-size=\"15\">Clearance between {} and {}</text>",
            escaped(&self.names[0]),
            escaped(&self.names[1])
        ));
        for tick in 0..=ticks {
            let length = step * f64::from(tick);
            let level = y(length);
            put(&format!(
                "<line x1=\"{left}\" y1=\"{level:.1}\" x2=\"{right}\" y2=\"{level:.1}\" stroke=\"#ddd\"/>\
                 <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
                left - 8.0,
                level + 4.5,
                short(length)
            ));
        }
        // Upper bounds from left to right, then lower bounds back.
        for run in columns.chunk_by(|one, next| one.clearance.is_some() && next.clearance.is_some()) {
            let known: Vec<(f64, [f64; 2])> =
                run.iter().filter_map(|c| Some((0.5 * (c.from + c.to), c.clearance?))).collect();
            let line = |k: usize| {
                known.iter().fold(String::new(), |mut text, (place, bounds)| {
                    let _ = write!(text, "{:.1},{:.1} ", x(*place), y(bounds[k]));
                    text
                })
            };
            let back: Vec<String> = line(0).split(' ').rev().map(str::to_owned).collect();
            put(&format!(
                "<polygon points=\"{}{}\" fill=\"{CLEARANCE}\" fill-opacity=\"0.22\"/>\
                 <polyline points=\"{}\" fill=\"none\" stroke=\"{CLEARANCE}\" stroke-width=\"1.5\"/>",
                line(1),
                back.join(" ").trim_start(),
                line(1)
            ));
        }
        if self.margin > 0.0 {
            let level = y(self.margin);
            put(&format!(
                "<line x1=\"{left}\" y1=\"{level:.1}\" x2=\"{right}\" y2=\"{level:.1}\" stroke=\"{MARGIN}\" \
                 stroke-dasharray=\"6 4\"/><text x=\"{right}\" y=\"{:.1}\" text-anchor=\"end\" \
                 fill=\"{MARGIN}\">margin {}</text>",
                level - 5.0,
                short(self.margin)
            ));
        }
        let [height, gap] = STRIP;
        let mut start = left;
        let mut columns_left = &columns[..];
        for run in columns.chunk_by(|one, next| one.verdict == next.verdict) {
            columns_left = &columns_left[run.len()..];
            // A run ends half way to the next one.
            let end = match (run.last(), columns_left.first()) {
                (Some(own), Some(next)) => x(0.5 * (own.to + next.from)),
                _ => right,
            };
            put(&format!(
                "<rect x=\"{start:.2}\" y=\"{:.1}\" width=\"{:.2}\" height=\"{height}\" fill=\"{}\"/>",
                bottom + gap,
                (end - start).max(1.0),
                colour(run[0].verdict)
            ));
            start = end;
        }
        put(&format!(
            "<rect x=\"{left}\" y=\"{top}\" width=\"{}\" height=\"{}\" fill=\"none\" stroke=\"{FRAME}\"/>",
            right - left,
            bottom - top
        ));
        let below = bottom + gap + height + 18.0;
        put(&format!(
            "<text x=\"{left}\" y=\"{below}\">{label} {}</text><text x=\"{right}\" y=\"{below}\" \
             text-anchor=\"end\">{label} {}</text>",
            place(first),
            place(last)
        ));
        let mut at = left;
        for (verdict, word) in [
            (PathVerdict::Separated, "apart"),
            (PathVerdict::Intersecting, "touch"),
            (PathVerdict::Undecided, "undecided"),
        ] {
            put(&format!(
                "<rect x=\"{at}\" y=\"{}\" width=\"12\" height=\"12\" fill=\"{}\"/><text x=\"{}\" \
                 y=\"{}\">{word}</text>",
                SIZE[1] - 30.0,
                colour(verdict),
                at + 18.0,
                SIZE[1] - 19.0
            ));
            at += 110.0;
        }
        put(&format!(
            "<rect x=\"{at}\" y=\"{}\" width=\"12\" height=\"12\" fill=\"{CLEARANCE}\" \
             fill-opacity=\"0.5\"/><text x=\"{}\" y=\"{}\">clearance, between its bounds; lengths in world \
             units</text>",
            SIZE[1] - 30.0,
            at + 18.0,
            SIZE[1] - 19.0
        ));
        svg.push_str("</svg>\n");
        svg
    }
}

/// Returns the name of the horizontal axis and the columns. The axis is the time if every pose has
/// one and times do not decrease, and the number of the line otherwise.
fn columns(entries: &[PathEntry]) -> (&'static str, Vec<Column>) {
    let has_times = entries.iter().all(|entry| entry.time.is_some_and(f64::is_finite))
        && entries.windows(2).all(|pair| pair[0].time <= pair[1].time);
    #[expect(clippy::cast_precision_loss, reason = "numbers of lines are exact up to 2⁵³")]
    let place = |entry: &PathEntry| entry.time.filter(|_| has_times).unwrap_or(entry.line as f64);
    let together = entries.len().div_ceil(COLUMNS).max(1);
    let columns = entries.chunks(together).map(|chunk| {
        let least = |a: Option<[f64; 2]>, b: Option<[f64; 2]>| match (a, b) {
            (Some(a), Some(b)) => Some([a[0].min(b[0]), a[1].min(b[1])]),
            (one, other) => one.or(other),
        };
        Column {
            from: place(&chunk[0]),
            to: place(&chunk[chunk.len() - 1]),
            clearance: chunk.iter().map(|entry| entry.clearance).fold(None, least),
            verdict: chunk.iter().map(|entry| entry.verdict).max().unwrap_or(PathVerdict::Undecided),
        }
    });
    (if has_times { "time" } else { "line" }, columns.collect())
}

/// Returns a step of 1, 2 or 5 times a power of ten, and the number of steps, 3 to 8, that reach
/// `highest`.
fn ticks(highest: f64) -> (f64, u32) {
    if highest <= 0.0 || !highest.is_finite() {
        return (1.0, 1);
    }
    let power = 10.0_f64.powf((highest / 3.0).log10().floor());
    let step = [1.0, 2.0, 5.0].into_iter().map(|m| m * power).rfind(|step| *step * 3.0 <= highest * 1.000_1);
    let step = step.unwrap_or(power);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most 8")]
    let count = (highest / step - 1e-3).ceil() as u32;
    (step, count)
}

/// Formats a coordinate of the horizontal axis, without trailing zeros.
fn place(x: f64) -> String {
    let text = format!("{x:.3}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// Escapes text for SVG.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(line: u64, verdict: PathVerdict, clearance: Option<[f64; 2]>) -> PathEntry {
        let time = None;
        PathEntry { line, time, verdict, evidence: None, reason: None, clearance, place: None, micros: 1.0 }
    }

    #[test]
    fn a_column_shows_the_worst_of_its_poses() {
        let mut entries: Vec<PathEntry> =
            (1..=1600).map(|line| entry(line, PathVerdict::Separated, Some([2.0, 3.0]))).collect();
        entries[801] = entry(802, PathVerdict::Intersecting, Some([0.0, 0.0]));
        let (label, columns) = columns(&entries);
        assert_eq!((label, columns.len()), ("line", 800));
        let [from, to] = [columns[400].from, columns[400].to];
        assert_eq!([from, to], [801.0, 802.0]);
        assert_eq!(columns[400].verdict, PathVerdict::Intersecting);
        assert_eq!(columns[400].clearance, Some([0.0, 0.0]));
        assert_eq!(columns[401].verdict, PathVerdict::Separated);
    }

    #[test]
    fn steps_of_the_axis_are_round() {
        for (highest, step, count) in [(1.0, 0.2, 5), (0.37, 0.1, 4), (8.1, 2.0, 5), (3e-4, 1e-4, 3)] {
            let (found, ticks) = ticks(highest);
            assert!((found - step).abs() < 1e-9 * step, "{highest}: {found}");
            assert_eq!(ticks, count, "{highest}");
        }
        assert_eq!(ticks(0.0), (1.0, 1));
    }

    #[test]
    fn names_are_escaped_and_nothing_is_drawn_of_no_poses() {
        let names = ["a<b".to_owned(), "c&d".to_owned()];
        let svg = PathPlot { names: &names, margin: 0.0 }.draw(&[]);
        assert!(svg.contains("a&lt;b and c&amp;d"), "{svg}");
        assert!(!svg.contains("NaN"), "{svg}");
    }
}
