//! The implicit function near the surface, with both kernels. The rival is kiddo's search for the
//! nearest point at the same places, which a method without a surface needs at least.

use std::hint::black_box;
use std::num::NonZero;

use criterion::{Criterion, criterion_group, criterion_main};
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use nearmiss::hierarchy::GatherScratch;
use nearmiss::{BuildOptions, Kernel, Scan, SurfaceOptions};
use nearmiss_benches::Failure;
use nearmiss_benches::object::{Object, from_folder};
use nearmiss_testdata::arbitrary::{point_in, rng};

/// Places that are asked in turn: more than caches keep warm.
const PLACES: usize = 1 << 14;

/// Places within r of a point, in the frame that the scan is stored in.
fn places(scan: &Scan) -> Vec<[f64; 3]> {
    let rng = &mut rng(1);
    let r = scan.sampling_radius() / scan.frame().scale;
    let step = 7919 % scan.len();
    (0..PLACES)
        .map(|i| {
            let (p, d) = (scan.positions()[i * step % scan.len()], point_in(rng, r));
            [0, 1, 2].map(|k| f64::from(p[k]) + d[k])
        })
        .collect()
}

fn measure(criterion: &mut Criterion, object: &Object) -> Result<(), Failure> {
    let mut group = criterion.benchmark_group(format!("evaluate/{}", object.name));
    for kernel in [Kernel::Gaussian, Kernel::Wendland] {
        let surface = SurfaceOptions::default().with_kernel(kernel);
        let scan = Scan::build(&object.cloud, &BuildOptions::default().with_surface(surface))?;
        let places = places(&scan);
        let mut scratch = GatherScratch::default();
        let mut next = places.iter().cycle();
        group.bench_function(format!("{kernel:?}"), |bencher| {
            bencher.iter(|| next.next().map(|&x| scan.evaluate_with(black_box(x), &mut scratch).f));
        });
    }
    let scan = Scan::build(&object.cloud, &BuildOptions::default())?;
    let tree = ImmutableKdTree::<f32, 3>::new_from_slice(scan.positions()).map_err(|e| format!("{e:?}"))?;
    #[expect(clippy::cast_possible_truncation, reason = "the tree is single precision")]
    let places: Vec<[f32; 3]> = places(&scan).iter().map(|p| p.map(|x| x as f32)).collect();
    let mut next = places.iter().cycle();
    group.bench_function("rival kiddo, nearest point", |bencher| {
        bencher.iter(|| {
            let place = next.next()?;
            Some(tree.query(black_box(place)).nearest_one::<SquaredEuclidean<f32>>().execute().distance)
        });
    });
    let wanted = NonZero::new(32).ok_or("no number")?;
    group.bench_function("rival kiddo, 32 nearest", |bencher| {
        bencher.iter(|| {
            let place = next.next()?;
            Some(tree.query(black_box(place)).nearest_n::<SquaredEuclidean<f32>>(wanted).execute().len())
        });
    });
    group.finish();
    Ok(())
}

fn evaluate(criterion: &mut Criterion) {
    let mut objects = vec![Object::read("dragon-5k").expect("the dragon is shipped")];
    objects.extend(from_folder("dragon-100k.ply").expect("a readable object"));
    for object in &objects {
        measure(criterion, object).expect("a scan of the object");
    }
}

criterion_group!(benches, evaluate);
criterion_main!(benches);
