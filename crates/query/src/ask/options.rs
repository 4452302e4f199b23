//! Options of a collision query as plain values, and the plan that validates them.

use nearmiss_hierarchy::{Part, PointHierarchy};
use nearmiss_surface::Metric;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::ask::answer::Evidence;
use crate::ask::budget::Budget;
use crate::ask::interpolation::{Interpolation, Refinement, SurfelSize};

/// The meaning of "two scans meet".
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Semantics {
    /// The obstacles of the scans have a point in common (`docs/theory/obstacle.md`). The obstacle
    /// of a scan consists of its surface where points sample a sheet, a ball about every other
    /// point, and every measured point itself. None of it is further from a measured point than
    /// that point's local radius or half the scan's reach. Surfaces are two-sided: a ball entirely
    /// inside a hollow ball does not meet it.
    #[default]
    Obstacle,
    /// The implicit surfaces have a point in common, as in Klein & Zachmann's papers. Points that
    /// do not sample a sheet are not obstacles. Two-sided as well.
    Surface,
    /// Balls of this radius (world units, zero or more) about the points of both scans overlap or
    /// touch. Exact.
    Thickened(f64),
}

impl Semantics {
    /// The part of the scan that node volumes must contain to certify these semantics.
    pub(crate) const fn part(self) -> Part {
        match self {
            Self::Obstacle => Part::Obstacle,
            Self::Surface | Self::Thickened(_) => Part::Surface,
        }
    }

    /// Returns the distance by which what counts of a scan may exceed the [box](crate::Placed::bounds) of the
    /// scan, in world units: the radius of thickened points, or 0.
    #[must_use]
    pub const fn growth(self) -> f64 {
        match self {
            Self::Thickened(radius) => radius,
            Self::Obstacle | Self::Surface => 0.0,
        }
    }

    /// Returns `true` if surfaces are compared, alone or as parts of obstacles, instead of points
    /// alone.
    pub(crate) const fn is_of_surfaces(self) -> bool {
        matches!(self, Self::Obstacle | Self::Surface)
    }
}

/// The amount of detail about a contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Detail {
    /// Crossing tangent discs. Fastest; the evidence is estimated.
    Verdict,
    /// A point on both surfaces, verified if possible.
    #[default]
    Witness,
}

/// The method that compares two leaves.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Method {
    /// Tests whether tangent discs of their points cross.
    #[default]
    Traversal,
    /// Measures how near both surfaces come to random test points (Klein & Zachmann 2004, §5.3),
    /// for comparison. Slower, and misses contacts between the test points.
    Sampling(Sampling),
    /// Searches along the graph of a (Klein & Zachmann 2005, §4). Slower than [`Self::Traversal`].
    /// Without hierarchy it uses no bounding volumes, and may miss small contacts.
    Interpolation(Interpolation),
}

/// The random test of two leaves (Klein & Zachmann 2004, §5.3, eq. 8). Test points are drawn in the
/// sphere covering of a's leaf; the leaves intersect if |f_A| + |f_B| is below a tolerance at any
/// of them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default)]
#[non_exhaustive]
pub struct Sampling {
    /// Test points per leaf pair or, if [flat](Sampling::flat), per leaf's worth of points; 1 to
    /// 65,536, default 128.
    pub test_points: u32,
    /// `d_ε` in sampling radii, of the scan with the greater one: above 0, at most 4; default 0.4.
    pub tolerance: f64,
    /// The seed of the random numbers, combined with the ids of the leaves.
    pub seed: u64,
    /// `true`: no hierarchy; test points are drawn about those points of a that are in the box of
    /// b.
    pub flat: bool,
    /// The limit of test points in total without hierarchy (Klein & Zachmann 2005, §5.2). Default:
    /// 2³² − 1.
    pub most: u32,
}

/// The greatest number of test points.
pub(crate) const MOST_TEST_POINTS: u32 = 65_536;

impl Default for Sampling {
    fn default() -> Self {
        Self { test_points: 128, tolerance: 0.4, seed: 0, flat: false, most: u32::MAX }
    }
}

impl Sampling {
    /// The same test with this number of test points.
    #[must_use]
    pub const fn with_test_points(self, test_points: u32) -> Self {
        Self { test_points, ..self }
    }

    /// The same test with this tolerance, in sampling radii.
    #[must_use]
    pub const fn with_tolerance(self, tolerance: f64) -> Self {
        Self { tolerance, ..self }
    }

    /// The same test with another seed.
    #[must_use]
    pub const fn with_seed(self, seed: u64) -> Self {
        Self { seed, ..self }
    }

    /// The same test with at most this many test points in total.
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

/// The order in which node pairs are visited. It changes no verdict unless a budget ends the
/// search.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Order {
    /// Depth first; among siblings the pair whose boxes overlap most. Fastest to completion.
    DepthFirst,
    /// By overlap: of all pairs the one whose boxes overlap most. Best under budgets.
    Overlap,
    /// The pair with most sample points of a's node on both sides of f′ of b's node. Only points
    /// further from f′ than the covering radius of b's node count (Klein & Zachmann 2004, §5.2).
    Sides,
    /// The same, with each sample point weighted by the eigenvalue gap of f′ there (Klein &
    /// Zachmann 2004, §7).
    SidesByGap,
    /// The most probable pair, by the number of cells of the intersection of the boxes that both
    /// surfaces are expected to fill (Klein & Zachmann, slides on average-case collision detection,
    /// 2003). The first query of a scan counts cells, which takes as long as preparing a tenth of it.
    Cells,
}

/// Options of a collision query. Plain values; [`CollidePlan::new`] validates them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default)]
#[non_exhaustive]
pub struct CollideOptions {
    /// The meaning of contact. Default: obstacles.
    pub semantics: Semantics,
    /// The amount of detail about a contact. Default: a witness.
    pub detail: Detail,
    /// Scans nearer than this, in world units, count as meeting; zero or more. Default: 0, only
    /// contact counts.
    ///
    /// The margin is conservative: scans with two points nearer than it are never separated.
    pub margin: f64,
    /// The evidence wanted for a separation of surfaces. Default: certified, which yields a proven
    /// distance. If the proof fails, the separation is still reported, as estimated. A search that
    /// asks for [estimated](CollideOptions::estimated) separations takes two thirds of the time on
    /// average, and a third to half of it near contact. With the geodesic kernel separations are
    /// always estimated, as enclosures are proven for Euclidean distances only.
    pub evidence: Evidence,
    /// The metric that defines the surfaces; ignored for balls about points. Default: `None`, the
    /// metric that both scans were prepared for.
    pub metric: Option<Metric>,
    /// The method that compares two leaves. Default: tangent discs. Every other method compares
    /// only surfaces.
    pub method: Method,
    /// The order in which node pairs of surfaces and obstacles are visited. Default: `None`, the
    /// fastest order measured (benches/record): depth first, or by overlap if a budget of work or
    /// time may end the search.
    pub order: Option<Order>,
    /// `true` if node pairs of surfaces and obstacles whose boxes overlap are also tested by their
    /// sphere coverings (Klein & Zachmann 2004, §5.1). Default: `false`, as the test costs more
    /// than it saves (benches/record).
    pub coverings: bool,
}

impl Default for CollideOptions {
    fn default() -> Self {
        Self {
            semantics: Semantics::default(),
            detail: Detail::default(),
            margin: 0.0,
            evidence: Evidence::Certified,
            metric: None,
            method: Method::default(),
            order: None,
            coverings: false,
        }
    }
}

impl CollideOptions {
    /// The options of a search that only asks whether things meet, by the default method.
    pub(crate) fn of_verdicts(&self) -> Self {
        Self { evidence: Evidence::Estimated, detail: Detail::Verdict, ..self.by_descent() }
    }

    /// The same options with the default method.
    pub(crate) fn by_descent(&self) -> Self {
        Self { method: Method::Traversal, order: None, coverings: false, ..*self }
    }

    /// The default options with [estimated](Evidence::Estimated) separations: no proofs, and the
    /// fastest search.
    #[must_use]
    pub fn estimated() -> Self {
        Self { evidence: Evidence::Estimated, ..Self::default() }
    }

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

    /// The same options with this evidence for separations.
    #[must_use]
    pub const fn with_evidence(self, evidence: Evidence) -> Self {
        Self { evidence, ..self }
    }

    /// The same options with this metric.
    #[must_use]
    pub const fn with_metric(self, metric: Metric) -> Self {
        Self { metric: Some(metric), ..self }
    }

    /// Returns `true` if separations of surfaces must be proven. Separations of points always are.
    pub(crate) fn certifies(&self) -> bool {
        self.semantics.is_of_surfaces() && self.evidence == Evidence::Certified
    }

    /// The same options with this method.
    #[must_use]
    pub const fn with_method(self, method: Method) -> Self {
        Self { method, ..self }
    }

    /// The same options with this order.
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

/// An invalid question.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum PlanError {
    /// The radius is negative, infinite or NaN.
    #[error("expected a finite radius of at least 0 about the points, got {0}")]
    Radius(f64),
    /// The margin is negative, infinite or NaN.
    #[error("expected a finite margin of at least 0, got {0}")]
    Margin(f64),
    /// The link length is negative, infinite or NaN.
    #[error("expected a finite link length of at least 0, got {0}")]
    Link(f64),
    /// The relative precision is out of range.
    #[error("expected a relative precision of at least 0 and below 1, got {0}")]
    Relative(f64),
    /// Too few or too many test points.
    #[error("expected 1 to 65536 test points, got {0}")]
    TestPoints(u32),
    /// The tolerance is out of range.
    #[error("expected a tolerance above 0 and at most 4 sampling radii, got {0}")]
    Tolerance(f64),
    /// Too few or too many surfels.
    #[error("expected 1 to 65536 surfels, or a surfel size of 1 to 1024 sampling radii, got {0}")]
    SurfelSize(f64),
    /// The probability is not between 0 and 1.
    #[error("expected a probability above 0 and below 1 that each surfel has a point, got {0}")]
    Probability(f64),
    /// The tolerance of a refinement in a sphere is out of range.
    #[error("expected a tolerance of the refinement above 0.01 and at most 1 sampling radius, got {0}")]
    Refinement(f64),
    /// The spacing or tolerance of curves is not positive and finite.
    #[error("expected a finite spacing or tolerance above 0, got {0}")]
    CurveLength(f64),
    /// Sampling and interpolation decide whether surfaces cross, not how far apart they are.
    #[error(
        "expected no margin and no radius about the points with the methods `sampling` and `interpolation`, got one; leave it out, \
         or use the method `traversal`"
    )]
    SamplingAlone,
    /// The option is for two scans; a mesh and a scan are compared without it.
    #[error("expected the default method and order for a mesh and a scan, got {0}; leave it out")]
    NotForMeshes(&'static str),
    /// The option is for two scans; shapes and rays are compared with a scan without it.
    #[error("expected the default method for shapes and rays, got {0}; leave it out")]
    NotForShapes(&'static str),
    /// The surfaces of the two scans are defined by different metrics.
    #[error(
        "expected two scans prepared for the same kernel, got the {} and the {} kernel; prepare one of them again",
        .0[0], .0[1]
    )]
    Metrics([Metric; 2]),
    /// A scan was prepared for another metric than the options ask for.
    #[error(
        "expected scans prepared for the {asked} kernel, got the {stored} kernel; prepare them for the {asked} kernel, or \
         ask for the {stored} kernel"
    )]
    Metric {
        /// The metric that was asked for.
        asked: Metric,
        /// The metric that the scan was prepared for.
        stored: Metric,
    },
}

/// The metric of both scans. Fails if they differ from each other or from `asked`.
fn common_metric(asked: Option<Metric>, stored: [Metric; 2]) -> Result<Metric, PlanError> {
    match asked {
        Some(asked) => match stored.into_iter().find(|&stored| stored != asked) {
            Some(stored) => Err(PlanError::Metric { asked, stored }),
            None => Ok(asked),
        },
        None if stored[0] != stored[1] => Err(PlanError::Metrics(stored)),
        None => Ok(stored[0]),
    }
}

/// Checks that the numbers of the method are in range, and that the method supports the question.
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
                SurfelSize::Count(count) if !(1..=MOST_TEST_POINTS).contains(&count) => {
                    return Err(PlanError::SurfelSize(f64::from(count)));
                }
                SurfelSize::Radius(radii) if !(1.0..=1024.0).contains(&radii) => {
                    return Err(PlanError::SurfelSize(radii));
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
/// A plan serves every pair of scans of the same [metric](PointHierarchy::metric), in any poses.
/// Make one for a whole [`World`](crate::World).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CollidePlan {
    options: CollideOptions,
}

impl CollidePlan {
    /// Validates `options` for two scans in any poses.
    ///
    /// # Errors
    /// Names the option that is out of range, or the [metric](PointHierarchy::metric) that does not
    /// match. Balls about points are independent of the metric and match any.
    pub fn new(options: &CollideOptions, a: &PointHierarchy, b: &PointHierarchy) -> Result<Self, PlanError> {
        Self::of_metrics(options, [a.metric(), b.metric()])
    }

    /// Validates `options` for any scans of a metric, such as those that a [world](crate::World) will have.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn of_metric(options: &CollideOptions, metric: Metric) -> Result<Self, PlanError> {
        Self::of_metrics(options, [metric; 2])
    }

    pub(crate) fn of_metrics(options: &CollideOptions, metrics: [Metric; 2]) -> Result<Self, PlanError> {
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
            let metric = common_metric(options.metric, metrics)?;
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
        let by_paper = matches!(order, Some(Order::Sides | Order::SidesByGap | Order::Cells));
        let closer = coverings || by_paper || budget.resolution.is_some();
        semantics.is_of_surfaces() && (method != Method::Traversal || closer)
    }

    /// Returns the distance, in world units, up to which points or surfaces count as meeting. This
    /// is the reach of a [broad phase](crate::World::near_pairs) for this question.
    #[must_use]
    pub fn reach(&self) -> f64 {
        2.0 * self.options.semantics.growth() + self.options.margin
    }

    /// The plan of a search that only asks whether the scans meet, by the default method.
    pub(crate) fn of_verdicts(&self) -> Self {
        Self { options: self.options.of_verdicts() }
    }

    /// The same plan with other test points, which must be in range.
    pub(crate) fn with_sampling(self, sampling: Sampling) -> Self {
        Self { options: self.options.with_method(Method::Sampling(sampling)) }
    }

    /// The options that were validated, with the metric of the scans.
    #[must_use]
    pub fn options(&self) -> &CollideOptions {
        &self.options
    }
}
