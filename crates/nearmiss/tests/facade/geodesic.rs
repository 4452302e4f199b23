//! Scans for the geodesic kernel: the sheets they keep apart, agreement with straight-line
//! distances, and storage.
use std::sync::Arc;

use nearmiss::graph::SurfaceGraphMeta;
use nearmiss::hierarchy::HierarchyMeta;
use nearmiss::store::Writer;
use nearmiss::{
    Answer, BatchScratch, BuildOptions, Check, CollideOptions, CollidePlan, Evidence, GraphError,
    GraphOptions, Metric, Pair, Paths, Placed, PlanError, PointCloud, PointKind, Pose, Scan, Scratch,
    Semantics, Until, Verdict, World, each,
};
use nearmiss_testdata::arbitrary::{self, CloudKind};
use nearmiss_testdata::dragon::{Dragon, dragon_mesh};
use nearmiss_testdata::shapes::{Order, Sampling, plates, sphere, torus};
use serde::Serialize;

/// A scan with a graph and straight-line distances, and the same scan for the geodesic kernel.
fn both(points: &[[f64; 3]]) -> [Scan; 2] {
    let cloud = PointCloud::from_positions(points).unwrap();
    let scan = Scan::build(&cloud, &BuildOptions::default()).unwrap();
    let scan = scan
        .with_graph(&cloud, &GraphOptions::default().with_close_pairs(Some(Paths::Rebuilt)), None)
        .unwrap();
    [scan.clone(), scan.with_geodesic_kernel().unwrap()]
}

fn bytes(scan: &Scan) -> Vec<u8> {
    let mut bytes = Vec::new();
    scan.write_to(&mut bytes).unwrap();
    bytes
}

fn ask(a: &Scan, b: &Scan, pose: &Pose, scratch: &mut Scratch) -> Verdict {
    let plan =
        CollidePlan::new(&CollideOptions::estimated().with_semantics(Semantics::Surface), a, b).unwrap();
    Pair::new(a.at(&Pose::IDENTITY), b.at(pose)).collide(&plan, scratch).verdict
}

/// Counts verdicts: separated, certified contacts, other contacts, undecided.
fn tally(a: &Scan, b: &Scan, poses: &[Pose]) -> [usize; 4] {
    let mut counts = [0; 4];
    let mut scratch = Scratch::default();
    for pose in poses {
        let kind = match ask(a, b, pose, &mut scratch) {
            Verdict::Separated { .. } => 0,
            Verdict::Intersecting { evidence: Evidence::Certified, .. } => 1,
            Verdict::Intersecting { .. } => 2,
            Verdict::Undecided(_) => 3,
        };
        counts[kind] += 1;
    }
    counts
}

const SPACING: f64 = 0.05;

/// The mean bandwidth of plates that are far apart.
fn bandwidth() -> f64 {
    let flat = plates(2.0, 2.0, 10.0).sample(Sampling { order: Order::Random, ..Sampling::clean(SPACING) });
    let scan =
        Scan::build(&PointCloud::from_positions(&flat.points).unwrap(), &BuildOptions::default()).unwrap();
    let sum: f64 = scan.radii().iter().map(|&r| f64::from(scan.plan().bandwidth(r))).sum();
    #[expect(clippy::cast_precision_loss, reason = "some thousand")]
    let count = scan.len() as f64;
    sum / count * scan.frame().scale
}

/// Two plates at this distance, sampled at random without noise.
fn pair_of_plates(distance: f64) -> [Scan; 2] {
    let sampling = Sampling { order: Order::Random, seed: 1, ..Sampling::clean(SPACING) };
    both(&plates(2.0, 2.0, distance).sample(sampling).points)
}

/// Angles in degrees, ascending, between the plates and the normals of points further from the
/// border than edges reach.
fn leaning(scan: &Scan) -> Vec<f32> {
    let inner = |p: &[f32; 3]| p[0].abs().max(p[1].abs()) < 0.7;
    let mut angles: Vec<f32> = (scan.positions().iter().zip(scan.normals()))
        .filter(|(p, _)| inner(p))
        .map(|(_, n)| n[0].hypot(n[1]).atan2(n[2].abs()).to_degrees())
        .collect();
    angles.sort_unstable_by(f32::total_cmp);
    angles
}

/// Klein & Zachmann 2005, fig. 4 and 5: with straight-line distances, points of the other sheet
/// contribute.
#[test]
fn discs_of_close_plates_lie_on_them() {
    let h = bandwidth();
    // The distance in h; then the fraction of ambiguous points and the median angle, each as an
    // upper limit for the geodesic kernel and a lower limit for straight-line distances.
    for (s, ambiguous, angle) in
        [(1.5, [0.25, 0.8], [2.0, 2.5]), (1.8, [0.05, 0.15], [0.1, 1.2]), (2.0, [0.02, 0.015], [0.1, 0.7])]
    {
        let scans = pair_of_plates(s * h);
        let [straight, geodesic] = [0, 1].map(|k: usize| {
            let angles = leaning(&scans[k]);
            (scans[k].share(PointKind::Noisy), angles[angles.len() / 2], angles[angles.len() - 1])
        });
        assert!(geodesic.0 < ambiguous[0] && straight.0 > ambiguous[1], "{s} h: {geodesic:?}, {straight:?}");
        assert!(geodesic.1 < angle[0] && straight.1 > angle[1], "{s} h: {geodesic:?}, {straight:?}");
        assert!(geodesic.2 < straight.2, "{s} h: the worst of {geodesic:?} and {straight:?}");
    }
}

/// A ball between two plates that touches neither, and one that intersects both.
#[test]
fn what_passes_between_close_plates_is_apart_and_what_cuts_them_is_certain() {
    let h = bandwidth();
    let mut rng = arbitrary::rng(7);
    let poses: Vec<Pose> = (0..400)
        .map(|_| arbitrary::point_in(&mut rng, 0.5))
        .map(|[x, y, _]| Pose::from_translation([x, y, 0.0]))
        .collect();
    let [straight, geodesic] = pair_of_plates(1.5 * h);
    let ball = |radius: f64| both(&sphere(radius).sample(Sampling::clean(radius / 10.0)).points);
    // The ball is a tenth of a bandwidth from either plate.
    let thin = ball(0.65 * h);
    let [of_straight, of_geodesic] = [tally(&straight, &thin[0], &poses), tally(&geodesic, &thin[1], &poses)];
    assert_eq!(of_geodesic, [400, 0, 0, 0], "apart");
    assert!(of_straight[3] > 0, "straight distances leave some open: {of_straight:?}");
    let thick = ball(1.15 * h);
    let [of_straight, of_geodesic] =
        [tally(&straight, &thick[0], &poses), tally(&geodesic, &thick[1], &poses)];
    assert!(of_geodesic[1] >= 396, "a witness on both surfaces: {of_geodesic:?}");
    assert!(of_straight[1] <= 4, "nothing is certain by straight distances: {of_straight:?}");
}

/// On random lines of motion, verdicts agree except within a fifth of a sampling radius of first
/// contact.
#[test]
fn where_no_other_sheet_is_near_verdicts_agree() {
    let dragon: Vec<[f64; 3]> = dragon_mesh(Dragon::Points5k).unwrap().vertices().to_vec();
    let sampling = Sampling { seed: 2, ..Sampling::clean(0.08) };
    let (mut rng, mut scratch) = (arbitrary::rng(3), Scratch::default());
    // The dragon has edges and clefts, where the verdicts may differ.
    for (name, points, most) in [
        ("sphere", sphere(1.0).sample(sampling).points, 0),
        ("torus", torus(1.0, 0.4).sample(sampling).points, 0),
        ("dragon", dragon, 4),
    ] {
        let [straight, geodesic] = both(&points);
        let r = straight.sampling_radius();
        let half = straight.bounds().half_extents().into_iter().fold(0.0, f64::max);
        let (mut asked, mut differ) = (0, 0);
        for _ in 0..40 {
            let (turn, direction) = (arbitrary::rotation(&mut rng), arbitrary::unit_vector(&mut rng));
            // Rotates about the centre of the scan.
            let middle = straight.bounds().centre();
            let at = |t: f64| {
                let turned = turn.apply(middle);
                turn.with_translation([0, 1, 2].map(|k| middle[k] - turned[k] + direction[k] * t))
            };
            let mut hits = |scan: &Scan, t: f64| ask(scan, scan, &at(t), &mut scratch).is_intersecting();
            let (mut apart, mut within) = (4.0 * half, 0.0);
            while apart - within > 1e-3 * r {
                let middle = 0.5 * (apart + within);
                if hits(&straight, middle) { within = middle } else { apart = middle }
            }
            for offset in [-2.0, -1.0, -0.5, -0.2, 0.2, 0.5, 1.0, 2.0] {
                let t = apart + offset * r;
                asked += 1;
                differ += usize::from(hits(&straight, t) != hits(&geodesic, t));
            }
        }
        assert_eq!(asked, 320, "{name}");
        assert!(differ <= most, "{name}: {differ} differ");
    }
}

#[test]
fn the_metric_is_kept_and_a_plan_holds_to_it() {
    use Metric::{Euclidean, Geodesic};
    let [straight, geodesic] = both(&arbitrary::cloud(CloudKind::Sphere, 600, 3));
    let written = bytes(&geodesic);
    for check in [Check::Full, Check::Structure] {
        let read = Scan::from_bytes(written.clone(), check).unwrap();
        assert_eq!((read.metric(), read.sanity_check()), (Geodesic, Ok(())));
        assert!(bytes(&read) == written, "all of it");
        assert!(bytes(&read.with_geodesic_kernel().unwrap()) == written, "fitted already");
    }
    assert!(straight.normals() != geodesic.normals(), "other discs");

    let plan = |metric: Option<Metric>, a: &Scan, b: &Scan| {
        let certified = CollideOptions::estimated().with_evidence(Evidence::Certified);
        CollidePlan::new(&metric.map_or(certified, |metric| certified.with_metric(metric)), a, b)
    };
    assert_eq!(plan(None, &straight, &straight).unwrap().options().metric, Some(Euclidean));
    assert_eq!(plan(Some(Geodesic), &geodesic, &geodesic).unwrap().options().metric, Some(Geodesic));
    for (metric, a, b, refused) in [
        (None, &straight, &geodesic, PlanError::Metrics([Euclidean, Geodesic])),
        (Some(Geodesic), &straight, &straight, PlanError::Metric { asked: Geodesic, stored: Euclidean }),
        (Some(Euclidean), &straight, &geodesic, PlanError::Metric { asked: Euclidean, stored: Geodesic }),
    ] {
        assert_eq!(plan(metric, a, b).unwrap_err(), refused);
        assert!(refused.to_string().contains("prepare"), "{refused}");
    }
    let balls = CollideOptions::estimated().with_semantics(Semantics::Thickened(0.1));
    assert!(CollidePlan::new(&balls, &straight, &geodesic).is_ok(), "points know no kernel");

    // Separated scans are never certified, whatever evidence is requested.
    let far = Pose::from_translation([9.0, 0.0, 0.0]);
    for (scan, evidence) in [(&straight, Evidence::Certified), (&geodesic, Evidence::Estimated)] {
        let plan = plan(None, scan, scan).unwrap();
        let (a, b, mut scratch) = (scan.at(&Pose::IDENTITY), scan.at(&far), Scratch::default());
        match Pair::new(a, b).collide(&plan, &mut scratch).verdict {
            Verdict::Separated { evidence: found, .. } => assert_eq!(found, evidence),
            other => panic!("{other:?}"),
        }
    }
}

/// Placed scans without a graph have the same discs, but do not verify contacts.
#[test]
fn a_witness_is_verified_by_the_scans_own_kernel_alone() {
    let [_, geodesic] = both(&arbitrary::cloud(CloudKind::Sphere, 600, 3));
    let pose = Pose::from_translation([1.1, 0.2, 0.0]);
    let asked = |a: &Placed<'_>, b: &Placed<'_>| {
        let plan = CollidePlan::new(&CollideOptions::estimated(), a.scan(), b.scan()).unwrap();
        match Pair::new(*a, *b).collide(&plan, &mut Scratch::default()).verdict {
            Verdict::Intersecting { contact, evidence } => (contact, evidence),
            other => panic!("{other:?}"),
        }
    };
    let bare = |pose: &Pose| Placed::new(&geodesic, pose);
    let (contact, evidence) = asked(&geodesic.at(&Pose::IDENTITY), &geodesic.at(&pose));
    assert_eq!(evidence, Evidence::Certified);
    for pose in [Pose::IDENTITY, pose] {
        let at = geodesic.at(&pose).evaluate(contact.point, &mut Scratch::default());
        assert!(at.f.abs() <= 1e-6 * at.bandwidth, "the witness is {} off by the geodesic kernel", at.f);
        let at = bare(&pose).evaluate(contact.point, &mut Scratch::default());
        assert!(at.f.abs() > 1e-6 * at.bandwidth, "and on the surface of straight distances");
    }
    for (a, b) in [(bare(&Pose::IDENTITY), bare(&pose)), (geodesic.at(&Pose::IDENTITY), bare(&pose))] {
        assert_eq!(asked(&a, &b).1, Evidence::Estimated);
    }
}

/// Metadata of a scan's file.
#[derive(Serialize)]
struct Meta {
    hierarchy: HierarchyMeta,
    graph: Option<SurfaceGraphMeta>,
    density: Option<nearmiss::Density>,
}

#[test]
fn without_the_map_there_is_no_such_scan() {
    let cloud = PointCloud::from_positions(&arbitrary::cloud(CloudKind::Sphere, 300, 4)).unwrap();
    let bare = Scan::build(&cloud, &BuildOptions::default()).unwrap();
    let graph = |pairs| {
        bare.clone().with_graph(&cloud, &GraphOptions::default().with_close_pairs(pairs), None).unwrap()
    };
    let (without, whole) = (graph(None), graph(Some(Paths::Rebuilt)).with_geodesic_kernel().unwrap());
    for scan in [&bare, &without] {
        assert_eq!(scan.clone().with_geodesic_kernel().unwrap_err(), GraphError::NoClosePairs);
    }
    // A new graph replaces the old one in the kernel if it has a map of close pairs.
    let other = whole
        .clone()
        .with_graph(&cloud, &GraphOptions::default().with_close_pairs(Some(Paths::Rebuilt)), None)
        .unwrap();
    assert_eq!(other.metric(), Metric::Geodesic);
    let options = GraphOptions::default().with_close_pairs(None);
    assert_eq!(whole.clone().with_graph(&cloud, &options, None).unwrap_err(), GraphError::NoClosePairs);

    // Files whose metadata claim the geodesic kernel.
    let version = nearmiss::store::File::from_bytes(bytes(&whole), Check::Full).unwrap().version();
    for scan in [&bare, &without] {
        let meta =
            Meta { hierarchy: whole.meta().clone(), graph: scan.graph().map(|g| g.meta()), density: None };
        let (mut writer, mut bytes) = (Writer::new(*b"SCAN", version), Vec::new());
        writer.metadata(&meta).unwrap();
        (*whole).add_to(&mut writer).unwrap();
        if let Some(graph) = scan.graph() {
            graph.add_to(&mut writer).unwrap();
        }
        writer.write_to(&mut bytes).unwrap();
        for check in [Check::Full, Check::Structure] {
            let refused = Scan::from_bytes(bytes.clone(), check).unwrap_err();
            assert!(refused.to_string().contains("no map of close pairs"), "{refused}");
        }
    }
}

#[test]
fn it_is_the_same_on_any_number_of_threads() {
    let points = arbitrary::cloud(CloudKind::Sphere, 3000, 6);
    let made = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        bytes(&pool.install(|| both(&points)[1].clone()))
    };
    let one = made(1);
    assert!([2, 5].into_iter().all(|threads| made(threads) == one), "other bytes");
}

#[test]
fn worlds_and_batches_keep_graph_and_kernel() {
    let ball = sphere(1.0).sample(Sampling::clean(0.1));
    let [_, geodesic] = both(&ball.points);
    let geodesic = Arc::new(geodesic);
    let options = CollideOptions::estimated().with_semantics(Semantics::Surface);
    let plan = CollidePlan::new(&options, &geodesic, &geodesic).unwrap();
    let poses: Vec<[Pose; 2]> = (0..8_u32)
        .map(|i| [Pose::IDENTITY, Pose::from_translation([1.0 + 0.1 * f64::from(i), 0.3, 0.1])])
        .collect();
    let mut told = vec![Answer::UNASKED; poses.len()];
    each(&mut told, None, &mut BatchScratch::default(), |i, scratch| {
        let [a, b] = [0, 1].map(|k: usize| geodesic.at(&poses[i][k]));
        Until::All.after(Pair::new(a, b).collide(&plan, scratch))
    });
    let mut certified = 0;
    for ([a, b], told) in poses.iter().zip(&told) {
        let views = [geodesic.at(a), geodesic.at(b)];
        let alone = Pair::new(views[0], views[1]).collide(&plan, &mut Scratch::default());
        assert_eq!(*told, alone, "a batch");
        let mut world = World::new();
        let ids = [world.insert(Arc::clone(&geodesic), a), world.insert(Arc::clone(&geodesic), b)];
        let pair = world.pair(ids).unwrap();
        assert_eq!(pair.collide(&plan, &mut Scratch::default()), alone, "a world");
        // Without the kernel, no contact is verified.
        let is_certified =
            matches!(alone.verdict, Verdict::Intersecting { evidence: Evidence::Certified, .. });
        certified += usize::from(is_certified);
    }
    assert!(certified > 4, "{certified} of {} certified", poses.len());
}
