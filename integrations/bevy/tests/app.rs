//! An app without a window: scans are loaded, asked, and tell their contacts; bad files are told as well.

use std::fs;
use std::path::Path;
use std::sync::{Arc, Mutex};

use bevy_app::{App, TaskPoolPlugin, Update};
use bevy_asset::{AssetPlugin, AssetServer, Assets, LoadState};
use bevy_ecs::message::Messages;
use bevy_ecs::prelude::*;
use bevy_ecs::system::{RunSystemOnce, SystemState};
use bevy_math::{Dir3, Quat, Ray3d, Vec3};
use bevy_transform::TransformPlugin;
use bevy_transform::components::Transform;
use nearmiss::geometry::PointCloud;
use nearmiss::{
    BuildOptions, CollideOptions, CollidePlan, Pair, Pose, Scan, Scratch, Semantics, Shape, ShapePlan, Target,
};
use nearmiss_bevy::{
    ContactPhase, ScanAsset, ScanCollider, ScanContact, ScanPlugin, ScanWorld, Scans, pose_of, ray_of,
    sphere_of,
};
use nearmiss_testdata::arbitrary::{point_in, rng, rotation};
use nearmiss_testdata::shapes::{Order, Sampling, patch, torus};
use tempfile::TempDir;
use tracing::field::{Field, Visit};
use tracing::span::{Attributes, Id, Record};
use tracing::{Event, Level, Metadata, Subscriber};

/// Frames after which a load counts as stuck. Each takes a millisecond or so.
const PATIENCE: u32 = 20_000;

fn app(folder: &Path) -> App {
    app_with(folder, ScanPlugin::default())
}

fn app_with(folder: &Path, plugin: ScanPlugin) -> App {
    let mut app = App::new();
    let file_path = folder.to_string_lossy().into_owned();
    app.add_plugins((
        TaskPoolPlugin::default(),
        AssetPlugin { file_path, ..AssetPlugin::default() },
        TransformPlugin,
        plugin,
    ));
    app
}

fn points_of_torus() -> Vec<[f64; 3]> {
    torus(1.0, 0.4).sample(Sampling { spacing: 0.1, noise: 0.0, order: Order::Random, seed: 1 }).points
}

fn scan_of(points: &[[f64; 3]]) -> Scan {
    let cloud = PointCloud::from_positions(points).expect("points");
    Scan::build(&cloud, &BuildOptions::default()).expect("a scan")
}

fn floor() -> Scan {
    let sampling = Sampling { spacing: 0.1, noise: 0.0, order: Order::Random, seed: 2 };
    scan_of(&patch(8.0, 8.0).sample(sampling).points)
}

/// Adds a scan without a file.
fn spawn(app: &mut App, scan: &Scan, transform: Transform) -> Entity {
    let asset = app.world_mut().resource_mut::<Assets<ScanAsset>>().add(ScanAsset(scan.clone()));
    app.world_mut().spawn((ScanCollider(asset), transform)).id()
}

fn place(app: &mut App, entity: Entity, transform: Transform) {
    app.world_mut().entity_mut(entity).insert(transform);
}

/// The contacts of the last frame.
fn contacts(app: &mut App) -> Vec<ScanContact> {
    app.world_mut().resource_mut::<Messages<ScanContact>>().drain().collect()
}

/// A file with the points, as text.
fn write(folder: &Path, name: &str, points: &[[f64; 3]]) {
    let lines: Vec<String> = points.iter().map(|[x, y, z]| format!("{x} {y} {z}")).collect();
    fs::write(folder.join(name), lines.join("\n")).expect("a file");
}

/// Keeps the errors that are logged.
#[derive(Clone, Default)]
struct Errors(Arc<Mutex<Vec<String>>>);

impl Subscriber for Errors {
    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        *metadata.level() == Level::ERROR
    }

    fn new_span(&self, _: &Attributes<'_>) -> Id {
        Id::from_u64(1)
    }

    fn record(&self, _: &Id, _: &Record<'_>) {}
    fn record_follows_from(&self, _: &Id, _: &Id) {}
    fn enter(&self, _: &Id) {}
    fn exit(&self, _: &Id) {}

    fn event(&self, event: &Event<'_>) {
        struct Text(String);
        impl Visit for Text {
            fn record_debug(&mut self, _: &Field, value: &dyn std::fmt::Debug) {
                self.0 += &format!("{value:?} ");
            }
        }
        let mut text = Text(String::new());
        event.record(&mut text);
        self.0.lock().expect("no panic").push(text.0);
    }
}

#[test]
fn files_are_loaded_and_bad_ones_are_told() {
    let errors = Errors::default();
    tracing::subscriber::set_global_default(errors.clone()).expect("the only one");
    let folder = TempDir::new().expect("a folder");
    write(folder.path(), "raw.xyz", &points_of_torus());
    scan_of(&points_of_torus()).save(folder.path().join("prepared.nm")).expect("saved");
    fs::write(folder.path().join("broken.nm"), b"nothing of the kind").expect("a file");
    fs::write(folder.path().join("broken.ply"), b"ply\nformat ascii 1.0\nelement vertex 99\n")
        .expect("a file");
    let mut damaged = fs::read(folder.path().join("prepared.nm")).expect("a file");
    let middle = damaged.len() / 2;
    damaged.truncate(middle);
    fs::write(folder.path().join("short.nm"), damaged).expect("a file");

    let mut app = app(folder.path());
    let names = ["raw.xyz", "prepared.nm", "broken.nm", "broken.ply", "short.nm", "missing.nm"];
    let handles = names.map(|name| app.world().resource::<AssetServer>().load::<ScanAsset>(name));
    let entities: Vec<Entity> = (0_u8..)
        .zip(&handles)
        .map(|(k, handle)| {
            let transform = Transform::from_xyz(0.0, 0.0, 5.0 * f32::from(k));
            app.world_mut().spawn((ScanCollider(handle.clone()), transform)).id()
        })
        .collect();
    let states = |app: &App| {
        let server = app.world().resource::<AssetServer>();
        handles.each_ref().map(|handle| server.load_state(handle))
    };
    let is_over = |state: &LoadState| matches!(state, LoadState::Loaded | LoadState::Failed(_));
    for _ in 0..PATIENCE {
        app.update();
        if states(&app).iter().all(is_over) {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    app.update();
    for (name, state) in names.iter().zip(states(&app)) {
        let loads = ["raw.xyz", "prepared.nm"].contains(name);
        assert!(if loads { state.is_loaded() } else { state.is_failed() }, "{name}: {state:?}");
    }
    let placed: Vec<bool> = {
        let world = app.world().resource::<ScanWorld>();
        entities.iter().map(|&entity| world.body_of(entity).is_some()).collect()
    };
    assert_eq!(placed, [true, true, false, false, false, false], "{names:?}");
    let told = errors.0.lock().expect("no panic").clone();
    for name in &names[2..] {
        assert!(told.iter().any(|line| line.contains(name)), "{name} is not told: {told:#?}");
    }

    // A ray from above hits the raw scan, which is the lower one, where the library says.
    let answer = app.world_mut().run_system_once(|mut scans: Scans<'_, '_>| {
        let up = Ray3d::new(Vec3::new(1.0, 0.0, -5.0), Dir3::Z);
        scans.cast(&ray_of(up, 100.0))
    });
    let (entity, hit) = answer.expect("a system").expect("a hit");
    assert_eq!(entity, entities[0], "{hit:?}");
    assert!((hit.t - 4.6).abs() < 0.02, "{hit:?}");

    // An uneven scale is told, and the scan leaves the world.
    place(&mut app, entities[0], Transform::from_scale(Vec3::new(1.0, 2.0, 1.0)));
    app.update();
    assert!(app.world().resource::<ScanWorld>().body_of(entities[0]).is_none(), "it is no similarity");
    let last = errors.0.lock().expect("no panic").last().cloned().unwrap_or_default();
    assert!(last.contains("is not placed") && last.contains("scale"), "{last}");
    place(&mut app, entities[0], Transform::IDENTITY);
    app.update();
    assert!(app.world().resource::<ScanWorld>().body_of(entities[0]).is_some(), "it is back");
}

#[test]
fn contacts_begin_stay_and_end() {
    let folder = TempDir::new().expect("a folder");
    let mut app = app(folder.path());
    let ring = scan_of(&points_of_torus());
    let floor = spawn(&mut app, &floor(), Transform::IDENTITY);
    let above = |z: f32| Transform::from_xyz(0.0, 0.0, z);
    let ring = spawn(&mut app, &ring, above(2.0));
    // Systems of the app receive the messages as well.
    #[derive(Resource, Default)]
    struct Heard(usize);
    app.init_resource::<Heard>();
    app.add_systems(Update, |mut heard: ResMut<'_, Heard>, mut all: MessageReader<'_, '_, ScanContact>| {
        heard.0 += all.read().count();
    });
    app.update();
    assert!(contacts(&mut app).is_empty(), "they are apart");
    let phases = |app: &mut App| {
        app.update();
        let found = contacts(app);
        found.iter().for_each(|it| assert_eq!(it.entities, [floor, ring], "{it:?}"));
        found
            .iter()
            .for_each(|it| assert_eq!(it.points.is_empty(), it.phase == ContactPhase::Ended, "{it:?}"));
        found.into_iter().map(|it| it.phase).collect::<Vec<_>>()
    };
    place(&mut app, ring, above(0.39));
    assert_eq!(phases(&mut app), [ContactPhase::Began], "it is lowered");
    assert!(phases(&mut app).is_empty(), "nothing moves");
    place(&mut app, ring, above(0.38));
    assert_eq!(phases(&mut app), [ContactPhase::Stays], "it is lowered further");
    place(&mut app, ring, above(3.0));
    assert_eq!(phases(&mut app), [ContactPhase::Ended], "it is lifted far away");
    place(&mut app, ring, above(0.39));
    assert_eq!(phases(&mut app), [ContactPhase::Began], "it is back");
    app.world_mut().despawn(ring);
    assert_eq!(phases(&mut app), [ContactPhase::Ended], "it is gone");
    assert!(phases(&mut app).is_empty(), "and stays so");

    // Systems of the next frame read them.
    let ring = scan_of(&points_of_torus());
    let _ring = spawn(&mut app, &ring, above(0.39));
    app.update();
    app.update();
    assert_eq!(app.world().resource::<Heard>().0, 1, "a system reads each message once");
}

#[test]
fn answers_equal_those_of_the_library() {
    compare_answers(CollideOptions::estimated());
}

#[test]
fn answers_about_thickened_points_equal_those_of_the_library() {
    compare_answers(CollideOptions::estimated().with_semantics(Semantics::Thickened(0.2)));
}

fn compare_answers(options: CollideOptions) {
    let folder = TempDir::new().expect("a folder");
    let mut app = app_with(folder.path(), ScanPlugin { options });
    let (ring, floor) = (scan_of(&points_of_torus()), floor());
    let on_floor = spawn(&mut app, &floor, Transform::IDENTITY);
    let moving = spawn(&mut app, &ring, Transform::IDENTITY);
    app.update();
    let mut state = SystemState::<Scans<'_, '_>>::new(app.world_mut());
    let plan = CollidePlan::new(&options, &floor, &ring).expect("a plan");
    let of_shapes = [&floor, &ring].map(|scan| ShapePlan::new(&options, scan).expect("a plan"));
    let (rng, mut scratch) = (&mut rng(7), Scratch::default());
    let (mut meets, mut hits, mut touches, mut nears) = (0, 0, 0, 0);
    let (mut entities, mut found) = (Vec::new(), Vec::new());
    for round in 0..1000 {
        let turn = rotation(rng);
        #[expect(clippy::cast_possible_truncation, reason = "Bevy computes in single precision")]
        let place_at = |p: [f64; 3]| Vec3::from_array(p.map(|c| c as f32));
        let axis = place_at(turn.rotate([0.0, 0.0, 1.0]));
        let transform = Transform::from_translation(place_at(point_in(rng, 2.0)))
            .with_rotation(Quat::from_rotation_arc(Vec3::Z, axis.normalize()));
        place(&mut app, moving, transform);
        app.update();
        let pose = pose_of(&transform.into()).expect("a pose");
        let placed = [floor.at(&Pose::IDENTITY), ring.at(&pose)];
        let targets = [0, 1].map(|k| Target::new(placed[k], &of_shapes[k]));

        let meet = Pair::new(placed[0], placed[1]).collide(&plan, &mut scratch).verdict.is_intersecting();
        let mut scans = state.get_mut(app.world_mut()).expect("valid");
        scans.overlapping(moving, &mut entities);
        assert_eq!(!entities.is_empty(), meet, "round {round}: {entities:?}");
        meets += u32::from(meet);

        let origin = place_at(point_in(rng, 3.0));
        let direction = Dir3::new(place_at(point_in(rng, 1.0))).expect("a direction");
        let ray = ray_of(Ray3d::new(origin, direction), 4.0);
        let expected = targets.map(|target| target.cast(&ray, &mut scratch).hit);
        let first = [on_floor, moving].into_iter().zip(expected).filter_map(|(e, hit)| Some((e, hit?)));
        let first = first.min_by(|a, b| a.1.t.total_cmp(&b.1.t));
        assert_eq!(scans.cast(&ray), first, "round {round}");
        hits += u32::from(first.is_some());

        let ball = sphere_of(origin, 0.5);
        let expected = targets.map(|target| target.touch(&ball, &mut scratch).verdict.is_touching());
        scans.touching(&ball, &mut entities);
        assert_eq!([on_floor, moving].map(|it| entities.contains(&it)), expected, "round {round}");
        touches += u32::from(expected[0] || expected[1]);
        scans.contacts(&ball, &mut found);
        for ((entity, target), touches) in [on_floor, moving].into_iter().zip(&targets).zip(expected) {
            let mut own = Vec::new();
            target.contacts(&ball, &mut own, &mut scratch);
            let theirs: Vec<_> = found.iter().filter(|it| it.0 == entity).map(|it| it.1).collect();
            assert_eq!(theirs, own, "round {round}");
            assert!(touches || own.is_empty(), "round {round}");
        }

        let point = Shape::Sphere { centre: ray.origin, radius: 0.0 };
        let expected = targets.map(|target| target.distance(&point, 2.0, &mut scratch).map(|it| it.upper));
        let least = expected.into_iter().flatten().min_by(f64::total_cmp);
        let nearest = scans.nearest(&point, 2.0);
        assert_eq!(nearest.map(|it| it.1.upper), least, "round {round}");
        nears += u32::from(least.is_some());
    }
    let seen = [meets, hits, touches, nears];
    assert!(seen.iter().all(|&it| (100..1000).contains(&it)), "meets, hits, touches, nears: {seen:?}");
}

#[test]
fn the_guide_shows_the_program_with_a_window() {
    let (_, program) = include_str!("../window/src/main.rs").split_once("\n\n").expect("docs, then code");
    let guide = include_str!("../../../docs/guide/bevy.md");
    assert!(guide.contains(program), "the code of the guide is that of integrations/bevy/window");
}

#[cfg(feature = "gizmos")]
#[test]
fn scans_and_contacts_are_drawn() {
    use bevy_gizmos::{GizmoAsset, GizmoPlugin};
    use nearmiss_bevy::{ScanGizmos, ScanGizmosPlugin};

    let mut app = app(Path::new("."));
    app.add_plugins((GizmoPlugin, ScanGizmosPlugin));
    let floor = floor();
    let lies = spawn(&mut app, &floor, Transform::IDENTITY);
    app.world_mut().entity_mut(lies).insert(ScanGizmos { points: 100, ..ScanGizmos::default() });
    let count = |app: &mut App| {
        app.update();
        let drawn = app.world().resource::<Assets<GizmoAsset>>();
        drawn.iter().map(|(_, asset)| asset.buffer().buffer().list_positions.len()).sum::<usize>()
    };
    // Lines have two ends.
    let scan = count(&mut app);
    assert!((100..=200).contains(&scan), "at most 100 lines, got {scan} ends");
    let stands = Transform::from_rotation(Quat::from_rotation_x(1.5));
    spawn(&mut app, &floor, stands);
    let points: usize = {
        let with_contacts = count(&mut app);
        let points = contacts(&mut app).iter().map(|contact| contact.points.len()).sum();
        assert_eq!(with_contacts, scan + 2 * points, "a line for each point of contact");
        points
    };
    assert!(points > 0, "they touch");
}
