//! Tangent discs ("surfels"): what each point says of the surface to first order.
//!
//! A point's normal is that of the weighted least-squares fit at the point itself. Its disc is as wide as it
//! must be for the discs of neighbours to close the surface, and narrower at a border, which shows as a wide
//! sector of the tangent plane without a neighbour: the discs of two scans whose borders face each other a
//! sampling radius apart must not meet.

use bytemuck::{Pod, Zeroable};
use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x16, i32x16, mask32x16};
use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_surface::{
    Centre, Evaluation, HalfBlock, Moments, PointBlock, Status, SurfacePlan, symmetric_eigen,
};
use serde::{Deserialize, Serialize};

use crate::boxes::{OrientedBox, dot};
use crate::build::ball;
use crate::covering::Solid;
use crate::enclosure::{Cell, LeafBounds, Surroundings};
use crate::gather::Index;
use crate::lanes::{along, product, seen_from};
use crate::neighbours::{Locality, chunks};
use crate::spacing::{Look, Spacing};
use crate::topology::Node;

/// Disc radius over local sampling radius in the interior. The sixth neighbour is √2 spacings away on a square
/// lattice, whose covering radius is 1/√2 spacings, 0.5; on a triangular one 1 and 1/√3, 0.58.
const DISC: f32 = 0.65;

/// Disc radius over local sampling radius at a border. Local radii grow there, to some 1.3 times those inside,
/// and two discs must not bridge a sampling radius.
const DISC_AT_BORDER: f32 = 0.35;

/// Sectors into which the tangent plane is divided, equal on a diamond: of 11 to 18 degrees.
const SECTORS: u32 = 24;

/// So many empty sectors side by side occur in the interior, even of random samples.
const INTERIOR_GAP: u32 = 6;

/// So many mean a border: about 135 degrees. A straight one leaves 180, a right-angled notch 90.
const BORDER_GAP: u32 = 9;

/// Parallel discs nearer than this share of the smaller radius touch: to first order nothing tells a sheet
/// that grazes another from one that lies on it. Boxes are that much wider than the discs.
pub const THICKNESS: f32 = 0.05;

/// λ2 < 0.05 λ3: the neighbourhood is a line, its normal any direction across.
const LINE: f64 = 0.05;

/// What the neighbourhood of a point looks like.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[repr(u8)]
#[non_exhaustive]
pub enum PointKind {
    /// One sheet: the disc is to be trusted.
    Surface = 0,
    /// At or beyond the border of its surface.
    Border = 1,
    /// No single plane fits: two sheets, an edge of several, or a blob.
    Ambiguous = 2,
    /// A line, as along one LiDAR ring.
    Line = 3,
    /// Too few neighbours.
    Isolated = 4,
}

impl PointKind {
    /// The kind stored as `code`; anything unknown is ambiguous.
    #[must_use]
    pub const fn from_code(code: u8) -> Self {
        match code {
            0 => Self::Surface,
            1 => Self::Border,
            3 => Self::Line,
            4 => Self::Isolated,
            _ => Self::Ambiguous,
        }
    }

    /// The greatest number that a kind is stored as.
    pub(crate) const LAST: u8 = Self::Isolated.code();
    /// Whether too little is known about the point for its disc to be trusted: there is some surface within about
    /// a local radius.
    #[inline]
    #[must_use]
    pub const fn is_sparse(self) -> bool {
        matches!(self, Self::Line | Self::Isolated)
    }

    /// The number it is stored as.
    #[must_use]
    pub const fn code(self) -> u8 {
        self as u8
    }
}

/// The directions of a leaf's normals, up to sign: all within the angle of `cosine` of `axis` or of −`axis`.
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
#[repr(C)]
pub struct NormalCone {
    /// Unit; its largest component is positive.
    pub axis: [f32; 3],
    /// Cosine of the half angle, 0 to 1.
    pub cosine: f32,
}

/// A point's disc.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Surfel {
    pub(crate) normal: [f32; 3],
    pub(crate) disc: f32,
    pub(crate) kind: PointKind,
    /// Where the surface nearest to the point is.
    pub(crate) cell: Cell,
}

/// The discs of all points as arrays, and the bounds of all leaves.
#[derive(Debug)]
pub(crate) struct Surfels {
    pub(crate) normals: Vec<[f32; 3]>,
    pub(crate) discs: Vec<f32>,
    pub(crate) kinds: Vec<u8>,
    /// See [`Slices::ball`](crate::Slices::ball).
    pub(crate) balls: Vec<f32>,
    /// About the disc and the ball of each point.
    pub(crate) flat: Vec<Solid>,
    /// About its cell as well.
    pub(crate) cells: Vec<Solid>,
    pub(crate) leaves: Vec<LeafBounds>,
}

impl Surfels {
    fn with_capacity(points: usize) -> Self {
        Self {
            normals: Vec::with_capacity(points),
            discs: Vec::with_capacity(points),
            kinds: Vec::with_capacity(points),
            balls: Vec::with_capacity(points),
            flat: Vec::with_capacity(points),
            cells: Vec::with_capacity(points),
            leaves: Vec::new(),
        }
    }

    fn push(&mut self, surfel: &Surfel, ball: f32) {
        let solid = Solid::of_disc(surfel.disc, ball);
        self.normals.push(surfel.normal);
        self.discs.push(surfel.disc);
        self.kinds.push(surfel.kind.code());
        self.balls.push(ball);
        self.flat.push(solid);
        self.cells.push(Solid::of_cell(&surfel.cell, solid));
    }
}

/// Reused from leaf to leaf.
#[derive(Debug)]
struct LeafScratch {
    level: Level,
    locality: Locality,
    surroundings: Surroundings,
    /// The blocks that are heard at a point.
    near: Vec<u32>,
    halves: Vec<HalfBlock>,
    fits: Vec<Moments>,
}

impl Default for LeafScratch {
    fn default() -> Self {
        Self {
            level: Level::new(),
            locality: Locality::default(),
            surroundings: Surroundings::default(),
            near: Vec::new(),
            halves: Vec::new(),
            fits: Vec::new(),
        }
    }
}

/// The discs of all points and the bounds of all leaves, in order.
pub(crate) fn surfels(
    index: &Index<'_>,
    positions: &[[f32; 3]],
    radii: &[f32],
    (spacings, ordinary): (&[Spacing], f32),
) -> Surfels {
    let leaf = |(node, about): (&Node, &'_ OrientedBox)| (node.points(), *about);
    let leaves: Vec<_> =
        index.nodes.iter().zip(index.boxes).filter(|(node, _)| node.is_leaf()).map(leaf).collect();
    let parts = chunks(&leaves, |leaves| {
        let (mut scratch, mut surfels) = (LeafScratch::default(), Vec::new());
        let bounds = leaves
            .iter()
            .map(|(points, about)| {
                let leaf = Leaf {
                    positions: &positions[points.clone()],
                    radii: &radii[points.clone()],
                    spacings: &spacings[points.clone()],
                    about,
                    ordinary,
                };
                leaf.surfels(index, &mut scratch, &mut surfels)
            })
            .collect::<Vec<_>>();
        (surfels, bounds)
    });
    let mut all = Surfels::with_capacity(positions.len());
    let mut radii = radii.iter();
    for (surfels, leaves) in parts {
        for (surfel, &radius) in surfels.iter().zip(&mut radii) {
            all.push(surfel, ball(surfel.kind, radius, ordinary));
        }
        all.leaves.extend(leaves);
    }
    all
}

/// The points of a leaf, and what of them is known already.
#[derive(Debug, Clone, Copy)]
struct Leaf<'a> {
    pub(crate) positions: &'a [[f32; 3]],
    pub(crate) radii: &'a [f32],
    pub(crate) spacings: &'a [Spacing],
    pub(crate) about: &'a OrientedBox,
    /// The scan's sampling radius.
    pub(crate) ordinary: f32,
}

impl Leaf<'_> {
    /// The discs of the points, and bounds of their part of the surface.
    pub(crate) fn surfels(
        &self,
        index: &Index<'_>,
        scratch: &mut LeafScratch,
        surfels: &mut Vec<Surfel>,
    ) -> LeafBounds {
        let (level, first) = (scratch.level, surfels.len());
        dispatch!(level, simd => self.fit(simd, index, scratch, surfels));
        let surfels = &mut surfels[first..];
        dispatch!(level, simd => self.look_about(simd, index, scratch, surfels))
    }

    /// The surface at every point.
    #[inline(always)]
    fn fit<S: Simd>(&self, simd: S, index: &Index<'_>, scratch: &mut LeafScratch, surfels: &mut Vec<Surfel>) {
        simd.vectorize(
            #[inline(always)]
            || {
                let LeafScratch { locality, near, halves, fits, .. } = scratch;
                // Radii grow by at most 0.3 per length, and few as fast.
                locality.collect(simd, index, self.positions, self.about.centre, 1.3 * self.about.reach);
                fits.clear();
                for p in self.positions {
                    let x = Centre::new(p.map(f64::from));
                    fits.push(index.moments(simd, &x, &locality.groups, near, halves));
                }
                Moments::evaluate_all(simd, index.plan, self.positions, fits, |i, at| {
                    surfels.push(surfel(
                        &at,
                        index.plan,
                        self.radii[i],
                        self.spacings[i].look == Look::Line,
                        self.ordinary,
                    ));
                });
            },
        );
    }

    /// Narrows the discs at borders, and bounds the surface about them.
    #[inline(always)]
    fn look_about<S: Simd>(
        &self,
        simd: S,
        index: &Index<'_>,
        scratch: &mut LeafScratch,
        surfels: &mut [Surfel],
    ) -> LeafBounds {
        simd.vectorize(
            #[inline(always)]
            || {
                let LeafScratch { locality, surroundings, near, .. } = scratch;
                surroundings.fill(index, self.positions[0], locality);
                let mut cells = LeafBounds::new(simd, self.positions, self.about, surroundings).cells();
                for ((p, radius), surfel) in self.positions.iter().zip(self.radii).zip(surfels) {
                    let near = index.heard(simd, &locality.groups, *p, 0.0, near);
                    let blocks = || near.iter().map(|&block| &index.blocks[block as usize]);
                    let gap = widest_gap(simd, *p, surfel.normal, blocks());
                    surfel.disc = surfel.disc.min(radius * disc(gap));
                    surfel.cell = surroundings.cell(simd, *p, surfel.normal, *radius, blocks());
                    cells.include(*p, surfel.normal, &surfel.cell);
                }
                cells.close()
            },
        )
    }
}

/// The disc of a point at which f is `at`, as if it were in the interior, without its cell.
fn surfel(at: &Evaluation, plan: &SurfacePlan, radius: f32, is_line: bool, ordinary: f32) -> Surfel {
    #[expect(clippy::cast_possible_truncation, reason = "stored in single precision")]
    let normal = at.normal.map(|c| c as f32);
    let kind = kind(at, is_line);
    // What is further than an ordinary horizon from all points is no surface (S0 eq. 6) but a hole, however sparse
    // the points about it; what a lone point knows of ends with its ball.
    let widest = if kind.is_sparse() { ordinary } else { plan.horizon(ordinary) };
    Surfel { normal, disc: (radius * DISC).min(widest), kind, cell: Cell::default() }
}

/// The disc of the point `p` at which f is `at`, narrowed where the sectors about it are empty of the points in `near`, those
/// that are heard there.
pub(crate) fn surfel_among(
    p: [f32; 3],
    at: &Evaluation,
    (plan, radius, ordinary): (&SurfacePlan, f32, f32),
    is_line: bool,
    near: &[PointBlock],
) -> Surfel {
    let mut surfel = surfel(at, plan, radius, is_line, ordinary);
    let gap = dispatch!(Level::new(), simd => simd.vectorize(
        #[inline(always)]
        || widest_gap(simd, p, surfel.normal, near.iter()),
    ));
    surfel.disc = surfel.disc.min(radius * disc(gap));
    surfel
}

/// The radius of a disc over the local sampling radius, given how many sectors beside each other are empty.
fn disc(gap: u32) -> f32 {
    let gap = gap.clamp(INTERIOR_GAP, BORDER_GAP) - INTERIOR_GAP;
    #[expect(clippy::cast_precision_loss, reason = "a small number")]
    let border = gap as f32 / (BORDER_GAP - INTERIOR_GAP) as f32;
    DISC - (DISC - DISC_AT_BORDER) * border
}

/// The greatest number of neighbouring sectors of the tangent plane in which no point lies that is heard at `p`; such points are
/// in the blocks `near`.
#[inline(always)]
fn widest_gap<'a, S: Simd>(
    simd: S,
    p: [f32; 3],
    normal: [f32; 3],
    near: impl Iterator<Item = &'a PointBlock>,
) -> u32 {
    let (u, v) = tangents(normal);
    let mut taken = i32x16::splat(simd, 0);
    for block in near {
        let d = seen_from(simd, block, p);
        let (x, y) = (along(d, u), along(d, v));
        let length = x.abs() + y.abs();
        // The angle of the diamond |x| + |y| = 1, 0 to 4: a quarter turn each 1, without trigonometry.
        let share = x / length;
        let quarter = simd.select_f32x16(y.simd_ge(0.0), -(share - 1.0), share + 3.0);
        let turn = quarter * (SECTORS as f32 / 4.0);
        let sector = simd.select_f32x16(turn.simd_lt(SECTORS as f32), turn, f32x16::splat(simd, 0.0));
        let horizon = f32x16::load_array_ref(simd, &block.horizon);
        let counts: mask32x16<S> = product(d, d).simd_lt(horizon * horizon) & length.simd_gt(0.0);
        taken |= simd.select_i32x16(counts, bit(sector), i32x16::splat(simd, 0));
    }
    let taken = taken.to_array().into_iter().fold(0, |all, bits| all | u64::from(bits.cast_unsigned()));
    // Twice round, so that a run across the start counts whole.
    let round = taken | taken << SECTORS;
    // Runs of k are left where k − 1 more follow.
    let (mut runs, mut widest) = (!round & ((1 << (2 * SECTORS)) - 1), 0);
    while runs != 0 {
        runs &= runs >> 1;
        widest += 1;
    }
    widest.min(SECTORS)
}

/// The bit of each number from 0 to 30, rounded down: two to its power, made as a floating-point number.
#[inline(always)]
fn bit<S: Simd>(number: f32x16<S>) -> i32x16<S> {
    const ONE: i32 = 127;
    const DIGITS: u32 = 23;
    let exponent = i32x16::truncate_from(number) + ONE;
    let power: f32x16<S> = (exponent << DIGITS).bitcast();
    i32x16::truncate_from(power)
}

/// Two unit vectors that complete `normal` to a right-handed frame (Duff et al., "Building an orthonormal
/// basis, revisited", JCGT 6(1), 2017).
pub(crate) fn tangents([x, y, z]: [f32; 3]) -> ([f32; 3], [f32; 3]) {
    let sign = 1.0_f32.copysign(z);
    let a = -1.0 / (sign + z);
    let b = x * y * a;
    ([1.0 + sign * x * x * a, sign * b, -sign * x], [b, sign + y * y * a, -y])
}

fn kind(at: &Evaluation, is_line: bool) -> PointKind {
    let [_, l2, l3] = at.eigenvalues;
    match at.status {
        Status::Outside => PointKind::Isolated,
        _ if is_line || l2 < LINE * l3 => PointKind::Line,
        Status::Ok => PointKind::Surface,
        Status::Border => PointKind::Border,
        _ => PointKind::Ambiguous,
    }
}

/// The cone of a leaf's `normals`, each of which is turned to the axis' side.
pub(crate) fn align(normals: &mut [[f32; 3]]) -> NormalCone {
    let cone = cone(normals);
    for n in normals {
        if dot(*n, cone.axis) < 0.0 {
            *n = n.map(|x| -x);
        }
    }
    cone
}

/// The cone of a leaf's `normals`, of any sign.
pub(crate) fn cone(normals: &[[f32; 3]]) -> NormalCone {
    let mut s = [0.0_f64; 6];
    for n in normals {
        let [x, y, z] = n.map(f64::from);
        for (sum, v) in s.iter_mut().zip([x * x, x * y, x * z, y * y, y * z, z * z]) {
            *sum += v;
        }
    }
    let main = Vector3::from(symmetric_eigen(s).vectors[2]);
    let largest = main.iter().fold(0.0_f64, |m, x| if x.abs() > m.abs() { *x } else { m });
    #[expect(clippy::cast_possible_truncation, reason = "stored in single precision")]
    let axis: [f32; 3] = (main * largest.signum()).map(|c| c as f32).into();
    let cosine = normals.iter().fold(1.0_f32, |least, n| least.min(dot(*n, axis).abs()));
    NormalCone { axis, cosine }
}

pub(crate) fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
