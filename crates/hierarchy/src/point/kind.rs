//! Kinds of points, and what stands for a point of each kind in the obstacle.

use serde::{Deserialize, Serialize};

/// Parallel discs nearer than this share of the smaller radius touch: to first order nothing tells a sheet
/// that grazes another from one that lies on it. Boxes are that much wider than the discs.
pub const THICKNESS: f32 = 0.05;

/// Half the thickness of a sheet at a point, in its local radius: the surface nearest to the point, and a
/// noisy point of the same sheet, lie no further from its tangent plane. A curvature of 0.6 over the local
/// radius rises so far at its distance, and so do two standard deviations of a noise of a fifth of the
/// spacing.
pub const SLAB: f32 = 0.3;

/// How the points about a point lie: its class (`docs/theory/obstacle.md`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[repr(u8)]
#[non_exhaustive]
pub enum PointKind {
    /// On one sheet: its tangent disc stands for the surface about it.
    Sheet = 0,
    /// At or beyond the border of a sheet; its disc is narrower.
    Edge = 1,
    /// No single plane fits: noise, foliage, or several sheets closer than the bandwidth.
    Noisy = 2,
    /// On a line, as along one LiDAR ring or a wire.
    Line = 3,
    /// Alone: fewer neighbours within its support radius than the surface needs.
    Stray = 4,
    /// Its neighbours are further away than the scan's [reach](crate::PointHierarchy::reach).
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

    /// Returns `true` if so little is known about the point that its disc is not to be trusted: some surface
    /// lies within about a local radius.
    #[inline]
    #[must_use]
    pub const fn is_sparse(self) -> bool {
        matches!(self, Self::Line | Self::Stray | Self::Sparse)
    }

    /// Returns `true` if the point samples a sheet, so that its tangent disc stands for it in the
    /// obstacle. All other points stand there as balls.
    #[inline]
    #[must_use]
    pub const fn is_sheet(self) -> bool {
        matches!(self, Self::Sheet | Self::Edge)
    }

    /// Returns the number that the kind is stored as.
    #[must_use]
    pub const fn code(self) -> u8 {
        self as u8
    }
}

/// See [`crate::Slices::obstacle_reach`]: that of a point on a sheet.
#[inline]
pub(crate) fn sheet_reach(radius: f32, disc: f32, reach: f32) -> f32 {
    cell_radius(radius, reach).max(disc * DISC_REACH)
}

/// See [`crate::Slices::cell_radius`].
#[inline]
pub(crate) fn cell_radius(radius: f32, reach: f32) -> f32 {
    radius.min(0.5 * reach)
}

/// How far a disc with its thickness reaches, in its radius.
const DISC_REACH: f32 = 1.0 + THICKNESS;

/// The ball of a point that has others all around, in its local radius: half the radius of a disc of a sheet.
/// The nearest neighbour is 0.36 local radii away on average, so such balls overlap.
const BALL_AMONG_OTHERS: f32 = 0.325;

/// The ball of any other point. Half the local radius is the most at which the centres of two balls that
/// touch are no further apart than the greater of their local radii.
const BALL_OF_SPARSE: f32 = 0.5;

/// See [`crate::Slices::obstacle_ball`].
#[inline]
pub(crate) fn obstacle_ball(i: usize, dense: usize, kind: PointKind, radius: f32) -> f32 {
    if is_on_sheet(i, dense, kind) { 0.0 } else { ball_share(kind) * radius }
}

/// The ball of a point that is on no sheet, in its local radius.
pub(crate) const fn ball_share(kind: PointKind) -> f32 {
    if kind.is_sparse() { BALL_OF_SPARSE } else { BALL_AMONG_OTHERS }
}

/// See [`crate::Slices::is_on_sheet`].
#[inline]
pub(crate) fn is_on_sheet(i: usize, dense: usize, kind: PointKind) -> bool {
    i < dense && kind.is_sheet()
}

/// See [`crate::Slices::ball`].
#[inline]
pub(crate) fn ball(kind: PointKind, radius: f32, sampling_radius: f32) -> f32 {
    if kind.is_sparse() { radius.min(sampling_radius) } else { 0.0 }
}
