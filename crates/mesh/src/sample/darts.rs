//! Poisson-disc samples at a spacing: random darts first, then darts in the remaining gaps.
//!
//! A dart is rejected if it is within the least distance of a sample. Random darts place most
//! samples. Each triangle is then halved along its longest side until every part is within the ball
//! of one sample, with a dart thrown at each part that is not (after Cline, Jeschke, White, Razdan
//! & Wonka 2009). Balls are convex, so a ball that contains the corners of a part contains the part.

use rand::seq::SliceRandom;
use rand::{Rng, RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::cells::{Cells, Site};
use crate::triangle::{Corners, Triangle, between, dot};

/// Least distance of two samples over spacing.
///
/// If a dart within a part of a diameter of at most 1 − `LEAST` spacings is rejected, the part is
/// within a spacing of the rejecting sample. This ends the halving.
pub(crate) const LEAST: f64 = 0.95;

/// Radius that counts as covered over spacing, with room for the rounding of positions.
const COVERED: f64 = 1.0 - 1e-9;

/// Samples per squared least distance of a large plane: random discs without overlap cover 54.7 %
/// of it at most (random sequential adsorption).
const DENSITY: f64 = 0.547 * 4.0 / std::f64::consts::PI;

/// Random darts over expected samples. They place about seven eighths of the samples.
const DARTS: f64 = 6.0;

/// Returns an estimate of the number of samples, for meshes whose triangles are large against the
/// spacing or form large surfaces.
pub(crate) fn estimate(area: f64, longest: f64, spacing: f64) -> f64 {
    let least = LEAST * spacing;
    (DENSITY * area / (least * least)).max(0.5 * longest / spacing)
}

/// Returns samples of which no two that face the same side are nearer than [`LEAST`] spacings, and
/// such that each point of the surface is within a spacing of a sample that faces the same side.
/// `None` if 32 bits cannot number them.
pub(crate) fn throw(
    corners: &[Corners],
    triangles: &[Triangle],
    normals: &[[f32; 3]],
    spacing: f64,
    seed: u64,
) -> Option<Vec<[f64; 3]>> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut board = Board { cells: Cells::new(COVERED * spacing, 0), least_sq: (LEAST * spacing).powi(2) };
    board.throw_at_random(triangles, normals, spacing, &mut rng)?;
    let mut order: Vec<usize> = (0..corners.len()).collect();
    order.shuffle(&mut rng);
    for i in order {
        board.fill(&corners[i], normals[i], (1.0 - LEAST) * spacing, &mut rng)?;
    }
    Some(board.cells.positions().collect())
}

/// The samples so far.
struct Board {
    cells: Cells,
    /// The square of the least distance.
    least_sq: f64,
}

impl Board {
    /// Throws darts that are uniform by area.
    fn throw_at_random(
        &mut self,
        triangles: &[Triangle],
        normals: &[[f32; 3]],
        spacing: f64,
        rng: &mut impl Rng,
    ) -> Option<()> {
        let mut area = 0.0;
        let add = |triangle: &Triangle| {
            area += triangle.area();
            area
        };
        // The area of all triangles up to each.
        let areas: Vec<f64> = triangles.iter().map(add).collect();
        let mut left = (DARTS * estimate(area, 0.0, spacing)).round();
        while left > 0.0 {
            left -= 1.0;
            let share = area * rng.random::<f64>();
            let i = areas.partition_point(|up_to| *up_to <= share);
            // Rounding may leave no triangle.
            let Some(triangle) = triangles.get(i) else { continue };
            let at = triangle.spread([rng.random(), rng.random()]);
            self.throw(Site { at, normal: normals[i] })?;
        }
        Some(())
    }

    /// Covers a triangle with samples.
    fn fill(&mut self, triangle: &Corners, normal: [f32; 3], tiny: f64, rng: &mut impl Rng) -> Option<()> {
        let mut parts = vec![*triangle];
        while let Some(part) = parts.pop() {
            if self.covers(&part, normal) {
                continue;
            }
            let [s, t] = [rng.random::<f64>().sqrt(), rng.random()];
            let weights = [1.0 - s, s * (1.0 - t), s * t];
            let at = [0, 1, 2].map(|k| (0..3).map(|c| weights[c] * part[c][k]).sum());
            self.throw(Site { at, normal })?;
            let halves = halves(&part, tiny);
            parts.extend(halves.into_iter().flatten());
        }
        Some(())
    }

    /// Adds a sample unless another one is too near. `None` if there are too many.
    fn throw(&mut self, site: Site) -> Option<()> {
        if !self.cells.any_near(&site, |_, _, square| square < self.least_sq) {
            if self.cells.len() >= u32::MAX as usize - 1 {
                return None;
            }
            self.cells.add(site);
        }
        Some(())
    }

    /// Returns `true` if the ball of one sample contains the part.
    fn covers(&self, part: &Corners, normal: [f32; 3]) -> bool {
        let most = self.cells.radius() * self.cells.radius();
        let is_within = |corner: [f64; 3], sample: [f64; 3]| {
            let way = between(corner, sample);
            dot(way, way) <= most
        };
        let from = Site { at: part[0], normal };
        self.cells.any_near(&from, |_, sample, _| is_within(part[1], sample) && is_within(part[2], sample))
    }
}

/// Returns the halves of a triangle on both sides of the middle of its longest side. `None` if no
/// side is longer than `tiny`, or rounding prevents it.
fn halves(corners: &Corners, tiny: f64) -> Option<[Corners; 2]> {
    let side_sq = |i: usize| {
        let way = between(corners[i], corners[(i + 1) % 3]);
        dot(way, way)
    };
    let sides = [side_sq(0), side_sq(1), side_sq(2)];
    let longest = (0..3).fold(0, |best, i| if sides[i] > sides[best] { i } else { best });
    let [a, b, c] = [0, 1, 2].map(|k| corners[(longest + k) % 3]);
    let middle = [0, 1, 2].map(|k| a[k] + 0.5 * (b[k] - a[k]));
    let is_divided = sides[longest] > tiny * tiny && middle != a && middle != b;
    is_divided.then_some([[a, middle, c], [middle, b, c]])
}
