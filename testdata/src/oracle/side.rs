//! Sides of a mesh: winding numbers, by the solid angles of its triangles.

use nalgebra::Vector3;
use nearmiss_geometry::TriangleMesh;

use super::count;

/// Distance from a vertex at which [`falls`] evaluates, as a share of the shortest edge there: far
/// above rounding, far below the surface's features.
const BESIDE: f64 = 1e-5;

/// Returns the solid angle of a triangle seen from `x` (van Oosterom & Strackee 1983), as a share
/// of the full sphere; positive from behind.
fn solid_angle(x: [f64; 3], corners: [[f64; 3]; 3]) -> f64 {
    let [a, b, c] = corners.map(|corner| Vector3::from(corner) - Vector3::from(x));
    let [la, lb, lc] = [a.norm(), b.norm(), c.norm()];
    let below = la * lb * lc + a.dot(&b) * lc + b.dot(&c) * la + c.dot(&a) * lb;
    a.dot(&b.cross(&c)).atan2(below) / std::f64::consts::TAU
}

fn corners(mesh: &TriangleMesh, triangle: [u32; 3]) -> [[f64; 3]; 3] {
    triangle.map(|vertex| mesh.vertices()[vertex as usize])
}

/// Returns the winding number of `mesh` about `x`: 1 inside a closed surface whose triangles are
/// counter-clockwise seen from outside, 0 outside.
#[must_use]
pub fn winding(mesh: &TriangleMesh, x: [f64; 3]) -> f64 {
    mesh.triangles().iter().map(|&triangle| solid_angle(x, corners(mesh, triangle))).sum()
}

/// Returns for each vertex by how much the winding number falls along `normals` there, from just
/// behind the surface to just before it. It is 1 if the normal points out, −1 if it points in. It
/// is 0 if both ends are on one side (of an edge, a fold or a flap of two triangles back to back),
/// whatever the sign. At open borders it is a fraction. Without a normal or triangle it is 0.
///
/// Only the triangles about a vertex are evaluated: the winding number of the others is continuous
/// there.
///
/// # Panics
/// If there is not a normal for each vertex.
#[must_use]
pub fn falls(mesh: &TriangleMesh, normals: &[[f64; 3]]) -> Vec<f64> {
    let vertices = mesh.vertices();
    assert_eq!(vertices.len(), normals.len(), "one of each a vertex");
    let mut shortest = vec![f64::INFINITY; vertices.len()];
    for triangle in mesh.triangles() {
        let around = corners(mesh, *triangle).map(Vector3::from);
        for k in 0..3 {
            let edge = (around[(k + 1) % 3] - around[k]).norm();
            for end in [triangle[k], triangle[(k + 1) % 3]] {
                if edge > 0.0 {
                    shortest[end as usize] = shortest[end as usize].min(edge);
                }
            }
        }
    }
    let mut falls = vec![0.0; vertices.len()];
    for &triangle in mesh.triangles() {
        let around = corners(mesh, triangle);
        for i in triangle.map(|vertex| vertex as usize) {
            let beside = |side: f64| [0, 1, 2].map(|k| vertices[i][k] + side * shortest[i] * normals[i][k]);
            let fall = solid_angle(beside(-BESIDE), around) - solid_angle(beside(BESIDE), around);
            if fall.is_finite() {
                falls[i] += fall;
            }
        }
    }
    falls
}

/// Counts of the signs of normals by [`falls`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Signs {
    /// Number of normals that point out or in.
    pub judged: usize,
    /// Number of judged normals that point in.
    pub wrong: usize,
}

impl Signs {
    /// The least fall that counts as a side. A corner of an open mesh falls by a quarter, a place
    /// without sides by nothing.
    const CLEAR: f64 = 0.2;

    /// Counts the signs.
    #[must_use]
    pub fn of(falls: &[f64]) -> Self {
        let judged = falls.iter().filter(|fall| fall.abs() > Self::CLEAR).count();
        Self { judged, wrong: falls.iter().filter(|&&fall| Self::is_wrong(fall)).count() }
    }

    /// Returns `true` if this is the fall of a normal that points in.
    #[must_use]
    pub fn is_wrong(fall: f64) -> bool {
        fall < -Self::CLEAR
    }

    /// Returns the share of the judged normals that point out.
    #[must_use]
    pub fn right(self) -> f64 {
        1.0 - count(self.wrong) / count(self.judged)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arbitrary::{rng, unit_vector};
    use crate::dragon::{Dragon, dragon_mesh};

    #[test]
    fn falls_are_differences_of_winding_numbers() {
        let mesh = dragon_mesh(Dragon::Points5k).unwrap();
        let rng = &mut rng(3);
        let normals: Vec<[f64; 3]> = mesh.vertices().iter().map(|_| unit_vector(rng)).collect();
        let falls = falls(&mesh, &normals);
        let (mut sides, mut none) = (0, 0);
        for i in (0..falls.len()).step_by(37) {
            let at = |side: f64| [0, 1, 2].map(|k| mesh.vertices()[i][k] + side * 1e-8 * normals[i][k]);
            let fall = winding(&mesh, at(-1.0)) - winding(&mesh, at(1.0));
            assert!((fall - falls[i]).abs() < 1e-3, "{fall} and {} at {i}", falls[i]);
            // The mesh is closed.
            let distance = (fall - fall.round()).abs();
            assert!(distance < 1e-3, "{fall} at {i}");
            sides += usize::from(fall.abs() > 0.5);
            none += usize::from(fall.abs() < 0.5);
        }
        assert!(sides > 100 && none > 3, "{sides} and {none}");
    }

    #[test]
    fn a_flap_has_one_side_and_an_open_corner_a_quarter() {
        let vertices = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let up = [[0.0, 0.0, 1.0]; 3];
        let flap = TriangleMesh::new(vertices.clone(), vec![[0, 1, 2], [0, 2, 1]]).unwrap();
        assert!(falls(&flap, &up).iter().all(|fall| fall.abs() < 1e-9));
        let corner = TriangleMesh::new(vertices, vec![[0, 1, 2]]).unwrap();
        let found = falls(&corner, &up);
        assert!((found[0] - 0.25).abs() < 1e-4, "{found:?}");
        assert!((found[1] - 0.125).abs() < 1e-4, "{found:?}");
        assert_eq!(Signs::of(&found), Signs { judged: 1, wrong: 0 });
        assert_eq!(Signs::of(&[-1.0, 1.0, 0.0, 1.0, 1.0]), Signs { judged: 4, wrong: 1 });
        assert_eq!(falls(&flap, &[[f64::NAN; 3]; 3]), [0.0; 3]);
    }
}
