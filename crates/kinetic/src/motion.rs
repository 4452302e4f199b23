//! Motion of one coordinate, and the certificate that one coordinate stays ahead of another.

use bytemuck::{Pod, Zeroable};

/// One coordinate over time: `at[0] + at[1] s + at[2] s²` with s = t − `start`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct Course {
    /// The time at which the coordinate is `at[0]`.
    pub(crate) start: f64,
    /// Position, velocity and half the acceleration at `start`.
    pub(crate) at: [f64; 3],
}

impl Course {
    /// Returns the position at `time`.
    #[inline]
    pub(crate) fn position(&self, time: f64) -> f64 {
        let s = time - self.start;
        self.at[0] + (self.at[1] + self.at[2] * s) * s
    }

    /// Returns the state at `time`, measured along the axis or, if `sign` is −1, against it.
    #[inline]
    pub(crate) fn state(&self, time: f64, sign: f64) -> State {
        let s = time - self.start;
        let bend = self.at[2] * s;
        State([
            sign * (self.at[0] + (self.at[1] + bend) * s),
            sign * (self.at[1] + 2.0 * bend),
            sign * self.at[2],
        ])
    }
}

/// Position, velocity and half the acceleration of a coordinate at some instant.
#[derive(Debug, Clone, Copy)]
pub(crate) struct State(pub(crate) [f64; 3]);

/// Returns `true` if `a` is the greater one: the first different number decides.
#[inline]
fn exceeds(a: &[f64], b: &[f64]) -> bool {
    let different = a.iter().zip(b).find(|(x, y)| x != y);
    different.is_some_and(|(x, y)| x > y)
}

impl State {
    /// Returns the state towards the opposite side.
    pub(crate) fn reversed(self) -> Self {
        Self(self.0.map(|x| -x))
    }

    /// Returns `true` if this coordinate is ahead now, or is about to be: ties of positions are
    /// broken by velocities, then by accelerations.
    #[inline]
    pub(crate) fn is_ahead_of(&self, other: &Self) -> bool {
        exceeds(&self.0, &other.0)
    }

    /// Returns `true` if this coordinate gains on the other right now.
    #[inline]
    pub(crate) fn gains_on(&self, other: &Self) -> bool {
        exceeds(&self.0[1..], &other.0[1..])
    }

    /// Returns the seconds from now until `rival` overtakes this coordinate, which is taken to be
    /// ahead; infinite if it never does.
    ///
    /// The lead d(s) = d₀ + d₁ s + d₂ s² of the rival starts at or below 0. At most one root has
    /// d' = √(d₁² − 4 d₀ d₂) > 0: that is where it overtakes. A positive d₀ is rounding. Then the
    /// derivatives decide: a rival that gains overtakes at once, any other has just been overtaken
    /// and starts from d₀ = 0. So a crossing that has been processed is never found again.
    #[inline]
    pub(crate) fn overtaken_in(&self, rival: &Self) -> f64 {
        let [lead, gain, bend] = [0, 1, 2].map(|k| rival.0[k] - self.0[k]);
        if lead >= 0.0 && rival.gains_on(self) {
            return 0.0;
        }
        let lead = lead.min(0.0);
        if bend == 0.0 {
            return if gain > 0.0 { -lead / gain } else { f64::INFINITY };
        }
        let square = gain * gain - 4.0 * lead * bend;
        if bend < 0.0 && (gain <= 0.0 || square <= 0.0) {
            return f64::INFINITY;
        }
        // Two forms of one root: neither subtracts numbers of equal sign.
        let root = square.sqrt();
        if gain > 0.0 {
            -2.0 * lead / (gain + root)
        } else {
            // Not zero by underflow: only a rival that gains overtakes at once.
            (0.5 * (root - gain) / bend).max(f64::MIN_POSITIVE)
        }
    }
}

/// Returns the time that is `wait` seconds after `now`. It is later than `now` unless `wait` is 0,
/// however small `wait` is: an event that is rescheduled makes progress.
#[inline]
pub(crate) fn later(now: f64, wait: f64) -> f64 {
    if wait == 0.0 { now } else { (now + wait).max(now.next_up()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wait(ahead: [f64; 3], rival: [f64; 3]) -> f64 {
        State(ahead).overtaken_in(&State(rival))
    }

    #[test]
    fn lines_cross_once() {
        assert_eq!(wait([1.0, 0.0, 0.0], [0.0, 0.5, 0.0]), 2.0, "half a unit a second");
        assert_eq!(wait([1.0, 0.0, 0.0], [0.0, -0.5, 0.0]), f64::INFINITY, "falls behind");
        assert_eq!(wait([1.0, 0.5, 0.0], [0.0, 0.5, 0.0]), f64::INFINITY, "parallel");
        assert_eq!(wait([1.0, 0.0, 0.0], [1.0, 0.5, 0.0]), 0.0, "level and faster");
    }

    #[test]
    fn parabolas_overtake_where_the_lead_rises() {
        // d = −1 + s²/… reaches zero at 2; d = −3 + 4 s − s² at 1, and returns at 3.
        assert_eq!(wait([1.0, 0.0, 0.0], [0.0, 0.0, 0.25]), 2.0, "starts level in velocity");
        assert_eq!(wait([3.0, 0.0, 0.0], [0.0, 4.0, -1.0]), 1.0, "overtakes");
        assert_eq!(wait([3.75, 1.0, -1.0], [3.0, 0.0, 0.0]), 1.5, "is overtaken again");
        assert_eq!(wait([3.0, 0.0, 0.0], [0.0, 2.0, -1.0]), f64::INFINITY, "turns back before");
        assert_eq!(wait([1.0, 0.0, 0.0], [0.0, 2.0, -1.0]), f64::INFINITY, "touches and turns back");
        assert_eq!(wait([0.0, 0.0, 0.0], [0.0, 0.0, 1.0]), 0.0, "level and accelerating");
    }

    #[test]
    fn rounding_at_a_crossing_is_no_second_crossing() {
        let [slow, fast] = [[1.0, 0.0, 0.0], [1.0 - 1e-16, 1.0, 0.0]];
        assert!(wait(slow, fast) < 1e-15, "about to overtake");
        assert_eq!(wait(fast, [1.0 + 1e-15, 0.0, 0.0]), f64::INFINITY, "has just been overtaken");
        let again = wait(fast, [1.0 + 1e-15, 0.0, 0.25]);
        assert!((again - 4.0).abs() < 1e-12, "{again}: comes back at the other root");
        assert_eq!(later(1.0, 1e-300), 1.0 + f64::EPSILON, "time goes on");
        assert_eq!(later(1.0, 0.0), 1.0, "at once");
    }
}
