//! [`DeformingScan`]: a prepared scan whose points move.

use std::ops::Deref;

use nearmiss_geometry::{Aabb, Frame, PointCloud};
use nearmiss_lanes::parallel::{in_pool_awake, map_all, on_threads};
use nearmiss_store::Workspace;
use nearmiss_surface::Metric;

use crate::scan::anew::fitted_anew;
use crate::scan::build::PointHierarchy;
use crate::scan::deform_error::{DeformError, bounds_of};
use crate::scan::options::{BuildError, BuildOptions};
use crate::scan::ordered::{Aim, Ordered};
use crate::scan::organised::{Pixels, replace_organised};
use crate::scan::points::{Placement, ScanPoints, step};
use crate::scan::refit::{Memory, NextFrame, Refitted, refit};

/// The greatest coordinate in units of the stored frame: beyond it, squares of squares of lengths
/// leave the range of single precision.
const FARTHEST: f64 = (1_u64 << 31) as f64;

/// A prepared scan whose points move, while the order of its points and the nodes over them stay.
///
/// Answers of the scan are about the current frame, and certificates prove them for it: boxes and
/// enclosures always belong to the current points, radii, normals and classes. Those are *carried
/// along* by [`Self::refit`] where the points of a leaf move nearly together, and otherwise fitted
/// anew; [`Self::renew`] fits all of them anew (`docs/theory/moving.md`).
///
/// Dereferences to its [`PointHierarchy`].
///
/// ```
/// use nearmiss_hierarchy::{BuildOptions, DeformingScan};
///
/// let frame = |bend: f64| -> Vec<[f64; 3]> {
///     let lattice = (0..400_u32).map(|i| [f64::from(i % 20), f64::from(i / 20)]);
///     lattice.map(|[x, y]| [x, y, bend * x * x]).collect()
/// };
/// let mut scan = DeformingScan::new(&frame(0.0), &BuildOptions::default())?;
/// let moved = scan.refit(&frame(0.002))?;
/// assert_eq!((moved.carried, moved.fitted), (400, 0));
/// assert!(scan.bounds().max[2] > 0.7);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct DeformingScan {
    scan: PointHierarchy,
    options: BuildOptions,
    /// The number of points of a frame.
    given: usize,
    /// Points that were repeated in the first frame, with those that represent them.
    twins: Vec<[u32; 2]>,
    memory: Memory,
    /// The memory of depth frames.
    pixels: Pixels,
    /// The cost of the boxes when the points were put in order.
    fresh: f64,
}

impl Deref for DeformingScan {
    type Target = PointHierarchy;

    fn deref(&self) -> &PointHierarchy {
        &self.scan
    }
}

impl DeformingScan {
    /// Prepares the first frame. Repeated points are represented by the first of them, and must stay
    /// together.
    ///
    /// # Errors
    /// If a point is not finite, fewer than eight are distinct, or an option is out of range.
    pub fn new(points: &[[f64; 3]], options: &BuildOptions) -> Result<Self, DeformError> {
        let cloud = PointCloud::from_positions(points)?;
        let twins = if cloud.dropped().duplicate > 0 { twins(&cloud, points) } else { Vec::new() };
        let scan = PointHierarchy::build(&cloud, options)?;
        Ok(Self::with(scan, *options, points.len(), twins))
    }

    /// Takes a prepared scan as the first frame. Its reach stays in later frames.
    ///
    /// # Errors
    /// If the scan was prepared from repeated points, or uses distances along a graph.
    pub fn of(scan: PointHierarchy) -> Result<Self, DeformError> {
        if scan.metric() != Metric::Euclidean {
            return Err(DeformError::Graph);
        }
        let dropped = scan.dropped();
        if dropped.duplicate > 0 {
            return Err(DeformError::Repeated { count: dropped.duplicate });
        }
        let options = BuildOptions::default()
            .with_surface(scan.meta.surface)
            .with_radius_neighbours(scan.radius_neighbours())
            .with_leaf_size(scan.leaf_size())
            .with_samples(scan.samples_a_node())
            .with_reach(scan.reach());
        let given = scan.len() + dropped.not_finite + dropped.filtered;
        Ok(Self::with(scan, options, given, Vec::new()))
    }

    fn with(scan: PointHierarchy, options: BuildOptions, given: usize, twins: Vec<[u32; 2]>) -> Self {
        let memory = Memory::at_rest();
        let fresh = cost(&scan);
        Self { scan, options, given, twins, memory, pixels: Pixels::default(), fresh }
    }

    /// Notes that all points have just been put in order and fitted.
    fn settle(&mut self) {
        self.memory.refresh();
        self.fresh = cost(&self.scan);
    }

    /// Moves the points, given in the order of the first frame. O(n log n) on all cores; does not
    /// allocate once warm if no point is fitted anew. A second thread of the pool stays awake until the end.
    ///
    /// The points of a leaf are carried along by the affine map that fits their motion since they were last
    /// fitted: normals turn with it, radii scale with the spacing, classes stay. Where the spacing, or a
    /// length relative to it, changed by more than a quarter, or the motion is not affine, the points of the
    /// leaf are fitted anew. Boxes, enclosures and leaf records are computed from the result. Neighbour
    /// lists are dropped, so that evaluations of f descend instead. The reach and the order of the points
    /// stay, and sphere coverings are infinite until [`Self::renew`].
    ///
    /// # Errors
    /// If the number of points differs from that of the first frame, a coordinate is not finite or
    /// too large, or repeated points are apart. The scan is unchanged then.
    pub fn refit(&mut self, points: &[[f64; 3]]) -> Result<Refitted, DeformError> {
        in_pool_awake(|| {
            let (frame, bounds) = self.check(points)?;
            let placed = NextFrame { points, frame, bounds, step: step(&frame, &bounds) };
            Ok(refit(&mut self.scan, &mut self.memory, &placed))
        })
    }

    /// Moves the points and fits all of them anew: radii, normals, classes and reach. The order of the
    /// points and the nodes stay; so does which points count as dense. Enclosures, neighbour lists and
    /// coverings are as after [`Self::refit`].
    ///
    /// # Errors
    /// As [`Self::refit`], and if the frame cannot be prepared with the options of the first one.
    pub fn renew(&mut self, points: &[[f64; 3]]) -> Result<(), DeformError> {
        in_pool_awake(|| self.renew_here(points))
    }

    /// Does the same, and starts loops from the current thread.
    fn renew_here(&mut self, points: &[[f64; 3]]) -> Result<(), DeformError> {
        let (frame, bounds) = self.check(points)?;
        let source = self.scan.source();
        let positions = map_all(source, |i| frame.to_local(points[*i as usize]));
        let (unit, dense) = (1.0 / frame.scale, self.scan.meta.dense as usize);
        let ordered = Ordered::kept((positions.into(), source.to_vec().into()), dense, &self.options, unit)?;
        let step = step(&frame, &bounds);
        let sides = self.scan.is_oriented().then(|| {
            refit(&mut self.scan, &mut self.memory, &NextFrame { points, frame, bounds, step });
            self.scan.normals().to_vec()
        });
        let placement = Placement { frame, bounds, dropped: self.scan.dropped(), step };
        let before = std::mem::take(&mut self.scan.arrays);
        self.scan = fitted_anew(placement, ordered, &self.options, &mut self.memory.closing, before);
        if let Some(sides) = sides {
            self.scan.turn_normals(&sides);
        }
        self.memory.refresh();
        Ok(())
    }

    /// Moves the points and prepares the scan anew, with another order of the points. Normals are no
    /// longer oriented. The same as [`Self::new`] with the same options.
    ///
    /// # Errors
    /// As [`Self::new`]. The scan is unchanged then.
    pub fn rebuild(&mut self, points: &[[f64; 3]]) -> Result<(), DeformError> {
        *self = Self::new(points, &self.options)?;
        Ok(())
    }

    /// Replaces the scan by another one of other points, with the same options. Points that are not
    /// finite, such as the holes of a depth frame, are dropped. The tree is new; enclosures, neighbour
    /// lists and coverings are as after [`Self::refit`], and [`Self::rebuild`] prepares those too. Up to a
    /// hundredth of sparse points stay among the others ([`Self::misplaced`]).
    ///
    /// # Errors
    /// As [`Self::new`]. The scan is unchanged then.
    pub fn replace(&mut self, points: &[[f64; 3]]) -> Result<(), DeformError> {
        let cloud = PointCloud::cleaned(points)?;
        let twins = if cloud.dropped().duplicate > 0 { twins(&cloud, points) } else { Vec::new() };
        let Self { scan, options, memory, .. } = self;
        options.check()?;
        let replaced = on_threads(options.threads, || {
            let (points, work) = (ScanPoints::from(&cloud), Workspace::in_memory());
            let ordered = Ordered::new(&points, options, Aim::Follow, &work)?;
            let before = std::mem::take(&mut scan.arrays);
            *scan = fitted_anew(points.placement(), ordered, options, &mut memory.closing, before);
            Ok::<_, BuildError>(())
        });
        replaced.or(Err(BuildError::Threads(options.threads)))??;
        (self.given, self.twins) = (points.len(), twins);
        self.settle();
        Ok(())
    }

    /// Replaces the scan by a depth frame: `points` has a place for each pixel, row by row, `width` in
    /// each. Pixels that are not finite or zero, where nothing was measured, are dropped.
    ///
    /// Neighbours are sought among the pixels around each point, and the order of the points follows a
    /// curve through the image. So this takes a small part of the time of [`Self::replace`]. Local
    /// radii are distances of neighbours within two pixels, and normals and classes are fitted to
    /// those within three. Bounds follow from these as after [`Self::refit`]. If one of twenty points
    /// has too few neighbours there, the result is that of [`Self::replace`].
    ///
    /// # Errors
    /// If the number of points is not a multiple of `width`, and as [`Self::new`]. The scan is
    /// unchanged then.
    pub fn replace_organised(&mut self, points: &[[f64; 3]], width: usize) -> Result<(), DeformError> {
        if width == 0 || !points.len().is_multiple_of(width) || u32::try_from(points.len()).is_err() {
            return Err(DeformError::Image { width, got: points.len() });
        }
        let Self { scan, options, memory, pixels, .. } = self;
        options.check()?;
        let replaced = on_threads(options.threads, || {
            in_pool_awake(|| replace_organised(scan, pixels, &mut memory.closing, (points, width), options))
        });
        if !replaced.or(Err(BuildError::Threads(options.threads)))?? {
            let hole = |p: &[f64; 3]| if *p == [0.0; 3] { [f64::NAN; 3] } else { *p };
            return self.replace(&map_all(points, hole));
        }
        (self.given, self.twins) = (points.len(), Vec::new());
        self.settle();
        Ok(())
    }

    /// Returns the cost of the boxes relative to that when the points were last put in order, by
    /// [`Self::new`], [`Self::rebuild`] or a replacement: the sum of the areas of all boxes, in squared
    /// local radii (Goldsmith & Salmon 1987). The greater, the looser the boxes. O(n), a small part of a
    /// refit.
    #[must_use]
    pub fn looseness(&self) -> f64 {
        let looseness = cost(&self.scan) / self.fresh;
        if looseness.is_finite() { looseness } else { 1.0 }
    }

    /// Returns the share of points whose class does not suit their place in the order: sparse points
    /// among the dense, and points on sheets after them, which are balls in the obstacle. Only
    /// [`Self::rebuild`] changes their places.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "counts below 2^32 are exact")]
    pub fn misplaced(&self) -> f64 {
        let (dense, leaf_size) = (self.scan.meta.dense as usize, self.scan.leaf_size() as usize);
        let is_misplaced = |i: usize| {
            let kind = self.scan.kind(i);
            if i < dense { kind.is_sparse() } else { kind.is_sheet() }
        };
        let count = (0..self.scan.len()).filter(|&i| is_misplaced(i)).count();
        // Less than a leaf of dense points is left over among the sparse ones in any order.
        count.saturating_sub(leaf_size) as f64 / self.scan.len() as f64
    }

    /// Checks the points of a frame, and returns the frame of their stored positions and their
    /// bounds.
    fn check(&self, points: &[[f64; 3]]) -> Result<(Frame, Aabb), DeformError> {
        if points.len() != self.given {
            return Err(DeformError::Count { what: "points", expected: self.given, got: points.len() });
        }
        let bounds = bounds_of("point", points)?;
        // Lengths are stored in the unit of the first frame.
        let scale = self.scan.frame().scale;
        let frame = Frame { scale, ..Frame::around(bounds.min, bounds.max) };
        let far =
            |k: usize| (bounds.min[k] - frame.origin[k]).abs().max((bounds.max[k] - frame.origin[k]).abs());
        let got = (0..3).map(far).fold(0.0, f64::max);
        let limit = FARTHEST * scale;
        if got > limit || !got.is_finite() {
            return Err(DeformError::TooFar { limit, got });
        }
        let apart = |[i, twin]: &&[u32; 2]| {
            frame.to_local(points[*i as usize]) != frame.to_local(points[*twin as usize])
        };
        if let Some(&[index, twin]) = self.twins.iter().find(apart) {
            let (p, q) = (points[index as usize], points[twin as usize]);
            let distance = (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt();
            return Err(DeformError::Apart { index, twin, distance });
        }
        // The bounds of the rounded positions are the rounded bounds, because rounding is monotonic.
        let stored = |p: [f64; 3]| frame.to_world(frame.to_local(p));
        Ok((frame, Aabb { min: stored(bounds.min), max: stored(bounds.max) }))
    }
}

/// Returns the areas of all boxes, in squared local radii.
fn cost(scan: &PointHierarchy) -> f64 {
    scan.tree().area() / scan.radii().iter().map(|r| f64::from(r * r)).sum::<f64>()
}

/// Returns the points that a cloud dropped because they repeat others, with these others.
fn twins(cloud: &PointCloud, points: &[[f64; 3]]) -> Vec<[u32; 2]> {
    let key = |p: [f32; 3]| p.map(f32::to_bits);
    let mut kept: Vec<_> = cloud.positions().iter().zip(cloud.source()).map(|(p, i)| (key(*p), *i)).collect();
    kept.sort_unstable();
    let mut sources = cloud.source().iter().peekable();
    let dropped = (0_u32..).zip(points).filter(|(i, _)| sources.next_if(|next| *next == i).is_none());
    let twin = |(i, p): (u32, &[f64; 3])| {
        let p = key(cloud.frame().to_local(*p));
        let place = kept.binary_search_by_key(&p, |(position, _)| *position).ok()?;
        Some([i, kept[place].1])
    };
    dropped.filter_map(twin).collect()
}
