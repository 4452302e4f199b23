//! Blue noise: samples keep their distance from each other and cover the surface, on both sides.
#![expect(clippy::unwrap_used, reason = "a test may panic")]

use std::f64::consts::TAU;

use nearmiss_geometry::TriangleMesh;
use nearmiss_mesh::{SampleError, SampleOptions, SamplePattern, SampleSize, sample, unit_normal};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

type Point = [f64; 3];

fn blue_noise(mesh: &TriangleMesh, samples: SampleSize, seed: u64) -> Vec<Point> {
    let options = SampleOptions::new(samples).with_pattern(SamplePattern::BlueNoise).with_seed(seed);
    sample(mesh, &options).unwrap()
}

fn distance(p: Point, q: Point) -> f64 {
    (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt()
}

/// Least distance of two of the points.
fn least_distance(points: &[Point]) -> f64 {
    let of = |i: usize| points[..i].iter().map(move |q| distance(points[i], *q));
    (1..points.len()).flat_map(of).fold(f64::INFINITY, f64::min)
}

/// Greatest distance from a place to the nearest point.
fn farthest(places: &[Point], points: &[Point]) -> f64 {
    let nearest = |p: &Point| points.iter().map(|q| distance(*p, *q)).fold(f64::INFINITY, f64::min);
    places.iter().map(nearest).fold(0.0, f64::max)
}

fn corners(mesh: &TriangleMesh) -> impl Iterator<Item = [Point; 3]> {
    mesh.triangles().iter().map(|t| t.map(|v| mesh.vertices()[v as usize]))
}

fn area(mesh: &TriangleMesh) -> f64 {
    let of = |[a, b, c]: [Point; 3]| {
        let [u, v] = [b, c].map(|p| [0, 1, 2].map(|k| p[k] - a[k]));
        let cross = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        0.5 * distance(cross, [0.0; 3])
    };
    corners(mesh).map(of).sum()
}

/// Places on all triangles: the corners, and others at random.
fn places(mesh: &TriangleMesh, per_triangle: usize) -> Vec<Point> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(99);
    let mut places = Vec::new();
    for [a, b, c] in corners(mesh) {
        places.extend([a, b, c]);
        for _ in 0..per_triangle {
            let [s, t]: [f64; 2] = [rng.random(), rng.random()];
            let [s, t] = if s + t > 1.0 { [1.0 - s, 1.0 - t] } else { [s, t] };
            places.push([0, 1, 2].map(|k| a[k] + s * (b[k] - a[k]) + t * (c[k] - a[k])));
        }
    }
    places
}

/// Turns triangles at random.
fn turned(mesh: &TriangleMesh) -> TriangleMesh {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
    let turn = |&[a, b, c]: &[u32; 3]| if rng.random() { [a, b, c] } else { [b, a, c] };
    let triangles = mesh.triangles().iter().map(turn).collect();
    TriangleMesh::new(mesh.vertices().to_vec(), triangles).unwrap()
}

/// A box with a corner at the origin.
fn cuboid([x, y, z]: Point) -> TriangleMesh {
    let corner =
        |bits: u8| [(0, x), (1, y), (2, z)].map(|(k, side)| if bits >> k & 1 == 1 { side } else { 0.0 });
    let vertices = (0..8).map(corner).collect();
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = faces.iter().flat_map(|f| [[f[0], f[1], f[2]], [f[0], f[2], f[3]]]).collect();
    TriangleMesh::new(vertices, triangles).unwrap()
}

/// A torus of small triangles with radii 1 and 0.4.
fn torus(rings: u32, sides: u32) -> TriangleMesh {
    let vertex = |i: u32| {
        let [u, v] = [(i / sides, rings), (i % sides, sides)].map(|(i, n)| TAU * f64::from(i) / f64::from(n));
        let out = 1.0 + 0.4 * v.cos();
        [out * u.cos(), out * u.sin(), 0.4 * v.sin()]
    };
    let at = |i: u32, j: u32| i % rings * sides + j % sides;
    let quads = (0..rings * sides).map(|q| (q / sides, q % sides));
    let halves = |(i, j): (u32, u32)| {
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        [[a, b, c], [a, c, d]]
    };
    TriangleMesh::new((0..rings * sides).map(vertex).collect(), quads.flat_map(halves).collect()).unwrap()
}

fn of_triangles(all: &[[Point; 3]]) -> TriangleMesh {
    let vertices: Vec<Point> = all.iter().flatten().copied().collect();
    let triangles = (0_u32..).step_by(3).take(all.len()).map(|i| [i, i + 1, i + 2]).collect();
    TriangleMesh::new(vertices, triangles).unwrap()
}

const TRIANGLE: [Point; 3] = [[0.1, 0.2, 0.3], [2.1, 0.4, 0.3], [0.4, 1.7, 0.9]];
const NEEDLE: [Point; 3] = [[0.0, 0.0, 0.0], [5.0, 1.0, 2.0], [2.0, 0.4 + 1e-7, 0.8]];

/// The distances that a spacing promises, for surfaces without opposite sides.
#[test]
fn samples_at_a_spacing_are_apart_and_cover_all() {
    let line = of_triangles(&[[[0.0; 3], [3.0, 1.0, 0.0], [1.5, 0.5, 0.0]]]);
    let point = of_triangles(&[[[7.0, 8.0, 9.0]; 3]]);
    let far = [3.2e6, -5.1e6, 100.0];
    let moved = of_triangles(&[TRIANGLE.map(|p| [0, 1, 2].map(|k| p[k] + far[k]))]);
    let meshes = [
        ("cube", cuboid([1.0; 3]), [0.21, 0.07]),
        ("torus", torus(90, 40), [0.35, 0.11]),
        ("turned torus", turned(&torus(90, 40)), [0.35, 0.11]),
        ("triangle", of_triangles(&[TRIANGLE]), [10.0, 0.05]),
        ("far triangle", moved, [0.3, 0.05]),
        ("needle", of_triangles(&[NEEDLE]), [0.5, 0.01]),
        ("line", line, [0.5, 0.01]),
        ("point", point, [1.0, 1e-6]),
    ];
    for (name, mesh, spacings) in &meshes {
        let places = places(mesh, (5000 / mesh.triangles().len()).max(1));
        for spacing in *spacings {
            for seed in 0..2 {
                let points = blue_noise(mesh, SampleSize::Spacing(spacing), seed);
                let apart = least_distance(&points);
                assert!(apart >= 0.95 * spacing * (1.0 - 1e-6), "{name}: {apart} apart at {spacing}");
                let farthest = farthest(&places, &points);
                assert!(farthest <= spacing, "{name}: {farthest} from a sample at {spacing}");
                assert_eq!(points, blue_noise(mesh, SampleSize::Spacing(spacing), seed), "{name}, again");
                let off = points.iter().step_by(7).map(|p| nearest_place(mesh, *p)).fold(0.0, f64::max);
                assert!(off < 2e-9, "{name}: {off} off the mesh");
            }
        }
    }
    let seeds = [0, 1].map(|seed| blue_noise(&meshes[0].1, SampleSize::Spacing(0.2), seed));
    assert_ne!(seeds[0], seeds[1]);
    assert_eq!(blue_noise(&meshes[7].1, SampleSize::Spacing(1.0), 0), [[7.0, 8.0, 9.0]]);
    // A line is no longer than its samples are apart, and not much shorter.
    let on_line = blue_noise(&meshes[6].1, SampleSize::Spacing(0.01), 0).len();
    assert!((158..=333).contains(&on_line), "{on_line} samples on a line of 316 spacings");
}

/// Returns the distance from `p` to the plane of the nearest triangle that contains its foot, or to
/// the nearest edge.
fn nearest_place(mesh: &TriangleMesh, p: Point) -> f64 {
    let dot = |a: Point, b: Point| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let to = |a: Point, b: Point| [0, 1, 2].map(|k| b[k] - a[k]);
    let of_edge = |a: Point, b: Point| {
        let along = to(a, b);
        let share = (dot(to(a, p), along) / dot(along, along)).clamp(0.0, 1.0);
        let share = if share.is_nan() { 0.0 } else { share };
        distance(p, [0, 1, 2].map(|k| a[k] + share * along[k]))
    };
    let of_triangle = |[a, b, c]: [Point; 3]| {
        let edges = of_edge(a, b).min(of_edge(b, c)).min(of_edge(c, a));
        let Some(n) = unit_normal(&[a, b, c]) else { return edges };
        let cross = |a: Point, b: Point| {
            [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
        };
        let sides = [(a, to(a, b)), (b, to(b, c)), (c, to(c, a))];
        let is_above = sides.iter().all(|(from, side)| dot(cross(*side, to(*from, p)), n) >= 0.0);
        if is_above { dot(to(a, p), n).abs() } else { edges }
    };
    corners(mesh).map(of_triangle).fold(f64::INFINITY, f64::min)
}

/// A box thinner than the spacing: both sides are covered by samples of their own.
#[test]
fn each_side_of_a_thin_sheet_is_covered() {
    let thin = cuboid([1.0, 0.8, 0.01]);
    for mesh in [&thin, &turned(&thin)] {
        for (samples, apart, covered) in
            [(SampleSize::Spacing(0.1), 0.0949, 0.1), (SampleSize::Count(200), 0.06, 0.12)]
        {
            let points = blue_noise(mesh, samples, 0);
            for (z, other) in [(0.0, 0.01), (0.01, 0.0)] {
                let is_at = |p: &Point, z: f64| (p[2] - z).abs() < 1e-9;
                // The rim faces neither side, so its samples count for both.
                let side: Vec<Point> = points.iter().filter(|p| !is_at(p, other)).copied().collect();
                let places: Vec<Point> = places(mesh, 3000).into_iter().filter(|p| is_at(p, z)).collect();
                let farthest = farthest(&places, &side);
                assert!(places.len() > 5000 && farthest <= covered, "{farthest} for {samples:?}");
                let least = least_distance(&side);
                assert!(least > apart, "{least} apart for {samples:?}");
            }
        }
    }
}

/// The relative radius: the least distance over that of the densest arrangement of as many points.
/// Between 0.65 and 0.85 for good blue noise (Lagae & Dutré 2008).
#[test]
fn the_relative_radius_is_that_of_blue_noise() {
    let square = of_triangles(&[
        [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]],
        [[0.0; 3], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]],
    ]);
    for (name, mesh) in [("torus", torus(60, 40)), ("cube", cuboid([1.0; 3])), ("square", square)] {
        for seed in 0..3 {
            for samples in [SampleSize::Count(2000), SampleSize::Spacing((area(&mesh) / 2000.0).sqrt())] {
                let points = blue_noise(&mesh, samples, seed);
                let count = f64::from(u32::try_from(points.len()).unwrap());
                let densest = (2.0 / 3.0_f64.sqrt() * area(&mesh) / count).sqrt();
                let relative = least_distance(&points) / densest;
                println!("{name} {samples:?} {} {relative}", points.len());
                assert!((0.65..0.85).contains(&relative), "{name}: {relative} for {samples:?}");
            }
        }
    }
    // Independent places are nearer by far.
    let options = SampleOptions::new(SampleSize::Count(2000));
    let random = least_distance(&sample(&torus(60, 40), &options).unwrap());
    let densest = (2.0 / 3.0_f64.sqrt() * area(&torus(60, 40)) / 2000.0).sqrt();
    assert!(random < 0.15 * densest, "{random}, densest {densest}");
}

#[test]
fn a_number_of_samples_is_met_exactly() {
    let thin = of_triangles(&[NEEDLE]);
    let mixed =
        of_triangles(&[TRIANGLE, [[9.0; 3]; 3], NEEDLE, [[4.0, 0.0, 0.0], [5.0, 0.0, 0.0], [6.0, 0.0, 0.0]]]);
    for mesh in [&cuboid([1.0, 1.0, 1e-3]), &of_triangles(&[TRIANGLE]), &thin, &mixed, &torus(90, 60)] {
        for count in [1, 2, 3, 7, 100, 1501] {
            let points = blue_noise(mesh, SampleSize::Count(count), 5);
            assert_eq!(points.len(), count as usize);
            assert_eq!(points, blue_noise(mesh, SampleSize::Count(count), 5));
        }
        assert_ne!(blue_noise(mesh, SampleSize::Count(100), 1), blue_noise(mesh, SampleSize::Count(100), 2));
    }
    // Samples of a needle are spread along it.
    let mut along: Vec<f64> =
        blue_noise(&thin, SampleSize::Count(100), 0).iter().map(|p| p[0] / 5.0).collect();
    along.sort_by(f64::total_cmp);
    let steps = along.windows(2).map(|pair| pair[1] - pair[0]);
    let [least, most] = [steps.clone().fold(1.0, f64::min), steps.fold(0.0, f64::max)];
    assert!(least > 0.002, "{least} between samples");
    assert!(along[0] < 0.15 && along[99] > 0.85 && most < 0.04, "{along:?}");
}

#[test]
fn what_cannot_be_sampled_is_refused() {
    let options = |samples| SampleOptions::new(samples).with_pattern(SamplePattern::BlueNoise);
    let (spacing, count) = (|s| options(SampleSize::Spacing(s)), options(SampleSize::Count(9)));
    let empty = TriangleMesh::default();
    assert_eq!(sample(&empty, &spacing(0.1)), Ok(vec![]));
    assert_eq!(sample(&empty, &count), Err(SampleError::NoArea));
    let line = of_triangles(&[[[0.0; 3], [3.0, 0.0, 0.0], [1.0, 0.0, 0.0]]]);
    assert_eq!(sample(&line, &count), Err(SampleError::NoArea));
    for wrong in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(sample(&line, &spacing(wrong)), Err(SampleError::Spacing { .. })), "{wrong}");
    }
    for mesh in [&line, &cuboid([1.0; 3])] {
        for small in [1e-10, 1e-300] {
            assert!(matches!(sample(mesh, &spacing(small)), Err(SampleError::TooMany { .. })), "{small}");
        }
    }
    let broken = TriangleMesh::new(vec![[0.0; 3], [1.0, f64::NAN, 0.0]], vec![[0, 1, 1]]).unwrap();
    assert_eq!(sample(&broken, &spacing(0.1)), Err(SampleError::NotFinite { vertex: 1 }));
    // Spacings finer than the coordinates are rounded.
    let point = of_triangles(&[[[1e9, 1e9, 1e9]; 3]]);
    assert_eq!(blue_noise(&point, SampleSize::Spacing(1e-12), 0), [[1e9; 3]]);
    let huge = of_triangles(&[[[-1e150, 0.0, 0.0], [1e150, 0.0, 0.0], [0.0, 1e150, 1e149]]]);
    assert!(blue_noise(&huge, SampleSize::Spacing(1e149), 0).len() > 50);
}
