//! Interpolation search: S1 §4. What it asks for, and how many points are drawn.

mod flat;
mod leaves;
mod partners;
mod refine;
mod root;
mod side;
mod volume;

use nearmiss_graph::LazyPath;
use serde::{Deserialize, Serialize};

pub(crate) use side::Side;

/// The search for intersections along paths of a's graph (S1 §4): points of a are drawn at random, those on
/// different sides of b are joined by a path, and on it the place is looked for where the side changes. Where
/// b's sides are not known, and where no drawn points lie on either side though some are near, points are
/// drawn towards each other instead.
///
/// What a graph makes for such searches it makes when the first wants it, whatever that's deadline, unless it
/// was [made ready](nearmiss_graph::SurfaceGraph::make_ready).
///
/// Wants the graph of a, and for brackets that of b, which says which side is out.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default)]
#[non_exhaustive]
pub struct Interpolation {
    /// Into how many surfels the surface of a is thought to be cut where b may be.
    pub surfels: Surfels,
    /// The probability that each of them has a drawn point (S1, Lemma 1): above 0 and below 1; default 0.97.
    pub probability: f64,
    /// How the other end of a bracket is found.
    pub brackets: Brackets,
    /// How a place on both surfaces is found from there, if [`Detail::Witness`](crate::Detail) asks for one.
    pub refinement: Refinement,
    /// Where brackets led nowhere: so many of the drawn points nearest to b are drawn towards it, from
    /// nearest point to nearest point, and the discs there compared. Finds small contacts between drawn
    /// points, which no bracket holds, and those where sides are not known; S1 does without. Default: 64.
    pub approaches: u32,
    /// What the random numbers come from.
    pub seed: u64,
    /// Without hierarchy: points drawn from all of a that lie in the box of b. With it, pairs of leaves are
    /// compared: each edge of a's graph there, whether its ends are on different sides of b, and where none
    /// crosses, all discs.
    pub flat: bool,
}

/// How large surfels are.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Surfels {
    /// So many, however many points there are: 1 to 65,536. Default: 30, for some 200 points (S1 §4.1).
    Count(u32),
    /// So many sampling radii wide (S3: adapted to the sampling density): 1 to 1024. The number of points
    /// drawn grows with that of the cloud's.
    Radius(f64),
}

/// Where the other end of a bracket comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Brackets {
    /// From the drawn points: the nearest on the other side, within two surfel radii (S3).
    #[default]
    Drawn,
    /// From the map of close pairs: some points about two surfel radii away along the surface (S1 §4.3), as
    /// far as it reaches; beyond, from the drawn points.
    Annulus,
}

/// How a place on both surfaces is found from an approximate one.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub enum Refinement {
    /// By Newton's method on both surfaces.
    #[default]
    Newton,
    /// By random points in a sphere, until one is as near to both surfaces as this, in sampling radii (S1
    /// §4.6): above 0.01, at most 1.
    Sphere(f64),
    /// By the points of a regular grid in that sphere (S3).
    Grid(f64),
}

impl Default for Interpolation {
    fn default() -> Self {
        Self {
            surfels: Surfels::Count(30),
            probability: 0.97,
            brackets: Brackets::Drawn,
            refinement: Refinement::Newton,
            approaches: 64,
            seed: 0,
            flat: false,
        }
    }
}

impl Interpolation {
    /// The same search with such surfels.
    #[must_use]
    pub const fn with_surfels(self, surfels: Surfels) -> Self {
        Self { surfels, ..self }
    }

    /// The same search with this probability that each surfel has a point.
    #[must_use]
    pub const fn with_probability(self, probability: f64) -> Self {
        Self { probability, ..self }
    }

    /// The same search with brackets like these.
    #[must_use]
    pub const fn with_brackets(self, brackets: Brackets) -> Self {
        Self { brackets, ..self }
    }

    /// The same search, refined like this.
    #[must_use]
    pub const fn with_refinement(self, refinement: Refinement) -> Self {
        Self { refinement, ..self }
    }

    /// The same search with so many approaches.
    #[must_use]
    pub const fn with_approaches(self, approaches: u32) -> Self {
        Self { approaches, ..self }
    }

    /// The same search with other random numbers.
    #[must_use]
    pub const fn with_seed(self, seed: u64) -> Self {
        Self { seed, ..self }
    }

    /// The same search with or without hierarchy.
    #[must_use]
    pub const fn with_flat(self, flat: bool) -> Self {
        Self { flat, ..self }
    }

    /// How many points to draw for so many surfels.
    pub(crate) fn draws(&self, surfels: f64) -> u32 {
        points_to_draw(surfels, self.probability)
    }

    /// How many points are drawn where surfels are [counted](Surfels::Count); none where their size is given.
    #[must_use]
    pub fn points(&self) -> Option<u32> {
        match self.surfels {
            Surfels::Count(surfels) => Some(self.draws(f64::from(surfels))),
            Surfels::Radius(_) => None,
        }
    }
}

/// The probability that each of `surfels` surfels of one size gets one of `points` points that are drawn
/// evenly and independently: Σₖ (−1)ᵏ C(a, k) (1 − k/a)ⁿ, by inclusion and exclusion, to 1e-7. S1's Lemma 1
/// has its limit for many surfels.
#[must_use]
pub fn occupancy(surfels: u32, points: u32) -> f64 {
    /// With so many surfels expected to stay empty all are occupied once in 10⁸ times.
    const HOPELESS: f64 = 18.0;
    let (a, n) = (f64::from(surfels), f64::from(points));
    if points < surfels || a * (n * (-1.0 / a).ln_1p()).exp() > HOPELESS {
        return 0.0;
    }
    let (mut sum, mut choices) = (1.0, 1.0);
    for k in 1..surfels {
        let left = f64::from(k);
        choices *= (a - left + 1.0) / left;
        let term = choices * (n * (-left / a).ln_1p()).exp();
        sum += if k % 2 == 0 { term } else { -term };
        if term < 1e-12 {
            break;
        }
    }
    sum.clamp(0.0, 1.0)
}

/// The fewest points to draw so that with a probability of at most `error` some of `surfels` surfels gets
/// none.
///
/// O(log n) times what [`occupancy`] takes. 2³² − 1 if that does not suffice.
#[must_use]
pub fn points_for(surfels: u32, error: f64) -> u32 {
    let (mut few, mut enough) = (surfels.saturating_sub(1), surfels.max(1));
    let suffices = |points: u32| points == u32::MAX || 1.0 - occupancy(surfels, points) <= error;
    while !suffices(enough) {
        few = enough;
        enough = enough.saturating_mul(2);
    }
    while enough - few > 1 {
        let middle = few + (enough - few) / 2;
        if suffices(middle) {
            enough = middle;
        } else {
            few = middle;
        }
    }
    enough
}

/// n = a ln a + c a points, of which each of a surfels gets one with probability `exp(−exp(−c))` (S1, Lemma
/// 1); for ten surfels and more the true probability is greater.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "it saturates")]
fn points_to_draw(surfels: f64, probability: f64) -> u32 {
    let c = -(-probability.ln()).ln();
    (surfels * surfels.ln() + c * surfels).ceil().max(1.0) as u32
}

/// Reused between queries; never influences an answer.
#[derive(Debug, Clone, Default)]
pub(crate) struct InterpolationScratch {
    volume: volume::Volume,
    drawn: partners::Drawn,
    path: LazyPath,
    pub(crate) sides: side::Cache,
    /// Points whose neighbourhood in b is near, nearest first, and where those ended that were drawn there.
    near: Vec<(f64, u32, u32)>,
    seen: Vec<[u32; 2]>,
    /// Points about two surfel radii away from one.
    annulus: Vec<u32>,
    /// Edges on which searches ended, in order.
    crossed: Vec<[u32; 2]>,
}

#[cfg(test)]
mod tests {
    use super::{Interpolation, occupancy, points_for};

    /// Ball by ball: the probabilities of how many surfels are occupied.
    fn ball_by_ball(surfels: u32, points: u32) -> f64 {
        let a = f64::from(surfels);
        let mut occupied = vec![0.0; surfels as usize + 1];
        occupied[0] = 1.0;
        for _ in 0..points {
            let mut next = vec![0.0; occupied.len()];
            for (k, p) in (0_u32..).zip(&occupied) {
                let share = f64::from(k) / a;
                next[k as usize] += p * share;
                if k < surfels {
                    next[k as usize + 1] += p * (1.0 - share);
                }
            }
            occupied = next;
        }
        occupied[surfels as usize]
    }

    #[test]
    fn occupancy_equals_that_of_balls_in_bins() {
        for surfels in [1, 2, 5, 10, 30, 100] {
            for points in [0, 1, surfels, 2 * surfels, 3 * surfels, 5 * surfels, 10 * surfels] {
                let (found, expected) = (occupancy(surfels, points), ball_by_ball(surfels, points));
                assert!((found - expected).abs() < 1e-7, "{found} for {expected}, {points} in {surfels}");
            }
        }
        // docs/theory: Lemma 1 with c = 3.5 promises 0.970, the true probabilities are these.
        for (surfels, expected) in [(10, 0.980), (30, 0.974), (100, 0.972)] {
            let a = f64::from(surfels);
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few hundred")]
            let found = occupancy(surfels, (a * a.ln() + 3.5 * a).ceil() as u32);
            assert!((found - expected).abs() < 2e-3, "{found} for {expected}");
        }
    }

    #[test]
    fn the_fewest_points_suffice_and_no_fewer_do() {
        for surfels in [1, 2, 30, 300, 20_000] {
            for error in [0.5, 0.03, 1e-3, 1e-6] {
                let points = points_for(surfels, error);
                assert!(1.0 - occupancy(surfels, points) <= error, "{points} for {surfels} do not suffice");
                assert!(points == 1 || 1.0 - occupancy(surfels, points - 1) > error, "{points} are too many");
            }
        }
        // S1 §4.1: some 200 points for 30 surfels; Lemma 1 asks for a few more than it takes.
        let asked = Interpolation::default().points();
        assert_eq!((asked, points_for(30, 0.03)), (Some(207), 204), "Lemma 1, and exactly");
    }
}
