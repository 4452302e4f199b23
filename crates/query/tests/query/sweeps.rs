//! Sweeps against exact impact times, and against brute force on random motions.

use std::f64::consts::{PI, TAU};
use std::time::Duration;

use nearmiss_geometry::{Motion, PointCloud, Pose, Screw, TriangleMesh};
use nearmiss_hierarchy::{BuildOptions, MeshBuildOptions, MeshHierarchy, PointHierarchy};
use nearmiss_query::{
    Budget, CollideOptions, CollidePlan, Deadline, DistanceOptions, DistancePlan, MeshScanPair, MeshScanPlan,
    MeshScanSweep, Pair, PlacedMesh, PlanError, Prepared, Scratch, Semantics, Sweep, SweepAnswer,
    SweepOptions, SweepPlan, SweepReason, SweepVerdict,
};
use nearmiss_testdata::arbitrary::{self, CloudKind};
use rand::RngExt;

fn prepared(points: &[[f64; 3]]) -> PointHierarchy {
    PointHierarchy::build(&PointCloud::cleaned(points).unwrap(), &BuildOptions::default()).unwrap()
}

/// A sphere about the origin, on a Fibonacci spiral.
fn sphere(count: u32, radius: f64) -> PointHierarchy {
    let points: Vec<[f64; 3]> = (0..count)
        .map(|i| {
            let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(count);
            let (turn, level) = (f64::from(i) * PI * (3.0 - 5.0_f64.sqrt()), (1.0 - z * z).sqrt());
            [level * turn.cos(), level * turn.sin(), z].map(|x| radius * x)
        })
        .collect();
    prepared(&points)
}

/// A square plate in the plane of x and y about the origin.
fn plate(count: u32, half: f64) -> PointHierarchy {
    let at = |i: u32| (2.0 * f64::from(i) / f64::from(count - 1) - 1.0) * half;
    let points: Vec<_> = (0..count).flat_map(|i| (0..count).map(move |j| [at(i), at(j), 0.0])).collect();
    prepared(&points)
}

/// A round bar of radius 0.1 along x, from 0 to 4, with round ends.
fn bar() -> PointHierarchy {
    let ring = |x: f64, radius: f64, count: u32| {
        (0..count).map(move |j| {
            let turn = TAU * f64::from(j) / f64::from(count);
            [x, radius * turn.cos(), radius * turn.sin()]
        })
    };
    let side = (0..=160).flat_map(|i| ring(0.025 * f64::from(i), 0.1, 24));
    let ends = (1..5).flat_map(|i| {
        let (rise, level) = (PI / 2.0 * f64::from(i) / 5.0).sin_cos();
        ring(-0.1 * rise, 0.1 * level, 24 - 4 * i).chain(ring(4.0 + 0.1 * rise, 0.1 * level, 24 - 4 * i))
    });
    prepared(&side.chain(ends).collect::<Vec<_>>())
}

fn at(x: f64, y: f64, z: f64) -> Pose {
    Pose::from_translation([x, y, z])
}

fn through(poses: &[Pose]) -> Motion {
    Motion::through(poses).unwrap()
}

struct Question<'q> {
    scans: [&'q PointHierarchy; 2],
    motions: [&'q Motion; 2],
    options: SweepOptions,
}

impl<'q> Question<'q> {
    /// b moves, a stays.
    fn new(a: &'q PointHierarchy, b: &'q PointHierarchy, motions: [&'q Motion; 2]) -> Self {
        Self { scans: [a, b], motions, options: SweepOptions::default() }
    }

    fn with(self, options: SweepOptions) -> Self {
        Self { options, ..self }
    }

    fn within(&self, budget: &Budget, scratch: &mut Scratch) -> SweepAnswer {
        let Self { scans: [a, b], motions: [of_a, of_b], options } = self;
        let plan = SweepPlan::new(options, a, b).unwrap();
        Sweep::new(a.along(of_a), b.along(of_b)).within(budget).first_impact(&plan, scratch)
    }

    fn answer(&self) -> SweepAnswer {
        self.within(&Budget::UNLIMITED, &mut Scratch::default())
    }

    /// The greater sampling radius at scale 1.
    fn radius(&self) -> f64 {
        let [a, b] = self.scans;
        a.sampling_radius().max(b.sampling_radius())
    }

    /// The impact must be that at `time`. `speed` is that of the point that meets.
    fn meets(&self, time: f64, speed: f64, what: &str) -> SweepAnswer {
        let answer = self.answer();
        let SweepVerdict::Impact { t_free, t_hit, contact, .. } = answer.verdict else {
            panic!("{what}: {answer:?}");
        };
        let r = self.radius();
        assert!((t_hit - time).abs() * speed <= r, "{what}: hit at {t_hit}, expected {time}, r {r}");
        assert!(t_free < t_hit, "{what}: {answer:?}");
        assert!((t_hit - t_free) * speed <= 2.0 * r, "{what}: free to {t_free}, hit at {t_hit}, r {r}");
        assert!(t_free <= time + 0.1 * r / speed, "{what}: free to {t_free}, expected {time}");
        assert!(contact.point.iter().all(|x| x.is_finite()), "{what}: {contact:?}");
        assert!(answer.distances <= 12, "{what}: {answer:?}");
        self.check(&answer, 200, what);
        answer
    }

    /// Compares an answer with contact and distance queries at `steps` times.
    fn check(&self, answer: &SweepAnswer, steps: u32, what: &str) {
        let (end, clearance, upper) = match answer.verdict {
            SweepVerdict::Free { clearance, upper, .. } => (self.duration(), clearance, upper),
            SweepVerdict::Impact { t_free, t_hit, .. } => {
                assert!(t_free <= t_hit, "{what}: {answer:?}");
                (t_free, self.options.clearance, f64::INFINITY)
            }
            SweepVerdict::Undecided { t_free, .. } => (t_free, self.options.clearance, f64::INFINITY),
        };
        assert!(clearance >= self.options.clearance && clearance <= upper, "{what}: {answer:?}");
        let [a, b] = self.scans;
        let touching = CollideOptions::estimated()
            .with_semantics(self.options.semantics)
            .with_margin(self.options.clearance);
        let touching = CollidePlan::new(&touching, a, b).unwrap();
        let apart = DistanceOptions::default().with_semantics(self.options.semantics).with_relative(0.01);
        let apart = DistancePlan::new(&apart, a, b).unwrap();
        let mut scratch = Scratch::default();
        let mut least = f64::INFINITY;
        for step in 0..=steps {
            let time = self.duration() * f64::from(step) / f64::from(steps);
            if time >= end && !answer.verdict.is_free() {
                break;
            }
            let [pa, pb] = self.motions.map(|motion| motion.at(time));
            let pair = Pair::new(a.at(&pa), b.at(&pb));
            let met = pair.collide(&touching, &mut scratch).verdict;
            assert!(!met.is_intersecting(), "{what}: {met:?} at {time}, {answer:?}");
            let found = pair.distance(&apart, &mut scratch);
            least = least.min(found.upper);
            assert!(found.upper >= clearance, "{what}: {found:?} at {time}, {answer:?}");
        }
        if answer.verdict.is_free() {
            assert!(upper >= 0.99 * least - self.radius(), "{what}: nearest {least}, {answer:?}");
        }
    }

    fn duration(&self) -> f64 {
        self.motions[0].duration().max(self.motions[1].duration())
    }
}

#[test]
fn spheres_along_a_line_meet_when_their_centres_are_two_radii_apart() {
    let (a, b) = (sphere(4000, 1.0), sphere(1500, 0.5));
    let still = Motion::still(Pose::IDENTITY);
    let motion = through(&[at(5.0, 0.0, 0.0), at(-5.0, 0.0, 0.0)]);
    Question::new(&a, &b, [&still, &motion]).meets(0.35, 10.0, "head-on");
    // The same seen from b: a moves towards it.
    let [stays, moves] = [Motion::still(at(5.0, 0.0, 0.0)), through(&[Pose::IDENTITY, at(10.0, 0.0, 0.0)])];
    Question::new(&a, &b, [&moves, &stays]).meets(0.35, 10.0, "a moves");
    // Both move, and b turns about its way, which changes nothing.
    let halves = [through(&[Pose::IDENTITY, at(5.0, 0.0, 0.0)]), {
        let turned = Pose::from_axis_angle([1.0, 0.0, 0.0], 3.0);
        through(&[at(5.0, 0.0, 0.0), turned])
    }];
    Question::new(&a, &b, halves.each_ref()).meets(0.35, 10.0, "both move");
    // A path: first away, then past the other one, then into it.
    let path = [at(5.0, 0.0, 0.0), at(5.0, 4.0, 0.0), at(0.0, 4.0, 0.0), at(0.0, 0.0, 0.0)];
    Question::new(&a, &b, [&still, &through(&path)]).meets(2.0 + 2.5 / 4.0, 4.0, "a path");
    // Off centre: they meet when the distance of the centres is 1.5.
    let motion = through(&[at(5.0, 1.0, 0.0), at(-5.0, 1.0, 0.0)]);
    let exact = (5.0 - 1.25_f64.sqrt()) / 10.0;
    Question::new(&a, &b, [&still, &motion]).meets(exact, 10.0, "off centre");
    // With a clearance of 1 the centres may come to 2.5.
    let options = SweepOptions::default().with_clearance(1.0);
    let motion = through(&[at(5.0, 0.0, 0.0), at(-5.0, 0.0, 0.0)]);
    Question::new(&a, &b, [&still, &motion]).with(options).meets(0.25, 10.0, "a clearance");
    // In another unit and frame.
    let world =
        Pose::from_axis_angle([1.0, 1.0, 0.0], 0.7).with_scale(2.5).with_translation([9.0, 2.0, -3.0]);
    let [still, motion] = [
        Motion::still(world),
        through(&[at(5.0, 0.0, 0.0), at(-5.0, 0.0, 0.0)].map(|pose| world.after(&pose))),
    ];
    let answer = Question::new(&a, &b, [&still, &motion]).answer();
    let SweepVerdict::Impact { t_free, t_hit, .. } = answer.verdict else { panic!("{answer:?}") };
    assert!((t_hit - 0.35).abs() < 0.01 && t_free < t_hit && t_free > 0.33, "{answer:?}");
}

#[test]
fn a_turning_bar_hits_a_post_at_its_far_end() {
    let (bar, post) = (bar(), sphere(800, 0.3));
    let stays = Motion::still(at(0.0, 3.0, 0.0));
    // From the x axis by 120° about z; the bar reaches the post when its axis is 0.4 from the
    // post's centre.
    let turn = 120.0_f64.to_radians();
    let motion = through(&[Pose::IDENTITY, Pose::from_axis_angle([0.0, 0.0, 1.0], turn)]);
    let exact = (PI / 2.0 - (0.4_f64 / 3.0).asin()) / turn;
    Question::new(&post, &bar, [&stays, &motion]).meets(exact, 3.0 * turn, "a turning bar");
    // Five turns at once about its own end, tilted until the last: no pose in between is given.
    let lifted = Screw::new(at(0.0, 0.0, 4.0), [0.0, 0.0, 5.0 * TAU], [0.0, 0.0, -4.3]);
    let spun = Motion::of_screw(lifted);
    let question = Question::new(&post, &bar, [&stays, &spun]);
    let answer = question.answer();
    question.check(&answer, 2000, "five turns");
    let SweepVerdict::Impact { t_free, t_hit, .. } = answer.verdict else { panic!("{answer:?}") };
    // The bar passes the post at a height of 0.35 in the fifth turn, and of 1.2 in the fourth.
    assert!(t_free > 0.84 && t_free < t_hit && t_hit < 0.852, "{answer:?}");
    // Turning in place above the post, it is free by the height less both radii.
    let spun = Motion::of_screw(Screw::new(at(0.0, 0.0, 1.4), [0.0, 0.0, 5.0 * TAU], [0.0; 3]));
    let question = Question::new(&post, &bar, [&stays, &spun]);
    let answer = question.answer();
    question.check(&answer, 500, "above");
    let SweepVerdict::Free { clearance, upper, .. } = answer.verdict else { panic!("{answer:?}") };
    assert!(clearance > 0.8 && clearance <= 1.0 && (1.0..1.4).contains(&upper), "{answer:?}");
}

#[test]
fn nothing_passes_through_a_thin_plate() {
    let (plate, ball) = (plate(60, 1.0), sphere(300, 0.05));
    let still = Motion::still(Pose::IDENTITY);
    let motion = through(&[at(0.3, 0.2, 50.0), at(0.3, 0.2, -50.0)]);
    let question = Question::new(&plate, &ball, [&still, &motion]);
    question.meets(0.4995, 100.0, "fast through a plate");
    // Nor does what is much smaller than the spacing.
    let dust = sphere(300, 0.001);
    let falls = through(&[at(0.31, 0.2, 0.5), at(0.3, 0.2, -0.5)]);
    let question = Question::new(&plate, &dust, [&still, &falls]);
    question.meets(0.5, 1.0, "dust through a plate");
    // Past the border of the plate nothing is hit.
    let past = through(&[at(1.3, 0.2, 50.0), at(1.3, 0.2, -50.0)]);
    let question = Question::new(&plate, &ball, [&still, &past]);
    let answer = question.answer();
    assert!(answer.verdict.is_free(), "{answer:?}");
    question.check(&answer, 4000, "past the border");
}

#[test]
fn motions_that_stay_six_spacings_clear_are_free() {
    let rng = &mut arbitrary::rng(2401);
    let (a, b) = (sphere(3000, 1.0), bar());
    let r = a.sampling_radius().max(b.sampling_radius());
    let still = Motion::still(Pose::IDENTITY);
    let (mut free, mut asked, mut distances) = (0, 0, 0);
    let mut scratch = Scratch::default();
    while asked < 60 {
        let poses: Vec<Pose> = (0..3)
            .map(|_| {
                let way = arbitrary::unit_vector(rng).map(|x| x * rng.random_range(1.3..5.0));
                arbitrary::rotation(rng).with_translation(way)
            })
            .collect();
        let motion = through(&poses);
        let question = Question::new(&a, &b, [&still, &motion]);
        let plan = DistancePlan::new(&DistanceOptions::default(), &a, &b).unwrap();
        let is_clear = (0..=100).all(|step| {
            let pose = motion.at(0.02 * f64::from(step));
            let pair = Pair::new(a.at(&Pose::IDENTITY), b.at(&pose));
            pair.distance(&plan, &mut scratch).upper > 6.5 * r
        });
        if !is_clear {
            continue;
        }
        asked += 1;
        let answer = question.within(&Budget::UNLIMITED, &mut scratch);
        free += u32::from(answer.verdict.is_free());
        distances += answer.distances;
        question.check(&answer, 100, "clear");
    }
    assert!(free >= 57, "{free} of {asked} are free");
    assert!(distances <= 8 * asked, "{distances} distance queries for {asked} motions");
}

#[test]
fn brute_force_finds_no_hit_in_a_free_part_of_random_motions() {
    let rng = &mut arbitrary::rng(2402);
    let mut verdicts = [0; 3];
    for (n, kind) in (0_u64..).zip(CloudKind::ALL.iter().cycle().take(40)) {
        let a = prepared(&arbitrary::cloud(*kind, 400, n));
        let b = prepared(&arbitrary::cloud(*kind, [300, 60][(n % 2) as usize], n + 100));
        let size = a.bounds().half_extents().into_iter().fold(0.0, f64::max);
        let semantics =
            [Semantics::Obstacle, Semantics::Surface, Semantics::Thickened(0.05 * size)][(n % 3) as usize];
        let options = SweepOptions::default().with_semantics(semantics);
        let options = options.with_clearance([0.0, 0.1 * size][(n / 3 % 2) as usize]);
        let mut pose = |scale: f64| {
            let way = arbitrary::unit_vector(rng).map(|x| x * 3.5 * size);
            arbitrary::rotation(rng).with_scale(scale).with_translation(way)
        };
        let motions = match n % 4 {
            0 => [Motion::still(Pose::IDENTITY), through(&[pose(1.0), pose(1.0), pose(1.0)])],
            1 => [through(&[pose(0.5), pose(0.5)]), through(&[pose(2.0), pose(2.0)])],
            2 => [through(&[pose(1.0), pose(1.0)]), Motion::still(Pose::IDENTITY)],
            _ => {
                let [x, y, z] = pose(1.0).translation();
                let screw = Screw::new(pose(1.0), [0.0, 9.0, 2.0], [x, y, z]);
                [Motion::still(Pose::IDENTITY), Motion::of_screw(screw)]
            }
        };
        let question = Question::new(&a, &b, motions.each_ref()).with(options);
        let answer = question.answer();
        question.check(&answer, 200, &format!("{kind:?} {n}"));
        verdicts[match answer.verdict {
            SweepVerdict::Free { .. } => 0,
            SweepVerdict::Impact { .. } => 1,
            SweepVerdict::Undecided { .. } => 2,
        }] += 1;
    }
    assert!(verdicts[0] >= 5 && verdicts[1] >= 5, "{verdicts:?}");
}

#[test]
fn degenerate_motions_have_an_answer() {
    let (a, b) = (sphere(1000, 1.0), sphere(500, 0.5));
    let still = Motion::still(Pose::IDENTITY);
    let ask = |motion: &Motion| Question::new(&a, &b, [&still, motion]).answer().verdict;
    for (apart, what) in [
        (Motion::still(at(3.0, 0.0, 0.0)), "one pose"),
        (through(&[at(3.0, 0.0, 0.0); 2]), "coincident poses"),
        (through(&[at(3.0, 0.0, 0.0); 4]), "many coincident poses"),
    ] {
        let verdict = ask(&apart);
        assert!(verdict.is_free(), "{what}: {verdict:?}");
    }
    for touching in [Motion::still(at(1.2, 0.0, 0.0)), through(&[at(1.2, 0.0, 0.0), at(5.0, 0.0, 0.0)])] {
        let verdict = ask(&touching);
        assert!(
            matches!(verdict, SweepVerdict::Impact { t_free: 0.0, t_hit: 0.0, .. }),
            "touching at the start: {verdict:?}"
        );
    }
    let invalid = Motion::of_screw(Screw::new(at(3.0, 0.0, 0.0), [f64::NAN, 0.0, 0.0], [0.0; 3]));
    let verdict = ask(&invalid);
    assert!(matches!(verdict, SweepVerdict::Undecided { reason: SweepReason::Pose, .. }), "{verdict:?}");
    let stretched = Motion::still(Pose::IDENTITY.with_scale(f64::NAN));
    let verdict = ask(&stretched);
    assert!(
        matches!(verdict, SweepVerdict::Undecided { reason: SweepReason::Pose, t_free: 0.0 }),
        "{verdict:?}"
    );
    // Nearer than the enclosures can tell apart, for ever.
    let r = a.sampling_radius().max(b.sampling_radius());
    let close = ask(&through(&[at(1.5 + 0.3 * r, 0.0, 0.0); 2]));
    assert!(!close.is_free(), "{close:?}");
    // Two things that move together do not move.
    let turn = Pose::from_axis_angle([0.0, 1.0, 1.0], 2.0).with_translation([100.0, 0.0, 3.0]);
    let beside = at(2.2, 0.0, 0.0);
    let together = [through(&[Pose::IDENTITY, turn]), through(&[beside, turn.after(&beside)])];
    let question = Question::new(&a, &b, together.each_ref());
    let answer = question.answer();
    assert!(answer.verdict.is_free() && answer.intervals < 20, "{answer:?}");
    question.check(&answer, 50, "together");
    let refused = SweepPlan::new(&SweepOptions::default().with_clearance(f64::NAN), &a, &b);
    assert!(matches!(refused, Err(PlanError::Margin(_))), "{refused:?}");
}

#[test]
fn budgets_end_a_sweep_with_what_is_proven() {
    let (a, b) = (sphere(2000, 1.0), sphere(800, 0.5));
    let still = Motion::still(Pose::IDENTITY);
    let motion = through(&[at(9.0, 0.2, 0.0), at(2.0, 0.2, 0.0), at(-3.0, 0.2, 0.0)]);
    let question = Question::new(&a, &b, [&still, &motion]);
    let mut scratch = Scratch::default();
    let whole = question.within(&Budget::UNLIMITED, &mut scratch);
    assert!(whole.verdict.is_impact(), "{whole:?}");
    let times = |verdict: &SweepVerdict| match *verdict {
        SweepVerdict::Impact { t_free, t_hit, .. } => Some([t_free, t_hit]),
        _ => None,
    };
    let (mut last, mut cut) = (0.0, 0);
    for work in [0, 100, 500, 1000, 2000, 4000, 8000, 1_000_000] {
        let budget = Budget::UNLIMITED.with_work(work);
        let answer = question.within(&budget, &mut scratch);
        let again = question.within(&budget, &mut Scratch::default());
        assert_eq!(answer, again, "a scratch never changes an answer");
        question.check(&answer, 100, "within a budget");
        match answer.verdict {
            SweepVerdict::Undecided { t_free, reason: SweepReason::Budget } => {
                cut += 1;
                last = t_free;
            }
            // With a budget nodes are visited in another order, so the contact may be another one.
            verdict => assert_eq!(times(&verdict), times(&whole.verdict), "a budget that suffices"),
        }
    }
    assert!((2..8).contains(&cut) && last > 0.0, "{cut} sweeps were cut, the last at {last}");
    // A contact at the start is found first. Its proof of contact alone takes some 50 units.
    let touching = through(&[at(1.2, 0.0, 0.0), at(-3.0, 0.2, 0.0)]);
    let answer =
        Question::new(&a, &b, [&still, &touching]).within(&Budget::UNLIMITED.with_work(100), &mut scratch);
    assert_eq!(times(&answer.verdict), Some([0.0, 0.0]), "{answer:?}");
    assert!(answer.band > 0.0 && answer.band < 1.0, "{answer:?}");
    let late = Budget::UNLIMITED.with_deadline(Deadline::within(Duration::ZERO));
    let answer = question.within(&late, &mut scratch);
    assert!(
        matches!(answer.verdict, SweepVerdict::Undecided { reason: SweepReason::Budget, .. }),
        "{answer:?}"
    );
}

#[test]
fn a_mesh_meets_a_scan_when_it_should() {
    let scan = sphere(3000, 1.0);
    let corners = vec![[-3.0, -3.0, 0.0], [3.0, -3.0, 0.0], [3.0, 3.0, 0.0], [-3.0, 3.0, 0.0]];
    let plate = TriangleMesh::new(corners, vec![[0, 1, 2], [0, 2, 3]]).unwrap();
    let plate = MeshHierarchy::build(&plate, &MeshBuildOptions::default()).unwrap();
    let still = Motion::still(Pose::IDENTITY);
    let mut scratch = Scratch::default();
    let falls = through(&[at(0.2, 0.1, 4.0), at(0.2, 0.1, -4.0)]);
    // Tilts about an axis 2 above the centre; touches when it is 1 from the centre, at 60°.
    let tilts = through(&[
        at(0.0, 0.0, 2.0),
        Pose::from_axis_angle([0.0, 1.0, 0.0], 1.2).with_translation([0.0, 0.0, 2.0]),
    ]);
    let slides = through(&[at(-50.0, 0.0, 1.4), at(50.0, 0.0, 1.4)]);
    let r = scan.sampling_radius();
    for (semantics, motion, expected) in [
        (Semantics::Obstacle, &falls, Some(0.375)),
        (Semantics::Surface, &falls, Some(0.375)),
        (Semantics::Thickened(0.2), &falls, Some(0.35)),
        (Semantics::Obstacle, &tilts, Some(PI / 3.0 / 1.2)),
        (Semantics::Obstacle, &slides, None),
    ] {
        let options = SweepOptions::default().with_semantics(semantics);
        let plan = SweepPlan::against_mesh(&options, &scan).unwrap();
        let sweep = MeshScanSweep::new(scan.along(&still), &plate, motion);
        let answer = sweep.first_impact(&plan, &mut scratch);
        let touching = CollideOptions::estimated().with_semantics(semantics);
        let touching = MeshScanPlan::new(&touching, &scan).unwrap();
        let mut check = |end: f64| {
            for step in 0..300 {
                let time = end * f64::from(step) / 300.0;
                let pair =
                    MeshScanPair::new(scan.at(&Pose::IDENTITY), PlacedMesh::new(&plate, &motion.at(time)));
                let met = pair.collide(&touching, &mut scratch).verdict;
                assert!(!met.is_intersecting(), "{semantics:?}: {met:?} at {time}, {answer:?}");
            }
        };
        match (answer.verdict, expected) {
            (SweepVerdict::Free { clearance, upper, .. }, None) => {
                check(1.0);
                assert!(clearance > 0.1 && upper < 0.5 && answer.intervals < 400, "{answer:?}");
            }
            (SweepVerdict::Impact { t_free, t_hit, .. }, Some(expected)) => {
                check(t_free);
                let speed = if motion == &falls { 8.0 } else { 1.2 * 3.0_f64.sqrt() };
                assert!((t_hit - expected).abs() * speed < r, "{semantics:?}: {answer:?}, not {expected}");
                assert!((t_hit - t_free) * speed < 3.0 * r, "{semantics:?}: {answer:?}");
            }
            (verdict, expected) => panic!("{semantics:?}: {verdict:?}, not {expected:?}"),
        }
    }
}
