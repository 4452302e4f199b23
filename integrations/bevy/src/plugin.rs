//! The plugin.

use bevy_app::{App, Plugin, PostUpdate};
use bevy_asset::{AssetApp, AssetEventSystems};
use bevy_ecs::schedule::{IntoScheduleConfigs, SystemSet};
use bevy_transform::TransformSystems;
use nearmiss::CollideOptions;

use crate::asset::{ScanAsset, ScanLoader};
use crate::collider::{ScanWorld, follow};
use crate::contact::{ScanContact, find};

/// Loads scans, places the entities with a [`ScanCollider`](crate::ScanCollider), and writes
/// [`ScanContact`] messages. Needs Bevy's `TaskPoolPlugin`, `AssetPlugin` and `TransformPlugin`, added
/// before.
#[derive(Debug, Clone, Copy)]
pub struct ScanPlugin {
    /// The meaning and the accuracy of all queries. Estimated separations by default, without proofs.
    pub options: CollideOptions,
}

impl Default for ScanPlugin {
    fn default() -> Self {
        Self { options: CollideOptions::estimated() }
    }
}

/// The systems that follow transforms and find contacts, in `PostUpdate` after Bevy's transforms.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, SystemSet)]
pub struct ScanSystems;

impl Plugin for ScanPlugin {
    fn build(&self, app: &mut App) {
        app.init_asset::<ScanAsset>()
            .init_asset_loader::<ScanLoader>()
            .add_message::<ScanContact>()
            .insert_resource(ScanWorld::new(&self.options))
            .configure_sets(
                PostUpdate,
                ScanSystems.after(TransformSystems::Propagate).after(AssetEventSystems),
            )
            .add_systems(PostUpdate, (follow, find).chain().in_set(ScanSystems));
    }
}
