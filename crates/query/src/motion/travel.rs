//! Bounds on the length of the way of b's points, as seen from a, during a time interval.

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_geometry::{Pose, Screw};
use nearmiss_hierarchy::{Ball, NodeBounds};

/// More than the relative rounding error of a bound in single precision.
const ROUNDED_UP: f64 = 1.0 + 1e-6;

/// More than the rounding error of a pose of a screw, relative to the lengths that it is made of.
const POSE_ROUNDING: f64 = 1e-14;

/// A bound on the way of points from the middle of an interval to either end.
///
/// In the world, the two screws move the points at a place x with the velocities `v_a(x)` and
/// `v_b(x)`. Seen from a, a point of b at x moves with `v_b(x)` − `v_a(x)`, which is linear in x.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Travel {
    /// Half the length of the interval.
    half: f64,
    /// A place in the world and the relative velocity there.
    place: Vector3<f64>,
    velocity: Vector3<f64>,
    /// The relative angular velocity.
    turn: Vector3<f64>,
    /// The change of the speed of a point within the interval, as it moves to other places. Seen
    /// from a still a, each point of b has a constant speed.
    drift: f64,
    /// A bound on the way of b's points in the world if a moves; 0 if it does not.
    own: f64,
    /// The angle by which a turns.
    turn_of_a: f64,
    /// The poses of the stored frames.
    placed: [Pose; 2],
    /// The length in a's stored frame of one unit of the world.
    to_stored: f64,
    /// A bound on the rounding errors of both poses, in the world.
    pub(crate) rounding: f64,
}

impl Travel {
    /// Prepares bounds for an interval of length 2 `half`. `placed` are the poses of the stored
    /// frames in its middle, and `balls` contain both things.
    pub(crate) fn new(screws: &[Screw; 2], half: f64, placed: [&Pose; 2], balls: &[Ball; 2]) -> Self {
        let [a, b] = screws;
        let at = |k: usize| Vector3::from(placed[k].apply(balls[k].centre));
        let radius = |k: usize| balls[k].radius * placed[k].scale();
        let place = at(1);
        let of = |screw: &Screw| Vector3::from(screw.velocity(place.into()));
        let turns = [a, b].map(|screw| Vector3::from(screw.turn()));
        let turn = turns[1] - turns[0];
        let is_still = |screw: &Screw| of(screw) == Vector3::zeros() && screw.turn() == [0.0; 3];
        let own_speed = of(b).norm() + turns[1].norm() * radius(1);
        let own = if is_still(a) || half == 0.0 { 0.0 } else { half * own_speed };
        let rounding = |k: usize| {
            let start = screws[k].start().translation();
            let shift = Vector3::from(screws[k].velocity(start)).norm();
            let start = Vector3::from(start);
            let arms = start.norm() + at(k).norm() + (at(k) - start).norm() + radius(k);
            (arms + shift) * (1.0 + turns[k].norm())
        };
        Self {
            half,
            place,
            velocity: of(b) - of(a),
            turn,
            drift: turn.norm() * own,
            own,
            turn_of_a: half * turns[0].norm(),
            placed: placed.map(|pose| *pose),
            to_stored: ROUNDED_UP / placed[0].scale(),
            rounding: POSE_ROUNDING * (rounding(0) + rounding(1)),
        }
    }

    /// A bound on the way of any point of a ball in b's stored frame, in the world.
    pub(crate) fn of_ball(&self, centre: [f64; 3], radius: f64) -> f64 {
        if self.half == 0.0 {
            return 0.0;
        }
        let arm = Vector3::from(self.placed[1].apply(centre)) - self.place;
        let at_centre = (self.velocity + self.turn.cross(&arm)).norm();
        let speed = at_centre + self.turn.norm() * radius * self.placed[1].scale() + self.drift;
        self.half * speed * ROUNDED_UP
    }

    /// A bound on the way of any point of a node of b, in a's stored frame.
    pub(crate) fn of_node(&self, bounds: &NodeBounds<f32>) -> f32 {
        self.stored(self.of_ball(bounds.centre.map(f64::from), f64::from(radius(bounds))))
    }

    /// A lower bound, for the whole interval, of the distance of the enclosures of two nodes in the
    /// world, less the rounding error of the boxes: along the face normal for which it is greatest.
    /// `way` is [`Self::of_ball`] of b's node.
    ///
    /// Nodes that slide past each other have a gap that changes little along the normal.
    pub(crate) fn gap_along_normals(&self, nodes: [&NodeBounds<f32>; 2], way: f64) -> f64 {
        let [a, b] = [0, 1].map(|k| WorldBox::new(nodes[k], &self.placed[k]));
        let between = b.centre - a.centre;
        let arm = b.centre - self.place;
        let at_centre = self.velocity + self.turn.cross(&arm);
        let lever = f64::from(radius(nodes[1])) * self.placed[1].scale() + self.own.max(way);
        let mut greatest = f64::NEG_INFINITY;
        for axis in a.axes.iter().chain(&b.axes) {
            let normal = if axis.dot(&between) < 0.0 { -axis } else { *axis };
            let gap = normal.dot(&between) - a.extent(&normal) - b.extent(&-normal);
            let speed = normal.dot(&at_centre).abs() + normal.cross(&self.turn).norm() * lever;
            greatest = greatest.max(gap - (self.half * speed + self.turn_of_a * way) * ROUNDED_UP);
        }
        greatest
    }

    /// Converts a length in the world to a's stored frame, rounded up.
    #[expect(clippy::cast_possible_truncation, reason = "rounded up")]
    pub(crate) fn stored(&self, length: f64) -> f32 {
        (length * self.to_stored) as f32
    }
}

/// The radius of a ball about the centre of a node's box that contains its enclosure.
pub(crate) fn radius(NodeBounds { half, low, high, .. }: &NodeBounds<f32>) -> f32 {
    let reach = [0, 1, 2].map(|k| half[k] + low[k].max(high[k]));
    reach.iter().map(|x| x * x).sum::<f32>().sqrt() * (1.0 + 1e-6)
}

/// The enclosure of a node in the world.
struct WorldBox {
    centre: Vector3<f64>,
    axes: [Vector3<f64>; 3],
    /// The distances from the centre to the faces, against and along the axes.
    low: [f64; 3],
    high: [f64; 3],
}

impl WorldBox {
    fn new(bounds: &NodeBounds<f32>, placed: &Pose) -> Self {
        let reach = |k: usize, growth: f32| (f64::from(bounds.half[k]) + f64::from(growth)) * placed.scale();
        Self {
            centre: placed.apply(bounds.centre.map(f64::from)).into(),
            axes: bounds.axes.map(|axis| placed.rotate(axis.map(f64::from)).into()),
            low: [0, 1, 2].map(|k| reach(k, bounds.low[k])),
            high: [0, 1, 2].map(|k| reach(k, bounds.high[k])),
        }
    }

    /// The greatest distance of any point from the centre along `normal`.
    fn extent(&self, normal: &Vector3<f64>) -> f64 {
        let along = |k: usize| {
            let share = normal.dot(&self.axes[k]);
            share * if share < 0.0 { -self.low[k] } else { self.high[k] }
        };
        along(0) + along(1) + along(2)
    }
}
