//! Scenes and measurements for the tables and figures of dos Anjos, Pereira & Oliveira 2012.

pub mod columns;
pub mod headroom;
pub mod steps;

use std::path::Path;

use nearmiss::slices::{Route, SliceBuilder, SliceFolder, SliceMap, SliceOptions, SlicePlan};
use nearmiss::{PointCloud, TriangleMesh};
use nearmiss_testdata::house::{STAIRS, house, scanned};
use nearmiss_testdata::scenes::TWO_STOREYS;

use crate::Failure;
use crate::clock::timed;

/// The input of a slice map.
#[derive(Debug)]
pub enum Source {
    /// A scan.
    Points(PointCloud),
    /// A mesh, which is sampled for the map.
    Mesh(TriangleMesh),
}

/// Builds a slice map of `source`; returns it with its number of points.
///
/// # Errors
/// When memory for the map cannot be allocated.
pub fn made(plan: &SlicePlan, source: &Source) -> Result<(SliceMap, u64), Failure> {
    let mut builder = SliceBuilder::new(plan)?;
    match source {
        Source::Points(cloud) => builder.add_cloud(cloud),
        Source::Mesh(mesh) => _ = builder.add_mesh(mesh),
    }
    let [points, _] = builder.counts();
    Ok((builder.finish(), points))
}

/// A scan with a route that climbs and descends stairs.
#[derive(Debug)]
pub struct Walked {
    /// The points.
    pub cloud: PointCloud,
    /// The route.
    pub route: Route,
}

impl Walked {
    /// Reads the scan of two storeys and their staircase from the data folder `data`.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn scan(data: &Path) -> Result<Self, Failure> {
        let cloud = nearmiss::io::read(data.join(TWO_STOREYS.file), None)?.cloud;
        Ok(Self { cloud, route: serde_json::from_str(TWO_STOREYS.route)? })
    }

    /// Generates the house and its route.
    ///
    /// # Errors
    /// When the generated points do not make a valid cloud.
    pub fn house(spacing: f64, seed: u64) -> Result<Self, Failure> {
        let y = 0.5 * (STAIRS[0] + STAIRS[1]);
        let points = scanned(&house(), spacing, 0.003, seed);
        let route = Route {
            start: [1.2, 8.0, 0.2],
            points: vec![[1.2, y], [8.0, y], [8.0, 9.5], [8.0, y], [1.2, y]],
        };
        Ok(Self { cloud: PointCloud::from_positions(&points)?, route })
    }

    /// Builds the map and saves it to the folder `place`; returns the opened folder and the seconds
    /// from points to saved map.
    ///
    /// # Errors
    /// When the map cannot be built or written.
    pub fn folder(&self, place: &Path, options: &SliceOptions) -> Result<(SliceFolder, f64), Failure> {
        let plan = SlicePlan::new(options, &self.cloud.bounds())?;
        let (saved, time) = timed(|| {
            let mut builder = SliceBuilder::new(&plan)?;
            builder.add_cloud(&self.cloud);
            Ok::<_, Failure>(builder.finish().save(place)?)
        });
        saved?;
        Ok((SliceFolder::open(place)?, time.as_secs_f64()))
    }
}
