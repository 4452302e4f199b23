//! What is asked: options as plain numbers, and the plan that they validate to.

use nearmiss_hierarchy::{Part, PointHierarchy};
use nearmiss_surface::Metric;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::ask::answer::Evidence;
use crate::ask::budget::Budget;
use crate::ask::interpolation::{Interpolation, Refinement, Surfels};

/// What it means that two scans meet.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Semantics {
    /// Their obstacles have a point in common (`docs/theory/obstacle.md`). The obstacle of a scan is its
    /// surface where points sample a sheet, a ball about every other point, and every measured point itself;
    /// none of it is further from a measured point than that point's local radius or half the scan's reach.
    /// Two-sided: a ball wholly inside a hollow ball does not meet it.
    #[default]
    Obstacle,
    /// Their implicit surfaces have a point in common, as the papers define them: points that sample no sheet
    /// are no obstacles. Two-sided likewise.
    Surface,
    /// Balls of this radius (world units, zero or more) about the points of both overlap or touch: exact.
    Thickened(f64),
}

impl Semantics {
    /// What the volumes of nodes must hold for a certificate of these semantics.
    pub(crate) const fn part(self) -> Part {
        match self {
            Self::Obstacle => Part::Obstacle,
            Self::Surface | Self::Thickened(_) => Part::Surface,
        }
    }

    /// Returns `true` if surfaces are compared, alone or as parts of obstacles, not points alone.
    pub(crate) const fn is_of_surfaces(self) -> bool {
        matches!(self, Self::Obstacle | Self::Surface)
    }
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

/// How two leaves are compared.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Method {
    /// Whether tangent discs of their points cross.
    #[default]
    Traversal,
    /// How near both surfaces come to random test points: S0 §5.3, for comparison. Slower, and misses what
    /// lies between the test points.
    Sampling(Sampling),
    /// By searches along the graph of a: S1 §4. Slower than [`Self::Traversal`]; without hierarchy it does
    /// without volumes, and may miss small contacts.
    Interpolation(Interpolation),
}

/// The random test of two leaves (S0 §5.3, eq. 8): test points in the sphere covering of a's leaf, in which
/// an intersection is seen when |f_A| + |f_B| is less than a tolerance in any.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default)]
#[non_exhaustive]
pub struct Sampling {
    /// Test points for each pair of leaves, or, [flat](Sampling::flat), for each leaf's worth of points; 1 to
    /// 65,536, default 128.
    pub test_points: u32,
    /// `d_ε` in sampling radii (of the scan with the greater one): above 0, at most 4; default 0.4.
    pub tolerance: f64,
    /// What the random numbers come from, together with the ids of the leaves.
    pub seed: u64,
    /// Without hierarchy: test points about those points of a that lie in the box of b.
    pub flat: bool,
    /// Without hierarchy: no more test points than this in all, as S1 §5.2 has them. Default: 2³² − 1.
    pub most: u32,
}

/// Greatest number of test points.
pub(crate) const MOST_TEST_POINTS: u32 = 65_536;

impl Default for Sampling {
    fn default() -> Self {
        Self { test_points: 128, tolerance: 0.4, seed: 0, flat: false, most: u32::MAX }
    }
}

impl Sampling {
    /// The same test with so many test points.
    #[must_use]
    pub const fn with_test_points(self, test_points: u32) -> Self {
        Self { test_points, ..self }
    }

    /// The same test with this tolerance, in sampling radii.
    #[must_use]
    pub const fn with_tolerance(self, tolerance: f64) -> Self {
        Self { tolerance, ..self }
    }

    /// The same test with other random numbers.
    #[must_use]
    pub const fn with_seed(self, seed: u64) -> Self {
        Self { seed, ..self }
    }

    /// The same test with no more test points than this in all.
    #[must_use]
    pub const fn with_most(self, most: u32) -> Self {
        Self { most, ..self }
    }

    /// The same test with or without hierarchy.
    #[must_use]
    pub const fn with_flat(self, flat: bool) -> Self {
        Self { flat, ..self }
    }
}

/// Which pairs of nodes are looked at first. Changes no verdict unless a budget ends the search.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Order {
    /// Depth first, of siblings the one whose boxes overlap most: fastest to the end.
    DepthFirst,
    /// Of all pairs the one whose boxes overlap most of each other: best under budgets.
    Overlap,
    /// The pair with most sample points of a's node on either side of f′ of b's, further from it than its
    /// covering radius (S0 §5.2).
    Sides,
    /// The same, each sample point weighing with the eigenvalue gap of f′ where it is (S0 §7).
    SidesByGap,
}

/// What is asked. Plain values; [`CollidePlan::new`] validates them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default)]
#[non_exhaustive]
pub struct CollideOptions {
    /// What it means to meet. Default: obstacles.
    pub semantics: Semantics,
    /// How much to say of a contact. Default: a witness.
    pub detail: Detail,
    /// What nearer than this, in world units, counts as meeting; zero or more. Default: 0, nothing but
    /// contact.
    ///
    /// Never too small: two points nearer than it are never separated.
    pub margin: f64,
    /// How sure a separation of surfaces should be. Default: estimated. Certified costs half as much again,
    /// near contact two to three times as much, and says a proven distance; where the proof fails, the
    /// separation is still answered as estimated. By the geodesic kernel it always is, for enclosures are
    /// proven of straight distances alone.
    pub evidence: Evidence,
    /// By which distances surfaces are defined; balls about points know none. None, the default: as both
    /// scans were prepared.
    pub metric: Option<Metric>,
    /// How two leaves are compared. Default: by tangent discs. Any other method compares surfaces alone.
    pub method: Method,
    /// Which pairs of nodes are looked at first, of surfaces and obstacles. None, the default: what measuring
    /// found best (benches/record), depth first, or by overlap where a budget of work or time may end the
    /// search.
    pub order: Option<Order>,
    /// Whether nodes whose boxes overlap are also parted by their sphere coverings (S0 §5.1), of surfaces and
    /// obstacles. Default: no, for that costs more than it saves (benches/record).
    pub coverings: bool,
}

impl Default for CollideOptions {
    fn default() -> Self {
        Self {
            semantics: Semantics::default(),
            detail: Detail::default(),
            margin: 0.0,
            evidence: Evidence::Estimated,
            metric: None,
            method: Method::default(),
            order: None,
            coverings: false,
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

    /// The same options by this metric.
    #[must_use]
    pub const fn with_metric(self, metric: Metric) -> Self {
        Self { metric: Some(metric), ..self }
    }

    /// Whether separations are to be proven; of points they always are.
    pub(crate) fn certifies(&self) -> bool {
        self.semantics.is_of_surfaces() && self.evidence == Evidence::Certified
    }

    /// The same options with this method.
    #[must_use]
    pub const fn with_method(self, method: Method) -> Self {
        Self { method, ..self }
    }

    /// The same options in this order.
    #[must_use]
    pub const fn with_order(self, order: Order) -> Self {
        Self { order: Some(order), ..self }
    }

    /// The same options with or without sphere coverings.
    #[must_use]
    pub const fn with_coverings(self, coverings: bool) -> Self {
        Self { coverings, ..self }
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
    /// A link length that is no length.
    #[error("link must be a finite length, zero or more, got {0}")]
    Link(f64),
    /// A relative precision out of range.
    #[error("relative must be at least 0 and less than 1, got {0}")]
    Relative(f64),
    /// Too few or too many test points.
    #[error("{0} test points; 1 to 65536 are possible")]
    TestPoints(u32),
    /// A tolerance that is none.
    #[error("a tolerance of {0} sampling radii; it must be more than 0 and at most 4")]
    Tolerance(f64),
    /// Too few or too many surfels.
    #[error("{0} surfels; 1 to 65536 are possible, or 1 to 1024 sampling radii for each")]
    Surfels(f64),
    /// A probability that none can have.
    #[error("a probability of {0} that each surfel has a point; it must be more than 0 and less than 1")]
    Probability(f64),
    /// A tolerance in a sphere that is none.
    #[error("a tolerance of {0} sampling radii in a sphere; it must be more than 0.01 and at most 1")]
    Refinement(f64),
    /// A spacing or tolerance of curves that is no length.
    #[error("a spacing or tolerance of {0}; it must be finite and more than 0")]
    CurveLength(f64),
    /// Test points say whether surfaces cross, not how far apart they are.
    #[error(
        "the methods `sampling` and `interpolation` compare surfaces, without a margin; leave the margin and the thickness out"
    )]
    SamplingAlone,
    /// The surfaces of the two scans are not defined alike.
    #[error(
        "one scan is prepared for the {} kernel, the other for the {} one; prepare both for the same",
        .0[0], .0[1]
    )]
    Metrics([Metric; 2]),
    /// A scan's surface is not defined as it is asked for.
    #[error(
        "asked by the {asked} kernel of a scan that is prepared for the {stored} one; prepare it for the {asked} kernel, or \
         ask by the {stored} one"
    )]
    Metric {
        /// By which metric it was asked.
        asked: Metric,
        /// For which the scan is.
        stored: Metric,
    },
}

/// The metric of both scans, which must be that which is asked for, if any is.
fn common_metric(asked: Option<Metric>, a: &PointHierarchy, b: &PointHierarchy) -> Result<Metric, PlanError> {
    let stored = [a.metric(), b.metric()];
    match asked {
        Some(asked) => match stored.into_iter().find(|&stored| stored != asked) {
            Some(stored) => Err(PlanError::Metric { asked, stored }),
            None => Ok(asked),
        },
        None if stored[0] != stored[1] => Err(PlanError::Metrics(stored)),
        None => Ok(stored[0]),
    }
}

/// Whether the numbers of the method are in range, and it answers such questions.
fn check_method(options: &CollideOptions) -> Result<(), PlanError> {
    match options.method {
        Method::Traversal => return Ok(()),
        Method::Sampling(Sampling { test_points, tolerance, .. }) => {
            if !(1..=MOST_TEST_POINTS).contains(&test_points) {
                return Err(PlanError::TestPoints(test_points));
            }
            if !(tolerance > 0.0 && tolerance <= 4.0) {
                return Err(PlanError::Tolerance(tolerance));
            }
        }
        Method::Interpolation(Interpolation { surfels, probability, refinement, .. }) => {
            match surfels {
                Surfels::Count(count) if !(1..=MOST_TEST_POINTS).contains(&count) => {
                    return Err(PlanError::Surfels(f64::from(count)));
                }
                Surfels::Radius(radii) if !(1.0..=1024.0).contains(&radii) => {
                    return Err(PlanError::Surfels(radii));
                }
                _ => {}
            }
            if !(probability > 0.0 && probability < 1.0) {
                return Err(PlanError::Probability(probability));
            }
            match refinement {
                Refinement::Sphere(tolerance) | Refinement::Grid(tolerance)
                    if !(tolerance > 0.01 && tolerance <= 1.0) =>
                {
                    return Err(PlanError::Refinement(tolerance));
                }
                _ => {}
            }
        }
    }
    let alone = !options.semantics.is_of_surfaces() || options.margin > 0.0;
    if alone { Err(PlanError::SamplingAlone) } else { Ok(()) }
}

/// A validated question about two scans.
///
/// A plan serves every pair of scans of the same [metric](PointHierarchy::metric), in any poses. Make one for
/// a whole [`World`](crate::World).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CollidePlan {
    options: CollideOptions,
}

impl CollidePlan {
    /// Validates `options` for two scans in any poses.
    ///
    /// # Errors
    /// Names the option that is out of range, or the [metric](PointHierarchy::metric) that does not fit.
    /// Balls about points, which know no kernel, fit any.
    pub fn new(options: &CollideOptions, a: &PointHierarchy, b: &PointHierarchy) -> Result<Self, PlanError> {
        let is_length = |l: f64| l >= 0.0 && l.is_finite();
        match options.semantics {
            Semantics::Thickened(r) if !is_length(r) => return Err(PlanError::Radius(r)),
            _ if !is_length(options.margin) => return Err(PlanError::Margin(options.margin)),
            _ => {}
        }
        check_method(options)?;
        let mut options = *options;
        if options.method != Method::Traversal {
            // The papers' methods compare surfaces.
            options.semantics = Semantics::Surface;
        }
        if options.semantics.is_of_surfaces() {
            let metric = common_metric(options.metric, a, b)?;
            options.metric = Some(metric);
            if metric == Metric::Geodesic {
                options.evidence = Evidence::Estimated;
            }
        }
        Ok(Self { options })
    }

    /// Returns `true` if the query uses a method of the papers instead of the default search.
    pub(crate) fn is_of_papers(&self, budget: &Budget) -> bool {
        let CollideOptions { semantics, method, order, coverings, .. } = self.options;
        let by_sides = matches!(order, Some(Order::Sides | Order::SidesByGap));
        let closer = coverings || by_sides || budget.resolution.is_some();
        semantics.is_of_surfaces() && (method != Method::Traversal || closer)
    }

    /// The distance, in world units, up to which points or surfaces count as meeting: the reach of a
    /// [broad phase](crate::World::near_pairs) for this question.
    #[must_use]
    pub fn reach(&self) -> f64 {
        match self.options.semantics {
            Semantics::Thickened(radius) => 2.0 * radius + self.options.margin,
            Semantics::Obstacle | Semantics::Surface => self.options.margin,
        }
    }

    /// The same question with other test points, which are in range.
    pub(crate) fn with_sampling(self, sampling: Sampling) -> Self {
        Self { options: self.options.with_method(Method::Sampling(sampling)) }
    }

    /// The options that were validated, with the metric of the scans.
    #[must_use]
    pub fn options(&self) -> &CollideOptions {
        &self.options
    }
}
