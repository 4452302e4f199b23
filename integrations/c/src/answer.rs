//! Answers of questions about two scans.

use nearmiss::{BodyVerdict, Reason as Why, ShapeVerdict, Verdict as Found};

use crate::options::Evidence;

/// A verdict.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(i32)]
pub enum Verdict {
    /// The question could not be decided; see the reason.
    Undecided = -1,
    /// They are apart; of a motion: it is free.
    Separated = 0,
    /// They touch; of a motion: it ends in an impact.
    Touching = 1,
}

/// The reason of an undecided verdict.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(i32)]
pub enum Reason {
    /// It is decided.
    None = 0,
    /// The budget was spent.
    Budget = 1,
    /// The points of one are on lines or too sparse where they come near each other.
    Undersampled = 2,
    /// The points of one do not fit a single sheet there.
    Ambiguous = 3,
    /// A pose is out of range.
    Range = 4,
    /// They come nearer than can be proven apart.
    Near = 5,
    /// Another reason.
    Other = 6,
    /// A shape is out of range.
    Shape = 7,
    /// The kernel is geodesic, so nothing is proven about a motion.
    Geodesic = 8,
}

impl Reason {
    pub(crate) const fn new(why: Why) -> Self {
        match why {
            Why::Budget { .. } => Self::Budget,
            Why::Undersampled => Self::Undersampled,
            Why::Ambiguous => Self::Ambiguous,
            Why::Pose => Self::Range,
            Why::Shape => Self::Shape,
            _ => Self::Other,
        }
    }
}

pub(crate) const fn evidence(of: nearmiss::Evidence) -> Evidence {
    match of {
        nearmiss::Evidence::Certified => Evidence::Certified,
        nearmiss::Evidence::Estimated => Evidence::Estimated,
    }
}

/// A number that is missing.
pub(crate) const NONE: f64 = f64::NAN;

/// A place or direction that is missing.
pub(crate) const NOWHERE: [f64; 3] = [NONE; 3];

/// A point that is missing.
pub(crate) const NOBODY: u32 = u32::MAX;

/// An answer. Missing numbers are NaN, missing points `UINT32_MAX`. World coordinates and lengths.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct Answer {
    /// The verdict.
    pub verdict: Verdict,
    /// The certainty of the verdict.
    pub evidence: Evidence,
    /// The reason if it is undecided.
    pub reason: Reason,
    /// The point of the first scan that shows the contact, as the input numbers it; the triangle of a mesh.
    pub source_a: u32,
    /// The point of the second scan, or the triangle of a mesh.
    pub source_b: u32,
    /// A place where both touch.
    pub witness: [f64; 3],
    /// The unit normal of the first surface there, of either sign; missing if points are compared.
    pub normal_a: [f64; 3],
    /// The unit normal of the second surface there.
    pub normal_b: [f64; 3],
    /// The uncertainty of the place.
    pub residual: f64,
    /// A proven lower bound of the distance, of a certified separation.
    pub gap: f64,
    /// The length within which nothing is claimed about the scanned things themselves. Infinite if a pose or
    /// a shape is out of range.
    pub band: f64,
    /// The probability of a contact, if the budget was spent.
    pub likelihood: f64,
    /// The work that was done: evaluations of surfaces.
    pub evaluations: u64,
    /// The work that was done: pairs of nodes.
    pub node_pairs: u64,
    /// The work that was done: pairs of leaves.
    pub leaf_pairs: u64,
}

impl Answer {
    /// An undecided answer.
    const fn undecided(reason: Reason, band: f64) -> Self {
        Self {
            verdict: Verdict::Undecided,
            evidence: Evidence::None,
            reason,
            source_a: NOBODY,
            source_b: NOBODY,
            witness: NOWHERE,
            normal_a: NOWHERE,
            normal_b: NOWHERE,
            residual: NONE,
            gap: NONE,
            band,
            likelihood: NONE,
            evaluations: 0,
            node_pairs: 0,
            leaf_pairs: 0,
        }
    }

    /// The same answer for this reason.
    fn because(self, why: Why) -> Self {
        let likelihood = if let Why::Budget { likelihood } = why { likelihood } else { NONE };
        Self { reason: Reason::new(why), likelihood, ..self }
    }

    /// The same answer with both sides exchanged.
    pub(crate) fn swapped(self) -> Self {
        let Self { source_a, source_b, normal_a, normal_b, .. } = self;
        Self { source_a: source_b, source_b: source_a, normal_a: normal_b, normal_b: normal_a, ..self }
    }

    /// The answer about a scan and a shape.
    pub(crate) fn of_shape(answer: &nearmiss::ShapeAnswer, shape_is_first: bool) -> Self {
        let none = Self::undecided(Reason::None, answer.band);
        match answer.verdict {
            ShapeVerdict::Touching { point: witness, source, evidence: certainty } => {
                let (verdict, evidence) = (Verdict::Touching, evidence(certainty));
                let [source_a, source_b] =
                    if shape_is_first { [NOBODY, source.0] } else { [source.0, NOBODY] };
                Self { verdict, evidence, witness, source_a, source_b, ..none }
            }
            ShapeVerdict::Separated { evidence: certainty } => {
                Self { verdict: Verdict::Separated, evidence: evidence(certainty), ..none }
            }
            ShapeVerdict::Undecided(why) => none.because(why),
        }
    }

    /// The answer about two bodies.
    pub(crate) fn of_bodies(answer: &nearmiss::BodyAnswer) -> Self {
        let none = Self::undecided(Reason::None, answer.band);
        match answer.verdict {
            BodyVerdict::Touching { point: witness, evidence: certainty } => {
                Self { verdict: Verdict::Touching, evidence: evidence(certainty), witness, ..none }
            }
            BodyVerdict::Separated { evidence: certainty } => {
                Self { verdict: Verdict::Separated, evidence: evidence(certainty), ..none }
            }
            BodyVerdict::Undecided(why) => none.because(why),
        }
    }

    #[inline]
    pub(crate) fn new(answer: &nearmiss::Answer) -> Self {
        let none = Self {
            evaluations: answer.statistics.evaluations,
            node_pairs: answer.statistics.node_pairs,
            leaf_pairs: answer.statistics.leaf_pairs,
            ..Self::undecided(Reason::None, answer.band)
        };
        match answer.verdict {
            Found::Intersecting { contact, evidence: certainty } => {
                let Contact { point, normal_a, normal_b, residual, source_a, source_b } =
                    Contact::new(&contact);
                let (verdict, evidence) = (Verdict::Touching, evidence(certainty));
                Self {
                    verdict,
                    evidence,
                    witness: point,
                    normal_a,
                    normal_b,
                    residual,
                    source_a,
                    source_b,
                    ..none
                }
            }
            Found::Separated { gap, evidence: certainty } => {
                let gap = if certainty == nearmiss::Evidence::Certified { gap } else { NONE };
                Self { verdict: Verdict::Separated, evidence: evidence(certainty), gap, ..none }
            }
            Found::Undecided(why) => none.because(why),
        }
    }
}

/// A contact of two scans, in the world.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct Contact {
    /// The place.
    pub point: [f64; 3],
    /// The unit normal of the first surface there, of either sign; NaN if points are compared.
    pub normal_a: [f64; 3],
    /// The unit normal of the second surface there.
    pub normal_b: [f64; 3],
    /// The uncertainty of the place.
    pub residual: f64,
    /// The point of the first scan, as the input numbers it.
    pub source_a: u32,
    /// The point of the second scan.
    pub source_b: u32,
}

impl Contact {
    pub(crate) fn new(contact: &nearmiss::Contact) -> Self {
        let [normal_a, normal_b] = contact.normals.unwrap_or([NOWHERE; 2]);
        let [source_a, source_b] = contact.sources.map(|source| source.0);
        Self { point: contact.point, normal_a, normal_b, residual: contact.residual, source_a, source_b }
    }
}

/// A contact point for a physics solver, in the world.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ManifoldPoint {
    /// The point midway between the surfaces.
    pub point: [f64; 3],
    /// The unit direction in which the first scan moves out of the second.
    pub normal: [f64; 3],
    /// The distance along the normal; negative for penetration.
    pub gap: f64,
    /// The nearest point of the first scan, as the input numbers it.
    pub source_a: u32,
    /// The nearest point of the second scan.
    pub source_b: u32,
}

impl ManifoldPoint {
    pub(crate) fn new(place: &nearmiss::ManifoldPoint) -> Self {
        let [source_a, source_b] = place.sources.map(|source| source.0);
        Self { point: place.point, normal: place.normal, gap: place.gap, source_a, source_b }
    }
}

/// Bounds on a distance, in world units: lower ≤ distance ≤ upper. If a pose is out of range, `lower` is 0,
/// `upper` and `band` are infinite, the places NaN and the points `UINT32_MAX`.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct Distance {
    /// A proven lower bound; 0 if nothing is known.
    pub lower: f64,
    /// An upper bound: the distance of the two places; infinite if nothing is known.
    pub upper: f64,
    /// The nearest place on the first scan.
    pub point_a: [f64; 3],
    /// The nearest place on the second scan.
    pub point_b: [f64; 3],
    /// The length within which nothing is claimed about the scanned things themselves.
    pub band: f64,
    /// The point of the first scan near its place, as the input numbers it.
    pub source_a: u32,
    /// The point of the second scan near its place.
    pub source_b: u32,
    /// The certainty of the upper bound; none if it is infinite.
    pub evidence: Evidence,
    /// True if the budget did not end the search.
    pub complete: bool,
}

impl Distance {
    pub(crate) fn new(distance: &nearmiss::Distance) -> Self {
        let &nearmiss::Distance { lower, upper, band, complete, .. } = distance;
        // Without an upper bound, the library returns any two points.
        let is_known = upper.is_finite();
        let [point_a, point_b] = if is_known { distance.points } else { [NOWHERE; 2] };
        let [source_a, source_b] =
            if is_known { distance.sources.map(|source| source.0) } else { [NOBODY; 2] };
        let evidence = if is_known { evidence(distance.evidence) } else { Evidence::None };
        Self { lower, upper, point_a, point_b, band, source_a, source_b, evidence, complete }
    }
}
