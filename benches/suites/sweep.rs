//! The sweep, all distances in equal parts: the mean of an iteration is the sweep mean.
//!
//! This suite is for comparing commits. `bench sweep` shows the distribution by distance.

use criterion::{Criterion, criterion_group, criterion_main};
use nearmiss::Pose;
use nearmiss_benches::object::{Object, from_folder};
use nearmiss_benches::{poses, rivals::bench};

/// Poses for each distance, drawn beforehand. Slower methods take fewer iterations per sample than
/// there are poses, so no pose is queried twice within a sample. The fastest ones start again after
/// 26,000.
const PER_DISTANCE: usize = 2000;

/// Distances in turn.
fn poses() -> Vec<Pose> {
    let columns = poses::sweep(PER_DISTANCE, 1, 0);
    (0..PER_DISTANCE).flat_map(|i| columns.iter().map(move |column| column[i]).collect::<Vec<_>>()).collect()
}

fn sweep(criterion: &mut Criterion) {
    let mut objects = vec![Object::read("dragon-23k").expect("the dragon is shipped")];
    objects.extend(from_folder("dragon-100k.ply").expect("a readable object"));
    let poses = poses();
    for object in &objects {
        let object = object.scaled().expect("an object with extent");
        bench(&object, |method| {
            let mut group = criterion.benchmark_group(format!("sweep/{}", object.name));
            let mut next = poses.iter().cycle();
            group.bench_function(method.name(), |bencher| {
                bencher.iter(|| next.next().map(|pose| method.ask(&Pose::IDENTITY, pose)));
            });
            group.finish();
        })
        .expect("methods that take the object");
    }
}

criterion_group!(benches, sweep);
criterion_main!(benches);
