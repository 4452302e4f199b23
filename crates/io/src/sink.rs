//! The one thing that every reader fills; it ends in a model.

use std::path::Path;

use nearmiss_geometry::{PointCloud, TriangleMesh};

use crate::columns::{Holds, Row};
use crate::error::{Fault, ReadError};

/// What a file holds.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Model {
    /// All vertices, broken ones and duplicates dropped and counted; [`PointCloud::source`] leads back to the
    /// order of the file, and so to the vertices of the mesh. Carries normals and colours if the file does.
    pub cloud: PointCloud,
    /// The faces, cut into triangles, over all vertices in the order of the file; `None` if there are none.
    pub mesh: Option<TriangleMesh>,
}

/// Rows and faces as they come, in the order of the file.
#[derive(Debug, Default)]
pub(crate) struct Sink {
    points: Vec<[f64; 3]>,
    holds: Holds,
    normals: Vec<[f32; 3]>,
    colours: Vec<[u8; 3]>,
    triangles: Vec<[u32; 3]>,
}

impl Sink {
    /// For rows that hold this. `capacity` of them must be sure to fit into memory: no more than the file's
    /// length has space for.
    pub(crate) fn new(holds: Holds, capacity: usize) -> Self {
        Self::default().with_rows(holds, capacity)
    }

    /// The same, now expecting rows; for formats in which faces may come first.
    pub(crate) fn with_rows(mut self, holds: Holds, capacity: usize) -> Self {
        self.holds = holds;
        self.points.reserve(capacity);
        self.normals.reserve(if holds.normals { capacity } else { 0 });
        self.colours.reserve(if holds.colours { capacity } else { 0 });
        self
    }

    /// A point with what belongs to it.
    #[inline]
    pub(crate) fn row(&mut self, row: &Row) {
        let [x, y, z, normal @ .., r, g, b] = *row;
        self.points.push([x, y, z]);
        if self.holds.normals {
            #[expect(clippy::cast_possible_truncation, reason = "single precision is enough for a normal")]
            self.normals.push(normal.map(|n| n as f32));
        }
        if self.holds.colours {
            self.colours.push([r, g, b].map(channel));
        }
    }

    /// A polygon, cut into the triangles of a fan.
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

    /// A strip: each corner makes a triangle with the two before it, every other one turned round. Triangles
    /// with two equal corners only lead the strip on.
    pub(crate) fn strip(&mut self, corners: &[u32]) {
        for (i, triple) in corners.windows(3).enumerate() {
            let [a, b, c] = [triple[0], triple[1], triple[2]];
            if a != b && b != c && c != a {
                self.triangles.push(if i % 2 == 0 { [a, b, c] } else { [b, a, c] });
            }
        }
    }

    /// The file's points as a cloud, and its triangles if there are any.
    pub(crate) fn into_model(self, path: &Path) -> Result<Model, ReadError> {
        let cloud = self.cloud().map_err(|cause| ReadError::Cloud { path: path.into(), cause })?;
        let mesh = self.into_mesh(path)?;
        Ok(Model { cloud, mesh })
    }

    fn cloud(&self) -> Result<PointCloud, nearmiss_geometry::CloudError> {
        let mut cloud = PointCloud::cleaned(&self.points)?;
        if self.holds.normals {
            cloud = cloud.with_normals(&self.normals)?;
        }
        if self.holds.colours {
            cloud = cloud.with_colours(&self.colours)?;
        }
        Ok(cloud)
    }

    /// The file's points, if it has no faces; else what there is.
    pub(crate) fn into_points(self) -> Result<Vec<[f64; 3]>, Self> {
        if self.triangles.is_empty() { Ok(self.points) } else { Err(self) }
    }

    /// The file's triangles, if there are any.
    pub(crate) fn into_mesh(self, path: &Path) -> Result<Option<TriangleMesh>, ReadError> {
        if self.triangles.is_empty() {
            return Ok(None);
        }
        let broken = |p: &[f64; 3]| !p.iter().all(|x| x.is_finite());
        if let Some(vertex) = self.points.iter().position(broken) {
            return Err(ReadError::MeshNotFinite { path: path.into(), vertex });
        }
        let mesh = TriangleMesh::new(self.points, self.triangles);
        debug_assert!(mesh.is_ok(), "readers check each corner where they know its place");
        Ok(mesh.ok())
    }
}

/// The vertex that a face names by `index`, where the format counts `vertices` of them from `first`.
pub(crate) fn corner(index: i64, vertices: u64, first: u8) -> Result<u32, Fault> {
    let from_zero = index.checked_sub(first.into());
    from_zero
        .and_then(|i| u32::try_from(i).ok())
        .filter(|&i| u64::from(i) < vertices)
        .ok_or(Fault::NoSuchVertex { vertex: index, vertices, first })
}

/// A colour channel from a number that should be a whole one in 0..=255.
fn channel(value: f64) -> u8 {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "the cast saturates, and makes zero of NaN"
    )]
    let channel = value.round() as u8;
    channel
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
    fn corners_are_checked_at_both_ends() {
        assert_eq!(corner(0, 3, 0), Ok(0));
        assert_eq!(corner(3, 3, 1), Ok(2));
        for (index, first) in [(-1, 0), (3, 0), (0, 1), (4, 1), (i64::MIN, 1), (i64::MAX, 0)] {
            assert!(corner(index, 3, first).is_err(), "{index} counted from {first}");
        }
    }

    #[test]
    fn channels_saturate() {
        assert_eq!([-5.0, 0.4, 254.6, 300.0, f64::NAN].map(channel), [0, 0, 255, 255, 0]);
    }
}
