//! Two triangles: the exact test, compared with the rounded test of the hand-written traversal and
//! with parry's; contacts; distances.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use nearmiss::mesh::{Corners, triangle_contact, triangle_distance, triangles_meet};
use nearmiss_benches::rivals::triangles::intersect;
use nearmiss_testdata::arbitrary::{point_in, rng};
use parry3d::query::intersection_test;
use parry3d::shape::Triangle;

/// Pairs of each kind; they are asked one after the other.
const PAIRS: usize = 1000;

type Pair = [Corners; 2];

/// Random pairs within a cube of side 2 for which the predicate holds.
fn drawn(seed: u64, keep: impl Fn(&Pair) -> bool) -> Vec<Pair> {
    let rng = &mut rng(seed);
    let pairs = std::iter::repeat_with(|| [(); 2].map(|()| [(); 3].map(|()| point_in(rng, 1.0))));
    pairs.filter(|pair| keep(pair)).take(PAIRS).collect()
}

fn boxes_meet([a, b]: &Pair) -> bool {
    (0..3).all(|k| {
        let low = |t: &Corners| t.iter().map(|p| p[k]).fold(f64::MAX, f64::min);
        let high = |t: &Corners| t.iter().map(|p| p[k]).fold(f64::MIN, f64::max);
        low(a) <= high(b) && low(b) <= high(a)
    })
}

/// Neighbours in a flat grid whose step is not representable: they share an edge or a corner.
fn tiles() -> Vec<Pair> {
    let corner = |i: usize, j: usize| [0.1 * i as f64, 0.1 * j as f64, 0.7];
    let lower = |i: usize, j: usize| [corner(i, j), corner(i + 1, j), corner(i, j + 1)];
    let upper = |i: usize, j: usize| [corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
    (0..PAIRS)
        .map(|n| {
            [
                lower(n % 30, n / 30),
                if n % 2 == 0 { upper(n % 30, n / 30) } else { lower(n % 30 + 1, n / 30) },
            ]
        })
        .collect()
}

/// Pairs that share an edge but no plane, as neighbours in a mesh do.
fn hinges() -> Vec<Pair> {
    drawn(5, |_| true).into_iter().map(|[a, b]| [a, [a[1], a[0], b[2]]]).collect()
}

fn triangles(criterion: &mut Criterion) {
    let kinds: [(&str, Vec<Pair>); 5] = [
        ("far", drawn(1, |pair| !boxes_meet(pair))),
        ("near", drawn(2, |pair| boxes_meet(pair) && !triangles_meet(&pair[0], &pair[1]))),
        ("meeting", drawn(3, |pair| triangles_meet(&pair[0], &pair[1]))),
        ("hinges", hinges()),
        ("tiles", tiles()),
    ];
    for (kind, pairs) in &kinds {
        let mut group = criterion.benchmark_group(format!("triangles/{kind}"));
        group.throughput(Throughput::Elements(PAIRS as u64));
        group.bench_function("exact", |bencher| {
            bencher.iter(|| pairs.iter().filter(|[a, b]| triangles_meet(black_box(a), b)).count());
        });
        group.bench_function("rounded", |bencher| {
            bencher.iter(|| pairs.iter().filter(|[a, b]| intersect(black_box(a), b)).count());
        });
        let single = |t: &Corners| {
            #[expect(clippy::cast_possible_truncation, reason = "parry's precision")]
            let single = |x: f64| x as f32;
            let [a, b, c] = t.map(|p| parry3d::math::Vector::from(p.map(single)));
            Triangle::new(a, b, c)
        };
        let singles: Vec<[Triangle; 2]> =
            pairs.iter().map(|pair| [single(&pair[0]), single(&pair[1])]).collect();
        let place = parry3d::math::Pose::identity();
        group.bench_function("parry-f32", |bencher| {
            bencher.iter(|| {
                let meet = |[a, b]: &&[Triangle; 2]| {
                    intersection_test(&place, black_box(a), &place, b).is_ok_and(|found| found.intersecting)
                };
                singles.iter().filter(meet).count()
            });
        });
        group.bench_function("contact", |bencher| {
            bencher
                .iter(|| pairs.iter().filter(|[a, b]| triangle_contact(black_box(a), b).is_some()).count());
        });
        group.bench_function("distance", |bencher| {
            bencher
                .iter(|| pairs.iter().map(|[a, b]| triangle_distance(black_box(a), b).distance).sum::<f64>());
        });
        group.finish();
    }
}

criterion_group!(benches, triangles);
criterion_main!(benches);
