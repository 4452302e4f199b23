//! Certified separations of small shapes in random poses, against the exact distance.
//!
//! A ball is placed at random beside a shape of each family. Their exact surfaces intersect if the
//! distance of the ball's centre from the shape is at most its radius; the difference is the depth.
//! The program fails if a separation deeper than 0.3 r is certified, or a certified gap exceeds the
//! exact one by more than 0.3 r.

use nearmiss::{
    BuildOptions, CollideOptions, CollidePlan, Detail, Evidence, Pair, PointCloud, Pose, Scan, Scratch,
    Verdict,
};
use nearmiss_benches::Failure;
use nearmiss_testdata::arbitrary::{point_in, rng, rotation, unit_vector};
use nearmiss_testdata::shapes::{Form, Sampling, Shape, bars, bowl, cuboid, patch, plates, scorer_radius};
use nearmiss_testdata::shapes::{shells, sphere, step, torus};

/// Radius of the ball. Its samples resolve its curvature as well as the shapes' samples resolve
/// theirs.
const BALL: f64 = 0.4;

/// Lower limits of the gap, in r, of the rows of the table.
const EDGES: [f64; 9] = [f64::NEG_INFINITY, -1.0, -0.3, 0.0, 1.0, 2.0, 3.0, 4.0, 6.0];

#[derive(Debug, Clone, Copy, Default)]
struct Row {
    hits: u64,
    certified: u64,
    estimated: u64,
    undecided: u64,
}

fn forms() -> Vec<(&'static str, Form)> {
    vec![
        ("sphere", sphere(1.0)),
        ("torus", torus(1.0, 0.35)),
        ("bowl", bowl(1.0)),
        ("patch", patch(2.0, 2.0)),
        ("plates", plates(1.5, 1.5, 0.6)),
        ("step", step(1.0, 0.7, 1.0)),
        ("cuboid", cuboid([1.6, 1.2, 0.8])),
        ("shells", shells(0.5, 1.0)),
        ("bars", bars(2, 1.0, 0.4)),
    ]
}

fn scan(shape: &Shape) -> Result<Scan, Failure> {
    Ok(Scan::build(&PointCloud::from_positions(&shape.points)?, &BuildOptions::default())?)
}

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Poses of the ball, over all families
    #[arg(long, value_name = "N", default_value_t = 1_000_000)]
    poses: usize,
    /// Seed of the random numbers
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let forms = forms();
    let each = arguments.poses.div_ceil(forms.len());
    let mut rows = [Row::default(); EDGES.len()];
    let asked = each * forms.len();
    let mut bad = 0;
    for (name, form) in forms {
        bad += one_family(name, form, each, arguments.seed, &mut rows)?;
    }
    println!("\n| gap / r from | hits | certified apart | estimated apart | undecided |");
    println!("| --: | --: | --: | --: | --: |");
    for (edge, Row { hits, certified, estimated, undecided }) in EDGES.iter().zip(&rows) {
        println!("| {edge} | {hits} | {certified} | {estimated} | {undecided} |");
    }
    println!("\n{asked} poses; {bad} false certificates");
    if bad > 0 {
        return Err(format!("expected no false certificate, got {bad}").into());
    }
    Ok(())
}

/// Queries `count` poses of one family; returns the number of false certificates.
fn one_family(name: &str, form: Form, count: usize, seed: u64, rows: &mut [Row]) -> Result<u64, Failure> {
    let mut random = rng(seed);
    let sample = |form: Form, n: u32| {
        let spacing = form.spacing_for(n);
        form.sample(Sampling::clean(spacing))
    };
    let (shape, ball) = (sample(form, 1200), sample(sphere(BALL), 300));
    let r = scorer_radius(&shape.points).max(scorer_radius(&ball.points));
    let (a, b) = (scan(&shape)?, scan(&ball)?);
    let options = CollideOptions::estimated().with_detail(Detail::Verdict).with_evidence(Evidence::Certified);
    let plan = CollidePlan::new(&options, &a, &b)?;
    let mut scratch = Scratch::default();
    let (mut bad, mut greatest) = (0, f64::NEG_INFINITY);
    let size = a.bounds().half_extents().into_iter().fold(0.0, f64::max);
    for i in 0..count {
        let centre = if i % 4 == 0 {
            point_in(&mut random, 1.3 * size + BALL)
        } else {
            // Around a sample: from deep inside the ball to 8 r beside it.
            let sample = shape.points[i % shape.points.len()];
            let along = unit_vector(&mut random);
            let away = BALL + r * (2.5 + 5.5 * point_in(&mut random, 1.0)[0]);
            [0, 1, 2].map(|k| sample[k] + away * along[k])
        };
        let gap = shape.distance(centre) - BALL;
        let turn = rotation(&mut random).with_translation(centre);
        let answer = Pair::new(a.at(&Pose::IDENTITY), b.at(&turn)).collide(&plan, &mut scratch);
        let row = &mut rows[EDGES.iter().rposition(|edge| gap / r >= *edge).unwrap_or(0)];
        match answer.verdict {
            Verdict::Intersecting { .. } => row.hits += 1,
            Verdict::Separated { gap: proven, evidence: Evidence::Certified } => {
                row.certified += 1;
                greatest = greatest.max((proven - gap) / r);
                bad += u64::from(gap < -0.3 * r || proven > gap + 0.3 * r);
            }
            Verdict::Separated { .. } => row.estimated += 1,
            Verdict::Undecided(_) => row.undecided += 1,
        }
    }
    println!("{name}: r {r:.4}, {bad} false; proven gap less exact gap at most {greatest:+.3} r");
    Ok(bad)
}
