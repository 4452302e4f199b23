//! Samples are on the mesh and as dense as requested everywhere.
#![expect(clippy::unwrap_used, reason = "a test may panic")]

use nearmiss_geometry::TriangleMesh;
use nearmiss_mesh::{
    Lattice, SampleError, SampleOptions, SamplePattern, SampleSize, lattice_samples, sample,
};

/// Triangles of many shapes: right, flat, needle-thin, obtuse, tiny, huge, without area, a point.
const CORNERS: [[[f64; 3]; 3]; 9] = [
    [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
    [[0.0, 0.0, 1.0], [2.0, 0.3, 1.0], [1.0, 0.1, 1.5]],
    [[0.0, 5.0, 0.0], [6.0, 5.0, 0.2], [0.0, 5.003, 0.0]],
    [[0.0, 0.0, 2.0], [3.0, 0.0, 2.0], [-1.0, 0.2, 2.2]],
    [[9.0, 9.0, 9.0], [9.001, 9.0, 9.0], [9.0, 9.001, 9.0]],
    [[-8.0, -8.0, 0.0], [-2.0, -7.0, 3.0], [-8.0, -1.0, -3.0]],
    [[4.0, 0.0, 0.0], [5.0, 1.0, 1.0], [4.5, 0.5, 0.5]],
    [[7.0, 7.0, 7.0], [7.0, 7.0, 7.0], [7.0, 7.0, 7.0]],
    [[0.0, -3.0, 0.0], [0.0, -3.0, 1.0], [0.0, -2.0, 0.5]],
];

fn mesh() -> TriangleMesh {
    let vertices: Vec<[f64; 3]> = CORNERS.iter().flatten().copied().collect();
    let triangles = (0..9).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    TriangleMesh::new(vertices, triangles).unwrap()
}

/// Points on a grid over a triangle: corners, sides and inside.
fn places([a, b, c]: [[f64; 3]; 3], n: u16) -> impl Iterator<Item = [f64; 3]> {
    (0..=n).flat_map(move |i| {
        (0..=n - i).map(move |j| {
            let [s, t] = [i, j].map(|x| f64::from(x) / f64::from(n));
            [0, 1, 2].map(|k| a[k] + s * (b[k] - a[k]) + t * (c[k] - a[k]))
        })
    })
}

fn distance(p: [f64; 3], q: [f64; 3]) -> f64 {
    (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt()
}

/// Returns the distance from `p` to the nearest point of a dense grid on the triangles, which
/// exceeds the distance to the mesh by at most half a grid step.
fn off_the_mesh(p: [f64; 3]) -> f64 {
    CORNERS
        .iter()
        .flat_map(|corners| places(*corners, 60))
        .map(|q| distance(p, q))
        .fold(f64::INFINITY, f64::min)
}

#[test]
fn no_place_is_further_from_a_sample_than_asked() {
    for pattern in [SamplePattern::Regular, SamplePattern::Random, SamplePattern::BlueNoise] {
        for spacing in [0.5, 0.13] {
            let options = SampleOptions::new(SampleSize::Spacing(spacing)).with_pattern(pattern).with_seed(3);
            let points = sample(&mesh(), &options).unwrap();
            let mut farthest = 0.0_f64;
            for corners in CORNERS {
                for p in places(corners, 40) {
                    let nearest = points.iter().map(|q| distance(p, *q)).fold(f64::INFINITY, f64::min);
                    farthest = farthest.max(nearest);
                }
            }
            assert!(farthest <= spacing, "{farthest} from a sample at spacing {spacing}");
            assert!(
                farthest > 0.4 * spacing,
                "{farthest} at spacing {spacing}: far more samples than needed"
            );
            for p in points.iter().step_by(17) {
                assert!(off_the_mesh(*p) < 0.12, "{p:?} is off the mesh");
            }
            assert_eq!(sample(&mesh(), &options).unwrap(), points, "the same again");
        }
    }
    let options = SampleOptions::new(SampleSize::Spacing(0.13));
    let rows = sample(&mesh(), &options).unwrap();
    let moved = sample(&mesh(), &options.with_pattern(SamplePattern::Random)).unwrap();
    assert!(moved.len() < 2 * rows.len(), "{} in rows, {} moved", rows.len(), moved.len());
}

#[test]
fn a_number_of_samples_is_spread_by_area() {
    // Two squares, one with nine times the area of the other, in four triangles.
    let square =
        |x: f64, side: f64| [[x, 0.0, 0.0], [x + side, 0.0, 0.0], [x + side, side, 0.0], [x, side, 0.0]];
    let vertices = [square(0.0, 1.0), square(5.0, 3.0)].concat();
    let mesh = TriangleMesh::new(vertices, vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]).unwrap();
    for seed in 0..5 {
        let points = sample(&mesh, &SampleOptions::new(SampleSize::Count(10_000)).with_seed(seed)).unwrap();
        assert_eq!(points.len(), 10_000);
        let small = points.iter().filter(|p| p[0] <= 1.0).count();
        assert!(small.abs_diff(1000) <= 2, "{small} of 10000 on a tenth of the area");
        // Samples are uniform within a triangle too: about 1000 in each of 9 equal cells, within
        // five standard deviations.
        for cell in 0..9_u32 {
            let [x, y] = [f64::from(cell % 3), f64::from(cell / 3)];
            let here = |p: &&[f64; 3]| {
                (p[0] - 5.0 - x).clamp(0.0, 1.0) == p[0] - 5.0 - x && p[1] >= y && p[1] < y + 1.0
            };
            let count = points.iter().filter(here).count();
            assert!(count.abs_diff(1000) < 160, "{count} in cell {cell}");
        }
    }
    let drawn = |seed| sample(&mesh, &SampleOptions::new(SampleSize::Count(100)).with_seed(seed)).unwrap();
    assert_ne!(drawn(1), drawn(2));
}

#[test]
fn every_box_that_a_triangle_passes_gets_a_sample_with_its_extremes() {
    let (origin, sides) = ([-8.3, -8.1, -3.2], [0.31, 0.27, 0.5]);
    let lattice = Lattice { origin, sides, counts: [64, 64, 26] };
    let cell = |p: [f64; 3]| [0, 1, 2].map(|k| ((p[k] - origin[k]) / sides[k]).floor());
    let mut compared = 0;
    for corners in CORNERS {
        let mut samples = Vec::new();
        assert!(lattice_samples(corners, &lattice, |p| samples.push(p)), "{corners:?} is within");
        for p in places(corners, 150) {
            let here: Vec<&[f64; 3]> = samples.iter().filter(|q| cell(**q) == cell(p)).collect();
            assert!(!here.is_empty(), "{p:?} of {corners:?} is in an empty box");
            for k in 0..3 {
                let least = here.iter().map(|q| q[k]).fold(f64::INFINITY, f64::min);
                let most = here.iter().map(|q| q[k]).fold(f64::NEG_INFINITY, f64::max);
                assert!(p[k] > least - 1e-5 && p[k] < most + 1e-5, "{p:?} beyond {least} to {most}");
            }
            compared += 1;
        }
    }
    assert!(compared > 100_000, "{compared} places");
}

#[test]
fn of_what_reaches_beyond_the_lattice_the_part_inside_is_sampled_in_bounded_time() {
    let (origin, sides) = ([-1.0, 2.0, 0.5], [0.5, 0.25, 0.125]);
    let lattice = Lattice { origin, sides, counts: [9, 7, 5] };
    let wide = Lattice { origin: origin.map(|x| x - 20.0), sides, counts: [99, 199, 399] };
    let cell = |p: [f64; 3]| [0, 1, 2].map(|k| ((p[k] - origin[k]) / sides[k]).floor());
    let is_within = |p: [f64; 3]| (0..3).all(|k| (0.0..[9.0, 7.0, 5.0][k]).contains(&cell(p)[k]));
    let sampled = |triangle, lattice: &Lattice| {
        let mut samples = Vec::new();
        let whole = lattice_samples(triangle, lattice, |p| samples.push(p));
        (whole, samples)
    };
    let mut inside = 0;
    let shifted = |i: u8| {
        let by = [0.113_7, 0.071_9, 0.031_3].map(|x| x * f64::from(i));
        CORNERS.map(|corners| {
            corners.map(|c| [c[0] + by[0] - 1.503, c[1] + by[1] + 2.009, c[2] + by[2] - 0.407])
        })
    };
    for triangle in (0..40).flat_map(shifted) {
        let (whole, samples) = sampled(triangle, &lattice);
        let (is_within_wide, all) = sampled(triangle, &wide);
        assert!(is_within_wide);
        assert_eq!(whole, triangle.iter().all(|c| is_within(*c)), "{triangle:?}");
        // The boxes with samples are those of the larger lattice, restricted to the smaller one.
        let of = |samples: &[[f64; 3]]| {
            let within = samples.iter().filter(|p| is_within(**p));
            let mut cells: Vec<[u64; 3]> = within.map(|p| cell(*p).map(f64::to_bits)).collect();
            cells.sort_unstable();
            cells.dedup();
            cells
        };
        assert_eq!(of(&samples), of(&all), "{triangle:?}");
        // Samples on the last wall may be outside by rounding.
        let inwards = |p: [f64; 3]| [0, 1, 2].map(|k| p[k] + 1e-9 * (1.0 - p[k]).signum() * sides[k]);
        assert!(samples.iter().all(|p| is_within(*p) || is_within(inwards(*p))), "nothing outside");
        inside += samples.len();
    }
    assert!(inside > 1000, "{inside} samples");
    // A plane as wide as doubles allow still passes through every box once. A triangle with a NaN,
    // infinite or extreme corner gets no samples.
    for reach in [1e3, 1e9, 1e18, 1e100, 1e148] {
        let z = 0.8;
        let huge = [[-reach, -reach, z], [3.0 * reach, -reach, z], [-reach, 3.0 * reach, z]];
        let (whole, samples) = sampled(huge, &lattice);
        assert!(!whole && samples.len() == 4 * 63, "{reach}: {} samples", samples.len());
        let (whole, samples) = sampled(huge.map(|c| [c[0], c[1], -z]), &lattice);
        assert!(!whole && samples.is_empty(), "below");
    }
    for broken in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX] {
        let (whole, samples) = sampled([[0.0, 2.5, 0.6], [1.0, 2.5, 0.6], [0.0, broken, 0.6]], &lattice);
        assert!(!whole && samples.is_empty(), "{broken}");
    }
}

#[test]
fn what_cannot_be_sampled_is_refused() {
    let refused = |mesh: &TriangleMesh, samples| sample(mesh, &SampleOptions::new(samples)).unwrap_err();
    assert_eq!(refused(&mesh(), SampleSize::Spacing(0.0)), SampleError::Spacing { spacing: 0.0 });
    assert!(matches!(refused(&mesh(), SampleSize::Spacing(f64::NAN)), SampleError::Spacing { .. }));
    assert!(matches!(refused(&mesh(), SampleSize::Spacing(1e-9)), SampleError::TooMany { .. }));
    let flat = TriangleMesh::new(vec![[0.0; 3], [1.0; 3]], vec![[0, 1, 1]]).unwrap();
    assert_eq!(refused(&flat, SampleSize::Count(10)), SampleError::NoArea);
    let regular = SampleOptions::new(SampleSize::Count(10)).with_pattern(SamplePattern::Regular);
    assert_eq!(sample(&mesh(), &regular), Err(SampleError::RegularCount));
    assert!(!sample(&flat, &SampleOptions::new(SampleSize::Spacing(0.1))).unwrap().is_empty(), "a line");
    let broken = TriangleMesh::new(vec![[0.0; 3], [1.0, f64::NAN, 0.0]], vec![[0, 1, 1]]).unwrap();
    assert_eq!(refused(&broken, SampleSize::Spacing(0.1)), SampleError::NotFinite { vertex: 1 });
    assert_eq!(refused(&TriangleMesh::default(), SampleSize::Count(1)), SampleError::NoArea);
    assert!(
        sample(&TriangleMesh::default(), &SampleOptions::new(SampleSize::Spacing(1.0))).unwrap().is_empty()
    );
}
