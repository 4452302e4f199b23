//! Intersection curves `{x | f_A(x) = f_B(x) = 0}` of two surfaces, as polylines.
//!
//! The contacts of the two scans give the points where their discs cross. From the first crossing
//! that no curve has passed, Newton's method finds a point on both surfaces, and the curve is
//! followed in both directions (`follow`). Each step goes ahead along `n_A × n_B` and returns to
//! both surfaces by Newton's method; steps get shorter where the curve turns. Crossings that a
//! curve has passed start no other (`trail`). Steep crossings come first, as grazing ones are
//! unreliable to first order (docs/theory/curves.md).

mod follow;
mod line;
mod trail;

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::PointHierarchy;

use crate::ask::answer::{Contact, Contacts, Evidence, Statistics};
use crate::ask::budget::Budget;
use crate::ask::options::{CollideOptions, CollidePlan, Detail, Order, PlanError, Semantics};
use crate::contact::collide::{Asked, ContactScratch, Outputs, collide};
use crate::pair::meter::Meter;
use crate::pair::placed::Placed;
use follow::{Follower, LONGEST, SAME_TURN};
pub use line::{Curve, CurveEnd};
use trail::{Place, Trail};

/// The smallest tolerance, as a share of the lesser sampling radius, that sums in single precision
/// can reach.
const LEAST_TOLERANCE: f64 = 1e-5;

/// Evaluations per leaf pair, for the limit without a budget and a step of one sampling radius. Few
/// of the leaf pairs are on a curve, so this is a tenth of what following a curve through a leaf
/// pair takes.
const EVALUATIONS: f64 = 10.0;

/// The least sine of the angle of crossing discs from which curves are started before all others.
const STEEP: f64 = 0.3;

/// Options of a curve query. Lengths are in world units.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[non_exhaustive]
pub struct CurveOptions {
    /// The desired distance of successive points. Points are closer where a chord would deviate
    /// from its curve by more than 1/40 of that distance, or of two sampling radii if that is less.
    /// Default: `None`, twice the lesser sampling radius of the scans.
    pub spacing: Option<f64>,
    /// The greatest |f| of either surface at a point. Default: `None`, a thousandth of the lesser
    /// sampling radius. Values below 1e-5 of that radius are raised to it.
    pub tolerance: Option<f64>,
}

impl CurveOptions {
    /// The same options with this spacing.
    #[must_use]
    pub const fn with_spacing(self, spacing: f64) -> Self {
        Self { spacing: Some(spacing), ..self }
    }

    /// The same options with this tolerance.
    #[must_use]
    pub const fn with_tolerance(self, tolerance: f64) -> Self {
        Self { tolerance: Some(tolerance), ..self }
    }
}

/// Validated options for two scans.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurvePlan {
    options: CurveOptions,
    contacts: CollidePlan,
}

impl CurvePlan {
    /// Validates `options` for two scans in any poses.
    ///
    /// # Errors
    /// Returns [`PlanError::CurveLength`] for a spacing or tolerance that is not positive and
    /// finite, and [`PlanError::Metrics`] if the scans were prepared for different kernels.
    pub fn new(options: &CurveOptions, a: &PointHierarchy, b: &PointHierarchy) -> Result<Self, PlanError> {
        let given = [options.spacing, options.tolerance].into_iter().flatten();
        if let Some(length) = given.into_iter().find(|&l| !(l > 0.0 && l.is_finite())) {
            return Err(PlanError::CurveLength(length));
        }
        let contacts = CollideOptions::estimated()
            // Balls about points have no curves.
            .with_semantics(Semantics::Surface)
            .with_detail(Detail::Verdict)
            .with_evidence(Evidence::Estimated)
            .with_order(Order::DepthFirst);
        Ok(Self { options: *options, contacts: CollidePlan::new(&contacts, a, b)? })
    }

    /// The options that were validated.
    #[must_use]
    pub fn options(&self) -> &CurveOptions {
        &self.options
    }
}

/// The intersection curves of two surfaces, in the world.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Curves {
    /// The points of all curves, curve after curve, each in order.
    pub points: Vec<[f64; 3]>,
    /// The curves, in the order in which they were found.
    pub curves: Vec<Curve>,
    /// The greatest |f| of either surface at any of the points.
    pub max_residual: f64,
    /// `true` if the budget was not spent and the poses are valid.
    pub complete: bool,
    /// The cost of the query.
    pub statistics: Statistics,
}

impl Curves {
    /// Returns the total length of all curves.
    #[must_use]
    pub fn length(&self) -> f64 {
        let between =
            |[i, j]: [usize; 2]| (Vector3::from(self.points[i]) - Vector3::from(self.points[j])).norm();
        self.curves.iter().flat_map(Curve::edges).map(between).fold(0.0, |sum, length| sum + length)
    }

    /// Returns the number of closed curves.
    #[must_use]
    pub fn closed(&self) -> usize {
        self.curves.iter().filter(|curve| curve.is_closed()).count()
    }
}

/// Memory that is reused between queries.
#[derive(Debug, Clone, Default)]
pub(crate) struct CurveScratch {
    contacts: Contacts,
    trail: Trail,
}

/// Writes the intersection curves of two surfaces to `found`. See
/// [`Pair::curves`](crate::Pair::curves).
pub(crate) fn curves(
    views: [&Placed<'_>; 2],
    plan: &CurvePlan,
    budget: &Budget,
    found: &mut Curves,
    (contact, scratch): (&mut ContactScratch, &mut CurveScratch),
) {
    found.points.clear();
    found.curves.clear();
    found.max_residual = 0.0;
    let CurveScratch { contacts, trail } = scratch;
    let outputs = Outputs { contacts: Some(&mut *contacts), ..Outputs::default() };
    let asked = Asked { scans: views, plan: &plan.contacts, budget };
    let answer = collide(asked, contact, outputs);
    found.complete = contacts.complete;
    found.statistics = answer.statistics;
    let [a, b] = views.map(|view| view.sampling_radius());
    let radius = a.min(b);
    let gathers = &mut contact.gathers;
    let spacing = plan.options.spacing.unwrap_or(2.0 * radius);
    let longest = spacing.min(LONGEST * radius);
    let tolerance = plan.options.tolerance.unwrap_or(1e-3 * radius).max(LEAST_TOLERANCE * radius);
    let Some(first) = contacts.contacts.first() else { return };
    trail.clear(first.point.into(), longest);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "1 to 2¹⁶")]
    let evaluations = (EVALUATIONS * radius / longest).clamp(1.0, 65536.0) as u64;
    let meter = Meter::new(budget, views, evaluations).after(answer.statistics);
    let mut follower = Follower { views, gathers, nearest: [0; 2], meter, longest, radius, tolerance, trail };
    for steep in [true, false] {
        for contact in &contacts.contacts {
            let crossing = crossing(contact);
            if (crossing.sine >= STEEP) != steep || follower.trail.has_passed(&crossing, 0.5 * longest) {
                continue;
            }
            let Ok(place) = follower.begin(contact.point) else {
                found.complete = false;
                break;
            };
            let Some(place) = place.filter(|place| !follower.trail.has_passed(place, SAME_TURN * longest))
            else {
                continue;
            };
            let curve = follower.trace(place, spacing, &mut found.points);
            found.complete &= !curve.ends.is_some_and(|ends| ends.contains(&CurveEnd::Budget));
            found.curves.push(curve);
        }
    }
    found.max_residual = follower.trail.places.iter().fold(0.0, |most, place| place.residual.max(most));
    found.statistics = follower.meter.spent;
}

/// Converts a contact of crossing discs to a place.
fn crossing(contact: &Contact) -> Place {
    let normals = contact.normals.map_or([Vector3::zeros(); 2], |normals| normals.map(Vector3::from));
    Place::between(contact.point.into(), normals, contact.residual)
}
