//! A window in which a probe moves through a scanned room, as `docs/guide/bevy.md` shows:
//! `cargo run -- FOLDER` with a folder that holds `room.ply` and `probe.nm`. Arrow keys move the probe.

use std::f32::consts::FRAC_PI_2;

use bevy::prelude::*;
use nearmiss_bevy::{ScanCollider, ScanContact, ScanGizmos, ScanGizmosPlugin, ScanPlugin, Scans, ray_of};

/// The radius of the probe.
const RADIUS: f32 = 0.3;

fn main() {
    // Bevy would look for a relative folder beside `Cargo.toml`, not in the current directory.
    let folder = std::env::args().nth(1).unwrap_or("assets".into());
    let folder = std::path::absolute(folder).expect("a folder with the scans");
    let assets = AssetPlugin { file_path: folder.to_string_lossy().into(), ..default() };
    App::new()
        .add_plugins((DefaultPlugins.set(assets), ScanPlugin::default(), ScanGizmosPlugin))
        .add_systems(Startup, set_up)
        .add_systems(Update, (move_probe, listen, look_down))
        .run();
}

#[derive(Component)]
struct Probe;

fn set_up(mut commands: Commands, server: Res<AssetServer>) {
    let eye = Transform::from_xyz(3.0, 5.0, 6.0).looking_at(Vec3::new(3.0, 0.5, -2.0), Vec3::Y);
    commands.spawn((Camera3d::default(), eye));
    // The y axis of Bevy points up. The z axis of the room does, so the room is turned.
    let upright = Transform::from_rotation(Quat::from_rotation_x(-FRAC_PI_2));
    // Raw or prepared: `room.ply` is prepared in the background, `probe.nm` is only opened.
    let room = ScanCollider(server.load("room.ply"));
    commands.spawn((room, upright, ScanGizmos { points: 20_000, ..ScanGizmos::default() }));
    let probe = ScanCollider(server.load("probe.nm"));
    // Few points, so that contacts show through.
    let few = ScanGizmos { points: 300, ..ScanGizmos::default() };
    commands.spawn((probe, few, Transform::from_xyz(2.0, 1.5, -2.0), Probe));
}

fn move_probe(
    keys: Res<ButtonInput<KeyCode>>,
    time: Res<Time>,
    mut probe: Single<&mut Transform, With<Probe>>,
) {
    let axis = |plus, minus| f32::from(keys.pressed(plus)) - f32::from(keys.pressed(minus));
    let way = Vec3::new(
        axis(KeyCode::ArrowRight, KeyCode::ArrowLeft),
        axis(KeyCode::ArrowUp, KeyCode::ArrowDown),
        0.0,
    );
    probe.translation += way * time.delta_secs();
}

fn listen(mut contacts: MessageReader<ScanContact>) {
    for contact in contacts.read() {
        info!("{:?} {:?}: {} points", contact.entities, contact.phase, contact.points.len());
    }
}

/// Logs how far the floor is below the probe, whenever that changes by a decimetre.
fn look_down(mut scans: Scans, probe: Single<&GlobalTransform, With<Probe>>, mut last: Local<Option<f64>>) {
    // From just below the probe: a ray from its centre would hit the probe itself.
    let from = probe.translation() - Vec3::Y * 1.05 * RADIUS;
    let hit = scans.cast(&ray_of(Ray3d::new(from, Dir3::NEG_Y), 100.0));
    let below = hit.map(|(_, hit)| (10.0 * hit.t).round() / 10.0);
    if *last != below {
        *last = below;
        match below {
            Some(metres) => info!("the floor is {metres:.1} m below the probe"),
            None => info!("nothing is below the probe"),
        }
    }
}
