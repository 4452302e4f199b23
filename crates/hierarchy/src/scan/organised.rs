//! Replaces a scan by a depth frame: neighbours are sought among the pixels around each point, and
//! the order of the points follows a curve through the image (`docs/theory/moving.md`).

use nearmiss_geometry::{Aabb, CloudError, Dropped, Frame};
use nearmiss_index::PointBlock;
use nearmiss_lanes::id32;
use nearmiss_lanes::parallel::{both, change_each, fill, ranges};
use nearmiss_surface::SurfacePlan;

use crate::patch::alignment::align_leaves;
use crate::patch::pixels::{find_borders, fit, vote};
use crate::patch::surfels::Fit;
use crate::point::disc::PointCode;
use crate::point::kind::PointKind;
use crate::point::raster::{MOST_NEIGHBOURS, MOST_PIXELS, Pixel, Raster, is_measured, limited};
use crate::scan::anew::resize;
use crate::scan::build::PointHierarchy;
use crate::scan::closing::Closing;
use crate::scan::deform_error::DeformError;
use crate::scan::options::{BuildError, BuildOptions};
use crate::scan::points::step;
use crate::scan::refit::LEAST_RADIUS;
use crate::scan::sampling::{Selection, check_reach, reach_of};
use crate::tree::items::Item;
use crate::tree::split::split_loose;
use crate::tree::topology::Topology;

/// The share of points without K neighbours among the pixels around from which pixels do not tell
/// neighbours.
const ALONE: f64 = 0.05;

/// The size of the box around a leaf, in the greatest radius of its points, from which it is loose:
/// twice the diagonal of a leaf of four by four pixels.
const LOOSE: f32 = 6.0;

/// The number of points that a thread takes at once.
const AT_ONCE: usize = 1 << 12;

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
    selection: Selection,
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
    let alone = pixels.raster.space(options.radius_neighbours as usize);
    #[expect(clippy::cast_precision_loss, reason = "counts below 2^32 are exact")]
    if alone as f64 > ALONE * count as f64 {
        return Ok(false);
    }
    pixels.along = pixels.raster.measured();
    let Pixels { raster, fits, codes, along, radii, items, selection } = pixels;
    radii.resize(count, 0.0);
    fill(radii, |i| raster.radius(along[i]));
    let (unit, ordinary) = (1.0 / frame.scale, selection.of(radii));
    let reach = reach_of(options, ordinary, unit);
    let far =
        (0..3).map(|k| (bounds.min[k] - frame.origin[k]).abs().max((bounds.max[k] - frame.origin[k]).abs()));
    #[expect(clippy::cast_possible_truncation, reason = "as stored")]
    check_reach(reach, (far.fold(0.0, f64::max) * unit) as f32, unit)?;
    let plan =
        SurfacePlan::new(&options.surface, f64::from(ordinary.min(reach)), unit).map_err(BuildError::from)?;
    let limits = LEAST_RADIUS..=reach;
    raster.support(&limits, |radius| plan.support_radius(radius), |support| plan.decay(support));
    fits.resize(points.len(), Fit::default());
    codes.resize(points.len(), PointCode::new(PointKind::Stray, 0));
    fit(raster, &plan, reach, fits);
    vote(raster, fits);
    find_borders(raster, fits, codes);
    change_each(radii, AT_ONCE, |_, radius| *radius = limited(*radius, &limits));
    let topology = Topology::new(id32(count), options.leaf_size);
    let dense = order(raster, codes, along, items, options.leaf_size as usize);
    split_loose(items, &topology, dense, &|leaf: &[Item]| is_loose(leaf, radii));
    resize(scan, topology);
    let meta = &mut scan.meta;
    let stored = |p: [f64; 3]| frame.to_world(frame.to_local(p));
    meta.bounds = Aabb { min: stored(bounds.min), max: stored(bounds.max) };
    (meta.frame, meta.step, meta.reach, meta.dense) = (frame, step(&frame, &bounds), reach, id32(dense));
    meta.dropped = Dropped { not_finite: points.len() - count, duplicate: 0, filtered: 0 };
    meta.is_oriented = false;
    pixels.fill(scan);
    closing.spread(scan);
    closing.support(scan);
    closing.bound(scan);
    Ok(true)
}

impl Pixels {
    /// Sets the arrays of the points of a scan.
    fn fill(&self, scan: &mut PointHierarchy) {
        let (arrays, leaf_size) = (&mut scan.arrays, scan.topology.leaf_size());
        let Some(positions) = scan.positions.get_mut() else { return };
        let points = Points {
            positions: positions.to_mut(),
            blocks: arrays.blocks.to_mut(),
            source: arrays.source.to_mut(),
            radii: arrays.radii.to_mut(),
            codes: arrays.codes.to_mut(),
            normals: arrays.normals.to_mut(),
        };
        points.fill(0, self);
        align_leaves(arrays.normals.to_mut(), leaf_size);
    }
}

/// The arrays of some points, from the first point of a block on.
struct Points<'a> {
    positions: &'a mut [[f32; 3]],
    blocks: &'a mut [PointBlock],
    source: &'a mut [u32],
    radii: &'a mut [f32],
    codes: &'a mut [PointCode],
    normals: &'a mut [[f32; 3]],
}

impl Points<'_> {
    /// Divides the points at the start of a block.
    fn split_at(self, block: usize) -> [Self; 2] {
        let first = block * PointBlock::WIDTH;
        let (positions, blocks) = (self.positions.split_at_mut(first), self.blocks.split_at_mut(block));
        let (source, radii) = (self.source.split_at_mut(first), self.radii.split_at_mut(first));
        let (codes, normals) = (self.codes.split_at_mut(first), self.normals.split_at_mut(first));
        [
            Self {
                positions: positions.0,
                blocks: blocks.0,
                source: source.0,
                radii: radii.0,
                codes: codes.0,
                normals: normals.0,
            },
            Self {
                positions: positions.1,
                blocks: blocks.1,
                source: source.1,
                radii: radii.1,
                codes: codes.1,
                normals: normals.1,
            },
        ]
    }

    /// Sets the points, of which `first` are before the first one.
    fn fill(self, first: usize, pixels: &Pixels) {
        if self.positions.len() > AT_ONCE {
            let middle = self.blocks.len() / 2;
            let [left, right] = self.split_at(middle);
            both(|| left.fill(first, pixels), || right.fill(first + middle * PointBlock::WIDTH, pixels));
            return;
        }
        let Pixels { raster, fits, codes, along, radii, items, .. } = pixels;
        self.blocks.fill(PointBlock::EMPTY);
        for (i, item) in items[first..][..self.positions.len()].iter().enumerate() {
            let pixel = raster.number(along[item.index as usize]);
            let (block, lane) = (&mut self.blocks[i / PointBlock::WIDTH], i % PointBlock::WIDTH);
            for k in 0..3 {
                block.position[k][lane] = item.position[k];
            }
            self.positions[i] = item.position;
            self.source[i] = id32(pixel);
            self.radii[i] = radii[item.index as usize];
            self.codes[i] = codes[pixel];
            self.normals[i] = fits[pixel].normal;
        }
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
    let (mut bounds, mut count) = (Aabb::EMPTY, 0);
    for p in points {
        // No branch: holes come anywhere.
        let is_there = is_measured(*p);
        count += usize::from(is_there);
        for k in 0..3 {
            let [low, high] = if is_there { [p[k]; 2] } else { [f64::INFINITY, f64::NEG_INFINITY] };
            bounds.min[k] = if low < bounds.min[k] { low } else { bounds.min[k] };
            bounds.max[k] = if high > bounds.max[k] { high } else { bounds.max[k] };
        }
    }
    Measured { bounds, count }
}

/// Returns `false` for coordinates that a cloud refuses.
fn is_in_range(bounds: &Aabb) -> bool {
    const MOST: f64 = 1e150;
    (0..3).all(|k| bounds.min[k].abs().max(bounds.max[k].abs()) <= MOST)
}

/// Puts the points into `items` along the curve, the sparse ones last. Returns the number of the
/// others, which fill whole leaves: a remainder of them is moved to the sparse ones. The index of an
/// item is its place along the curve.
fn order(
    raster: &Raster,
    codes: &[PointCode],
    along: &[Pixel],
    items: &mut Vec<Item>,
    leaf_size: usize,
) -> usize {
    items.resize(along.len(), Item { position: [0.0; 3], index: 0 });
    fill(items, |i| Item { position: raster.position(along[i]), index: id32(i) });
    let is_sparse = |i: &usize| codes[raster.number(along[*i])].kind().is_sparse();
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
