//! The obstacle of a scan: certificates, the width of the band, and bounds on distances, compared
//! with brute force.
use nearmiss::{
    Answer, BuildOptions, CollideOptions, CollidePlan, Detail, Distance, DistanceOptions, DistancePlan,
    Evidence, Pair, Placed, PointCloud, PointKind, Pose, Scan, Scratch, Verdict,
};
use nearmiss_testdata::arbitrary::{self, CloudKind};
use nearmiss_testdata::scanner::{self, Frame};
use nearmiss_testdata::shapes::{Sampling, sphere};
use rand::RngExt;

fn scan(points: &[[f64; 3]]) -> Scan {
    Scan::build(&PointCloud::from_positions(points).unwrap(), &BuildOptions::default()).unwrap()
}

fn ask(a: &Placed<'_>, b: &Placed<'_>, detail: Detail) -> Answer {
    let options = CollideOptions::estimated().with_evidence(Evidence::Certified).with_detail(detail);
    let plan = CollidePlan::new(&options, a.scan(), b.scan()).unwrap();
    Pair::new(*a, *b).collide(&plan, &mut Scratch::default())
}

fn how_far(a: &Placed<'_>, b: &Placed<'_>) -> Distance {
    let plan = DistancePlan::new(&DistanceOptions::default(), a.scan(), b.scan()).unwrap();
    Pair::new(*a, *b).distance(&plan, &mut Scratch::default())
}

/// Returns the points of a scan in the world. Each has the radius of its ball, and the radius of a
/// ball that contains its part of the obstacle. Computed only from the definition in
/// `docs/theory/obstacle.md`.
fn matter(view: &Placed<'_>) -> Vec<([f64; 3], f64, f64)> {
    let (arrays, scale) = (view.scan().arrays(), view.stored_to_world().scale());
    let part = |i: usize| {
        let (radius, reach) = (f64::from(arrays.radii[i]), f64::from(arrays.reach));
        let kind = view.scan().kind(i);
        let alone = matches!(kind, PointKind::Line | PointKind::Stray | PointKind::Sparse);
        let on_sheet = i < arrays.dense && matches!(kind, PointKind::Sheet | PointKind::Edge);
        let (ball, within) = if on_sheet {
            (0.0, radius.min(0.5 * reach).max(1.05 * f64::from(arrays.discs.get(i))))
        } else {
            let ball = radius * if alone { 0.5 } else { 0.325 };
            (ball, ball)
        };
        (view.point(i), ball * scale, within * scale)
    };
    (0..view.scan().len()).map(part).collect()
}

/// Returns a lower and an upper bound on the distance of two obstacles, and the distance of their
/// nearest points, from all pairs of points. The lower bound uses the balls that contain each part,
/// the upper bound the balls of the points.
fn brute_force(a: &Placed<'_>, b: &Placed<'_>) -> [f64; 3] {
    let (of_a, of_b) = (matter(a), matter(b));
    let mut bounds = [f64::INFINITY; 3];
    for (p, ball_p, within_p) in &of_a {
        for (q, ball_q, within_q) in &of_b {
            let [x, y, z] = [p[0] - q[0], p[1] - q[1], p[2] - q[2]];
            let away = (x * x + y * y + z * z).sqrt();
            bounds[0] = bounds[0].min(away - within_p - within_q);
            bounds[1] = bounds[1].min(away - ball_p - ball_q);
            bounds[2] = bounds[2].min(away);
        }
    }
    bounds
}

/// Clouds with strays, rings, clusters and sheets of uneven density.
fn clouds() -> Vec<Vec<[f64; 3]>> {
    let mut clouds: Vec<Vec<[f64; 3]>> = [
        CloudKind::Sphere,
        CloudKind::Random,
        CloudKind::Clustered,
        CloudKind::Rings,
        CloudKind::Outlier,
        CloudKind::Coplanar,
    ]
    .iter()
    .map(|&kind| arbitrary::cloud(kind, 300, 7))
    .collect();
    let frame = scanner::frame(&Frame { beams: 12, steps: 40, noise: 0.02, seed: 3 });
    clouds.push(frame.iter().map(|p| p.map(|x| 0.1 * x)).collect());
    clouds.push(uneven_plate(0.08, 6.0));
    clouds
}

/// A plate of 2 × 2 at z = 0, with spacing `ratio` times as large where x is positive.
fn uneven_plate(spacing: f64, ratio: f64) -> Vec<[f64; 3]> {
    let mut points = Vec::new();
    for (from, to, step) in [(-1.0, 0.0, spacing), (0.0, 1.0, spacing * ratio)] {
        let mut x = from;
        while x < to - 1e-9 {
            let mut y = -1.0;
            while y <= 1.0 + 1e-9 {
                points.push([x, y, 0.0]);
                y += step;
            }
            x += step;
        }
    }
    points
}

#[test]
fn answers_hold_against_brute_force() {
    let scans: Vec<Scan> = clouds().iter().map(|points| scan(points)).collect();
    let mut rng = arbitrary::rng(17);
    let (mut certified, mut touching, mut bracketed) = (0, 0, 0);
    for a in &scans {
        for b in &scans {
            let size = |scan: &Scan| scan.bounds().half_extents().into_iter().fold(0.0, f64::max);
            for _ in 0..6 {
                let scale = size(a) / size(b) * rng.random_range(0.2..1.0);
                let turn = arbitrary::rotation(&mut rng).with_scale(scale);
                let centre = turn.apply(b.bounds().centre());
                let to = arbitrary::point_in(&mut rng, 1.6 * size(a));
                let pose =
                    turn.with_translation([0, 1, 2].map(|k| a.bounds().centre()[k] + to[k] - centre[k]));
                let views = [a.at(&Pose::IDENTITY), b.at(&pose)];
                let [below, of_balls, nearest] = brute_force(&views[0], &views[1]);
                let rounding = 1e-5 * size(a);
                let answer = ask(&views[0], &views[1], Detail::Witness);
                match answer.verdict {
                    Verdict::Separated { gap, evidence } => {
                        assert!(of_balls > -rounding, "balls overlap by {}", -of_balls);
                        assert!(gap <= of_balls.max(0.0) + rounding, "{gap} of {of_balls}");
                        // Balls about the points prove separations that boxes do not.
                        assert!(below < rounding || evidence == Evidence::Certified, "{below} apart");
                        certified += usize::from(evidence == Evidence::Certified);
                    }
                    Verdict::Intersecting { .. } => {
                        assert!(below <= rounding, "nothing is nearer than {below}");
                        touching += 1;
                    }
                    Verdict::Undecided(reason) => panic!("obstacles leave nothing open: {reason:?}"),
                }
                let most = views
                    .iter()
                    .map(|v| v.scan().reach() / v.scan().frame().scale * v.stored_to_world().scale());
                let most = most.fold(0.0, f64::max);
                assert!(answer.band > 0.0 && answer.band <= most * (1.0 + 1e-6), "{} of {most}", answer.band);

                let found = how_far(&views[0], &views[1]);
                assert!(found.lower <= found.upper && found.complete, "{found:?}");
                assert!(found.upper <= nearest + rounding && found.upper <= of_balls.max(0.0) + rounding);
                assert!(found.lower <= of_balls.max(0.0) + rounding, "{} of {of_balls}", found.lower);
                assert_eq!(found.upper == 0.0, answer.verdict.is_intersecting(), "{found:?}, {answer:?}");
                let content = (0.9 * found.upper).min(found.upper - found.band);
                assert!(found.lower >= content.min(below) - 10.0 * rounding, "{found:?}, {below}");
                bracketed += usize::from(found.lower > 0.0);
            }
        }
    }
    assert!(certified > 100 && touching > 60 && bracketed > 100, "{certified}, {touching}, {bracketed}");
}

/// On a plate of two densities the band is local, and no contact is reported beyond it.
#[test]
fn the_band_of_uneven_plates_is_local_and_no_wider_than_the_reach() {
    let spacing = 0.04;
    let ball = scan(&sphere(0.28).sample(Sampling::clean(0.02)).points);
    for ratio in [2.0, 7.0, 20.0] {
        let plate = scan(&uneven_plate(spacing, ratio));
        let (mut contacts, mut certified, mut beyond) = (0, 0, 0);
        let mut rng = arbitrary::rng(5);
        for _ in 0..150 {
            // Positions around the border of the plate.
            let angle = rng.random_range(0.0..std::f64::consts::TAU);
            let (s, c) = angle.sin_cos();
            let edge = 1.0 / s.abs().max(c.abs());
            let away = edge + 0.28 + rng.random_range(-0.2..0.6);
            let pose = Pose::from_translation([away * c, away * s, rng.random_range(-0.1..0.1)]);
            let views = [plate.at(&Pose::IDENTITY), ball.at(&pose)];
            let [_, _, nearest] = brute_force(&views[0], &views[1]);
            let answer = ask(&views[0], &views[1], Detail::Witness);
            assert!(answer.band <= plate.reach() * (1.0 + 1e-6), "{ratio}: {}", answer.band);
            if answer.verdict.is_intersecting() {
                assert!(nearest <= answer.band * (1.0 + 1e-5), "{ratio}: {nearest}, band {}", answer.band);
                contacts += 1;
            }
            // Further apart than the band, nothing can touch.
            if nearest > 1.05 * plate.reach() {
                let proven =
                    matches!(answer.verdict, Verdict::Separated { evidence: Evidence::Certified, .. });
                certified += usize::from(proven);
                beyond += 1;
            }
        }
        assert!(contacts > 20 && beyond > 20, "{ratio}: {contacts} contacts, {beyond} beyond");
        assert_eq!(certified, beyond, "{ratio}");
    }
}

/// Two walls half a spacing apart, and one stray point in a hundred. Strays are obstacles, but do
/// not widen the walls.
#[test]
fn strays_are_obstacles_and_widen_no_wall() {
    let spacing = 0.05;
    let mut rng = arbitrary::rng(9);
    let mut points = Vec::new();
    for wall in [0.0, 0.5 * spacing] {
        for _ in 0..1600 {
            let [x, y, _] = arbitrary::point_in(&mut rng, 1.0);
            points.push([x, y, wall]);
        }
    }
    let strays: Vec<[f64; 3]> = (0..32)
        .map(|_| arbitrary::point_in(&mut rng, 1.0))
        .map(|[x, y, z]| [x, y, 1.2 + z])
        .filter(|p| p[2] > 0.5)
        .collect();
    points.extend(&strays);
    let room = scan(&points);
    assert!(room.share(PointKind::Stray) > 0.004, "{}", room.share(PointKind::Stray));
    let probe = scan(&sphere(0.05).sample(Sampling::clean(0.008)).points);
    let (mut met, mut proven, mut asked) = (0, 0, 0);
    for stray in &strays {
        let views = [room.at(&Pose::IDENTITY), probe.at(&Pose::from_translation(*stray))];
        // The interior of the probe is empty. The ball about the stray touches its shell, or the
        // stray is inside it.
        let Distance { lower, upper, .. } = how_far(&views[0], &views[1]);
        assert!(upper <= 0.05 && lower <= upper, "{stray:?}: {lower} to {upper}");
        met += usize::from(upper == 0.0);
    }
    for _ in 0..300 {
        let [x, y, z] = arbitrary::point_in(&mut rng, 1.0);
        let pose = Pose::from_translation([0.9 * x, 0.9 * y, 1.2 + z]);
        let views = [room.at(&Pose::IDENTITY), probe.at(&pose)];
        let [_, _, nearest] = brute_force(&views[0], &views[1]);
        let answer = ask(&views[0], &views[1], Detail::Verdict);
        if nearest >= 2.0 * answer.band {
            asked += 1;
            proven += usize::from(matches!(
                answer.verdict,
                Verdict::Separated { evidence: Evidence::Certified, .. }
            ));
            let found = how_far(&views[0], &views[1]);
            assert!(found.lower >= 0.5 * nearest && found.upper <= nearest * (1.0 + 1e-5), "{found:?}");
        }
    }
    assert!(asked > 40, "{asked} of 300");
    assert_eq!(proven, asked);
    assert!(met > strays.len() / 2, "{met} of {}", strays.len());
}

/// Nearly all surface points hit by a scanner's beams are in the obstacle, or within its band.
#[test]
fn a_scanned_hall_is_covered() {
    for (beams, steps, noise) in [(64, 900, 0.0), (32, 900, 0.01), (64, 450, 0.02)] {
        let points = scanner::frame(&Frame { beams, steps, noise, seed: 4 });
        let hall = scan(&points);
        let view = hall.at(&Pose::IDENTITY);
        let parts = matter(&view);
        // A finer scanner hits the surface between the rings.
        let seen = scanner::frame(&Frame { beams: 4 * beams - 3, steps: 311, noise: 0.0, seed: 1 });
        let mut rng = arbitrary::rng(2);
        let (mut covered, mut asked) = (0, 0);
        for _ in 0..1500 {
            let x = seen[rng.random_range(0..seen.len())];
            let away = |p: &[f64; 3]| (0..3).map(|k| (p[k] - x[k]).powi(2)).sum::<f64>().sqrt();
            let nearest = (0..parts.len()).min_by(|&i, &j| away(&parts[i].0).total_cmp(&away(&parts[j].0)));
            let i = nearest.unwrap();
            let band = f64::from(hall.radii()[i]) * hall.frame().scale;
            covered += usize::from(away(&parts[i].0) <= parts[i].2 + band);
            asked += 1;
        }
        assert!(covered * 100 >= asked * 95, "{beams} beams: {covered} of {asked}");
        assert!(hall.sheet_share() > 0.8, "{beams} beams: {} on sheets", hall.sheet_share());
    }
}

/// The reach is stored in the file, and an invalid reach is rejected with an error that names it.
#[test]
fn the_reach_is_stored_and_checked() {
    let cloud = PointCloud::from_positions(&arbitrary::cloud(CloudKind::Sphere, 500, 1)).unwrap();
    let made = Scan::build(&cloud, &BuildOptions::default().with_reach(0.3)).unwrap();
    assert!((made.reach() - 0.3).abs() < 1e-6);
    let mut bytes = Vec::new();
    made.write_to(&mut bytes).unwrap();
    let read = Scan::from_bytes(bytes, nearmiss::Check::Full).unwrap();
    assert_eq!(read.reach().to_bits(), made.reach().to_bits());
    for reach in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let refused = Scan::build(&cloud, &BuildOptions::default().with_reach(reach)).unwrap_err();
        assert!(refused.to_string().contains("reach"), "{refused}");
    }
}
