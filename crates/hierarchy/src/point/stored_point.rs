//! A single stored point with all that a comparison of two points needs.

use crate::point::kind::PointKind;

/// A stored point of a scan; lengths in the stored frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StoredPoint {
    /// The position.
    pub position: [f32; 3],
    /// The unit normal, of arbitrary sign until normals are oriented.
    pub normal: [f32; 3],
    /// The kind.
    pub kind: PointKind,
    /// The local sampling radius.
    pub radius: f32,
    /// The radius of the tangent disc.
    pub disc: f32,
    /// The radius of the ball that represents the point in the obstacle; zero on sheets.
    pub ball: f32,
    /// `true` if the obstacle represents the point by the sheet that it samples.
    pub is_on_sheet: bool,
    /// The distance from a point on a sheet up to which the surface belongs to the obstacle.
    pub cell: f32,
}
