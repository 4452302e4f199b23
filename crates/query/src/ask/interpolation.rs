//! Options of an interpolation search.

use serde::{Deserialize, Serialize};

use crate::ask::occupancy::points_to_draw;

/// A search for intersections along paths of a's graph (Klein & Zachmann 2005, §4). Points of a are
/// drawn at random, points on different sides of b are joined by a path, and the search finds where
/// the side changes along it. If the sides of b are unknown, or no bracket is found although some
/// drawn points are near b, these step towards b instead.
///
/// A graph builds the tables for such searches on first use, ignoring the deadline of that query,
/// unless [`make_ready`](nearmiss_graph::SurfaceGraph::make_ready) was called before.
///
/// Needs the graph of a. Brackets also need the graph of b, which orients its normals.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default)]
#[non_exhaustive]
pub struct Interpolation {
    /// The notional partition into surfels of the part of a's surface that is near b.
    pub surfels: SurfelSize,
    /// The probability that every surfel contains a drawn point (Klein & Zachmann 2005, Lemma 1):
    /// above 0 and below 1; default 0.97.
    pub probability: f64,
    /// The method that finds the other end of a bracket.
    pub brackets: Brackets,
    /// The method that finds a point on both surfaces from there, if
    /// [`Detail::Witness`](crate::Detail) asks for one.
    pub refinement: Refinement,
    /// If no bracket yields an intersection, this many of the drawn points nearest to b step
    /// towards it, from nearest point to nearest point, and the discs there are compared. Finds
    /// small contacts between drawn points, which no bracket contains, and contacts where sides are
    /// unknown. Klein & Zachmann 2005 has no such step. Default: 64.
    pub approaches: u32,
    /// The seed of the random numbers.
    pub seed: u64,
    /// `true`: no hierarchy; points are drawn from all points of a in the box of b. `false`: leaf
    /// pairs are compared. For each edge of a's graph there, the search tests whether its ends are
    /// on different sides of b; if no edge crosses b, it compares all discs.
    pub flat: bool,
}

/// The size of surfels.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum SurfelSize {
    /// This many surfels, whatever the number of points: 1 to 65,536. Default: 30, for about 200
    /// points (Klein & Zachmann 2005, §4.1).
    Count(u32),
    /// Surfels this many sampling radii wide, adapted to the sampling density (Zachmann's slides):
    /// 1 to 1024. The number of drawn points grows with that of the cloud.
    Radius(f64),
}

/// The source of the other end of a bracket.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Brackets {
    /// The drawn points: the nearest one on the other side within two surfel radii (Zachmann's
    /// slides).
    #[default]
    Drawn,
    /// The map of close pairs: some points about two surfel radii away along the surface (Klein &
    /// Zachmann 2005, §4.3), as far as the map reaches; beyond that, the drawn points.
    Annulus,
}

/// The method that finds a point on both surfaces from an approximate one.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub enum Refinement {
    /// Newton's method on both surfaces.
    #[default]
    Newton,
    /// Random points in a sphere, until one is within this distance of both surfaces, in sampling
    /// radii (Klein & Zachmann 2005, §4.6): above 0.01, at most 1.
    Sphere(f64),
    /// Points of a regular grid in that sphere (Zachmann's slides).
    Grid(f64),
}

impl Default for Interpolation {
    fn default() -> Self {
        Self {
            surfels: SurfelSize::Count(30),
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
    /// The same search with these surfels.
    #[must_use]
    pub const fn with_surfels(self, surfels: SurfelSize) -> Self {
        Self { surfels, ..self }
    }

    /// The same search with this probability that each surfel has a point.
    #[must_use]
    pub const fn with_probability(self, probability: f64) -> Self {
        Self { probability, ..self }
    }

    /// The same search with these brackets.
    #[must_use]
    pub const fn with_brackets(self, brackets: Brackets) -> Self {
        Self { brackets, ..self }
    }

    /// The same search with this refinement.
    #[must_use]
    pub const fn with_refinement(self, refinement: Refinement) -> Self {
        Self { refinement, ..self }
    }

    /// The same search with this number of approaches.
    #[must_use]
    pub const fn with_approaches(self, approaches: u32) -> Self {
        Self { approaches, ..self }
    }

    /// The same search with another seed.
    #[must_use]
    pub const fn with_seed(self, seed: u64) -> Self {
        Self { seed, ..self }
    }

    /// The same search with or without hierarchy.
    #[must_use]
    pub const fn with_flat(self, flat: bool) -> Self {
        Self { flat, ..self }
    }

    /// The number of points to draw for this many surfels.
    pub(crate) fn draws(&self, surfels: f64) -> u32 {
        points_to_draw(surfels, self.probability)
    }

    /// Returns the number of points drawn if surfels are [counted](SurfelSize::Count); `None` if their
    /// size is given.
    #[must_use]
    pub fn points(&self) -> Option<u32> {
        match self.surfels {
            SurfelSize::Count(surfels) => Some(self.draws(f64::from(surfels))),
            SurfelSize::Radius(_) => None,
        }
    }
}
