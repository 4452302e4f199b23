//! `FlightPlan`: the motion of a point as a function of time.

use crate::error::KineticError;
use crate::motion::Course;

/// The greatest magnitude of a coordinate, a velocity or an acceleration. Squares of differences of
/// positions stay finite at all times up to [`LATEST`].
const GREATEST: f64 = 1e100;

/// The greatest magnitude of a time, in seconds.
const LATEST: f64 = 1e15;

/// One leg: the three coordinates, with a common start.
pub(crate) type Leg = [Course; 3];

/// The motion of a point: at rest, linear, quadratic, or a sequence of such legs.
///
/// A leg lasts until the next one starts, the last one for ever. The first leg also holds before
/// its start. Legs need not join: the point jumps if they do not. Times are seconds, lengths those of
/// the caller.
///
/// ```
/// use nearmiss_kinetic::FlightPlan;
///
/// let thrown = FlightPlan::quadratic(0.0, [0.0, 0.0, 2.0], [3.0, 0.0, 0.0], [0.0, 0.0, -4.0])?;
/// let plan = thrown.then(FlightPlan::at_rest(1.0, [3.0, 0.0, 0.0])?)?;
/// assert_eq!(plan.position(0.5), [1.5, 0.0, 1.5]);
/// assert_eq!(plan.position(7.0), [3.0, 0.0, 0.0]);
/// # Ok::<(), nearmiss_kinetic::KineticError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct FlightPlan {
    pub(crate) first: Leg,
    /// The other legs, the last one first, so that a tree pops them in order.
    pub(crate) later: Vec<Leg>,
}

impl FlightPlan {
    /// A point that rests at `position` from `start` on.
    ///
    /// # Errors
    /// [`KineticError::Number`] if a number is not finite or too large.
    pub fn at_rest(start: f64, position: [f64; 3]) -> Result<Self, KineticError> {
        Self::linear(start, position, [0.0; 3])
    }

    /// A point that is at `position` at `start` and moves with constant `velocity`.
    ///
    /// # Errors
    /// [`KineticError::Number`] if a number is not finite or too large.
    pub fn linear(start: f64, position: [f64; 3], velocity: [f64; 3]) -> Result<Self, KineticError> {
        Self::quadratic(start, position, velocity, [0.0; 3])
    }

    /// A point with constant `acceleration`, at `position` with `velocity` at `start`.
    ///
    /// # Errors
    /// [`KineticError::Number`] if a number is not finite or too large.
    pub fn quadratic(
        start: f64,
        position: [f64; 3],
        velocity: [f64; 3],
        acceleration: [f64; 3],
    ) -> Result<Self, KineticError> {
        let start = seconds(start)?;
        for (what, numbers) in
            [("position", position), ("velocity", velocity), ("acceleration", acceleration)]
        {
            for value in numbers {
                within(what, value, GREATEST)?;
            }
        }
        let first =
            [0, 1, 2].map(|k| Course { start, at: [position[k], velocity[k], 0.5 * acceleration[k]] });
        Ok(Self { first, later: Vec::new() })
    }

    /// A point that passes `places` at `times`, in straight lines at constant speed, and then rests.
    ///
    /// # Errors
    /// [`KineticError::Polyline`] if there are no places or the numbers differ,
    /// [`KineticError::LegOrder`] if times do not ascend, and [`KineticError::Number`] if a number
    /// is not finite or too large.
    pub fn through(times: &[f64], places: &[[f64; 3]]) -> Result<Self, KineticError> {
        if times.len() != places.len() || times.is_empty() {
            return Err(KineticError::Polyline { times: times.len(), places: places.len() });
        }
        let end = times.len() - 1;
        let leg = |i: usize| {
            if i == end {
                return Self::at_rest(times[i], places[i]);
            }
            let [start, next] = [seconds(times[i])?, seconds(times[i + 1])?];
            if next <= start {
                return Err(KineticError::LegOrder { after: start, start: next });
            }
            let velocity = [0, 1, 2].map(|k| (places[i + 1][k] - places[i][k]) / (next - start));
            Self::linear(start, places[i], velocity)
        };
        let first = leg(0)?.first;
        let later = (1..=end).rev().map(|i| Ok(leg(i)?.first)).collect::<Result<_, KineticError>>()?;
        Ok(Self { first, later })
    }

    /// Appends the legs of `next`.
    ///
    /// # Errors
    /// [`KineticError::LegOrder`] if `next` does not start after the last leg of this plan.
    pub fn then(mut self, next: Self) -> Result<Self, KineticError> {
        let after = self.later.first().unwrap_or(&self.first)[0].start;
        let start = next.first[0].start;
        if start <= after {
            return Err(KineticError::LegOrder { after, start });
        }
        let mut later = next.later;
        later.push(next.first);
        later.append(&mut self.later);
        Ok(Self { first: self.first, later })
    }

    /// Returns the position at `time`. Costs a binary search of the legs.
    #[must_use]
    pub fn position(&self, time: f64) -> [f64; 3] {
        // The legs are in descending order of their starts.
        let future = self.later.partition_point(|leg| leg[0].start > time);
        let leg = self.later.get(future).unwrap_or(&self.first);
        [0, 1, 2].map(|k| leg[k].position(time))
    }
}

/// Returns `time`, −0 as 0, if it is finite and small enough.
pub(crate) fn seconds(time: f64) -> Result<f64, KineticError> {
    Ok(within("time", time, LATEST)? + 0.0)
}

/// Returns `true` if a leg could have been made by a [`FlightPlan`].
pub(crate) fn is_valid(leg: &Leg) -> bool {
    let start = leg[0].start;
    let numbers = |course: &Course| course.at.iter().all(|x| x.abs() <= GREATEST);
    seconds(start).is_ok() && leg.iter().all(|course| course.start == start && numbers(course))
}

fn within(what: &'static str, value: f64, limit: f64) -> Result<f64, KineticError> {
    if value.abs() <= limit { Ok(value) } else { Err(KineticError::Number { what, value, limit }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn legs_follow_each_other() {
        let [a, b, c] = [0.0, 1.0, 3.0].map(|t| FlightPlan::linear(t, [t; 3], [1.0, 0.0, -1.0]).unwrap());
        let plan = a.clone().then(b.clone()).unwrap().then(c.clone()).unwrap();
        assert_eq!(plan, a.clone().then(b.clone().then(c.clone()).unwrap()).unwrap(), "associative");
        for (t, leg) in [(-1.0, &a), (0.5, &a), (1.0, &b), (2.0, &b), (3.0, &c), (9.0, &c)] {
            assert_eq!(plan.position(t), leg.position(t), "at {t}");
        }
        let refused = b.then(a).unwrap_err().to_string();
        assert!(refused.starts_with("expected a leg that starts after 1 s, got 0 s"), "{refused}");
    }

    #[test]
    fn polylines_pass_their_places() {
        let [times, places] = [[0.0, 1.0, 4.0], [0.0, 5.0, -1.0]];
        let plan = FlightPlan::through(&times, &places.map(|x| [x, 0.0, 2.0 * x])).unwrap();
        for (time, x) in [(0.0, 0.0), (0.5, 2.5), (1.0, 5.0), (2.5, 2.0), (4.0, -1.0), (8.0, -1.0)] {
            assert_eq!(plan.position(time), [x, 0.0, 2.0 * x], "at {time}");
        }
        assert!(FlightPlan::through(&[0.0, 0.0], &[[0.0; 3]; 2]).is_err(), "two places at once");
        assert!(FlightPlan::through(&[0.0], &[]).is_err(), "no places");
        assert!(FlightPlan::through(&[], &[]).is_err(), "nothing");
    }

    #[test]
    fn numbers_must_be_finite() {
        for bad in [f64::NAN, f64::INFINITY, -1e101] {
            assert!(FlightPlan::linear(bad, [0.0; 3], [0.0; 3]).is_err(), "start {bad}");
            for k in 0..9 {
                let mut numbers = [0.0; 9];
                numbers[k] = bad;
                let [p, v, a] = [0, 3, 6].map(|i| [numbers[i], numbers[i + 1], numbers[i + 2]]);
                assert!(FlightPlan::quadratic(0.0, p, v, a).is_err(), "number {k} is {bad}");
            }
        }
    }
}
