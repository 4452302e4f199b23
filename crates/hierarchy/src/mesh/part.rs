//! Parts of a mesh as meshes of their own.

use std::ops::ControlFlow;

use fearless_simd::{Level, Simd};
use nearmiss_lanes::id32;
use nearmiss_mesh::nearest_on_triangle;

use crate::descent::PlaceVisitor;
use crate::mesh::build::{MeshHierarchy, MeshView, build_as_given};
use crate::mesh::options::MeshBuildOptions;

impl MeshHierarchy {
    /// Returns the triangles, in leaf order, that come within `radius` of a place in the caller's frame, in
    /// ascending order. `None` if there are more than `most`. O(log n) for each.
    #[must_use]
    pub fn triangles_in_ball(&self, centre: [f64; 3], radius: f64, most: usize) -> Option<Vec<u32>> {
        let (frame, view) = (self.frame(), self.arrays());
        let stored = frame.to_local(centre);
        // In single precision, boxes are off by a few steps of the greatest coordinate.
        let bounds = view.tree.root_box();
        let far = stored.iter().chain(&bounds.centre).fold(bounds.radius(), |far, c| far.max(c.abs()));
        #[expect(clippy::cast_possible_truncation, reason = "counted in the reach")]
        let reach = (radius / frame.scale) as f32 + 8e-6 * far;
        let (most_sq, found) = (reach * reach, Vec::new());
        let mut search = InBall { view: &view, centre, square: radius * radius, most_sq, most, found };
        let flow = view.tree.descend_to(Level::new(), stored, &mut search);
        search.found.sort_unstable();
        flow.is_continue().then_some(search.found)
    }

    /// Prepares some triangles, in leaf order, as a mesh of their own in the same frame. Its
    /// [sources](MeshView::source) are indices into `triangles`. `None` without triangles, or if the threads
    /// cannot be started.
    ///
    /// Costs as much as a [build](Self::build) without cleaning and without counts of cells.
    ///
    /// # Panics
    /// If there is no such triangle.
    #[must_use]
    pub fn part(&self, triangles: &[u32]) -> Option<Self> {
        let view = self.arrays();
        let mut wanted: Vec<u32> = triangles.iter().flat_map(|&i| view.triangles[i as usize]).collect();
        wanted.sort_unstable();
        wanted.dedup();
        let vertices = wanted.iter().map(|&v| view.vertices.get(v as usize).copied().unwrap_or_default());
        let number = |v| wanted.binary_search(&v).map_or(0, id32);
        let renumbered: Vec<[u32; 3]> =
            triangles.iter().map(|&i| view.triangles[i as usize].map(number)).collect();
        build_as_given(vertices.collect(), &renumbered, &MeshBuildOptions::default().with_cells(false)).ok()
    }
}

/// A search for the triangles in a ball.
struct InBall<'a> {
    view: &'a MeshView<'a>,
    centre: [f64; 3],
    /// The squared radius.
    square: f64,
    /// The same in the stored frame, with room for rounding.
    most_sq: f32,
    most: usize,
    found: Vec<u32>,
}

impl PlaceVisitor for InBall<'_> {
    fn most_sq(&self) -> f32 {
        self.most_sq
    }

    fn leaf<S: Simd>(&mut self, _: S, number: usize) -> ControlFlow<()> {
        for i in self.view.tree.topology().points_of_leaf(number) {
            let near = nearest_on_triangle(&self.view.corners(i), self.centre);
            let square: f64 = (0..3).map(|k| (near[k] - self.centre[k]).powi(2)).sum();
            if square <= self.square {
                self.found.push(id32(i));
            }
        }
        if self.found.len() > self.most { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

#[cfg(test)]
mod tests {
    use nearmiss_geometry::TriangleMesh;
    use nearmiss_testdata::arbitrary::{point_in, rng};

    use super::*;

    /// Parts hold the triangles that they were made of, and balls those that brute force finds.
    #[test]
    fn parts_and_balls_hold_their_triangles() {
        let rng = &mut rng(7101);
        for (count, offset) in [(1, 0.0), (3, 0.0), (60, 0.0), (500, 4000.0)] {
            let place = |rng: &mut _, size| point_in(rng, size).map(|c| c + offset);
            let mut vertices = Vec::new();
            for _ in 0..count {
                let centre = place(rng, 1.0);
                vertices.extend([(); 3].map(|()| {
                    let by = point_in(rng, 0.2);
                    [0, 1, 2].map(|k| centre[k] + by[k])
                }));
            }
            let triangles: Vec<[u32; 3]> = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
            let given = TriangleMesh::new(vertices, triangles).unwrap();
            let mesh = MeshHierarchy::build(&given, &MeshBuildOptions::default()).unwrap();
            let view = mesh.arrays();
            for radius in [0.0, 0.1, 0.4, 5.0] {
                let centre = place(rng, 1.0);
                let found = mesh.triangles_in_ball(centre, radius, usize::MAX).unwrap();
                let expected: Vec<u32> = (0..count)
                    .filter(|&i| {
                        let near = nearest_on_triangle(&view.corners(i as usize), centre);
                        (0..3).map(|k| (near[k] - centre[k]).powi(2)).sum::<f64>() <= radius * radius
                    })
                    .collect();
                assert_eq!(found, expected, "{count} triangles, radius {radius}");
                let most = found.len();
                assert!(mesh.triangles_in_ball(centre, radius, most).is_some());
                assert!(most == 0 || mesh.triangles_in_ball(centre, radius, most - 1).is_none());
                let Some(part) = mesh.part(&found) else {
                    assert_eq!(most, 0);
                    continue;
                };
                let own = part.arrays();
                let mut sources = own.source.to_vec();
                for (i, &source) in own.source.iter().enumerate() {
                    assert_eq!(own.corners(i), view.corners(found[source as usize] as usize));
                }
                sources.sort_unstable();
                assert!(sources.into_iter().eq(0..id32(most)));
            }
        }
    }
}
