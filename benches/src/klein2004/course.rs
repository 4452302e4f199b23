//! Figs 9 to 12: time over distance, and differences from an exact test of polygons.

use std::hint::black_box;

use nearmiss::geometry::NodeId;
use nearmiss::hierarchy::Relative;
use nearmiss::{Answer, Pose, Reason, Scan, Verdict};

use crate::clock::{nanoseconds, timed};
use crate::poses::{DISTANCES, distance};
use crate::rivals::Method;
use crate::sample::{Sample, count};

/// Distances over which the paper averages differences.
const AVERAGED: std::ops::RangeInclusive<f64> = 0.6..=2.0;

/// Warm-up poses before each distance.
const WARM_UP: usize = 20;

/// Comparison of the answers with the exact test at one distance, for the poses at which the root
/// boxes intersect.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Difference {
    /// Poses at which the root boxes intersect.
    pub tests: usize,
    /// False hits and misses.
    pub differ: usize,
    /// Searches ended by the budget. Their likelier verdict counts in `differ`.
    pub unfinished: usize,
    /// Undecided for other reasons; neither a difference nor an agreement.
    pub undecided: usize,
}

impl Difference {
    /// Differences in percent of the tests; zero without tests.
    #[must_use]
    pub fn percent(&self) -> f64 {
        100.0 * count(self.differ) / count(self.tests.max(1))
    }
}

/// Results of one method over the distances of the sweep.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Course {
    /// Times of single queries.
    pub times: [Sample; DISTANCES],
    /// Comparison with the exact test; empty without a mesh.
    pub differences: [Difference; DISTANCES],
}

/// Poses with known facts about them.
#[derive(Debug, Clone)]
pub struct Questions {
    poses: [Vec<Pose>; DISTANCES],
    /// `true` where the meshes intersect.
    exact: Option<[Vec<bool>; DISTANCES]>,
    /// `true` where the root boxes intersect.
    close: [Vec<bool>; DISTANCES],
}

impl Questions {
    /// Prepares the poses; `exact` tests the meshes in all of them.
    #[must_use]
    pub fn new(poses: [Vec<Pose>; DISTANCES], scan: &Scan, exact: Option<&mut dyn Method>) -> Self {
        let close = poses.each_ref().map(|poses| poses.iter().map(|pose| roots_meet(scan, pose)).collect());
        let exact = exact.map(|mesh| {
            let mut ask =
                |poses: &Vec<Pose>| poses.iter().map(|p| mesh.ask(&Pose::IDENTITY, p).hit).collect();
            poses.each_ref().map(&mut ask)
        });
        Self { poses, exact, close }
    }
}

/// Returns `true` if the root boxes overlap with the second copy of the scan at `pose`. Objects
/// scaled for the sweep are stored in their own frame.
fn roots_meet(scan: &Scan, pose: &Pose) -> bool {
    let root = &scan.tree().bounds(NodeId::ROOT);
    let relative = Relative::new(pose, f64::from(root.radius()));
    relative.gap(root, root) <= relative.slack()
}

impl Difference {
    /// Counts an answer; `exact` is the truth about the polygons.
    fn count(&mut self, verdict: &Verdict, exact: bool) {
        self.tests += 1;
        let hit = match verdict {
            Verdict::Undecided(Reason::Budget { likelihood }) => {
                self.unfinished += 1;
                *likelihood >= 0.5
            }
            Verdict::Undecided(_) => {
                self.undecided += 1;
                return;
            }
            _ => verdict.is_intersecting(),
        };
        self.differ += usize::from(hit != exact);
    }

    fn add(&mut self, other: &Self) {
        self.tests += other.tests;
        self.differ += other.differ;
        self.unfinished += other.unfinished;
        self.undecided += other.undecided;
    }
}

impl Course {
    /// Runs all queries `passes` times, distance by distance. The least time of a query counts,
    /// which reduces the effect of other load. The verdicts of the first pass are compared.
    ///
    /// Thousands of other queries run between two runs of the same one.
    pub fn run(questions: &Questions, passes: usize, mut ask: impl FnMut(&Pose) -> Answer) -> Self {
        let mut course = Self::default();
        let mut least = questions.poses.each_ref().map(|poses| vec![f64::INFINITY; poses.len()]);
        for pass in 0..passes {
            for (i, poses) in questions.poses.iter().enumerate() {
                for pose in poses.iter().take(WARM_UP) {
                    black_box(ask(pose));
                }
                for (k, pose) in poses.iter().enumerate() {
                    let (answer, time) = timed(|| black_box(ask(black_box(pose))));
                    least[i][k] = least[i][k].min(nanoseconds(time));
                    let exact = questions.exact.as_ref().filter(|_| pass == 0 && questions.close[i][k]);
                    if let Some(exact) = exact {
                        course.differences[i].count(&answer.verdict, exact[i][k]);
                    }
                }
            }
        }
        for (sample, times) in course.times.iter_mut().zip(least) {
            times.into_iter().for_each(|time| sample.push(time));
        }
        course
    }

    /// Pairs of distance and mean time in microseconds.
    #[must_use]
    pub fn mean_times(&self) -> Vec<[f64; 2]> {
        (0..DISTANCES).map(|i| [distance(i), self.times[i].summary().mean / 1e3]).collect()
    }

    /// Pairs of distance and median time in microseconds.
    #[must_use]
    pub fn median_times(&self) -> Vec<[f64; 2]> {
        (0..DISTANCES).map(|i| [distance(i), self.times[i].summary().median / 1e3]).collect()
    }

    /// Pairs of distance and differences in percent, for the distances with tests.
    #[must_use]
    pub fn percents(&self) -> Vec<[f64; 2]> {
        let tested = (0..DISTANCES).filter(|&i| self.differences[i].tests > 0);
        tested.map(|i| [distance(i), self.differences[i].percent()]).collect()
    }

    /// The average of the mean times over all distances, in microseconds.
    #[must_use]
    pub fn sweep_mean(&self) -> f64 {
        self.mean_times().iter().map(|p| p[1]).sum::<f64>() / count(DISTANCES)
    }

    /// All tests at distances of 0.6 to 2 together, as the paper averages them.
    #[must_use]
    pub fn averaged(&self) -> Difference {
        let within = (0..DISTANCES).filter(|&i| AVERAGED.contains(&distance(i)));
        within.fold(Difference::default(), |mut sum, i| {
            sum.add(&self.differences[i]);
            sum
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::object::Object;
    use crate::poses::sweep;
    use crate::rivals::parry::MeshTree;
    use nearmiss::{Budget, BuildOptions, CollideOptions, CollidePlan, Pair, Scratch};

    #[test]
    fn boxes_that_hold_a_corner_of_each_other_meet() {
        let object = Object::read("dragon-5k").unwrap().scaled().unwrap();
        let scan = Scan::build(&object.cloud, &BuildOptions::default()).unwrap();
        let root = scan.tree().bounds(NodeId::ROOT);
        let [centre, half] = [root.centre, root.half].map(|v| v.map(f64::from));
        let axes = root.axes.map(|axis| axis.map(f64::from));
        let corner = |bits: u32| {
            let side = [0, 1, 2].map(|k| if bits >> k & 1 == 0 { half[k] } else { -half[k] });
            [0, 1, 2].map(|c| centre[c] + (0..3).map(|k| side[k] * axes[k][c]).sum::<f64>())
        };
        let is_inside = |p: [f64; 3]| {
            (0..3).all(|k| (0..3).map(|c| axes[k][c] * (p[c] - centre[c])).sum::<f64>().abs() <= half[k])
        };
        let (mut held, mut far) = (0, 0);
        for pose in sweep(200, 3, 0).iter().flatten() {
            let meet = roots_meet(&scan, pose);
            let back = pose.inverse();
            if (0..8).any(|i| is_inside(pose.apply(corner(i))) || is_inside(back.apply(corner(i)))) {
                held += 1;
                assert!(meet, "{pose:?}");
            }
            let apart =
                pose.apply(centre).iter().zip(centre).map(|(p, q)| (p - q).powi(2)).sum::<f64>().sqrt();
            if apart > 2.0 * f64::from(root.radius()) {
                far += 1;
                assert!(!meet, "{pose:?}");
            }
        }
        assert!(held > 1000 && far > 100, "{held} hold a corner, {far} are far apart");
    }

    #[test]
    fn an_exact_answer_does_not_differ_and_its_contrary_always() {
        let object = Object::read("dragon-5k").unwrap().scaled().unwrap();
        let scan = Scan::build(&object.cloud, &BuildOptions::default()).unwrap();
        let mut mesh = MeshTree::new(object.mesh.as_ref().unwrap());
        let poses = sweep(30, 1, 0);
        let questions = Questions::new(poses, &scan, Some(&mut mesh));
        let exact = questions.exact.as_ref().unwrap();
        // Intersecting meshes have intersecting root boxes; the reverse does not hold.
        let pairs = || exact.iter().flatten().zip(questions.close.iter().flatten());
        assert!(pairs().all(|(&hit, &close)| close || !hit), "a hit with boxes apart");
        assert!(pairs().any(|(&hit, &close)| close && !hit), "boxes meet, meshes do not");

        let plan = CollidePlan::new(&CollideOptions::estimated(), &scan, &scan).unwrap();
        let a = scan.at(&Pose::IDENTITY);
        let course = Course::run(&questions, 2, |pose| {
            Pair::new(a, scan.at(pose)).collide(&plan, &mut Scratch::default())
        });
        let Difference { tests, differ, undecided, unfinished } = course.averaged();
        assert!(tests > 80 && differ * 10 < tests && undecided * 10 < tests && unfinished == 0, "{course:?}");
        let none = Budget::UNLIMITED.with_work(0);
        let guessed = Course::run(&questions, 1, |pose| {
            Pair::new(a, scan.at(pose)).within(&none).collide(&plan, &mut Scratch::default())
        })
        .averaged();
        assert!(guessed.tests == tests && guessed.unfinished > tests / 2, "{guessed:?}");
        let times: usize = course.times.iter().map(Sample::len).sum();
        assert_eq!(times, 30 * DISTANCES);
    }
}
