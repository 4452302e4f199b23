//! Rays against the discs and balls of all points of a scan.

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_geometry::{PointCloud, Pose};
use nearmiss_hierarchy::{BuildOptions, PointHierarchy, SLAB, THICKNESS};
use nearmiss_query::{
    CollideOptions, Detail, Evidence, Placed, Ray, Scratch, Semantics, Shape, ShapeIndex, ShapePlan,
    ShapeVerdict, Target,
};
use nearmiss_testdata::arbitrary::{self, CloudKind, point_in, rng, rotation, unit_vector};
use nearmiss_testdata::instructions::levels;
use rand::RngExt;

type Vector = Vector3<f64>;

/// Where a ray meets the part of a point.
struct Met {
    i: usize,
    t: f64,
    /// `true` if it meets the disc or ball itself, not only the cell.
    is_sure: bool,
    /// The distance along the ray within which the same sheet may be met again.
    layer: f64,
}

/// The distance at which a ball of the ray's radius first comes within a disc's reach, by plain steps.
fn first_touch(ray: &Ray, (centre, normal, radius): (Vector, Vector, f64)) -> Option<f64> {
    let (o, d) = (Vector::from(ray.origin), Vector::from(ray.direction).normalize());
    let gap = |t: f64| {
        let away = o + d * t - centre;
        let height = normal.dot(&away);
        let beside = (away - normal * height).norm();
        height.hypot((beside - radius).max(0.0)) - ray.radius
    };
    // The distance is convex along the ray: find its least, then the zero before it.
    let middle = (centre - o).dot(&d);
    let (mut low, mut high) =
        ((middle - 2.0 * radius - ray.radius).max(0.0), (middle + 2.0 * radius + ray.radius).max(0.0));
    let start = low;
    if gap(0.0) <= f64::from(THICKNESS) * radius {
        return Some(0.0);
    }
    for _ in 0..200 {
        let third = (high - low) / 3.0;
        if gap(low + third) <= gap(high - third) {
            high -= third;
        } else {
            low += third;
        }
    }
    let least = 0.5 * (low + high);
    if gap(least) > 0.0 {
        return None;
    }
    let (mut low, mut high) = (start, least);
    if gap(low) <= 0.0 {
        return Some(low);
    }
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if gap(middle) > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    Some(high)
}

fn brute(scan: &Placed<'_>, ray: &Ray, semantics: Semantics) -> Vec<Met> {
    let (arrays, placed) = (scan.scan().arrays(), scan.stored_to_world());
    let (o, d) = (Vector::from(ray.origin), Vector::from(ray.direction).normalize());
    let mut all = Vec::new();
    for i in 0..scan.scan().len() {
        let p = Vector::from(scan.point(i));
        let kind = scan.scan().kind(i);
        let ball = match semantics {
            Semantics::Thickened(radius) => Some(radius),
            Semantics::Obstacle if !arrays.is_on_sheet(i) => {
                Some(f64::from(arrays.obstacle_ball(i)) * placed.scale())
            }
            Semantics::Surface if kind.is_sparse() => continue,
            _ => None,
        };
        if let Some(ball) = ball {
            let (middle, reach) = ((p - o).dot(&d), ball + ray.radius);
            let half_sq = reach * reach - (o + d * middle - p).norm_squared();
            if half_sq >= 0.0 && middle + half_sq.sqrt() >= 0.0 {
                all.push(Met { i, t: (middle - half_sq.sqrt()).max(0.0), is_sure: true, layer: 0.0 });
            }
            continue;
        }
        let normal = Vector::from(placed.rotate(arrays.normals[i].map(f64::from))).normalize();
        let radius = f64::from(arrays.discs.get(i)) * placed.scale();
        let layer =
            f64::from(arrays.radii[i]) * placed.scale() * (f64::from(SLAB) / normal.dot(&d).abs()).min(1.0);
        let sure = if ray.radius > 0.0 {
            first_touch(ray, (p, normal, radius))
        } else {
            let t = normal.dot(&(p - o)) / normal.dot(&d);
            Some(t).filter(|&t| t >= 0.0 && (o + d * t - p).norm() <= radius)
        };
        if let Some(t) = sure {
            all.push(Met { i, t, is_sure: true, layer });
            continue;
        }
        let cell = f64::from(arrays.cell_radius(i)) * placed.scale();
        let height = normal.dot(&(o - p));
        let t = (ray.radius.copysign(height) - height) / normal.dot(&d);
        let beside = (o + d * t - normal * ray.radius.copysign(height) - p).norm();
        if t >= 0.0 && beside <= cell {
            all.push(Met { i, t, is_sure: false, layer });
        }
    }
    all.retain(|met| met.t <= ray.max);
    all.sort_by(|a, b| a.t.total_cmp(&b.t));
    all
}

#[test]
fn the_first_hit_is_one_that_brute_force_finds() {
    let rng = &mut rng(77);
    let (mut hits, mut misses, mut certain) = (0, 0, 0);
    for (n, kind) in (0_u64..).zip(CloudKind::ALL.iter().cycle().take(42)) {
        let leaf_size = [16, 5, 40][(n % 3) as usize];
        let cloud =
            PointCloud::cleaned(&arbitrary::cloud(*kind, [600, 200, 30][(n % 3) as usize], n)).unwrap();
        let scan = PointHierarchy::build(&cloud, &BuildOptions::default().with_leaf_size(leaf_size)).unwrap();
        let size = scan.bounds().half_extents().into_iter().fold(0.0, f64::max);
        let scale = [1.0, 1e-3, 1e4][(n / 3 % 3) as usize];
        let pose = rotation(rng).with_scale(scale).with_translation(point_in(rng, 3.0 * size * scale));
        let (placed, index) = (Placed::new(&scan, &pose), ShapeIndex::new(&scan));
        for round in 0..24 {
            let through = placed.point(rng.random_range(0..scan.len()));
            let d = point_in(rng, size * scale * [0.3, 0.01, 1e-4][round % 3]);
            let through = Vector::from([0, 1, 2].map(|k| through[k] + d[k]));
            let way = Vector::from(unit_vector(rng));
            let origin = through - way * (size * scale * [0.0, 0.5, 3.0, 1e3][round % 4]);
            let radius = if round % 3 == 1 { 0.02 * size * scale } else { 0.0 };
            let max = if round % 5 == 0 { size * scale } else { f64::INFINITY };
            let ray = Ray::new(origin.into(), (way * 3.0).into()).with_radius(radius).with_max(max);
            let semantics = match round % 6 {
                2 => Semantics::Surface,
                4 => Semantics::Thickened(0.01 * size * scale),
                _ => Semantics::Obstacle,
            };
            let options = CollideOptions::default().with_semantics(semantics).with_detail(Detail::Verdict);
            let plan = ShapePlan::new(&options, &scan).unwrap();
            // With an index, a tree of upright boxes leads to the leaves.
            let targets = [placed, placed.with_shapes(&index)].map(|placed| Target::new(placed, &plan));
            let truth = brute(&placed, &ray, semantics);
            let what = format!("{kind:?} {n}, round {round}, {ray:?}");
            let mut known = None;
            for (level, target) in
                levels().into_iter().flat_map(|level| [(level, &targets[0]), (level, &targets[1])])
            {
                let mut scratch = Scratch::by_level(level);
                let answer = target.cast(&ray, &mut scratch);
                assert!(known.is_none_or(|known| known == answer), "{what}: {answer:?}, {known:?} before");
                known = Some(answer);
                assert_eq!(target.is_hit(&ray, &mut scratch), answer.hit.is_some(), "{what}: any hit");
            }
            let [by_tree, by_index] = [0, 1].map(|k| {
                let mut hits = Vec::new();
                targets[k].cast_all(&ray, &mut hits, &mut Scratch::default());
                hits
            });
            assert_eq!(by_index, by_tree, "{what}: all hits");
            let answer = known.unwrap();
            let lost = 1e-6 * size * scale + 1e-12 * (origin.norm() + size);
            let Some(hit) = answer.hit else {
                misses += 1;
                let sure = truth.iter().find(|met| met.is_sure && met.t + lost < ray.max);
                assert!(sure.is_none(), "{what}: misses {:?}", sure.map(|met| (met.i, met.t)));
                if answer.evidence == Evidence::Certified {
                    certain += 1;
                    assert!(truth.is_empty(), "{what}: a certified miss");
                }
                continue;
            };
            hits += 1;
            let own = truth.iter().find(|met| scan.id(met.i) == hit.source);
            let own = own.unwrap_or_else(|| panic!("{what}: {hit:?} is not met"));
            assert!(
                (own.t - hit.t).abs() <= lost,
                "{what}: {hit:?}, brute {} {} {:?}",
                own.t,
                own.is_sure,
                scan.kind(own.i)
            );
            if let Some(first) = truth.iter().find(|met| met.is_sure) {
                let before = truth.iter().take_while(|met| met.t <= first.t);
                let latest = before.map(|met| met.t + met.layer).fold(0.0, f64::max);
                assert!(hit.t <= latest + lost, "{what}: {hit:?}, brute {} to {latest}", first.t);
            }
        }
    }
    assert!(hits > 300 && misses > 150 && certain > 20, "{hits} hits, {misses} misses, {certain} certain");
}

#[test]
fn the_order_of_the_leaves_does_not_matter() {
    let (rng, mut hits) = (&mut rng(78), 0);
    for n in 0..4 {
        // Few points on curved and crossing sheets, so that rays graze and pass between discs.
        let [freedom, noise] = [[1.0, 0.02], [0.3, 0.0], [2.0, 0.1], [0.7, 0.05]][n];
        let points: Vec<[f64; 3]> = (0..1500)
            .map(|i| {
                let [u, v, w] = point_in(rng, 1.0);
                let sheet = f64::from(i % 3);
                [u, v, 0.2 * sheet + 0.3 * (freedom * (2.0 * u + sheet)).sin() * v + noise * w]
            })
            .collect();
        let cloud = PointCloud::cleaned(&points).unwrap();
        let scan = PointHierarchy::build(&cloud, &BuildOptions::default().with_leaf_size(4)).unwrap();
        let (placed, index) = (Placed::new(&scan, &Pose::IDENTITY), ShapeIndex::new(&scan));
        let plan = ShapePlan::new(&CollideOptions::default().with_detail(Detail::Verdict), &scan).unwrap();
        let targets = [placed, placed.with_shapes(&index)].map(|placed| Target::new(placed, &plan));
        let mut scratch = Scratch::default();
        for _ in 0..10_000 {
            let (through, off) = (points[rng.random_range(0..points.len())], point_in(rng, 0.05));
            let [x, y, z] = unit_vector(rng);
            let way = [x, y, 0.3 * z];
            let ray = Ray::new([0, 1, 2].map(|k| through[k] + off[k] - 2.0 * way[k]), way);
            let [by_tree, by_index] = [0, 1].map(|k| targets[k].cast(&ray, &mut scratch));
            assert_eq!(by_index, by_tree, "{n}: {ray:?}");
            hits += usize::from(by_tree.hit.is_some());
        }
    }
    assert!(hits > 10_000, "{hits} hits");
}

#[test]
fn odd_rays_hit_nothing() {
    let cloud = PointCloud::cleaned(&arbitrary::cloud(CloudKind::Sphere, 400, 2)).unwrap();
    let scan = PointHierarchy::build(&cloud, &BuildOptions::default()).unwrap();
    let target = Target::new(
        Placed::new(&scan, &Pose::IDENTITY),
        &ShapePlan::new(&CollideOptions::default(), &scan).unwrap(),
    );
    let mut scratch = Scratch::default();
    let good = Ray::new([0.0; 3], [1.0, 0.0, 0.0]);
    assert!(target.is_hit(&good, &mut scratch), "from inside");
    assert!(target.is_hit(&Ray::new([0.0; 3], [1e-300, 0.0, 0.0]), &mut scratch), "a short direction");
    assert!(target.is_hit(&Ray::new([-1e9, 0.0, 0.0], [1e300, 0.0, 0.0]), &mut scratch), "from afar");
    let nan = f64::NAN;
    for ray in [
        Ray::new([0.0; 3], [0.0; 3]),
        Ray::new([nan, 0.0, 0.0], [1.0, 0.0, 0.0]),
        Ray::new([0.0; 3], [nan, 0.0, 0.0]),
        Ray::new([0.0; 3], [f64::INFINITY, 0.0, 0.0]),
        good.with_max(-1.0),
        good.with_max(nan),
        good.with_radius(-0.1),
        good.with_radius(nan),
    ] {
        assert!(
            target.cast(&ray, &mut scratch).hit.is_none() && !target.is_hit(&ray, &mut scratch),
            "{ray:?}"
        );
    }
}

/// A ball that touches before it moves has its hit there, certified if it holds a measured point.
#[test]
fn balls_that_touch_do_not_move() {
    let cloud = PointCloud::cleaned(&arbitrary::cloud(CloudKind::Sphere, 3000, 8)).unwrap();
    let scan = PointHierarchy::build(&cloud, &BuildOptions::default()).unwrap();
    let index = ShapeIndex::new(&scan);
    let plan = ShapePlan::new(&CollideOptions::default(), &scan).unwrap();
    let placed = Placed::new(&scan, &Pose::IDENTITY).with_shapes(&index);
    let target = Target::new(placed, &plan);
    let (rng, mut scratch, mut hits) = (&mut rng(611), Scratch::default(), Vec::new());
    let (mut touching, mut holding, mut moving) = (0, 0, 0);
    for round in 0..4000 {
        let p = Vector::from(placed.point(rng.random_range(0..scan.len())));
        let radius = rng.random_range(0.01..0.2);
        let origin = p + Vector::from(point_in(rng, 1.2 * radius));
        let ray = Ray::new(origin.into(), unit_vector(rng)).with_radius(radius);
        let touch = target.touch(&Shape::Sphere { centre: ray.origin, radius }, &mut scratch).verdict;
        let hit = target.cast(&ray, &mut scratch).hit;
        target.cast_all(&ray, &mut hits, &mut scratch);
        assert_eq!(hit.map(|hit| hit.t), hits.first().map(|hit| hit.t), "round {round}: {ray:?}");
        let ShapeVerdict::Touching { .. } = touch else {
            assert!(hit.is_none_or(|hit| hit.t > 0.0), "round {round}: {touch:?} {hit:?} {ray:?}");
            moving += usize::from(hit.is_some());
            continue;
        };
        touching += 1;
        let hit = hit.expect("a hit where the ball touches");
        assert!(hit.t == 0.0 && target.is_hit(&ray, &mut scratch), "round {round}: {hit:?} {ray:?}");
        let holds = |i: usize| (Vector::from(placed.point(i)) - origin).norm() <= radius;
        if (0..scan.len()).any(holds) {
            holding += 1;
            assert!(hit.evidence == Evidence::Certified, "round {round}: {touch:?} {hit:?}");
        }
        let away = (Vector::from(hit.point) - origin).norm();
        assert!(away <= radius + 0.01, "round {round}: {away} of {radius}");
    }
    assert!(
        touching > 1500 && holding > 1000 && moving > 200,
        "{touching} touching, {holding} hold a point, {moving} move"
    );
}

/// Hits of thin rays face the ray, and nothing is claimed about rays from too far away.
#[test]
fn normals_face_rays_and_far_rays_prove_nothing() {
    let rng = &mut rng(613);
    let rough: Vec<[f64; 3]> =
        (0..3000).map(|_| unit_vector(rng).map(|x| x * rng.random_range(0.97..1.03))).collect();
    let cloud = PointCloud::from_positions(&rough).unwrap();
    let scan = PointHierarchy::build(&cloud, &BuildOptions::default()).unwrap();
    let index = ShapeIndex::new(&scan);
    let plan = ShapePlan::new(&CollideOptions::default(), &scan).unwrap();
    let target = Target::new(Placed::new(&scan, &Pose::IDENTITY).with_shapes(&index), &plan);
    let (mut scratch, mut hits) = (Scratch::default(), 0);
    for round in 0..20_000 {
        let origin = Vector::from(point_in(rng, 2.0));
        let direction = Vector::from(unit_vector(rng));
        let Some(hit) = target.cast(&Ray::new(origin.into(), direction.into()), &mut scratch).hit else {
            continue;
        };
        hits += 1;
        let slope = Vector::from(hit.normal).dot(&direction);
        assert!(slope <= 1e-9, "round {round}: {slope} {hit:?}");
    }
    assert!(hits > 2500, "{hits} hits");
    for far in [1e15, 1e18, 1e300, f64::MAX] {
        for radius in [0.0, 0.03] {
            let ray = Ray::new([0.0, 0.0, far], [0.0, 0.0, -1.0]).with_radius(radius);
            let answer = target.cast(&ray, &mut scratch);
            assert!(answer.hit.is_none() && answer.evidence == Evidence::Estimated, "{far}: {answer:?}");
        }
    }
    let near = target.cast(&Ray::new([0.0, 0.0, 1e6], [0.0, 0.0, -1.0]), &mut scratch).hit.expect("a hit");
    assert!((near.t - 1e6 + 1.0).abs() < 0.1, "{near:?}");
}
