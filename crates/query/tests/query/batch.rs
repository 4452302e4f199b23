//! Batches against single queries, on pools of one to four threads.
use std::ops::ControlFlow;
#[cfg(feature = "rayon")]
use std::sync::Barrier;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use nearmiss_geometry::{PointCloud, Pose};
use nearmiss_hierarchy::{BuildOptions, PointHierarchy};
use nearmiss_query::{
    Answer, BatchScratch, Budget, CollideOptions, CollidePlan, Deadline, Detail, Evidence, Order, Pair,
    Placed, Reason, Scratch, Semantics, Until, Verdict, each,
};
use nearmiss_testdata::arbitrary::{self, CloudKind};
use rayon::ThreadPool;

fn prepared(kind: CloudKind, count: u32, seed: u64) -> PointHierarchy {
    let cloud = PointCloud::from_positions(&arbitrary::cloud(kind, count, seed)).unwrap();
    PointHierarchy::build(&cloud, &BuildOptions::default().with_leaf_size(8)).unwrap()
}

fn pools() -> impl Iterator<Item = ThreadPool> {
    (1..=4).map(|threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap())
}

fn poses(count: usize, spread: f64, seed: u64) -> Vec<[Pose; 2]> {
    let rng = &mut arbitrary::rng(seed);
    let scale = |i: usize| [1.0, 0.7, 1.5][i % 3];
    (0..count).map(|i| [0.2, spread].map(|s| arbitrary::pose(rng, s).with_scale(scale(i)))).collect()
}

/// Pairs of a scan with itself at pairs of poses.
fn pairs<'a>(scan: &'a PointHierarchy, poses: &[[Pose; 2]]) -> Vec<Pair<'a>> {
    poses.iter().map(|[p, q]| Pair::new(Placed::new(scan, p), Placed::new(scan, q))).collect()
}

fn plan(options: CollideOptions, scan: &PointHierarchy) -> CollidePlan {
    CollidePlan::new(&options, scan, scan).unwrap()
}

/// Answers one by one, each with a fresh scratch.
fn singly(pairs: &[Pair<'_>], plan: &CollidePlan) -> Vec<Answer> {
    pairs.iter().map(|pair| pair.collide(plan, &mut Scratch::default())).collect()
}

/// Answers all in a batch.
fn batch(
    pairs: &[Pair<'_>],
    plan: &CollidePlan,
    deadline: Option<Deadline>,
    until: Until,
    scratch: &mut BatchScratch,
) -> Vec<Answer> {
    let mut answers = vec![Answer::UNASKED; pairs.len()];
    let told =
        each(&mut answers, deadline, scratch, |i, scratch| until.after(pairs[i].collide(plan, scratch)));
    answers.truncate(told);
    answers
}

fn options() -> [CollideOptions; 5] {
    let options = CollideOptions::estimated();
    [
        options,
        options.with_detail(Detail::Verdict),
        options.with_evidence(Evidence::Certified),
        options.with_margin(0.2),
        options.with_semantics(Semantics::Thickened(0.05)),
    ]
}

#[test]
fn a_batch_says_what_single_queries_say() {
    let scans = [CloudKind::Sphere, CloudKind::Random, CloudKind::Rings, CloudKind::Coplanar]
        .map(|kind| prepared(kind, 300, 1));
    let poses = poses(150, 2.0, 2);
    let mut kinds = [0; 3];
    let mut scratch = BatchScratch::default();
    let budgets = [Budget::UNLIMITED, Budget::UNLIMITED.with_work(20), Budget::UNLIMITED.with_work(0)];
    for options in options() {
        let plan = plan(options, &scans[0]);
        for budget in &budgets {
            let pair = |(i, [p, q]): (usize, &[Pose; 2])| {
                let [a, b] = [Placed::new(&scans[i % 4], p), Placed::new(&scans[i / 4 % 4], q)];
                Pair::new(a, b).within(budget)
            };
            let pairs: Vec<Pair<'_>> = poses.iter().enumerate().map(pair).collect();
            let expected = singly(&pairs, &plan);
            for pool in pools() {
                let told = pool.install(|| batch(&pairs, &plan, None, Until::All, &mut scratch));
                assert_eq!(told, expected, "{} threads, {options:?}, {budget:?}", pool.current_num_threads());
            }
            let fresh = batch(&pairs, &plan, None, Until::All, &mut BatchScratch::default());
            assert_eq!(fresh, expected, "with a new scratch");
            for answer in &expected {
                kinds[match answer.verdict {
                    Verdict::Intersecting { .. } => 0,
                    Verdict::Separated { .. } => 1,
                    Verdict::Undecided(_) => 2,
                }] += 1;
            }
        }
    }
    assert!(kinds.iter().all(|&n| n > 200), "of all verdicts some: {kinds:?}");
}

#[test]
fn until_the_first_hit_answers_end_with_it() {
    let scan = prepared(CloudKind::Sphere, 300, 1);
    let plan = plan(CollideOptions::estimated().with_detail(Detail::Verdict), &scan);
    let at = |x: f64| [Pose::IDENTITY, Pose::from_translation([x, 0.0, 0.0])];
    let (apart, together) = (at(5.0), at(1.2));
    let mut scratch = BatchScratch::default();
    for hits in [&[][..], &[0], &[999], &[17, 18, 600], &[15], &[16], &[500, 501, 502], &[998, 3]] {
        let mut poses = vec![apart; 1000];
        hits.iter().for_each(|&i| poses[i] = together);
        let pairs = pairs(&scan, &poses);
        let whole = batch(&pairs, &plan, None, Until::All, &mut scratch);
        let count = hits.iter().min().map_or(1000, |first| first + 1);
        for pool in pools() {
            for _ in 0..5 {
                let told = pool.install(|| batch(&pairs, &plan, None, Until::First, &mut scratch));
                assert_eq!(told, whole[..count], "{hits:?}, {} threads", pool.current_num_threads());
            }
        }
    }
}

#[test]
fn little_is_asked_after_the_first_hit() {
    let most_at_once = 16;
    for pool in pools() {
        let threads = pool.current_num_threads();
        for end in [0, 100, 5000] {
            let asked = AtomicUsize::new(0);
            let mut answers = vec![usize::MAX; 100_000];
            let ask = |i: usize, _: &mut _| {
                asked.fetch_add(1, Ordering::Relaxed);
                if i >= end { ControlFlow::Break(2 * i) } else { ControlFlow::Continue(2 * i) }
            };
            let scratch = &mut BatchScratch::default();
            let told = pool.install(|| each(&mut answers, None, scratch, ask));
            assert_eq!(told, end + 1);
            assert!(answers[..told].iter().enumerate().all(|(i, &answer)| answer == 2 * i), "{end}");
            let asked = asked.into_inner();
            assert!(asked <= told + threads * most_at_once, "{asked} asked for {told} on {threads} threads");
        }
    }
}

#[cfg(feature = "rayon")]
#[test]
fn of_two_hits_the_lower_ends_it_whichever_is_later() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    let (low, high) = (0, 16);
    for later in [low, high] {
        let begun = Barrier::new(2);
        let ask = |i: usize, _: &mut _| {
            if i != low && i != high {
                return ControlFlow::Continue(i);
            }
            begun.wait();
            if i == later {
                std::thread::sleep(Duration::from_millis(20));
            }
            ControlFlow::Break(i)
        };
        let mut answers = vec![0; 1000];
        let told = pool.install(|| each(&mut answers, None, &mut BatchScratch::default(), ask));
        assert_eq!(told, low + 1, "{later} is found later");
    }
}

#[test]
fn every_question_is_asked_once() {
    for pool in pools() {
        for count in [0, 1, 2, 3, 7, 16, 17, 63, 64, 65, 1000] {
            let mut answers = vec![0; count];
            let times: Vec<AtomicUsize> = (0..count).map(|_| AtomicUsize::new(0)).collect();
            let ask = |i: usize, _: &mut _| {
                times[i].fetch_add(1, Ordering::Relaxed);
                ControlFlow::Continue(i + 1)
            };
            let told = pool.install(|| each(&mut answers, None, &mut BatchScratch::default(), ask));
            assert_eq!(told, count);
            assert!(answers.iter().copied().eq(1..=count), "{count}: in place");
            assert!(times.into_iter().all(|n| n.into_inner() == 1), "{count}: once each");
        }
    }
}

#[test]
fn a_deadline_spans_the_batch() {
    let scan = prepared(CloudKind::Sphere, 2000, 1);
    let plan = plan(CollideOptions::estimated().with_order(Order::DepthFirst), &scan);
    let poses = poses(100_000, 2.0, 3);
    let pairs = pairs(&scan, &poses);
    let unasked = |answer: &Answer| answer.statistics.node_pairs == 0;
    let mut scratch = BatchScratch::default();
    for pool in pools() {
        for micros in [0, 500, 5000] {
            let told = pool.install(|| {
                let deadline = Deadline::within(Duration::from_micros(micros));
                let budget = Budget::UNLIMITED.with_deadline(deadline);
                let pairs: Vec<_> = pairs.iter().map(|pair| pair.within(&budget)).collect();
                batch(&pairs, &plan, Some(deadline), Until::All, &mut scratch)
            });
            assert_eq!(told.len(), poses.len(), "every question has an answer");
            let asked = told.iter().position(unasked).unwrap();
            assert!(asked < 50_000, "{asked} questions in {micros} µs");
            assert!(micros > 0 || asked == 0, "{asked} questions in no time");
            assert!(told[asked..].iter().all(unasked), "in order");
            let likelihood = 0.5;
            let nothing = Verdict::Undecided(Reason::Budget { likelihood });
            assert!(
                told[asked..].iter().all(|answer| answer.verdict == nothing),
                "no verdict without a look"
            );
            // Questions answered in time have their usual answer; the others were in progress.
            let whole = told[..asked].iter().zip(&pairs);
            let whole =
                whole.filter(|(answer, pair)| **answer == pair.collide(&plan, &mut Scratch::default()));
            let cut_short = asked - whole.count();
            assert!(cut_short <= 16 * pool.current_num_threads(), "{cut_short} of {asked} cut short");
        }
    }
}
