//! Shapes that move past scans, against brute force over time; distances of two shapes.

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_geometry::{Motion, PointCloud, Pose, Screw};
use nearmiss_hierarchy::{BuildOptions, PointHierarchy};
use nearmiss_query::{
    Budget, CollideOptions, Placed, Scratch, Shape, ShapePlan, ShapeSweepVerdict, SupportMap, SweepReason,
    Target,
};
use nearmiss_testdata::arbitrary::{point_in, rng, rotation, unit_vector};
use nearmiss_testdata::shapes::{self, Form, Order, Sampling};
use rand::{Rng, RngExt};

type Vector = Vector3<f64>;

/// A scan of a form, with points 0.05 apart.
fn scanned(form: Form, noise: f64) -> PointHierarchy {
    let sampled = form.sample(Sampling { spacing: 0.05, noise, order: Order::Random, seed: 2 });
    let cloud = PointCloud::from_positions(&sampled.points).unwrap();
    PointHierarchy::build(&cloud, &BuildOptions::default()).unwrap()
}

/// Shapes of about this size in their own frame.
fn shapes_of(size: f64) -> [Shape<'static>; 5] {
    let up = Pose::from_translation([0.2 * size, 0.0, 0.0]);
    [
        Shape::Sphere { centre: [0.3 * size, 0.0, 0.0], radius: size },
        Shape::Capsule { ends: [[-size, 0.0, 0.0], [size, 0.0, 0.0]], radius: 0.4 * size },
        Shape::Box { pose: up, half: [size, 0.6 * size, 0.3 * size], radius: 0.0 },
        Shape::Cylinder { pose: up, half_height: size, radius: 0.5 * size, rounding: 0.0 },
        Shape::Triangle { points: [[size, 0.0, 0.0], [0.0, size, 0.0], [-size, -size, 0.1]], radius: 0.1 },
    ]
}

/// Poses near the torus. A path that stays on one side of it is often free.
fn path(rng: &mut impl Rng, stays: bool) -> Vec<Pose> {
    let side = unit_vector(rng);
    let mut pose = || {
        let place = if stays {
            let (away, beside) = (rng.random_range(1.4..2.4), point_in(rng, 0.5));
            [0, 1, 2].map(|k| side[k] * away + beside[k])
        } else {
            unit_vector(rng).map(|x| x * rng.random_range(0.6..2.4))
        };
        rotation(rng).with_translation(place)
    };
    vec![pose(), pose(), pose()]
}

/// The signed distance of a place from the torus.
fn off_the_torus(p: Vector) -> f64 {
    (p.xy().norm() - 1.0).hypot(p.z) - 0.4
}

#[test]
fn free_parts_are_free_and_impacts_are_where_brute_force_finds_them() {
    let scan = scanned(shapes::torus(1.0, 0.4), 0.03);
    let r = scan.sampling_radius();
    let rng = &mut rng(11);
    let mut scratch = Scratch::default();
    let (mut seen, mut clear, mut proven, mut queries, mut late) = ([0; 3], 0, 0, 0, 0);
    for round in 0..80_usize {
        let margin = [0.0, 0.1][round % 2];
        let plan = ShapePlan::new(&CollideOptions::default().with_margin(margin), &scan).unwrap();
        let target = Target::new(Placed::new(&scan, &Pose::IDENTITY), &plan);
        let shape = shapes_of(0.15)[round % 5];
        let poses = path(rng, round % 4 < 2);
        let motion = Motion::through(&poses).unwrap();
        let answer = target.sweep(&shape, &motion, &mut scratch);
        queries += answer.distances;
        // Brute force.
        let steps = 400_u32;
        let at = |step: u32| f64::from(step) / f64::from(steps) * motion.duration();
        let mut upper = |time: f64| {
            let moved = shape.moved(&motion.at(time)).unwrap();
            target.distance(&moved, f64::INFINITY, &mut scratch).unwrap().upper
        };
        let distances: Vec<f64> = (0..=steps).map(|step| upper(at(step))).collect();
        let first = distances.iter().position(|&d| d <= margin);
        let least = distances.iter().copied().fold(f64::INFINITY, f64::min);
        let way = |t: f64| {
            let [p, q] = [t, t + 1e-6].map(|t| motion.at(t));
            let ball = 0.4 * 0.15;
            (Vector::from(p.apply([ball; 3])) - Vector::from(q.apply([ball; 3]))).norm() / 1e-6
        };
        clear += usize::from(least > margin + 6.0 * r);
        match answer.verdict {
            ShapeSweepVerdict::Free { clearance, upper, .. } => {
                assert!(first.is_none(), "{shape:?} is free, but touches at {first:?}");
                assert!(clearance >= margin && clearance <= least + 1e-9, "{clearance} kept, {least} found");
                assert!(upper >= clearance && upper >= least - 0.05, "{upper} for {least}");
                proven += usize::from(least > margin + 6.0 * r);
                seen[0] += 1;
            }
            ShapeSweepVerdict::Impact { t_free, t_hit, contact } => {
                let first = first.map(|step| at(u32::try_from(step).unwrap()));
                assert!(first.is_none_or(|first| first >= t_free), "touches at {first:?}, free to {t_free}");
                assert!(upper(t_hit) <= margin && t_free <= t_hit, "no contact at {t_hit}");
                // A hit between two of the times of brute force may be missed by it.
                let error = first.map_or(0.0, |first| (t_hit - first) * way(t_hit));
                assert!(error < r, "impact at {t_hit} instead of {first:?}");
                let depth = contact.depth + margin;
                assert!(
                    t_hit == 0.0 || depth.abs() < 0.5 * r,
                    "{contact:?} at {t_hit}, margin {margin}, r {r}"
                );
                let off = off_the_torus(contact.point.into());
                assert!(off.abs() < 0.5 * r, "{contact:?} is {off} off, r {r}");
                late += usize::from((t_hit - t_free) * way(t_hit) > 2.0 * r);
                seen[1] += 1;
            }
            ShapeSweepVerdict::Undecided { t_free, reason } => {
                assert_eq!(reason, SweepReason::Near, "{shape:?}");
                let first = first.map(|step| at(u32::try_from(step).unwrap()));
                assert!(first.is_none(), "touches at {first:?}, undecided from {t_free}");
                seen[2] += 1;
            }
        }
    }
    assert!(seen[0] > 15 && seen[1] > 15, "free, impact, undecided: {seen:?}");
    assert!(proven * 100 >= clear * 95, "{proven} of {clear} motions that stay clear are proven");
    // Only where a shape slides beside the scan first.
    assert!(late * 4 <= seen[1], "{late} of {} impacts long after the end of the proof", seen[1]);
    assert!(queries < 80 * 40, "{queries} distance queries");
}

/// A solid box, known by its support map.
#[derive(Debug)]
struct Corners(Vec<[f64; 3]>);

impl SupportMap for Corners {
    fn support(&self, direction: [f64; 3]) -> [f64; 3] {
        let along = |p: &[f64; 3]| Vector::from(*p).dot(&Vector::from(direction));
        *self.0.iter().max_by(|a, b| along(a).total_cmp(&along(b))).expect("corners")
    }

    fn centre(&self) -> [f64; 3] {
        [0.0; 3]
    }
}

#[test]
fn plans_without_proof_find_the_impacts_of_all_shapes_in_a_few_steps() {
    let scan = scanned(shapes::torus(1.0, 0.4), 0.0);
    let (r, rng, mut scratch) = (scan.sampling_radius(), &mut rng(5), Scratch::default());
    let placed = rotation(rng).with_translation([3.0, -1.0, 2.0]).with_scale(1.5);
    let plan = ShapePlan::new(&CollideOptions::estimated(), &scan).unwrap();
    let target = Target::new(Placed::new(&scan, &placed), &plan);
    let half = [0.15, 0.1, 0.05];
    let corners: Vec<[f64; 3]> =
        (0..8_u8).map(|i| [0, 1, 2].map(|k| if i >> k & 1 == 0 { -half[k] } else { half[k] })).collect();
    let own = Corners(corners.clone());
    // A motion in the scan's own frame, moved along with the scan; rigid.
    let into = |pose: &Pose| placed.after(pose).with_scale(1.0);
    let (mut impacts, mut free, mut queries) = (0, 0, 0);
    for round in 0..60_usize {
        let motion =
            Motion::through(&path(rng, round % 2 == 0).iter().map(into).collect::<Vec<_>>()).unwrap();
        let solid = Shape::Box { pose: Pose::IDENTITY, half, radius: 0.02 };
        let others = [Shape::Hull { points: &corners, radius: 0.02 }, Shape::Own { map: &own, radius: 0.02 }];
        let [of_box, of_hull, of_own] = [solid, others[0], others[1]].map(|shape| {
            let answer = target.sweep(&shape, &motion, &mut scratch);
            queries += answer.distances;
            match answer.verdict {
                ShapeSweepVerdict::Impact { t_hit, contact, .. } => Some((t_hit, contact)),
                ShapeSweepVerdict::Undecided { .. } => None,
                ShapeSweepVerdict::Free { .. } => panic!("nothing is proven"),
            }
        });
        let speed = 1.5 * 4.0;
        for other in [of_hull, of_own] {
            let (a, b) = (of_box.map(|it| it.0), other.map(|it| it.0));
            assert_eq!(a.is_some(), b.is_some(), "box {a:?}, other {b:?} in round {round}");
            let away = a.zip(b).map_or(0.0, |(a, b)| (a - b).abs() * speed);
            assert!(away < 0.5 * r, "box {a:?}, other {b:?} in round {round}");
            let off = other.filter(|it| it.0 > 0.0).map(|it| {
                let foot = placed.apply_inverse(it.1.point);
                (off_the_torus(foot.into()), it.1.depth)
            });
            assert!(off.is_none_or(|(off, depth)| off.abs() < 0.5 * r && depth.abs() < r), "{off:?}, r {r}");
        }
        // Brute force.
        let touches = |time: f64| {
            let moved = solid.moved(&motion.at(time)).unwrap();
            target.touch(&moved, &mut Scratch::default()).verdict.is_touching()
        };
        let first = (0..=1000_u32).map(|i| f64::from(i) * 0.002).find(|&t| touches(t));
        match (first, of_box) {
            (Some(first), Some((t_hit, _))) => {
                assert!(t_hit <= first && (first - t_hit) * speed < 0.5 * r, "{t_hit}, brute force {first}");
                impacts += 1;
            }
            (Some(first), None) => panic!("touches at {first}, but no impact in round {round}"),
            // Between two of the times of brute force.
            (None, Some((t_hit, _))) => assert!(touches(t_hit), "no contact at {t_hit} in round {round}"),
            (None, None) => free += 1,
        }
    }
    assert!(impacts > 15 && free > 15, "{impacts} impacts, {free} free");
    assert!(queries < 3 * 60 * 30, "{queries} distance queries");
}

#[test]
fn shapes_that_do_not_move_or_start_in_contact_are_told() {
    let scan = scanned(shapes::patch(2.0, 2.0), 0.0);
    let plan = ShapePlan::new(&CollideOptions::default(), &scan).unwrap();
    let target = Target::new(Placed::new(&scan, &Pose::IDENTITY), &plan);
    let mut scratch = Scratch::default();
    let ball = Shape::Sphere { centre: [0.0; 3], radius: 0.1 };
    let still = |z: f64| Motion::still(Pose::from_translation([0.0, 0.0, z]));
    let mut told = |shape: &Shape<'_>, motion: &Motion| target.sweep(shape, motion, &mut scratch).verdict;
    assert!(matches!(told(&ball, &still(0.5)), ShapeSweepVerdict::Free { .. }), "above the floor");
    let ShapeSweepVerdict::Impact { t_free, t_hit, .. } = told(&ball, &still(0.05)) else {
        panic!("in the floor");
    };
    assert_eq!((t_free, t_hit), (0.0, 0.0), "in contact from the start");
    let empty = Shape::Hull { points: &[], radius: 0.1 };
    let wrong = Shape::Sphere { centre: [0.0; 3], radius: -1.0 };
    for shape in [empty, wrong] {
        let verdict = told(&shape, &still(0.5));
        let reason = SweepReason::Shape;
        assert_eq!(verdict, ShapeSweepVerdict::Undecided { t_free: 0.0, reason }, "{shape:?}");
    }
    // A mirrored pose bounds no speed, and what is proven before a broken pose stays proven.
    let plate = Shape::Triangle { points: [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], radius: 0.0 };
    let mirrored = Pose::from_translation([0.0, 0.0, 2.0]).with_scale(-1.0);
    let verdict = told(&plate, &Motion::of_screw(Screw::new(mirrored, [0.0, 3.0, 0.0], [0.0, 0.0, -4.0])));
    assert_eq!(verdict, ShapeSweepVerdict::Undecided { t_free: 0.0, reason: SweepReason::Pose });
    let places = [0.5, 0.7, 1e200].map(|z| Pose::from_translation([0.0, 0.0, z]));
    let verdict = told(&ball, &Motion::through(&places).unwrap());
    assert!(matches!(verdict, ShapeSweepVerdict::Undecided { t_free: 1.0.., .. }), "{verdict:?}");
    // Close by for a long way: never a hit, and no proof either.
    let at = |x: f64| Pose::from_translation([x, 0.0, 0.105]);
    let along = Motion::through(&[at(-0.9), at(0.9)]).unwrap();
    let verdict = told(&ball, &along);
    assert!(!matches!(verdict, ShapeSweepVerdict::Impact { .. }), "{verdict:?}");
}

/// A limit of work ends a sweep with what the first queries prove.
#[test]
fn budgets_end_a_sweep_of_a_shape_with_what_is_proven() {
    let scan = scanned(shapes::torus(1.0, 0.4), 0.0);
    let plan = ShapePlan::new(&CollideOptions::default(), &scan).unwrap();
    let target = Target::new(Placed::new(&scan, &Pose::IDENTITY), &plan);
    let (ball, scratch) = (Shape::Sphere { centre: [0.0; 3], radius: 0.2 }, &mut Scratch::default());
    let at = |x: f64| Pose::from_translation([x, 0.1, 0.0]);
    let motion = Motion::through(&[at(4.0), at(2.5), at(0.0)]).unwrap();
    let whole = target.sweep(&ball, &motion, scratch);
    let ShapeSweepVerdict::Impact { t_hit, .. } = whole.verdict else { panic!("{whole:?}") };
    let mut last = 0.0;
    for work in 1..=u64::from(whole.distances) {
        let answer = target.sweep_within(&ball, &motion, &Budget::UNLIMITED.with_work(work), scratch);
        let ShapeSweepVerdict::Undecided { t_free, reason: SweepReason::Budget } = answer.verdict else {
            assert_eq!(answer, whole, "{work} queries suffice");
            assert!(last > 0.8 * t_hit, "{last} was proven before");
            return;
        };
        assert_eq!(u64::from(answer.distances), work);
        assert!(t_free >= last && t_free < t_hit, "{work} queries: {answer:?}");
        last = t_free;
    }
    panic!("no budget suffices: {whole:?}");
}

#[test]
fn shapes_much_smaller_than_the_spacing_pass_through_no_surface() {
    let scan = scanned(shapes::patch(2.0, 2.0), 0.1);
    let plan = ShapePlan::new(&CollideOptions::default(), &scan).unwrap();
    let target = Target::new(Placed::new(&scan, &Pose::IDENTITY), &plan);
    let (rng, scratch) = (&mut rng(8105), &mut Scratch::default());
    for round in 0..200_usize {
        let size = [0.003, 0.001][round % 2];
        let [p, q] = [0, 1].map(|_| unit_vector(rng).map(|x| x * size));
        let shape = match round / 2 % 4 {
            0 => Shape::Sphere { centre: [0.0; 3], radius: size },
            1 => Shape::Box { pose: Pose::IDENTITY, half: [size; 3], radius: 0.0 },
            2 => Shape::Capsule { ends: [p, q], radius: 0.5 * size },
            _ => Shape::Cylinder { pose: Pose::IDENTITY, half_height: size, radius: size, rounding: 0.0 },
        };
        let [x, y] = [0, 1].map(|_| rng.random_range(-0.8..0.8));
        let turned = rotation(rng);
        let motion = Motion::through(&[0.3, -0.3].map(|z| turned.with_translation([x, y, z]))).unwrap();
        let verdict = target.sweep(&shape, &motion, scratch).verdict;
        let ShapeSweepVerdict::Impact { t_hit, .. } = verdict else {
            panic!("round {round}: {shape:?} at {x} {y} passes through: {verdict:?}");
        };
        assert!((t_hit - 0.5).abs() * 0.6 < 0.03, "round {round}: {verdict:?}");
    }
}

#[test]
fn distances_of_two_shapes_equal_those_of_their_points() {
    let rng = &mut rng(3);
    for round in 0..200_usize {
        let own = [0, 1].map(|k| {
            let by =
                rotation(rng).with_translation(point_in(rng, 2.0)).with_scale(rng.random_range(0.5..2.0));
            shapes_of(0.5)[(round + k * (round / 5)) % 5].moved(&by).unwrap()
        });
        let gap = own[0].gap_to(&own[1]).unwrap();
        let back = own[1].gap_to(&own[0]).unwrap();
        assert!((gap.upper - back.upper).abs() < 1e-6, "{gap:?}, {back:?}");
        assert!(gap.lower <= gap.upper && gap.upper - gap.lower < 1e-6, "{gap:?}");
        let apart = (Vector::from(gap.points[0]) - Vector::from(gap.points[1])).norm();
        assert!((apart - gap.upper).abs() < 1e-6, "{gap:?}: points are {apart} apart");
        // Of two spheres about points of the cores, in closed form.
        if let [Shape::Capsule { ends: p, radius: a }, Shape::Capsule { ends: q, radius: b }] = own {
            let brute = (0..=100_u32)
                .flat_map(|i| (0..=100_u32).map(move |j| [i, j]))
                .map(|[i, j]| {
                    let on = |ends: [[f64; 3]; 2], share: u32| {
                        let [from, to] = ends.map(Vector::from);
                        from + (to - from) * (f64::from(share) * 0.01)
                    };
                    ((on(p, i) - on(q, j)).norm() - a - b).max(0.0)
                })
                .fold(f64::INFINITY, f64::min);
            assert!(gap.upper <= brute + 1e-9 && brute <= gap.upper + 0.02, "{gap:?} for {brute}");
        }
    }
    let wrong = Shape::Sphere { centre: [f64::NAN; 3], radius: 1.0 };
    assert!(wrong.gap_to(&shapes_of(1.0)[0]).is_none(), "invalid shapes have no distance");
}
