//! `CleanMesh`: a mesh without repeated vertices and without useless triangles.

use nearmiss_geometry::TriangleMesh;
use thiserror::Error;

use crate::flat::has_area;
use crate::triangle::Corners;
use crate::weld;

/// Options of [`CleanMesh`].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct CleanOptions {
    /// Greatest distance over which vertices are welded, in the units of the vertices. 0, the
    /// default, welds vertices with equal coordinates only.
    pub weld: f64,
}

impl CleanOptions {
    /// The same options with this weld distance.
    #[must_use]
    pub const fn with_weld(self, weld: f64) -> Self {
        Self { weld }
    }
}

/// Why a mesh cannot be cleaned.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum CleanError {
    /// A coordinate is NaN or infinite.
    #[error("expected finite coordinates, got {position:?} (vertex {vertex}); correct or remove the vertex")]
    NotFinite {
        /// Index of the vertex.
        vertex: usize,
        /// Its coordinates.
        position: [f64; 3],
    },
    /// A triangle refers to a vertex that does not exist.
    #[error(
        "expected a vertex index below {vertices}, got {vertex} (triangle {triangle}); \
         correct the triangle or add the vertex"
    )]
    NoSuchVertex {
        /// Index of the triangle.
        triangle: usize,
        /// The vertex index.
        vertex: u32,
        /// Number of vertices.
        vertices: usize,
    },
    /// The weld distance is negative, NaN or infinite.
    #[error("expected a finite weld distance of 0 or more, got {weld}; give 0 to weld equal vertices only")]
    Weld {
        /// The distance.
        weld: f64,
    },
    /// There are more vertices or triangles than 32-bit indices can number.
    #[error("expected at most 4294967295 {what}, got {count}; split the mesh")]
    TooMany {
        /// "vertices" or "triangles".
        what: &'static str,
        /// Their number.
        count: usize,
    },
}

/// Counts of what cleaning a mesh removed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct CleanReport {
    /// Vertices before.
    pub vertices: usize,
    /// Triangles before.
    pub triangles: usize,
    /// Vertices replaced by another one at the same place, or within the weld distance.
    pub welded_vertices: usize,
    /// Vertices that no remaining triangle uses, welded ones not counted.
    pub unused_vertices: usize,
    /// Triangles with two equal corners or, exactly, with collinear corners.
    pub degenerate_triangles: usize,
    /// Triangles with the same three corners as an earlier one, in any order.
    pub duplicate_triangles: usize,
}

/// The number of a triangle in the input, and its vertices.
type Numbered = (u32, [u32; 3]);

/// A triangle mesh in which all vertices are finite, distinct and used, all triangles have an area
/// greater than zero, and no two triangles have the same three corners.
///
/// Vertices and triangles keep their order. Orientation is kept; nothing is promised about
/// closedness or manifoldness.
///
/// ```
/// use nearmiss_mesh::{CleanMesh, CleanOptions};
///
/// // Two triangles of a square as a triangle soup: the corners of their common edge are repeated.
/// let vertices = [
///     [0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0],
///     [0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0],
/// ];
/// let mesh = CleanMesh::from_parts(&vertices, &[[0, 1, 2], [3, 4, 5]], &CleanOptions::default())?;
/// assert_eq!(mesh.triangles(), [[0, 1, 2], [0, 2, 3]]);
/// assert_eq!(mesh.report().welded_vertices, 2);
/// # Ok::<(), nearmiss_mesh::CleanError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CleanMesh {
    vertices: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
    sources: Vec<u32>,
    seams: Vec<[u32; 3]>,
    report: CleanReport,
}

impl CleanMesh {
    /// Cleans a mesh. See [`CleanMesh::from_parts`].
    ///
    /// # Errors
    /// As [`CleanMesh::from_parts`].
    pub fn new(mesh: &TriangleMesh, options: &CleanOptions) -> Result<Self, CleanError> {
        Self::from_parts(mesh.vertices(), mesh.triangles(), options)
    }

    /// Cleans vertices and triangles that refer to them.
    ///
    /// Vertices are welded first: equal ones become the one with the lowest index. With a weld
    /// distance above 0, each vertex in turn is replaced by the nearest vertex kept before it if
    /// that is within the distance, up to rounding. So no vertex moves farther than the distance,
    /// and kept vertices are farther apart than it. Then degenerate triangles are dropped, then
    /// duplicates except the first, then unused vertices. A mesh may end up empty.
    ///
    /// # Cost
    /// O(n log n) in time for n vertices and triangles, O(n) in memory.
    ///
    /// # Errors
    /// If a vertex, also an unused one, has a coordinate that is NaN or infinite, if a triangle
    /// refers to a vertex that does not exist, if the weld distance is negative or not finite, or
    /// if there are more than 2^32 − 1 vertices or triangles.
    pub fn from_parts(
        vertices: &[[f64; 3]],
        triangles: &[[u32; 3]],
        options: &CleanOptions,
    ) -> Result<Self, CleanError> {
        check(vertices, triangles, options)?;
        let replacements =
            if options.weld > 0.0 { weld::within(vertices, options.weld) } else { weld::equal(vertices) };
        let kept = (0_u32..).zip(&replacements).filter(|(v, replacement)| v == *replacement).count();

        let welded = triangles.iter().map(|t| t.map(|v| replacements[v as usize]));
        let proper = |t: &[u32; 3]| {
            t[0] != t[1] && t[1] != t[2] && t[2] != t[0] && has_area(&t.map(|v| vertices[v as usize]))
        };
        let (mut remaining, mut seams): (Vec<Numbered>, Vec<Numbered>) =
            (0..).zip(welded).partition(|(_, t)| proper(t));
        let degenerate_triangles = seams.len();
        seams.retain(|(_, t)| t[0] != t[1] && t[1] != t[2] && t[2] != t[0]);
        let duplicate_triangles = drop_duplicates(&mut remaining, &mut seams);

        let mut used = vec![false; vertices.len()];
        for &v in remaining.iter().flat_map(|(_, t)| t) {
            used[v as usize] = true;
        }
        let mut numbers = vec![0_u32; vertices.len()];
        let chosen = vertices.iter().zip(&mut numbers).zip(&used).filter(|(_, used)| **used);
        let left: Vec<[f64; 3]> = (0..)
            .zip(chosen)
            .map(|(number, ((position, place), _))| {
                *place = number;
                *position
            })
            .collect();
        let number = |v: u32| match used[v as usize] {
            true => numbers[v as usize],
            false => u32::try_from(left.len()).unwrap_or(u32::MAX).saturating_add(v),
        };
        let seams = seams.iter().map(|(_, t)| t.map(number)).collect();
        let report = CleanReport {
            vertices: vertices.len(),
            triangles: triangles.len(),
            welded_vertices: vertices.len() - kept,
            unused_vertices: kept - left.len(),
            degenerate_triangles,
            duplicate_triangles,
        };
        Ok(Self {
            vertices: left,
            triangles: remaining.iter().map(|(_, t)| t.map(|v| numbers[v as usize])).collect(),
            sources: remaining.iter().map(|(source, _)| *source).collect(),
            seams,
            report,
        })
    }

    /// Positions of the vertices.
    #[must_use]
    pub fn vertices(&self) -> &[[f64; 3]] {
        &self.vertices
    }

    /// Vertex indices of each triangle.
    #[must_use]
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// For each triangle, its index in the mesh it was made from, in ascending order.
    #[must_use]
    pub fn sources(&self) -> &[u32] {
        &self.sources
    }

    /// Vertex indices of triangles that were dropped but may connect others: those without area between
    /// three vertices, and one for each triangle that occurs equally often in both orientations, such as
    /// the common wall of two boxes. With their edges, a mesh that was closed before is closed. A vertex
    /// that no triangle uses has a number beyond those of [`Self::vertices`].
    #[must_use]
    pub fn seams(&self) -> &[[u32; 3]] {
        &self.seams
    }

    /// The corners of the `i`-th triangle.
    ///
    /// # Panics
    /// If there is no such triangle.
    #[must_use]
    pub fn corners(&self, i: usize) -> Corners {
        self.triangles[i].map(|v| self.vertices[v as usize])
    }

    /// Counts of what was removed.
    #[must_use]
    pub const fn report(&self) -> &CleanReport {
        &self.report
    }
}

fn check(vertices: &[[f64; 3]], triangles: &[[u32; 3]], options: &CleanOptions) -> Result<(), CleanError> {
    if !(options.weld >= 0.0 && options.weld.is_finite()) {
        return Err(CleanError::Weld { weld: options.weld });
    }
    validate(vertices, triangles)
}

/// Checks a mesh without cleaning it: every vertex is finite, and every triangle has vertices. O(n).
///
/// # Errors
/// If a vertex has a coordinate that is NaN or infinite, if a triangle refers to a vertex that does
/// not exist, or if there are more than 2^32 − 1 vertices or triangles.
pub fn validate(vertices: &[[f64; 3]], triangles: &[[u32; 3]]) -> Result<(), CleanError> {
    for (what, count) in [("vertices", vertices.len()), ("triangles", triangles.len())] {
        if u32::try_from(count).is_err() {
            return Err(CleanError::TooMany { what, count });
        }
    }
    if let Some(vertex) = vertices.iter().position(|v| v.iter().any(|x| !x.is_finite())) {
        return Err(CleanError::NotFinite { vertex, position: vertices[vertex] });
    }
    for (triangle, corners) in triangles.iter().enumerate() {
        if let Some(&vertex) = corners.iter().find(|&&v| v as usize >= vertices.len()) {
            return Err(CleanError::NoSuchVertex { triangle, vertex, vertices: vertices.len() });
        }
    }
    Ok(())
}

/// Keeps the first of the triangles with the same corners, and returns the number of others. One of those
/// that occur equally often in both orientations is added to `seams`.
fn drop_duplicates(triangles: &mut Vec<Numbered>, seams: &mut Vec<Numbered>) -> usize {
    let before = triangles.len();
    let sorted = |&(source, corners): &Numbered| {
        let mut ordered = corners;
        ordered.sort_unstable();
        let least = corners.iter().position(|&v| v == ordered[0]).unwrap_or(0);
        (ordered, source, corners[(least + 1) % 3] == ordered[1])
    };
    let mut keys: Vec<([u32; 3], u32, bool)> = triangles.iter().map(sorted).collect();
    keys.sort_unstable();
    let mut firsts = Vec::with_capacity(keys.len());
    for same in keys.chunk_by(|a, b| a.0 == b.0) {
        let (corners, first, _) = same[0];
        firsts.push(first);
        if 2 * same.iter().filter(|key| key.2).count() == same.len() {
            seams.push((first, corners));
        }
    }
    firsts.sort_unstable();
    let mut firsts = firsts.into_iter().peekable();
    triangles.retain(|(source, _)| firsts.next_if_eq(source).is_some());
    before - triangles.len()
}
