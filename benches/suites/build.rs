//! Preparing a scan, on one thread and on all. The rivals are kiddo's kd-tree of the points and
//! parry's hierarchy of the mesh. They do less: neither has normals, radii or discs, and the mesh
//! had to be made first.

use std::time::Duration;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use nearmiss::{BuildOptions, Scan};
use nearmiss_benches::object::Object;
use nearmiss_benches::rivals::kiddo::PointScan;
use nearmiss_benches::rivals::parry::MeshTree;

/// The large one takes seconds per run on one thread, and criterion needs ten runs.
const PATIENCE: Duration = Duration::from_secs(20);

fn measure(criterion: &mut Criterion, object: &Object) {
    let mut group = criterion.benchmark_group(format!("build/{}", object.name));
    group
        .sample_size(10)
        .measurement_time(PATIENCE)
        .throughput(Throughput::Elements(object.cloud.len() as u64));
    for (name, threads) in [("one thread", 1), ("all threads", 0)] {
        let options = BuildOptions::default().with_threads(threads);
        group.bench_function(name, |bencher| bencher.iter(|| Scan::build(&object.cloud, &options)));
    }
    group.bench_function("rival kiddo", |bencher| {
        bencher.iter(|| PointScan::new(&object.cloud, object.r).is_ok());
    });
    if let Some(mesh) = &object.mesh {
        group.bench_function("rival parry (mesh)", |bencher| bencher.iter(|| MeshTree::new(mesh)));
    }
    group.finish();
}

fn build(criterion: &mut Criterion) {
    for source in ["dragon-5k", "dragon-23k", "bumpy:1000000"] {
        measure(criterion, &Object::read(source).expect("shipped or generated"));
    }
}

criterion_group!(benches, build);
criterion_main!(benches);
