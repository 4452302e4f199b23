//! Curves against exactly known ones: none missing, none invented, loops closed, ends at borders.
use crate::cut::{assert_whole, curves, draw, fine, hausdorff, nearest_true, scans, to_found, to_segment};
use nearmiss_geometry::{PointCloud, Pose};
use nearmiss_hierarchy::{BuildOptions, PointHierarchy};
use nearmiss_query::{
    Budget, CollideOptions, CollidePlan, Contacts, CurveEnd, CurveOptions, CurvePlan, Curves, Pair, Placed,
    PlanError, Scratch, Semantics,
};
use nearmiss_surface::meet;
use nearmiss_testdata::arbitrary;
use nearmiss_testdata::cuts;
use nearmiss_testdata::dragon::{Dragon, dragon_mesh};
use nearmiss_testdata::shapes::{Form, Order, Sampling, patch, sphere};
use rand::RngExt;

/// The greatest distance of a curve's end from the border, in sampling radii. f is defined until
/// the centroid is 0.56 h away, which depends on the positions of the points.
const AT_BORDERS: f64 = 0.75;

#[test]
fn clean_cuts_are_found_whole() {
    let mut cases = 0;
    for cut in cuts::clean() {
        for order in [Order::Regular, Order::Random] {
            // Random dart throwing is slow on large forms.
            if order == Order::Random && !cut.name.contains("sphere") {
                continue;
            }
            let sampling = Sampling { spacing: fine(&cut), noise: 0.0, order, seed: 3 };
            let [a, b] = scans(&cut, [sampling; 2]);
            let found = draw(
                &Placed::new(&a, &Pose::IDENTITY),
                &Placed::new(&b, &cut.pose_b),
                CurveOptions::default(),
            );
            let radii = [a.sampling_radius(), b.sampling_radius()];
            let r = radii[0].min(radii[1]);
            assert!(cut.curvature() * radii[0].max(radii[1]) < 0.021, "{}: H r is small", cut.name);
            let border = if cut.name.contains("bowl") || cut.name.contains("half sphere") {
                Some(CurveEnd::BorderOfA)
            } else {
                cut.name.contains("strip").then_some(CurveEnd::BorderOfB)
            };
            let allowed = if border.is_some() { AT_BORDERS } else { 0.05 };
            assert_whole(&found, &cut, &Pose::IDENTITY, radii, allowed);
            assert!(found.max_residual <= 1e-3 * r, "{}: {}", cut.name, found.max_residual / r);
            for curve in &found.curves {
                assert_eq!(curve.ends, border.map(|end| [end; 2]), "{}", cut.name);
                for [i, j] in curve.edges() {
                    let step = to_segment(found.points[i], found.points[j], found.points[j]);
                    assert!(step <= 2.0 * r * (1.0 + 1e-9), "{}: a step of {} r", cut.name, step / r);
                }
            }
            if border.is_some() {
                // Away from the ends, the curve is as exact as elsewhere.
                let mut inner = cut.clone();
                let ends = cut.curves.iter().flat_map(|c| [c.points[0], c.points[c.points.len() - 1]]);
                let ends: Vec<_> = ends.collect();
                let inside = |x: &[f64; 3]| ends.iter().all(|&end| to_segment(*x, end, end) > r);
                inner.curves.iter_mut().for_each(|curve| curve.points.retain(inside));
                let [_, missing] = hausdorff(&found, &inner, &Pose::IDENTITY, radii);
                assert!(missing < 0.05, "{}: {missing} r missing inside", cut.name);
            }
            cases += 1;
        }
    }
    assert_eq!(cases, 13);
}

#[test]
fn poses_swaps_and_densities_change_little() {
    let cut = cuts::spheres(1.0, 0.8, 1.1);
    let spacing = fine(&cut);
    let mut rng = arbitrary::rng(8);
    let densities = [[1.0, 1.0], [1.0, 2.5], [3.0, 1.0], [1.5, 1.5]].map(|[sa, sb]| {
        let sampling =
            |share: f64, seed| Sampling { spacing: share * spacing, noise: 0.0, order: Order::Random, seed };
        scans(&cut, [sampling(sa, 5), sampling(sb, 6)])
    });
    for (round, [a, b]) in densities.iter().cycle().take(6).enumerate() {
        let scale = [1.0, 0.01, 300.0][round % 3];
        let shift = [1.0, 1e3, 1e6, 0.0][round % 4] * scale;
        let world = arbitrary::rotation(&mut rng)
            .with_translation(arbitrary::point_in(&mut rng, shift))
            .with_scale(scale);
        let views = [Placed::new(a, &world), Placed::new(b, &world.after(&cut.pose_b))];
        let found = draw(&views[0], &views[1], CurveOptions::default());
        // The same shape in the frame of a.
        let mut home = found.clone();
        home.points.iter_mut().for_each(|p| *p = world.apply_inverse(*p));
        let radii = [a.sampling_radius(), b.sampling_radius()];
        let coarse = radii[0].max(radii[1]) / radii[0].min(radii[1]);
        // The bias comes from the coarser surface; errors are measured in the finer radius.
        assert_whole(&home, &cut, &Pose::IDENTITY, radii, 0.05 * coarse);
        let swapped = draw(&views[1], &views[0], CurveOptions::default());
        assert_eq!((swapped.curves.len(), swapped.closed()), (found.curves.len(), found.closed()));
        let r = radii[0].min(radii[1]) * scale;
        let apart = swapped.points.iter().map(|&p| to_found(p, &found)).fold(0.0, f64::max) / r;
        assert!(apart < 0.06, "swapped, {apart} r aside");
        assert!((swapped.length() / found.length() - 1.0).abs() < 1e-3, "as long");
    }
}

/// A step that ends just short of the start must close the loop, wherever the steps happen to end.
#[test]
fn circles_are_closed_in_every_pose_and_no_chord_is_walked_twice() {
    let mut rng = arbitrary::rng(12);
    let build = |form: Form, order, seed| {
        let points = form.sample(Sampling { spacing: 0.08, noise: 0.0, order, seed }).points;
        PointHierarchy::build(&PointCloud::from_positions(&points).unwrap(), &BuildOptions::default())
            .unwrap()
    };
    let ball = build(sphere(1.0), Order::Regular, 0);
    let plates: Vec<_> = (0..4).map(|seed| build(patch(3.2, 3.2), Order::Random, seed)).collect();
    let r = ball.sampling_radius();
    let (mut found, mut scratch) = (Curves::default(), Scratch::default());
    let mut short_edges = 0;
    for round in 0..6000 {
        let plate = &plates[round % plates.len()];
        let d: f64 = rng.random_range(0.0..0.85);
        let pose = arbitrary::rotation(&mut rng);
        // The plate's normal is its third axis.
        let pose = pose.with_translation(pose.rotate([0.0, 0.0, d]));
        let views = [Placed::new(&ball, &Pose::IDENTITY), Placed::new(plate, &pose)];
        let spacing = [None, Some(0.5 * r), Some(1.1 * r)][round % 3];
        let mut options = CurveOptions::default();
        options.spacing = spacing;
        let plan = CurvePlan::new(&options, &ball, plate).unwrap();
        Pair::new(views[0], views[1]).curves(&plan, &mut found, &mut scratch);
        assert_eq!(found.curves.len(), 1, "round {round}: {:?}", found.curves);
        assert_eq!(found.curves[0].ends, None, "round {round}: {:?}", found.curves);

        let radius = (1.0 - d * d).sqrt();
        let share = found.length() / (std::f64::consts::TAU * radius);
        // The bias of the circle's radius is that of the sphere's, about r²H/2, divided by the sine
        // of the angle.
        assert!((share - 1.0).abs() < 0.01 / (radius * radius), "round {round}: {share} of the circle");
        let angle = |i: usize| {
            let [x, y, _] = pose.apply_inverse(found.points[i]);
            y.atan2(x)
        };
        let mut turns = 0.0;
        for [i, j] in found.curves[0].edges() {
            let turn = (angle(j) - angle(i) + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU);
            turns += (turn - std::f64::consts::PI).abs();
            let step = to_segment(found.points[i], found.points[j], found.points[j]);
            assert!(
                step <= spacing.unwrap_or(2.0 * r) * (1.0 + 1e-9),
                "round {round}: a step of {} r",
                step / r
            );
            short_edges += usize::from(step < 1e-3 * r);
        }
        let turns = turns / std::f64::consts::TAU;
        assert!((turns - 1.0).abs() < 1e-3, "round {round}: {turns} times round");
    }
    assert!(short_edges < 6, "{short_edges} edges without length");
}

#[test]
fn spacing_and_tolerance_are_kept() {
    let cut = cuts::torus_and_upright(1.0, 0.5, 0.3);
    let sampling = Sampling { spacing: 2.0 * fine(&cut), noise: 0.0, order: Order::Random, seed: 3 };
    let [a, b] = scans(&cut, [sampling; 2]);
    let views = [Placed::new(&a, &Pose::IDENTITY), Placed::new(&b, &cut.pose_b)];
    let r = a.sampling_radius().min(b.sampling_radius());
    let mut counts = Vec::new();
    for (spacing, tolerance) in [(0.2, 1e-2), (1.0, 1e-4), (5.0, 1e-3), (100.0, 1e-3)] {
        let options = CurveOptions::default().with_spacing(spacing * r).with_tolerance(tolerance * r);
        let found = draw(&views[0], &views[1], options);
        assert!(found.max_residual <= tolerance * r, "{} r off for {tolerance}", found.max_residual / r);
        let edges = || found.curves.iter().flat_map(nearmiss_query::Curve::edges);
        let steps = edges().map(|[i, j]| to_segment(found.points[i], found.points[j], found.points[j]) / r);
        let longest = steps.fold(0.0, f64::max);
        assert!(longest <= spacing * (1.0 + 1e-9), "{longest} for {spacing}");
        assert_whole(&found, &cut, &Pose::IDENTITY, [a.sampling_radius(), b.sampling_radius()], 0.25);
        counts.push(found.points.len());
    }
    assert!(
        counts.windows(2).all(|w| w[0] >= w[1]) && counts[0] > 3 * counts[1],
        "fewer points further apart: {counts:?}"
    );
    for options in
        [CurveOptions::default().with_spacing(0.0), CurveOptions::default().with_tolerance(f64::NAN)]
    {
        assert!(matches!(CurvePlan::new(&options, &a, &b), Err(PlanError::CurveLength(_))));
    }
}

#[test]
fn a_figure_of_eight_is_followed_to_where_it_crosses_itself() {
    let cut = cuts::torus_and_upright(1.0, 0.5, 0.5);
    for (seed, share) in [(0, 1.0), (1, 0.93), (2, 1.1)] {
        let sampling = Sampling::clean(share * fine(&cut));
        let [a, b] = scans(&cut, [sampling; 2]);
        let found =
            draw(&Placed::new(&a, &Pose::IDENTITY), &Placed::new(&b, &cut.pose_b), CurveOptions::default());
        let r = a.sampling_radius();
        // Within a few radii of the crossing, a shift of h²H/2 changes the curves. Further away
        // they must agree.
        let crossing = [0.0, 0.5, 0.0];
        let near = |x: &[f64; 3]| to_segment(*x, crossing, crossing) < 6.0 * r;
        let mut away = cut.clone();
        away.curves.iter_mut().for_each(|curve| curve.points.retain(|x| !near(x)));
        let [_, missing] = hausdorff(&found, &away, &Pose::IDENTITY, [r, b.sampling_radius()]);
        assert!(missing < 0.05, "sampling {seed}: {missing} r missing");
        for &x in &found.points {
            let off = nearest_true(x, &cut).1 / r;
            assert!(off < if near(&x) { 1.5 } else { 0.3 }, "sampling {seed}: {x:?} is {off} r off");
        }
        for curve in &found.curves {
            for end in curve.ends.into_iter().flatten() {
                assert_eq!(end, CurveEnd::Tangent, "sampling {seed}: {:?}", found.curves);
            }
        }
        let longest =
            cut.curves.iter().flat_map(|c| &c.points).map(|&x| to_found(x, &found)).fold(0.0, f64::max);
        assert!(longest < 2.0 * r, "sampling {seed}: {} r missing at the crossing", longest / r);
    }
}

#[test]
fn surfaces_that_coincide_touch_in_points() {
    let points = sphere(1.0).sample(Sampling::clean(0.1)).points;
    let scan = PointHierarchy::build(&PointCloud::from_positions(&points).unwrap(), &BuildOptions::default())
        .unwrap();
    let view = Placed::new(&scan, &Pose::IDENTITY);
    let found = draw(&view, &view, CurveOptions::default());
    assert!(found.curves.len() > 50, "{}", found.curves.len());
    for curve in &found.curves {
        assert_eq!((curve.count, curve.ends), (1, Some([CurveEnd::Tangent; 2])));
    }
    let r = scan.sampling_radius();
    for (i, &p) in found.points.iter().enumerate() {
        let others = found.points[..i].iter().map(|&q| to_segment(p, q, q)).fold(f64::INFINITY, f64::min);
        assert!(others > 2.0 * r, "points keep their distance: {}", others / r);
    }
}

#[test]
fn noise_leaves_most_of_a_curve() {
    let cut = cuts::sphere_and_plane(1.0, 0.3);
    for (noise, allowed) in [(0.05, 0.2), (0.15, 0.5)] {
        let sampling = |seed| Sampling { spacing: 0.03, noise, order: Order::Random, seed };
        let [a, b] = scans(&cut, [sampling(1), sampling(2)]);
        let found =
            draw(&Placed::new(&a, &Pose::IDENTITY), &Placed::new(&b, &cut.pose_b), CurveOptions::default());
        let radii = [a.sampling_radius(), b.sampling_radius()];
        assert_whole(&found, &cut, &Pose::IDENTITY, radii, allowed);
    }
}

#[test]
fn a_budget_leaves_what_was_found() {
    let cut = cuts::torus_and_level(1.0, 0.6, 0.2);
    let [a, b] = scans(&cut, [Sampling::clean(0.03); 2]);
    let views = [Placed::new(&a, &Pose::IDENTITY), Placed::new(&b, &cut.pose_b)];
    let plan = CurvePlan::new(&CurveOptions::default(), &a, &b).unwrap();
    let whole = curves(Pair::new(views[0], views[1]), &plan);
    assert!(whole.complete && whole.curves.len() == 2, "{:?}", whole.curves);
    let units = |found: &Curves| found.statistics.evaluations + found.statistics.node_pairs;
    let (mut found, mut scratch) = (Curves::default(), Scratch::default());
    let mut partial = 0;
    for share in 0..=20 {
        // Finding the contacts takes most of the work.
        let work = units(&whole) - whole.statistics.evaluations * (20 - share) / 20 + share / 20;
        let budget = Budget::default().with_work(work);
        Pair::new(views[0], views[1]).within(&budget).curves(&plan, &mut found, &mut scratch);
        assert_eq!(found.complete, share == 20, "{share} twentieths of the work");
        assert!(units(&found) <= work + 4, "{} of {work} units", units(&found));
        assert_eq!(found, curves(Pair::new(views[0], views[1]).within(&budget), &plan), "the same twice");
        let cut_short =
            |c: &nearmiss_query::Curve| c.ends.is_some_and(|ends| ends.contains(&CurveEnd::Budget));
        assert!(found.curves.iter().all(|c| c.is_closed() || cut_short(c)), "{:?}", found.curves);
        for &p in &found.points {
            assert!(to_found(p, &whole) < 0.1 * a.sampling_radius(), "on the whole curve");
        }
        partial += usize::from(!found.complete && !found.points.is_empty());
    }
    assert!(partial > 5, "{partial} with some of the curve");
    assert_eq!(found, whole);
    let past = nearmiss_query::Deadline::within(std::time::Duration::ZERO);
    Pair::new(views[0], views[1]).within(&Budget::default().with_deadline(past)).curves(
        &plan,
        &mut found,
        &mut scratch,
    );
    assert!(!found.complete && found.points.is_empty());
    let nowhere = Placed::new(&b, &Pose::from_translation([f64::NAN; 3]));
    assert!(!curves(Pair::new(views[0], nowhere), &plan).complete, "no pose");
    let away = Placed::new(&b, &Pose::from_translation([0.0, 0.0, 9.0]));
    let none = curves(Pair::new(views[0], away), &plan);
    assert!(none.complete && none.curves.is_empty());
}

/// Newton's method from every crossing of discs by itself, without a trail.
#[test]
fn nothing_that_newton_finds_from_any_crossing_is_missing() {
    let points = dragon_mesh(Dragon::Points5k).unwrap().vertices().to_vec();
    let scan = PointHierarchy::build(&PointCloud::from_positions(&points).unwrap(), &BuildOptions::default())
        .unwrap();
    let size = scan.bounds().half_extents().into_iter().fold(0.0, f64::max);
    let r = scan.sampling_radius();
    let mut rng = arbitrary::rng(4);
    let (mut asked, mut ends) = (0, 0);
    for _ in 0..60 {
        let pose = arbitrary::rotation(&mut rng).with_translation(arbitrary::point_in(&mut rng, 0.8 * size));
        let views = [Placed::new(&scan, &Pose::IDENTITY), Placed::new(&scan, &pose)];
        let found = draw(&views[0], &views[1], CurveOptions::default());
        let surfaces = CollideOptions::estimated().with_semantics(Semantics::Surface);
        let plan = CollidePlan::new(&surfaces, &scan, &scan).unwrap();
        let mut contacts = Contacts::default();
        Pair::new(views[0], views[1]).contacts(&mut contacts).collide(&plan, &mut Scratch::default());
        let mut scratch = [Scratch::default(), Scratch::default()];
        let [of_a, of_b] = &mut scratch;
        for contact in &contacts.contacts {
            let meeting =
                meet(contact.point, |x| Some([views[0].evaluate(x, of_a), views[1].evaluate(x, of_b)]));
            let meeting = meeting.unwrap();
            if meeting.verified {
                let off = to_found(meeting.point, &found) / r;
                assert!(off < 2.1, "{:?}: {off} r from all curves", meeting.point);
                asked += 1;
            }
        }
        for &x in &found.points {
            let off = [views[0].evaluate(x, of_a), views[1].evaluate(x, of_b)].map(|at| at.f.abs());
            assert!(
                off[0].max(off[1]) <= found.max_residual * (1.0 + 1e-9),
                "{off:?} of {}",
                found.max_residual
            );
        }
        assert!(found.max_residual <= 1e-3 * r);
        ends += found.curves.iter().filter(|c| !c.is_closed()).count();
    }
    assert!(asked > 500, "{asked} places");
    assert!(ends < 400, "{ends} open curves");
}
