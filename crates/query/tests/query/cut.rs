//! Comparison of computed curves with the true ones.

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_geometry::{PointCloud, Pose};
use nearmiss_hierarchy::{BuildOptions, PointHierarchy};
use nearmiss_query::{CurveOptions, CurvePlan, Curves, Pair, Placed, Scratch};
use nearmiss_testdata::cuts::Cut;
use nearmiss_testdata::shapes::{Form, Sampling};

/// The curves of a pair.
pub(crate) fn curves(pair: Pair<'_>, plan: &CurvePlan) -> Curves {
    let mut found = Curves::default();
    pair.curves(plan, &mut found, &mut Scratch::default());
    found
}

/// Samples of `form` near enough to the other surface to affect the curve.
pub(crate) fn prepared(form: &Form, sampling: Sampling, other: impl Fn([f64; 3]) -> f64) -> PointHierarchy {
    let shape = form.clone().sample(sampling);
    let near: Vec<_> = shape.points.into_iter().filter(|&p| other(p) < 14.0 * sampling.spacing).collect();
    PointHierarchy::build(&PointCloud::from_positions(&near).unwrap(), &BuildOptions::default()).unwrap()
}

/// Both scans of a cut.
pub(crate) fn scans(cut: &Cut, samplings: [Sampling; 2]) -> [PointHierarchy; 2] {
    let of_b = |x: [f64; 3]| cut.b.distance(cut.pose_b.apply_inverse(x));
    let of_a = |x: [f64; 3]| cut.a.distance(cut.pose_b.apply(x));
    [prepared(&cut.a, samplings[0], of_b), prepared(&cut.b, samplings[1], of_a)]
}

pub(crate) fn draw(a: &Placed<'_>, b: &Placed<'_>, options: CurveOptions) -> Curves {
    let plan = CurvePlan::new(&options, a.scan(), b.scan()).unwrap();
    let found = curves(Pair::new(*a, *b), &plan);
    assert!(found.complete, "without a budget");
    found
}

/// The distance from `x` to the segment from `p` to `q`.
pub(crate) fn to_segment(x: [f64; 3], p: [f64; 3], q: [f64; 3]) -> f64 {
    let [x, p, q] = [x, p, q].map(Vector3::from);
    let d = q - p;
    let share = if d.norm() > 0.0 { ((x - p).dot(&d) / d.norm_squared()).clamp(0.0, 1.0) } else { 0.0 };
    (x - p - d * share).norm()
}

/// The distance from `x` to the computed curves.
pub(crate) fn to_found(x: [f64; 3], found: &Curves) -> f64 {
    let at = |i: usize| found.points[i];
    let edges = found.curves.iter().flat_map(|c| c.edges().chain([[c.first; 2]]));
    edges.map(|[i, j]| to_segment(x, at(i), at(j))).fold(f64::INFINITY, f64::min)
}

/// The point of the true curves nearest to `x`, and its distance.
pub(crate) fn nearest_true(x: [f64; 3], cut: &Cut) -> ([f64; 3], f64) {
    let all = cut.curves.iter().flat_map(|curve| {
        let n = curve.points.len();
        let steps = if curve.closed { n } else { n - 1 };
        (0..steps).map(move |i| [curve.points[i], curve.points[(i + 1) % n]])
    });
    let off = |[p, q]: [[f64; 3]; 2]| (p, to_segment(x, p, q));
    all.map(off).min_by(|a, b| a.1.total_cmp(&b.1)).unwrap()
}

/// The greatest distances of computed points from true curves and of true points from computed
/// curves, in the lesser sampling radius, minus the bias of the surfaces there; h is at most the
/// sampling radius. `world` is the pose of a.
pub(crate) fn hausdorff(found: &Curves, cut: &Cut, world: &Pose, radii: [f64; 2]) -> [f64; 2] {
    let r = radii[0].min(radii[1]);
    let h = radii[0].max(radii[1]);
    let excess = |off: f64, x: [f64; 3]| (off - cut.aside(x) * h * h) / r;
    let mut made_up = f64::NEG_INFINITY;
    for [i, j] in found.curves.iter().flat_map(|c| c.edges().chain([[c.first; 2]])) {
        let middle = [0, 1, 2].map(|k| 0.5 * (found.points[i][k] + found.points[j][k]));
        for x in [found.points[i], middle] {
            let (place, off) = nearest_true(world.apply_inverse(x), cut);
            made_up = made_up.max(excess(off, place));
        }
    }
    let truth = cut.curves.iter().flat_map(|curve| curve.points.iter().step_by(5));
    let missing = truth.map(|&x| excess(to_found(world.apply(x), found), x));
    [made_up, missing.fold(f64::NEG_INFINITY, f64::max)]
}

/// A spacing with H·r ≤ 0.02, as a sampling radius is at most about 1.6 spacings.
pub(crate) fn fine(cut: &Cut) -> f64 {
    0.02 / 1.6 / cut.curvature()
}

/// Asserts that the computed curves are those of `cut`, within `allowed` sampling radii.
pub(crate) fn assert_whole(found: &Curves, cut: &Cut, world: &Pose, radii: [f64; 2], allowed: f64) {
    let [made_up, missing] = hausdorff(found, cut, world, radii);
    let name = cut.name;
    assert!(made_up <= allowed, "{name}: {made_up} r made up");
    assert!(missing <= allowed, "{name}: {missing} r missing");
    assert_eq!(found.curves.len(), cut.curves.len(), "{name}: {:?}", found.curves);
    assert_eq!(found.closed(), cut.curves.iter().filter(|c| c.closed).count(), "{name}: {:?}", found.curves);
}
