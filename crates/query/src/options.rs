//! What is asked: options as plain numbers, and the plan that they validate to.

use nearmiss_hierarchy::PointHierarchy;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::verdict::Evidence;

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
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default)]
#[non_exhaustive]
pub struct CollideOptions {
    /// What it means to meet. Default: surfaces.
    pub semantics: Semantics,
    /// How much to say of a contact. Default: a witness.
    pub detail: Detail,
    /// What nearer than this, in world units, counts as meeting; zero or more. Default: 0, nothing but contact.
    ///
    /// Never too small: two points nearer than it are never separated.
    pub margin: f64,
    /// How sure a separation of surfaces should be. Default: estimated. Certified costs half as much again, near contact
    /// two to three times as much, and says a proven distance; where the proof fails, the separation is still answered
    /// as estimated.
    pub evidence: Evidence,
}

impl Default for CollideOptions {
    fn default() -> Self {
        Self {
            semantics: Semantics::default(),
            detail: Detail::default(),
            margin: 0.0,
            evidence: Evidence::Estimated,
        }
    }
}

impl CollideOptions {
    /// The same options with these semantics.
    #[must_use]
    pub const fn with_semantics(self, semantics: Semantics) -> Self {
        Self { semantics, ..self }
    }

    /// The same options with this margin.
    #[must_use]
    pub const fn with_margin(self, margin: f64) -> Self {
        Self { margin, ..self }
    }

    /// The same options with this evidence of separations.
    #[must_use]
    pub const fn with_evidence(self, evidence: Evidence) -> Self {
        Self { evidence, ..self }
    }

    /// Whether separations are to be proven; of points they always are.
    pub(crate) fn certifies(&self) -> bool {
        self.semantics == Semantics::Surface && self.evidence == Evidence::Certified
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
    /// A margin that is no length.
    #[error("a margin of {0}; it must be finite and not negative")]
    Margin(f64),
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
        let is_length = |l: f64| l >= 0.0 && l.is_finite();
        match options.semantics {
            Semantics::Thickened(r) if !is_length(r) => Err(PlanError::Radius(r)),
            _ if !is_length(options.margin) => Err(PlanError::Margin(options.margin)),
            _ => Ok(Self { options: *options }),
        }
    }

    /// How near points or surfaces must come to meet, in the world.
    pub(crate) fn reach(&self) -> f64 {
        match self.options.semantics {
            Semantics::Thickened(radius) => 2.0 * radius + self.options.margin,
            Semantics::Surface => self.options.margin,
        }
    }

    /// The options that were validated.
    #[must_use]
    pub fn options(&self) -> &CollideOptions {
        &self.options
    }
}
