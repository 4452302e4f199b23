//! Curves against those known exactly: nothing missing, nothing made up, loops closed, ends at borders.
#![expect(clippy::unwrap_used, reason = "a test may panic")]

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_geometry::{PointCloud, Pose};
use nearmiss_hierarchy::{BuildOptions, PointHierarchy};
use nearmiss_query::{Budget, CurveOptions, CurvePlan, Curves, End, ScanView, curves};
use nearmiss_testdata::arbitrary;
use nearmiss_testdata::cuts::{self, Cut};
use nearmiss_testdata::shapes::{Form, Order, Sampling};

/// Samples of `form` near enough to the other surface to matter to the curve.
fn prepared(form: &Form, sampling: Sampling, other: impl Fn([f64; 3]) -> f64) -> PointHierarchy {
    let shape = form.clone().sample(sampling);
    let near: Vec<_> = shape.points.into_iter().filter(|&p| other(p) < 14.0 * sampling.spacing).collect();
    PointHierarchy::build(&PointCloud::from_positions(&near).unwrap(), &BuildOptions::default()).unwrap()
}

/// Both scans of a cut.
fn scans(cut: &Cut, samplings: [Sampling; 2]) -> [PointHierarchy; 2] {
    let of_b = |x: [f64; 3]| cut.b.distance(cut.pose_b.apply_inverse(x));
    let of_a = |x: [f64; 3]| cut.a.distance(cut.pose_b.apply(x));
    [prepared(&cut.a, samplings[0], of_b), prepared(&cut.b, samplings[1], of_a)]
}

fn draw(a: &ScanView<'_>, b: &ScanView<'_>, options: CurveOptions) -> Curves {
    let plan = CurvePlan::new(&options, a.scan(), b.scan()).unwrap();
    let found = curves(a, b, &plan, &Budget::UNLIMITED);
    assert!(found.complete, "without a budget");
    found
}

/// Distance from `x` to the segment from `p` to `q`.
fn to_segment(x: [f64; 3], p: [f64; 3], q: [f64; 3]) -> f64 {
    let [x, p, q] = [x, p, q].map(Vector3::from);
    let d = q - p;
    let share = if d.norm() > 0.0 { ((x - p).dot(&d) / d.norm_squared()).clamp(0.0, 1.0) } else { 0.0 };
    (x - p - d * share).norm()
}

/// Distance from `x` to what was found.
fn to_found(x: [f64; 3], found: &Curves) -> f64 {
    let at = |i: usize| found.points[i];
    let edges = found.curves.iter().flat_map(|c| c.edges().chain([[c.first; 2]]));
    edges.map(|[i, j]| to_segment(x, at(i), at(j))).fold(f64::INFINITY, f64::min)
}

/// The place of the true curves that is nearest to `x`, and how far it is.
fn nearest_true(x: [f64; 3], cut: &Cut) -> ([f64; 3], f64) {
    let all = cut.curves.iter().flat_map(|curve| {
        let n = curve.points.len();
        let steps = if curve.closed { n } else { n - 1 };
        (0..steps).map(move |i| [curve.points[i], curve.points[(i + 1) % n]])
    });
    let off = |[p, q]: [[f64; 3]; 2]| (p, to_segment(x, p, q));
    all.map(off).min_by(|a, b| a.1.total_cmp(&b.1)).unwrap()
}

/// The greatest of how far found places are from true ones and the other way round, in the lesser sampling radius, after the bias
/// of the surfaces there is taken off; h is no more than the sampling radius. `world` is the pose of a.
fn hausdorff(found: &Curves, cut: &Cut, world: &Pose, radii: [f64; 2]) -> [f64; 2] {
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

/// Spacings at which H·r ≤ 0.02 for the forms of this cut: a sampling radius is some 1.4 spacings.
fn clean_spacing(cut: &Cut) -> f64 {
    let bent = cut.curves.iter().flat_map(|curve| &curve.points).map(|&x| 2.0 * cut.aside(x));
    // Of both together, over the sine: more than either.
    0.02 / 1.45 / bent.fold(1.0, f64::max)
}

#[test]
fn clean_cuts_are_found_whole() {
    for cut in cuts::clean() {
        let spacing = clean_spacing(&cut);
        for order in [Order::Regular, Order::Random] {
            let sampling = Sampling { spacing, noise: 0.0, order, seed: 3 };
            let [a, b] = scans(&cut, [sampling; 2]);
            let views = [ScanView::new(&a, &Pose::IDENTITY), ScanView::new(&b, &cut.pose_b)];
            let found = draw(&views[0], &views[1], CurveOptions::default());
            let radii = [a.sampling_radius(), b.sampling_radius()];
            let r = radii[0].min(radii[1]);
            let [made_up, missing] = hausdorff(&found, &cut, &Pose::IDENTITY, radii);
            let name = format!("{} {order:?}", cut.name);
            println!(
                "{name}: {} + {} points, {} curves, {} points, made up {made_up:.4}, missing {missing:.4}, residual {:.1e}, {} evaluations, ends {:?}",
                a.len(),
                b.len(),
                found.curves.len(),
                found.points.len(),
                found.max_residual / r,
                found.statistics.evaluations,
                found.curves.iter().map(|c| c.ends).collect::<Vec<_>>()
            );
        }
    }
}
