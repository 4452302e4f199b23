//! An object at random poses in a scan, with the exact distances of the points.
//!
//! Lengths are given in *local spacings*. The local spacing is the greater of the distances from
//! either of the nearest two points to its sixth distinct neighbour in its own scan, times the scale of
//! the pose.

use nearmiss::{Answer, Distance, Evidence, PointCloud, Pose, Verdict};
use nearmiss_testdata::arbitrary::{rng, rotation};
use rand::RngExt;

use crate::Failure;
use crate::rivals::kiddo::PointScan;
use crate::scorer::spacings;

/// Separations of at least this many local spacings should be certified.
pub const FAR: f64 = 6.0;

/// The object's longest side over the scan's diagonal, by default.
const SHARE: f64 = 0.04;

/// The share of separations beyond [`FAR`] that must be certified, and the share of lower bounds there
/// that must be at least half of the truth.
const WANTED: f64 = 0.95;

/// The greatest distance of the nearest points at a contact, in local spacings.
const REACH: f64 = 1.0;

/// The truth about a pose, by brute force.
#[derive(Debug, Clone, Copy)]
pub struct Truth {
    /// The pose of the object; the scan stays.
    pub pose: Pose,
    /// Distance of the nearest two points.
    pub distance: f64,
    /// The local spacing at these points.
    pub spacing: f64,
}

impl Truth {
    /// Returns `true` if the points are at least [`FAR`] local spacings apart.
    #[must_use]
    pub fn is_far(&self) -> bool {
        self.distance >= FAR * self.spacing
    }
}

/// Returns `count` random poses of `body` within the bounds of `scan`, with the exact distances of the
/// points. The longest side of the body becomes `size`; by default a 25th of the scan's diagonal.
///
/// # Errors
/// When a cloud has too few points.
pub fn truths(
    scan: &PointCloud,
    body: &PointCloud,
    size: Option<f64>,
    (count, seed): (usize, u64),
) -> Result<Vec<Truth>, Failure> {
    let diagonal = 2.0 * scan.bounds().half_extents().iter().map(|x| x * x).sum::<f64>().sqrt();
    let longest = 2.0 * body.bounds().half_extents().into_iter().fold(0.0, f64::max);
    let scale = size.unwrap_or(SHARE * diagonal) / longest;
    let (spacings_a, spacings_b) = (spacings(scan)?, spacings(body)?);
    let tree = PointScan::new(scan, f64::INFINITY)?;
    let centre = body.bounds().centre();
    let (bounds, rng) = (scan.bounds(), &mut rng(seed));
    let truths = (0..count).map(|_| {
        let to =
            [0, 1, 2].map(|k| bounds.min[k] + (bounds.max[k] - bounds.min[k]) * rng.random_range(0.0..1.0));
        let turned = rotation(rng).with_scale(scale);
        let from = turned.apply(centre);
        let pose = turned.with_translation([0, 1, 2].map(|k| to[k] - from[k]));
        let (distance, i, j) = tree.nearest_pair(body, &pose);
        Truth { pose, distance, spacing: spacings_a[i].max(spacings_b[j] * scale) }
    });
    Ok(truths.collect())
}

/// Counts of answers.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Score {
    /// The poses that are far.
    pub far: usize,
    /// Certified separations among these.
    pub certified: usize,
    /// Lower bounds of at least half the truth among these.
    pub at_least_half: usize,
    /// Lower bounds and gaps above the distance of the nearest points.
    pub lower_above: usize,
    /// Upper bounds above it.
    pub upper_above: usize,
    /// Contacts.
    pub contacts: usize,
    /// The greatest distance of the nearest points at a contact, in local spacings.
    pub furthest_contact: f64,
    /// Verdicts that are undecided.
    pub undecided: usize,
}

impl Score {
    /// Counts a verdict. Returns what is wrong or disappointing about it, if anything is.
    pub fn verdict(&mut self, truth: &Truth, answer: &Answer) -> Option<String> {
        let is_far = truth.is_far();
        self.far += usize::from(is_far);
        let off = truth.distance / truth.spacing;
        match answer.verdict {
            Verdict::Separated { evidence, gap } => {
                let is_certified = evidence == Evidence::Certified;
                self.certified += usize::from(is_far && is_certified);
                if is_certified && gap > truth.distance + rounding(truth) {
                    self.lower_above += 1;
                    return Some(format!("a gap of {gap}, but points {} apart", truth.distance));
                }
                (is_far && !is_certified).then(|| format!("{off:.1} spacings apart, not certified"))
            }
            Verdict::Intersecting { .. } => {
                self.contacts += 1;
                self.furthest_contact = self.furthest_contact.max(off);
                (off > REACH).then(|| format!("a contact {off:.2} spacings from the nearest points"))
            }
            Verdict::Undecided(reason) => {
                self.undecided += 1;
                Some(format!("{reason:?}"))
            }
        }
    }

    /// Counts the bounds of a distance. Returns what is wrong or disappointing about them, if anything
    /// is.
    pub fn distance(&mut self, truth: &Truth, found: &Distance) -> Option<String> {
        let is_far = truth.is_far();
        let is_half = found.lower >= 0.5 * truth.distance;
        let most = truth.distance + rounding(truth);
        let above = [found.lower > most, found.upper > most];
        self.at_least_half += usize::from(is_far && is_half);
        self.lower_above += usize::from(above[0]);
        self.upper_above += usize::from(above[1]);
        let is_good = above == [false; 2] && (is_half || !is_far);
        (!is_good).then(|| format!("{} to {}, truth {}", found.lower, found.upper, truth.distance))
    }

    /// Returns `true` if nothing is wrong and the answers are useful: all bounds hold, no contact is
    /// further than a local spacing from the nearest points, everything is decided, and far from contact
    /// 95 of 100 separations are certified and as many lower bounds at least half of the distance.
    #[must_use]
    pub fn is_clean(&self) -> bool {
        let wanted = |of: usize| crate::sample::count(of) >= WANTED * crate::sample::count(self.far);
        self.lower_above + self.upper_above + self.undecided == 0
            && self.furthest_contact <= REACH
            && wanted(self.certified)
            && wanted(self.at_least_half)
    }
}

/// Both sides round the same positions to single precision once.
fn rounding(truth: &Truth) -> f64 {
    1e-6 * truth.distance + 1e-6 * truth.spacing
}
