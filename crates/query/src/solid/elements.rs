//! The parts of a scan that shapes are compared with: a disc or a ball for each point, and the volume
//! that contains the obstacle near each point.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16, mask32x16};
use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::{ClearanceGrid, LeafBlock, LeafBoxes, Part, PointKind, SLAB, ScanArrays, THICKNESS};
use nearmiss_lanes::wide::{Bits, bits};

use crate::ask::answer::Evidence;
use crate::ask::options::{Detail, Semantics};
use crate::leaf::disc_triangle::FlatDisc;
use crate::pair::placed::Placed;
use crate::solid::core::{Gap, Solid};
use crate::solid::lanes::{Distances, LaneBox};
use crate::solid::plan::ShapePlan;
use crate::solid::plane::Plane;

type Vector = Vector3<f64>;

const WIDTH: usize = LeafBlock::WIDTH;

/// Steps of a component of a normal in a [`LeafBlock`].
const STEPS: f32 = 32767.0;

/// The part of one point.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Element {
    /// A tangent disc.
    Disc(FlatDisc),
    /// A ball about the point.
    Ball(Vector, f64),
}

impl Element {
    /// The nearest points of a core and the disc or ball. Also the distance up to which they meet without a
    /// margin. If the shape is further away than `most` and than that, any two points that are, too.
    pub(crate) fn gap(&self, solid: &Solid<'_>, most: f64) -> (Gap, f64) {
        match self {
            Self::Disc(disc) => {
                let thick = disc.thickness();
                (solid.gap(disc, solid.radius + most.max(thick)), thick)
            }
            &Self::Ball(centre, radius) => {
                let on_core = solid.nearest(&centre);
                let away = on_core - centre;
                let length = away.norm();
                let on_ball = if length > radius { centre + away * (radius / length) } else { on_core };
                let distance = length - radius;
                (Gap { distance, lower: distance - 1e-12 * length, on_core, on_disc: on_ball }, 0.0)
            }
        }
    }
}

/// A scan with the meaning of a plan, in its stored frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Elements<'a> {
    pub(crate) placed: Placed<'a>,
    pub(crate) arrays: ScanArrays<'a>,
    /// The clearance at each place, if the scan has a shape index and the obstacle counts.
    pub(crate) clear: Option<&'a ClearanceGrid>,
    /// The boxes around the leaves, if the scan has a shape index and the obstacle or points count.
    pub(crate) leaves: Option<&'a LeafBoxes>,
    /// The detail of contacts.
    pub(crate) detail: Detail,
    pub(crate) semantics: Semantics,
    /// The margin in the stored frame.
    pub(crate) margin: f64,
    /// The radius of thickened points in the stored frame.
    thickened: f64,
    /// The greatest coordinate of the scan.
    pub(crate) far: f64,
    /// `true` if enclosures prove separations.
    pub(crate) certifies: bool,
    /// Half the thickness of cells, in local radii.
    slab: f32,
}

/// Lower bounds on the distances of a core from the parts of sixteen points; infinite in unused lanes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LeafGaps {
    /// From the discs, with their thickness, and from the balls.
    pub(crate) elements: [f32; WIDTH],
    /// From the cells, which contain the obstacle near the points unless they are [flat](Elements::flat).
    pub(crate) cells: [f32; WIDTH],
    /// Upper bounds on the distances from the points themselves, if [`Solid::is_closed_in_lanes`].
    pub(crate) points: [f32; WIDTH],
}

/// The sizes of the parts of sixteen points.
pub(crate) struct Parts<S: Simd> {
    /// The radii of discs and balls.
    pub(crate) radii: f32x16<S>,
    /// The radii about the points that contain the obstacle near them, and half its thickness. Not set
    /// if only discs and balls are wanted, as the next.
    pub(crate) reaches: f32x16<S>,
    slabs: f32x16<S>,
    /// The radii of the cells of points on sheets.
    pub(crate) cells: f32x16<S>,
    pub(crate) discs: mask32x16<S>,
}

/// Distances of a core from the points of a block of a leaf and their planes, and the errors of these.
pub(crate) struct Measured<S: Simd> {
    pub(crate) distances: Distances<S>,
    /// The error of the distance from a disc, or of a height.
    pub(crate) tilt: f32x16<S>,
    /// The error of the distance from a point.
    off: f32,
}

impl<S: Simd> Measured<S> {
    #[inline(always)]
    pub(crate) fn new(simd: S, lane_box: &LaneBox<'_>, block: &LeafBlock) -> Self {
        // Positions are off by a step, and normals by less than a step in each component.
        let [x, y, z] = block.half;
        let step = 2.0 * (x * x + y * y + z * z).sqrt() / STEPS;
        let distances = lane_box.of_points(simd, &block.positions(simd), &block.normals(simd));
        let off = 2.0 * step + lane_box.slack;
        let tilt = (distances.from_point + lane_box.reach()) * (2.0 / STEPS) + off;
        Self { distances, tilt, off }
    }
}

impl<'a> Elements<'a> {
    #[inline]
    pub(crate) fn new(placed: Placed<'a>, plan: &ShapePlan) -> Self {
        let arrays = placed.scan().arrays();
        let options = plan.options();
        let scale = placed.stored_to_world().scale();
        let thickened = match options.semantics {
            Semantics::Thickened(radius) => radius / scale,
            _ => 0.0,
        };
        // The surface alone continues beyond the obstacle, which the boxes contain.
        let is_listed = options.semantics != Semantics::Surface;
        let bounds = placed.scan().root_box();
        let far = Vector3::from(bounds.centre).amax() + bounds.radius();
        Self {
            placed,
            arrays,
            clear: placed
                .shapes()
                .and_then(|index| index.clear.as_deref())
                .filter(|_| options.semantics == Semantics::Obstacle),
            leaves: placed.shapes().and_then(|index| index.leaves.as_deref()).filter(|_| is_listed),
            detail: options.detail,
            semantics: options.semantics,
            margin: options.margin / scale,
            thickened,
            far: f64::from(far) + thickened,
            certifies: options.certifies(),
            slab: SLAB,
        }
    }

    /// The same, with which nothing evaluates the implicit function.
    pub(crate) fn without_witness(&self) -> Self {
        Self { detail: Detail::Verdict, ..*self }
    }

    /// The discs and balls alone, without a margin.
    pub(crate) fn bare(&self) -> Self {
        Self { margin: 0.0, certifies: false, ..self.without_witness() }
    }

    /// The same with flat cells, as rays see them. Lower bounds on distances are then those from the discs,
    /// the balls and the flat cells, unless only enclosures count.
    pub(crate) fn flat(&self) -> Self {
        Self { slab: 0.0, ..*self }
    }

    pub(crate) fn scale(&self) -> f64 {
        self.placed.stored_to_world().scale()
    }

    pub(crate) fn part(&self) -> Part {
        self.semantics.part()
    }

    /// The radius by which points exceed the boxes of their nodes.
    pub(crate) fn beyond_boxes(&self) -> f64 {
        self.thickened
    }

    pub(crate) fn position(&self, i: usize) -> Vector {
        self.arrays.position(i).map(f64::from).into()
    }

    /// The positions of `count` points, at most sixteen, in lanes.
    #[inline(always)]
    pub(crate) fn positions(&self, first: usize, count: usize) -> [[f32; WIDTH]; 3] {
        if first.is_multiple_of(WIDTH) {
            return self.arrays.blocks[first / WIDTH].position;
        }
        let mut positions = [[0.0; WIDTH]; 3];
        for lane in 0..count {
            for (k, x) in self.arrays.position(first + lane).into_iter().enumerate() {
                positions[k][lane] = x;
            }
        }
        positions
    }

    /// The local radii of `count` points, at most sixteen, in the stored frame.
    #[inline(always)]
    pub(crate) fn local_radii<S: Simd>(&self, simd: S, first: usize, count: usize) -> f32x16<S> {
        let of = &self.arrays.radii[first..first + count];
        if let Ok(radii) = of.try_into() {
            return f32x16::load_array_ref(simd, radii);
        }
        let mut radii = [0.0; WIDTH];
        radii[..count].copy_from_slice(of);
        f32x16::load_array_ref(simd, &radii)
    }

    /// Returns `true` if a point is at a border of a sheet.
    pub(crate) fn is_at_border(&self, i: usize) -> bool {
        self.placed.scan().is_at_border(i) || self.placed.scan().kind(i) == PointKind::Edge
    }

    /// The lanes among `lanes`, from the point `first` on, whose points are at a border, as bits.
    pub(crate) fn borders(&self, first: usize, lanes: u32) -> u32 {
        let is_at_border = |lane: usize| self.is_at_border(first + lane);
        Bits(lanes).fold(0, |borders, lane| borders | u32::from(is_at_border(lane)) << lane)
    }

    pub(crate) fn normal(&self, i: usize) -> Vector {
        Vector::from(self.arrays.normals[i].map(f64::from)).normalize()
    }

    /// The local radius of a point, in the world.
    pub(crate) fn band(&self, i: usize) -> f64 {
        f64::from(self.arrays.radii[i]) * self.scale()
    }

    /// The greatest local radius, in the world.
    pub(crate) fn greatest_band(&self) -> f64 {
        f64::from(self.arrays.tree.root_box().reach) * self.scale()
    }

    /// Returns `true` if a disc represents the point.
    pub(crate) fn is_disc(&self, i: usize) -> bool {
        match self.semantics {
            Semantics::Obstacle => self.arrays.is_on_sheet(i),
            Semantics::Surface => !self.is_doubtful(i),
            Semantics::Thickened(_) => false,
        }
    }

    /// Returns `true` if the surface near the point is not known, and surfaces are compared.
    pub(crate) fn is_doubtful(&self, i: usize) -> bool {
        self.semantics == Semantics::Surface && self.placed.scan().kind(i).is_sparse()
    }

    /// The radius of the disc or ball of a point.
    fn radius(&self, i: usize) -> f32 {
        #[expect(clippy::cast_possible_truncation, reason = "the exact test is in double precision")]
        match self.semantics {
            Semantics::Thickened(_) => (self.thickened as f32).next_up(),
            Semantics::Surface if self.is_doubtful(i) => self.arrays.ball(i),
            Semantics::Obstacle if !self.is_disc(i) => self.arrays.obstacle_ball(i),
            _ => self.arrays.discs.get(i),
        }
    }

    /// The part of a point.
    pub(crate) fn element(&self, i: usize) -> Element {
        let centre = self.position(i);
        if self.is_disc(i) {
            let radius = f64::from(self.arrays.discs.get(i));
            return Element::Disc(FlatDisc { centre, normal: self.normal(i), radius });
        }
        let radius = match self.semantics {
            Semantics::Thickened(_) => self.thickened,
            _ => f64::from(self.radius(i)),
        };
        Element::Ball(centre, radius)
    }

    /// The measured point `i`, in the stored frame, if it is in a shape and points are part of the obstacle.
    #[inline]
    pub(crate) fn held(&self, solid: &Solid<'_>, i: usize) -> Option<Vector> {
        let point = self.position(i);
        let is_held =
            self.semantics == Semantics::Obstacle && solid.distance(&point) <= solid.radius + self.margin;
        is_held.then_some(point)
    }

    /// A point of the disc or ball of a point that is in a shape or within the margin, if there is one.
    pub(crate) fn reached(&self, solid: &Solid<'_>, i: usize) -> Option<Vector> {
        let element = self.element(i);
        let Element::Disc(disc) = element else {
            let (gap, _) = element.gap(solid, self.margin);
            return (gap.distance <= solid.radius + self.margin).then_some(gap.on_disc);
        };
        solid.reaches(&disc, solid.radius + self.margin.max(disc.thickness()))
    }

    /// A lower bound on the distance of a core from the cell or the ball of a point; any that exceeds
    /// `beyond` if the distance does. The core is above `plane`.
    pub(crate) fn cell_gap(
        &self,
        solid: &Solid<'_>,
        i: usize,
        (beyond, plane): (f64, Option<&Plane>),
    ) -> f64 {
        let (centre, reach) = (self.position(i), f64::from(self.arrays.obstacle_reach(i)));
        let Some((disc, slab)) = self.cell(i, centre, reach) else {
            return solid.distance_bound(&centre) - reach;
        };
        // Lanes know the distances of other cores from points, or bounds on them.
        let by_ball = if solid.is_own() { solid.distance_bound(&centre) - reach } else { f64::NEG_INFINITY };
        if by_ball > beyond {
            return by_ball;
        }
        let above = plane.map_or(0.0, |plane| plane.above(&disc));
        let lower = if above > beyond + slab { above } else { solid.gap(&disc, beyond + slab).lower };
        by_ball.max(lower - slab)
    }

    /// The greatest distance of a place of the cell of a point from its disc.
    pub(crate) fn hole(&self, i: usize) -> f64 {
        let beyond = self.arrays.cell_radius(i) - self.arrays.discs.get(i);
        if self.is_disc(i) { f64::from(beyond.max(0.0)) } else { 0.0 }
    }

    /// Returns `true` if the obstacle near a point is proven to be further than `within` from a core.
    pub(crate) fn is_cell_beyond(&self, solid: &Solid<'_>, i: usize, within: f64) -> bool {
        let (centre, reach) = (self.position(i), f64::from(self.arrays.obstacle_reach(i)));
        if solid.distance_bound(&centre) - reach > within {
            return true;
        }
        let cell = self.cell(i, centre, reach);
        cell.is_some_and(|(disc, slab)| solid.is_beyond(&disc, (within + slab) * (1.0 + 1e-9)))
    }

    /// A disc and a distance from it within which the obstacle near a point on a sheet is.
    fn cell(&self, i: usize, centre: Vector, radius: f64) -> Option<(FlatDisc, f64)> {
        if !self.arrays.is_on_sheet(i) {
            return None;
        }
        let slab = f64::from(self.slab * self.arrays.radii[i]) * (1.0 + 1e-6);
        Some((FlatDisc { centre, normal: self.normal(i), radius }, slab))
    }

    /// Compares a core with the points of a block of a leaf, given by its number.
    #[inline(always)]
    pub(crate) fn leaf_gaps<S: Simd>(
        &self,
        simd: S,
        lane_box: &LaneBox<'_>,
        (leaf, block, first, count): (usize, &LeafBlock, usize, usize),
    ) -> LeafGaps {
        let has_cells = self.certifies && self.semantics == Semantics::Obstacle;
        let parts = self.parts(simd, leaf, (block, first, count), has_cells);
        let used = mask32x16::from_bitmask(simd, (1_u64 << count) - 1);
        let none = f32x16::splat(simd, f32::INFINITY);
        let Measured { distances, tilt, off } = Measured::new(simd, lane_box, block);
        let elements = distances.parts(simd, parts.radii, parts.radii * THICKNESS, parts.discs) - tilt;
        let cells = if has_cells {
            distances.cells(simd, parts.reaches, parts.slabs, parts.discs) - tilt
        } else {
            elements
        };
        LeafGaps {
            elements: used.select(elements, none).to_array(),
            cells: used.select(cells, none).to_array(),
            points: (distances.from_point + off).to_array(),
        }
    }

    /// The sizes of the parts of the points in a block of a leaf, and those of their cells.
    #[inline(always)]
    pub(crate) fn parts<S: Simd>(
        &self,
        simd: S,
        leaf: usize,
        (block, first, count): (&LeafBlock, usize, usize),
        has_cells: bool,
    ) -> Parts<S> {
        let zero = f32x16::splat(simd, 0.0);
        if count == WIDTH && first.is_multiple_of(WIDTH) && self.semantics == Semantics::Obstacle {
            let balls = if self.arrays.leaves.has_balls(leaf) {
                f32x16::load_array_ref(simd, &self.arrays.obstacle_balls(first / WIDTH))
            } else {
                zero
            };
            let (discs, of_discs): (mask32x16<S>, _) = (balls.simd_eq(zero), block.discs(simd));
            let radii = discs.select(of_discs, balls);
            let local: Option<&[f32; WIDTH]> = self.arrays.radii[first..first + WIDTH].try_into().ok();
            let Some(local) = local.filter(|_| has_cells) else {
                return Parts { radii, reaches: radii, slabs: zero, cells: zero, discs };
            };
            let local = f32x16::load_array_ref(simd, local);
            let cells = local.min(0.5 * self.arrays.reach);
            // As `ScanArrays::obstacle_reach`, with the thickness of a disc.
            let reaches = discs.select(cells.max(of_discs * (1.0 + THICKNESS)), balls);
            return Parts { radii, reaches, slabs: local * self.slab, cells, discs };
        }
        let (mut radii, mut reaches, mut slabs) = ([0.0; WIDTH], [0.0; WIDTH], [0.0; WIDTH]);
        let (mut cells, mut discs) = ([0.0; WIDTH], 0_u64);
        for (lane, i) in (first..first + count).enumerate() {
            radii[lane] = self.radius(i);
            reaches[lane] = self.arrays.obstacle_reach(i);
            slabs[lane] = self.slab * self.arrays.radii[i];
            cells[lane] = self.arrays.cell_radius(i);
            discs |= u64::from(self.is_disc(i)) << lane;
        }
        Parts {
            radii: f32x16::load_array_ref(simd, &radii),
            reaches: f32x16::load_array_ref(simd, &reaches),
            slabs: f32x16::load_array_ref(simd, &slabs),
            cells: f32x16::load_array_ref(simd, &cells),
            discs: mask32x16::from_bitmask(simd, discs),
        }
    }

    /// The first `count` lanes that are not further than `most`.
    #[inline(always)]
    pub(crate) fn lanes_within<S: Simd>(simd: S, (gaps, count): (&[f32; WIDTH], usize), most: f32) -> u32 {
        // Not `<=`, which would be false for NaN.
        let beyond: mask32x16<S> = f32x16::load_array_ref(simd, gaps).simd_gt(most);
        !bits(beyond) & ((1 << count) - 1)
    }

    /// A point in the world.
    pub(crate) fn in_world(&self, x: &Vector) -> [f64; 3] {
        self.placed.stored_to_world().apply((*x).into())
    }

    /// A direction in the world.
    pub(crate) fn turned(&self, n: &Vector) -> [f64; 3] {
        self.placed.stored_to_world().rotate((*n).into())
    }

    /// The evidence for a separation in which no enclosure was within reach.
    pub(crate) fn of_separation(&self, is_doubtful: bool) -> Evidence {
        let is_proven = !is_doubtful && (self.certifies || matches!(self.semantics, Semantics::Thickened(_)));
        if is_proven { Evidence::Certified } else { Evidence::Estimated }
    }
}
