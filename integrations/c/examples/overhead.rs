//! The cost of a call of C over a call of the library, in the same run, and of a batch for comparison
//! with Python: `cargo run --release -p nearmiss-c --example overhead -- SCAN.nm`. See
//! `integrations/python/overhead.py`.
#![expect(clippy::print_stdout, clippy::disallowed_methods, reason = "a program that tells times")]
#![expect(unsafe_code, reason = "it calls the library as C does")]

use std::mem::MaybeUninit;
use std::ops::ControlFlow;
use std::time::Instant;

use nearmiss::{Answer, BatchScratch, Check, CollideOptions, CollidePlan, Pair, Pose, Scan, Scratch, each};
use nearmiss_c::collide::nearmiss_collide;
use nearmiss_c::plan::nearmiss_plan_new;
use nearmiss_c::pose::{Placed, nearmiss_pose_identity};
use nearmiss_c::scan::nearmiss_scan_from_bytes;
use nearmiss_c::scratch::nearmiss_scratch_new;
use nearmiss_c::status::Status;

/// Calls between two looks at the clock, and how often.
const CALLS: u32 = 2000;
const ROUNDS: usize = 301;

/// Poses of the batch.
const POSES: u32 = 100_000;

/// Returns the time of a call in nanoseconds.
fn time(mut call: impl FnMut()) -> f64 {
    let start = Instant::now();
    (0..CALLS).for_each(|_| call());
    start.elapsed().as_secs_f64() * 1e9 / f64::from(CALLS)
}

/// The translation of the `i`-th pose; `overhead.py` has the same.
fn place(i: u32) -> [f64; 3] {
    let part = |step: f64| (f64::from(i) * step).fract();
    [
        0.3 * part(0.618_033_988_749) - 0.15,
        0.3 * part(0.754_877_666_247) - 0.15,
        0.3 * part(0.569_840_290_998) - 0.15,
    ]
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("expected a prepared scan")?;
    let scan = Scan::read(&path, Check::Full)?;
    let plan = CollidePlan::new(&CollideOptions::default(), &scan, &scan)?;
    let mut scratch = Scratch::default();

    let bytes = std::fs::read(&path)?;
    let (mut c_scan, mut c_plan, mut c_scratch) =
        (MaybeUninit::uninit(), MaybeUninit::uninit(), MaybeUninit::uninit());
    // SAFETY: the bytes are those of the vector, and the scan is made by the call.
    let made = unsafe { nearmiss_scan_from_bytes(bytes.as_ptr(), bytes.len(), 0, Some(&mut c_scan)) };
    assert_eq!(made, Status::Ok, "the bytes of a scan");
    // SAFETY: as above; it is never freed.
    let c_scan = unsafe { c_scan.assume_init().as_ref() };
    assert_eq!(nearmiss_plan_new(None, c_scan, c_scan, Some(&mut c_plan)), Status::Ok, "a plan");
    assert_eq!(nearmiss_scratch_new(Some(&mut c_scratch)), Status::Ok, "a scratch");
    // SAFETY: both were made by the calls above and are never freed; nothing else uses the scratch.
    let (c_plan, c_scratch) = unsafe { (c_plan.assume_init().as_ref(), c_scratch.assume_init().as_mut()) };
    let c_scratch = c_scratch.ok_or("expected a scratch")?;

    for distance in [30.0, 0.3] {
        let a = Placed { scan: c_scan, pose: nearmiss_pose_identity() };
        let mut b = a;
        b.pose.translation[0] = distance;
        let mut answer = MaybeUninit::uninit();
        let mut times = [Vec::new(), Vec::new()];
        for _ in 0..ROUNDS {
            times[0].push(time(|| {
                // The same numbers as from C: a position and a quaternion of either scan.
                let [a, b] = std::hint::black_box([&a.pose, &b.pose]);
                let [a, b] =
                    [a, b].map(|pose| Pose::new(pose.translation, pose.rotation).with_scale(pose.scale));
                let pair = Pair::new(scan.at(&a), scan.at(&b));
                std::hint::black_box(pair.collide(&plan, &mut scratch));
            }));
            times[1].push(time(|| {
                let (a, b) = (std::hint::black_box(&a), std::hint::black_box(&b));
                nearmiss_collide(
                    c_plan,
                    Some(a),
                    Some(b),
                    None,
                    None,
                    Some(&mut *c_scratch),
                    Some(&mut answer),
                );
                std::hint::black_box(&answer);
            }));
        }
        let [ours, c] = times.map(|mut times| {
            times.sort_unstable_by(f64::total_cmp);
            times[ROUNDS / 2]
        });
        println!("{distance} apart: {ours:.1} ns, from C {c:.1} ns: {:+.1} ns", c - ours);
    }

    let matrices: Vec<[f64; 16]> =
        (0..POSES).map(|i| Pose::from_translation(place(i)).to_row_major()).collect();
    let mut answers = vec![Answer::UNASKED; matrices.len()];
    let mut scratch = BatchScratch::default();
    for _ in 0..5 {
        let start = Instant::now();
        each(&mut answers, None, &mut scratch, |i, scratch| {
            let pose = Pose::from_matrix(&matrices[i]).unwrap_or_default();
            let pair = Pair::new(scan.at(&Pose::IDENTITY), scan.at(&pose));
            ControlFlow::Continue(pair.collide(&plan, scratch))
        });
        println!("batch of {POSES} matrices: {:.1} ms", start.elapsed().as_secs_f64() * 1e3);
    }
    Ok(())
}
