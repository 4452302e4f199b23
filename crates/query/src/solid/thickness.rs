//! Bounds on how thick a shape is, in closed form.

use nearmiss_geometry::nalgebra::Vector3;

use crate::solid::core::Solid;

type Vector = Vector3<f64>;

impl Solid<'_> {
    /// Half the length of a line about [`Self::inside`] in the shape, at least, in each plane through it.
    pub(crate) fn width(&self) -> f64 {
        let is_even = self.round_ends().is_some_and(|[below, above]| below == above);
        if self.is_box() || is_even {
            // A plane crosses the rectangle that the two longer axes span.
            let [x, y, z] = self.half.into();
            return self.radius + x.min(y).max(x.max(y).min(z));
        }
        self.depth(&self.inside).map_or(0.0, |(depth, _)| depth)
    }

    /// A lower bound on how far the shape reaches from `x` in a unit direction. Negative where `x` is
    /// outside, and for shapes other than spheres, capsules, boxes and cylinders.
    pub(crate) fn reach(&self, x: &Vector, way: &Vector) -> f64 {
        let from = x - self.centre;
        let [at, rise] = [&from, way].map(|v| self.axes.map(|axis| axis.dot(v)));
        // How far the place is from where a line in the direction leaves the core's box along an axis.
        let leaves = |k: usize| match rise[k].abs() {
            ..1e-9 => f64::INFINITY,
            speed => (self.half[k] - at[k] * rise[k].signum()) / speed,
        };
        let beyond = [0, 1, 2].map(|k| (at[k].abs() - self.half[k]).max(0.0));
        let is_within = beyond.iter().all(|&off| off <= 0.0);
        if self.is_box() {
            return self.radius
                + if is_within {
                    (0..3).map(leaves).fold(f64::INFINITY, f64::min)
                } else {
                    -Vector::from(beyond).norm()
                };
        }
        let Some([below, above]) = self.round_ends() else { return f64::NEG_INFINITY };
        let within_sq = below * below - at[0] * at[0] - at[2] * at[2];
        if below != above || !is_within || within_sq < 0.0 {
            return f64::NEG_INFINITY;
        }
        let along = at[0] * rise[0] + at[2] * rise[2];
        let speed_sq = rise[0] * rise[0] + rise[2] * rise[2];
        let side = match speed_sq {
            ..1e-18 => f64::INFINITY,
            _ => ((along * along + speed_sq * within_sq).sqrt() - along) / speed_sq,
        };
        self.radius + side.min(leaves(1))
    }
}
