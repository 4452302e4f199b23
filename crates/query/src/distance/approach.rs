//! Points on two surfaces near two samples, moved towards each other along the surfaces.
//!
//! Projected gradient descent on the distance, with steps that are halved if they go too far. The
//! first step has the right length on flat surfaces, and on surfaces that bend away from each
//! other. Near the tip of a surface it is too long, by a factor of the distance to the other
//! surface over the radius of the tip.

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_surface::{Projection, Status, project};

use crate::pair::meter::Meter;
use crate::pair::placed::{Placed, ViewScratch};

/// Steps of either point; each costs two or three evaluations.
pub(crate) const ROUNDS: u32 = 8;

/// A step is skipped if it would gain less than this share of the sampling radius.
const ENOUGH: f64 = 1e-3;

/// A point stops if its steps would have to be shorter than this share.
const SHORTEST: f64 = 1.0 / 16.0;

/// A point on each surface.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Feet {
    pub(crate) points: [[f64; 3]; 2],
    pub(crate) distance: f64,
}

/// Two surfaces near one sample of each.
#[derive(Debug)]
pub(crate) struct Approach<'a, 's> {
    pub(crate) views: [&'a Placed<'a>; 2],
    pub(crate) samples: [usize; 2],
    pub(crate) gathers: &'s mut [ViewScratch; 2],
    pub(crate) meter: &'s mut Meter,
}

impl Approach<'_, '_> {
    /// Returns two verified points, one on each surface, that are near each other. They start at
    /// the feet of the samples and take turns stepping along their surfaces towards each other. A
    /// step is at most a local radius long. It is halved after a step that increased the distance.
    /// Returns `None` if no starting points are found or the budget ends first.
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

    /// Moves one foot towards the other along its surface by `share` of the way, if that reduces
    /// the distance; otherwise halves `share`. Returns `false` if no step is worth trying.
    fn step(&mut self, side: usize, feet: &mut [Projection; 2], share: &mut f64) -> bool {
        let (view, sample) = (self.views[side], self.samples[side]);
        let to = between(feet) * [1.0, -1.0][side];
        let Some(place) = step(view, sample, &feet[side], to, *share) else { return false };
        let mut next = *feet;
        if let Some(foot) = self.land(side, place) {
            next[side] = foot;
        }
        if between(&next).norm() < to.norm() {
            *feet = next;
        } else {
            *share *= 0.5;
        }
        true
    }

    fn land(&mut self, side: usize, x: [f64; 3]) -> Option<Projection> {
        land(self.views[side], self.samples[side], x, &mut self.gathers[side], self.meter)
    }
}

/// The point to which a foot on a surface steps, by `share` of its way towards the end of `to`, at
/// most a local radius of `sample`. `None` if no step is worth trying.
pub(crate) fn step(
    view: &Placed<'_>,
    sample: usize,
    foot: &Projection,
    to: Vector3<f64>,
    share: f64,
) -> Option<[f64; 3]> {
    let radius = f64::from(view.scan().radii()[sample]) * view.stored_to_world().scale();
    let (distance, normal) = (to.norm(), Vector3::from(foot.at.normal));
    let along = to - normal * normal.dot(&to);
    let length = along.norm();
    if share < SHORTEST || length * length.min(radius) <= ENOUGH * radius * distance {
        return None;
    }
    Some((Vector3::from(foot.point) + along * (share * (radius / length).min(1.0))).into())
}

/// Returns the verified surface point below `x`, near `sample`. If `x` is beyond a border of the
/// surface, projects the centroid of the last evaluation instead. `None` once the budget is spent.
pub(crate) fn land(
    view: &Placed<'_>,
    sample: usize,
    x: [f64; 3],
    scratch: &mut ViewScratch,
    meter: &mut Meter,
) -> Option<Projection> {
    let mut project = |x| {
        if meter.go_on().is_break() {
            return None;
        }
        let mut near = view.near(sample, scratch);
        let foot = project(x, |y| near.evaluate(y));
        meter.evaluated(u64::from(foot.evaluations));
        Some(foot)
    };
    let foot = project(x)?;
    if foot.at.status != Status::Border || foot.converged {
        return Some(foot).filter(|foot| foot.converged);
    }
    project(foot.at.centroid).filter(|foot| foot.converged)
}

fn between(feet: &[Projection; 2]) -> Vector3<f64> {
    Vector3::from(feet[1].point) - Vector3::from(feet[0].point)
}
