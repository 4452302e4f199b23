//! Moving scans answer as still ones, certify only what holds in the current frame, and forget
//! earlier frames.

use nearmiss::{
    Bodies, Body, BuildOptions, Check, CollideOptions, CollidePlan, DeformError, DistanceOptions,
    DistancePlan, Evidence, GraphOptions, MovingScan, Pair, PairHint, PointCloud, Pose, Proof, Renewal, Scan,
    Scratch, Semantics, Verdict, World,
};
use nearmiss_testdata::arbitrary::{rng, rotation, unit_vector};
use nearmiss_testdata::shapes::{Sampling, scorer_radius, sphere};

/// Points of a sphere.
fn ball() -> Vec<[f64; 3]> {
    sphere(1.0).sample(Sampling::clean(0.06)).points
}

/// The sphere, deformed more and more: squeezed, bent and dented.
fn deformed(points: &[[f64; 3]], share: f64) -> Vec<[f64; 3]> {
    let one = |[x, y, z]: &[f64; 3]| {
        let dent = 0.3 * share * (-8.0 * (x * x + (y - 1.0) * (y - 1.0) + z * z)).exp();
        [x * (1.0 + 0.15 * share), y - dent + 0.1 * share * x * x, z * (1.0 - 0.15 * share)]
    };
    points.iter().map(one).collect()
}

/// The least distance of two sets of points under a pose of the second.
fn least(a: &[[f64; 3]], b: &[[f64; 3]], pose: &Pose) -> f64 {
    let b: Vec<[f64; 3]> = b.iter().map(|p| pose.apply(*p)).collect();
    let sq = |p: &[f64; 3], q: &[f64; 3]| (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>();
    let all = a.iter().flat_map(|p| b.iter().map(move |q| sq(p, q)));
    all.fold(f64::INFINITY, f64::min).sqrt()
}

fn certified() -> CollideOptions {
    CollideOptions::default().with_evidence(Evidence::Certified)
}

#[test]
fn refitted_renewed_and_prepared_scans_agree_outside_the_band() {
    let points = ball();
    let r = scorer_radius(&points);
    let options = BuildOptions::default();
    let mut refitted = MovingScan::new(&points, &options).unwrap();
    let mut renewed = MovingScan::new(&points, &options).unwrap();
    let (rng, scratch) = (&mut rng(8), &mut Scratch::default());
    let (mut seen, mut proven) = ([0; 2], 0);
    for step in 1..8_u8 {
        let frame = deformed(&points, f64::from(step) / 7.0);
        let fitted = refitted.refit(&frame).unwrap().fitted;
        assert!(fitted < points.len() / 4, "{fitted} points fitted anew");
        renewed.renew(&frame).unwrap();
        let cloud = PointCloud::from_positions(&frame).unwrap();
        let anew = Scan::build(&cloud, &options).unwrap();
        for length in [1.2, 1.7, 1.9, 2.0, 2.1, 2.2, 2.4, 2.8] {
            let away = unit_vector(rng).map(|c| c * length);
            let pose = rotation(rng).with_translation(away);
            let truth = least(&frame, &frame, &pose);
            let mut verdicts = Vec::new();
            for placed in
                [refitted.at(&Pose::IDENTITY), renewed.at(&Pose::IDENTITY), anew.at(&Pose::IDENTITY)]
            {
                let other = nearmiss::Placed::new(placed.scan(), &pose);
                let plan = CollidePlan::new(&certified(), placed.scan(), placed.scan()).unwrap();
                let pair = Pair::new(placed, other);
                let mut proof = Proof::default();
                let verdict = pair.proof(&mut proof).collide(&plan, scratch).verdict;
                if let Verdict::Separated { gap, evidence: Evidence::Certified } = verdict {
                    assert!(gap <= truth, "step {step}: proven {gap}, but points are {truth} apart");
                    assert!(!proof.pairs.is_empty(), "step {step}: a proof has pairs");
                    proven += 1;
                }
                let plan = DistancePlan::new(&DistanceOptions::default(), placed.scan(), placed.scan());
                let distance = pair.distance(&plan.unwrap(), scratch);
                assert!(distance.upper <= truth + 1e-6, "step {step}: {distance:?} of {truth}");
                assert!(distance.lower <= distance.upper, "step {step}: {distance:?}");
                if truth > 4.0 * r {
                    assert!(distance.lower > 0.4 * truth, "step {step}: {distance:?} of {truth}");
                }
                verdicts.push(verdict.is_intersecting());
            }
            // The balls are at least 1.5 wide, so the nearest poses are deep.
            if truth > 2.0 * r || length < 1.3 {
                assert!(verdicts.iter().all(|v| *v == verdicts[2]), "step {step}, {truth}: {verdicts:?}");
                seen[usize::from(verdicts[2])] += 1;
            }
        }
    }
    assert!(seen[0] >= 7 && seen[1] >= 7 && proven > 20, "{seen:?} verdicts, {proven} proven");
}

/// A wall and a ball before it, seen by a depth camera, with noise and holes.
fn depth_frame(width: u32, height: u32, time: f64, seed: u64) -> Vec<[f64; 3]> {
    let rng = &mut rng(seed);
    let (focus, centre, radius) = (0.9 * f64::from(width), [0.3 * time.sin(), 0.1, 2.0], 0.4);
    let mut pixel = |i: u32| {
        let [u, v] =
            [f64::from(i % width) - 0.5 * f64::from(width), f64::from(i / width) - 0.5 * f64::from(height)];
        let d = [u / focus, v / focus, 1.0];
        let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let (dd, dc, cc) = (dot(d, d), dot(d, centre), dot(centre, centre) - radius * radius);
        let root = dc * dc - dd * cc;
        let depth = if root > 0.0 { (dc - root.sqrt()) / dd } else { 3.0 };
        let noise = unit_vector(rng)[0];
        let hole = i.is_multiple_of(53) || (i % width / 8 == 2 && i / width / 8 == 3);
        if hole { [f64::NAN; 3] } else { d.map(|x| x * depth * (1.0 + 2e-4 * noise)) }
    };
    (0..width * height).map(&mut pixel).collect()
}

#[test]
fn replaced_depth_frames_answer_as_prepared_ones_outside_the_band() {
    let tool = sphere(0.1).sample(Sampling::clean(0.02)).points;
    let tool = MovingScan::new(&tool, &BuildOptions::default()).unwrap();
    let first = ball();
    let (mut by_pixels, mut by_points) = (
        MovingScan::new(&first, &BuildOptions::default()).unwrap(),
        MovingScan::new(&first, &BuildOptions::default()).unwrap(),
    );
    let one_thread = BuildOptions::default().with_threads(1);
    let mut alone = MovingScan::new(&first, &one_thread).unwrap();
    let (rng, scratch) = (&mut rng(21), &mut Scratch::default());
    let (mut seen, mut proven) = ([0; 2], [0; 3]);
    for step in 0..3_u8 {
        let frame = depth_frame(120, 90, f64::from(step), step.into());
        by_pixels.replace_organised(&frame, 120).unwrap();
        by_points.replace(&frame).unwrap();
        alone.replace_organised(&frame, 120).unwrap();
        assert_eq!(alone.outline(), by_pixels.outline(), "threads change nothing");
        let measured: Vec<[f64; 3]> = frame.iter().copied().filter(|p| p[2].is_finite()).collect();
        let anew = MovingScan::new(&measured, &BuildOptions::default()).unwrap();
        let r = anew.sampling_radius();
        for k in 0..120_u32 {
            let near = measured[(k as usize * 977) % measured.len()];
            let away = unit_vector(rng).map(|c| c * (0.06 + 0.002 * f64::from(k)));
            let pose = rotation(rng).with_translation([0, 1, 2].map(|i| near[i] + away[i]));
            let mut found = Vec::new();
            for (scan, proven) in [&by_pixels, &by_points, &anew].into_iter().zip(&mut proven) {
                let plan = CollidePlan::new(&certified(), scan, &tool).unwrap();
                let answer = Pair::new(scan.at(&Pose::IDENTITY), tool.at(&pose)).collide(&plan, scratch);
                *proven += usize::from(matches!(
                    answer.verdict,
                    Verdict::Separated { evidence: Evidence::Certified, .. }
                ));
                found.push(answer.verdict.is_intersecting());
            }
            // The tool is a sphere: it is apart if its centre is further than its radius from all points.
            let centre = pose.translation();
            let sq = |p: &[f64; 3]| (0..3).map(|i| (p[i] - centre[i]).powi(2)).sum::<f64>();
            let distance = measured.iter().map(sq).fold(f64::INFINITY, f64::min).sqrt() - 0.1;
            if distance.abs() > 2.0 * r {
                assert_eq!(found, [distance < 0.0; 3], "step {step}, pose {k}: {distance}");
                seen[usize::from(distance < 0.0)] += 1;
            }
        }
    }
    assert!(seen.iter().all(|seen| *seen > 20), "{seen:?} poses apart and in contact");
    assert!(proven[0].min(proven[1]) * 10 > proven[2] * 9, "{proven:?} separations are certified");
}

#[test]
fn a_scan_whose_points_changed_places_is_prepared_anew() {
    let points = ball();
    let mut moving = MovingScan::new(&points, &BuildOptions::default()).unwrap();
    assert_ne!(points.len() % 271, 0, "271 is prime, so every point gets another place");
    let shuffled: Vec<_> = (0..points.len()).map(|i| points[i * 271 % points.len()]).collect();
    moving.renew(&shuffled).unwrap();
    let loose = moving.looseness();
    assert!(loose > 2.0, "a renewal keeps the order, so boxes are loose: {loose}");
    assert_eq!(moving.move_to(&shuffled).unwrap(), Renewal::Rebuilt);
    assert!((moving.looseness() - 1.0).abs() < 1e-6, "{}", moving.looseness());
}

#[test]
fn a_hint_of_an_earlier_frame_certifies_nothing() {
    let points = ball();
    let still = MovingScan::new(&points, &BuildOptions::default()).unwrap();
    let mut moving = MovingScan::new(&points, &BuildOptions::default()).unwrap();
    let scratch = &mut Scratch::default();
    let mut hint = PairHint::default();
    let away = Pose::from_translation([2.6, 0.0, 0.0]);
    let mut ask = |moving: &MovingScan, hint: &mut PairHint| {
        let plan = CollidePlan::new(&certified(), moving, &still).unwrap();
        // Twice, so that the second question continues from the first.
        let pair = Pair::new(moving.at(&Pose::IDENTITY), still.at(&away));
        pair.hinted(hint).collide(&plan, scratch);
        pair.hinted(hint).collide(&plan, scratch).verdict
    };
    let before = ask(&moving, &mut hint);
    assert!(
        matches!(before, Verdict::Separated { evidence: Evidence::Certified, .. }),
        "far apart at first: {before:?}"
    );
    // A bulge towards the other ball, which leaves the bounds of the first frame.
    let bulge = |height: f64| -> Vec<[f64; 3]> {
        let one = |[x, y, z]: &[f64; 3]| [x + height * (4.0 * (x - 1.0)).exp(), *y, *z];
        points.iter().map(one).collect()
    };
    moving.refit(&bulge(1.2)).unwrap();
    let met = ask(&moving, &mut hint);
    assert!(met.is_intersecting(), "the bulge is within the other ball: {met:?}");
    moving.refit(&bulge(0.1)).unwrap();
    assert!(ask(&moving, &mut hint).is_separated(), "they part again");
    // The other way round: a proof of one frame does not outlive it.
    for height in [1.2, 0.0, 0.9, 0.2] {
        moving.refit(&bulge(height)).unwrap();
        let (hinted, fresh) = (ask(&moving, &mut hint), ask(&moving, &mut PairHint::default()));
        assert_eq!(hinted.is_intersecting(), fresh.is_intersecting(), "height {height}");
        assert_eq!(hinted.is_separated(), fresh.is_separated(), "height {height}");
    }
}

#[test]
fn every_meaning_is_answered_for_a_moving_scan() {
    let points = ball();
    let mut moving = MovingScan::new(&points, &BuildOptions::default()).unwrap();
    let frame = deformed(&points, 1.0);
    moving.refit(&frame).unwrap();
    let scratch = &mut Scratch::default();
    for semantics in [Semantics::Obstacle, Semantics::Surface, Semantics::Thickened(0.02)] {
        let plan = CollidePlan::new(&certified().with_semantics(semantics), &moving, &moving).unwrap();
        for (away, meets) in [(1.5, true), (4.0, false)] {
            let pose = Pose::from_translation([away, 0.1, 0.0]);
            let verdict =
                Pair::new(moving.at(&Pose::IDENTITY), moving.at(&pose)).collide(&plan, scratch).verdict;
            assert_eq!(verdict.is_intersecting(), meets, "{semantics:?} at {away}: {verdict:?}");
            if let Verdict::Separated { gap, evidence } = verdict {
                assert_eq!(evidence, Evidence::Certified, "{semantics:?}");
                assert!(gap <= least(&frame, &frame, &pose), "{semantics:?}: {gap}");
            }
        }
    }
}

#[test]
fn a_frame_can_be_kept_and_passes_every_check_of_a_file() {
    let points = ball();
    let mut moving = MovingScan::new(&points, &BuildOptions::default()).unwrap();
    moving.refit(&deformed(&points, 0.7)).unwrap();
    let still = moving.still();
    let bounds = *still.bounds();
    moving.refit(&deformed(&points, 0.1)).unwrap();
    assert_eq!(*still.bounds(), bounds, "a later frame does not change it");
    let mut bytes = Vec::new();
    still.write_to(&mut bytes).unwrap();
    let read = Scan::from_bytes(bytes, Check::Full).unwrap();
    assert_eq!(read.outline(), still.outline(), "the frame as it was");
    assert!(moving.move_to(&vec![[1.0, 2.0, 3.0]; points.len()]).is_ok(), "all points in one place");
    assert_eq!(moving.bounds().min, moving.bounds().max);
}

#[test]
fn worlds_follow_a_scan_that_changes() {
    let points = ball();
    let mut world = World::new();
    let a = world.insert(MovingScan::new(&points, &BuildOptions::default()).unwrap(), &Pose::IDENTITY);
    // The box of a ball may lie in any direction, so its corners may be √3 away, and a little more.
    let away = Pose::from_translation([4.2, 0.0, 0.0]);
    let b = world.insert(MovingScan::new(&points, &BuildOptions::default()).unwrap(), &away);
    let mut pairs = Vec::new();
    world.near_pairs(Bodies::All, 0.1, &mut pairs);
    assert!(pairs.is_empty(), "far apart at first: {pairs:?}");
    let long: Vec<[f64; 3]> = points.iter().map(|[x, y, z]| [2.5 * x + 1.5, *y, *z]).collect();
    let moved = world.change(a, |body| match body {
        Body::Scan(scan) => Some(scan.move_to(&long)),
        Body::Mesh(_) | Body::Shape(_) => None,
    });
    assert!(
        moved.flatten().unwrap().is_ok_and(|renewal| renewal != Renewal::Refitted),
        "it stretched beyond the factor"
    );
    world.near_pairs(Bodies::These(&[a]), 0.1, &mut pairs);
    assert_eq!(pairs, [[a, b]], "now it reaches the other");
    let pair = world.pair([a, b]).unwrap();
    let [x, y] = [a, b].map(|id| world.placed(id).unwrap());
    let plan = CollidePlan::new(&CollideOptions::default(), x.scan(), y.scan()).unwrap();
    assert!(pair.collide(&plan, &mut Scratch::default()).verdict.is_intersecting(), "they meet");
}

#[test]
fn graphs_are_refused_and_other_scans_taken() {
    let points = ball();
    let cloud = PointCloud::from_positions(&points).unwrap();
    let scan = Scan::build(&cloud, &BuildOptions::default()).unwrap();
    let with_graph = scan.clone().with_graph(&cloud, &GraphOptions::default(), None).unwrap();
    let refused = MovingScan::try_from(with_graph).unwrap_err();
    assert_eq!(refused, DeformError::Graph);
    assert!(refused.to_string().contains("prepare the scan without a graph"), "{refused}");
    let mut moving = MovingScan::try_from(scan.clone()).unwrap();
    let frame = deformed(&points, 0.5);
    assert_eq!(moving.move_to(&frame), Ok(Renewal::Refitted));
    assert_eq!(scan.positions(), Scan::build(&cloud, &BuildOptions::default()).unwrap().positions());
    moving.renew(&frame).unwrap();
    assert!((moving.reach() - scan.reach()).abs() < 1e-9, "the reach of a prepared scan stays");
    moving.rebuild(&frame).unwrap();
    let anew = Scan::build(&PointCloud::from_positions(&frame).unwrap(), &BuildOptions::default()).unwrap();
    assert_eq!(moving.source(), anew.source(), "prepared anew");
    // A frame of other points, with holes.
    let mut other: Vec<[f64; 3]> = points[..600].to_vec();
    other[5] = [f64::NAN; 3];
    moving.replace(&other).unwrap();
    assert_eq!((moving.len(), moving.dropped().not_finite), (599, 1));
}
