//! The forms of the pairs, with their sizes.

use crate::shapes::{self, Form};

/// Spacing of nearly all forms; radii of curvature are at least seven times r ≈ 0.07 where
/// possible.
const SPACING: f64 = 0.05;

/// r of a square lattice of that spacing, the unit of the distances of plates.
const LATTICE_R: f64 = SPACING * std::f64::consts::SQRT_2;

/// A form of one size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Body {
    Ball,
    Globe,
    Patch,
    Sheet,
    Box,
    Torus,
    Bowl,
    Step,
    Shells,
    Building,
    Avatar,
    Grid,
    Field,
    /// Two sheets, this many [`LATTICE_R`] apart.
    Plates(f64),
}

impl Body {
    pub(super) fn form(self) -> Form {
        match self {
            Self::Ball => Form { name: "ball", ..shapes::sphere(0.5) },
            Self::Globe => shapes::sphere(1.0),
            Self::Patch => shapes::patch(3.2, 3.0),
            Self::Sheet => Form { name: "sheet", ..shapes::patch(2.0, 2.0) },
            Self::Box => shapes::cuboid([1.1, 1.0, 0.9]),
            Self::Torus => shapes::torus(1.3, 0.35),
            Self::Bowl => shapes::bowl(1.0),
            Self::Step => shapes::step(1.2, 0.6, 1.8),
            Self::Shells => shapes::shells(0.5, 1.2),
            Self::Building => shapes::building(),
            Self::Avatar => shapes::avatar(1.6, 0.3),
            Self::Grid => shapes::bars(2, 1.4, 0.45),
            Self::Field => shapes::field([3, 2, 2], 1.1, 0.35),
            Self::Plates(multiple) => shapes::plates(2.2, 2.2, multiple * LATTICE_R),
        }
    }

    pub(super) fn spacing(self) -> f64 {
        match self {
            // 68 units of area: 8,000 points.
            Self::Building => 0.09,
            _ => SPACING,
        }
    }
}
