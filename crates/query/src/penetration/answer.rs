//! The answer to how far two things penetrate each other.

use serde::{Deserialize, Serialize};

use crate::ask::answer::{Evidence, Statistics};
use crate::penetration::probe::Vector;
use crate::penetration::search::Bounds;

/// The inside of a scan.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Interior {
    /// The scan is its surface and has no inside: a room, a wall, a single view.
    #[default]
    Hollow,
    /// The surface encloses a solid, so what is inside overlaps it. Small holes do no harm. Ignored for
    /// [thickened points](crate::Semantics::Thickened).
    Solid,
}

/// The penetration of two things, in world units: lower ≤ length of the least shift that separates them ≤
/// upper.
///
/// The second of two scans, of two meshes or of two shapes is shifted. A shape is shifted out of a scan or a
/// mesh, and a mesh out of a scan.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Penetration {
    /// A lower bound: every shorter shift leaves a contact or an overlap. 0 if no bound was found.
    ///
    /// Rays judge which places are inside a [solid](Interior::Solid) scan. The bound is proven as far as
    /// they are right, and as the discs leave no hole through which a part may pass
    /// (`docs/theory/penetration.md`).
    pub lower: f64,
    /// The length of a shift after which the two are separate: 0 if they already are, infinite if a pose or
    /// a shape is invalid, or if no such shift was found.
    pub upper: f64,
    /// The unit vector along which the shift of length [`Self::upper`] is. 0 if none is needed or known.
    pub direction: [f64; 3],
    /// The evidence for the separation after that shift. Certified for meshes and shapes. The shortest shift
    /// out of a scan ends next to its surface, where most separations are estimated.
    pub evidence: Evidence,
    /// The length below which the scans do not determine the separation after the shift; 0 for meshes and
    /// shapes.
    pub band: f64,
    /// `true` if the search ended before the budget did. The bounds may still differ.
    pub complete: bool,
    /// The cost of the query.
    pub statistics: Statistics,
}

impl Penetration {
    /// A penetration that is not known.
    pub(crate) const UNKNOWN: Self = Self {
        lower: 0.0,
        upper: f64::INFINITY,
        direction: [0.0; 3],
        evidence: Evidence::Estimated,
        band: f64::INFINITY,
        complete: false,
        statistics: Statistics { evaluations: 0, node_pairs: 0, leaf_pairs: 0, neighbour_steps: 0 },
    };

    /// The penetration with these bounds, of things whose lengths are `scale` times as great in the world.
    pub(crate) fn new(
        bounds: &Bounds,
        (scale, turned): (f64, impl FnOnce(Vector) -> [f64; 3]),
        (evidence, band): (Evidence, f64),
        statistics: Statistics,
    ) -> Self {
        let upper = bounds.shift.norm() * scale;
        Self {
            lower: (bounds.lower * scale).min(upper),
            upper,
            direction: bounds.shift.try_normalize(0.0).map_or([0.0; 3], turned),
            evidence,
            band,
            complete: bounds.complete,
            statistics,
        }
    }
}
