//! Fast bodies do not pass through a scan, and a scanned object comes to rest on a scanned table.

use nearmiss::geometry::PointCloud;
use nearmiss::{BuildOptions, GraphOptions, Scan};
use nearmiss_parry::{ScanDispatcher, ScanShape};
use nearmiss_testdata::shapes::{Order, Sampling, patch, torus};
use rapier3d::parry::query::{DefaultQueryDispatcher, QueryDispatcher as _};
use rapier3d::prelude::*;

fn scanned(points: &[[f64; 3]]) -> ScanShape {
    let cloud = PointCloud::from_positions(points).expect("points");
    ScanShape::new(Scan::build(&cloud, &BuildOptions::default()).expect("a scan")).expect("for shapes")
}

/// A square of z = 0 about the origin.
fn table(size: f64) -> ScanShape {
    let sampling = Sampling { spacing: 0.03, noise: 0.0, order: Order::Random, seed: 1 };
    scanned(&patch(size, size).sample(sampling).points)
}

fn world(gravity: f32) -> PhysicsWorld {
    let mut world = PhysicsWorld::new();
    world.gravity = Vector::Z * -gravity;
    world.narrow_phase = NarrowPhase::with_query_dispatcher(ScanDispatcher.chain(DefaultQueryDispatcher));
    world
}

#[test]
fn fast_bodies_do_not_pass_through_a_scan() {
    let mut world = world(0.0);
    world.insert_collider(ColliderBuilder::new(table(4.0).shared()).friction(0.5), None);
    let shapes = [
        SharedShape::ball(0.05),
        SharedShape::cuboid(0.05, 0.04, 0.06),
        SharedShape::capsule_x(0.05, 0.03),
        SharedShape::cylinder(0.05, 0.04),
        SharedShape::cone(0.05, 0.05),
        SharedShape::round_cuboid(0.03, 0.03, 0.03, 0.02),
    ];
    let bodies: Vec<RigidBodyHandle> = (0_u8..)
        .zip(&shapes)
        .map(|(k, shape)| {
            // More than a metre a step, with a spin of half a turn a step.
            let x = f32::from(k) * 0.5 - 1.25;
            let body = RigidBodyBuilder::dynamic()
                .translation(Vector::new(x, 0.0, 1.0 + 0.37 * f32::from(k)))
                .linvel(Vector::new(3.0, 1.0, -80.0))
                .angvel(Vector::new(100.0, 100.0, 0.0));
            world.insert(body, ColliderBuilder::new(shape.clone()).density(500.0)).0
        })
        .collect();
    for _ in 0..20 {
        world.step();
        for (shape, &body) in shapes.iter().zip(&bodies) {
            let z = world.bodies[body].center_of_mass().z;
            assert!(z > 0.0, "a {:?} is at {z}, behind the surface", shape.shape_type());
        }
    }
    let slowed = bodies.iter().filter(|&&body| world.bodies[body].linvel().z > -1.0).count();
    assert_eq!(slowed, bodies.len(), "all of them hit the scan");
}

#[test]
fn a_scanned_object_comes_to_rest_on_a_scanned_table() {
    let sampling = Sampling { spacing: 0.03, noise: 0.0, order: Order::Random, seed: 2 };
    let cloud = PointCloud::from_positions(&torus(0.3, 0.1).sample(sampling).points).expect("points");
    // Oriented: the inside of a ring is not where its centre is.
    let ring = Scan::build(&cloud, &BuildOptions::default()).expect("a scan");
    let ring = ring.with_graph(&cloud, &GraphOptions::default(), None).expect("a graph");
    let ring = ScanShape::new(ring).expect("for shapes").solid().expect("it is closed");
    let exact = 2.0 * std::f32::consts::PI.powi(2) * 0.3 * 0.01;
    let rest = || {
        let mut world = world(9.81);
        world.insert_collider(ColliderBuilder::new(table(2.0).shared()).friction(0.6), None);
        let pose = Pose::new(Vector::new(0.0, 0.0, 0.5), Vector::new(0.5, 0.2, 0.0));
        let body = RigidBodyBuilder::dynamic().pose(pose);
        let collider = ColliderBuilder::new(ring.clone().shared()).density(500.0).friction(0.6);
        let (body, _) = world.insert(body, collider);
        let mass = world.bodies[body].mass();
        assert!((mass / (500.0 * exact) - 1.0).abs() < 0.05, "{mass} kg");
        let energy = |world: &PhysicsWorld| {
            let body = &world.bodies[body];
            body.kinetic_energy() + body.mass() * 9.81 * body.center_of_mass().z
        };
        let (start, mut most) = (energy(&world), 0.0_f32);
        for _ in 0..300 {
            world.step();
            most = most.max(energy(&world));
        }
        assert!(most <= start * 1.001, "energy rose from {start} to {most} J");
        let body = &world.bodies[body];
        (body.center_of_mass(), body.position().rotation * Vector::Z, body.linvel().length())
    };
    let (centre, axis, speed) = rest();
    assert!(speed < 0.01, "it still moves at {speed} m/s");
    assert!((centre.z - 0.1).abs() < 0.01 && axis.z.abs() > 0.999, "it lies at {centre}, its axis is {axis}");
    assert_eq!(rest().0, centre, "the same world twice");
}
