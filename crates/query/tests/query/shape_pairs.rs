//! Pairs with placed convex shapes against loops over all triangles and shapes in the world.

use std::sync::LazyLock;

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_geometry::{PointCloud, Pose, TriangleMesh};
use nearmiss_hierarchy::{BuildOptions, MeshBuildOptions, MeshHierarchy, PointHierarchy};
use nearmiss_mesh::{nearest_on_triangle, triangle_distance};
use nearmiss_query::{
    AsShape, CollideOptions, PlacedMesh, Prepared, PreparedMesh, Scratch, Semantics, Shape, ShapeMeshPair,
    ShapePair, ShapePlan, ShapeScanPair, SupportMap, Target,
};
use nearmiss_testdata::arbitrary::{self, CloudKind, point_in, rng, rotation};
use rand::RngExt;

type Random = rand_xoshiro::Xoshiro256PlusPlus;
type Vector = Vector3<f64>;
type Corners = [[f64; 3]; 3];

/// An ellipsoid about the origin of a pose, as a shape of the caller's own.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ellipsoid {
    pub(crate) half: [f64; 3],
    pub(crate) pose: Pose,
}

impl SupportMap for Ellipsoid {
    fn support(&self, direction: [f64; 3]) -> [f64; 3] {
        let own = self.pose.rotate_inverse(direction);
        let stretched = Vector::from([0, 1, 2].map(|k| own[k] * self.half[k])).normalize();
        self.pose.apply([0, 1, 2].map(|k| stretched[k] * self.half[k]))
    }

    fn centre(&self) -> [f64; 3] {
        self.pose.translation()
    }
}

/// A shape that owns what it needs.
#[derive(Debug, Clone)]
pub(crate) enum Owned {
    Plain(Shape<'static>),
    Hull(Vec<[f64; 3]>, f64),
    Own(Ellipsoid, f64),
}

impl AsShape for Owned {
    fn as_shape(&self) -> Shape<'_> {
        match self {
            Self::Plain(shape) => *shape,
            Self::Hull(points, radius) => Shape::Hull { points, radius: *radius },
            Self::Own(map, radius) => Shape::Own { map, radius: *radius },
        }
    }
}

impl Owned {
    /// One of nine kinds of shapes, of size about 1, about the origin.
    pub(crate) fn random(kind: u32, rng: &mut Random) -> Self {
        let mut length = |most: f64| rng.random_range(0.05..most);
        let (half, half_height, thick) = ([length(0.7), length(0.7), length(0.7)], length(0.7), length(0.4));
        let radius = if rng.random_bool(0.3) { 0.0 } else { thick };
        let pose = rotation(rng).with_translation(point_in(rng, 0.3)).with_scale(rng.random_range(0.5..1.5));
        Self::Plain(match kind % 9 {
            0 => Shape::Sphere { centre: point_in(rng, 0.5), radius },
            1 => Shape::Capsule { ends: [point_in(rng, 1.0), point_in(rng, 1.0)], radius },
            2 => Shape::Box { pose, half, radius },
            3 => Shape::Cylinder { pose, half_height, radius: thick, rounding: radius },
            4 => Shape::Cone { pose, half_height, radius: thick, rounding: radius },
            5 => {
                let points = [point_in(rng, 1.0), point_in(rng, 1.0), point_in(rng, 1.0)];
                Shape::Triangle { points, radius }
            }
            6 => return Self::Hull((0..12).map(|_| point_in(rng, 0.8)).collect(), radius),
            7 => return Self::Own(Ellipsoid { half, pose }, radius),
            _ => Shape::Sphere { centre: point_in(rng, 0.5), radius: 0.0 },
        })
    }

    /// The same shape, given in the world.
    fn moved(&self, by: &Pose) -> Self {
        match self {
            Self::Plain(shape) => Self::Plain(shape.moved(by).unwrap()),
            Self::Hull(points, radius) => {
                Self::Hull(points.iter().map(|&p| by.apply(p)).collect(), radius * by.scale())
            }
            Self::Own(Ellipsoid { half, pose }, radius) => {
                Self::Own(Ellipsoid { half: *half, pose: by.after(pose) }, radius * by.scale())
            }
        }
    }
}

pub(crate) fn prepared(mesh: &TriangleMesh) -> MeshHierarchy {
    MeshHierarchy::build(mesh, &MeshBuildOptions::default()).unwrap()
}

/// A cube of triangles from −1 to 1, each face divided into squares.
pub(crate) fn cube(divisions: u32) -> TriangleMesh {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for face in 0..6_u32 {
        let (k, side) = (face as usize % 3, if face < 3 { -1.0 } else { 1.0 });
        let first = u32::try_from(vertices.len()).unwrap();
        for i in 0..=divisions {
            for j in 0..=divisions {
                let mut p = [side; 3];
                p[(k + 1) % 3] = 2.0 * f64::from(i) / f64::from(divisions) - 1.0;
                p[(k + 2) % 3] = 2.0 * f64::from(j) / f64::from(divisions) - 1.0;
                vertices.push(p);
            }
        }
        let at = |i: u32, j: u32| first + i * (divisions + 1) + j;
        for (i, j) in (0..divisions).flat_map(|i| (0..divisions).map(move |j| (i, j))) {
            triangles.push([at(i, j), at(i + 1, j), at(i, j + 1)]);
            triangles.push([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    TriangleMesh::new(vertices, triangles).unwrap()
}

/// Triangles of all sizes and forms, needles among them.
fn soup(count: u32, rng: &mut Random) -> TriangleMesh {
    let mut vertices = Vec::new();
    for _ in 0..count {
        let (centre, size) = (point_in(rng, 3.0), [0.02, 0.3, 1.0][rng.random_range(0..3)]);
        let corners: [[f64; 3]; 3] = [point_in(rng, size), point_in(rng, size), point_in(rng, size)];
        let needle = rng.random_bool(0.2);
        for (k, corner) in corners.iter().enumerate() {
            let from = if needle && k == 2 { corners[1].map(|x| x * 1.001) } else { *corner };
            vertices.push([0, 1, 2].map(|k| centre[k] + from[k]));
        }
    }
    TriangleMesh::new(vertices, (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect()).unwrap()
}

/// A pose of any rotation and of a scale around 1.
pub(crate) fn pose(spread: f64, rng: &mut Random) -> Pose {
    let scale = [1.0, 0.4, 2.5][rng.random_range(0..3)];
    rotation(rng).with_scale(scale).with_translation(point_in(rng, spread))
}

fn apart(a: [f64; 3], b: [f64; 3]) -> f64 {
    (Vector::from(a) - Vector::from(b)).norm()
}

/// The triangles of a mesh in the world.
fn triangles_of<'m>(mesh: &'m TriangleMesh, at: &Pose) -> impl Iterator<Item = Corners> + use<'m> {
    let at = *at;
    mesh.triangles().iter().map(move |t| t.map(|v| at.apply(mesh.vertices()[v as usize])))
}

/// The distance of a shape in the world and a triangle; by formulas for what has corners.
fn to_triangle(shape: &Shape<'_>, triangle: &Corners) -> f64 {
    let core = match *shape {
        Shape::Sphere { centre, .. } => apart(nearest_on_triangle(triangle, centre), centre),
        Shape::Capsule { ends: [p, q], .. } => triangle_distance(&[p, q, q], triangle).distance,
        Shape::Triangle { points, .. } => triangle_distance(&points, triangle).distance,
        Shape::Box { pose, half, .. } => {
            let own = pose.apply_inverse(triangle[0]);
            if (0..3).all(|k| own[k].abs() <= half[k]) {
                return 0.0;
            }
            let corner =
                |i: u32| pose.apply([0, 1, 2].map(|k| if i >> k & 1 == 0 { -half[k] } else { half[k] }));
            let faces = [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
            let halves = faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
            halves.map(|t| triangle_distance(&t.map(corner), triangle).distance).fold(f64::INFINITY, f64::min)
        }
        _ => return shape.gap_to(&Shape::Triangle { points: *triangle, radius: 0.0 }).unwrap().upper,
    };
    (core - shape.rounding()).max(0.0)
}

/// The least distance of a shape in the world and all triangles.
fn to_all(shape: &Shape<'_>, mesh: &TriangleMesh, at: &Pose) -> f64 {
    triangles_of(mesh, at).map(|triangle| to_triangle(shape, &triangle)).fold(f64::INFINITY, f64::min)
}

#[test]
fn distances_from_meshes_are_those_of_the_nearest_triangle() {
    let rng = &mut rng(6101);
    let meshes = [cube(1), cube(9), soup(400, rng), soup(3, rng)];
    let hierarchies = meshes.each_ref().map(prepared);
    let scratch = &mut Scratch::default();
    let (mut touching, mut beyond) = (0, 0);
    for round in 0..1800_u32 {
        let which = round as usize % 4;
        let (mesh, hierarchy) = (&meshes[which], &hierarchies[which]);
        let shape = Owned::random(round / 4, rng);
        let (of_mesh, of_shape) = (pose(1.0, rng), pose(4.0, rng));
        let expected = to_all(&shape.moved(&of_shape).as_shape(), mesh, &of_mesh);
        let pair = ShapeMeshPair::new(PlacedMesh::new(hierarchy, &of_mesh), shape.at(&of_shape));
        let found = pair.distance(f64::INFINITY, scratch).unwrap();
        let context = format!("{expected}, but {found:?}, for {shape:?} at {of_shape:?}, {of_mesh:?}");
        assert!((found.upper - expected).abs() <= 1e-7, "{context}");
        assert!(found.lower <= expected + 1e-9 && found.upper - found.lower <= 1e-6, "{context}");
        let [on_mesh, on_shape] = found.points;
        assert!((apart(on_mesh, on_shape) - found.upper).abs() <= 1e-6, "{context}");
        let triangle = mesh.triangles()[found.triangle as usize].map(|v| mesh.vertices()[v as usize]);
        let triangle = triangle.map(|corner| of_mesh.apply(corner));
        assert!(apart(nearest_on_triangle(&triangle, on_mesh), on_mesh) <= 1e-9, "{context}");
        let dot = Shape::Sphere { centre: on_shape, radius: 0.0 };
        let off = shape.moved(&of_shape).as_shape().gap_to(&dot).unwrap().upper;
        assert!(off <= 1e-7, "{off} off, {context}");
        touching += u32::from(expected == 0.0);
        // A reach that is just enough, and one that is not.
        assert_eq!(pair.distance(found.upper, scratch).unwrap().upper, found.upper, "{context}");
        if expected > 1e-3 {
            beyond += 1;
            assert!(pair.distance(0.999 * expected - 1e-9, scratch).is_none(), "{context}");
        }
    }
    assert!(touching > 200 && beyond > 500, "{touching} touch, {beyond} are apart");
}

#[test]
fn shapes_about_a_closed_mesh() {
    let scratch = &mut Scratch::default();
    let hierarchy = prepared(&cube(6));
    let at = Pose::from_translation([10.0, 0.0, 0.0]).with_scale(2.0);
    let mut ask = |shape: Shape<'_>, pose: &Pose| {
        ShapeMeshPair::new(hierarchy.at(&at), shape.at(pose)).distance(f64::INFINITY, scratch).unwrap()
    };
    let moved = |x: f64| Pose::from_translation([x, 0.0, 0.0]);
    let dot = Shape::Sphere { centre: [0.0; 3], radius: 0.0 };
    let ball = Shape::Sphere { centre: [0.0; 3], radius: 0.5 };
    let rod = Shape::Capsule { ends: [[0.0; 3], [1.0, 0.0, 0.0]], radius: 0.0 };
    let large = Shape::Box { pose: Pose::IDENTITY, half: [3.0; 3], radius: 0.0 };
    let hull = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let hull = Shape::Hull { points: &hull, radius: 0.25 };
    // The surface of the cube is at x = 8 and x = 12.
    for (shape, x, expected) in [
        (dot, 10.0, 2.0),
        (dot, 11.0, 1.0),
        (dot, 15.0, 3.0),
        (ball, 10.0, 1.5),
        (ball, 11.75, 0.0),
        (ball, 12.5, 0.0),
        (ball, 13.0, 0.5),
        (rod, 10.5, 0.5),
        (rod, 11.5, 0.0),
        (rod, 12.25, 0.25),
        (rod, 12.0, 0.0),
        (large, 10.0, 0.0),
        (large, 16.0, 1.0),
        (hull, 13.0, 0.75),
        (hull, 9.0, 0.75),
        (hull, 11.5, 0.0),
    ] {
        let found = ask(shape, &moved(x));
        assert!((found.upper - expected).abs() < 1e-12, "{shape:?} at {x}: {expected}, but {found:?}");
        assert!(found.lower <= expected && found.upper - found.lower < 1e-8, "{shape:?} at {x}: {found:?}");
    }
    // Twice as large.
    let found = ask(hull, &moved(14.0).with_scale(2.0));
    assert!((found.upper - 1.5).abs() < 1e-12, "{found:?}");
}

#[test]
fn placed_shapes_are_apart_like_shapes_in_the_world() {
    let rng = &mut rng(6102);
    let mut touching = 0;
    for round in 0..2000_u32 {
        let shapes = [Owned::random(round, rng), Owned::random(round / 9, rng)];
        let poses = [pose(2.0, rng), pose(2.0, rng)];
        let [a, b] = [0, 1].map(|k| shapes[k].moved(&poses[k]));
        let expected = a.as_shape().gap_to(&b.as_shape()).unwrap();
        let pair = ShapePair::new(shapes[0].at(&poses[0]), shapes[1].at(&poses[1]));
        let found = pair.distance().unwrap();
        let context = format!("{expected:?}, but {found:?}, for {shapes:?} at {poses:?}");
        assert!((found.upper - expected.upper).abs() <= 1e-7, "{context}");
        assert!(found.lower <= expected.upper + 1e-9 && found.upper - found.lower <= 1e-6, "{context}");
        if expected.upper > 0.0 {
            assert!((apart(found.points[0], found.points[1]) - found.upper).abs() <= 1e-6, "{context}");
        }
        touching += u32::from(expected.upper == 0.0);
        // The box contains the shape and is hardly larger than that of the shape in the world.
        let [own, world] = [shapes[0].at(&poses[0]).bounds().unwrap(), a.as_shape().bounds().unwrap()];
        for k in 0..3 {
            assert!(own.min[k] <= world.min[k] + 1e-12 && own.max[k] >= world.max[k] - 1e-12, "{context}");
            assert!(own.min[k] >= world.min[k] - 1e-9 && own.max[k] <= world.max[k] + 1e-9, "{context}");
        }
    }
    assert!((200..1800).contains(&touching), "{touching} touch");
}

fn scan(kind: CloudKind, count: u32) -> PointHierarchy {
    let cloud = PointCloud::from_positions(&arbitrary::cloud(kind, count, 7)).unwrap();
    PointHierarchy::build(&cloud, &BuildOptions::default()).unwrap()
}

pub(crate) static SCANS: LazyLock<[PointHierarchy; 3]> =
    LazyLock::new(|| [CloudKind::Sphere, CloudKind::Random, CloudKind::Coplanar].map(|kind| scan(kind, 400)));

#[test]
fn placed_shapes_meet_scans_like_shapes_in_the_world() {
    let rng = &mut rng(6103);
    let scratch = &mut Scratch::default();
    let (mut contacts, mut expected_contacts) = (Vec::new(), Vec::new());
    let (mut touching, mut differ) = (0, 0);
    for round in 0..900_u32 {
        let scan = &SCANS[round as usize % 3];
        let options = match round / 3 % 3 {
            0 => CollideOptions::default(),
            1 => CollideOptions::default().with_margin(0.2),
            _ => CollideOptions::default().with_semantics(Semantics::Thickened(0.1)),
        };
        let plan = ShapePlan::new(&options, scan).unwrap();
        let shape = Owned::random(round / 9, rng);
        let (of_scan, of_shape) = (pose(1.0, rng), pose(2.0, rng));
        let world = shape.moved(&of_shape);
        let target = Target::new(scan.at(&of_scan), &plan);
        let pair = ShapeScanPair::new(scan.at(&of_scan), shape.at(&of_shape));
        let context = format!("{shape:?} at {of_shape:?}, {of_scan:?}");

        let expected = target.distance(&world.as_shape(), f64::INFINITY, scratch).unwrap();
        let found = pair.distance(&plan, f64::INFINITY, scratch).unwrap();
        let size = 1e-5 * expected.upper.max(1.0);
        assert!((found.upper - expected.upper).abs() <= size, "{expected:?}, but {found:?}, for {context}");
        assert!((found.lower - expected.lower).abs() <= size, "{expected:?}, but {found:?}, for {context}");
        let off = apart(found.points[0], found.points[1]) - found.upper;
        assert!(found.upper == 0.0 || off.abs() <= size, "{found:?}, for {context}");

        let [expected, found] =
            [target.touch(&world.as_shape(), scratch).verdict, pair.touch(&plan, scratch).verdict];
        differ += u32::from(expected.is_touching() != found.is_touching());
        touching += u32::from(found.is_touching());
        target.contacts(&world.as_shape(), &mut expected_contacts, scratch);
        pair.contacts(&plan, &mut contacts, scratch);
        let deepest = |found: &[nearmiss_query::ShapeContact]| found.first().map(|contact| contact.depth);
        let depths = [deepest(&expected_contacts), deepest(&contacts)];
        // Nearest points of other cores are iterated, so their deep contacts depend on rounding.
        let is_exact = matches!(shape, Owned::Plain(Shape::Sphere { .. } | Shape::Capsule { .. }));
        let is_same = match depths {
            [Some(a), Some(b)] => !is_exact || (a - b).abs() <= 1e-6,
            [a, b] => a.is_none() && b.is_none(),
        };
        differ += u32::from(!is_same);
    }
    assert!((200..800).contains(&touching) && differ <= 2, "{touching} touch, {differ} by rounding");
}
