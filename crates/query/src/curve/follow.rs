//! Along a curve, step by step.

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_surface::{Evaluation, Status, step_onto_both};

use super::line::{Curve, CurveEnd};
use super::trail::{PARALLEL, Place, Trail};
use crate::pair::meter::Meter;
use crate::pair::placed::{Placed, ViewScratch};

/// The longest step in sampling radii: no further than the points about a place know of.
pub(super) const LONGEST: f64 = 2.0;

/// The shortest, in the same radii: so exactly is it known where a curve ends.
const SHORTEST: f64 = 1.0 / 64.0;

/// So often a chord that turns too far is halved: to a quarter, which may turn sixteen times as much a
/// length.
const BRIDGES: u32 = 2;

/// Rounds of Newton's method from a crossing of discs: most that reach the tolerance at all do so in half as
/// many.
const ROUNDS_TO_BEGIN: u32 = 8;

/// Where the square of the sine is less, a beginning is looked for between the surfaces, as
/// [`meet`](nearmiss_surface::meet) does.
const FLAT: f64 = 1e-3;

/// Corrections may make a step a little longer than it aimed for.
const STRIDE: f64 = 0.98;

/// A curve that cannot be followed where the sine is below this ends because its surfaces touch.
const GRAZING: f64 = 0.1;

/// The most a curve turns in the longest step; in a shorter one by as much more. An arc leaves its chord by
/// an eighth of the turn times its length, so by a fortieth of the longest step.
const TURN: f64 = 0.2;

/// No step turns further: 34°.
const MOST_TURN: f64 = 0.6;

/// The cosine of the most a surface turns in a step, 30°: more is another sheet.
const TILT_COSINE: f64 = 0.866;

/// Where the mean of the points is this many bandwidths aside, the surface ends near: at a border it is 0.56,
/// elsewhere seldom 0.2.
const BESIDE: f64 = 0.4;

/// Rounds of Newton's method a step; a good start needs two.
const ROUNDS: u32 = 4;

/// These may lead away from where the step aimed by this share of its length: no nearer is another sheet.
const MOST_CORRECTION: f64 = 0.25;

/// However short the step, so much in sampling radii: f is no smoother than that where points come into its
/// horizon.
const LEAST_CORRECTION: f64 = 1.0 / 32.0;

/// What a chord passes within this share of its length it joins: four times as far as an arc leaves it.
pub(super) const SAME_TURN: f64 = 0.1;

/// Follows curves, and leaves its trail.
#[derive(Debug)]
pub(super) struct Follower<'a> {
    pub(super) views: [&'a Placed<'a>; 2],
    pub(super) gathers: &'a mut [ViewScratch; 2],
    /// Points near which either function was evaluated last.
    pub(super) nearest: [usize; 2],
    pub(super) meter: Meter,
    /// The longest step.
    pub(super) longest: f64,
    /// The lesser sampling radius.
    pub(super) radius: f64,
    /// The greatest |f|.
    pub(super) tolerance: f64,
    pub(super) trail: &'a mut Trail,
}

impl Place {
    /// Why a curve cannot be followed from here, although both surfaces go on.
    fn lost(&self) -> CurveEnd {
        if self.sine < GRAZING { CurveEnd::Tangent } else { CurveEnd::Lost }
    }

    /// No step was found to where it was looked for.
    fn astray(&self) -> Refusal {
        Refusal { end: self.lost(), is_wall: false }
    }

    /// How the curve turns here for each unit of length, by the chord from `before`.
    fn bend_since(&self, before: &Self, way: f64) -> Vector3<f64> {
        let turned = (self.tangent - before.tangent) * (way / (self.point - before.point).norm());
        turned - self.tangent * self.tangent.dot(&turned)
    }

    /// Where the curve passes halfway to `next`: the middle of the cubic with these ends and their tangents,
    /// as long as an arc that turns so far.
    fn halfway(&self, next: &Self, way: f64) -> Vector3<f64> {
        let turned = next.tangent - self.tangent;
        let length = way * (next.point - self.point).norm() * (1.0 + turned.norm_squared() / 16.0);
        0.5 * (self.point + next.point) - turned * (0.125 * length)
    }
}

impl Follower<'_> {
    /// Both functions at `x`; none once the budget is spent.
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

    /// The curve through `place`, whose points are added to `points`, not further than `spacing` from each
    /// other.
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

    /// The place on both surfaces that Newton's method leads to from a crossing of discs, if it does; in
    /// `Err` that the budget is spent.
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

    /// From a place of the trail onward, or back (`way` −1), until the curve ends; none when it is there
    /// again.
    fn follow(&mut self, start: usize, way: f64) -> Option<CurveEnd> {
        let shortest = SHORTEST * self.longest.min(self.radius);
        let most = STRIDE * self.longest;
        let mut here = self.trail.places[start];
        let mut bend = Vector3::zeros();
        let mut length = most;
        // How far ahead a surface was seen not to go on.
        let mut wall = f64::INFINITY;
        let mut grows = true;
        loop {
            // A step that would turn too far need not be tried.
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

    /// Leaves on the trail `next`, on the same curve as `here`, and before it as many places between as it
    /// takes for no chord to turn further than it may. Tells which place one of these chords passes, where
    /// they stop.
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

    /// Returns `true` if `passed` lies beyond `next` and a chord from `here` would be too long or turn too
    /// far to leave `next` out.
    fn needs_between(&self, here: &Place, next: &Place, passed: &Place) -> bool {
        let direct = passed.point - here.point;
        let is_beyond = (passed.point - next.point).dot(&(next.point - here.point)) > 0.0;
        let chord = direct.norm();
        is_beyond && (chord > self.longest || turns(here, &passed.turned_like(here), chord, self.longest))
    }

    /// The place on the curve near `aim`, which is about `length` from `here`, or why there is none.
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

/// Why a step is not taken.
#[derive(Debug, Clone, Copy)]
struct Refusal {
    /// Why the curve ends if it can come no nearer.
    end: CurveEnd,
    /// Whether a surface was seen from so near not to go on that another step that far will not be taken
    /// either.
    is_wall: bool,
}

/// What is in the way at `x`, where one of the functions that are `at` says that its surface is not.
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

/// Whether the curve turns too far between two places for a chord of that length, where `longest` is the
/// longest.
fn turns(here: &Place, next: &Place, chord: f64, longest: f64) -> bool {
    let turn = (next.tangent - here.tangent).norm();
    turn > MOST_TURN || turn * chord > TURN * longest
}

/// Adds to `points` the first and the last of `places`, and of those between so many that none is further
/// than `spacing` from the one before, nor turned by more than a step may.
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
