//! A picture of the kinds of a scan's points: a colour each, with a legend.

use nearmiss::{PointKind, Pose, Scan};

use crate::canvas::{Area, Canvas, Colour, FINE};
use crate::digits::short;
use crate::font;
use crate::health::kind_name;
use crate::image::Picture;
use crate::picture;

/// In fine pixels.
const WIDTH: usize = 1572 * FINE;
const HEIGHT: usize = 900 * FINE;
const GAP: usize = 12 * FINE;
const LEGEND: usize = 44 * FINE;

const GROUND: Colour = [255, 255, 255];
const PANEL_GROUND: Colour = [238, 240, 243];
const INK: Colour = [30, 34, 40];

/// The colour of a kind in pictures and exported points. All are told apart by eyes that do not see
/// all colours.
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

/// The obstacle of `scan`: points on sheets as discs, all others as the balls that they stand for,
/// in the colours of their kinds.
#[must_use]
pub fn kinds_picture(scan: &Scan) -> Picture {
    let mut canvas = Canvas::new(WIDTH + 2 * GAP, HEIGHT + 2 * GAP + LEGEND, GROUND);
    let area = Area { left: GAP, top: GAP, width: WIDTH, height: HEIGHT };
    canvas.fill(area, PANEL_GROUND);
    let view = scan.at(&Pose::IDENTITY);
    let camera = picture::scan_camera(&view, area);
    for i in 0..scan.len() {
        picture::obstacle(&mut canvas, &camera, &view, i, colour(scan.kind(i)), picture::LARGEST);
    }
    picture::scale_bar(&mut canvas, &camera);
    let top = HEIGHT + 2 * GAP + 8 * FINE;
    let mut left = GAP + 4 * FINE;
    for kind in PointKind::ALL {
        let share = short(100.0 * scan.share(kind));
        let name = format!("{} {share} %", kind_name(kind));
        canvas.fill(Area { left, top, width: 14 * FINE, height: 14 * FINE }, colour(kind));
        canvas.text([left + 20 * FINE, top], 2 * FINE, INK, &name);
        left += (40 + 2 * font::ADVANCE * name.chars().count()) * FINE;
    }
    let reach = format!("reach {}", short(scan.reach()));
    canvas.text([left + 10 * FINE, top], 2 * FINE, INK, &reach);
    canvas.picture()
}
