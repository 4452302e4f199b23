//! The table and the plots of Klein & Zachmann 2004, §6: measurements and objects.
//!
//! The paper's objects are not available in their sizes, so others stand in for them. Without a
//! folder of objects, the dragon that the tests ship replaces them. The paper's two artificial
//! models are generated: a lattice of crossing bars of 197,000 points, which is not a manifold, and
//! spheres that do not touch.

pub mod course;
pub mod hierarchy;

use std::path::Path;

use nearmiss::PointCloud;
use nearmiss_testdata::arbitrary::rng;
use nearmiss_testdata::shapes::{Form, Sampling, bars, field};
use rand::seq::SliceRandom;

use crate::Failure;
use crate::object::Object;
use crate::scorer::radius;

/// Files that stand in for the paper's Sharan, Happy Buddha, Aphrodite and elephant.
const OBJECTS: [&str; 4] = [
    "objects/beetle-20k.obj",
    "objects/happy-buddha-50k.obj",
    "objects/igea-134k.ply",
    "deforming/elephant-gallop/frame_0001.ply",
];

/// An object in several sizes.
const SIZES: [&str; 4] = ["dragon-5k", "dragon-23k", "truth/dragon70k.ply", "objects/dragon-100k.ply"];

/// Reads the objects, with or without a mesh, scaled for the sweep.
///
/// # Errors
/// When a file exists but cannot be read.
pub fn objects(folder: Option<&Path>) -> Result<Vec<Object>, Failure> {
    let mut found = Vec::new();
    for file in OBJECTS {
        let path = folder.map(|folder| folder.join(file)).filter(|path| path.is_file());
        if let Some(path) = path {
            let object = Object::read(&path.to_string_lossy())?;
            // A frame of an animation is named after the animation.
            let is_frame = object.name.starts_with("frame");
            let folder = path.parent().and_then(Path::file_name).filter(|_| is_frame);
            let name = folder.map_or_else(|| object.name.clone(), |f| f.to_string_lossy().into_owned());
            found.push(Object { name, ..object }.scaled()?);
        }
    }
    if found.is_empty() {
        found = vec![Object::read("dragon-5k")?.scaled()?, Object::read("dragon-23k")?.scaled()?];
    }
    Ok(found)
}

/// An object in all available sizes.
///
/// # Errors
/// As [`objects`].
pub fn sizes(folder: Option<&Path>) -> Result<Vec<Object>, Failure> {
    let source = |name: &str| match name.contains('.') {
        false => Some(name.to_owned()),
        true => {
            folder.map(|f| f.join(name)).filter(|p| p.is_file()).map(|p| p.to_string_lossy().into_owned())
        }
    };
    SIZES.iter().filter_map(|name| source(name)).map(|source| Object::read(&source)?.scaled()).collect()
}

/// The paper's artificial models with about this many points, and exact triangles.
///
/// # Errors
/// When they cannot be scaled.
pub fn artificial(points: u32) -> Result<[Object; 2], Failure> {
    let made = |name: &str, form: Form| {
        let spacing = form.spacing_for(points);
        let shape = form.sample(Sampling::clean(spacing));
        let mesh = Some(shape.tessellated());
        let cloud = PointCloud::cleaned(&shape.points)?;
        Object { name: name.into(), r: radius(&cloud)?, cloud, mesh }.scaled()
    };
    Ok([made("grid", bars(9, 1.0, 0.3))?, made("spheres", field([3, 3, 3], 1.0, 0.4))?])
}

/// A random subset of this many points, without a mesh, or the whole cloud if it has no more.
///
/// # Errors
/// When so few points do not make a valid cloud.
pub fn subset(object: &Object, points: usize, seed: u64) -> Result<PointCloud, Failure> {
    let mut order: Vec<usize> = (0..object.cloud.len()).collect();
    order.shuffle(&mut rng(seed));
    order.truncate(points);
    let kept: Vec<[f64; 3]> = order.into_iter().map(|i| object.cloud.point(i)).collect();
    Ok(PointCloud::cleaned(&kept)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_artificial_models_are_as_the_paper_says() {
        let [grid, spheres] = artificial(20_000).unwrap();
        for object in [&grid, &spheres] {
            assert!(
                (16_000..25_000).contains(&object.cloud.len()),
                "{}: {}",
                object.name,
                object.cloud.len()
            );
            let half = object.cloud.bounds().half_extents();
            assert!((half.into_iter().fold(0.0, f64::max) - 1.0).abs() < 1e-6, "{} is scaled", object.name);
        }
        // Two triangles per face, four faces per bar, nine bars in each direction.
        assert_eq!(grid.mesh.unwrap().triangles().len(), 2 * 4 * 18);
        assert!(spheres.mesh.unwrap().triangles().len() > 20_000);
    }

    #[test]
    fn subsets_have_distinct_points_of_the_object() {
        let object = Object::read("dragon-5k").unwrap();
        let few = subset(&object, 1000, 3).unwrap();
        assert_eq!(few.len(), 1000);
        assert_eq!(few.positions(), subset(&object, 1000, 3).unwrap().positions());
        assert_eq!(subset(&object, usize::MAX, 3).unwrap().len(), object.cloud.len());
    }
}
