//! Values that no scan contains, such as NaN, infinities and extremes. Every function must
//! terminate, and must not accept a NaN as a surface point.

use nearmiss_surface::{
    Bandwidth, Evaluation, Kernel, Level, Moments, Status, SurfaceOptions, SurfacePlan, meet, project,
    symmetric_eigen,
};

const ABSURD: [f32; 12] = [
    f32::NAN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::MAX,
    f32::MIN,
    1e20,
    -1e12,
    1e-45,
    f32::MIN_POSITIVE,
    0.0,
    -0.0,
    -1.0,
];

/// A sheet of points, some with absurd coordinates or radii, and its implicit function.
struct Sheet {
    points: Vec<([f32; 3], f32)>,
    plan: SurfacePlan,
}

impl Sheet {
    fn all() -> Vec<Self> {
        let bandwidths = [Bandwidth::Local, Bandwidth::Global];
        let plans = [Kernel::Gaussian, Kernel::Wendland].into_iter().flat_map(|kernel| {
            bandwidths.map(|b| SurfaceOptions::default().with_kernel(kernel).with_bandwidth(b))
        });
        let plans: Vec<SurfacePlan> =
            plans.map(|options| SurfacePlan::new(&options, 1.5, 1.0).expect("in range")).collect();
        let sound: Vec<([f32; 3], f32)> = (0..49_u8)
            .map(|i| ([f32::from(i % 7) - 3.0, f32::from(i / 7) - 3.0, 0.1 * f32::from(i % 3)], 1.5))
            .collect();
        let mut sheets = vec![];
        for plan in &plans {
            sheets.push(Self { points: sound.clone(), plan: *plan });
            for value in ABSURD {
                for (slot, every) in [(0, 1), (2, 1), (3, 1), (0, 5), (1, 5), (3, 5), (4, 3)] {
                    let mut points = sound.clone();
                    for (p, radius) in points.iter_mut().step_by(every) {
                        match slot {
                            0..3 => p[slot] = value,
                            3 => *radius = value,
                            _ => (*p, *radius) = ([value; 3], value),
                        }
                    }
                    sheets.push(Self { points, plan: *plan });
                }
            }
        }
        sheets
    }

    fn evaluate(&self, x: [f64; 3]) -> Evaluation {
        let (points, radii): (Vec<[f32; 3]>, Vec<f32>) = self.points.iter().copied().unzip();
        let blocks = self.plan.blocks(&points, &radii);
        let at = Moments::about(Level::new(), &self.plan, x, blocks).evaluate(&self.plan, x);
        assert!(at.f.is_finite() && at.bandwidth.is_finite(), "{at:?}");
        if at.status == Status::Ok {
            let unit = at.normal.iter().map(|c| c * c).sum::<f64>();
            assert!((unit - 1.0).abs() < 1e-9 && at.bandwidth > 0.0, "{at:?}");
        }
        at
    }
}

fn places() -> impl Iterator<Item = [f64; 3]> {
    let absurd = ABSURD.into_iter().map(f64::from).chain([1e300, f64::MAX, 5e-324]);
    absurd.map(|x| [0.1, x, 0.05]).chain([[0.1, 0.2, 0.05], [3.0, 3.0, 0.0]])
}

#[test]
fn projections_and_meetings_end_with_numbers() {
    let sheets = Sheet::all();
    let sound = &sheets[0];
    let mut met = 0;
    for sheet in &sheets {
        for start in places() {
            let foot = project(start, |x| sheet.evaluate(x));
            assert!(foot.evaluations <= 12, "{foot:?}");
            let meeting = meet(start, |x| Some([sheet.evaluate(x), sound.evaluate(x)])).unwrap();
            assert!(meeting.rounds <= 16, "{meeting:?}");
            if meeting.verified || foot.converged {
                assert!(
                    meeting.residual().is_finite() && foot.point.iter().all(|c| c.is_finite()),
                    "{foot:?}"
                );
                met += 1;
            }
        }
    }
    assert!(met > 100, "{met} ended on the surface");
}

#[test]
fn eigenpairs_of_absurd_matrices_end() {
    let values = ABSURD.map(f64::from);
    for (i, x) in values.into_iter().enumerate() {
        for slot in 0..6 {
            let mut m = [1.0, 0.1, 0.2, 2.0, 0.3, 3.0];
            m[slot] = x;
            m[(slot + 1) % 6] = values[(i + slot) % values.len()];
            let eigen = symmetric_eigen(m);
            if m.iter().all(|v| v.is_finite()) {
                assert!(eigen.vectors.iter().flatten().all(|v| v.is_finite()), "{m:?}: {eigen:?}");
            }
        }
    }
}
