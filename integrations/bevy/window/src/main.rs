//! A window in which a probe moves through a scanned room, as `docs/guide/bevy.md` shows:
//! `cargo run -- FOLDER` with a folder that holds `room.ply` and `probe.nm`. Arrow keys move the probe.

use bevy::prelude::*;
use nearmiss_bevy::{ScanCollider, ScanContact, ScanGizmos, ScanGizmosPlugin, ScanPlugin, Scans, ray_of};

fn main() {
    let assets = AssetPlugin { file_path: std::env::args().nth(1).unwrap_or("assets".into()), ..default() };
    App::new()
        .add_plugins((DefaultPlugins.set(assets), ScanPlugin::default(), ScanGizmosPlugin))
        .add_systems(Startup, set_up)
        .add_systems(Update, (move_probe, listen, look_down))
        .run();
}

#[derive(Component)]
struct Probe;

fn set_up(mut commands: Commands, server: Res<AssetServer>) {
    commands
        .spawn((Camera3d::default(), Transform::from_xyz(0.0, 6.0, 12.0).looking_at(Vec3::ZERO, Vec3::Y)));
    // Raw or prepared: `assets/room.ply` is prepared in the background, `assets/probe.nm` is only opened.
    let room = ScanCollider(server.load("room.ply"));
    commands.spawn((room, ScanGizmos { points: 20_000, ..ScanGizmos::default() }));
    let probe = ScanCollider(server.load("probe.nm"));
    commands.spawn((probe, ScanGizmos::default(), Transform::from_xyz(0.0, 3.0, 0.0), Probe));
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

fn look_down(mut scans: Scans, probe: Single<&GlobalTransform, With<Probe>>) {
    let down = Ray3d::new(probe.translation(), Dir3::NEG_Y);
    if let Some((entity, hit)) = scans.cast(&ray_of(down, 100.0)) {
        trace!("{entity} is {} below", hit.t);
    }
}
