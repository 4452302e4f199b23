//! Bodies of mixed shapes that fall onto a fixed shape, in a world of rapier.

use nearmiss_parry::ScanDispatcher;
use rand::RngExt as _;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng as _;
use rapier3d::parry::query::{DefaultQueryDispatcher, QueryDispatcher as _};
use rapier3d::prelude::*;

/// Acceleration of gravity, against z.
pub(crate) const GRAVITY: f32 = 9.81;

/// A world with bodies that fall.
pub(crate) struct Drop {
    pub(crate) world: PhysicsWorld,
    pub(crate) bodies: Vec<RigidBodyHandle>,
    ground: ColliderHandle,
}

/// A shape of the k-th kind, at most `size` from its centre.
fn shape(k: usize, size: f32) -> SharedShape {
    match k % 6 {
        0 => SharedShape::ball(0.7 * size),
        1 => SharedShape::cuboid(0.6 * size, 0.5 * size, 0.4 * size),
        2 => SharedShape::capsule_z(0.5 * size, 0.4 * size),
        3 => SharedShape::cylinder(0.5 * size, 0.6 * size),
        4 => SharedShape::round_cuboid(0.4 * size, 0.4 * size, 0.3 * size, 0.1 * size),
        _ => SharedShape::cone(0.6 * size, 0.6 * size),
    }
}

impl Drop {
    /// Bodies of at most 0.25 from their centres, each above one of `places`. Nothing damps them, and
    /// none sleeps.
    pub(crate) fn new(ground: SharedShape, places: &[[f32; 3]], seed: u64) -> Self {
        let mut world = PhysicsWorld::new();
        world.gravity = Vector::Z * -GRAVITY;
        world.narrow_phase = NarrowPhase::with_query_dispatcher(ScanDispatcher.chain(DefaultQueryDispatcher));
        let ground = world.insert_collider(ColliderBuilder::new(ground).friction(0.7), None);
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let bodies = (0..).zip(places).map(|(k, place)| {
            let size = random.random_range(0.12..0.25_f32);
            let turn = [0; 3].map(|_| random.random_range(-1.5..1.5_f32));
            let pose = Pose::new(Vector::from_array(*place), Vector::from_array(turn));
            let body = RigidBodyBuilder::dynamic().pose(pose).can_sleep(false);
            let collider = ColliderBuilder::new(shape(k, size)).density(500.0).friction(0.7);
            world.insert(body, collider).0
        });
        let bodies = bodies.collect();
        Self { world, bodies, ground }
    }

    /// The kinetic energy, and that of height above z = 0, in joules.
    pub(crate) fn energy(&self) -> [f64; 2] {
        let mut sum = [0.0; 2];
        for body in self.bodies.iter().filter_map(|&handle| self.world.bodies.get(handle)) {
            sum[0] += f64::from(body.kinetic_energy());
            sum[1] += f64::from(body.mass() * GRAVITY * body.center_of_mass().z);
        }
        sum
    }

    pub(crate) fn positions(&self) -> Vec<Vector> {
        let body = |&handle: &RigidBodyHandle| self.world.bodies.get(handle);
        self.bodies.iter().filter_map(body).map(RigidBody::center_of_mass).collect()
    }

    pub(crate) fn speeds(&self) -> Vec<f32> {
        let body = |&handle: &RigidBodyHandle| self.world.bodies.get(handle);
        self.bodies.iter().filter_map(body).map(|body| body.linvel().length()).collect()
    }

    /// The greatest depth of a contact with the ground.
    pub(crate) fn deepest(&self) -> f32 {
        let pairs = self.world.narrow_phase.contact_pairs_with(self.ground);
        let points = pairs.flat_map(|pair| pair.manifolds()).flat_map(|manifold| &manifold.points);
        points.fold(0.0, |deepest, point| deepest.max(-point.dist))
    }
}
