//! Curves of intersecting tori, complete; and of surfaces that graze or nearly coincide. For the
//! latter the tests assert that the search ends, invents nothing and reports where it could not
//! continue.
use crate::cut::{assert_whole, draw, fine, scans, to_found, to_segment};
use nearmiss_geometry::{PointCloud, Pose};
use nearmiss_hierarchy::{BuildOptions, PointHierarchy};
use nearmiss_query::{CurveEnd, CurveOptions, Curves, Placed};
use nearmiss_testdata::arbitrary;
use nearmiss_testdata::cuts;
use nearmiss_testdata::dragon::{Dragon, dragon_mesh};
use nearmiss_testdata::shapes::{Form, Sampling, patch, sphere};

#[test]
fn tori_through_each_other_are_found_whole() {
    let mut loops = Vec::new();
    for cut in cuts::crossing_tori() {
        let [a, b] = scans(&cut, [Sampling::clean(fine(&cut)); 2]);
        let radii = [a.sampling_radius(), b.sampling_radius()];
        assert!(cut.curvature() * radii[0].max(radii[1]) < 0.021, "{}: H r is small", cut.name);
        let views = [Placed::new(&a, &Pose::IDENTITY), Placed::new(&b, &cut.pose_b)];
        let found = draw(&views[0], &views[1], CurveOptions::default());
        assert_whole(&found, &cut, &Pose::IDENTITY, radii, 0.05);
        assert!(found.max_residual <= 1e-3 * radii[0].min(radii[1]), "{}: {}", cut.name, found.max_residual);
        loops.push(found.closed());
    }
    assert_eq!(loops, [4, 4, 2, 2]);
}

fn prepared(form: &Form, spacing: f64, keep: impl Fn(&[f64; 3]) -> bool) -> PointHierarchy {
    let points: Vec<_> =
        form.clone().sample(Sampling::clean(spacing)).points.into_iter().filter(keep).collect();
    PointHierarchy::build(&PointCloud::from_positions(&points).unwrap(), &BuildOptions::default()).unwrap()
}

/// Returns `true` if every end is reported as a tangency.
fn ends_touch(found: &Curves) -> bool {
    found.curves.iter().all(|curve| curve.ends.is_none_or(|ends| ends == [CurveEnd::Tangent; 2]))
}

#[test]
fn a_ball_that_grazes_leaves_a_loop_or_a_point_or_nothing() {
    const SPACING: f64 = 0.02;
    let ball = prepared(&sphere(1.0), SPACING, |x| x[2] > 0.7);
    let above = prepared(&sphere(1.0), SPACING, |x| x[2] < -0.7);
    let plane = prepared(&patch(1.4, 1.4), SPACING, |_| true);
    let r = ball.sampling_radius();
    // The zero sets of balls are h²H/2 inside.
    let radius = 1.0 - 0.5 * (0.99 * r).powi(2);
    let view = Placed::new(&ball, &Pose::IDENTITY);
    for other in [&plane, &above] {
        let is_plane = std::ptr::eq(other, &raw const plane);
        // The curves at this penetration depth, with the centre and the radius of the true circle.
        let drawn = |depth: f64| {
            let (pose, height) = if is_plane {
                (radius - depth, radius - depth)
            } else {
                (2.0 * radius - depth, radius - 0.5 * depth)
            };
            let pose = Pose::from_translation([0.0, 0.0, pose]);
            let found = draw(&view, &Placed::new(other, &pose), CurveOptions::default());
            assert!(found.max_residual <= 1e-3 * r, "{} r off", found.max_residual / r);
            (found, [0.0, 0.0, height], (radius * radius - height * height).max(0.0).sqrt())
        };
        let (found, centre, rho) = drawn(0.8 * r);
        assert_eq!((found.curves.len(), found.closed()), (1, 1), "a loop: {:?}", found.curves);
        for &x in &found.points {
            let off = (to_segment(x, centre, centre) - rho).abs() / r;
            assert!(off < 0.2, "{off} r from the circle");
        }
        // Smaller than a step, or shallower than the tolerance: a loop or points, none far from the
        // tangency.
        for depth in [0.2, 0.1, 0.05, 0.02, 0.01, 2e-3, 0.0, -2e-3] {
            let (found, centre, rho) = drawn(depth * r);
            assert!(ends_touch(&found), "{depth} r deep: {:?}", found.curves);
            assert!(found.curves.len() <= 3, "{depth} r deep: {:?}", found.curves);
            for &x in &found.points {
                let off = (to_segment(x, centre, centre) - rho).max(0.0) / r;
                assert!(off < 1.0, "{depth} r deep: {off} r outside the circle");
            }
            assert!(depth > -1e-3 || found.points.len() <= 2, "{depth} r deep: {}", found.points.len());
            assert!(found.statistics.evaluations < 2000, "{depth} r deep: {:?}", found.statistics);
        }
        let (none, ..) = drawn(-0.1 * r);
        assert!(none.complete && none.curves.is_empty(), "apart: {:?}", none.curves);
    }
}

#[test]
fn sheets_that_are_nearly_parallel_cross_in_a_line_or_touch_in_points() {
    const SPACING: f64 = 0.02;
    let sheet = prepared(&patch(1.0, 1.0), SPACING, |_| true);
    let r = sheet.sampling_radius();
    let view = Placed::new(&sheet, &Pose::IDENTITY);
    let drawn = |angle: f64, height: f64| {
        let pose = Pose::from_axis_angle([1.0, 0.0, 0.0], angle).with_translation([0.0, 0.0, height]);
        draw(&view, &Placed::new(&sheet, &pose), CurveOptions::default())
    };
    for angle in [0.3, 0.1, 0.05, 0.02] {
        let found = drawn(angle, 0.0);
        assert_eq!(found.curves.len(), 1, "{angle}: {:?}", found.curves);
        let ends = found.curves[0].ends.unwrap();
        let is_border = |end| matches!(end, CurveEnd::BorderOfA | CurveEnd::BorderOfB);
        assert!(ends.into_iter().all(is_border), "{angle}: {ends:?}");
        assert!((found.length() - 1.0).abs() < 1.5 * r, "{angle}: {} long", found.length());
        let aside = found.points.iter().map(|x| x[1].abs()).fold(0.0, f64::max) / r;
        assert!(aside < 0.15, "{angle}: {aside} r aside");
    }
    // Below half a degree the surfaces count as tangent: points a step apart along the line.
    for angle in [5e-3, 1e-3] {
        let found = drawn(angle, 0.0);
        assert!(!found.curves.is_empty(), "{angle}");
        assert!(found.curves.iter().all(|curve| curve.count == 1) && ends_touch(&found), "{angle}");
        for (i, &x) in found.points.iter().enumerate() {
            assert!(x[1].abs() < 1e-3 * r / angle + r, "{angle}: {} r aside", x[1] / r);
            assert!(found.points[..i].iter().all(|&y| to_segment(x, y, y) > 2.0 * r), "{angle}: apart");
        }
    }
    let none = drawn(0.0, 0.1 * r);
    assert!(none.complete && none.curves.is_empty(), "{:?}", none.curves);
}

#[test]
fn chords_keep_to_what_shorter_ones_show() {
    let points = dragon_mesh(Dragon::Points5k).unwrap().vertices().to_vec();
    let scan = PointHierarchy::build(&PointCloud::from_positions(&points).unwrap(), &BuildOptions::default())
        .unwrap();
    let r = scan.sampling_radius();
    let size = scan.bounds().half_extents().into_iter().fold(0.0, f64::max);
    let mut rng = arbitrary::rng(7);
    let mut off = Vec::new();
    for _ in 0..40 {
        let pose = arbitrary::rotation(&mut rng).with_translation(arbitrary::point_in(&mut rng, 0.5 * size));
        let views = [Placed::new(&scan, &Pose::IDENTITY), Placed::new(&scan, &pose)];
        let found = draw(&views[0], &views[1], CurveOptions::default());
        let fine = draw(&views[0], &views[1], CurveOptions::default().with_spacing(0.2 * r));
        for [i, j] in found.curves.iter().flat_map(nearmiss_query::Curve::edges) {
            let middle = [0, 1, 2].map(|k| 0.5 * (found.points[i][k] + found.points[j][k]));
            off.push(to_found(middle, &fine) / r);
        }
    }
    off.sort_by(f64::total_cmp);
    // 1/40 of two sampling radii, plus the excess of a surface that is rougher than an arc, which
    // is greatest where the surface turns within a step.
    let [most, nearly_all] = [off[off.len() - 1], off[off.len() * 99 / 100]];
    assert!(off.len() > 500, "{} chords", off.len());
    assert!(nearly_all < 0.065 && most < 0.2, "{nearly_all} r off, {most} at most");
}
