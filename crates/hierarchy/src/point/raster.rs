//! The points of a depth frame by pixel. Neighbours of a point are sought among the pixels around it,
//! so sixteen pixels of a row take the same neighbour at once.

use std::ops::{Range, RangeInclusive};

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x16};
use nearmiss_geometry::Frame;
use nearmiss_lanes::parallel::{change_runs, map_each, ranges};
use nearmiss_lanes::vector::{dot, sub};
use nearmiss_lanes::wide::Bits;

use crate::point::spacing::GROWTH;

/// The number of pixels processed together.
pub(crate) const WIDTH: usize = 16;

/// The reach of the window of neighbours, in pixels. A row, column or diagonal has only four of its
/// 24 neighbours, so the sixth nearest is beside the line of the others: where a surface is seen at a
/// grazing angle, the spacing is that across lines, as for the rings of a scanner. The weights of the
/// default surface fall to an eighth at two pixels.
const WINDOW: isize = 2;

/// The pixels around the image without points, as many as a window reaches.
const MARGIN: usize = 2;

/// The coordinates of a pixel without a point: too far to be a neighbour.
const NOWHERE: f32 = 1e30;

/// The greatest number of neighbours that the window serves.
pub(crate) const MOST_NEIGHBOURS: u32 = 8;

/// The greatest number of pixels in a row or column.
pub(crate) const MOST_PIXELS: usize = 1 << 16;

/// The reach of the window in which radii are smoothed.
const SMOOTHING: isize = 1;

/// A pixel of an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Pixel {
    pub(crate) row: u16,
    pub(crate) column: u16,
}

/// A depth frame. Arrays have a margin around the image, and room for full lanes.
#[derive(Debug, Clone, Default)]
pub(crate) struct Raster {
    pub(crate) width: usize,
    pub(crate) height: usize,
    stride: usize,
    /// The coordinates of each row, x, then y, then z.
    positions: Vec<f32>,
    /// Distances of the K-th neighbours, and smoothed.
    spacings: Vec<f32>,
    radii: Vec<f32>,
    /// The support radii of each row, then their decays.
    supports: Vec<f32>,
    /// The pixels with points, as one bit each for sixteen in a row.
    there: Vec<u16>,
    /// The pixels along a curve that stays within small squares before it goes on.
    curve: Vec<Pixel>,
}

/// Sixteen pixels of a row.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sixteen {
    row: usize,
    column: usize,
}

impl Sixteen {
    /// Returns the pixel in a lane.
    #[expect(clippy::cast_possible_truncation, reason = "rows and columns are counted in 16 bits")]
    pub(crate) const fn pixel(self, lane: usize) -> Pixel {
        Pixel { row: self.row as u16, column: (self.column + lane) as u16 }
    }

    /// Returns the place of the first of the pixels in an array of all pixels.
    fn place(self, stride: usize) -> usize {
        (self.row + MARGIN) * stride + self.column + MARGIN
    }
}

impl Raster {
    /// Sets the size of the image, and the places of all pixels.
    pub(crate) fn place(&mut self, points: &[[f64; 3]], width: usize, frame: &Frame) {
        let height = points.len() / width;
        if (width, height) != (self.width, self.height) {
            let stride = width.next_multiple_of(WIDTH) + 2 * MARGIN;
            let count = (height + 2 * MARGIN) * stride;
            let curve = curve(width, height);
            *self = Self {
                width,
                height,
                stride,
                positions: vec![NOWHERE; 3 * count],
                spacings: vec![f32::INFINITY; count],
                radii: vec![0.0; count],
                supports: vec![0.0; 2 * count],
                there: vec![0; height * width.div_ceil(WIDTH)],
                curve,
            };
        }
        let stride = self.stride;
        let inner = &mut self.positions[3 * MARGIN * stride..][..3 * height * stride];
        change_runs(inner, 3 * stride, |row, out| {
            for (column, p) in points[row * width..][..width].iter().enumerate() {
                let p = if is_measured(*p) { frame.to_local(*p) } else { [NOWHERE; 3] };
                for k in 0..3 {
                    out[k * stride + MARGIN + column] = p[k];
                }
            }
        });
        let positions: &[f32] = &self.positions;
        change_runs(&mut self.there, width.div_ceil(WIDTH), |row, there| {
            let (xs, _) = positions[3 * (row + MARGIN) * stride + MARGIN..].as_chunks::<WIDTH>();
            for (bits, xs) in there.iter_mut().zip(xs) {
                *bits = (0..WIDTH).fold(0, |bits, lane| bits | u16::from(xs[lane] < NOWHERE) << lane);
            }
        });
    }

    /// Returns the pixels with points, along the curve.
    pub(crate) fn measured(&self) -> Vec<Pixel> {
        let some = |range: Range<usize>| self.curve[range].iter().copied().filter(|pixel| self.has(*pixel));
        ranges(self.curve.len(), |range| some(range).collect::<Vec<_>>()).concat()
    }

    fn has(&self, pixel: Pixel) -> bool {
        self.positions
            [3 * (usize::from(pixel.row) + MARGIN) * self.stride + usize::from(pixel.column) + MARGIN]
            < NOWHERE
    }

    /// Returns the number of a pixel, row by row.
    pub(crate) fn number(&self, pixel: Pixel) -> usize {
        usize::from(pixel.row) * self.width + usize::from(pixel.column)
    }

    /// Returns the place of a pixel.
    pub(crate) fn position(&self, pixel: Pixel) -> [f32; 3] {
        let at = 3 * (usize::from(pixel.row) + MARGIN) * self.stride + usize::from(pixel.column) + MARGIN;
        [self.positions[at], self.positions[at + self.stride], self.positions[at + 2 * self.stride]]
    }

    /// Returns the radius of a pixel.
    pub(crate) fn radius(&self, pixel: Pixel) -> f32 {
        self.radii[self.at(pixel)]
    }

    /// Returns the distance of the K-th neighbour of a pixel, infinite if its window has fewer.
    pub(crate) fn spacing(&self, pixel: Pixel) -> f32 {
        self.spacings[self.at(pixel)]
    }

    fn at(&self, pixel: Pixel) -> usize {
        (usize::from(pixel.row) + MARGIN) * self.stride + usize::from(pixel.column) + MARGIN
    }

    /// Returns the pixels of a row, sixteen by sixteen, and the lanes with points as bits.
    pub(crate) fn row(&self, row: usize) -> impl Iterator<Item = (Sixteen, u32)> {
        let steps = self.width.div_ceil(WIDTH);
        self.there[row * steps..][..steps].iter().enumerate().filter_map(move |(step, there)| {
            (*there != 0).then_some((Sixteen { row, column: step * WIDTH }, u32::from(*there)))
        })
    }

    /// Returns the coordinates of sixteen pixels.
    #[inline(always)]
    fn load<S: Simd>(&self, simd: S, here: Sixteen, (down, right): (isize, isize)) -> [f32x16<S>; 3] {
        let row = (here.row + MARGIN).wrapping_add_signed(down);
        let column = (here.column + MARGIN).wrapping_add_signed(right);
        let at = 3 * row * self.stride + column;
        let lanes = |k: usize| f32x16::from_slice(simd, &self.positions[at + k * self.stride..][..WIDTH]);
        [lanes(0), lanes(1), lanes(2)]
    }

    /// Returns the neighbours of sixteen pixels as seen from them.
    #[inline(always)]
    fn seen<S: Simd>(
        &self,
        simd: S,
        here: Sixteen,
        own: [f32x16<S>; 3],
        by: (isize, isize),
    ) -> [f32x16<S>; 3] {
        let [x, y, z] = self.load(simd, here, by);
        [x - own[0], y - own[1], z - own[2]]
    }

    /// Passes on, for each neighbour in the window, its place as seen from sixteen pixels, its support
    /// radius and its decay.
    #[inline(always)]
    pub(crate) fn around<S: Simd>(
        &self,
        simd: S,
        here: Sixteen,
        mut each: impl FnMut([f32x16<S>; 3], f32x16<S>, f32x16<S>),
    ) {
        let own = self.load(simd, here, (0, 0));
        for down in -WINDOW..=WINDOW {
            let row = (here.row + MARGIN).wrapping_add_signed(down);
            for right in -WINDOW..=WINDOW {
                let at = 2 * row * self.stride + (here.column + MARGIN).wrapping_add_signed(right);
                let lanes = |at: usize| f32x16::from_slice(simd, &self.supports[at..][..WIDTH]);
                each(self.seen(simd, here, own, (down, right)), lanes(at), lanes(at + self.stride));
            }
        }
    }

    /// Returns the numbers of the eight pixels around one with their points, the nearest first.
    pub(crate) fn nearest(&self, pixel: Pixel) -> impl Iterator<Item = Pixel> {
        let p = self.position(pixel);
        let mut found = [(f32::INFINITY, pixel); 8];
        let mut count = 0;
        for row in pixel.row.saturating_sub(1)..=pixel.row.saturating_add(1) {
            for column in pixel.column.saturating_sub(1)..=pixel.column.saturating_add(1) {
                let other = Pixel { row, column };
                let is_inside = usize::from(row) < self.height && usize::from(column) < self.width;
                if other != pixel && is_inside && self.has(other) {
                    let d = sub(self.position(other), p);
                    found[count] = (dot(d, d), other);
                    count += 1;
                }
            }
        }
        found[..count].sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        found.into_iter().take(count).map(|(_, other)| other)
    }

    /// Measures the spacing of all points: the distance of the `count`-th neighbour in the window.
    /// Then smooths them, so that none exceeds that of a neighbour by much. Returns the number of points
    /// whose window has fewer neighbours.
    pub(crate) fn space(&mut self, count: usize) -> usize {
        let (level, stride) = (Level::new(), self.stride);
        let mut spacings = std::mem::take(&mut self.spacings);
        let raster = &*self;
        change_runs(inner(&mut spacings, stride), stride, |row, out| {
            out.fill(f32::INFINITY);
            for (here, _) in raster.row(row) {
                dispatch!(level, simd => simd.vectorize(
                    #[inline(always)]
                    || raster.spacings_of(simd, here, count, out),
                ));
            }
        });
        self.spacings = spacings;
        let mut radii = std::mem::take(&mut self.radii);
        let raster = &*self;
        change_runs(inner(&mut radii, stride), stride, |row, out| {
            for (here, _) in raster.row(row) {
                dispatch!(level, simd => simd.vectorize(
                    #[inline(always)]
                    || raster.smooth(simd, here, out),
                ));
            }
        });
        self.radii = radii;
        let alone = map_each(self.height, |row| {
            let alone = |here: Sixteen, lane: usize| !self.spacing(here.pixel(lane)).is_finite();
            let alone = |(here, there)| Bits(there).filter(|lane| alone(here, *lane)).count();
            self.row(row).map(alone).sum::<usize>()
        });
        alone.into_iter().sum()
    }

    #[inline(always)]
    fn spacings_of<S: Simd>(&self, simd: S, here: Sixteen, count: usize, out: &mut [f32]) {
        let own = self.load(simd, here, (0, 0));
        let mut best = [f32x16::splat(simd, f32::INFINITY); MOST_NEIGHBOURS as usize];
        for down in -WINDOW..=WINDOW {
            for right in -WINDOW..=WINDOW {
                if (down, right) == (0, 0) {
                    continue;
                }
                let [x, y, z] = self.seen(simd, here, own, (down, right));
                let mut d = x * x + y * y + z * z;
                for best in &mut best[..count] {
                    (*best, d) = (best.min(d), best.max(d));
                }
            }
        }
        let last = best[count - 1].sqrt().to_array();
        out[here.column + MARGIN..][..WIDTH].copy_from_slice(&last);
    }

    #[inline(always)]
    fn smooth<S: Simd>(&self, simd: S, here: Sixteen, out: &mut [f32]) {
        let own = self.load(simd, here, (0, 0));
        let mut least = f32x16::splat(simd, f32::INFINITY);
        for down in -SMOOTHING..=SMOOTHING {
            for right in -SMOOTHING..=SMOOTHING {
                let [x, y, z] = self.seen(simd, here, own, (down, right));
                let at =
                    here.place(self.stride).wrapping_add_signed(down * self.stride.cast_signed() + right);
                let radius = f32x16::from_slice(simd, &self.spacings[at..][..WIDTH]);
                least = least.min(radius + (x * x + y * y + z * z).sqrt() * GROWTH);
            }
        }
        out[here.column + MARGIN..][..WIDTH].copy_from_slice(&least.to_array());
    }

    /// [Limits](limited) the radii, and sets the support radii of all points.
    pub(crate) fn support(
        &mut self,
        limits: &RangeInclusive<f32>,
        support_radius: impl Fn(f32) -> f32 + Sync + Send,
        decay: impl Fn(f32) -> f32 + Sync + Send,
    ) {
        let stride = self.stride;
        change_runs(&mut self.radii, stride, |_, radii| {
            for radius in radii {
                *radius = limited(*radius, limits);
            }
        });
        let radii: &[f32] = &self.radii;
        change_runs(&mut self.supports, 2 * stride, |row, out| {
            let (supports, decays) = out.split_at_mut(stride);
            for (i, radius) in radii[row * stride..][..stride].iter().enumerate() {
                supports[i] = support_radius(*radius);
                decays[i] = decay(supports[i]);
            }
        });
    }
}

/// Returns a radius within limits; the upper one for infinity and NaN.
pub(crate) fn limited(radius: f32, limits: &RangeInclusive<f32>) -> f32 {
    if radius < *limits.end() { radius.max(*limits.start()) } else { *limits.end() }
}

/// Returns the rows of an array that are no margin.
fn inner(all: &mut [f32], stride: usize) -> &mut [f32] {
    let end = all.len() - MARGIN * stride;
    &mut all[MARGIN * stride..end]
}

/// Returns `true` if there is a point: finite, and not zero, as some cameras mark holes.
pub(crate) fn is_measured(p: [f64; 3]) -> bool {
    // Zero for finite coordinates, NaN for others.
    let zero = 0.0 * p[0] + 0.0 * p[1] + 0.0 * p[2];
    (zero == 0.0) & ((p[0] != 0.0) | (p[1] != 0.0) | (p[2] != 0.0))
}

/// Returns the pixels of an image along a Hilbert curve (Hilbert 1891): sixteen in a row are a square
/// or nearly so.
fn curve(width: usize, height: usize) -> Vec<Pixel> {
    let side = width.max(height).next_power_of_two();
    let rows = 0..u16::try_from(height).unwrap_or(u16::MAX);
    let columns = 0..u16::try_from(width).unwrap_or(u16::MAX);
    let pixels = rows.flat_map(|row| columns.clone().map(move |column| Pixel { row, column }));
    let mut pixels: Vec<(u64, Pixel)> =
        pixels.map(|pixel| (along_curve(side, pixel.column.into(), pixel.row.into()), pixel)).collect();
    pixels.sort_unstable();
    pixels.into_iter().map(|(_, pixel)| pixel).collect()
}

/// Returns the position of a pixel along the curve through a square of this side, a power of two.
fn along_curve(side: usize, mut x: usize, mut y: usize) -> u64 {
    let (mut position, mut half) = (0, side / 2);
    while half > 0 {
        let (right, up) = (x & half != 0, y & half != 0);
        let quarter = (3 * u64::from(right)) ^ u64::from(up);
        position += quarter * (half as u64) * (half as u64);
        if !up {
            if right {
                (x, y) = (side - 1 - x, side - 1 - y);
            }
            (x, y) = (y, x);
        }
        half /= 2;
    }
    position
}
