//! Tests of cut balls.

use nearmiss_testdata::arbitrary::{point_in, rng, unit_vector};
use nearmiss_testdata::instructions::levels;
use rand::{Rng, RngExt};

use super::*;

/// Sixteen cut balls; every fourth one is whole.
struct Parts {
    centres: [[f32; 16]; 3],
    normals: [[f32; 16]; 3],
    radii: [f32; 16],
    slabs: [f32; 16],
}

#[expect(clippy::cast_possible_truncation, reason = "stored in single precision")]
fn single(x: f64) -> f32 {
    x as f32
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl Parts {
    fn random(rng: &mut impl Rng, shift: f64) -> Self {
        let mut own =
            Self { centres: [[0.0; 16]; 3], normals: [[0.0; 16]; 3], radii: [0.0; 16], slabs: [0.0; 16] };
        for lane in 0..16 {
            let (centre, normal) = (point_in(rng, 0.5), unit_vector(rng));
            for k in 0..3 {
                own.centres[k][lane] = single(centre[k] + if k == 0 { shift } else { 0.0 });
                own.normals[k][lane] = single(normal[k]);
            }
            own.radii[lane] = rng.random_range(0.05..0.4);
            let share = rng.random_range(0.0..1.2_f32);
            own.slabs[lane] = if lane % 4 == 3 { f32::INFINITY } else { share * own.radii[lane] };
        }
        own
    }

    fn load<S: Simd>(&self, simd: S) -> CutBalls<S> {
        let [radii, slabs] = [&self.radii, &self.slabs].map(|x| f32x16::load_array_ref(simd, x));
        let balls = Balls { centres: load(simd, &self.centres), radii, lanes: 0x7fff };
        let faces = (radii * radii - slabs * slabs).max(0.0).sqrt();
        CutBalls { balls, normals: load(simd, &self.normals), slabs, faces }
    }

    /// A random place of the part in a lane.
    fn place(&self, lane: usize, rng: &mut impl Rng) -> [f64; 3] {
        let of = |rows: &[[f32; 16]; 3]| [0, 1, 2].map(|k| f64::from(rows[k][lane]));
        let (centre, normal) = (of(&self.centres), of(&self.normals));
        // On the boundary of the ball, and moved back onto a face of the slab if it is beyond.
        let out = unit_vector(rng).map(|x| x * f64::from(self.radii[lane]));
        let height = dot(out, normal);
        let most = f64::from(self.slabs[lane]);
        let back = height - height.clamp(-most, most);
        [0, 1, 2].map(|k| centre[k] + out[k] - back * normal[k])
    }
}

/// The extent of a cut ball is the greatest of the places on its outline.
#[test]
fn cut_balls_extend_as_far_as_their_outlines() {
    let rng = &mut rng(813);
    let (mut cut, mut whole) = (0, 0);
    for round in 0..500 {
        let (radius, share) = (rng.random_range(0.1..3.0_f64), rng.random_range(0.0..1.3_f64));
        let slab = if round % 5 == 0 { f64::INFINITY } else { share * radius };
        let angle: f64 = [0.0, 0.5, rng.random_range(0.0..0.5)][round % 3] * std::f64::consts::PI;
        let outline = |step: u32| {
            let own = f64::from(step) * std::f64::consts::TAU / 20_000.0;
            radius.min(slab / own.cos().abs()) * (own - angle).cos()
        };
        let exact = (0..20_000).map(outline).fold(0.0, f64::max);
        for level in levels() {
            let found = dispatch!(level, simd => {
                let all = |x: f64| f32x16::splat(simd, single(x));
                let face = (radius * radius - slab * slab).max(0.0).sqrt();
                extent(all(angle.cos().abs()), [all(radius), all(slab), all(face)]).to_array()[7]
            });
            let found = f64::from(found);
            assert!(found > exact - 1e-6 * radius, "{found} {exact}, {radius} {slab} {angle}");
            assert!(found < exact + 0.011 * radius, "{found} {exact}, {radius} {slab} {angle}");
        }
        if exact < 0.99 * radius {
            cut += 1;
        } else {
            whole += 1;
        }
    }
    assert!(cut > 150 && whole > 150, "{cut} cut, {whole} whole");
}

#[test]
fn gaps_are_below_the_distances_of_all_places() {
    let rng = &mut rng(814);
    let (mut apart, mut better) = (0, 0);
    for round in 0..60 {
        let shift = [0.8, 1.4, 2.0][round % 3];
        let (a, b) = (Parts::random(rng, 0.0), Parts::random(rng, shift));
        let [x, y, z] = [unit_vector(rng), unit_vector(rng), unit_vector(rng)].map(|v| v.map(single));
        // Any axes will do, if they are at right angles.
        let axes = right_angles([x, y, z]);
        let bounds =
            OrientedBox { centre: [single(shift), 0.0, 0.0], half: [0.3, 0.2, 0.02], axes, reach: 0.0 };
        let mut found = levels().into_iter().map(|level| {
            dispatch!(level, simd => {
                let (a, b) = (a.load(simd), b.load(simd));
                let of_balls = {
                    let whole = f32x16::splat(simd, f32::INFINITY);
                    CutBalls { slabs: whole, ..a }.gap_to_others(
                        simd,
                        &CutBalls { slabs: whole, ..b },
                        f32::INFINITY,
                    )
                };
                [
                    a.gap_to_others(simd, &b, f32::INFINITY),
                    a.gap_to_others(simd, &b, 0.1),
                    a.balls.gap_to_box(simd, &bounds),
                    of_balls,
                ]
            })
        });
        let first = found.next().expect("a level");
        for other in found {
            assert!((0..4).all(|k| (other[k] - first[k]).abs() < 1e-5), "{first:?} {other:?}");
        }
        let [gap, enough, of_box, of_balls] = first;
        assert!(gap >= of_balls - 1e-6, "{first:?}");
        assert!((enough - gap.min(0.1)).abs() < 1e-6, "{first:?}");
        better += usize::from(gap > of_balls + 0.01);
        apart += usize::from(gap > 0.0);
        for _ in 0..3000 {
            // The last lane is not in use.
            let [i, j] = [(); 2].map(|()| rng.random_range(0..15));
            let (p, q) = (a.place(i, rng), b.place(j, rng));
            let d = [0, 1, 2].map(|k| p[k] - q[k]);
            assert!(dot(d, d).sqrt() >= f64::from(gap) - 1e-5, "round {round}: {gap}");
            let mut corner = bounds.centre.map(f64::from);
            for k in 0..3 {
                let t = rng.random_range(-1.0..1.0) * f64::from(bounds.half[k]);
                corner = [0, 1, 2].map(|i| corner[i] + t * f64::from(bounds.axes[k][i]));
            }
            let d = [0, 1, 2].map(|k| p[k] - corner[k]);
            assert!(dot(d, d).sqrt() >= f64::from(of_box) - 1e-5, "round {round}: {of_box}");
        }
    }
    assert!(apart > 20 && better > 15, "{apart} apart, {better} better than by balls");
}

/// Three directions at right angles, from any three.
fn right_angles([x, y, _]: [[f32; 3]; 3]) -> [[f32; 3]; 3] {
    use nearmiss_geometry::nalgebra::Vector3;
    let (x, y) = (Vector3::from(x).normalize(), Vector3::from(y));
    let y = (y - x * x.dot(&y)).normalize();
    [x, y, x.cross(&y)].map(Into::into)
}

/// The bounds of the distance of two spheres: where they face each other, the slabs of their points decide.
#[test]
fn spheres_are_proven_apart_by_their_slabs() {
    use nearmiss_geometry::{PointCloud, Pose};
    use nearmiss_hierarchy::{BuildOptions, PointHierarchy};

    use crate::{DistanceOptions, DistancePlan, Pair, Prepared, Scratch};

    let points: Vec<[f64; 3]> = (0..4000)
        .map(|i| {
            let (z, turn) = (1.0 - f64::from(2 * i + 1) / 4000.0, 2.4 * f64::from(i));
            let beside = (1.0 - z * z).sqrt();
            [beside * turn.cos(), beside * turn.sin(), z]
        })
        .collect();
    let cloud = PointCloud::from_positions(&points).unwrap();
    let sphere = PointHierarchy::build(&cloud, &BuildOptions::default()).unwrap();
    let plan = DistancePlan::new(&DistanceOptions::default(), &sphere, &sphere).unwrap();
    let radius = sphere.sampling_radius();
    let (rng, mut scratch) = (&mut rng(815), Scratch::default());
    let (mut lost, mut certified) = (0.0, 0);
    for round in 0..60 {
        let away = [1.0, 1.5, 3.0][round % 3] * radius;
        let at = unit_vector(rng).map(|x| x * (2.0 + away));
        let pose = nearmiss_testdata::arbitrary::rotation(rng).with_translation(at);
        let found = Pair::new(sphere.at(&Pose::IDENTITY), sphere.at(&pose)).distance(&plan, &mut scratch);
        assert!(found.lower <= away && away < found.upper + 0.01 * radius, "{away}: {found:?}");
        lost += (away - found.lower) / radius / 60.0;
        certified += usize::from(found.lower > 0.0);
    }
    assert!(lost < 0.8 && certified == 60, "{lost} local radii lost, {certified} apart");
}
