//! Oriented boxes, and whether two of them in relative motion overlap.
//!
//! The separating-axis test of Gottschalk, Lin & Manocha ("OBBTree", SIGGRAPH 1996) with the six face normals
//! only: the nine edge axes exclude few further pairs of thin patches and cost more than they save
//! (benches/record).

use bytemuck::{Pod, Zeroable};
use nearmiss_geometry::Pose;
use nearmiss_geometry::nalgebra::Vector3;

type Axes = [[f32; 3]; 3];

/// A box about `centre` with half edge lengths `half` along the orthonormal `axes`.
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
#[repr(C)]
pub struct OrientedBox {
    /// The middle.
    pub centre: [f32; 3],
    /// Half the edge lengths.
    pub half: [f32; 3],
    /// Unit directions of the edges, a right-handed frame.
    pub axes: Axes,
}

/// What rounding can do to a coordinate of a box, relative to the largest number involved.
const ROUNDING: f32 = 1e-6;

impl OrientedBox {
    /// The least box along `axes` that contains all `intervals`, given per axis; grown by what rounding may
    /// have cost.
    pub(crate) fn spanned(axes: Axes, low: [f32; 3], high: [f32; 3]) -> Self {
        let middle = [0, 1, 2].map(|k| 0.5 * low[k] + 0.5 * high[k]);
        let reach = (0..3).fold(0.0_f32, |m, k| m.max(low[k].abs()).max(high[k].abs()));
        let centre =
            [0, 1, 2].map(|k| middle[0] * axes[0][k] + middle[1] * axes[1][k] + middle[2] * axes[2][k]);
        let half = [0, 1, 2].map(|k| 0.5 * high[k] - 0.5 * low[k] + ROUNDING * reach);
        Self { centre, half, axes }
    }

    /// Squared distance of `p` from the box, 0 inside.
    #[inline]
    #[must_use]
    pub fn distance_sq(&self, p: [f32; 3]) -> f32 {
        let d = sub(p, self.centre);
        let beyond = [0, 1, 2].map(|k| (dot(self.axes[k], d).abs() - self.half[k]).max(0.0));
        dot(beyond, beyond)
    }

    /// Distance from the centre to a corner.
    #[must_use]
    pub fn radius(&self) -> f32 {
        dot(self.half, self.half).sqrt()
    }
}

/// The motion of one scan's stored frame into another's, in single precision for the hot path, with a bound on
/// what rounding costs there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Relative {
    /// Rows of scale · rotation.
    linear: Axes,
    /// Rows of the rotation.
    rotation: Axes,
    translation: [f32; 3],
    scale: f32,
    slack: f32,
}

impl Relative {
    /// The motion `pose` from b's stored frame to a's; `reach` bounds the coordinates of both in a's frame.
    #[must_use]
    #[expect(clippy::cast_possible_truncation, reason = "slack covers the rounding")]
    pub fn new(pose: &Pose, reach: f64) -> Self {
        let r = pose.rotation();
        let rotation = [0, 1, 2].map(|i| [0, 1, 2].map(|j| r[(i, j)] as f32));
        let scale = pose.scale() as f32;
        Self {
            linear: rotation.map(|row| row.map(|x| x * scale)),
            rotation,
            translation: pose.translation().map(|x| x as f32),
            scale,
            slack: ROUNDING * reach as f32,
        }
    }

    /// A point of b's frame in a's.
    #[inline]
    #[must_use]
    pub fn point(&self, p: [f32; 3]) -> [f32; 3] {
        [0, 1, 2].map(|i| dot(self.linear[i], p) + self.translation[i])
    }

    /// A direction of b's frame in a's.
    #[inline]
    #[must_use]
    pub fn direction(&self, v: [f32; 3]) -> [f32; 3] {
        self.rotation.map(|row| dot(row, v))
    }

    /// Length in a's frame of a unit of b's.
    #[inline]
    #[must_use]
    pub fn scale(&self) -> f32 {
        self.scale
    }

    /// A bound on the error of a transformed coordinate.
    #[inline]
    #[must_use]
    pub fn slack(&self) -> f32 {
        self.slack
    }

    /// How far the boxes `a` and `b` are apart along the face normal that parts them most; negative when they
    /// overlap along all six. A positive value, less [`Relative::slack`], is a lower bound of their distance.
    #[inline]
    #[must_use]
    pub fn gap(&self, a: &OrientedBox, b: &OrientedBox) -> f32 {
        let d = sub(self.point(b.centre), a.centre);
        let half_b = b.half.map(|h| h * self.scale);
        let axes_b = b.axes.map(|e| self.direction(e));
        let mut gap = f32::MIN;
        let mut spread_b = [0.0_f32; 3];
        for i in 0..3 {
            let cosines = axes_b.map(|e| dot(a.axes[i], e).abs());
            let reach = dot(half_b, cosines);
            gap = gap.max(dot(a.axes[i], d).abs() - a.half[i] - reach);
            for j in 0..3 {
                spread_b[j] += a.half[i] * cosines[j];
            }
        }
        for j in 0..3 {
            gap = gap.max(dot(axes_b[j], d).abs() - half_b[j] - spread_b[j]);
        }
        gap
    }
}

/// The stored frame of a scan in the world, as a pose.
pub(crate) fn placed(frame: &nearmiss_geometry::Frame, pose: &Pose) -> Pose {
    pose.after(
        &Pose::IDENTITY
            .with_scale(frame.scale)
            .with_translation(frame.origin),
    )
}

#[inline]
pub(crate) fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline]
pub(crate) fn sub(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// Three unit vectors in single precision.
#[expect(clippy::cast_possible_truncation, reason = "box axes are single precision")]
pub(crate) fn to_axes(vectors: [[f64; 3]; 3]) -> Axes {
    vectors.map(|v| Vector3::from(v).normalize().map(|x| x as f32).into())
}
