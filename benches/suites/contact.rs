//! Poses within 10 r of first touch, half of them apart. Queries take longest there.

use criterion::{Criterion, criterion_group, criterion_main};
use nearmiss::Pose;
use nearmiss_benches::object::{Object, from_folder};
use nearmiss_benches::{poses, rivals::bench};

/// Poses drawn beforehand; each costs some milliseconds to find.
const POSES: usize = 4000;

/// Enough for a run of `-- --test`, which asks each method once.
const POSES_TO_TRY: usize = 20;

fn contact(criterion: &mut Criterion) {
    let mut objects = vec![Object::read("dragon-23k").expect("the dragon is shipped")];
    objects.extend(from_folder("dragon-100k.ply").expect("a readable object"));
    let count = if std::env::args().any(|word| word == "--test") { POSES_TO_TRY } else { POSES };
    for object in &objects {
        let object = object.scaled().expect("an object with extent");
        let poses = poses::near(&object, count, 1).expect("poses near contact");
        bench(&object, |method| {
            let mut group = criterion.benchmark_group(format!("contact/{}", object.name));
            let mut next = poses.iter().cycle();
            group.bench_function(method.name(), |bencher| {
                bencher.iter(|| next.next().map(|near| method.ask(&Pose::IDENTITY, &near.pose)));
            });
            group.finish();
        })
        .expect("methods that take the object");
    }
}

criterion_group!(benches, contact);
criterion_main!(benches);
