//! Proofs that two placed boxes, or parts of points, are disjoint.
//!
//! A separating direction is searched in floating point; any direction is valid. That it separates
//! the boxes is then shown in intervals. A box is exactly the set of `centre + Σ t_k axes_k` with
//! `|t_k| ≤ half_k`, for any axes.

use crate::interval::{Interval, dot};
use crate::proof::{Enclosure, Matrix};

type Vector = [f64; 3];

/// A box in the world: bounds of its exact place, and its approximate place.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Placed {
    centre: [Interval; 3],
    axes: [[Interval; 3]; 3],
    half: Vector,
    about: Vector,
    directions: [Vector; 3],
    /// The part of the obstacle about each place of the box, if it has a size.
    part: Option<Part>,
}

/// A ball about the origin and, for points on sheets, the slab that cuts it: the places y with
/// |normal · y| ≤ slab.
#[derive(Debug, Clone, Copy)]
struct Part {
    radius: f64,
    cut: Option<([Interval; 3], f64)>,
}

impl Part {
    /// Returns about how far the part extends along `d`, and the share of the normal in `d` that proves it.
    ///
    /// For each share t, d · y = t (normal · y) + (d − t normal) · y ≤ |t| slab + |d − t normal| radius.
    fn extent(&self, d: Vector) -> (f64, f64) {
        let whole = (self.radius * times(d, d).sqrt(), 0.0);
        let Some((normal, slab)) = self.cut else { return whole };
        let normal = normal.map(middle);
        let (of_d, of_normal) = (times(d, d).sqrt(), times(normal, normal).sqrt());
        let cosine = times(d, normal) / (of_d * of_normal);
        let (height, sine) = (slab / of_normal, (1.0 - cosine * cosine).max(0.0).sqrt());
        let face = (self.radius * self.radius - height * height).max(0.0).sqrt();
        let share = (cosine.abs() - sine * height / face).max(0.0).copysign(cosine) * of_d / of_normal;
        let rest = [0, 1, 2].map(|k| d[k] - share * normal[k]);
        let cut = share.abs() * slab + times(rest, rest).sqrt() * self.radius;
        if cut < whole.0 { (cut, share) } else { whole }
    }

    /// Returns a bound of how far the part extends along `d`.
    fn greatest_extent(&self, d: [Interval; 3]) -> Interval {
        let (_, share) = self.extent(d.map(middle));
        let radius = Interval::new(self.radius);
        let Some((normal, slab)) = self.cut.filter(|_| share != 0.0) else {
            return radius * dot(d, d).root();
        };
        let rest = [0, 1, 2].map(|k| d[k] - Interval::new(share) * normal[k]);
        Interval::new(share.abs()) * Interval::new(slab) + radius * dot(rest, rest).root()
    }
}

fn middle(x: Interval) -> f64 {
    0.5 * x.low + 0.5 * x.high
}

impl Placed {
    /// Returns the box of `enclosure` transformed by `matrix`.
    pub(crate) fn new(enclosure: &Enclosure, matrix: &Matrix) -> Self {
        let row = |i: usize| [0, 1, 2].map(|j| Interval::new(matrix[4 * i + j]));
        let exact = |v: [f32; 3]| v.map(|x| Interval::new(f64::from(x)));
        let turned = |v: [f32; 3]| [0, 1, 2].map(|i| dot(row(i), exact(v)));
        let shift = [3, 7, 11].map(|i| Interval::new(matrix[i]));
        let linear = turned(enclosure.centre);
        let centre = [0, 1, 2].map(|i| linear[i] + shift[i]);
        let axes = enclosure.axes.map(turned);
        let (about, directions) = (centre.map(middle), axes.map(|axis| axis.map(middle)));
        Self { centre, axes, half: enclosure.half.map(f64::from), about, directions, part: None }
    }

    /// Returns the part of the obstacle about a stored position, transformed by `matrix`, which scales by
    /// `scale`. The part is a ball and, given a unit normal, half the thickness of a slab that cuts it.
    pub(crate) fn part(
        position: [f32; 3],
        (radius, cut): (f64, Option<([f32; 3], f64)>),
        (matrix, scale): (&Matrix, f64),
    ) -> Self {
        let at = |axes| Enclosure { first: 0, count: 1, centre: position, half: [0.0; 3], axes };
        // A turned normal and a turned place are each longer by the scale.
        let cut = cut.map(|(normal, slab)| {
            let turned = Self::new(&at([normal, [0.0; 3], [0.0; 3]]), matrix).axes[0];
            (turned, slab * scale * scale)
        });
        let part = Some(Part { radius: radius * scale, cut });
        Self { part, ..Self::new(&at([[0.0; 3]; 3]), matrix) }
    }

    /// Returns approximately how far the box and the part extend from the centre along `d`.
    fn extent(&self, d: Vector) -> f64 {
        let of_box: f64 = (0..3).map(|k| self.half[k] * times(d, self.directions[k]).abs()).sum();
        of_box + self.part.map_or(0.0, |part| part.extent(d).0)
    }

    /// Returns a bound of how far the box and the part extend from the centre along `d`.
    fn greatest_extent(&self, d: [Interval; 3]) -> Interval {
        let along = |k: usize| Interval::new(self.half[k]) * dot(d, self.axes[k]).magnitude();
        let of_box = along(0) + along(1) + along(2);
        self.part.map_or(of_box, |part| of_box + part.greatest_extent(d))
    }
}

/// Returns the approximate distance of two boxes along the direction tried, if they are proven to
/// be at least `wanted` apart.
pub(crate) fn distance(a: &Placed, b: &Placed, wanted: f64) -> Option<f64> {
    let mut candidates = normals(a, b);
    let apart = minus(a.about, b.about);
    candidates.push(apart);
    let size = |d: Vector| times(d, d).sqrt();
    let about = |d: Vector| (times(d, apart).abs() - a.extent(d) - b.extent(d)) / size(d);
    let ranked = candidates.into_iter().map(|d| (about(d), d)).filter(|(gap, _)| gap.is_finite());
    let best = ranked.max_by(|x, y| x.0.total_cmp(&y.0));
    let proven = best.and_then(|(_, d)| distance_along(a, b, d, wanted));
    proven.or_else(|| distance_along(a, b, between_nearest(a, b), wanted))
}

/// Returns the approximate distance of two sets of parts and boxes, if they are proven to be at least
/// `wanted` apart.
pub(crate) fn distance_of_all(a: &[Placed], b: &[Placed], wanted: f64) -> Option<f64> {
    let mut least = f64::INFINITY;
    for (p, q) in a.iter().flat_map(|p| b.iter().map(move |q| (p, q))) {
        least = least.min(distance(p, q, wanted)?);
    }
    Some(least)
}

/// Returns the distance that `direction`, of any length, proves.
fn distance_along(a: &Placed, b: &Placed, direction: Vector, wanted: f64) -> Option<f64> {
    let d = direction.map(Interval::new);
    let apart = [0, 1, 2].map(|k| a.centre[k] - b.centre[k]);
    let between = dot(d, apart).magnitude() - a.greatest_extent(d) - b.greatest_extent(d);
    let length = dot(d, d).root();
    let claimed = Interval::new(wanted) * length;
    let holds = between.low > 0.0 && between.low >= claimed.high && length.high.is_finite();
    holds.then(|| between.low / length.high)
}

/// Returns the face normals of both boxes, the common normals of their edges and the normals of slabs.
fn normals(a: &Placed, b: &Placed) -> Vec<Vector> {
    let mut normals = Vec::with_capacity(18);
    for box_ in [a, b] {
        let cut = box_.part.and_then(|part| part.cut);
        normals.extend(cut.map(|(normal, _)| normal.map(middle)));
        let [x, y, z] = box_.directions;
        normals.extend([cross(y, z), cross(z, x), cross(x, y)]);
    }
    for x in a.directions {
        normals.extend(b.directions.map(|y| cross(x, y)));
    }
    normals
}

/// Returns approximately the vector from the point of b nearest to a, to the point of a nearest to
/// b. Minimises the square of its length in the six parameters of the two boxes, one after the
/// other within its bounds, repeatedly.
fn between_nearest(a: &Placed, b: &Placed) -> Vector {
    const SWEEPS: usize = 300;
    let mut between = minus(a.about, b.about);
    let mut parameters = [0.0; 6];
    let column = |k: usize| if k < 3 { a.directions[k] } else { b.directions[k - 3].map(|x| -x) };
    let bound = |k: usize| if k < 3 { a.half[k] } else { b.half[k - 3] };
    for _ in 0..SWEEPS {
        for k in 0..6 {
            let axis = column(k);
            let step = -times(axis, between) / times(axis, axis);
            let moved = (parameters[k] + step).clamp(-bound(k), bound(k));
            let step = moved - parameters[k];
            // No step where an axis has length zero.
            if step.is_finite() {
                parameters[k] = moved;
                between = [0, 1, 2].map(|i| between[i] + step * axis[i]);
            }
        }
    }
    between
}

fn times(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn minus(a: Vector, b: Vector) -> Vector {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::Source;

    const AXES: [[f32; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

    /// Returns a matrix that turns about the axes z, then x, and shifts.
    fn matrix(turn: [f64; 2], shift: Vector) -> Matrix {
        let [(s, c), (t, d)] = turn.map(f64::sin_cos);
        let [x, y, z] = shift;
        [c, -s, 0.0, x, d * s, d * c, -t, y, t * s, t * c, d, z, 0.0, 0.0, 0.0, 1.0]
    }

    fn placed(half: [f32; 3], turn: [f64; 2], shift: Vector) -> Placed {
        let enclosure = Enclosure { first: 0, count: 1, centre: [0.0; 3], half, axes: AXES };
        Placed::new(&enclosure, &matrix(turn, shift))
    }

    #[test]
    fn an_ulp_apart_is_apart_and_touching_is_not() {
        let cube = |x: f64| placed([0.5; 3], [0.0; 2], [x, 0.25, 0.0]);
        let origin = cube(0.0);
        assert!(distance(&origin, &cube(1.0), 0.0).is_none(), "they touch");
        assert!(distance(&origin, &cube(1.0_f64.next_down()), 0.0).is_none(), "they overlap");
        let ulp = f64::EPSILON;
        assert_eq!(distance(&origin, &cube(1.0 + ulp), 0.0).map(|d| d > 0.9 * ulp), Some(true));
        assert!(distance(&origin, &cube(1.5), 0.5 * (1.0 + 1e-15)).is_none(), "not so far");
        assert!(distance(&origin, &cube(1.5), 0.5 * (1.0 - 1e-15)).is_some(), "a little less");
        assert!(distance(&origin, &cube(-1.0 - ulp), 0.0).is_some(), "either side");
    }

    #[test]
    fn overlapping_boxes_are_never_apart() {
        let mut source = Source::new(5);
        for i in 0..20_000 {
            let mut number = || source.signed();
            let turns = [[number() * 3.0, number() * 3.0], [number() * 3.0, number() * 3.0]];
            #[expect(clippy::cast_possible_truncation, reason = "any number will do")]
            let mut half = || [(); 3].map(|()| number().abs() as f32);
            let halves = [half(), half()];
            // A point of either box; b is moved so that the two points coincide.
            let a = placed(halves[0], turns[0], [0.0; 3]);
            let centred = placed(halves[1], turns[1], [0.0; 3]);
            let mut inside = |p: &Placed| {
                let t = [0, 1, 2].map(|k| p.half[k] * number() * (1.0 - 1e-9));
                [0, 1, 2].map(|i| (0..3).map(|k| t[k] * p.directions[k][i]).sum::<f64>())
            };
            let shift = minus(inside(&a), inside(&centred));
            let b = placed(halves[1], turns[1], shift);
            assert!(distance(&a, &b, 0.0).is_none(), "pair {i}");
        }
    }

    #[test]
    fn edges_and_corners_are_parted_too() {
        let quarter = std::f64::consts::FRAC_PI_4;
        // Two edges across each other: only their common normal separates them.
        let a = placed([0.5; 3], [quarter, 0.0], [0.0; 3]);
        let b =
            Placed::new(&Enclosure { first: 0, count: 1, centre: [0.0; 3], half: [0.5; 3], axes: AXES }, &{
                let (s, c) = quarter.sin_cos();
                [c, 0.0, s, 1.5, 0.0, 1.0, 0.0, 0.0, -s, 0.0, c, 0.0, 0.0, 0.0, 0.0, 1.0]
            });
        let exact = 1.5 - 2.0_f64.sqrt();
        assert!((distance(&a, &b, 0.0).unwrap() / exact - 1.0).abs() < 1e-12);
        assert!(distance(&a, &b, exact * (1.0 + 1e-12)).is_none());
        // Two corners towards each other: no normal of either box gives their distance.
        let (corner, further) = (placed([0.5; 3], [0.0; 2], [0.0; 3]), placed([0.5; 3], [0.0; 2], [2.0; 3]));
        let exact = 3.0_f64.sqrt();
        assert!(distance(&corner, &further, exact * (1.0 - 1e-12)).is_some());
        assert!(distance(&corner, &further, exact * (1.0 + 1e-12)).is_none());
        // The same without symmetry; the point 0.5 0.5 0.5 is nearest to (2.5, 1.3, 0.9) and its
        // box.
        let further = placed([0.5; 3], [0.0; 2], [3.0, 1.8, 1.4]);
        let exact = (2.0_f64 * 2.0 + 0.8 * 0.8 + 0.4 * 0.4).sqrt();
        assert!(distance(&corner, &further, exact * (1.0 - 1e-9)).is_some());
    }

    #[test]
    fn random_boxes_are_as_far_apart_as_their_nearest_points() {
        let mut source = Source::new(6);
        let mut apart = 0;
        for _ in 0..2000 {
            let mut number = || source.signed();
            let a = placed([0.3, 0.2, 0.01], [number() * 3.0, number() * 3.0], [0.0; 3]);
            let shift = [number(), number(), number()];
            let b = placed([0.2, 0.1, 0.02], [number() * 3.0, number() * 3.0], shift);
            let between = between_nearest(&a, &b);
            let nearest = times(between, between).sqrt();
            if let Some(proven) = distance(&a, &b, 0.99 * nearest) {
                assert!(proven <= nearest * (1.0 + 1e-9), "{proven} of {nearest}");
                apart += 1;
            }
        }
        assert!(apart > 1500, "most are far apart: {apart}");
    }

    /// The extent of a part is the greatest of the places on its outline.
    #[test]
    fn parts_extend_as_far_as_their_places() {
        let mut source = Source::new(7);
        let (mut cut, mut scale) = (0, 1.0);
        for round in 0..500 {
            let mut number = || source.signed();
            let turn = [number() * 3.0, number() * 3.0];
            scale = if round % 2 == 0 { 1.0 } else { 1.0 + number().abs() };
            let mut placing = matrix(turn, [number(), number(), number()]);
            for i in [0, 1, 2, 4, 5, 6, 8, 9, 10] {
                placing[i] *= scale;
            }
            let (radius, share) = (0.2 + number().abs(), 1.2 * number().abs());
            let slab = share * radius;
            let part =
                Placed::part([0.3, 0.1, 0.2], (radius, Some(([0.0, 0.0, 1.0], slab))), (&placing, scale));
            let d = [number(), number(), number()];
            let bound = part.greatest_extent(d.map(Interval::new));
            let axis = [placing[2], placing[6], placing[10]].map(|x| x / scale);
            let length = times(d, d).sqrt();
            let angle = (times(d, axis) / length).clamp(-1.0, 1.0).acos();
            let outline = |step: u32| {
                let own = f64::from(step) * std::f64::consts::TAU / 20_000.0;
                radius.min(slab / own.cos().abs()) * (own - angle).cos() * length * scale
            };
            let exact = (0..20_000).map(outline).fold(0.0, f64::max);
            assert!(
                bound.high >= exact && bound.high < exact + 5e-4 * radius * length * scale,
                "{bound:?} {exact}"
            );
            cut += usize::from(exact < 0.99 * radius * length * scale);
        }
        assert!(cut > 150 && scale > 1.0, "{cut} cut");
    }

    #[test]
    fn slabs_that_face_each_other_are_apart_though_their_balls_overlap() {
        let part = |z: f32, normal: Option<[f32; 3]>| {
            let cut = normal.map(|normal| (normal, 0.3));
            Placed::part([0.4, 0.2, z], (1.0, cut), (&matrix([0.0; 2], [0.0; 3]), 1.0))
        };
        let up = Some([0.0, 0.0, 1.0]);
        let origin = Placed::part([0.0; 3], (1.0, up.map(|n| (n, 0.3))), (&matrix([0.0; 2], [0.0; 3]), 1.0));
        assert!(distance(&origin, &part(0.75, up), 0.15 - 1e-6).is_some(), "both cut");
        assert!(distance(&origin, &part(0.75, up), 0.15 + 1e-6).is_none(), "not so far");
        assert!(distance(&origin, &part(0.75, None), 0.0).is_none(), "a whole ball");
        assert!(distance(&origin, &part(1.5, None), 0.19).is_some(), "a slab and a ball");
    }
}
