//! A small solver of rigid bodies on a scan: semi-implicit Euler, sequential impulses with friction
//! (Catto 2005). No damping, no sleeping.

use nearmiss::geometry::nalgebra::{Matrix3, UnitQuaternion, Vector3};
use nearmiss::{Pose, Scratch, Shape, ShapeContact, ShapeHint, Target};

type Vector = Vector3<f64>;

pub(crate) const GRAVITY: f64 = 9.81;
const ITERATIONS: u32 = 30;

/// The share of a depth that is removed in each step, and the depth that is left.
const PUSH: f64 = 0.2;
const SLOP: f64 = 1e-3;

/// A ball, box, cylinder or capsule of mass 1.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Kind {
    Ball {
        radius: f64,
    },
    Box {
        half: [f64; 3],
    },
    /// Along its own y axis.
    Cylinder {
        half: f64,
        radius: f64,
    },
    /// Along its own x axis.
    Capsule {
        half: f64,
        radius: f64,
    },
}

impl Kind {
    /// The principal moments of inertia.
    fn moments(self) -> Vector {
        match self {
            Self::Ball { radius } => Vector::repeat(0.4 * radius * radius),
            Self::Box { half: [x, y, z] } => Vector::new(y * y + z * z, z * z + x * x, x * x + y * y) / 3.0,
            Self::Cylinder { half, radius } => {
                let across = 0.25 * radius * radius + half * half / 3.0;
                Vector::new(across, 0.5 * radius * radius, across)
            }
            // A cylinder and a ball, by volume.
            Self::Capsule { half, radius } => {
                let (of_ball, of_cylinder) = (4.0 / 3.0 * radius, 2.0 * half);
                let share = of_cylinder / (of_ball + of_cylinder);
                let sq = radius * radius;
                let along = share * 0.5 * sq + (1.0 - share) * 0.4 * sq;
                let ends = (1.0 - share) * (0.4 * sq + half * half + 0.75 * half * radius);
                let across = share * (0.25 * sq + half * half / 3.0) + ends;
                Vector::new(along, across, across)
            }
        }
    }
}

/// The impulses of a contact, kept by its id from step to step.
#[derive(Debug, Clone, Copy)]
struct Held {
    contact: ShapeContact,
    /// Along the normal and two tangents.
    impulses: [f64; 3],
}

/// A rigid body.
#[derive(Debug)]
pub(crate) struct Body {
    pub(crate) kind: Kind,
    pub(crate) place: Vector,
    pub(crate) turn: UnitQuaternion<f64>,
    pub(crate) velocity: Vector,
    pub(crate) spin: Vector,
    pub(crate) friction: f64,
    /// The resistance to rolling: a length, by which the force of the ground is ahead of the contact.
    pub(crate) rolling: f64,
    hint: ShapeHint,
    held: Vec<Held>,
    found: Vec<ShapeContact>,
}

impl Body {
    pub(crate) fn new(
        kind: Kind,
        place: [f64; 3],
        turn: UnitQuaternion<f64>,
        [friction, rolling]: [f64; 2],
    ) -> Self {
        let (velocity, spin, hint) = (Vector::zeros(), Vector::zeros(), ShapeHint::default());
        let (held, found) = (Vec::new(), Vec::new());
        Self { kind, place: place.into(), turn, velocity, spin, friction, rolling, hint, held, found }
    }

    fn shape(&self) -> Shape<'static> {
        let q = self.turn.coords;
        let pose = Pose::new(self.place.into(), [q.x, q.y, q.z, q.w]);
        match self.kind {
            Kind::Ball { radius } => Shape::Sphere { centre: self.place.into(), radius },
            Kind::Box { half } => Shape::Box { pose, half, radius: 0.0 },
            Kind::Cylinder { half, radius } => {
                Shape::Cylinder { pose, half_height: half, radius, rounding: 0.0 }
            }
            Kind::Capsule { half, radius } => {
                let along = self.turn * Vector::x() * half;
                Shape::Capsule { ends: [(self.place - along).into(), (self.place + along).into()], radius }
            }
        }
    }

    /// The kinetic energy, for mass 1.
    pub(crate) fn energy(&self) -> f64 {
        let own = self.turn.inverse_transform_vector(&self.spin);
        0.5 * (self.velocity.norm_squared() + own.component_mul(&self.kind.moments()).dot(&own))
    }

    /// The number of contacts in the last step.
    pub(crate) fn contacts(&self) -> usize {
        self.held.len()
    }

    /// Moves the body by one step of `dt`. `target` has a margin, so that contacts are known before
    /// they touch.
    pub(crate) fn step(&mut self, target: &Target<'_>, dt: f64, scratch: &mut Scratch) {
        self.velocity.z -= GRAVITY * dt;
        target.contacts_hinted(&self.shape(), &mut self.hint, &mut self.found, scratch);
        let known = std::mem::take(&mut self.held);
        self.held.extend(self.found.iter().map(|&contact| {
            let same = known.iter().find(|held| held.contact.id == contact.id);
            Held { contact, impulses: same.map_or([0.0; 3], |held| held.impulses) }
        }));
        let axes = self.turn.to_rotation_matrix().into_inner();
        let inverse = axes * Matrix3::from_diagonal(&self.kind.moments().map(f64::recip)) * axes.transpose();
        let mut held = std::mem::take(&mut self.held);
        for Held { contact, impulses } in &held {
            let frame = frame(contact);
            let impulse = frame[0] * impulses[0] + frame[1] * impulses[1] + frame[2] * impulses[2];
            self.push(&inverse, contact, impulse);
        }
        let mut resisted = Vector::zeros();
        for _ in 0..ITERATIONS {
            let load: f64 = held.iter().map(|held| held.impulses[0]).sum();
            let wanted =
                resisted - axes * (self.kind.moments().component_mul(&(axes.transpose() * self.spin)));
            let kept = wanted.cap_magnitude(self.rolling * load);
            self.spin += inverse * (kept - resisted);
            resisted = kept;
            for Held { contact, impulses } in &mut held {
                let (frame, arm) = (frame(contact), Vector::from(contact.point) - self.place);
                for axis in [1, 2, 0] {
                    let speed = frame[axis].dot(&(self.velocity + self.spin.cross(&arm)));
                    let lever = arm.cross(&frame[axis]);
                    // A gap may close within the step.
                    let allowed = if axis == 0 { contact.depth.min(0.0) / dt } else { 0.0 };
                    let change = (allowed - speed) / (1.0 + lever.dot(&(inverse * lever)));
                    let (low, high) = if axis == 0 {
                        (0.0, f64::INFINITY)
                    } else {
                        (-self.friction * impulses[0], self.friction * impulses[0])
                    };
                    let kept = (impulses[axis] + change).clamp(low, high);
                    let change = kept - impulses[axis];
                    impulses[axis] = kept;
                    self.push(&inverse, contact, frame[axis] * change);
                }
            }
        }
        self.place += self.velocity * dt;
        self.turn = UnitQuaternion::from_scaled_axis(self.spin * dt) * self.turn;
        self.turn.renormalize();
        // Depths are removed from places, not by velocities.
        if let Some(deepest) = self.found.first() {
            self.place += Vector::from(deepest.normal) * (PUSH * (deepest.depth - SLOP).max(0.0));
        }
        self.held = held;
    }

    fn push(&mut self, inverse: &Matrix3<f64>, contact: &ShapeContact, impulse: Vector) {
        self.velocity += impulse;
        self.spin += inverse * (Vector::from(contact.point) - self.place).cross(&impulse);
    }
}

/// The normal and two tangents of a contact.
fn frame(contact: &ShapeContact) -> [Vector; 3] {
    let normal = Vector::from(contact.normal);
    let other = if normal.x.abs() < 0.6 { Vector::x() } else { Vector::y() };
    let tangent = normal.cross(&other).normalize();
    [normal, tangent, normal.cross(&tangent)]
}
