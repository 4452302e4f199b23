//! All of `{x | f_A(x) = f_B(x) = 0}`: the curves in which two surfaces cut each other, as polylines.
//!
//! All contacts of the two scans say where discs of either scan cross. From the first of these places that no
//! curve has passed, Newton's method leads onto both surfaces, and from there the curve is followed both ways
//! (`follow`): ahead along `n_A × n_B`, back onto both surfaces by Newton's method, in steps that get shorter
//! where the curve turns. Crossings that it passed start no other (`trail`). Places where the surfaces cross
//! steeply come first: where they graze, first order says little (docs/theory/curves.md).

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

/// Tolerances below this share of the lesser sampling radius are not reached by single-precision sums.
const LEAST_TOLERANCE: f64 = 1e-5;

/// Evaluations along curves, in steps of a sampling radius, for each of the pairs of leaves that sound scans
/// may have at most, of which few are on a curve: a tenth of what it takes to follow one through.
const EVALUATIONS: f64 = 10.0;

/// Crossings of discs at angles with a sine from this on start curves before all others.
const STEEP: f64 = 0.3;

/// How curves are to be drawn; lengths in the world.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[non_exhaustive]
pub struct CurveOptions {
    /// The wanted distance of points that follow each other; they are nearer where a chord would leave its
    /// curve by more than a fortieth of that, or of two sampling radii. None: twice the lesser of the scans'
    /// sampling radii.
    pub spacing: Option<f64>,
    /// The greatest |f| of either surface at a point. None: a thousandth of that radius; never less than a
    /// hundredth of that.
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
    /// [`PlanError::CurveLength`] for a spacing or tolerance that is not positive; [`PlanError::Metrics`] for
    /// scans that are prepared for different kernels.
    pub fn new(options: &CurveOptions, a: &PointHierarchy, b: &PointHierarchy) -> Result<Self, PlanError> {
        let given = [options.spacing, options.tolerance].into_iter().flatten();
        if let Some(length) = given.into_iter().find(|&l| !(l > 0.0 && l.is_finite())) {
            return Err(PlanError::CurveLength(length));
        }
        let contacts = CollideOptions::default()
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

/// The curves in which two surfaces cut each other, in the world.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Curves {
    /// The points of all, curve after curve, each in order.
    pub points: Vec<[f64; 3]>,
    /// The curves, in the order in which they were found.
    pub curves: Vec<Curve>,
    /// The greatest |f| of either surface at any of the points.
    pub max_residual: f64,
    /// Whether the budget lasted, and the poses are some.
    pub complete: bool,
    /// What that cost.
    pub statistics: Statistics,
}

impl Curves {
    /// The length of all curves together.
    #[must_use]
    pub fn length(&self) -> f64 {
        let between =
            |[i, j]: [usize; 2]| (Vector3::from(self.points[i]) - Vector3::from(self.points[j])).norm();
        self.curves.iter().flat_map(Curve::edges).map(between).fold(0.0, |sum, length| sum + length)
    }

    /// How many of the curves are loops.
    #[must_use]
    pub fn closed(&self) -> usize {
        self.curves.iter().filter(|curve| curve.is_closed()).count()
    }
}

/// Reused between queries.
#[derive(Debug, Clone, Default)]
pub(crate) struct CurveScratch {
    contacts: Contacts,
    trail: Trail,
}

/// Leaves in `found` the curves in which two surfaces cut each other. See
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

/// Two crossing discs as a place.
fn crossing(contact: &Contact) -> Place {
    let normals = contact.normals.map_or([Vector3::zeros(); 2], |normals| normals.map(Vector3::from));
    Place::between(contact.point.into(), normals, contact.residual)
}
