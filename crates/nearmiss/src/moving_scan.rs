//! `MovingScan`: a scan that deforms while it is asked.

use std::ops::Deref;

use nearmiss_geometry::Pose;
use nearmiss_hierarchy::{BuildOptions, DeformError, DeformingScan, PointHierarchy, Refitted};
use nearmiss_query::{Placed, Prepared};

use crate::moving_mesh::Renewal;
use crate::scan::Scan;

/// The looseness of refitted boxes from which a scan is prepared anew (docs/theory/moving.md).
const LOOSE: f64 = 2.0;

/// The share of misplaced points from which a scan is prepared anew.
const MISPLACED: f64 = 0.05;

/// The share of points fitted anew by a refit from which all others are fitted anew too.
const MOST_FITTED: f64 = 0.5;

/// A scan whose points move from frame to frame, or are replaced by those of another frame.
///
/// Every question that a still scan answers is answered about the current frame. A certificate is a
/// proof for that frame. Hints of another frame are ignored. Dereferences to its [`DeformingScan`].
///
/// ```
/// use nearmiss::{BuildOptions, CollideOptions, CollidePlan, MovingScan, Pair, Pose, Scratch};
///
/// // A sheet that dents until it touches the one below.
/// let frame = |dent: f64| -> Vec<[f64; 3]> {
///     let lattice = (0..900_u32).map(|i| [f64::from(i % 30) - 15.0, f64::from(i / 30) - 15.0]);
///     lattice.map(|[x, y]| [x, y, -dent * (-0.02 * (x * x + y * y)).exp()]).collect()
/// };
/// let below = MovingScan::new(&frame(0.0), &BuildOptions::default())?;
/// let mut moving = MovingScan::new(&frame(0.0), &BuildOptions::default())?;
/// let above = Pose::from_translation([0.2, 0.3, 8.0]);
/// let mut scratch = Scratch::default();
/// for (dent, meets) in [(0.0, false), (3.0, false), (6.0, false), (9.0, true)] {
///     moving.move_to(&frame(dent))?;
///     let plan = CollidePlan::new(&CollideOptions::default(), &moving, &below)?;
///     let pair = Pair::new(moving.at(&above), below.at(&Pose::IDENTITY));
///     assert_eq!(pair.collide(&plan, &mut scratch).verdict.is_intersecting(), meets);
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// A move runs on the threads of the current rayon pool. Called from one of these, it wakes only the others:
/// see the guide to moving scans.
#[derive(Debug, Clone)]
pub struct MovingScan {
    scan: DeformingScan,
}

impl Deref for MovingScan {
    type Target = DeformingScan;

    fn deref(&self) -> &DeformingScan {
        &self.scan
    }
}

impl TryFrom<Scan> for MovingScan {
    type Error = DeformError;

    /// Takes a prepared scan as the first frame. Its reach stays in later frames.
    ///
    /// # Errors
    /// [`DeformError::Graph`] if the scan has a graph, [`DeformError::Repeated`] if it was prepared
    /// from repeated points.
    fn try_from(scan: Scan) -> Result<Self, DeformError> {
        if scan.graph().is_some() {
            return Err(DeformError::Graph);
        }
        Ok(Self { scan: DeformingScan::of(scan.into_hierarchy())? })
    }
}

impl MovingScan {
    /// Prepares the first frame.
    ///
    /// # Errors
    /// As [`DeformingScan::new`].
    pub fn new(points: &[[f64; 3]], options: &BuildOptions) -> Result<Self, DeformError> {
        Ok(Self { scan: DeformingScan::new(points, options)? })
    }

    /// Moves the points, given in the order of the first frame, at the least cost that keeps queries
    /// fast: by a [refit](DeformingScan::refit); if that fitted more than half of the points anew, by
    /// a [renewal](DeformingScan::renew); and if boxes have become loose, or points that no longer
    /// sample a surface are among those that do, by preparing the scan anew. A frame that cannot be
    /// prepared, such as one with all points in one place, stays refitted.
    ///
    /// # Errors
    /// As [`DeformingScan::refit`]. The scan is unchanged then.
    #[expect(clippy::cast_precision_loss, reason = "counts below 2^32 are exact")]
    pub fn move_to(&mut self, points: &[[f64; 3]]) -> Result<Renewal, DeformError> {
        let fitted = self.scan.refit(points)?.fitted;
        let mut done = Renewal::Refitted;
        if fitted as f64 > MOST_FITTED * self.scan.len() as f64 {
            done = self.scan.renew(points).map_or(done, |()| Renewal::Renewed);
        }
        if self.scan.looseness() > LOOSE || self.scan.misplaced() > MISPLACED {
            done = self.scan.rebuild(points).map_or(done, |()| Renewal::Rebuilt);
        }
        Ok(done)
    }

    /// Moves the points and carries discs along where they move nearly together.
    ///
    /// # Errors
    /// As [`DeformingScan::refit`].
    pub fn refit(&mut self, points: &[[f64; 3]]) -> Result<Refitted, DeformError> {
        self.scan.refit(points)
    }

    /// Moves the points and fits all of them anew.
    ///
    /// # Errors
    /// As [`DeformingScan::renew`].
    pub fn renew(&mut self, points: &[[f64; 3]]) -> Result<(), DeformError> {
        self.scan.renew(points)
    }

    /// Moves the points and prepares the scan anew.
    ///
    /// # Errors
    /// As [`DeformingScan::rebuild`].
    pub fn rebuild(&mut self, points: &[[f64; 3]]) -> Result<(), DeformError> {
        self.scan.rebuild(points)
    }

    /// Replaces the scan by one of other points, such as the next frame of a depth camera.
    ///
    /// # Errors
    /// As [`DeformingScan::replace`].
    pub fn replace(&mut self, points: &[[f64; 3]]) -> Result<(), DeformError> {
        self.scan.replace(points)
    }

    /// Replaces the scan by an organised depth frame: a point for each pixel, row by row, `width` in
    /// each, with NaN or zero where nothing was measured.
    ///
    /// ```
    /// use nearmiss::{BuildOptions, MovingScan};
    ///
    /// // A camera looks at a wall, two units away and slowly nearer.
    /// let frame = |time: f64| -> Vec<[f64; 3]> {
    ///     let pixels = (0..64 * 48_u32).map(|i| [f64::from(i % 64) - 32.0, f64::from(i / 64) - 24.0]);
    ///     let depth = 2.0 - 0.1 * time;
    ///     let place = |[u, v]: [f64; 2]| [u * depth / 60.0, v * depth / 60.0, depth];
    ///     pixels.map(|p| if p == [3.0, 5.0] { [f64::NAN; 3] } else { place(p) }).collect()
    /// };
    /// let mut seen = MovingScan::new(&frame(0.0)[..64 * 29], &BuildOptions::default())?;
    /// for step in 1..4 {
    ///     seen.replace_organised(&frame(f64::from(step)), 64)?;
    ///     assert_eq!(seen.len(), 64 * 48 - 1);
    /// }
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// As [`DeformingScan::replace_organised`].
    pub fn replace_organised(&mut self, points: &[[f64; 3]], width: usize) -> Result<(), DeformError> {
        self.scan.replace_organised(points, width)
    }

    /// Returns the current frame as a still scan, for example to save it. Later frames do not change
    /// it.
    #[must_use]
    pub fn still(&self) -> Scan {
        Scan::of(PointHierarchy::clone(&self.scan), None)
    }

    /// Places the scan at `pose`, which maps the frame of its points to the world.
    #[inline]
    #[must_use]
    pub fn at(&self, pose: &Pose) -> Placed<'_> {
        Placed::new(&self.scan, pose)
    }
}

impl Prepared for MovingScan {
    fn at(&self, pose: &Pose) -> Placed<'_> {
        Self::at(self, pose)
    }
}
