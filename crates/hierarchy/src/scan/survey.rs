//! Spacing, borders and holes of a scan, estimated from a sample of its points.

use std::f64::consts::TAU;
use std::ops::{ControlFlow, Range};

use fearless_simd::{Level, Simd};
use nearmiss_geometry::NodeId;
use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_index::PointBlock;
use nearmiss_lanes::parallel::chunks;
use nearmiss_surface::symmetric_eigen;

use crate::descent::PlaceVisitor;
use crate::scan::build::PointHierarchy;

const WIDTH: usize = PointBlock::WIDTH;

/// The maximum number of sampled blocks of points on sheets. For other points it is half of this.
const BLOCKS: usize = 128;

/// The rank of the neighbour whose distance is the spacing.
const RANK: usize = 6;

/// A point is an outlier if its spacing exceeds the reach and at least this many of its six nearest
/// neighbours are on sheets and [`DENSER`] times denser, or if it is in no plane or line with its neighbours.
const OUTLIER: usize = 2;
const DENSER: f64 = 4.0;

/// The number of neighbours that show a plane.
const PLANE: usize = 12;

/// Points are in no plane if their least variance exceeds this share of the next one, and in no line if that
/// exceeds the same share of the greatest. Twelve points at random in a ball have about a half.
const FLAT: f64 = 0.1;

/// The number of neighbours that show a border. Of 24 random directions in a plane, one in ten
/// thousand leaves a sector of 150° empty.
const RING: usize = 24;

/// A border leaves at least this sector of the tangent plane empty, 150°, ...
const BORDER: f64 = TAU * 150.0 / 360.0;

/// ... and no second one of more than 100°: between two such sectors is a line.
const LINE: f64 = TAU * 100.0 / 360.0;

/// The maximum width of a hole that is searched for, in reaches.
const FAR: f64 = 20.0;

/// The cosine of the angle around the outward direction in which the far side of a hole is searched
/// for: 25°.
const CONE: f64 = 0.906;

/// The normals on both sides of a hole differ by at most the angle with this cosine. The height of
/// the far side over the tangent plane of the near side is at most this share of the width.
const PARALLEL: f64 = 0.9;
const LEVEL: f64 = 0.15;

/// Estimates from a sample of a scan's points. Lengths are in the caller's units.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SamplingSurvey {
    /// The distance of each sampled point except outliers to its sixth neighbour, ascending, and
    /// the share of all points that it represents.
    pub spacings: Vec<(f64, f64)>,
    /// The estimated share of points that are on no sheet, and have much denser points as neighbours or are
    /// in no plane and no line with them.
    pub outliers: f64,
    /// The estimated share of points at a border of a sheet.
    pub border: f64,
    /// The share of all points that each sampled border point represents.
    pub border_weight: f64,
    /// The widths of holes wider than the reach that sampled border points face across their sheet,
    /// ascending.
    pub holes: Vec<f64>,
}

/// The counts of one block.
#[derive(Default)]
struct Seen {
    count: usize,
    outliers: usize,
    spacings: Vec<f64>,
    border: usize,
    holes: Vec<f64>,
}

impl PointHierarchy {
    /// Samples up to 3,072 points. The same `seed` chooses the same points, whatever the number of
    /// threads.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "counts")]
    pub fn survey(&self, seed: u64) -> SamplingSurvey {
        let arrays = self.arrays();
        let mut survey = SamplingSurvey::default();
        let parts = [(0..arrays.dense, BLOCKS), (arrays.dense..self.len(), BLOCKS / 2)];
        for (points, most) in parts {
            if points.is_empty() {
                continue;
            }
            let blocks = sample(points.clone(), most, seed);
            let seen = chunks(&blocks, |blocks| {
                blocks.iter().map(|&block| self.look(block, &points)).collect::<Vec<_>>()
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

    /// Surveys the points of a block that are among `points`.
    fn look(&self, block: usize, points: &Range<usize>) -> Seen {
        let arrays = self.arrays();
        let mut ring = Ring::of(self);
        let mut seen = Seen::default();
        let first = block * WIDTH;
        for i in (first..first + WIDTH).filter(|i| points.contains(i)) {
            ring.gather(i);
            let near = ring.near.get(RANK.min(ring.count) - 1);
            let spacing = near.map_or(0.0, |(distance_sq, _)| f64::from(*distance_sq).sqrt());
            seen.count += 1;
            let is_outlier = i >= arrays.dense && spacing > f64::from(arrays.reach) && {
                let near = ring.ids().take(RANK);
                // The radii of other points are limited by the reach.
                let is_denser = |j: usize| j < arrays.dense && DENSER * f64::from(arrays.radii[j]) < spacing;
                let denser = near.filter(|&j| is_denser(j));
                denser.count() >= OUTLIER || self.is_scattered(i, ring.ids().take(PLANE))
            };
            if is_outlier {
                seen.outliers += 1;
            } else {
                seen.spacings.push(spacing * self.frame().scale);
            }
            if arrays.is_on_sheet(i)
                && let Some(outward) = self.outward(i, ring.ids())
            {
                seen.border += 1;
                seen.holes.extend(self.hole(i, outward).map(|width| width * self.frame().scale));
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

    /// Returns `true` if a point is in no plane and in no line with its neighbours.
    fn is_scattered(&self, i: usize, near: impl Iterator<Item = usize>) -> bool {
        let (mut count, mut sum, mut products) = (0.0, Vector3::zeros(), [0.0; 6]);
        for j in near.chain([i]) {
            let d = self.place(j) - self.place(i);
            (count, sum) = (count + 1.0, sum + d);
            let own = [d.x * d.x, d.x * d.y, d.x * d.z, d.y * d.y, d.y * d.z, d.z * d.z];
            products = [0, 1, 2, 3, 4, 5].map(|k| products[k] + own[k]);
        }
        let m: Vector3<f64> = sum / count;
        let of_mean = [m.x * m.x, m.x * m.y, m.x * m.z, m.y * m.y, m.y * m.z, m.z * m.z];
        let covariance = [0, 1, 2, 3, 4, 5].map(|k| products[k] / count - of_mean[k]);
        let [least, next, most] = symmetric_eigen(covariance).values;
        least > FLAT * next && next > FLAT * most
    }

    /// Returns the direction in the tangent plane of point `i` in which its sheet ends, if it ends
    /// there.
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

    /// Returns the width of the hole that point `i` faces `outward`, in stored units, if it is
    /// wider than the reach and another part of the same plane is beyond it.
    fn hole(&self, i: usize, outward: Vector3<f64>) -> Option<f64> {
        let arrays = self.arrays();
        let (p, normal) = (self.place(i), self.normal(i));
        let reach = f64::from(arrays.reach);
        let (mut best, mut far_side) = (FAR * reach, None);
        let mut open = vec![NodeId::ROOT];
        let topology = arrays.tree.topology;
        while let Some(id) = open.pop() {
            let (points, bounds) = (topology.points(id), arrays.tree.bounds(id));
            let radius = f64::from(bounds.radius());
            let d = Vector3::from(bounds.centre.map(f64::from)) - p;
            let along = outward.dot(&d);
            // A sphere misses the cone if it does so in the plane through the axis and its centre.
            let beside = (d.norm_squared() - along * along).max(0.0).sqrt();
            let sine = (1.0 - CONE * CONE).sqrt();
            if points.start >= arrays.dense
                || d.norm() - radius > best
                || beside * CONE - along * sine > radius
            {
                continue;
            }
            if !topology.is_leaf(id) {
                open.extend(topology.children(id).iter());
                continue;
            }
            for j in points.start..points.end.min(arrays.dense) {
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

/// The nearest neighbours of a point.
struct Ring<'a> {
    scan: &'a PointHierarchy,
    /// The number of neighbours wanted.
    count: usize,
    /// The point, and its position.
    centre: usize,
    place: [f32; 3],
    /// Squared distances and indices, ascending.
    near: Vec<(f32, usize)>,
}

impl<'a> Ring<'a> {
    fn of(scan: &'a PointHierarchy) -> Self {
        let count = RING.min(scan.len() - 1);
        Self { scan, count, centre: 0, place: [0.0; 3], near: Vec::with_capacity(count + 1) }
    }

    /// Finds the neighbours of the `i`-th point.
    fn gather(&mut self, i: usize) {
        self.near.clear();
        (self.centre, self.place) = (i, self.scan.positions()[i]);
        let _all = self.scan.tree().descend_to(Level::new(), self.place, self);
    }

    fn ids(&self) -> impl Iterator<Item = usize> {
        self.near.iter().map(|(_, id)| *id)
    }
}

impl PlaceVisitor for Ring<'_> {
    fn most_sq(&self) -> f32 {
        /// Allowance for the rounding of a distance to a box.
        const ROUNDED: f32 = 1.0 + 1e-5;
        if self.near.len() < self.count { f32::INFINITY } else { self.near[self.count - 1].0 * ROUNDED }
    }

    fn leaf<S: Simd>(&mut self, _: S, number: usize) -> ControlFlow<()> {
        for j in self.scan.topology().points_of_leaf(number).filter(|j| *j != self.centre) {
            let p = self.scan.positions()[j];
            let distance_sq: f32 = (0..3).map(|k| (p[k] - self.place[k]).powi(2)).sum();
            let found = (distance_sq, j);
            let place = self.near.partition_point(|other| *other < found);
            if place < self.count {
                self.near.insert(place, found);
                self.near.truncate(self.count);
            }
        }
        ControlFlow::Continue(())
    }
}

/// Returns evenly spread blocks of `points`: one of each of up to `most` equal runs.
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
