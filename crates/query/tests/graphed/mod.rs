//! Scans with their graphs.

use nearmiss_geometry::{PointCloud, Pose};
use nearmiss_graph::{GraphOptions, Samples, Sides, SurfaceGraph};
use nearmiss_hierarchy::{BuildOptions, PointHierarchy};
use nearmiss_query::ScanView;
use nearmiss_testdata::shapes::{Form, Order, Sampling};

/// A tree over points, its normals turned to one side, and their graph.
pub(crate) struct Scan {
    pub(crate) tree: PointHierarchy,
    pub(crate) graph: SurfaceGraph,
}

impl Scan {
    pub(crate) fn new(points: &[[f64; 3]]) -> Self {
        Self::with_normals(points, None)
    }

    /// With normals of its own.
    pub(crate) fn with_normals(points: &[[f64; 3]], own: Option<&[[f32; 3]]>) -> Self {
        let cloud = PointCloud::from_positions(points).unwrap();
        let mut tree = PointHierarchy::build(&cloud, &BuildOptions::default()).unwrap();
        let own: Option<Vec<[f32; 3]>> =
            own.map(|own| tree.source().iter().map(|&i| own[i as usize]).collect());
        let mut normals = tree.normals().to_vec();
        let samples = Samples { plan: tree.plan(), positions: tree.positions(), radii: tree.radii() };
        let sides = Sides { normals: own.as_deref(), scanner: None };
        let graph = SurfaceGraph::build(samples, sides, &mut normals, &GraphOptions::default()).unwrap();
        tree.turn_normals(&normals);
        Self { tree, graph }
    }

    /// Random samples of a form with noise of this share of their spacing.
    pub(crate) fn of(form: Form, spacing: f64, noise: f64) -> Self {
        Self::new(&form.sample(Sampling { spacing, noise, order: Order::Random, seed: 3 }).points)
    }

    pub(crate) fn at(&self, pose: &Pose) -> ScanView<'_> {
        ScanView::new(&self.tree, pose).with_graph(&self.graph)
    }
}
