//! The well-filled cells of a box, for probabilities of collision.
//!
//! Klein & Zachmann (slides, 2003) lay a grid over the bounding volume of a node and count the cells
//! that hold at least as much of its surface as the largest polygon that fits into a cell. Their
//! cells are cubes of one number along each axis. Here they are nearly cubic, so that the flat box
//! of a patch is not cut into thin layers, and a cell is well filled by a quarter of the largest
//! polygon: a plane that passes through a cube at random covers 0.47 of it in the mean, so no
//! smooth sheet would fill a cell otherwise.

use nearmiss_lanes::vector::{cross, dot, sub};

use crate::bounds::boxes::OrientedBox;

/// The number of cells to which counts refer. A node's grid has at most as many; its count is scaled
/// to this number.
pub const CELLS: u8 = 64;

/// The share of the largest polygon in a cell that fills the cell well.
const WELL_FILLED: f32 = 0.25;

/// The greatest number of parts into which an edge is cut so that each part is about one cell long.
const MOST_PARTS: f32 = 8.0;

/// The cells over a box, and the area in each.
pub(crate) struct Grid<'a> {
    bounds: &'a OrientedBox,
    /// The number of cells along each axis.
    counts: [usize; 3],
    /// Cells per length along each axis.
    per_length: [f32; 3],
    /// The length of the longest edge of a cell.
    edge: f32,
    /// The area that fills a cell well.
    enough: f32,
    areas: [f32; CELLS as usize],
}

impl<'a> Grid<'a> {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        clippy::cast_precision_loss,
        reason = "counts of 1 to 64"
    )]
    pub(crate) fn over(bounds: &'a OrientedBox) -> Self {
        let whole = bounds.half.map(|half| 2.0 * half);
        let most = usize::from(CELLS);
        // The smallest cubic cells of which there are no more. Axes shorter than a cell have one.
        let mut counts = [1; 3];
        let mut best = 0;
        for along in 1..=most {
            let edge = whole[0] / along as f32;
            let count = |k: usize| ((whole[k] / edge).round() as usize).clamp(1, most);
            let tried = [along, count(1), count(2)];
            let product: usize = tried.iter().product();
            if product <= most && product > best {
                (best, counts) = (product, tried);
            }
        }
        let edges = [0, 1, 2].map(|k| whole[k] / counts[k] as f32);
        let per_length = edges.map(|edge| if edge > 0.0 { 1.0 / edge } else { 0.0 });
        // A plane through two opposite edges of a cuboid.
        let section = |k: usize| {
            let [a, b] = [edges[(k + 1) % 3], edges[(k + 2) % 3]];
            edges[k] * (a * a + b * b).sqrt()
        };
        let largest = (0..3).map(section).fold(0.0, f32::max);
        let edge = edges.into_iter().fold(0.0, f32::max);
        let areas = [0.0; CELLS as usize];
        Self { bounds, counts, per_length, edge, enough: WELL_FILLED * largest, areas }
    }

    /// Returns the coordinates of a point, in cells.
    fn local(&self, p: [f32; 3]) -> [f32; 3] {
        let d = sub(p, self.bounds.centre);
        [0, 1, 2].map(|k| (dot(self.bounds.axes[k], d) + self.bounds.half[k]) * self.per_length[k])
    }

    /// Adds the area of a triangle to the cells in which it lies, in parts about one cell long.
    pub(crate) fn add(&mut self, corners: &[[f32; 3]; 3]) {
        let local = corners.map(|p| self.local(p));
        let [p, q, r] = *corners;
        let (e, f) = (sub(q, p), sub(r, p));
        let normal = cross(e, f);
        let area = 0.5 * dot(normal, normal).sqrt();
        let g = sub(r, q);
        let longest = dot(e, e).max(dot(f, f)).max(dot(g, g)).sqrt();
        let parts = (longest / self.edge).ceil().clamp(1.0, MOST_PARTS);
        let share = area / (parts * parts);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "1 to 8")]
        let count = parts as u16;
        let third = 1.0 / (3.0 * parts);
        for i in 0..count {
            // Row i has 2 (count - i) - 1 parts, which point up and down in turn.
            for j in 0..2 * (count - i) - 1 {
                let (up, step) = (f32::from(1 - j % 2), f32::from(j / 2));
                let v = (3.0 * f32::from(i) + 2.0 - up) * third;
                let u = (3.0 * step + 2.0 - up) * third;
                let w = 1.0 - u - v;
                let place = [0, 1, 2].map(|k| w * local[0][k] + u * local[1][k] + v * local[2][k]);
                let at = self.cell(place);
                self.areas[at] += share;
            }
        }
    }

    /// The cell at a place, in cells along each axis.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to the grid")]
    fn cell(&self, place: [f32; 3]) -> usize {
        let [x, y, z] = [0, 1, 2].map(|k| (place[k].max(0.0) as usize).min(self.counts[k] - 1));
        (z * self.counts[1] + y) * self.counts[0] + x
    }

    /// The number of well-filled cells, scaled to [`CELLS`]. At least 1.
    pub(crate) fn filled(&self) -> u8 {
        let cells: usize = self.counts.iter().product();
        let filled = self.areas[..cells].iter().filter(|&&area| area > 0.0 && area >= self.enough).count();
        let most = usize::from(CELLS);
        u8::try_from((filled * most + cells / 2) / cells).unwrap_or(CELLS).clamp(1, CELLS)
    }
}
