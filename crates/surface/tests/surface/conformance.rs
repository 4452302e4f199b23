//! Conformance tests, run for each kernel.
use nearmiss_surface::{
    Evaluation, Kernel, Level, Moments, Status, SurfaceOptions, SurfacePlan, meet, project,
};
use nearmiss_testdata::arbitrary;

/// Points with one radius for all; a brute-force search is fast enough here.
struct Sheet {
    points: Vec<[f32; 3]>,
    radius: f32,
    plan: SurfacePlan,
}

impl Sheet {
    fn new(points: Vec<[f32; 3]>, radius: f32, kernel: Kernel) -> Self {
        let options = SurfaceOptions::default().with_kernel(kernel);
        Self { points, radius, plan: SurfacePlan::new(&options, f64::from(radius), 1.0).unwrap() }
    }

    /// The plane z = `height` over a square lattice of unit spacing from −15 to 15, for x ≤ `end`.
    fn plane(height: f32, end: f32, kernel: Kernel) -> Self {
        let side = |i: u8| f32::from(i) - 15.0;
        let lattice = (0..31).flat_map(|i| (0..31).map(move |j| [side(i), side(j), height]));
        Self::new(lattice.filter(|p| p[0] <= end).collect(), 2.0_f32.sqrt(), kernel)
    }

    /// Evenly spread points on a sphere about the origin; 4000 of them at a radius of 18 are about
    /// 1 apart.
    fn sphere(count: u16, radius: f64, kernel: Kernel) -> Self {
        let points = (0..count).map(|i| {
            let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(count);
            let (s, t) = ((1.0 - z * z).sqrt(), f64::from(i) * 2.399_963_229_728_653);
            #[expect(clippy::cast_possible_truncation, reason = "positions are single precision")]
            [s * t.cos(), s * t.sin(), z].map(|c| (radius * c) as f32)
        });
        Self::new(points.collect(), 1.4, kernel)
    }

    fn with(mut self, other: Self) -> Self {
        self.points.extend(other.points);
        self
    }

    fn at(&self, x: [f64; 3]) -> Evaluation {
        let radii = vec![self.radius; self.points.len()];
        let blocks = self.plan.blocks(&self.points, &radii);
        Moments::about(Level::new(), &self.plan, x, blocks).evaluate(&self.plan, x)
    }

    fn h(&self) -> f64 {
        f64::from(self.plan.bandwidth(self.radius))
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
        let plane = Sheet::plane(0.25, 99.0, kernel);
        let mut rng = arbitrary::rng(1);
        for _ in 0..200 {
            let [x, y, z] = arbitrary::point_in(&mut rng, 1.0);
            let height = 0.5 * plane.h() * z;
            let at = plane.at([8.0 * x, 8.0 * y, 0.25 + height]);
            assert_eq!(at.status, Status::Ok, "{kernel:?}");
            assert!((at.f + height).abs() < 1e-6 * plane.h(), "{kernel:?}: {} for {height}", at.f);
            assert!(at.normal[2] > 1.0 - 1e-9, "{kernel:?}: {:?}", at.normal);
            assert!((at.bandwidth - plane.h()).abs() < 1e-6 * plane.h(), "{kernel:?}: one h for all");
        }
    });
}

#[test]
fn the_surface_ends_where_its_samples_end() {
    each_kernel(|kernel| {
        let half = Sheet::plane(0.0, 0.0, kernel);
        let inside = half.at([-1.0, 0.3, 0.0]);
        assert_eq!(inside.status, Status::Ok, "{kernel:?}: one spacing inside");
        let beyond = half.at([1.0 * half.h(), 0.3, 0.0]);
        assert_eq!(beyond.status, Status::Border, "{kernel:?}: one h beyond");
        assert!(beyond.f.abs() < 1e-6, "{kernel:?}: f alone goes on: {}", beyond.f);
        assert_eq!(half.at([9.0, 0.0, 0.0]).status, Status::Outside, "{kernel:?}: far beyond");
        assert_eq!(half.at([9.0, 0.0, 0.0]).f.to_bits(), 0, "{kernel:?}: and no NaN");
    });
}

#[test]
fn between_two_sheets_there_is_no_surface() {
    each_kernel(|kernel| {
        let h = Sheet::plane(0.0, 99.0, kernel).h();
        #[expect(clippy::cast_possible_truncation, reason = "positions are single precision")]
        let gap = (2.0 * h) as f32;
        let plates = Sheet::plane(0.0, 99.0, kernel).with(Sheet::plane(gap, 99.0, kernel));
        let middle = plates.at([0.2, 0.3, h]);
        assert!(middle.f.abs() < 1e-3 * h, "{kernel:?}: f vanishes there: {}", middle.f);
        assert_eq!(middle.status, Status::Ambiguous, "{kernel:?}: but the points are no one sheet");
        // On closer sheets the normal is upright again, but there is still more than one sheet.
        #[expect(clippy::cast_possible_truncation, reason = "positions are single precision")]
        let close = Sheet::plane(0.0, 99.0, kernel).with(Sheet::plane((1.1 * h) as f32, 99.0, kernel));
        let between = close.at([0.2, 0.3, 0.55 * h]);
        assert!(between.normal[2] > 0.99, "{kernel:?}: {:?}", between.normal);
        assert_eq!(between.status, Status::Ambiguous, "{kernel:?}: {:?}", between.eigenvalues);
        let on = plates.at([0.2, 0.3, 0.0]);
        assert_eq!(on.status, Status::Ok, "{kernel:?}: on either sheet it is defined");
        assert!(on.f.abs() < 0.1 * h, "{kernel:?}: and where it was: {}", on.f);
    });
}

#[test]
fn a_sphere_shrinks_by_its_curvature() {
    each_kernel(|kernel| {
        let sphere = Sheet::sphere(4000, 18.0, kernel);
        let bias = sphere.h().powi(2) / (2.0 * 18.0);
        let mut rng = arbitrary::rng(2);
        for _ in 0..50 {
            let direction = arbitrary::unit_vector(&mut rng);
            let foot = project(direction.map(|c| 18.3 * c), |x| sphere.at(x));
            assert!(foot.converged, "{kernel:?}: {foot:?}");
            let radius = foot.point.iter().map(|c| c * c).sum::<f64>().sqrt();
            let expected = 18.0 - bias;
            assert!((radius - expected).abs() < 0.4 * bias, "{kernel:?}: {radius} for {expected}");
        }
    });
}

/// Evaluates a sheet that is rotated by `angle` about the y axis and lifted by `lift`, in the
/// common frame.
fn turned(sheet: &Sheet, angle: f64, lift: f64, x: [f64; 3]) -> Evaluation {
    use nearmiss_geometry::Pose;
    let pose = Pose::from_axis_angle([0.0, 1.0, 0.0], angle).with_translation([0.0, 0.0, lift]);
    let at = sheet.at(pose.apply_inverse(x));
    Evaluation { normal: pose.rotate(at.normal), centroid: pose.apply(at.centroid), ..at }
}

#[test]
fn newton_finds_the_common_point_of_two_planes() {
    each_kernel(|kernel| {
        let sheet = Sheet::plane(0.0, 99.0, kernel);
        for angle in [0.05, 0.3, 1.0, 1.5] {
            let meeting =
                meet([0.4, 0.2, 0.3], |x| Some([sheet.at(x), turned(&sheet, angle, 0.0, x)])).unwrap();
            assert!(meeting.verified, "{kernel:?}, {angle}: {meeting:?}");
            // The common line is x = z = 0.
            let [x, y, z] = meeting.point;
            assert!(x.abs() < 1e-4 && z.abs() < 1e-5, "{kernel:?}, {angle}: {:?}", meeting.point);
            assert!((y - 0.2).abs() < 1e-3, "{kernel:?}: the least step does not slide along the line: {y}");
            assert!(meeting.rounds <= 6, "{kernel:?}, {angle}: {} rounds", meeting.rounds);
        }
    });
}

#[test]
fn parallel_planes_meet_only_if_they_coincide() {
    each_kernel(|kernel| {
        let sheet = Sheet::plane(0.0, 99.0, kernel);
        let apart = meet([0.4, 0.2, 0.1], |x| Some([sheet.at(x), turned(&sheet, 0.0, 0.2, x)])).unwrap();
        assert!(!apart.verified, "{kernel:?}: {apart:?}");
        assert!((apart.residual() - 0.1).abs() < 1e-3, "{kernel:?}: halfway between: {}", apart.residual());
        let same = meet([0.4, 0.2, 0.1], |x| Some([sheet.at(x), turned(&sheet, 0.0, 0.0, x)])).unwrap();
        assert!(same.verified, "{kernel:?}: {same:?}");
    });
}

#[test]
fn newton_takes_few_rounds_on_curved_sheets() {
    each_kernel(|kernel| {
        // Radius 4 at a spacing of 1: the points near a surface point deviate from a plane by a
        // seventh of h.
        let sphere = Sheet::sphere(200, 4.0, kernel);
        let mut rng = arbitrary::rng(9);
        let (mut rounds, mut verified) = (0, 0);
        for _ in 0..100 {
            let [x, y, z] = arbitrary::unit_vector(&mut rng);
            // A second sphere, 4 to the side. The spheres meet in a circle in the plane halfway
            // between them.
            let length = (y * y + z * z).sqrt().max(0.1);
            let start = [2.0 + 0.1 * x, 3.3 * y / length, 3.3 * z / length];
            let meeting = meet(start, |p| Some([sphere.at(p), sphere.at([p[0] - 4.0, p[1], p[2]])])).unwrap();
            if meeting.verified {
                verified += 1;
                rounds += meeting.rounds;
            }
        }
        assert!(verified >= 80, "{kernel:?}: {verified} of 100");
        assert!(rounds <= 5 * verified, "{kernel:?}: {rounds} rounds for {verified} witnesses");
    });
}
