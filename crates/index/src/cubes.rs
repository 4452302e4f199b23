//! A grid of cubes over a box.

/// A grid of cubes over a box.
#[derive(Debug, Clone, Copy)]
pub struct Cubes {
    min: [f64; 3],
    edge: f64,
    per_edge: f64,
    size: [usize; 3],
}

impl Cubes {
    /// Covers the box from `min` to `max`, and everything within `margin` edges of it. The edge is about
    /// the least that is not less than `least` and takes no more than `most` cubes.
    #[must_use]
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "cubes are counted in small numbers"
    )]
    pub fn new([min, max]: [[f64; 3]; 2], margin: f64, (least, most): (f64, f64)) -> Self {
        let longest = (0..3).fold(f64::MIN_POSITIVE, |longest: f64, k| longest.max(max[k] - min[k]));
        let along = |edge: f64, k: usize| ((max[k] - min[k]) / edge + 2.0 * margin).floor() + 1.0;
        let count = |edge: f64| (0..3).map(|k| along(edge, k)).product::<f64>();
        let mut edge = longest.max(least);
        while 0.9 * edge >= least && count(0.9 * edge) <= most {
            edge *= 0.9;
        }
        let size = [0, 1, 2].map(|k| along(edge, k) as usize);
        Self { min: min.map(|c| c - margin * edge), edge, per_edge: 1.0 / edge, size }
    }

    /// Returns the number of cubes.
    #[must_use]
    pub fn count(&self) -> usize {
        self.size.iter().product()
    }

    /// Returns the number of cubes along each axis.
    #[must_use]
    pub fn size(&self) -> [usize; 3] {
        self.size
    }

    /// Returns the length of an edge.
    #[must_use]
    pub fn edge(&self) -> f64 {
        self.edge
    }

    /// Returns a coordinate of a place in edges from the first corner.
    #[inline]
    #[must_use]
    pub fn along(&self, k: usize, c: f64) -> f64 {
        (c - self.min[k]) * self.per_edge
    }

    /// Returns the number of the cube that contains a place; `None` outside the grid and for NaN.
    #[inline]
    #[must_use]
    pub fn at(&self, place: [f64; 3]) -> Option<usize> {
        self.about(place).map(|(cube, _)| cube)
    }

    /// Does the same, and also returns the squared distance of the place from the centre of the cube, up
    /// to rounding.
    #[inline]
    #[must_use]
    pub fn about(&self, place: [f64; 3]) -> Option<(usize, f64)> {
        let (cube, within) = self.locate(place)?;
        let off = within.map(|c| (c - 0.5) * self.edge);
        Some((cube, off.iter().map(|c| c * c).sum()))
    }

    /// Returns the number of the cube that contains a place, and the distances of the place from the first
    /// corner of the cube along each axis, in edges; `None` outside the grid and for NaN.
    #[inline]
    #[must_use]
    pub fn locate(&self, place: [f64; 3]) -> Option<(usize, [f64; 3])> {
        let (mut cube, mut within) = (0, [0.0; 3]);
        for k in 0..3 {
            let at = self.along(k, place[k]);
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
            let number = at as usize;
            if at.is_nan() || at < 0.0 || number >= self.size[k] {
                return None;
            }
            cube = cube * self.size[k] + number;
            #[expect(clippy::cast_precision_loss, reason = "a small number")]
            let steps = number as f64;
            within[k] = at - steps;
        }
        Some((cube, within))
    }

    /// Returns the part of a cube that contains a place, if each edge is cut into `parts`: the number of
    /// parts from the first along each axis, and the distances of the place from the first corner of its
    /// part, in edges of a part. `None` outside the grid and for NaN.
    #[inline(always)]
    #[must_use]
    pub fn locate_part(&self, place: [f64; 3], parts: u32) -> Option<([u32; 3], [f64; 3])> {
        let (mut numbers, mut within) = ([0; 3], [0.0; 3]);
        for k in 0..3 {
            let at = self.along(k, place[k]) * f64::from(parts);
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
            let number = at as u32;
            if at.is_nan() || at < 0.0 || number as usize >= self.size[k] * parts as usize {
                return None;
            }
            (numbers[k], within[k]) = (number, at - f64::from(number));
        }
        Some((numbers, within))
    }

    /// Returns the number of the cube that is this many cubes from the first along each axis.
    #[inline]
    #[must_use]
    pub fn number(&self, [x, y, z]: [usize; 3]) -> usize {
        (x * self.size[1] + y) * self.size[2] + z
    }

    /// Returns the first corner of the cube that is this many cubes from the first along each axis.
    #[inline]
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "small numbers")]
    pub fn corner(&self, steps: [usize; 3]) -> [f64; 3] {
        [0, 1, 2].map(|k| self.min[k] + self.edge * steps[k] as f64)
    }

    /// Returns the centre of a cube, by its number.
    #[inline]
    #[must_use]
    pub fn centre(&self, cube: usize) -> [f64; 3] {
        let [_, ys, zs] = self.size;
        self.corner([cube / (ys * zs), cube / zs % ys, cube % zs]).map(|c| c + 0.5 * self.edge)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_place_in_the_box_is_in_a_cube() {
        for (max, least, most) in
            [([3.0, 2.0, 1.0], 0.0, 500.0), ([1.0, 0.0, 0.0], 0.3, 1e9), ([0.0; 3], 0.5, 1e3)]
        {
            let cubes = Cubes::new([[-1.0; 3], max.map(|c| c - 1.0)], 0.5, (least, most));
            assert!(cubes.edge() >= least && cubes.count() <= 500, "{cubes:?}");
            for cube in 0..cubes.count() {
                let centre = cubes.centre(cube);
                assert_eq!(cubes.at(centre), Some(cube), "{cubes:?}");
                let (part, within) = cubes.locate_part(centre.map(|c| c + 0.4 * cubes.edge()), 5).unwrap();
                assert_eq!(cubes.number(part.map(|own| own as usize / 5)), cube);
                assert!(part.iter().all(|own| own % 5 == 4), "0.9 edges from the corner, {part:?}");
                assert!(within.iter().all(|c| (c - 0.5).abs() < 1e-9), "{within:?}");
            }
            for far in [[-1.0; 3], max.map(|c| c - 1.0)] {
                for side in [-0.49, 0.49] {
                    let place = far.map(|c| c + side * cubes.edge());
                    assert!(cubes.at(place).is_some(), "{place:?} in {cubes:?}");
                }
            }
            for none in [[f64::NAN, 0.0, 0.0], [0.0, -9.0, 0.0], [0.0, 0.0, 1e300]] {
                assert_eq!(cubes.locate_part(none, 12), None);
            }
            assert_eq!(cubes.at([f64::NAN, 0.0, 0.0]), None);
            assert_eq!(cubes.at([0.0, -9.0, 0.0]), None, "before the grid");
            assert_eq!(cubes.at([0.0, 0.0, 1e300]), None, "beyond the grid");
        }
    }
}
