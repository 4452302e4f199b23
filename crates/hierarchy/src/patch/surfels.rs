//! Tangent discs ("surfels"): the first-order approximation of the surface at each point.
//!
//! A point's normal is that of the weighted least-squares fit at the point itself. Its disc is wide
//! enough that the discs of neighbours close the surface, and narrower at a border, because the
//! discs of two scans whose borders face each other a sampling radius apart must not meet. A border
//! shows as a wide sector of the tangent plane without a neighbour.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x16};
use nearmiss_index::PointBlock;
use nearmiss_lanes::parallel::{chunks, fill_with, in_order};
use nearmiss_lanes::vector::{dot, sub, tangents};
use nearmiss_lanes::wide::{along, product, seen_from};
use nearmiss_store::{Room, WorkError, Workspace};
use nearmiss_surface::{Centre, Evaluation, HalfBlock, Moments, Neighbourhood, Status};

use crate::bounds::boxes::OrientedBox;
use crate::patch::covering::Solid;
use crate::patch::enclosure::{Cell, LeafBounds, Sides, Surroundings};
use crate::patch::sectors::Taken;
use crate::point::disc::PointCode;
use crate::point::gather::{GROWN, Index};
use crate::point::kind::{PointKind, SLAB, ball, cell_radius, obstacle_ball};
use crate::point::neighbours::Locality;
use crate::point::spacing::{Look, Spacing};

/// If λ2 < 0.05 λ3 the neighbourhood is a line, and its normal is any direction across.
const LINE: f64 = 0.05;

/// The surface at a point to first order, and the point's class.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Fit {
    pub(crate) normal: [f32; 3],
    /// The code of the kind, and above it one more than the gap; 0 if that is unknown.
    code: u32,
}

/// The number of bits of [`Fit::code`] below the gap.
const GAP: u32 = 8;

impl Default for Fit {
    fn default() -> Self {
        Self::new([0.0, 0.0, 1.0], PointKind::Stray)
    }
}

impl Fit {
    /// A fit with an unknown gap.
    pub(crate) fn new(normal: [f32; 3], kind: PointKind) -> Self {
        Self { normal, code: kind.code().into() }
    }

    /// Returns the fit with its normal on the other side.
    pub(crate) fn flipped(self) -> Self {
        Self { normal: self.normal.map(|c| -c), ..self }
    }

    /// Returns the code of the point, and `false` if its gap is unknown and taken for 0.
    pub(crate) fn point_code(&self) -> (PointCode, bool) {
        let gap = self.code >> GAP;
        (PointCode::new(self.kind(), gap.saturating_sub(1)), gap > 0)
    }

    /// The point's class.
    #[expect(clippy::cast_possible_truncation, reason = "the code of a kind")]
    pub(crate) const fn kind(&self) -> PointKind {
        PointKind::from_code(self.code as u8)
    }
}

/// The disc of a point. Its radius follows from the code.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Surfel {
    pub(crate) normal: [f32; 3],
    pub(crate) code: PointCode,
    /// The cell that contains the surface nearest to the point.
    pub(crate) cell: Cell,
}

/// The discs of points as arrays, and the bounds of their leaves.
#[derive(Debug)]
pub(crate) struct Surfels {
    pub(crate) normals: Room<[f32; 3]>,
    pub(crate) codes: Room<PointCode>,
    /// The radius of each point's ball: the greater of [`ScanArrays::ball`](crate::ScanArrays::ball) and
    /// [`ScanArrays::obstacle_ball`](crate::ScanArrays::obstacle_ball).
    pub(crate) balls: Room<f32>,
    /// Solids around the disc, the ball and the cell of each point.
    pub(crate) cells: Room<Solid>,
    pub(crate) leaves: Room<LeafBounds>,
    /// Bounds of the leaves' parts of the obstacle.
    pub(crate) obstacles: Room<LeafBounds>,
}

/// The discs and bounds of a few leaves.
#[derive(Debug, Default)]
struct Some {
    discs: Vec<(Surfel, f32, f32)>,
    leaves: Vec<[LeafBounds; 2]>,
}

/// Scratch memory for leaves.
#[derive(Debug, Default)]
struct LeafScratch {
    locality: Locality,
    surroundings: Surroundings,
    /// The blocks near the leaf.
    blocks: Vec<PointBlock>,
    /// The decays of their points.
    decays: Vec<[f32; PointBlock::WIDTH]>,
    /// The places of the blocks whose support may contain a point.
    near: Vec<u32>,
    /// The places of the blocks whose support may come within the reach of a point.
    wide: Vec<u32>,
    halves: Vec<HalfBlock>,
    fits: Vec<Moments>,
    /// The places of the blocks with points that support each point of a leaf, one after the other, and the
    /// end of each point's.
    lists: Vec<u32>,
    ends: Vec<usize>,
}

/// The inputs for the discs of all points, in order.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Known<'a> {
    pub(crate) positions: &'a [[f32; 3]],
    pub(crate) radii: &'a [f32],
    /// The scan's sampling radius.
    pub(crate) ordinary: f32,
    /// The scan's reach.
    pub(crate) reach: f32,
    /// The number of dense points; sparse points follow.
    pub(crate) dense: usize,
}

/// Fits the surface at every point and classifies the points, with their gaps if `gaps`. O(n).
pub(crate) fn fits(
    index: &Index<'_>,
    positions: &[[f32; 3]],
    spacings: &[Spacing],
    gaps: bool,
    work: &Workspace,
) -> Result<Room<Fit>, WorkError> {
    let (topology, level) = (index.tree.topology, Level::new());
    let mut all = work.room(positions.len())?;
    fill_with(&mut all, topology.leaf_size(), LeafScratch::default, |scratch, leaves, found| {
        for (number, found) in leaves.zip(found.chunks_mut(topology.leaf_size())) {
            let points = topology.points_of_leaf(number);
            let (positions, spacings) = (&positions[points.clone()], &spacings[points]);
            let look = |i: usize| spacings[i].look();
            dispatch!(level, simd => fit(simd, index, positions, (&look, gaps), scratch, found));
        }
    });
    Ok(all)
}

/// Fits the surface at the points of some leaves, ascending, with their gaps. `looks` has their
/// appearance.
pub(crate) fn fits_of(
    index: &Index<'_>,
    positions: &[[f32; 3]],
    looks: &(impl Fn(usize) -> Look + Sync + Send),
    leaves: &[u32],
) -> Vec<Fit> {
    let (topology, level) = (index.tree.topology, Level::new());
    // Only the last leaf may have fewer points.
    let count = leaves.iter().map(|&leaf| topology.points_of_leaf(leaf as usize).len()).sum();
    let mut all = vec![Fit::default(); count];
    fill_with(&mut all, topology.leaf_size(), LeafScratch::default, |scratch, some, found| {
        for (number, found) in leaves[some].iter().zip(found.chunks_mut(topology.leaf_size())) {
            let points = topology.points_of_leaf(*number as usize);
            let (first, positions) = (points.start, &positions[points]);
            let look = |i: usize| looks(first + i);
            dispatch!(level, simd => fit(simd, index, positions, (&look, true), scratch, found));
        }
    });
    all
}

/// Returns the gaps of some points, in order. `normal` returns the normal of a point.
pub(crate) fn gaps_of(
    index: &Index<'_>,
    positions: &[[f32; 3]],
    normal: impl Fn(usize) -> [f32; 3] + Sync + Send,
    points: &[u32],
) -> Vec<u32> {
    let level = Level::new();
    let some = chunks(points, |points| {
        let (mut groups, mut near, mut gaps) = (Vec::new(), Vec::new(), Vec::new());
        for &point in points {
            let (p, normal) = (positions[point as usize], normal(point as usize));
            index.collect(level, p, 0.0, &mut groups);
            gaps.push(dispatch!(level, simd => simd.vectorize(
                #[inline(always)]
                || {
                    let near = index.supporting(simd, &groups, p, 0.0, &mut near);
                    let blocks = near.iter().map(|&block| &index.blocks[block as usize]);
                    widest_gap(simd, p, normal, blocks)
                },
            )));
        }
        gaps
    });
    some.into_iter().flatten().collect()
}

/// Returns the points of a leaf, and the box around them.
fn leaf(index: &Index<'_>, number: usize) -> (Range<usize>, OrientedBox) {
    let topology = index.tree.topology;
    (topology.points_of_leaf(number), index.tree.bounds(topology.leaf(number)))
}

/// Computes the discs of all points and the bounds of all leaves, in order.
pub(crate) fn surfels(
    index: &Index<'_>,
    known: &Known<'_>,
    fits: &[Fit],
    work: &Workspace,
) -> Result<Surfels, WorkError> {
    let Known { positions, radii, ordinary, reach, dense } = *known;
    let (topology, level) = (index.tree.topology, Level::new());
    let some = |scratch: &mut LeafScratch, leaves: Range<usize>| {
        let (mut surfels, mut some) = (Vec::new(), Some::default());
        for number in leaves {
            let (points, about) = leaf(index, number);
            let leaf =
                Leaf { positions: &positions[points.clone()], radii: &radii[points.clone()], about: &about };
            let is_dense = points.start < dense;
            let fits = &fits[points.clone()];
            surfels.clear();
            some.leaves.push(dispatch!(level, simd => {
                leaf.look_about(simd, index, (fits, reach, is_dense), scratch, &mut surfels)
            }));
            for ((i, &radius), surfel) in points.zip(leaf.radii).zip(&surfels) {
                let kind = surfel.code.kind();
                let ball = ball(kind, radius, ordinary).max(obstacle_ball(i, dense, kind, radius));
                some.discs.push((*surfel, surfel.code.disc(radius, reach, ordinary), ball));
            }
        }
        some
    };
    let (points, leaves) = (positions.len(), topology.leaves());
    let mut all = Surfels {
        normals: work.room(points)?,
        codes: work.room(points)?,
        balls: work.room(points)?,
        cells: work.room(points)?,
        leaves: work.room(leaves)?,
        obstacles: work.room(leaves)?,
    };
    all.fill(|take| in_order(leaves, LeafScratch::default, some, take));
    Ok(all)
}

impl Surfels {
    /// Stores the results that `give` passes on, one after the other.
    fn fill(&mut self, give: impl FnOnce(&mut (dyn FnMut(Some) + Send))) {
        let Self { normals, codes, balls, cells, leaves, obstacles } = self;
        let (normals, codes): (&mut [_], &mut [_]) = (normals, codes);
        let (balls, cells): (&mut [_], &mut [_]) = (balls, cells);
        let (leaves, obstacles): (&mut [_], &mut [_]) = (leaves, obstacles);
        let (mut point, mut leaf) = (0, 0);
        give(&mut |some| {
            for (surfel, disc, ball) in some.discs {
                (normals[point], codes[point], balls[point]) = (surfel.normal, surfel.code, ball);
                cells[point] = Solid::of_cell(&surfel.cell, Solid::of_disc(disc, ball));
                point += 1;
            }
            for [surface, obstacle] in some.leaves {
                (leaves[leaf], obstacles[leaf]) = (surface, obstacle);
                leaf += 1;
            }
        });
    }
}

/// The points of a leaf, and the box around them.
#[derive(Debug, Clone, Copy)]
struct Leaf<'a> {
    positions: &'a [[f32; 3]],
    radii: &'a [f32],
    about: &'a OrientedBox,
}

impl Leaf<'_> {
    /// Computes the discs of the points, narrowed at borders, and the bounds of the leaf's part of
    /// the surface and of the obstacle.
    #[inline(always)]
    fn look_about<S: Simd>(
        &self,
        simd: S,
        index: &Index<'_>,
        (fits, reach, is_dense): (&[Fit], f32, bool),
        scratch: &mut LeafScratch,
        surfels: &mut Vec<Surfel>,
    ) -> [LeafBounds; 2] {
        simd.vectorize(
            #[inline(always)]
            || {
                let LeafScratch { locality, surroundings, near, wide, .. } = scratch;
                // Radii grow by at most 0.3 per length, and few of them as fast.
                locality.collect(simd, index, self.positions, self.about.centre, 1.3 * self.about.reach);
                locality.gather_balls(index);
                surroundings.fill(index, self.positions[0], locality);
                let bounds = LeafBounds::new(simd, self.positions, self.about, surroundings);
                let (mut cells, mut obstacle) = (bounds.cells(), bounds.cells());
                let mut has_cells = false;
                for ((p, &radius), fit) in self.positions.iter().zip(self.radii).zip(fits) {
                    let wide = locality.supporting(simd, *p, surroundings.reach() * GROWN, wide);
                    let mut cell = surroundings.cell(simd, *p, fit.normal, wide);
                    let axes = tangents(fit.normal);
                    let (mut taken, mut sides) = (Taken::new(simd), Sides::new(simd, radius));
                    for &place in &*locality.supporting(simd, *p, 0.0, near) {
                        let block = &index.blocks[locality.blocks[place as usize] as usize];
                        let d = seen_from(simd, &block.position, *p);
                        let (d_sq, flat) = (product(d, d), [along(d, axes.0), along(d, axes.1)]);
                        taken.add(simd, f32x16::load_array_ref(simd, &block.support_radius), d_sq, flat);
                        sides.add(simd, &cell, d_sq, flat, along(d, fit.normal));
                    }
                    sides.close(&mut cell);
                    let gap = taken.widest_gap();
                    cells.include(*p, fit.normal, &cell);
                    if is_dense && fit.kind().is_sheet() {
                        has_cells = true;
                        obstacle.include(
                            *p,
                            fit.normal,
                            &cell.within(cell_radius(radius, reach), SLAB * radius),
                        );
                    }
                    let code = PointCode::new(fit.kind(), gap);
                    surfels.push(Surfel { normal: fit.normal, code, cell });
                }
                let obstacle = if has_cells { obstacle.close() } else { bounds.empty() };
                [cells.close(), obstacle]
            },
        )
    }
}

/// Sets `found` to the fits of the points of a leaf, with gaps if `gaps`. `look` returns the appearance of
/// a point.
#[inline(always)]
fn fit<S: Simd>(
    simd: S,
    index: &Index<'_>,
    positions: &[[f32; 3]],
    (look, gaps): (&dyn Fn(usize) -> Look, bool),
    scratch: &mut LeafScratch,
    found: &mut [Fit],
) {
    simd.vectorize(
        #[inline(always)]
        || {
            let LeafScratch { locality, blocks, decays, near, halves, fits, lists, ends, .. } = scratch;
            let middle = middle(positions);
            let own = positions.iter().map(|p| sub(*p, middle)).map(|d| dot(d, d));
            let own = own.fold(0.0, f32::max).sqrt();
            locality.collect_within(simd, index, middle, own * GROWN);
            locality.gather_balls(index);
            blocks.clear();
            blocks.extend(locality.blocks.iter().map(|&block| index.blocks[block as usize]));
            decays.clear();
            // A loop, as a closure would be compiled without the instruction set.
            for block in &*blocks {
                decays.push(index.plan.decays(simd, block).to_array());
            }
            fits.clear();
            lists.clear();
            ends.clear();
            for p in positions {
                let x = Centre::new(p.map(f64::from));
                let mut sums = Neighbourhood::new(simd, index.plan, &x);
                let near = locality.supporting(simd, x.rounded(), 0.0, near);
                let count = sums.offer_all(simd, (blocks, decays), near, halves);
                lists.extend_from_slice(&near[..count]);
                ends.push(lists.len());
                fits.push(sums.moments(simd));
            }
            Moments::evaluate_all(simd, index.plan, positions, fits, |i, at| found[i] = fitted(&at, look(i)));
            if gaps {
                let mut start = 0;
                for (i, fit) in found.iter_mut().enumerate() {
                    let near = lists[start..ends[i]].iter().map(|&place| &blocks[place as usize]);
                    let gap = widest_gap(simd, positions[i], fit.normal, near);
                    fit.code |= (gap + 1) << GAP;
                    start = ends[i];
                }
            }
        },
    );
}

/// Returns the centre of the upright box about some points.
#[inline(always)]
fn middle(points: &[[f32; 3]]) -> [f32; 3] {
    let (mut low, mut high) = (points[0], points[0]);
    for p in points {
        for k in 0..3 {
            low[k] = if p[k] < low[k] { p[k] } else { low[k] };
            high[k] = if p[k] > high[k] { p[k] } else { high[k] };
        }
    }
    let mut middle = low;
    for k in 0..3 {
        middle[k] = 0.5 * low[k] + 0.5 * high[k];
    }
    middle
}

/// Returns the fit of a point from f there.
pub(crate) fn fitted(at: &Evaluation, look: Look) -> Fit {
    #[expect(clippy::cast_possible_truncation, reason = "stored in single precision")]
    let normal = at.normal.map(|c| c as f32);
    Fit::new(normal, kind(at, look))
}

/// Returns the disc of the point `p`, narrowed if adjacent sectors around it contain none of the
/// points in `near`, whose support radii reach `p`.
pub(crate) fn surfel_of(fit: &Fit, p: [f32; 3], near: &[PointBlock]) -> Surfel {
    let gap = dispatch!(Level::new(), simd => simd.vectorize(
        #[inline(always)]
        || widest_gap(simd, p, fit.normal, near.iter()),
    ));
    Surfel { normal: fit.normal, code: PointCode::new(fit.kind(), gap), cell: Cell::default() }
}

/// Returns the greatest number of adjacent sectors of the tangent plane without a point that
/// supports `p`. The blocks `near` contain such points.
#[inline(always)]
fn widest_gap<'a, S: Simd>(
    simd: S,
    p: [f32; 3],
    normal: [f32; 3],
    near: impl Iterator<Item = &'a PointBlock>,
) -> u32 {
    let (axes, mut taken) = (tangents(normal), Taken::new(simd));
    for block in near {
        let d = seen_from(simd, &block.position, p);
        let support_radius = f32x16::load_array_ref(simd, &block.support_radius);
        taken.add(simd, support_radius, product(d, d), [along(d, axes.0), along(d, axes.1)]);
    }
    taken.widest_gap()
}

fn kind(at: &Evaluation, look: Look) -> PointKind {
    let [_, l2, l3] = at.eigenvalues;
    match at.status {
        Status::Outside => PointKind::Stray,
        _ if look == Look::Line || l2 < LINE * l3 => PointKind::Line,
        _ if look == Look::Sparse => PointKind::Sparse,
        Status::Ok => PointKind::Sheet,
        Status::Border => PointKind::Edge,
        _ => PointKind::Noisy,
    }
}
