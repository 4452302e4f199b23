//! Points of two surfaces near two samples, as near to each other as steps along the surfaces lead.
//!
//! Projected gradients of the distance with steps that are halved where they lead too far: along flat or
//! bent-away surfaces the first step is right, over tips it is too long by as much as the other surface is
//! further away than they are round.

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_surface::{Projection, Status, project};

use crate::pair::meter::Meter;
use crate::pair::placed::{Placed, ViewScratch};

/// Steps of either point; each costs two or three evaluations.
const ROUNDS: u32 = 8;

/// A step from which less is to be gained than this share of the sampling radius is not made.
const ENOUGH: f64 = 1e-3;

/// Steps are shortened to this share before they are given up.
const SHORTEST: f64 = 1.0 / 16.0;

/// A point of either surface.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Feet {
    pub(crate) points: [[f64; 3]; 2],
    pub(crate) distance: f64,
}

/// Two surfaces about two of their samples.
#[derive(Debug)]
pub(crate) struct Approach<'a, 's> {
    pub(crate) views: [&'a Placed<'a>; 2],
    pub(crate) samples: [usize; 2],
    pub(crate) gathers: &'s mut [ViewScratch; 2],
    pub(crate) meter: &'s mut Meter,
}

impl Approach<'_, '_> {
    /// Verified points of both surfaces, the nearest that were found: from the samples' feet on, either in
    /// turn steps along its surface towards the other, at most a local radius, half as far where that led
    /// away. None where no such points are found, or the budget ends the search for the first.
    pub(crate) fn run(&mut self) -> Option<Feet> {
        let starts = [0, 1].map(|side| self.views[side].point(self.samples[side]));
        let mut feet = [self.land(0, starts[0])?, self.land(1, starts[1])?];
        let mut shares = [1.0; 2];
        for _ in 0..ROUNDS {
            let tried = [0, 1].map(|side| self.step(side, &mut feet, &mut shares[side]));
            if tried == [false; 2] {
                break;
            }
        }
        let distance = between(&feet).norm();
        Some(Feet { points: feet.map(|foot| foot.point), distance })
    }

    /// Moves one foot towards the other along its surface, if that brings it nearer. `share` of the way is
    /// gone; half as much from then on if it does not. Whether that was worth trying.
    fn step(&mut self, side: usize, feet: &mut [Projection; 2], share: &mut f64) -> bool {
        let view = self.views[side];
        let radius = f64::from(view.scan().radii()[self.samples[side]]) * view.placed().scale();
        let to = between(feet) * [1.0, -1.0][side];
        let (distance, normal) = (to.norm(), Vector3::from(feet[side].at.normal));
        let along = to - normal * normal.dot(&to);
        let length = along.norm();
        if *share < SHORTEST || length * length.min(radius) <= ENOUGH * radius * distance {
            return false;
        }
        let step = along * (*share * (radius / length).min(1.0));
        let place = Vector3::from(feet[side].point) + step;
        let mut next = *feet;
        if let Some(foot) = self.land(side, place.into()) {
            next[side] = foot;
        }
        if between(&next).norm() < distance {
            *feet = next;
        } else {
            *share *= 0.5;
        }
        true
    }

    /// The verified surface point below `x`; where the surface ends before that, below the mean of the points
    /// that reach there.
    fn land(&mut self, side: usize, x: [f64; 3]) -> Option<Projection> {
        let foot = self.project(side, x)?;
        if foot.at.status != Status::Border || foot.converged {
            return Some(foot).filter(|foot| foot.converged);
        }
        self.project(side, foot.at.centroid).filter(|foot| foot.converged)
    }

    /// None once the budget is spent.
    fn project(&mut self, side: usize, x: [f64; 3]) -> Option<Projection> {
        if self.meter.go_on().is_break() {
            return None;
        }
        let (view, scratch) = (self.views[side], &mut self.gathers[side]);
        let foot = project(x, |y| view.evaluate_near(self.samples[side], y, scratch));
        self.meter.evaluated(u64::from(foot.evaluations));
        Some(foot)
    }
}

fn between(feet: &[Projection; 2]) -> Vector3<f64> {
    Vector3::from(feet[1].point) - Vector3::from(feet[0].point)
}
