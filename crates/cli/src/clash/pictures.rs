//! Pictures of clashes: an overview of all, and a close view of each.

use nearmiss::geometry::nalgebra::Vector3;
use nearmiss::{Aabb, Clash, ClashKind, Placed};
use nearmiss_draw::canvas::{Area, Camera, Canvas, Colour, FINE};
use nearmiss_draw::picture::Picture;

use crate::clash::list::List;
use crate::console::Bar;
use crate::picture::{
    GROUND, HALO, LARGEST, OF_A, OF_B, PANEL_GROUND, directions, dot, obstacle, paint_sized, scale_bar,
    splat, stored_index,
};
use crate::viewpoint::whole_camera;

/// Sizes in fine pixels.
const OVERVIEW: [usize; 2] = [1120 * FINE, 700 * FINE];
const CLOSE: [usize; 2] = [420 * FINE, 320 * FINE];

/// Colours of contacts, and of the background of their numbers.
const OF_HARD: Colour = [196, 22, 42];
const OF_CLEARANCE: Colour = [126, 60, 160];

/// Radii in fine pixels: of points if no surfaces are compared, and of the dots at contacts.
const POINT: f64 = 3.0;
const CONTACT: f64 = 4.5;

/// Least half height of the close view: in local radii, and as a share of the diagonal of the
/// smaller scan.
const RADII: f64 = 12.0;
const OF_SMALLER: f64 = 0.12;

/// The half height of the close view up to which a small scan is shown as a whole, in its diagonals.
const OF_SMALL: f64 = 0.75;

/// A scan is cut open in the overview if the diagonal of its box exceeds this multiple of the
/// other's.
const LARGER: f64 = 3.0;

/// Height of the view of the smaller scan's surroundings, in diagonals of that scan. The view is
/// made if it magnifies the overview by more than `LOST`.
const AROUND: f64 = 1.6;
const LOST: f64 = 3.0;

/// Stored points per chunk. Points that follow each other are near each other, because they are
/// stored in the order of the tree.
const CHUNK: usize = 512;

/// The number of points of a scan, and of contacts, that are sampled to choose a direction.
const LOOKED_AT: usize = 1200;
const TARGETS: usize = 24;

/// The pictures of a list.
pub(crate) struct Pictures {
    /// Both scans.
    pub(crate) overview: Picture,
    /// The surroundings of the smaller scan, if it is lost in the overview.
    pub(crate) surroundings: Option<Picture>,
    /// Close views of the first clashes.
    pub(crate) close: Vec<Picture>,
}

/// Paints the overview and the first `count` clashes, and advances `bar` for each.
pub(crate) fn paint(list: &List<'_>, count: usize, bar: &Bar) -> Pictures {
    let whole = Overview::new(list);
    let overview = whole.paint(list, count, &whole.camera);
    let surroundings = whole.nearer.as_ref().map(|camera| whole.paint(list, count, camera));
    bar.advance(1);
    let chunks = list.views.map(Chunks::new);
    let close = list.found.clashes.iter().take(count).map(|clash| {
        let picture = Close::new(list, clash, &chunks).paint(list, clash);
        bar.advance(1);
        picture
    });
    Pictures { overview, surroundings, close: close.collect() }
}

/// The overview of both scans. If one scan is much larger than the other, its part in front of the
/// smaller one is left out, like the front of a doll's house.
struct Overview {
    camera: Camera,
    /// The camera for the surroundings of the smaller scan, if the other is much larger.
    nearer: Option<Camera>,
    /// For each scan, the greatest coordinate towards the viewer at which points are painted.
    cuts: [f64; 2],
}

impl Overview {
    fn new(list: &List<'_>) -> Self {
        let [width, height] = OVERVIEW;
        let area = Area { left: 0, top: 0, width, height };
        let clashes = &list.found.clashes;
        let centres: Vec<Vector3<f64>> = clashes.iter().map(|clash| clash.group.centre().into()).collect();
        let boxes = list.views.map(bounds);
        let sizes = boxes.map(|bounds| diagonal(&bounds));
        let smaller = usize::from(sizes[1] < sizes[0]);
        let size = sizes[smaller];
        let is_open = sizes[1 - smaller] > LARGER * size && !centres.is_empty();
        let targets = thinned(&centres, TARGETS);
        let camera = whole_camera(list.views, area, |points, toward| {
            if is_open {
                // Prefer a view from above, as into a building.
                return 3.0 * (1.0 - toward.dot(&Vector3::new(0.0, -0.35, 0.94)));
            }
            4.0 * hidden(&targets, points, *toward, [0.1 * size, 0.05 * size])
        });
        let mut cuts = [f64::INFINITY; 2];
        if !is_open {
            return Self { camera, nearer: None, cuts };
        }
        let front = |corner: [f64; 3]| camera.axes[2].dot(&Vector3::from(corner));
        cuts[1 - smaller] = boxes[smaller].corners().into_iter().map(front).fold(f64::NEG_INFINITY, f64::max);
        #[expect(clippy::cast_precision_loss, reason = "pixels")]
        let scale = height as f64 / (AROUND * size.max(f64::MIN_POSITIVE));
        let nearer = Camera { centre: boxes[smaller].centre().into(), scale, ..camera };
        Self { camera, nearer: Some(nearer).filter(|nearer| nearer.scale > LOST * camera.scale), cuts }
    }

    /// Paints both scans with the numbers of the first clashes, and dots at the others.
    fn paint(&self, list: &List<'_>, numbered: usize, camera: &Camera) -> Picture {
        let Area { width, height, .. } = camera.area;
        let mut canvas = Canvas::new(width, height, GROUND);
        canvas.fill(camera.area, PANEL_GROUND);
        for ((view, colour), cut) in list.views.into_iter().zip([OF_A, OF_B]).zip(self.cuts) {
            let front = |i: usize| camera.axes[2].dot(&Vector3::from(view.point(i)));
            for i in (0..view.scan().len()).filter(|&i| front(i) <= cut) {
                point(list, &mut canvas, camera, (view, i), colour, LARGEST);
            }
        }
        scale_bar(&mut canvas, camera);
        let clashes = &list.found.clashes;
        for clash in clashes.iter().skip(numbered) {
            contact_dot(&mut canvas, camera, clash.group.centre().into(), colour_of(clash));
        }
        // The first clash is painted last, so that it is on top.
        for (i, clash) in clashes.iter().enumerate().take(numbered).rev() {
            label(&mut canvas, camera, clash.group.centre().into(), i + 1, colour_of(clash));
        }
        canvas.picture()
    }
}

/// Paints one stored point as it is compared: as a dot, or as part of the obstacle.
fn point(
    list: &List<'_>,
    canvas: &mut Canvas,
    camera: &Camera,
    (view, i): (&Placed<'_>, usize),
    colour: Colour,
    largest: f64,
) {
    if list.of_points {
        canvas.splat(camera, &dot(&splat(view, i), camera, POINT), colour);
    } else {
        obstacle(canvas, camera, view, i, colour, largest);
    }
}

fn colour_of(clash: &Clash) -> Colour {
    match clash.kind {
        ClashKind::Hard => OF_HARD,
        ClashKind::Clearance => OF_CLEARANCE,
    }
}

fn contact_dot(canvas: &mut Canvas, camera: &Camera, place: Vector3<f64>, colour: Colour) {
    let [x, y, _] = camera.project(place);
    canvas.line(camera.area, [[x, y]; 2], 2.0 * CONTACT + HALO, GROUND);
    canvas.line(camera.area, [[x, y]; 2], 2.0 * CONTACT, colour);
}

/// Writes a number on a round background at a place.
fn label(canvas: &mut Canvas, camera: &Camera, place: Vector3<f64>, number: usize, colour: Colour) {
    let (text, size) = (number.to_string(), 2 * FINE);
    let [x, y, _] = camera.project(place);
    #[expect(clippy::cast_precision_loss, reason = "pixels")]
    let half = 0.5 * Canvas::text_width(size, &text) as f64;
    let (thick, ends) = (15.0 * size as f64 / 2.0, [[x - 0.6 * half, y], [x + 0.6 * half, y]]);
    canvas.line(camera.area, ends, thick + 2.0 * HALO, GROUND);
    canvas.line(camera.area, ends, thick, colour);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the cast saturates")]
    let corner = [x - half + 0.5 * size as f64, y - 3.5 * size as f64].map(|c| c.max(0.0) as usize);
    canvas.text(corner, size, GROUND, &text);
}

/// Returns the bounds of a placed scan in the world, from the corners of its own bounds.
fn bounds(view: &Placed<'_>) -> Aabb {
    let frame = view.scan().frame();
    let to_stored = |p: [f64; 3]| [0, 1, 2].map(|k| (p[k] - frame.origin[k]) / frame.scale);
    Aabb::of(view.scan().bounds().corners().map(|p| view.stored_to_world().apply(to_stored(p))))
}

fn diagonal(bounds: &Aabb) -> f64 {
    2.0 * Vector3::from(bounds.half_extents()).norm()
}

/// Returns at most `most` of the places, evenly spaced in their order.
fn thinned(places: &[Vector3<f64>], most: usize) -> Vec<Vector3<f64>> {
    places.iter().step_by(places.len().div_ceil(most).max(1)).copied().collect()
}

/// Estimates how much of the targets is hidden, seen from `toward`: 0 to about 1. A point counts if
/// it is more than `from` in front of a target and less than `beside` from its line of sight.
fn hidden(
    targets: &[Vector3<f64>],
    points: &[Vector3<f64>],
    toward: Vector3<f64>,
    [from, beside]: [f64; 2],
) -> f64 {
    let of_target = |target: &Vector3<f64>| {
        let before = points.iter().filter(|p| {
            let offset = *p - target;
            let depth = toward.dot(&offset);
            depth > from && (offset - toward * depth).norm_squared() < beside * beside
        });
        #[expect(clippy::cast_precision_loss, reason = "a count")]
        let count = before.count() as f64;
        count / (count + 3.0)
    };
    #[expect(clippy::cast_precision_loss, reason = "a count")]
    let count = targets.len().max(1) as f64;
    targets.iter().map(of_target).sum::<f64>() / count
}

/// Bounding boxes of chunks of consecutive stored points.
struct Chunks(Vec<Aabb>);

impl Chunks {
    fn new(view: &Placed<'_>) -> Self {
        let starts = (0..view.scan().len()).step_by(CHUNK);
        Self(
            starts
                .map(|start| Aabb::of((start..view.scan().len().min(start + CHUNK)).map(|i| view.point(i))))
                .collect(),
        )
    }

    /// Returns the stored points within a radius of a place.
    fn within(&self, view: &Placed<'_>, centre: Vector3<f64>, radius: f64) -> Vec<usize> {
        let near = |bounds: &Aabb| {
            let beyond =
                (0..3).map(|k| (bounds.min[k] - centre[k]).max(centre[k] - bounds.max[k]).max(0.0).powi(2));
            beyond.sum::<f64>() <= radius * radius
        };
        let chunks = self.0.iter().enumerate().filter(|(_, bounds)| near(bounds)).map(|(k, _)| k * CHUNK);
        let points = chunks.flat_map(|start| start..view.scan().len().min(start + CHUNK));
        points.filter(|&i| (Vector3::from(view.point(i)) - centre).norm() <= radius).collect()
    }
}

/// A close view of a clash.
struct Close {
    camera: Camera,
    /// The stored points of each scan that are shown.
    shown: [Vec<usize>; 2],
    contacts: Vec<Vector3<f64>>,
}

impl Close {
    fn new(list: &List<'_>, clash: &Clash, chunks: &[Chunks; 2]) -> Self {
        let places = clash.group.contacts.iter().map(|&i| Vector3::from(list.found.contacts[i].point));
        let contacts: Vec<Vector3<f64>> = places.collect();
        let nearest = &list.found.contacts[clash.group.nearest];
        let radius = |k: usize| -> f64 {
            let view = list.views[k];
            let local = view.scan().radii()[stored_index(view, nearest.sources[k])];
            f64::from(local) * view.stored_to_world().scale()
        };
        let sizes = list.views.map(|view| diagonal(&bounds(view)));
        let smaller = usize::from(sizes[1] < sizes[0]);
        // A scan that is small compared with the spacing of the other fills the view.
        let around = (RADII * radius(0).min(radius(1))).max(OF_SMALL * sizes[smaller]);
        let reach: f64 = (0.7_f64 * clash.group.diagonal())
            .max((RADII * radius(0).max(radius(1))).min(around))
            .max(OF_SMALLER * sizes[smaller])
            .max(1.5 * clash.upper)
            .max(f64::MIN_POSITIVE);
        let centre = Vector3::from(clash.group.centre());
        let shown = [0, 1].map(|k| chunks[k].within(list.views[k], centre, 1.7 * reach));
        let looked_at = [0, 1].map(|k: usize| {
            let stride = shown[k].len().div_ceil(LOOKED_AT).max(1);
            let some = shown[k].iter().step_by(stride).map(|&i| Vector3::from(list.views[k].point(i)));
            some.collect::<Vec<_>>()
        });
        // Avoid directions in which contacts are hidden, or the smaller scan by the larger one.
        let (targets, body) = (thinned(&contacts, TARGETS), thinned(&looked_at[smaller], TARGETS));
        let normal = nearest.normals.map_or_else(Vector3::zeros, |normals| normals[1 - smaller].into());
        // Look at a gap along the surfaces, and at a cut obliquely.
        let oblique = if clash.kind == ClashKind::Hard { 0.4 } else { 0.1 };
        let cost = |toward: &Vector3<f64>| {
            let below = (-toward.dot(&Vector3::new(0.0, 0.5, 0.8))).max(0.0);
            let steep = toward.z.abs().powi(4);
            let turned = (toward.dot(&normal).abs() - oblique).abs();
            let before = [0.08 * reach, 0.1 * reach];
            let of_contacts: f64 =
                looked_at.iter().map(|points| hidden(&targets, points, *toward, before)).sum();
            let of_body = hidden(&body, &looked_at[1 - smaller], *toward, before);
            of_contacts + 2.0 * of_body + 0.4 * turned + 0.25 * below + 0.1 * steep
        };
        let toward = directions().min_by(|p, q| cost(p).total_cmp(&cost(q))).unwrap_or_else(Vector3::z);
        // Upright if possible: z points up unless the view is along z.
        let axis = if toward.z.abs() < 0.97 { Vector3::z() } else { Vector3::y() };
        let up = (axis - toward * toward.dot(&axis)).normalize();
        let [width, height] = CLOSE;
        #[expect(clippy::cast_precision_loss, reason = "pixels")]
        let scale = 0.5 * height as f64 / reach;
        let area = Area { left: 0, top: 0, width, height };
        let camera = Camera { axes: [up.cross(&toward), up, toward], centre, scale, area };
        Self { camera, shown, contacts }
    }

    fn paint(&self, list: &List<'_>, clash: &Clash) -> Picture {
        let [width, height] = CLOSE;
        let mut canvas = Canvas::new(width, height, GROUND);
        canvas.fill(self.camera.area, PANEL_GROUND);
        let sizes = list.views.map(|view| diagonal(&bounds(view)));
        paint_sized(&mut canvas, self.camera.area, sizes, |canvas, side| {
            for &i in &self.shown[side] {
                let (of, colour) = ((list.views[side], i), [OF_A, OF_B][side]);
                point(list, canvas, &self.camera, of, colour, f64::INFINITY);
            }
        });
        scale_bar(&mut canvas, &self.camera);
        for &contact in &self.contacts {
            contact_dot(&mut canvas, &self.camera, contact, colour_of(clash));
        }
        canvas.picture()
    }
}
