//! Points of a scan, gathered piece by piece in a workspace.

use nearmiss_geometry::{Aabb, CloudError, Dropped, Frame, Intake, LEAST_POINTS, Repeated};
use nearmiss_lanes::id32;
use nearmiss_store::{Room, WorkError, Workspace};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::scan::points::ScanPoints;

/// The name of the stage.
const STAGE: &str = "points";

/// Why no points can be gathered.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum IntakeError {
    /// They make no cloud.
    #[error(transparent)]
    Cloud(#[from] CloudError),
    /// The workspace fails.
    #[error(transparent)]
    Work(#[from] WorkError),
    /// There are not as many points as when they were counted.
    #[error("expected {counted} points, got {got}; the input changed while it was read: read it again")]
    Changed {
        /// How many there were first.
        counted: usize,
        /// How many came then.
        got: usize,
    },
}

/// Gathers the points of a scan, larger than memory maybe, in the order in which they are given: the same as
/// those of a [`PointCloud`](nearmiss_geometry::PointCloud), and a filter before.
///
/// Points are given twice: first to an [`Intake`], which finds their frame, then to this.
#[derive(Debug)]
pub struct PointGatherer<'w> {
    work: &'w Workspace,
    intake: Intake,
    frame: Frame,
    positions: Room<[f32; 3]>,
    source: Room<u32>,
    /// How many were given, and how many of them are kept.
    given: usize,
    kept: usize,
    filtered: usize,
    step: f64,
}

impl<'w> PointGatherer<'w> {
    /// For the points that `intake` has seen.
    ///
    /// # Errors
    /// When they make no cloud, or the workspace has no room.
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

    /// Adds points; of the finite ones those are kept of which `is_wanted` says so, by their places among
    /// these and their positions as they are kept.
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

    /// Leaves out what is repeated.
    ///
    /// # Errors
    /// When too few points are left, when there are others than `intake` has seen, or when the workspace has
    /// no room.
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

/// What is known of gathered points.
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
    /// Those that an ended process has gathered in the workspace, if one has.
    ///
    /// # Errors
    /// When they cannot be read.
    pub fn kept(work: &Workspace) -> Result<Option<Self>, WorkError> {
        let stage = work.stage(STAGE);
        let Some(about) = stage.done::<About>() else { return Ok(None) };
        let positions = stage.room("positions", about.count)?;
        let source = stage.room("source", about.count)?;
        Ok(Some(Self { positions, source, about }))
    }

    /// The points for a build.
    #[must_use]
    pub fn points(&self) -> ScanPoints<'_> {
        let About { frame, bounds, dropped, step, .. } = self.about;
        ScanPoints { positions: &self.positions, source: &self.source, frame, bounds, dropped, step }
    }
}
