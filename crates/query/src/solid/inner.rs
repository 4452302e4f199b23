//! The depth of the origin in a convex shape that is known by its support map.
//!
//! A polytope inside the shape grows at the face that is nearest to the origin, by the point of the shape
//! that is furthest along the normal of that face (van den Bergen, "Proximity Queries and Penetration Depth
//! Computation on 3D Game Objects", 2001). The polytope is inside the shape at all times, so the distance
//! of its nearest face is a lower bound of the depth.

use nearmiss_geometry::nalgebra::Vector3;

type Vector = Vector3<f64>;

/// The greatest numbers of vertices and faces. A convex polytope has two faces a vertex less four.
const VERTICES: usize = 64;
const FACES: usize = 2 * VERTICES;

/// The search ends once the bounds of the depth differ by this share of the shape's size.
const PRECISION: f64 = 1e-6;

/// A triangle of the polytope, with its unit normal to the outside and its distance from the origin along it.
#[derive(Debug, Clone, Copy)]
struct Face {
    corners: [usize; 3],
    normal: Vector,
    height: f64,
}

/// A polytope with triangles as faces.
struct Polytope {
    vertices: [Vector; VERTICES],
    faces: [Face; FACES],
    counts: [usize; 2],
}

/// Returns a lower bound of the distance of the origin from the boundary of a convex shape that contains
/// it, and the normal of the nearest face of the polytope. If the shape is flat, zero and a normal of it.
/// `scale` is the size of the shape.
pub(crate) fn inner_depth(support: impl Fn(&Vector) -> Vector, scale: f64) -> (f64, Vector) {
    let mut polytope = match Polytope::new(&support, scale) {
        Ok(polytope) => polytope,
        Err(normal) => return (0.0, normal),
    };
    let mut best = (0.0, Vector::zeros());
    loop {
        let [_, count] = polytope.counts;
        let nearest = polytope.faces[..count].iter().min_by(|a, b| a.height.total_cmp(&b.height));
        let Some(&Face { normal, height, .. }) = nearest else { return best };
        if height > best.0 {
            best = (height, normal);
        }
        let furthest = support(&normal);
        if normal.dot(&furthest) - height <= PRECISION * scale || !polytope.grow(furthest, scale) {
            return best;
        }
    }
}

impl Polytope {
    /// A tetrahedron of points of the shape; a unit normal of the shape if it is flat.
    fn new(support: &impl Fn(&Vector) -> Vector, scale: f64) -> Result<Self, Vector> {
        /// Less than this is flat, relative to the size.
        const FLAT: f64 = 1e-9;
        let p = support(&Vector::x());
        let q = support(&-Vector::x());
        // The point that is furthest from those before, along `d` or against it.
        let off = |d: &Vector| {
            let [high, low] = [support(d), support(&-d)];
            let of = |x: &Vector| d.dot(&(x - p)).abs();
            let furthest = if of(&low) > of(&high) { low } else { high };
            (of(&furthest) > FLAT * scale).then_some(furthest)
        };
        let is_wide = (q - p).norm() > FLAT * scale;
        let q = if is_wide { Some(q) } else { off(&Vector::y()).or_else(|| off(&Vector::z())) };
        let along = (q.ok_or_else(Vector::x)? - p).normalize();
        let least = along.iamin();
        let across = along.cross(&Vector::from_fn(|k, _| if k == least { 1.0 } else { 0.0 })).normalize();
        let r = off(&across).or_else(|| off(&along.cross(&across))).ok_or(across)?;
        let normal = along.cross(&(r - p)).try_normalize(0.0).ok_or(across)?;
        let s = off(&normal).ok_or(normal)?;
        let q = q.unwrap_or(p);
        let none = Face { corners: [0; 3], normal: Vector::zeros(), height: 0.0 };
        let mut polytope =
            Self { vertices: [Vector::zeros(); VERTICES], faces: [none; FACES], counts: [4, 0] };
        polytope.vertices[..4].copy_from_slice(&[p, q, r, s]);
        let is_above = normal.dot(&(s - p)) > 0.0;
        let turned = if is_above { [0, 2, 1, 3] } else { [0, 1, 2, 3] };
        // Each face is seen anticlockwise from the outside.
        for [i, j, k] in [[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]] {
            polytope.add([turned[i], turned[j], turned[k]]).ok_or(normal)?;
        }
        Ok(polytope)
    }

    /// Adds a face; `None` if it has no area or there is no room.
    fn add(&mut self, corners: [usize; 3]) -> Option<()> {
        let [p, q, r] = corners.map(|i| self.vertices[i]);
        let normal = (q - p).cross(&(r - p)).try_normalize(0.0)?;
        let face = self.faces.get_mut(self.counts[1])?;
        *face = Face { corners, normal, height: normal.dot(&p) };
        self.counts[1] += 1;
        Some(())
    }

    /// Extends the polytope to a point outside it. Returns `false` if the point is not outside by more than
    /// rounding, or if there is no room.
    fn grow(&mut self, point: Vector, scale: f64) -> bool {
        /// Rounding of heights, relative to the size.
        const ROUNDING: f64 = 1e-12;
        let [vertices, count] = self.counts;
        if vertices == VERTICES {
            return false;
        }
        self.vertices[vertices] = point;
        self.counts[0] += 1;
        // The edges of the faces that see the point; those that are in two of them cancel out.
        let (mut edges, mut open) = ([[0; 2]; 3 * FACES], 0);
        let mut kept = 0;
        for n in 0..count {
            let face = self.faces[n];
            if face.normal.dot(&point) - face.height <= ROUNDING * scale {
                self.faces[kept] = face;
                kept += 1;
                continue;
            }
            for k in 0..3 {
                let [i, j] = [face.corners[k], face.corners[(k + 1) % 3]];
                match edges[..open].iter().position(|&edge| edge == [j, i]) {
                    Some(n) => {
                        open -= 1;
                        edges[n] = edges[open];
                    }
                    None => {
                        edges[open] = [i, j];
                        open += 1;
                    }
                }
            }
        }
        self.counts[1] = kept;
        open > 0 && edges[..open].iter().all(|&[i, j]| self.add([i, j, vertices]).is_some())
    }
}

#[cfg(test)]
mod tests {
    use nearmiss_testdata::arbitrary::{point_in, rng, unit_vector};

    use super::*;

    /// The furthest of `points` along `d`.
    fn furthest(points: &[Vector], d: &Vector) -> Vector {
        *points.iter().max_by(|a, b| a.dot(d).total_cmp(&b.dot(d))).expect("there are points")
    }

    /// The depth in a random hull is that of the nearest plane through three points that has all others on
    /// one side.
    #[test]
    fn depths_in_hulls() {
        let rng = &mut rng(7301);
        let mut inside = 0;
        for _ in 0..400 {
            let points: Vec<Vector> = (0..12).map(|_| point_in(rng, 1.0).into()).collect();
            let mut least = f64::INFINITY;
            for i in 0..12 {
                for j in 0..i {
                    for k in 0..j {
                        let normal = (points[j] - points[i]).cross(&(points[k] - points[i])).normalize();
                        let heights = points.iter().map(|p| normal.dot(&(p - points[i])));
                        let (low, high) =
                            heights.fold((0.0_f64, 0.0_f64), |(low, high), h| (low.min(h), high.max(h)));
                        let own = normal.dot(&points[i]);
                        if high < 1e-9 {
                            least = least.min(own);
                        } else if low > -1e-9 {
                            least = least.min(-own);
                        }
                    }
                }
            }
            let (depth, way) = inner_depth(|d| furthest(&points, d), 1.0);
            assert!((depth - least.max(0.0)).abs() < 1e-5, "{depth} {least}");
            if depth > 0.01 {
                inside += 1;
                assert!((way.dot(&furthest(&points, &way)) - depth).abs() < 1e-5);
            }
        }
        assert!(inside > 100, "{inside} hulls contain the origin");
    }

    /// Smooth, thin and flat shapes.
    #[test]
    fn depths_in_other_shapes() {
        let rng = &mut rng(7302);
        for _ in 0..200 {
            let away = Vector::from(point_in(rng, 0.5));
            let ball = |d: &Vector| d.normalize() - away;
            let (depth, way) = inner_depth(ball, 1.0);
            let exact = 1.0 - away.norm();
            assert!(depth <= exact + 1e-9 && depth > exact - 0.03, "{depth} {exact}");
            assert!((way.norm() - 1.0).abs() < 1e-9, "{way}");
            let thin = Vector::new(1.0, 0.01, 2.0);
            let slab = |d: &Vector| Vector::from_fn(|k, _| thin[k].copysign(d[k]));
            assert!((inner_depth(slab, 2.0).0 - 0.01).abs() < 1e-6);
            let plate = |d: &Vector| Vector::new(1.0_f64.copysign(d.x), 0.0, 1.0_f64.copysign(d.z));
            assert_eq!(inner_depth(plate, 1.0).0, 0.0);
            let normal = Vector::from(unit_vector(rng));
            let segment = |d: &Vector| normal * normal.dot(d).signum();
            assert_eq!(inner_depth(segment, 1.0).0, 0.0);
            assert_eq!(inner_depth(|_| Vector::zeros(), 0.0).0, 0.0);
        }
    }
}
