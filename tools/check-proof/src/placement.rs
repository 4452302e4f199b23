//! The placements of scans in a proof: rotations with one scale, compared with those of the query.

use nearmiss::geometry::Frame;

use crate::proof::Matrix;

/// Rounding error of the rotation.
const ROUNDING: f64 = 1e-12;

/// A scan's map from stored positions to the world, verified to be a similarity.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Placement {
    matrix: Matrix,
    /// Length of a stored unit in the world.
    pub(crate) scale: f64,
}

impl Placement {
    /// # Errors
    /// If `matrix` is not a rotation with one scale and a shift.
    pub(crate) fn new(matrix: &Matrix) -> Result<Self, String> {
        if matrix[12..] != [0.0, 0.0, 0.0, 1.0] {
            return Err("expected a last row of 0 0 0 1, got another one".into());
        }
        let column = |j: usize| [matrix[j], matrix[4 + j], matrix[8 + j]];
        let product = |i: usize, j: usize| (0..3).map(|k| column(i)[k] * column(j)[k]).sum::<f64>();
        let square = (product(0, 0) + product(1, 1) + product(2, 2)) / 3.0;
        let off = |(i, j): (usize, usize)| (product(i, j) - if i == j { square } else { 0.0 }).abs();
        let worst = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].map(off).into_iter().fold(0.0, f64::max);
        if !square.is_normal() || worst > ROUNDING * square {
            return Err(format!(
                "expected a rotation with uniform scale, got one that is off by {:.1e}",
                worst / square
            ));
        }
        let [x, y, z] = [column(0), column(1), column(2)];
        let determinant = x[0] * (y[1] * z[2] - y[2] * z[1]) - x[1] * (y[0] * z[2] - y[2] * z[0])
            + x[2] * (y[0] * z[1] - y[1] * z[0]);
        if determinant <= 0.0 {
            return Err("expected a rotation, got a reflection".into());
        }
        Ok(Self { matrix: *matrix, scale: square.sqrt() })
    }

    /// Maps a point of the world to the stored frame.
    pub(crate) fn stored(&self, x: [f64; 3]) -> [f64; 3] {
        let m = &self.matrix;
        let d = [x[0] - m[3], x[1] - m[7], x[2] - m[11]];
        [0, 1, 2].map(|j| (0..3).map(|i| m[4 * i + j] * d[i]).sum::<f64>() / (self.scale * self.scale))
    }

    /// Returns the distance between the corners of some bounds of stored positions placed by this
    /// and by `pose`, which maps the caller's positions.
    pub(crate) fn moved(&self, pose: &Matrix, frame: &Frame, bounds: [[f32; 3]; 2]) -> f64 {
        let mut most = 0.0_f64;
        let mut sum = 0.0;
        for corner in 0..8_usize {
            let stored = [0, 1, 2].map(|k| f64::from(bounds[(corner >> k) & 1][k]));
            let given = [0, 1, 2].map(|k| frame.origin[k] + frame.scale * stored[k]);
            let [x, y] = [apply(&self.matrix, stored), apply(pose, given)];
            let moved = (0..3).map(|k| (x[k] - y[k]).powi(2)).sum::<f64>().sqrt();
            sum += moved;
            most = most.max(moved);
        }
        // Unlike a maximum, a sum propagates NaN.
        if sum.is_nan() { sum } else { most }
    }
}

fn apply(m: &Matrix, p: [f64; 3]) -> [f64; 3] {
    [0, 4, 8].map(|i| m[i] * p[0] + m[i + 1] * p[1] + m[i + 2] * p[2] + m[i + 3])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A turn about z by the angle with sine 0.6, twice as large, shifted.
    const MATRIX: Matrix = [1.6, -1.2, 0.0, 5.0, 1.2, 1.6, 0.0, -6.0, 0.0, 0.0, 2.0, 7.0, 0.0, 0.0, 0.0, 1.0];

    #[test]
    fn similarities_are_told_from_others() {
        let placed = Placement::new(&MATRIX).unwrap();
        assert!((placed.scale - 2.0).abs() < 1e-15);
        let p = [0.5, -0.25, 8.0];
        let back = placed.stored(apply(&MATRIX, p));
        assert!((0..3).all(|k| (back[k] - p[k]).abs() < 1e-14), "{back:?}");
        let with = |i: usize, x: f64| {
            let mut m = MATRIX;
            m[i] = x;
            Placement::new(&m)
        };
        assert!(with(0, 1.6 + 1e-13).is_ok(), "rounding");
        assert!(with(0, 1.6 + 1e-11).is_err(), "a shear");
        assert!(with(10, -2.0).is_err(), "a mirror");
        assert!(with(15, 2.0).is_err() && with(12, 1.0).is_err(), "a projection");
        assert!(Placement::new(&[0.0; 16]).is_err(), "nothing");
    }

    #[test]
    fn poses_are_compared_about_the_frame() {
        let frame = Frame { origin: [1e6, 0.0, 0.0], scale: 4.0 };
        let pose: Matrix =
            [0.4, -0.3, 0.0, 5.0 - 4e5, 0.3, 0.4, 0.0, -6.0 - 3e5, 0.0, 0.0, 0.5, 7.0, 0.0, 0.0, 0.0, 1.0];
        let placed = Placement::new(&MATRIX).unwrap();
        let bounds = [[-1.0; 3], [1.0; 3]];
        assert!(placed.moved(&pose, &frame, bounds) < 1e-8, "the same");
        let mut other = pose;
        other[3] += 0.5;
        assert!((placed.moved(&other, &frame, bounds) - 0.5).abs() < 1e-8, "half a unit further");
    }
}
