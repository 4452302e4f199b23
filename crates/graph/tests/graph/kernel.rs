//! Runs the conformance tests of `nearmiss-surface` with distances along the graph.
use crate::clouds::Cloud;
use nearmiss_geometry::Pose;
use nearmiss_graph::{Close, ClosePairs, GeodesicKernel, GeodesicScratch, KernelScratch, Network, Paths};
use nearmiss_surface::{Evaluation, Kernel, Level, Moments, Status, SurfaceOptions, SurfacePlan, project};
use nearmiss_testdata::arbitrary;
use nearmiss_testdata::shapes::{patch, plates, sphere, torus};

/// A cloud with its map of close pairs.
struct Sheet {
    cloud: Cloud,
    plan: SurfacePlan,
    pairs: ClosePairs,
}

impl Sheet {
    fn new(cloud: Cloud, kernel: Kernel) -> Self {
        let plan = SurfacePlan::new(&SurfaceOptions::default().with_kernel(kernel), 1.0, 1.0).unwrap();
        let support_radii: Vec<f32> = cloud.radii.iter().map(|&r| plan.support_radius(r)).collect();
        let pairs =
            ClosePairs::build(Network::new(&cloud.graph, &cloud.lengths), &support_radii, Paths::Rebuilt);
        Self { cloud, plan, pairs }
    }

    fn kernel(&self) -> GeodesicKernel<'_> {
        GeodesicKernel::new(&self.plan, &self.cloud.points, &self.cloud.radii, &self.cloud.graph, &self.pairs)
    }

    fn nearest(&self, x: [f64; 3]) -> u32 {
        let away = |p: &[f32; 3]| (0..3).map(|k| (f64::from(p[k]) - x[k]).powi(2)).sum::<f64>();
        let near = (0..self.cloud.points.len())
            .min_by(|&a, &b| away(&self.cloud.points[a]).total_cmp(&away(&self.cloud.points[b])));
        u32::try_from(near.unwrap()).unwrap()
    }

    fn at(&self, x: [f64; 3]) -> Evaluation {
        self.kernel().evaluate(x, self.nearest(x), &mut KernelScratch::default())
    }

    /// Evaluates f with straight-line distances.
    fn straight_at(&self, x: [f64; 3]) -> Evaluation {
        let blocks = self.plan.blocks(&self.cloud.points, &self.cloud.radii);
        Moments::about(Level::new(), &self.plan, x, blocks).evaluate(&self.plan, x)
    }

    fn h(&self) -> f64 {
        let sum: f64 = self.cloud.radii.iter().map(|&r| f64::from(self.plan.bandwidth(r))).sum();
        #[expect(clippy::cast_precision_loss, reason = "some thousand")]
        let count = self.cloud.radii.len() as f64;
        sum / count
    }
}

fn each_kernel(test: impl Fn(Kernel)) {
    for kernel in [Kernel::Gaussian, Kernel::Wendland] {
        test(kernel);
    }
}

#[test]
fn on_a_plane_the_function_is_the_height() {
    each_kernel(|kernel| {
        for seed in 0..3 {
            let plane = Sheet::new(Cloud::of_form(patch(2.0, 2.0), 0.1, 0.0, seed), kernel);
            let (h, rng) = (plane.h(), &mut arbitrary::rng(seed));
            for _ in 0..200 {
                let [x, y, z] = arbitrary::point_in(rng, 1.0);
                let height = 0.3 * h * z;
                let at = plane.at([0.6 * x, 0.6 * y, height]);
                assert_eq!(at.status, Status::Ok, "{kernel:?}, seed {seed}: {at:?}");
                assert!((at.f + height).abs() < 1e-6 * h, "{kernel:?}, seed {seed}: {} for {height}", at.f);
                assert!(at.normal[2] > 1.0 - 1e-9, "{kernel:?}: {:?}", at.normal);
            }
            let above = plane.at([0.2, 0.1, 3.0 * h]);
            assert_ne!(above.status, Status::Ok, "{kernel:?}: nothing is there");
        }
    });
}

#[test]
fn a_sphere_shrinks_by_its_curvature() {
    each_kernel(|kernel| {
        let ball = Sheet::new(Cloud::of_form(sphere(1.0), 0.07, 0.0, 0), kernel);
        let bias = ball.h().powi(2) / 2.0;
        let rng = &mut arbitrary::rng(2);
        for _ in 0..50 {
            let direction = arbitrary::unit_vector(rng);
            let foot = project(direction.map(|c| 1.01 * c), |x| ball.at(x));
            let radius = foot.point.iter().map(|c| c * c).sum::<f64>().sqrt();
            let shrunk = 1.0 - radius;
            // Paths along edges are longer than straight lines, so fewer points contribute.
            assert!((0.5..1.2).contains(&(shrunk / bias)), "{kernel:?}: {shrunk} for {bias}");
        }
    });
}

#[test]
fn it_moves_with_its_points() {
    let cloud = Cloud::of_form(torus(1.0, 0.4), 0.1, 0.1, 4);
    let pose = Pose::from_axis_angle([0.36, 0.48, 0.8], 1.1).with_translation([0.3, -0.2, 0.1]);
    #[expect(clippy::cast_possible_truncation, reason = "positions are single precision")]
    let moved =
        Cloud::new(cloud.points.iter().map(|p| pose.apply(p.map(f64::from)).map(|c| c as f32)).collect());
    let (still, moved) = (Sheet::new(cloud, Kernel::Gaussian), Sheet::new(moved, Kernel::Gaussian));
    let (h, rng) = (still.h(), &mut arbitrary::rng(5));
    let mut compared = 0;
    for i in (0..still.cloud.points.len()).step_by(7) {
        let d = arbitrary::point_in(rng, 0.3 * h);
        let x = [0, 1, 2].map(|k| f64::from(still.cloud.points[i][k]) + d[k]);
        // f may jump where rounding changes the nearest point or edge, or drops an edge.
        let [a, b] = [(&still, x), (&moved, pose.apply(x))]
            .map(|(sheet, x)| (sheet.kernel().foot(x, sheet.nearest(x)).ends, sheet.at(x)));
        if a.0 == b.0 && a.1.support == b.1.support {
            compared += 1;
            assert!((a.1.f.abs() - b.1.f.abs()).abs() < 1e-4 * h, "{} and {}", a.1.f, b.1.f);
        }
    }
    assert!(compared > 100, "only {compared} places are alike");
}

#[test]
fn distances_from_the_foot_are_those_of_its_ends_and_go_over_smoothly() {
    let ring = Sheet::new(Cloud::of_form(torus(1.0, 0.4), 0.1, 0.1, 4), Kernel::Gaussian);
    let (kernel, mut scratch, mut search) =
        (ring.kernel(), KernelScratch::default(), GeodesicScratch::default());
    let network = Network::new(&ring.cloud.graph, &ring.cloud.lengths);
    for i in (0..ring.cloud.points.len()).step_by(11) {
        let id = u32::try_from(i).unwrap();
        let foot = kernel.foot(ring.cloud.points[i].map(f64::from), id);
        assert_eq!((foot.ends[0], foot.share), (id, 0.0));
        let at = kernel.evaluate(ring.cloud.points[i].map(f64::from), id, &mut scratch);
        assert_eq!(kernel.evaluate_at(id, &mut scratch).0, at, "at point {i}");
        // At a point, the list of the point contributes, except for points exactly at their support
        // radius.
        let supporting = kernel.find_supporting(&foot, &mut scratch).to_vec();
        let strict = ring
            .pairs
            .of(i)
            .filter(|c| c.distance < ring.plan.support_radius(ring.cloud.radii[c.point as usize]));
        assert_eq!(supporting, strict.collect::<Vec<_>>());
        // The midpoint of an edge yields the same points, whichever end comes first.
        let other = ring.cloud.graph.of(i)[0];
        let there = foot_between(&ring, [id, other], 0.5);
        let back = foot_between(&ring, [other, id], 0.5);
        let sorted = |foot, scratch: &mut KernelScratch| {
            let mut supporting: Vec<(u32, f32)> =
                kernel.find_supporting(&foot, scratch).iter().map(|c| (c.point, c.distance)).collect();
            supporting.sort_unstable_by_key(|c| c.0);
            supporting
        };
        let (a, b) = (sorted(there, &mut scratch), sorted(back, &mut scratch));
        assert_eq!(a.iter().map(|c| c.0).collect::<Vec<_>>(), b.iter().map(|c| c.0).collect::<Vec<_>>());
        for (a, b) in a.iter().zip(&b) {
            assert!((a.1 - b.1).abs() < 1e-6, "{a:?} and {b:?}");
            // The distance is between those of the ends, except for their rounding.
            let [p, q] = [id, other].map(|end| search.distance(network, end, a.0).unwrap());
            assert!(a.1 <= 0.500_05 * (p + q) + there.length, "{} between {p} and {q}", a.1);
            assert!(a.1 >= 0.9999 * p.min(q), "{} between {p} and {q}", a.1);
        }
    }
}

#[test]
fn weights_are_those_of_the_formulas_at_every_level() {
    each_kernel(|kernel| {
        let ring = Sheet::new(Cloud::of_form(torus(1.0, 0.4), 0.1, 0.2, 4), kernel);
        let (h, rng) = (ring.h(), &mut arbitrary::rng(8));
        let (mut best, mut base) = (KernelScratch::default(), KernelScratch::at(Level::baseline()));
        for i in (0..ring.cloud.points.len()).step_by(5) {
            let d = arbitrary::point_in(rng, 0.4 * h);
            let x = [0, 1, 2].map(|k| f64::from(ring.cloud.points[i][k]) + d[k]);
            let nearest = ring.nearest(x);
            let found = ring.kernel().evaluate(x, nearest, &mut best);
            let again = ring.kernel().evaluate(x, nearest, &mut base);
            assert_eq!(found.f.to_bits(), again.f.to_bits(), "{kernel:?} at {i}");
            // Klein & Zachmann 2005, eq. 1 to 5.
            let foot = ring.kernel().foot(x, nearest);
            let weigh = |c: &Close| {
                let support_radius = f64::from(ring.plan.support_radius(ring.cloud.radii[c.point as usize]));
                let t = (f64::from(c.distance) / support_radius).powi(2);
                let q = t.sqrt();
                let w = match kernel {
                    Kernel::Gaussian => 1e-4_f64.powf(t),
                    _ => (1.0 - q).powi(4) * (4.0 * q + 1.0),
                };
                (w, ring.cloud.points[c.point as usize].map(f64::from))
            };
            let supporting: Vec<_> =
                ring.kernel().find_supporting(&foot, &mut best).iter().map(weigh).collect();
            let total: f64 = supporting.iter().map(|(w, _)| w).sum();
            let mean = [0, 1, 2].map(|k| supporting.iter().map(|(w, p)| w * p[k]).sum::<f64>() / total);
            let about = |j: usize, k: usize| {
                supporting.iter().map(|(w, p)| w * (p[j] - mean[j]) * (p[k] - mean[k])).sum::<f64>() / total
            };
            let c = [about(0, 0), about(0, 1), about(0, 2), about(1, 1), about(1, 2), about(2, 2)];
            let normal = nearmiss_surface::symmetric_eigen(c).vectors[0];
            let f: f64 = (0..3).map(|k| normal[k] * (mean[k] - x[k])).sum();
            assert!((f.abs() - found.f.abs()).abs() < 1e-4 * h, "{kernel:?} at {i}: {} for {f}", found.f);
            assert_eq!(found.support as usize, supporting.len());
        }
    });
}

fn foot_between(sheet: &Sheet, [a, b]: [u32; 2], share: f64) -> nearmiss_graph::Foot {
    let [p, q] = [a, b].map(|i| sheet.cloud.points[i as usize]);
    #[expect(clippy::cast_possible_truncation, reason = "a length")]
    nearmiss_graph::Foot { ends: [a, b], share, length: crate::clouds::distance(&p, &q) as f32 }
}

#[test]
fn sheets_that_no_edge_joins_stay_apart() {
    each_kernel(|kernel| {
        let h = Sheet::new(Cloud::of_form(patch(2.0, 2.0), 0.1, 0.0, 1), kernel).h();
        // No sphere of influence is much larger than the sphere to the sixth neighbour, so at 2.2 h
        // no edge joins the plates.
        for gap in [2.2, 3.0] {
            let pair = Sheet::new(Cloud::of_form(plates(2.0, 2.0, gap * h), 0.1, 0.0, 1), kernel);
            let rng = &mut arbitrary::rng(3);
            for _ in 0..50 {
                let [x, y, z] = arbitrary::point_in(rng, 1.0);
                let height = 0.2 * h * z;
                let at = pair.at([0.6 * x, 0.6 * y, 0.5 * gap * h + height]);
                assert_eq!(at.status, Status::Ok, "{kernel:?}, {gap} h: {at:?}");
                assert!((at.f + height).abs() < 1e-6 * h, "{kernel:?}, {gap} h: {} for {height}", at.f);
            }
            let middle = pair.at([0.1, 0.2, 0.02 * h]);
            assert_ne!(middle.status, Status::Ok, "{kernel:?}, {gap} h: {middle:?}");
        }
        let pair = Sheet::new(Cloud::of_form(plates(2.0, 2.0, 2.2 * h), 0.1, 0.0, 1), kernel);
        let straight = pair.straight_at([0.1, 0.2, 1.1 * h]);
        assert!(straight.f.abs() > 1e-3 * h, "{kernel:?}: straight distances reach across: {}", straight.f);
    });
}
