//! Penetrations of meshes against known depths, and against all pairs of triangles.

use nearmiss_geometry::nalgebra::{Matrix3, Vector3};
use nearmiss_geometry::{Pose, TriangleMesh};
use nearmiss_hierarchy::{MeshBuildOptions, MeshHierarchy};
use nearmiss_mesh::triangles_meet;
use nearmiss_query::{Budget, MeshPair, MeshScratch, MeshSolid, Penetration, PlacedMesh};
use nearmiss_testdata::arbitrary::{point_in, pose, rng, unit_vector};
use rand::RngExt;

type Random = rand_xoshiro::Xoshiro256PlusPlus;
type Vector = Vector3<f64>;

fn prepare(mesh: &TriangleMesh) -> (MeshHierarchy, MeshSolid) {
    let prepared = MeshHierarchy::build(mesh, &MeshBuildOptions::default()).unwrap();
    let solid = MeshSolid::new(&prepared);
    (prepared, solid)
}

fn ask(meshes: [&TriangleMesh; 2], poses: [Pose; 2], budget: &Budget) -> Penetration {
    let [(a, solid_a), (b, solid_b)] = meshes.map(prepare);
    let pair = MeshPair::new(PlacedMesh::new(&a, &poses[0]), PlacedMesh::new(&b, &poses[1])).within(budget);
    pair.penetration([&solid_a, &solid_b], &mut MeshScratch::default())
}

/// The pose that shifts b out of a.
fn shifted(pose: &Pose, t: Vector) -> Pose {
    pose.with_translation((Vector::from(pose.translation()) + t).into())
}

fn apart(pose: &Pose, found: &Penetration) -> Pose {
    shifted(pose, Vector::from(found.direction) * found.upper)
}

/// Twelve triangles about the box −half..half, wound counterclockwise from outside.
fn cuboid(half: [f64; 3]) -> TriangleMesh {
    let vertices =
        (0..8_u8).map(|i| [0, 1, 2].map(|k| if i >> k & 1 == 1 { half[k] } else { -half[k] })).collect();
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = faces.iter().flat_map(|[p, q, r, s]| [[*p, *q, *r], [*p, *r, *s]]).collect();
    TriangleMesh::new(vertices, triangles).unwrap()
}

/// A closed surface over a lattice of `u` by `v` parameters, periodic in both.
fn periodic([u, v]: [u32; 2], place: impl Fn(f64, f64) -> [f64; 3]) -> TriangleMesh {
    let at = |i: u32, n: u32| std::f64::consts::TAU * f64::from(i) / f64::from(n);
    let vertices = (0..u * v).map(|i| place(at(i / v, u), at(i % v, v))).collect();
    let number = |i: u32, j: u32| (i % u) * v + j % v;
    let quad = |i: u32, j: u32| [number(i, j), number(i + 1, j), number(i + 1, j + 1), number(i, j + 1)];
    let quads = (0..u * v).map(|i| quad(i / v, i % v));
    TriangleMesh::new(vertices, quads.flat_map(|[p, q, r, s]| [[p, q, r], [p, r, s]]).collect()).unwrap()
}

fn torus(major: f64, minor: f64) -> TriangleMesh {
    periodic([64, 32], |s, t| {
        let r = major + minor * t.cos();
        [r * s.cos(), r * s.sin(), minor * t.sin()]
    })
}

/// A sphere with its poles on the z axis.
fn sphere(radius: f64) -> TriangleMesh {
    let (rings, sides) = (32_u32, 64_u32);
    let mut vertices = vec![[0.0, 0.0, radius], [0.0, 0.0, -radius]];
    for i in 1..rings {
        let (sin, cos) = (std::f64::consts::PI * f64::from(i) / f64::from(rings)).sin_cos();
        for j in 0..sides {
            let (y, x) = (std::f64::consts::TAU * f64::from(j) / f64::from(sides)).sin_cos();
            vertices.push([radius * sin * x, radius * sin * y, radius * cos]);
        }
    }
    let at = |i: u32, j: u32| 2 + (i - 1) * sides + j % sides;
    let mut triangles = Vec::new();
    for j in 0..sides {
        triangles.extend([[0, at(1, j), at(1, j + 1)], [1, at(rings - 1, j + 1), at(rings - 1, j)]]);
        for i in 1..rings - 1 {
            triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    TriangleMesh::new(vertices, triangles).unwrap()
}

fn joined(meshes: &[&TriangleMesh]) -> TriangleMesh {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for mesh in meshes {
        let first = u32::try_from(vertices.len()).unwrap();
        vertices.extend_from_slice(mesh.vertices());
        triangles.extend(mesh.triangles().iter().map(|t| t.map(|v| first + v)));
    }
    TriangleMesh::new(vertices, triangles).unwrap()
}

/// The corners of all triangles in the world.
fn placed(mesh: &TriangleMesh, pose: &Pose) -> Vec<[[f64; 3]; 3]> {
    mesh.triangles().iter().map(|t| t.map(|v| pose.apply(mesh.vertices()[v as usize]))).collect()
}

/// The number of times that triangles, wound counterclockwise from outside, enclose a place (Van
/// Oosterom & Strackee 1983).
fn winding(triangles: &[[[f64; 3]; 3]], place: [f64; 3]) -> f64 {
    let angle = |t: &[[f64; 3]; 3]| {
        let [a, b, c] = t.map(|p| Vector::from(p) - Vector::from(place));
        let (r, s, t) = (a.norm(), b.norm(), c.norm());
        2.0 * a.dot(&b.cross(&c)).atan2(r * s * t + a.dot(&b) * t + a.dot(&c) * s + b.dot(&c) * r)
    };
    triangles.iter().map(angle).sum::<f64>() / (2.0 * std::f64::consts::TAU)
}

/// `true` if the solids of two closed meshes of one part have a common point.
fn overlap(meshes: [&TriangleMesh; 2], poses: [&Pose; 2]) -> bool {
    let [a, b] = [0, 1].map(|k| placed(meshes[k], poses[k]));
    a.iter().any(|t| b.iter().any(|u| triangles_meet(t, u)))
        || winding(&a, b[0][0]).abs() > 0.5
        || winding(&b, a[0][0]).abs() > 0.5
}

/// Expects these bounds on a known depth, and a separation by the shift. `loose` bounds the relative
/// difference of the lower bound and the depth.
fn expect(meshes: [&TriangleMesh; 2], poses: [Pose; 2], depth: f64, [loose, error]: [f64; 2]) {
    let found = ask(meshes, poses, &Budget::UNLIMITED);
    assert!(found.complete, "{found:?}");
    assert!(found.upper <= depth * (1.0 + error), "{found:?}, expected {depth}");
    assert!(found.upper >= depth * (1.0 - error), "{found:?}, expected {depth}");
    assert!(found.lower <= depth && found.lower >= depth * (1.0 - loose), "{found:?}, expected {depth}");
    assert!(!overlap(meshes, [&poses[0], &apart(&poses[1], &found)]), "{found:?}");
    let again = ask(meshes, [poses[0], apart(&poses[1], &found)], &Budget::UNLIMITED);
    assert_eq!((again.lower, again.upper), (0.0, 0.0), "{again:?}");
}

#[test]
fn boxes_have_the_depth_of_their_least_overlap() {
    let rng = &mut rng(3311);
    for round in 0..40 {
        let mut half = || -> [f64; 3] { [0, 1, 2].map(|_| rng.random_range(0.3..1.5)) };
        let (p, q) = (half(), half());
        let d: [f64; 3] = [0, 1, 2].map(|k| rng.random_range(-0.97..0.97) * (p[k] + q[k]));
        // Some are inside the other, concentric or not.
        let q = if round % 4 == 0 { p.map(|x| 0.3 * x) } else { q };
        let d = if round % 4 == 0 { d.map(|x| 0.1 * x) } else { d };
        let depth = (0..3).map(|k| p[k] + q[k] - d[k].abs()).fold(f64::INFINITY, f64::min);
        let world = pose(rng, 3.0);
        let b = world.after(&Pose::from_translation(d));
        // Deep overlaps are bounded loosely: no ball in a box is thicker than the box.
        let is_shallow = (0..3).all(|k| depth < 0.5 * p[k].min(q[k]));
        let loose = if is_shallow { 0.05 } else { 0.6 };
        expect([&cuboid(p), &cuboid(q)], [world, b], depth * world.scale(), [loose, 1e-4]);
    }
}

#[test]
fn spheres_have_the_depth_of_their_radii() {
    let rng = &mut rng(3312);
    for round in 0..6 {
        let (r, s) = (1.0, [0.4, 1.0, 0.1][round % 3]);
        let distance = [1.2, 1.9, 0.85, 0.0, 1.05, 0.3][round];
        let way = Vector::from(unit_vector(rng)) * distance;
        let poses = [Pose::IDENTITY, Pose::from_translation(way.into())];
        if r + s <= distance {
            continue;
        }
        // The faces are up to 0.5 % of the radii inside the spheres.
        let off = 0.006 * (r + s) / (r + s - distance);
        expect([&sphere(r), &sphere(s)], poses, r + s - distance, [off + 0.05, off]);
    }
}

#[test]
fn tori_side_by_side_have_the_depth_of_their_tubes() {
    for offset in [0.05, 0.2, 0.35] {
        let poses = [Pose::IDENTITY, Pose::from_translation([0.0, 0.0, offset])];
        let off = 0.003 / (0.4 - offset);
        expect([&torus(1.0, 0.2), &torus(1.0, 0.2)], poses, 0.4 - offset, [off + 0.05, off]);
    }
    // Linked tori do not overlap.
    let upright = Pose::from_axis_angle([1.0, 0.0, 0.0], 1.5).with_translation([1.0, 0.0, 0.0]);
    let found = ask([&torus(1.0, 0.2), &torus(1.0, 0.2)], [Pose::IDENTITY, upright], &Budget::UNLIMITED);
    assert_eq!((found.lower, found.upper, found.complete), (0.0, 0.0, true), "{found:?}");
}

/// An affine image of a tetrahedron, a cube or an octahedron.
fn convex(rng: &mut Random) -> TriangleMesh {
    let mut entries = || Vector::from(point_in(rng, 1.0));
    let map = loop {
        let map = Matrix3::from_columns(&[entries(), entries(), entries()]);
        if map.determinant() > 0.1 {
            break map;
        }
    };
    let mesh = match rng.random_range(0..3_u8) {
        0 => cuboid([1.0; 3]),
        1 => {
            let vertices = vec![[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
            TriangleMesh::new(vertices, vec![[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]]).unwrap()
        }
        _ => {
            let vertices = (0..6_u8)
                .map(|i| [0, 1, 2].map(|k| if i / 2 == k { 1.0 - 2.0 * f64::from(i % 2) } else { 0.0 }));
            let triangles = (0..8_u32).map(|i| {
                let [x, y, z] = [i & 1, 2 + (i >> 1 & 1), 4 + (i >> 2)];
                if i.count_ones() % 2 == 0 { [x, y, z] } else { [y, x, z] }
            });
            TriangleMesh::new(vertices.collect(), triangles.collect()).unwrap()
        }
    };
    let vertices = mesh.vertices().iter().map(|v| (map * Vector::from(*v)).into()).collect();
    TriangleMesh::new(vertices, mesh.triangles().to_vec()).unwrap()
}

/// The least distance of the origin from a face of the Minkowski difference of two convex solids,
/// whose faces have the normals of a face of one or of two edges. Negative if they are apart.
fn minkowski(meshes: [&TriangleMesh; 2], poses: [&Pose; 2]) -> f64 {
    let [a, b] = [0, 1]
        .map(|k| placed(meshes[k], poses[k]).into_iter().map(|t| t.map(Vector::from)).collect::<Vec<_>>());
    let edges = |m: &[[Vector; 3]]| m.iter().flat_map(|t| [t[1] - t[0], t[2] - t[1]]).collect::<Vec<_>>();
    let mut normals: Vec<Vector> = a.iter().chain(&b).map(|t| (t[1] - t[0]).cross(&(t[2] - t[0]))).collect();
    for e in edges(&a) {
        normals.extend(edges(&b).iter().map(|f| e.cross(f)));
    }
    let mut least = f64::INFINITY;
    for u in normals.iter().filter_map(|n| n.try_normalize(1e-9)).flat_map(|u| [u, -u]) {
        let high = a.iter().flatten().map(|p| u.dot(p)).fold(f64::NEG_INFINITY, f64::max);
        let low = b.iter().flatten().map(|p| u.dot(p)).fold(f64::INFINITY, f64::min);
        least = least.min(high - low);
    }
    least
}

#[test]
fn convex_solids_have_the_depth_of_their_minkowski_difference() {
    let rng = &mut rng(3313);
    let (mut overlapping, mut close, mut share) = (0, 0, 0.0);
    for _ in 0..150 {
        let (a, b) = (convex(rng), convex(rng));
        let poses = [pose(rng, 0.6), pose(rng, 0.6)];
        let depth = minkowski([&a, &b], [&poses[0], &poses[1]]);
        let found = ask([&a, &b], poses, &Budget::UNLIMITED);
        if depth < 1e-9 {
            assert_eq!((found.lower, found.upper), (0.0, 0.0), "{found:?}, expected {depth}");
            continue;
        }
        overlapping += 1;
        assert!(found.lower <= depth && depth <= found.upper * (1.0 + 1e-9), "{found:?}, expected {depth}");
        close += u32::from(found.upper <= 1.02 * depth);
        share += found.lower / depth;
    }
    let share = share / f64::from(overlapping);
    println!("{overlapping} overlap, {close} within 2 %, lower bound on average {share} of the depth");
    assert!(
        overlapping > 60 && close * 10 >= overlapping * 9 && share > 0.85,
        "{overlapping}, {close}, {share}"
    );
}

/// An L of two boxes as one closed surface: a prism over a hexagon that is not convex.
fn ell(rng: &mut Random) -> TriangleMesh {
    let (w, t) = (rng.random_range(0.6..1.4), rng.random_range(0.15..0.5));
    let outline = [[0.0, 0.0], [w, 0.0], [w, t], [t, t], [t, 1.0], [0.0, 1.0]];
    let vertices = outline.iter().flat_map(|[x, y]| [[*x, *y, 0.0], [*x, *y, 0.6]]).collect();
    let sides = (0..6_u32).map(|i| [2 * i, 2 * ((i + 1) % 6), 2 * ((i + 1) % 6) + 1, 2 * i + 1]);
    let mut triangles: Vec<_> = sides.flat_map(|[p, q, r, s]| [[p, q, r], [p, r, s]]).collect();
    for [i, j, k] in [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]] {
        triangles.extend([[2 * i, 2 * k, 2 * j], [2 * i + 1, 2 * j + 1, 2 * k + 1]]);
    }
    TriangleMesh::new(vertices, triangles).unwrap()
}

/// Shifts shorter than the lower bound leave an overlap, the shift found ends it, and both bounds
/// hold under every budget.
#[test]
fn shifts_shorter_than_the_lower_bound_leave_an_overlap() {
    let rng = &mut rng(3314);
    let mut overlapping = 0;
    for round in 0..40 {
        let solid = |rng: &mut Random| if round % 3 == 0 { torus(0.7, 0.3) } else { ell(rng) };
        let (a, b) = (ell(rng), solid(rng));
        let poses = [pose(rng, 0.4), pose(rng, 0.4)];
        let is_overlap = overlap([&a, &b], [&poses[0], &poses[1]]);
        let mut last = f64::INFINITY;
        for work in [0, 10, 1000, 10_000, u64::MAX] {
            let found = ask([&a, &b], poses, &Budget::UNLIMITED.with_work(work));
            assert!(found.lower <= found.upper && found.upper <= last, "{work} units: {found:?}");
            assert!(is_overlap || found.lower == 0.0, "{work} units: {found:?}");
            assert!(!overlap([&a, &b], [&poses[0], &apart(&poses[1], &found)]), "{work} units: {found:?}");
            last = found.upper;
            for _ in 0..20 {
                let t = Vector::from(unit_vector(rng)) * (found.lower * rng.random_range(0.5..0.999));
                let left = found.lower == 0.0 || overlap([&a, &b], [&poses[0], &shifted(&poses[1], t)]);
                assert!(left, "{work} units: {found:?}, {t}");
            }
            if work == u64::MAX {
                assert_eq!(is_overlap, found.upper > 0.0, "{found:?}");
                overlapping += u32::from(is_overlap);
            }
        }
    }
    assert!((15..40).contains(&overlapping), "{overlapping} overlap");
}

#[test]
fn cavities_and_open_meshes_are_not_solid() {
    let (shell, small) = (joined(&[&cuboid([1.0; 3]), &cuboid([0.8; 3])]), cuboid([0.1; 3]));
    let at = |x: f64| [Pose::IDENTITY, Pose::from_translation([x, 0.0, 0.0])];
    let depth = |a: &TriangleMesh, x: f64| ask([a, &small], at(x), &Budget::UNLIMITED);
    // Free in the cavity, and in the wall, from which both ways out are equally long.
    assert_eq!(depth(&shell, 0.3).upper, 0.0);
    let wall = depth(&shell, 0.9);
    assert!(wall.upper > 0.2 - 1e-9 && wall.upper < 0.201 && wall.lower > 0.19, "{wall:?}");
    // Without one of its triangles, a box is a surface.
    let box_of = cuboid([1.0; 3]);
    let open = TriangleMesh::new(box_of.vertices().to_vec(), box_of.triangles()[1..].to_vec()).unwrap();
    assert!(!prepare(&open).1.is_closed() && prepare(&box_of).1.is_closed());
    assert_eq!(depth(&open, 0.3).upper, 0.0);
    let deep = depth(&box_of, 0.3);
    assert!(deep.upper > 0.8 - 1e-9 && deep.upper < 0.801 && deep.lower > 0.75, "{deep:?}");
    // Half way through the open side's opposite face: to the nearer side of it.
    let through = depth(&open, 0.96);
    assert!(through.upper > 0.06 - 1e-9 && through.upper < 0.0601 && through.lower > 0.05, "{through:?}");
}

/// A surface through a solid: the lower bound is more than the size of its triangles, in both orders.
#[test]
fn sheets_through_solids_have_lower_bounds() {
    const SIDE: u32 = 40;
    let vertices = (0..=SIDE).flat_map(|i| (0..=SIDE).map(move |j| [i, j]));
    let vertices = vertices.map(|[i, j]| [0.1 * f64::from(i) - 2.0, 0.1 * f64::from(j) - 2.0, 0.2]).collect();
    let corners = |i: u32, j: u32| [0, 1, SIDE + 2, SIDE + 1].map(|k| i * (SIDE + 1) + j + k);
    let quads = (0..SIDE).flat_map(|i| (0..SIDE).map(move |j| corners(i, j)));
    let sheet = TriangleMesh::new(vertices, quads.flat_map(|[p, q, r, s]| [[p, q, r], [p, r, s]]).collect());
    let (sheet, block) = (sheet.unwrap(), cuboid([1.0; 3]));
    for meshes in [[&sheet, &block], [&block, &sheet]] {
        let found = ask(meshes, [Pose::IDENTITY; 2], &Budget::UNLIMITED);
        assert!(found.upper > 0.8 - 1e-9 && found.upper < 0.801 && found.lower > 0.75, "{found:?}");
    }
}

#[test]
fn invalid_questions_have_no_known_penetration() {
    let mesh = cuboid([1.0; 3]);
    let invalid = Pose::IDENTITY.with_scale(f64::NAN);
    let found = ask([&mesh, &mesh], [Pose::IDENTITY, invalid], &Budget::UNLIMITED);
    assert!(found.lower == 0.0 && found.upper.is_infinite() && !found.complete, "{found:?}");
    let ((a, solid), (b, other)) = (prepare(&mesh), prepare(&cuboid([0.5; 3])));
    let pair = MeshPair::new(PlacedMesh::new(&a, &Pose::IDENTITY), PlacedMesh::new(&b, &Pose::IDENTITY));
    let scratch = &mut MeshScratch::default();
    assert!(pair.penetration([&other, &solid], scratch).upper.is_infinite());
    let found = pair.penetration([&solid, &other], scratch);
    assert!(found.upper > 1.5 - 1e-9 && found.upper < 1.5001 && found.lower > 1.49, "{found:?}");
}

/// Things that only touch, at the origin of coordinates, are apart after any shift.
#[test]
fn things_that_touch_at_zero_end_the_search() {
    let floor =
        TriangleMesh::new(vec![[-9.0, -9.0, 0.0], [9.0, -9.0, 0.0], [0.0, 9.0, 0.0]], vec![[0, 1, 2]])
            .unwrap();
    let standing =
        TriangleMesh::new(vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]], vec![[0, 1, 2]]).unwrap();
    let cube = cuboid([0.5; 3]);
    let up = Pose::from_translation([0.0, 0.0, 0.5]);
    for (b, pose) in [(&standing, Pose::IDENTITY), (&cube, up), (&floor, Pose::IDENTITY)] {
        for work in [None, Some(1), Some(100), Some(10_000)] {
            let budget = work.map_or(Budget::UNLIMITED, |work| Budget::UNLIMITED.with_work(work));
            let found = ask([&floor, b], [Pose::IDENTITY, pose], &budget);
            assert!(work == Some(1) || found.upper < 1e-9 || !found.complete, "{work:?}: {found:?}");
            assert!(found.lower <= 1e-12, "{work:?}: {found:?}");
        }
    }
}
