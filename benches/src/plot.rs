//! Line plots with one or two panels, as SVG.

use plotters::chart::ChartBuilder;
use plotters::coord::Shift;
use plotters::coord::ranged1d::{AsRangedCoord, Ranged, ValueFormatter};
use plotters::element::Circle;
use plotters::prelude::{
    BLACK, Color, DashedLineSeries, DrawingArea, EmptyElement, IntoDrawingArea, IntoLogRange, LineSeries,
    PathElement, RGBColor, SVGBackend, SeriesLabelPosition, WHITE,
};

use crate::Failure;

/// Width and height of a panel, in pixels.
const SIZE: (u32, u32) = (560, 420);

/// Colours that are distinguishable with colour blindness (Okabe & Ito).
const COLOURS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(70, 70, 70),
];

/// A line with marked points.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Line {
    /// Name in the legend; an empty name is not shown.
    pub name: String,
    /// Points, in the units of the axes.
    pub points: Vec<[f64; 2]>,
    /// Index of the colour.
    pub colour: usize,
    /// `true` if the line is dashed.
    pub dashed: bool,
}

/// Name and scale of an axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// Name with the unit.
    pub name: String,
    /// `true` for a logarithmic scale, which shows nothing at or below zero.
    pub logarithmic: bool,
}

impl Axis {
    /// A linear axis.
    #[must_use]
    pub fn even(name: &str) -> Self {
        Self { name: name.into(), logarithmic: false }
    }

    /// A logarithmic axis.
    #[must_use]
    pub fn logarithmic(name: &str) -> Self {
        Self { name: name.into(), logarithmic: true }
    }
}

/// Lines over a pair of axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    /// Title above the panel.
    pub title: String,
    /// Horizontal and vertical axis.
    pub axes: [Axis; 2],
    /// The lines it shows.
    pub lines: Vec<Line>,
}

/// Draws the panels side by side.
///
/// # Errors
/// When a panel has nothing to show.
pub fn figure(panels: &[Panel]) -> Result<String, Failure> {
    let mut text = String::new();
    let columns = u32::try_from(panels.len())?;
    {
        let root = SVGBackend::with_string(&mut text, (SIZE.0 * columns, SIZE.1)).into_drawing_area();
        root.fill(&WHITE).map_err(failure)?;
        for (panel, area) in panels.iter().zip(root.split_evenly((1, panels.len()))) {
            let [x, y] = [0, 1].map(|k| range(panel, k));
            let (x, y) = (x?, y?);
            match [&panel.axes[0], &panel.axes[1]].map(|axis| axis.logarithmic) {
                [false, false] => draw(&area, panel, x, y)?,
                [true, false] => draw(&area, panel, x.log_scale(), y)?,
                [false, true] => draw(&area, panel, x, y.log_scale())?,
                [true, true] => draw(&area, panel, x.log_scale(), y.log_scale())?,
            }
        }
        root.present().map_err(failure)?;
    }
    Ok(text)
}

/// Converts an error of the drawing, which borrows the drawing area, to an owned one.
fn failure(error: impl std::fmt::Display) -> Failure {
    error.to_string().into()
}

/// Room above the lines for the legend, as a share of their range.
const HEADROOM: f64 = 0.4;

/// The range of an axis: from zero, or from below the least value, to above the greatest.
fn range(panel: &Panel, k: usize) -> Result<std::ops::Range<f64>, Failure> {
    let values = panel.lines.iter().flat_map(|line| &line.points).map(|p| p[k]);
    let is_logarithmic = panel.axes[k].logarithmic;
    let shown = values.filter(|v| v.is_finite() && (!is_logarithmic || *v > 0.0));
    let (low, high) = shown.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    if low > high {
        return Err(format!("{}: expected points to plot, got none", panel.title).into());
    }
    let room = if k == 1 { HEADROOM } else { 0.05 };
    Ok(if is_logarithmic {
        0.8 * low..1.1 * high * (high / low).powf(room)
    } else {
        0.0..if high > 0.0 { (1.0 + room) * high } else { 1.0 }
    })
}

fn draw<X, Y>(area: &DrawingArea<SVGBackend<'_>, Shift>, panel: &Panel, x: X, y: Y) -> Result<(), Failure>
where
    X: AsRangedCoord<Value = f64>,
    Y: AsRangedCoord<Value = f64>,
    X::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
    Y::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
{
    let mut chart = ChartBuilder::on(area)
        .caption(&panel.title, ("sans-serif", 17))
        .margin(12)
        .x_label_area_size(42)
        .y_label_area_size(64)
        .build_cartesian_2d(x, y)
        .map_err(failure)?;
    chart
        .configure_mesh()
        .x_desc(panel.axes[0].name.as_str())
        .y_desc(panel.axes[1].name.as_str())
        .max_light_lines(4)
        .light_line_style(BLACK.mix(0.06))
        .bold_line_style(BLACK.mix(0.18))
        .label_style(("sans-serif", 13))
        .axis_desc_style(("sans-serif", 14))
        .x_label_formatter(&|v| plain(*v))
        .y_label_formatter(&|v| plain(*v))
        .draw()
        .map_err(failure)?;
    for line in &panel.lines {
        let colour = COLOURS[line.colour % COLOURS.len()];
        let style = colour.stroke_width(2);
        let drawable =
            |p: &&[f64; 2]| (0..2).all(|k| p[k].is_finite() && (p[k] > 0.0 || !panel.axes[k].logarithmic));
        let points: Vec<(f64, f64)> = line.points.iter().filter(drawable).map(|p| (p[0], p[1])).collect();
        let drawn = if line.dashed {
            chart.draw_series(DashedLineSeries::new(points.clone(), 6, 4, style))
        } else {
            chart.draw_series(LineSeries::new(points.clone(), style))
        };
        let (drawn, dashed) = (drawn.map_err(failure)?, line.dashed);
        if !line.name.is_empty() {
            drawn.label(&line.name).legend(move |(x, y)| {
                let ends = if dashed { vec![(x, y), (x + 7, y)] } else { vec![(x, y), (x + 18, y)] };
                PathElement::new(ends, style)
            });
        }
        let marks = points.iter().map(|&p| EmptyElement::at(p) + Circle::new((0, 0), 3, colour.filled()));
        chart.draw_series(marks).map_err(failure)?;
    }
    chart
        .configure_series_labels()
        .position(if rises(panel) { SeriesLabelPosition::UpperLeft } else { SeriesLabelPosition::UpperRight })
        .background_style(WHITE.mix(0.85))
        .border_style(BLACK.mix(0.3))
        .label_font(("sans-serif", 13))
        .draw()
        .map_err(failure)
}

/// Returns `true` if most lines end higher than they begin.
fn rises(panel: &Panel) -> bool {
    let ends = panel.lines.iter().filter_map(|line| Some((line.points.first()?[1], line.points.last()?[1])));
    let (up, all) = ends.fold((0, 0), |(up, all), (first, last)| (up + usize::from(last > first), all + 1));
    2 * up > all
}

/// Formats a number without redundant digits.
fn plain(v: f64) -> String {
    let text = if v != 0.0 && v.abs() < 0.01 { format!("{v:.4}") } else { format!("{v:.2}") };
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text.is_empty() { "0".into() } else { text.into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn panel(logarithmic: bool) -> Panel {
        let axis = Axis { name: "points".into(), logarithmic };
        let line = |colour, dashed| Line {
            name: format!("line {colour}"),
            points: vec![[1.0, 2.0], [10.0, 20.0], [100.0, 30.0]],
            colour,
            dashed,
        };
        Panel {
            title: "of a test".into(),
            axes: [axis.clone(), axis],
            lines: vec![line(0, false), line(1, true)],
        }
    }

    #[test]
    fn a_figure_names_its_axes_and_lines() {
        for logarithmic in [false, true] {
            let svg = figure(&[panel(logarithmic), panel(!logarithmic)]).unwrap();
            assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"), "a whole drawing");
            for text in ["of a test", "points", "line 0", "line 1"] {
                assert!(svg.matches(text).count() >= 2, "{text} in both panels");
            }
        }
    }

    #[test]
    fn nothing_to_show_is_an_error() {
        let mut empty = panel(true);
        empty.lines.iter_mut().flat_map(|line| &mut line.points).for_each(|p| p[1] = 0.0);
        assert!(figure(&[empty]).is_err());
    }

    #[test]
    fn numbers_are_plain() {
        assert_eq!([0.0, 0.5, 10.0, 1000.0, 0.001].map(plain), ["0", "0.5", "10", "1000", "0.001"]);
    }
}
