//! Pictures of two meshes and of their contacts.

use nearmiss::geometry::nalgebra::Vector3;
use nearmiss::{MeshAnswer, MeshContact, MeshDistance, MeshVerdict, PlacedMesh};
use nearmiss_draw::canvas::{Area, Camera, Canvas, Colour, shade};
use nearmiss_draw::marks::{HALO, frame, mark};
use nearmiss_draw::picture::Picture;

use super::words::sentence;
use crate::picture::{
    Close, GAP, GROUND, INK, LEGEND, OF_A, OF_B, PANEL, PANEL_GROUND, Style, close_told, legend, paint_sized,
    scale_bar_in,
};
use crate::viewpoint::{LEVEL, Shown, stride};

/// The colour of contacts.
const OF_CONTACT: Colour = [196, 22, 42];

/// Half the width of the close view, as a share of the half diagonal of the smaller mesh.
const CLOSE: f64 = 0.35;

/// The part of the close view that is painted darker along the cut, as a share of its half width.
const CUT: f64 = 0.02;

/// The width of contacts in fine pixels.
const LINE: f64 = 5.0;

impl Shown for PlacedMesh<'_> {
    fn points(&self) -> Vec<Vector3<f64>> {
        let vertices = self.mesh().arrays().vertices;
        vertices.iter().step_by(stride(vertices.len())).map(|v| self.pose().apply(*v).into()).collect()
    }

    fn level_share(&self) -> f64 {
        let (mut level, mut all) = (0.0, 0.0);
        for corners in triangles(self) {
            let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
            all += normal.norm();
            level += if normal.z.abs() > LEVEL * normal.norm() { normal.norm() } else { 0.0 };
        }
        level / all
    }

    fn centre(&self) -> Vector3<f64> {
        self.pose().apply(self.mesh().bounds().centre()).into()
    }
}

/// The triangles of a mesh in the world.
fn triangles<'a>(placed: &'a PlacedMesh<'_>) -> impl Iterator<Item = [Vector3<f64>; 3]> + 'a {
    let view = placed.mesh().arrays();
    (0..placed.mesh().len()).map(move |i| view.corners(i).map(|p| placed.pose().apply(p).into()))
}

/// Returns half the diagonal of a mesh's bounds, in the world.
fn half_diagonal(placed: &PlacedMesh<'_>) -> f64 {
    Vector3::from(placed.mesh().bounds().half_extents()).norm() * placed.pose().scale()
}

/// The answer about two meshes that a picture shows.
pub(crate) struct Told<'a> {
    pub(crate) answer: &'a MeshAnswer,
    /// The contacts that are drawn.
    pub(crate) contacts: &'a [MeshContact],
    /// The distance of meshes that are apart.
    pub(crate) distance: Option<&'a MeshDistance>,
    /// The length to which numbers are rounded.
    pub(crate) digit: f64,
}

/// Paints both meshes in the world, with the segments in which their triangles meet or the line between
/// the nearest points, and, if they touch, a close view of the contact, cut open across it.
pub(crate) fn paint(meshes: [&PlacedMesh<'_>; 2], told: &Told<'_>, style: &Style) -> Picture {
    let mut canvas = Canvas::new(2 * PANEL + 3 * GAP, PANEL + LEGEND + 2 * GAP, GROUND);
    let sizes = meshes.map(half_diagonal);
    let close = match told.answer.verdict {
        MeshVerdict::Intersecting(contact) => Some(Close {
            point: contact.point.into(),
            normals: contact.normals.map(Vector3::from),
            reach: CLOSE * sizes[0].min(sizes[1]),
            pair: None,
            upright: style.view.upright(meshes),
        }),
        _ => None,
    };
    let width = if close.is_some() { PANEL } else { 2 * PANEL + GAP };
    let area = Area { left: GAP, top: GAP, width, height: PANEL };
    canvas.fill(area, PANEL_GROUND);
    let shown: Vec<Vector3<f64>> = told
        .contacts
        .iter()
        .map(|contact| contact.point)
        .chain(told.distance.iter().flat_map(|found| found.points))
        .map(Vector3::from)
        .collect();
    let camera = style.view.camera(meshes, area, &shown, |points, toward| {
        4.0 * hidden(&shown, points, *toward, 0.1 * sizes[0].min(sizes[1]))
    });
    paint_sized(&mut canvas, area, sizes, |canvas, side| {
        for corners in triangles(meshes[side]) {
            canvas.triangle(&camera, &corners, [OF_A, OF_B][side]);
        }
    });
    paint_contacts(&mut canvas, &camera, told.contacts, sizes);
    if let Some(found) = told.distance {
        paint_gap(&mut canvas, &camera, found);
    }
    if let Some(close) = &close {
        let area = Area { left: 2 * GAP + PANEL, ..area };
        canvas.fill(area, PANEL_GROUND);
        paint_close(&mut canvas, close, area, meshes, told.contacts);
        close.finish(&mut canvas, &close.camera(area), style.unit);
        frame(&mut canvas, &camera, close.point, close.reach);
        mark(&mut canvas, &camera, close.point, 1.0);
    }
    scale_bar_in(&mut canvas, &camera, style.unit);
    let mut text = sentence(told.answer, told.distance, told.digit);
    if close.is_some() {
        text = format!("They touch at the ringed point (certified). {}", close_told(false));
    }
    legend(&mut canvas, &text, &style.names);
    canvas.picture()
}

/// Draws the segments in which triangles meet, where nothing hides them.
fn paint_contacts(canvas: &mut Canvas, camera: &Camera, contacts: &[MeshContact], sizes: [f64; 2]) {
    let lift = 0.02 * sizes[0].min(sizes[1]);
    for contact in contacts {
        canvas.edge(camera, contact.ends.map(Vector3::from), LINE, OF_CONTACT, lift);
    }
}

/// Draws the line between the nearest points.
fn paint_gap(canvas: &mut Canvas, camera: &Camera, found: &MeshDistance) {
    let ends = found.points.map(|p| camera.project(p.into())).map(|[x, y, _]| [x, y]);
    for (width, colour) in [(LINE + 2.0 * HALO, GROUND), (LINE, INK)] {
        canvas.line(camera.area, ends, width, colour);
        ends.iter().for_each(|end| canvas.line(camera.area, [*end; 2], 2.0 * width, colour));
    }
}

/// Paints the part of both meshes behind the plane through a contact, across their line of
/// intersection.
fn paint_close(
    canvas: &mut Canvas,
    close: &Close,
    area: Area,
    meshes: [&PlacedMesh<'_>; 2],
    contacts: &[MeshContact],
) {
    let camera = close.camera(area);
    let chord = close.chord();
    for (placed, colour) in meshes.into_iter().zip([OF_A, OF_B]) {
        for corners in triangles(placed) {
            let beyond = close.point - chord * (CUT * close.reach);
            for part in behind(&corners, close.point, chord) {
                behind(&part, beyond, chord).for_each(|part| canvas.triangle(&camera, &part, colour));
                let dark = shade(colour, 0.45);
                behind(&part, beyond, -chord).for_each(|part| canvas.triangle(&camera, &part, dark));
            }
        }
    }
    for contact in contacts {
        canvas.edge(&camera, contact.ends.map(Vector3::from), LINE, OF_CONTACT, 0.02 * close.reach);
    }
    close.paint_normals(canvas, &camera);
}

/// Returns the part of a triangle on the lower side of the plane through `point` with this normal, as up
/// to two triangles.
fn behind(
    corners: &[Vector3<f64>; 3],
    point: Vector3<f64>,
    normal: Vector3<f64>,
) -> impl Iterator<Item = [Vector3<f64>; 3]> {
    let heights = corners.map(|p| normal.dot(&(p - point)));
    let mut part = Vec::with_capacity(4);
    for k in 0..3 {
        let (p, q) = (corners[k], corners[(k + 1) % 3]);
        let (g, h) = (heights[k], heights[(k + 1) % 3]);
        if g <= 0.0 {
            part.push(p);
        }
        if (g <= 0.0) != (h <= 0.0) {
            part.push(p + (q - p) * (g / (g - h)));
        }
    }
    let fan: Vec<_> = (1..part.len().max(1) - 1).map(|k| [part[0], part[k], part[k + 1]]).collect();
    fan.into_iter()
}

/// Estimates the share of some places that points hide, seen from `toward`: 0 to about 1.
fn hidden(places: &[Vector3<f64>], points: &[Vector3<f64>], toward: Vector3<f64>, radius: f64) -> f64 {
    let some = places.iter().step_by(places.len().div_ceil(16).max(1));
    let counts = some.map(|place| {
        let before = points.iter().step_by(points.len().div_ceil(1000).max(1)).filter(|p| {
            let offset = *p - place;
            let depth = toward.dot(&offset);
            depth > radius && (offset - toward * depth).norm() < radius
        });
        #[expect(clippy::cast_precision_loss, reason = "a count")]
        let count = before.count() as f64;
        count / (count + 4.0)
    });
    let (count, sum) = counts.fold((0.0, 0.0), |(count, sum), share| (count + 1.0, sum + share));
    if count > 0.0 { sum / count } else { 0.0 }
}
