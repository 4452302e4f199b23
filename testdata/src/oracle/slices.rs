//! Slice maps from the formulas alone: every level of every point is kept, voxel by voxel, and
//! evaluated in each query.

use std::collections::BTreeMap;

/// Number of levels of a slice.
const LEVELS: f64 = 255.0;

/// The slice map of some points.
#[derive(Debug, Clone)]
pub struct SliceTwin {
    /// o, t, σ.
    origin: [f64; 3],
    sides: [f64; 3],
    /// ε.
    share: f64,
    /// Levels in each voxel: column, row, slice.
    voxels: BTreeMap<[i64; 3], Vec<i64>>,
}

/// The contents of a voxel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TwinVoxel {
    /// Level of the highest point.
    pub top: i64,
    /// Level of the lowest point.
    pub low: i64,
    /// `true` if it is an obstacle.
    pub is_obstacle: bool,
}

impl SliceTwin {
    /// Creates the map of points in coordinates of which the third points up.
    #[must_use]
    pub fn new(points: &[[f64; 3]], origin: [f64; 3], [t, sigma]: [f64; 2], share: f64) -> Self {
        let sides = [t, t, sigma];
        let mut voxels: BTreeMap<[i64; 3], Vec<i64>> = BTreeMap::new();
        for p in points {
            let q = [0, 1, 2].map(|k| (p[k] - origin[k]) / sides[k]);
            let level = whole((q[2] - q[2].floor()) * LEVELS);
            voxels.entry(q.map(whole)).or_default().push(level);
        }
        Self { origin, sides, share, voxels }
    }

    /// Returns every occupied voxel.
    pub fn voxels(&self) -> impl Iterator<Item = ([i64; 3], TwinVoxel)> {
        self.voxels.keys().filter_map(|at| Some((*at, self.voxel(*at)?)))
    }

    /// Returns the contents of a voxel.
    #[must_use]
    pub fn voxel(&self, [c, r, s]: [i64; 3]) -> Option<TwinVoxel> {
        // Levels counted through all slices.
        let span = |s: i64| {
            let levels = self.voxels.get(&[c, r, s])?;
            Some((255 * s + levels.iter().min()?, 255 * s + levels.iter().max()?))
        };
        let is_wide = |low: i64, high: i64| float(high - low) > self.share * LEVELS + 1e-6;
        let (low, high) = span(s)?;
        let above = span(s + 1).filter(|above| !is_wide(high, above.0));
        let below = span(s - 1).filter(|below| !is_wide(below.1, low));
        let mut is_obstacle = is_wide(low, high);
        if let Some(above) = above {
            is_obstacle |= is_wide(low, above.1);
        }
        if let Some(below) = below {
            is_obstacle |= is_wide(below.0, high);
        }
        Some(TwinVoxel { top: high - 255 * s, low: low - 255 * s, is_obstacle })
    }

    /// Returns the number of occupied voxels that a closed box meets, `true` if one is an obstacle,
    /// and the heights of the floors below it, column by column. `counts` are the numbers of
    /// columns and rows.
    #[must_use]
    pub fn query(&self, min: [f64; 3], max: [f64; 3], counts: [i64; 2]) -> (usize, bool, Vec<f64>) {
        let cell = |p: [f64; 3]| [0, 1, 2].map(|k| ((p[k] - self.origin[k]) / self.sides[k]).floor());
        let (from, to) = (cell(min), cell(max));
        let within = |at: &[i64; 3]| (0..3).all(|k| from[k] <= float(at[k]) && float(at[k]) <= to[k]);
        let inside: Vec<[i64; 3]> = self.voxels.keys().copied().filter(within).collect();
        let obstacle = inside.iter().any(|at| self.voxel(*at).is_some_and(|voxel| voxel.is_obstacle));
        let mut floors = Vec::new();
        for c in 0..counts[0] {
            for r in 0..counts[1] {
                let column = [c, r].map(float);
                if (0..2).any(|k| column[k] < from[k] || column[k] > to[k]) {
                    continue;
                }
                let below = |at: &&[i64; 3]| at[0] == c && at[1] == r && float(at[2]) <= from[2];
                let highest = self.voxels.keys().filter(below).max_by_key(|at| at[2]);
                let Some((at, voxel)) = highest.and_then(|at| Some((at, self.voxel(*at)?))) else { continue };
                if !voxel.is_obstacle {
                    let share = (float(voxel.top) + 0.5) / LEVELS;
                    floors.push(self.origin[2] + (float(at[2]) + share) * self.sides[2]);
                }
            }
        }
        (inside.len(), obstacle, floors)
    }
}

#[expect(clippy::cast_possible_truncation, reason = "floors of small numbers")]
fn whole(x: f64) -> i64 {
    x.floor() as i64
}

#[expect(clippy::cast_precision_loss, reason = "small numbers")]
fn float(i: i64) -> f64 {
    i as f64
}
