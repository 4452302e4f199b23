//! Sampling of meshes, by spacing or by number of points.

mod cells;
mod darts;
mod elimination;
mod facing;

use nearmiss_geometry::TriangleMesh;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use thiserror::Error;

use crate::triangle::{Corners, Triangle, between, length};
use crate::weld;
use cells::Site;
use facing::consistent_normals;

/// Greatest number of points in a cloud.
const MOST: f64 = 4_294_967_295.0;

/// Row step over spacing: 2/√5, reduced slightly for rounding. No point of a triangle is then
/// further than the spacing from a sample.
const STEP: f64 = 0.894_427;

/// Greatest jitter of a sample over spacing. Jittered samples are placed closer by the same
/// fraction.
const JITTER: f64 = 0.2;

/// Units of rounding of the greatest coordinate below which a spacing is not resolved.
const RESOLVED: f64 = 64.0 * f64::EPSILON;

/// Density or number of samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SampleSize {
    /// Greatest distance from any point of the surface to its nearest sample, in the units of the
    /// mesh.
    Spacing(f64),
    /// Total number of samples, with uniform density by area.
    Count(u32),
}

/// Arrangement of samples on the surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum SamplePattern {
    /// Rows along the longest side of each triangle, for a spacing only. No random choices.
    Regular,
    /// At a spacing, rows with each sample jittered, which takes 56 % more samples. For a number of
    /// samples, independent random places.
    Random,
    /// Blue noise: random places none of which is near another (a Poisson-disc distribution).
    ///
    /// At a spacing s, no two samples are nearer than 0.95 s, and about a third fewer samples are
    /// needed than in rows on large faces. For a number of samples n on an area A, the nearest two
    /// are about 0.75 √(A/n) apart.
    ///
    /// Surfaces whose normals differ by more than 120°, such as the two sides of a thin sheet, are
    /// sampled independently: these distances hold for samples of the same side, and each side has
    /// samples of its own within the spacing. Normals are turned consistently over shared edges.
    BlueNoise,
}

/// Options of [`sample`], which validates them.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct SampleOptions {
    /// Density or number of samples.
    pub samples: SampleSize,
    /// Arrangement of the samples. By default regular at a spacing, random for a number of samples.
    pub pattern: SamplePattern,
    /// Seed of the random numbers, 0 by default.
    pub seed: u64,
}

impl SampleOptions {
    /// Creates options with the default pattern and seed.
    #[must_use]
    pub const fn new(samples: SampleSize) -> Self {
        let pattern = match samples {
            SampleSize::Spacing(_) => SamplePattern::Regular,
            SampleSize::Count(_) => SamplePattern::Random,
        };
        Self { samples, pattern, seed: 0 }
    }

    /// Sets the pattern.
    #[must_use]
    pub const fn with_pattern(self, pattern: SamplePattern) -> Self {
        Self { pattern, ..self }
    }

    /// Sets the seed.
    #[must_use]
    pub const fn with_seed(self, seed: u64) -> Self {
        Self { seed, ..self }
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
    /// A number of samples requested in the regular pattern.
    #[error("expected a spacing for regular samples, got a number of samples; choose another pattern")]
    RegularCount,
    /// More samples than 32-bit ids can number.
    #[error("expected at most 2^32 samples, got about {count:e}; give a larger spacing")]
    TooMany {
        /// Approximate number of samples.
        count: f64,
    },
}

/// Returns points on the triangles of a mesh.
///
/// In the regular and random patterns, each triangle is sampled separately, so edges that triangles
/// share are sampled twice at a spacing. A number of random samples is divided among the triangles
/// in proportion to their areas, to within one sample. These patterns take time proportional to the
/// number of samples.
///
/// Blue noise takes O(n log n) for n samples and triangles, and memory for n samples at a spacing,
/// for 5 n candidates otherwise. Sources: Cline, Jeschke, White, Razdan & Wonka 2009 for a spacing,
/// Yuksel 2015 for a number of samples.
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
    let corners: Vec<Corners> = mesh.triangles().iter().map(|t| t.map(|v| vertices[v as usize])).collect();
    let triangles: Vec<Triangle> = corners.iter().map(|t| Triangle::new(*t)).collect();
    let normals = || {
        let equal = weld::equal(vertices);
        let welded: Vec<[u32; 3]> = mesh.triangles().iter().map(|t| t.map(|v| equal[v as usize])).collect();
        consistent_normals(&corners, &welded)
    };
    let seed = options.seed;
    match (options.samples, options.pattern) {
        (SampleSize::Spacing(spacing), _) if !(spacing > 0.0 && spacing.is_finite()) => {
            Err(SampleError::Spacing { spacing })
        }
        (SampleSize::Spacing(spacing), SamplePattern::Regular) => in_rows(&triangles, spacing, None),
        (SampleSize::Spacing(spacing), SamplePattern::Random) => in_rows(&triangles, spacing, Some(seed)),
        (SampleSize::Spacing(spacing), SamplePattern::BlueNoise) => {
            let count = darts::estimate(area(&triangles), longest(&triangles), spacing);
            let too_many = SampleError::TooMany { count };
            if count.is_nan() || count >= MOST {
                return Err(too_many);
            }
            let greatest = vertices.iter().flatten().fold(0.0_f64, |most, x| most.max(x.abs()));
            let spacing = spacing.max(RESOLVED * greatest);
            darts::throw(&corners, &triangles, &normals(), spacing, seed).ok_or(too_many)
        }
        (SampleSize::Count(_), SamplePattern::Regular) => Err(SampleError::RegularCount),
        (SampleSize::Count(count), SamplePattern::Random) => {
            let mut points = Vec::with_capacity(count as usize);
            by_area(&triangles, count, seed, |_, p| points.push(p))?;
            Ok(points)
        }
        (SampleSize::Count(count), SamplePattern::BlueNoise) => {
            let all = count.saturating_mul(elimination::CANDIDATES).min(u32::MAX - 1);
            let normals = normals();
            let mut candidates = elimination::table(all, count, area(&triangles));
            by_area(&triangles, all, seed, |i, at| candidates.add(Site { at, normal: normals[i] }))?;
            Ok(elimination::eliminate(candidates, count))
        }
    }
}

fn area(triangles: &[Triangle]) -> f64 {
    triangles.iter().map(Triangle::area).sum()
}

/// Returns the length of the longest side.
fn longest(triangles: &[Triangle]) -> f64 {
    triangles.iter().map(Triangle::base).fold(0.0, f64::max)
}

fn in_rows(triangles: &[Triangle], spacing: f64, seed: Option<u64>) -> Result<Vec<[f64; 3]>, SampleError> {
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

/// Calls `each` with the index of a triangle and a random point of it, `count` times.
fn by_area(
    triangles: &[Triangle],
    count: u32,
    seed: u64,
    mut each: impl FnMut(usize, [f64; 3]),
) -> Result<(), SampleError> {
    let area = area(triangles);
    if !(area > 0.0 && area.is_finite()) {
        return Err(SampleError::NoArea);
    }
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    // Systematic sampling: steps of equal area through the triangles, from a random start.
    let start: f64 = rng.random();
    let mut shares = (0..count).map(|i| (f64::from(i) + start) / f64::from(count) * area).peekable();
    let (mut covered, last) = (0.0, triangles.len() - 1);
    for (i, triangle) in triangles.iter().enumerate() {
        covered += triangle.area();
        while shares.next_if(|share| *share < covered || i == last).is_some() {
            each(i, triangle.spread([rng.random(), rng.random()]));
        }
    }
    Ok(())
}
