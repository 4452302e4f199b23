//! Samples of a triangle in every box of a lattice that the triangle passes through.

/// A triangle has three corners, and each of the six walls of a box adds at most one.
const MOST_CORNERS: usize = 9;

/// Fraction of the distance to the centre of its piece by which a corner is moved inwards, so that
/// the corner is inside its box and not on a wall.
const INWARDS: f64 = 1.0 / 1_048_576.0;

/// A convex polygon in lattice coordinates, in which boxes have side 1.
#[derive(Debug, Clone, Copy)]
struct Piece {
    corners: [[f64; 3]; MOST_CORNERS],
    count: usize,
}

impl Piece {
    const EMPTY: Self = Self { corners: [[0.0; 3]; MOST_CORNERS], count: 0 };

    fn push(&mut self, corner: [f64; 3]) {
        // Rounding may yield one corner too many where a corner touches a wall; that corner repeats
        // another.
        if self.count < MOST_CORNERS {
            self.corners[self.count] = corner;
            self.count += 1;
        }
    }

    fn corners(&self) -> &[[f64; 3]] {
        &self.corners[..self.count]
    }

    /// Returns the least and the greatest coordinate along `axis`.
    fn extent(&self, axis: usize) -> [f64; 2] {
        let along = self.corners().iter().map(|c| c[axis]);
        along.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)])
    }

    /// Splits the polygon into the part below a wall and the part above it. Points on the wall are
    /// in both parts.
    fn split(&self, axis: usize, wall: f64) -> [Self; 2] {
        let mut parts = [Self::EMPTY; 2];
        let corners = self.corners();
        for (i, &corner) in corners.iter().enumerate() {
            let next = corners[(i + 1) % corners.len()];
            let [from, to] = [corner[axis] - wall, next[axis] - wall];
            if from <= 0.0 {
                parts[0].push(corner);
            }
            if from >= 0.0 {
                parts[1].push(corner);
            }
            if from < 0.0 && to > 0.0 || from > 0.0 && to < 0.0 {
                let share = from / (from - to);
                let mut crossing = [0, 1, 2].map(|k| corner[k] + share * (next[k] - corner[k]));
                crossing[axis] = wall;
                parts.iter_mut().for_each(|part| part.push(crossing));
            }
        }
        parts
    }

    /// Cuts the polygon at every wall across `axis`, and calls `each` with the part in every box.
    /// Parts before the first wall or beyond the last are dropped.
    fn cut(mut self, axis: usize, boxes: u32, mut each: impl FnMut(Self)) {
        let boxes = f64::from(boxes);
        let [low, high] = self.extent(axis);
        if high < 0.0 || low >= boxes {
            return;
        }
        if low < 0.0 {
            [_, self] = self.split(axis, 0.0);
        }
        let mut wall = low.max(0.0).floor() + 1.0;
        while wall <= high.min(boxes) {
            let [below, above] = self.split(axis, wall);
            each(below);
            self = above;
            wall += 1.0;
        }
        if wall <= boxes {
            each(self);
        }
    }
}

/// A lattice of equal boxes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lattice {
    /// Least corner of the first box.
    pub origin: [f64; 3],
    /// Side lengths of a box, positive.
    pub sides: [f64; 3],
    /// Number of boxes along each axis.
    pub counts: [u32; 3],
}

/// Limit of coordinates in box sides. Coordinates beyond it may overflow before they are cut.
const FARTHEST: f64 = 1e150;

/// Cuts a triangle along the walls of a lattice and calls `each` with the corners of the pieces.
/// Each corner is first moved towards the centre of its piece by a millionth of the distance.
///
/// Returns `true` if the whole triangle is in the lattice. Parts outside the lattice are skipped. A
/// triangle is skipped entirely if a corner is not finite or more than 1e150 boxes away.
///
/// Every box that holds more of the triangle than rounding error gets a sample. The least and
/// greatest sample coordinates in a box are those of the triangle's part in that box, to a
/// millionth. Boxes are half open: a point on a wall belongs to the box above. Takes about 10 ns a
/// sample, and one step for each box along an axis, however far the triangle extends.
pub fn lattice_samples(triangle: [[f64; 3]; 3], lattice: &Lattice, mut each: impl FnMut([f64; 3])) -> bool {
    let Lattice { origin, sides, counts } = *lattice;
    let corners = triangle.map(|corner| [0, 1, 2].map(|k| (corner[k] - origin[k]) / sides[k]));
    // Written so that NaN is rejected.
    if !corners.iter().flatten().all(|x| x.abs() <= FARTHEST) {
        return false;
    }
    let mut whole = Piece::EMPTY;
    corners.into_iter().for_each(|corner| whole.push(corner));
    whole.cut(0, counts[0], |slab| {
        slab.cut(1, counts[1], |column| {
            column.cut(2, counts[2], |piece| {
                let corners = piece.corners();
                let mut middle = [0.0; 3];
                for corner in corners {
                    for k in 0..3 {
                        middle[k] += corner[k] * COUNTED[corners.len()];
                    }
                }
                for corner in corners {
                    let inside = [0, 1, 2].map(|k| corner[k] + INWARDS * (middle[k] - corner[k]));
                    each([0, 1, 2].map(|k| origin[k] + inside[k] * sides[k]));
                }
            });
        });
    });
    corners.iter().all(|corner| (0..3).all(|k| corner[k] >= 0.0 && corner[k] < f64::from(counts[k])))
}

/// Reciprocals of corner counts.
const COUNTED: [f64; MOST_CORNERS + 1] =
    [0.0, 1.0, 1.0 / 2.0, 1.0 / 3.0, 1.0 / 4.0, 1.0 / 5.0, 1.0 / 6.0, 1.0 / 7.0, 1.0 / 8.0, 1.0 / 9.0];
