//! Small versions of everything that a program does with a scan: queries in a few poses,
//! evaluations, checks, and saving.

use nearmiss::{
    Answer, CollideOptions, CollidePlan, Detail, Evaluation, Evidence, Pair, Pose, Reason, Scan, Scratch,
    Semantics, Verdict,
};

use crate::hostile::graph::{GraphAnswers, exercise_graph};

/// The answers of a scan.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Answers {
    /// Answers to queries about the scan and another one, and itself.
    pub(crate) collide: Vec<Answer>,
    /// Evaluations near some of its points.
    pub(crate) at: Vec<Evaluation>,
    /// Answers of its graph.
    pub(crate) graph: Option<GraphAnswers>,
}

/// Poses of the other scan: coincident, slightly off, across the rim, far away.
fn poses(size: f64) -> [Pose; 4] {
    let turn = Pose::from_axis_angle([1.0, 2.0, 3.0], 0.7);
    [
        Pose::IDENTITY,
        turn.with_translation([0.01 * size, 0.0, 0.02 * size]),
        turn.with_translation([0.6 * size, 0.2 * size, 0.1 * size]),
        Pose::from_translation([9.0 * size, 0.0, 0.0]),
    ]
}

/// Runs all queries on `scan`, with `other` as the second scan.
///
/// # Panics
/// Panics if a query costs more than comparing all pairs of nodes, if an evaluation is NaN, or if
/// the scan cannot be written.
#[must_use]
pub(crate) fn exercise(scan: &Scan, other: &Scan) -> Answers {
    let size = other.bounds().half_extents().into_iter().fold(0.0, f64::max);
    let mut scratch = Scratch::default();
    let mut collide = Vec::new();
    let everything =
        (4 * scan.topology().len() * 4 * other.topology().len().max(scan.topology().len())) as u64;
    let surface = CollideOptions::estimated();
    let balls = surface.with_semantics(Semantics::Thickened(1e-3 * size));
    let all = [
        surface.with_detail(Detail::Verdict).with_evidence(Evidence::Certified),
        surface,
        surface.with_margin(0.02 * size).with_evidence(Evidence::Certified),
        balls,
        balls.with_margin(0.02 * size),
    ];
    for options in all {
        for pose in poses(size) {
            for (a, b) in [(scan, other), (other, scan), (scan, scan)] {
                let Ok(plan) = CollidePlan::new(&options, a, b) else { continue };
                let (a, b) = (a.at(&Pose::IDENTITY), b.at(&pose));
                let answer = Pair::new(a, b).collide(&plan, &mut scratch);
                // A node pair is compared once by boxes and once by enclosures.
                assert!(answer.statistics.node_pairs <= 2 * everything + 4, "{:?}", answer.statistics);
                if let Verdict::Undecided(Reason::Budget { likelihood }) = answer.verdict {
                    assert!((0.0..=1.0).contains(&likelihood), "a likelihood of {likelihood}");
                }
                collide.push(answer);
            }
        }
    }
    let view = scan.at(&Pose::IDENTITY);
    let places = (0..scan.len()).step_by(scan.len() / 7 + 1).map(|i| view.point(i).map(|x| x + 0.01 * size));
    let at: Vec<Evaluation> = places.chain([[0.0; 3], [1e30; 3]]).map(|x| scan.evaluate(x)).collect();
    assert!(at.iter().all(|e| e.f.is_finite() && e.bandwidth.is_finite()), "{at:?}");
    let _sound_or_not = scan.sanity_check();
    let mut sink = std::io::sink();
    assert!(scan.write_to(&mut sink).is_ok(), "what was loaded can be saved");
    Answers { collide, at, graph: exercise_graph(scan) }
}
