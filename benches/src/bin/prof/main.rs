//! temp
use nearmiss::*;
use nearmiss_benches::object::Object;
use nearmiss_testdata::arbitrary::{point_in, rng, rotation, unit_vector};
use rand::RngExt;
use std::hint::black_box;
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let (what, kind, rounds): (&str, &str, usize) = (&args[2], &args[3], args[4].parse().unwrap());
    let object = Object::read(&args[1]).unwrap().scaled().unwrap();
    let scan = Scan::build(&object.cloud, &BuildOptions::default()).unwrap().with_shapes();
    let plan = ShapePlan::new(&CollideOptions::estimated().with_detail(Detail::Verdict), &scan).unwrap();
    let target = Target::new(scan.at(&Pose::IDENTITY), &plan);
    let r = object.r;
    let mut shapes = vec![];
    let rng = &mut rng(1);
    for _ in 0..1000 {
        let p = object.cloud.point(rng.random_range(0..object.cloud.len()));
        let d = point_in(rng, 3.0 * r);
        let centre = [0, 1, 2].map(|k| p[k] + d[k]);
        let along = unit_vector(rng);
        let end = [0, 1, 2].map(|k| centre[k] + 4.0 * r * along[k]);
        let pose = rotation(rng).with_translation(centre);
        shapes.push(match kind {
            "sphere" => Shape::Sphere { centre, radius: r },
            "capsule" => Shape::Capsule { ends: [centre, end], radius: r },
            _ => Shape::Box { pose, half: [2.0 * r, r, 0.5 * r], radius: 0.0 },
        });
    }
    let mut scratch = Scratch::default();
    let mut out = vec![];
    let mut sum = 0;
    let start = std::time::Instant::now();
    for _ in 0..rounds {
        for s in &shapes {
            match what {
                "touch" => sum += usize::from(target.touch(black_box(s), &mut scratch).verdict.is_touching()),
                _ => {
                    target.contacts(black_box(s), &mut out, &mut scratch);
                    sum += out.len();
                }
            }
        }
    }
    println!("{sum} {:.0} ns", start.elapsed().as_nanos() as f64 / (rounds * 1000).max(1) as f64);
}
