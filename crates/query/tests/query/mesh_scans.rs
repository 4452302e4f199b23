//! Queries of a mesh and a scan against every disc, ball and point with every triangle.

use std::collections::BTreeSet;

use nearmiss_geometry::{PointCloud, Pose, TriangleMesh};
use nearmiss_hierarchy::{BuildOptions, MeshBuildOptions, MeshHierarchy, PointHierarchy};
use nearmiss_mesh::{Corners, triangle_distance};
use nearmiss_query::{
    Budget, CollideOptions, Contacts, Detail, DistanceOptions, DistancePlan, Evidence, MeshScanPair,
    MeshScanPlan, Method, Order, Placed, PlacedMesh, PlanError, Reason, Sampling, Scratch, Semantics,
    Verdict,
};
use nearmiss_surface::Status;
use nearmiss_testdata::arbitrary::{self, CloudKind, point_in, pose, rng};
use nearmiss_testdata::instructions::levels;
use rand::RngExt;

type Random = rand_xoshiro::Xoshiro256PlusPlus;
type Vector = [f64; 3];

fn minus(p: Vector, q: Vector) -> Vector {
    [0, 1, 2].map(|k| p[k] - q[k])
}

fn dot(p: Vector, q: Vector) -> f64 {
    (0..3).map(|k| p[k] * q[k]).sum()
}

fn size(p: Vector) -> f64 {
    dot(p, p).sqrt()
}

fn from_point(p: Vector, triangle: &Corners) -> f64 {
    triangle_distance(&[p; 3], triangle).distance
}

/// The least of a convex function between 0 and 1.
fn least(f: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..80 {
        let third = (high - low) / 3.0;
        if f(low + third) <= f(high - third) {
            high -= third;
        } else {
            low += third;
        }
    }
    f(low).min(f(high)).min(f(0.0)).min(f(1.0))
}

/// The distance of a disc and a triangle: the least of the convex function "distance from the disc"
/// over all points of the triangle.
fn from_disc((centre, normal, radius): (Vector, Vector, f64), [p, q, r]: &Corners) -> f64 {
    let from = |x: Vector| {
        let d = minus(x, centre);
        let height = dot(d, normal);
        let beside = size([0, 1, 2].map(|k| d[k] - height * normal[k]));
        height.hypot((beside - radius).max(0.0))
    };
    least(|s| {
        let (a, b) =
            ([0, 1, 2].map(|k| p[k] + s * (q[k] - p[k])), [0, 1, 2].map(|k| p[k] + s * (r[k] - p[k])));
        least(|t| from([0, 1, 2].map(|k| a[k] + t * (b[k] - a[k]))))
    })
}

/// A part of a scan that belongs to one point.
enum Shape {
    Disc(Vector, f64),
    Ball(f64),
}

/// One pair of a point and a triangle: the distance in the world, and the distance up to which they
/// meet. Also whether the point is sparse.
struct Pairs {
    /// The point, the triangle, the distance less what makes them meet, and the local radius.
    all: Vec<(usize, usize, f64, f64)>,
    /// The least distance of any disc, ball or point.
    apart: f64,
    /// The least distance of a point less its ball.
    of_points: f64,
    /// The least distance of a sparse point less the ball of surfaces.
    doubt: f64,
}

/// Compares everything with everything, with the meaning of `semantics`.
fn brute(scan: &Placed<'_>, triangles: &[Corners], semantics: Semantics, margin: f64) -> Pairs {
    let (slices, scale) = (scan.scan().arrays(), scan.stored_to_world().scale());
    let far = triangles.iter().flatten().fold(0.0_f64, |far, p| far.max(size(*p)));
    let mut pairs =
        Pairs { all: vec![], apart: f64::INFINITY, of_points: f64::INFINITY, doubt: f64::INFINITY };
    for i in 0..scan.scan().len() {
        let (p, radius) = (scan.point(i), f64::from(slices.radii[i]) * scale);
        let normal = scan.stored_to_world().rotate(slices.normals[i].map(f64::from));
        let normal = normal.map(|c| c / size(normal));
        let disc = f64::from(slices.discs.get(i)) * scale;
        let is_sparse = scan.scan().kind(i).is_sparse();
        let shape = match semantics {
            Semantics::Obstacle if !slices.is_on_sheet(i) => {
                Shape::Ball(f64::from(slices.obstacle_ball(i)) * scale)
            }
            Semantics::Thickened(radius) => Shape::Ball(radius),
            _ => Shape::Disc(normal, disc),
        };
        for (j, triangle) in triangles.iter().enumerate() {
            let distance = from_point(p, triangle);
            let beyond = match shape {
                Shape::Ball(ball) => {
                    pairs.apart = pairs.apart.min(distance - ball);
                    pairs.of_points = pairs.of_points.min(distance - ball);
                    distance - ball - margin
                }
                Shape::Disc(normal, disc) => {
                    pairs.of_points = pairs.of_points.min(distance);
                    let is_near = distance < 1.06 * disc + margin + 1e-9 * far;
                    let is_nearest = distance - 1.001 * disc < pairs.apart;
                    let apart = if is_near || is_nearest {
                        from_disc((p, normal, disc), triangle)
                    } else {
                        distance - disc
                    };
                    pairs.apart = pairs.apart.min(apart);
                    apart - margin.max(f64::from(nearmiss_hierarchy::THICKNESS) * disc)
                }
            };
            if semantics == Semantics::Surface && is_sparse {
                pairs.doubt = pairs.doubt.min(distance - f64::from(slices.ball(i)) * scale - margin);
            } else {
                pairs.all.push((i, j, beyond, radius));
            }
        }
    }
    pairs
}

/// A scan and a mesh to compare.
struct Case {
    scan: PointHierarchy,
    mesh: MeshHierarchy,
    poses: [Pose; 2],
}

/// Compares every answer with the brute one. Returns whether they meet; `None` if that depends on
/// rounding.
#[expect(clippy::too_many_lines, reason = "every answer of one case")]
fn check(case: &Case, semantics: Semantics, margin: f64, what: &str) -> Option<bool> {
    let Case { scan, mesh, poses } = case;
    let (placed, view) = (Placed::new(scan, &poses[0]), mesh.arrays());
    let triangles: Vec<Corners> =
        (0..mesh.len()).map(|j| view.corners(j).map(|p| poses[1].apply(p))).collect();
    let pairs = brute(&placed, &triangles, semantics, margin);
    // Poses are composed in double precision, far from the origin as well.
    let far = triangles.iter().flatten().fold(0.0_f64, |far, p| far.max(size(*p)))
        + size(poses[0].translation())
        + size(poses[1].translation());
    let lost = |radius: f64| 1e-6 * radius + 1e-13 * far;
    let leaf = |(i, j, ..): &(usize, usize, f64, f64)| {
        [i / scan.topology().leaf_size(), j / mesh.topology().leaf_size()]
    };
    let surely: BTreeSet<_> = pairs.all.iter().filter(|p| p.2 < -lost(p.3)).map(leaf).collect();
    let maybe: BTreeSet<_> = pairs.all.iter().filter(|p| p.2 < lost(p.3)).map(leaf).collect();
    let options = CollideOptions::estimated().with_semantics(semantics).with_margin(margin);
    let pair = MeshScanPair::new(placed, PlacedMesh::new(mesh, &poses[1]));
    let mut verdicts = vec![];
    for level in levels() {
        let scratch = &mut Scratch::by_level(level);
        for options in [
            options,
            options.with_detail(Detail::Verdict).with_order(Order::Overlap),
            options.with_evidence(Evidence::Certified),
        ] {
            let plan = MeshScanPlan::new(&options, scan).unwrap();
            let answer = pair.collide(&plan, scratch);
            let hit = answer.verdict.is_intersecting();
            assert!(hit || surely.is_empty(), "{what}: {answer:?} misses {surely:?}");
            assert!(!hit || !maybe.is_empty(), "{what}: {answer:?} is wrong, {} apart", pairs.apart);
            match answer.verdict {
                Verdict::Intersecting { contact, evidence } => {
                    check_contact(
                        case,
                        &triangles,
                        (semantics, margin),
                        (contact, evidence, answer.band),
                        what,
                    );
                }
                Verdict::Separated { gap, evidence } => {
                    assert!(gap <= pairs.apart.max(0.0) * (1.0 + 1e-9), "{what}: {gap}, is {}", pairs.apart);
                    assert!(gap == 0.0 || evidence == Evidence::Certified, "{what}: {gap}");
                    assert!(pairs.doubt > -lost(answer.band), "{what}: a sparse point is near");
                }
                Verdict::Undecided(reason) => {
                    assert!(
                        reason == Reason::Undersampled && pairs.doubt < lost(answer.band),
                        "{what}: {reason:?}"
                    );
                }
            }
            verdicts.push(hit);
            let mut contacts = Contacts::default();
            let all = pair.contacts(&plan, &mut contacts, scratch);
            assert!(contacts.complete && all.verdict.is_intersecting() == hit, "{what}");
            let found: BTreeSet<_> = contacts
                .contacts
                .iter()
                .map(|c| {
                    let i = scan.source().iter().position(|&s| s == c.sources[0].0).unwrap();
                    let j = view.source.iter().position(|&s| s == c.sources[1].0).unwrap();
                    leaf(&(i, j, 0.0, 0.0))
                })
                .collect();
            assert_eq!(found.len(), contacts.contacts.len(), "{what}: one contact of a pair of leaves");
            assert!(found.is_superset(&surely), "{what}: {found:?} lacks some of {surely:?}");
            assert!(found.is_subset(&maybe), "{what}: {found:?} has more than {maybe:?}");
            for work in [0, 1, 30, 200] {
                let verdict = pair.within(&Budget::UNLIMITED.with_work(work)).collide(&plan, scratch).verdict;
                assert!(!verdict.is_intersecting() || !maybe.is_empty(), "{what}");
                assert!(!verdict.is_separated() || surely.is_empty(), "{what}");
            }
        }
        if margin == 0.0 {
            let options = DistanceOptions::default().with_semantics(semantics);
            let plan = DistancePlan::against_mesh(&options, scan).unwrap();
            for work in [0, 1, 30, 200, u64::MAX] {
                let whole = work == u64::MAX;
                let budget = if whole { Budget::UNLIMITED } else { Budget::UNLIMITED.with_work(work) };
                let distance = pair.within(&budget).distance(&plan, scratch);
                let off = lost(distance.band);
                assert!(
                    distance.lower <= pairs.apart.max(0.0) + off,
                    "{what}: {distance:?}, is {}",
                    pairs.apart
                );
                assert!(
                    distance.lower <= distance.upper && (!whole || distance.complete),
                    "{what}: {distance:?}"
                );
                if whole && semantics != Semantics::Surface {
                    assert!(
                        distance.upper <= pairs.of_points.max(0.0) + off,
                        "{what}: {distance:?}, points {}",
                        pairs.of_points
                    );
                }
                if distance.evidence == Evidence::Certified {
                    let [p, q] = distance.points;
                    let on = triangles.iter().map(|t| from_point(q, t)).fold(f64::INFINITY, f64::min);
                    assert!(on <= off, "{what}: {distance:?}, the point is {on} off the mesh");
                    if !matches!(semantics, Semantics::Thickened(_)) {
                        assert!(
                            (size(minus(p, q)) - distance.upper).abs() <= off + 1e-9 * distance.upper,
                            "{what}: {distance:?}"
                        );
                    }
                }
                if let Semantics::Thickened(_) = semantics
                    && whole
                {
                    assert!(
                        (distance.upper - pairs.apart.max(0.0)).abs() <= off,
                        "{what}: {distance:?}, is {}",
                        pairs.apart
                    );
                    assert_eq!(distance.lower, distance.upper, "{what}");
                }
            }
        }
    }
    let agree = surely.is_empty() == maybe.is_empty();
    assert!(!agree || verdicts.iter().all(|&hit| hit != surely.is_empty()), "{what}");
    agree.then_some(!surely.is_empty())
}

/// A contact is near its sources, and a certified one is where it says.
fn check_contact(
    Case { scan, mesh, poses }: &Case,
    triangles: &[Corners],
    (semantics, margin): (Semantics, f64),
    (contact, evidence, band): (nearmiss_query::Contact, Evidence, f64),
    what: &str,
) {
    let placed = Placed::new(scan, &poses[0]);
    let i = scan.source().iter().position(|&s| s == contact.sources[0].0).unwrap();
    let j = mesh.arrays().source.iter().position(|&s| s == contact.sources[1].0).unwrap();
    let far = size(contact.point) + size(poses[0].translation()) + size(poses[1].translation());
    let lost = 1e-6 * band + 1e-13 * far;
    let off = from_point(contact.point, &triangles[j]);
    let radius = f64::from(scan.radii()[i]) * placed.stored_to_world().scale();
    let thick = match semantics {
        Semantics::Thickened(r) => r + margin,
        _ => margin + 0.05 * radius,
    };
    assert!(off <= 0.51 * thick.max(2.0 * lost) + lost, "{what}: {contact:?} is {off} off its triangle");
    if evidence == Evidence::Certified && contact.normals.is_some() && margin == 0.0 {
        assert!(off <= lost, "{what}: a witness is on its triangle, not {off} away");
        let at = placed.evaluate(contact.point, &mut Scratch::default());
        assert!(at.status == Status::Ok && at.f.abs() <= 2e-6 * at.bandwidth, "{what}: {at:?} at a witness");
    }
}

/// The kinds of triangles near a cloud.
#[derive(Debug, Clone, Copy)]
enum Triangles {
    Small,
    Large,
    Huge,
    Needles,
    /// Their corners are points of the cloud.
    OfPoints,
}

const KINDS: [Triangles; 5] =
    [Triangles::Small, Triangles::Large, Triangles::Huge, Triangles::Needles, Triangles::OfPoints];

/// Triangles near the points of a scan, given in the frame of its input.
fn triangles(rng: &mut Random, kind: Triangles, count: u32, scan: &PointHierarchy, off: f64) -> TriangleMesh {
    let at_home = Placed::new(scan, &Pose::IDENTITY);
    let extent = scan.bounds().half_extents().into_iter().fold(0.0, f64::max);
    let mut vertices = Vec::new();
    for _ in 0..count {
        let i = rng.random_range(0..scan.len());
        let r = at_home.stored_to_world().scale() * f64::from(scan.radii()[i]);
        let place = at_home.point(i);
        let shift = point_in(rng, off * r);
        let along = arbitrary::unit_vector(rng);
        for corner in 0..3_u8 {
            let away = match kind {
                Triangles::Small => point_in(rng, 0.3 * r),
                Triangles::Large => point_in(rng, 6.0 * r),
                Triangles::Huge => point_in(rng, 200.0 * extent),
                Triangles::Needles => {
                    let (t, thin) =
                        (rng.random_range(-20.0..20.0) * r, [1e-2, 1e-5, 1e-9][usize::from(corner)]);
                    let beside = point_in(rng, thin * r);
                    [0, 1, 2].map(|k| t * along[k] + beside[k])
                }
                Triangles::OfPoints => {
                    let other = at_home.point(rng.random_range(0..scan.len()));
                    minus(other, place)
                }
            };
            vertices.push([0, 1, 2].map(|k| place[k] + shift[k] + away[k]));
        }
    }
    let triangles = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    TriangleMesh::new(vertices, triangles).unwrap()
}

#[test]
fn clouds_of_every_kind_answer_as_all_pairs_do() {
    let rng = &mut rng(3301);
    let mut seen = [[0; 2]; 3];
    let mut open = 0;
    for round in 0..210_usize {
        let cloud = CloudKind::ALL[round % 14];
        let count = [30, 90, 250][round % 3];
        let points = arbitrary::cloud(cloud, count, round as u64);
        let options = BuildOptions::default().with_leaf_size([16, 4, 40][round / 3 % 3]);
        let Ok(scan) = PointHierarchy::build(&PointCloud::cleaned(&points).unwrap(), &options) else {
            continue;
        };
        let kind = KINDS[round % 5];
        // Huge triangles and needles meet nearly everything.
        let count =
            [rng.random_range(1..4), rng.random_range(1..25)][usize::from(!matches!(kind, Triangles::Huge))];
        let off = [0.0, 1.0, 4.0][rng.random_range(0..3_usize)];
        let mesh = triangles(rng, kind, count, &scan, off);
        let Ok(mesh) = MeshHierarchy::build(&mesh, &MeshBuildOptions::default()) else { continue };
        let scale = [1.0, 1e-3, 50.0][round / 7 % 3];
        let extent = scan.bounds().half_extents().into_iter().fold(0.0, f64::max) * scale;
        let spread = [1.0, 1e5][round % 2] * extent;
        let world = pose(rng, spread).with_scale(scale);
        let r = Placed::new(&scan, &world).sampling_radius();
        // The mesh where it was made, or a little aside.
        let aside = [0.0, 0.5 * r, 5.0 * r, 2.0 * extent][rng.random_range(0..4_usize)];
        let beside =
            world.with_translation([0, 1, 2].map(|k| world.translation()[k] + point_in(rng, aside)[k]));
        let case = Case { scan, mesh, poses: [world, beside] };
        let semantics =
            [Semantics::Obstacle, Semantics::Obstacle, Semantics::Surface, Semantics::Thickened(0.4 * r)];
        let semantics = semantics[rng.random_range(0..4_usize)];
        let margin = [0.0, 0.0, 0.02 * r, r][rng.random_range(0..4_usize)];
        let what = format!("round {round}, {cloud:?}, {kind:?}, {semantics:?}, margin {margin}");
        match check(&case, semantics, margin, &what) {
            Some(hit) => {
                let of = match semantics {
                    Semantics::Obstacle => 0,
                    Semantics::Surface => 1,
                    _ => 2,
                };
                seen[of][usize::from(hit)] += 1;
            }
            None => open += 1,
        }
    }
    assert!(seen.iter().flatten().all(|&n| n > 5) && open < 20, "{seen:?}, {open} depend on rounding");
}

#[test]
fn triangles_in_the_plane_of_a_scan_meet_it() {
    let points: Vec<[f64; 3]> =
        (0..900_u16).map(|i| [f64::from(i % 30), f64::from(i / 30), 0.0].map(|x| x * 0.1)).collect();
    let scan = PointHierarchy::build(&PointCloud::from_positions(&points).unwrap(), &BuildOptions::default())
        .unwrap();
    let tips = |z: f64| vec![[0.5, 0.5, z], [2.0, 0.6, z], [1.0, 2.0, z]];
    for (height, hits) in [(0.0, true), (1e-6, true), (0.02, false), (-1e-7, true)] {
        let mesh = TriangleMesh::new(tips(height), vec![[0, 1, 2]]).unwrap();
        let mesh = MeshHierarchy::build(&mesh, &MeshBuildOptions::default()).unwrap();
        for (k, world) in [Pose::IDENTITY, pose(&mut rng(5), 1e4).with_scale(1e3)].into_iter().enumerate() {
            let case = Case { scan: scan.clone(), mesh: mesh.clone(), poses: [world; 2] };
            let what = format!("{height}, pose {k}");
            assert_eq!(check(&case, Semantics::Obstacle, 0.0, &what), Some(hits), "{what}");
        }
    }
}

#[test]
fn the_methods_of_the_papers_are_refused() {
    let points = arbitrary::cloud(CloudKind::Sphere, 200, 1);
    let scan =
        PointHierarchy::build(&PointCloud::cleaned(&points).unwrap(), &BuildOptions::default()).unwrap();
    let options = CollideOptions::estimated();
    for refused in [
        options.with_method(Method::Sampling(Sampling::default())),
        options.with_order(Order::Sides),
        options.with_order(Order::Cells),
        options.with_coverings(true),
    ] {
        assert!(matches!(MeshScanPlan::new(&refused, &scan), Err(PlanError::NotForMeshes(_))));
    }
    assert_eq!(MeshScanPlan::new(&options.with_margin(-1.0), &scan), Err(PlanError::Margin(-1.0)));
    let mesh = TriangleMesh::new(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], vec![[0, 1, 2]]).unwrap();
    let mesh = MeshHierarchy::build(&mesh, &MeshBuildOptions::default()).unwrap();
    let nowhere = Pose::from_translation([f64::NAN, 0.0, 0.0]);
    let plan = MeshScanPlan::new(&options, &scan).unwrap();
    let pair = MeshScanPair::new(Placed::new(&scan, &Pose::IDENTITY), PlacedMesh::new(&mesh, &nowhere));
    let scratch = &mut Scratch::default();
    assert_eq!(pair.collide(&plan, scratch).verdict, Verdict::Undecided(Reason::Pose));
    let plan = DistancePlan::against_mesh(&DistanceOptions::default(), &scan).unwrap();
    assert!(!pair.distance(&plan, scratch).complete);
}
