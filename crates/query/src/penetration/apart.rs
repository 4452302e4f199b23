//! The shift that surely separates two things.

use crate::penetration::probe::Vector;

/// Doublings of the shift.
const DOUBLINGS: u32 = 64;

/// Finds a shift of the second of two balls, given by their centres and radii, along the line of the centres
/// after which `is_apart`: first the shift after which the balls are `margin` apart, then longer ones, as
/// rounding grows with the distance from the origin. `None` if even far away nothing is found to be apart.
pub(crate) fn out_of_balls(
    [(a, r), (b, s)]: [(Vector, f64); 2],
    margin: f64,
    mut is_apart: impl FnMut(Vector) -> bool,
) -> Option<Vector> {
    let (between, radii) = (b - a, r + s + margin);
    let way = between.try_normalize(1e-9 * (r + s)).unwrap_or_else(Vector::z);
    let mut length = (radii - way.dot(&between)).max(0.0) * (1.0 + 1e-5) + 1e-9 * radii;
    for _ in 0..DOUBLINGS {
        if is_apart(way * length) {
            return Some(way * length);
        }
        length *= 2.0;
    }
    None
}
