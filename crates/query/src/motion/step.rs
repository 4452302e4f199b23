//! The distance between two tests for contact where nothing is proven.

/// The share of a band that a thing moves from one test to the next.
const SHARE: f64 = 0.25;

/// The least share: things that are smaller may pass through a surface without a contact.
const LEAST: f64 = 1.0 / 64.0;

/// The least way of a thing between two tests for contact, given the local spacing and the radius of a ball
/// about the thing: a quarter of the spacing or, for things so small that they would pass through a surface
/// on this way, half the radius, as the ball is that of a box.
pub(crate) fn least_step(band: f64, radius: f64) -> f64 {
    (SHARE * band).min(0.5 * radius).max(LEAST * band)
}
