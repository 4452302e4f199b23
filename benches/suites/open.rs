//! Opening a prepared scan of a million points. It is compared with reading the file, and with
//! building kiddo's kd-tree, which a user of a library without files does at every start.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use nearmiss::{BuildOptions, Check, Scan};
use nearmiss_benches::Failure;
use nearmiss_benches::object::Object;
use nearmiss_benches::rivals::kiddo::PointScan;

fn measure(criterion: &mut Criterion) -> Result<(), Failure> {
    let object = Object::read("bumpy:1000000")?;
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("bumpy.scan");
    let bytes = Scan::build(&object.cloud, &BuildOptions::default())?.save(&path)?;
    let mut group = criterion.benchmark_group("open/bumpy:1000000");
    group.sample_size(10).throughput(Throughput::Bytes(bytes));
    group.bench_function("Check::Structure", |bencher| {
        bencher.iter(|| Scan::open(&path, Check::Structure));
    });
    group.bench_function("Check::Full", |bencher| bencher.iter(|| Scan::open(&path, Check::Full)));
    group.bench_function("only reading the file", |bencher| bencher.iter(|| std::fs::read(&path)));
    group.bench_function("rival kiddo, building", |bencher| {
        bencher.iter(|| PointScan::new(&object.cloud, object.r).is_ok());
    });
    group.finish();
    Ok(())
}

fn open(criterion: &mut Criterion) {
    measure(criterion).expect("a scan that can be saved and opened");
}

criterion_group!(benches, open);
criterion_main!(benches);
