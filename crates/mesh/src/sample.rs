//! Points on a mesh: at a spacing, or so many.

use nearmiss_geometry::TriangleMesh;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use thiserror::Error;

use crate::triangle::{Triangle, between, length};

/// More samples than this no cloud can number.
const MOST: f64 = 4_294_967_295.0;

/// Steps of rows whose farthest place is a spacing away: 2/√5, a little less for rounding.
const STEP: f64 = 0.894_427;

/// Samples are jittered by at most this share of the spacing, and laid closer by as much.
const JITTER: f64 = 0.2;

/// How many samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Samples {
    /// So many that no place of the surface is further than this from one, in the units of the mesh.
    Spacing(f64),
    /// So many in all, at random, as densely everywhere as the area says.
    Count(u32),
}

/// How a mesh is sampled. Plain values, checked by [`sample`].
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct SampleOptions {
    /// How many.
    pub samples: Samples,
    /// What is random depends on it. Without, samples at a spacing lie in rows; with one, each is moved at
    /// random, which takes a little over half as many again. A count is random always, of seed 0 if none is
    /// given.
    pub seed: Option<u64>,
}

impl SampleOptions {
    /// So many samples, without a seed.
    #[must_use]
    pub const fn new(samples: Samples) -> Self {
        Self { samples, seed: None }
    }

    /// The same with this seed.
    #[must_use]
    pub const fn with_seed(self, seed: u64) -> Self {
        Self { seed: Some(seed), ..self }
    }
}

/// Why a mesh is not sampled.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum SampleError {
    /// A spacing that is none.
    #[error("a spacing of {spacing} is none; give a length above 0")]
    Spacing {
        /// As given.
        spacing: f64,
    },
    /// A vertex without a place.
    #[error("vertex {vertex} has a coordinate that is not finite; repair the mesh")]
    NotFinite {
        /// Its index.
        vertex: usize,
    },
    /// No surface to lay a number of samples on.
    #[error("the mesh has no area to spread points over; sample it at a spacing")]
    NoArea,
    /// More samples than can be numbered.
    #[error("about {count:e} samples would be needed, more than 2^32; give a larger spacing")]
    TooMany {
        /// How many.
        count: f64,
    },
}

/// Points on the triangles of a mesh.
///
/// At a spacing, each triangle is sampled by itself, in rows along its longest side; what two triangles share
/// is sampled twice. So many in all are drawn triangle by triangle, each getting as many as its area is
/// worth, give or take one.
///
/// # Errors
/// When the options make no sense, or the mesh is not finite.
pub fn sample(mesh: &TriangleMesh, options: &SampleOptions) -> Result<Vec<[f64; 3]>, SampleError> {
    let vertices = mesh.vertices();
    let broken = |v: &[f64; 3]| v.iter().any(|x| !x.is_finite());
    if let Some(vertex) = vertices.iter().position(broken) {
        return Err(SampleError::NotFinite { vertex });
    }
    let triangles = mesh.triangles().iter().map(|t| Triangle::new(t.map(|v| vertices[v as usize])));
    let triangles: Vec<Triangle> = triangles.collect();
    match options.samples {
        Samples::Spacing(spacing) if spacing > 0.0 && spacing.is_finite() => {
            spaced(&triangles, spacing, options.seed)
        }
        Samples::Spacing(spacing) => Err(SampleError::Spacing { spacing }),
        Samples::Count(count) => counted(&triangles, count, options.seed.unwrap_or(0)),
    }
}

fn spaced(triangles: &[Triangle], spacing: f64, seed: Option<u64>) -> Result<Vec<[f64; 3]>, SampleError> {
    let step = STEP * spacing * if seed.is_some() { 1.0 - JITTER } else { 1.0 };
    let count: f64 = triangles.iter().map(|t| t.count(step)).sum();
    if count.is_nan() || count >= MOST {
        return Err(SampleError::TooMany { count });
    }
    let mut rng = seed.map(Xoshiro256PlusPlus::seed_from_u64);
    let mut points = Vec::new();
    for triangle in triangles {
        triangle.rows(step, |p| {
            points.push(match &mut rng {
                None => p,
                Some(rng) => moved(p, triangle.spread([rng.random(), rng.random()]), JITTER * spacing),
            });
        });
    }
    Ok(points)
}

/// From `p` towards a place of the same triangle, at most so far.
fn moved(p: [f64; 3], towards: [f64; 3], most: f64) -> [f64; 3] {
    let way = between(p, towards);
    let share = (most / length(way)).min(1.0);
    // No way to go gives no share.
    if share.is_nan() { p } else { [0, 1, 2].map(|k| p[k] + share * way[k]) }
}

fn counted(triangles: &[Triangle], count: u32, seed: u64) -> Result<Vec<[f64; 3]>, SampleError> {
    let area: f64 = triangles.iter().map(Triangle::area).sum();
    if !(area > 0.0 && area.is_finite()) {
        return Err(SampleError::NoArea);
    }
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut points = Vec::with_capacity(count as usize);
    // Systematic sampling: steps of equal area through the triangles, from a random start.
    let start: f64 = rng.random();
    let mut shares = (0..count).map(|i| (f64::from(i) + start) / f64::from(count) * area).peekable();
    let (mut covered, last) = (0.0, triangles.len() - 1);
    for (i, triangle) in triangles.iter().enumerate() {
        covered += triangle.area();
        while shares.next_if(|share| *share < covered || i == last).is_some() {
            points.push(triangle.spread([rng.random(), rng.random()]));
        }
    }
    Ok(points)
}
