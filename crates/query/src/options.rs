//! What is asked: options as plain numbers, and the plan that they validate to.

use nearmiss_hierarchy::PointHierarchy;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// What it means that two scans meet.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Semantics {
    /// Their surfaces have a point in common. Two-sided: a ball wholly inside a hollow ball does not meet it.
    #[default]
    Surface,
    /// Balls of this radius (world units, zero or more) about the points of both overlap or touch: exact.
    Thickened(f64),
}

/// How much to say of a contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Detail {
    /// Where the points' tangent discs cross: fastest; the evidence is estimated.
    Verdict,
    /// A point on both surfaces, verified where that can be had.
    #[default]
    Witness,
}

/// What is asked. Plain values; [`CollidePlan::new`] validates them.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[non_exhaustive]
pub struct CollideOptions {
    /// What it means to meet. Default: surfaces.
    pub semantics: Semantics,
    /// How much to say of a contact. Default: a witness.
    pub detail: Detail,
}

impl CollideOptions {
    /// The same options with these semantics.
    #[must_use]
    pub const fn with_semantics(self, semantics: Semantics) -> Self {
        Self { semantics, ..self }
    }

    /// The same options with this detail.
    #[must_use]
    pub const fn with_detail(self, detail: Detail) -> Self {
        Self { detail, ..self }
    }
}

/// Why a question cannot be asked.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum PlanError {
    /// A radius that is no length.
    #[error("a radius of {0} about the points; it must be finite and not negative")]
    Radius(f64),
}

/// A validated question about two scans.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CollidePlan {
    options: CollideOptions,
}

impl CollidePlan {
    /// Validates `options` for two scans in any poses.
    ///
    /// # Errors
    /// Names the option that is out of range.
    pub fn new(
        options: &CollideOptions,
        _a: &PointHierarchy,
        _b: &PointHierarchy,
    ) -> Result<Self, PlanError> {
        match options.semantics {
            Semantics::Thickened(r) if !(r >= 0.0 && r.is_finite()) => Err(PlanError::Radius(r)),
            _ => Ok(Self { options: *options }),
        }
    }

    /// The options that were validated.
    #[must_use]
    pub fn options(&self) -> &CollideOptions {
        &self.options
    }
}
