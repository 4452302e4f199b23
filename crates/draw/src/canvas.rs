//! A canvas of pixels with depth. Paints discs and balls under an orthographic camera, with lines,
//! rings and letters over them.

use nearmiss_geometry::nalgebra::Vector3;

use crate::font;
use crate::picture::Picture;

/// Red, green, blue.
pub type Colour = [u8; 3];

/// Supersampling factor in both directions: fine pixels per pixel of the picture.
pub const FINE: usize = 2;

/// A rectangle of fine pixels.
#[derive(Debug, Clone, Copy)]
pub struct Area {
    /// First column.
    pub left: usize,
    /// First row, from the top.
    pub top: usize,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

/// An orthographic camera for an area of the canvas.
#[derive(Debug, Clone, Copy)]
pub struct Camera {
    /// Unit directions: to the right, up, and towards the viewer.
    pub axes: [Vector3<f64>; 3],
    /// The point shown in the middle of the area.
    pub centre: Vector3<f64>,
    /// Fine pixels per unit of length.
    pub scale: f64,
    /// The part of the canvas that shows the view.
    pub area: Area,
}

impl Camera {
    /// Returns the components of a direction or offset: to the right, up and towards the viewer.
    #[must_use]
    pub fn turn(&self, v: Vector3<f64>) -> [f64; 3] {
        self.axes.map(|axis| axis.dot(&v))
    }

    /// Returns column, row, and nearness to the viewer, in fine pixels.
    #[must_use]
    pub fn project(&self, p: Vector3<f64>) -> [f64; 3] {
        let [x, y, z] = self.turn(p - self.centre);
        [self.middle(0) + self.scale * x, self.middle(1) - self.scale * y, self.scale * z]
    }

    #[expect(clippy::cast_precision_loss, reason = "pixels")]
    fn middle(&self, axis: usize) -> f64 {
        let Area { left, top, width, height } = self.area;
        let (start, length) = if axis == 0 { (left, width) } else { (top, height) };
        start as f64 + 0.5 * length as f64
    }
}

/// A disc in the world.
#[derive(Debug, Clone, Copy)]
pub struct Splat {
    /// The centre.
    pub centre: Vector3<f64>,
    /// The unit normal, of either sign.
    pub normal: Vector3<f64>,
    /// The radius, in units of the world.
    pub radius: f64,
}

/// Direction to the light, over the viewer's left shoulder: right, up, towards the viewer.
const LIGHT: [f64; 3] = [-0.36, 0.48, 0.8];

/// Share of the colour that is kept without light.
const AMBIENT: f64 = 0.3;

/// Discs whose normals have a smaller component towards the viewer are painted as dots.
const EDGE_ON: f64 = 0.12;

/// The least radius of a disc, in fine pixels.
const DOT: f64 = 1.4;

/// The greatest radius of a disc, in fine pixels.
const LARGEST: f64 = 200.0;

/// A canvas of fine pixels, from which a [`Picture`] is made.
#[derive(Debug, Clone)]
pub struct Canvas {
    width: usize,
    height: usize,
    pixels: Vec<Colour>,
    depth: Vec<f64>,
}

impl Canvas {
    /// Returns a canvas of one colour. Width and height are in fine pixels.
    #[must_use]
    pub fn new(width: usize, height: usize, ground: Colour) -> Self {
        let count = width * height;
        Self { width, height, pixels: vec![ground; count], depth: vec![f64::NEG_INFINITY; count] }
    }

    /// Fills the part of `area` that is on the canvas, over everything there.
    pub fn fill(&mut self, area: Area, colour: Colour) {
        for y in area.top..(area.top + area.height).min(self.height) {
            let row = y * self.width;
            let [left, right] = [area.left, area.left + area.width].map(|x| row + x.min(self.width));
            self.pixels[left..right].fill(colour);
            self.depth[left..right].fill(f64::NEG_INFINITY);
        }
    }

    /// Paints a lit disc, hidden by anything nearer to the viewer.
    pub fn splat(&mut self, camera: &Camera, splat: &Splat, colour: Colour) {
        let [x, y, z] = camera.project(splat.centre);
        let n = camera.turn(splat.normal);
        let lambert = (0..3).map(|k| n[k] * LIGHT[k]).sum::<f64>().abs();
        let lit = shade(colour, AMBIENT + (1.0 - AMBIENT) * lambert);
        let radius = (camera.scale * splat.radius).min(LARGEST);
        let (columns, rows) = pixels_about(camera.area, [x, y], radius.max(DOT));
        for row in rows {
            for column in columns.clone() {
                let [u, v] = centre_of(column, row);
                let (dx, dy) = (u - x, y - v);
                let tilt = if n[2].abs() > EDGE_ON { -(n[0] * dx + n[1] * dy) / n[2] } else { f64::INFINITY };
                let flat = dx * dx + dy * dy;
                let in_dot = flat <= DOT * DOT;
                let in_disc = flat + tilt * tilt <= radius * radius;
                let near = z + if in_disc { tilt } else { 0.0 };
                let i = row * self.width + column;
                if (in_dot || in_disc) && near > self.depth[i] {
                    self.depth[i] = near;
                    self.pixels[i] = lit;
                }
            }
        }
    }

    /// Paints a lit triangle, hidden by anything nearer to the viewer.
    pub fn triangle(&mut self, camera: &Camera, corners: &[Vector3<f64>; 3], colour: Colour) {
        let [p, q, r] = corners.map(|corner| camera.project(corner));
        let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
        let Some(normal) = normal.try_normalize(0.0) else { return };
        let n = camera.turn(normal);
        let lambert = (0..3).map(|k| n[k] * LIGHT[k]).sum::<f64>().abs();
        let lit = shade(colour, AMBIENT + (1.0 - AMBIENT) * lambert);
        let area = (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
        if area == 0.0 {
            return;
        }
        let middle = [0, 1].map(|k| 0.5 * (p[k].min(q[k]).min(r[k]) + p[k].max(q[k]).max(r[k])));
        let half = [0, 1].map(|k| p[k].max(q[k]).max(r[k]) - middle[k]);
        let columns = pixels_about(camera.area, middle, half[0]).0;
        let rows = pixels_about(camera.area, middle, half[1]).1;
        for row in rows {
            for column in columns.clone() {
                let [x, y] = centre_of(column, row);
                let u = ((x - p[0]) * (r[1] - p[1]) - (y - p[1]) * (r[0] - p[0])) / area;
                let v = ((q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0])) / area;
                let near = p[2] + u * (q[2] - p[2]) + v * (r[2] - p[2]);
                let i = row * self.width + column;
                let is_inside = u >= 0.0 && v >= 0.0 && u + v <= 1.0;
                if is_inside && near > self.depth[i] {
                    self.depth[i] = near;
                    self.pixels[i] = lit;
                }
            }
        }
    }

    /// Paints a lit ball, hidden by anything nearer to the viewer.
    pub fn ball(&mut self, camera: &Camera, centre: Vector3<f64>, radius: f64, colour: Colour) {
        let [x, y, z] = camera.project(centre);
        let radius = camera.scale * radius;
        let (columns, rows) = pixels_about(camera.area, [x, y], radius);
        for row in rows {
            for column in columns.clone() {
                let [u, v] = centre_of(column, row);
                let (dx, dy) = ((u - x) / radius, (y - v) / radius);
                let up_sq = 1.0 - dx * dx - dy * dy;
                if up_sq <= 0.0 {
                    continue;
                }
                let n = [dx, -dy, up_sq.sqrt()];
                let near = z + radius * n[2];
                let i = row * self.width + column;
                if near > self.depth[i] {
                    let lambert = (0..3).map(|k| n[k] * LIGHT[k]).sum::<f64>().max(0.0);
                    self.depth[i] = near;
                    self.pixels[i] = shade(colour, AMBIENT + (1.0 - AMBIENT) * lambert);
                }
            }
        }
    }

    /// Returns width and height in fine pixels.
    #[must_use]
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// Blends the painted pixels of `other`, a canvas of the same size, over `area` of this one.
    pub fn veil(&mut self, other: &Self, area: Area, opacity: f64) {
        for y in area.top..area.top + area.height {
            let row = y * self.width + area.left..y * self.width + area.left + area.width;
            for i in row.filter(|&i| other.depth[i] > f64::NEG_INFINITY) {
                self.pixels[i] = blend(self.pixels[i], other.pixels[i], opacity);
            }
        }
    }

    /// Blends `colour` over the pixels of `area` within `reach` of a place. `cover` gives the
    /// opacity at each pixel.
    fn overlay(
        &mut self,
        area: Area,
        [x, y]: [f64; 2],
        reach: f64,
        colour: Colour,
        cover: impl Fn([f64; 2]) -> f64,
    ) {
        let (columns, rows) = pixels_about(area, [x, y], reach);
        for row in rows {
            for column in columns.clone() {
                let share = cover(centre_of(column, row)).clamp(0.0, 1.0);
                let pixel = &mut self.pixels[row * self.width + column];
                *pixel = blend(*pixel, colour, share);
            }
        }
    }

    /// Draws a line with round ends, clipped to `area`, which must be on the canvas.
    pub fn line(&mut self, area: Area, [from, to]: [[f64; 2]; 2], width: f64, colour: Colour) {
        let middle = [0, 1].map(|k| 0.5 * (from[k] + to[k]));
        let length = distance(from, to);
        self.overlay(area, middle, 0.5 * length + width, colour, |p| {
            let along = (0..2).map(|k| (p[k] - from[k]) * (to[k] - from[k])).sum::<f64>();
            let t = if length > 0.0 { (along / (length * length)).clamp(0.0, 1.0) } else { 0.0 };
            let foot = [0, 1].map(|k| from[k] + t * (to[k] - from[k]));
            0.5 * width - distance(p, foot) + 0.5
        });
    }

    /// Draws the visible parts of a line. Something hides a part only if it is nearer to the viewer
    /// by more than `lift`, a length in the world.
    pub fn edge(&mut self, camera: &Camera, ends: [Vector3<f64>; 2], width: f64, colour: Colour, lift: f64) {
        let [from, to] = ends.map(|end| camera.project(end));
        let [start, end] = [[from[0], from[1]], [to[0], to[1]]];
        let length = distance(start, end);
        let middle = [0, 1].map(|k| 0.5 * (start[k] + end[k]));
        let (columns, rows) = pixels_about(camera.area, middle, 0.5 * length + width);
        for row in rows {
            for column in columns.clone() {
                let p = centre_of(column, row);
                let along = (0..2).map(|k| (p[k] - start[k]) * (end[k] - start[k])).sum::<f64>();
                let t = if length > 0.0 { (along / (length * length)).clamp(0.0, 1.0) } else { 0.0 };
                let foot = [0, 1].map(|k| start[k] + t * (end[k] - start[k]));
                let near = from[2] + t * (to[2] - from[2]) + lift * camera.scale;
                let i = row * self.width + column;
                if distance(p, foot) <= 0.5 * width && near > self.depth[i] {
                    self.pixels[i] = colour;
                }
            }
        }
    }

    /// Draws a circle with lines of the given width.
    pub fn ring(&mut self, area: Area, centre: [f64; 2], radius: f64, width: f64, colour: Colour) {
        self.overlay(area, centre, radius + width, colour, |p| {
            0.5 * width - (distance(p, centre) - radius).abs() + 0.5
        });
    }

    /// Writes a line of letters. Capitals are 7 `size` high, and their upper left corner is at `[x,
    /// y]`. Letters reach at most 2 `size` below the baseline. All lengths are in fine pixels.
    pub fn text(&mut self, [x, y]: [usize; 2], size: usize, colour: Colour, text: &str) {
        font::cover(size, text, |column, row, share| {
            let at = |start: usize, offset: i32| start.checked_add_signed(isize::try_from(offset).ok()?);
            let (Some(column), Some(row)) = (at(x, column), at(y, row)) else { return };
            if column < self.width && row < self.height {
                let pixel = &mut self.pixels[row * self.width + column];
                *pixel = blend(*pixel, colour, f64::from(share).clamp(0.0, 1.0));
            }
        });
    }

    /// Returns the width of a line of letters, in fine pixels.
    #[must_use]
    pub fn text_width(size: usize, text: &str) -> usize {
        font::width(size, text)
    }

    /// Returns the picture. Each of its pixels is the mean of [`FINE`]² fine pixels.
    #[must_use]
    pub fn picture(&self) -> Picture {
        let (width, height, pixels) = self.averaged();
        Picture { width, height, pixels }
    }

    /// Returns width, height and the bytes of the averaged pixels: red, green, blue.
    fn averaged(&self) -> (usize, usize, Vec<u8>) {
        let (width, height) = (self.width / FINE, self.height / FINE);
        let mut bytes = Vec::with_capacity(3 * width * height);
        for y in 0..height {
            for x in 0..width {
                let mut sum = [0_usize; 3];
                for i in 0..FINE * FINE {
                    let pixel = self.pixels[(FINE * y + i / FINE) * self.width + FINE * x + i % FINE];
                    for (sum, channel) in sum.iter_mut().zip(pixel) {
                        *sum += usize::from(channel);
                    }
                }
                bytes.extend(sum.map(|s| u8::try_from(s / (FINE * FINE)).unwrap_or(u8::MAX)));
            }
        }
        (width, height, bytes)
    }
}

/// Returns the columns and rows of `area` within `reach` of a place.
fn pixels_about(
    area: Area,
    [x, y]: [f64; 2],
    reach: f64,
) -> (std::ops::Range<usize>, std::ops::Range<usize>) {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the cast saturates")]
    let range = |c: f64, start: usize, length: usize| {
        let low = (c - reach).floor().max(0.0) as usize;
        let high = ((c + reach).ceil().max(0.0) as usize).saturating_add(1);
        low.max(start)..high.min(start + length)
    };
    (range(x, area.left, area.width), range(y, area.top, area.height))
}

#[expect(clippy::cast_precision_loss, reason = "pixels")]
fn centre_of(column: usize, row: usize) -> [f64; 2] {
    [column as f64 + 0.5, row as f64 + 0.5]
}

fn distance(p: [f64; 2], q: [f64; 2]) -> f64 {
    (p[0] - q[0]).hypot(p[1] - q[1])
}

/// Returns `colour` under a share of the light, from 0 (black) to 1.
#[must_use]
pub fn shade(colour: Colour, light: f64) -> Colour {
    blend([0; 3], colour, light.clamp(0.0, 1.0))
}

/// Returns the mixture of two colours with this share of `above`, from 0 to 1.
#[must_use]
pub fn blend(below: Colour, above: Colour, share: f64) -> Colour {
    std::array::from_fn(|k| {
        let mixed = f64::from(below[k]) * (1.0 - share) + f64::from(above[k]) * share;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 0 and 255")]
        let mixed = mixed.round() as u8;
        mixed
    })
}
