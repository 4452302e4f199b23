//! The sphere-of-influence graph to the r-th neighbour (S1 §3.2).
//!
//! `d_i` is the distance of point i from its r-th nearest other point, or from the furthest where there are
//! fewer; i and j are joined iff `‖p_i − p_j‖ ≤ d_i + d_j`. What is compared is √ in double precision of
//! squared distances in single, `(x−x')² + (y−y')² + (z−z')²` rounded at each operation in this order. That
//! is one predicate for all who ask it, symmetric, and it joins every point with its r nearest whatever the
//! rounding. Equal distances on a grid stay equal where the differences are: at such a tie the points are
//! joined. Distances below 1e-19 are none.

use nearmiss_index::{BlockBoxes, Heard, Nearest, PointBlock};
use nearmiss_lanes::parallel::ranges;
use nearmiss_lanes::vector::distance_sq;
use nearmiss_surface::Level;

use crate::adjacency::{Adjacency, Lists};
use crate::options::GraphError;

const WIDTH: usize = PointBlock::WIDTH;

/// ‖a − b‖.
#[inline]
pub(crate) fn distance(a: [f32; 3], b: [f32; 3]) -> f64 {
    f64::from(distance_sq(a, b)).sqrt()
}

/// How far a point of this `d_i²` is heard: further than `d_i`, by more than rounding, so that no neighbour
/// is missed.
#[inline]
pub(crate) fn horizon(radius_sq: f32) -> f32 {
    radius_sq.sqrt() * (1.0 + 1e-6) + 1e-19
}

/// The spheres of influence: `d_i²` of each point.
pub(crate) fn radii_sq(positions: &[[f32; 3]], neighbours: u32) -> Vec<f32> {
    let blocks = blocks(positions, |_| 0.0);
    let boxes = BlockBoxes::new(&blocks, positions.len());
    let tree = boxes.over(&blocks);
    let level = Level::new();
    let parts = ranges(blocks.len(), |range| {
        let (mut found, mut radii) = (Nearest::default(), Vec::new());
        for block in range {
            tree.nearest(level, block, neighbours as usize, &mut found);
            let lanes = 0..(positions.len() - block * WIDTH).min(WIDTH);
            radii.extend(lanes.map(|lane| found.of(lane).last().map_or(0.0, |last| last.distance_sq)));
        }
        radii
    });
    parts.into_iter().flatten().collect()
}

/// The graph, given the spheres.
pub(crate) fn influence(positions: &[[f32; 3]], radii_sq: &[f32]) -> Result<Adjacency, GraphError> {
    let blocks = blocks(positions, |i| horizon(radii_sq[i]));
    let boxes = BlockBoxes::new(&blocks, positions.len());
    let tree = boxes.over(&blocks);
    let level = Level::new();
    let radius = |i: usize| f64::from(radii_sq[i]).sqrt();
    let parts = ranges(blocks.len(), |range| {
        let (mut heard, mut lists) = (Heard::default(), Lists::default());
        for block in range {
            tree.heard(level, block, &mut heard);
            for i in block * WIDTH..((block + 1) * WIDTH).min(positions.len()) {
                let (p, own) = (positions[i], radius(i));
                let joined = |&&j: &&u32| {
                    let j = j as usize;
                    j != i && distance(p, positions[j]) <= own + radius(j)
                };
                lists.push(heard.at(i % WIDTH).iter().filter(joined).copied());
            }
        }
        lists
    });
    Adjacency::from_lists(parts)
}

/// The points in blocks, with their horizons.
fn blocks(positions: &[[f32; 3]], horizon: impl Fn(usize) -> f32) -> Vec<PointBlock> {
    let mut blocks = vec![PointBlock::EMPTY; positions.len().div_ceil(WIDTH)];
    for (i, p) in positions.iter().enumerate() {
        let (block, lane) = (&mut blocks[i / WIDTH], i % WIDTH);
        for k in 0..3 {
            block.position[k][lane] = p[k];
        }
        block.horizon[lane] = horizon(i);
    }
    blocks
}
