//! A preprocessed scan at a pose in the world.

use nearmiss_geometry::Pose;
use nearmiss_graph::{GeodesicKernel, KernelScratch, SurfaceGraph, SurfaceSamples};
use nearmiss_hierarchy::{GatherScratch, NearField, PointHierarchy, SLAB};
use nearmiss_index::PointBlock;
use nearmiss_surface::{Evaluation, Metric};

use crate::pair::shape_index::ShapeIndex;

/// Reusable memory for evaluations of f; never influences a result.
#[derive(Debug, Clone, Default)]
pub(crate) struct ViewScratch {
    /// The corners of a shape near the scan.
    pub(crate) corners: Vec<[f32; 3]>,
    pub(crate) gather: GatherScratch,
    kernel: KernelScratch,
}

/// A preprocessed scan at a pose. Takes a few nanoseconds to make or copy.
#[derive(Debug, Clone, Copy)]
pub struct Placed<'a> {
    scan: &'a PointHierarchy,
    graph: Option<&'a SurfaceGraph>,
    shapes: Option<&'a ShapeIndex>,
    /// Maps the stored frame to the world.
    stored_to_world: Pose,
}

impl<'a> Placed<'a> {
    /// Places `scan` at `pose`, which maps the frame of the scan's input to the world. The scale of
    /// the pose applies to every length of the scan, such as radii and bandwidths.
    ///
    /// A scan of the [geodesic metric](PointHierarchy::metric) needs [its graph](Self::with_graph)
    /// as well; without it, no contact is verified.
    #[inline]
    #[must_use]
    pub fn new(scan: &'a PointHierarchy, pose: &Pose) -> Self {
        let frame = scan.frame();
        // Equals `pose.after(frame)`, as the pose of the frame has no rotation.
        let stored_to_world =
            pose.with_scale(pose.scale() * frame.scale).with_translation(pose.apply(frame.origin));
        Self { scan, graph: None, shapes: None, stored_to_world }
    }

    /// The same scan with its graph and its shape index at another pose.
    pub(crate) fn moved_to(&self, pose: &Pose) -> Self {
        Self { stored_to_world: Self::new(self.scan, pose).stored_to_world, ..*self }
    }

    /// A [part](PointHierarchy::part) of the scan, placed as the scan is.
    pub(crate) fn with_part<'p>(&self, part: &'p PointHierarchy) -> Placed<'p> {
        Placed { scan: part, graph: None, shapes: None, stored_to_world: self.stored_to_world }
    }

    /// The same placed scan, shifted by `t` in the world.
    pub(crate) fn shifted(&self, t: [f64; 3]) -> Self {
        let pose = &self.stored_to_world;
        let [x, y, z] = pose.translation();
        Self { stored_to_world: pose.with_translation([x + t[0], y + t[1], z + t[2]]), ..*self }
    }

    /// The same placed scan with its graph, for the geodesic kernel and for searches along the graph.
    #[inline]
    #[must_use]
    pub fn with_graph(self, graph: &'a SurfaceGraph) -> Self {
        Self { graph: Some(graph), ..self }
    }

    /// The same placed scan with its shape index. An index of another scan is ignored.
    #[inline]
    #[must_use]
    pub fn with_shapes(self, shapes: &'a ShapeIndex) -> Self {
        Self { shapes: Some(shapes).filter(|shapes| shapes.is_of(self.scan)), ..self }
    }

    /// The graph, if there is one.
    #[must_use]
    pub fn graph(&self) -> Option<&'a SurfaceGraph> {
        self.graph
    }

    /// The shape index, if there is one.
    #[must_use]
    pub fn shapes(&self) -> Option<&'a ShapeIndex> {
        self.shapes
    }

    /// Returns f with distances along the graph (Klein & Zachmann 2005, eq. 5) in the frame of the
    /// stored positions. `None` without a graph that has a map of close pairs.
    #[must_use]
    pub fn geodesic_kernel(&self) -> Option<GeodesicKernel<'a>> {
        let scan = self.scan;
        let samples = SurfaceSamples { plan: scan.plan(), positions: scan.positions(), radii: scan.radii() };
        self.graph?.kernel(samples)
    }

    /// The geodesic kernel if the scan's metric needs it; `None` for the Euclidean metric.
    fn kernel(&self) -> Option<GeodesicKernel<'a>> {
        match self.scan.metric() {
            Metric::Euclidean => None,
            Metric::Geodesic => self.geodesic_kernel(),
        }
    }

    /// The scan.
    #[must_use]
    pub fn scan(&self) -> &'a PointHierarchy {
        self.scan
    }

    /// The scan's sampling radius in the world.
    #[must_use]
    pub fn sampling_radius(&self) -> f64 {
        self.scan.sampling_radius() / self.scan.frame().scale * self.stored_to_world.scale()
    }

    /// The pose of the scan's stored frame.
    #[must_use]
    pub fn stored_to_world(&self) -> &Pose {
        &self.stored_to_world
    }

    /// Returns `true` if `x` belongs to the obstacle. `x` is a world point of the implicit surface
    /// near the stored point `i`. It belongs to the obstacle if it is in the cell of its nearest
    /// stored point and that point samples a sheet (`docs/theory/obstacle.md`).
    pub(crate) fn is_obstacle(&self, i: usize, x: [f64; 3]) -> bool {
        let x = self.stored_to_world.apply_inverse(x);
        let nearest = self.scan.stored_point(self.scan.nearest_point_near(i, x) as usize);
        let away = [0, 1, 2].map(|k| x[k] - f64::from(nearest.position[k]));
        let height: f64 = (0..3).map(|k| away[k] * f64::from(nearest.normal[k])).sum();
        let distance_sq: f64 = away.iter().map(|d| d * d).sum();
        let most = f64::from(nearest.cell);
        nearest.is_on_sheet && height.abs() <= f64::from(SLAB * nearest.radius) && distance_sq <= most * most
    }

    /// Returns the world position of the `i`-th stored point.
    ///
    /// # Panics
    /// If `i` is out of range.
    #[must_use]
    pub fn point(&self, i: usize) -> [f64; 3] {
        let [x, y, z] = PointBlock::position_in(self.scan.blocks(), i);
        self.stored_to_world.apply([f64::from(x), f64::from(y), f64::from(z)])
    }

    /// Returns `true` if f can be evaluated with the scan's metric. Only then can its zeros verify
    /// crossings of discs.
    pub(crate) fn verifies(&self) -> bool {
        self.scan.metric() == Metric::Euclidean || self.kernel().is_some()
    }

    /// See [`Placed::evaluate`].
    pub(crate) fn evaluate_with(&self, x: [f64; 3], scratch: &mut ViewScratch) -> Evaluation {
        match self.kernel() {
            None => self.in_world(
                self.scan.evaluate_oriented_with(self.stored_to_world.apply_inverse(x), &mut scratch.gather),
            ),
            Some(kernel) => self.evaluate_by(&kernel, x, &mut scratch.kernel),
        }
    }

    /// Evaluates f at `x` with distances along the scan's graph by `kernel`, whatever the metric of
    /// the scan. The status is `Outside` if `x` is outside all support radii. The sign is that of
    /// the nearest point's normal (Klein & Zachmann 2005, §3.2).
    pub fn evaluate_by(
        &self,
        kernel: &GeodesicKernel<'_>,
        x: [f64; 3],
        scratch: &mut KernelScratch,
    ) -> Evaluation {
        self.evaluate_by_near(kernel, 0, x, scratch)
    }

    fn evaluate_by_near(
        &self,
        kernel: &GeodesicKernel<'_>,
        i: usize,
        x: [f64; 3],
        scratch: &mut KernelScratch,
    ) -> Evaluation {
        let x = self.stored_to_world.apply_inverse(x);
        let nearest = self.scan.nearest_point_near(i, x);
        let at = kernel.evaluate(x, nearest, scratch);
        let at = if self.scan.is_oriented() {
            at.turned_to(self.scan.normals()[nearest as usize].map(f64::from), 1.0)
        } else {
            at
        };
        self.in_world(at)
    }

    /// The same as [`Self::evaluate_with`], but faster if `x` is near the stored point `i`, and
    /// with the normal turned to the side of that point's normal.
    pub(crate) fn evaluate_near(&self, i: usize, x: [f64; 3], scratch: &mut ViewScratch) -> Evaluation {
        self.near(i, scratch).evaluate(x)
    }

    /// f for several positions near the stored point `i`; see [`Self::evaluate_near`].
    pub(crate) fn near<'s>(&'s self, i: usize, scratch: &'s mut ViewScratch) -> PlacedField<'s> {
        let field = match self.kernel() {
            None => Field::Euclidean(self.scan.near(i, &mut scratch.gather)),
            Some(kernel) => Field::Geodesic(kernel, &mut scratch.kernel),
        };
        PlacedField { placed: self, i, normal: self.scan.normals()[i].map(f64::from), field }
    }

    /// Evaluates |f| at `x`; faster if `x` is near the last point evaluated with this scratch. The
    /// sign is arbitrary. `nearest` is any stored point; the call is fastest with the one nearest
    /// to the last `x`. If the kernel needs the nearest point, `nearest` is updated to it.
    pub(crate) fn evaluate_onward(
        &self,
        x: [f64; 3],
        nearest: &mut usize,
        scratch: &mut ViewScratch,
    ) -> Evaluation {
        let x = self.stored_to_world.apply_inverse(x);
        self.in_world(match self.kernel() {
            None => self.scan.evaluate_onward(x, &mut scratch.gather),
            Some(kernel) => {
                let found = self.scan.nearest_point_near(*nearest, x);
                *nearest = found as usize;
                kernel.evaluate(x, found, &mut scratch.kernel)
            }
        })
    }

    /// Converts an evaluation from the stored frame to the world.
    #[inline]
    pub(crate) fn in_world(&self, at: Evaluation) -> Evaluation {
        let scale = self.stored_to_world.scale();
        Evaluation {
            f: at.f * scale,
            normal: self.stored_to_world.rotate(at.normal),
            centroid: self.stored_to_world.apply(at.centroid),
            bandwidth: at.bandwidth * scale,
            eigenvalues: at.eigenvalues.map(|l| l * scale * scale),
            ..at
        }
    }
}

/// The implicit function of a placed scan near one of its points.
pub(crate) struct PlacedField<'a> {
    placed: &'a Placed<'a>,
    /// The point, and its normal.
    i: usize,
    normal: [f64; 3],
    field: Field<'a>,
}

/// The implicit function in the stored frame.
enum Field<'a> {
    Euclidean(NearField<'a>),
    Geodesic(GeodesicKernel<'a>, &'a mut KernelScratch),
}

impl PlacedField<'_> {
    /// Evaluates f at `x`, in the world.
    pub(crate) fn evaluate(&mut self, x: [f64; 3]) -> Evaluation {
        let Self { placed, i, normal, field } = self;
        match field {
            Field::Euclidean(field) => {
                let at = field.evaluate(placed.stored_to_world.apply_inverse(x));
                placed.in_world(at.turned_to(*normal, 0.0))
            }
            Field::Geodesic(kernel, scratch) => placed.evaluate_by_near(kernel, *i, x, scratch),
        }
    }
}
