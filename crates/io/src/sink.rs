//! `Sink`: the points and triangles that every reader collects, and that become a `Model`.

use std::path::Path;

use nearmiss_geometry::{PointCloud, Scanner, TriangleMesh};

use crate::columns::{Holds, Row};
use crate::error::{Fault, ReadError};
use crate::points::Points;

/// The contents of a file: a point cloud, and a mesh if the file has faces.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Model {
    /// All vertices, except invalid ones and duplicates, which are dropped and counted.
    /// [`PointCloud::source`] maps its points to indices in the file, which are also those of the
    /// mesh. It has normals, colours, intensities and classes if the file does.
    pub cloud: PointCloud,
    /// The faces, cut into triangles, with all vertices in file order; `None` without faces.
    pub mesh: Option<TriangleMesh>,
}

/// Points and triangles in file order.
#[derive(Debug, Default)]
pub(crate) struct Sink {
    points: Points,
    holds: Holds,
    triangles: Vec<[u32; 3]>,
    scanners: Vec<Scanner>,
}

impl Sink {
    /// Creates a sink for points with these attributes. `capacity` must be bounded by the length of
    /// the file.
    pub(crate) fn new(holds: Holds, capacity: usize) -> Self {
        Self::default().with_rows(holds, capacity)
    }

    /// Sets the attributes of the points that follow. For formats in which faces may come first.
    pub(crate) fn with_rows(mut self, holds: Holds, capacity: usize) -> Self {
        self.holds = holds;
        self.points.reserve(holds, capacity);
        self
    }

    /// Adds a point.
    #[inline]
    pub(crate) fn row(&mut self, row: &Row) {
        self.points.push(self.holds, row);
    }

    /// Sets the scanner positions.
    #[cfg(feature = "e57")]
    pub(crate) fn with_scanners(self, scanners: Vec<Scanner>) -> Self {
        Self { scanners, ..self }
    }

    /// Adds points. All must have the same attributes.
    pub(crate) fn append(&mut self, points: &Points) {
        self.points.append(points);
    }

    /// Adds a polygon, cut into a fan of triangles.
    pub(crate) fn polygon(&mut self, corners: &[u32]) -> Result<(), Fault> {
        let [first, rest @ ..] = corners else {
            return Err(Fault::FewCorners { corners: 0 });
        };
        if rest.len() < 2 {
            return Err(Fault::FewCorners { corners: corners.len() });
        }
        self.triangles.extend(rest.windows(2).map(|side| [*first, side[0], side[1]]));
        Ok(())
    }

    /// Adds triangles, given by the indices of their corners.
    #[cfg(feature = "gltf")]
    pub(crate) fn triangles(&mut self, triangles: &[[u32; 3]]) {
        self.triangles.extend_from_slice(triangles);
    }

    /// Creates a sink of triangles, given by the positions of their corners, three for each. Equal
    /// corners become one vertex. Takes O(n log n) time, for a sort.
    pub(crate) fn of_corners(corners: &[[f64; 3]]) -> Self {
        let bits = |i: u32| corners[i as usize].map(|x| (x + 0.0).to_bits());
        let count = u32::try_from(corners.len()).unwrap_or(u32::MAX);
        let mut order: Vec<u32> = (0..count).collect();
        order.sort_unstable_by_key(|&i| (bits(i), i));
        // The first of equal corners becomes the vertex.
        let mut first_of = vec![0; order.len()];
        for run in order.chunk_by(|&i, &j| bits(i) == bits(j)) {
            run.iter().for_each(|&i| first_of[i as usize] = run[0]);
        }
        let mut sink = Self::default();
        let mut vertex_of = vec![0; order.len()];
        for i in 0..first_of.len() {
            let first = first_of[i] as usize;
            if first == i {
                vertex_of[i] = sink.points.positions.len();
                sink.points.positions.push(corners[i]);
            } else {
                vertex_of[i] = vertex_of[first];
            }
        }
        #[expect(clippy::cast_possible_truncation, reason = "no more vertices than corners")]
        let vertices: Vec<u32> = vertex_of.into_iter().map(|vertex| vertex as u32).collect();
        sink.triangles = vertices.as_chunks().0.to_vec();
        sink
    }

    /// Adds a triangle strip: each corner forms a triangle with the previous two, and the
    /// orientation alternates. Triangles with two equal corners are left out.
    pub(crate) fn strip(&mut self, corners: &[u32]) {
        for (i, triple) in corners.windows(3).enumerate() {
            let [a, b, c] = [triple[0], triple[1], triple[2]];
            if a != b && b != c && c != a {
                self.triangles.push(if i % 2 == 0 { [a, b, c] } else { [b, a, c] });
            }
        }
    }

    /// Converts the points to a cloud, and the triangles, if any, to a mesh.
    pub(crate) fn into_model(self, path: &Path) -> Result<Model, ReadError> {
        let cloud = self.cloud().map_err(|cause| ReadError::Cloud { path: path.into(), cause })?;
        let mesh = self.into_mesh(path)?;
        Ok(Model { cloud, mesh })
    }

    fn cloud(&self) -> Result<PointCloud, nearmiss_geometry::CloudError> {
        let Points { positions, normals, colours, intensities, classes } = &self.points;
        let mut cloud = PointCloud::cleaned(positions)?.with_scanners(self.scanners.clone());
        if !normals.is_empty() {
            cloud = cloud.with_normals(normals)?;
        }
        if !colours.is_empty() {
            cloud = cloud.with_colours(colours)?;
        }
        if !intensities.is_empty() {
            cloud = cloud.with_intensities(intensities)?;
        }
        if !classes.is_empty() {
            cloud = cloud.with_classes(classes)?;
        }
        Ok(cloud)
    }

    /// Returns the points if there are no faces, otherwise the sink itself as the error.
    pub(crate) fn into_points(self) -> Result<Points, Box<Self>> {
        if self.triangles.is_empty() { Ok(self.points) } else { Err(Box::new(self)) }
    }

    /// Returns the points.
    pub(crate) fn points(&self) -> &Points {
        &self.points
    }

    /// Converts the triangles, if any, to a mesh.
    pub(crate) fn into_mesh(self, path: &Path) -> Result<Option<TriangleMesh>, ReadError> {
        if self.triangles.is_empty() {
            return Ok(None);
        }
        let broken = |p: &[f64; 3]| !p.iter().all(|x| x.is_finite());
        if let Some(vertex) = self.points.positions.iter().position(broken) {
            return Err(ReadError::MeshNotFinite { path: path.into(), vertex });
        }
        let mesh = TriangleMesh::new(self.points.positions, self.triangles);
        debug_assert!(mesh.is_ok(), "readers check each corner where they know its place");
        Ok(mesh.ok())
    }
}

/// Converts `index` of a face to the index of a vertex from 0. The format numbers `vertices`
/// vertices from `first`.
pub(crate) fn corner(index: i64, vertices: u64, first: u8) -> Result<u32, Fault> {
    let from_zero = index.checked_sub(first.into());
    from_zero
        .and_then(|i| u32::try_from(i).ok())
        .filter(|&i| u64::from(i) < vertices)
        .ok_or(Fault::NoSuchVertex { vertex: index, vertices, first })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_turn_every_other_triangle() {
        let mut sink = Sink::default();
        sink.strip(&[0, 1, 2, 3, 3, 4, 5]);
        assert_eq!(sink.triangles, [[0, 1, 2], [2, 1, 3], [3, 4, 5]]);
    }

    #[test]
    fn corners_at_one_place_become_one_vertex() {
        let [a, b, c, d] = [[0.0, -0.0, 1.0], [1.0; 3], [2.0; 3], [0.5; 3]];
        let sink = Sink::of_corners(&[a, b, c, b, d, [0.0, 0.0, 1.0]]);
        assert_eq!(sink.points.positions, [a, b, c, d]);
        assert_eq!(sink.triangles, [[0, 1, 2], [1, 3, 0]]);
    }

    #[test]
    fn corners_are_checked_at_both_ends() {
        assert_eq!(corner(0, 3, 0), Ok(0));
        assert_eq!(corner(3, 3, 1), Ok(2));
        for (index, first) in [(-1, 0), (3, 0), (0, 1), (4, 1), (i64::MIN, 1), (i64::MAX, 0)] {
            assert!(corner(index, 3, first).is_err(), "{index} counted from {first}");
        }
    }
}
