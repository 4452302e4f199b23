//! The places that curves have passed, in a grid for fast look-up.

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_surface::Evaluation;

/// Surfaces at angles with a sine below this count as tangent. Normals are about as exact as the
/// turn of a surface that bends by this share within a bandwidth.
pub(super) const PARALLEL: f64 = 0.01;

/// A place on two surfaces, or nearly on them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Place {
    pub(super) point: Vector3<f64>,
    pub(super) normals: [Vector3<f64>; 2],
    /// The unit vector along `n_A × n_B`.
    pub(super) tangent: Vector3<f64>,
    /// The sine of the angle between the surfaces.
    pub(super) sine: f64,
    /// The greater |f| of the two surfaces.
    pub(super) residual: f64,
}

impl Place {
    pub(super) fn new(point: Vector3<f64>, at: &[Evaluation; 2]) -> Self {
        let residual = at[0].f.abs().max(at[1].f.abs());
        Self::between(point, at.map(|at| Vector3::from(at.normal)), residual)
    }

    pub(super) fn between(point: Vector3<f64>, normals: [Vector3<f64>; 2], residual: f64) -> Self {
        let across = normals[0].cross(&normals[1]);
        let sine = across.norm();
        let tangent = if sine > 0.0 { across / sine } else { across };
        Self { point, normals, tangent, sine, residual }
    }

    /// The same place with the normals turned to the sides of those of `other`, as the sign of a
    /// surface normal is arbitrary.
    pub(super) fn turned_like(self, other: &Self) -> Self {
        let signs = [0, 1].map(|side| 1.0_f64.copysign(self.normals[side].dot(&other.normals[side])));
        let normals = [0, 1].map(|side| self.normals[side] * signs[side]);
        Self { normals, tangent: self.tangent * (signs[0] * signs[1]), ..self }
    }

    /// Returns `true` if the surfaces are tangent, so that there is no direction to follow.
    pub(super) fn is_tangent(&self) -> bool {
        self.sine < PARALLEL
    }

    /// Returns `true` if the surfaces here and at `other` are likely the same sheets, intersecting
    /// in the same direction.
    fn agrees(&self, other: &Self) -> bool {
        /// The cosine of 45°.
        const HALFWAY: f64 = 0.7;
        let turned = self.turned_like(other);
        let same = |side: usize| turned.normals[side].dot(&other.normals[side]) > HALFWAY;
        turned.tangent.dot(&other.tangent) > HALFWAY && same(0) && same(1)
    }
}

/// The end of a list of places.
const NONE: u32 = u32::MAX;

/// Crossings at angles with a sine below this have no reliable direction.
const FLAT: f64 = 0.1;

/// Places in a grid of cubes, with a hash table of lists.
#[derive(Debug, Clone, Default)]
pub(super) struct Trail {
    pub(super) places: Vec<Place>,
    /// The previous place in the same list, for each place.
    next: Vec<u32>,
    /// The last place of each list. The number of lists is a power of two.
    heads: Vec<u32>,
    /// The origin of the grid.
    origin: Vector3<f64>,
    /// The longest step.
    longest: f64,
}

impl Trail {
    /// Edge of a cube, in longest steps. Searches reach half an edge.
    const EDGE: f64 = 2.5;

    const FEWEST: usize = 256;

    /// Share of its length by which a chord is extended to search for places: `SAME_TURN` times the
    /// tangent of `MOST_TURN`. Then no place within `SAME_TURN` of the chord's length is missed
    /// between two chords that turn by `MOST_TURN`.
    const BEYOND: f64 = 0.07;

    pub(super) fn clear(&mut self, origin: Vector3<f64>, longest: f64) {
        self.places.clear();
        self.next.clear();
        self.heads.clear();
        self.heads.resize(Self::FEWEST, NONE);
        (self.origin, self.longest) = (origin, longest);
    }

    /// The cube that contains `x` in a grid shifted by `shift` edges. With a shift of one half, the
    /// eight cubes from there contain everything within half an edge of `x`.
    fn cube(&self, x: Vector3<f64>, shift: f64) -> [i64; 3] {
        #[expect(clippy::cast_possible_truncation, reason = "beyond all cubes is one more")]
        let at = |c: f64| (c / (Self::EDGE * self.longest) - shift).floor() as i64;
        let d = x - self.origin;
        [at(d.x), at(d.y), at(d.z)]
    }

    fn list(&self, [x, y, z]: [i64; 3]) -> usize {
        let mix = |c: i64, by: u64| c.cast_unsigned().wrapping_mul(by);
        let hash =
            mix(x, 0x9e37_79b9_7f4a_7c15) ^ mix(y, 0xc2b2_ae3d_27d4_eb4f) ^ mix(z, 0x1656_67b1_9e37_79f9);
        (hash >> 32) as usize & (self.heads.len() - 1)
    }

    pub(super) fn push(&mut self, place: Place) {
        self.places.push(place);
        self.next.push(NONE);
        if self.places.len() <= self.heads.len() {
            self.link(self.places.len() - 1);
            return;
        }
        let lists = 2 * self.heads.len();
        self.heads.clear();
        self.heads.resize(lists, NONE);
        for i in 0..self.places.len() {
            self.link(i);
        }
    }

    fn link(&mut self, i: usize) {
        let list = self.list(self.cube(self.places[i].point, 0.0));
        self.next[i] = self.heads[list];
        self.heads[list] = u32::try_from(i).unwrap_or(NONE);
    }

    /// The places within half an edge of `x`, and possibly others.
    fn near(&self, x: Vector3<f64>) -> impl Iterator<Item = usize> {
        let [x, y, z] = self.cube(x, 0.5);
        (0..8).flat_map(move |corner| {
            // Coordinates saturate far from the origin, as happens with damaged files.
            let next = |c: i64, axis: i64| c.saturating_add(corner >> axis & 1);
            let cube = [next(x, 0), next(y, 1), next(z, 2)];
            let existing = |i: u32| Some(i as usize).filter(|_| i != NONE);
            let first = existing(self.heads[self.list(cube)]);
            std::iter::successors(first, move |&i| existing(self.next[i]))
        })
    }

    /// Returns `true` if a curve has passed `place` within `aside`. Where either place has no
    /// reliable direction, within the longest step.
    pub(super) fn has_passed(&self, place: &Place, aside: f64) -> bool {
        self.near(place.point).any(|i| {
            let other = &self.places[i];
            let offset = place.point - other.point;
            let along = offset.dot(&other.tangent);
            if other.is_tangent() || place.sine < FLAT {
                return offset.norm() <= self.longest;
            }
            let off = (offset - other.tangent * along).norm();
            along.abs() <= self.longest && off <= aside && place.agrees(other)
        })
    }

    /// The nearest place that the chord from `here` to `next` passes within `aside`, in the same
    /// direction.
    ///
    /// The chord is extended by [`Self::BEYOND`] of its length. Otherwise a place just beyond
    /// `next` would be missed where the next chord turns away from it: that place is then neither
    /// before the end of this chord nor ahead of the next one.
    pub(super) fn passed(&self, here: &Place, next: &Place, aside: f64) -> Option<usize> {
        let chord = next.point - here.point;
        let length = chord.norm();
        let direction = chord / length;
        let mut nearest = (length * (1.0 + Self::BEYOND), None);
        for i in self.near(here.point) {
            let offset = self.places[i].point - here.point;
            let along = offset.dot(&direction);
            // `here` itself, exactly 0 along the chord, was not passed.
            let ahead = along > 0.0 && along <= nearest.0;
            if ahead && (offset - direction * along).norm() <= aside && self.places[i].agrees(here) {
                nearest = (along, Some(i));
            }
        }
        nearest.1
    }
}

#[cfg(test)]
mod tests {
    use nearmiss_testdata::arbitrary::{point_in, rng, unit_vector};
    use rand::RngExt;

    use super::*;

    /// The same without a grid.
    fn linear(trail: &Trail, place: &Place, aside: f64) -> bool {
        trail.places.iter().any(|other| {
            let offset = place.point - other.point;
            let along = offset.dot(&other.tangent);
            let off = (offset.norm_squared() - along * along).max(0.0).sqrt();
            let agree = (0..2).all(|k| place.normals[k].dot(&other.normals[k]).abs() > 0.7);
            let sign = (0..2).map(|k| place.normals[k].dot(&other.normals[k]).signum()).product::<f64>();
            let same_way = sign * place.tangent.dot(&other.tangent) > 0.7;
            if other.sine < 0.01 || place.sine < 0.1 {
                offset.norm() <= trail.longest
            } else {
                agree && same_way && along.abs() <= trail.longest && off <= aside
            }
        })
    }

    #[test]
    fn the_grid_finds_what_looking_at_all_places_finds() {
        let rng = &mut rng(6);
        let mut trail = Trail::default();
        let mut seen = [0, 0];
        for (round, origin) in [0.0, 1e6, -3e9].into_iter().enumerate() {
            let longest = [0.05, 0.2, 1.0][round];
            trail.clear(Vector3::repeat(origin), longest);
            for i in 0..3000 {
                let mut normals = [unit_vector(rng), unit_vector(rng)].map(Vector3::from);
                if i % 3 == 0 {
                    normals = [Vector3::x(), Vector3::y()];
                } else if i % 7 == 0 {
                    normals[1] = normals[0];
                }
                let point = Vector3::repeat(origin) + Vector3::from(point_in(rng, 1.5));
                let place = Place::between(point, normals, 0.0);
                let aside = rng.random_range(0.1..0.5) * longest;
                let expected = linear(&trail, &place, aside);
                assert_eq!(trail.has_passed(&place, aside), expected, "{i} of round {round}: {place:?}");
                seen[usize::from(expected)] += 1;
                trail.push(place);
            }
        }
        assert!(seen.iter().all(|&n| n > 500), "both answers: {seen:?}");
    }

    /// Damaged files contain arbitrary numbers. Searching far from the origin of the grid must not
    /// overflow.
    #[test]
    fn places_without_a_cube_are_looked_for_without_overflow() {
        let normals = [Vector3::y(), Vector3::z()];
        let far = [f64::MAX, -f64::MAX, f64::INFINITY, -f64::INFINITY, f64::NAN, 1e300, 3.7e19, -3.7e19, 0.0];
        let mut trail = Trail::default();
        for longest in [1.0, f64::MIN_POSITIVE, 0.0, f64::MAX, f64::INFINITY, f64::NAN] {
            for origin in [0.0, -f64::MAX, f64::NAN] {
                trail.clear(Vector3::repeat(origin), longest);
                for i in 0..far.len().pow(3) {
                    let at = |k: u32| far[i / far.len().pow(k) % far.len()];
                    let place = Place::between(Vector3::new(at(0), at(1), at(2)), normals, 0.0);
                    assert_eq!(trail.passed(&place, &place, 0.1), None, "a chord without length");
                    // Any result is acceptable.
                    let _ = trail.has_passed(&place, 0.1);
                    trail.push(place);
                }
                assert_eq!(trail.places.len(), far.len().pow(3));
            }
        }
        // Places are also found where the coordinates of cubes saturate.
        trail.clear(Vector3::zeros(), 1.0);
        let place = Place::between(Vector3::repeat(f64::MAX), normals, 0.0);
        assert!(!trail.has_passed(&place, 0.1));
        trail.push(place);
        assert!(trail.has_passed(&place, 0.1));
    }

    #[test]
    fn a_chord_passes_what_lies_ahead_of_it_and_runs_its_way() {
        let place = |x: f64, y: f64, way: f64| {
            Place::between(Vector3::new(x, y, 0.0), [Vector3::y(), Vector3::z() * way], 0.0)
        };
        let mut trail = Trail::default();
        trail.clear(Vector3::zeros(), 1.0);
        let [here, next] = [place(0.0, 0.0, 1.0), place(1.0, 0.0, 1.0)];
        for (x, y) in [(0.0, 0.0), (-0.5, 0.0), (1.2, 0.0), (0.5, 0.2)] {
            trail.push(place(x, y, 1.0));
            assert_eq!(trail.passed(&here, &next, 0.1), None, "({x}, {y})");
        }
        // A chord that ends just before a place counts as passing it: from `next` on, the place
        // would be aside or behind.
        let mut short = trail.clone();
        short.push(place(1.0 + 1e-9, 0.0, 1.0));
        assert_eq!(short.passed(&here, &next, 0.1), Some(4));
        trail.push(place(0.9, 0.05, 1.0));
        assert_eq!(trail.passed(&here, &next, 0.1), Some(4));
        // The signs of unoriented normals do not determine a direction.
        trail.push(place(0.7, -0.05, -1.0));
        assert_eq!(trail.passed(&here, &next, 0.1), Some(5), "the nearest");
        let across = Place::between(Vector3::new(0.4, 0.0, 0.0), [Vector3::x(), Vector3::z()], 0.0);
        trail.push(across);
        assert_eq!(trail.passed(&here, &next, 0.1), Some(5), "another curve");
    }
}
