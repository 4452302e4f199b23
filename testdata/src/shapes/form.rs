//! Exact surfaces.

use super::primitive::Primitive;

/// An exact surface: the union of its primitives.
#[derive(Debug, Clone, PartialEq)]
pub struct Form {
    /// Its name.
    pub name: &'static str,
    /// The parts. They may touch and cross.
    pub parts: Vec<Primitive>,
    /// `true` if the union is connected; otherwise every part is a component of its own.
    pub connected: bool,
}

impl Form {
    /// Returns the exact distance of `x` to the nearest point of the surface, never negative.
    #[must_use]
    pub fn distance(&self, x: [f64; 3]) -> f64 {
        self.parts.iter().map(|part| part.distance(x)).fold(f64::INFINITY, f64::min)
    }

    /// Returns the spacing that gives about `n` points.
    #[must_use]
    pub fn spacing_for(&self, n: u32) -> f64 {
        let area: f64 = self.parts.iter().map(Primitive::area).sum();
        (area / f64::from(n.max(1))).sqrt()
    }
}
