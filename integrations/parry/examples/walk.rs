//! A character walks through a scanned building in a world of rapier, along a route on its slice map:
//! `cargo run --release -p nearmiss-parry --example walk -- SCAN X,Y,Z X,Y,Z`. The scan is in metres, z up:
//! a prepared scan (`.nm`), or a point cloud in any format that nearmiss reads. Both places are near a
//! floor.
//!
//! Prints where the feet are each second, and the time of a step. `--falls` lets the route go off edges.

#![expect(
    clippy::print_stdout,
    clippy::disallowed_methods,
    reason = "a program may print and read the clock"
)]

mod common;

use std::process::ExitCode;
use std::time::Instant;

use common::Failure;
use nearmiss::slices::{Avatar, AvatarOptions, Pixel, Route, SliceBuilder, SliceOptions, SlicePlan};
use nearmiss::{Aabb, PointCloud};
use nearmiss_parry::{Character, CharacterOptions, Obstacle, ScanDispatcher, ScanShape};
use rapier3d::parry::query::{DefaultQueryDispatcher, QueryDispatcher as _};
use rapier3d::prelude::*;

/// The speed of a walk, in metres a second.
const SPEED: f32 = 1.4;

/// Steps a second.
const RATE: u32 = 60;

/// Seconds after which the walk is given up.
const PATIENCE: u32 = 120;

/// A point of the route is reached within this distance across.
const NEAR: f32 = 0.1;

fn main() -> ExitCode {
    common::finish(run())
}

fn run() -> Result<(), Failure> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [path, from, to, ..] = words.as_slice() else {
        return Err("expected a scan and two places, SCAN X,Y,Z X,Y,Z".into());
    };
    let [from, to] = [place(from)?, place(to)?];
    let (scan, cloud) = common::open(path)?;
    println!("{} points, sampling radius {:.3}", scan.len(), scan.sampling_radius());
    let route = route(&cloud, scan.bounds(), [from, to], words.iter().any(|word| word == "--falls"))?;
    println!("a route of {} points", route.points.len());

    let mut world = PhysicsWorld::new();
    world.narrow_phase = NarrowPhase::with_query_dispatcher(ScanDispatcher.chain(DefaultQueryDispatcher));
    world.insert_collider(ColliderBuilder::new(ScanShape::new(scan)?.shared()), None);
    // Narrower than the avatar of the route, whose corners it turns.
    let options =
        CharacterOptions { up: Vector::Z, radius: 0.15, height: 1.6, ..CharacterOptions::default() };
    let mut walker = Character::new(&options, vector(from) + Vector::Z * 0.1)?;
    let shape = SharedShape::new(walker.capsule());
    let body = RigidBodyBuilder::kinematic_position_based().translation(walker.centre());
    let (body, _) = world.insert(body, ColliderBuilder::new(shape));
    let end = walk(&mut world, body, &mut walker, &route);
    let away = (vector(to) - walker.feet()).length();
    println!("{end} at {:.2}, {away:.2} from the goal", walker.feet());
    Ok(())
}

/// Walks along a route, and prints the way. Returns the reason why the walk ends.
fn walk(
    world: &mut PhysicsWorld,
    body: RigidBodyHandle,
    walker: &mut Character,
    route: &Route,
) -> &'static str {
    println!("seconds, x, y, z, next point, blocked steps, in the air, us a step");
    let (mut fall, mut next) = (0.0_f32, 0);
    let (mut blocked, mut air, mut took) = (0, 0, 0.0);
    for step in 0..PATIENCE * RATE {
        let way = loop {
            let Some(&[x, y]) = route.points.get(next) else { return "arrived" };
            let [x, y, _] = vector([x, y, 0.0]).to_array();
            let way = Vector::new(x - walker.feet().x, y - walker.feet().y, 0.0);
            if way.length() > NEAR {
                break way;
            }
            next += 1;
        };
        let clock = Instant::now();
        let pace = way.clamp_length_max(SPEED / 60.0);
        let wanted = pace - Vector::Z * (fall / 60.0);
        let queries = world.query_pipeline_with_filter(QueryFilter::default().exclude_rigid_body(body));
        let near = queries.intersect_aabb_conservative(walker.reach(wanted));
        let obstacles: Vec<Obstacle<'_>> =
            near.map(|(_, it)| Obstacle { pose: *it.position(), shape: it.shape() }).collect();
        let stride = walker.step(wanted, queries.dispatcher, &obstacles);
        took += clock.elapsed().as_secs_f64() * 1e6;
        fall = if stride.is_grounded { 0.0 } else { fall + 9.81 / 60.0 };
        blocked += u32::from(stride.is_blocked);
        air += u32::from(!stride.is_grounded);
        world.bodies[body].set_next_kinematic_translation(walker.centre());
        world.step();
        if step % RATE == RATE - 1 {
            let [x, y, z] = walker.feet().to_array();
            let (second, mean) = (step / RATE + 1, took / f64::from(RATE));
            println!("{second}, {x:.2}, {y:.2}, {z:.2}, {next}, {blocked}, {air}, {mean:.0}");
            (blocked, air, took) = (0, 0, 0.0);
        }
    }
    "gave up"
}

/// A short route on the slice map of a cloud.
fn route(cloud: &PointCloud, bounds: &Aabb, ends: [[f64; 3]; 2], falls: bool) -> Result<Route, Failure> {
    let options = SliceOptions::default().with_pixel(Pixel::Side(0.05));
    let mut builder = SliceBuilder::new(&SlicePlan::new(&options, bounds)?)?;
    builder.add_cloud(cloud);
    let avatar = Avatar::new(&AvatarOptions::default())?;
    Ok(Route::find(&builder.finish(), &avatar, ends, falls)?.route)
}

fn place(word: &str) -> Result<[f64; 3], Failure> {
    let numbers: Option<Vec<f64>> = word.split(',').map(|number| number.trim().parse().ok()).collect();
    let place = numbers.and_then(|numbers| numbers.try_into().ok());
    place.ok_or_else(|| format!("expected a place X,Y,Z, got {word:?}").into())
}

#[expect(clippy::cast_possible_truncation, reason = "rapier computes in single precision")]
fn vector(place: [f64; 3]) -> Vector {
    Vector::from_array(place.map(|c| c as f32))
}
