//! Directions in eight bits.

/// A direction, five degrees off in the mean and at most 15: the number of a cell on the sides of an
/// octahedron, unfolded to a square of 16 × 16 cells (Cigolle et al. 2014, "A Survey of Efficient
/// Representations for Independent Unit Vectors").
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(transparent)]
pub(super) struct Direction(u8);

impl Direction {
    pub(super) const NONE: Self = Self(u8::MAX);

    /// The direction of a vector; none if it is zero or not finite.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 15")]
    pub(super) fn of([x, y, z]: [f32; 3]) -> Self {
        let sum = x.abs() + y.abs() + z.abs();
        if sum.is_nan() || sum <= 0.0 || sum.is_infinite() {
            return Self::NONE;
        }
        let (u, v) = (x / sum, y / sum);
        let (u, v) = if z < 0.0 { folded(u, v) } else { (u, v) };
        let cell = |c: f32| ((c + 1.0) * 8.0).min(15.0) as u8;
        let number = cell(u) * 16 + cell(v);
        // The last cell has the number of none. Another corner of the square is the same direction, -z.
        if number == Self::NONE.0 { Self(15 * 16) } else { Self(number) }
    }

    /// A unit vector.
    #[inline(always)]
    pub(super) fn vector(self) -> Option<[f32; 3]> {
        if self == Self::NONE {
            return None;
        }
        let middle = |cell: u8| (f32::from(cell) + 0.5) * 0.125 - 1.0;
        let (u, v) = (middle(self.0 / 16), middle(self.0 % 16));
        let z = 1.0 - u.abs() - v.abs();
        let (x, y) = if z < 0.0 { folded(u, v) } else { (u, v) };
        let scale = 1.0 / (x * x + y * y + z * z).sqrt();
        Some([x * scale, y * scale, z * scale])
    }
}

/// Folds the corners of the square onto the lower half of the octahedron, and back.
#[inline(always)]
fn folded(u: f32, v: f32) -> (f32, f32) {
    ((1.0 - v.abs()).copysign(u), (1.0 - u.abs()).copysign(v))
}

#[cfg(test)]
mod tests {
    use nearmiss_lanes::vector::dot;
    use nearmiss_testdata::arbitrary::{rng, unit_vector};

    use super::*;

    #[test]
    fn directions_are_kept_to_within_a_few_degrees() {
        let rng = &mut rng(9404);
        let corners = (0..27).map(|i| [i % 3, i / 3 % 3, i / 9].map(|c: u8| f32::from(c) - 1.0));
        #[expect(clippy::cast_possible_truncation, reason = "near one")]
        let random = (0..20_000).map(|_| unit_vector(rng).map(|c| c as f32));
        let (mut greatest, mut sum, mut count) = (0.0_f32, 0.0, 0.0);
        for vector in corners.chain(random).filter(|v| *v != [0.0; 3]) {
            let own = Direction::of(vector.map(|c| 3.0 * c)).vector().unwrap();
            assert!((dot(own, own) - 1.0).abs() < 1e-5, "{own:?} of {vector:?}");
            let off = (dot(own, vector) / dot(vector, vector).sqrt()).min(1.0).acos().to_degrees();
            (greatest, sum, count) = (greatest.max(off), sum + off, count + 1.0);
        }
        assert!(greatest < 15.0 && sum < 5.5 * count, "{greatest} and {} degrees off", sum / count);
        let down = Direction::of([0.0, 0.0, -1.0]).vector().unwrap();
        assert!(down[2] < -6.0_f32.to_radians().cos(), "{down:?}");
        for none in [[0.0; 3], [f32::NAN, 1.0, 0.0], [f32::INFINITY, 1.0, 0.0]] {
            assert_eq!(Direction::of(none).vector(), None);
        }
    }
}
