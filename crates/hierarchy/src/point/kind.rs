//! Kinds of points, and the shape that represents a point of each kind in the obstacle.

use serde::{Deserialize, Serialize};

/// The thickness of discs, as a share of their radius. Parallel discs nearer than this share of the
/// smaller radius touch: to first order a grazing sheet cannot be told from one in the same place.
/// Boxes are wider than the discs by as much.
pub const THICKNESS: f32 = 0.05;

/// Half the thickness of a sheet at a point, as a multiple of its local radius. The surface nearest
/// to the point, and a noisy point of the same sheet, are no further from its tangent plane. A
/// curvature of 0.6 over the local radius rises this far over one local radius; two standard
/// deviations of a noise of a fifth of the spacing do too.
pub const SLAB: f32 = 0.3;

/// The class of a point, by the arrangement of the points around it (`docs/theory/obstacle.md`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[repr(u8)]
#[non_exhaustive]
pub enum PointKind {
    /// On one sheet: the tangent disc represents the surface around the point.
    Sheet = 0,
    /// At or beyond the border of a sheet; its disc is narrower.
    Edge = 1,
    /// No single plane fits: noise, foliage, or several sheets closer than the bandwidth.
    Noisy = 2,
    /// On a line, such as a LiDAR ring or a wire.
    Line = 3,
    /// Isolated: fewer neighbours within its support radius than the surface needs.
    Stray = 4,
    /// With neighbours further away than the scan's [reach](crate::PointHierarchy::reach).
    Sparse = 5,
}

impl PointKind {
    /// All kinds, in the order of their codes.
    pub const ALL: [Self; 6] = [Self::Sheet, Self::Edge, Self::Noisy, Self::Line, Self::Stray, Self::Sparse];

    /// Returns the kind stored as `code`; an unknown code is [`Self::Noisy`].
    #[must_use]
    pub const fn from_code(code: u8) -> Self {
        match code {
            0 => Self::Sheet,
            1 => Self::Edge,
            3 => Self::Line,
            4 => Self::Stray,
            5 => Self::Sparse,
            _ => Self::Noisy,
        }
    }

    /// The greatest code of a kind.
    pub(crate) const LAST: u8 = Self::Sparse.code();

    /// Returns `true` if too little is known about the point to trust its disc. There is some
    /// surface within about a local radius.
    #[inline]
    #[must_use]
    pub const fn is_sparse(self) -> bool {
        matches!(self, Self::Line | Self::Stray | Self::Sparse)
    }

    /// Returns `true` if the point samples a sheet, so that its tangent disc represents it in the
    /// obstacle. All other points are represented by balls.
    #[inline]
    #[must_use]
    pub const fn is_sheet(self) -> bool {
        matches!(self, Self::Sheet | Self::Edge)
    }

    /// Returns the code that the kind is stored as.
    #[must_use]
    pub const fn code(self) -> u8 {
        self as u8
    }
}

/// See [`crate::ScanArrays::obstacle_reach`]; for points on a sheet.
#[inline]
pub(crate) fn sheet_reach(radius: f32, disc: f32, reach: f32) -> f32 {
    cell_radius(radius, reach).max(disc * DISC_REACH)
}

/// See [`crate::ScanArrays::cell_radius`].
#[inline]
pub(crate) fn cell_radius(radius: f32, reach: f32) -> f32 {
    radius.min(0.5 * reach)
}

/// The distance from the centre to the rim of a disc with its thickness, in disc radii.
const DISC_REACH: f32 = 1.0 + THICKNESS;

/// The radius of the ball of a noisy point, in local radii: half the radius of a disc in the
/// interior of a sheet. The nearest neighbour is 0.36 local radii away on average, so such balls
/// overlap.
const BALL_AMONG_OTHERS: f32 = 0.325;

/// The radius of the ball of any other point, in local radii. It is the greatest radius with which
/// the centres of two touching balls are no further apart than the greater of their local radii.
const BALL_OF_SPARSE: f32 = 0.5;

/// See [`crate::ScanArrays::obstacle_ball`].
#[inline]
pub(crate) fn obstacle_ball(i: usize, dense: usize, kind: PointKind, radius: f32) -> f32 {
    if is_on_sheet(i, dense, kind) { 0.0 } else { ball_share(kind) * radius }
}

/// Returns the radius of the ball of a point that is not on a sheet, in local radii.
pub(crate) const fn ball_share(kind: PointKind) -> f32 {
    if kind.is_sparse() { BALL_OF_SPARSE } else { BALL_AMONG_OTHERS }
}

/// See [`crate::ScanArrays::is_on_sheet`].
#[inline]
pub(crate) fn is_on_sheet(i: usize, dense: usize, kind: PointKind) -> bool {
    i < dense && kind.is_sheet()
}

/// See [`crate::ScanArrays::ball`].
#[inline]
pub(crate) fn ball(kind: PointKind, radius: f32, sampling_radius: f32) -> f32 {
    if kind.is_sparse() { radius.min(sampling_radius) } else { 0.0 }
}
