//! Following of a curve, step by step.

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_surface::{Evaluation, Status, step_onto_both};

use super::line::{Curve, CurveEnd};
use super::trail::{PARALLEL, Place, Trail};
use crate::pair::meter::Meter;
use crate::pair::placed::{Placed, ViewScratch};

/// The longest step, in sampling radii. The points near a place do not describe the surface further
/// away.
pub(super) const LONGEST: f64 = 2.0;

/// The shortest step, in the same radii, which is the precision of the ends of curves.
const SHORTEST: f64 = 1.0 / 64.0;

/// The number of times that a chord which turns too far may be halved. Twice gives a quarter, which
/// may turn sixteen times as much per length.
const BRIDGES: u32 = 2;

/// Rounds of Newton's method from a crossing of discs. Most that converge at all do so in half as
/// many.
const ROUNDS_TO_BEGIN: u32 = 8;

/// The squared sine below which the start is searched for midway between the surfaces, as in
/// [`meet`](nearmiss_surface::meet).
const FLAT: f64 = 1e-3;

/// Share of the longest step to aim for, as corrections may lengthen a step a little.
const STRIDE: f64 = 0.98;

/// The sine below which a curve that cannot be followed counts as ending in a tangency.
const GRAZING: f64 = 0.1;

/// The greatest turn of a curve in the longest step, in radians; proportionally more in a shorter
/// one. An arc deviates from its chord by 1/8 of the turn times its length, so by 1/40 of the
/// longest step.
const TURN: f64 = 0.2;

/// The greatest turn in any step, in radians: 34°.
const MOST_TURN: f64 = 0.6;

/// The cosine of the greatest turn of a surface in a step, 30°. A greater turn means another sheet.
const TILT_COSINE: f64 = 0.866;

/// Distance of the centroid from the point, in bandwidths, from which the surface counts as ending
/// nearby. At a border it is 0.56, elsewhere seldom 0.2.
const BESIDE: f64 = 0.4;

/// Rounds of Newton's method per step; a good start needs two.
const ROUNDS: u32 = 4;

/// The greatest distance, as a share of the step, between the aim and the corrected point. Other
/// sheets are further away.
const MOST_CORRECTION: f64 = 0.25;

/// A lower limit for that distance, in sampling radii, for short steps. f is not smoother than this
/// where points enter its support radius.
const LEAST_CORRECTION: f64 = 1.0 / 32.0;

/// A chord ends at an earlier place that it passes within this share of its length: four times the
/// deviation of an arc.
pub(super) const SAME_TURN: f64 = 0.1;

/// Follows curves and records their trail.
#[derive(Debug)]
pub(super) struct Follower<'a> {
    pub(super) views: [&'a Placed<'a>; 2],
    pub(super) gathers: &'a mut [ViewScratch; 2],
    /// The points near which each function was evaluated last.
    pub(super) nearest: [usize; 2],
    pub(super) meter: Meter,
    /// The longest step.
    pub(super) longest: f64,
    /// The lesser sampling radius.
    pub(super) radius: f64,
    /// The greatest |f| allowed.
    pub(super) tolerance: f64,
    pub(super) trail: &'a mut Trail,
}

impl Place {
    /// The reason why a curve cannot be followed from here although both surfaces continue.
    fn lost(&self) -> CurveEnd {
        if self.sine < GRAZING { CurveEnd::Tangent } else { CurveEnd::Lost }
    }

    /// The refusal of a step that did not converge near its aim.
    fn astray(&self) -> Refusal {
        Refusal { end: self.lost(), is_wall: false }
    }

    /// The curvature vector of the curve here, estimated from the chord from `before`.
    fn bend_since(&self, before: &Self, way: f64) -> Vector3<f64> {
        let turned = (self.tangent - before.tangent) * (way / (self.point - before.point).norm());
        turned - self.tangent * self.tangent.dot(&turned)
    }

    /// The point of the curve halfway to `next`: the middle of the cubic with these ends and
    /// tangents that is as long as an arc with this turn.
    fn halfway(&self, next: &Self, way: f64) -> Vector3<f64> {
        let turned = next.tangent - self.tangent;
        let length = way * (next.point - self.point).norm() * (1.0 + turned.norm_squared() / 16.0);
        0.5 * (self.point + next.point) - turned * (0.125 * length)
    }
}

impl Follower<'_> {
    /// Evaluates both functions at `x`. `None` once the budget is spent.
    pub(super) fn evaluate(&mut self, x: [f64; 3]) -> Option<[Evaluation; 2]> {
        if self.meter.go_on().is_break() {
            return None;
        }
        self.meter.evaluated(2);
        let mut side = |side: usize| {
            self.views[side].evaluate_onward(x, &mut self.nearest[side], &mut self.gathers[side])
        };
        Some([side(0), side(1)])
    }

    /// Traces the curve through `place` and appends its points to `points`, at most `spacing`
    /// apart.
    pub(super) fn trace(&mut self, place: Place, spacing: f64, points: &mut Vec<[f64; 3]>) -> Curve {
        let start = self.trail.places.len();
        self.trail.push(place);
        let onward = if place.is_tangent() { Some(CurveEnd::Tangent) } else { self.follow(start, 1.0) };
        let turn = self.trail.places.len();
        let ends = onward.map(|last| {
            let back = match last {
                CurveEnd::Budget => None,
                _ if place.is_tangent() => Some(CurveEnd::Tangent),
                _ => self.follow(start, -1.0),
            };
            [back.unwrap_or(last), last]
        });
        let first = points.len();
        let (onward, back) = self.trail.places[start..].split_at(turn - start);
        thin_out(back.iter().rev().chain(onward), [spacing, self.longest], points);
        Curve { first, count: points.len() - first, ends }
    }

    /// Finds the place on both surfaces to which Newton's method leads from a crossing of discs, if
    /// it converges. `Err` if the budget is spent.
    pub(super) fn begin(&mut self, crossing: [f64; 3]) -> Result<Option<Place>, CurveEnd> {
        let mut point = Vector3::from(crossing);
        for _ in 0..ROUNDS_TO_BEGIN {
            let at = self.evaluate(point.into()).ok_or(CurveEnd::Budget)?;
            let place = Place::new(point, &at);
            if place.residual <= self.tolerance {
                return Ok(Some(place).filter(|_| at.iter().all(|at| at.status == Status::Ok)));
            }
            if at.iter().any(|at| at.status == Status::Outside) {
                break;
            }
            point += step_onto_both(&at, FLAT);
        }
        Ok(None)
    }

    /// Follows the curve from a place of the trail, forward or backward (`way` −1), to its end.
    /// Returns `None` if it comes back to the start.
    fn follow(&mut self, start: usize, way: f64) -> Option<CurveEnd> {
        let shortest = SHORTEST * self.longest.min(self.radius);
        let most = STRIDE * self.longest;
        let mut here = self.trail.places[start];
        let mut bend = Vector3::zeros();
        let mut length = most;
        // Distance ahead at which a surface was found to end.
        let mut wall = f64::INFINITY;
        let mut grows = true;
        loop {
            // Skip the steps that would turn too far.
            let bent: f64 = bend.norm();
            let straight = (0.8 * TURN * self.longest / bent).sqrt().min(0.8 * MOST_TURN / bent);
            let ahead = length.min(straight).max(shortest);
            let arc = here.tangent * way + bend * (0.5 * ahead);
            let aim = here.point + arc * (ahead / arc.norm());
            let known = self.trail.places.len();
            let step = self.land(&here, aim, ahead).and_then(|next| self.join(&here, &next, way, BRIDGES));
            if let [between @ .., last] = &self.trail.places[known..] {
                let (last, before) = (*last, between.last().unwrap_or(&here));
                bend = last.bend_since(before, way);
                let left = wall - (last.point - here.point).norm();
                wall = if left > 0.0 { left } else { f64::INFINITY };
                here = last;
                length = if grows { most.min(2.0 * length) } else { length }.min(0.5 * wall);
                grows = true;
            }
            match step {
                Ok(None) => {}
                Ok(Some(passed)) => return (passed != start).then(|| here.lost()),
                Err(refusal) => {
                    if refusal.end == CurveEnd::Budget || ahead <= shortest {
                        return Some(refusal.end);
                    }
                    if refusal.is_wall {
                        wall = ahead;
                    }
                    length = 0.5 * ahead;
                    grows = false;
                }
            }
        }
    }

    /// Appends `next`, which is on the same curve as `here`, to the trail. Inserts as many places
    /// before it as are needed for no chord to turn too far. Returns the earlier place that one of
    /// these chords passes, and stops there.
    fn join(&mut self, here: &Place, next: &Place, way: f64, bridges: u32) -> Result<Option<usize>, Refusal> {
        let chord = (next.point - here.point).norm();
        if !turns(here, next, chord, self.longest) {
            let passed = self.trail.passed(here, next, SAME_TURN * chord);
            if passed.is_none_or(|i| self.needs_between(here, next, &self.trail.places[i])) {
                self.trail.push(*next);
            }
            return Ok(passed);
        }
        if bridges == 0 {
            return Err(here.astray());
        }
        let between = self.land(here, here.halfway(next, way), 0.5 * chord)?;
        match self.join(here, &between, way, bridges - 1)? {
            None => self.join(&between, next, way, bridges - 1),
            passed => Ok(passed),
        }
    }

    /// Returns `true` if `passed` is beyond `next` and a chord to it from `here` would be too long
    /// or turn too far, so that `next` cannot be left out.
    fn needs_between(&self, here: &Place, next: &Place, passed: &Place) -> bool {
        let direct = passed.point - here.point;
        let is_beyond = (passed.point - next.point).dot(&(next.point - here.point)) > 0.0;
        let chord = direct.norm();
        is_beyond && (chord > self.longest || turns(here, &passed.turned_like(here), chord, self.longest))
    }

    /// Finds the place on the curve near `aim`, which is about `length` from `here`.
    fn land(&mut self, here: &Place, aim: Vector3<f64>, length: f64) -> Result<Place, Refusal> {
        let most = (MOST_CORRECTION * length).max(LEAST_CORRECTION * self.radius);
        let mut point = aim;
        for _ in 0..ROUNDS {
            let at = self.evaluate(point.into()).ok_or(Refusal { end: CurveEnd::Budget, is_wall: false })?;
            let place = Place::new(point, &at).turned_like(here);
            if at.iter().any(|at| at.status != Status::Ok) {
                let is_wall = place.residual <= LEAST_CORRECTION * self.radius;
                return Err(Refusal { end: obstacle(point, &at), is_wall });
            }
            if (0..2).any(|side| place.normals[side].dot(&here.normals[side]) < TILT_COSINE) {
                break;
            }
            if place.residual <= self.tolerance {
                if place.is_tangent() {
                    return Err(Refusal { end: CurveEnd::Tangent, is_wall: false });
                }
                let is_near = (point - here.point).norm() <= self.longest;
                return if is_near { Ok(place) } else { Err(here.astray()) };
            }
            point += step_onto_both(&at, PARALLEL * PARALLEL);
            if (point - aim).norm() > most {
                break;
            }
        }
        Err(here.astray())
    }
}

/// The reason why a step is not taken.
#[derive(Debug, Clone, Copy)]
struct Refusal {
    /// The reason for the end of the curve if no shorter step succeeds.
    end: CurveEnd,
    /// `true` if a surface ends here, and an evaluation so near to the end showed it that no other
    /// step of this length will succeed.
    is_wall: bool,
}

/// The reason why the curve ends at `x`, where one of the evaluations `at` is not on its surface.
fn obstacle(x: Vector3<f64>, at: &[Evaluation; 2]) -> CurveEnd {
    let ends = at.each_ref().map(|at| {
        let aside = (Vector3::from(at.centroid) - x).norm() / at.bandwidth;
        at.status == Status::Outside || aside > BESIDE
    });
    match ends {
        [true, _] => CurveEnd::BorderOfA,
        [_, true] => CurveEnd::BorderOfB,
        _ => CurveEnd::Lost,
    }
}

/// Returns `true` if the curve turns too far between two places for a chord of length `chord`,
/// where `longest` is the longest step.
fn turns(here: &Place, next: &Place, chord: f64, longest: f64) -> bool {
    let turn = (next.tangent - here.tangent).norm();
    turn > MOST_TURN || turn * chord > TURN * longest
}

/// Appends the first and the last of `places` to `points`, and as many in between that no point is
/// further than `spacing` from the one before and no chord turns too far.
fn thin_out<'a>(
    places: impl Iterator<Item = &'a Place>,
    [spacing, longest]: [f64; 2],
    points: &mut Vec<[f64; 3]>,
) {
    let mut kept: Option<&Place> = None;
    let mut last: Option<&Place> = None;
    let mut since = 0.0;
    for place in places {
        if let (Some(kept_place), Some(last_place)) = (kept, last) {
            let step = (place.point - last_place.point).norm();
            let turned = turns(kept_place, place, since + step, longest);
            if since > 0.0 && (since + step > spacing || turned) {
                points.push(last_place.point.into());
                kept = last;
                since = 0.0;
            }
            since += step;
        } else {
            points.push(place.point.into());
            kept = Some(place);
        }
        last = Some(place);
    }
    if let Some(last) = last.filter(|_| since > 0.0) {
        points.push(last.point.into());
    }
}
