//! Sphere coverings: balls of one radius about some centres that contain a set.

use nalgebra::Vector3;

/// A box about `centre`, `half` of its edge lengths along orthonormal `axes`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solid {
    /// The middle.
    pub centre: [f64; 3],
    /// Half the edge lengths.
    pub half: [f64; 3],
    /// Unit directions of the edges.
    pub axes: [[f64; 3]; 3],
}

impl Solid {
    /// Returns the point with these coordinates, −1 to 1 along each axis.
    #[must_use]
    pub fn at(&self, t: [f64; 3]) -> [f64; 3] {
        let along = |k: usize| Vector3::from(self.axes[k]) * (t[k] * self.half[k]);
        (Vector3::from(self.centre) + along(0) + along(1) + along(2)).into()
    }

    /// Returns the distance of `x`, 0 inside.
    #[must_use]
    pub fn distance(&self, x: [f64; 3]) -> f64 {
        let d = Vector3::from(x) - Vector3::from(self.centre);
        let beyond = |k: usize| (d.dot(&Vector3::from(self.axes[k])).abs() - self.half[k]).max(0.0);
        Vector3::new(beyond(0), beyond(1), beyond(2)).norm()
    }
}

/// Returns the distance of `x` from the nearest of `centres`.
#[must_use]
pub fn to_nearest(centres: &[[f64; 3]], x: [f64; 3]) -> f64 {
    let distance = |c: &[f64; 3]| (Vector3::from(*c) - Vector3::from(x)).norm();
    centres.iter().map(distance).fold(f64::INFINITY, f64::min)
}

/// Returns bounds of the least radius at which balls about `centres` contain all `solids`. With a
/// grid of `n` + 1 points an edge, the lower bound is the distance of the furthest grid point. The
/// upper bound is that of any point in a cell of the grid.
#[must_use]
pub fn covering_radius(centres: &[[f64; 3]], solids: &[Solid], n: u32) -> [f64; 2] {
    let mut bounds = [0.0_f64; 2];
    let coordinate = |i: u32| 2.0 * f64::from(i) / f64::from(n) - 1.0;
    for solid in solids {
        let cell = Vector3::from(solid.half).norm() / f64::from(n);
        for i in 0..(n + 1).pow(3) {
            let t = [i, i / (n + 1), i / (n + 1).pow(2)].map(|i| coordinate(i % (n + 1)));
            let distance = to_nearest(centres, solid.at(t));
            bounds = [bounds[0].max(distance), bounds[1].max(distance + cell)];
        }
    }
    bounds
}

/// Returns a lower bound of the distance of two sets of balls: those of `radius_a` about `a` that
/// are near `volume_b`, and those of `radius_b` about `b` near `volume_a`. It is the greater of two
/// bounds: by the distances of balls from the other volume, and by the distances from the other's
/// balls near its own volume. If it exceeds `reach`, nothing in both balls and volume of a is
/// within `reach` of anything in both balls and volume of b.
#[must_use]
pub fn clearance(
    (a, radius_a, volume_a): (&[[f64; 3]], f64, &Solid),
    (b, radius_b, volume_b): (&[[f64; 3]], f64, &Solid),
) -> f64 {
    let mut least = f64::INFINITY;
    for p in a {
        for q in b {
            let balls = (Vector3::from(*p) - Vector3::from(*q)).norm() - radius_a - radius_b;
            let volumes = (volume_b.distance(*p) - radius_a).max(volume_a.distance(*q) - radius_b);
            least = least.min(balls.max(volumes));
        }
    }
    least
}
