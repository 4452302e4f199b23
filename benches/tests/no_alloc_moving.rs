//! Refits of meshes and scans, and questions about them, allocate no memory once warm.
//!
//! This is a program without a test harness because the counter covers the whole process. It runs
//! on one thread, as rayon allocates to spread work.
#![expect(clippy::unwrap_used, reason = "a test may panic")]

use nearmiss::{
    BuildOptions, CollideOptions, CollidePlan, Evidence, MeshBuildOptions, MeshItself, MeshPair, MeshScratch,
    MovingMesh, MovingScan, Pair, Pose, Scratch,
};
use nearmiss_benches::counting::Counting;
use nearmiss_benches::object::Object;

#[global_allocator]
static ALLOCATOR: Counting = Counting::new();

/// Bends points by an angle a unit of length.
fn bent(points: &[[f64; 3]], bend: f64, out: &mut Vec<[f64; 3]>) {
    out.clear();
    out.extend(points.iter().map(|[x, y, z]| {
        let (s, c) = (bend * x).sin_cos();
        [x * c - 0.1 * y * s, y + 0.3 * x * s, *z]
    }));
}

fn main() {
    let object = Object::read("dragon-5k").unwrap().scaled().unwrap();
    let mesh = object.mesh.as_ref().unwrap();
    let points: Vec<[f64; 3]> = (0..object.cloud.len()).map(|i| object.cloud.point(i)).collect();
    let mut moving_mesh = MovingMesh::new(mesh, &MeshBuildOptions::default()).unwrap();
    let mut moving_scan = MovingScan::new(&points, &BuildOptions::default()).unwrap();
    let (mut scratch, mut mesh_scratch) = (Scratch::default(), MeshScratch::default());
    let mut frame = Vec::new();
    let options = CollideOptions::default().with_evidence(Evidence::Certified);
    let mut run = || {
        let (mut carried, mut hits) = (0, 0);
        for step in 0..20_u8 {
            let bend = 0.01 * f64::from(step % 7);
            bent(mesh.vertices(), bend, &mut frame);
            moving_mesh.refit(&frame).unwrap();
            assert!(moving_mesh.looseness() < 2.0, "step {step}: {}", moving_mesh.looseness());
            bent(&points, bend, &mut frame);
            let refitted = moving_scan.refit(&frame).unwrap();
            assert_eq!(refitted.fitted, 0, "step {step}: points fitted anew need memory");
            carried += refitted.carried;
            for shift in [0.5, 1.0, 3.0] {
                let pose = Pose::from_translation([shift, 0.2, 0.1]);
                let pair = MeshPair::new(moving_mesh.at(&Pose::IDENTITY), moving_mesh.at(&pose));
                hits += usize::from(pair.collide(&mut mesh_scratch).verdict.is_intersecting());
                let plan = CollidePlan::new(&options, &moving_scan, &moving_scan).unwrap();
                let pair = Pair::new(moving_scan.at(&Pose::IDENTITY), moving_scan.at(&pose));
                hits += usize::from(pair.collide(&plan, &mut scratch).verdict.is_intersecting());
            }
            let itself = MeshItself::new(moving_mesh.at(&Pose::IDENTITY));
            hits += usize::from(itself.collide(&mut mesh_scratch).verdict.is_intersecting());
        }
        (carried, hits)
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    pool.install(|| {
        let first = run();
        let again = run();
        let before = ALLOCATOR.calls();
        assert_eq!(run(), first, "answers do not depend on the past");
        assert_eq!(ALLOCATOR.calls() - before, 0, "warm refits allocated");
        assert!(again == first && first.1 > 20, "{first:?}");
    });
}
