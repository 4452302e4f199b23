//! Replaces a scan by a depth frame: neighbours are sought among the pixels around each point, and
//! the order of the points follows a curve through the image (`docs/theory/moving.md`).

use nearmiss_geometry::{Aabb, CloudError, Dropped, Frame};
use nearmiss_index::PointBlock;
use nearmiss_lanes::id32;
use nearmiss_lanes::parallel::{both, change_each, fill, ranges};
use nearmiss_surface::SurfacePlan;

use crate::patch::pixels::{find_borders, fit, vote};
use crate::patch::surfels::Fit;
use crate::point::disc::PointCode;
use crate::point::kind::PointKind;
use crate::point::raster::{MOST_NEIGHBOURS, MOST_PIXELS, Pixel, Raster, is_measured};
use crate::scan::anew::{resize, set_normals};
use crate::scan::build::PointHierarchy;
use crate::scan::closing::Closing;
use crate::scan::deform_error::DeformError;
use crate::scan::options::{BuildError, BuildOptions};
use crate::scan::points::step;
use crate::scan::refit::LEAST_RADIUS;
use crate::scan::sampling::{check_reach, quantile, reach_of};
use crate::tree::split::{Item, split_loose};
use crate::tree::topology::Topology;

/// The share of points without K neighbours among the pixels around from which pixels do not tell
/// neighbours.
const ALONE: f64 = 0.05;

/// The size of the box around a leaf, in the greatest radius of its points, from which it is loose:
/// twice the diagonal of a leaf of four by four pixels.
const LOOSE: f32 = 6.0;

/// Memory that depth frames reuse.
#[derive(Debug, Clone, Default)]
pub(crate) struct Pixels {
    raster: Raster,
    fits: Vec<Fit>,
    codes: Vec<PointCode>,
    /// The pixels with points along the curve, and their radii.
    along: Vec<Pixel>,
    radii: Vec<f32>,
    items: Vec<Item>,
    counts: Vec<usize>,
}

/// Replaces `scan` by the measured points of a depth frame. Returns `false`, and changes nothing, if
/// the pixels do not tell the neighbours of the points.
pub(crate) fn replace_organised(
    scan: &mut PointHierarchy,
    pixels: &mut Pixels,
    closing: &mut Closing,
    (points, width): (&[[f64; 3]], usize),
    options: &BuildOptions,
) -> Result<bool, DeformError> {
    let Measured { bounds, count } = measured(points);
    if count < 8 {
        return Err(CloudError::TooFew { distinct: count, given: points.len() }.into());
    }
    let frame = Frame::around(bounds.min, bounds.max);
    let sides = width.max(points.len() / width);
    if options.radius_neighbours > MOST_NEIGHBOURS || sides > MOST_PIXELS || !is_in_range(&bounds) {
        return Ok(false);
    }
    pixels.raster.place(points, width, &frame);
    pixels.raster.space(options.radius_neighbours as usize);
    pixels.along.clear();
    pixels.along.extend(pixels.raster.measured());
    let Pixels { raster, fits, codes, along, radii, items, counts } = pixels;
    radii.resize(count, 0.0);
    fill(radii, |i| raster.radius(along[i]));
    #[expect(clippy::cast_precision_loss, reason = "counts below 2^32 are exact")]
    let most_alone = ALONE * count as f64;
    #[expect(clippy::cast_precision_loss, reason = "counts below 2^32 are exact")]
    let alone = along.iter().filter(|pixel| !raster.spacing(**pixel).is_finite()).count() as f64;
    if alone > most_alone {
        return Ok(false);
    }
    let (unit, ordinary) = (1.0 / frame.scale, quantile(radii, counts));
    let reach = reach_of(options, ordinary, unit);
    let far =
        (0..3).map(|k| (bounds.min[k] - frame.origin[k]).abs().max((bounds.max[k] - frame.origin[k]).abs()));
    #[expect(clippy::cast_possible_truncation, reason = "as stored")]
    check_reach(reach, (far.fold(0.0, f64::max) * unit) as f32, unit)?;
    let plan =
        SurfacePlan::new(&options.surface, f64::from(ordinary.min(reach)), unit).map_err(BuildError::from)?;
    raster.support(
        (LEAST_RADIUS, reach),
        |radius| plan.support_radius(radius),
        |support| plan.decay(support),
    );
    fits.resize(points.len(), Fit::default());
    codes.resize(points.len(), PointCode::new(PointKind::Stray, 0));
    fit(raster, &plan, reach, fits);
    vote(raster, fits);
    find_borders(raster, fits, codes);
    fill(radii, |i| raster.radius(along[i]));
    let topology = Topology::new(id32(count), options.leaf_size);
    let dense = order(raster, fits, along, items, options.leaf_size as usize);
    split_loose(items, &topology, dense, &|leaf: &[Item]| is_loose(leaf, radii));
    resize(scan, topology);
    let meta = &mut scan.meta;
    let stored = |p: [f64; 3]| frame.to_world(frame.to_local(p));
    meta.bounds = Aabb { min: stored(bounds.min), max: stored(bounds.max) };
    (meta.frame, meta.step, meta.reach, meta.dense) = (frame, step(&frame, &bounds), reach, id32(dense));
    meta.dropped = Dropped { not_finite: points.len() - count, duplicate: 0, filtered: 0 };
    meta.is_oriented = false;
    pixels.fill(scan);
    closing.reserve(scan);
    closing.support(scan);
    closing.turn(scan);
    closing.bound(scan);
    closing.finish(scan);
    Ok(true)
}

impl Pixels {
    /// Sets the arrays of the points of a scan.
    fn fill(&self, scan: &mut PointHierarchy) {
        const WIDTH: usize = PointBlock::WIDTH;
        let Self { raster, fits, codes, along, radii, items, .. } = self;
        let pixel = |i: usize| raster.number(along[items[i].index as usize]);
        if let Some(positions) = scan.positions.get_mut() {
            fill(positions.to_mut(), |i| items[i].position);
        }
        change_each(scan.arrays.blocks.to_mut(), WIDTH, |number, block| {
            *block = PointBlock::EMPTY;
            for (lane, item) in items[number * WIDTH..].iter().take(WIDTH).enumerate() {
                for k in 0..3 {
                    block.position[k][lane] = item.position[k];
                }
            }
        });
        fill(scan.arrays.source.to_mut(), |i| id32(pixel(i)));
        fill(scan.arrays.radii.to_mut(), |i| radii[items[i].index as usize]);
        fill(scan.arrays.codes.to_mut(), |i| codes[pixel(i)]);
        set_normals(scan, |i| fits[pixel(i)].normal);
    }
}

/// The bounds and the number of the measured points of a frame.
struct Measured {
    bounds: Aabb,
    count: usize,
}

fn measured(points: &[[f64; 3]]) -> Measured {
    const TASK: usize = 1 << 14;
    if points.len() > TASK {
        let (left, right) = points.split_at(points.len() / 2);
        let (mut a, b) = both(|| measured(left), || measured(right));
        if b.count > 0 {
            a.bounds.grow(b.bounds.min);
            a.bounds.grow(b.bounds.max);
        }
        return Measured { bounds: a.bounds, count: a.count + b.count };
    }
    let mut all = Measured { bounds: Aabb::EMPTY, count: 0 };
    for p in points.iter().filter(|p| is_measured(**p)) {
        all.bounds.grow(*p);
        all.count += 1;
    }
    all
}

/// Returns `false` for coordinates that a cloud refuses.
fn is_in_range(bounds: &Aabb) -> bool {
    const MOST: f64 = 1e150;
    (0..3).all(|k| bounds.min[k].abs().max(bounds.max[k].abs()) <= MOST)
}

/// Puts the points into `items` along the curve, the sparse ones last. Returns the number of the
/// others, which fill whole leaves: a remainder of them is moved to the sparse ones. The index of an
/// item is its place along the curve.
fn order(raster: &Raster, fits: &[Fit], along: &[Pixel], items: &mut Vec<Item>, leaf_size: usize) -> usize {
    items.resize(along.len(), Item { position: [0.0; 3], index: 0 });
    fill(items, |i| Item { position: raster.position(along[i]), index: id32(i) });
    let is_sparse = |i: &usize| fits[raster.number(along[*i])].kind().is_sparse();
    let sparse: Vec<usize> =
        ranges(along.len(), |range| range.filter(is_sparse).collect::<Vec<_>>()).concat();
    if sparse.is_empty() {
        return along.len();
    }
    let last: Vec<Item> = sparse.iter().map(|i| items[*i]).collect();
    let mut count = sparse[0];
    for (k, i) in sparse.iter().enumerate() {
        let end = sparse.get(k + 1).map_or(along.len(), |next| *next);
        items.copy_within(i + 1..end, count);
        count += end - (i + 1);
    }
    items[count..].copy_from_slice(&last);
    count - count % leaf_size
}

/// Returns `true` if a leaf is longer than its spacing suggests, as where it has points on both sides
/// of an edge in depth.
fn is_loose(leaf: &[Item], radii: &[f32]) -> bool {
    let (mut low, mut high, mut reach) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3], 0.0_f32);
    for item in leaf {
        for k in 0..3 {
            (low[k], high[k]) = (low[k].min(item.position[k]), high[k].max(item.position[k]));
        }
        reach = reach.max(radii[item.index as usize]);
    }
    let diagonal_sq: f32 = (0..3).map(|k| (high[k] - low[k]).powi(2)).sum();
    diagonal_sq > (LOOSE * reach).powi(2)
}
