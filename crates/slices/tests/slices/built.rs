//! Maps of points.

use nearmiss_geometry::Aabb;
use nearmiss_slices::{SliceBuilder, SliceError, SliceMap, SliceOptions, SlicePlan};
use nearmiss_testdata::dragon::{Dragon, dragon_mesh};
use nearmiss_testdata::house::{Quad, triangles};

/// Returns the map of these points.
pub(crate) fn built(points: &[[f64; 3]], options: &SliceOptions) -> Result<SliceMap, SliceError> {
    let plan = SlicePlan::new(options, &Aabb::of(points.iter().copied()))?;
    let mut builder = SliceBuilder::new(&plan)?;
    builder.add(points);
    assert_eq!(builder.counts(), [points.len() as u64, 0], "all points are within their bounds");
    Ok(builder.finish())
}

/// A real scan.
pub(crate) fn dragon() -> Vec<[f64; 3]> {
    dragon_mesh(Dragon::Points23k).unwrap().vertices().to_vec()
}

/// Returns the map of sampled surfaces.
pub(crate) fn of_quads(quads: &[Quad], options: &SliceOptions) -> SliceMap {
    let mesh = triangles(quads);
    let plan = SlicePlan::new(options, &Aabb::of(mesh.vertices().iter().copied())).unwrap();
    let mut builder = SliceBuilder::new(&plan).unwrap();
    assert!(builder.add_mesh(&mesh) > 0);
    builder.finish()
}
