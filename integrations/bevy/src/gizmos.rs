//! Pictures of scans and their contacts.

use bevy_app::{App, Plugin, PostUpdate};
use bevy_color::Color;
use bevy_ecs::prelude::*;
use bevy_gizmos::gizmos::Gizmos;
use bevy_math::Vec3;

use crate::collider::ScanWorld;
use crate::contact::ScanContact;
use crate::plugin::ScanSystems;

/// Draws the scan of an entity: some of its points, each as a short line along its normal.
#[derive(Debug, Clone, Copy, PartialEq, Component)]
pub struct ScanGizmos {
    /// The greatest number of points.
    pub points: usize,
    /// The colour of the points.
    pub colour: Color,
}

impl Default for ScanGizmos {
    /// At most 5,000 points in light blue.
    fn default() -> Self {
        Self { points: 5000, colour: Color::srgb(0.6, 0.75, 0.9) }
    }
}

/// Draws each entity with [`ScanGizmos`], and the contacts of the frame along their normals, in orange.
/// Needs Bevy's `GizmoPlugin`.
#[derive(Debug, Clone, Copy, Default)]
pub struct ScanGizmosPlugin;

impl Plugin for ScanGizmosPlugin {
    fn build(&self, app: &mut App) {
        // Bevy collects what is drawn in `Last`.
        app.add_systems(PostUpdate, (draw_scans, draw_contacts).after(ScanSystems));
    }
}

fn draw_scans(
    mut gizmos: Gizmos<'_, '_>,
    world: Res<'_, ScanWorld>,
    shown: Query<'_, '_, (Entity, &ScanGizmos)>,
) {
    for (entity, style) in &shown {
        let Some(placed) = world.placed(entity) else { continue };
        let (scan, frame) = (placed.scan(), placed.stored_to_world());
        let length = placed.sampling_radius();
        let every = scan.len().div_ceil(style.points.max(1)).max(1);
        for (i, normal) in scan.normals().iter().enumerate().step_by(every) {
            let (point, normal) = (placed.point(i), frame.rotate(normal.map(f64::from)));
            let end = [0, 1, 2].map(|k| point[k] + length * normal[k]);
            gizmos.line(single(point), single(end), style.colour);
        }
    }
}

fn draw_contacts(
    mut gizmos: Gizmos<'_, '_>,
    world: Res<'_, ScanWorld>,
    mut contacts: MessageReader<'_, '_, ScanContact>,
) {
    for contact in contacts.read() {
        let length = contact.entities.iter().filter_map(|&entity| world.placed(entity));
        let length = length.map(|placed| 3.0 * placed.sampling_radius()).fold(0.0, f64::max);
        for it in &contact.points {
            let end = [0, 1, 2].map(|k| it.point[k] + length * it.normal[k]);
            gizmos.line(single(it.point), single(end), Color::srgb(0.95, 0.45, 0.1));
        }
    }
}

#[expect(clippy::cast_possible_truncation, reason = "Bevy draws in single precision")]
fn single(place: [f64; 3]) -> Vec3 {
    Vec3::from_array(place.map(|c| c as f32))
}
