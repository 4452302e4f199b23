//! f over a square that cuts through a scan.

use nearmiss::geometry::nalgebra::Vector3;
use nearmiss::surface::symmetric_eigen;
use nearmiss::{PointHierarchy, Status};
use rayon::prelude::*;

use super::place::{Centre, Place};
use super::signs::{Pair, follow};

/// A square in the stored frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Slice {
    pub(crate) middle: Vector3<f64>,
    /// Unit directions: to the right, up, and out of the square.
    pub(crate) axes: [Vector3<f64>; 3],
    /// Half a side.
    pub(crate) half: f64,
}

/// f at a place of a slice.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Value {
    /// The value, in the stored frame.
    pub(crate) f: f64,
    pub(crate) bandwidth: f64,
    /// `true` if a zero there would be a point of the surface.
    pub(crate) counts: bool,
}

/// f over a slice, row by row from the top; `None` where it is undefined.
#[derive(Debug, Clone)]
pub(crate) struct Field {
    pub(crate) values: Vec<Option<Value>>,
    /// Neighbours whose normals point to opposite sides.
    pub(crate) flips: Vec<Pair>,
}

/// Number of places tried for the most informative slice.
const CANDIDATES: usize = 300;

impl Slice {
    /// Returns the slice about a cloud point, of half side `half`, that cuts the surface as
    /// squarely as possible and contains the greatest variety of its directions: where it curves,
    /// folds, or comes back.
    pub(crate) fn telling(scan: &PointHierarchy, half: f64) -> Self {
        let stride = scan.len().div_ceil(CANDIDATES);
        let all: Vec<usize> = (0..scan.len()).step_by(stride).collect();
        let rated = all.par_iter().map(|&i| {
            let middle = Vector3::from(scan.positions()[i].map(f64::from));
            Self::across(scan, middle, half)
        });
        let best = rated.reduce_with(|a, b| if b.1 > a.1 { b } else { a });
        best.map_or_else(|| Self::facing(Vector3::zeros(), Vector3::z(), half), |(slice, _)| slice)
    }

    /// Returns the slice about `middle` that cuts the surface there most squarely, and its rating.
    /// Both follow from Σnnᵀ of the normals n within `half`: the least eigenvalue measures how
    /// obliquely the surface is cut, the second how much it turns.
    fn across(scan: &PointHierarchy, middle: Vector3<f64>, half: f64) -> (Self, f64) {
        let mut sums = [0.0; 6];
        for (p, n) in scan.positions().iter().zip(scan.normals()) {
            if (Vector3::from(p.map(f64::from)) - middle).norm() < half {
                let [x, y, z] = n.map(f64::from);
                for (sum, v) in sums.iter_mut().zip([x * x, x * y, x * z, y * y, y * z, z * z]) {
                    *sum += v;
                }
            }
        }
        let eigen = symmetric_eigen(sums);
        let [oblique, turning, _] = eigen.values;
        (Self::facing(middle, eigen.vectors[0].into(), half), turning - 2.0 * oblique)
    }

    /// Returns the slice with this unit normal.
    pub(crate) fn facing(middle: Vector3<f64>, normal: Vector3<f64>, half: f64) -> Self {
        let upward = if normal.y.abs() < 0.9 { Vector3::y() } else { Vector3::z() };
        let right = upward.cross(&normal).normalize();
        Self { middle, axes: [right, normal.cross(&right), normal], half }
    }

    /// Returns the middle of a pixel of a picture of `side` pixels a side.
    fn place(&self, pixel: usize, side: usize) -> Vector3<f64> {
        #[expect(clippy::cast_precision_loss, reason = "pixels")]
        let along = |k: usize| ((2 * k + 1) as f64 / side as f64 - 1.0) * self.half;
        self.middle + self.axes[0] * along(pixel % side) - self.axes[1] * along(pixel / side)
    }

    /// Returns the points at most `thick` off the slice, as offsets to the right of and above its
    /// middle.
    pub(crate) fn points(&self, scan: &PointHierarchy, thick: f64) -> Vec<[f64; 2]> {
        let near = scan.positions().iter().filter_map(|p| {
            let d = Vector3::from(p.map(f64::from)) - self.middle;
            let [x, y, z] = self.axes.map(|axis| axis.dot(&d));
            let is_in = z.abs() <= thick && x.abs().max(y.abs()) <= self.half;
            is_in.then_some([x, y])
        });
        near.collect()
    }

    /// Evaluates f at `side` times `side` places, with the covariance about `centre`.
    pub(crate) fn evaluate(&self, scan: &PointHierarchy, centre: Centre, side: usize) -> Field {
        let at = |pixel: usize| {
            let x = self.place(pixel, side);
            let place = Place::new(scan, x)?;
            let counts = scan.evaluate(x.into()).status == Status::Ok;
            Some((place, counts))
        };
        let all: Vec<_> = (0..side * side).into_par_iter().map(at).collect();
        let normal =
            |found: &Option<(Place, bool)>| found.map_or_else(Vector3::zeros, |p| p.0.normal(centre));
        let normals: Vec<Vector3<f64>> = all.par_iter().map(normal).collect();
        // From the points outwards, and first along places whose normals agree. Signs then disagree
        // only where they must.
        let doubt = |[i, j]: Pair| {
            let away = |(place, _): (Place, bool)| place.offset.norm() / place.bandwidth;
            let furthest = away(all[i]?).max(away(all[j]?));
            Some((furthest + 1.0 - normals[i].dot(&normals[j]).abs(), [i, j]))
        };
        let neighbours = (0..side * side).flat_map(|i| {
            let right = (i % side + 1 < side).then_some([i, i + 1]);
            let down = (i + side < side * side).then_some([i, i + side]);
            right.into_iter().chain(down)
        });
        let (signs, flips) = follow(&normals, neighbours.filter_map(doubt).collect());
        let value = |i: usize| {
            let (place, counts) = all[i]?;
            Some(Value { f: signs[i] * normals[i].dot(&place.offset), bandwidth: place.bandwidth, counts })
        };
        Field { values: (0..side * side).map(value).collect(), flips }
    }
}

#[cfg(test)]
mod tests {
    use nearmiss::{BuildOptions, PointCloud, Scan};
    use nearmiss_testdata::shapes::{Sampling, plates, torus};

    use super::*;

    fn scan(points: &[[f64; 3]]) -> Scan {
        Scan::build(&PointCloud::from_positions(points).unwrap(), &BuildOptions::default()).unwrap()
    }

    #[test]
    fn across_a_torus_f_is_the_distance_and_has_sides() {
        let torus = torus(1.0, 0.4).sample(Sampling::clean(0.05));
        let scan = scan(&torus.points);
        let slice = Slice::facing(Vector3::new(1.0, 0.0, 0.0), Vector3::y(), 0.5);
        let field = slice.evaluate(&scan, Centre::Mean, 60);
        let mut on_surface = [0, 0];
        for (i, value) in field.values.iter().enumerate() {
            let Some(Value { f, counts: true, .. }) = *value else { continue };
            let x = slice.place(i, 60);
            // The surface shrinks by h²H/2, here 0.004 at most.
            let exact = torus.distance(x.into());
            assert!((f.abs() - exact).abs() < 0.006, "{f} at {x:?}, {exact} from the torus");
            if exact > 0.01 {
                let inside = (x - slice.middle).norm() < 0.4;
                on_surface[usize::from(inside == (f > 0.0))] += 1;
            }
        }
        assert!(on_surface.iter().sum::<usize>() > 300 && on_surface.contains(&0), "sides: {on_surface:?}");
    }

    #[test]
    fn flips_lie_between_sheets_and_nowhere_else() {
        // Two bandwidths apart.
        let scan = scan(&plates(1.5, 1.5, 0.11).sample(Sampling::clean(0.04)).points);
        let slice = Slice::facing(Vector3::zeros(), Vector3::y(), 0.3);
        let field = slice.evaluate(&scan, Centre::Mean, 120);
        assert!(field.flips.len() > 30, "{} flips", field.flips.len());
        for pair in &field.flips {
            let height = slice.place(pair[0], 120).z.abs();
            assert!(height < 0.05, "a flip at height {height}");
        }
    }

    #[test]
    fn the_telling_slice_cuts_squarely() {
        let scan = scan(&torus(1.0, 0.3).sample(Sampling::clean(0.04)).points);
        let slice = Slice::telling(&scan, 0.9);
        let [right, up, out] = slice.axes;
        let skew = right.dot(&up).abs() + up.dot(&out).abs() + (right.cross(&up) - out).norm();
        assert!(skew < 1e-9, "right-handed axes, {skew} off");
        // A piece of the tube is within 0.9 of one of its points. Cut across, it is round.
        let level = (slice.middle.x.hypot(slice.middle.y), slice.axes[2].z.abs());
        assert!(level.1 < 0.2, "cut across the tube: {slice:?}");
    }
}
