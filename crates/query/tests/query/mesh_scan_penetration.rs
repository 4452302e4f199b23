//! Penetrations of meshes and scans against known depths.

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_geometry::{PointCloud, Pose, TriangleMesh};
use nearmiss_hierarchy::{BuildOptions, MeshBuildOptions, MeshHierarchy, PointHierarchy};
use nearmiss_query::{
    Budget, CollideOptions, Interior, MeshScanPair, MeshScanPlan, MeshSolid, Placed, PlacedMesh, Scratch,
};
use nearmiss_testdata::arbitrary::{rng, rotation, unit_vector};
use nearmiss_testdata::shapes::{Form, Order, Sampling, patch, sphere};
use rand::RngExt;

type Vector = Vector3<f64>;

const HOLLOW: Interior = Interior::Hollow;
const SOLID: Interior = Interior::Solid;

fn prepare(form: Form, noise: f64) -> PointHierarchy {
    let sampling = Sampling { spacing: 0.04, noise, order: Order::Random, seed: 5 };
    let cloud = PointCloud::from_positions(&form.sample(sampling).points).unwrap();
    PointHierarchy::build(&cloud, &BuildOptions::default()).unwrap()
}

fn shifted(pose: &Pose, t: Vector) -> Pose {
    pose.with_translation((Vector::from(pose.translation()) + t).into())
}

/// A closed box with these half edges as a mesh.
pub(crate) fn box_mesh(half: [f64; 3]) -> MeshHierarchy {
    let corners = (0..8_u8).map(|n| [0, 1, 2].map(|k| if n >> k & 1 == 1 { half[k] } else { -half[k] }));
    let mut triangles = Vec::new();
    for k in 0..3 {
        let (u, v) = (1 << ((k + 1) % 3), 1 << ((k + 2) % 3));
        for side in [0, 1 << k] {
            triangles.extend([[side, side + u, side + u + v], [side, side + u + v, side + v]]);
        }
    }
    let mesh = TriangleMesh::new(corners.collect(), triangles).unwrap();
    MeshHierarchy::build(&mesh, &MeshBuildOptions::default()).unwrap()
}

/// A box as a mesh that is partly in a floor, in a solid ball, inside of it, and around it.
#[test]
fn meshes_in_scans() {
    let rng = &mut rng(8807);
    let scratch = &mut Scratch::default();
    for noise in [0.0, 0.1] {
        let [floor, ball] = [patch(4.0, 4.0), sphere(1.0)].map(|form| prepare(form, noise));
        // Measured points may be above the floor, and the rims of discs are above the ball.
        let off = 4.0 * noise * 0.04 + 0.5 * (0.65 * ball.sampling_radius()).powi(2) + 1e-6;
        let half = [0.5, 0.4, 0.3];
        let meshes = [half, [2.0; 3]].map(box_mesh);
        let [block, case] = meshes.each_ref().map(|mesh| (mesh, MeshSolid::new(mesh)));
        for depth in [0.05, 0.1, 0.2, 0.25] {
            let up = |z: f64| Pose::from_translation([0.03, 0.05, z]);
            let cases = [
                ("block in floor", &floor, HOLLOW, &block, up(0.3 - depth), depth),
                ("block on ball", &ball, SOLID, &block, up(1.3 - depth), depth),
                // Out through the side that is 2 − 0.05 away, on which the ball is 1 thick.
                ("ball in case", &ball, SOLID, &case, up(depth), 3.0 - depth),
                ("hollow ball in case", &ball, HOLLOW, &case, up(depth), 3.0 - depth),
            ];
            for (name, scan, interior, (mesh, solid), pose, exact) in cases {
                let scale = rng.random_range(0.1..10.0);
                let frame = rotation(rng).with_scale(scale).with_translation([3.0, -2.0, 1.0]);
                let own = frame.after(&pose);
                let plan = MeshScanPlan::new(&CollideOptions::default(), scan).unwrap();
                let mut ask = |pose: &Pose, budget: &Budget| {
                    let pair = MeshScanPair::new(Placed::new(scan, &frame), PlacedMesh::new(mesh, pose));
                    pair.within(budget).penetration(&plan, (interior, solid), scratch)
                };
                let found = ask(&own, &Budget::UNLIMITED);
                let radius = scan.sampling_radius() * scale;
                assert!(found.complete && found.lower <= (exact + off) * scale, "{name} {depth}: {found:?}");
                assert!((found.upper - exact * scale).abs() <= radius, "{name} {depth} {scale}: {found:?}");
                let is_whole = interior == SOLID || name == "block in floor";
                let least = if is_whole { 0.5 * found.upper - radius } else { 0.3 * found.upper };
                assert!(found.lower >= least, "{name} {depth} {scale}: {found:?}");
                for _ in 0..10 {
                    let t = Vector::from(unit_vector(rng)) * (found.lower * rng.random_range(0.0..0.999));
                    let again = ask(&shifted(&own, t), &Budget::UNLIMITED.with_work(1));
                    assert!(again.upper > 0.0, "{name}: {t} of {found:?} parts them");
                }
                let parted = Vector::from(found.direction) * found.upper * (1.0 + 1e-9);
                assert_eq!(ask(&shifted(&own, parted), &Budget::UNLIMITED).upper, 0.0, "{name}: {found:?}");
            }
        }
    }
}

/// A mesh without closed parts in a solid scan, a stranger's solid, and what is apart.
#[test]
fn open_meshes_in_scans() {
    let (ball, scratch) = (prepare(sphere(1.0), 0.0), &mut Scratch::default());
    let corners = vec![[0.0, -0.2, -0.2], [0.0, 0.2, -0.2], [0.0, 0.0, 0.3]];
    let blade = TriangleMesh::new(corners, vec![[0, 1, 2]]).unwrap();
    let blade = MeshHierarchy::build(&blade, &MeshBuildOptions::default()).unwrap();
    let solid = MeshSolid::new(&blade);
    let plan = MeshScanPlan::new(&CollideOptions::default(), &ball).unwrap();
    let mut ask = |x: f64, interior, solid: &MeshSolid| {
        let pose = Pose::from_translation([x, 0.0, 0.0]);
        let pair = MeshScanPair::new(Placed::new(&ball, &Pose::IDENTITY), PlacedMesh::new(&blade, &pose));
        pair.penetration(&plan, (interior, solid), scratch)
    };
    // The furthest point of the blade along x is 0.6 from the surface there.
    let inside = ask(0.4, SOLID, &solid);
    assert!(inside.lower > 0.5 && inside.lower <= 0.6 && (inside.upper - 0.6).abs() < 0.06, "{inside:?}");
    assert!(inside.direction[0] > 0.9, "{inside:?}");
    assert_eq!(ask(0.4, HOLLOW, &solid).upper, 0.0);
    assert_eq!(ask(1.2, SOLID, &solid).upper, 0.0);
    let stranger = MeshSolid::new(&box_mesh([1.0; 3]));
    assert!(ask(0.4, SOLID, &stranger).upper.is_infinite());
}
