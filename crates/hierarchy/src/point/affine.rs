//! The motion of the points of a leaf as an affine map, fitted by least squares, and how a disc
//! follows it.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16, mask32x16};
use nearmiss_lanes::vector::{cross, dot, sub, tangents};
use nearmiss_lanes::wide::{
    WIDTH, along, load, put_together, seen_from, spread_out, squared, sum, sum_of_each,
};

use crate::tree::axes::Spread;
use crate::tree::topology::MOST_LEAF_POINTS;

/// The ridge of the fit as a share of the second moments. It draws directions in which the points do
/// not extend, such as the normal of a flat patch, towards the identity.
const RIDGE: f64 = 1e-5;

/// Changes of the spacing by less, as a share, count as none, so that rigid motions keep all radii.
const RIGID: f32 = 1e-3;

/// A leaf at rest: what the fit needs of its points.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Rest {
    middle: [f32; 3],
    /// The inverse of the second moments with the ridge, as xx xy xz yy yz zz.
    inverse: [f32; 6],
    ridge: f32,
    /// The mean normal, up to signs.
    normal: [f32; 3],
}

/// The motion of a leaf since its rest.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Motion {
    /// For each column of the linear map, the cross product of the two others.
    cofactors: [[f32; 3]; 3],
    /// The factor by which the spacing of points in the tangent plane changes: the root of that of
    /// areas.
    pub(crate) spacing: f32,
    /// `false` if spacing or lengths in the tangent plane have changed too much, or no affine map moves
    /// the points.
    pub(crate) is_carried: bool,
}

/// Up to sixteen points of a leaf at rest, side by side.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct RestLanes {
    /// Relative to the middle of the leaf; zero in surplus lanes.
    positions: [[f32; WIDTH]; 3],
    normals: [[f32; WIDTH]; 3],
    /// Local radii; infinite in surplus lanes.
    radii: [f32; WIDTH],
}

/// Puts up to sixteen vectors side by side. Surplus lanes have the vector `rest`.
#[inline(always)]
fn side_by_side(vectors: &[[f32; 3]], rest: [f32; 3]) -> [[f32; WIDTH]; 3] {
    let mut lanes = [[rest[0]; WIDTH], [rest[1]; WIDTH], [rest[2]; WIDTH]];
    spread_out(vectors, &mut lanes);
    lanes
}

fn middle(points: &[[f32; 3]]) -> [f32; 3] {
    // Relative to the first point, where rounding is least.
    let (first, mut sum) = (points[0], [0.0_f32; 3]);
    for p in points {
        let d = sub(*p, first);
        sum = [sum[0] + d[0], sum[1] + d[1], sum[2] + d[2]];
    }
    #[expect(clippy::cast_precision_loss, reason = "at most 64")]
    let count = points.len() as f32;
    [first[0] + sum[0] / count, first[1] + sum[1] / count, first[2] + sum[2] / count]
}

impl Rest {
    /// A leaf with these points and normals.
    pub(crate) fn new(points: &[[f32; 3]], normals: &[[f32; 3]]) -> Self {
        let middle = middle(points);
        let mut s = [0.0_f64; 6];
        for p in points {
            let [x, y, z] = sub(*p, middle).map(f64::from);
            for (sum, product) in s.iter_mut().zip([x * x, x * y, x * z, y * y, y * z, z * z]) {
                *sum += product;
            }
        }
        let ridge = RIDGE * (s[0] + s[3] + s[5]);
        let [a, b, c, d, e, f] = [s[0] + ridge, s[1], s[2], s[3] + ridge, s[4], s[5] + ridge];
        let adjugate =
            [d * f - e * e, c * e - b * f, b * e - c * d, a * f - c * c, b * c - a * e, a * d - b * b];
        let determinant = a * adjugate[0] + b * adjugate[1] + c * adjugate[2];
        #[expect(clippy::cast_possible_truncation, reason = "stored in single precision")]
        let inverse = adjugate.map(|x| (x / determinant) as f32);
        let mut normal = [0.0_f32; 3];
        for n in normals {
            let side = 1.0_f32.copysign(dot(*n, normals[0]));
            normal = [0, 1, 2].map(|k| normal[k] + side * n[k]);
        }
        let length = dot(normal, normal).sqrt();
        let normal = if length > 0.0 { normal.map(|c| c / length) } else { [0.0, 0.0, 1.0] };
        #[expect(clippy::cast_possible_truncation, reason = "stored in single precision")]
        let ridge = ridge as f32;
        Self { middle, inverse, ridge, normal }
    }

    /// Sets `lanes` to the points of this leaf.
    pub(crate) fn spread(
        &self,
        (points, normals, radii): (&[[f32; 3]], &[[f32; 3]], &[f32]),
        lanes: &mut [RestLanes],
    ) {
        let all = points.chunks(WIDTH).zip(normals.chunks(WIDTH)).zip(radii.chunks(WIDTH));
        for (((points, normals), radii), lanes) in all.zip(lanes) {
            lanes.positions = side_by_side(points, self.middle);
            for (row, middle) in lanes.positions.iter_mut().zip(self.middle) {
                row.iter_mut().for_each(|c| *c -= middle);
            }
            lanes.normals = side_by_side(normals, [0.0; 3]);
            lanes.radii = [f32::INFINITY; WIDTH];
            lanes.radii[..radii.len()].copy_from_slice(radii);
        }
    }

    /// Fits the motion from `points`, at rest, to the places `now`. For a leaf that is carried along, the
    /// spacing changes by at most the factor `most` or its reciprocal, and so does the ratio of a length to
    /// the spacing. Each point is within `off` of its radius of its place. Also returns the moments of these
    /// places.
    #[inline(always)]
    pub(crate) fn motion<S: Simd>(
        &self,
        simd: S,
        points: &[RestLanes],
        now: &[[f32; 3]],
        (most, off): (f32, f32),
    ) -> (Motion, Spread) {
        let (first, mut places) = (now[0], [[[0.0; WIDTH]; 3]; MOST_LEAF_POINTS / WIDTH]);
        let mut sums = [f32x16::splat(simd, 0.0); 3];
        for (now, places) in now.chunks(WIDTH).zip(&mut places) {
            *places = side_by_side(now, first);
            // Relative to the first point, where rounding is least.
            let q = seen_from(simd, places, first);
            for k in 0..3 {
                sums[k] += q[k];
            }
        }
        #[expect(clippy::cast_precision_loss, reason = "at most 64")]
        let count = now.len() as f32;
        let middle = [
            first[0] + sum(sums[0]) / count,
            first[1] + sum(sums[1]) / count,
            first[2] + sum(sums[2]) / count,
        ];
        // Rows of Σ (q − q̄)(p − p̄)ᵀ, and six entries of Σ (q − q̄)(q − q̄)ᵀ.
        let mut products = [f32x16::splat(simd, 0.0); WIDTH];
        for (points, places) in points.iter().zip(&places) {
            let (p, mut q) = (load(simd, &points.positions), seen_from(simd, places, middle));
            let is_used: mask32x16<S> =
                f32x16::load_array_ref(simd, &points.radii).simd_lt(f32x16::splat(simd, f32::INFINITY));
            for i in 0..3 {
                q[i] = simd.select_f32x16(is_used, q[i], f32x16::splat(simd, 0.0));
                for k in 0..3 {
                    products[3 * i + k] += q[i] * p[k];
                }
            }
            let [x, y, z] = q;
            for (k, product) in [x * x, x * y, x * z, y * y, y * z, z * z].into_iter().enumerate() {
                products[9 + k] += product;
            }
        }
        let [xx, xy, xz, yx, yy, yz, zx, zy, zz, second @ .., _] = sum_of_each(products);
        let rows = [[xx + self.ridge, xy, xz], [yx, yy + self.ridge, yz], [zx, zy, zz + self.ridge]];
        let [a, b, c, d, e, f] = self.inverse;
        let mut linear = rows;
        for i in 0..3 {
            linear[i] = [dot(rows[i], [a, b, c]), dot(rows[i], [b, d, e]), dot(rows[i], [c, e, f])];
        }
        let [x, y, z] = linear;
        // Functions and arrays instead of `map`: closures within `map` are compiled without the
        // instruction set of their caller.
        let apply = |v: [f32; 3]| [dot(x, v), dot(y, v), dot(z, v)];
        let (u, v) = tangents(self.normal);
        let (u, v) = (apply(u), apply(v));
        let (uu, uv, vv) = (dot(u, u), dot(u, v), dot(v, v));
        // The eigenvalues of the metric in the tangent plane.
        let (mean, half) = (0.5 * (uu + vv), 0.5 * (uu - vv));
        let apart = (half * half + uv * uv).sqrt();
        let [low, high] = [(mean - apart).max(0.0).sqrt(), (mean + apart).sqrt()];
        let spacing = (low * high).sqrt();
        let mut is_carried = spacing * most >= 1.0 && spacing <= most && high <= most * spacing;
        for (points, places) in points.iter().zip(&places) {
            let within = f32x16::load_array_ref(simd, &points.radii) * off;
            let (p, mut d) = (load(simd, &points.positions), seen_from(simd, places, middle));
            for k in 0..3 {
                d[k] -= along(p, linear[k]);
            }
            // Also false for NaN.
            let is_near: mask32x16<S> = squared(d).simd_le(within * within);
            is_carried &= is_near.all_true();
        }
        let column = |k: usize| [linear[0][k], linear[1][k], linear[2][k]];
        let [x, y, z] = [column(0), column(1), column(2)];
        let motion = Motion {
            cofactors: [cross(y, z), cross(z, x), cross(x, y)],
            spacing: if (spacing - 1.0).abs() < RIGID { 1.0 } else { spacing },
            is_carried,
        };
        (motion, Spread::about(count, middle, second))
    }
}

impl Motion {
    /// Moves the unit normals and the local radii of a leaf, which are `before` at rest. A normal stays if
    /// the motion flattens its plane. No radius exceeds `most`.
    #[inline(always)]
    pub(crate) fn carry<S: Simd>(
        &self,
        simd: S,
        before: &[RestLanes],
        (normals, radii): (&mut [[f32; 3]], &mut [f32]),
        most: f32,
    ) {
        let [x, y, z] = &self.cofactors;
        // Where points are fitted anew, these are upper limits for those of their neighbours.
        let spacing = match self.spacing {
            spacing if self.is_carried => spacing,
            spacing if spacing.is_finite() => spacing.max(1.0),
            _ => 1.0,
        };
        let mut rows = [[0.0; WIDTH]; 3];
        let moved = normals.chunks_mut(WIDTH).zip(radii.chunks_mut(WIDTH));
        for (before, (normals, radii)) in before.iter().zip(moved) {
            let moved =
                (f32x16::load_array_ref(simd, &before.radii) * spacing).min(f32x16::splat(simd, most));
            let moved = moved.to_array();
            match radii.first_chunk_mut() {
                Some(radii) => *radii = moved,
                None => radii.copy_from_slice(&moved[..radii.len()]),
            }
            let n = load(simd, &before.normals);
            let mut turned = n;
            for k in 0..3 {
                turned[k] = along(n, [x[k], y[k], z[k]]);
            }
            let length = squared(turned).sqrt();
            let is_sound: mask32x16<S> = length.simd_gt(f32::MIN_POSITIVE) & length.simd_le(f32::MAX);
            let scale = f32x16::splat(simd, 1.0) / length;
            for k in 0..3 {
                rows[k] = simd.select_f32x16(is_sound, turned[k] * scale, n[k]).to_array();
            }
            put_together(&rows, normals);
        }
    }
}

#[cfg(test)]
mod tests {
    use fearless_simd::{Level, dispatch};

    use super::*;

    /// Returns where a normal points, taken among others.
    fn turned(motion: &Motion, normal: [f32; 3]) -> [f32; 3] {
        let before: Vec<[f32; 3]> = (0..20).map(|i| if i == 17 { normal } else { [0.0, 1.0, 0.0] }).collect();
        let (mut normals, mut radii) = (vec![[f32::NAN; 3]; 20], vec![f32::NAN; 20]);
        let mut lanes = [RestLanes::default(); 2];
        Rest::default().spread((&before, &before, &[0.5; 20]), &mut lanes);
        let moved = (&mut normals[..], &mut radii[..]);
        dispatch!(Level::new(), simd => motion.carry(simd, &lanes, moved, 0.6));
        let least = if motion.is_carried { 0.0 } else { 1.0 };
        let expected =
            if motion.spacing.is_finite() { (0.5 * motion.spacing.max(least)).min(0.6) } else { 0.5 };
        assert!(radii.iter().all(|r| *r == expected), "{radii:?}");
        normals[17]
    }

    fn patch() -> Vec<[f32; 3]> {
        let lattice = (0..16_u8).map(|i| [f32::from(i % 4), f32::from(i / 4)]);
        lattice.map(|[x, y]| [x + 100.0, y - 50.0, 0.05 * (x - 1.5) * (x - 1.5)]).collect()
    }

    fn motion_by(f: impl Fn([f32; 3]) -> [f32; 3]) -> Motion {
        let (points, normals) = (patch(), [[0.0, 0.0, 1.0]; 16]);
        let (rest, mut lanes) = (Rest::new(&points, &normals), [RestLanes::default()]);
        rest.spread((&points, &normals, &[1.4; 16]), &mut lanes);
        let now: Vec<[f32; 3]> = points.iter().map(|p| f(*p)).collect();
        dispatch!(Level::new(), simd => rest.motion(simd, &lanes, &now, (1.25, 0.2))).0
    }

    fn is_near(a: [f32; 3], b: [f32; 3]) -> bool {
        (0..3).all(|k| (a[k] - b[k]).abs() < 5e-3)
    }

    #[test]
    fn the_moments_of_the_places_are_those_of_the_points() {
        for count in [1_u8, 15, 16, 17, 40] {
            let points: Vec<[f32; 3]> = (0..count)
                .map(|i| [f32::from(i % 4) + 100.0, f32::from(i / 4), 0.1 * f32::from(i)])
                .collect();
            let (rest, mut lanes) =
                (Rest::new(&points, &vec![[0.0, 0.0, 1.0]; points.len()]), [RestLanes::default(); 3]);
            rest.spread((&points, &points, &vec![1.0; points.len()]), &mut lanes);
            let lanes = &lanes[..points.len().div_ceil(WIDTH)];
            let now: Vec<[f32; 3]> = points.iter().map(|[x, y, z]| [x + 3.0, y - z, 2.0 * z]).collect();
            let (_, found) = dispatch!(Level::new(), simd => rest.motion(simd, lanes, &now, (1.25, 0.2)));
            let expected = Spread::of(&now);
            let scale = 1.0 + expected.second.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
            let is_near = |a: &[f64], b: &[f64], off: f64| a.iter().zip(b).all(|(a, b)| (a - b).abs() <= off);
            assert!(is_near(&found.mean, &expected.mean, 2e-5), "{count}: {found:?}, {expected:?}");
            assert!(
                is_near(&found.second, &expected.second, 1e-5 * scale),
                "{count}: {found:?}, {expected:?}"
            );
        }
    }

    #[test]
    fn a_rigid_motion_keeps_lengths_and_turns_normals() {
        let still = motion_by(|p| p);
        assert!(still.is_carried && still.spacing == 1.0, "{still:?}");
        assert!(is_near(turned(&still, [0.6, 0.0, 0.8]), [0.6, 0.0, 0.8]), "{still:?}");
        // A quarter turn about the y axis.
        let quarter = motion_by(|[x, y, z]| [z + 7.0, y, -x]);
        assert!(quarter.is_carried && quarter.spacing == 1.0, "{quarter:?}");
        assert!(is_near(turned(&quarter, [0.0, 0.0, 1.0]), [1.0, 0.0, 0.0]), "{quarter:?}");
        assert!(is_near(turned(&quarter, [0.2, 0.0, 0.98]), [0.98, 0.0, -0.2]), "{quarter:?}");
    }

    #[test]
    fn a_shear_turns_normals_by_the_cofactors() {
        let sheared = motion_by(|[x, y, z]| [x, y, z + 0.2 * x]);
        let length = (1.0_f32 + 0.04).sqrt();
        assert!(
            is_near(turned(&sheared, [0.0, 0.0, 1.0]), [-0.2 / length, 0.0, 1.0 / length]),
            "{sheared:?}"
        );
        assert!((sheared.spacing - length.sqrt()).abs() < 1e-3 && sheared.is_carried, "{sheared:?}");
    }

    #[test]
    fn stretches_collapses_and_tears_are_not_carried() {
        let wider = motion_by(|[x, y, z]| [1.5 * x, y, z]);
        assert!(wider.is_carried && (wider.spacing - 1.5_f32.sqrt()).abs() < 1e-3, "{wider:?}");
        assert!(motion_by(|[x, y, z]| [1.2 * x, 1.2 * y, z]).is_carried, "within the factor");
        assert!(!motion_by(|[x, y, z]| [1.3 * x, 1.3 * y, z]).is_carried, "stretched");
        assert!(!motion_by(|[x, y, z]| [1.6 * x, y, z]).is_carried, "stretched along one axis");
        assert!(!motion_by(|[x, y, z]| [x, 0.6 * y, z]).is_carried, "compressed");
        assert!(motion_by(|[x, y, z]| [1.2 * x, y / 1.2, z]).is_carried, "areas are kept");
        assert!(!motion_by(|[x, y, z]| [1.3 * x, y / 1.3, z]).is_carried, "lengths change too much");
        assert!(!motion_by(|_| [1.0, 2.0, 3.0]).is_carried, "in one point");
        assert!(!motion_by(|[x, y, z]| [x, y, if x > 101.0 { z + 1.5 } else { z }]).is_carried, "torn");
        assert!(!motion_by(|[x, ..]| [x, f32::NAN, 0.0]).is_carried, "NaN");
        let flat = turned(&motion_by(|_| [1.0, 2.0, 3.0]), [0.0, 0.6, 0.8]);
        assert!(flat.iter().all(|c| c.is_finite()), "a direction, whatever it is: {flat:?}");
    }
}
