//! A depth image of a scan: one ray for each pixel, coloured by the length of the ray.

use std::ops::ControlFlow;

use nearmiss::geometry::nalgebra::Vector3;
use nearmiss::{BatchScratch, Ray, RayHit, Target, each};
use nearmiss_draw::canvas::{Area, Canvas, Colour, FINE, blend, shade};
use nearmiss_draw::legend;
use nearmiss_draw::picture::Picture;

use crate::digits::{percent, short};
use crate::picture::{GAP, GROUND, LEGEND};
use crate::viewpoint::ViewArgs;

/// The least width of a picture, for its legend. If the image has fewer pixels, they are squares.
const WIDTH: usize = 1080;

/// The greatest height of a picture whose pixels are squares.
const HEIGHT: usize = 4096;

/// Colours from the nearest to the furthest hit, which colour-blind readers can tell apart.
const DEPTHS: [Colour; 5] = [[253, 231, 76], [122, 209, 81], [34, 168, 132], [59, 82, 139], [68, 1, 84]];

/// The colour of pixels whose rays hit nothing.
const NOTHING: Colour = [228, 230, 234];

/// The share of the colour that is kept where a ray grazes the surface.
const GRAZING: f64 = 0.45;

/// Share of the rays that may be shorter, or longer, than the range of colours.
const OUTLYING: f64 = 0.01;

/// A camera with one vanishing point.
#[derive(Debug, Clone, Copy)]
pub(super) struct Viewer {
    /// Columns and rows of pixels.
    size: [usize; 2],
    eye: Vector3<f64>,
    /// To the right, up and ahead, for one unit of depth: to the border of the image.
    axes: [Vector3<f64>; 3],
}

impl Viewer {
    /// A camera at `eye` that looks at `place`, `angle` degrees wide, with so many columns and rows of
    /// pixels, upright as `view` tells. `None` if both places are equal.
    pub(super) fn new(
        view: &ViewArgs,
        target: &Target<'_>,
        [eye, place]: [[f64; 3]; 2],
        (angle, size): (f64, [usize; 2]),
    ) -> Option<Self> {
        let eye = Vector3::from(eye);
        let ahead = (Vector3::from(place) - eye).try_normalize(0.0)?;
        let upright = view.upright([target.scan(), target.scan()]);
        let up = upright.map_or_else(Vector3::z, |upright| upright.up());
        let right = ahead.cross(&up).try_normalize(1e-9).unwrap_or_else(|| crate::picture::across(ahead));
        let half = (0.5 * angle).to_radians().tan();
        #[expect(clippy::cast_precision_loss, reason = "pixels")]
        let tall = half * size[1] as f64 / size[0] as f64;
        Some(Self { size, eye, axes: [right * half, right.cross(&ahead) * tall, ahead] })
    }

    /// The ray through the middle of a pixel, counted by rows from the top left.
    #[expect(clippy::cast_precision_loss, reason = "pixels")]
    fn ray(&self, pixel: usize) -> Ray {
        let [columns, rows] = self.size;
        let [x, y] = [
            2.0 * ((pixel % columns) as f64 + 0.5) / columns as f64 - 1.0,
            1.0 - 2.0 * ((pixel / columns) as f64 + 0.5) / rows as f64,
        ];
        let [right, up, ahead] = self.axes;
        Ray::new(self.eye.into(), (ahead + right * x + up * y).normalize().into())
    }
}

/// Casts a ray for each pixel, or moves a ball of `radius` along it, on all threads. Returns the hits by rows
/// from the top left.
pub(super) fn shoot(target: &Target<'_>, viewer: &Viewer, radius: f64) -> Vec<Option<RayHit>> {
    let mut hits: Vec<Option<RayHit>> = vec![None; viewer.size[0] * viewer.size[1]];
    let _all = each(&mut hits, None, &mut BatchScratch::default(), |pixel, scratch| {
        ControlFlow::Continue(target.cast(&viewer.ray(pixel).with_radius(radius), scratch).hit)
    });
    hits
}

/// Paints the hits of a scan with this name.
pub(super) fn paint(hits: &[Option<RayHit>], viewer: &Viewer, name: &str) -> Picture {
    let [near, far] = range(hits);
    let [columns, rows] = viewer.size;
    let edge = WIDTH.div_ceil(columns).min((HEIGHT / rows).max(1)) * FINE;
    let width = (columns * edge).max(WIDTH * FINE);
    let mut canvas = Canvas::new(width + 2 * GAP, rows * edge + 2 * GAP + LEGEND, GROUND);
    for (pixel, hit) in hits.iter().enumerate() {
        let tint = hit.map_or(NOTHING, |hit| {
            let along = Vector3::from(viewer.ray(pixel).direction).dot(&Vector3::from(hit.normal)).abs();
            shade(colour((hit.t - near) / (far - near)), GRAZING + (1.0 - GRAZING) * along)
        });
        let [left, top] = [GAP + pixel % columns * edge, GAP + pixel / columns * edge];
        canvas.fill(Area { left, top, width: edge, height: edge }, tint);
    }
    let [left, top] = [GAP + 4 * FINE, rows * edge + 2 * GAP + 4 * FINE];
    let width = width - 4 * FINE;
    let depths = [0.0, 0.25, 0.5, 0.75, 1.0].map(|share| short(near + share * (far - near)));
    let mut entries: Vec<(Option<Colour>, &str)> = vec![(None, "Length of the ray:")];
    entries.extend(DEPTHS.iter().zip(&depths).map(|(&own, depth)| (Some(own), depth.as_str())));
    entries.push((Some(NOTHING), "hits nothing"));
    legend::entries(&mut canvas, [left, top], width, &entries);
    let told =
        format!("{name}: {} of the rays hit. Darker where they graze the surface.", percent(share(hits)));
    legend::sentence(&mut canvas, [left, top + legend::LINE], width, &told);
    canvas.picture()
}

/// The share of the rays that hit, from 0 to 1.
#[expect(clippy::cast_precision_loss, reason = "pixels")]
pub(super) fn share(hits: &[Option<RayHit>]) -> f64 {
    hits.iter().flatten().count() as f64 / hits.len() as f64
}

/// The lengths of the rays that have the first and the last colour.
fn range(hits: &[Option<RayHit>]) -> [f64; 2] {
    let mut lengths: Vec<f64> = hits.iter().flatten().map(|hit| hit.t).collect();
    lengths.sort_unstable_by(f64::total_cmp);
    let (Some(&first), Some(&last)) = (lengths.first(), lengths.last()) else { return [0.0, 1.0] };
    #[expect(
        clippy::cast_precision_loss,
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a count"
    )]
    let off = (OUTLYING * lengths.len() as f64) as usize;
    let [near, far] = [lengths[off], lengths[lengths.len() - 1 - off]];
    if far > near { [near, far] } else { [first, last.max(first + f64::MIN_POSITIVE)] }
}

/// Returns the colour of a share of the range.
fn colour(share: f64) -> Colour {
    let place = 4.0 * if share.is_finite() { share.clamp(0.0, 1.0) } else { 1.0 };
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 3")]
    let step = (place as usize).min(3);
    #[expect(clippy::cast_precision_loss, reason = "0 to 3")]
    let within = place - step as f64;
    blend(DEPTHS[step], DEPTHS[step + 1], within)
}
