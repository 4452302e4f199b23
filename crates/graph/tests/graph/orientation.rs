//! Orients normals with random signs, and compares them with the normals of known shapes.
use crate::clouds::{Cloud, single};
use nearmiss_geometry::TriangleMesh;
use nearmiss_graph::{Adjacency, Decision, Orientation, Sides, Viewpoint, orient};
use nearmiss_testdata::dragon::{Dragon, dragon_mesh};
use nearmiss_testdata::oracle::{Signs, falls};
use nearmiss_testdata::shapes::{bowl, cuboid, plates, sphere, torus};

fn oriented(cloud: &Cloud, seed: u64, sides: Sides<'_>) -> (Vec<[f32; 3]>, Orientation) {
    let mut normals = cloud.normals(seed);
    let found = orient(&cloud.graph, &cloud.points, &cloud.radii, sides, &mut normals);
    (normals, found)
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Fraction of the points whose normal points to the side of `expected`.
#[expect(clippy::cast_precision_loss, reason = "below 2^24")]
fn right(normals: &[[f32; 3]], expected: impl Fn(usize) -> [f32; 3]) -> f64 {
    let right = normals.iter().enumerate().filter(|&(i, n)| dot(*n, expected(i)) > 0.0).count();
    right as f64 / normals.len() as f64
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

            // Convex shapes: every normal points away from the centre.
            for (name, form, spacing) in [
                ("sphere", sphere(1.0), 0.07),
                ("cuboid", cuboid([1.0, 0.8, 0.6]), 0.05),
                ("plate, four spacings thick", cuboid([1.0, 1.0, 0.12]), 0.03),
            ] {
                let cloud = Cloud::of_form(form, spacing, noise, seed);
                let (normals, _) = oriented(&cloud, seed, Sides::default());
                let share = right(&normals, |i| cloud.points[i]);
                // Noise rotates some normals at edges by a right angle.
                let least = if noise > 0.0 { 0.998 } else { 0.999 };
                assert!(share >= least, "{name}, seed {seed}, noise {noise}: {share}");
            }
        }
    }
}

/// The vertices of a dragon that its triangles use.
fn dragon(which: Dragon) -> (TriangleMesh, Vec<usize>, Cloud) {
    let mesh = dragon_mesh(which).unwrap();
    let mut used: Vec<usize> = mesh.triangles().iter().flatten().map(|&vertex| vertex as usize).collect();
    used.sort_unstable();
    used.dedup();
    let vertices = single(mesh.vertices());
    let cloud = Cloud::new(used.iter().map(|&i| vertices[i]).collect());
    (mesh, used, cloud)
}

#[test]
fn the_dragon_points_outwards() {
    // Where sheets are nearer to each other than samples, the points do not determine the
    // orientation.
    for (which, least) in [(Dragon::Points23k, 0.998), (Dragon::Points5k, 0.995)] {
        let (mesh, used, cloud) = dragon(which);
        for seed in 0..3 {
            let (normals, _) = oriented(&cloud, seed, Sides::default());
            let mut at_vertices = vec![[0.0; 3]; mesh.vertices().len()];
            for (&i, normal) in used.iter().zip(&normals) {
                at_vertices[i] = normal.map(f64::from);
            }
            let signs = Signs::of(&falls(&mesh, &at_vertices));
            assert!(signs.right() >= least, "{which:?}, start {seed}: {signs:?}");
            assert!(20 * signs.judged > 18 * used.len(), "{which:?}: {signs:?}");
        }
    }
}

/// Agreement of the normals at the ends of an edge from p to q: whether the signs match, and the
/// strength in general and along the surface. By the formulas alone, rounded to steps of 1/1023.
fn mirrored([p, m, q, n]: [[f32; 3]; 4]) -> (bool, f32, f32) {
    let e = [q[0] - p[0], q[1] - p[1], q[2] - p[2]];
    let cosine = dot(m, n) - 2.0 * dot(m, e) * dot(n, e) / dot(e, e);
    let off = dot(m, e).powi(2).max(dot(n, e).powi(2)) / dot(e, e);
    let strength = cosine.abs().min(1.0);
    let step = |share: f32| (1023.0 * share.max(0.0)).floor() / 1023.0;
    (cosine >= 0.0, step(strength), step(strength * (1.0 - off)))
}

#[test]
fn no_patch_would_rather_be_turned() {
    let clouds = [
        dragon(Dragon::Points5k).2,
        Cloud::of_form(cuboid([1.0, 1.0, 0.06]), 0.03, 0.2, 3),
        Cloud::of_form(plates(1.0, 1.0, 0.05), 0.05, 0.3, 1),
    ];
    let mut patches = 0;
    for cloud in clouds {
        let (normals, _) = oriented(&cloud, 1, Sides::default());
        let edge = |i: usize, j: usize| mirrored([cloud.points[i], normals[i], cloud.points[j], normals[j]]);
        // The least index that smooth edges lead to.
        let mut patch: Vec<usize> = (0..normals.len()).collect();
        let mut changes = true;
        while changes {
            changes = false;
            for i in 0..normals.len() {
                for j in cloud.graph.of(i).iter().map(|&j| j as usize).filter(|&j| edge(i, j).2 >= 0.95) {
                    let least = patch[i].min(patch[j]);
                    changes |= patch[i] != least || patch[j] != least;
                    (patch[i], patch[j]) = (least, least);
                }
            }
        }
        let (mut odds, mut votes) = (vec![0.0; normals.len()], vec![0; normals.len()]);
        for i in 0..normals.len() {
            for j in cloud.graph.of(i).iter().map(|&j| j as usize).filter(|&j| patch[i] != patch[j]) {
                let (agree, strength, _) = edge(i, j);
                let weight = ((1.0 + strength) / (1.0 - strength).max(1e-3)).ln();
                odds[patch[i]] += if agree { weight } else { -weight };
                votes[patch[i]] += 1;
            }
        }
        patches += votes.iter().filter(|&&votes| votes > 0).count();
        for (odds, votes) in odds.iter().zip(votes) {
            // The library rounds votes to steps.
            assert!(*odds > -0.01 * (1 + votes) as f32, "{odds} of {votes} votes");
        }
    }
    assert!(patches > 1000, "{patches}");
}

#[test]
fn faces_of_thin_plates_point_outwards() {
    for spacings in [1.5, 2.0, 2.5, 3.0] {
        for seed in 0..6 {
            let thickness = 0.03 * spacings;
            let cloud = Cloud::of_form(cuboid([1.0, 1.0, thickness]), 0.03, 0.0, seed);
            let (normals, _) = oriented(&cloud, seed, Sides::default());
            let is_inner = |p: &[f32; 3]| p[0].abs().max(p[1].abs()) < 0.47;
            let faces: Vec<usize> = (0..normals.len()).filter(|&i| is_inner(&cloud.points[i])).collect();
            let wrong = faces.iter().filter(|&&i| normals[i][2] * cloud.points[i][2] <= 0.0).count();
            assert!(
                1000 * wrong <= faces.len(),
                "{spacings} spacings, seed {seed}: {wrong} of {}",
                faces.len()
            );
        }
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
    // A scanner above looks into the bowl.
    let (normals, found) =
        oriented(&cloud, 3, Sides { scanner: Some(Viewpoint::One([0.0, 0.0, 5.0])), ..Sides::default() });
    assert_eq!((right(&normals, outward), found.parts[0].decision), (0.0, Decision::Scanner));
    // Normals of the scan's input, a third of them wrong and some missing, override the scanner.
    let given: Vec<[f32; 3]> = (0..cloud.points.len())
        .map(|i| match i % 9 {
            0..3 => cloud.points[i].map(|c| -c),
            3 => [0.0; 3],
            4 => [f32::NAN; 3],
            _ => cloud.points[i],
        })
        .collect();
    let sides = Sides { normals: Some(&given), scanner: Some(Viewpoint::One([0.0, 0.0, 5.0])) };
    let (normals, found) = oriented(&cloud, 3, sides);
    assert_eq!((right(&normals, outward), found.parts[0].decision), (1.0, Decision::Normals));
    // Flat parts have no outside.
    let flat = Cloud::of_form(plates(1.0, 1.0, 0.5), 0.05, 0.0, 2);
    let (normals, found) = oriented(&flat, 4, Sides::default());
    assert_eq!(found.parts.len(), 2);
    assert!(found.parts.iter().all(|part| part.orientable && part.decision == Decision::Convention));
    assert_eq!(right(&normals, |_| [0.0, 0.0, 1.0]), 1.0);
}

/// A band around a circle of radius 1, with width 0.5, twisted by `halves` half turns.
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
