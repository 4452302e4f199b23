//! Validation of the numbers of every point, against their ranges and against the leaf.

use std::array::from_fn;

use nearmiss_store::Flaw;

use super::limits::FARTHEST;
use crate::bounds::boxes::OrientedBox;
use crate::point::disc::{DiscRadii, PointCode};
use crate::point::kind::THICKNESS;
use crate::scan::build::PointHierarchy;

/// Tolerance for the squared length of normals, which are unit up to rounding.
const NORMAL: f32 = 1e-5;

/// Bound on the rounding error of a coordinate in a box that was grown by 3e-6 of its coordinates.
const SLACK: f32 = 1e-6;

/// Tolerance for a sine computed as √(1 − (n·axis)²), whose square is about 1e-7 off.
const SINE: f32 = 2e-3;

/// The number of points processed together.
const LANES: usize = 8;

/// One number for each lane.
type Lanes = [f32; LANES];

/// One for each lane that passes a check, otherwise zero.
type Sound = [u32; LANES];

/// Checks all points of a hierarchy whose structure is valid.
pub(super) fn check(scan: &PointHierarchy) -> Result<(), Flaw> {
    let arrays = Arrays {
        positions: scan.positions(),
        normals: &scan.arrays.normals,
        radii: &scan.arrays.radii,
        discs: scan.discs(),
        source: &scan.arrays.source,
    };
    let last = u32::try_from(scan.given() - 1).unwrap_or(u32::MAX);
    let topology = scan.topology();
    for number in 0..topology.leaves() {
        let bounds = &scan.tree().bounds(topology.leaf(number));
        let size = |v: [f32; 3]| v[0].abs() + v[1].abs() + v[2].abs();
        let leaf = Leaf { bounds, last, slack: SLACK * (size(bounds.centre) + size(bounds.half)) };
        let points = topology.points_of_leaf(number);
        for start in points.clone().step_by(LANES) {
            leaf.check(&arrays.block(start, points.end), start)?;
        }
    }
    Ok(())
}

/// The arrays with one entry for each point.
struct Arrays<'a> {
    positions: &'a [[f32; 3]],
    normals: &'a [[f32; 3]],
    radii: &'a [f32],
    discs: DiscRadii<'a>,
    source: &'a [u32],
}

/// Some points of a leaf side by side, padded with the first of them.
struct Block {
    position: [Lanes; 3],
    normal: [Lanes; 3],
    radius: Lanes,
    disc: Lanes,
    code: [PointCode; LANES],
    source: [u32; LANES],
}

impl Arrays<'_> {
    #[inline]
    fn block(&self, start: usize, end: usize) -> Block {
        let code = lanes(self.discs.codes, start, end);
        let radius = lanes(self.radii, start, end);
        Block {
            position: transposed(&lanes(self.positions, start, end)),
            normal: transposed(&lanes(self.normals, start, end)),
            radius,
            disc: from_fn(|i| code[i].disc(radius[i], self.discs.reach, self.discs.sampling_radius)),
            code,
            source: lanes(self.source, start, end),
        }
    }
}

#[inline]
fn lanes<T: Copy>(all: &[T], start: usize, end: usize) -> [T; LANES] {
    let some = &all[start..end];
    some.first_chunk().copied().unwrap_or_else(|| {
        let mut filled = [some[0]; LANES];
        filled[..some.len()].copy_from_slice(some);
        filled
    })
}

#[inline]
fn transposed(vectors: &[[f32; 3]; LANES]) -> [Lanes; 3] {
    let mut rows = [[0.0; LANES]; 3];
    for i in 0..LANES {
        for k in 0..3 {
            rows[k][i] = vectors[i][k];
        }
    }
    rows
}

/// The limits for the points of a leaf.
struct Leaf<'a> {
    bounds: &'a OrientedBox,
    /// The last index of the caller's input.
    last: u32,
    /// The rounding error in this leaf.
    slack: f32,
}

/// The names of the checks, in the order of [`Leaf::sound`].
const COMPARED: [&str; 6] = [
    "the position of point",
    "the normal of point",
    "the radius of point",
    "the kind of point",
    "the source index of point",
    "the bounding box of point",
];

impl Leaf<'_> {
    /// Checks the points from `start`; the error names the first that fails.
    #[inline]
    fn check(&self, p: &Block, start: usize) -> Result<(), Flaw> {
        let found = self.sound(p);
        let mut all = [1; LANES];
        for sound in &found {
            for i in 0..LANES {
                all[i] &= sound[i];
            }
        }
        let Some(lane) = all.iter().position(|&sound| sound == 0) else { return Ok(()) };
        let what =
            COMPARED.iter().zip(found).find(|(_, sound)| sound[lane] == 0).map_or("point", |(what, _)| what);
        Err(Flaw::Value { what, index: start + lane })
    }

    /// Performs every check, in all lanes. Written so that NaN fails, and with plain loops over
    /// lanes, so that it compiles to vector code.
    #[inline]
    fn sound(&self, p: &Block) -> [Sound; COMPARED.len()] {
        let ([x, y, z], [nx, ny, nz]) = (&p.position, &p.normal);
        let mut sound = [[1; LANES]; COMPARED.len()];
        for i in 0..LANES {
            let placed = (x[i].abs() <= FARTHEST) & (y[i].abs() <= FARTHEST) & (z[i].abs() <= FARTHEST);
            sound[0][i] = u32::from(placed);
        }
        for i in 0..LANES {
            let off = (nx[i] * nx[i] + ny[i] * ny[i] + nz[i] * nz[i] - 1.0).abs();
            sound[1][i] = u32::from(off <= NORMAL);
        }
        for i in 0..LANES {
            sound[2][i] = u32::from((p.radius[i] > 0.0) & (p.radius[i] <= self.bounds.reach));
        }
        for i in 0..LANES {
            sound[3][i] = u32::from(p.code[i].is_sound());
            sound[4][i] = u32::from(p.source[i] <= self.last);
        }
        sound[5] = self.in_box(p);
        sound
    }

    /// Returns the lanes of points whose disc, with its thickness, is inside the box.
    #[inline]
    fn in_box(&self, p: &Block) -> Sound {
        let b = self.bounds;
        let ([x, y, z], [nx, ny, nz]) = (&p.position, &p.normal);
        let [cx, cy, cz] = b.centre;
        let mut sound = [1; LANES];
        for k in 0..3 {
            let [ux, uy, uz] = b.axes[k];
            let most = b.half[k] + self.slack;
            for i in 0..LANES {
                let along = (x[i] - cx) * ux + (y[i] - cy) * uy + (z[i] - cz) * uz;
                let cosine = nx[i] * ux + ny[i] * uy + nz[i] * uz;
                let room = most - along.abs() - (THICKNESS - SINE) * p.disc[i];
                let spread_sq = p.disc[i] * p.disc[i] * (1.0 - cosine * cosine);
                sound[i] &= u32::from((room >= 0.0) & (spread_sq <= room * room));
            }
        }
        sound
    }
}
