//! A page about a motion: its summary, the filmstrip, and events, update time and query time over t.

use std::fmt::Write as _;
use std::io::{self, Write};

use nearmiss_draw::picture::Picture;

use super::moment::Moment;
use crate::digits::short;
use crate::html::{escaped, image};
use crate::path_plot::ticks;

const STYLE: &str = "\
body{font:15px/1.45 system-ui,sans-serif;color:#1e2228;max-width:1120px;margin:2em auto;padding:0 1em}
h1{font-size:1.5em}h2{font-size:1.15em;margin-top:1.6em}
img,svg{max-width:100%;display:block}
footer{margin-top:2em;color:#5a6270;font-size:.9em}
";

/// Width and height of a plot, and the left, right, top and bottom of its area.
const SIZE: [f64; 2] = [1080.0, 190.0];
const AREA: [f64; 4] = [80.0, 1064.0, 16.0, 148.0];

/// The most columns; if there are more query times, several share one.
const COLUMNS: usize = 1000;

/// A value over time.
struct Plot {
    name: &'static str,
    colour: &'static str,
    value: fn(&Moment) -> f64,
}

#[expect(clippy::cast_precision_loss, reason = "counts to plot")]
const PLOTS: [Plot; 4] = [
    Plot { name: "Bounding volumes updated", colour: "#1f6fb2", value: |moment| moment.bv_updates as f64 },
    Plot { name: "Events", colour: "#7e3ca0", value: |moment| moment.events as f64 },
    Plot { name: "Update time, µs", colour: "#b2541f", value: |moment| moment.update_micros },
    Plot { name: "Query time, µs", colour: "#2f8f5b", value: |moment| moment.query_micros },
];

/// Writes the page.
pub(super) fn write(
    name: &str,
    summary: &str,
    film: &Picture,
    moments: &[Moment],
    out: &mut impl Write,
) -> io::Result<()> {
    let name = escaped(name);
    writeln!(
        out,
        "<!DOCTYPE html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width\">\n<title>Motion of {name}</title>\n\
         <style>\n{STYLE}</style>\n<h1>Motion of {name}</h1>\n<p>{}</p>",
        escaped(summary)
    )?;
    image(film, "the bodies at some of the query times", out)?;
    for plot in &PLOTS {
        writeln!(out, "<h2>{}</h2>\n{}", plot.name, plot.draw(moments))?;
    }
    writeln!(
        out,
        "<footer>The strip below each plot shows the verdicts: red where the bodies meet, green where they do not, grey \
         where that is undecided or was not asked. Times in seconds of the motion.</footer>\n</html>"
    )
}

impl Plot {
    fn draw(&self, moments: &[Moment]) -> String {
        let [left, right, top, bottom] = AREA;
        let last = moments.last().map_or(0.0, |moment| moment.t);
        let x = |t: f64| left + (right - left) * if last > 0.0 { t / last } else { 0.0 };
        let highest = moments.iter().map(|moment| (self.value)(moment)).fold(0.0, f64::max);
        let (step, count) = ticks(highest);
        let y = |value: f64| bottom - (bottom - top) * value / (step * f64::from(count));
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" font-size=\"13\" fill=\"#222\">\n",
            SIZE[0], SIZE[1]
        );
        for tick in 0..=count {
            let value = step * f64::from(tick);
            let level = y(value);
            let _ = writeln!(
                svg,
                "<line x1=\"{left}\" y1=\"{level:.1}\" x2=\"{right}\" y2=\"{level:.1}\" stroke=\"#ddd\"/>\
                 <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
                left - 8.0,
                level + 4.5,
                short(value)
            );
        }
        let at_once = moments.len().div_ceil(COLUMNS).max(1);
        let mut line = String::new();
        #[expect(clippy::cast_precision_loss, reason = "a count")]
        let width = (right - left) / (moments.len() - 1).max(1) as f64 + 0.3;
        for some in moments.chunks(at_once) {
            let most = some.iter().map(|moment| (self.value)(moment)).fold(0.0, f64::max);
            let _ = write!(line, "{:.1},{:.1} ", x(some[0].t), y(most));
            let end = some.last().map_or(0.0, |moment| moment.t);
            let _ = writeln!(
                svg,
                "<rect x=\"{:.1}\" y=\"{}\" width=\"{:.1}\" height=\"10\" fill=\"{}\"/>",
                x(some[0].t) - 0.5 * width,
                bottom + 6.0,
                (x(end) - x(some[0].t)).max(0.0) + width,
                verdict_colour(some)
            );
        }
        let _ = writeln!(
            svg,
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.6\"/>",
            line.trim_end(),
            self.colour
        );
        for (at, anchor, t) in [(left, "start", 0.0), (right, "end", last)] {
            let _ = writeln!(
                svg,
                "<text x=\"{at}\" y=\"{}\" text-anchor=\"{anchor}\">t = {} s</text>",
                bottom + 34.0,
                short(t)
            );
        }
        svg + "</svg>"
    }
}

/// Returns the colour of the most severe verdict.
fn verdict_colour(moments: &[Moment]) -> &'static str {
    let has = |word: &str| moments.iter().any(|m| m.found.is_some_and(|found| found.verdict == word));
    match (has("intersecting"), has("undecided"), has("separated")) {
        (true, ..) => "#cc3b3b",
        (_, false, true) => "#4c9f70",
        _ => "#a8a8a8",
    }
}
