//! Interpolation search as a leaf test, against all edges of a and f of b by direct sums.
use std::collections::BTreeSet;

use crate::graphed::Scan;
use nearmiss_geometry::Pose;
use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::BuildOptions;
use nearmiss_query::{
    CollideOptions, CollidePlan, Contacts, Detail, Interpolation, Method, Pair, Placed, Scratch,
};
use nearmiss_testdata::arbitrary;
use nearmiss_testdata::oracle::{self, SurfaceTwin};
use nearmiss_testdata::shapes::{Form, Order, Sampling, cuboid, sphere, torus};

/// Random samples in small leaves, so that few edges cross.
fn scan(form: Form, spacing: f64, noise: f64) -> Scan {
    let sampling = Sampling { spacing, noise, order: Order::Random, seed: 3 };
    Scan::build(&form.sample(sampling).points, None, &BuildOptions::default().with_leaf_size(4))
}

/// The surface of a scan by sums over all its points, in the world.
struct Twin<'a> {
    view: Placed<'a>,
    surface: SurfaceTwin,
}

impl<'a> Twin<'a> {
    fn new(view: Placed<'a>) -> Self {
        let scan = view.scan();
        let points: Vec<[f64; 3]> = scan.positions().iter().map(|p| p.map(f64::from)).collect();
        let radii: Vec<f64> = scan.radii().iter().map(|&r| f64::from(r)).collect();
        let options = scan.plan().options();
        let parameters = oracle::Parameters {
            reach: options.support_radius,
            kernel: oracle::Kernel::Gaussian { theta: options.threshold },
            bandwidth: oracle::Bandwidth::Local,
            least_support: options.support_min as usize,
        };
        Self { view, surface: SurfaceTwin::with_radii(&points, &radii, parameters) }
    }

    fn nearest(&self, x: Vector3<f64>) -> usize {
        let away = |i: &usize| (Vector3::from(self.view.point(*i)) - x).norm();
        (0..self.view.scan().len()).min_by(|i, j| away(i).total_cmp(&away(j))).unwrap()
    }

    /// The distance of `x` from the surface, positive on the side to which the normal of the
    /// nearest point points (Klein & Zachmann 2005, §3.2). `None` where f is undefined.
    fn side(&self, x: Vector3<f64>) -> Option<f64> {
        let placed = self.view.stored_to_world();
        let at = self.surface.evaluate(placed.apply_inverse(x.into()))?;
        let normal = self.view.scan().normals()[self.nearest(x)].map(f64::from);
        let turned = Vector3::from(at.normal).dot(&Vector3::from(normal)).signum();
        (at.status == oracle::Status::Ok).then_some(-at.value * turned * placed.scale())
    }
}

/// The leaf of every stored point.
fn leaves(view: &Placed<'_>) -> Vec<usize> {
    let mut of = vec![0; view.scan().len()];
    let topology = view.scan().topology();
    for leaf in 0..topology.leaves() {
        of[topology.points_of_leaf(leaf)].fill(leaf);
    }
    of
}

/// Checks one pair. Returns the number of edges that cross and of contacts on edges.
fn check(scans: [&Scan; 2], pose: &Pose) -> [usize; 2] {
    let (a, b) = (scans[0].at(&Pose::IDENTITY), scans[1].at(pose));
    let twin = Twin::new(b);
    let points: Vec<Vector3<f64>> = (0..a.scan().len()).map(|i| a.point(i).into()).collect();
    let sides: Vec<Option<f64>> = points.iter().map(|&p| twin.side(p)).collect();
    let radius = |j: usize| f64::from(b.scan().radii()[j]) * b.stored_to_world().scale();
    let edges: Vec<[usize; 2]> =
        scans[0].graph.points().edges().edges().map(|edge| edge.map(|i| i as usize)).collect();

    let options = CollideOptions::estimated()
        .with_method(Method::Interpolation(Interpolation::default()))
        .with_detail(Detail::Verdict);
    let plan = CollidePlan::new(&options, a.scan(), b.scan()).unwrap();
    let (mut all, mut scratch) = (Contacts::default(), Scratch::default());
    let answer = Pair::new(a, b).contacts(&mut all).collide(&plan, &mut scratch);

    // Contacts on an edge, which do not come from discs, are at zeros of b's f, near points of both
    // scans.
    let leaf = leaves(&a);
    let mut tested = BTreeSet::new();
    let mut on_edges = 0;
    for contact in &all.contacts {
        let x = Vector3::from(contact.point);
        let is_on = |[i, j]: [usize; 2]| {
            let along = points[j] - points[i];
            let share = along.dot(&(x - points[i])) / along.norm_squared();
            (-1e-9..=1.0 + 1e-9).contains(&share) && (points[i] + share * along - x).norm() < 1e-9
        };
        let Some(edge) = edges.iter().find(|&&edge| is_on(edge)) else { continue };
        on_edges += 1;
        tested.extend(edge.map(|i| leaf[i]));
        let j = twin.nearest(x);
        // Where f is undefined, the nearest point must be as near.
        let f = twin.side(x).unwrap_or_else(|| (Vector3::from(b.point(j)) - x).norm());
        assert!(f.abs() <= 0.25 * radius(j) * (1.0 + 1e-3), "f is {f} at {contact:?}, r {}", radius(j));
        let away = points.iter().map(|p| (p - x).norm()).fold(f64::INFINITY, f64::min);
        assert!(away <= 0.9 * a.scan().sampling_radius().max(radius(j)) * 1.3, "{away} from a: {contact:?}");
    }
    // Where an edge certainly crosses, a crossing was found in the leaf of one of its ends.
    let mut crossing = 0;
    for [i, j] in edges {
        let (Some(p), Some(q)) = (sides[i], sides[j]) else { continue };
        let length = (points[i] - points[j]).norm();
        let least = 0.05 * radius(twin.nearest(points[i]));
        if p * q < 0.0 && p.abs().min(q.abs()) > least && p.abs() + q.abs() <= 1.2 * length {
            crossing += 1;
            assert!(
                tested.contains(&leaf[i]) || tested.contains(&leaf[j]),
                "edge {i} to {j} crosses, from {p} to {q}; {} contacts",
                all.contacts.len()
            );
        }
    }
    assert!(crossing == 0 || answer.verdict.is_intersecting(), "{crossing} edges cross: {answer:?}");
    [crossing, on_edges]
}

#[test]
fn edges_that_cross_are_those_of_brute_force() {
    let forms: [fn() -> Form; 3] = [|| sphere(1.0), || torus(1.0, 0.35), || cuboid([1.5, 1.0, 1.2])];
    let scans: Vec<Scan> = forms.iter().map(|form| scan(form(), 0.12, 0.05)).collect();
    let finer: Vec<Scan> = forms.iter().map(|form| scan(form(), 0.08, 0.1)).collect();
    let mut rng = arbitrary::rng(4);
    let [mut crossing, mut on_edges] = [0; 2];
    for (i, a) in scans.iter().enumerate() {
        for (j, b) in finer.iter().enumerate() {
            let pose = arbitrary::rotation(&mut rng)
                .with_translation(arbitrary::point_in(&mut rng, 0.9))
                .with_scale([1.0, 0.7][(i + j) % 2]);
            for scans in [[a, b], [b, a]] {
                let [crosses, on] = check(scans, &pose);
                (crossing, on_edges) = (crossing + crosses, on_edges + on);
            }
        }
    }
    // Where the surfaces graze each other, single edges cross.
    for round in 0..15 {
        let away = 1.8 + 0.012 * f64::from(round);
        let axis = arbitrary::unit_vector(&mut rng).map(|x| away * x);
        let pose = arbitrary::rotation(&mut rng).with_translation(axis);
        let [crosses, on] = check([&scans[0], &finer[0]], &pose);
        (crossing, on_edges) = (crossing + crosses, on_edges + on);
    }
    assert!(crossing > 1000 && on_edges > 200, "{crossing} edges cross, {on_edges} contacts are on edges");
}
