//! Sampling of meshes, by spacing or by number of points.

use nearmiss_geometry::TriangleMesh;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use thiserror::Error;

use crate::triangle::{Triangle, between, length};

/// Greatest number of points in a cloud.
const MOST: f64 = 4_294_967_295.0;

/// Row step over spacing: 2/√5, reduced slightly for rounding. No point of a triangle is then
/// further than the spacing from a sample.
const STEP: f64 = 0.894_427;

/// Greatest jitter of a sample over spacing. Jittered samples are placed closer by the same
/// fraction.
const JITTER: f64 = 0.2;

/// Density or number of samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SampleSize {
    /// Greatest distance from any point of the surface to its nearest sample, in the units of the
    /// mesh.
    Spacing(f64),
    /// Total number of samples, at random, with uniform density by area.
    Count(u32),
}

/// Options of [`sample`], which validates them.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct SampleOptions {
    /// Density or number of samples.
    pub samples: SampleSize,
    /// Seed of the random numbers.
    ///
    /// Without a seed, samples at a spacing form regular rows. With a seed, each sample is
    /// jittered, which takes 56 % more samples. A number of samples is always drawn at random, with
    /// seed 0 by default.
    pub seed: Option<u64>,
}

impl SampleOptions {
    /// Creates options without a seed.
    #[must_use]
    pub const fn new(samples: SampleSize) -> Self {
        Self { samples, seed: None }
    }

    /// Sets the seed.
    #[must_use]
    pub const fn with_seed(self, seed: u64) -> Self {
        Self { seed: Some(seed), ..self }
    }
}

/// Error of [`sample`].
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum SampleError {
    /// A spacing that is not positive and finite.
    #[error("expected a finite spacing above 0, got {spacing}")]
    Spacing {
        /// The spacing given.
        spacing: f64,
    },
    /// A vertex with a NaN or infinite coordinate.
    #[error(
        "expected finite coordinates, got NaN or infinity (vertex {vertex}); correct or remove the vertex"
    )]
    NotFinite {
        /// Index of the vertex.
        vertex: usize,
    },
    /// A number of samples requested of a mesh without area.
    #[error(
        "expected a mesh with an area above 0, got an area of 0; give a spacing instead of a number of samples"
    )]
    NoArea,
    /// More samples than 32-bit ids can number.
    #[error("expected at most 2^32 samples, got about {count:e}; give a larger spacing")]
    TooMany {
        /// Approximate number of samples.
        count: f64,
    },
}

/// Returns points on the triangles of a mesh.
///
/// At a spacing, each triangle is sampled separately, in rows along its longest side, so edges that
/// triangles share are sampled twice. A number of samples is divided among the triangles in
/// proportion to their areas, to within one sample.
///
/// # Errors
/// Fails if the options are invalid, if a vertex is not finite, if a number of samples is requested
/// and the mesh has no area, or if there would be too many samples.
pub fn sample(mesh: &TriangleMesh, options: &SampleOptions) -> Result<Vec<[f64; 3]>, SampleError> {
    let vertices = mesh.vertices();
    let broken = |v: &[f64; 3]| v.iter().any(|x| !x.is_finite());
    if let Some(vertex) = vertices.iter().position(broken) {
        return Err(SampleError::NotFinite { vertex });
    }
    let triangles = mesh.triangles().iter().map(|t| Triangle::new(t.map(|v| vertices[v as usize])));
    let triangles: Vec<Triangle> = triangles.collect();
    match options.samples {
        SampleSize::Spacing(spacing) if spacing > 0.0 && spacing.is_finite() => {
            spaced(&triangles, spacing, options.seed)
        }
        SampleSize::Spacing(spacing) => Err(SampleError::Spacing { spacing }),
        SampleSize::Count(count) => counted(&triangles, count, options.seed.unwrap_or(0)),
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

/// Moves `p` towards `towards`, a point of the same triangle, by at most `most`.
fn moved(p: [f64; 3], towards: [f64; 3], most: f64) -> [f64; 3] {
    let way = between(p, towards);
    let share = (most / length(way)).min(1.0);
    // If the two points coincide, `share` is NaN.
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
