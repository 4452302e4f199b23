//! A drawing of the path, from above and from the side. A capsule is a line with round ends.

use std::fmt::{Error, Write};

use nearmiss::{Pose, Scan, Shape};

use crate::arm::{Arm, LINKS};

/// Pixels of a view.
const SIZE: f64 = 700.0;

/// Points of the scan that are drawn at most.
const DOTS: usize = 12_000;

/// Colours from no clearance to the greatest.
const COLOURS: [&str; 5] = ["#b2182b", "#ef7832", "#f4cd5a", "#86b86a", "#3e9668"];

/// The arm at one time.
#[derive(Debug)]
pub(crate) struct Moment {
    pub(crate) links: [Shape<'static>; LINKS],
    /// Places on the tool.
    pub(crate) tool: Vec<[f64; 3]>,
    /// The distance from the room.
    pub(crate) apart: f64,
}

/// Draws the arm at all moments with its distance from the room as colour.
pub(crate) fn svg(scan: &Scan, arm: &Arm<'_>, moments: &[Moment]) -> Result<String, Error> {
    let mut out = String::new();
    let (wide, tall) = (2.0 * SIZE + 30.0, SIZE + 80.0);
    writeln!(out, r#"<svg xmlns="http://www.w3.org/2000/svg" width="{wide}" height="{tall}">"#)?;
    writeln!(out, r##"<rect width="100%" height="100%" fill="#ffffff"/>"##)?;
    let highest = moments.iter().map(|moment| moment.apart).fold(f64::MIN_POSITIVE, f64::max);
    // Nearest last, so that it is on top.
    let mut order: Vec<usize> = (0..moments.len()).collect();
    order.sort_by(|&a, &b| moments[b].apart.total_cmp(&moments[a].apart));
    for (view, axes, across) in [(0.0, [0, 1], 2), (1.0, [0, 2], 1)] {
        let scale = SIZE / (3.2 * arm.length);
        let left = 10.0 + view * (SIZE + 10.0);
        let place = |p: [f64; 3]| {
            let [x, y] = axes.map(|k: usize| (p[k] - arm.base[k]) * scale);
            [left + 0.5 * SIZE + x, 10.0 + 0.5 * SIZE - y]
        };
        let is_shown = |[x, y]: [f64; 2]| x > left && x < left + SIZE && y > 10.0 && y < 10.0 + SIZE;
        let frame = r##"fill="#f4f5f7" stroke="#c8ccd2""##;
        writeln!(out, r#"<rect x="{left}" y="10" width="{SIZE}" height="{SIZE}" {frame}/>"#)?;
        let world = scan.at(&Pose::IDENTITY);
        // A slab about the base, within the reach of the arm.
        let is_near = |p: [f64; 3]| (p[across] - arm.base[across]).abs() < 0.6 * arm.length;
        let near = || (0..scan.len()).map(|i| world.point(i)).filter(|&p| is_near(p) && is_shown(place(p)));
        let step = near().count().div_ceil(DOTS).max(1);
        for p in near().step_by(step) {
            let [x, y] = place(p);
            writeln!(out, r##"<circle cx="{x:.1}" cy="{y:.1}" r="1.2" fill="#9aa4b2"/>"##)?;
        }
        for &moment in &order {
            let Moment { links, tool, apart } = &moments[moment];
            let colour = COLOURS[share(apart / highest)];
            for link in links {
                let Shape::Capsule { ends, radius } = link else { continue };
                let [[x1, y1], [x2, y2]] = ends.map(place);
                let line =
                    format!(r#"x1="{x1:.1}" y1="{y1:.1}" x2="{x2:.1}" y2="{y2:.1}" stroke-linecap="round""#);
                let width = 2.0 * radius * scale;
                writeln!(out, r##"<line {line} stroke="#ffffff" stroke-width="{:.1}"/>"##, width + 1.5)?;
                writeln!(out, r#"<line {line} stroke="{colour}" stroke-width="{width:.1}"/>"#)?;
            }
            for p in tool {
                let [x, y] = place(*p);
                writeln!(out, r#"<circle cx="{x:.1}" cy="{y:.1}" r="1.6" fill="{colour}"/>"#)?;
            }
        }
        let title = if view == 0.0 { "from above" } else { "from the side" };
        writeln!(
            out,
            r#"<text x="{:.0}" y="34" font-family="sans-serif" font-size="18">{title}</text>"#,
            left + 12.0
        )?;
    }
    let low = SIZE + 45.0;
    for (k, colour) in COLOURS.iter().enumerate() {
        let (x, length) = (20.0 + 230.0 * f64::from(u8::try_from(k).unwrap_or(0)), highest * STEPS[k]);
        writeln!(out, r#"<rect x="{x}" y="{:.0}" width="16" height="16" fill="{colour}"/>"#, low - 13.0)?;
        let text = format!("from {length:.3} off the room");
        writeln!(
            out,
            r#"<text x="{}" y="{low}" font-family="sans-serif" font-size="16">{text}</text>"#,
            x + 24.0
        )?;
    }
    writeln!(out, "</svg>")?;
    Ok(out)
}

/// The shares of the greatest distance at which the colours start.
const STEPS: [f64; 5] = [0.0, 0.1, 0.25, 0.5, 0.75];

/// The number of the colour of a share.
fn share(of: f64) -> usize {
    STEPS.iter().rposition(|&step| of >= step).unwrap_or(0)
}
