//! A filmstrip: the bodies at some of the query times, in the colour of their clearance.

use nearmiss::geometry::nalgebra::Vector3;
use nearmiss_draw::canvas::{Area, Camera, Canvas, Colour, FINE, Splat, blend};
use nearmiss_draw::legend;
use nearmiss_draw::marks::{GROUND, PANEL_GROUND, title};
use nearmiss_draw::picture::Picture;

use super::body::{Asking, Body, Following, Partner};
use super::frames::Frames;
use super::moment::Moment;
use super::solid::Solid;
use crate::digits::short;
use crate::error::CliError;
use crate::viewpoint::{Shown, ViewArgs};

/// The most panels, and those in a row.
const PANELS: usize = 8;
const COLUMNS: usize = 4;

/// Sizes in fine pixels.
const PANEL: [usize; 2] = [380 * FINE, 320 * FINE];
const GAP: usize = 10 * FINE;

const OF_PARTNER: Colour = [186, 194, 204];
const UNTESTED: Colour = [74, 144, 217];

/// Colours of the clearance: in contact, at half of the greatest clearance, and at the greatest.
const CLEARANCE: [Colour; 3] = [[196, 30, 46], [240, 170, 60], [62, 150, 104]];

/// The bodies at one time.
struct Shot {
    t: f64,
    words: String,
    /// The distance of the bodies, zero in contact, if they were tested.
    clearance: Option<f64>,
    body: Solid,
    partner: Option<Solid>,
}

/// Paints the bodies at up to eight of the query times, evenly spread, the first and the last
/// included.
pub(super) fn paint(
    frames: &Frames,
    partner: Partner<'_>,
    moments: &[Moment],
    view: &ViewArgs,
) -> Result<Picture, CliError> {
    let shots = shots(frames, partner, moments)?;
    let rows = shots.len().div_ceil(COLUMNS).max(1);
    let columns = shots.len().clamp(1, COLUMNS);
    let width = columns * PANEL[0] + (columns + 1) * GAP;
    let strip = rows * PANEL[1] + (rows + 1) * GAP;
    let mut canvas = Canvas::new(width, strip + legend::LINE + GAP, GROUND);
    let greatest = shots.iter().filter_map(|shot| shot.clearance).fold(0.0, f64::max);
    let area = Area { left: 0, top: 0, width: PANEL[0], height: PANEL[1] };
    let camera = camera(&shots, area, view);
    for (i, shot) in shots.iter().enumerate() {
        let (row, column) = (i / COLUMNS, i % COLUMNS);
        let (left, top) = (GAP + column * (PANEL[0] + GAP), GAP + row * (PANEL[1] + GAP));
        let area = Area { left, top, ..area };
        canvas.fill(area, PANEL_GROUND);
        let camera = Camera { area, ..camera };
        if let Some(partner) = &shot.partner {
            partner.paint(&mut canvas, &camera, OF_PARTNER);
        }
        shot.body.paint(&mut canvas, &camera, shot.colour(greatest));
        title(&mut canvas, area, &format!("{} s: {}", short(shot.t), shot.words));
    }
    let far =
        if greatest.is_finite() { format!("{} apart", short(greatest)) } else { "not in contact".to_owned() };
    let entries = [
        (Some(CLEARANCE[0]), "in contact"),
        (Some(CLEARANCE[2]), far.as_str()),
        (Some(UNTESTED), "not tested"),
        (Some(OF_PARTNER), "partner"),
    ];
    let is_tested = shots.iter().any(|shot| shot.clearance.is_some());
    let has_partner = shots.iter().any(|shot| shot.partner.is_some());
    let shown = [is_tested, greatest > 0.0, !is_tested, has_partner];
    let entries: Vec<_> =
        entries.into_iter().zip(shown).filter(|(_, shown)| *shown).map(|(e, _)| e).collect();
    legend::entries(&mut canvas, [GAP, strip + GAP / 2], width - 2 * GAP, &entries);
    Ok(canvas.picture())
}

fn shots(frames: &Frames, partner: Partner<'_>, moments: &[Moment]) -> Result<Vec<Shot>, CliError> {
    let count = PANELS.min(moments.len());
    let mut body = Body::first(frames)?;
    let mut other = match partner {
        Partner::Moving(others) => Some(Body::first(others)?),
        _ => None,
    };
    let (mut asking, mut places) = (Asking::default(), Vec::new());
    let chosen = (0..count).map(|k| &moments[k * (moments.len() - 1) / (count - 1).max(1)]);
    chosen
        .map(|moment| {
            for (body, frames) in [(Some(&mut body), Some(frames)), (other.as_mut(), partner.frames())] {
                let (Some(body), Some(frames)) = (body, frames) else { continue };
                frames.at(moment.t, &mut places);
                let moved = body.move_to(&places, Following::Refit);
                moved.map_err(|cause| frames.fault(moment.t, &cause))?;
            }
            let clearance = match moment.found.map(|found| found.verdict) {
                Some("intersecting") => Some(0.0),
                Some(_) => match (&other, partner) {
                    (Some(other), _) => Some(asking.clearance(body.view(), other.view())?),
                    (None, Partner::Still(still)) => Some(asking.clearance(body.view(), still.view())?),
                    // A mesh that does not meet itself.
                    _ => Some(f64::INFINITY),
                },
                None => None,
            };
            let partner = match (&other, partner) {
                (Some(other), _) => Some(other.view().solid()),
                (None, Partner::Still(still)) => Some(still.view().solid()),
                _ => None,
            };
            let words = moment.found.map_or("moved".to_owned(), |found| found.verdict.to_owned());
            Ok(Shot { t: moment.t, words, clearance, body: body.view().solid(), partner })
        })
        .collect()
}

/// A camera that shows all shots.
fn camera(shots: &[Shot], area: Area, view: &ViewArgs) -> Camera {
    let all = |solid: fn(&Shot) -> Option<&Solid>| {
        let splat = |centre| Splat { centre, normal: Vector3::z(), radius: 0.0 };
        Solid::Discs(shots.iter().filter_map(solid).flat_map(Solid::points).map(splat).collect())
    };
    let bodies = all(|shot| Some(&shot.body));
    let partners = all(|shot| shot.partner.as_ref());
    let partners = if partners.points().is_empty() { &bodies } else { &partners };
    view.camera([&bodies, partners], area, &[], |_, _| 0.0)
}

impl Shot {
    fn colour(&self, greatest: f64) -> Colour {
        let Some(clearance) = self.clearance else { return UNTESTED };
        let share =
            if greatest > 0.0 && greatest.is_finite() { (clearance / greatest).min(1.0) } else { 1.0 };
        let share = if clearance == 0.0 { 0.0 } else { share };
        let [contact, middle, far] = CLEARANCE;
        if share < 0.5 { blend(contact, middle, 2.0 * share) } else { blend(middle, far, 2.0 * share - 1.0) }
    }
}
