//! `TriangleMesh`: vertices, and triangles that index them.

use thiserror::Error;

/// Error of [`TriangleMesh::new`].
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum MeshError {
    /// A triangle with a vertex index out of range.
    #[error("expected a vertex index below {vertices}, got {vertex} (triangle {triangle})")]
    NoSuchVertex {
        /// Index of the triangle.
        triangle: usize,
        /// The vertex index.
        vertex: u32,
        /// Number of vertices.
        vertices: usize,
    },
}

/// Triangles over shared vertices. Orientation, closedness and manifoldness are not guaranteed.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TriangleMesh {
    vertices: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
}

impl TriangleMesh {
    /// Creates a mesh of `vertices` and `triangles`, which hold vertex indices.
    ///
    /// # Errors
    /// Fails if a vertex index is out of range. The error names the first triangle with such an
    /// index.
    pub fn new(vertices: Vec<[f64; 3]>, triangles: Vec<[u32; 3]>) -> Result<Self, MeshError> {
        for (triangle, corners) in triangles.iter().enumerate() {
            if let Some(&vertex) = corners.iter().find(|&&v| v as usize >= vertices.len()) {
                return Err(MeshError::NoSuchVertex { triangle, vertex, vertices: vertices.len() });
            }
        }
        Ok(Self { vertices, triangles })
    }

    /// Returns the positions of the vertices.
    #[must_use]
    pub fn vertices(&self) -> &[[f64; 3]] {
        &self.vertices
    }

    /// Returns the vertex indices of each triangle.
    #[must_use]
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Returns the length of the longest edge of triangle `i`, in the units of the vertices.
    ///
    /// # Panics
    /// Panics if `i` is not below the number of triangles.
    #[must_use]
    pub fn longest_edge(&self, i: usize) -> f64 {
        let corners = self.triangles[i].map(|v| self.vertices[v as usize]);
        let edge_sq = |a: [f64; 3], b: [f64; 3]| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>();
        (0..3).map(|k| edge_sq(corners[k], corners[(k + 1) % 3])).fold(0.0, f64::max).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_must_name_vertices_that_are_there() {
        let vertices = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0]];
        let mesh = TriangleMesh::new(vertices.clone(), vec![[0, 1, 2]]).unwrap();
        assert!((mesh.longest_edge(0) - 5.0_f64.sqrt()).abs() < 1e-15, "hypotenuse");
        let refused = TriangleMesh::new(vertices, vec![[0, 1, 2], [0, 3, 1]]).unwrap_err();
        assert_eq!(refused, MeshError::NoSuchVertex { triangle: 1, vertex: 3, vertices: 3 });
    }
}
