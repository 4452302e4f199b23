//! What an interpolation search asks for.

use serde::{Deserialize, Serialize};

use crate::ask::occupancy::points_to_draw;

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
