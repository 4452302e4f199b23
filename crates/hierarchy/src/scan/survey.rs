//! Spacing, borders and holes of a scan, from a sample of its points.

use std::f64::consts::TAU;
use std::ops::Range;

use fearless_simd::Level;
use nearmiss_geometry::NodeId;
use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_index::{BlockBoxes, BlockTree, Nearest, PointBlock};
use nearmiss_lanes::parallel::chunks;

use crate::scan::build::PointHierarchy;

const WIDTH: usize = PointBlock::WIDTH;

/// At most so many blocks of points on sheets are sampled, and half as many of other points.
const BLOCKS: usize = 128;

/// The spacing is the distance to the neighbour of this rank.
const RANK: usize = 6;

/// A point is an outlier if so many of its nearest six lie on sheets and are this many times denser,
/// and its spacing exceeds the reach.
const OUTLIER: usize = 2;
const DENSER: f64 = 4.0;

/// Neighbours about a point that show a border. Of 24 random directions in a plane, one in ten
/// thousand leaves a sector of 150° empty.
const RING: usize = 24;

/// A border leaves at least this sector of the tangent plane empty, 150°, ...
const BORDER: f64 = TAU * 150.0 / 360.0;

/// ... and no second one of more than 100°: between two is a line.
const LINE: f64 = TAU * 100.0 / 360.0;

/// A hole is looked for no further than this, in reaches.
const FAR: f64 = 20.0;

/// The cosine of the angle about the outward direction in which the far side of a hole is looked
/// for: 25°.
const CONE: f64 = 0.906;

/// The far side of a hole has a normal within the angle of this cosine of that of the near side,
/// and its height over the near side's tangent plane is at most this share of the width.
const PARALLEL: f64 = 0.9;
const LEVEL: f64 = 0.15;

/// What a sample of a scan's points shows. Lengths are in the caller's units.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Survey {
    /// Distance of each sampled point but outliers to its sixth neighbour, ascending, and the share
    /// of all points it stands for.
    pub spacings: Vec<(f64, f64)>,
    /// Estimated share of the points that lie on no sheet and have much denser points as neighbours.
    pub outliers: f64,
    /// Estimated share of the points that lie at a border of a sheet.
    pub border: f64,
    /// The share of all points that each sampled border point stands for.
    pub border_weight: f64,
    /// Widths of the holes wider than the reach that sampled border points face across their sheet,
    /// ascending.
    pub holes: Vec<f64>,
}

/// What one block shows.
#[derive(Default)]
struct Seen {
    count: usize,
    outliers: usize,
    spacings: Vec<f64>,
    border: usize,
    holes: Vec<f64>,
}

impl PointHierarchy {
    /// Looks at up to 3,072 points. The same `seed` chooses the same points, whatever the thread
    /// count.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "counts")]
    pub fn survey(&self, seed: u64) -> Survey {
        let slices = self.slices();
        let boxes = BlockBoxes::new(slices.blocks, self.len());
        let tree = boxes.over(slices.blocks);
        let mut survey = Survey::default();
        let parts = [(0..slices.dense, BLOCKS), (slices.dense..self.len(), BLOCKS / 2)];
        for (points, most) in parts {
            if points.is_empty() {
                continue;
            }
            let blocks = sample(points.clone(), most, seed);
            let seen = chunks(&blocks, |blocks| {
                let mut found = Nearest::default();
                blocks.iter().map(|&block| self.look(&tree, block, &points, &mut found)).collect::<Vec<_>>()
            });
            let seen: Vec<Seen> = seen.into_iter().flatten().collect();
            let count: usize = seen.iter().map(|seen| seen.count).sum();
            let weight = points.len() as f64 / self.len() as f64 / count.max(1) as f64;
            survey.outliers += weight * seen.iter().map(|seen| seen.outliers as f64).sum::<f64>();
            let border: usize = seen.iter().map(|seen| seen.border).sum();
            if border > 0 {
                (survey.border, survey.border_weight) = (weight * border as f64, weight);
            }
            for seen in seen {
                survey.spacings.extend(seen.spacings.into_iter().map(|spacing| (spacing, weight)));
                survey.holes.extend(seen.holes);
            }
        }
        survey.spacings.sort_by(|a, b| a.0.total_cmp(&b.0));
        survey.holes.sort_by(f64::total_cmp);
        survey
    }

    /// Looks at those points of a block that are among `points`.
    fn look(&self, tree: &BlockTree<'_>, block: usize, points: &Range<usize>, found: &mut Nearest) -> Seen {
        let slices = self.slices();
        let count = RING.min(self.len() - 1);
        tree.nearest(Level::new(), block, count, found);
        let mut seen = Seen::default();
        let first = block * WIDTH;
        for i in (first..first + WIDTH).filter(|i| points.contains(i)) {
            let near = found.ranked(i % WIDTH, RANK.min(count) - 1);
            let spacing = near.map_or(0.0, |near| f64::from(near.distance_sq).sqrt());
            seen.count += 1;
            let is_outlier = i >= slices.dense && spacing > f64::from(slices.reach) && {
                let near = found.of(i % WIDTH).take(RANK).map(|near| near.id as usize);
                // The radii of other points are limited by the reach.
                let is_denser = |j: usize| j < slices.dense && DENSER * f64::from(slices.radii[j]) < spacing;
                let denser = near.filter(|&j| is_denser(j));
                denser.count() >= OUTLIER
            };
            if is_outlier {
                seen.outliers += 1;
            } else {
                seen.spacings.push(spacing * self.frame().scale);
            }
            if slices.is_on_sheet(i) {
                let ids = found.of(i % WIDTH).map(|near| near.id as usize);
                if let Some(outward) = self.outward(i, ids) {
                    seen.border += 1;
                    seen.holes.extend(self.hole(i, outward).map(|width| width * self.frame().scale));
                }
            }
        }
        seen
    }

    fn place(&self, i: usize) -> Vector3<f64> {
        self.positions()[i].map(f64::from).into()
    }

    fn normal(&self, i: usize) -> Vector3<f64> {
        self.normals()[i].map(f64::from).into()
    }

    /// The direction in the tangent plane of point `i` in which its sheet ends, if it ends there.
    fn outward(&self, i: usize, near: impl Iterator<Item = usize>) -> Option<Vector3<f64>> {
        let (p, normal) = (self.place(i), self.normal(i));
        let least = normal.iamin();
        let axis = Vector3::from_fn(|k, _| if k == least { 1.0 } else { 0.0 });
        let u = normal.cross(&axis).try_normalize(0.0)?;
        let v = normal.cross(&u);
        let mut angles: Vec<f64> = near
            .map(|j| self.place(j) - p)
            .map(|d| [u.dot(&d), v.dot(&d)])
            .filter(|d| d[0] != 0.0 || d[1] != 0.0)
            .map(|[x, y]| y.atan2(x))
            .collect();
        angles.sort_by(f64::total_cmp);
        let next = angles.iter().cycle().skip(1);
        let mut sectors: Vec<(f64, f64)> =
            angles.iter().zip(next).map(|(from, to)| ((to - from).rem_euclid(TAU), *from)).collect();
        sectors.sort_by(|a, b| b.0.total_cmp(&a.0));
        let (&(widest, from), &(second, _)) = (sectors.first()?, sectors.get(1)?);
        let middle = from + 0.5 * widest;
        (widest >= BORDER && second <= LINE).then(|| u * middle.cos() + v * middle.sin())
    }

    /// The width of the hole that point `i` faces `outward`, if another part of the same plane is
    /// beyond it: more than the reach. Stored units.
    fn hole(&self, i: usize, outward: Vector3<f64>) -> Option<f64> {
        let slices = self.slices();
        let (p, normal) = (self.place(i), self.normal(i));
        let reach = f64::from(slices.reach);
        let (mut best, mut far_side) = (FAR * reach, None);
        let mut open = vec![NodeId::ROOT];
        let topology = slices.tree.topology;
        while let Some(id) = open.pop() {
            let (points, bounds) = (topology.points(id), slices.tree.bounds(id));
            let radius = f64::from(bounds.radius());
            let d = Vector3::from(bounds.centre.map(f64::from)) - p;
            let along = outward.dot(&d);
            // A sphere misses the cone if it does so in the plane through the axis and its centre.
            let beside = (d.norm_squared() - along * along).max(0.0).sqrt();
            let sine = (1.0 - CONE * CONE).sqrt();
            if points.start >= slices.dense
                || d.norm() - radius > best
                || beside * CONE - along * sine > radius
            {
                continue;
            }
            if !topology.is_leaf(id) {
                open.extend(topology.children(id).iter());
                continue;
            }
            for j in points.start..points.end.min(slices.dense) {
                let d = self.place(j) - p;
                let width = d.norm();
                if width < best && width > 0.0 && outward.dot(&d) > CONE * width {
                    (best, far_side) = (width, Some(j));
                }
            }
        }
        let j = far_side?;
        let height = normal.dot(&(self.place(j) - p)).abs();
        let is_same = normal.dot(&self.normal(j)).abs() > PARALLEL && height < LEVEL * best;
        (is_same && best > reach).then_some(best)
    }
}

/// Blocks of `points`, spread evenly: one of each of up to `most` equal runs.
fn sample(points: Range<usize>, most: usize, seed: u64) -> Vec<usize> {
    let blocks = points.start / WIDTH..points.end.div_ceil(WIDTH);
    let count = most.min(blocks.len());
    let chosen = |run: usize| {
        let run_of = |run: usize| blocks.start + run * blocks.len() / count;
        let (from, to) = (run_of(run), run_of(run + 1));
        #[expect(clippy::cast_possible_truncation, reason = "a remainder")]
        let offset = (mixed(seed ^ run as u64) % (to - from) as u64) as usize;
        from + offset
    };
    (0..count).map(chosen).collect()
}

/// The finaliser of `SplitMix64`.
fn mixed(x: u64) -> u64 {
    let x = x.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    x ^ (x >> 31)
}
