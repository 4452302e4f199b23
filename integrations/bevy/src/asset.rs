//! Scans as assets.

use std::iter;
use std::path::Path;
use std::sync::LazyLock;

use bevy_asset::io::Reader;
use bevy_asset::{Asset, AssetLoader, LoadContext};
use bevy_reflect::TypePath;
use bevy_tasks::{AsyncComputeTaskPool, TaskPool};
use nearmiss::io::{Format, ReadError};
use nearmiss::{BuildError, BuildOptions, Check, GraphError, GraphOptions, LoadError, Scan};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Endings of prepared scans and of all files that nearmiss reads.
static ENDINGS: LazyLock<Vec<&str>> = LazyLock::new(|| {
    let read = Format::ALL.iter().flat_map(|format| format.names());
    iter::once("nm").chain(read.copied()).collect()
});

/// A prepared scan.
#[derive(Debug, Clone, Asset, TypePath)]
pub struct ScanAsset(pub Scan);

/// The preparation of a raw scan. Files that nearmiss saved are as they were prepared.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ScanSettings {
    /// The widest gap that is bridged, in the units of the file; see
    /// [`BuildOptions::reach`](nearmiss::BuildOptions::reach). Twice the spacing of the points by default.
    pub reach: Option<f64>,
    /// `true` for a graph over the points, which orients the normals. Takes twice the time.
    pub graph: bool,
}

/// Error of loading a scan.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ScanLoadError {
    /// The file cannot be read.
    #[error(transparent)]
    Io(#[from] std::io::Error),
    /// The prepared scan is damaged, or of another version.
    #[error(transparent)]
    Prepared(#[from] LoadError),
    /// The raw scan is invalid; the error names the fault and its place.
    #[error(transparent)]
    Raw(#[from] ReadError),
    /// A setting is out of range; the error names it.
    #[error(transparent)]
    Settings(#[from] BuildError),
    /// The graph cannot be made.
    #[error(transparent)]
    Graph(#[from] GraphError),
}

/// Loads prepared scans (`.nm`), and prepares raw ones, in a task of the pool for long computations. With
/// optimisation, a million raw points take about 1.5 s on two cores.
///
/// Whatever the content of a file, it gives a scan or an error, which the asset server logs.
#[derive(Debug, Clone, Copy, Default, TypePath)]
pub struct ScanLoader;

impl AssetLoader for ScanLoader {
    type Asset = ScanAsset;
    type Settings = ScanSettings;
    type Error = ScanLoadError;

    async fn load(
        &self,
        reader: &mut dyn Reader,
        settings: &ScanSettings,
        context: &mut LoadContext<'_>,
    ) -> Result<ScanAsset, ScanLoadError> {
        let mut bytes = Vec::new();
        reader.read_to_end(&mut bytes).await?;
        let (path, settings) = (context.path().path().to_path_buf(), *settings);
        let pool = AsyncComputeTaskPool::get_or_init(TaskPool::default);
        pool.spawn(async move { prepared(bytes, &path, &settings) }).await.map(ScanAsset)
    }

    fn extensions(&self) -> &[&str] {
        &ENDINGS
    }
}

fn prepared(bytes: Vec<u8>, path: &Path, settings: &ScanSettings) -> Result<Scan, ScanLoadError> {
    if path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("nm")) {
        return Ok(Scan::from_bytes(bytes, Check::Full)?);
    }
    let cloud = nearmiss::io::read_bytes(&bytes, None, path)?.cloud;
    let options = BuildOptions::default();
    let options = settings.reach.map_or(options, |reach| options.with_reach(reach));
    let scan = Scan::build(&cloud, &options)?;
    Ok(if settings.graph { scan.with_graph(&cloud, &GraphOptions::default(), None)? } else { scan })
}
