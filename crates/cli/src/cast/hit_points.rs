//! The hits of rays as a point cloud: a simulated scan.

use std::path::Path;

use nearmiss::RayHit;
use nearmiss::io::{Column, PlyPoints};

use crate::console::warn;
use crate::error::CliError;
use crate::output;

/// Hits, with the numbers of their rays.
#[derive(Debug, Default)]
pub(super) struct HitPoints {
    places: Vec<[f64; 3]>,
    normals: Vec<[f32; 3]>,
    source: Vec<u32>,
    rays: Vec<u32>,
    lengths: Vec<f32>,
    /// The number of rays so far.
    count: u32,
}

impl HitPoints {
    /// Adds the hit of the next ray, if it hits.
    #[expect(clippy::cast_possible_truncation, reason = "unit vectors, and lengths to seven digits")]
    pub(super) fn add(&mut self, hit: Option<&RayHit>) {
        if let Some(hit) = hit {
            self.places.push(hit.point);
            self.normals.push(hit.normal.map(|x| x as f32));
            self.source.push(hit.source.0);
            self.rays.push(self.count);
            self.lengths.push(hit.t as f32);
        }
        self.count = self.count.saturating_add(1);
    }

    /// Writes the points as PLY, with normals, the indices of the measured points, the number of the ray and
    /// its length.
    pub(super) fn write(&self, path: &Path) -> Result<(), CliError> {
        if self.places.is_empty() {
            warn(format_args!("no ray hits the scan; {} has no points", path.display()));
        }
        let columns = [Column::Uint("ray", &self.rays), Column::Float("t", &self.lengths)];
        let ply = PlyPoints::double(&self.places).with_normals(&self.normals).with_source(&self.source);
        let ply = ply.with_columns(&columns);
        output::replace(path, |out| ply.write(out).map_err(CliError::writing_ply(path)))
    }
}
