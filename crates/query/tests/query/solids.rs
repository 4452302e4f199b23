//! Convex shapes against the discs and balls of all points of a scan, by plain minimisation.

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_geometry::{PointCloud, Pose};
use nearmiss_hierarchy::{BuildOptions, PointHierarchy, SLAB, THICKNESS};
use nearmiss_mesh::nearest_on_triangle;
use nearmiss_query::{
    CollideOptions, Detail, Evidence, Method, Placed, PlanError, Reason, Sampling, Scratch, Semantics, Shape,
    ShapeIndex, ShapePlan, ShapeVerdict, SupportMap, Target,
};
use nearmiss_testdata::arbitrary::{self, CloudKind, point_in, rng, rotation, unit_vector};
use nearmiss_testdata::instructions::levels;
use rand::RngExt;

type Random = rand_xoshiro::Xoshiro256PlusPlus;
type Vector = Vector3<f64>;

/// Returns the least of a convex function between two numbers.
fn least(low: f64, high: f64, f: &dyn Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (low, high);
    let mut best = f(low).min(f(high));
    for _ in 0..45 {
        let third = (high - low) / 3.0;
        let (a, b) = (f(low + third), f(high - third));
        best = best.min(a).min(b);
        if a <= b {
            high -= third;
        } else {
            low += third;
        }
    }
    best
}

fn to_segment(p: Vector, a: Vector, b: Vector) -> f64 {
    let (along, away) = (b - a, p - a);
    let square = along.norm_squared();
    let share = if square > 0.0 { (away.dot(&along) / square).clamp(0.0, 1.0) } else { 0.0 };
    (away - along * share).norm()
}

fn to_triangle(p: Vector, corners: [Vector; 3]) -> f64 {
    (p - Vector::from(nearest_on_triangle(&corners.map(Into::into), p.into()))).norm()
}

/// The distance from a truncated cone about the y axis: from its section, which is a trapezium.
fn to_round(p: Vector, half: f64, [below, above]: [f64; 2]) -> f64 {
    let (beside, height) = (p.x.hypot(p.z), p.y);
    let at = |x: f64, y: f64| Vector::new(x, y, 0.0);
    let own = at(beside, height);
    let share = (height + half) / (2.0 * half);
    if height.abs() <= half && (beside <= below + (above - below) * share || half == 0.0 && beside <= below) {
        return 0.0;
    }
    let edges = [
        (at(0.0, -half), at(below, -half)),
        (at(below, -half), at(above, half)),
        (at(above, half), at(0.0, half)),
    ];
    edges.iter().map(|&(a, b)| to_segment(own, a, b)).fold(f64::INFINITY, f64::min)
}

/// The distance from a hull of few points: from every triangle of them, or 0 in a tetrahedron.
fn to_hull(p: Vector, points: &[[f64; 3]]) -> f64 {
    let q: Vec<Vector> = points.iter().map(|&q| q.into()).collect();
    let volume = |a: Vector, b: Vector, c: Vector, d: Vector| (b - a).cross(&(c - a)).dot(&(d - a));
    let mut nearest = f64::INFINITY;
    for i in 0..q.len() {
        for j in 0..i {
            for k in 0..j {
                nearest = nearest.min(to_triangle(p, [q[i], q[j], q[k]]));
                for l in 0..k {
                    let all = volume(q[i], q[j], q[k], q[l]);
                    let parts = [
                        volume(p, q[j], q[k], q[l]),
                        volume(q[i], p, q[k], q[l]),
                        volume(q[i], q[j], p, q[l]),
                        volume(q[i], q[j], q[k], p),
                    ];
                    if all != 0.0 && parts.iter().all(|part| part * all >= 0.0) {
                        return 0.0;
                    }
                }
            }
        }
    }
    nearest
}

/// An ellipsoid, as a shape of the caller's own.
#[derive(Debug)]
struct Ellipsoid {
    pose: Pose,
    radii: [f64; 3],
}

impl SupportMap for Ellipsoid {
    fn support(&self, direction: [f64; 3]) -> [f64; 3] {
        let d = self.pose.rotate_inverse(direction);
        let along = Vector::from([0, 1, 2].map(|k| d[k] * self.radii[k]));
        let length = along.norm();
        self.pose.apply([0, 1, 2].map(|k| self.radii[k] * along[k] / length))
    }

    fn centre(&self) -> [f64; 3] {
        self.pose.translation()
    }
}

/// The distance of a world point from a shape without its rounding.
fn to_core(shape: &Shape<'_>, p: [f64; 3]) -> f64 {
    let x = Vector::from(p);
    match *shape {
        Shape::Sphere { centre, .. } => (x - Vector::from(centre)).norm(),
        Shape::Capsule { ends: [a, b], .. } => to_segment(x, a.into(), b.into()),
        Shape::Box { pose, half, .. } => {
            let own = pose.apply_inverse(p);
            let beyond = [0, 1, 2].map(|k| (own[k].abs() - half[k]).max(0.0));
            Vector::from(beyond).norm() * pose.scale()
        }
        Shape::Cylinder { pose, half_height, radius, .. } => {
            to_round(pose.apply_inverse(p).into(), half_height, [radius; 2]) * pose.scale()
        }
        Shape::Cone { pose, half_height, radius, .. } => {
            to_round(pose.apply_inverse(p).into(), half_height, [radius, 0.0]) * pose.scale()
        }
        Shape::Triangle { points, .. } => to_triangle(x, points.map(Into::into)),
        Shape::Hull { points, .. } => to_hull(x, points),
        _ => panic!("no other shapes"),
    }
}

/// The distance of a shape's core from a disc in the world.
fn to_disc(shape: &Shape<'_>, centre: Vector, normal: Vector, radius: f64) -> f64 {
    let other = if normal.x.abs() < 0.6 { Vector::x() } else { Vector::y() };
    let u = normal.cross(&other).normalize();
    let v = normal.cross(&u);
    least(-radius, radius, &|s| {
        let chord = (radius * radius - s * s).max(0.0).sqrt();
        least(-chord, chord, &|t| to_core(shape, (centre + u * s + v * t).into()))
    })
}

/// The answer of brute force about a shape.
struct Brute {
    /// The least distance from any disc or ball.
    apart: f64,
    /// The same, less the thickness of the disc.
    thick: f64,
    /// The same, less the greater of thickness and margin.
    beyond: f64,
    /// The least distance of a sparse point of a surface, less its ball.
    doubt: f64,
}

fn brute(scan: &Placed<'_>, shape: &Shape<'_>, options: &CollideOptions) -> Brute {
    let (arrays, scale) = (scan.scan().arrays(), scan.stored_to_world().scale());
    let none = f64::INFINITY;
    let mut found = Brute { apart: none, thick: none, beyond: none, doubt: none };
    for i in 0..scan.scan().len() {
        let p = scan.point(i);
        let from_point = to_core(shape, p) - shape.rounding();
        let is_sparse = scan.scan().kind(i).is_sparse();
        let ball = match options.semantics {
            Semantics::Thickened(radius) => Some(radius),
            Semantics::Obstacle if !arrays.is_on_sheet(i) => Some(f64::from(arrays.obstacle_ball(i)) * scale),
            Semantics::Surface if is_sparse => {
                let ball = f64::from(arrays.ball(i)) * scale;
                found.doubt = found.doubt.min(from_point - ball - options.margin);
                continue;
            }
            _ => None,
        };
        if let Some(ball) = ball {
            found.apart = found.apart.min(from_point - ball);
            found.thick = found.thick.min(from_point - ball);
            found.beyond = found.beyond.min(from_point - ball - options.margin);
            continue;
        }
        let radius = f64::from(arrays.discs.get(i)) * scale;
        if from_point - 1.1 * radius > found.apart.min(found.beyond + options.margin) + 1e-9 * from_point {
            continue;
        }
        let normal =
            Vector::from(scan.stored_to_world().rotate(arrays.normals[i].map(f64::from))).normalize();
        let apart = to_disc(shape, p.into(), normal, radius) - shape.rounding();
        let thick = f64::from(THICKNESS) * radius;
        found.apart = found.apart.min(apart);
        found.thick = found.thick.min(apart - thick);
        found.beyond = found.beyond.min(apart - options.margin.max(thick));
    }
    found
}

/// Draws a shape of about `size`, at `centre`.
fn draw<'p>(
    rng: &mut Random,
    which: usize,
    (centre, size): ([f64; 3], f64),
    points: &'p mut Vec<[f64; 3]>,
) -> Shape<'p> {
    let mut length = |most: f64| size * rng.random_range(0.05..most);
    let (half, radius) = ([length(1.0), length(1.0), length(1.0)], length(0.5));
    let rounding = if which.is_multiple_of(2) { 0.0 } else { 0.5 * radius };
    let pose = rotation(rng).with_translation(centre);
    let near = |rng: &mut Random| {
        let d = point_in(rng, size);
        [0, 1, 2].map(|k| centre[k] + d[k])
    };
    match which / 2 {
        0 => Shape::Sphere { centre, radius },
        1 => Shape::Capsule { ends: [centre, near(rng)], radius: 2.0 * rounding },
        2 => Shape::Box { pose: pose.with_scale(3.0), half: half.map(|h| h / 3.0), radius: rounding },
        3 => Shape::Cylinder { pose, half_height: half[0], radius, rounding },
        4 => Shape::Cone { pose, half_height: half[0], radius, rounding },
        5 => Shape::Triangle { points: [centre, near(rng), near(rng)], radius: rounding },
        _ => {
            points.clear();
            points.extend((0..4).map(|_| near(rng)));
            Shape::Hull { points, radius: rounding }
        }
    }
}

pub(crate) fn prepared(kind: CloudKind, count: u32, seed: u64, leaf_size: u32) -> PointHierarchy {
    let cloud = PointCloud::cleaned(&arbitrary::cloud(kind, count, seed)).unwrap();
    PointHierarchy::build(&cloud, &BuildOptions::default().with_leaf_size(leaf_size)).unwrap()
}

/// Compares the answers about one shape with brute force. Returns if it touches; `None` if that depends
/// on rounding.
pub(crate) fn check(
    scan: &Placed<'_>,
    shape: &Shape<'_>,
    options: &CollideOptions,
    what: &str,
) -> Option<bool> {
    let plan = ShapePlan::new(options, scan.scan()).unwrap();
    let target = Target::new(*scan, &plan);
    let truth = brute(scan, shape, options);
    let scale = scan.stored_to_world().scale();
    let far = scan.scan().root_box();
    let size = scale * f64::from(far.radius() + Vector3::from(far.centre).amax());
    let at = Vector::from(scan.stored_to_world().translation()).norm();
    // Rounding of world coordinates, and the precision of the minimisation.
    let lost =
        1e-13 * at + 1e-6 * size.min(truth.apart.abs() + f64::from(scan.scan().root_box().reach) * scale);
    let mut answer = None;
    for level in levels() {
        let mut scratch = Scratch::by_level(level);
        let own = target.touch(shape, &mut scratch);
        assert!(answer.is_none_or(|known| known == own), "{what}: {own:?} and {answer:?} by instruction set");
        answer = Some(own);
        let distance = target.distance(shape, f64::INFINITY, &mut scratch);
        if truth.apart == f64::INFINITY {
            assert!(distance.is_none(), "{what}: {distance:?} from nothing");
            continue;
        }
        let distance = distance.unwrap();
        let upper = if truth.thick <= 0.0 { 0.0 } else { truth.apart.max(0.0) };
        if truth.thick.abs() > lost {
            assert!((distance.upper - upper).abs() <= lost, "{what}: {distance:?}, brute {}", truth.apart);
        }
        assert!(0.0 <= distance.lower && distance.lower <= distance.upper, "{what}: {distance:?}");
        check_cells(scan, shape, options, distance.lower, what);
        let within = target.distance(shape, distance.upper * 1.001 + 1e-9 * size, &mut scratch);
        assert_eq!(within.map(|it| it.upper), Some(distance.upper), "{what}: within reach");
        if distance.upper > 0.0 {
            let nearer = target.distance(shape, 0.9 * distance.upper, &mut scratch);
            assert!(nearer.is_none(), "{what}: {nearer:?} beyond reach");
        }
    }
    let answer = answer.unwrap();
    if truth.beyond.abs() <= lost || truth.doubt.abs() <= lost {
        return None;
    }
    match answer.verdict {
        ShapeVerdict::Touching { point, .. } => {
            assert!(truth.beyond < 0.0, "{what}: {answer:?}, brute {}", truth.beyond);
            let off = to_core(shape, point) - shape.rounding() - options.margin;
            assert!(off <= lost + 0.1 * answer.band, "{what}: {answer:?} is {off} away");
        }
        ShapeVerdict::Separated { evidence } => {
            assert!(truth.beyond > 0.0, "{what}: {answer:?}, brute {}", truth.beyond);
            if evidence == Evidence::Certified {
                check_cells(scan, shape, options, options.margin, what);
            }
        }
        ShapeVerdict::Undecided(reason) => {
            assert_eq!(reason, Reason::Undersampled, "{what}: {answer:?}");
            assert!(truth.beyond > 0.0 && truth.doubt < 0.0, "{what}: {answer:?}, {}", truth.doubt);
        }
    }
    Some(answer.verdict.is_touching())
}

/// Places in the cells of points are no nearer to the shape than `lower`.
fn check_cells(scan: &Placed<'_>, shape: &Shape<'_>, options: &CollideOptions, lower: f64, what: &str) {
    if options.semantics != Semantics::Obstacle || lower == 0.0 {
        return;
    }
    let (arrays, scale) = (scan.scan().arrays(), scan.stored_to_world().scale());
    let rng = &mut rng(5);
    for i in (0..scan.scan().len()).filter(|&i| arrays.is_on_sheet(i)).step_by(3) {
        let reach = f64::from(arrays.cell_radius(i)) * scale;
        let normal =
            Vector::from(scan.stored_to_world().rotate(arrays.normals[i].map(f64::from))).normalize();
        let way = Vector::from(unit_vector(rng));
        let across = (way - normal * normal.dot(&way)).normalize();
        let layer = f64::from(SLAB * arrays.radii[i]) * scale;
        let height = rng.random_range(-1.0..1.0) * layer.min(reach);
        let x = Vector::from(scan.point(i))
            + across * (reach * reach - height * height).max(0.0).sqrt() * 0.999
            + normal * height * 0.999;
        let from = to_core(shape, x.into()) - shape.rounding();
        assert!(from >= lower * (1.0 - 1e-9), "{what}: {x:?} of the obstacle is {from} away, lower {lower}");
    }
}

#[test]
fn every_answer_is_that_of_brute_force() {
    let rng = &mut rng(61);
    let mut seen = [[0; 2]; 7];
    let mut points = Vec::new();
    for (n, kind) in (0_u64..).zip(CloudKind::ALL.iter().cycle().take(42)) {
        let scan = prepared(*kind, [60, 200, 40][(n % 3) as usize], n, [16, 5, 40][(n % 3) as usize]);
        let size = scan.bounds().half_extents().into_iter().fold(0.0, f64::max);
        let scale = [1.0, 1e-3, 1e4][(n / 3 % 3) as usize];
        let pose = rotation(rng).with_scale(scale).with_translation(point_in(rng, 3.0 * size * scale));
        let index = ShapeIndex::new(&scan);
        for round in 0..14 {
            let placed = Placed::new(&scan, &pose);
            let placed = if round % 4 < 2 { placed.with_shapes(&index) } else { placed };
            let about = placed.point(rng.random_range(0..scan.len()));
            let reach = size * scale * [0.6, 0.1, 1e-3][round % 3];
            let d = point_in(rng, reach);
            let centre = [0, 1, 2].map(|k| about[k] + d[k]);
            let shape = draw(rng, round, (centre, reach), &mut points);
            let semantics = match round % 5 {
                1 => Semantics::Surface,
                3 => Semantics::Thickened(0.1 * reach),
                _ => Semantics::Obstacle,
            };
            let margin = if round % 4 == 2 { 0.05 * reach } else { 0.0 };
            let detail = if round % 3 == 1 { Detail::Verdict } else { Detail::Witness };
            let options =
                CollideOptions::default().with_semantics(semantics).with_margin(margin).with_detail(detail);
            let what = format!("{kind:?} {n}, round {round}, {options:?}, {shape:?}");
            if let Some(touches) = check(&placed, &shape, &options, &what) {
                seen[round / 2][usize::from(touches)] += 1;
            }
        }
    }
    assert!(seen.iter().flatten().all(|&n| n > 5), "both answers of every shape: {seen:?}");
}

#[test]
fn an_index_changes_no_verdict() {
    let rng = &mut rng(17);
    let mut seen = [0; 2];
    for (n, kind) in (0_u64..).zip(CloudKind::ALL) {
        let scan = prepared(kind, 3000, n, [16, 7][(n % 2) as usize]);
        let (index, r) = (ShapeIndex::new(&scan), scan.sampling_radius() / scan.frame().scale);
        let plain = Placed::new(&scan, &Pose::IDENTITY);
        let mut points = Vec::new();
        for round in 0..140 {
            let about = plain.point(rng.random_range(0..scan.len()));
            let d = point_in(rng, [1.0, 4.0, 8.0][round % 3] * r);
            let centre = [0, 1, 2].map(|k| about[k] + d[k]);
            let shape = draw(rng, round % 14, (centre, [0.5, 2.0][round % 2] * r), &mut points);
            let semantics = if round % 5 == 1 { Semantics::Thickened(0.3 * r) } else { Semantics::Obstacle };
            let options = CollideOptions::default().with_semantics(semantics).with_detail(Detail::Verdict);
            let plan = ShapePlan::new(&options, &scan).unwrap();
            let mut scratch = Scratch::default();
            let [(touching, evidence, distance, depth), indexed] =
                [plain, plain.with_shapes(&index)].map(|placed| {
                    let (target, mut contacts) = (Target::new(placed, &plan), Vec::new());
                    let verdict = target.touch(&shape, &mut scratch).verdict;
                    let evidence = match verdict {
                        ShapeVerdict::Separated { evidence } => Some(evidence),
                        _ => None,
                    };
                    let within = [2.0 * r, f64::INFINITY][round % 2];
                    let distance = target.distance(&shape, within, &mut scratch);
                    target.contacts(&shape, &mut contacts, &mut scratch);
                    let depth = contacts.first().map(|contact| contact.depth);
                    (verdict.is_touching(), evidence, distance.map(|it| [it.lower, it.upper]), depth)
                });
            let what = format!("{kind:?}, round {round}, {shape:?}");
            seen[usize::from(touching)] += 1;
            assert_eq!((indexed.0, indexed.1, indexed.3), (touching, evidence, depth), "{what}");
            // The boxes of the index may show a greater lower bound.
            let [[low, high], own] = [distance, indexed.2].map(|it| it.unwrap_or([9e9; 2]));
            let is_bound = own[0] >= low - 1e-4 * r && own[0] <= high;
            assert!(is_bound && high == own[1], "{what}: {distance:?}, {own:?}");
        }
    }
    assert!(seen.iter().all(|&n| n > 100), "both answers: {seen:?}");
}

#[test]
fn shapes_of_the_callers_own_are_like_those_known() {
    let scan = prepared(CloudKind::Sphere, 800, 3, 16);
    let pose = Pose::from_translation([0.3, 0.1, -0.2]);
    let placed = Placed::new(&scan, &pose);
    let rng = &mut rng(8);
    let plan = ShapePlan::new(&CollideOptions::default(), &scan).unwrap();
    let (target, mut scratch) = (Target::new(placed, &plan), Scratch::default());
    for _ in 0..60 {
        let centre = point_in(rng, 1.5);
        let radius = rng.random_range(0.01..0.4);
        let own = Ellipsoid { pose: rotation(rng).with_translation(centre), radii: [radius; 3] };
        let (own, sphere) = (Shape::Own { map: &own, radius: 0.0 }, Shape::Sphere { centre, radius });
        let [a, b] = [own, sphere].map(|shape| target.distance(&shape, f64::INFINITY, &mut scratch).unwrap());
        assert!((a.upper - b.upper).abs() < 1e-5, "{a:?} for {b:?}");
        assert!(a.lower <= b.upper && (a.lower - b.lower).abs() < 0.2, "{a:?} for {b:?}");
        if b.upper > 1e-3 {
            assert_eq!(
                target.touch(&own, &mut scratch).verdict.is_touching(),
                target.touch(&sphere, &mut scratch).verdict.is_touching(),
                "{own:?}"
            );
        }
    }
}

#[test]
fn degenerate_shapes_have_answers_and_invalid_ones_touch_nothing() {
    let scan = prepared(CloudKind::Sphere, 400, 1, 16);
    let placed = Placed::new(&scan, &Pose::IDENTITY);
    let plan = ShapePlan::new(&CollideOptions::default(), &scan).unwrap();
    let (target, mut scratch) = (Target::new(placed, &plan), Scratch::default());
    let p = placed.point(7);
    let (pose, nan) = (Pose::from_translation(p), f64::NAN);
    let at = [p; 4];
    let points_of_nothing = [
        Shape::Sphere { centre: p, radius: 0.0 },
        Shape::Capsule { ends: [p; 2], radius: 0.0 },
        Shape::Box { pose, half: [0.0; 3], radius: 0.0 },
        Shape::Cylinder { pose, half_height: 0.0, radius: 0.0, rounding: 0.0 },
        Shape::Cone { pose, half_height: 0.0, radius: 0.0, rounding: 0.0 },
        Shape::Triangle { points: [p; 3], radius: 0.0 },
        Shape::Hull { points: &at, radius: 0.0 },
        // Needles.
        Shape::Box { pose, half: [1e-12, 5.0, 1e-12], radius: 0.0 },
        Shape::Triangle {
            points: [p, [p[0], p[1], p[2] + 9.0], [p[0] + 1e-12, p[1], p[2] + 9.0]],
            radius: 0.0,
        },
        Shape::Cone { pose, half_height: 9.0, radius: 1e-9, rounding: 0.0 },
        // Larger than anything.
        Shape::Sphere { centre: p, radius: 1e15 },
        Shape::Box { pose, half: [1e12; 3], radius: 0.0 },
    ];
    for shape in &points_of_nothing {
        let answer = target.touch(shape, &mut scratch);
        assert!(answer.verdict.is_touching(), "{shape:?} holds a point: {answer:?}");
        let distance = target.distance(shape, f64::INFINITY, &mut scratch).unwrap();
        assert!(distance.upper == 0.0 && distance.lower == 0.0, "{shape:?}: {distance:?}");
        assert!(placed.touches(shape), "{shape:?} holds a point");
    }
    let invalid = [
        Shape::Sphere { centre: [nan, 0.0, 0.0], radius: 1.0 },
        Shape::Sphere { centre: p, radius: -1.0 },
        Shape::Sphere { centre: p, radius: nan },
        Shape::Capsule { ends: [p, [f64::INFINITY, 0.0, 0.0]], radius: 1.0 },
        Shape::Box { pose, half: [1.0, nan, 1.0], radius: 0.0 },
        Shape::Cylinder { pose, half_height: -1.0, radius: 1.0, rounding: 0.0 },
        Shape::Cone { pose, half_height: 1.0, radius: 1.0, rounding: -0.1 },
        Shape::Triangle { points: [p, p, [nan; 3]], radius: 0.0 },
        Shape::Hull { points: &[], radius: 1.0 },
    ];
    let mut contacts = Vec::new();
    for shape in &invalid {
        let answer = target.touch(shape, &mut scratch);
        assert_eq!(answer.verdict, ShapeVerdict::Undecided(Reason::Shape), "{shape:?}");
        assert_eq!(target.distance(shape, f64::INFINITY, &mut scratch), None, "{shape:?}");
        target.contacts(shape, &mut contacts, &mut scratch);
        assert!(contacts.is_empty(), "{shape:?}: {contacts:?}");
    }
    let far = Shape::Sphere { centre: [1e30, 0.0, 0.0], radius: 1.0 };
    assert!(target.touch(&far, &mut scratch).verdict.is_separated(), "a thing far away");
    let odd = Pose::IDENTITY.with_scale(nan);
    let nowhere = Target::new(Placed::new(&scan, &odd), &plan);
    let answer = nowhere.touch(&points_of_nothing[0], &mut scratch);
    assert_eq!(answer.verdict, ShapeVerdict::Undecided(Reason::Pose), "a pose that is none");
}

#[test]
fn options_for_two_scans_are_refused() {
    let scan = prepared(CloudKind::Sphere, 100, 1, 16);
    let options = CollideOptions::estimated().with_method(Method::Sampling(Sampling::default()));
    let refused = ShapePlan::new(&options, &scan);
    assert_eq!(refused, Err(PlanError::NotForShapes("the method `sampling`")));
    let refused = ShapePlan::new(&CollideOptions::default().with_coverings(true), &scan);
    assert_eq!(refused, Err(PlanError::NotForShapes("sphere coverings")));
    let refused = ShapePlan::new(&CollideOptions::default().with_margin(-1.0), &scan);
    assert_eq!(refused, Err(PlanError::Margin(-1.0)));
}
