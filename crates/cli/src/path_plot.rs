//! An SVG plot of clearance and verdict along a path of poses.

use std::fmt::{Display, Write as _};
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
        let axes = Axes::new(&columns, self.margin);
        let [left, _, top, bottom] = AREA;
        let [height, gap] = STRIP;
        let mut drawing = Drawing::new();
        let title = format!("Clearance between {} and {}", escaped(&self.names[0]), escaped(&self.names[1]));
        drawing.put(format_args!("<text x=\"{left}\" y=\"22\" font-size=\"15\">{title}</text>"));
        drawing.grid(&axes);
        drawing.clearance(&axes, &columns);
        drawing.margin(&axes, self.margin);
        drawing.verdicts(&axes, &columns);
        drawing.put(format_args!(
            "<rect x=\"{left}\" y=\"{top}\" width=\"{}\" height=\"{}\" fill=\"none\" stroke=\"{FRAME}\"/>",
            AREA[1] - left,
            bottom - top
        ));
        let below = bottom + gap + height + 18.0;
        for (end, anchor, at) in [(axes.first, "start", left), (axes.last, "end", AREA[1])] {
            drawing.put(format_args!(
                "<text x=\"{at}\" y=\"{below}\" text-anchor=\"{anchor}\">{label} {}</text>",
                place(end)
            ));
        }
        drawing.legend(self.margin);
        drawing.finish()
    }
}

/// Where values are on the plot.
#[derive(Debug)]
struct Axes {
    /// The ends of the horizontal axis.
    first: f64,
    last: f64,
    /// The distance of ticks of the vertical axis, and their number.
    step: f64,
    ticks: u32,
}

impl Axes {
    fn new(columns: &[Column], margin: f64) -> Self {
        let highest = columns.iter().filter_map(|column| column.clearance).map(|[_, upper]| upper);
        let (step, ticks) = ticks(highest.chain([margin]).fold(0.0, f64::max));
        let first = columns.first().map_or(0.0, |column| column.from);
        let last = columns.last().map_or(1.0, |column| column.to);
        Self { first, last, step, ticks }
    }

    fn x(&self, place: f64) -> f64 {
        let span = if self.last > self.first { self.last - self.first } else { 1.0 };
        AREA[0] + (AREA[1] - AREA[0]) * (place - self.first) / span
    }

    fn y(&self, length: f64) -> f64 {
        let share = length.max(0.0) / (self.step * f64::from(self.ticks));
        AREA[3] - (AREA[3] - AREA[2]) * share.min(1.0)
    }
}

/// An SVG in the making.
#[derive(Debug)]
struct Drawing(String);

impl Drawing {
    fn new() -> Self {
        Self(format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" font-family=\"system-ui, \
             'DejaVu Sans', sans-serif\" font-size=\"13\" fill=\"#222\">\n<rect width=\"100%\" height=\"100%\" \
             fill=\"#fff\"/>\n",
            SIZE[0], SIZE[1]
        ))
    }

    fn put(&mut self, element: impl Display) {
        let _ = writeln!(self.0, "{element}");
    }

    fn finish(mut self) -> String {
        self.put("</svg>");
        self.0
    }

    /// Draws the ticks of the vertical axis.
    fn grid(&mut self, axes: &Axes) {
        let [left, right, ..] = AREA;
        for tick in 0..=axes.ticks {
            let length = axes.step * f64::from(tick);
            let level = axes.y(length);
            self.put(format_args!(
                "<line x1=\"{left}\" y1=\"{level:.1}\" x2=\"{right}\" y2=\"{level:.1}\" stroke=\"#ddd\"/>\
                 <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
                left - 8.0,
                level + 4.5,
                short(length)
            ));
        }
    }

    /// Draws the range between the bounds of the clearance, and its upper bound as a line.
    fn clearance(&mut self, axes: &Axes, columns: &[Column]) {
        let runs = columns.chunk_by(|one, next| one.clearance.is_some() && next.clearance.is_some());
        for run in runs.filter(|run| run[0].clearance.is_some()) {
            let corners = |k: usize| {
                run.iter().filter_map(move |column| {
                    let middle = 0.5 * (column.from + column.to);
                    Some(format!("{:.1},{:.1}", axes.x(middle), axes.y(column.clearance?[k])))
                })
            };
            let upper: Vec<String> = corners(1).collect();
            let mut lower: Vec<String> = corners(0).collect();
            lower.reverse();
            let (upper, lower) = (upper.join(" "), lower.join(" "));
            self.put(format_args!(
                "<polygon points=\"{upper} {lower}\" fill=\"{CLEARANCE}\" fill-opacity=\"0.22\"/>\
                 <polyline points=\"{upper}\" fill=\"none\" stroke=\"{CLEARANCE}\" stroke-width=\"1.5\"/>"
            ));
        }
    }

    /// Draws the margin as a dashed line, if there is one.
    fn margin(&mut self, axes: &Axes, margin: f64) {
        if margin > 0.0 {
            let [left, right, ..] = AREA;
            let level = axes.y(margin);
            self.put(format_args!(
                "<line x1=\"{left}\" y1=\"{level:.1}\" x2=\"{right}\" y2=\"{level:.1}\" stroke=\"{MARGIN}\" \
                 stroke-dasharray=\"6 4\"/><text x=\"{right}\" y=\"{:.1}\" text-anchor=\"end\" \
                 fill=\"{MARGIN}\">margin {}</text>",
                level - 5.0,
                short(margin)
            ));
        }
    }

    /// Draws the strip of verdicts. A run of equal ones ends half way to the next run.
    fn verdicts(&mut self, axes: &Axes, columns: &[Column]) {
        let [height, gap] = STRIP;
        let mut start = AREA[0];
        let mut rest = columns;
        for run in columns.chunk_by(|one, next| one.verdict == next.verdict) {
            rest = &rest[run.len()..];
            let end = match (run.last(), rest.first()) {
                (Some(own), Some(next)) => axes.x(0.5 * (own.to + next.from)),
                _ => AREA[1],
            };
            self.put(format_args!(
                "<rect x=\"{start:.2}\" y=\"{:.1}\" width=\"{:.2}\" height=\"{height}\" fill=\"{}\"/>",
                AREA[3] + gap,
                (end - start).max(1.0),
                colour(run[0].verdict)
            ));
            start = end;
        }
    }

    fn legend(&mut self, margin: f64) {
        let [apart, touch, undecided] =
            [PathVerdict::Separated, PathVerdict::Intersecting, PathVerdict::Undecided].map(colour);
        let entries = [
            (apart, 1.0, "apart"),
            (touch, 1.0, if margin > 0.0 { "within margin" } else { "touch" }),
            (undecided, 1.0, "undecided"),
            (CLEARANCE, 0.5, "clearance, between its bounds; lengths in world units"),
        ];
        let mut left = AREA[0];
        for (colour, opacity, meaning) in entries {
            self.put(format_args!(
                "<rect x=\"{left}\" y=\"{}\" width=\"12\" height=\"12\" fill=\"{colour}\" \
                 fill-opacity=\"{opacity}\"/><text x=\"{}\" y=\"{}\">{meaning}</text>",
                SIZE[1] - 30.0,
                left + 18.0,
                SIZE[1] - 19.0
            ));
            left += 110.0;
        }
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
pub(crate) fn ticks(highest: f64) -> (f64, u32) {
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
        PathEntry {
            line,
            time,
            verdict,
            evidence: None,
            reason: None,
            clearance,
            penetration: None,
            is_nested: false,
            place: None,
            micros: 1.0,
        }
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
