//! Three-dimensional vectors in single precision, as scans store them.

/// a · b, summed in the order of the coordinates.
#[inline]
#[must_use]
pub const fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// a − b.
#[inline]
#[must_use]
pub const fn sub(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// a × b.
#[inline]
#[must_use]
pub const fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// ‖a − b‖², summed in the order of the coordinates.
#[inline]
#[must_use]
pub const fn distance_sq(a: [f32; 3], b: [f32; 3]) -> f32 {
    let d = sub(a, b);
    dot(d, d)
}

/// Returns two unit vectors that complete the unit vector `normal` to a right-handed frame (Duff et
/// al., "Building an orthonormal basis, revisited", JCGT 6(1), 2017).
#[inline]
#[must_use]
pub const fn tangents([x, y, z]: [f32; 3]) -> ([f32; 3], [f32; 3]) {
    let sign = 1.0_f32.copysign(z);
    let a = -1.0 / (sign + z);
    let b = x * y * a;
    ([1.0 + sign * x * x * a, sign * b, -sign * x], [b, sign + y * y * a, -y])
}

#[cfg(test)]
mod tests {
    use nearmiss_testdata::arbitrary::{rng, unit_vector};

    use super::*;

    #[test]
    #[expect(clippy::cast_possible_truncation, reason = "stored in single precision")]
    fn tangents_complete_a_frame() {
        let rng = &mut rng(1);
        let poles = [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]];
        for normal in (0..1000).map(|_| unit_vector(rng).map(|x| x as f32)).chain(poles) {
            let (u, v) = tangents(normal);
            for (a, b, expected) in
                [(u, u, 1.0), (v, v, 1.0), (u, v, 0.0), (u, normal, 0.0), (v, normal, 0.0)]
            {
                assert!((dot(a, b) - expected).abs() < 1e-6, "{normal:?}: {u:?}, {v:?}");
            }
            assert!(distance_sq(cross(u, v), normal) < 1e-12, "{normal:?}");
        }
    }
}
