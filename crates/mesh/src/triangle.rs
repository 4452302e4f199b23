//! A triangle in the frame of its longest side, and its sampling in rows.

/// The corners of a triangle. Corners may coincide or lie on a line.
pub type Corners = [[f64; 3]; 3];

/// A triangle in a frame whose first axis runs along the longest side, the base. The tip is above
/// the base.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Triangle {
    corner: [f64; 3],
    /// Unit directions along the longest side and away from it, in the triangle's plane.
    axes: [[f64; 3]; 2],
    base: f64,
    /// Distance from `corner` to the foot of the height, along the base.
    foot: f64,
    height: f64,
}

impl Triangle {
    pub(crate) fn new(corners: [[f64; 3]; 3]) -> Self {
        let side = |i: usize| length(between(corners[i], corners[(i + 1) % 3]));
        let sides = [side(0), side(1), side(2)];
        let longest = (0..3).fold(0, |best, i| if sides[i] > sides[best] { i } else { best });
        let [a, b, tip] = [0, 1, 2].map(|k| corners[(longest + k) % 3]);
        let base = sides[longest];
        let along = unit(between(a, b), base);
        let to_tip = between(a, tip);
        let foot = dot(to_tip, along).clamp(0.0, base);
        let away = [0, 1, 2].map(|k| to_tip[k] - foot * along[k]);
        let height = length(away);
        Self { corner: a, axes: [along, unit(away, height)], base, foot, height }
    }

    /// Returns the length of the longest side.
    pub(crate) fn base(&self) -> f64 {
        self.base
    }

    pub(crate) fn area(&self) -> f64 {
        0.5 * self.base * self.height
    }

    /// Returns the point at `x` along the base and `y` above it.
    fn at(&self, [x, y]: [f64; 2]) -> [f64; 3] {
        [0, 1, 2].map(|k| self.corner[k] + x * self.axes[0][k] + y * self.axes[1][k])
    }

    /// Maps two fractions from 0 to 1 to a point of the triangle. Uniform fractions give uniform
    /// points.
    pub(crate) fn spread(&self, [s, t]: [f64; 2]) -> [f64; 3] {
        // Rows are wider further from the tip.
        let from_tip = s.sqrt();
        let y = (1.0 - from_tip) * self.height;
        let [left, right] = self.row(y);
        self.at([left + t * (right - left), y])
    }

    /// Returns the interval along the base that the triangle covers at height `y`.
    fn row(&self, y: f64) -> [f64; 2] {
        let up = if self.height > 0.0 { y / self.height } else { 0.0 };
        [up * self.foot, self.base + up * (self.foot - self.base)]
    }

    /// Returns an estimate of the number of points from [`Self::rows`].
    pub(crate) fn count(&self, step: f64) -> f64 {
        (self.base / step + 1.0) * (self.height / step + 1.0)
    }

    /// Calls `each` with points in rows along the base. Points and rows are at most `step` apart
    /// and include corners and sides.
    ///
    /// No point of the triangle is further than √5/2 steps from a sample. The row below the point
    /// is at most a step away. It extends at least as far to both sides, because the angles at the
    /// longest side are at most right.
    pub(crate) fn rows(&self, step: f64, mut each: impl FnMut([f64; 3])) {
        let rows = (self.height / step).ceil();
        for i in whole(rows) {
            let y = if rows > 0.0 { i / rows * self.height } else { 0.0 };
            let [left, right] = self.row(y);
            let places = ((right - left) / step).ceil();
            for j in whole(places) {
                let share = if places > 0.0 { j / places } else { 0.0 };
                each(self.at([left + share * (right - left), y]));
            }
        }
    }
}

/// Yields 0, 1, … up to and including `last`, which is a whole number.
fn whole(last: f64) -> impl Iterator<Item = f64> {
    std::iter::successors(Some(0.0), |i| Some(i + 1.0)).take_while(move |i| *i <= last)
}

#[inline]
pub(crate) fn between(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|k| b[k] - a[k])
}

#[inline]
pub(crate) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline]
pub(crate) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline]
pub(crate) fn length(a: [f64; 3]) -> f64 {
    dot(a, a).sqrt()
}

fn unit(a: [f64; 3], length: f64) -> [f64; 3] {
    if length > 0.0 { a.map(|x| x / length) } else { [0.0; 3] }
}
