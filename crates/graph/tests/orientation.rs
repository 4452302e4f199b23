//! Oriented normals against those of shapes that are known, from arbitrary signs.
#![expect(clippy::unwrap_used, reason = "a test may panic")]

mod clouds;

use clouds::{Cloud, single};
use nearmiss_geometry::TriangleMesh;
use nearmiss_graph::{Adjacency, Decision, Orientation, Sides, orient};
use nearmiss_testdata::dragon::{Dragon, dragon_mesh};
use nearmiss_testdata::shapes::{bowl, cuboid, plates, sphere, torus};

fn oriented(cloud: &Cloud, seed: u64, sides: Sides<'_>) -> (Vec<[f32; 3]>, Orientation) {
    let mut normals = cloud.normals(seed);
    let found = orient(&cloud.graph, &cloud.points, &cloud.radii, sides, &mut normals);
    (normals, found)
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Share of the points whose normal points as `expected`.
#[expect(clippy::cast_precision_loss, reason = "below 2^24")]
fn right(normals: &[[f32; 3]], expected: impl Fn(usize) -> [f32; 3]) -> f64 {
    let right = normals.iter().enumerate().filter(|&(i, n)| dot(*n, expected(i)) > 0.0).count();
    right as f64 / normals.len() as f64
}

/// Sums of the normals of the faces about each vertex.
fn vertex_normals(mesh: &TriangleMesh) -> Vec<[f32; 3]> {
    let mut normals = vec![[0.0; 3]; mesh.vertices().len()];
    for corners in mesh.triangles() {
        let [a, b, c] = corners.map(|i| mesh.vertices()[i as usize]);
        let (u, v) = ([0, 1, 2].map(|k| b[k] - a[k]), [0, 1, 2].map(|k| c[k] - a[k]));
        let cross = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        for i in corners {
            for k in 0..3 {
                normals[*i as usize][k] += cross[k];
            }
        }
    }
    single(&normals)
}

#[test]
fn closed_shapes_point_outwards_from_any_start() {
    for seed in 0..4 {
        for noise in [0.0, 0.2] {
            let ring = Cloud::of_form(torus(1.0, 0.4), 0.05, noise, seed);
            let (normals, found) = oriented(&ring, seed, Sides::default());
            let outward = |i: usize| {
                let [x, y, z] = ring.points[i];
                let to_axis = 1.0 - 1.0 / (x * x + y * y).sqrt();
                [x * to_axis, y * to_axis, z]
            };
            assert_eq!(right(&normals, outward), 1.0, "torus, seed {seed}, noise {noise}");
            assert_eq!(found.parts.len(), 1);
            assert!(found.parts[0].orientable && found.parts[0].decision == Decision::Volume);
            let least = found.confidence.iter().min().unwrap();
            assert!(*least > 150, "{least} of 255");

            // Convex: every normal points away from the middle.
            for (name, form, spacing) in [
                ("sphere", sphere(1.0), 0.07),
                ("cuboid", cuboid([1.0, 0.8, 0.6]), 0.05),
                ("plate, four spacings thick", cuboid([1.0, 1.0, 0.12]), 0.03),
            ] {
                let cloud = Cloud::of_form(form, spacing, noise, seed);
                let (normals, _) = oriented(&cloud, seed, Sides::default());
                let share = right(&normals, |i| cloud.points[i]);
                // Noise turns some normals at edges by a right angle.
                let least = if noise > 0.0 { 0.998 } else { 0.999 };
                assert!(share >= least, "{name}, seed {seed}, noise {noise}: {share}");
            }
        }
    }
}

#[test]
fn the_dragon_points_outwards() {
    let mesh = dragon_mesh(Dragon::Points23k).unwrap();
    let expected = vertex_normals(&mesh);
    let used: Vec<usize> = (0..expected.len()).filter(|&i| dot(expected[i], expected[i]) > 0.0).collect();
    let vertices = single(mesh.vertices());
    let cloud = Cloud::new(used.iter().map(|&i| vertices[i]).collect());
    for seed in 0..3 {
        let (normals, _) = oriented(&cloud, seed, Sides::default());
        let share = right(&normals, |i| expected[used[i]]);
        // In its mouth and claws sheets are nearer to each other than samples.
        assert!(share >= 0.993, "{share} from start {seed}");
    }
}

#[test]
fn the_start_changes_nothing() {
    let cloud = Cloud::of_form(torus(1.0, 0.4), 0.08, 0.3, 7);
    let (expected, found) = oriented(&cloud, 0, Sides::default());
    for seed in 1..6 {
        assert_eq!(oriented(&cloud, seed, Sides::default()), (expected.clone(), found.clone()));
    }
}

#[test]
fn open_shapes_are_consistent_and_follow_what_is_known() {
    let cloud = Cloud::of_form(bowl(1.0), 0.06, 0.1, 5);
    let outward = |i: usize| cloud.points[i];
    let (normals, _) = oriented(&cloud, 3, Sides::default());
    let share = right(&normals, outward);
    assert!(share == 0.0 || share == 1.0, "{share} of a bowl");
    // A scanner above looks into it.
    let (normals, found) = oriented(&cloud, 3, Sides { scanner: Some([0.0, 0.0, 5.0]), ..Sides::default() });
    assert_eq!((right(&normals, outward), found.parts[0].decision), (0.0, Decision::Scanner));
    // Normals of the scan, a third of them wrong and some missing, say otherwise.
    let given: Vec<[f32; 3]> = (0..cloud.points.len())
        .map(|i| match i % 9 {
            0..3 => cloud.points[i].map(|c| -c),
            3 => [0.0; 3],
            4 => [f32::NAN; 3],
            _ => cloud.points[i],
        })
        .collect();
    let sides = Sides { normals: Some(&given), scanner: Some([0.0, 0.0, 5.0]) };
    let (normals, found) = oriented(&cloud, 3, sides);
    assert_eq!((right(&normals, outward), found.parts[0].decision), (1.0, Decision::Normals));
    // Flat: nothing says which side is out.
    let flat = Cloud::of_form(plates(1.0, 1.0, 0.5), 0.05, 0.0, 2);
    let (normals, found) = oriented(&flat, 4, Sides::default());
    assert_eq!(found.parts.len(), 2);
    assert!(found.parts.iter().all(|part| part.orientable && part.decision == Decision::Convention));
    assert_eq!(right(&normals, |_| [0.0, 0.0, 1.0]), 1.0);
}

/// A band about a circle of radius 1, half as wide, that is twisted by `halves` half turns.
fn band(halves: u16, spacing: f64) -> Vec<[f32; 3]> {
    let (mut points, mut angle) = (Vec::new(), 0.0_f64);
    while angle < std::f64::consts::TAU - 0.5 * spacing {
        let (s, c) = angle.sin_cos();
        let (twist, turn) = (0.5 * f64::from(halves) * angle).sin_cos();
        let mut across = -0.25;
        while across <= 0.25 {
            let r = 1.0 + across * turn;
            points.push([r * c, r * s, across * twist]);
            across += spacing;
        }
        angle += spacing;
    }
    single(&points)
}

#[test]
fn a_band_with_one_side_says_so_where_signs_meet() {
    for halves in 0..4 {
        let cloud = Cloud::new(band(halves, 0.03));
        let (_, found) = oriented(&cloud, u64::from(halves), Sides::default());
        assert_eq!(found.parts.len(), 1);
        assert_eq!(found.parts[0].orientable, halves % 2 == 0, "{halves} half turns");
        let doubtful = found.confidence.iter().filter(|&&c| c < 128).count();
        let expected = if halves % 2 == 0 { 0..1 } else { 16..80 };
        assert!(expected.contains(&doubtful), "{halves} half turns: {doubtful} of {}", cloud.points.len());
    }
}

#[test]
fn what_is_no_surface_is_no_reason_to_fail() {
    let graph = Adjacency::from_edges(4, &[[0, 1], [0, 2]]);
    let points = [[0.0; 3], [0.0; 3], [1.0, 0.0, 0.0], [5.0, 0.0, 0.0]];
    let mut normals = [[f32::NAN; 3], [0.0, -1.0, 0.0], [0.0; 3], [0.0, 0.0, -1.0]];
    let found = orient(&graph, &points, &[0.0, 1.0, 1.0, f32::NAN], Sides::default(), &mut normals);
    assert_eq!(found.parts.len(), 2);
    assert_eq!(found.confidence, [0; 4]);
    let none = orient(&Adjacency::from_edges(0, &[]), &[], &[], Sides::default(), &mut []);
    assert!(none.parts.is_empty());
}
