//! `cargo xtask demo`: the main use of the library on a real scan.

use std::path::PathBuf;
use std::time::Instant;

use nearmiss::{
    Answer, BuildOptions, Check, CollideOptions, CollidePlan, Evidence, Pair, Placed, Pose, Scan, Scratch,
    Semantics, Verdict,
};
use nearmiss_testdata::dragon::{Dragon, dragon_path};

use crate::repository::{Outcome, root};

/// Positions of the second copy on its path, in sampling radii past first touch.
const STEPS: [f64; 16] =
    [-20.0, -10.0, -6.0, -3.0, -2.0, -1.0, -0.5, -0.2, 0.0, 0.2, 0.5, 1.0, 2.0, 3.0, 6.0, 10.0];

/// Position of the second copy in the picture, in sampling radii past first touch.
const PICTURED: f64 = 6.0;

/// Direction from which the second copy comes.
const FROM: [f64; 3] = [0.1, 0.2, 1.0];
const TURNED: ([f64; 3], f64) = ([0.0, 1.0, 0.0], 0.6);

pub(crate) fn run() -> Outcome {
    let folder = root().join("target/demo");
    std::fs::create_dir_all(&folder)?;
    let scan = prepared(&folder.join("dragon.nm"))?;
    let r = scan.sampling_radius();
    let touch = first_touch(&scan)?;
    println!(
        "\nA second copy approaches. At offset 0 the nearest two points are one sampling radius, r = {r:.5}, apart."
    );
    println!(
        "Offsets are in r and increase with depth. Rows marked ~ are within r of contact, where answers may be wrong."
    );
    println!(
        "Nearest: the least distance between two points, in r. Gap: the certified lower bound of the distance of the\n\
         surfaces, in r.\n"
    );
    println!(
        "{:>8}  {:<10} {:<10} {:>8} {:>8} {:>9} {:>9} {:>12} {:>11}",
        "offset", "verdict", "evidence", "nearest", "gap", "residual", "µs", "evaluations", "node pairs"
    );
    let mut scratch = Scratch::default();
    let certified = CollideOptions::estimated().with_evidence(Evidence::Certified);
    let plan = CollidePlan::new(&certified, &scan, &scan)?;
    let a = scan.at(&Pose::IDENTITY);
    // Warm up: the first query allocates memory.
    Pair::new(a, scan.at(&pose(&scan, touch))).collide(&plan, &mut scratch);
    for offset in STEPS {
        let b_pose = pose(&scan, touch - offset * r);
        let b = scan.at(&b_pose);
        let start = now();
        let answer = Pair::new(a, b).collide(&plan, &mut scratch);
        let micros = start.elapsed().as_secs_f64() * 1e6;
        let distance = least_distance(&scan, &a, &b, &mut scratch)? / r;
        print_row(offset, &answer, [distance, r], micros);
    }
    let picture = draw(&scan, &a, &plan, touch - PICTURED * r, folder.join("contact.png"))?;
    println!("\nPicture of the contact at offset {PICTURED}: {}", picture.display());
    println!("It shows both scans, the witness and both normals, as `nearmiss collide … --image` does.");
    Ok(())
}

/// Preprocesses the shipped scan, saves it and opens it mapped.
fn prepared(path: &std::path::Path) -> Outcome<Scan> {
    let source = dragon_path(Dragon::Points23k);
    let start = now();
    let cloud = nearmiss::io::read(&source, None)?.cloud;
    let read = start.elapsed();
    let scan = Scan::build(&cloud, &BuildOptions::default())?;
    let built = start.elapsed();
    let bytes = scan.save(path)?;
    let saved = start.elapsed();
    let scan = Scan::open(path, Check::Full)?;
    let opened = start.elapsed();
    let millis = |time: std::time::Duration| time.as_secs_f64() * 1e3;
    println!("The Stanford dragon, {} points.", scan.len());
    println!("  read      {:8.2} ms", millis(read));
    println!("  prepared  {:8.2} ms", millis(built - read));
    println!(
        "  saved     {:8.2} ms, {:.0} bytes per point",
        millis(saved - built),
        bytes as f64 / scan.len() as f64
    );
    println!("  opened    {:8.2} ms, mapped, all checksums verified", millis(opened - saved));
    println!("  usable    {:8.1} % of the points", 100.0 * scan.usable());
    Ok(scan)
}

/// Returns the pose of the second copy at this distance, both about the middle of the scan's
/// bounds.
fn pose(scan: &Scan, distance: f64) -> Pose {
    let middle = scan.bounds().centre();
    let turn = Pose::from_axis_angle(TURNED.0, TURNED.1);
    let length = FROM.iter().map(|x| x * x).sum::<f64>().sqrt();
    let at = [0, 1, 2].map(|k| middle[k] + FROM[k] / length * distance);
    let moved = turn.apply(middle);
    turn.with_translation([0, 1, 2].map(|k| at[k] - moved[k]))
}

/// Returns the least distance of any two points: twice the radius at which balls about them touch.
fn least_distance(scan: &Scan, a: &Placed<'_>, b: &Placed<'_>, scratch: &mut Scratch) -> Outcome<f64> {
    let (mut apart, mut touching) = (0.0, 20.0 * scan.sampling_radius());
    for _ in 0..16 {
        let radius = 0.5 * (apart + touching);
        let balls = CollideOptions::estimated().with_semantics(Semantics::Thickened(radius));
        let plan = CollidePlan::new(&balls, scan, scan)?;
        if Pair::new(*a, *b).collide(&plan, scratch).verdict.is_intersecting() {
            touching = radius;
        } else {
            apart = radius;
        }
    }
    Ok(2.0 * apart)
}

/// Returns the distance at which the points, not the surfaces, first come within r of each other,
/// by bisection from far away with the exact query for thickened points.
fn first_touch(scan: &Scan) -> Outcome<f64> {
    let balls =
        CollideOptions::estimated().with_semantics(Semantics::Thickened(0.5 * scan.sampling_radius()));
    let plan = CollidePlan::new(&balls, scan, scan)?;
    let mut scratch = Scratch::default();
    let mut touches = |distance: f64| {
        let (a, b) = (scan.at(&Pose::IDENTITY), pose(scan, distance));
        Pair::new(a, scan.at(&b)).collide(&plan, &mut scratch).verdict.is_intersecting()
    };
    let half = scan.bounds().half_extents();
    let mut apart = 2.0 * half.iter().map(|x| x * x).sum::<f64>().sqrt();
    // Step in until the copies touch, then bisect.
    let step = 2.0 * scan.sampling_radius();
    while apart > 0.0 && !touches(apart - step) {
        apart -= step;
    }
    let mut within = apart - step;
    for _ in 0..40 {
        let middle = 0.5 * (apart + within);
        if touches(middle) { within = middle } else { apart = middle }
    }
    Ok(within)
}

fn print_row(offset: f64, answer: &Answer, [distance, r]: [f64; 2], micros: f64) {
    let evidence = |e: Evidence| if e == Evidence::Certified { "certified" } else { "estimated" };
    let none = String::new;
    let (verdict, evidence, gap, residual) = match answer.verdict {
        Verdict::Intersecting { contact, evidence: e } => {
            ("touch", evidence(e), none(), format!("{:.1e}", contact.residual))
        }
        Verdict::Separated { gap, evidence: e } if gap > 0.0 => {
            ("apart", evidence(e), format!("{:.2}", gap / r), none())
        }
        Verdict::Separated { evidence: e, .. } => ("apart", evidence(e), none(), none()),
        Verdict::Undecided(_) => ("undecided", "", none(), none()),
    };
    let spent = answer.statistics;
    // The points are r apart; the surfaces touch about r further in.
    let close = if (0.0..=2.0).contains(&offset) { '~' } else { ' ' };
    println!(
        "{close}{offset:>7.1}  {verdict:<10} {evidence:<10} {distance:>8.2} {gap:>8} {residual:>9} {micros:>9.1} {:>12} {:>11}",
        spent.evaluations, spent.node_pairs
    );
}

fn draw(scan: &Scan, a: &Placed<'_>, plan: &CollidePlan, distance: f64, path: PathBuf) -> Outcome<PathBuf> {
    let b_pose = pose(scan, distance);
    let b = scan.at(&b_pose);
    let answer = Pair::new(*a, b).collide(plan, &mut Scratch::default());
    nearmiss_cli::save_picture(&nearmiss_cli::contact_picture(a, &b, &answer), &path)?;
    Ok(path)
}

#[expect(clippy::disallowed_methods, reason = "a program may read the clock")]
fn now() -> Instant {
    Instant::now()
}
