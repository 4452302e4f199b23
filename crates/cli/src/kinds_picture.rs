//! A picture of a scan in which each point has the colour of its kind, with a legend.

use nearmiss::{PointKind, Pose, Scan};
use nearmiss_draw::canvas::{Area, Canvas, Colour, FINE};
use nearmiss_draw::legend;
use nearmiss_draw::picture::Picture;

use crate::digits::short;
use crate::health::kind_name;
use crate::picture;
use crate::viewpoint::ViewArgs;

/// Sizes in fine pixels.
const WIDTH: usize = 1572 * FINE;
const HEIGHT: usize = 900 * FINE;
const GAP: usize = 12 * FINE;
const LEGEND: usize = 2 * legend::LINE + 2 * FINE;

const GROUND: Colour = [255, 255, 255];
const PANEL_GROUND: Colour = [238, 240, 243];

/// Returns the colour of a kind in pictures and exported points. Colour-blind readers can tell all
/// of them apart.
pub(crate) const fn colour(kind: PointKind) -> Colour {
    match kind {
        PointKind::Sheet => [158, 166, 178],
        PointKind::Edge => [0, 114, 178],
        PointKind::Line => [0, 158, 115],
        PointKind::Stray => [200, 0, 0],
        PointKind::Sparse => [204, 121, 167],
        _ => [240, 170, 20],
    }
}

/// Paints the obstacle of `scan` in the colours of its kinds. Points on sheets are discs, all
/// others are the balls that represent them.
#[must_use]
pub fn kinds_picture(scan: &Scan) -> Picture {
    paint(scan, &ViewArgs::default())
}

/// Paints a [`kinds_picture`] from the viewpoint `from`.
pub(crate) fn paint(scan: &Scan, from: &ViewArgs) -> Picture {
    let mut canvas = Canvas::new(WIDTH + 2 * GAP, HEIGHT + 2 * GAP + LEGEND, GROUND);
    let area = Area { left: GAP, top: GAP, width: WIDTH, height: HEIGHT };
    canvas.fill(area, PANEL_GROUND);
    let view = scan.at(&Pose::IDENTITY);
    let camera = from.camera([&view, &view], area, &[], |_, _| 0.0);
    for i in 0..scan.len() {
        picture::obstacle(&mut canvas, &camera, &view, i, colour(scan.kind(i)), picture::LARGEST);
    }
    picture::scale_bar(&mut canvas, &camera);
    let entries = PointKind::ALL.map(|kind| {
        let share = short(100.0 * scan.share(kind));
        (Some(colour(kind)), format!("{} {share} %", kind_name(kind)))
    });
    let entries: Vec<(Option<Colour>, &str)> =
        entries.iter().map(|(colour, text)| (*colour, text.as_str())).collect();
    let [left, top] = [GAP + 4 * FINE, HEIGHT + 2 * GAP + 4 * FINE];
    let width = WIDTH - 4 * FINE;
    legend::entries(&mut canvas, [left, top], width, &entries);
    let told = format!(
        "The kinds of the points and their shares. Gaps of up to {} count as surface.",
        short(scan.reach())
    );
    legend::sentence(&mut canvas, [left, top + legend::LINE], width, &told);
    canvas.picture()
}
