//! The sphere-of-influence graph to the r-th neighbour (Klein & Zachmann 2005, §3.2).
//!
//! `d_i` is the distance of point i from its r-th nearest other point, or from the furthest if
//! there are fewer. Points i and j are joined if and only if `‖p_i − p_j‖ ≤ d_i + d_j`.
//!
//! The comparison uses double-precision roots of single-precision squared distances
//! `(x−x')² + (y−y')² + (z−z')²`, rounded after each operation in this order. This predicate is the
//! same for the build and for updates. It is symmetric, and joins every point with its r nearest
//! whatever the rounding. Equal distances on a grid stay equal if the differences are exact, and
//! points at such a tie are joined. Distances below 1e-19 count as zero.

use nearmiss_index::{BlockBoxes, Nearest, Overlaps, PointBlock};
use nearmiss_lanes::parallel::ranges;
use nearmiss_lanes::vector::distance_sq;
use nearmiss_surface::Level;

use crate::adjacency::{Adjacency, Lists};
use crate::options::GraphError;

const WIDTH: usize = PointBlock::WIDTH;

/// Returns ‖a − b‖.
#[inline]
pub(crate) fn distance(a: [f32; 3], b: [f32; 3]) -> f64 {
    f64::from(distance_sq(a, b)).sqrt()
}

/// Returns a search radius slightly greater than `d_i`, given `d_i²`, so that rounding does not
/// lose a neighbour.
#[inline]
pub(crate) fn support_radius(radius_sq: f32) -> f32 {
    radius_sq.sqrt() * (1.0 + 1e-6) + 1e-19
}

/// Returns `d_i²` of each point, which defines its sphere of influence.
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

/// Returns the graph, given the spheres.
pub(crate) fn influence(positions: &[[f32; 3]], radii_sq: &[f32]) -> Result<Adjacency, GraphError> {
    let blocks = blocks(positions, |i| support_radius(radii_sq[i]));
    let boxes = BlockBoxes::new(&blocks, positions.len());
    let tree = boxes.over(&blocks);
    let level = Level::new();
    let radius = |i: usize| f64::from(radii_sq[i]).sqrt();
    let parts = ranges(blocks.len(), |range| {
        let (mut overlapping, mut lists) = (Overlaps::default(), Lists::default());
        for block in range {
            tree.overlapping(level, block, &mut overlapping);
            for i in block * WIDTH..((block + 1) * WIDTH).min(positions.len()) {
                let (p, own) = (positions[i], radius(i));
                let joined = |&&j: &&u32| {
                    let j = j as usize;
                    j != i && distance(p, positions[j]) <= own + radius(j)
                };
                lists.push(overlapping.at(i % WIDTH).iter().filter(joined).copied());
            }
        }
        lists
    });
    Adjacency::from_lists(parts)
}

/// Returns the points in blocks, with these support radii.
fn blocks(positions: &[[f32; 3]], support_radius: impl Fn(usize) -> f32) -> Vec<PointBlock> {
    let mut blocks = vec![PointBlock::EMPTY; positions.len().div_ceil(WIDTH)];
    for (i, p) in positions.iter().enumerate() {
        let (block, lane) = (&mut blocks[i / WIDTH], i % WIDTH);
        for k in 0..3 {
            block.position[k][lane] = p[k];
        }
        block.support_radius[lane] = support_radius(i);
    }
    blocks
}
