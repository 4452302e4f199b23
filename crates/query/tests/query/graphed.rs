//! Scans with their graphs.

use nearmiss_geometry::{PointCloud, Pose};
use nearmiss_graph::{GraphOptions, Paths, Sides, SurfaceGraph, SurfaceSamples};
use nearmiss_hierarchy::{BuildOptions, PointHierarchy};
use nearmiss_query::Placed;

/// A hierarchy over points with normals turned to one side, and the graph of the points.
pub(crate) struct Scan {
    pub(crate) tree: PointHierarchy,
    pub(crate) graph: SurfaceGraph,
}

impl Scan {
    /// Builds a scan, with its `own` normals if given.
    pub(crate) fn build(points: &[[f64; 3]], own: Option<&[[f32; 3]]>, options: &BuildOptions) -> Self {
        let cloud = PointCloud::from_positions(points).unwrap();
        let mut tree = PointHierarchy::build(&cloud, options).unwrap();
        let own: Option<Vec<[f32; 3]>> =
            own.map(|own| tree.source().iter().map(|&i| own[i as usize]).collect());
        let mut normals = tree.normals().to_vec();
        let samples = SurfaceSamples { plan: tree.plan(), positions: tree.positions(), radii: tree.radii() };
        let sides = Sides { normals: own.as_deref(), scanner: None };
        let graph = SurfaceGraph::build(
            samples,
            sides,
            &mut normals,
            &GraphOptions::default().with_close_pairs(Some(Paths::Rebuilt)),
        )
        .unwrap();
        tree.turn_normals(&normals);
        Self { tree, graph }
    }

    pub(crate) fn at(&self, pose: &Pose) -> Placed<'_> {
        Placed::new(&self.tree, pose).with_graph(&self.graph)
    }
}
