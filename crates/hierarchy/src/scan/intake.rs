//! Points of a scan, gathered piece by piece in a workspace.

use nearmiss_geometry::{Aabb, CloudError, Dropped, Frame, Intake, LEAST_POINTS, Repeated};
use nearmiss_lanes::id32;
use nearmiss_store::{Room, WorkError, Workspace};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::scan::points::ScanPoints;

/// The name of the stage in the workspace.
const STAGE: &str = "points";

/// The error of gathering points.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum IntakeError {
    /// The points do not form a cloud.
    #[error(transparent)]
    Cloud(#[from] CloudError),
    /// The workspace failed.
    #[error(transparent)]
    Work(#[from] WorkError),
    /// The number of points differs from the first pass.
    #[error(
        "expected {counted} points as in the first pass, got {got}; leave the input unchanged and read it again"
    )]
    Changed {
        /// The number of points in the first pass.
        counted: usize,
        /// The number of points in the second pass.
        got: usize,
    },
}

/// Gathers the points of a scan, which may be larger than memory, in the order in which they are
/// given. The result is that of a filter followed by a
/// [`PointCloud`](nearmiss_geometry::PointCloud).
///
/// Points are given twice: first to an [`Intake`], which determines their frame, then to this.
#[derive(Debug)]
pub struct PointGatherer<'w> {
    work: &'w Workspace,
    intake: Intake,
    frame: Frame,
    positions: Room<[f32; 3]>,
    source: Room<u32>,
    /// The number of points given, and the number of them kept.
    given: usize,
    kept: usize,
    filtered: usize,
    step: f64,
}

impl<'w> PointGatherer<'w> {
    /// Creates a gatherer for the points that `intake` has seen.
    ///
    /// # Errors
    /// If the points do not form a cloud, or the workspace cannot provide the memory.
    pub fn new(work: &'w Workspace, intake: &Intake) -> Result<Self, IntakeError> {
        let frame = intake.frame()?;
        let finite = intake.given() - intake.not_finite();
        Ok(Self {
            work,
            intake: *intake,
            frame,
            positions: work.room(finite)?,
            source: work.room(finite)?,
            given: 0,
            kept: 0,
            filtered: 0,
            step: 0.0,
        })
    }

    /// Adds points. Of the finite ones it keeps those for which `is_wanted` returns `true`, given
    /// their index in `points` and their position as stored.
    pub fn add(&mut self, points: &[[f64; 3]], is_wanted: impl Fn(usize, [f64; 3]) -> bool) {
        let (positions, source): (&mut [_], &mut [_]) = (&mut self.positions, &mut self.source);
        for (i, &p) in points.iter().enumerate() {
            let index = self.given;
            self.given += 1;
            if !p.iter().all(|x| x.is_finite()) {
                continue;
            }
            let local = self.frame.to_local(p);
            let back = self.frame.to_world(local);
            self.step = (0..3).fold(self.step, |step, k| step.max((p[k] - back[k]).abs()));
            if !is_wanted(i, back) {
                self.filtered += 1;
            } else if self.kept < positions.len() {
                (positions[self.kept], source[self.kept]) = (local, id32(index));
                self.kept += 1;
            }
        }
    }

    /// Drops repeated points and closes the gatherer.
    ///
    /// # Errors
    /// If too few points are left, if their number differs from that of `intake`, or if the
    /// workspace cannot provide the memory.
    pub fn finish(mut self) -> Result<GatheredPoints, IntakeError> {
        let (work, given) = (self.work, self.given);
        if given != self.intake.given() {
            return Err(IntakeError::Changed { counted: self.intake.given(), got: given });
        }
        self.positions.truncate(self.kept);
        self.source.truncate(self.kept);
        let repeated = Repeated::among(&self.positions, &mut work.room(self.kept)?);
        let duplicate = repeated.count();
        let count = self.kept - duplicate;
        if count < LEAST_POINTS {
            return Err(CloudError::TooFew { distinct: count, given }.into());
        }
        let stage = work.stage(STAGE);
        let (mut positions, mut kept_source) =
            (stage.room("positions", count)?, stage.room("source", count)?);
        {
            let (positions, kept_source): (&mut [[f32; 3]], &mut [u32]) = (&mut positions, &mut kept_source);
            let all = self.positions.iter().zip(&*self.source).enumerate();
            let first = all.filter(|(i, _)| !repeated.contains(*i)).map(|(_, point)| point);
            for ((p, i), (position, source)) in first.zip(positions.iter_mut().zip(kept_source)) {
                (*position, *source) = (*p, *i);
            }
        }
        let dropped = Dropped { not_finite: self.intake.not_finite(), duplicate, filtered: self.filtered };
        let bounds = Aabb::of(positions.iter().map(|&p| self.frame.to_world(p)));
        let about = About { count, frame: self.frame, bounds, dropped, step: self.step };
        stage.close(&about)?;
        Ok(GatheredPoints { positions, source: kept_source, about })
    }
}

/// The metadata of gathered points.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct About {
    count: usize,
    frame: Frame,
    bounds: Aabb,
    dropped: Dropped,
    step: f64,
}

/// The points that a [`PointGatherer`] has gathered.
#[derive(Debug)]
pub struct GatheredPoints {
    positions: Room<[f32; 3]>,
    source: Room<u32>,
    about: About,
}

impl GatheredPoints {
    /// Returns the points that an interrupted process has gathered in the workspace, if there are
    /// any.
    ///
    /// # Errors
    /// If the points cannot be read.
    pub fn kept(work: &Workspace) -> Result<Option<Self>, WorkError> {
        let stage = work.stage(STAGE);
        let Some(about) = stage.done::<About>() else { return Ok(None) };
        let positions = stage.room("positions", about.count)?;
        let source = stage.room("source", about.count)?;
        Ok(Some(Self { positions, source, about }))
    }

    /// Returns the points in the form that a build takes.
    #[must_use]
    pub fn points(&self) -> ScanPoints<'_> {
        let About { frame, bounds, dropped, step, .. } = self.about;
        ScanPoints { positions: &self.positions, source: &self.source, frame, bounds, dropped, step }
    }
}
