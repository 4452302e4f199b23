//! An arm of six capsules, and the proof that a motion of its joints is free.

use nearmiss::{Pose, Scratch, Shape, Target};

pub(crate) const LINKS: usize = 6;

/// The angles of the joints.
pub(crate) type Angles = [f64; LINKS];

/// Axes of the joints, each in the frame of the link before it.
const AXES: [[f64; 3]; LINKS] =
    [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// Lengths of the links, and the radius of all, as shares of the length of the arm.
const LENGTHS: [f64; LINKS] = [0.16, 0.28, 0.24, 0.12, 0.12, 0.08];
const RADIUS: f64 = 0.03;

/// Intervals shorter than this are not split.
const SHORTEST: f64 = 1e-4;

/// An arm whose first joint is at `base`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Arm {
    pub(crate) base: [f64; 3],
    /// The sum of the lengths of the links.
    pub(crate) length: f64,
}

/// Two links, or a link and the room, and bounds on their distance.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Near {
    pub(crate) link: usize,
    /// The other link; `None` for the room.
    pub(crate) other: Option<usize>,
    pub(crate) lower: f64,
    pub(crate) upper: f64,
}

impl Arm {
    pub(crate) fn radius(&self) -> f64 {
        RADIUS * self.length
    }

    /// The capsules of the links.
    pub(crate) fn links(&self, angles: &Angles) -> [Shape<'static>; LINKS] {
        let mut at = Pose::from_translation(self.base);
        std::array::from_fn(|k| {
            at = at.after(&Pose::from_axis_angle(AXES[k], angles[k]));
            let tip = [LENGTHS[k] * self.length, 0.0, 0.0];
            let ends = [at.apply([0.0; 3]), at.apply(tip)];
            at = at.after(&Pose::from_translation(tip));
            Shape::Capsule { ends, radius: self.radius() }
        })
    }

    /// The pairs that matter, with their distances: each link and the room, and links that are no
    /// neighbours.
    pub(crate) fn pairs(
        &self,
        room: &Target<'_>,
        angles: &Angles,
        scratch: &mut Scratch,
        mut visit: impl FnMut(Near),
    ) {
        let links = self.links(angles);
        for (link, shape) in links.iter().enumerate() {
            let far = 2.0 * self.length;
            let found = room.distance(shape, far, scratch);
            let [lower, upper] = found.map_or([far, far], |found| [found.lower, found.upper]);
            visit(Near { link, other: None, lower, upper });
            for (other, near) in links.iter().enumerate().take(link.saturating_sub(1)) {
                let [lower, upper] = shape.gap_to(near).map_or([0.0; 2], |gap| [gap.lower, gap.upper]);
                visit(Near { link, other: Some(other), lower, upper });
            }
        }
    }

    /// The nearest pair of a link and the room, and that of two links.
    pub(crate) fn nearest_pairs(
        &self,
        room: &Target<'_>,
        angles: &Angles,
        scratch: &mut Scratch,
    ) -> [Near; 2] {
        let mut best = [Near { link: 0, other: None, lower: f64::INFINITY, upper: f64::INFINITY }; 2];
        self.pairs(room, angles, scratch, |near| {
            let of_kind = &mut best[usize::from(near.other.is_some())];
            if near.upper < of_kind.upper {
                *of_kind = near;
            }
        });
        best
    }

    /// A bound on how far the links of a pair move, one as seen from the other, while the joints turn by
    /// `turns`: a joint moves a place by no more than its angle times the length of the arm up to it.
    fn travel(&self, pair: &Near, turns: &Angles) -> f64 {
        let first = pair.other.map_or(0, |other| other + 1);
        let reach = |joint: usize| LENGTHS[joint..=pair.link].iter().sum::<f64>() + RADIUS;
        (first..=pair.link).map(|joint| turns[joint].abs() * reach(joint)).sum::<f64>() * self.length
    }
}

/// The angles at a time from 0 to 1.
pub(crate) fn between([from, to]: [&Angles; 2], time: f64) -> Angles {
    std::array::from_fn(|k| from[k] + (to[k] - from[k]) * time)
}

/// The proof that a leg of a path is free.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Proof {
    /// The distance that all pairs keep, proven.
    pub(crate) clearance: f64,
    pub(crate) intervals: u32,
}

/// Proves that a leg is free: in the middle of each interval all pairs are further apart than they can
/// move until its ends. Otherwise the interval is halved. Returns the time of the first doubt if there is
/// no proof.
pub(crate) fn prove(
    arm: &Arm,
    room: &Target<'_>,
    leg: [&Angles; 2],
    scratch: &mut Scratch,
) -> Result<Proof, f64> {
    let mut proof = Proof { clearance: f64::INFINITY, intervals: 0 };
    // The earliest on top.
    let mut open = vec![[0.0, 1.0]];
    while let Some([start, end]) = open.pop() {
        let (middle, half) = (0.5 * (start + end), 0.5 * (end - start));
        let turns = std::array::from_fn(|k| (leg[1][k] - leg[0][k]) * half);
        let (mut least, mut touches) = (f64::INFINITY, false);
        arm.pairs(room, &between(leg, middle), scratch, |near| {
            least = least.min(near.lower - arm.travel(&near, &turns));
            touches |= near.upper <= 0.0;
        });
        proof.intervals += 1;
        if least > 0.0 {
            proof.clearance = proof.clearance.min(least);
        } else if touches || end - start < SHORTEST {
            return Err(start);
        } else {
            open.extend([[middle, end], [start, middle]]);
        }
    }
    Ok(proof)
}
