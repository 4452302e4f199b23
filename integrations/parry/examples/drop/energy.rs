//! A plot of the energy of bodies over time.

use std::path::Path;

use plotters::prelude::*;

use crate::common::Failure;

/// Says what the curves are.
const CAPTION: &str = "Energy of all bodies. Kinetic + potential energy counts from its least value.";

/// The kinetic energy and the potential energy above z = 0 at each step, in joules.
pub(crate) struct Record {
    pub(crate) name: &'static str,
    pub(crate) steps: Vec<[f64; 2]>,
}

/// Draws the kinetic energy and the sum of kinetic and potential energy, over seconds. The least sum of all
/// records is drawn as zero.
pub(crate) fn plot(records: &[Record], path: &Path) -> Result<(), Failure> {
    let sums = |record: &Record| record.steps.iter().map(|[k, p]| k + p).collect::<Vec<f64>>();
    let floor = records.iter().flat_map(sums).fold(f64::INFINITY, f64::min);
    // The kinetic energy of a body that falls forever exceeds all sums.
    let kinetic = records.iter().flat_map(|record| &record.steps).map(|[kinetic, _]| *kinetic);
    let top = records.iter().flat_map(sums).map(|sum| sum - floor).chain(kinetic).fold(0.0, f64::max);
    // Room for the frame below and above the curves.
    let range = -0.03 * top..1.05 * top;
    let steps = records.iter().map(|record| record.steps.len()).max().unwrap_or(0);
    let seconds = |step: usize| f64::from(u32::try_from(step).unwrap_or(u32::MAX)) / 60.0;
    let area = SVGBackend::new(path, (900, 520)).into_drawing_area();
    area.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&area)
        .margin(16)
        .caption(CAPTION, ("sans-serif", 17))
        .x_label_area_size(44)
        .y_label_area_size(92)
        .build_cartesian_2d(0.0..seconds(steps), range)?;
    chart
        .configure_mesh()
        .x_desc("time, s")
        .y_desc("energy, J")
        .y_label_formatter(&|joules| format!("{joules:.0}"))
        .label_style(("sans-serif", 15))
        .light_line_style(WHITE)
        .draw()?;
    let colours = [RGBColor(215, 90, 20), RGBColor(40, 90, 170)];
    for (record, colour) in records.iter().zip(colours) {
        let totals = sums(record).into_iter().map(|sum| sum - floor);
        let total: Vec<_> = totals.enumerate().map(|(step, joules)| (seconds(step), joules)).collect();
        let kinetic: Vec<_> =
            record.steps.iter().enumerate().map(|(step, [joules, _])| (seconds(step), *joules)).collect();
        let parts = [("kinetic + potential", total, 3), ("kinetic", kinetic, 1)];
        for (part, series, width) in parts {
            chart
                .draw_series(LineSeries::new(series, colour.stroke_width(width)))?
                .label(format!("{}, {part}", record.name))
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 22, y)], colour.stroke_width(width)));
        }
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperMiddle)
        .label_font(("sans-serif", 16))
        .background_style(WHITE)
        .border_style(RGBColor(200, 200, 200))
        .draw()?;
    area.present()?;
    Ok(())
}
