//! Objects to measure: points, their mesh if they have one, and the radius r that scores use.

use std::path::Path;

use nearmiss::{Aabb, PointCloud, TriangleMesh};
use nearmiss_testdata::dragon::{Dragon, dragon_path};
use nearmiss_testdata::{house, scanner};

use crate::Failure;
use crate::scorer::radius;

/// Longest side of an object's bounding box in a sweep (Zachmann 2002).
const SIDE: f64 = 2.0;

/// An object to measure.
#[derive(Debug, Clone)]
pub struct Object {
    /// The name shown in tables.
    pub name: String,
    /// Its points: distinct and finite.
    pub cloud: PointCloud,
    /// Its mesh, if it has one.
    pub mesh: Option<TriangleMesh>,
    /// The radius r of scores, in the units of the cloud.
    pub r: f64,
}

impl Object {
    /// Reads `source`: the path of a file, `dragon-5k` or `dragon-23k` (shipped with the tests), or a
    /// generated one: `bumpy:POINTS` (a surface), `hall` (a frame of a spinning laser scanner, with rings
    /// on the floor) or `house` (a building of two storeys, with noise).
    ///
    /// # Errors
    /// When the object cannot be read or generated.
    pub fn read(source: &str) -> Result<Self, Failure> {
        let shipped = match source {
            "dragon-5k" => Some(dragon_path(Dragon::Points5k)),
            "dragon-23k" => Some(dragon_path(Dragon::Points23k)),
            _ => None,
        };
        let generated = match source {
            "hall" => Some(scanner::frame(&scanner::Frame { beams: 32, steps: 1800, noise: 0.01, seed: 1 })),
            "house" => Some(house::scanned(&house::house(), 0.05, 0.005, 1)),
            _ => source.strip_prefix("bumpy:").map(|count| count.parse().map(bumpy_sphere)).transpose()?,
        };
        if let Some(points) = generated {
            let cloud = PointCloud::from_positions(&points)?;
            return Ok(Self { name: source.into(), r: radius(&cloud)?, cloud, mesh: None });
        }
        let path = shipped.as_deref().unwrap_or_else(|| Path::new(source));
        let model = nearmiss::io::read(path, None)?;
        let name = path.file_stem().map_or_else(|| source.into(), |stem| stem.to_string_lossy().into_owned());
        Ok(Self { name, r: radius(&model.cloud)?, cloud: model.cloud, mesh: model.mesh })
    }

    /// The same object, centred and scaled so that the longest side of its bounding box is 2.
    ///
    /// # Errors
    /// When scaling makes points equal, or the object has no extent.
    pub fn scaled(&self) -> Result<Self, Failure> {
        let bounds = self.cloud.bounds();
        let longest = bounds.half_extents().into_iter().fold(0.0, f64::max);
        let scale = 0.5 * SIDE / longest;
        let centre = bounds.centre();
        let place = |p: [f64; 3]| [0, 1, 2].map(|k| (p[k] - centre[k]) * scale);
        let points: Vec<[f64; 3]> = (0..self.cloud.len()).map(|i| place(self.cloud.point(i))).collect();
        let cloud = PointCloud::from_positions(&points)?;
        let mesh = match &self.mesh {
            Some(mesh) => {
                let vertices = mesh.vertices().iter().map(|&p| place(p)).collect();
                Some(TriangleMesh::new(vertices, mesh.triangles().to_vec())?)
            }
            None => None,
        };
        Ok(Self { name: self.name.clone(), r: self.r * scale, cloud, mesh })
    }

    /// Points per volume of the bounding box: the density of Klein & Zachmann 2005.
    #[must_use]
    pub fn density(&self) -> f64 {
        let Aabb { min, max } = self.cloud.bounds();
        crate::sample::count(self.cloud.len()) / (0..3).map(|k| max[k] - min[k]).product::<f64>()
    }
}

/// `count` points on a sphere with bumps, spread evenly over the directions along a Fibonacci
/// spiral. The surface is closed and smooth, with varying curvature.
#[must_use]
pub fn bumpy_sphere(count: u32) -> Vec<[f64; 3]> {
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let n = f64::from(count.max(1));
    (0..count)
        .map(|i| {
            let i = f64::from(i);
            let z = 1.0 - (2.0 * i + 1.0) / n;
            let flat = (1.0 - z * z).sqrt();
            let (s, c) = (golden * i).sin_cos();
            let [x, y] = [flat * c, flat * s];
            let radius = 1.0 + 0.05 * (7.0 * x).sin() * (6.0 * y).cos() + 0.03 * (11.0 * z).sin();
            [x, y, z].map(|k| k * radius)
        })
        .collect()
}

/// The object with this file name in the folder `NEARMISS_DATA`. `None` if the variable is not set
/// or the file does not exist.
///
/// # Errors
/// When the file cannot be read as an object.
pub fn from_folder(file: &str) -> Result<Option<Object>, Failure> {
    let Some(folder) = std::env::var_os("NEARMISS_DATA") else {
        return Ok(None);
    };
    let path = Path::new(&folder).join(file);
    if path.is_file() { Object::read(&path.to_string_lossy()).map(Some) } else { Ok(None) }
}
