//! Penetrations of scans, and of shapes and scans, against known depths.

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_geometry::{PointCloud, Pose};
use nearmiss_hierarchy::{BuildOptions, PointHierarchy};
use nearmiss_query::{
    Budget, CollideOptions, CollidePlan, Interior, Pair, Penetration, Placed, Scratch, Semantics, Shape,
    ShapePlan, SupportMap, Target,
};
use nearmiss_testdata::arbitrary::{rng, rotation, unit_vector};
use nearmiss_testdata::shapes::{Form, Order, Sampling, cuboid, patch, sphere, torus};
use rand::RngExt;

type Random = rand_xoshiro::Xoshiro256PlusPlus;
type Vector = Vector3<f64>;

const SPACING: f64 = 0.04;

fn prepare(form: Form, noise: f64) -> PointHierarchy {
    let sampling = Sampling { spacing: SPACING, noise, order: Order::Random, seed: 5 };
    let points = form.sample(sampling).points;
    let cloud = PointCloud::from_positions(&points).unwrap();
    PointHierarchy::build(&cloud, &BuildOptions::default()).unwrap()
}

fn shifted(pose: &Pose, t: Vector) -> Pose {
    pose.with_translation((Vector::from(pose.translation()) + t).into())
}

const HOLLOW: Interior = Interior::Hollow;
const SOLID: Interior = Interior::Solid;

/// Two scans, the pose of b relative to a, and the exact penetration.
struct Case<'s> {
    name: &'static str,
    scans: [&'s PointHierarchy; 2],
    interiors: [Interior; 2],
    pose: Pose,
    exact: f64,
}

impl Case<'_> {
    fn at(&self, frame: &Pose) -> [Pose; 2] {
        [*frame, frame.after(&self.pose)]
    }

    fn ask(&self, poses: &[Pose; 2], budget: &Budget, scratch: &mut Scratch) -> Penetration {
        let [a, b] = self.scans;
        let plan = CollidePlan::new(&CollideOptions::default(), a, b).unwrap();
        let pair = Pair::new(Placed::new(a, &poses[0]), Placed::new(b, &poses[1])).within(budget);
        pair.penetration(&plan, self.interiors, scratch)
    }
}

/// Asserts that the bounds are valid and near the exact penetration, all in units of a length `scale`.
fn check(name: &str, found: &Penetration, exact: f64, radius: f64) {
    assert!(found.complete, "{name}: {found:?}");
    assert!(found.lower <= exact + radius, "{name}: {exact} {found:?}");
    assert!(found.lower >= 0.5 * exact, "{name}: {exact} {found:?}");
    assert!((found.upper - exact).abs() <= radius, "{name}: {exact} {found:?}");
}

#[test]
fn scans_of_known_penetration() {
    let rng = &mut rng(8801);
    for noise in [0.0, 0.1] {
        let [floor, ball, small, ring, block] =
            [patch(4.0, 4.0), sphere(1.0), sphere(0.6), torus(1.0, 0.3), cuboid([1.0, 0.8, 0.6])]
                .map(|form| prepare(form, noise));
        let mut worst = (0.0_f64, f64::INFINITY);
        for round in 0..4_u8 {
            let up = |z: f64| Pose::from_translation([0.1 * f64::from(round), 0.05, z]);
            let depth = [0.03, 0.1, 0.2, 0.27][usize::from(round)] + rng.random_range(0.0..0.02);
            let way = Vector::from(unit_vector(rng));
            let beside = |distance: f64| Pose::from_translation((way * distance).into());
            let cases = [
                ("ball on floor", [&floor, &ball], [HOLLOW, SOLID], up(1.0 - depth), depth),
                ("floor under ball", [&ball, &floor], [SOLID, HOLLOW], up(depth - 1.0), depth),
                ("ring on floor", [&floor, &ring], [HOLLOW, SOLID], up(0.3 - depth), depth),
                ("block on floor", [&floor, &block], [HOLLOW, SOLID], up(0.3 - depth), depth),
                ("balls", [&ball, &small], [SOLID; 2], beside(1.6 - depth), depth),
                ("ball in ball", [&ball, &small], [SOLID; 2], beside(0.1), 1.5),
                ("ball on block", [&block, &ball], [SOLID; 2], up(1.3 - depth), depth),
            ];
            for (name, scans, interiors, pose, exact) in cases {
                let case = Case { name, scans, interiors, pose, exact };
                let scale = rng.random_range(0.1..10.0);
                let frame = rotation(rng).with_scale(scale).with_translation([3.0, -2.0, 1.0]);
                let poses = case.at(&frame);
                let scratch = &mut Scratch::default();
                let found = case.ask(&poses, &Budget::UNLIMITED, scratch);
                let radius = scans.map(PointHierarchy::sampling_radius).into_iter().fold(0.0, f64::max);
                check(case.name, &found, case.exact * scale, radius * scale);
                worst.0 = worst.0.max((found.upper / scale - exact).abs() / radius);
                worst.1 = worst.1.min(found.lower / found.upper);
                assert!(shorter_shifts_do_not_part(&case, &poses, &found, rng) > 0, "{name}");
            }
        }
        println!("noise {noise}: upper at most {:.2} r off, lower at least {:.2} of it", worst.0, worst.1);
        assert!(worst.1 >= 0.5, "lower only {} of upper", worst.1);
    }
}

/// Asks about shifts by less than the lower bound, and returns their number: the scans have to meet, or one
/// encloses the other.
fn shorter_shifts_do_not_part(
    case: &Case<'_>,
    poses: &[Pose; 2],
    found: &Penetration,
    rng: &mut Random,
) -> u32 {
    let scratch = &mut Scratch::default();
    for _ in 0..20 {
        let t = Vector::from(unit_vector(rng)) * (found.lower * rng.random_range(0.0..0.999));
        let again = case.ask(&[poses[0], shifted(&poses[1], t)], &Budget::UNLIMITED.with_work(1), scratch);
        assert!(again.upper > 0.0, "{}: {t} of {found:?} parts them", case.name);
    }
    let parted = shifted(&poses[1], Vector::from(found.direction) * found.upper * (1.0 + 1e-9));
    let again = case.ask(&[poses[0], parted], &Budget::UNLIMITED, scratch);
    assert_eq!(again.upper, 0.0, "{}: {found:?} does not part them", case.name);
    20
}

/// The bounds are valid with every budget, and those of a greater budget are no worse.
#[test]
fn budgets_keep_bounds_valid() {
    let (floor, ball) = (prepare(patch(4.0, 4.0), 0.0), prepare(sphere(1.0), 0.0));
    let pose = Pose::from_translation([0.0, 0.0, 0.8]);
    let case =
        Case { name: "ball on floor", scans: [&floor, &ball], interiors: [HOLLOW, SOLID], pose, exact: 0.2 };
    let scratch = &mut Scratch::default();
    let poses = case.at(&Pose::IDENTITY);
    let mut last = (0.0, f64::INFINITY);
    let mut incomplete = 0;
    for work in [0, 1, 10, 100, 1000, 10_000, 100_000, 10_000_000] {
        let found = case.ask(&poses, &Budget::UNLIMITED.with_work(work), scratch);
        assert!(found.lower <= 0.2 + 0.01 && found.upper >= 0.2 - 0.02, "{work}: {found:?}");
        assert!(found.lower >= last.0 && found.upper <= last.1, "{work}: {found:?} {last:?}");
        last = (found.lower, found.upper);
        incomplete += u32::from(!found.complete);
    }
    assert!(incomplete >= 3 && last.1 < 0.23, "{incomplete} {last:?}");
}

/// Thickened points, separate scans, scans without inside, and invalid poses.
#[test]
fn other_meanings() {
    let (floor, ball) = (prepare(patch(4.0, 4.0), 0.0), prepare(sphere(1.0), 0.0));
    let scratch = &mut Scratch::default();
    let mut ask = |options: CollideOptions, z: f64, interiors| {
        let plan = CollidePlan::new(&options, &floor, &ball).unwrap();
        let pose = Pose::from_translation([0.0, 0.0, z]);
        let pair = Pair::new(Placed::new(&floor, &Pose::IDENTITY), Placed::new(&ball, &pose));
        pair.penetration(&plan, interiors, scratch)
    };
    let options = CollideOptions::default();
    let apart = ask(options, 1.2, [HOLLOW, SOLID]);
    assert_eq!((apart.lower, apart.upper, apart.complete), (0.0, 0.0, true));
    let hollow = ask(options, 0.9, [HOLLOW; 2]);
    assert!(hollow.lower == 0.0 && (hollow.upper - 0.1).abs() < 0.03, "{hollow:?}");
    // A ball without inside may enclose a floor of which no part is outside; this floor is larger.
    let margin = ask(options.with_margin(0.2), 0.9, [HOLLOW, SOLID]);
    assert!((margin.lower - 0.3).abs() < 0.03 && (margin.upper - 0.3).abs() < 0.05, "{margin:?}");
    let thick = ask(options.with_semantics(Semantics::Thickened(0.1)), 1.1, [HOLLOW, SOLID]);
    assert!(thick.lower > 0.08 && thick.lower <= 0.1 && (thick.upper - 0.1).abs() < 0.02, "{thick:?}");
    let invalid = ask(options, f64::NAN, [HOLLOW, SOLID]);
    assert!(invalid.lower == 0.0 && invalid.upper == f64::INFINITY && !invalid.complete, "{invalid:?}");
}

/// An ellipsoid, as a shape of the caller's own.
#[derive(Debug)]
struct Ellipsoid([f64; 3], [f64; 3]);

impl SupportMap for Ellipsoid {
    fn support(&self, direction: [f64; 3]) -> [f64; 3] {
        let Self(radii, centre) = self;
        let along = Vector::from([0, 1, 2].map(|k| direction[k] * radii[k]));
        let length = along.norm();
        [0, 1, 2].map(|k| centre[k] + radii[k] * along[k] / length)
    }

    fn centre(&self) -> [f64; 3] {
        self.1
    }
}

/// The lowest and the highest z of a cylinder or cone of half height 0.3 with these radii below and above.
fn heights(pose: &Pose, radii: [f64; 2]) -> [f64; 2] {
    let axis = pose.rotate([0.0, 1.0, 0.0])[2];
    let ends = [0, 1].map(|k: usize| {
        let (centre, rim) =
            (pose.apply([0.0, [-0.3, 0.3][k], 0.0])[2], radii[k] * (1.0 - axis * axis).sqrt());
        [centre - rim, centre + rim]
    });
    [ends[0][0].min(ends[1][0]), ends[0][1].max(ends[1][1])]
}

/// The least shift of shapes out of a floor is their depth below it or, on the way down, their height above.
#[test]
fn shapes_in_a_floor() {
    let rng = &mut rng(8802);
    for noise in [0.0, 0.1] {
        let floor = prepare(patch(4.0, 4.0), noise);
        let radius = floor.sampling_radius();
        let plan = ShapePlan::new(&CollideOptions::default(), &floor).unwrap();
        let scratch = &mut Scratch::default();
        let mut worst = (0.0_f64, f64::INFINITY);
        for round in 0..6 {
            let place = Vector::new(rng.random_range(-0.5..0.5), rng.random_range(-0.5..0.5), 0.0);
            let centre = |z: f64| [place.x, place.y, z];
            let turned = rotation(rng).with_translation(centre(rng.random_range(0.0..0.2)));
            let corners: Vec<[f64; 3]> =
                (0..20).map(|_| turned.apply(unit_vector(rng).map(|x| 0.4 * x))).collect();
            let own = Ellipsoid([0.5, 0.3, 0.4], centre(0.2));
            let end = turned.apply([0.3, 0.0, 0.0]);
            let shapes = [
                ("sphere", Shape::Sphere { centre: centre(0.3), radius: 0.4 }),
                ("capsule", Shape::Capsule { ends: [turned.translation(), end], radius: 0.25 }),
                ("box", Shape::Box { pose: turned, half: [0.3, 0.2, 0.4], radius: 0.0 }),
                ("rounded box", Shape::Box { pose: turned, half: [0.3, 0.2, 0.1], radius: 0.2 }),
                ("cylinder", Shape::Cylinder { pose: turned, half_height: 0.3, radius: 0.2, rounding: 0.0 }),
                ("cone", Shape::Cone { pose: turned, half_height: 0.3, radius: 0.4, rounding: 0.0 }),
                ("hull", Shape::Hull { points: &corners, radius: 0.0 }),
                ("ellipsoid", Shape::Own { map: &own, radius: 0.0 }),
            ];
            let frame = rotation(rng).with_scale(2.0).with_translation([1.0, 2.0, 3.0]);
            for (name, shape) in shapes {
                let bounds = shape.bounds().unwrap();
                let [low, high] = match name {
                    "cone" => heights(&turned, [0.4, 0.0]),
                    "cylinder" => heights(&turned, [0.2, 0.2]),
                    _ => [bounds.min[2], bounds.max[2]],
                };
                let exact = high.min(-low);
                let target = Target::new(Placed::new(&floor, &Pose::IDENTITY), &plan);
                let found = target.penetration(&shape, HOLLOW, &Budget::UNLIMITED, scratch);
                assert!(found.complete && found.lower <= exact + radius, "{name}: {exact} {found:?}");
                assert!((found.upper - exact).abs() <= 1.5 * radius, "{name}, {round}: {exact} {found:?}");
                worst.0 = worst.0.max((found.upper - exact).abs() / radius);
                worst.1 = worst.1.min(found.lower / exact);
                for _ in 0..10 {
                    let t = Vector::from(unit_vector(rng)) * (found.lower * rng.random_range(0.0..0.999));
                    let moved = Placed::new(&floor, &shifted(&Pose::IDENTITY, -t));
                    let touches = Target::new(moved, &plan).touch(&shape, scratch).verdict.is_touching();
                    assert!(touches, "{name}: {t} of {found:?} parts them");
                }
                // The same in another frame.
                if let Some(moved) = shape.moved(&frame) {
                    let target = Target::new(Placed::new(&floor, &frame), &plan);
                    let again = target.penetration(&moved, HOLLOW, &Budget::UNLIMITED, scratch);
                    assert!((again.upper / 2.0 - found.upper).abs() < radius, "{name}: {found:?} {again:?}");
                }
            }
        }
        println!(
            "noise {noise}: upper at most {:.2} r off, lower at least {:.2} of the depth",
            worst.0, worst.1
        );
        assert!(worst.1 > 0.5, "lower at least {} of the depth", worst.1);
    }
}

/// Shapes inside a solid scan, and across its surface.
#[test]
fn shapes_in_a_solid() {
    let ball = prepare(sphere(1.0), 0.0);
    let plan = ShapePlan::new(&CollideOptions::default(), &ball).unwrap();
    let target = Target::new(Placed::new(&ball, &Pose::IDENTITY), &plan);
    let scratch = &mut Scratch::default();
    let mut ask = |x: f64, interior| {
        let shape = Shape::Sphere { centre: [x, 0.0, 0.0], radius: 0.3 };
        target.penetration(&shape, interior, &Budget::UNLIMITED, scratch)
    };
    for x in [0.0, 0.3, 0.5, 0.8, 0.95, 1.1, 1.25] {
        let (found, exact) = (ask(x, SOLID), 1.3 - x);
        assert!((found.upper - exact).abs() < 0.04, "{x}: {found:?}");
        assert!(found.lower > 0.7 * exact - 0.04 && found.lower < exact + 0.04, "{x}: {found:?}");
        assert!(x == 0.0 || found.direction[0] > 0.98, "{x}: {found:?}");
    }
    assert_eq!(ask(0.3, HOLLOW).upper, 0.0, "inside, it touches nothing");
    let inwards = ask(0.8, HOLLOW);
    assert!((inwards.upper - 0.1).abs() < 0.04 && inwards.direction[0] < -0.98, "{inwards:?}");
    assert_eq!(ask(1.4, SOLID).upper, 0.0);
    assert_eq!(ask(f64::NAN, SOLID).upper, f64::INFINITY);
}

/// Balls that nearly fill a hollow one: the way back into it is of little more than one length. Its normals
/// may point outwards, so that contacts are behind the surface.
#[test]
fn large_shapes_in_a_hollow_ball() {
    let ball = prepare(sphere(1.0), 0.0);
    let mut oriented = ball.clone();
    let outwards: Vec<[f32; 3]> = (0..ball.len()).map(|i| ball.arrays().position(i)).collect();
    oriented.turn_normals(&outwards);
    let (rng, scratch) = (&mut rng(8804), &mut Scratch::default());
    for round in 0..160_usize {
        let margin = [0.0, 0.08][round % 2];
        let scan = if round / 2 % 2 == 0 { &ball } else { &oriented };
        let plan = ShapePlan::new(&CollideOptions::default().with_margin(margin), scan).unwrap();
        let target = Target::new(Placed::new(scan, &Pose::IDENTITY), &plan);
        let (out, radius) = (Vector::from(unit_vector(rng)), rng.random_range(0.5..0.85));
        let away = rng.random_range(1.05 - radius..0.9);
        let shape = Shape::Sphere { centre: (out * away).into(), radius };
        let found = target.penetration(&shape, HOLLOW, &Budget::UNLIMITED, scratch);
        let exact = (away + radius - 1.0).min(1.0 + radius - away) + margin;
        let context = format!("{exact}, margin {margin}, {}: {found:?} of {shape:?}", scan.is_oriented());
        assert!(found.lower <= exact + 0.04 && (found.upper - exact).abs() < 0.04, "{context}");
    }
}

/// Things without thickness inside a solid, and points that are balls.
#[test]
fn thin_and_thick_things() {
    let (ball, dot) = (prepare(sphere(1.0), 0.0), prepare(sphere(0.05), 0.0));
    let scratch = &mut Scratch::default();
    let pose = Pose::from_translation([0.1, 0.0, 0.0]).with_scale(0.01);
    let plan = CollidePlan::new(&CollideOptions::default(), &ball, &dot).unwrap();
    let pair = Pair::new(Placed::new(&ball, &Pose::IDENTITY), Placed::new(&dot, &pose));
    for interiors in [[SOLID, HOLLOW], [SOLID; 2]] {
        let found = pair.penetration(&plan, interiors, scratch);
        assert!(found.lower > 0.85 && found.lower <= found.upper && found.upper < 0.92, "{found:?}");
    }
    let plan = ShapePlan::new(&CollideOptions::default(), &ball).unwrap();
    let target = Target::new(Placed::new(&ball, &Pose::IDENTITY), &plan);
    let corners = [[0.1, 0.0, 0.0], [0.1, 0.2, 0.0], [0.1, 0.0, 0.2]];
    let thin = [
        Shape::Sphere { centre: [0.1, 0.0, 0.0], radius: 0.0 },
        Shape::Triangle { points: corners, radius: 0.0 },
        Shape::Hull { points: &corners, radius: 0.0 },
        Shape::Box { pose: Pose::from_translation([0.1, 0.0, 0.0]), half: [0.0, 0.1, 0.1], radius: 0.0 },
    ];
    for shape in thin {
        let found = target.penetration(&shape, SOLID, &Budget::UNLIMITED, scratch);
        assert!(
            found.lower > 0.75 && found.upper >= found.lower && found.upper < 1.1,
            "{shape:?}: {found:?}"
        );
    }
    let thick = CollideOptions::default().with_semantics(Semantics::Thickened(0.1));
    let plan = ShapePlan::new(&thick, &ball).unwrap();
    let target = Target::new(Placed::new(&ball, &Pose::IDENTITY), &plan);
    for (centre, radius, exact) in
        [([0.0; 3], 5.0, 6.1), ([1.0, 0.0, 0.0], 1e-9, 0.1), ([1.25, 0.0, 0.0], 0.2, 0.05)]
    {
        let shape = Shape::Sphere { centre, radius };
        let found = target.penetration(&shape, HOLLOW, &Budget::UNLIMITED, scratch);
        assert!(found.lower > 0.6 * exact && found.lower <= exact + 1e-9, "{shape:?}: {found:?}");
        assert!((found.upper - exact).abs() < 0.03, "{shape:?}: {found:?}");
    }
}

/// Overlaps of less than half a sampling radius, where no measured point may be in the shape.
#[test]
fn shallow_shapes_in_a_floor() {
    let rng = &mut rng(8803);
    let floor = prepare(patch(4.0, 4.0), 0.0);
    let r = floor.sampling_radius();
    let plan = ShapePlan::new(&CollideOptions::default(), &floor).unwrap();
    let target = Target::new(Placed::new(&floor, &Pose::IDENTITY), &plan);
    let scratch = &mut Scratch::default();
    let mut worst = [f64::INFINITY; 3];
    for round in 0..90 {
        let size = rng.random_range(0.3..3.0) * r;
        let depth = rng.random_range(0.1 * r..0.5 * r).min(0.8 * size);
        let along = Vector::new(rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0), 0.0) * size;
        let place = Vector::new(rng.random_range(-0.5..0.5), rng.random_range(-0.5..0.5), size - depth);
        let turned = Pose::from_axis_angle([0.0, 0.0, 1.0], rng.random_range(0.0..3.0));
        let shape = match round % 3 {
            0 => Shape::Sphere { centre: place.into(), radius: size },
            1 => Shape::Capsule { ends: [place.into(), (place + along).into()], radius: size },
            _ => Shape::Box { pose: turned.with_translation(place.into()), half: [size; 3], radius: 0.0 },
        };
        let found = target.penetration(&shape, HOLLOW, &Budget::UNLIMITED, scratch);
        assert!((found.upper - depth).abs() < 0.1 * r, "{shape:?}: {depth} {found:?}");
        assert!(found.lower <= depth * (1.0 + 1e-9), "{shape:?}: {depth} {found:?}");
        worst[round % 3] = worst[round % 3].min(found.lower / found.upper);
    }
    println!("lower at least {worst:.2?} of upper");
    assert!(worst.iter().all(|&share| share >= 0.6), "{worst:?}");
}

/// A plate that stands in a floor is nowhere deep, but has to leave as far as its top or its foot is away.
#[test]
fn plates_that_stand_in_a_floor() {
    let rng = &mut rng(8804);
    for noise in [0.0, 0.1] {
        let floor = prepare(patch(4.0, 4.0), noise);
        let r = floor.sampling_radius();
        let plan = ShapePlan::new(&CollideOptions::default(), &floor).unwrap();
        let target = Target::new(Placed::new(&floor, &Pose::IDENTITY), &plan);
        let scratch = &mut Scratch::default();
        // The share of the depth that is the lower bound, in the middle of the floor and beside its border.
        let mut shares = [const { Vec::new() }; 2];
        for round in 0..80_usize {
            let is_beside = round % 4 == 3;
            let x = if is_beside { rng.random_range(1.7..2.0) } else { rng.random_range(-1.0..1.0) };
            let place = [x, rng.random_range(-0.5..0.5), rng.random_range(-0.25..0.25)];
            let pose = rotation(rng).with_translation(place);
            let corners: Vec<[f64; 3]> = (0..40_u8)
                .map(|n| {
                    let (sin, cos) = (0.4 * f64::from(n % 20)).sin_cos();
                    pose.apply([0.4 * cos, 0.4 * sin, [-0.02, 0.02][usize::from(n / 20)]])
                })
                .collect();
            let shape = match round % 3 {
                0 => Shape::Box { pose, half: [0.4, 0.3, 0.02], radius: 0.0 },
                1 => Shape::Box { pose, half: [0.3, 0.01, 0.4], radius: 0.01 },
                _ => Shape::Hull { points: &corners, radius: 0.0 },
            };
            let bounds = shape.bounds().unwrap();
            let exact = bounds.max[2].min(-bounds.min[2]);
            if exact < 3.0 * r {
                continue;
            }
            let found = target.penetration(&shape, HOLLOW, &Budget::UNLIMITED, scratch);
            assert!(found.complete && found.lower <= exact + 0.3 * r, "{shape:?}: {exact} {found:?}");
            // With a margin, both bounds grow by it.
            let wide = CollideOptions::default().with_margin(0.1);
            let wide = ShapePlan::new(&wide, &floor).unwrap();
            let wide = Target::new(Placed::new(&floor, &Pose::IDENTITY), &wide);
            let further = wide.penetration(&shape, HOLLOW, &Budget::UNLIMITED, scratch);
            assert!(further.lower <= further.upper && further.lower <= exact + 0.1 + 0.3 * r, "{further:?}");
            // A budget holds.
            let few = target.penetration(&shape, HOLLOW, &Budget::UNLIMITED.with_work(60), scratch);
            assert!(few.statistics.evaluations <= 60 + 2 && few.lower <= exact + 0.3 * r, "{few:?}");
            for _ in 0..100 {
                let t = Vector::from(unit_vector(rng)) * (found.lower * rng.random_range(0.0..0.999));
                let moved = Placed::new(&floor, &Pose::from_translation((-t).into()));
                let touches = Target::new(moved, &plan).touch(&shape, scratch).verdict.is_touching();
                assert!(touches, "{shape:?}: {t} of {found:?} parts them");
            }
            if round % 3 < 2 {
                shares[usize::from(is_beside)].push(found.lower / found.upper);
            }
        }
        let least = shares.each_ref().map(|shares| shares.iter().copied().fold(1.0, f64::min));
        let counts = shares.map(|all| all.len());
        println!("noise {noise}: lower at least {least:.2?} of upper, for {counts:?}");
        assert!(counts[0] > 20 && counts[1] > 5, "{counts:?} plates");
        assert!(least[0] >= 0.5 && least[1] > 0.05, "noise {noise}: {least:?}");
    }
}
