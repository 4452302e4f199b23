//! Scores the verdicts on a truth set: `truth CLOUD.ply POSES.jsonl`.
#![expect(clippy::print_stdout, reason = "a program for people")]
use nearmiss::*;
use std::time::Instant;
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let model = nearmiss::io::read(args[1].as_ref(), None).unwrap();
    let cloud = model.cloud;
    let num = |i: usize, d: f64| args.get(i).map_or(d, |s| s.parse().unwrap());
    let opts = BuildOptions::default().with_surface(SurfaceOptions::default().with_horizon(num(4, 3.5)).with_threshold(num(5, 1e-3)));
    let t = Instant::now();
    let scan = Scan::build(&cloud, &opts).unwrap();
    println!("build {:?} points {} r {} usable {} nodes {}", t.elapsed(), scan.len(), scan.sampling_radius(), scan.usable(), scan.nodes().len());
    for k in [PointKind::Surface, PointKind::Border, PointKind::Ambiguous, PointKind::Line, PointKind::Isolated] { print!("{k:?} {:.4} ", scan.share(k)); }
    println!();
    // scorer radius
    let mut r6: Vec<f32> = {
        // K=6 without smoothing: rebuild spacing by brute kd via radii is close; use raw option
        let p = cloud.positions();
        let tree = kd(p);
        p.iter().map(|q| tree(q)).collect()
    };
    r6.sort_by(f32::total_cmp);
    let r = f64::from(r6[((r6.len() - 1) as f64 * 0.9) as usize]);
    println!("scorer r {r}");
    let detail = if args.get(3).is_some_and(|s| s == "witness") { Detail::Witness } else { Detail::Verdict };
    let plan = CollidePlan::new(&CollideOptions::default().with_detail(detail), &scan, &scan).unwrap();
    let mut scratch = CollideScratch::default();
    let text = std::fs::read_to_string(&args[2]).unwrap();
    let poses: Vec<(Pose, Pose, bool, f64)> = text.lines().map(|l| {
        let v: serde_json::Value = serde_json::from_str(l).unwrap();
        let m = |k: &str| { let a: Vec<f64> = v[k].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect(); Pose::from_row_major(&a.try_into().unwrap(), scan.bounds(), 1e-3).unwrap() };
        (m("a"), m("b"), v["truth"].as_bool().unwrap(), v["gap"].as_f64().unwrap_or(f64::NAN))
    }).collect();
    let (mut fp, mut fnn, mut und, mut bandwrong, mut n_out, mut n_band, mut cert) = (vec![], vec![], 0, 0, 0, 0, 0);
    let mut time = 0.0; let mut pairs = 0; let mut leafs = 0; let mut evals = 0;
    for (i, (a, b, truth, gap)) in poses.iter().enumerate() {
        let t = Instant::now();
        let ans = collide_with(&scan.at(a), &scan.at(b), &plan, &Budget::UNLIMITED, &mut scratch);
        time += t.elapsed().as_secs_f64();
        pairs += ans.statistics.node_pairs; leafs += ans.statistics.leaf_pairs; evals += ans.statistics.evaluations;
        if let Verdict::Intersecting{evidence: Evidence::Certified, ..} = ans.verdict { cert += 1; }
        let hit = ans.verdict.is_intersecting();
        if let Verdict::Undecided(_) = ans.verdict { und += 1; }
        if gap.abs() > r { n_out += 1; if hit && !truth { fp.push((i, gap / r)); } if !hit && *truth { fnn.push((i, gap / r)); } }
        else { n_band += 1; if hit != *truth { bandwrong += 1; } }
    }
    let n = poses.len() as f64;
    println!("poses {} outside {n_out} band {n_band}: false hits {:?} misses {:?} undecided {und} band wrong {bandwrong} certified hits {cert}", poses.len(), fp, fnn);
    println!("mean {:.2} us, node pairs {:.1} leaf pairs {:.2} evals {:.2}", time / n * 1e6, pairs as f64 / n, leafs as f64 / n, evals as f64 / n);
}
fn kd(p: &[[f32; 3]]) -> impl Fn(&[f32; 3]) -> f32 + '_ {
    let tree = kiddo::ImmutableKdTree::<f32, 3>::new_from_slice(p).unwrap();
    move |q| tree.query(q).nearest_n::<kiddo::SquaredEuclidean<f32>>(std::num::NonZero::new(7).unwrap()).execute()[6].distance.sqrt()
}
